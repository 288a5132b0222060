"""Experiment 1: three adaptive rounds in wind that nobody measures, and the Master Model's round."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ferryid.compare import MEASURES
from ferryid.identify import force_mse
from ferryid.models.forces import model_estimator
from ferryid.report.drawing import Drawing
from ferryid.reproduce.flight import Flight, campaign, master_round, trial
from ferryid.reproduce.lab import Lab
from ferryid.reproduce.learning import BASE, MASTER, THESIS, hull_alone
from ferryid.reproduce.pictures import control_shares, integrals, model_fit
from ferryid.reproduce.study import Row, Study, Table, change, changes, median, percent, spread
from ferryid.types import AXES, Floats
from ferryid.vessel.profile import Profile

PLACE = 10
ROUNDS = 3
THEIRS = {"ISE": -75.0, "IAE": -46.0, "IAEW": -57.0, "EC": -20.0}
FEEDBACK = (-39.0, -61.0, -51.0)
FORCE = (-84.0, -87.0, -68.0)


@dataclass(frozen=True)
class Outcome:
    """One seed: the measures of rounds 1, 2, 3 and the Master Model's, and force errors on the log of round 3."""

    measures: dict[str, tuple[float, ...]]
    feedback: Floats
    model: Floats
    master: Floats
    base: Floats
    constant: Floats
    wind: Floats
    drawings: tuple[Drawing, ...]


def study(lab: Lab) -> Study:
    """Carry out Experiment 1."""
    outcomes = lab.each_seed(_experiment, "Experiment 1: adaptive rounds in wind")
    rows = [
        Row(
            f"force MSE of Model 2 against the Master Model's, {axis} (log of round 3)",
            "%",
            FORCE[j],
            changes([one.model[j] for one in outcomes], [one.master[j] for one in outcomes]),
        )
        for j, axis in enumerate(AXES)
    ]
    rows += [
        Row(
            f"{name}, round 1 to round 3",
            "%",
            THEIRS[name],
            tuple(change(one.measures[name][2], one.measures[name][0]) for one in outcomes),
        )
        for name in MEASURES
    ]
    rows += [
        Row(
            f"feedback power, {axis}, round 1 to round 3",
            "%",
            FEEDBACK[j],
            changes([one.feedback[2, j] for one in outcomes], [one.feedback[0, j] for one in outcomes]),
        )
        for j, axis in enumerate(AXES)
    ]
    table = Table(
        "Each round, median over the seeds (least to greatest).",
        ("", "round 1, base model", "round 2, Model 1", "round 3, Model 2", "Master Model"),
        tuple(
            (
                f"{name} [{unit}]",
                *(spread([factor * one.measures[name][k] for one in outcomes]) for k in range(ROUNDS + 1)),
            )
            for name, unit, factor in (
                ("ISE", "m² s", 1.0),
                ("IAE", "m s", 1.0),
                ("IAEW", "m s kJ", 1e-3),
                ("EC", "kJ", 1e-3),
            )
        )
        + tuple(
            (
                f"feedback, {axis} rms [{unit}]",
                *(spread([float(np.sqrt(one.feedback[k, j])) for one in outcomes]) for k in range(ROUNDS + 1)),
            )
            for j, (axis, unit) in enumerate(zip(AXES, ("N", "N", "N·m"), strict=True))
        ),
    )
    return Study(
        "rounds",
        "Adaptive rounds in wind (Experiment 1)",
        "Does the model fitted to a round make the next one more precise and cheaper, and is it better than "
        "the Master Model?",
        (
            "12-corner rounds of 12 minutes in a wind from NW of 5 m/s with gusts of 1.67 m/s per component, not measured; "
            "weather and noise differ from round to round. Round 1 flies with the base model (δ = σ = 0.4), "
            "round P + 1 with the "
            "model of rounds 1 to P: thesis basis, coupled, 12 components, window 1.0 s, no row held back.",
            "The true vessel has the Master Model's hull, as in the thesis's own simulations (4.3). The error e "
            "is the true one, "
            "with the heading error counted by how far it moves the hull's ends (2.5 m times the angle); the "
            "power is that of "
            "the force that really acts.",
        ),
        tuple(rows),
        (table,),
        tuple(_findings(outcomes)),
        outcomes[0].drawings,
        {
            "force_mse": {
                "model_2": [one.model.tolist() for one in outcomes],
                "master": [one.master.tolist() for one in outcomes],
                "base": [one.base.tolist() for one in outcomes],
            },
            "mean_wind_mps": [one.wind.tolist() for one in outcomes],
        },
    )


