"""Sections 3.2.5 and 5.6.5: updates when a payload comes aboard and there is only a crossing to learn from."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted
from ferryid.identify import accept_on_motions, force_mse
from ferryid.identify.adaptive import fit_motions, geometric_weights, mean_of_last, update_axes, weighted_mean
from ferryid.models import Model
from ferryid.reproduce.flight import controlled, fly, trial, weather_seed
from ferryid.reproduce.lab import Lab
from ferryid.reproduce.learning import BASE, THESIS, hull_alone, learn
from ferryid.reproduce.study import Study, Table, changes, median, number, percent, spread
from ferryid.signals.track import Motion
from ferryid.simulate.scenario import Scenario
from ferryid.simulate.sections import Payload
from ferryid.types import AXES, Floats

PLACE = 70
PASSENGERS_KG = 480.0
"""Six passengers of 80 kg, on the body origin."""
LAST = 3
"""S of (3.9)."""
FACTOR = 0.5
"""A model counts half of the next one, (5.1)."""
WAYS = (
    "old model, empty vessel",
    "new model of the half crossing",
    "surge alone updated",
    "forgetting factor 0.5",
    "mean of the last 3 models",
    "correction on top of that mean",
)


@dataclass(frozen=True)
class Outcome:
    """One seed: per way of updating, MSE over the base model's on three logs, whether accepted, and ISE of two flights."""

    half: Floats
    twelve: Floats
    empty: Floats
    accepted: tuple[bool, ...]
    crossing_ise: Floats
    twelve_ise: Floats


def study(lab: Lab) -> Study:
    """Update a model after half a crossing."""
    outcomes = lab.each_seed(_compare, "updating the model in operation")
    force = Table(
        "Force MSE over the base model's, mean of the axes; median (least to greatest). Accepted: by the "
        "criterion of 3.2.4 on the "
        "second half of the crossing.",
        (
            "way of updating",
            "accepted",
            "second half of the crossing",
            "12-corner round, same payload",
            "12-corner round, empty",
        ),
        tuple(
            (
                way,
                "–" if k == 0 else f"{sum(one.accepted[k] for one in outcomes)} of {len(outcomes)}",
                *(
                    spread([float(np.mean(getattr(one, on)[k])) for one in outcomes])
                    for on in ("half", "twelve", "empty")
                ),
            )
            for k, way in enumerate(WAYS)
        ),
    )
    axes = Table(
        "The same per axis on the 12-corner round with the payload.",
        ("way of updating", *AXES),
        tuple((way, *(spread([one.twelve[k, j] for one in outcomes]) for j in range(3))) for k, way in enumerate(WAYS)),
    )
    flown = Table(
        "ISE [m² s] of rounds flown with each model and the payload aboard.",
        ("way of updating", "crossing", "12-corner round"),
        tuple(
            (way, spread([one.crossing_ise[k] for one in outcomes]), spread([one.twelve_ise[k] for one in outcomes]))
            for k, way in enumerate(WAYS)
        ),
    )
    return Study(
        "updates",
        "Updating in operation",
        "Six passengers come aboard and half a crossing is all there is to learn from: which way of updating "
        "helps, and which harms "
        "manoeuvres that were not in it?",
        (
            f"Three 12-corner rounds of the empty vessel give Models 1 to 3. Then {PASSENGERS_KG:g} kg come "
            f"aboard. The first half of a "
            "crossing trains, the second judges (3.2.4), and a 12-corner round stands for manoeuvres never seen. "
            "The thesis proposes "
            "these ways (3.9), (5.1), 5.6.5 and tries none.",
        ),
        (),
        (force, axes, flown),
        tuple(_findings(outcomes)),
    )


