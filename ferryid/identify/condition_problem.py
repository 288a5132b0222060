"""Equations of motion of several logs with a hull that they share and conditions of their own, as sums for an estimate."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ferryid.cached import cached_property
from ferryid.identify.condition_kinds import WIND, ChangedWindows, ConditionKind, MotionSamples, gain_matrix, kinds_of
from ferryid.identify.thresholds import IDENTIFY
from ferryid.regression import MixedFit, fit_simpls
from ferryid.types import Flags, Floats, Ints

if TYPE_CHECKING:
    from ferryid.identify.weak_data import WeakData

BLOCKS = 3
"""Contiguous parts of every log, each held out in turn."""
STEADY = 9
"""Steady forces of a log: along the hull, north and east, on each axis."""


@dataclass(frozen=True, eq=False)
class HullAndConditions:
    """The equations of motion of L logs, with a hull that they share and conditions of their own.

    Attributes
    ----------
    logs
        The logs' windows.
    mask
        Where functions act, shape (K, 3).
    spread
        Standard deviations of the gains' prior, shape (K, 3); infinite where nothing is known.
    sigma
        Standard deviation of the residual, shape (3,).
    autocorrelation
        Of one window's residual with the next one's.
    kinds
        Kinds that are tried.
    start
        Gains, shape (K, 3), and intercept of the hull about which the first step is linear.
    winds
        Winds of the logs about which the first step is linear, shape (L, 2); NaN where none is estimated.
    """

    logs: tuple[ChangedWindows, ...]
    mask: Flags
    spread: Floats
    sigma: Floats
    autocorrelation: float
    kinds: tuple[ConditionKind, ...]
    start: tuple[Floats, Floats]
    winds: Floats

    @property
    def always(self) -> dict[str, float]:
        """Spread in sizes of the kind that takes part whatever the data say: the wind, where one is estimated."""
        return {kind.id: 1.0 for kind in self.kinds if kind.id == WIND}

    def begun(self) -> list[dict[str, Floats]]:
        """Return the conditions of the logs about which the first step is linear."""
        return [{} if log.absent(WIND) else {WIND: wind} for log, wind in zip(self.logs, self.winds, strict=True)]

    @cached_property
    def own(self) -> tuple[Ints, ...]:
        """Which functions act on each axis."""
        return tuple(np.flatnonzero(column) for column in self.mask.T)

    @cached_property
    def low(self) -> Ints:
        """Where the shared coefficients of each axis begin, and their number."""
        return np.cumsum([0, *(len(one) + 1 for one in self.own)])

    @cached_property
    def places(self) -> dict[str, Ints]:
        """Which own coefficients belong to each kind, behind the steady forces."""
        places, low = {}, STEADY
        for kind in self.kinds:
            places[kind.id] = np.arange(low, low + len(kind.parameters))
            low += len(kind.parameters)
        return places

    @cached_property
    def prior(self) -> Floats:
        """Precision of the shared coefficients."""
        values = np.zeros(int(self.low[-1]))
        for axis, own in enumerate(self.own):
            spread = self.spread[own, axis]
            values[self.low[axis] : self.low[axis + 1] - 1] = np.where(np.isfinite(spread), spread**-2.0, 0.0)
            # A hull that port and starboard make alike feels no force at rest.
            values[self.low[axis + 1] - 1] = self.sigma[axis] ** -2.0
        return values

    def hull(self, fit: MixedFit) -> tuple[Floats, Floats]:
        """Return gains, shape (K, 3), and intercept of an estimate."""
        gains, intercept = np.zeros(self.mask.shape), np.zeros(3)
        for axis, own in enumerate(self.own):
            gains[own, axis] = fit.shared[self.low[axis] : self.low[axis + 1] - 1]
            intercept[axis] = fit.shared[self.low[axis + 1] - 1]
        return gains, intercept

    def sums(self, hull: tuple[Floats, Floats], values: Sequence[Mapping[str, Floats]]) -> tuple[Floats, ...]:
        """Return the sums of the `BLOCKS` parts of all logs, linearised about a hull and conditions, (L, n, n) each."""
        P, D = int(self.low[-1]), STEADY + sum(len(kind.parameters) for kind in self.kinds)
        parts = np.zeros((BLOCKS, len(self.logs), P + D + 1, P + D + 1))
        for number, (log, at) in enumerate(zip(self.logs, values, strict=True)):
            for axis, table in enumerate(self._columns(log, at, hull)):
                for block, rows in enumerate(np.array_split(np.arange(len(table)), BLOCKS)):
                    chunk = table[rows]
                    used = np.flatnonzero(chunk.any(axis=0))
                    parts[block, number][np.ix_(used, used)] += (
                        chunk[:, used].T @ chunk[:, used] / self.sigma[axis] ** 2
                    )
        return tuple(parts)

    def _columns(self, log: ChangedWindows, at: Mapping[str, Floats], hull: tuple[Floats, Floats]) -> list[Floats]:
        """Return the whitened columns [shared, own, target] of each axis, shape (J, n)."""
        terms, J = log.functions.terms, len(log.windows)
        P, D = int(self.low[-1]), STEADY + sum(len(kind.parameters) for kind in self.kinds)
        here = log.under(at, gain_matrix(hull[0], terms))
        X, Y = here.regressors(terms), here.force - here.base(here.acceleration(log.posed))
        steady = np.column_stack([np.ones(J), here.heading])
        slopes = {
            kind.id: -log.slope(kind, at, *hull)
            for kind in self.kinds
            if not log.absent(kind.id) and IDENTIFY.fewest_condition_windows <= J
        }
        for kind in self.kinds:
            if kind.id in slopes and kind.id in at:
                Y = Y + slopes[kind.id] @ (at[kind.id] / kind.sizes)
        every = []
        for axis, own in enumerate(self.own):
            table = np.zeros((J, P + D + 1))
            table[:, self.low[axis] : self.low[axis + 1]] = np.column_stack([X[:, own], np.ones(J)])
            table[:, P + 3 * axis : P + 3 * axis + 3] = steady * self.sigma[axis]
            for name, slope in slopes.items():
                table[:, P + self.places[name]] = slope[:, axis]
            table[:, -1] = Y[:, axis]
            every.append(_independent(table, log.windows.run, self.autocorrelation))
        return every


def _independent(table: Floats, run: Ints, autocorrelation: float) -> Floats:
    """Return columns whose rows are independent, shape (J, c)."""
    if not len(table):
        return table
    kept = np.sqrt(1.0 - autocorrelation**2)
    out = table.copy()
    follows = np.flatnonzero(np.diff(run) == 0) + 1
    out[follows] = (table[follows] - autocorrelation * table[follows - 1]) / kept
    return out


def hull_and_conditions(data: WeakData, names: Container[str]) -> HullAndConditions:
    """Return the equations of hull and conditions of the kinds named and wind, about the estimate with wind alone."""
    windows, logs, K = data.windows, [], len(data.functions.terms)
    for k, (motion, velocity, one) in enumerate(zip(data.motions, windows.velocities, windows.training, strict=True)):
        samples = MotionSamples.of(data.profile, motion, velocity, one, windows.training_length_s)
        scale, posed, blown = data.settings.scale, data.whitening.posed, data.conditions.blown.get(k)
        logs.append(ChangedWindows(data.profile, scale, data.functions, one, samples, posed, blown))
    regression = fit_simpls(data.training, K, allowed=data.functions.mask)
    gains = regression.coefficients[-1]
    return HullAndConditions(
        tuple(logs),
        data.functions.mask,
        data.prior_factor * data.prior_spread,
        data.whitening.sigma,
        data.whitening.autocorrelation,
        tuple(
            kind
            for kind in kinds_of(data.profile, [log.samples for log in logs])
            if (kind.id in names or kind.id == WIND) and not all(log.absent(kind.id) for log in logs)
        ),
        (gains, data.intercepts(gains, regression.intercepts[-1])),
        data.conditions.wind,
    )
