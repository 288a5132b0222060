"""Errors of the sensors, group against group: worked by hand, against an independent fit, and from log to verdict."""

from __future__ import annotations

from dataclasses import replace
from math import log

import numpy as np
import pytest
from scipy.stats import norm, t

from ferryid.diagnose.checks import checks
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.estimation import Candidate
from ferryid.diagnose.judging import sensor_differences as module
from ferryid.diagnose.judging.difference import SENSORS, Difference
from ferryid.diagnose.judging.group_differences import JudgedGroups, beside_sensors, summary
from ferryid.diagnose.judging.sensor_differences import NORMAL, Apart, _difference
from ferryid.effects import effects
from ferryid.vessel import load_profile

B = np.array([False, False, True, True])
HEADING = next(one for one in checks() if one.id == "heading_bias")
SCALE = next(one for one in checks() if one.id == "velocity_scale")


def test_logs_that_agree_within_their_errors_differ_by_the_weighted_means() -> None:
    found = Apart.of(np.array([1.0, 1.0, 3.0, 3.0]), np.array([0.1, 0.2, 0.1, 0.2]), B)
    assert found.value == pytest.approx(2.0)
    assert found.error == pytest.approx((2.0 / (1.0 / 0.01 + 1.0 / 0.04)) ** 0.5)
    assert (found.scatter, found.freedom) == (0.0, NORMAL)


def test_logs_that_scatter_are_as_uncertain_as_a_two_sample_test_says() -> None:
    """With errors far below the scatter it is the t-test of two samples of one variance."""
    values = np.array([0.0, 0.4, 1.9, 2.3])
    found = Apart.of(values, np.full(4, 1e-6), B)
    pooled = np.sqrt((np.var(values[:2], ddof=1) + np.var(values[2:], ddof=1)) / 2.0)
    assert found.value == pytest.approx(1.9)
    assert found.error == pytest.approx(pooled)
    assert found.scatter == pytest.approx(pooled)
    assert found.freedom == 2.0
    assert found.reach(0.05) == pytest.approx(t.ppf(0.975, 2))


def test_one_log_in_each_group_has_no_scatter() -> None:
    found = Apart.of(np.array([1.0, 2.0]), np.array([0.3, 0.4]), np.array([False, True]))
    assert (found.value, found.error, found.scatter) == (pytest.approx(1.0), pytest.approx(0.5), 0.0)


@pytest.mark.parametrize("freedom", [NORMAL, 3.0])
def test_evidence_is_the_ratio_of_densities_and_the_smallest_size_reaches_the_odds(freedom: float) -> None:
    one = Apart(0.7, 0.1, 0.0, freedom)
    by_hand = norm.logpdf(0.7, scale=(2.0**2 + 0.1**2) ** 0.5) - (t.logpdf(7.0, freedom) - log(0.1))
    assert one.evidence(2.0) == pytest.approx(by_hand, rel=1e-4)
    assert Apart(0.0, 0.1, 0.0, freedom).evidence(2.0) == pytest.approx(-log((1.0 + 400.0) ** 0.5), abs=0.2)
    least = one.smallest(2.0, 0.0)
    assert replace(one, value=least).evidence(2.0) == pytest.approx(module.INFERENCE.prior_odds, abs=0.2) or least == (
        pytest.approx(0.1 * one.reach(module.CHECKS.false_alarm))
    )
    assert one.smallest(2.0, 5.0) == 5.0


def estimates(values: list[float], error: float, unit: str, name: str) -> list[dict[str, Estimate]]:
    return [{name: Estimate.normal(value, error, unit)} for value in values]


def test_a_heading_that_is_off_in_one_group_is_a_difference_and_not_where_all_logs_have_it() -> None:
    assert HEADING.lasting is not None
    turned = _difference(HEADING, HEADING.lasting, estimates([0.1, 0.0, 3.1, 3.0], 0.1, "deg", "angle"), "AABB", 1.0)
    assert turned is not None
    assert turned.selected
    assert turned.shown_by == SENSORS
    assert turned.probability > 0.99
    assert turned.estimates["angle"].low < 3.0 < turned.estimates["angle"].high
    assert turned.says.startswith("Heading bias (sensors compared), B relative to A: angle +3.00 deg (")
    same = _difference(HEADING, HEADING.lasting, estimates([3.0, 3.1, 3.1, 3.0], 0.1, "deg", "angle"), "AABB", 1.0)
    assert same is not None
    assert not same.selected
    # Below the accuracy of a compass it has no name, however certain.
    small = _difference(HEADING, HEADING.lasting, estimates([0.0, 0.0, 0.5, 0.5], 0.01, "deg", "angle"), "AABB", 1.0)
    assert small is not None
    assert not small.selected
    assert small.smallest["angle"] == 1.0


def test_a_scale_is_that_of_one_group_over_the_other() -> None:
    assert SCALE.lasting is not None
    found = _difference(SCALE, SCALE.lasting, estimates([0.5, 0.5, 1.0, 1.0], 0.01, "-", "factor"), "AABB", 0.03)
    assert found is not None
    assert found.estimates["factor"].value == pytest.approx(2.0)


def test_a_group_without_a_log_that_shows_it_has_no_difference() -> None:
    assert HEADING.lasting is not None
    some = [*estimates([0.0, 0.1], 0.1, "deg", "angle"), {}, {}]
    assert _difference(HEADING, HEADING.lasting, some, "AABB", 1.0) is None


def test_a_heading_that_resolved_the_velocity_is_not_compared_with_it() -> None:
    assert HEADING.hidden(load_profile("kvlcc2-model"))
    assert not HEADING.hidden(load_profile("vtec-usv"))


def of_forces(angle: float, selected: bool = True) -> Difference:
    bias = replace(Candidate.of(effects()["heading_bias"], None, load_profile("vtec-usv")), group="B")
    made = Difference.of(bias, {"angle": Estimate.normal(angle, 0.2, "deg")}, 30.0, 0.1, {"angle": 1.0})
    return replace(made, selected=selected)


def test_what_sensors_show_stands_first_and_forces_that_contradict_them_are_hints_beside_an_unknown_hull() -> None:
    assert HEADING.lasting is not None
    off, none = (
        _difference(HEADING, HEADING.lasting, estimates([0.0, 0.0, angle, angle], 0.1, "deg", "angle"), "AABB", 1.0)
        for angle in (4.0, 0.0)
    )
    assert off is not None
    assert none is not None
    judged = JudgedGroups((), (of_forces(0.0, False),), (), (), 1.0)
    found = beside_sensors(judged, (off,), hull_known=True)
    assert found.differences == (off,)
    assert found.compared == ()
    assert found.verdict == "different"
    assert summary(found) == "1 difference confirmed between the groups."
    judged = JudgedGroups((of_forces(-3.0),), (), (), (), 1.0)
    (doubted,) = beside_sensors(judged, (none,), hull_known=False).differences
    assert "the sensors, compared with each other, show no such difference (angle +0.00 deg (-0.20 to +0.20))" in doubted.doubt
    assert doubted.probability == 0.5
    (kept,) = beside_sensors(judged, (none,), hull_known=True).differences
    assert not kept.doubt
    (agreed,) = beside_sensors(JudgedGroups((of_forces(0.1),), (), (), (), 1.0), (none,), hull_known=False).differences
    assert not agreed.doubt
