"""Held samples: a sensor's last value, repeated while nothing new was measured.

Long repeats are taken out while a log is read, so that nothing is made of them; here they are found all the same.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted
from ferryid.diagnose.checks.check import Check, SensorFinding
from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.diagnose.data.estimate import Estimate
from ferryid.effects.force_model import Measurements
from ferryid.effects.measurements import interpolate_gaps
from ferryid.types import Floats

NAMES = ("north", "east", "heading", "surge", "sway", "yaw rate")


def find(measurements: Measurements) -> SensorFinding | None:
    """Return the share of the log in which some channel is held, and the longest time of it."""
    held, every = _held(measurements)
    rows = np.asarray(every.any(axis=1))
    edges = _edges(rows)
    parameters = _parameters(rows, measurements.step_s)
    percent, longest = parameters["share"].value, parameters["longest"].value
    if percent < 100.0 * (CHECKS.long_held_share if longest >= CHECKS.long_held_s else CHECKS.least_held_share):
        return None
    names = [name for name, column in zip(NAMES, every.T, strict=True) if column.any()]

    def correct(measured: Measurements) -> Measurements:
        # What was held is bridged: the jump at its end is no motion, and means reach over it.
        both = ((measured.eta, held[:, :3]), (measured.nu_raw, held[:, 3:]))
        eta, nu_raw = (interpolate_gaps(np.where(gone, np.nan, now), measured.usable) for now, gone in both)
        return replace(measured, eta=eta, nu_raw=nu_raw, usable=measured.usable & ~rows)

    return SensorFinding(
        "held_samples",
        parameters,
        f"Old samples were repeated {counted(len(edges), 'time')}, for up to {longest:.1f} s, "
        f"{percent:.1f} % of the log ({', '.join(names)}).",
        correct,
        {"first_s": measurements.t[edges[:, 0]], "last_s": measurements.t[edges[:, 1] - 1]},
    )


def estimate(measurements: Measurements) -> dict[str, Estimate]:
    """Return the share however small; see `find`."""
    return _parameters(np.asarray(_held(measurements)[1].any(axis=1)), measurements.step_s)


def _held(measurements: Measurements) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the channels that are held now, and those beside them that were before the log was read, shape (n, 6) each."""
    columns = np.column_stack([measurements.eta, measurements.nu_raw])
    held = np.column_stack([held_rows(column, measurements.usable, measurements.step_s) for column in columns.T])
    # A position is one sample: what repeats in one direction only is motion across it, or a resolution.
    held[:, :2] &= held[:, :2].all(axis=1, keepdims=True)
    return held, held | taken_out(measurements, columns)


def _edges(rows: NDArray[np.bool_]) -> NDArray[np.int64]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], rows, [False]]).astype(np.int8)))
    return edges.reshape(-1, 2)


def _parameters(rows: NDArray[np.bool_], step_s: float) -> dict[str, Estimate]:
    """Return share and longest time of the rows that are held; each hold began and ended within a row."""
    edges = _edges(rows)
    percent, ends = (100.0 * count / len(rows) for count in (int(rows.sum()), len(edges)))
    longest = float((edges[:, 1] - edges[:, 0]).max(initial=0)) * step_s
    return {
        "share": Estimate(percent, max(percent - ends, 0.0), percent + ends, "%"),
        "longest": Estimate(longest, max(longest - step_s, 0.0), longest + step_s, "s"),
    }


def held_rows(values: Floats, usable: NDArray[np.bool_], step_s: float) -> NDArray[np.bool_]:
    """Return which rows only repeat an earlier one for longer than the channel's rate and resolution explain, shape (n,)."""
    held = np.zeros(len(values), dtype=np.bool_)
    repeat = (np.diff(values) == 0.0) & usable[1:] & usable[:-1]
    step = np.abs(np.diff(values))[usable[1:] & usable[:-1]]
    changes = step[step > 0.0]
    if not repeat.any() or len(changes) < 10:
        return held
    edges = np.flatnonzero(np.diff(np.concatenate([[False], repeat, [False]]).astype(np.int8))).reshape(-1, 2)
    lengths = edges[:, 1] - edges[:, 0] + 1
    usual = float(np.median(np.concatenate([lengths, np.ones(max(len(changes) - len(lengths), 0))])))
    long = lengths > max(CHECKS.held_runs * usual, CHECKS.held_rows, CHECKS.held_s / step_s)
    jump, rounding = _least_jump(values, usable), _Rounding(values, usable)
    for first, last in edges[long].tolist():
        missed = abs(float(values[min(last + 1, len(values) - 1)] - values[last]))
        if (
            values[first] != 0.0
            and missed > max(jump, rounding.jump_after(first, last))
            and missed >= CHECKS.held_missed * _usual(values, usable, first, last)
        ):
            held[first + 1 : last + 1] = True
    return held


