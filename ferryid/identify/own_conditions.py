"""Conditions that the logs of a fit have of their own besides wind: whether any take part, and what is told of them."""

from __future__ import annotations

from typing import TypeVar

from ferryid.effects.wording import weak_evidence
from ferryid.identify.condition_choice import KindTest, choose_kinds
from ferryid.identify.condition_kinds import kinds_of
from ferryid.identify.condition_problem import hull_and_conditions
from ferryid.identify.log_condition import KindOutcome
from ferryid.identify.thresholds import IDENTIFY
from ferryid.identify.weak_data import WeakData

Data = TypeVar("Data", bound=WeakData)
KINDS = ("current", "payload", "heading_bias", "velocity_offset", "yaw_rate_offset")
"""Kinds that are tried."""


def with_own_conditions(data: Data) -> Data:
    """Return the data with those kinds of conditions that logs have of their own and that their data support."""
    enough = [one for one in data.windows.training if len(one) >= IDENTIFY.fewest_condition_windows]
    if data.impossible or data.settings.reduced or len(enough) < IDENTIFY.fewest_condition_logs:
        return data
    problem = hull_and_conditions(data, KINDS)
    tests, spreads = choose_kinds(problem)
    found = {one.kind.id: _outcome(one) for one in tests}
    for kind in kinds_of(data.profile, [log.samples for log in problem.logs]):
        if kind.id in KINDS and kind.id not in found:
            reason = problem.logs[0].absent(kind.id)
            found[kind.id] = KindOutcome(kind.id, kind.title, False, reason)
    return data.having(spreads, tuple(found[kind] for kind in KINDS))


def _outcome(test: KindTest) -> KindOutcome:
    """Return what is told of a kind that was tried."""
    spread = tuple(
        (one.name, test.spread * size, one.unit)
        for one, size in zip(test.kind.parameters, test.kind.sizes.tolist(), strict=True)
    )
    told = f"its log evidence over none is {test.evidence:.1f} nat"
    if test.included:
        reason = f"{told}, and held-out stretches are predicted no worse with it"
    elif test.evidence < IDENTIFY.condition_evidence:
        reason = weak_evidence(test.evidence, IDENTIFY.condition_evidence)
    elif test.within <= 0.0:
        reason = f"stretches held out within the logs are not predicted better with it, though {told}"
    elif not test.supported:
        reason = f"a hull estimated with it predicts other logs worse, though {told}"
    else:
        reason = "a likelier one was not confirmed by held-out data, for which it may stand in"
    return KindOutcome(test.kind.id, test.kind.title, test.included, reason, spread, test.evidence)
