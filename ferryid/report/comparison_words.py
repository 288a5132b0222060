"""A comparison of models in words and tables, alike on the page and on a terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import degrees, isfinite, isnan, nan

import numpy as np

from ferryid.compare import (
    BASE,
    Coefficient,
    CommonErrors,
    ComparedModel,
    ComparisonResult,
    EffectRow,
    LogErrors,
    Statement,
    is_of_a_hull,
)
from ferryid.counts import counted
from ferryid.effects import effects
from ferryid.effects.wording import listed, titled
from ferryid.regression import REGRESSION
from ferryid.report.rounding import without_rounding
from ferryid.report.scale import scale_words
from ferryid.types import AXES

MANY = 4
"""With this many models or more, the base model among them, sentences hold each against the best, not every two."""
ALL = "all logs"
ABOUT_ERRORS = (
    "Errors on an axis are of the predicted acceleration, as a force, averaged over windows of {window_s:.3g} s: what a fit is "
    "judged by. Those of the force in single rows, mostly noise, are in the JSON."
)
ABOUT_P = (
    "p: how likely a ratio this far from one is if both err alike (bootstrap of blocks of each log, in pairs), corrected for "
    "the number of comparisons on a log (Holm). Intervals are 95 %, of each ratio by itself, so that of many some miss 1 by "
    "chance. They hold the scatter within these logs, not what another day brings. Free: rms error after a "
    "free run of so long."
)


def about_errors(result: ComparisonResult) -> str:
    """Return what the errors are of, and what their probabilities mean."""
    return f"{ABOUT_ERRORS.format(window_s=result.prediction_window_s)} {ABOUT_P}"


def scopes(result: ComparisonResult) -> list[tuple[str | None, str, CommonErrors]]:
    """Return key, title and errors for every log, and for all of them together where there are several."""
    logs: list[tuple[str | None, str, CommonErrors]] = [(log.name, log.name, log) for log in result.logs]
    return [*logs, *([(None, ALL, result.pooled)] if result.pooled else [])]


def about(scope: CommonErrors) -> str:
    """Return how much there is to judge by."""
    length = f" of {scope.block_s:.3g} s" if isinstance(scope, LogErrors) else ""
    return (
        f"{counted(scope.rows, 'row')}, {scope.seconds:.0f} s, {counted(scope.windows, 'overlapping window')}, "
        f"{counted(scope.blocks, 'block')}{length}, "
        f"{counted(scope.free_run.starts, 'free run')}"
    )


def warnings_of(scope: CommonErrors) -> tuple[str, ...]:
    """Return what a reader must know of a log; nothing for several together."""
    return scope.warnings if isinstance(scope, LogErrors) else ()


def sentences(result: ComparisonResult, on: str | None) -> list[str]:
    """Return what is better than what on a log, or on all; differences that were not shown in one sentence for two models."""
    labels = result.labels
    told = (_on_axes(result, on), "free run")
    rows = [row for row in result.statements if row.on == on and row.kind in told]
    if len(labels) >= MANY:
        rows = [row for row in rows if _best(rows, row) in (row.first, row.second)]
    # The models that were asked about come before their base model.
    rows.sort(key=lambda row: BASE in (row.first, row.second))
    shown = [row.sentence for row in rows if row.better] + [row.sentence for row in rows if row.perhaps]
    unclear = [row for row in rows if not (row.better or row.perhaps)]
    if len(labels) >= MANY:
        return shown + _by_quantity(unclear)
    pairs: dict[frozenset[str], list[Statement]] = {}
    for row in unclear:
        pairs.setdefault(frozenset((row.first, row.second)), []).append(row)
    return shown + [same[0].sentence if len(same) == 1 else _together(same, labels) for same in pairs.values()]


def outcomes(result: ComparisonResult, on: str | None) -> tuple[list[str], list[tuple[str, list[str]]]]:
    """Return the matrix of a log, or of all: heads of the columns, and for every two models in what the first is better.

    With many models each is held against the first alone.
    """
    told = [row for row in result.statements if row.on == on and row.kind in (_on_axes(result, on), "free run")]
    columns = list(dict.fromkeys((row.what, row.horizon_s) for row in told))
    heads = [what if horizon is None else f"{what}, free {horizon:g} s" for what, horizon in columns]
    labels = result.labels
    # The base model is what a model is held against.
    pairs = [(one, other) for j, one in enumerate(labels) for other in labels[:j]]
    pairs = [(other, one) if one == BASE else (one, other) for one, other in pairs]
    if len(labels) >= MANY:
        pairs = [pair for pair in pairs if labels[0] in pair]
    found = {(frozenset((row.first, row.second)), (row.what, row.horizon_s)): row for row in told}
    rows = []
    for one, other in pairs:
        cells = [_outcome(found.get((frozenset((one, other)), column)), one) for column in columns]
        rows.append((f"{one} against {other}", cells))
    return heads, rows


def _outcome(row: Statement | None, label: str) -> str:
    """Return what a statement says of one of its models, in two words."""
    if row is None or not isfinite(row.ratio):
        return "–"
    which = "better" if row.first == label else "worse"
    if row.better or row.perhaps:
        says = which if row.better else f"may be {which}"
        return says if row.evidence else f"{says}, no evidence"
    return "no difference" if isfinite(row.low) else "too little data"


def _on_axes(result: ComparisonResult, on: str | None) -> str:
    """Return the kind of the statements on axes that count: of accelerations in windows, of forces where no window fits."""
    scope = next(scope for key, _, scope in scopes(result) if key == on)
    return "prediction" if scope.windows else "force"


def _by_quantity(rows: Sequence[Statement]) -> list[str]:
    """Return one sentence on all that is not told apart from the best, for each quantity."""
    groups: dict[tuple[str, str], list[Statement]] = {}
    for row in rows:
        if isfinite(row.ratio):
            groups.setdefault((row.kind, row.what), []).append(row)
    told = []
    for same in groups.values():
        others = [f"{row.second} {number(row.ratio)}{_span(row.low, row.high)}" for row in same]
        says = "no difference is shown" if isfinite(same[0].low) else "there is too little data to decide"
        told.append(f"{same[0].place}, {same[0].first} errs least, but {says}: its error over that of {listed(others)}")
    return told


def _best(rows: Sequence[Statement], row: Statement) -> str:
    """Return the model with the least error of what a row compares: the one that no other has a ratio below one to."""
    alike = [one for one in rows if (one.kind, one.what) == (row.kind, row.what)]
    beaten = {one.second for one in alike if isfinite(one.ratio)}
    return next((one.first for one in alike if one.first not in beaten), row.first)


def _together(rows: Sequence[Statement], labels: Sequence[str]) -> str:
    """Return one sentence on all that does not tell two models apart, the ratio of the first over the second with each."""
    first, second = sorted((rows[0].first, rows[0].second), key=labels.index)
    if first == BASE:
        first, second = second, first
    parts = []
    for row in rows:
        ratio, low, high = row.ratio, row.low, row.high
        if row.first != first:
            ratio, low, high = (1.0 / one if isfinite(one) and one > 0.0 else nan for one in (ratio, high, low))
        p = f", p {row.p_corrected:.2f}" if isfinite(row.p_corrected) else ""
        parts.append(f"{row.what} {number(ratio)}{_span(low, high)}{p}")
    if not isfinite(rows[0].low):
        return f"too little data to distinguish {first} from {second}, error of the first over the second's: {listed(parts)}"
    return f"no difference shown between {first} and {second}, error of the first over the second's: {listed(parts)}"


def _span(low: float, high: float) -> str:
    return f" [{number(low)}, {number(high)}]" if isfinite(low) and isfinite(high) else ""


def number(value: float, pattern: str = ".3g") -> str:
    """Return a number, or a dash where there is none."""
    return format(value, pattern) if isfinite(value) else "–"


def headline(result: ComparisonResult) -> str:
    """Return which model errs least on each axis, over all logs, whether that is more than chance, and what to keep."""
    known = scopes(result)
    if not known:
        return f"{counted(len(result.models), 'model')} by their coefficients alone: no log was given to judge them on."
    on, title, scope = known[-1]
    kind = _on_axes(result, on)
    if not scope.windows and not any(isfinite(row.low) for row in result.statements if row.on == on):
        return f"Too little data to compare the models, {title}: {scope.seconds:.0f} s, of which nothing is shown."
    groups: dict[tuple[str, str], list[str]] = {}
    for axis in AXES:
        rows = [row for row in result.statements if (row.on, row.kind, row.what) == (on, kind, axis)]
        if not rows:
            continue
        if scope.scores and all(isnan(scores.mse[axis]) for scores in scope.scores.values()):
            continue  # nothing was measured there
        best = _best(rows, rows[0])
        own = [row for row in rows if row.first == best]
        if not all(isfinite(row.ratio) for row in rows):
            sure = "as far as the data show"
        elif all(row.better for row in own):
            sure = "beyond chance" if all(row.evidence for row in own) else "where it was trained, which is no evidence"
        else:
            sure = "which may be chance" if isfinite(own[0].p) else "with too little data to decide"
        groups.setdefault((best, sure), []).append(axis)
    told = [f"{best} on {listed(axes)}, {sure}" for (best, sure), axes in groups.items()]
    kept = ""
    if BASE in result.labels and len(result.labels) > 1:
        shown = [
            row for row in result.statements
            if (row.on, row.kind, row.second) == (on, kind, BASE) and row.better and row.evidence
        ]  # fmt: skip
        free = {
            row.first for row in result.statements
            if (row.on, row.kind, row.second) == (on, "free run", BASE) and row.better and row.evidence
        }  # fmt: skip
        if not shown and free:
            kept = "No fitted model is shown to have less prediction error than the profile's hull, but run free "
            kept += f"{listed(sorted(free))} {'is' if len(free) == 1 else 'are'} better. "
        elif shown:
            kept = _partly(result, on, kind, shown)
        elif _undecided(result, on, kind):
            kept = _too_little(result, scope)
        else:
            kept = "No fitted model is shown to be better than the profile's hull: keep the hull. "
    if not told:
        return f"{kept}No error could be compared on {title}."
    return f"{kept}Least {kind} error, {title}: {'; '.join(told)}."


def _undecided(result: ComparisonResult, on: str | None, kind: str) -> bool:
    """Tell whether models were held against their base model, none of them with an interval."""
    known = [
        row for row in result.statements
        if (row.on, row.kind) == (on, kind) and BASE in (row.first, row.second) and isfinite(row.ratio)
    ]  # fmt: skip
    return bool(known) and not any(isfinite(row.low) for row in known)


def _too_little(result: ComparisonResult, scope: CommonErrors) -> str:
    """Return how much there is to decide about the base model by, and how much is needed."""
    needed = counted(REGRESSION.paired_fewest_blocks, "block")
    # Blocks of what windows predict are no shorter than two of them.
    block_s = max(2.0 * result.prediction_window_s, *(log.block_s for log in result.logs))
    return (
        "Too little data to decide whether a fitted model is better than the profile's hull: an interval needs "
        f"{needed} of {block_s:.3g} s, and {scope.seconds:.0f} s are compared. Give longer logs, or more of them. "
    )


def _partly(result: ComparisonResult, on: str | None, kind: str, shown: Sequence[Statement]) -> str:
    """Return on which axes fitted models are shown to be better than their base model, where that is not so on all of them."""
    told = []
    for label in dict.fromkeys(row.first for row in shown):
        against = [
            row for row in result.statements
            if (row.on, row.kind) == (on, kind) and {row.first, row.second} == {label, BASE} and isfinite(row.ratio)
        ]  # fmt: skip
        better = [row.what for row in shown if row.first == label]
        worse = [row.what for row in against if row.better == BASE and row.evidence]
        open_ = [row.what for row in against if row.what not in better and row.what not in worse]
        if not worse and not open_:
            continue
        rest = [f"worse on {listed(worse)}"] if worse else []
        rest += [f"not shown to be better or worse on {listed(open_)}"] if open_ else []
        told.append(f"{label} is better than the {BASE} on {listed(better)}, {' and '.join(rest)}")
    return f"{'; '.join(told)}. " if told else ""


def told_horizon(scope: CommonErrors) -> int:
    """Return the place of the horizon that free runs are told at: that of the sentences, else the longest with any run."""
    runs = scope.free_run
    if runs.told_s is not None:
        return runs.horizons_s.index(runs.told_s)
    return max((h for h, count in enumerate(runs.counted) if count), default=0)


def tracking_line(scope: CommonErrors) -> str:
    """Return how closely the vessel kept to the reference in a log; empty where there is none."""
    found = scope.tracking if isinstance(scope, LogErrors) else None
    if found is None:
        return ""
    off = ((found.position_m, "m"), (degrees(found.heading_rad), "deg"))
    within = [f"{number(value)} {unit}" for value, unit in off if isfinite(value)]
    return (
        f"the controller that sailed it kept to its reference within {listed(within)} (rms, {found.seconds:.0f} s): "
        f"ISE {number(found.ISE)} m²s, IAE {number(found.IAE)} m s, IAEW {number(found.IAEW)} m s J, "
        f"EC {number(found.EC)} J"
    )


def score_columns(scope: CommonErrors) -> list[str]:
    """Return the heads of the columns of `score_rows`."""
    horizon = scope.free_run.horizons_s[told_horizon(scope)]
    return [
        *(f"rms {axis} [{unit}]" for axis, unit in zip(AXES, ("N", "N", "N·m"), strict=True)),
        *(f"R² {axis}" for axis in AXES),
        *(f"free {horizon:g} s {what}" for what in ("[m]", "[deg]")),
    ]


def score_rows(result: ComparisonResult, scope: CommonErrors) -> list[tuple[str, list[str]]]:
    """Return for every model: rms error and R² per axis, in windows where any fits, and how far it strays when run free."""
    h = told_horizon(scope)
    rows = []
    for label in result.labels:
        scores = scope.scores[label]
        errors = scores.prediction if scope.windows else scores
        cells = [
            *(number(errors.mse[axis] ** 0.5) for axis in AXES),
            *(number(errors.r2[axis], ".3f") for axis in AXES),
            number(scores.free_run["position_m"][h]),
            number(degrees(scores.free_run["heading_rad"][h])),
        ]
        rows.append((label, cells))
    return rows


def model_line(model: ComparedModel) -> str:
    """Return what a model is, in half a sentence."""
    if model.is_base:
        return "the hull in the profile alone"
    parts = ["a refitted hull" if model.basis == "none" else f"basis {model.basis}"]
    changed = scale_words(model.scale)
    if changed:
        parts.append(f"on a base model with {changed}")
    if model.diagnosed:
        parts.append("with what a diagnosis found")
    if model.training:
        parts.append(f"trained on {listed(model.training)}")
    parts.append("accepted" if model.accepted else "not accepted")
    return ", ".join(parts)


Values = tuple[str, str, Mapping[str, Coefficient]]
"""Name and unit of a coefficient, and its values by the labels of the models."""


def coefficient_table(result: ComparisonResult) -> list[Values]:
    """Return the coefficients of the equations of motion, and below them the terms that are no hull's."""
    rows = result.coefficients.terms
    named = [(f"{_constant(row.term)} in {row.axis}", row) for row in rows if not is_of_a_hull(row.term, row.axis)]
    return [*physical_table(result), *((name, row.unit, row.values) for name, row in named)]


