"""The logs of a campaign: long ones each by itself, short ones one after another as if they were one.

What a pass over the rows of a bag of seconds takes is next to nothing beside what leads up to it. So logs in which the forces
of a row depend on that row alone, and on the log's own vector, are put one after another and worked out in one pass.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ferryid.diagnose.inference.candidate import Candidate, OtherHeading
from ferryid.diagnose.inference.weak_form import Windows
from ferryid.effects.force_model import ForceModel, Measurements
from ferryid.types import Floats, Ints

MOST_ROWS = 4096
"""Rows of the logs that are put one after another, at most: more are no faster, and are not shared between cores."""
BY_ROW = ("t", "eta", "nu_raw", "nu", "parts", "angles", "usable", "wind", "current", "payload", "rudders")
"""What measurements have of every row."""
FORCES_BY_ROW = ("parts", "angles", "external", "flow", "load", "damping_factor")
"""What a force model has of every row."""


@dataclass(frozen=True)
class Member:
    """One log of a vessel: its windows, its force model without effects, and the conditions that it has of its own.

    Where groups of logs are compared, `group` is its group's name: properties of another group do not act in it.
    """

    windows: Windows
    plain: ForceModel
    conditions: tuple[Candidate, ...] = ()
    group: str = ""


@dataclass(frozen=True)
class Stack:
    """Logs that are worked out in one pass.

    Attributes
    ----------
    logs
        Their places in the campaign.
    member
        The log; several are one after another in it.
    rows, windows
        Which of `logs` each row and each window is of, shapes (n,) and (J,); None for one log alone.
    """

    logs: tuple[int, ...]
    member: Member
    rows: Ints | None = None
    windows: Ints | None = None

    def own(self, every: Floats) -> Floats:
        """Return the vectors of these logs out of those of all, shape (logs, l); of one log alone, shape (l,)."""
        return np.asarray(every[self.logs[0]] if self.rows is None else every[list(self.logs)])

    def by_window(self, own: Floats) -> Floats:
        """Return what `own` returned for every window; that of one log alone as it is."""
        return own if self.windows is None else np.asarray(own[self.windows])

    def parted(self, by_window: Floats) -> list[Floats]:
        """Return what all windows have, shape (J, ...), log by log."""
        if self.windows is None:
            return [by_window]
        return np.split(by_window, np.flatnonzero(np.diff(self.windows)) + 1)


def stacked(members: Sequence[Member], acting: Sequence[Candidate]) -> tuple[Stack, ...]:
    """Return the logs of a campaign, short ones that are alike put one after another.

    Parameters
    ----------
    members
        The logs.
    acting
        Properties that act in them, beside their own conditions.
    """
    alike: dict[tuple[object, ...], list[int]] = {}
    for i, member in enumerate(members):
        alike.setdefault(_kind(member) if _can_be_joined(member, acting) else (i,), []).append(i)
    found = [chunk for places in alike.values() for chunk in _chunks(members, places)]
    return tuple(
        Stack((chunk[0],), members[chunk[0]]) if len(chunk) == 1 else _stack(members, chunk) for chunk in sorted(found)
    )


def _can_be_joined(member: Member, acting: Sequence[Candidate]) -> bool:
    """Return whether a log can be put beside others: all that acts does so on each row by itself, and all along."""
    by_row = all(one.effect.by_row and not one.times for one in (*member.conditions, *acting))
    plain, windows = member.plain, member.windows
    return by_row and plain.air is None and plain.measurements is windows.measurements and len(windows.starts) > 0


def _kind(member: Member) -> tuple[object, ...]:
    """Return what must be the same in logs that are put one after another."""
    windows, plain = member.windows, member.plain
    measurements = windows.measurements
    return (
        id(measurements.profile),
        member.group,
        tuple((one.key, one.heading is None) for one in member.conditions),
        windows.weight.tobytes(),
        windows.channels.tobytes(),
        measurements.slopes,
        tuple(getattr(measurements, name) is None for name in BY_ROW),
        tuple(getattr(plain, name) is None for name in FORCES_BY_ROW),
        plain.hull.tobytes(),
        plain.gust_std,
        plain.turned,
        plain.antenna,
    )


def _chunks(members: Sequence[Member], places: Sequence[int]) -> Iterator[list[int]]:
    """Yield places of logs of no more than `MOST_ROWS` together, or of one log."""
    chunk, rows = list[int](), 0
    for i in places:
        more = len(members[i].windows.measurements.t)
        if chunk and rows + more > MOST_ROWS:
            yield chunk
            chunk, rows = [], 0
        chunk.append(i)
        rows += more
    if chunk:
        yield chunk


def _stack(members: Sequence[Member], places: Sequence[int]) -> Stack:
    logs = [members[i] for i in places]
    every = [one.windows.measurements for one in logs]
    lengths = [len(one.t) for one in every]
    before = np.concatenate([[0], np.cumsum(lengths)[:-1]]).tolist()
    counts = [len(one.windows.starts) for one in logs]
    firsts = np.concatenate([[0], np.cumsum(counts)[:-1]]).tolist()
    measurements = replace(every[0], **_joined(every, BY_ROW), repeats=())
    windows = replace(
        logs[0].windows,
        measurements=measurements,
        starts=np.concatenate([one.windows.starts + row for one, row in zip(logs, before, strict=True)]),
        runs=tuple(
            (first + k, end + k) for one, k in zip(logs, firsts, strict=True) for first, end in one.windows.runs
        ),
        measured=np.concatenate([one.windows.measured for one in logs]),
    )
    # What follows from what was measured is asked for by corrections of measurements alone, none of which acts row by row.
    plain = replace(
        logs[0].plain, measurements=measurements, ambient=None, **_joined([one.plain for one in logs], FORCES_BY_ROW)
    )
    conditions = tuple(_together([one.conditions[k] for one in logs]) for k in range(len(logs[0].conditions)))
    return Stack(
        tuple(places),
        Member(windows, plain, conditions, logs[0].group),
        np.repeat(np.arange(len(logs)), lengths),
        np.repeat(np.arange(len(logs)), counts),
    )


def _joined(every: Sequence[Measurements] | Sequence[ForceModel], names: Sequence[str]) -> dict[str, Any]:
    found = dict[str, Any]()
    for name in names:
        parts = [getattr(one, name) for one in every]
        found[name] = None if parts[0] is None else np.concatenate(parts)
    return found


def _together(candidates: Sequence[Candidate]) -> Candidate:
    """Return a condition of several logs as one of them all: on the other headings of each, where it has such."""
    headings = [one.heading for one in candidates if one.heading is not None]
    if not headings:
        return candidates[0]
    return replace(candidates[0], heading=OtherHeading(np.concatenate([one.psi for one in headings])))
