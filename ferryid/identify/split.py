"""Training and validation rows that share no smoothing window: blocks with a purge gap, whole logs, folds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.identify.thresholds import IDENTIFY
from ferryid.signals.track import Motion
from ferryid.types import Flags, Floats

KINDS = ("blocks", "logs", "every-kth")
EVERY = 4

_GOLDEN = (5.0**0.5 - 1.0) / 2.0


class TooShort(FerryIdError):
    """Logs that are too short for what is asked of them, and may do for less."""


@dataclass(frozen=True)
class Split:
    """Which rows train and which validate; rows in neither are invalid or purged.

    Attributes
    ----------
    kind
        ``"blocks"``, ``"logs"``, ``"every-kth"``, or ``"none"`` where nothing is held out.
    training, validation
        One mask a log, shape (n,).
    purge_s
        Least time between a training row and a validation row [s]; 0 where none is kept.
    notes
        What a reader of the scores must know, as sentences with numbers.
    """

    kind: str
    training: tuple[Flags, ...]
    validation: tuple[Flags, ...]
    purge_s: float
    notes: tuple[str, ...] = ()

    @classmethod
    def nothing(cls, motions: Sequence[Motion]) -> Split:
        """Return the split of motions of which no row is used yet."""
        none = tuple(np.zeros(len(motion.t), dtype=bool) for motion in motions)
        return cls("none", none, none, 0.0)

    def within(self, rows: Sequence[Flags]) -> Split:
        """Return the split without what lies outside `rows`, one mask a log, shape (n,)."""
        training, validation = (
            tuple(mask & known for mask, known in zip(masks, rows, strict=True))
            for masks in (self.training, self.validation)
        )
        return replace(self, training=training, validation=validation)


def split_rows(
    motions: Sequence[Motion],
    kind: str = "blocks",
    *,
    window_s: float,
    guard_s: float = IDENTIFY.guard_s,
    blocks: int | None = None,
    shortest_s: float = 0.0,
    every: int = EVERY,
    validate: Sequence[str] = (),
) -> Split:
    """Divide the valid rows of several logs into training and validation; the same input gives the same rows.

    Parameters
    ----------
    motions
        Logs; only rows that are `valid` are used.
    kind
        ``"blocks"``: each log is cut into contiguous blocks of equally many valid rows, and of every three in a row
        one validates. ``"logs"``: whole logs validate. ``"every-kth"``: every k-th valid row
        validates (thesis 3.2.4); neighbours share the smoothing window, so that the score flatters.
    window_s
        Length of the smoothing window [s].
    guard_s
        Time [s] purged in addition to one window.
    blocks
        Number of blocks a log; None takes as many as are `IDENTIFY.block_s` long, 9 to 36 of them. Fewer where
        blocks would be shorter than four purge gaps. Among several logs, one too short for three blocks is a block
        itself, and of such logs the second, fifth ... validate.
    shortest_s
        Least length of a block [s], where that is longer.
    every
        k of ``"every-kth"``, 2 or more.
    validate
        Names of the logs that validate in ``"logs"``; the last one where none is named.

    Raises
    ------
    FerryIdError
        For an unknown kind, a log too short to hold training and validation, or fewer than two logs for ``"logs"``.
    """
    if not motions:
        raise FerryIdError("split: there is no log to divide, found none. Fix: give at least one log")
    if kind == "blocks":
        return _blocks(motions, window_s, guard_s, blocks, shortest_s)
    if kind == "logs":
        return _logs(motions, validate)
    if kind == "every-kth":
        return _every_kth(motions, every)
    raise FerryIdError(
        f'settings: there is no split called "{kind}".{did_you_mean(kind, KINDS)} Fix: choose one of {", ".join(KINDS)}'
    )


def correlation_time(values: Floats, valid: Flags, rate_hz: float, longest_s: float = 30.0) -> float:
    """Return the time [s] after which the autocorrelation of a signal falls below 1/e, the longest of its columns.

    Parameters
    ----------
    values
        Residual, shape (n, c).
    valid
        Rows to use, shape (n,); pairs across a gap do not count.
    rate_hz
        Rows per second.
    longest_s
        Upper limit of the answer [s].

    Returns
    -------
    float
        0 where nothing varies.
    """
    most = min(round(longest_s * rate_hz), len(valid) - 1)
    size = 1 << int(np.ceil(np.log2(max(2, len(valid) + most))))
    mask = valid.astype(float)
    pairs = np.fft.irfft(np.abs(np.fft.rfft(mask, size)) ** 2, size)[: most + 1]
    longest = 0.0
    for column in np.asarray(values, dtype=float).T:
        mean = column[valid].mean() if valid.any() else 0.0
        centred = np.where(valid, column - mean, 0.0)
        products = np.fft.irfft(np.abs(np.fft.rfft(centred, size)) ** 2, size)[: most + 1]
        if not products[0] > 0.0:
            continue
        correlation = products / np.maximum(pairs, 1.0) * (pairs[0] / products[0])
        below = np.flatnonzero((correlation < np.exp(-1.0)) & (pairs > 0.5))
        longest = max(longest, (below[0] if below.size else most) / rate_hz)
    return float(longest)


def purge_seconds(rate_hz: float, window_s: float, guard_s: float = IDENTIFY.guard_s) -> float:
    """Return the time [s] within which two rows at a rate share what was smoothed over `window_s`, and a guard."""
    # The derivative reaches one row further than the window on both sides.
    return window_s + 2.0 / rate_hz + guard_s


def _number(used: Flags, parts: int) -> NDArray[np.int64]:
    """Return which of `parts` contiguous parts of equally many used rows each row lies in, shape (n,)."""
    before: NDArray[np.int64] = np.cumsum(used) - used
    total = max(1, int(np.count_nonzero(used)))
    number: NDArray[np.int64] = np.minimum(before * parts // total, parts - 1)
    return number


def _purge(used: Flags, validates: Flags, purge: int) -> tuple[Flags, Flags]:
    """Return training and validation masks at least `purge` + 1 rows apart; the purge is taken from training."""
    validation = used & validates
    reach = np.concatenate([[0], np.cumsum(validation)])
    rows = np.arange(len(used))
    first, last = np.maximum(rows - purge, 0), np.minimum(rows + purge + 1, len(used))
    near = reach[last] > reach[first]
    return used & ~validates & ~near, validation


def _blocks(motions: Sequence[Motion], window_s: float, guard_s: float, blocks: int | None, shortest_s: float) -> Split:
    training, validation, notes, purges = [], [], [], []
    short = 0
    for motion in motions:
        purge_s = purge_seconds(motion.rate_hz, window_s, guard_s)
        seconds = np.count_nonzero(motion.valid) / motion.rate_hz
        least_s = max(IDENTIFY.block_purges * purge_s, shortest_s)
        number = min(block_number(seconds, purge_s, blocks), int(seconds / least_s))
        if number < 3 and len(motions) == 1:
            raise _too_short(motion, motion.valid, 3 * least_s, "three blocks and the gaps between them")
        if number < 3:
            # A log too short for blocks of its own is one block among those of its kind.
            validates = np.full(motion.valid.size, short % IDENTIFY.validates_every == 1)
            number, short = 1, short + 1
        else:
            validates = validation_blocks(number)[_number(motion.valid, number)]
        train, check = _purge(motion.valid, validates, round(purge_s * motion.rate_hz))
        training.append(train)
        validation.append(check)
        purges.append(purge_s)
        lost = np.count_nonzero(motion.valid & ~train & ~check) / motion.rate_hz
        notes.append(
            f"{motion.log}: {counted(number, 'block')} of {seconds / number:.0f} s; "
            f"{np.count_nonzero(train) / motion.rate_hz:.0f} s train, "
            f"{np.count_nonzero(check) / motion.rate_hz:.0f} s validate, "
            f"{lost:.0f} s purged in gaps of {purge_s:.1f} s."
        )
    return Split("blocks", tuple(training), tuple(validation), min(purges), tuple(notes))


def block_number(seconds: float, purge_s: float, wanted: int | None = None) -> int:
    """Return the number of blocks of a log of `seconds`, none shorter than four purge gaps; see `split_rows`."""
    usual = wanted or min(max(round(seconds / IDENTIFY.block_s), IDENTIFY.fewest_blocks), IDENTIFY.most_blocks)
    return min(usual, int(seconds / (IDENTIFY.block_purges * purge_s)))


def validation_blocks(number: int) -> Flags:
    """Return which of `number` blocks validate, shape (number,): one of every three in a row.

    Which of the three follows multiples of the golden ratio. Always the same one would keep step with a trial that
    repeats itself, and validation would see manoeuvres that training never does.
    """
    triples = np.arange((number + 1) // IDENTIFY.validates_every)
    chosen = np.zeros(number, dtype=bool)
    place = ((triples * _GOLDEN + 0.5) % 1.0 * IDENTIFY.validates_every).astype(np.int64)
    chosen[np.minimum(IDENTIFY.validates_every * triples + place, number - 1)] = True
    return chosen


def _logs(motions: Sequence[Motion], validate: Sequence[str]) -> Split:
    names = [motion.log for motion in motions]
    if len(motions) < 2:
        raise FerryIdError(
            f"{names[0]}: a split by logs needs at least two, found one. Fix: give more logs, or use --split blocks"
        )
    for name in validate:
        if name not in names:
            raise FerryIdError(
                f"settings: no log called {name!r} to validate on.{did_you_mean(name, names)} "
                f"Fix: name one of {', '.join(names)}"
            )
    chosen = set(validate) or {names[-1]}
    if chosen >= set(names):
        raise FerryIdError(
            f"settings: every log validates ({', '.join(names)}) and none is left to train. Fix: name fewer"
        )
    nothing = [np.zeros(len(motion.valid), dtype=bool) for motion in motions]
    training = [none if motion.log in chosen else motion.valid for motion, none in zip(motions, nothing, strict=True)]
    validation = [motion.valid if motion.log in chosen else none for motion, none in zip(motions, nothing, strict=True)]
    note = f"Whole logs validate: {', '.join(sorted(chosen))}."
    return Split("logs", tuple(training), tuple(validation), 0.0, (note,))


def _every_kth(motions: Sequence[Motion], every: int) -> Split:
    if every < 2:
        raise FerryIdError(f"settings: every {every}. row cannot validate, found k = {every}. Fix: give 2 or more")
    training, validation = [], []
    for motion in motions:
        if np.count_nonzero(motion.valid) < 2 * every:
            raise _too_short(motion, motion.valid, 2 * every / motion.rate_hz, f"every {every}. row")
        count = np.cumsum(motion.valid)
        check = motion.valid & (count % every == 0)
        training.append(motion.valid & ~check)
        validation.append(check)
    note = (
        f"Every {every}. row validates, as in the thesis: neighbouring rows share the smoothing window, "
        "so that this score is too good. Judge by blocks."
    )
    return Split("every-kth", tuple(training), tuple(validation), 0.0, (note,))


def _too_short(motion: Motion, used: Flags, needed_s: float, what: str) -> TooShort:
    seconds = np.count_nonzero(used) / motion.rate_hz
    return TooShort(
        f"{motion.log}: too short for {what}, found {seconds:.1f} s of usable rows and {needed_s:.1f} s are needed. "
        "Fix: give a longer log, or several logs of the vessel in one command, of which short ones are held out whole"
    )
