"""The recursive filter against scipy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from ferryid.recursive_filter import lagged, recursive_filter

VALUES = np.random.default_rng(3).standard_normal((50, 2)).cumsum(axis=0)


@pytest.mark.parametrize(("b", "a"), [([1.0, -2.0, 1.0], [1.0, -1.2, 0.5]), ([0.3, 0.2], [1.0, -0.5])])
def test_as_that_of_scipy_from_rest(b: list[float], a: list[float]) -> None:
    known = lfilter(b, a, VALUES, axis=0)
    np.testing.assert_allclose(recursive_filter(np.array(b), np.array(a), VALUES), known, atol=1e-12)
    np.testing.assert_allclose(recursive_filter(np.array(b), np.array(a), VALUES[:, 0]), known[:, 0], atol=1e-12)


def test_what_stood_still_stays() -> None:
    b, a = np.array([0.3, 0.2]), np.array([1.0, -0.5])
    still = np.full((20, 2), [4.0, -7.0])
    np.testing.assert_allclose(recursive_filter(b, a, still, still[0]), still, rtol=1e-14)
    known, _ = lfilter(b, a, VALUES, axis=0, zi=0.7 * VALUES[:1])
    np.testing.assert_allclose(recursive_filter(b, a, VALUES, VALUES[0]), known, atol=1e-12)


def test_a_lag_answers_what_is_linear_between_rows_exactly() -> None:
    t = np.arange(0.0, 20.0, 0.25)
    for time_constant_s in (0.01, 0.25, 3.0):
        exact = t - time_constant_s * (1.0 - np.exp(-t / time_constant_s))
        np.testing.assert_allclose(lagged(t, time_constant_s, 0.25), exact, atol=1e-12)
    # What stood still before the first row goes on doing so.
    np.testing.assert_array_equal(lagged(np.full(5, 2.0), 1.0, 0.25), 2.0)
