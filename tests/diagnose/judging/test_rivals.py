"""What stands beside a finding as unresolved: rivals near in evidence, and shapes of one thrust curve that are nearly alike."""

from __future__ import annotations

from collections.abc import Callable, Set
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ferryid.diagnose.inference.estimation import Candidate, Fit, fit
from ferryid.diagnose.judging import campaign_properties
from ferryid.diagnose.judging.campaign_properties import _one_of_two_that_hide, _one_shape_of_each_curve
from ferryid.diagnose.judging.rivals import (
    RivalComparison,
    RivalFit,
    compare_rivals,
    is_doubted_where,
    least_gain,
    redundant_shape,
    same_curve,
)
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects import effects
from ferryid.vessel.frames import to_body
from tests.diagnose.judging.test_held_out import FERRY, sailed, trial_on

LIMIT, AIR = "thrust_saturation", "ventilation"


def candidate(effect: str, instance: str | None = "propeller") -> Candidate:
    return Candidate(effects()[effect], instance, ())


def compared(fitted: Fit, gains: dict[str, float], evidence: float) -> RivalComparison:
    rivals = tuple(RivalFit(candidate(name), fitted, gain) for name, gain in gains.items())
    return RivalComparison(rivals, 0.999, evidence)


@pytest.fixture
def fitted() -> Fit:
    # No figure of it is read.
    return Fit.__new__(Fit)


def test_another_shape_of_the_curve_that_explains_nearly_as_much_is_unresolved(fitted: Fit) -> None:
    near, far = -0.09 * 300.0, -0.11 * 300.0
    assert compared(fitted, {AIR: near}, 300.0).unresolved(candidate(LIMIT)) == (AIR,)
    assert compared(fitted, {AIR: far}, 300.0).unresolved(candidate(LIMIT)) == ()


def test_what_is_near_in_evidence_is_unresolved_whatever_it_is(fitted: Fit) -> None:
    one = compared(
        fitted, {"wind": -0.9 * JUDGING.unresolved_evidence, "current": -1.1 * JUDGING.unresolved_evidence}, 30.0
    )
    assert one.unresolved(candidate(LIMIT)) == ("wind",)


def test_other_effects_and_other_actuators_have_no_curve_in_common(fitted: Fit) -> None:
    assert compared(fitted, {"wind": -20.0}, 300.0).unresolved(candidate(LIMIT)) == ()
    assert same_curve(candidate(AIR), candidate(LIMIT), 0.95)
    assert not same_curve(candidate(AIR, "fore"), candidate(LIMIT, "aft"), 0.95)
    assert not same_curve(candidate("thruster_gain"), candidate(LIMIT), 0.95)


def test_a_delay_and_a_lag_are_two_formulas_of_one_response(fitted: Fit) -> None:
    near, far = -0.09 * 300.0, -0.11 * 300.0
    for one, other in (("time_delay", "thruster_lag"), ("thruster_lag", "time_delay")):
        assert compared(fitted, {other: near}, 300.0).unresolved(candidate(one)) == (other,)
        assert compared(fitted, {other: far}, 300.0).unresolved(candidate(one)) == ()
    assert compared(fitted, {"time_delay": near}, 300.0).unresolved(candidate(LIMIT)) == ()


def test_a_finding_without_evidence_has_no_shape_beside_it(fitted: Fit) -> None:
    assert compared(fitted, {AIR: -10.0}, 0.0).unresolved(candidate(LIMIT)) == ()
    assert replace(compared(fitted, {}, 300.0), rivals=()).unresolved(candidate(LIMIT)) == ()


def weighed(alone: dict[int, float], both: float) -> Callable[[Set[int]], float]:
    """Return the evidence of two effects without some of them: of either alone, and of both, over none."""
    return lambda left_out: (
        -1000.0 + (both if not left_out else 0.0 if len(left_out) == 2 else alone[1 - next(iter(left_out))])
    )


SHAPES = [candidate(AIR), candidate(LIMIT)]


@pytest.mark.parametrize(
    ("selected", "alone", "both", "redundant"),
    [
        # Figures of a campaign at sea whose propeller drew air: either explains nine tenths of what both do.
        (SHAPES, {0: 1136.2, 1: 1112.5}, 1208.3, (1, 0)),
        (SHAPES, {0: 1112.5, 1: 1136.2}, 1208.3, (0, 1)),
        # One explains what the other cannot, however little that is: a band about zero beside a limit.
        (SHAPES, {0: 1136.2, 1: 72.1}, 1208.3, None),
        (SHAPES, {0: 604.0, 1: 604.0}, 1208.0, None),
        # Of two actuators, and an effect that is no shape of a curve.
        ([candidate(AIR, "fore"), candidate(LIMIT, "aft")], {0: 1136.2, 1: 1112.5}, 1208.3, None),
        ([candidate("thruster_gain"), candidate(LIMIT)], {0: 1136.2, 1: 1112.5}, 1208.3, None),
        # Nothing that either explains.
        (SHAPES, {0: -3.0, 1: -3.0}, -5.0, None),
    ],
)
def test_of_two_shapes_of_a_curve_that_explain_the_same_the_weaker_is_redundant(
    selected: list[Candidate], alone: dict[int, float], both: float, redundant: tuple[int, int] | None
) -> None:
    found = redundant_shape(selected, weighed(alone, both))
    assert (None if found is None else found[:2]) == redundant
    if found is not None:
        assert found[2] == pytest.approx(1112.5 / 1136.2)


