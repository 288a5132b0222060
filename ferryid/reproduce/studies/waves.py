"""Experiment 2: waves break the model, and what this tool says of it."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ferryid.counts import counted
from ferryid.identify import FitSettings, fit_logs, force_mse
from ferryid.models import Model
from ferryid.models.forces import model_estimator
from ferryid.report.drawing import Drawing, Line, Panel
from ferryid.reproduce.flight import Flight, campaign, controlled, fly, master_round, trial, weather_seed
from ferryid.reproduce.lab import Lab
from ferryid.reproduce.learning import BASE, MASTER, THESIS, hull_alone, learn
from ferryid.reproduce.pictures import FORCES, against, control_shares, integrals, model_fit
from ferryid.reproduce.study import Row, Study, Table, changes, median, number, percent, spread
from ferryid.reproduce.variants import rougher, windier
from ferryid.simulate.scenario import Scenario
from ferryid.types import AXES, Floats, RunContext
from ferryid.vessel.profile import Profile

PLACE = 30
THEIRS = (217.0, 171.0, 58.0)
BIGGER = 3.0
"""How much higher the waves of round 8 are than those of rounds 4 to 7; the thesis calls them big and small."""
HEIGHTS_M = (0.0, 0.05, 0.1, 0.2, 0.4)
BREEZY = ("neither", *(f"breeze, {height:g} m" for height in HEIGHTS_M))
"""What the logs that `ferryid fit` is tried on were recorded in: neither breeze nor waves, then a breeze and waves."""


@dataclass(frozen=True)
class Told:
    """What `ferryid fit` makes of one log: accepted, number of warnings, its model's calm error over the base model's."""

    accepted: bool
    warnings: tuple[str, ...]
    calm: float
    validation: float


@dataclass(frozen=True)
class Outcome:
    """One seed of Experiment 2."""

    wavy: dict[str, Floats]
    calm: dict[str, Floats]
    feedback_peak: Floats
    feedback_power: dict[str, Floats]
    by_height: Floats
    by_height_calm: Floats
    told: tuple[Told, ...]
    drawings: tuple[Drawing, ...]


def study(lab: Lab) -> Study:
    """Carry out Experiment 2."""
    outcomes = lab.each_seed(_experiment, "Experiment 2: waves")
    rows = [
        Row(
            f"force MSE of Model 8 (big waves) against Model 4 (small waves), {axis}, on Data Set 7",
            "%",
            THEIRS[j],
            changes([one.wavy["Model 8"][j] for one in outcomes], [one.wavy["Model 4"][j] for one in outcomes]),
        )
        for j, axis in enumerate(AXES)
    ]
    rows += [
        Row(
            f"the same on a log in calm weather, {axis}",
            "%",
            None,
            changes([one.calm["Model 8"][j] for one in outcomes], [one.calm["Model 4"][j] for one in outcomes]),
        )
        for j, axis in enumerate(AXES)
    ]
    rows += [
        Row(
            f"force MSE of Model 6 against Model 2, {axis}, on Data Set 7",
            "%",
            "better",
            changes([one.wavy["Model 6"][j] for one in outcomes], [one.wavy["Model 2"][j] for one in outcomes]),
        )
        for j, axis in enumerate(AXES)
    ]
    rows += [
        Row(
            f"feedback power of a round in waves with Model 6 against Model 2, {axis}",
            "%",
            "more",
            changes(
                [one.feedback_power["Model 6"][j] for one in outcomes],
                [one.feedback_power["Model 2"][j] for one in outcomes],
            ),
        )
        for j, axis in enumerate(AXES)
    ]
    rows += [
        Row(
            "largest feedback force, Experiment 1", "N", "100 to 200 N", tuple(one.feedback_peak[0] for one in outcomes)
        ),
        Row(
            "largest feedback force, rounds 4 to 7",
            "N",
            "600 to 1500 N",
            tuple(one.feedback_peak[1] for one in outcomes),
        ),
        Row("largest feedback force, round 8", "N", None, tuple(one.feedback_peak[2] for one in outcomes)),
    ]
    return Study(
        "waves",
        "Waves break the model (Experiment 2)",
        "How much worse is a model that was fitted in waves, and does this tool notice?",
        (
            "Rounds 4 to 7 are adaptive in a breeze of 3 m/s from NE, waves of 0.1 m (significant, peak period 2 "
            "s) and two boats "
            f"passing by; in round 8, flown with the Master Model, waves and wakes are {BIGGER:g} times as high. "
            f"The thesis gives no "
            "heights, so that its percentages have no counterpart that could be set beside them one to one: the "
            "sweep shows how they "
            "grow. Models 1 and 2 are those of Experiment 1, flown with the same seeds.",
        ),
        tuple(rows),
        _tables(outcomes),
        tuple(_findings(outcomes)),
        (
            against(
                "waves-height",
                "Force MSE, over that of a model trained without waves, against the significant height in "
                "training; median and "
                "range over the seeds.",
                "significant wave height in training [m]",
                tuple(f"{axis}, ratio" for axis in AXES),
                HEIGHTS_M,
                {
                    "judged in waves of 0.1 m": np.array([one.by_height for one in outcomes]),
                    "judged in calm weather": np.array([one.by_height_calm for one in outcomes]),
                },
                logarithmic=True,
            ),
            *outcomes[0].drawings,
        ),
        {"fits_in_waves": [[vars(told) for told in one.told] for one in outcomes], "heights_m": list(HEIGHTS_M)},
    )


def _experiment(folder: Path, seed: int) -> Outcome:
    windy, wavy = trial("experiment-1"), trial("experiment-2")
    first = campaign(folder, windy, seed, 3)
    second = campaign(folder, wavy, seed, 4, first=4)
    eighth = master_round(folder, rougher(wavy, BIGGER), seed, 8)
    profile, window = eighth.profile, THESIS.window_s
    models = {
        "Model 2": first.models[1],
        "Model 4": second.models[0],
        "Model 6": second.models[2],
        "Model 8": learn([eighth.motion(window)], profile),
    }
    seventh = second.flights[3]
    calm_flight = fly(folder, "calm", controlled(trial("calm"), MASTER), weather_seed(seed, 9))
    calm = calm_flight.motion(window)
    again = fly(folder, "round-7-model-2", wavy, weather_seed(seed, 7), models["Model 2"])
    by_height, by_height_calm, told = _sweep(folder, seed, wavy, profile, seventh, calm_flight)
    return Outcome(
        {name: force_mse(model, seventh.motion(window)) for name, model in models.items()},
        {name: force_mse(model, calm) for name, model in models.items()},
        np.array([_peak(first.flights), _peak(second.flights), _peak((eighth,))]),
        {"Model 6": seventh.performance.feedback_power, "Model 2": again.performance.feedback_power},
        by_height,
        by_height_calm,
        told,
        _pictures(models, first.flights, second.flights, eighth) if seed == 1 else (),
    )


def _peak(flights: tuple[Flight, ...]) -> float:
    return max(float(np.max(np.abs(flight.performance.feedback[:, :2]))) for flight in flights)


def _sweep(
    folder: Path, seed: int, wavy: Scenario, profile: Profile, judged: Flight, calm: Flight
) -> tuple[Floats, Floats, tuple[Told, ...]]:
    """Train in waves of each height; return MSE over that of the model without waves, in waves and calm, and what fit says."""
    rough, flat = [], []
    still = replace(windier(wavy, 0.0), waves=replace(wavy.waves, significant_height_m=0.0), wakes=())
    fly(folder, "still", controlled(still, MASTER), weather_seed(seed, 10))
    told = [_told(folder, "still", profile, calm)]
    for height in HEIGHTS_M:
        sea = replace(wavy, waves=replace(wavy.waves, significant_height_m=height), wakes=())
        flight = fly(folder, f"waves-{height:g}", controlled(sea, MASTER), weather_seed(seed, 10))
        model = learn([flight.motion(THESIS.window_s)], profile)
        rough.append(force_mse(model, judged.motion(THESIS.window_s)))
        flat.append(force_mse(model, calm.motion(THESIS.window_s)))
        told.append(_told(folder, f"waves-{height:g}", profile, calm))
    return np.array(rough) / rough[0], np.array(flat) / flat[0], tuple(told)


def _told(folder: Path, log: str, profile: Profile, calm: Flight) -> Told:
    """Return what `ferryid fit` says of one log, with its default settings on the thesis's base model."""
    result = fit_logs([str(folder / f"{log}.mcap")], profile, FitSettings(delta=0.4, sigma=0.4), RunContext(folder))
    still = calm.motion(float(result.model.settings["window_s"]))
    return Told(
        result.acceptance.accepted,
        result.warnings,
        float(np.mean(force_mse(result.model, still) / force_mse(hull_alone(profile, BASE), still))),
        result.acceptance.normalised_mse,
    )


