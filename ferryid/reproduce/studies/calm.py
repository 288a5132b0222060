"""Section 5.4: the adaptive rounds in calm weather."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ferryid.identify.judge import force_mse
from ferryid.identify.model import AXES
from ferryid.report.drawing import Drawing
from ferryid.reproduce.flight import campaign, master_round, trial
from ferryid.reproduce.lab import Lab
from ferryid.reproduce.learning import MASTER, THESIS, hull_alone
from ferryid.reproduce.performance import MEASURES
from ferryid.reproduce.pictures import integrals
from ferryid.reproduce.study import Row, Study, change, changes, median, spread

Floats = NDArray[np.float64]

PLACE = 12
ROUNDS = 4
WINDOW_S = 0.25
"""The thesis's choice for its simulations."""


@dataclass(frozen=True)
class Outcome:
    """One seed: measures of rounds 1 to 4 and of the Master Model's, force errors on the log of round 4."""

    measures: dict[str, tuple[float, ...]]
    feedback: Floats
    model: Floats
    master: Floats
    drawings: tuple[Drawing, ...]


def study(lab: Lab) -> Study:
    """Fly the rounds of section 5.4."""
    outcomes = lab.each_seed(_rounds, "section 5.4: adaptive rounds in calm weather")
    rows = [
        Row(
            f"{name}, round {a} to round {b}",
            "%",
            "improves" if b == 2 or b == 3 else "converged",
            tuple(change(one.measures[name][b - 1], one.measures[name][a - 1]) for one in outcomes),
        )
        for name in MEASURES
        for a, b in ((1, 2), (2, 3), (3, 4))
    ]
    rows += [
        Row(
            f"feedback power, {axis}, round 1 to round 3",
            "%",
            None,
            changes([one.feedback[2, j] for one in outcomes], [one.feedback[0, j] for one in outcomes]),
        )
        for j, axis in enumerate(AXES)
    ]
    rows += [
        Row(
            f"{name}, round 4 against the Master Model's",
            "%",
            None,
            tuple(change(one.measures[name][3], one.measures[name][4]) for one in outcomes),
        )
        for name in MEASURES
    ]
    return Study(
        "calm",
        "Adaptive rounds in calm weather (section 5.4)",
        "Do the measures improve with every update, and has the model converged after two rounds?",
        (
            "The same rounds without wind; the drag of still air remains. Window 0.25 s, as the thesis uses in "
            "simulation. The "
            "noise has the standard deviations of Table 5.2 for velocity and for acceleration alike, which makes "
            "it coloured.",
        ),
        tuple(rows),
        (),
        tuple(_findings(outcomes)),
        outcomes[0].drawings,
    )


def _rounds(folder: Path, seed: int) -> Outcome:
    settings = replace(THESIS, window_s=WINDOW_S)
    flown = campaign(folder, trial("calm"), seed, ROUNDS, settings)
    compared = master_round(folder, trial("calm"), seed, ROUNDS + 1)
    flights = (*flown.flights, compared)
    profile = compared.profile
    motion = flown.flights[-1].motion(1.0)
    labels = ("round 1, base model", "round 2, Model 1", "round 3, Model 2", "round 4, Model 3", "Master Model")
    drawing = integrals(
        "5-3-integrals",
        "Performance integrals in calm weather, as in figure 5.3.",
        {label: flight.performance for label, flight in zip(labels, flights, strict=True)},
    )
    return Outcome(
        {name: tuple(float(getattr(flight.performance, name)) for flight in flights) for name in MEASURES},
        np.array([flight.performance.feedback_power for flight in flights]),
        force_mse(flown.models[-1], motion),
        force_mse(hull_alone(profile, MASTER), motion),
        (drawing,) if seed == 1 else (),
    )


def _findings(outcomes: list[Outcome]) -> list[str]:
    told = []
    for k, word in ((1, "first"), (2, "second"), (3, "third")):
        values = [change(one.measures["ISE"][k], one.measures["ISE"][k - 1]) for one in outcomes]
        better = sum(value < 0 for value in values)
        told.append(
            f"The {word} update changes ISE by {spread(values, '%', signed=True)}; "
            f"it falls in {better} of {len(values)} runs."
        )
    best = median([change(one.measures["ISE"][3], one.measures["ISE"][4]) for one in outcomes])
    ratio = np.median([one.model / one.master for one in outcomes], axis=0)
    told.append(
        f"In the last round ISE is {best:+.1f} % from that of a round flown with the true hull as feedforward, "
        f"and on the log of that "
        f"round the model's force MSE is {ratio[0]:.2f}, {ratio[1]:.2f}, {ratio[2]:.2f} times the true hull's "
        "(surge, sway, yaw; window 1.0 s)."
    )
    return told