@pytest.fixture
def estimate(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Return an estimate of some properties, by the evidence over none of each set of them."""

    def made(evidence: dict[tuple[str, ...], float], *properties: Candidate) -> Any:
        return SimpleNamespace(
            campaign=SimpleNamespace(properties=properties),
            evidence=-1000.0 + evidence[tuple(one.effect.id for one in properties)],
            all=evidence,
        )

    monkeypatch.setattr(
        campaign_properties,
        "without_property",
        lambda one, gone: made(one.all, *(other for other in one.campaign.properties if other is not gone)),
    )
    return made


def test_a_campaign_keeps_one_shape_of_a_curve_with_the_other_as_its_rival(estimate: Callable[..., Any]) -> None:
    evidence = {(AIR, LIMIT): 1208.3, (AIR,): 1136.2, (LIMIT,): 1112.5, (): 0.0}
    made, rivals = _one_shape_of_each_curve(estimate(evidence, *SHAPES), {})
    assert [one.effect.id for one in made.campaign.properties] == [AIR]
    (rival,) = rivals[SHAPES[0].key]
    assert rival.candidate.effect.id == LIMIT
    assert rival.odds == pytest.approx(1112.5 - 1136.2)
    assert rival.share >= JUDGING.alike_shapes


DELAY, LAG = "time_delay", "thruster_lag"


@pytest.mark.parametrize(
    ("alone", "unknown", "kept"),
    [
        # Together either may be all of it, or none: the likelier one is left, with its own interval.
        ({DELAY: 90.0, LAG: 80.0}, {DELAY, LAG}, [DELAY]),
        ({DELAY: 70.0, LAG: 95.0}, {DELAY, LAG}, [LAG]),
        # Of one the interval shows that it is there.
        ({DELAY: 90.0, LAG: 80.0}, {LAG}, [DELAY, LAG]),
        # Neither explains what both do.
        ({DELAY: 60.0, LAG: 60.0}, {DELAY, LAG}, [DELAY, LAG]),
    ],
)
def test_of_a_delay_and_a_lag_that_hide_each_other_a_campaign_keeps_one(
    alone: dict[str, float],
    unknown: set[str],
    kept: list[str],
    estimate: Callable[..., Any],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(campaign_properties, "_holds_none", lambda made, one: one.effect.id in unknown)
    both = [candidate(DELAY, None), candidate(LAG, None)]
    evidence: dict[tuple[str, ...], float] = {(DELAY, LAG): 100.0, (): 0.0}
    evidence |= {(name,): gain for name, gain in alone.items()}
    made, rivals = _one_of_two_that_hide(estimate(evidence, *both), {})
    assert [one.effect.id for one in made.campaign.properties] == kept
    gone = [one for one in both if one.effect.id not in kept]
    assert [one.candidate for every in rivals.values() for one in every] == gone


@pytest.mark.slow
def test_a_mooring_whose_pull_is_constant_gives_way_to_a_push() -> None:
    """A push of 150 s to the south is also the pull of a line that is so long that the place hardly matters."""
    seen = sailed(480.0, np.zeros(2))
    span = (seen.t > 160.0) & (seen.t < 310.0)
    push = np.where(span, -200.0, 0.0)
    # The records claim what acted less the push, so that the push and they explain the motion.
    claimed = seen.parts.copy()
    claimed[:, 0, :2] -= np.column_stack(to_body(push, 0.0 * push, seen.psi))
    problem = trial_on(replace(seen, parts=claimed))
    mooring, pushed = (
        replace(Candidate(effects()[name], None, effects()[name].parameters_of(FERRY)), onset_s=160.0, offset_s=310.0)
        for name in ("mooring", "external_push")
    )
    far = fit(problem, [mooring], [np.array([1.0, 0.0, -200.0, 0.0])])
    problem = problem.with_noise_of(far)
    far, near = fit(problem, [mooring], far.values), fit(problem, [pushed], [np.array([-200.0, 0.0, 0.0])])
    assert is_doubted_where(problem, far, 0)
    assert not is_doubted_where(problem, near, 0)
    (rival,) = compare_rivals(problem, far, 0, [pushed]).rivals
    assert least_gain(problem, far, 0, rival) == -JUDGING.unresolved_evidence
    assert least_gain(problem, near, 0, rival) == 0.0
    line = compare_rivals(problem, near, 0, [mooring])
    assert line.rivals == ()
    assert line.probability > 0.99
