"""The usual trial of a vessel: a scenario of its scale, and what is simulated, with a generic hull where none is known."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isfinite

import numpy as np

from ferryid.effects.force_model import COEFFICIENTS
from ferryid.effects.hull_spread import default_hull_spread
from ferryid.errors import FerryIdError
from ferryid.simulate import Scenario, parse_scenario
from ferryid.simulate.control.allocation import pushes_every_way
from ferryid.simulate.plant.thrust import curves_of, largest_force, speed_for
from ferryid.simulate.sections import Gains, Noise, ReferenceTuning, Thrusters
from ferryid.vessel.dimensions import dimensions, froude_seconds
from ferryid.vessel.profile import Actuator, Hull, Profile
from ferryid.vessel.thrusters import thrust

CRUISING = 0.08
"""Acceleration [m/s²] that the thrust of a zigzag gives the rigid body from rest: Froude's law leaves it as it is."""
MOST_OF_FULL = 0.7
"""Share of the largest force that such a thrust takes at most."""
STRONGEST = 0.4
"""Acceleration [m/s²] of the rigid body by one actuator whose thrust curve has no end, at which it is ended."""
GENERIC = {
    "m11": 0.3,
    "m22": 1.0,
    "m33": 1.0,
    "X_u": -0.2,
    "X_|u|u": -0.5,
    "Y_v": -0.3,
    "Y_|v|v": -0.5,
    "N_r": -0.4,
    "N_|r|r": -0.5,
}
"""A generic hull: coefficients as shares of what those of a hull of this size may be at most."""
MODEL = (5.0, 1670.0, 4568.6)
"""Length [m], mass [kg] and moment of inertia [kg·m²] of the vessel that the simulator's usual gains belong to."""


@dataclass(frozen=True)
class Trial:
    """A scenario with the vessel that sails it, and what it is, as a sentence."""

    scenario: Scenario
    vessel: Profile
    says: str


def usual_trial(profile: Profile) -> Trial:
    """Return the usual trial of a vessel: twelve corners where it can push every way, a zigzag where it steers.

    Times and lengths follow Froude's law from those of milliAmpère, gains the vessel's mass and inertia. The water is calm and
    nothing is left out: responses depend on motion and noise alone.

    Raises
    ------
    FerryIdError
        For a vessel that has no actuators, or can do neither.
    """
    if not profile.actuators:
        raise FerryIdError(
            f"{profile.path}: effects are distinguished by motion and the actuators' force, found no actuator in the profile. "
            "Fix: describe them in [[actuator]] and map their signals"
        )
    vessel = sailing(profile)
    length, time = dimensions(profile)[0] / MODEL[0], froude_seconds(profile, 1.0)
    lines = ['schema = "ferryid.scenario/1"', f"vessel = {json.dumps(profile.name)}", "seed = 1"]
    corners = pushes_every_way(profile.actuators)
    if corners:
        lines += ["[path]", 'kind = "twelve-corner"', f"dwell_s = {60.0 * time!r}", f"size = {length!r}"]
        lines += controller_lines(profile, length, time)
    else:
        lines += ["[manoeuvre]", 'kind = "zigzag"', f"speed_rpm = {cruising(vessel)!r}", f"lead_s = {40.0 * time!r}"]
        lines += [f"duration_s = {720.0 * time!r}"]
    lines += equipment_lines(vessel, length, time)
    what = "the twelve-corner trial" if corners else "a 20/20 zigzag"
    generic = "a generic hull of its dimensions, as the profile has no hull model"
    hull = "the profile's hull" if profile.hull.has_model else generic
    says = f"Simulated: {what} of {profile.name} at its scale, in calm water and air, with {hull}."
    return Trial(parse_scenario("\n".join(lines) + "\n", "usual-trial"), vessel, says)


def equipment_lines(vessel: Profile, length: float, time: float) -> list[str]:
    """Return the sections of a scenario on actuators and sensors, scaled in length and time from those of milliAmpère."""
    dynamics, noise, full = Thrusters(), Noise(), max(fastest(vessel), 1e-3)
    return [
        "[thrusters]",
        f"speed_lag_s = {dynamics.speed_lag_s * time!r}",
        f"speed_rate_rpmps = {full / (1.75 * time)!r}",
        f"azimuth_lag_s = {dynamics.azimuth_lag_s * time!r}",
        f"azimuth_rate_degps = {dynamics.azimuth_rate_degps / time!r}",
        f"rudder_lag_s = {dynamics.rudder_lag_s * time!r}",
        f"rudder_rate_degps = {dynamics.rudder_rate_degps / time!r}",
        "[sensors]",
        *("imu_rate_hz = 0", "camera_rate_hz = 0", "wind_rate_hz = 5", "current_rate_hz = 5", "payload_rate_hz = 1"),
        "[sensors.noise]",
        f"speed_rpm = {1e-3 * full!r}",
        f"current_mps = {noise.current_mps * length / time!r}",
        f"payload_kg = {noise.payload_kg * vessel.hull.mass_kg / MODEL[1]!r}",
    ]


