"""What is said of single logs of several: once, with ranges, where it differs by its numbers alone."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ferryid.counts import counted, verb

MOST_LOGS_SAID = 10
"""Logs of an archive whose own warnings are repeated for all of it."""
ALIKE_LOGS = 3
"""Logs of which the same is said with other numbers, from which on it is said once."""
NAMED_LOGS = 3
"""Logs that are named where the same is said of more of them."""
LEFT_OUT = re.compile(r"(?P<whole>Left out of the [\w ]+): (?P<log>[^:]+): (?P<why>.+)", re.DOTALL)
"""What is said of a log that is left out: of what, which log, and why."""
NUMBER = re.compile(r"(?<![\w.:,-])\d+(?:,\d{3})*(?:\.\d+)?(?![\w.:-]*\w)")
PLACE = "\0"
"""A number without a sign that is no part of a name or of a time, and what stands in its place in the shape of a sentence."""


def log_warnings(told: Sequence[tuple[str, Sequence[str]]]) -> tuple[str, ...]:
    """Return what is told of single logs, each with its name, of the first `MOST_LOGS_SAID` that have anything to tell.

    What differs by its numbers alone in `ALIKE_LOGS` logs or more is one sentence with their ranges.

    Parameters
    ----------
    told
        Name of every log, and sentences.
    """
    by_shape: dict[str, dict[str, str]] = {}
    for name, sentences in told:
        for sentence in sentences:
            by_shape.setdefault(NUMBER.sub(PLACE, sentence), {})[name] = sentence
    alike = {shape: of_logs for shape, of_logs in by_shape.items() if len(of_logs) >= ALIKE_LOGS}
    said = [
        f"{counted(len(of_logs), 'log')}: {_ranged(shape, list(of_logs.values()))}" for shape, of_logs in alike.items()
    ]
    rest = [(name, [one for one in sentences if NUMBER.sub(PLACE, one) not in alike]) for name, sentences in told]
    those = [(name, sentences) for name, sentences in rest if sentences]
    said += [f"{name}: {sentence}" for name, sentences in those[:MOST_LOGS_SAID] for sentence in sentences]
    if (others := len(those) - MOST_LOGS_SAID) > 0:
        said.append(f"{counted(others, 'more log')} {verb(others, 'has')} such warnings, see the JSON.")
    return tuple(said)


def left_out_together(sentences: Sequence[str]) -> list[str]:
    """Return sentences in which logs that are left out for one reason are named together, where the first of them stands.

    Reasons are alike that differ by their numbers alone, in `ALIKE_LOGS` logs or more; all other sentences stay as they are.
    """
    alike: dict[tuple[str, str], list[tuple[str, str, str]]] = {}
    for sentence in sentences:
        if found := LEFT_OUT.fullmatch(sentence):
            of_shape = alike.setdefault((found["whole"], NUMBER.sub(PLACE, found["why"])), [])
            of_shape.append((sentence, found["log"], found["why"]))
    together = dict[str, str]()
    taken = set[str]()
    for (whole, shape), logs in alike.items():
        if len(logs) < ALIKE_LOGS:
            continue
        names = ", ".join(name for _, name, _ in logs[:NAMED_LOGS])
        more = len(logs) - NAMED_LOGS
        reason = _ranged(shape, [why for _, _, why in logs])
        together[logs[0][0]] = (
            f"{whole}: {counted(len(logs), 'log')} ({names}{f' and {more} more' if more else ''}): {reason}"
        )
        taken.update(sentence for sentence, _, _ in logs[1:])
    return [together.get(sentence, sentence) for sentence in sentences if sentence not in taken]


def _ranged(shape: str, sentences: Sequence[str]) -> str:
    """Return sentences of one shape as one, with the least and the most of each number that differs.

    Intervals, in brackets or called that, become the one that holds them all.
    """
    columns = list(zip(*(NUMBER.findall(one) for one in sentences), strict=True))
    text, known = "", 0
    for part in re.split(f"({PLACE} to {PLACE}|{PLACE})", shape):
        if part == PLACE:
            text += _range(columns[known])
        elif part == f"{PLACE} to {PLACE}":
            both = columns[known], columns[known + 1]
            text += _enclosing(*both) if text.endswith(("interval ", "(")) else _from_to(*both)
        else:
            text += part
        known += part.count(PLACE)
    return text


def _value(number: str) -> float:
    return float(number.replace(",", ""))


def _range(numbers: Sequence[str]) -> str:
    """Return the least and the most of numbers as they were written, or the only one."""
    least, most = min(numbers, key=_value), max(numbers, key=_value)
    return least if least == most else f"{least} to {most}"


def _enclosing(lows: Sequence[str], highs: Sequence[str]) -> str:
    """Return the interval that holds some, by their ends."""
    return f"{min(lows, key=_value)} to {max(highs, key=_value)}"


def _from_to(starts: Sequence[str], ends: Sequence[str]) -> str:
    """Return what goes from one number to another, each with its range."""
    every = [_range(starts), _range(ends)]
    return " to ".join(f"({one})" if " to " in one else one for one in every)
