"""Whether two logs hold the same recording: as a copy in another file or format, or one as a piece of the other.

A hash tells copies whose bytes are alike. A log that lost its last line, or was written in another format, is the same
recording all the same: it would train and validate on the same data, and count twice.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.signals.stream import Recording
from ferryid.signals.thresholds import SIGNALS
from ferryid.types import Floats

SAMPLES = 200
"""Places of a log, evenly spaced, that are looked for in the other."""
ROWS = 8
"""Rows in sequence that have to be alike at such a place."""
TRIED = 50
"""Places at which the first of these rows is tried, most."""


WANTED = (("x", "y"), ("u", "v"), ("psi",))
"""Signals that are compared, the first of which both logs have."""
Samples = tuple[Floats, ...]
"""Values of each of `WANTED` in single precision, shape (n, signals): formats differ in more."""


class GivenLogs:
    """The logs that a command was given so far, none of them twice."""

    def __init__(self) -> None:
        self._known: list[tuple[str, str, Samples]] = []
        self._files: set[str] = set()

    def add(self, recording: Recording) -> None:
        """Add a log.

        Raises
        ------
        FerryIdError
            For one that was given before: with the same content, as a copy in another format or a piece, or with a file of its
            own that is part of both.
        """
        name, samples = recording.files[0], _samples_of(recording)
        for other, sha256, known in self._known:
            if recording.sha256 == sha256:
                raise FerryIdError(f"{name}: the same log as {other}, which would count twice. Fix: give it once")
            if _same_samples(samples, known):
                raise FerryIdError(
                    f"{name}: holds the recording of {other}, or a piece of it, which would count twice. "
                    "Fix: give one of the two"
                )
        files = {str(Path(file).resolve()) for file in recording.files}
        if shared := sorted(files & self._files):
            raise FerryIdError(f"{shared[0]}: is part of two logs, so that it would count twice. Fix: give it once")
        self._known.append((name, recording.sha256, samples))
        self._files |= files


def same_recording(one: Recording, other: Recording) -> bool:
    """Return whether the samples of the pose, or of the velocity, of the shorter log are found in the other, in sequence.

    Values count as measured, not their times: a clock may have been set, and a begin cut off. Where the vessel lies still, or
    a sensor repeats its value, nothing is compared.
    """
    return _same_samples(_samples_of(one), _samples_of(other))


def _samples_of(recording: Recording) -> Samples:
    return tuple(_signals(recording, wanted) for wanted in WANTED)


def _same_samples(one: Samples, other: Samples) -> bool:
    for several in zip(one, other, strict=True):
        if all(len(values) >= ROWS for values in several):
            shorter, longer = sorted(several, key=len)
            share = _found_share(shorter, longer)
            if share is not None:
                return share >= SIGNALS.shared_samples
    return False


def _signals(recording: Recording, wanted: tuple[str, ...]) -> Floats:
    """Return signals of one topic in single precision, as formats differ, shape (n, signals); none without them all."""
    stream = next((each for each in recording.streams.values() if set(wanted) <= set(each.columns)), None)
    if stream is None:
        return np.empty((0, len(wanted)), dtype=np.float32)
    values = np.column_stack([stream.columns[name] for name in wanted]).astype(np.float32)
    return np.asarray(values[np.isfinite(values).all(axis=1)])


def _found_share(shorter: Floats, longer: Floats) -> float | None:
    """Return the share of places of a series that the other one has as well; None where it hardly changes."""
    places = np.unique(np.linspace(0, len(shorter) - ROWS, SAMPLES).astype(np.int64))
    # Steps of a coarse sensor, or of one that repeats its values, look alike by chance.
    changing = [k for k in places.tolist() if len(np.unique(shorter[k : k + ROWS], axis=0)) > ROWS // 2]
    if not changing:
        return None
    order = np.argsort(longer[:, 0], kind="stable")
    values = longer[order, 0]
    found = 0
    for k in changing:
        low, high = (int(np.searchsorted(values, shorter[k, 0], side)) for side in ("left", "right"))
        piece = shorter[k : k + ROWS]
        found += any(
            np.array_equal(longer[at : at + ROWS], piece) for at in order[low : min(high, low + TRIED)].tolist()
        )
    return found / len(changing)
