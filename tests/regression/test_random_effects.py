"""Random effects of groups of rows: by hand against dense matrices, and on drawn groups of a known spread."""

from __future__ import annotations

import numpy as np
import pytest

from ferryid.regression import GroupSums

P, D = 3, 2


def drawn(L: int, n: int, spread: float) -> tuple[GroupSums, list[np.ndarray]]:
    """Return the sums of groups and their columns [shared, own, target]."""
    rng, shared, tables = np.random.default_rng(3), np.array([1.0, -2.0, 0.5]), []
    for _ in range(L):
        X, Z = rng.standard_normal((n, P)), rng.standard_normal((n, D))
        y = X @ shared + Z @ (spread * rng.standard_normal(D)) + rng.standard_normal(n)
        tables.append(np.column_stack([X, Z, y]))
    return GroupSums(np.stack([one.T @ one for one in tables]), np.array([0.0, 0.0, 0.2])), tables


def test_the_estimate_is_that_of_dense_generalised_least_squares() -> None:
    sums, tables = drawn(4, 12, 0.7)
    width = np.array([0.7, 0.3])
    fit = sums.fit(width)
    information, slope = np.diag(sums.prior), np.zeros(P)
    for table in tables:
        X, Z, y = table[:, :P], table[:, P:-1], table[:, -1]
        inverse = np.linalg.inv(np.eye(len(y)) + (Z * width**2) @ Z.T)
        information, slope = information + X.T @ inverse @ X, slope + X.T @ inverse @ y
    shared = np.linalg.solve(information, slope)
    np.testing.assert_allclose(fit.shared, shared, rtol=1e-7)
    np.testing.assert_allclose(fit.covariance, np.linalg.inv(information), rtol=1e-7)
    for number, table in enumerate(tables):
        X, Z, y = table[:, :P], table[:, P:-1], table[:, -1]
        own = np.linalg.solve(Z.T @ Z + np.diag(width**-2.0), Z.T @ (y - X @ shared))
        np.testing.assert_allclose(fit.own[number], own, rtol=1e-6)
        left = y - X @ shared - Z @ own
        assert fit.loss(sums.products)[number] == pytest.approx(left @ left)
        alone = y - X @ shared
        assert fit.loss(sums.products, np.zeros((4, D)))[number] == pytest.approx(alone @ alone)


def test_the_evidence_is_the_restricted_likelihood_of_dense_matrices() -> None:
    sums, tables = drawn(4, 12, 0.7)

    def dense(width: np.ndarray) -> float:
        information, slope, total = np.diag(sums.prior), np.zeros(P), 0.0
        for table in tables:
            X, Z, y = table[:, :P], table[:, P:-1], table[:, -1]
            V = np.eye(len(y)) + (Z * width**2) @ Z.T
            inverse = np.linalg.inv(V)
            information, slope = information + X.T @ inverse @ X, slope + X.T @ inverse @ y
            total += y @ inverse @ y + np.linalg.slogdet(V)[1]
        total += np.linalg.slogdet(information)[1] - slope @ np.linalg.solve(information, slope)
        return -0.5 * float(total)

    one, other = np.array([0.7, 0.3]), np.array([0.1, 1.0])
    assert sums.fit(one).evidence - sums.fit(other).evidence == pytest.approx(dense(one) - dense(other), abs=1e-6)


@pytest.mark.parametrize("spread", [0.0, 0.6])
def test_the_spread_of_greatest_evidence_is_that_of_the_groups(spread: float) -> None:
    sums, _ = drawn(40, 30, spread)
    found, fit = sums.best(lambda size: np.full(D, size))
    assert found == pytest.approx(spread, abs=0.12)
    assert fit.evidence == max(
        fit.evidence, *(sums.fit(np.full(D, size)).evidence for size in (0.01, 0.3, 0.6, 1.0, 3.0))
    )
    # Where groups have nothing of their own, none is as likely.
    none = sums.within(np.zeros(0, dtype=np.int64)).fit(np.zeros(0)).evidence
    assert (fit.evidence - none > 100.0) == (spread > 0.0)
