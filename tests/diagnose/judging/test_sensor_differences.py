"""Errors of the sensors, group against group: worked by hand, against an independent fit, and from log to verdict."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from ferryid.diagnose.checks import checks
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.estimation import Candidate
from ferryid.diagnose.inference.group_differences import gross
from ferryid.diagnose.judging import sensor_differences as module
from ferryid.diagnose.judging.difference import SENSORS, Difference
from ferryid.diagnose.judging.group_differences import JudgedGroups, beside_sensors, summary
from ferryid.diagnose.judging.sensor_differences import Apart, _difference
from ferryid.effects import effects
from ferryid.vessel import load_profile

HEADING = next(one for one in checks() if one.id == "heading_bias")
SCALE = next(one for one in checks() if one.id == "velocity_scale")


def apart(values: list[float], errors: list[float], second: list[bool], size: float = 2.0) -> Apart:
    return Apart(np.array(values), np.array(errors), np.array(second), size)


TWO = [False, False, True, True]


def test_logs_that_agree_within_their_errors_differ_by_the_weighted_means() -> None:
    value, error, scatter, evidence = apart([1.0, 1.0, 3.0, 3.0], [0.1, 0.2, 0.1, 0.2], TWO).weighed
    by_hand = (2.0 / (1.0 / 0.01 + 1.0 / 0.04)) ** 0.5
    assert value == pytest.approx(2.0)
    assert error == pytest.approx(by_hand, rel=0.02)
    assert scatter < 0.01
    # Over none that scatters, as four logs are not the same by chance; the prior of a scatter is paid for.
    assert 8.0 < evidence < 0.5 * (2.0 / by_hand) ** 2


def test_one_log_in_each_group_has_the_evidence_of_a_normal_prior() -> None:
    value, error, scatter, evidence = apart([1.0, 2.0], [0.3, 0.4], [False, True]).weighed
    assert (value, error, scatter) == (pytest.approx(1.0), pytest.approx(0.5), 0.0)
    by_hand = norm.logpdf(1.0, scale=(4.0 + 0.25) ** 0.5) - norm.logpdf(1.0, scale=0.5)
    assert evidence == pytest.approx(by_hand + float(gross(np.array([1.0]))))


def test_logs_that_scatter_as_much_as_they_differ_show_nothing() -> None:
    *_, evidence = apart([0.0, 2.0, 0.9, 2.9], [0.01] * 4, TWO).weighed
    assert evidence < 0.0


@pytest.mark.parametrize("scatter", [0.0, 0.3])
def test_more_logs_and_larger_differences_are_more_evidence(scatter: float) -> None:
    """Of 20 degrees between logs that scatter by a third of one nothing was left, and one of 170 spoke against itself."""
    found = []
    for away in (5.0, 20.0, 170.0):
        values = [-scatter, scatter, away - scatter, away + scatter]
        found.append(apart(values, [0.1] * 4, TWO, 28.6).weighed[3])
    assert found == sorted(found)
    assert found[1] > 8.0
    assert apart([0.0, scatter, 20.0], [0.1] * 3, [False, False, True], 28.6).weighed[3] > 8.0


def test_a_log_that_is_known_badly_counts_little() -> None:
    value, error, *_ = apart([1.0, 1.35, 1.0], [0.005, 0.3, 0.005], [False, False, True], 0.5).weighed
    assert value == pytest.approx(0.0, abs=0.01)
    assert error < 0.05


def test_the_smallest_difference_seen_is_one_that_is_found() -> None:
    quiet = apart([0.0, 0.0, 0.0, 0.0], [0.1] * 4, TWO)
    least = quiet.smallest(0.0)
    assert least is not None
    there = replace(quiet, values=quiet.values + least * quiet.second)
    below = replace(quiet, values=quiet.values + 0.7 * least * quiet.second)
    assert there.weighed[3] >= module.INFERENCE.prior_odds > below.weighed[3]
    floor = quiet.smallest(5.0)
    assert floor is not None
    assert floor >= 5.0
    assert apart([-30.0, 30.0, -30.0, 30.0], [0.1] * 4, TWO).smallest(0.0) is None


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
    least = small.smallest["angle"]
    assert least is not None
    assert 1.0 <= least < 1.2


def test_a_scale_is_that_of_one_group_over_the_other() -> None:
    assert SCALE.lasting is not None
    found = _difference(SCALE, SCALE.lasting, estimates([0.5, 0.5, 1.0, 1.0], 0.01, "-", "factor"), "AABB", 0.03)
    assert found is not None
    assert found.estimates["factor"].value == pytest.approx(2.0)


def test_a_factor_is_divided_by_what_the_good_logs_of_the_other_group_say() -> None:
    """The median of a good log and a bad one turned 0.9 into 1.1."""
    assert SCALE.lasting is not None
    some = [
        {"factor": Estimate.normal(value, error, "-")}
        for value, error in ((1.0, 0.005), (-3.0, 4.0), (0.9, 0.005), (0.9, 0.005))
    ]
    found = _difference(SCALE, SCALE.lasting, some, "AABB", 0.03)
    assert found is not None
    assert found.estimates["factor"].value == pytest.approx(0.9, abs=0.005)
    none = [{"factor": Estimate.normal(value, 0.005, "-")} for value in (0.0, 0.9)]
    assert _difference(SCALE, SCALE.lasting, none, "AB", 0.03) is None


def test_an_antenna_that_moved_ahead_is_seen_though_it_did_not_move_sideways() -> None:
    arm = next(one for one in checks() if one.id == "lever_arm")
    assert arm.lasting is not None
    some = [
        {"x": Estimate.normal(x, 0.01, "m"), "y": Estimate.normal(y, 0.01, "m")}
        for x, y in ((0.0, 0.0), (0.05, 0.02), (1.0, 0.03), (1.04, 0.0))
    ]
    found = _difference(arm, arm.lasting, some, "AABB", 0.15)
    assert found is not None
    assert found.selected
    assert found.estimates["x"].low < 1.0 < found.estimates["x"].high


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
    # What forces show beside an error that was taken out is not told as another one.
    assert beside_sensors(JudgedGroups((of_forces(0.5),), (), (), (), 1.0), (off,), hull_known=True).differences == (
        off,
    )
    judged = JudgedGroups((of_forces(-3.0),), (), (), (), 1.0)
    (doubted,) = beside_sensors(judged, (none,), hull_known=False).differences
    assert (
        "the sensors, compared with each other, show no such difference (angle +0.00 deg (-0.20 to +0.20))"
        in doubted.doubt
    )
    assert doubted.probability == 0.5
    (kept,) = beside_sensors(judged, (none,), hull_known=True).differences
    assert not kept.doubt
    (agreed,) = beside_sensors(JudgedGroups((of_forces(0.1),), (), (), (), 1.0), (none,), hull_known=False).differences
    assert not agreed.doubt
