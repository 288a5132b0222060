"""Which of two models is better, as sentences, with what the number of comparisons leaves of their certainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, sqrt

import numpy as np

from ferryid.compare.comparison_result import Statement, place_of
from ferryid.compare.thresholds import COMPARE
from ferryid.regression.resampling import PairedRatios, holm
from ferryid.types import AXES

QUANTITIES = ("position", "heading", "speed", "yaw rate")
"""What free runs are judged by, in the order of their errors."""
TOLD_QUANTITIES = 2
"""How many of these have sentences; the others follow from them."""
Cell = tuple[str, str, float | None, PairedRatios, int]
"""Kind, axis or quantity, horizon [s], and the column of the ratios that a comparison is made of."""


@dataclass(frozen=True)
class PairedErrors:
    """Force and free runs of some models on one log, or on all (`on` is None then).

    Attributes
    ----------
    on
        Name of the log.
    labels
        Names of the models.
    force
        Errors of the force in single rows, on the three axes.
    prediction
        Errors of the acceleration in windows, on the three axes.
    runs
        Free runs at each horizon, with the four columns of `QUANTITIES`.
    horizons_s
        Horizons [s].
    told_s
        The horizon that sentences are made of, None where no horizon has intervals.
    trained
        Names of the models that have learnt from what they are judged on.
    """

    on: str | None
    labels: tuple[str, ...]
    force: PairedRatios
    prediction: PairedRatios
    runs: tuple[PairedRatios, ...]
    horizons_s: tuple[float, ...]
    told_s: float | None
    trained: frozenset[str]


def comparison_statements(judged: PairedErrors) -> list[Statement]:
    """Return one entry for every two models and everything that they are compared by.

    Probabilities are corrected for the number of these entries after Holm; intervals are of each by itself. Errors of the
    force in single rows repeat those of the acceleration in windows, with more noise: they are corrected by themselves.
    """
    cells: list[Cell] = [("prediction", axis, None, judged.prediction, column) for column, axis in enumerate(AXES)]
    if judged.told_s is not None:
        runs = judged.runs[judged.horizons_s.index(judged.told_s)]
        cells += [("free run", name, judged.told_s, runs, k) for k, name in enumerate(QUANTITIES[:TOLD_QUANTITIES])]
    in_rows: list[Cell] = [("force", axis, None, judged.force, column) for column, axis in enumerate(AXES)]
    return [*_statements(judged, cells), *_statements(judged, in_rows)]


def _statements(judged: PairedErrors, cells: Sequence[Cell]) -> list[Statement]:
    """Return the entries of one family of comparisons."""
    corrected = holm(np.column_stack([paired.p[:, column] for *_, paired, column in cells]))
    rows = []
    for k, (i, j) in enumerate(judged.force.pairs):
        for place, (kind, what, horizon, paired, column) in enumerate(cells):
            if kind != "force" and not isfinite(paired.ratio[k, column]):
                continue
            numbers = [float(values[k, column]) for values in (paired.ratio, paired.low, paired.high)]
            rows.append(
                _statement(
                    judged,
                    (judged.labels[i], judged.labels[j]),
                    (kind, what, horizon),
                    # Errors of free runs are told as such, not squared.
                    [sqrt(value) if kind == "free run" and value >= 0.0 else value for value in numbers],
                    (float(paired.p[k, column]), float(corrected[k, place])),
                )
            )
    return rows


def _statement(
    judged: PairedErrors,
    pair: tuple[str, str],
    of: tuple[str, str, float | None],
    numbers: Sequence[float],
    chances: tuple[float, float],
) -> Statement:
    kind, what, horizon = of
    (first, second), (ratio, low, high), (p, corrected) = pair, numbers, chances
    if ratio > 1.0:
        first, second, ratio, low, high = second, first, 1.0 / ratio, 1.0 / high, 1.0 / low
    known, alike = isfinite(low + high) and isfinite(p), 1.0 - ratio < COMPARE.alike
    clear = known and not alike and corrected <= COMPARE.significance
    hint = known and not alike and not clear and p <= COMPARE.significance and corrected <= COMPARE.maybe
    evidence = not ((clear or hint) and first in judged.trained)
    error = {"force": "MSE", "prediction": "prediction MSE"}.get(kind, f"{what} error")
    place = place_of(kind, what, horizon)
    # In words: "of the other's [0.1, 0.2]" reads as if the brackets belonged to the other model.
    span = f" (95 % interval {low:.3g} to {high:.3g})" if known else ""
    if not isfinite(ratio):
        says = f"{first} and {second} cannot be compared {place}: one of them makes no error, or there is nothing to judge by"
    elif alike:
        says = (
            f"{first} and {second} are alike {place}: their {error} differs by less than {100.0 * COMPARE.alike:.1f} %"
        )
    elif not known:
        says = f"too little data to distinguish {first} from {second} {place}: {error} {ratio:.3g} of the other's"
    elif clear:
        says = f"{first} is better than {second} {place} (p {format_probability(corrected)}): "
        says += f"its {error} is {ratio:.3g} of the other's{span}"
    elif hint:
        alone, among = format_probability(p), format_probability(corrected)
        says = f"{first} may be better than {second} {place} (p {alone} by itself, {among} among all): "
        says += f"its {error} is {ratio:.3g} of the other's{span}"
    else:
        says = (
            f"no difference shown between {first} and {second} {place} (p {format_probability(corrected)}): "
            f"{error} of the first {ratio:.3g} of the other's{span}"
        )
    if not evidence:
        says += f"; no evidence, as {first} was fitted to {'this log' if judged.on else 'some of these logs'}"
    return Statement(
        on=judged.on,
        kind=kind,
        what=what,
        horizon_s=horizon,
        first=first,
        second=second,
        ratio=ratio,
        low=low,
        high=high,
        p=p,
        p_corrected=corrected,
        better=first if clear else None,
        perhaps=first if hint else None,
        evidence=evidence,
        sentence=says,
    )


def format_probability(p: float) -> str:
    """Return a probability as people write it."""
    return f"{p:.1g}" if p < 0.1 else f"{p:.2f}"
