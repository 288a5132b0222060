"""The interval of a verdict's ratio: it covers the ratio of what made the errors, widens where they last, and may be none."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from ferryid.identify.ratio_interval import LogErrors, ratio_interval

RATE_HZ, RATIO = 5.0, 0.5


def errors(seconds: float, seed: int, memory_s: float = 0.0, ratio: float = RATIO) -> LogErrors:
    """Return errors of two models whose expected squares have this ratio on every axis; each axis has its own unit."""
    rng = np.random.default_rng(seed)
    count = round(seconds * RATE_HZ)
    pole = np.exp(-1.0 / (memory_s * RATE_HZ)) if memory_s else 0.0

    def series() -> np.ndarray:
        return np.asarray(lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], rng.standard_normal((count, 3)), axis=0))

    scale = np.array([10.0, 100.0, 1000.0])
    return LogErrors(scale * series(), scale * np.sqrt(ratio) * series(), np.arange(count) / RATE_HZ)


def test_it_covers_the_ratio_of_what_made_the_errors() -> None:
    inside = 0
    for seed in range(60):
        found = ratio_interval([errors(300.0, seed, memory_s=2.0), errors(200.0, 1000 + seed, memory_s=2.0)])
        assert found is not None
        inside += found[0] < RATIO < found[1]
    # 57 of 60 are expected; fewer than 50 have a probability of one in a thousand.
    assert 50 <= inside < 60


def test_it_is_wider_where_errors_last_for_longer() -> None:
    short, long = (ratio_interval([errors(600.0, 1, memory_s=one)]) for one in (0.2, 8.0))
    assert short is not None
    assert long is not None
    assert np.log(long[1] / long[0]) > 2.0 * np.log(short[1] / short[0])


def test_axes_count_alike_whatever_their_units() -> None:
    one = errors(300.0, 2)
    found = ratio_interval([one])
    scaled = LogErrors(one.base * [1.0, 1e3, 1e6], one.model * [1.0, 1e3, 1e6], one.at_s)
    assert ratio_interval([scaled]) == pytest.approx(found)


def test_the_base_models_error_of_each_axis_is_as_uncertain_as_the_new_models() -> None:
    one, ratios = errors(400.0, 6, memory_s=2.0), np.array([0.05, 0.05, 1.0])
    # Where the one errs more the other does, and the ratio of every axis is known.
    alike = LogErrors(one.base, np.sqrt(ratios) * one.base, one.at_s)
    assert ratio_interval([alike]) == pytest.approx((ratios.mean(), ratios.mean()), rel=1e-9)
    apart = LogErrors(one.base, np.sqrt(ratios) * (0.95 * one.base + 0.05 * one.model), one.at_s)
    found = ratio_interval([apart])
    assert found is not None
    assert found[0] == pytest.approx(found[1], rel=0.1)


def test_an_axis_without_errors_of_the_base_model_has_no_part() -> None:
    one = errors(300.0, 3)
    found = ratio_interval([one.without_sway()])
    two = LogErrors(one.base[:, [0, 2, 0]], one.model[:, [0, 2, 0]], one.at_s)
    assert found is not None
    assert found != ratio_interval([one])
    assert found[0] < RATIO < found[1]
    assert ratio_interval([two]) is not None


@pytest.mark.parametrize("seconds", [0.0, 20.0])
def test_few_blocks_have_no_interval(seconds: float) -> None:
    assert ratio_interval([errors(seconds, 4)]) is None


def test_a_model_whose_error_is_not_finite_has_no_interval() -> None:
    one = errors(300.0, 5)
    assert ratio_interval([LogErrors(one.base, np.full_like(one.model, np.inf), one.at_s)]) is None
    assert ratio_interval([LogErrors(0.0 * one.base, one.model, one.at_s)]) is None