def _pictures(
    models: dict[str, Model], first: tuple[Flight, ...], second: tuple[Flight, ...], eighth: Flight
) -> tuple[Drawing, ...]:
    seventh = second[3].motion(THESIS.window_s)
    master = hull_alone(eighth.profile, MASTER).of(seventh)
    labels = (
        "round 4, base model",
        "round 5, Model 4",
        "round 6, Model 5",
        "round 7, Model 6",
        "round 8, Master Model",
    )
    rounds = dict(zip(labels, (one.performance for one in (*second, eighth)), strict=True))
    return (
        integrals("5-9-integrals", "Performance integrals of Experiment 2, as in figure 5.9.", rounds),
        model_fit(
            "5-10-model-6",
            "Force in round 7: measured, Model 6 and the Master Model, t = 350 to 430 s, as in figure 5.10.",
            seventh,
            {"Master Model": master, "Model 6": model_estimator(models["Model 6"]).of(seventh)},
            (350.0, 430.0),
        ),
        control_shares(
            "5-11-shares-round-7", "Feedforward and feedback in round 7, as in figure 5.11.", second[3].performance
        ),
        model_fit(
            "5-12-model-2",
            "The same for Model 2, which never saw waves, as in figure 5.12.",
            seventh,
            {"Master Model": master, "Model 2": model_estimator(models["Model 2"]).of(seventh)},
            (350.0, 430.0),
        ),
        control_shares(
            "5-13-shares-round-8",
            "Feedforward and feedback in round 8, bigger waves, as in figure 5.13.",
            eighth.performance,
        ),
        _feedforwards(models, first[2]),
        _states(eighth),
    )