def _experiment(folder: Path, seed: int) -> Outcome:
    flown = campaign(folder, trial("experiment-1"), seed, ROUNDS)
    compared = master_round(folder, trial("experiment-1"), seed, ROUNDS + 1)
    flights = (*flown.flights, compared)
    profile = compared.profile
    motion = flown.flights[2].motion(THESIS.window_s)
    new, master = model_estimator(flown.models[1]), hull_alone(profile, MASTER)
    labels = ("round 1, base model", "round 2, Model 1", "round 3, Model 2", "Master Model")
    drawings = (
        integrals(
            "5-5-integrals",
            "Performance integrals of Experiment 1, as in figure 5.5.",
            {label: flight.performance for label, flight in zip(labels, flights, strict=True)},
        ),
        model_fit(
            "5-6-model-fit",
            "Force on the log of round 3, as in figure 5.6: measured, and as Model 2 and the Master Model estimate it.",
            motion,
            {"Master Model": master.of(motion), "Model 2": new.of(motion)},
        ),
        model_fit(
            "5-6-model-fit-zoomed",
            "The same, t = 360 to 420 s.",
            motion,
            {"Master Model": master.of(motion), "Model 2": new.of(motion)},
            (360.0, 420.0),
        ),
        control_shares(
            "5-7-shares-round-1",
            "Feedforward and feedback in round 1, base model, as in figure 5.7.",
            flights[0].performance,
        ),
        control_shares(
            "5-8-shares-round-3",
            "Feedforward and feedback in round 3, Model 2, as in figure 5.8.",
            flights[2].performance,
        ),
    )
    return Outcome(
        {name: tuple(float(getattr(flight.performance, name)) for flight in flights) for name in MEASURES},
        np.array([flight.performance.feedback_power for flight in flights]),
        force_mse(new, motion),
        force_mse(master, motion),
        force_mse(hull_alone(profile, BASE), motion),
        _with_constant(flown.flights, profile),
        np.array([flight.simulation.truth.wind.mean(axis=0) for flight in flights]),
        drawings if seed == 1 else (),
    )


def _with_constant(flights: tuple[Flight, ...], profile: Profile) -> Floats:
    """Return the MSE on round 3 of the Master Model plus its mean error in rounds 1 and 2: a constant force and no more."""
    master = hull_alone(profile, MASTER)
    left = [(motion.tau - master.of(motion))[motion.valid] for motion in (f.motion(THESIS.window_s) for f in flights)]
    return np.asarray(np.nanmean((left[2] - np.nanmean(np.vstack(left[:2]), axis=0)) ** 2, axis=0))


def _findings(outcomes: list[Outcome]) -> list[str]:
    told = []
    for name in MEASURES:
        told.append(
            f"{name}: "
            f"{spread([change(one.measures[name][1], one.measures[name][0]) for one in outcomes], '%', signed=True)} "
            f"with Model 1 and "
            f"{spread([change(one.measures[name][2], one.measures[name][1]) for one in outcomes], '%', signed=True)} "
            "more with Model 2."
        )
    floor = np.sqrt(np.median([one.master for one in outcomes], axis=0))
    gain = [median(changes([one.model[j] for one in outcomes], [one.master[j] for one in outcomes])) for j in range(3)]
    flat = [
        median(changes([one.constant[j] for one in outcomes], [one.master[j] for one in outcomes])) for j in range(3)
    ]
    told.append(
        "The Master Model is the true hull here, so that what it leaves of the force "
        f"({floor[0]:.0f} N, {floor[1]:.0f} N, {floor[2]:.0f} N·m rms) is wind, noise and lag, and there is no wrong hull "
        f"to correct. Model 2's MSE against it is {_three(gain)}; the true hull plus nothing but a constant force along "
        f"the hull's axes, the mean of what it left in rounds 1 and 2, makes {_three(flat)}. How far a real vessel lies "
        "from its Master Model no simulation can know; the next study turns the question round."
    )
    return told


def _three(values: list[float]) -> str:
    return ", ".join(f"{percent(value)} %" for value in values)