def physical_table(result: ComparisonResult) -> list[Values]:
    """Return the coefficients of the equations of motion, but for those that no model has."""
    rows = _without_rounding([(row.coefficient, row.unit, row.values) for row in result.coefficients.physical])
    return [row for row in rows if any(cell(one)[0] != NONE for one in row[2].values())]


def term_table(result: ComparisonResult) -> list[Values]:
    """Return the terms of every axis as the models have them."""
    return _without_rounding([(f"{row.term} in {row.axis}", row.unit, row.values) for row in result.coefficients.terms])


def _without_rounding(rows: Sequence[Values]) -> list[Values]:
    """Return rows with zero for what is nothing but rounding."""
    labels = {label for _, _, values in rows for label in values}
    shown = {
        label: without_rounding(
            {
                name: np.array([one.value, one.low, one.high])
                for name, _, values in rows
                if (one := values.get(label)) is not None
            }
        )
        for label in labels
    }
    return [
        (name, unit, {label: Coefficient(*shown[label][name].tolist()) for label in values})
        for name, unit, values in rows
    ]


NONE = "–"
"""In the place of a coefficient that a model does not have."""
HELD = "held"
"""In the place of the interval of a coefficient that a fit did not estimate."""


def estimated(result: ComparisonResult) -> frozenset[str]:
    """Return the labels of the models whose coefficients have intervals: what has none in them was held, as in the profile."""
    known = result.coefficients
    every = (*(row.values for row in known.physical), *(row.values for row in known.terms))
    return frozenset(label for values in every for label, one in values.items() if _has_interval(one))


def _has_interval(one: Coefficient) -> bool:
    return isfinite(one.low) and isfinite(one.high) and one.low != one.high


def cell(one: Coefficient | None, *, of_fit: bool = False) -> tuple[str, str]:
    """Return a coefficient and its interval as text; a dash for one that a model does not have.

    `of_fit` is whether the others of its model have intervals: then one without any was held.
    """
    if one is None or (one.value == 0.0 and not _has_interval(one)):
        return NONE, ""
    if not _has_interval(one):
        return number(one.value, ".4g"), HELD if of_fit else ""
    return number(one.value, ".4g"), f"{number(one.low, '.4g')} to {number(one.high, '.4g')}"


def _constant(term: str) -> str:
    return "constant" if term == "1" else term


def render_effects(rows: Sequence[EffectRow]) -> list[str]:
    """Return effects that differ as lines."""
    lines = []
    for row in rows:
        title = titled(effects()[row.effect].title, row.instance)
        lines.append(f"{title}, {'a condition of ' + row.log if row.log else 'a property of the vessel'}")
        lines += [f"  {label}: {found.sentence if found else 'not in it'}" for label, found in row.values.items()]
    return lines
