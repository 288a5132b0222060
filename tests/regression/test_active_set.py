"""Least squares with coefficients that are not negative, beside SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import nnls

from ferryid.regression.active_set import non_negative


@pytest.mark.parametrize("seed", range(40))
def test_the_same_as_scipys(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, k = rng.integers(3, 30), rng.integers(1, 60)
    X, y = rng.standard_normal((n, k)), rng.standard_normal(n)
    if seed % 2:
        # As of a constraint that holds from both sides, beside others that nearly agree.
        X = np.column_stack([X, -X[:, :1], X + 1e-3 * rng.standard_normal(X.shape)])
    found, (wanted, left) = non_negative(X, y, 50 * X.shape[1]), nnls(X, y, maxiter=50 * X.shape[1])
    assert np.all(found >= 0.0)
    assert np.linalg.norm(X @ found - y) == pytest.approx(left, rel=1e-9, abs=1e-9)
    np.testing.assert_allclose(X @ found, X @ wanted, atol=1e-7)
    if np.linalg.matrix_rank(X[:, (found > 0.0) | (wanted > 0.0)]) == np.count_nonzero((found > 0.0) | (wanted > 0.0)):
        np.testing.assert_allclose(found, wanted, atol=1e-7)


def test_what_no_coefficient_lessens_is_left() -> None:
    np.testing.assert_array_equal(non_negative(np.eye(2), np.array([-1.0, -2.0]), 100), [0.0, 0.0])
    assert len(non_negative(np.zeros((2, 0)), np.ones(2), 10)) == 0
