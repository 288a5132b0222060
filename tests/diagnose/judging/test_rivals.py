"""What stands beside a finding as unresolved: rivals near in evidence, and shapes of one thrust curve that are nearly alike."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ferryid.diagnose.inference.estimation import Candidate, Fit
from ferryid.diagnose.judging.rivals import RivalComparison, RivalFit, same_curve
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects import effects

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


def test_a_finding_without_evidence_has_no_shape_beside_it(fitted: Fit) -> None:
    assert compared(fitted, {AIR: -10.0}, 0.0).unresolved(candidate(LIMIT)) == ()
    assert replace(compared(fitted, {}, 300.0), rivals=()).unresolved(candidate(LIMIT)) == ()
