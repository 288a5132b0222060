"""How each effect is concealed in a trial of the plant: by its physical cause, not by the formula that is to find it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import cos, pi, sin
from typing import Any

import numpy as np

from ferryid.prove.case import Truth
from ferryid.prove.known import damping
from ferryid.prove.plant.vessels import Vessel

Knobs = dict[str, Any]


@dataclass(frozen=True)
class Concealed:
    """What stands in the plant's conditions, what the profile's coefficients are multiplied by, and what ought to be named."""

    conditions: Knobs
    truths: tuple[Truth, ...]
    factors: Mapping[str, float]


@dataclass(frozen=True)
class Hiding:
    """How an effect is concealed.

    Attributes
    ----------
    unit
        Of its size.
    least, most
        Sizes from invisible to gross, on the 6 m ferry.
    moderate
        A size that a user would want to know of.
    draw
        Makes it of a size, for a vessel, by a random generator, in a span of time [s] or None where it has none.
    spans
        True where it may begin and end.
    fits
        Whether a vessel can have it.
    """

    unit: str
    least: float
    most: float
    moderate: float
    draw: Callable[[float, Vessel, np.random.Generator, Span], Concealed]
    spans: bool = False
    fits: Callable[[Vessel], bool] = lambda vessel: True


Span = tuple[float | None, float | None]


def made(
    effect: str,
    values: Mapping[str, float],
    conditions: Knobs,
    *,
    instance: str | None = None,
    span: Span = (None, None),
    factors: Mapping[str, float] | None = None,
) -> Concealed:
    """Return one concealed effect."""
    return Concealed(conditions, (Truth(effect, instance, dict(values), *span),), factors or {})


def _plane(size: float, rng: np.random.Generator) -> tuple[float, float]:
    angle = rng.uniform(0.0, 2.0 * pi)
    return size * cos(angle), size * sin(angle)


def _sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _ends(span: Span) -> tuple[float, float]:
    return (span[0] or 0.0, 1e9 if span[1] is None else span[1])


def _turning(vessel: Vessel) -> list[str]:
    return [one.name for one in vessel.thrusters if one.angle_deg is None]


def wind(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Concealed:
    """Return a wind of a speed [m/s]."""
    north, east = _plane(size, rng)
    return made("wind", {"north": north, "east": east}, {"wind": (north, east)})


def gusts(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Concealed:
    """Return gusts [m/s] about a wind of twice to four times as much.

    Theirs is Kaimal's spectrum, that of the effect a Gauss-Markov process's: the two have no time constant in common.
    """
    time_s = float(rng.uniform(4.0, 12.0))
    north, east = _plane(size * rng.uniform(2.0, 4.0), rng)
    truths = (
        Truth("gusts", None, {"std": size}),
        Truth("wind", None, {"north": north, "east": east}),
    )
    return Concealed({"wind": (north, east), "gust_std": size, "gust_time": time_s}, truths, {})


def current(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Concealed:
    """Return a current of a speed [m/s]."""
    north, east = _plane(size, rng)
    return made("current", {"north": north, "east": east}, {"current": (north, east)})


def waves(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Concealed:
    """Return a sea of a significant height [m]; how it pushes the vessel is known after the trial."""
    period = float(rng.uniform(0.9, 1.4)) * np.sqrt(vessel.length)
    knobs = {"wave_height": size, "wave_period": float(period), "wave_direction": float(rng.uniform(0.0, 360.0))}
    return made("waves", {}, knobs)


def payload(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Concealed:
    """Return a load, as a share of the vessel's mass."""
    mass, x = size * vessel.mass, float(rng.uniform(-0.3, 0.3)) * vessel.length
    conditions = {"payload": (mass, x, 0.5), "payload_span": _ends(span)}
    return made("payload", {"mass": mass, "x": x}, conditions, span=span)


