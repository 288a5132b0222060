"""Whether two logs hold the same recording: as a copy in another file or format, or one as a piece of the other.

A hash tells copies whose bytes are alike. A log that lost its last line, or was written in another format, is the same
recording all the same: it would train and validate on the same data, and count twice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ferryid.cached import cached_property
from ferryid.errors import FerryIdError
from ferryid.files import resolved
from ferryid.signals.stream import Recording
from ferryid.signals.thresholds import SIGNALS
from ferryid.types import Floats, Ints

SAMPLES = 200
"""Places of a log, evenly spaced, that are looked for in the other."""
ROWS = 8
"""Rows in sequence that have to be alike at such a place."""
TRIED = 50
"""Places at which the first of these rows is tried, most."""
MARKS = 100
"""Places of a log, evenly spaced, whose samples are kept as hashes, most."""
HEADING = "psi"
COMPARED = (("x", "y"), ("u", "v"), ("vel_N", "vel_E"), (HEADING,))
"""Signals of one topic that are compared: the first of them that both logs have and that changes."""


class GivenTwiceError(FerryIdError):
    """A recording that a command was given twice: a fault of the arguments, whatever the log holds."""


class GivenLogs:
    """The logs that a command was given so far, none of them twice."""

    def __init__(self) -> None:
        self._known: list[tuple[str, str, Searchable]] = []
        self._files: set[str] = set()

    def add(self, recording: Recording) -> None:
        """Add a log.

        Raises
        ------
        GivenTwiceError
            For one that was given before: with the same content, as a copy in another format or a piece, or with a file of its
            own that is part of both.
        """
        name, samples = recording.files[0], searchable([recording])[0]
        for other, sha256, known in self._known:
            if recording.sha256 == sha256:
                what = "given twice, and" if name == other else f"the same log as {other}, which"
                raise GivenTwiceError(f"{name}: {what} would count twice. Fix: give it once")
            if samples.same(known):
                raise GivenTwiceError(
                    f"{name}: holds the recording of {other}, or a piece of it, which would count twice. "
                    "Fix: give one of the two"
                )
        files = {str(resolved(file)) for file in recording.files}
        if shared := sorted(files & self._files):
            raise GivenTwiceError(f"{shared[0]}: is part of two logs, so that it would count twice. Fix: give it once")
        self._known.append((name, recording.sha256, samples))
        self._files |= files


def same_recording(one: Recording, other: Recording) -> bool:
    """Return whether the samples of the pose, or of the velocity, of the shorter log are found in the other, in sequence.

    Values count as measured, not their times: a clock may have been set, and a begin cut off. Where the vessel lies still, or
    a sensor repeats its value, nothing is compared.
    """
    first, second = searchable([one, other])
    return first.same(second)


def motion_marks(recording: Recording) -> dict[str, Any]:
    """Return hashes of samples in sequence, by which `has_marks` knows a copy or a piece of the log without the log itself.

    Returns
    -------
    dict
        By the names of signals in `COMPARED`, ``{"rows": n, "hashes": [...]}``; without those that hardly change.
    """
    marks = {}
    for wanted in COMPARED:
        kept = _Sequence(_signals(recording, wanted))
        if len(kept.values) >= ROWS and len(hashes := kept.marks):
            marks[_key(wanted)] = {"rows": len(kept.values), "hashes": hashes.tolist()}
    return marks


def has_marks(recording: Recording, several: Sequence[Mapping[str, Any]]) -> bool:
    """Return whether a log holds one of the recordings that `motion_marks` are of, or a piece of one, or is a piece."""
    if not several:
        return False
    values = {_key(wanted): _signals(recording, wanted) for wanted in COMPARED}
    hashes = {key: _every_hash(one) for key, one in values.items() if len(one) >= ROWS}
    return any(_marked(hashes, marks) for marks in several)


def _marked(hashes: Mapping[str, Ints], marks: Mapping[str, Any]) -> bool:
    """Return whether enough of a log's marks are among the hashes of another one, by the names of signals.

    Positions are counted from the first fix where they were latitudes, and unlike in a piece: velocities are looked at too. A
    heading turns through the same coarse values in many trials, and counts only where a log has neither.
    """
    shared = [key for key in hashes if key in marks]
    for key in shared[:-1] if len(shared) > 1 and shared[-1] == HEADING else shared:
        kept = marks[key]
        found = np.isin(np.array(kept["hashes"], dtype=np.int64), hashes[key]).sum()
        possible = len(kept["hashes"]) * min(1.0, (len(hashes[key]) + ROWS - 1) / kept["rows"])
        if found >= max(SIGNALS.least_marks, SIGNALS.shared_samples * possible):
            return True
    return False


def searchable(recordings: Sequence[Recording]) -> list[Searchable]:
    """Return the samples of recordings, each of which is to be compared with several: what is sorted is sorted once."""
    return [Searchable(tuple(_Sequence(_signals(one, wanted)) for wanted in COMPARED)) for one in recordings]


@dataclass(frozen=True, eq=False)
class Searchable:
    """The samples of a recording by `COMPARED`."""

    kinds: tuple[_Sequence, ...]

    def same(self, other: Searchable) -> bool:
        """Return what `same_recording` does."""
        for several in zip(self.kinds, other.kinds, strict=True):
            if all(len(one.values) >= ROWS for one in several):
                shorter, longer = sorted(several, key=lambda one: len(one.values))
                share = shorter.found_share(longer)
                if share is not None:
                    return share >= SIGNALS.shared_samples
        return False


@dataclass(frozen=True, eq=False)
class _Sequence:
    """Samples of some signals in single precision, as formats differ, shape (n, signals)."""

    values: Floats

    @cached_property
    def _order(self) -> Ints:
        return np.argsort(self.values[:, 0], kind="stable")

    @cached_property
    def _rising(self) -> Floats:
        return np.asarray(self.values[self._order, 0])

    @cached_property
    def _pieces(self) -> Floats:
        """Some `ROWS` in sequence that change, at places that are evenly spaced, shape (pieces, ROWS, signals)."""
        places = np.unique(np.linspace(0, len(self.values) - ROWS, SAMPLES).astype(np.int64))
        every = self.values[places[:, None] + np.arange(ROWS)]
        alike = (every[:, :, None] == every[:, None]).all(axis=-1)
        different = ROWS - np.tril(alike, -1).any(axis=2).sum(axis=1)
        # Steps of a coarse sensor, or of one that repeats its values, look alike by chance.
        return np.asarray(every[different > ROWS // 2])

    @property
    def marks(self) -> Ints:
        """Hashes of at most `MARKS` pieces."""
        return _hashes(self._pieces[:: SAMPLES // MARKS])

    def found_share(self, longer: _Sequence) -> float | None:
        """Return the share of pieces that another series has as well; None where this one hardly changes."""
        pieces = self._pieces
        if not len(pieces):
            return None
        low, high = (np.searchsorted(longer._rising, pieces[:, 0, 0], side) for side in ("left", "right"))
        found = 0
        for k in np.flatnonzero(high > low).tolist():
            tried = longer._order[low[k] : min(high[k], low[k] + TRIED)].tolist()
            found += any(np.array_equal(longer.values[at : at + ROWS], pieces[k]) for at in tried)
        return found / len(pieces)


def _signals(recording: Recording, wanted: tuple[str, ...]) -> Floats:
    """Return signals of one topic, shape (n, signals); none without them all."""
    stream = next((each for each in recording.streams.values() if set(wanted) <= set(each.columns)), None)
    if stream is None:
        return np.empty((0, len(wanted)), dtype=np.float32)
    values = np.column_stack([stream.columns[name] for name in wanted]).astype(np.float32)
    return np.asarray(values[np.isfinite(values).all(axis=1)])


def _key(wanted: tuple[str, ...]) -> str:
    return " ".join(wanted)


def _every_hash(values: Floats) -> Ints:
    """Return the hashes of all `ROWS` in sequence, shape (n - ROWS + 1,)."""
    return _hashes(sliding_window_view(values, ROWS, axis=0).transpose(0, 2, 1))


def _hashes(pieces: Floats) -> Ints:
    """Return FNV-1a over the samples of each piece, shape (n, ROWS, signals), as 52 bits, which JSON holds exactly."""
    hashes = np.full(len(pieces), 0xCBF29CE484222325, dtype=np.uint64)
    for row in range(pieces.shape[1]):
        for signal in range(pieces.shape[2]):
            # Adding zero makes zero of minus zero.
            bits = (pieces[:, row, signal] + np.float32(0.0)).astype(np.float32).view(np.uint32)
            hashes = (hashes ^ bits) * np.uint64(0x100000001B3)
    return np.asarray((hashes ^ (hashes >> np.uint64(32))) & np.uint64(2**52 - 1), dtype=np.int64)
