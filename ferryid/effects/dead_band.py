"""Dead band: one actuator gives no force while its order is near zero, ahead and astern each up to a value of its own.

A propeller that does not turn below a speed, or whose blades do not bite yet, gives nothing there and what its thrust curve
gives above: the curve was measured at larger speeds. The force rises over a quarter of the band on either side of its end, as
no two starts are alike, and a fit has a slope there; the impulse that is lost is that of a sharp end to within a few per cent.
"""

from __future__ import annotations

from functools import partial
from math import isfinite
from typing import Any

import numpy as np

from ferryid.effects.actuator_force import (
    acts_in,
    along,
    curve_force,
    force_is_measured,
    index_of,
    loss_label,
    lost,
    scaled,
    speed_limits,
)
from ferryid.effects.effect import Effect, Parameter, Values
from ferryid.effects.force_model import ForceModel, Measurements, touches
from ferryid.effects.simulated import Simulated, entry
from ferryid.effects.thresholds import EFFECTS
from ferryid.types import Floats
from ferryid.vessel.profile import Actuator, Profile

RISE = 0.25
"""Share of the band below and above its end over which the force rises."""
SIZE, LARGEST = 0.15, 0.5
"""Usual and largest band, in shares of the largest speed of the thrust curve."""
NODES = 201
"""Speeds at which a thrust curve is tabulated to be inverted."""
DIRECT_MPS2, DIRECT_LARGEST_MPS2 = 0.02, 0.5
"""The same of an actuator that is ordered a force, by the acceleration that it gives the rigid body [m/s²]."""


def parameters_of(profile: Profile) -> tuple[Parameter, ...]:
    """Return the ends of the band ahead and astern, in the unit of the order; the scales are those of all actuators."""
    unit, names = unit_of(profile), instances(profile)
    every = [speed_limits(one) for one in profile.actuators if one.name in names]
    made = []
    for side, name in enumerate(("ahead", "astern")):
        end = max([limits[side] for limits in every], default=1.0) or 1.0
        size, most = SIZE * end, LARGEST * end
        if unit == "N":
            size, most = DIRECT_MPS2 * profile.hull.mass_kg, DIRECT_LARGEST_MPS2 * profile.hull.mass_kg
        made.append(Parameter(name, unit, size, 0.0, most, start=size))
    return tuple(made)


def unit_of(profile: Profile) -> str:
    """Return the unit of the orders: N where every actuator is ordered a force, else rpm, and of those that turn only."""
    return "N" if all(one.kind == "force" for one in profile.actuators) else "rpm"


def instances(profile: Profile) -> tuple[str | None, ...]:
    """Return the actuators whose force follows from an order or a speed by a curve that does not depend on the flow."""
    return tuple(
        one.name for one in profile.actuators if not force_is_measured(profile, one) and _able(one, unit_of(profile))
    )


def _able(actuator: Actuator, unit: str) -> bool:
    if unit == "N":
        return actuator.kind == "force"
    curve = actuator.thrust
    return (
        actuator.kind != "force"
        and curve is not None
        and curve.kind != "open_water"
        and all(isfinite(end) for end in speed_limits(actuator))
    )


@touches("parts", "angles")
def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Take the force off within the band."""
    k = index_of(force_model, instance)
    push = along(force_model, k)
    order = _order(force_model.measurements.profile.actuators[k], push)
    return scaled(force_model, k, _share(order, np.where(push < 0.0, p[1], p[0])))


def _share(order: Floats, end: Floats) -> Floats:
    """Return the share of the force that is left at an order without its sign, shape (n,): none below a band, all above."""
    within = np.clip((order - (1.0 - RISE) * end) / np.maximum(2.0 * RISE * end, 1e-9), 0.0, 1.0)
    return np.where(end > 0.0, within, 1.0)


def _order(actuator: Actuator, push: Floats) -> Floats:
    """Return the order without its sign at which an actuator gives a force by its curve, shape (n,)."""
    if actuator.kind == "force":
        return np.abs(push)
    ahead, astern = (
        (speeds, np.maximum.accumulate(np.abs(curve_force(actuator, sign * speeds))))
        for sign, end in zip((1.0, -1.0), speed_limits(actuator), strict=True)
        for speeds in [np.linspace(0.0, end, NODES)]
    )
    size = np.abs(push)
    return np.where(push < 0.0, np.interp(size, astern[1], astern[0]), np.interp(size, ahead[1], ahead[0]))


def cannot(measurements: Measurements) -> str:
    """Return why the measurements cannot show it of any actuator."""
    return (
        ""
        if instances(measurements.profile)
        else "no actuator has a thrust curve over speed alone whose limits are stated (valid)"
    )


def cannot_be_of(measurements: Measurements, instance: str | None) -> str:
    """Return why the log cannot show it of one actuator: it needs forces within a usual band and beyond."""
    k = index_of(measurements, instance)
    actuator = measurements.profile.actuators[k]
    push = along(measurements, k)[measurements.usable]
    order = _order(actuator, push)
    for sign, one in zip((1.0, -1.0), parameters_of(measurements.profile), strict=True):
        turns = sign * push > 0.0
        # Bands of twice the usual size are looked for.
        if acts_in(turns & (order > 2.0 * one.size)) and acts_in(turns & (order < 2.0 * one.size)):
            return ""
    return "no actuator ran both near zero and well above it"


def unreported(measurements: Measurements, p: Floats) -> frozenset[str]:
    """Return the sides without a band."""
    every = parameters_of(measurements.profile)
    none = {one.name for one, value in zip(every, p.tolist(), strict=True) if value < 1e-3 * one.size}
    return frozenset(none) if len(none) < len(every) else frozenset()


def says(values: Values, instance: str | None) -> str:
    """Return the finding as a sentence."""
    sides = " and ".join(f"{values[side]:.3g} {side}" for side in ("ahead", "astern") if side in values)
    return f"{instance} gives no force until its order exceeds {sides}."


def thrust(p: Any, speed: float, force: float) -> float:
    """Return the simulated force of the actuator at a speed."""
    band = p[0] if speed >= 0.0 else p[1]
    if band <= 0.0:
        return force
    return float(force * min(max((abs(speed) / band - 1.0 + RISE) / (2.0 * RISE), 0.0), 1.0))


def regressor(force_model: ForceModel, p: Floats, instance: str | None, axis: str) -> tuple[str, Floats]:
    """Return the force within the band."""
    return loss_label(instance, axis, "within its dead band"), lost(force_model, apply(force_model, p, instance), axis)


EFFECT = Effect(
    "dead_band",
    "Dead band",
    parameters_of,
    apply,
    says,
    partial(entry, "dead_band"),
    instances=instances,
    cannot=cannot,
    cannot_be_of=cannot_be_of,
    of_thrust_curve=True,
    vessel=True,
    piecewise=True,
    unreported=unreported,
    in_part=True,
    regressor=regressor,
    formula_error=EFFECTS.load_error,
    simulated=Simulated(thrust=thrust),
    by_row=True,
)