def taken_out(measurements: Measurements, columns: Floats) -> NDArray[np.bool_]:
    """Return the rows of repeats that were taken out while the log was read, shape (n, 6).

    As of those that are found here, some channel has to have moved on meanwhile: a vessel at rest repeats itself rightly.
    """
    held = np.zeros(columns.shape, dtype=np.bool_)
    n = len(columns)
    jumps = [_least_jump(column, measurements.usable) for column in columns.T] if measurements.repeats else []
    for channels, start_s, end_s in measurements.repeats:
        first, last = (int(np.searchsorted(measurements.t, at - 0.5 * measurements.step_s)) for at in (start_s, end_s))
        if not 0 < last - first < n:
            continue
        ends = min(last, n - 1)
        missed = {k: abs(float(columns[ends, k] - columns[first, k])) for k in channels}
        moved = [
            one > jumps[k] and one >= CHECKS.held_missed * _usual(columns[:, k], measurements.usable, first, last - 1)
            for k, one in missed.items()
        ]
        if any(moved) and end_s - start_s > CHECKS.held_s:
            held[first + 1 : last, channels] = True
    return held


def _least_jump(values: Floats, usable: NDArray[np.bool_]) -> float:
    """Return how far a channel has to jump after a hold: beyond its resolution where it is coarse or was interpolated."""
    changes = np.abs(np.diff(values))[usable[1:] & usable[:-1]]
    changes = changes[changes > 0.0]
    coarse = np.unique(np.round(changes, 9)).size < CHECKS.coarse_share * len(changes)
    return CHECKS.held_jump * float(np.median(changes)) if coarse or _interpolated(values, usable) else 0.0


class _Rounding:
    """How far a channel has to jump after a hold where its values repeat at times around it too.

    Numbers written with so many digits are coarser where they are large: a degree beyond 100, a tenth below. A whole log then
    has no one resolution, and between the rows of a grid a step of it is in two parts.
    """

    def __init__(self, values: Floats, usable: NDArray[np.bool_]) -> None:
        same = np.flatnonzero(usable[1:] & usable[:-1])
        self._step = np.abs(np.diff(values))[same]
        self._changed = np.flatnonzero(self._step > 0.0)
        self._at = same[self._changed]

    def jump_after(self, first: int, last: int) -> float:
        """Return it of a hold from row `first` to row `last`, else zero."""
        before = self._changed[: np.searchsorted(self._at, first)]
        after = self._changed[np.searchsorted(self._at, last, side="right") :]
        sides = [one for one in (before[-CHECKS.held_around :], after[: CHECKS.held_around]) if one.size]
        rows = sum(int(one[-1] - one[0]) + 1 for one in sides)
        changes = sum(one.size for one in sides)
        if rows - changes < CHECKS.coarse_share * rows or not sides:
            return 0.0
        return CHECKS.held_jump * max(float(np.median(self._step[one])) for one in sides)


def _usual(values: Floats, usable: NDArray[np.bool_], first: int, last: int) -> float:
    """Return how far a channel usually moves in as long as some rows, at times around them."""
    rows = last + 1 - first
    some = np.arange(
        max(0, first - CHECKS.held_around * rows), min(len(values) - rows, last + CHECKS.held_around * rows)
    )
    some = some[(some + rows <= first) | (some > last)]
    some = some[usable[some] & usable[some + rows]]
    return float(np.median(np.abs(values[some + rows] - values[some]))) if some.size else 0.0


def _interpolated(values: Floats, usable: NDArray[np.bool_]) -> bool:
    """Tell whether values lie on straight lines between fewer samples."""
    slope = np.diff(values)
    moving = (slope[1:] != 0.0) & (slope[:-1] != 0.0) & usable[2:] & usable[1:-1] & usable[:-2]
    if not moving.any():
        return False
    bend, size = np.abs(np.diff(slope))[moving], np.abs(slope[1:])[moving]
    return bool(np.mean(bend <= 1e-3 * size + 1e-12) > CHECKS.straight_share)


CHECK = Check("held_samples", "Values held without a measurement", find, 5, estimate)
