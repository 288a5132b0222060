"""Velocities that stay at one value, mostly zero, while the pose moves: an instrument that was lost, or a filter that stopped.

A velocity is compared with what positions and headings give of the same axis over the time for which it does not change. A
vessel that lies still does not move by its pose either; a coarse sensor, or one with a dead band, may repeat a value while
the vessel moves by less than its resolution.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted
from ferryid.signals.pose_limits import Samples, mean_interval
from ferryid.signals.poses import PoseFault
from ferryid.signals.thresholds import SIGNALS
from ferryid.types import Floats, Nanoseconds
from ferryid.vessel.frames import to_body

_AXES = {
    "u": ("surge velocity", "position", "m/s", "m"),
    "v": ("sway velocity", "position", "m/s", "m"),
    "r": ("yaw rate", "heading", "rad/s", "rad"),
    "vel_N": ("velocity north", "position", "m/s", "m"),
    "vel_E": ("velocity east", "position", "m/s", "m"),
}


@dataclass(frozen=True)
class HeldVelocity:
    """One stretch in which a velocity stays at one value while the pose moves.

    Attributes
    ----------
    signal
        Canonical name.
    first, last
        Indices of its first and last wrong sample.
    start_ns, end_ns
        Times of the last right sample before and the first right one after [ns], or of the first and last of all.
    value
        What it stays at [m/s or rad/s].
    moved
        How far the pose moves otherwise than by that velocity, from end to end of its range [m or rad].
    """

    signal: str
    first: int
    last: int
    start_ns: int
    end_ns: int
    value: float
    moved: float

    @property
    def samples(self) -> int:
        """Number of wrong samples."""
        return self.last - self.first + 1

    @property
    def seconds(self) -> float:
        """Length between the right samples on either side [s]."""
        return (self.end_ns - self.start_ns) * 1e-9


def held_velocities(samples: Samples, poses: Sequence[PoseFault]) -> tuple[HeldVelocity, ...]:
    """Return where velocities stay at one value while the pose moves, in order of time.

    Parameters
    ----------
    samples
        Canonical name to times and cleaned values, as for `ferryid.signals.poses.pose_faults`.
    poses
        What that found; where the pose is wrong it shows nothing.
    """
    found: list[HeldVelocity] = []
    for name, (_, of, _, _) in _AXES.items():
        path = _path(samples, name)
        if name not in samples or path is None:
            continue
        wrong = [fault for fault in poses if fault.signal in (of, "heading")]
        if any(not fault.left_out for fault in wrong):
            continue
        found += _held(name, *samples[name], *path, wrong)
    return tuple(sorted(found, key=lambda one: (one.start_ns, one.signal)))


def held_sentences(held: Sequence[HeldVelocity], samples: Samples) -> tuple[str, ...]:
    """Return what was found as sentences with numbers, one for each signal."""
    said = []
    for name, (what, of, unit, way) in _AXES.items():
        those = [one for one in held if one.signal == name]
        if those:
            values = sorted({round(one.value, 6) for one in those})
            at = f"{values[0]:g} {unit}" if len(values) == 1 else f"one of {counted(len(values), 'value')}"
            count = sum(one.samples for one in those)
            said.append(
                f"{name}: the {what} stays at {at} while the {of} moves, {counted(len(those), 'time')}, at most for "
                f"{max(one.seconds for one in those):.1f} s and {max(one.moved for one in those):.3g} {way}; {count} of "
                f"{counted(samples[name][1].size, 'sample')} left out."
            )
    return tuple(said)


def held_reason(one: HeldVelocity) -> str:
    """Return what is wrong with one stretch, to stand after "because"."""
    what, of, unit, way = _AXES[one.signal]
    return f"the {what} stays at {one.value:g} {unit} while the {of} moves by {one.moved:.3g} {way}"


def _path(samples: Samples, name: str) -> tuple[Floats, Floats] | None:
    """Return times [s] and the integral of one velocity as the pose gives it [m or rad]; None where it does not."""
    if name == "r":
        return _known(samples, "psi")
    if name in ("vel_N", "vel_E"):
        return _known(samples, "x" if name == "vel_N" else "y")
    north, east, psi = (_known(samples, one) for one in ("x", "y", "psi"))
    if north is None or east is None or psi is None or samples["x"][1].size != samples["y"][1].size:
        return None
    time_ns, x, y = samples["x"][0], samples["x"][1], samples["y"][1]
    both = np.isfinite(x) & np.isfinite(y)
    time_s = _seconds(time_ns[both])
    if time_s.size < SIGNALS.moved_poses:
        return None
    pointing = np.interp((time_s[1:] + time_s[:-1]) / 2, *psi)
    ahead, aside = to_body(np.diff(x[both]), np.diff(y[both]), pointing)
    return time_s, np.concatenate([[0.0], np.cumsum(ahead if name == "u" else aside)])


def _known(samples: Samples, name: str) -> tuple[Floats, Floats] | None:
    if name not in samples:
        return None
    time_ns, values = samples[name]
    finite = np.isfinite(values)
    return (_seconds(time_ns[finite]), values[finite]) if np.count_nonzero(finite) >= SIGNALS.moved_poses else None


def _seconds(time_ns: Nanoseconds) -> Floats:
    return np.asarray(time_ns * 1e-9, dtype=np.float64)


def _held(
    name: str, time_ns: Nanoseconds, values: Floats, path_s: Floats, path: Floats, wrong: Sequence[PoseFault]
) -> list[HeldVelocity]:
    known = np.flatnonzero(np.isfinite(values))
    if known.size < SIGNALS.moved_poses:
        return []
    time_s, value = _seconds(time_ns[known]), values[known]
    step = np.diff(value)
    fresh = time_s[np.concatenate([[True], step != 0.0])]
    if fresh.size < SIGNALS.moved_poses:
        return []  # a constant, which is refused as one
    longest = max(SIGNALS.moved_periods * mean_interval(np.diff(fresh)), SIGNALS.moved_s)
    usual = _speed(path_s, path)
    moves = np.abs(np.diff(path))
    if not moves.any():
        return []
    least = max(
        SIGNALS.moved_rad if name == "r" else SIGNALS.moved_m,
        SIGNALS.moved_steps * float(np.median(moves[moves > 0.0])),
    )
    resolution = float(np.median(np.abs(step[step != 0.0])))
    band = float(np.quantile(np.abs(value[value != 0.0]), SIGNALS.dead_band))
    same = np.concatenate([[False], (step == 0.0) & (np.diff(time_s) <= longest), [False]])
    edges = np.flatnonzero(np.diff(same.astype(np.int8)))
    noise = _disagreement(time_s, value, path_s, path)
    found = []
    for before, last in zip(edges[::2], edges[1::2], strict=True):
        first_s, last_s, at = float(time_s[before]), float(time_s[last]), float(value[before])
        if last_s - first_s <= longest:
            continue
        if any(fault.start_ns * 1e-9 < last_s and fault.end_ns * 1e-9 > first_s for fault in wrong):
            continue
        inside = (path_s >= first_s) & (path_s <= last_s)
        if np.count_nonzero(inside) < SIGNALS.moved_poses:
            continue
        away = path[inside] - at * path_s[inside]
        moved = float(np.ptp(away))
        slack = max(resolution, band) if at == 0.0 else resolution
        # The mean square of noise in several windows scatters less about its expectation than that in one.
        scatter = (SIGNALS.moved_noises**2 - 1.0) / np.sqrt(_windows(last_s - first_s))
        if moved <= least or _speed(path_s[inside], away) <= max(
            slack + noise * np.sqrt(1.0 + scatter), SIGNALS.moved_share * usual
        ):
            continue
        # A value that is not zero was measured once.
        first = int(before) + (at != 0.0)
        ends = known[max(first - 1, 0)], known[min(last + 1, known.size - 1)]
        found.append(
            HeldVelocity(
                name, int(known[first]), int(known[last]), int(time_ns[ends[0]]), int(time_ns[ends[1]]), at, moved
            )
        )
    return found


def _disagreement(time_s: Floats, value: Floats, path_s: Floats, path: Floats) -> float:
    """Return by how much a velocity and that of the pose usually differ, in means over `SIGNALS.moved_window_s`."""
    way = np.concatenate([[0.0], np.cumsum((value[1:] + value[:-1]) / 2 * np.diff(time_s))])
    first, last = max(time_s[0], path_s[0]), min(time_s[-1], path_s[-1])
    edges = np.arange(first, last, SIGNALS.moved_window_s)
    if edges.size < SIGNALS.moved_poses:
        return 0.0
    apart = np.diff(np.interp(edges, path_s, path) - np.interp(edges, time_s, way)) / SIGNALS.moved_window_s
    return 1.4826 * float(np.median(np.abs(apart)))


def _speed(time_s: Floats, path: Floats) -> float:
    """Return the root-mean-square speed along a path, in means over `SIGNALS.moved_window_s` or the whole of it."""
    length = float(time_s[-1] - time_s[0])
    if length <= 0.0:
        return 0.0
    parts = _windows(length)
    edges = np.linspace(time_s[0], time_s[-1], parts + 1)
    way: NDArray[np.float64] = np.diff(np.interp(edges, time_s, path)) * (parts / length)
    return float(np.sqrt(np.mean(way**2)))


def _windows(seconds: float) -> int:
    """Return how many means a stretch of this length has."""
    return max(1, int(seconds / SIGNALS.moved_window_s))