def _feedforwards(models: dict[str, Model], flight: Flight) -> Drawing:
    """Return figure 5.14: what Models 2 and 6 ask for along the reference of round 3."""
    control = flight.simulation.control
    nu_dot = np.gradient(control.nu_d, control.t, axis=0)
    wanted = {
        name: model_estimator(models[name])(nu_dot, control.nu_d, control.eta_d[:, 2], None, None)
        for name in ("Model 2", "Model 6")
    }
    panels = tuple(
        Panel(label, tuple(Line(name, control.t, force[:, j]) for name, force in wanted.items()))
        for j, label in enumerate(FORCES)
    )
    return Drawing(
        "5-14-feedforward",
        "Feedforward of Models 2 and 6 along the reference of round 3, as in figure 5.14.",
        "time [s]",
        panels,
    )


def _states(flight: Flight) -> Drawing:
    """Return figure 5.15: velocities and roll in round 8."""
    truth = flight.simulation.truth
    return Drawing(
        "5-15-states",
        "True velocities, and roll as an indicator of the waves, in round 8, as in figure 5.15.",
        "time [s]",
        (
            Panel("u [m/s]", (Line("true", truth.t, truth.nu[:, 0]),)),
            Panel("v [m/s]", (Line("true", truth.t, truth.nu[:, 1]),)),
            Panel("r [deg/s]", (Line("true", truth.t, np.degrees(truth.nu[:, 2])),)),
            Panel("roll [deg]", (Line("true", truth.t, np.degrees(truth.attitude[:, 0])),)),
        ),
    )


