"""A flow over time beside what a sensor measured: hand-worked correlation, band and averages."""

from __future__ import annotations

import numpy as np
import pytest

from ferryid.diagnose.data.course import Course, MeasuredCourse


def course(std: float = 1.0) -> Course:
    """A wind that rises by 1 m/s in 10 s on one component and stays on the other."""
    t = np.array([0.0, 10.0, 20.0])
    values = {"north": np.array([0.0, 1.0, 2.0]), "east": np.array([1.0, 0.0, 1.0])}
    return Course(t, values, {name: np.full(3, std) for name in values}, np.array([1.0, 0.5]), np.eye(2))


def test_what_follows_the_course_correlates_wholly_and_lies_in_the_band() -> None:
    t = np.linspace(0.0, 20.0, 41)
    measured = np.column_stack([0.5 + t / 10.0, np.abs(t - 10.0) / 5.0])
    one = MeasuredCourse.beside(course(), t, measured)
    assert one.correlation == pytest.approx(1.0)
    assert one.inside == 1.0
    # The mean of what was measured nearer to a knot than to others: 0 to 4.5 s, 5 to 14.5 s, 15 to 20 s.
    assert one.value["north"] == pytest.approx([0.5 + 0.225, 0.5 + 0.975, 0.5 + 1.75])


def test_a_narrow_band_holds_what_is_near_and_an_opposite_course_correlates_negatively() -> None:
    t = np.linspace(0.0, 20.0, 41)
    measured = np.column_stack([2.0 - t / 10.0, 1.0 - np.abs(t - 10.0) / 10.0])
    one = MeasuredCourse.beside(course(0.1), t, measured)
    assert one.correlation == pytest.approx(-1.0)
    # Within 0.196 of the estimate: north from 9.02 to 10.98 s, east from 4.02 to 5.98 s and from 14.02 to 15.98 s.
    assert one.inside == pytest.approx((3 + 3 + 3) / 82)


def test_what_is_constant_has_no_correlation_and_what_was_not_measured_no_average() -> None:
    one = MeasuredCourse.beside(course(), np.array([0.0, 1.0, 2.0]), np.ones((3, 2)))
    assert np.isnan(one.correlation)
    assert np.isnan(one.value["north"][1:]).all()


def test_the_band_in_json_has_both_ends() -> None:
    plain = course(0.5).to_json()
    assert set(plain) == {"t", "north", "north_low", "north_high", "east", "east_low", "east_high"}
    assert plain["north_low"] == pytest.approx([-0.98, 0.02, 1.02])
