"""Why aims are missed, as far as the run itself shows it: sentences for the page, none where nothing is missed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from typing import Any

import numpy as np

from ferryid.counts import counted
from ferryid.identify.thresholds import IDENTIFY
from ferryid.validation.name_scores import Share
from ferryid.validation.records import DIAGNOSED
from tests.rivals.measures import LAST, MOST_DAMPING, OURS, Trials, expected, inertias_covered, ratio_of
from tests.rivals.recorded import INSIDER, Recorded
from tests.rivals.scores import HORIZONS_S
from tests.rivals.second_logs import BASES, FIT, NEAR, best, best_truly, position_error, result
from tests.rivals.simulated import Found, summary

OUTPUT_ERROR = "output error"
QUARTER = 0.75
"""Of the best rival's error: what free runs on recordings are to leave in the median."""
INERTIAS = ("m11", "m22", "m33")


def causes(found: Trials, recorded: Sequence[Recorded], second: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return why aims are missed, as a list in Markdown; empty where nothing is."""
    lines = [
        *(damping(found) if found else []),
        *(intervals(found) if found else []),
        *(second_logs(second) if second else []),
        *(free_runs(recorded) if recorded else []),
    ]
    return ["", "What the missed aims come to:", "", *(f"- {line}" for line in lines)] if lines else []


def damping(found: Trials) -> list[str]:
    """Return a sentence on each kind of trial whose damping force misses its aim, with the error that is to be expected."""
    lines = []
    for name, trials in found.items():
        value, limit = summary([one[OURS] for one in trials])[3], expected(trials)
        if value <= MOST_DAMPING:
            continue
        why = "the aim is below that" if limit > MOST_DAMPING else "more than is to be expected"
        lines.append(
            f"Damping force, {name}: {value:.1f} %, expected by the covariance of the fit {limit:.1f} %: {why}."
        )
    return lines


def intervals(found: Trials) -> list[str]:
    """Return whose intervals hold the truth too often or too seldom, and what chance leaves open."""
    covered = inertias_covered(found)
    known = covered[np.isfinite(covered)]
    share = Share(int(known.sum()), known.size)
    if 0.93 <= known.mean() <= 0.97:
        return []
    errors = np.abs([one[OURS].inertia for trials in found.values() for one in trials if isinstance(one[OURS], Found)])
    each = ", ".join(
        f"{name} {100.0 * np.nanmean(one):.1f} % (median error {100.0 * np.median(error):.1f} %)"
        for name, one, error in zip(INERTIAS, covered.T, errors.T, strict=True)
    )
    return [
        f"Intervals of the inertias: {share.text}. By inertia: {each}. Each has the same allowance of "
        f"{100.0 * IDENTIFY.inertia_error:g} % for what windows and time stamps shift an inertia by, which yaw needs in a "
        "breeze and surge does not."
    ]


def second_logs(found: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return what the free runs on second logs that are not the best come to, and what another basis would have done."""
    results = [result(one) for one in found]
    won = best(results, DIAGNOSED, position_error)
    lost = [(plain, one) for plain, one, good in zip(found, results, won, strict=True) if not good]
    if len(lost) <= 0.1 * len(results):
        return []
    place = list(results[0].methods).index(DIAGNOSED)
    noisy, unnamed, rest = [], [], []
    for plain, one in lost:
        known = {effect.effect for effect in one.methods[DIAGNOSED].effects or ()}
        group = noisy if best_truly(plain)[place] else unnamed if not known else rest
        group.append(str(plain["cell"]))
    lines = [
        f"Free runs on second logs, {counted(len(lost), 'log')} of {len(results)} on which another model is more than "
        f"5 % ahead: on {len(noisy)} ours is best from true starts{_named(noisy)}, so that the noise of the measured ones "
        f"decides; on {len(unnamed)} nothing is in the model beside the fit's correction{_named(unnamed)}; on {len(rest)} "
        f"something is{_named(rest)}."
    ]
    overall = {
        name: float(np.median([position_error(one.methods[name]) / (one.base.position_m or np.nan) for one in results]))
        for name in results[0].methods
        if name not in (DIAGNOSED, FIT)
    }
    rival = min(overall, key=lambda name: overall[name])
    ratio = np.median([position_error(one.methods[DIAGNOSED]) / position_error(one.methods[rival]) for one in results])
    lines.append(
        "The best rival of each log is another one from log to log, chosen after the fact. Of the position error of the one "
        f"that is best over all logs, {rival}, the diagnosed model has {ratio:.2f} in the median."
    )
    for basis in BASES:
        ratios = [
            (inf if (other := plain["bases"][basis][1]) is None else other) / position_error(one.methods[FIT])
            for plain, one in zip(found, results, strict=True)
        ]
        better = [str(plain["cell"]) for plain, ratio in zip(found, ratios, strict=True) if ratio < 1.0 / NEAR]
        worse = sum(ratio > NEAR for ratio in ratios)
        lines.append(
            f"`fit --basis {basis}`: position errors {np.median(ratios):.2f} times those of the default, "
            f"less by more than 5 % on {len(better)}{_named(better)}, more on {worse}."
        )
    return lines


def _named(cells: Sequence[str]) -> str:
    return f" ({', '.join(cells)})" if cells else ""


def free_runs(recorded: Sequence[Recorded]) -> list[str]:
    """Return how far below output error a fit to the judged recordings themselves is, where ours is not far enough."""
    ours, inside = [], []
    for one in recorded:
        mine, least = (ratio_of(score, one.scores[OUTPUT_ERROR]) for score in (one.scores[OURS], one.insider))
        if mine is not None and least is not None:
            ours.append(mine.value)
            inside.append(least.value)
    if not ours or np.median(ours) <= QUARTER:
        return []
    beyond = sum(one > QUARTER for one in inside)
    return [
        f"Position after {HORIZONS_S[LAST]:g} s against {OUTPUT_ERROR}, aim a quarter less in the median: "
        f"{np.median(ours):.2f}. *{INSIDER[0].upper()}{INSIDER[1:]}*, which has seen what it is judged on, has "
        f"{', '.join(f'{one:.2f}' for one in sorted(inside))} of that error in the {counted(len(inside), 'set')}: on {beyond} "
        "of them not even it is a quarter better, and what is left is the terms', the unmeasured weather's and the starts'."
    ]
