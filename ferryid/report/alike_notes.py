"""Notes on several logs that differ in their numbers only, said once."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ferryid.counts import counted
from ferryid.effects.wording import listed

_NUMBER = re.compile(r"(?<![\w./:-])[-+−]?\d+(?:\.\d+)?(?![\w/:-]|\.\d)")
"""A number in a sentence, of which neither names nor dates are."""

SHOWN_LOGS = 8
"""Names of logs in a line; the table of logs has all of them."""


def said_once(notes: Sequence[tuple[str, str]]) -> list[str]:
    """Return a line for each note of a log, given as (log, note), and one line for several that differ in numbers only.

    Numbers that differ are given as a range, in the order of the first log that has such a note.
    """
    groups: dict[str, list[tuple[str, str]]] = {}
    for log, note in notes:
        groups.setdefault(_NUMBER.sub("#", note), []).append((log, note))
    return [line for group in groups.values() for line in _lines(group)]


def _lines(group: Sequence[tuple[str, str]]) -> list[str]:
    logs = list(dict.fromkeys(log for log, _ in group))
    if len(group) == 1 or len(logs) < len(group):
        return [f"{log}: {note}" for log, note in group]
    columns = zip(*(_NUMBER.findall(note) for _, note in group), strict=True)
    ranges = iter([_range(column) for column in columns])
    shown = logs if len(logs) <= SHOWN_LOGS else [*logs[: SHOWN_LOGS - 1], f"{len(logs) - SHOWN_LOGS + 1} more"]
    return [f"{counted(len(logs), 'log')}, {listed(shown)}, each: {_NUMBER.sub(lambda _: next(ranges), group[0][1])}"]


def _range(numbers: Sequence[str]) -> str:
    low, high = (which(numbers, key=lambda text: float(text.replace("−", "-"))) for which in (min, max))
    return low if float(low.replace("−", "-")) == float(high.replace("−", "-")) else f"{low} to {high}"