def _compare(folder: Path, seed: int) -> Outcome:
    window = THESIS.window_s
    calm, crossing = controlled(trial("calm"), BASE), trial("crossing")
    laden = (Payload(mass_kg=PASSENGERS_KG),)
    rounds = [fly(folder, f"empty-{k}", calm, weather_seed(seed, k)) for k in (1, 2, 3)]
    profile = rounds[0].profile
    motions = [flight.motion(window) for flight in rounds]
    earlier = [learn([motion], profile) for motion in motions]
    old = learn(motions, profile)
    trip = fly(folder, "crossing", replace(crossing, payload=laden), weather_seed(seed, 4), old).motion(window)
    halves = [trip.t < trip.t[-1] / 2, trip.t >= trip.t[-1] / 2]
    new = fit_motions(profile, [trip], THESIS, name="reproduction", rows=[halves[0]]).model
    mean = mean_of_last([*earlier], LAST)
    series = [*earlier, new]
    models = (
        old,
        new,
        update_axes(old, [trip], axes=("surge",), rows=[halves[0]]).model,
        weighted_mean(series, geometric_weights(len(series), FACTOR)),
        mean_of_last(series, LAST),
        fit_motions(profile, [trip], THESIS, name="reproduction", base=mean, rows=[halves[0]]).model,
    )
    test = fly(folder, "test", replace(calm, payload=laden), weather_seed(seed, 5), old).motion(window)
    base = hull_alone(profile, BASE)

    def errors(motion: Motion, rows: NDArray[np.bool_] | None = None) -> Floats:
        masks = None if rows is None else [rows]
        return np.array([force_mse(model, motion, masks) for model in models]) / force_mse(base, motion, masks)

    return Outcome(
        errors(trip, halves[1]),
        errors(test),
        errors(fly(folder, "test-empty", calm, weather_seed(seed, 6), old).motion(window)),
        tuple(accept_on_motions(old, model, trip, [halves[1]]).accepted for model in models),
        _ise(folder, "crossing", replace(crossing, payload=laden), weather_seed(seed, 7), models),
        _ise(folder, "twelve", replace(calm, payload=laden), weather_seed(seed, 8), models),
    )


def _ise(folder: Path, name: str, scenario: Scenario, seed: int, models: tuple[Model, ...]) -> Floats:
    return np.array(
        [fly(folder, f"{name}-{k}", scenario, seed, model).performance.ISE for k, model in enumerate(models)]
    )


def _findings(outcomes: list[Outcome]) -> list[str]:
    told = []
    half = [median([float(np.mean(one.half[k] / one.half[0])) for one in outcomes]) for k in range(len(WAYS))]
    twelve = [median([float(np.mean(one.twelve[k] / one.twelve[0])) for one in outcomes]) for k in range(len(WAYS))]
    for k in range(1, len(WAYS)):
        told.append(
            f"{WAYS[k][0].upper()}{WAYS[k][1:]}: {number(half[k])} times the old model's MSE on the rest of the crossing, "
            f"{number(twelve[k])} times on the 12-corner round it never saw (mean of the axes' ratios)."
        )
    safe = [k for k in range(1, len(WAYS)) if half[k] < 1.0 and twelve[k] < 1.0]
    for k in safe:
        pairs = [
            (float(np.mean(one.half[k] / one.half[0])), float(np.mean(one.twelve[k] / one.twelve[0])))
            for one in outcomes
        ]
        both = sum(a < 1.0 and b < 1.0 for a, b in pairs)
        flown = [
            median(changes([getattr(o, on)[k] for o in outcomes], [getattr(o, on)[0] for o in outcomes]))
            for on in ("crossing_ise", "twelve_ise")
        ]
        told.append(
            f"{WAYS[k][0].upper()}{WAYS[k][1:]} is better than the old model on both in the median, by "
            f"{percent(100 * (1 - half[k]), '')} % and {percent(100 * (1 - twelve[k]), '')} %, and in {both} of "
            f"{counted(len(outcomes), 'run')} on its own. Flown, it changes ISE by {percent(flown[0])} % (crossing) and "
            f"{percent(flown[1])} % (12-corner). How much it helps, these runs leave open."
        )
    if not safe:
        told.append("No way of updating is better than the old model on both.")
    told.append(
        "Poor excitation does what the thesis fears: a model made of half a crossing alone is "
        f"{number(twelve[1])} times as wrong on manoeuvres that were not in it."
        if twelve[1] > 1.5
        else "The thesis's fear of poor excitation is not borne out here: a model made of half a crossing alone is "
        f"{number(twelve[1])} times as wrong as the old one on manoeuvres that were not in it."
    )
    return told
