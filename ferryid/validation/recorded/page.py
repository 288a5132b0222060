"""The page of a proof on real recordings: what was concealed, what was found of it, and what this cannot show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ferryid.counts import counted
from ferryid.report.validation_figures import Detected, detection_curves
from ferryid.validation.name_scores import Share
from ferryid.validation.page_parts import BEYOND, answers, error_figure, error_row, few, how_well_known, render
from ferryid.validation.recorded.case_sampling import MULTIPLES, NotMade
from ferryid.validation.recorded.doses import RELATIVE_STEP, Doses, joined, pooled
from ferryid.validation.recorded.effects import ACTUATOR, LOAD, SENSOR, concealments
from ferryid.validation.recorded.scores import (
    TWICE_DISTINCT,
    DoseResponse,
    Later,
    Missed,
    Moved,
    Paired,
    RecordedScores,
    from_twice_distinct,
    recorded_targets,
)

FAMILIES = {SENSOR: "Sensors", ACTUATOR: "Actuators", LOAD: "Loads"}


def figures(scores: RecordedScores) -> dict[str, str]:
    """Return the page's figures by file name, as SVG text."""
    drawn = {}
    shown = pooled([one.doses for one in scores.responses])
    if shown:
        drawn["detection.svg"] = detection_curves([_detected(one) for one in shown])
    return drawn | error_figure(scores.recoveries)


def page(result: Mapping[str, Any], scores: RecordedScores) -> str:
    """Return the page as Markdown; figures lie in the folder ``proof-real`` beside it.

    Parameters
    ----------
    result
        Seed, commitment, counts and settings of the run.
    scores
        Of its cases.
    """
    known = concealments()
    tried = {one.effect for one in (*scores.responses, *scores.changes)} | {one.effect for one in scores.gross}
    context = {
        "scores": scores,
        "cases": counted(scores.runs, "case"),
        "families": [
            (title, [(one.id, one.how) for one in known.values() if one.family == family and one.id in tried])
            for family, title in FAMILIES.items()
        ],
        "unaltered": [
            (
                one.recording,
                one.vessel,
                one.verdict.replace("_", " "),
                f"{one.seconds:.0f}",
                _list(one.named),
                _list(one.hinted),
            )
            for one in scores.unaltered
        ],
        "responses": [_row(one) for one in scores.responses],
        "later": [_later(one) for one in scores.later],
        "moved": [_moved(one) for one in scores.moved],
        "missed": [_missed(one) for one in scores.missed],
        "below_distinct": sum(one.of_distinct < TWICE_DISTINCT for one in scores.missed),
        "pairs": [_pair(one) for one in scores.pairs],
        "gross": [
            (one.effect, one.recording, one.outcome, ", ".join(one.named) or "none", "yes" if one.noticed else "no")
            for one in scores.gross
        ],
        "wrong": _counts(scores.wrong_names),
        "gone": _counts(scores.gone_names),
        "noticed_errors": [error_row(one) for one in scores.noticed_recoveries[1:]],
        "not_made": _not_made(scores),
        "by_family": _by_family(scores),
        "multiples": [f"{one:g}" for one in MULTIPLES],
        "by_multiple": _by_multiple(scores.responses),
        "how_well_known": how_well_known([one.curve for one in pooled([each.doses for each in scores.responses])]),
        "changes": [_row(one) for one in scores.changes],
        "changes_by_multiple": _by_multiple(scores.changes),
        "changes_from_twice_distinct": from_twice_distinct(scores.changes),
        "from_twice_distinct": from_twice_distinct(scores.responses),
        "distinct_by_family": _distinct_by_family(scores),
        "figures": figures(scores),
    }
    return render(
        "validation_recorded.md", result, scores.seconds, recorded_targets(scores), scores.recoveries, context
    )


def _row(one: DoseResponse) -> tuple[str, ...]:
    unit = concealments()[one.effect].unit
    if one.curve is None or one.noticed_curve is None:
        return one.effect, one.recording, unit, "", "", "", "", "", "the recording as it was has this name"
    note = ", ".join(f"{count} {what}" for what, count in one.instead.items())
    named = f"{sum(one.named)} of {len(one.named)}"
    least, distinct = (
        f"{float(np.median(some)):.3g}" if any(some) else "" for some in (one.oracle_sizes, one.distinct_sizes)
    )
    return one.effect, one.recording, unit, least, distinct, named, one.curve.text, one.noticed_curve.text, note


def _later(one: Later) -> tuple[str, ...]:
    outcome = "named" if one.named else "a hint" if one.noticed else "no"
    found = "none" if one.found_s is None else f"{one.found_s:.0f}"
    size = f"{one.size:.2g} {concealments()[one.effect].unit}"
    return one.effect, one.recording, size, f"{one.onset_s:.0f}", outcome, found


