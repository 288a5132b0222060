"""What the library cannot name, or only in part: conditions that change, and vessels that the profile does not describe."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import cos, pi, sin
from typing import Any

import numpy as np

from ferryid.vessel.profile import Actuator, Profile
from tests.reach.places import Place, stretch


@dataclass(frozen=True)
class Outside:
    """One thing outside the library.

    Attributes
    ----------
    name, title
        In results, and for people.
    tables
        Draws what stands in the scenario, from the place and a random generator; with ``"csv"`` the wind's file.
    allowed
        Names that say in part what is in the log: they are not wrong.
    names
        Effect id of the library that would be its right name: with that effect in the library it is no longer outside.
    profile
        Key of `PROFILES`.
    """

    name: str
    title: str
    tables: Callable[[Place, np.random.Generator], dict[str, Any]]
    allowed: tuple[str, ...] = ()
    names: str = ""
    profile: str = ""


def nothing(place: Place, rng: np.random.Generator) -> dict[str, Any]:
    """Return no tables."""
    return {}


def _direction(rng: np.random.Generator, low: float, high: float) -> tuple[float, float]:
    angle, length = rng.uniform(0.0, 2.0 * pi), rng.uniform(low, high)
    return round(length * cos(angle), 3), round(length * sin(angle), 3)


def turning_current(place: Place, rng: np.random.Generator) -> dict[str, Any]:
    """Return a current that turns right round."""
    north, east = _direction(rng, 0.1, 0.2)
    turn = float(rng.choice([-1.0, 1.0])) * 21600.0 / place.duration_s
    return {"environment": {"current": {"north_mps": north, "east_mps": east, "turn_degpmin": round(turn, 2)}}}


def squall(place: Place, rng: np.random.Generator) -> dict[str, Any]:
    """Return a wind that comes and goes within minutes."""
    north, east = _direction(rng, 3.0, 5.0)
    first, last = stretch(place, rng, 0.12, 0.25)
    rows = [(0.0, 0.0), (first, 0.0), (first + 15.0, 1.0), (last - 15.0, 1.0), (last, 0.0)]
    text = "time,north,east\n" + "".join(f"{t:.1f},{share * north:.3f},{share * east:.3f}\n" for t, share in rows)
    return {"environment": {"wind": {"series": "wind.csv"}}, "csv": text}


def veering_wind(place: Place, rng: np.random.Generator) -> dict[str, Any]:
    """Return a wind that turns by half a circle during the trial."""
    start, speed = rng.uniform(0.0, 2.0 * pi), rng.uniform(2.0, 4.0)
    share = np.linspace(0.0, 1.0, 25)
    angle = start + pi * share * float(rng.choice([-1.0, 1.0]))
    rows = zip(share * place.duration_s, speed * np.cos(angle), speed * np.sin(angle), strict=True)
    text = "time,north,east\n" + "".join(f"{t:.1f},{north:.3f},{east:.3f}\n" for t, north, east in rows)
    return {"environment": {"wind": {"series": "wind.csv"}}, "csv": text}


def boat_wakes(place: Place, rng: np.random.Generator) -> dict[str, Any]:
    """Return the wakes of four boats."""
    wakes = []
    for _ in range(4):
        wakes.append(
            {
                "at_s": round(float(rng.uniform(0.1, 0.9)) * place.duration_s, 1),
                "height_m": round(float(rng.uniform(0.15, 0.25)), 3),
                "period_s": round(float(rng.uniform(2.0, 2.6)), 2),
                "duration_s": 25.0,
                "direction_deg": round(float(rng.uniform(0.0, 360.0)), 1),
            }
        )
    return {"environment": {"wakes": wakes}}


def gusts(place: Place, rng: np.random.Generator) -> dict[str, Any]:
    """Return a gusty wind without a mean."""
    return {"environment": {"wind": {"gust_std_mps": round(float(rng.uniform(1.2, 2.0)), 3), "gust_time_s": 8.0}}}


def waves(place: Place, rng: np.random.Generator) -> dict[str, Any]:
    """Return the short waves of a fjord."""
    sea = {"significant_height_m": round(float(rng.uniform(0.08, 0.16)), 3), "peak_period_s": 2.4}
    return {"environment": {"waves": {**sea, "direction_deg": round(float(rng.uniform(0.0, 360.0)), 1)}}}


def shallow(place: Place, rng: np.random.Generator) -> dict[str, Any]:
    """Return water in which half of the 12-corner path is shallow."""
    factor = round(float(rng.uniform(1.5, 2.5)), 3)
    zone = {"north_m": [7.5, 60.0], "east_m": [-60.0, 60.0], "damping_factor": factor}
    return {"environment": {"shallow": zone}}


def coarse_encoders(place: Place, rng: np.random.Generator) -> dict[str, Any]:
    """Return azimuth angles in coarse steps."""
    return {"sensors": {"azimuth_step_deg": round(float(rng.uniform(5.0, 12.0)), 1)}}


def one_coefficient(place: Place, rng: np.random.Generator) -> dict[str, Any]:
    """Return one of the hull's coefficients far off."""
    names = ("m11", "m22", "m33", "X_|u|u", "Y_|r|v", "Y_|v|r", "N_|r|r", "N_|r|v", "N_r")
    present = [name for name in names if name.startswith("m") or place.profile.hull.D.get(name, 0.0) != 0.0]
    factor = float(rng.choice([0.5, 1.8]))
    return {"true_hull": {present[int(rng.integers(len(present)))]: factor}}


