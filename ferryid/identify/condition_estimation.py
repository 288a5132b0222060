"""Conditions that logs have of their own, of given kinds, estimated together with the hull that they share.

They are random effects, whose spread between the logs is the one of greatest marginal likelihood (empirical Bayes).
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ferryid.identify.condition_kinds import WIND, ConditionKind, gain_matrix
from ferryid.identify.condition_problem import STEADY, HullAndConditions
from ferryid.identify.log_condition import LogCondition
from ferryid.identify.outcome import LogWind
from ferryid.identify.thresholds import IDENTIFY
from ferryid.identify.weak_rows import WeakRows
from ferryid.regression import GroupSums, MixedFit
from ferryid.types import Floats, Ints

STEPS = 3
"""Gauss-Newton steps for hull and conditions, once it is settled which there are."""
_FIRST_STEADY = 0.1
"""Spread of the steady forces, in units of the residual, with which the search for it begins."""


@dataclass(frozen=True, eq=False)
class OwnConditions:
    """Conditions that L logs have of their own.

    Attributes
    ----------
    kinds
        Which they are.
    spreads
        Standard deviation between logs of each kind, in sizes, by its name.
    values
        What each log has of them, by the kind's name, L of them.
    covariance
        Of the parameters of each log, shape (L, q, q), by the kind's name.
    windows
        The training windows as if the conditions had been measured.
    added
        What they add to the covariance of gains and intercept, by axis, shape (3, K + 1, K + 1).
    """

    kinds: tuple[ConditionKind, ...]
    spreads: Mapping[str, float]
    values: tuple[Mapping[str, Floats], ...]
    covariance: Mapping[str, Floats]
    windows: tuple[WeakRows, ...]
    added: Floats

    def winds(self, logs: Sequence[str]) -> tuple[LogWind, ...]:
        """Return the winds that were estimated, by the names of the logs."""
        if WIND not in self.covariance:
            return ()
        return tuple(
            LogWind(log, (float(at[WIND][0]), float(at[WIND][1])), tuple(np.sqrt(np.diag(covariance)).tolist()))
            for log, at, covariance in zip(logs, self.values, self.covariance[WIND], strict=True)
            if WIND in at
        )

    def listed(self, logs: Sequence[str]) -> tuple[LogCondition, ...]:
        """Return the other conditions, by the names of the logs."""
        return tuple(
            LogCondition(
                log,
                kind.id,
                kind.title,
                tuple(one.name for one in kind.parameters),
                tuple(one.unit for one in kind.parameters),
                at[kind.id],
                covariance,
            )
            for kind in self.kinds
            if kind.id != WIND
            for log, at, covariance in zip(logs, self.values, self.covariance[kind.id], strict=True)
            if kind.id in at
        )


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """Kinds that take part, their spreads, and how large steady forces are."""

    spreads: Mapping[str, float]
    steady: float
    fit: MixedFit
    numbers: Ints

    def widths(self, problem: HullAndConditions) -> Floats:
        """Return the standard deviations of the own coefficients."""
        return widths_of(problem, self.spreads, self.steady)

    def rows(self, problem: HullAndConditions, kind: ConditionKind) -> Ints:
        """Return which own coefficients of the estimate are those of a kind."""
        return np.flatnonzero(np.isin(self.numbers, problem.places[kind.id]))


def widths_of(problem: HullAndConditions, spreads: Mapping[str, float], steady: float) -> Floats:
    parts = [np.full(STEADY, steady)]
    parts += [np.full(len(kind.parameters), spreads[kind.id]) for kind in problem.kinds if kind.id in spreads]
    return np.concatenate(parts)


def _widths_with(
    problem: HullAndConditions, spreads: Mapping[str, float], steady: float, name: str, size: float
) -> Floats:
    return widths_of(problem, {**spreads, name: size}, steady)


def numbers_of(problem: HullAndConditions, names: Container[str]) -> Ints:
    return np.concatenate([np.arange(STEADY), *(problem.places[kind.id] for kind in problem.kinds if kind.id in names)])


def estimate_own(problem: HullAndConditions, spreads: Mapping[str, float]) -> OwnConditions:
    """Return the conditions of the logs, of given kinds with spreads to begin with."""
    values = problem.begun()
    chosen = settled(problem, problem.sums(problem.start, values), {**problem.always, **spreads})
    for _ in range(STEPS):
        _, chosen = stepped(problem, chosen, values)
    G = gain_matrix(problem.hull(chosen.fit)[0], problem.logs[0].functions.terms)
    kinds, covariance = [kind for kind in problem.kinds if kind.id in chosen.spreads], {}
    for kind in kinds:
        rows = chosen.rows(problem, kind)
        wider = 1.0 if kind.id == WIND else IDENTIFY.condition_error
        scale = wider**2 * np.outer(kind.sizes, kind.sizes)
        covariance[kind.id] = chosen.fit.own_covariance[:, rows[:, None], rows] * scale
    return OwnConditions(
        tuple(kinds),
        {kind.id: chosen.spreads[kind.id] for kind in kinds},
        tuple(values),
        covariance,
        tuple(log.under(at, G) for log, at in zip(problem.logs, values, strict=True)),
        _added(problem, chosen),
    )


def stepped(
    problem: HullAndConditions, before: Hypothesis, values: list[dict[str, Floats]]
) -> tuple[tuple[Floats, ...], Hypothesis]:
    """Take a Gauss-Newton step: return cross-products about an estimate, whose conditions `values` get, and the next one."""
    for kind in problem.kinds:
        if kind.id in before.spreads:
            rows = before.rows(problem, kind)
            for number, log in enumerate(problem.logs):
                if not log.absent(kind.id):
                    values[number][kind.id] = before.fit.own[number, rows] * kind.sizes
    parts = problem.sums(problem.hull(before.fit), values)
    return parts, settled(problem, parts, before.spreads, before)


def settled(
    problem: HullAndConditions, parts: Sequence[Floats], spreads: Mapping[str, float], before: Hypothesis | None = None
) -> Hypothesis:
    """Return the estimate with the spreads of greatest evidence, one after the other."""
    numbers = numbers_of(problem, spreads)
    sums = whole(problem, parts).within(numbers)
    now = dict(spreads)
    steady = _FIRST_STEADY if before is None else before.steady
    steady, fit = sums.best(lambda size: widths_of(problem, now, size), steady)
    for name in now:
        now[name], fit = sums.best(partial(_widths_with, problem, now, steady, name), now[name])
    return Hypothesis(now, steady, fit, numbers)


def _added(problem: HullAndConditions, one: Hypothesis) -> Floats:
    """Return what conditions besides wind and steady forces add to the covariance of gains and intercept, (3, K + 1, K + 1)."""
    fit, others = one.fit, numbers_of(problem, problem.always)
    wider = {name: one.spreads[name] for name in problem.always}
    without = fit.sums.within(np.arange(len(others))).fit(widths_of(problem, wider, one.steady))
    covariance, K = fit.covariance - without.covariance, len(problem.mask)
    added = np.zeros((3, K + 1, K + 1))
    for axis, own in enumerate(problem.own):
        part, places = slice(problem.low[axis], problem.low[axis + 1]), [*own.tolist(), K]
        added[axis][np.ix_(places, places)] = covariance[part, part]
    return added


def whole(problem: HullAndConditions, parts: Sequence[Floats]) -> GroupSums:
    """Return the sums of parts of the logs, (L, n, n) each."""
    return GroupSums(np.sum(parts, axis=0), problem.prior)