def _pair(one: Paired) -> tuple[str, ...]:
    outcomes = [
        "named" if named else "a hint" if noticed else "no"
        for named, noticed in zip(one.named, one.noticed, strict=True)
    ]
    return one.recording, *one.effects, *outcomes


def _missed(one: Missed) -> tuple[str, ...]:
    distinct = f"{one.of_distinct:.1f}" if one.of_distinct else ""
    why = f"{one.outcome}: {one.why}" if one.why else one.outcome
    return one.effect, one.recording, f"{one.of_oracle:.1f}", distinct, why, "; ".join(one.instead) or "nothing"


def _moved(one: Moved) -> tuple[str, ...]:
    found = "not found" if one.found is None else f"{one.found:.3g} ({one.low:.3g} to {one.high:.3g})"
    numbers = (f"{value:.3g}" for value in (one.before, one.concealed, one.expected))
    return one.effect, one.recording, one.parameter, *numbers, found


def _detected(one: Doses) -> Detected:
    return Detected(
        one.effect,
        "multiple of the oracle's size",
        (MULTIPLES[0] / BEYOND, MULTIPLES[-1] * RELATIVE_STEP),
        answers(one.multiples, one.named, one.curve),
        answers(one.multiples, one.noticed, one.noticed_curve),
    )


def _by_multiple(responses: Sequence[DoseResponse]) -> list[tuple[str, ...]]:
    """Return for each family, each effect and all how many doses were named at each multiple, and from which on they are."""
    known, every = concealments(), [one.doses for one in responses]
    rows = [("all", joined("all", every), "")]
    for family, title in FAMILIES.items():
        mine = [one for one in every if known[one.effect].family == family]
        # Several effects together have no size of their own.
        rows += [(f"*{title}*", joined(family, mine), ""), *((one.effect, one, one.curve.text) for one in pooled(mine))]
    return [
        (title, *(few(one.at(level)) for level in range(len(MULTIPLES))), reliable)
        for title, one, reliable in rows
        if one.multiples
    ]


def _distinct_by_family(scores: RecordedScores) -> str:
    """Return how many doses of twice the distinct size and more each family has, and how many were named, as a phrase."""
    told = []
    for family, title in FAMILIES.items():
        share = from_twice_distinct([one for one in scores.responses if concealments()[one.effect].family == family])
        if share.of:
            told.append(f"{title.lower()} {share.count}/{share.of}")
    return ", ".join(told)


def _not_made(scores: RecordedScores) -> list[str]:
    """Return a line for each recording: effects that it cannot carry by their reasons, and sizes that it cannot."""
    lines: dict[str, dict[str, list[NotMade]]] = {}
    for one in scores.not_made:
        reason = one.why
        if one.effect:
            reason = one.why.partition(f" cannot be concealed in {one.recording}: ")[2] or one.why
        if one.size:
            _, inexpressible, why = one.why.rpartition(" rows cannot express it, ")
            reason = f"more than 2 % of the rows cannot express it, {why}" if inexpressible else why.partition(": ")[2]
        lines.setdefault(one.recording, {}).setdefault(reason.removesuffix("."), []).append(one)
    return [
        f"{recording}: {'; '.join(_lacking(reason, some) for reason, some in by_reason.items())}."
        for recording, by_reason in lines.items()
    ]


def _lacking(reason: str, some: Sequence[NotMade]) -> str:
    """Return effects, or sizes of one, with the reason why a recording lacks them."""
    if not some[0].effect:
        return reason
    parts = []
    for effect in dict.fromkeys(one.effect for one in some):
        sizes = [one.size for one in some if one.effect == effect and one.size]
        # Two effects together have no size.
        of = f" of {' and '.join(f'{size:.3g}' for size in sizes)} {concealments()[effect].unit}" if sizes else ""
        parts.append(f"{effect}{of}")
    return f"{', '.join(parts)} ({reason})"


def _by_family(scores: RecordedScores) -> list[tuple[str, ...]]:
    """Return for each family how many doses there were, were named, and were named or a new hint."""
    rows = list[tuple[str, ...]]()
    for family, title in FAMILIES.items():
        some = [one for one in scores.responses if concealments()[one.effect].family == family]
        some_later = [one for one in scores.later if concealments()[one.effect].family == family]
        named = [flag for one in some for flag in one.named] + [one.named for one in some_later]
        noticed = [flag for one in some for flag in one.noticed] + [one.noticed for one in some_later]
        if named:
            rows.append((title, Share(sum(named), len(named)).text, Share(sum(noticed), len(noticed)).text))
    return rows


def _list(names: tuple[str, ...]) -> str:
    return ", ".join(names) or "none"


def _counts(names: Mapping[str, int]) -> str:
    return ", ".join(f"{count} {name}" for name, count in names.items())
