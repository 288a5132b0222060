"""The interval of a ratio of medians: wide where runs scatter, and of runs that diverged or ended."""

from __future__ import annotations

import numpy as np
import pytest

from tests.rivals.scatter import ratio_of_medians


def test_a_constant_ratio_has_no_scatter() -> None:
    theirs = np.random.default_rng(1).uniform(1.0, 3.0, 60)
    found = ratio_of_medians(0.8 * theirs, theirs)
    assert found == pytest.approx((0.8, 0.8, 0.8))
    assert found.text == "0.80 (0.80 to 0.80)"


def test_the_interval_holds_the_true_ratio_as_often_as_it_says() -> None:
    """Runs that overlap: errors of a moving average, whose scatter single draws would take for smaller than it is."""
    rng, held = np.random.default_rng(2), 0
    for _ in range(100):
        noise = rng.standard_normal((2, 209))
        slow = np.array([np.convolve(one, np.ones(10) / np.sqrt(10.0), "valid") for one in noise])
        ours, theirs = np.exp(0.3 * slow)
        found = ratio_of_medians(ours, theirs)
        held += found.low <= 1.0 <= found.high
    assert 82 <= held <= 100


def test_diverged_runs_count_and_those_that_ended_do_not() -> None:
    ours, theirs = np.array([1.0, 1.0, 1.0, np.nan]), np.array([2.0, np.inf, np.inf, 5.0])
    assert ratio_of_medians(ours, theirs).value == 0.0
    assert ratio_of_medians(ours, np.array([2.0, 2.0, np.inf, 0.1])).value == 0.5
    assert ratio_of_medians(np.array([np.inf, np.inf, 1.0]), np.ones(3)).value == np.inf
    assert np.isnan(ratio_of_medians(np.array([np.nan]), np.ones(1)).value)


def test_few_runs_have_no_interval() -> None:
    found = ratio_of_medians(np.ones(5), np.full(5, 2.0))
    assert found.value == 0.5
    assert np.isnan([found.low, found.high]).all()
    assert found.text == "0.50 (few runs)"
