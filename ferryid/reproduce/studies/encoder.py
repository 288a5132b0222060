"""Section 4.8: azimuth angles read as integers against floats."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ferryid.identify import force_mse
from ferryid.reproduce.flight import controlled, fly, trial, weather_seed
from ferryid.reproduce.lab import Lab
from ferryid.reproduce.learning import BASE, THESIS, hull_alone, learn
from ferryid.reproduce.pictures import against
from ferryid.reproduce.study import Row, Study, Table, changes, median, number, percent, spread
from ferryid.simulate.scenario import Scenario
from ferryid.types import AXES, Floats

PLACE = 40
STEPS_DEG = (0.0, 1.0, 5.0, 15.0, 45.0)
"""0 reads floats; 1 integers of degrees; the rest shows from where on it matters."""


@dataclass(frozen=True)
class Outcome:
    """One seed: per step, rms of measured less true force, the model's test MSE, and ISE of the round flown with it."""

    rounding: Floats
    error: Floats
    base: Floats
    ise: Floats


def study(lab: Lab) -> Study:
    """Learn from encoders of several resolutions."""
    outcomes = lab.each_seed(_compare, "encoder angles as integers and floats")
    error = np.array([one.error / one.error[0] for one in outcomes])
    rows = [
        Row(
            f"force MSE of a model from integer degrees against floats, {axis}",
            "%",
            None,
            changes([one.error[1, j] for one in outcomes], [one.error[0, j] for one in outcomes]),
        )
        for j, axis in enumerate(AXES)
    ]
    rows.append(
        Row(
            "ISE of the next round, integer degrees against floats",
            "%",
            "update is necessary",
            changes([one.ise[1] for one in outcomes], [one.ise[0] for one in outcomes]),
        )
    )
    table = Table(
        "By step of the encoder; median (least to greatest).",
        (
            "step [deg]",
            *(
                f"measured less true force, {axis}, rms [{unit}]"
                for axis, unit in zip(AXES, ("N", "N", "N·m"), strict=True)
            ),
            *(f"model's MSE / with floats, {axis}" for axis in AXES),
        ),
        tuple(
            (
                "floats" if step == 0.0 else f"{step:g}",
                *(spread([one.rounding[k, j] for one in outcomes]) for j in range(3)),
                *(spread(error[:, k, j].tolist()) for j in range(3)),
            )
            for k, step in enumerate(STEPS_DEG)
        ),
    )
    return Study(
        "encoder",
        "Integer encoder angles (section 4.8)",
        "The thesis had the encoders' firmware changed from integers to floats, as a condition for success. How "
        "much was at stake?",
        (
            "The calm round 1, logged by encoders of several steps; each model is judged on another round whose "
            "encoders read "
            "floats, and flown in round 2. The thesis does not give the unit of its integers; whole degrees are "
            "the likeliest.",
        ),
        tuple(rows),
        (table,),
        tuple(_findings(outcomes)),
        (
            against(
                "encoder-steps",
                "Test MSE of the model over that was fitted to floats: median and range over the seeds.",
                "encoder step [deg]",
                tuple(f"{axis}, ratio" for axis in AXES),
                STEPS_DEG,
                {"model": error},
            ),
        ),
    )


def _stepped(scenario: Scenario, step_deg: float) -> Scenario:
    return replace(scenario, sensors=replace(scenario.sensors, azimuth_step_deg=step_deg))


def _compare(folder: Path, seed: int) -> Outcome:
    calm = controlled(trial("calm"), BASE)
    test = fly(folder, "test", calm, weather_seed(seed, 3)).motion(THESIS.window_s)
    rounding, error, ise = [], [], []
    for step in STEPS_DEG:
        flight = fly(folder, f"step-{step:g}", _stepped(calm, step), weather_seed(seed, 1))
        truth, measured = flight.simulation.truth, flight.measured
        tau = np.column_stack([np.interp(measured.t, truth.t, column) for column in truth.tau.T])
        rounding.append(np.sqrt(np.nanmean((measured.tau - tau)[measured.usable] ** 2, axis=0)))
        model = learn([flight.motion(THESIS.window_s)], flight.profile)
        error.append(force_mse(model, test))
        ise.append(fly(folder, f"next-{step:g}", calm, weather_seed(seed, 2), model).performance.ISE)
    base = force_mse(hull_alone(flight.profile, BASE), test)
    return Outcome(np.array(rounding), np.array(error), base, np.array(ise))


def _findings(outcomes: list[Outcome]) -> list[str]:
    whole = np.median([one.rounding[1] for one in outcomes], axis=0)
    floats = np.median([one.rounding[0] for one in outcomes], axis=0)
    told = [
        f"Measured and true force differ by {number(floats[0])} N, {number(floats[1])} N and {number(floats[2])} "
        f"N·m rms with floats and by "
        f"{number(whole[0])} N, {number(whole[1])} N and {number(whole[2])} N·m with whole degrees."
    ]
    worse = [median([one.error[1, j] / one.error[0, j] for one in outcomes]) for j in range(3)]
    told.append(
        "Whole degrees make the model's MSE "
        + ", ".join(f"{percent(100 * (ratio - 1))} % in {axis}" for ratio, axis in zip(worse, AXES, strict=True))
        + (
            ": in these runs too little to make or break the method. Whole degrees are our guess at what the thesis's "
            "integers were, and its encoders may have had other faults that the update corrected."
            if max(worse) < 1.05
            else ": the update is worth having."
        )
    )
    matters = [
        step
        for k, step in enumerate(STEPS_DEG)
        if max(median([one.error[k, j] / one.error[0, j] for one in outcomes]) for j in range(3)) > 1.25
    ]
    told.append(
        f"The first step of these that makes an axis worse by more than 25 % is {matters[0]:g}°."
        if matters
        else "None of these steps makes an axis worse by more than 25 %."
    )
    return told
