"""How well a fold's windows are predicted beside a hull that the others determine: against the dense covariance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from ferryid.diagnose.inference.hull_uncertainty import HullUncertainty


@pytest.fixture
def known() -> HullUncertainty:
    rng = np.random.default_rng(7)
    rows = np.arange(30) % 3 == 1
    slopes = rng.standard_normal((10, 4))
    root = rng.standard_normal((4, 4))
    return HullUncertainty(rows, slopes, root @ root.T + np.eye(4))


def test_errors_are_weighed_by_the_inverse_of_their_covariance(known: HullUncertainty) -> None:
    white = np.random.default_rng(8).standard_normal(30)
    covariance = np.eye(10) + known.slopes @ np.linalg.inv(known.precision) @ known.slopes.T
    np.testing.assert_allclose(known.weighed(white), np.linalg.solve(covariance, white[known.rows]), rtol=1e-9)


def test_the_hull_moves_to_the_top_of_its_posterior(known: HullUncertainty) -> None:
    white = np.random.default_rng(9).standard_normal(30)

    def cost(move: np.ndarray) -> float:
        left = white[known.rows] + known.slopes @ move
        return float(left @ left + move @ known.precision @ move)

    found = minimize(cost, np.zeros(4), tol=1e-12)
    np.testing.assert_allclose(known.move(white), found.x, atol=1e-5)
    assert cost(known.move(white)) == pytest.approx(float(white[known.rows] @ known.weighed(white)))


def test_a_hull_that_is_known_leaves_errors_as_they_are(known: HullUncertainty) -> None:
    sure = HullUncertainty(known.rows, known.slopes, 1e12 * np.eye(4))
    white = np.random.default_rng(10).standard_normal(30)
    np.testing.assert_allclose(sure.weighed(white), white[known.rows], rtol=1e-9)
    np.testing.assert_allclose(sure.move(white), 0.0, atol=1e-9)
