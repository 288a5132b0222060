"""How far a vessel can move between two poses: from the poses themselves, and from the measured velocity."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ferryid.signals.thresholds import SIGNALS
from ferryid.types import Floats, Nanoseconds
from ferryid.vessel.frames import to_world, wrap

Complex = NDArray[np.complex128]
Samples = Mapping[str, tuple[Nanoseconds, Floats]]
"""Canonical name to times [ns] and cleaned values, NaN where missing."""
Path = Callable[[Floats], tuple[Complex, Floats]]
"""Times [s] to the integral of the velocity, and to the integral of its size."""


@dataclass(frozen=True)
class Limits:
    """How far a pose can move, from the log itself: metres for positions, radians for headings."""

    angle: bool
    start_ns: int
    period_s: float
    step: float
    speed: float
    floor: float
    path: Path | None

    @staticmethod
    def of(time_s: Floats, values: Complex, path: Path | None, start_ns: int, *, angle: bool) -> Limits:
        fixes = np.flatnonzero(np.concatenate([[True], np.diff(values) != 0.0]))
        interval = np.diff(time_s[fixes])
        if angle:
            floor, most, least = SIGNALS.heading_jump_rad, SIGNALS.attitude_rate_radps, SIGNALS.least_rate_radps
        else:
            floor, most, least = SIGNALS.position_step_m, SIGNALS.position_rate_mps, SIGNALS.least_speed_mps
        if interval.size == 0:
            return Limits(angle, int(start_ns), float("inf"), 0.0, most, floor, path)
        move = np.abs(difference(values[fixes], angle=angle))
        period = mean_interval(interval)
        # Over a second, noise weighs little.
        later = np.minimum(np.searchsorted(time_s, time_s + 1.0), time_s.size - 1)
        lasts = time_s[later] - time_s
        way = np.abs(between(values, np.arange(time_s.size), later, angle=angle))
        whole = (lasts > 0.5) & (lasts < 2.0)
        speed = float(np.quantile(way[whole] / lasts[whole], SIGNALS.speed_quantile)) if whole.any() else most
        return Limits(
            angle,
            int(start_ns),
            period,
            float(np.median(move)),
            float(np.clip(SIGNALS.jump_speeds * speed, least, most)),
            floor,
            path,
        )

    def jump(self, move: Floats, lasts: Floats) -> NDArray[np.bool_]:
        """True where a pose moves farther than the vessel can."""
        return np.asarray(
            move > np.maximum(SIGNALS.jump_noises * self.step, self.floor + self.speed * lasts), dtype=bool
        )

    def elsewhere(self, move: float) -> bool:
        """True where a pose is not where noise and a usual interval may bring it."""
        return move > max(SIGNALS.held_steps * self.step, self.speed * self.period_s)

    def known(self, at_s: Floats) -> bool:
        """True where the velocity is measured throughout."""
        return self.path is not None and bool(np.isfinite(self.path(at_s + self.start_ns * 1e-9)[0]).all())

    def ways(self, first_s: Floats, last_s: Floats) -> Complex:
        """Return the ways by the velocity from first to last times; 0 where it was not measured."""
        if self.path is None or first_s.size == 0:
            return np.zeros(first_s.size, dtype=np.complex128)
        start_s = self.start_ns * 1e-9
        way = self.path(last_s + start_s)[0] - self.path(first_s + start_s)[0]
        return np.where(np.isfinite(way), way, 0.0)

    def travelled(self, first_s: float, last_s: float) -> float:
        """Return how far the velocity has brought the vessel in the meantime; 0 where that is not known."""
        if self.path is None:
            return 0.0
        way = self.path(np.array([first_s, last_s]) + self.start_ns * 1e-9)[0]
        return float(abs(way[1] - way[0])) if np.isfinite(way).all() else 0.0

    def back(self, jump: float, move: complex, first_s: float, last_s: float) -> bool:
        """True where a pose after a while is where the vessel's velocity would have brought it, and by that not anywhere.

        Parameters
        ----------
        jump
            How far it was off in between.
        move
            From the last pose before to the first one after.
        first_s, last_s
            Their times [s].
        """
        lasts = last_s - first_s
        known = None if self.path is None else self.path(np.array([first_s, last_s]) + self.start_ns * 1e-9)
        way, reach = 0j, self.speed / SIGNALS.jump_speeds * lasts
        if known is not None and np.isfinite(known[0]).all():
            way, reach = complex(known[0][1] - known[0][0]), SIGNALS.drift_share * float(known[1][1] - known[1][0])
        miss = move - way
        away = abs(float(wrap(np.array([miss.real]))[0])) if self.angle else abs(miss)
        return away <= SIGNALS.return_share * jump and reach <= SIGNALS.return_share * jump


def mean_interval(interval: Floats) -> float:
    """Return the mean of the intervals [s] without the long ones."""
    period = float(interval.mean())
    for _ in range(5):
        period = float(interval[interval <= 3.0 * period].mean())
    return period


def between(values: Complex, first: NDArray[np.int64], last: NDArray[np.int64], *, angle: bool) -> Complex:
    change = values[last] - values[first]
    return np.asarray(wrap(change.real) + 0j if angle else change)


def difference(values: Complex, *, angle: bool) -> Complex:
    change = np.diff(values)
    return np.asarray(wrap(change.real) + 0j if angle else change)


def finite(time_ns: Nanoseconds, values: Complex) -> tuple[Nanoseconds, Complex]:
    finite = np.isfinite(values)
    return time_ns[finite], values[finite]


def integral(samples: Samples, name: str) -> Path | None:
    if name not in samples:
        return None
    time_ns, values = finite(samples[name][0], samples[name][1].astype(np.complex128))
    return _summed(time_ns, values)


def way_over_ground(samples: Samples) -> Path | None:
    """Return the integral of the velocity over ground, north + i east."""
    if "vel_N" in samples and "vel_E" in samples and samples["vel_N"][1].size == samples["vel_E"][1].size:
        return _summed(*finite(samples["vel_N"][0], samples["vel_N"][1] + 1j * samples["vel_E"][1]))
    if not {"u", "v", "psi"} <= samples.keys() or samples["u"][1].size != samples["v"][1].size:
        return None
    time_ns, body = finite(samples["u"][0], samples["u"][1] + 1j * samples["v"][1])
    turned_ns, psi = finite(samples["psi"][0], samples["psi"][1].astype(np.complex128))
    if time_ns.size < 2 or turned_ns.size < 2:
        return None
    north, east = to_world(body.real, body.imag, np.interp(time_ns, turned_ns, psi.real))
    return _summed(time_ns, north + 1j * east)


def _summed(time_ns: Nanoseconds, rate: Complex) -> Path | None:
    if time_ns.size < 2:
        return None
    time_s = time_ns * 1e-9
    interval = np.diff(time_ns) * 1e-9
    middle = (rate[1:] + rate[:-1]) / 2
    way = np.concatenate([[0.0], np.cumsum(middle * interval)])
    length = np.concatenate([[0.0], np.cumsum(np.abs(middle) * interval)])

    north, east = np.ascontiguousarray(way.real), np.ascontiguousarray(way.imag)  # or every call copies them

    def path(at_s: Floats) -> tuple[Complex, Floats]:
        along = np.interp(at_s, time_s, north) + 1j * np.interp(at_s, time_s, east)
        inside = (at_s >= time_s[0] - 1.0) & (at_s <= time_s[-1] + 1.0)
        return np.where(inside, along, np.nan), np.interp(at_s, time_s, length)

    return path
