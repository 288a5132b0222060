"""What further topics of a log show of the sensors, and what was repaired while it was read: on the page and on a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import Any

from ferryid.counts import counted, verb
from ferryid.diagnose import Comparison, Diagnosis, SecondSources

IN_TEXT = 4
"""Lines on a terminal; the others are on the page."""
NAMES = {"yaw_rate": "yaw rate", "speed": "speed over ground"}
ABOUT = (
    "Topics that the profile does not map, beside the mapped signal of their kind: position, heading, velocity, yaw rate. "
    "Listed are differences that are significant, with 95 % intervals, and the scatter that is left. Nothing of it changes a "
    "signal that is used, or enters a finding."
)


def of_all(diagnoses: Sequence[Diagnosis]) -> SecondSources | None:
    """Return what was compared over all of several logs; None where each log has its own."""
    if len(diagnoses) < 2 or any(one.sources is not diagnoses[0].sources for one in diagnoses):
        return None
    return diagnoses[0].sources


def section(sources: SecondSources) -> dict[str, Any]:
    """Return what the page shows; empty where no other topic was looked at."""
    if not sources:
        return {}
    return {
        "about": ABOUT,
        "rows": [
            {
                "name": one.candidate.label,
                "seems": f"{NAMES.get(one.kind, one.kind)}{f' ({one.axes})' if one.axes else ''}",
                "differences": _differences(one),
                "scatter": _scatter(one),
                "over": _over(one),
            }
            for one in sources.compared
        ],
        "witnesses": [one.says for one in sources.witnesses],
        "passed_over": _passed_over(sources),
    }


def lines(sources: SecondSources) -> list[str]:
    """Return what a terminal shows, one line each: odd ones first, then one topic of each sender and kind that differs."""
    shown = [f"instrument: {one.says}" for one in sources.witnesses]
    seen = set[tuple[str, int | str]]()
    agreeing = 0
    for one in sources.compared:
        sender = sources.senders.get(one.candidate.topic)
        key = (one.kind, one.candidate.topic if sender is None else sender)
        if key in seen:
            continue
        seen.add(key)
        if one.agrees:
            agreeing += 1
        else:
            shown.append(f"instrument: {one.says}")
    more = len(shown) - IN_TEXT
    shown = shown[:IN_TEXT]
    if more > 0:
        shown.append(f"instrument: {counted(more, 'more line')} on the page.")
    if agreeing:
        shown.append(
            f"instrument: {counted(agreeing, 'other signal')} {verb(agreeing, 'agrees')} with the mapped ones."
        )
    return shown


def repairs(diagnosis: Diagnosis) -> list[str]:
    """Return what was repaired of a log, without what its notes have already."""
    return [one for one in diagnosis.repairs if one not in diagnosis.notes]


def repair_lines(diagnosis: Diagnosis) -> list[str]:
    """Return the same for a terminal, the first few."""
    told = repairs(diagnosis)
    more = len(told) - IN_TEXT
    return [
        *(f"repaired: {one}" for one in told[:IN_TEXT]),
        *([f"repaired: {counted(more, 'more line')} on the page."] if more > 0 else []),
    ]


def _differences(one: Comparison) -> str:
    if not one.follows:
        return f"does not follow the mapped signal ({100.0 * one.share:.0f} % of its variance in common)"
    if one.same:
        return "repeats the mapped signal"
    return "; ".join(difference.says for difference in one.differences) or "none"


def _scatter(one: Comparison) -> str:
    return f"{one.scatter:.2g} {one.scatter_unit}" if one.follows and isfinite(one.scatter) else "–"


def _over(one: Comparison) -> str:
    logs = f" of {counted(one.logs, 'log')}" if one.logs > 1 else ""
    return f"{counted(one.windows, 'overlapping window')}{logs}{', receive times' if one.clock == 'receive' else ''}"


def _passed_over(sources: SecondSources) -> str:
    parts = [f"{counted(count, 'signal')} ({reason})" for reason, count in sources.passed_over.items()]
    return f"Passed over: {', '.join(parts)}." if parts else ""
