"""What lies between a signal and the mapped one: factor, rotation, place, delay and bias, all at once.

With z the signal (a complex number for a pair of components), nu the mapped velocity, p the mapped position, psi the heading
and l the place of the other sensor seen from the mapped one::

    z(t) = k e^(ib) (u + iv + i r l)(t - T) [e^(i psi)] + c        velocities, in the world in brackets
    dz/dt = d/dt (k e^(ib) p + e^(i psi) l)(t - T) + c              positions
    z(t) = k r(t - T) + c,    dz/dt = k dpsi/dt (t - T) + c         yaw rates and headings

where a first-order filter of one of the two may stand in the place of the delay T: with time constant T, ``z + T dz/dt`` is
what z would be without it. All of it is averaged over the windows of the sensor checks, and solved with their regression. Both
signals have noise, which makes a factor too small in one direction of the regression and too large in the other: the intervals
hold both.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.diagnose.checks.regression import Solution, step
from ferryid.diagnose.checks.spans import RATE_HZ, Spans
from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.diagnose.second_sources.pairs import EAST, NORTH, PSI, Pair, R, U, V
from ferryid.diagnose.second_sources.thresholds import SECOND
from ferryid.types import Floats

Complex = NDArray[np.complexfloating[Any, Any]]
SCALE, ANGLE, X, Y, LATE, BIAS, BIAS_2 = range(7)
NEUTRAL = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
PAIRS = ((X, Y), (BIAS, BIAS_2))
TINY = np.array([1e-4, 1e-4, 1e-2, 1e-2, 1e-2, 1e-3, 1e-3])
STEPS = 10
LONGER = (2, 4, 8)
"""Multiples of the time after which residuals are taken as independent that are tried as well."""
OF_VECTORS, OF_SCALARS = np.ones(7, dtype=np.bool_), np.array([1, 0, 0, 0, 1, 1, 0], dtype=np.bool_)
VECTORS = frozenset({"position", "velocity"})
FLOORS = np.array([CHECKS.filtered_scale, SECOND.axis_rad, SECOND.mount_m, SECOND.mount_m, SECOND.clock_s, 0.0, 0.0])


@dataclass(frozen=True)
class Setting:
    """How a signal is taken: its kind, whether it is in the world's axes or the vessel's, mirrored, and its gain.

    ``gain`` has the unit in its size and the axes, quarter turns, in its angle. ``filtered`` takes a lag in place of a delay.
    """

    kind: str
    world: bool = False
    mirrored: bool = False
    gain: complex = 1.0
    filtered: bool = False

    @property
    def rates(self) -> bool:
        """Whether derivatives are compared, in which origins and slow wander do not count."""
        return self.kind in ("position", "heading")

    def signal(self, pair: Pair) -> Complex:
        """Return the signal in the axes and unit of what is mapped, shape (n,)."""
        value = complex_of(pair.other) / self.gain
        return np.conj(value) if self.mirrored else value

    def functional(self, spans: Spans, values: Complex) -> Complex:
        """Return what is compared in every window, shape (J,)."""
        return self._averaged(spans.rate if self.rates else spans.mean, values)

    def _averaged(self, average: Callable[[Floats], Floats], values: Complex) -> Complex:
        """Return averages of a complex signal by those of its parts: products of real and complex arrays are slow."""
        if self.kind not in VECTORS:
            return average(np.ascontiguousarray(values.real)) + 0j
        both = average(np.column_stack([values.real, values.imag]))
        return np.asarray(both[:, 0] + 1j * both[:, 1], dtype=np.complex128)

    def unfiltered(self, spans: Spans, values: Complex, lag_s: float) -> Complex:
        """Return the same of what a signal would be without a first-order lag, shape (J,)."""
        plain = self.functional(spans, values)
        if lag_s <= 0.0 or not self.filtered:
            return plain
        return plain + lag_s * self._averaged(spans.curvature if self.rates else spans.rate, values)


def complex_of(values: Floats) -> Complex:
    """Return the components of a vector as one complex number."""
    return values[:, 0] + (1j * values[:, 1] if values.shape[1] == 2 else 0j)


def source_of(setting: Setting, mapped: Floats) -> Complex:
    """Return the mapped signal that a signal of a kind is compared with, shape (n,)."""
    if setting.kind == "position":
        return np.asarray(mapped[:, NORTH] + 1j * mapped[:, EAST])
    if setting.kind == "velocity":
        body = mapped[:, U] + 1j * mapped[:, V]
        return np.asarray(body * np.exp(1j * mapped[:, PSI]) if setting.world else body)
    if setting.kind == "speed":
        return np.hypot(mapped[:, U], mapped[:, V]) + 0j
    return mapped[:, PSI if setting.kind == "heading" else R] + 0j


def lever_of(setting: Setting, mapped: Floats) -> Complex:
    """Return what a metre ahead of the mapped sensor adds to it, shape (n,)."""
    turn = np.exp(1j * mapped[:, PSI])
    if setting.kind == "position":
        return np.asarray(turn)
    if setting.kind == "velocity":
        return np.asarray(1j * mapped[:, R] * (turn if setting.world else 1.0))
    return np.zeros(len(mapped), dtype=np.complex128)


def _predicted(setting: Setting, mapped: Floats, source: Complex, p: Floats) -> Complex:
    """Return what the signal should be, shape (n,), without bias."""
    lever, gain = lever_of(setting, mapped) * complex(p[X], p[Y]), p[SCALE] * np.exp(1j * p[ANGLE])
    if setting.kind == "position":
        value = gain * source + lever
    elif setting.kind == "velocity":
        value = gain * (source + lever)
    else:
        value = p[SCALE] * source
    if p[LATE] != 0.0 and not setting.filtered:
        row = np.arange(len(value), dtype=np.float64)
        value = np.interp(row - p[LATE] * RATE_HZ, row, value)
    return np.asarray(value)


def _inverse(setting: Setting, mapped: Floats, signal: Complex, p: Floats) -> Complex:
    """Return the mapped signal that the other one leads to."""
    lever, gain = lever_of(setting, mapped) * complex(p[X], p[Y]), p[SCALE] * np.exp(1j * p[ANGLE])
    if p[LATE] != 0.0 and not setting.filtered:
        row = np.arange(len(signal), dtype=np.float64)
        signal = np.interp(row + p[LATE] * RATE_HZ, row, signal)
    if setting.kind == "position":
        return np.asarray((signal - lever) / gain)
    bias = complex(p[BIAS], p[BIAS_2])
    if setting.kind == "velocity":
        return np.asarray((signal - bias) / gain - lever)
    return np.asarray((signal - (0.0 if setting.rates else bias)) / p[SCALE])


@dataclass(frozen=True)
class Fitted:
    """What lies between a signal and the mapped one.

    Attributes
    ----------
    active
        Parameters that were let in, shape (7,).
    one, other
        Solutions of the regression in both directions.
    share
        What both have in common, of the variance in the windows.
    scatter
        Robust standard deviation of what is left, row by row, in the mapped signal's unit.
    windows
        How many there are.
    filtered
        Whether the delay is a first-order lag.
    apart
        Of each parameter that was not let in: the step to where it would be, None for the others.
    """

    active: NDArray[np.bool_]
    one: Solution
    other: Solution
    share: float
    scatter: float
    windows: int
    filtered: bool = False
    apart: tuple[Solution | None, ...] = ()

    @property
    def values(self) -> Floats:
        """Middle of the two solutions, shape (7,)."""
        return np.asarray(0.5 * (self.one.values + self.other.values))

    def certain(self, index: int) -> bool:
        """Return whether a parameter is surely not neutral, in both directions alike."""
        neutral = float(NEUTRAL[index])
        sides = (self.one.values[index] - neutral) * (self.other.values[index] - neutral) > 0.0
        return bool(
            self.active[index] and sides and self.one.certain(index, neutral) and self.other.certain(index, neutral)
        )

    def estimate(self, index: int) -> tuple[float, float] | None:
        """Return a parameter with its standard error, also of one that was not let in; None where it is not known."""
        if self.active[index]:
            return float(self.values[index]), float(max(self.one.errors[index], self.other.errors[index]))
        apart = self.apart[index]
        return None if apart is None else (float(NEUTRAL[index] + apart.values[index]), float(apart.errors[index]))

    def interval(self, index: int) -> tuple[float, float, float]:
        """Return a parameter, and the interval that holds both directions' 95 % intervals."""
        both = [one.estimate(index, "") for one in (self.one, self.other)]
        return float(self.values[index]), min(one.low for one in both), max(one.high for one in both)