def _tables(outcomes: list[Outcome]) -> tuple[Table, ...]:
    ratios = Table(
        "Force MSE of a model trained in waves over that of one trained without, by significant height; median (least to "
        "greatest).",
        ("height [m]", *(f"{axis}, in waves" for axis in AXES), *(f"{axis}, calm" for axis in AXES)),
        tuple(
            (
                f"{height:g}",
                *(spread([one.by_height[k, j] for one in outcomes]) for j in range(3)),
                *(spread([one.by_height_calm[k, j] for one in outcomes]) for j in range(3)),
            )
            for k, height in enumerate(HEIGHTS_M)
        ),
    )
    tool = Table(
        "What `ferryid fit` makes of the same logs, and of one without breeze and waves, with its default settings on the "
        "thesis's base model (δ = σ = 0.4): MSE over the base model's, mean of the axes.",
        ("recorded in", "accepted", "warnings", "on its own validation rows", "on the calm log"),
        tuple(
            (
                label,
                f"{sum(one.told[k].accepted for one in outcomes)} of {len(outcomes)}",
                spread([float(len(one.told[k].warnings)) for one in outcomes]),
                spread([one.told[k].validation for one in outcomes]),
                spread([one.told[k].calm for one in outcomes]),
            )
            for k, label in enumerate(BREEZY)
        ),
    )
    kinds = [
        Counter(kind for one in outcomes for kind in {kind_of(w) for w in one.told[k].warnings})
        for k in range(len(BREEZY))
    ]
    warned = Table(
        "Its warnings by kind, numbers left out: in how many runs each was given.",
        ("warning", *BREEZY),
        tuple((kind, *(f"{counted[kind]}" for counted in kinds)) for kind, _ in sum(kinds, Counter()).most_common()),
    )
    return ratios, tool, warned


def _findings(outcomes: list[Outcome]) -> list[str]:
    told = []
    rough = np.array([one.by_height[-1] for one in outcomes])
    flat = np.array([one.by_height_calm[-1] for one in outcomes])
    told.append(
        f"Trained in waves of {HEIGHTS_M[-1]:g} m a model's force MSE is {number(float(np.median(rough)))} times "
        f"that of one trained "
        f"without (median over axes and seeds) where it is judged in small waves, and "
        f"{number(float(np.median(flat)))} times where "
        "it is judged in calm weather."
    )
    lower = [
        axis
        for j, axis in enumerate(AXES)
        if median([one.wavy["Model 6"][j] / one.wavy["Model 2"][j] for one in outcomes]) < 1.0
    ]
    worse = [
        axis
        for j, axis in enumerate(AXES)
        if median([one.calm["Model 6"][j] / one.calm["Model 2"][j] for one in outcomes]) > 1.0
    ]
    told.append(
        f"On the wavy log of round 7 Model 6 has a lower MSE than Model 2 in {_list(lower)}, on the calm log a "
        f"higher one in "
        f"{_list(worse)}: "
        + (
            "as the thesis says, a low error in waves is no sign of a good model."
            if lower and worse
            else "the thesis's contrast between the two does not appear in every axis here."
        )
    )
    power = [
        median(
            changes(
                [o.feedback_power["Model 6"][j] for o in outcomes], [o.feedback_power["Model 2"][j] for o in outcomes]
            )
        )
        for j in range(3)
    ]
    told.append(
        "Flown in the same waves, Model 6 takes "
        + ", ".join(f"{percent(value)} % in {axis}" for value, axis in zip(power, AXES, strict=True))
        + " of feedback power against Model 2; the thesis, which compares rounds of different days, found more with Model 6."
    )
    accepted = [sum(one.told[k].accepted for one in outcomes) for k in range(len(BREEZY))]
    worst = [median([one.told[k].calm for one in outcomes]) for k in range(len(BREEZY))]
    count = len(outcomes)
    told.append(
        f"`ferryid fit` accepts its model of the log without breeze and waves in {accepted[0]} of "
        f"{counted(count, 'run')}, with the "
        f"breeze alone in {accepted[1]}, and with breeze and waves in "
        + ", ".join(f"{accepted[k + 1]} ({HEIGHTS_M[k]:g} m)" for k in range(1, len(HEIGHTS_M)))
        + f". Judged in calm weather these models have {', '.join(number(value) for value in worst)} times the base "
        "model's error, in the same order"
        + (
            ": in most runs the unmeasured breeze alone takes the acceptance away, and the waves add to the error."
            if accepted[0] - accepted[1] > count / 2
            else "."
        )
    )
    return told


def kind_of(warning: str) -> str:
    """Return a warning without its numbers and its axis, so that warnings of one kind are alike."""
    kind = re.sub(r"\b(surge|sway|yaw)\b", "…", re.sub(r"[-+−]?\d[\d.,]*(?:e[-+]?\d+)?", "#", warning))
    return kind.replace("kg·m²", "kg")


def _list(names: list[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names) or "no axis"
