"""Which kinds of conditions the logs of a fit have of their own.

A kind takes part only where the marginal likelihood speaks for it, where stretches that were held out within the logs are
predicted better with it, and where a hull that was estimated with it does not predict other logs worse.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ferryid.identify.condition_estimation import STEPS, Hypothesis, numbers_of, settled, stepped, whole, widths_of
from ferryid.identify.condition_kinds import ConditionKind
from ferryid.identify.condition_problem import HullAndConditions
from ferryid.identify.thresholds import IDENTIFY
from ferryid.regression import GroupSums
from ferryid.types import Floats

_GROUPS = 5
"""Most groups of logs that are held out in turn."""


@dataclass(frozen=True)
class KindTest:
    """What speaks for a kind of condition.

    Attributes
    ----------
    kind
        The kind.
    spread
        Standard deviation between logs, in sizes.
    evidence
        Logarithm of the marginal likelihood over that of none [nat].
    within, across
        Squares of the whitened errors that it saves: of stretches held out within the logs, and of logs held out, by the hull
        alone.
    across_error
        Standard error of `across`, from the scatter between the logs.
    included
        Whether it takes part.
    """

    kind: ConditionKind
    spread: float = 0.0
    evidence: float = 0.0
    within: float = 0.0
    across: float = 0.0
    across_error: float = 0.0
    included: bool = False

    @property
    def supported(self) -> bool:
        """Whether likelihood and held-out data speak for it."""
        return self.evidence >= IDENTIFY.condition_evidence and self.within > 0.0 and self.across >= -self.across_error


def choose_kinds(problem: HullAndConditions) -> tuple[tuple[KindTest, ...], Mapping[str, float]]:
    """Return what speaks for each kind of condition, and the spreads of those that take part, by the kind's name."""
    values, tests = problem.begun(), dict[str, KindTest]()
    parts = problem.sums(problem.start, values)
    chosen = settled(problem, parts, problem.always)
    while True:
        left = [kind for kind in problem.kinds if kind.id not in chosen.spreads]
        tried = [_tried(problem, parts, chosen, kind) for kind in left]
        tests |= {test.kind.id: test for test, _ in tried}
        best, made = max(tried, key=lambda one: one[0].evidence, default=(None, chosen))
        # Where the likeliest fails on what was held out, another that passes would stand in for it.
        if best is None or not best.supported:
            return tuple(tests.values()), {name: one for name, one in chosen.spreads.items() if tests.get(name)}
        tests[best.kind.id] = replace(best, included=True)
        # What a linear step leaves of one kind looks like another one.
        chosen = made
        for _ in range(STEPS):
            parts, chosen = stepped(problem, chosen, values)


def _tried(
    problem: HullAndConditions, parts: Sequence[Floats], without: Hypothesis, kind: ConditionKind
) -> tuple[KindTest, Hypothesis]:
    """Return what speaks for one more kind, and the estimate with it."""
    names = [*without.spreads, kind.id]
    numbers = numbers_of(problem, names)
    sums = whole(problem, parts).within(numbers)
    spread, fit = sums.best(lambda size: widths_of(problem, {**without.spreads, kind.id: size}, without.steady))
    made = Hypothesis({**without.spreads, kind.id: spread}, without.steady, fit, numbers)
    test = KindTest(kind, spread, fit.evidence - without.fit.evidence)
    if test.evidence < IDENTIFY.condition_evidence:
        return test, made
    within = float(np.sum(_block_losses(problem, parts, without) - _block_losses(problem, parts, made)))
    saved = _log_losses(problem, parts, without) - _log_losses(problem, parts, made)
    error = float(np.sqrt(len(saved)) * np.std(saved, ddof=1))
    return replace(test, within=within, across=float(np.sum(saved)), across_error=error), made


def _block_losses(problem: HullAndConditions, parts: Sequence[Floats], one: Hypothesis) -> Floats:
    """Return the squares left of each part of each log by an estimate from all others, shape (`_BLOCKS`, L)."""
    widths, losses = one.widths(problem), []
    for block in range(len(parts)):
        fit = whole(problem, [one for k, one in enumerate(parts) if k != block]).within(one.numbers).fit(widths)
        losses.append(fit.loss(GroupSums(parts[block], problem.prior).within(one.numbers).products))
    return np.array(losses)


def _log_losses(problem: HullAndConditions, parts: Sequence[Floats], one: Hypothesis) -> Floats:
    """Return the squares left of each log by the hull that the others determine, shape (L,)."""
    every = whole(problem, parts).within(one.numbers)
    L, widths, losses = len(every.products), one.widths(problem), np.zeros(len(every.products))
    group = np.arange(L) % min(L, _GROUPS)
    for number in range(min(L, _GROUPS)):
        held = group == number
        fit = replace(every, products=every.products[~held]).fit(widths)
        losses[held] = fit.loss(every.products[held], np.zeros((int(held.sum()), every.D)))
    return losses
