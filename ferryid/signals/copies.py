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
from ferryid.types import Flags, Floats, Ints

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
    a sensor repeats its value, nothing is compared. Positions and velocities may be rounded: they are alike within the coarser
    of the quanta of both logs, the step of a signal near a value. Two logs of one sensor have one quantum, and have to be
    equal; two trials never agree row by row to their noise. A heading alone has to be equal, as it turns through the same
    values in many trials.
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
    return [
        Searchable(tuple(_Sequence(_signals(one, wanted), wanted != (HEADING,)) for wanted in COMPARED))
        for one in recordings
    ]


@dataclass(frozen=True, eq=False)
class Searchable:
    """The samples of a recording by `COMPARED`."""

    kinds: tuple[_Sequence, ...]

    def same(self, other: Searchable) -> bool:
        """Return what `same_recording` does.

        Velocities are looked at where positions are not alike, as these count from the first fix of a piece, and may have other
        digits. A heading counts only where a log has neither.
        """
        compared = False
        for several in zip(self.kinds, other.kinds, strict=True):
            if any(len(one.values) < ROWS for one in several) or (compared and not several[0].rounded):
                continue
            shorter, longer = sorted(several, key=lambda one: len(one.values))
            share = shorter.found_share(longer)
            if share is not None and share >= SIGNALS.shared_samples:
                return True
            compared |= share is not None
        return False