def fit(setting: Setting, pairs: Sequence[Pair], length_m: float, *, delayed: bool = False) -> Fitted | None:
    """Fit what lies between a signal and the mapped one over some logs; None where there is too little of both.

    `delayed`: signals were moved by a delay already, so that what is left of it has to be let in, however small: else the place
    of the sensor would take it.
    """
    size = np.array([0.5, 0.5, max(10.0, length_m), max(10.0, length_m), 2.0, 1.0, 1.0])
    usable = OF_VECTORS if setting.kind in VECTORS else OF_SCALARS.copy()
    # A turn is a turn: headings have no factor.
    usable = usable & (np.arange(7) != SCALE) if setting.kind == "heading" else usable
    problem = _Problem(setting, tuple(pairs), usable, size)
    always = np.zeros(7, dtype=np.bool_)
    # Slow wander of a position or heading is no news; a bias of a velocity has to compete with its factor.
    always[BIAS:] = setting.rates
    always[LATE] = delayed
    start = problem.search(always & usable)
    if start is None:
        return None
    left = np.abs(problem.complex_residual(start[0]))
    kept = left <= CHECKS.outlier * max(float(np.median(left)), 1e-12)
    problem = problem.only(kept)
    found = problem.search(always & usable)
    if found is None:
        return None
    p, active = found
    one, other = problem.solve(p, active, long=True), problem.solve(p, active, reverse=True, long=True)
    if one is None or other is None:
        return None
    total = problem.functionals()
    left = problem.complex_residual(one.values)
    power = float(np.sum(np.abs(total - total.mean()) ** 2))
    share = 1.0 - float(np.sum(np.abs(left - left.mean()) ** 2)) / power if power > 0.0 else 0.0
    return Fitted(
        active, one, other, share, problem.scatter(one.values), len(left), setting.filtered,
        problem.apart(one.values, active),
    )  # fmt: skip


