"""Wind and current measured: bases of the thesis and of the paper."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ferryid.identify.adapt import data_matrix
from ferryid.identify.cross_products import Rows
from ferryid.identify.judge import force_mse
from ferryid.identify.model import AXES
from ferryid.identify.qr import factorise
from ferryid.identify.simpls import simpls
from ferryid.reproduce.flight import Flight, controlled, fly, trial, weather_seed
from ferryid.reproduce.lab import Lab
from ferryid.reproduce.learning import BASE, THESIS, hull_alone, without_anemometer
from ferryid.reproduce.study import Row, Study, Table, spread
from ferryid.signals.track import Motion
from ferryid.simulate.scenario import Scenario
from ferryid.simulate.sections import Current
from ferryid.vessel.profile import Profile

Floats = NDArray[np.float64]

PLACE = 60
WIND_BASES = (("not measured", "thesis"), ("thesis (3.6)", "thesis+wind-thesis"), ("paper (18)", "thesis+wind-paper"))
CURRENT_BASES = (
    ("not measured", "thesis"),
    ("thesis (3.7)", "thesis+current-thesis"),
    ("paper (19)", "thesis+current-paper"),
)
MOST = 30
"""More components than any basis has functions: nothing is held back where bases are compared."""


@dataclass(frozen=True)
class Outcome:
    """One seed: test MSE over the base model's, per basis of wind, then of current, shape (3, 3) each."""

    wind: Floats
    current: Floats


def study(lab: Lab) -> Study:
    """Learn wind and current."""
    outcomes = lab.each_seed(_compare, "wind and current bases")
    tables = tuple(
        Table(
            f"{what}: test MSE over the base model's; median (least to greatest).",
            ("basis", *AXES),
            tuple(
                (label, *(spread([getattr(one, name)[k, j] for one in outcomes]) for j in range(3)))
                for k, (label, _) in enumerate(bases)
            ),
        )
        for what, name, bases in (
            ("Wind of 5 m/s with gusts", "wind", WIND_BASES),
            ("Current of 0.3 m/s", "current", CURRENT_BASES),
        )
    )
    rows = tuple(
        Row(
            f"force MSE with the {what} basis of the {whose} against none, {axis}",
            "%",
            "improves",
            tuple(100.0 * (getattr(one, what)[k, j] / getattr(one, what)[0, j] - 1.0) for one in outcomes),
        )
        for what in ("wind", "current")
        for k, whose in ((1, "thesis"), (2, "paper"))
        for j, axis in enumerate(AXES)
    )
    return Study(
        "flows",
        "Measured wind and current",
        "How much of what wind and current do is explained once they are measured, and by which basis?",
        (
            "Two rounds train and two, with the wind or current from another direction, test. The profile's wind "
            "areas are taken "
            "away, so that the basis alone has to explain the wind; in the current the base model's motion "
            "through the water is "
            "left out likewise. All components are used. The thesis has no such trial: it expects improvement.",
        ),
        rows,
        tables,
        tuple(_findings(outcomes)),
    )


def _flown(folder: Path, name: str, scenario: Scenario, seed: int, number_: int) -> Flight:
    sensors = replace(scenario.sensors, wind_rate_hz=10.0, current_rate_hz=10.0)
    return fly(folder, name, controlled(replace(scenario, sensors=sensors), BASE), weather_seed(seed, number_))


def _compare(folder: Path, seed: int) -> Outcome:
    windy, calm = trial("experiment-1"), trial("calm")
    turned = replace(windy, wind=replace(windy.wind, north_mps=windy.wind.east_mps, east_mps=-windy.wind.north_mps))
    back = replace(windy, wind=replace(windy.wind, north_mps=-windy.wind.north_mps, east_mps=-windy.wind.east_mps))
    streams = [
        replace(calm, current=Current(north_mps=north, east_mps=east))
        for north, east in ((0.3, 0.0), (0.0, -0.3), (-0.21, 0.21), (0.21, 0.21))
    ]
    blown = [_flown(folder, f"wind-{k}", one, seed, k) for k, one in enumerate((windy, back, turned, windy), 1)]
    drifted = [_flown(folder, f"current-{k}", one, seed, 10 + k) for k, one in enumerate(streams, 1)]
    return Outcome(
        np.array([_error([_only_wind(f) for f in blown], blown[0].profile, name) for _, name in WIND_BASES]),
        np.array([_error([_only_current(f) for f in drifted], drifted[0].profile, name) for _, name in CURRENT_BASES]),
    )


def _only_wind(flight: Flight) -> Motion:
    return replace(flight.motion(THESIS.window_s), current=None)


def _only_current(flight: Flight) -> Motion:
    return replace(flight.motion(THESIS.window_s), wind=None)


def _error(motions: list[Motion], profile: Profile, name: str) -> Floats:
    """Return the MSE of a model of the first two logs on the last two, over the base model's."""
    bare = replace(profile, wind=None)
    settings = replace(THESIS, basis=name)
    still = [without_anemometer(motion) for motion in motions]
    seen = still if name == "thesis" else motions
    X = data_matrix(bare, seen[:2], settings)
    Y = data_matrix(bare, still[:2], THESIS)
    fitted = simpls(factorise(Rows.of(X.X, Y.Y)), MOST)
    base = hull_alone(bare, BASE)
    errors, unit = np.zeros(3), np.zeros(3)
    for motion, quiet in zip(seen[2:], still[2:], strict=True):
        estimate = base.of(quiet) + X.functions.of(motion) @ fitted.coefficients[-1] + fitted.intercepts[-1]
        known = motion.valid & np.isfinite(estimate).all(axis=1)
        errors += np.mean((motion.tau - estimate)[known] ** 2, axis=0)
        unit += force_mse(base, quiet)
    return np.asarray(errors / unit)


def _findings(outcomes: list[Outcome]) -> list[str]:
    told = []
    for what, name in (("wind", "wind"), ("current", "current")):
        table = np.median([getattr(one, name) for one in outcomes], axis=0)
        gain = [100 * (table[k] / table[0] - 1) for k in (1, 2)]
        told.append(
            f"Measuring the {what} changes the force MSE by "
            + "; ".join(
                f"{', '.join(f'{value:+.0f} %' for value in values)} with the basis of the {whose}"
                for whose, values in zip(("thesis", "paper"), gain, strict=True)
            )
            + " (surge, sway, yaw)."
        )
        closer = [
            "thesis" if table[1, j] < 0.98 * table[2, j] else "paper" if table[2, j] < 0.98 * table[1, j] else ""
            for j in range(3)
        ]
        told.append(
            f"Between the two {what} bases: "
            + ", ".join(
                f"{axis} {f'the {whose} one is better' if whose else 'no difference'}"
                for axis, whose in zip(AXES, closer, strict=True)
            )
            + "."
        )
    return told
