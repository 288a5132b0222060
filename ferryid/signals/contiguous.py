"""Short logs that follow each other at once, or nearly so, such as bags of 20 s of one recording, as one log.

A recorder that begins a new file every few seconds cuts one recording into pieces. Each piece by itself loses the windows at
its ends, is too short to hold anything out, and has a wind, a current and a noise of its own for the estimate. Pieces are put
together before anything else is done with them, which leaves the recording as it would be without the cuts. A break is a gap
in it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil
from pathlib import Path

import numpy as np

from ferryid.cached import cached_property
from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.files import existing_parts
from ferryid.ingest import open_log
from ferryid.side_by_side import over
from ferryid.signals.order_of_time import dated
from ferryid.signals.recording import Recording, record
from ferryid.signals.thresholds import SIGNALS
from ferryid.types import Floats, Nanoseconds
from ferryid.vessel.dimensions import window_seconds
from ferryid.vessel.profile import Profile

POSE = (("x", "y"), ("psi",))
"""Signals that go on from one log to the next."""


@dataclass(frozen=True)
class LogPart:
    """A log that is part of another: its path, and when it begins and ends in that [s from its start]."""

    path: str
    begin_s: float
    end_s: float

    @property
    def name(self) -> str:
        """Name of its file."""
        return Path(self.path).name


@dataclass(frozen=True)
class Contiguous:
    """Logs, those that follow each other without a break put together.

    Attributes
    ----------
    paths
        In the order in which the first of each was given; parts joined by ``+``.
    parts
        Of every path that was put together.
    """

    paths: tuple[str, ...]
    parts: Mapping[str, tuple[LogPart, ...]]

    def without(self, joined: Collection[str]) -> Contiguous:
        """Return the logs with some that were put together as they were given."""
        paths = [
            each
            for path in self.paths
            for each in ([part.path for part in self.parts[path]] if path in joined else [path])
        ]
        return Contiguous(tuple(paths), {path: parts for path, parts in self.parts.items() if path not in joined})

    @property
    def notes(self) -> tuple[str, ...]:
        """What was put together, as a sentence; none where nothing was."""
        if not self.parts:
            return ()
        lengths = [parts[-1].end_s for parts in self.parts.values()]
        short, long = min(lengths) / 60.0, max(lengths) / 60.0
        minutes = f"{long:.3g} min" if f"{short:.3g}" == f"{long:.3g}" else f"{short:.3g} to {long:.3g} min"
        count = sum(len(parts) for parts in self.parts.values())
        breaks = [b.begin_s - a.end_s for parts in self.parts.values() for a, b in pairwise(parts)]
        how = "without a break" if max(breaks) < SIGNALS.gap_s else f"after breaks of up to {max(breaks):.2g} s"
        return (
            f"{counted(count, 'log')} that follow each other {how} were joined into {counted(len(self.parts), 'log')} of "
            f"{minutes}.",
        )


@dataclass(frozen=True)
class _Messages:
    """The messages of a topic: their type and number, and the times of the first and the last [ns]."""

    type: str
    count: int
    start_ns: int
    end_ns: int


@dataclass(frozen=True)
class _Span:
    """A log that may be joined: its path, and what it holds of the topics that a profile maps, by their names."""

    path: str
    topics: Mapping[str, _Messages]

    @cached_property
    def start_ns(self) -> int:
        return min(one.start_ns for one in self.topics.values())

    @cached_property
    def end_ns(self) -> int:
        return max(one.end_ns for one in self.topics.values())

    @property
    def seconds(self) -> float:
        return (self.end_ns - self.start_ns) * 1e-9

    def precedes(self, other: _Span, profile: Profile, *, alone: bool) -> bool:
        """Return whether another log goes on when this one ends, with the same topics; `alone` where no log was made beside."""
        shared = [(topic, other.topics[name]) for name, topic in self.topics.items() if name in other.topics]
        if not shared or any(one.type != two.type or two.start_ns < one.end_ns for one, two in shared):
            return False
        break_s = (other.start_ns - self.end_ns) * 1e-9
        if dated(self.start_ns):
            # Two recorders may have begun their files together.
            return break_s <= SIGNALS.break_s and (alone or _goes_on(self.path, other.path, profile))
        # Times that are no dates may follow each other by chance: no sample may be missing, nor the vessel be elsewhere.
        return break_s <= min(SIGNALS.break_s, SIGNALS.break_samples * self.sample_s) and _goes_on(
            self.path, other.path, profile
        )

    @property
    def sample_s(self) -> float:
        """Mean interval of the topic with the most messages [s]."""
        fastest = max(self.topics.values(), key=lambda one: one.count)
        return (fastest.end_ns - fastest.start_ns) * 1e-9 / max(fastest.count - 1, 1)


def contiguous(paths: Sequence[str], profile: Profile) -> Contiguous:
    """Return logs with those put together that follow each other without a break.

    They are bags too short to be judged by themselves (`SIGNALS.short_windows`, `SIGNALS.short_s`), whose topics have the same
    types. Each begins when the one before ended, by the recorder's clock or the times of the table, to within `SIGNALS.break_s`
    where these are dates. Where they are not, as in tables that count seconds, the next sample has to be there, and the pose to
    go on. No more are put together than `SIGNALS.joined_s`, so that what is
    constant over a log is so for that long. A log that cannot be opened stays by itself, and whoever reads it says what is
    wrong.

    Parameters
    ----------
    paths
        Logs of one vessel; parts of one recording joined by ``+``.
    profile
        The vessel, which maps the topics that count.
    """
    given = list(dict.fromkeys(paths))
    if len(given) < 2:
        return Contiguous(tuple(paths), {})
    mapped = {signal.topic.strip("/") for signal in profile.signals}
    longest_s = max(SIGNALS.short_s, SIGNALS.short_windows * window_seconds(profile))
    spans = [one for one in over(lambda path: _span(path, profile, mapped), given) if one and one.seconds < longest_s]
    joined = {
        "+".join(one.path for one in piece): piece
        for run in _runs(sorted(spans, key=lambda one: one.start_ns), profile)
        for piece in _pieces(run)
        if len(piece) > 1
    }
    whole_of = {one.path: path for path, piece in joined.items() for one in piece}
    parts = {path: _parts(piece) for path, piece in joined.items()}
    made = [whole_of.get(path, path) for path in given]
    # Whoever reads the logs refuses one that was given twice.
    again = [path for k, path in enumerate(paths) if path in paths[:k]]
    return Contiguous((*dict.fromkeys(made), *again), parts)


def _span(path: str, profile: Profile, mapped: set[str]) -> _Span | None:
    """Return when a log was recorded; None where it cannot be opened, or holds nothing that is mapped."""
    if len(existing_parts(path)) != 1:
        # Parts that were joined by hand are a log as they are.
        return None
    try:
        topics = open_log(path, profile.table).topics
    except FerryIdError:
        return None
    kept = {
        one.name: _Messages(one.type, one.count, one.start_ns, one.end_ns)
        for one in topics
        if one.name.strip("/") in mapped and one.count and one.start_ns is not None and one.end_ns is not None
    }
    # A table whose last row is empty has one time.
    if not kept or any(one.end_ns <= one.start_ns for one in kept.values() if one.count > 1):
        return None
    return _Span(path, kept)


def _runs(spans: Sequence[_Span], profile: Profile) -> list[list[_Span]]:
    """Return logs in order of time in runs of which each log precedes the next."""
    runs = list[list[_Span]]()
    alone = not any(two.start_ns < one.start_ns + (one.end_ns - one.start_ns) // 2 for one, two in pairwise(spans))
    for one in spans:
        # A copy beside a bag begins with it and follows the same one: it stays by itself.
        run = next((run for run in runs if run[-1].precedes(one, profile, alone=alone)), None)
        if run is None:
            runs.append([one])
        else:
            run.append(one)
    return runs


def _goes_on(path: str, after: str, profile: Profile) -> bool:
    """Return whether pose goes on in another log where it ends in this one: no faster than it changes within either of them."""
    try:
        first, second = (record(one, profile) for one in (path, after))
    except FerryIdError:
        return False
    for names in POSE:
        (t, before), (s, behind) = (_samples(one, names) for one in (first, second))
        if len(t) < 2 or len(s) < 2 or s[0] <= t[-1]:
            return False
        rates = [_rates(t, before), _rates(s, behind)]
        across = _rates(np.array([t[-1], s[0]]), np.array([before[-1], behind[0]]))
        if float(across[0]) > max(float(one.max()) for one in rates):
            return False
    return True


def _samples(recording: Recording, names: tuple[str, ...]) -> tuple[Nanoseconds, Floats]:
    """Return times [ns] and values of signals of one topic, shape (n,) and (n, signals); none without them."""
    stream = next((one for one in recording.streams.values() if set(names) <= set(one.columns)), None)
    if stream is None:
        return np.empty(0, dtype=np.int64), np.empty((0, len(names)))
    values = np.column_stack([stream.columns[name] for name in names])
    finite = np.isfinite(values).all(axis=1)
    return stream.time_ns[finite], values[finite]


def _rates(time_ns: Nanoseconds, values: Floats) -> Floats:
    """Return how fast samples change from one to the next, of a heading the shorter way round, shape (n - 1,)."""
    steps = np.diff(values, axis=0)
    if steps.shape[1] == 1:
        steps = (steps + np.pi) % (2.0 * np.pi) - np.pi
    return np.asarray(np.hypot.reduce(steps, axis=1) / (np.diff(time_ns) * 1e-9))


def _pieces(run: Sequence[_Span]) -> list[list[_Span]]:
    """Return a run in pieces of about one length, none longer than `SIGNALS.joined_s`."""
    start = run[0].start_ns
    seconds = (run[-1].end_ns - start) * 1e-9
    count = ceil(seconds / SIGNALS.joined_s)
    pieces = [list[_Span]() for _ in range(count)]
    for one in run:
        middle = 0.5e-9 * (one.start_ns + one.end_ns - 2 * start)
        pieces[min(int(middle / seconds * count), count - 1)].append(one)
    return [one for one in pieces if one]


def _parts(piece: Sequence[_Span]) -> tuple[LogPart, ...]:
    start = piece[0].start_ns
    return tuple(LogPart(one.path, (one.start_ns - start) * 1e-9, (one.end_ns - start) * 1e-9) for one in piece)
