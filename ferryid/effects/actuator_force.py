"""The force of one actuator along its own direction, and what its thrust curve and its signals imply."""

from __future__ import annotations

import math

import numpy as np

from ferryid.compiled import compiled
from ferryid.effects.force_model import ForceModel, Measurements, check_actuators
from ferryid.effects.thresholds import EFFECTS
from ferryid.types import AXES, Flags, Floats
from ferryid.vessel.hull import current_in_body
from ferryid.vessel.profile import Actuator, Profile
from ferryid.vessel.thrusters import FRESH_WATER, thrust

_NODES = 201
"""Speeds at which the largest force of a curve is looked for; a polynomial may fall again before its end."""


def along(force_model: ForceModel | Measurements, k: int) -> Floats:
    """Return the force of actuator `k` along its own direction, positive ahead [N], shape (n,)."""
    measurements = force_model if isinstance(force_model, Measurements) else force_model.measurements
    actuator, part = measurements.profile.actuators[k], force_model.parts[:, k]
    if actuator.kind == "azimuth":
        # Most models leave the angles as they were measured.
        angle, known = force_model.angles, measurements.angles is force_model.angles
        cosine, sine = measurements.directions if known else (np.cos(angle), np.sin(angle))
        return np.asarray(part[:, 0] * cosine[:, k] + part[:, 1] * sine[:, k])
    return np.asarray(part[:, 0] * math.cos(actuator.angle_rad) + part[:, 1] * math.sin(actuator.angle_rad))


def speed_along(measurements: Measurements, k: int) -> Floats:
    """Return the velocity through the water of actuator `k` along its own direction, positive ahead [m/s], shape (n,)."""
    nu, actuator = measurements.nu, measurements.profile.actuators[k]
    if measurements.current is not None:
        nu = nu - current_in_body(measurements.current, measurements.psi)
    x, y = actuator.position_m
    ahead, starboard = nu[:, 0] - nu[:, 2] * y, nu[:, 1] + nu[:, 2] * x
    if actuator.kind == "azimuth":
        cosine, sine = measurements.directions
        return np.asarray(ahead * cosine[:, k] + starboard * sine[:, k])
    return np.asarray(ahead * math.cos(actuator.angle_rad) + starboard * math.sin(actuator.angle_rad))


def scaled(force_model: ForceModel, k: int, share: Floats) -> ForceModel:
    """Return the force model with the force of actuator `k` along its own direction multiplied by a share, shape (n,).

    Of a propeller with a rudder that is the force ahead: across it is the rudder's, which lives on the vessel's own flow where
    the propeller is weak or turns astern.
    """
    actuator = force_model.measurements.profile.actuators[k]
    if actuator.kind == "propeller_rudder":
        parts = force_model.parts.copy()
        more = (share - 1.0) * parts[:, k, 0]
        parts[:, k, 0] += more
        parts[:, k, 2] -= actuator.position_m[1] * more
        return force_model.replaced(parts=parts)
    check_actuators(force_model)
    parts, share = np.ascontiguousarray(force_model.parts), np.ascontiguousarray(share)
    return force_model.replaced(parts=_with_share(parts, k, share))


@compiled
def _with_share(parts: Floats, k: int, share: Floats) -> Floats:
    out = parts.copy()
    for i in range(share.shape[0]):
        for axis in range(3):
            out[i, k, axis] *= share[i]
    return out


def lost(before: ForceModel, after: ForceModel, axis: str) -> Floats:
    """Return what the actuators lose from one force model to another on an axis [N, N·m], shape (n,)."""
    j = AXES.index(axis)
    return np.asarray((before.parts - after.parts)[:, :, j].sum(axis=1))


def curve_force(actuator: Actuator, speed_rpm: Floats) -> Floats:
    """Return the force on the hull at rest of all units of an actuator by its thrust curve [N], shape as the speeds'."""
    assert actuator.thrust is not None
    force, _ = thrust(
        actuator.thrust,
        speed_rpm,
        diameter_m=actuator.inflow.get("diameter_m", math.nan),
        water_density=actuator.inflow.get("water_density", FRESH_WATER),
    )
    return actuator.count * (1.0 - actuator.inflow.get("thrust_deduction", 0.0)) * force


def speed_limits(actuator: Actuator) -> tuple[float, float]:
    """Return the largest speeds ahead and astern that the thrust curve covers [rpm]; infinite where it states no end."""
    if actuator.thrust is None:
        return math.inf, math.inf
    factor = 60.0 if actuator.thrust.input_unit == "rps" else 1.0
    low, high = actuator.thrust.valid
    return factor * high, -factor * low


def force_limits(actuator: Actuator) -> tuple[float, float]:
    """Return the largest forces ahead and astern that the thrust curve gives at rest [N]; infinite where it states no end."""
    ahead, astern = speed_limits(actuator)
    if not (math.isfinite(ahead) and math.isfinite(astern)):
        return math.inf, math.inf
    shares = np.linspace(0.0, 1.0, _NODES)
    return (
        float(np.max(curve_force(actuator, ahead * shares), initial=0.0)),
        float(np.max(-curve_force(actuator, -astern * shares), initial=0.0)),
    )


def force_is_measured(profile: Profile, actuator: Actuator) -> bool:
    """Tell whether the profile maps a measured force or thrust of the actuator: what the actuator loses is in it already."""
    return any(one.quantity in (f"{actuator.name}.force", f"{actuator.name}.thrust") for one in profile.signals)


def acts_in(rows: Flags) -> bool:
    """Tell whether something is so for a part of a log that can show it."""
    return bool(rows.size) and float(np.mean(rows)) >= EFFECTS.acting_share


def index_of(force_model: ForceModel | Measurements, instance: str | None) -> int:
    """Return the place of an actuator among those of the profile."""
    measurements = force_model if isinstance(force_model, Measurements) else force_model.measurements
    return measurements.names.index(str(instance))


def loss_label(instance: str | None, axis: str, what: str) -> str:
    """Return the label of a force that an actuator loses, with its unit."""
    return f"{axis} {'moment' if axis == 'yaw' else 'force'} of {instance} {what} [{'N·m' if axis == 'yaw' else 'N'}]"
