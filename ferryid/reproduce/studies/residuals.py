"""Sections 3.2.1-3.2.2: the residual from measured force, from commanded force, and of a parallel simulation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ferryid.compare import signal_power
from ferryid.counts import counted
from ferryid.identify import force_mse
from ferryid.models.forces import FORMS
from ferryid.reproduce.flight import controlled, fly, trial, weather_seed
from ferryid.reproduce.lab import Lab
from ferryid.reproduce.learning import BASE, THESIS, hull_alone, learn
from ferryid.reproduce.study import Row, Study, Table, changes, median, number, spread
from ferryid.types import AXES, Floats

PLACE = 50
LABELS = {
    "measured": "τ_mes − F₀ (3.1)",
    "commanded": "τ_d − F₀ (Jervan 2020)",
    "parallel": "parallel simulation (Gale et al. 2017)",
}


@dataclass(frozen=True)
class Outcome:
    """One seed: per form of the residual, test MSE over the base model's, and how the next round went."""

    error: Floats
    ise: Floats
    energy: Floats
    feedback: Floats


def study(lab: Lab) -> Study:
    """Learn from three residuals."""
    outcomes = lab.each_seed(_compare, "forms of the residual")
    rows = [
        Row(
            f"force MSE with τ_d against τ_mes, {axis}",
            "%",
            "questionable",
            changes([one.error[1, j] for one in outcomes], [one.error[0, j] for one in outcomes]),
        )
        for j, axis in enumerate(AXES)
    ]
    rows += [
        Row(
            "ISE of the next round, τ_d against τ_mes",
            "%",
            "best tracking (Jervan), questionable (Aurlien)",
            changes([one.ise[1] for one in outcomes], [one.ise[0] for one in outcomes]),
        ),
        Row(
            "ISE of the next round, parallel simulation against τ_mes",
            "%",
            "as good without it",
            changes([one.ise[2] for one in outcomes], [one.ise[0] for one in outcomes]),
        ),
    ]
    table = Table(
        "By residual; median (least to greatest). MSE is against the measured force, over the base model's.",
        (
            "residual",
            *(f"MSE, {axis}" for axis in AXES),
            "ISE of the next round [m² s]",
            "EC [kJ]",
            "feedback rms, surge [N]",
        ),
        tuple(
            (
                LABELS[form],
                *(spread([one.error[k, j] for one in outcomes]) for j in range(3)),
                spread([one.ise[k] for one in outcomes]),
                spread([one.energy[k] / 1e3 for one in outcomes]),
                spread([float(np.sqrt(one.feedback[k, 0])) for one in outcomes]),
            )
            for k, form in enumerate(FORMS)
        ),
    )
    return Study(
        "residuals",
        "Which residual? (sections 3.2.1 and 3.2.2)",
        "Measured or commanded force, inverse model or parallel simulation: which makes the better model?",
        (
            "Round 1 of Experiment 1 trains, another round in the same wind tests, and round 2 is flown with each model.",
        ),
        tuple(rows),
        (table,),
        tuple(_findings(outcomes)),
    )


def _compare(folder: Path, seed: int) -> Outcome:
    windy = controlled(trial("experiment-1"), BASE)
    flight = fly(folder, "training", windy, weather_seed(seed, 1))
    test = fly(folder, "test", windy, weather_seed(seed, 3)).motion(THESIS.window_s)
    unit = force_mse(hull_alone(flight.profile, BASE), test)
    motion = flight.motion(THESIS.window_s)
    error, after = [], []
    for form in FORMS:
        model = learn([motion], flight.profile, replace(THESIS, residual=form))
        error.append(force_mse(model, test) / unit)
        after.append(fly(folder, f"next-{form}", windy, weather_seed(seed, 2), model).performance)
    return Outcome(
        np.array(error),
        np.array([one.ISE for one in after]),
        np.array([one.EC for one in after]),
        np.array([signal_power(one.feedback) for one in after]),
    )


def _findings(outcomes: list[Outcome]) -> list[str]:
    told = []
    for k, form in ((1, "commanded"), (2, "parallel")):
        ise = [one.ise[k] / one.ise[0] for one in outcomes]
        force = median([float(np.mean(one.error[k] / one.error[0])) for one in outcomes])
        better = sum(ratio < 1.0 for ratio in ise)
        told.append(
            f"{LABELS[form]}: the force MSE is {number(force)} times that with τ_mes (mean of the axes), and the "
            f"next round's ISE "
            f"{spread(ise)} times; it is lower in {better} of {counted(len(ise), 'run')}."
        )
    lower = sum(one.ise[1] < one.ise[0] for one in outcomes)
    told.append(
        f"Jervan's advice to use τ_d for better tracking shows in {lower} of {counted(len(outcomes), 'run')} "
        "here, Aurlien's doubt in "
        f"{len(outcomes) - lower}: the sign of so small a difference is not settled by these."
        if 0 < lower < len(outcomes)
        else f"τ_d brings {'better' if lower else 'worse'} tracking in all of these runs."
    )
    return told
