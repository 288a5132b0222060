"""What was found in the logs of a batch, each in one line: effects, in how many logs, of what size; and damaged logs."""

from __future__ import annotations

from collections.abc import Sequence
from math import nan
from pathlib import PurePath

from ferryid.counts import counted
from ferryid.diagnose import JUDGING, UNKNOWN, Estimate
from ferryid.effects.wording import uncapitalised
from ferryid.report.batch_rows import FindingSummary, SummaryRow
from ferryid.report.diagnosis_words import sized, title

NAMED = 5
"""Logs that are named in a line; the others are counted."""


def found_in(rows: Sequence[SummaryRow]) -> str:
    """Return the findings that are more than hints, the commonest first; with its size what only one log has. May be empty."""
    by_key: dict[tuple[str, str | None], list[FindingSummary]] = {}
    for row in rows:
        for one in row.findings:
            if one.effect != UNKNOWN and one.probability > JUDGING.hint_probability:
                by_key.setdefault(one.key, []).append(one)
    every = sorted(by_key.values(), key=len, reverse=True)
    told = ", ".join(f"{_named(some)} in {counted(len(some), 'log')}" for some in every)
    return f"{told[:1].upper()}{told[1:]}" if told else ""


def losses_in(rows: Sequence[SummaryRow]) -> str:
    """Return how many logs are damaged, and which: a log that was cut is done like any other, but not whole. Empty without."""
    damaged = [PurePath(row.log).name for row in rows if is_damaged(row)]
    if not damaged:
        return ""
    more = f" and {len(damaged) - NAMED} more" if len(damaged) > NAMED else ""
    return f"{counted(len(damaged), 'log')} damaged, of which some is lost: {', '.join(damaged[:NAMED])}{more}"


def copies_in(rows: Sequence[SummaryRow]) -> str:
    """Return which logs hold the same recording byte by byte, each of which counts for itself. Empty without."""
    logs: dict[str, dict[str, None]] = {}
    for row in rows:
        if row.sha256:
            logs.setdefault(row.sha256, {})[row.log] = None
    same = [" = ".join(_distinct(list(one))) for one in logs.values() if len(one) > 1]
    more = f" and {len(same) - NAMED} more" if len(same) > NAMED else ""
    return f"Identical logs, each of which counts: {', '.join(same[:NAMED])}{more}" if same else ""


def _distinct(logs: Sequence[str]) -> list[str]:
    """Return the names of some logs, the first `NAMED` of them, with their folders where they have one name."""
    names = [PurePath(one).name for one in logs]
    told = names if len(set(names)) == len(names) else [str(PurePath(*PurePath(one).parts[-2:])) for one in logs]
    return told[:NAMED] + [f"{len(told) - NAMED} more"] * (len(told) > NAMED)


def is_damaged(row: SummaryRow) -> bool:
    """Return whether some of a log is lost."""
    return row.lost is not None and bool(row.lost.messages or row.lost.unknown)


def _named(some: Sequence[FindingSummary]) -> str:
    return sized_name(some[0]) if len(some) == 1 else _name(some[0])


def _name(one: FindingSummary) -> str:
    return uncapitalised(title(one.effect, one.instance))


def sized_name(first: FindingSummary) -> str:
    """Return the name of a finding with its size: a breeze and a thruster at half its force are not alike."""
    known = {
        key: Estimate(one.value, nan if one.low is None else one.low, nan if one.high is None else one.high, one.unit)
        for key, one in first.parameters.items()
        if one.value is not None
    }
    return sized(_name(first), first.effect, known)