@dataclass(frozen=True)
class _Problem:
    setting: Setting
    pairs: tuple[Pair, ...]
    usable: NDArray[np.bool_]
    size: Floats

    @property
    def place(self) -> NDArray[np.int64]:
        """Number of each window in strides, logs far apart."""
        places, first = [], 0
        for pair in self.pairs:
            places.append(pair.spans.place + first)
            last = int(places[-1][-1]) if len(places[-1]) else first
            blocks = -(-(last + 1) // CHECKS.independent_strides) + 1
            first = blocks * CHECKS.independent_strides
        return np.concatenate(places)

    def only(self, kept: NDArray[np.bool_]) -> _Problem:
        """Return some of the windows."""
        pairs, first = [], 0
        for pair in self.pairs:
            count = len(pair.spans.starts)
            pairs.append(Pair(pair.spans.only(kept[first : first + count]), pair.other, pair.mapped, pair.good))
            first += count
        return _Problem(self.setting, tuple(pairs), self.usable, self.size)

    def functionals(self) -> Complex:
        """Return what is compared of the signal, shape (J,)."""
        return np.concatenate([self.setting.functional(pair.spans, self.setting.signal(pair)) for pair in self.pairs])

    def complex_residual(self, p: Floats, *, reverse: bool = False, at: Floats | None = None) -> Complex:
        """Return the signal less what it should be; `reverse`: where the mapped signal is made of it, with parameters `at`."""
        parts = []
        for pair in self.pairs:
            signal = self.setting.signal(pair)
            source = source_of(self.setting, pair.mapped)
            if reverse and at is not None:
                source = _inverse(self.setting, pair.mapped, signal, at)
            expected = _predicted(self.setting, pair.mapped, source, p)
            seen = self.setting.unfiltered(pair.spans, signal, p[LATE])
            parts.append(seen - self.setting.unfiltered(pair.spans, expected, -p[LATE]))
        return np.concatenate(parts) - complex(p[BIAS], p[BIAS_2])

    def channels(self, values: Complex) -> Floats:
        """Return real channels, shape (J, c)."""
        vector = self.setting.kind in VECTORS
        return np.asarray(
            np.column_stack([values.real, values.imag]) if vector else values.real[:, None], dtype=np.float64
        )

    def derivatives(self, p: Floats, *, reverse: bool = False) -> Floats:
        """Return the residual's derivatives, shape (J, c, 7)."""
        windows = sum(len(pair.spans.starts) for pair in self.pairs)
        none = np.zeros((windows, 2 if self.setting.kind in VECTORS else 1))
        columns = []
        for k, tiny in enumerate(TINY):
            if not self.usable[k]:
                columns.append(none)
                continue
            more, less = p.copy(), p.copy()
            more[k] += tiny
            less[k] -= tiny
            change = self.complex_residual(more, reverse=reverse, at=p) - self.complex_residual(
                less, reverse=reverse, at=p
            )
            columns.append(self.channels(change) / (2.0 * tiny))
        return np.stack(columns, axis=-1)

    def step(
        self, p: Floats, active: NDArray[np.bool_], e: Floats, J: Floats, Z: Floats, *, long: bool = False
    ) -> Solution | None:
        """Return the change of the active parameters; `long`: with the largest errors over several times of independence."""
        place, kept = self.place, (Z[:, :, active], J[:, :, active])
        values, errors = np.zeros(7), np.zeros(7)
        args = (*kept, e, place, self.size[active], (p - NEUTRAL)[active])
        change = step(*args)
        if change is None:
            return None
        values[active], errors[active] = change.values, change.errors
        for times in LONGER if long else ():
            wider = step(*args, CHECKS.independent_strides * times)
            if wider is not None and wider.freedom >= len(NEUTRAL):
                errors[active] = np.maximum(errors[active], wider.errors)
        errors[active] = np.hypot(errors[active], FLOORS[active])
        return Solution(values, errors, change.freedom)

    def solve(
        self, start: Floats, active: NDArray[np.bool_], *, reverse: bool = False, long: bool = False
    ) -> Solution | None:
        """Return values and errors of the active parameters."""
        if not active.any():
            blocks = len(np.unique(self.place // CHECKS.independent_strides))
            return Solution(start.copy(), np.zeros(len(start)), blocks) if blocks > len(NEUTRAL) else None
        p, solution = start.copy(), None
        for _ in range(STEPS):
            e, J = self.channels(self.complex_residual(p)), self.derivatives(p)
            Z = self.derivatives(p, reverse=True) if reverse else J
            change = self.step(p, active, e, J, Z, long=long)
            if change is None:
                return None
            moved = np.clip(change.values, -self.size, self.size)
            p = p + moved
            p[SCALE] = max(p[SCALE], 1e-3)
            solution = Solution(p, change.errors, change.freedom)
            if np.all(np.abs(moved) <= 0.05 * change.errors + 1e-9):
                break
        return solution

    def search(self, active: NDArray[np.bool_]) -> tuple[Floats, NDArray[np.bool_]] | None:
        """Let parameters in, the most certain first, until none of the others is certain."""
        p, active = NEUTRAL.copy(), active.copy()
        while True:
            if active.any():
                solved = self.solve(p, active)
                if solved is None:
                    return None
                p = solved.values
            e, J = self.channels(self.complex_residual(p)), self.derivatives(p)
            scores = []
            for k in np.flatnonzero(self.usable & ~active).tolist():
                more = active.copy()
                more[self.together(k)] = True
                change = self.step(p, more, e, J, J)
                if change is not None and change.certain(k):
                    scores.append((change.score(k), k))
            if not scores:
                return p, active
            chosen = max(scores)[1]
            active[self.together(chosen)] = True

    def apart(self, p: Floats, active: NDArray[np.bool_]) -> tuple[Solution | None, ...]:
        """Return the step of each parameter that was not let in, beside all that were."""
        e, J = self.channels(self.complex_residual(p)), self.derivatives(p)
        found: list[Solution | None] = []
        for k in range(len(NEUTRAL)):
            more = active.copy()
            more[self.together(k)] = True
            found.append(self.step(p, more, e, J, J, long=True) if self.usable[k] and not active[k] else None)
        return tuple(found)

    def together(self, k: int) -> list[int]:
        """Return which parameters are let in with one: both components of a vector."""
        pair = next((pair for pair in PAIRS if k in pair), (k,))
        return [one for one in pair if self.usable[one]]

    def scatter(self, p: Floats) -> float:
        """Return the robust standard deviation of what is left row by row, about the middle of each log."""
        parts = []
        for pair in self.pairs:
            source = source_of(self.setting, pair.mapped)
            away = (self.setting.signal(pair) - _predicted(self.setting, pair.mapped, source, p))[pair.good]
            if len(away):
                parts.append(self.channels(away) - np.median(self.channels(away), axis=0))
        return 1.4826 * float(np.median(np.abs(np.concatenate(parts))))
