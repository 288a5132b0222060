"""The tables between a recording and a fit: aligned signals, then smoothed motion with its forces."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ferryid.types import Flags, Floats


@dataclass(frozen=True)
class Doubt:
    """A kinematic contradiction between signals: a sentence, whether it is certain that one of them is wrong, and its remedy.

    `remedy` is what to change in the profile, with the tables of the signals; empty where that is in the sentence.
    """

    says: str
    certain: bool
    remedy: str = ""


@dataclass(frozen=True)
class Interval:
    """One unbroken stretch of rows that are not used.

    Attributes
    ----------
    start_s, end_s
        Times of its first row and of the first row after it [s], from the first row of the track.
    signals
        Canonical names of those that are wrong or were not measured; empty where that is not known of single signals.
    reason
        What is wrong with it, to stand after "because".
    """

    start_s: float
    end_s: float
    signals: tuple[str, ...]
    reason: str


@dataclass(frozen=True)
class LeftOut:
    """Rows of a log that are not used, for one reason.

    Attributes
    ----------
    reason
        What is wrong with them, to stand after "because".
    rows
        Number of rows.
    stretches
        Number of unbroken stretches of them.
    seconds
        Their length together [s].
    intervals
        The stretches, in order of time.
    """

    reason: str
    rows: int
    stretches: int
    seconds: float
    intervals: tuple[Interval, ...] = ()

    @staticmethod
    def of(
        reason: str,
        rows: Flags,
        rate_hz: float,
        first_row: int = 0,
        cause: Callable[[slice], tuple[Sequence[str], str]] | None = None,
    ) -> tuple[LeftOut, ...]:
        """Count rows that are left out; empty where there are none.

        Parameters
        ----------
        reason
            What is wrong with them.
        rows
            Flags of the rows, shape (n,).
        rate_hz
            Rows per second.
        first_row
            The row whose time is zero.
        cause
            Signals and reason of one stretch of rows, by default none and `reason`.
        """
        count = int(np.count_nonzero(rows))
        if not count:
            return ()
        intervals = []
        for stretch in segments(rows):
            signals, why = ((), reason) if cause is None else cause(stretch)
            first, last = ((row - first_row) / rate_hz for row in (stretch.start, stretch.stop))
            intervals.append(Interval(first, last, tuple(signals), why))
        return (LeftOut(reason, count, len(intervals), count / rate_hz, tuple(intervals)),)


def segments(valid: Flags) -> list[slice]:
    """Return the unbroken stretches of True, in order."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], valid, [False]]).astype(np.int8)))
    return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


@dataclass(frozen=True)
class Track:
    """All signals of one recording on one uniform grid, in SI units, NED world frame and FRD body frame.

    Attributes
    ----------
    log
        Name of the log.
    t
        Time [s] since the first row, uniform, shape (n,).
    t0_ns
        Absolute time of the first row [ns].
    rate_hz
        Rows per second.
    columns
        Canonical signal name to values, shape (n,), NaN where nothing was measured. Names and units: see
        `ferryid.vessel.signal_map`.
    valid
        True where position or velocity and every actuator were measured: no gap is bridged, shape (n,).
    repairs
        Counted repairs and findings, as sentences with numbers, for `inspect` and the report.
    doubts
        Contradictions between signals; their sentences stand among the repairs too.
    left_out
        Rows that are not valid, by reason; each row once.
    slopes
        Which of `u, v, r` nothing measured: they are slopes of the position or heading.
    """

    log: str
    t: Floats
    t0_ns: int
    rate_hz: float
    columns: Mapping[str, Floats]
    valid: Flags
    repairs: tuple[str, ...] = ()
    doubts: tuple[Doubt, ...] = ()
    left_out: tuple[LeftOut, ...] = ()
    slopes: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Motion:
    """Smoothed motion and forces of one log, ready for regression. All arrays share the first axis, n rows.

    Attributes
    ----------
    log
        Name of the log.
    t
        Time [s] since the log's first row.
    rate_hz
        Rows per second.
    eta
        Position north, east [m] and heading [rad, unwrapped], NED, shape (n, 3); NaN where not measured.
    nu
        Smoothed surge, sway [m/s] and yaw rate [rad/s] over ground, FRD at the body origin, shape (n, 3).
    nu_dot
        Time derivative of `nu` [m/s², m/s², rad/s²], shape (n, 3).
    tau
        Applied actuator force from feedback [N, N, N·m], FRD, shape (n, 3), smoothed with the same window.
    tau_d
        Commanded force, same shape and frame, or None when the log has none.
    eta_d
        Desired position [m] and heading [rad], NED, shape (n, 3), NaN where the log has none, or None.
    wind
        True wind [m/s] north, east, where the air goes to, shape (n, 2), or None.
    current
        Current [m/s] north, east, where the water goes to, shape (n, 2), or None.
    payload
        Measured payload [kg] and its place forward of the body origin [m], held from one measurement to the next and not
        smoothed, shape (n, 2), or None.
    valid
        True for rows whose whole smoothing window lies inside measured data.
    raw_nu
        Unsmoothed velocities, shape (n, 3).
    repairs
        Sentences carried on from the track, and those of smoothing.
    left_out
        Rows that are not valid because of gaps, faults and what smoothing loses beside them, by reason; each row once.
    sway_measured
        False where sway velocity was not measured and stands as zero: forces and motion in sway say nothing.
    tau_steadied
        What `tau` is beside velocities whose slow errors are replaced by the position's, shape (n, 3), or None where it is the
        same: forces that a model knows, and that are taken off, go with the velocity.
    """

    log: str
    t: Floats
    rate_hz: float
    eta: Floats
    nu: Floats
    nu_dot: Floats
    tau: Floats
    valid: Flags
    raw_nu: Floats
    tau_d: Floats | None = None
    eta_d: Floats | None = None
    wind: Floats | None = None
    current: Floats | None = None
    payload: Floats | None = None
    repairs: tuple[str, ...] = field(default=())
    left_out: tuple[LeftOut, ...] = ()
    sway_measured: bool = True
    tau_steadied: Floats | None = None