@dataclass(frozen=True, eq=False)
class _Sequence:
    """Samples of some signals in double precision, shape (n, signals); `rounded` where a copy may have fewer digits."""

    values: Floats
    rounded: bool = False

    @cached_property
    def _order(self) -> Ints:
        return np.argsort(self.values[:, 0], kind="stable")

    @cached_property
    def _rising(self) -> Floats:
        return np.asarray(self.values[self._order, 0])

    @cached_property
    def _places(self) -> Ints:
        """Where some `ROWS` in sequence that change begin, evenly spaced."""
        places = np.unique(np.linspace(0, len(self.values) - ROWS, SAMPLES).astype(np.int64))
        every = self.values.astype(np.float32)[places[:, None] + np.arange(ROWS)]
        # Steps of a coarse sensor, or of one that repeats its values, look alike by chance.
        return np.asarray(places[_changing(every, np.zeros((len(every), every.shape[2])))])

    @cached_property
    def _pieces(self) -> Floats:
        """The rows at `_places`, shape (pieces, ROWS, signals)."""
        return np.asarray(self.values[self._places[:, None] + np.arange(ROWS)])

    @cached_property
    def _quanta(self) -> tuple[tuple[Floats, Floats], ...]:
        """Of each signal some of its values in order, and its quantum from each of them to the next."""
        return tuple(_quanta_of(column) for column in self.values.T)

    @cached_property
    def _own_quantum(self) -> Floats:
        return self.quantum(self._pieces[:, 0])

    @cached_property
    def _single(self) -> Floats:
        """The single precision of the pieces, shape (pieces, signals)."""
        return np.asarray(SIGNALS.single_precision * np.abs(self._pieces).max(axis=1))

    @property
    def marks(self) -> Ints:
        """Hashes of at most `MARKS` pieces."""
        return _hashes(self._pieces[:: SAMPLES // MARKS])

    def quantum(self, values: Floats) -> Floats:
        """Return the quantum of the signals near some values of them, shape (k, signals)."""
        found = np.zeros(values.shape)
        if self.rounded:
            for signal, (begin, step) in enumerate(self._quanta):
                found[:, signal] = step[
                    np.clip(np.searchsorted(begin, values[:, signal], "right") - 1, 0, len(step) - 1)
                ]
        return found

    def found_share(self, longer: _Sequence) -> float | None:
        """Return the share of pieces that another series has as well; None where this one hardly changes."""
        pieces = self._pieces
        if not len(pieces):
            return None
        share = float(self._found(longer, self._single).mean())
        return share if share >= SIGNALS.shared_samples or not self.rounded else self._rounded_share(longer, share)

    def _rounded_share(self, longer: _Sequence, share: float) -> float | None:
        """Return the same where one may be rounded; None where too little changes by more than that.

        `share` is the share of pieces that are alike to single precision, which is all where both have one quantum.
        """
        pieces, own, other = self._pieces, self._own_quantum, longer.quantum(self._pieces[:, 0])
        quantum = np.maximum(own, other)
        half = 0.5 * (1.0 + SIGNALS.quantum_slack) * quantum
        if not ((half > self._single) & (np.abs(own - other) > SIGNALS.quantum_slack * quantum)).any():
            return share
        found = self._found(longer, np.maximum(half, self._single))
        if not found.any():
            return 0.0
        # Steps of a few quanta are alike in many trials, and so is a straight way along an axis at one speed.
        turning = (np.ptp(pieces, axis=1) > quantum).all(axis=1)
        counts = turning & _changing(pieces, SIGNALS.rounded_quanta * quantum)
        if counts.sum() < SIGNALS.shared_samples * len(pieces):
            return None
        return float((found & counts).sum() / counts.sum())

    def _found(self, longer: _Sequence, near: Floats) -> Flags:
        """Return which pieces another series has as well, within a distance of each signal, shape (pieces, signals)."""
        pieces = self._pieces
        first, away = pieces[:, 0, 0], near[:, 0]
        low = np.searchsorted(longer._rising, first - away, "left")
        count = np.minimum(np.searchsorted(longer._rising, first + away, "right") - low, TRIED)
        piece = np.repeat(np.arange(len(pieces)), count)
        at = longer._order[np.arange(len(piece)) - np.repeat(np.cumsum(count) - count, count) + np.repeat(low, count)]
        whole = at <= len(longer.values) - ROWS
        piece, at = piece[whole], at[whole]
        for row in range(ROWS):
            if not len(at):
                break
            alike = (np.abs(longer.values[at + row] - pieces[piece, row]) <= near[piece]).all(axis=1)
            piece, at = piece[alike], at[alike]
        found = np.zeros(len(pieces), dtype=np.bool_)
        found[piece] = True
        return found


def _changing(pieces: Floats, near: Floats) -> Flags:
    """Return which pieces, shape (k, ROWS, signals), have more than half of their rows unlike those before.

    `near` is the distance up to which values are alike, shape (k, signals).
    """
    alike = (np.abs(pieces[:, :, None] - pieces[:, None]) <= near[:, None, None]).all(axis=-1)
    different = ROWS - np.tril(alike, -1).any(axis=2).sum(axis=1)
    return np.asarray(different > ROWS // 2)


def _quanta_of(column: Floats) -> tuple[Floats, Floats]:
    """Return values of a signal in order, and the quantum from each of them to the next.

    That is the largest number of which all steps between neighbouring values are multiples. Of a signal that was rounded, to
    decimals, to digits or to single precision, it is the step of that; of another it is next to nothing, however slowly and
    steadily the signal changes.
    """
    values = np.sort(column)
    steps = np.diff(values)
    least = SIGNALS.least_quantum * max(abs(values[0]), abs(values[-1]))
    changes = steps > least
    if not changes.any():
        return values[:1], np.zeros(1)
    values, steps = values[:-1][changes], steps[changes]
    size = min(SIGNALS.quantum_steps, len(steps))
    several = steps[: len(steps) // size * size].reshape(-1, size)
    # Small ones, but not the least alone: at a steady speed many are the same.
    spread = np.linspace(0, size // 4, min(SIGNALS.divided_steps, size)).astype(np.int64)
    return values[: several.size : size], _common_divisor(np.sort(several, axis=1)[:, spread], least)


def _common_divisor(steps: Floats, least: float) -> Floats:
    """Return the largest number of which the steps of a row are multiples, up to `least`, shape (k,); by Euclid."""
    divisor = steps[:, 0]
    for other in steps.T[1:]:
        divided = other
        while True:
            rest = np.abs(divided - divisor * np.round(divided / divisor))
            multiple = rest <= least
            if multiple.all():
                break
            divided, divisor = np.where(multiple, divided, divisor), np.where(multiple, divisor, rest)
    return np.where(divisor > SIGNALS.quantum_rests * least, divisor, 0.0)


def _signals(recording: Recording, wanted: tuple[str, ...]) -> Floats:
    """Return signals of one topic, shape (n, signals); none without them all."""
    stream = next((each for each in recording.streams.values() if set(wanted) <= set(each.columns)), None)
    if stream is None:
        return np.empty((0, len(wanted)))
    values = np.column_stack([stream.columns[name] for name in wanted]).astype(np.float64)
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