def measured_wind(place: Place, rng: np.random.Generator) -> dict[str, Any]:
    """Return a wind that is measured."""
    north, east = _direction(rng, 3.0, 5.0)
    wind = {"north_mps": north, "east_mps": east, "gust_std_mps": 0.4}
    return {"environment": {"wind": wind}, "sensors": {"wind_rate_hz": 5.0}}


OUTSIDE = (
    Outside("gusts", "gusts about a calm", gusts, names="gusts"),
    Outside("waves", "waves of a fjord", waves, names="waves"),
    Outside("shallow_water", "shallow water in half of the path", shallow, names="shallow_water"),
    Outside("azimuth_resolution", "azimuth encoders in coarse steps", coarse_encoders, names="azimuth_resolution"),
    Outside("hull_parameters", "one hull coefficient halved or 80 % up", one_coefficient, names="hull_parameters"),
    Outside("boat wakes", "wakes of four passing boats", boat_wakes, ("waves", "gusts")),
    Outside("turning current", "a current that turns right round", turning_current, ("current",)),
    Outside("squall", "a wind of a few minutes", squall, ("wind", "gusts")),
    Outside("veering wind", "a wind that turns by half a circle", veering_wind, ("wind", "gusts")),
    Outside(
        "no cross damping",
        "a model whose sway and yaw do not damp each other",
        nothing,
        ("hull_parameters",),
        "",
        "no cross damping",
    ),
    Outside(
        "no damping of second order",
        "a model with linear damping only",
        nothing,
        ("hull_parameters", "fouling"),
        "",
        "linear",
    ),
    Outside("thruster elsewhere", "a thruster 0.4 m from where the profile has it", nothing, (), "", "moved thruster"),
    Outside(
        "weak astern", "thrust astern 30 % less than the profile's", nothing, ("thruster_gain",), "", "strong astern"
    ),
    Outside("wind areas", "a measured wind, areas 40 % less in the profile", measured_wind, (), "", "small areas"),
)


def _without(profile: Profile, names: tuple[str, ...]) -> Profile:
    D = {name: value for name, value in profile.hull.D.items() if name not in names}
    return replace(profile, hull=replace(profile.hull, D=D))


def no_cross_damping(profile: Profile, size: Sequence[float]) -> Profile:
    """Return a profile without damping that couples sway and yaw."""
    return _without(profile, ("Y_|v|r", "Y_|r|v", "N_|r|v", "N_|v|r", "Y_|r|r", "N_|v|v"))


def linear(profile: Profile, size: Sequence[float]) -> Profile:
    """Return a profile with linear damping only."""
    return _without(profile, tuple(name for name in profile.hull.D if len(name) > 3))


def moved_thruster(profile: Profile, size: Sequence[float]) -> Profile:
    """Return a profile with its first actuator 0.4 m further forward."""
    first, *rest = profile.actuators
    x, y = first.position_m
    return replace(profile, actuators=(replace(first, position_m=(x + 0.4, y)), *rest))


def strong_astern(profile: Profile, size: Sequence[float]) -> Profile:
    """Return a profile whose propellers push harder astern than the true ones: true ones give 30 % less."""

    def stronger(actuator: Actuator) -> Actuator:
        curve = actuator.thrust
        if curve is None:
            return actuator
        speeds = np.linspace(*curve.valid, 201)
        force = sum(c * speeds ** (k + 1) for k, c in enumerate(curve.coefficients))
        force = np.where(speeds < 0.0, force / 0.7, force)
        return replace(
            actuator,
            thrust=replace(curve, kind="table", coefficients=(), table=(tuple(speeds.tolist()), tuple(force.tolist()))),
        )

    return replace(profile, actuators=tuple(stronger(actuator) for actuator in profile.actuators))


def small_areas(profile: Profile, size: Sequence[float]) -> Profile:
    """Return a profile whose wind areas are too small."""
    assert profile.wind is not None
    wind = replace(profile.wind, frontal_m2=0.6 * profile.wind.frontal_m2, lateral_m2=0.6 * profile.wind.lateral_m2)
    return replace(profile, wind=wind)


def _signal(profile: Profile, quantity: str, **changes: Any) -> Profile:
    signals = tuple(replace(one, **changes) if one.quantity == quantity else one for one in profile.signals)
    return replace(profile, signals=signals)


def other_unit(profile: Profile, size: Sequence[float]) -> Profile:
    """Return a profile that takes velocities in m/s for knots."""
    return _signal(profile, "velocity", unit="kn")


def yaw_sign(profile: Profile, size: Sequence[float]) -> Profile:
    """Return a profile that turns the sign of the yaw rate round."""
    return _signal(profile, "yaw_rate", sign=-1.0)


def position_mount(profile: Profile, size: Sequence[float]) -> Profile:
    """Return a profile that has the antenna in another place than it is, for positions only."""
    return _signal(profile, "position", mount_m=(-size[0], -size[1]))


PROFILES: Mapping[str, Callable[[Profile, Sequence[float]], Profile]] = {
    "": lambda profile, size: profile,
    "no cross damping": no_cross_damping,
    "linear": linear,
    "moved thruster": moved_thruster,
    "strong astern": strong_astern,
    "small areas": small_areas,
    "velocity unit": other_unit,
    "yaw sign": yaw_sign,
    "position mount": position_mount,
}
"""What is done to the profile before it is given to the diagnosis."""