def fouling(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Concealed:
    """Return a fouled hull: more drag ahead, as a share, and a third of that across."""
    factors = (1.0 + size, 1.0 + size / 3.0, 1.0 + size / 3.0)
    return made("fouling", dict(zip(("surge", "sway", "yaw"), factors, strict=True)), {"fouling": factors})


def thruster_gain(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Concealed:
    """Return a thruster that lost a share of its force."""
    name = str(rng.choice([one.name for one in vessel.thrusters]))
    conditions = {"gain": {name: 1.0 - size}, "gain_span": _ends(span)}
    return made("thruster_gain", {"factor": 1.0 - size}, conditions, instance=name, span=span)


def azimuth_offset(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Concealed:
    """Return a thruster that points elsewhere than it says [deg]."""
    name, angle = str(rng.choice(_turning(vessel))), size * _sign(rng)
    return made("azimuth_offset", {"angle": angle}, {"azimuth_offset_deg": {name: angle}}, instance=name)


def azimuth_resolution(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Concealed:
    """Return encoders of a step [deg]."""
    return made("azimuth_resolution", {"step": size}, {"azimuth_step_deg": size})


def thruster_lag(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Concealed:
    """Return a force that comes late [s]."""
    return made("thruster_lag", {"time_constant": size}, {"lag_s": size})


def thrust_inflow_loss(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Concealed:
    """Return a loss to inflow, as a share per m/s at 60 % of full speed; what it comes to is known after the trial."""
    return made("thrust_inflow_loss", {}, {"inflow": size})


def thruster_interaction(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Concealed:
    """Return a loss in the race of another thruster, as a share."""
    return made("thruster_interaction", {"fraction": size}, {"interaction": size})


def mooring(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Concealed:
    """Return a line, as stiff as swings the vessel at 0.06 rad/s times the root of the size."""
    stiffness = [size * 0.0036 * vessel.mass * float(rng.uniform(0.6, 1.6)) for _ in range(2)]
    place = _plane(vessel.leg_m * rng.uniform(0.2, 0.8), rng)
    names = ("stiffness_north", "stiffness_east", "north", "east")
    conditions = {"mooring": (*stiffness, *place), "mooring_span": _ends(span)}
    return made("mooring", dict(zip(names, (*stiffness, *place), strict=True)), conditions, span=span)


def shallow_water(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Concealed:
    """Return a bank on one side, over which damping grows by a share."""
    far, edge = 4.0 * vessel.leg_m, float(rng.uniform(-0.3, 0.3)) * vessel.leg_m
    side = [(edge, far, -far, far), (-far, edge, -far, far), (-far, far, edge, far), (-far, far, -far, edge)]
    bank = side[int(rng.integers(4))]
    return made("shallow_water", {"factor": 1.0 + size}, {"shallow": 1.0 + size, "shallow_m": bank})


def time_delay(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Concealed:
    """Return a navigation that is late [s]."""
    return made("time_delay", {"seconds": size}, {"delay_s": size})


def lever_arm(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Concealed:
    """Return a navigation whose point of reference is elsewhere [m]."""
    x, y = _plane(size, rng)
    return made("lever_arm", {"x": x, "y": y}, {"lever_m": (x, y)})


def heading_bias(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Concealed:
    """Return a heading that is off [deg]."""
    angle = size * _sign(rng)
    return made("heading_bias", {"angle": angle}, {"heading_bias_deg": angle})


def yaw_rate_scale(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Concealed:
    """Return a gyro whose scale is off by a share."""
    factor = 1.0 + size * _sign(rng)
    return made("yaw_rate_scale", {"factor": factor}, {"yaw_rate_factor": factor})


def hull_parameters(size: float, vessel: Vessel, rng: np.random.Generator, span: Span) -> Concealed:
    """Return a profile that has two of the coefficients that matter wrong: the true ones are larger or smaller by a share."""
    known = damping(vessel)
    names = [*("m11", "m22", "m33", "X_|u|u", "Y_|v|v", "N_|r|r", "N_|v|r"), "N_r" if "N_r" in known else "X_u"]
    chosen = [names[k] for k in rng.choice(len(names), 2, replace=False)]
    true = {name: float((1.0 + size) ** _sign(rng)) for name in chosen}
    return made("hull_parameters", true, {}, factors={name: 1.0 / factor for name, factor in true.items()})


def _can_turn(vessel: Vessel) -> bool:
    return bool(_turning(vessel))


HIDINGS: Mapping[str, Hiding] = {
    "wind": Hiding("m/s", 0.1, 8.0, 3.5, wind),
    "gusts": Hiding("m/s", 0.1, 2.5, 1.0, gusts),
    "current": Hiding("m/s", 0.0005, 0.4, 0.15, current),
    "waves": Hiding("m", 0.0005, 0.12, 0.05, waves),
    "payload": Hiding("share of the mass", 0.01, 0.4, 0.15, payload, spans=True),
    "fouling": Hiding("share of the drag", 0.05, 2.5, 1.0, fouling),
    "thruster_gain": Hiding("share of the force", 0.005, 0.5, 0.2, thruster_gain, spans=True),
    "azimuth_offset": Hiding("deg", 0.1, 15.0, 6.0, azimuth_offset, fits=_can_turn),
    "azimuth_resolution": Hiding("deg", 0.3, 20.0, 8.0, azimuth_resolution, fits=_can_turn),
    "thruster_lag": Hiding("s", 0.02, 1.5, 0.6, thruster_lag),
    "thrust_inflow_loss": Hiding("s/m", 0.01, 0.6, 0.25, thrust_inflow_loss),
    "thruster_interaction": Hiding("share of the force", 0.02, 0.6, 0.3, thruster_interaction, fits=_can_turn),
    "mooring": Hiding("(0.06 rad/s)²", 0.002, 3.0, 1.0, mooring, spans=True),
    "shallow_water": Hiding("share of the damping", 0.02, 2.0, 0.8, shallow_water),
    "time_delay": Hiding("s", 0.01, 1.0, 0.3, time_delay),
    "lever_arm": Hiding("m", 0.01, 1.5, 0.6, lever_arm),
    "heading_bias": Hiding("deg", 0.1, 12.0, 4.0, heading_bias),
    "yaw_rate_scale": Hiding("share", 0.003, 0.25, 0.08, yaw_rate_scale),
    "hull_parameters": Hiding("share of a coefficient", 0.1, 1.5, 0.8, hull_parameters),
}
"""By effect id: every name of the contract but ``unknown``."""
