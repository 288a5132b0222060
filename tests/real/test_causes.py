"""Sentences on why an aim was missed hold what the figures show, and no more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.real.causes import Winds, of_directions, of_intervals, of_the_gain, of_the_median, of_the_vessel, spread_deg
from tests.real.shared_force import SharedForce

NORTH = np.tile([1.0, 0.0], (9, 1))


def winds(shift: tuple[float, float], error: float) -> Winds:
    """Return nine runs of a wind to the north whose estimates have one error in common."""
    return Winds(NORTH, NORTH + np.array(shift), np.full((9, 2), error), np.full(9, 15.0))


def test_an_error_in_common_is_told_where_standard_errors_are_small() -> None:
    told = of_directions(winds((0.0, -0.8), 0.2), 30.0, 6 / 9, winds((0.0, 0.0), 0.1))
    assert "9 of 9 be expected within 30 deg: all runs have an error in common" in told
    assert "+0.00 m/s north and -0.80 east in the mean, with a scatter between runs of 0.00 and 0.00" in told
    assert "varies by 15 deg" in told
    assert "against 15 deg in the random runs" in told


def test_standard_errors_are_told_where_they_explain_it() -> None:
    told = of_directions(winds((0.0, -0.8), 1.5), 30.0, 6 / 9)
    assert told.endswith("1.50 m/s across the wind in the median, let 4 of 9 be expected within 30 deg.")
    # The size of a normal variable is 0.67 standard deviations in the median, here 45 deg.
    assert "stand for 30 deg in the median" in of_the_median(winds((0.0, 0.0), 1.0))


@pytest.mark.parametrize(
    ("beside", "beside_measured", "explains"),
    [(2.0, 0.3, "does not explain it"), (12.0, 0.3, "does not explain it"), (12.0, 9.0, "explains it")],
    ids=["little evidence", "none beside the measured wind", "beside both"],
)
def test_a_force_of_the_vessel_is_the_cause_only_where_it_acts_beside_the_measured_wind_too(
    beside: float, beside_measured: float, explains: str
) -> None:
    turned = np.radians(np.repeat([-20.0, 40.0], [4, 5]))
    shared = SharedForce(beside, np.column_stack([np.cos(turned), np.sin(turned)]), beside_measured, (3.0, -26.0))
    told = of_the_vessel(shared, NORTH, 30.0)
    assert f"the same in all runs, {explains}" in told
    assert "with it, 4 of 9 are within 30 deg" in told
    assert "Y_v of -26.0 kg/s, against 3.0 kg/s with the estimated steady one" in told
    assert "taken for less damping" in told
    # A hull that is damped more beside the estimated winds needs another cause.
    assert "taken for less damping" not in of_the_vessel(replace(shared, damping=(-30.0, -26.0)), NORTH, 30.0)


def test_intervals_are_left_together() -> None:
    assert "which is +0.0 and -4.0 of the reported standard errors" in of_intervals(winds((0.0, -0.8), 0.2))


def test_a_steady_wind_is_the_cause_only_where_its_own_mean_gains_too_little() -> None:
    assert of_the_gain(0.04, 0.13, 0.5).startswith(
        "The measured wind's own mean over each run gains 4 %, and 13 % with"
    )
    assert of_the_gain(0.04, 0.6, 0.5) == ""


def test_the_spread_of_headings_is_that_of_a_circle() -> None:
    rows = np.random.default_rng(1).normal(np.pi, 0.3, 100_000)
    assert spread_deg(rows % (2.0 * np.pi)) == pytest.approx(np.degrees(0.3), rel=0.01)
    assert spread_deg(np.zeros(5)) == 0.0