def generic_hull(profile: Profile) -> Hull:
    """Return a profile's rigid body with added mass and damping that are usual for its dimensions; see `GENERIC`."""
    most = dict(zip(COEFFICIENTS, default_hull_spread(profile, np.zeros((1, 3))).tolist(), strict=True))
    M = profile.hull.M.copy()
    for k, name in enumerate(("m11", "m22", "m33")):
        M[k, k] += GENERIC[name] * most[name]
    D = {name: share * most[name] for name, share in GENERIC.items() if not name.startswith("m")}
    return replace(profile.hull, M=M, D=D)


def sailing(profile: Profile) -> Profile:
    """Return the vessel as it can be simulated: with a hull model, and thrust curves that end."""
    hull = profile.hull if profile.hull.has_model else generic_hull(profile)
    strongest = STRONGEST * profile.hull.mass_kg
    return replace(profile, hull=hull, actuators=tuple(_ended(one, strongest) for one in profile.actuators))


def _ended(actuator: Actuator, strongest: float) -> Actuator:
    """Return an actuator whose thrust curve ends, at a force [N] where it has no end."""
    curve = actuator.thrust
    if curve is None or all(isfinite(end) for end in curve.valid):
        return actuator
    density = actuator.inflow.get("water_density", 1000.0)
    speed = 60.0
    while speed < 1e6:
        force = thrust(
            curve, np.array([speed]), diameter_m=actuator.inflow.get("diameter_m", 1.0), water_density=density
        )[0]
        if actuator.count * float(force[0]) >= strongest:
            break
        speed *= 1.1
    end = speed / (60.0 if curve.input_unit == "rps" else 1.0)
    return replace(actuator, thrust=replace(curve, valid=(max(curve.valid[0], -end), min(curve.valid[1], end))))


def fastest(vessel: Profile) -> float:
    """Return the highest speed [rpm] of all propellers; of forces that are ordered directly, a usual one [N]."""
    curves = curves_of(vessel)
    return max(
        CRUISING * vessel.hull.mass_kg if curves.direct[k] else float(curves.high[k])
        for k in range(len(vessel.actuators))
    )


def cruising(vessel: Profile) -> float:
    """Return the speed [rpm], or the force [N], that drives the vessel through a zigzag."""
    curves, count = curves_of(vessel), len(vessel.actuators)
    share = CRUISING * vessel.hull.mass_kg / count
    return max(
        speed_for(curves, k, min(share, MOST_OF_FULL * largest_force(curves, k, ahead=True))) for k in range(count)
    )


def controller_lines(
    profile: Profile,
    length: float,
    time: float,
    quick: float = 1.0,
    most: Sequence[float] | None = None,
    hardest: Sequence[float] | None = None,
) -> list[str]:
    """Return gains and reference of the controller, scaled from the simulator's.

    Parameters
    ----------
    profile
        The vessel.
    length, time
        Factors from those of milliAmpère.
    quick
        Factor on the natural frequency of the reference: how closely it follows what is asked for.
    most, hardest
        Largest speeds [m/s, m/s, rad/s] and accelerations; scaled from the simulator's where None.
    """
    gains, reference = Gains(), ReferenceTuning()
    mass, inertia = profile.hull.mass_kg / MODEL[1], profile.hull.inertia_z / MODEL[2]
    by_axis = (mass, mass, inertia)

    def scaled(values: tuple[float, float, float], factors: tuple[float, float, float]) -> str:
        return repr([value * factor for value, factor in zip(values, factors, strict=True)])

    def each(power: int) -> tuple[float, float, float]:
        return (mass * time**power, mass * time**power, inertia * time**power)

    speed, turn = length / time, 1.0 / time
    limits = scaled(reference.speed_limit, (speed, speed, turn)) if most is None else repr(list(most))
    pushes = scaled(reference.acceleration_limit, (speed / time, speed / time, turn / time))
    return [
        "[controller]",
        f"Kp = {scaled(gains.Kp, each(-2))}",
        f"Kd = {scaled(gains.Kd, each(-1))}",
        f"Ki = {scaled(gains.Ki, each(-3))}",
        f"integral_limit = {scaled(gains.integral_limit, (by_axis[0], by_axis[1], by_axis[2] / time**2))}",
        "[controller.reference]",
        f"omega_radps = {scaled(reference.omega_radps, (quick * turn, quick * turn, quick * turn))}",
        f"speed_limit = {limits}",
        f"acceleration_limit = {pushes if hardest is None else repr(list(hardest))}",
    ]
