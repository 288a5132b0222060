"""Wind and current measured: bases of the thesis and of the paper, and what a measured wind is worth to the controller."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ferryid.identify import force_mse
from ferryid.identify.adaptive import data_matrix
from ferryid.regression import Rows, factorise, fit_simpls
from ferryid.regression.bases import relative_flow
from ferryid.reproduce.flight import Flight, controlled, fly, trial, weather_seed
from ferryid.reproduce.lab import Lab
from ferryid.reproduce.learning import BASE, THESIS, hull_alone, learn, without_anemometer, without_wind_areas
from ferryid.reproduce.study import Row, Study, Table, changes, median, number, percent, spread
from ferryid.signals.track import Motion
from ferryid.simulate.scenario import Scenario
from ferryid.simulate.sections import Current
from ferryid.types import AXES, Floats
from ferryid.vessel.profile import Profile

PLACE = 60
UNITS = ("N", "N", "N·m")
WIND_BASES = (("not measured", "thesis"), ("thesis (3.6)", "thesis+wind-thesis"), ("paper (18)", "thesis+wind-paper"))
CURRENT_BASES = (
    ("not measured", "thesis"),
    ("thesis (3.7)", "thesis+current-thesis"),
    ("paper (19)", "thesis+current-paper"),
)
THIRD: Mapping[str, Callable[[Floats], Floats]] = {
    "paper (18), γ sin γ": lambda gamma: gamma * np.sin(gamma),
    "the same, γ from 0 to 2π": lambda gamma: np.mod(gamma, 2.0 * np.pi) * np.sin(gamma),
    "abs(γ) sin γ": lambda gamma: np.abs(gamma) * np.sin(gamma),
    "thesis (3.6), sin 2γ": lambda gamma: np.sin(2.0 * gamma),
}
"""Third functions of the wind, all times V²; only the yaw moment needs them."""
CONTROLLERS = (
    "not measured",
    "measured, Blendermann's areas known",
    "measured, basis of the thesis",
    "measured, basis of the paper",
)
ALIKE = 0.9
"""Of two errors, the lower counts as lower below this ratio."""
MOST = 30
"""More components than any basis has functions: nothing is held back where bases are compared."""


@dataclass(frozen=True)
class Outcome:
    """One seed: test MSE over the base model's, per basis of wind, then of current, shape (3, 3) each.

    `third` is the yaw MSE by third function of the wind; `ise`, `energy` and `feedback` belong to a round per controller.
    """

    wind: Floats
    current: Floats
    third: Floats
    ise: Floats
    energy: Floats
    feedback: Floats


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
    tables += (
        Table(
            "Yaw moment of the wind, test MSE over the base model's, by third function (V² times it).",
            ("third function", "yaw"),
            tuple((label, spread([one.third[k] for one in outcomes])) for k, label in enumerate(THIRD)),
        ),
        Table(
            "Round 3 in the wind of Experiment 1, flown with a model of rounds 1 and 2; median (least to greatest).",
            (
                "wind",
                "ISE [m² s]",
                "EC [kJ]",
                *(f"feedback, {axis} rms [{unit}]" for axis, unit in zip(AXES, UNITS, strict=True)),
            ),
            tuple(
                (
                    label,
                    spread([one.ise[k] for one in outcomes]),
                    spread([one.energy[k] / 1e3 for one in outcomes]),
                    *(spread([float(np.sqrt(one.feedback[k, j])) for one in outcomes]) for j in range(3)),
                )
                for k, label in enumerate(CONTROLLERS)
            ),
        ),
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
    rows += (
        Row(
            "ISE of a round with measured wind (basis of the thesis) in the feedforward against unmeasured",
            "%",
            "improves",
            changes([one.ise[2] for one in outcomes], [one.ise[0] for one in outcomes]),
        ),
        *(
            Row(
                f"feedback power of the same, {axis}",
                "%",
                "improves",
                changes([one.feedback[2, j] for one in outcomes], [one.feedback[0, j] for one in outcomes]),
            )
            for j, axis in enumerate(AXES)
        ),
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
            "Then rounds 1 and 2 of Experiment 1 are flown with a vane of 10 Hz, and round 3 with each of four feedforwards: "
            "of a model that knows no wind; of one whose base model has the areas of the simulated vessel, and of two that "
            "have fitted the wind by either basis instead, these three with the measured wind.",
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
        _third([_only_wind(f) for f in blown], blown[0].profile),
        *_closed_loop(folder, seed, windy),
    )


def _closed_loop(folder: Path, seed: int, windy: Scenario) -> tuple[Floats, Floats, Floats]:
    """Return ISE, energy and feedback power of round 3 by controller."""
    rounds = [_flown(folder, f"round-{k}", windy, seed, k) for k in (1, 2)]
    profile, bare = rounds[0].profile, without_wind_areas(rounds[0].profile)
    seen = [_only_wind(f) for f in rounds]
    models = (
        learn([without_anemometer(m) for m in seen], bare),
        learn(seen, profile),
        learn(seen, bare, replace(THESIS, basis="thesis+wind-thesis", components=MOST)),
        learn(seen, bare, replace(THESIS, basis="thesis+wind-paper", components=MOST)),
    )
    vane = replace(windy, sensors=replace(windy.sensors, wind_rate_hz=10.0))
    flown = [
        fly(folder, f"with-{k}", vane if k else windy, weather_seed(seed, 3), m).performance
        for k, m in enumerate(models)
    ]
    return (
        np.array([one.ISE for one in flown]),
        np.array([one.EC for one in flown]),
        np.array([one.feedback_power for one in flown]),
    )


def measured_wind(motion: Motion) -> Floats:
    """Return the wind over ground of a log that holds it, shape (n, 2)."""
    assert motion.wind is not None  # every log here is flown with a vane
    return motion.wind


def _third(motions: list[Motion], profile: Profile) -> Floats:
    """Return the yaw MSE by third function of the wind, all else the basis of the paper, ordinary least squares."""
    bare = without_wind_areas(profile)
    base = hull_alone(bare, BASE)
    settings = replace(THESIS, basis="thesis+wind-paper")
    functions = data_matrix(bare, motions[:1], settings).functions
    place = functions.terms.index("V_rw^2 sin(gamma_rw)gamma_rw")
    errors = []
    for third in THIRD.values():
        parts, left = [], []
        for motion in motions:
            values = functions.of(motion)
            wind_rel = relative_flow(motion.nu, motion.eta[:, 2], measured_wind(motion))
            gamma = -np.arctan2(wind_rel[:, 1], wind_rel[:, 0])
            values[:, place] = np.sum(wind_rel**2, axis=1) * third(gamma)
            residual = (motion.tau - base.of(without_anemometer(motion)))[:, 2]
            known = motion.valid & np.isfinite(values).all(axis=1) & np.isfinite(residual)
            parts.append(np.column_stack([values[known], np.ones(known.sum())]))
            left.append(residual[known])
        theta = np.linalg.lstsq(np.vstack(parts[:2]), np.concatenate(left[:2]), rcond=None)[0]
        misfit = [np.mean((y - X @ theta) ** 2) for X, y in zip(parts[2:], left[2:], strict=True)]
        errors.append(sum(misfit) / sum(np.mean(y**2) for y in left[2:]))
    return np.array(errors)


def _only_wind(flight: Flight) -> Motion:
    return replace(flight.motion(THESIS.window_s), current=None)


def _only_current(flight: Flight) -> Motion:
    return replace(flight.motion(THESIS.window_s), wind=None)


def _error(motions: list[Motion], profile: Profile, name: str) -> Floats:
    """Return the MSE of a model of the first two logs on the last two, over the base model's."""
    bare = without_wind_areas(profile)
    settings = replace(THESIS, basis=name)
    still = [without_anemometer(motion) for motion in motions]
    seen = still if name == "thesis" else motions
    X = data_matrix(bare, seen[:2], settings)
    Y = data_matrix(bare, still[:2], THESIS)
    fitted = fit_simpls(factorise(Rows.of(X.X, Y.Y)), MOST)
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
                f"{', '.join(f'{percent(value)} %' for value in values)} with the basis of the {whose}"
                for whose, values in zip(("thesis", "paper"), gain, strict=True)
            )
            + " (surge, sway, yaw)."
        )
        closer = [
            "thesis" if table[1, j] < ALIKE * table[2, j] else "paper" if table[2, j] < ALIKE * table[1, j] else ""
            for j in range(3)
        ]
        told.append(
            f"Between the two {what} bases: "
            + ", ".join(
                f"{axis} {f'the {whose} one is better' if whose else 'less than a tenth between them'}"
                for axis, whose in zip(AXES, closer, strict=True)
            )
            + "."
        )
    third = [number(median([one.third[k] for one in outcomes])) for k in range(len(THIRD))]
    told.append(
        "Why the paper's third function does nothing for yaw: a hull alike on both sides takes the opposite moment from a "
        "wind of the opposite angle, and γ sin γ is the same for γ and −γ. With γ counted from 0 to 2π it is no better: its "
        "odd part is then π sin γ, which the second function is already. Regression on the same logs bears this out: "
        f"{third[0]} and {third[1]} times the base model's yaw MSE, against {third[2]} with the odd |γ| sin γ and "
        f"{third[3]} with sin 2γ. In Blendermann's moment the factor is in fact |γ|, where (2.18c) prints γ."
    )
    for k in range(1, len(CONTROLLERS)):
        ise = changes([one.ise[k] for one in outcomes], [one.ise[0] for one in outcomes])
        power = [
            median(changes([one.feedback[k, j] for one in outcomes], [one.feedback[0, j] for one in outcomes]))
            for j in range(3)
        ]
        told.append(
            f"In the loop, wind {CONTROLLERS[k]}: ISE {spread(ise, '%', signed=True)} against unmeasured, feedback power "
            + ", ".join(f"{percent(value)} % in {axis}" for value, axis in zip(power, AXES, strict=True))
            + "."
        )
    return told
