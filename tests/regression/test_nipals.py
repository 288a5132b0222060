"""NIPALS against scikit-learn, against SIMPLS where both must agree, and against hand-worked cases."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from sklearn.cross_decomposition import PLSRegression

from ferryid.errors import FerryIdError
from ferryid.regression.cross_products import CrossProducts
from ferryid.regression.nipals import component_covariances, fit_nipals
from ferryid.regression.simpls import fit_simpls
from tests.regression.rows import from_rows

Floats = NDArray[np.float64]


def data(m: int = 3, seed: int = 0) -> tuple[Floats, Floats]:
    rng = np.random.default_rng(seed)
    X = rng.standard_normal((400, 8)) @ rng.standard_normal((8, 8)) * np.geomspace(1.0, 50.0, 8) + 3.0
    return X, X @ rng.standard_normal((8, m)) + 20.0 * rng.standard_normal((400, m)) - 7.0


@pytest.mark.parametrize("scale", [True, False])
@pytest.mark.parametrize("m", [1, 3])
def test_agrees_with_scikit_learn(m: int, scale: bool) -> None:
    X, Y = data(m)
    fit = fit_nipals(X, Y, 6, scale=scale, tolerance=1e-26, most_iterations=20000)
    assert fit.converged
    for components in range(1, 7):
        other = PLSRegression(components, scale=scale, tol=1e-26, max_iter=20000).fit(X, Y)
        np.testing.assert_allclose(
            X @ fit.coefficients[components - 1] + fit.intercepts[components - 1],
            other.predict(X).reshape(-1, m),
            rtol=1e-9,
            atol=1e-8,
        )
    signs = np.sign(np.sum(fit.weights * other.x_weights_, axis=0))
    np.testing.assert_allclose(fit.weights, other.x_weights_ * signs, atol=1e-9)
    np.testing.assert_allclose(fit.loadings, other.x_loadings_ * signs, atol=1e-9)
    np.testing.assert_allclose(fit.y_loadings, other.y_loadings_ * signs, atol=1e-9)
    np.testing.assert_allclose(fit.rotations, other.x_rotations_ * signs, atol=1e-9)
    np.testing.assert_allclose(fit.scores(X), other.x_scores_ * signs, atol=1e-7)


def test_usual_tolerance_stops_where_scikit_learn_stops() -> None:
    X, Y = data()
    fit, other = fit_nipals(X, Y, 5), PLSRegression(5).fit(X, Y)
    np.testing.assert_allclose(fit.scores(X) @ fit.loadings.T, other.x_scores_ @ other.x_loadings_.T, atol=0.02)


def test_long_data_agree_with_scikit_learn() -> None:
    # Several blocks of rows and a rest.
    X, Y = data()
    X, Y = np.tile(X, (12, 1))[:4567], np.tile(Y, (12, 1))[:4567]
    fit = fit_nipals(X, Y, 3, tolerance=1e-26, most_iterations=20000)
    other = PLSRegression(3, tol=1e-26, max_iter=20000).fit(X, Y)
    np.testing.assert_allclose(X @ fit.coefficients[-1] + fit.intercepts[-1], other.predict(X), rtol=1e-9, atol=1e-8)


def test_one_output_is_simpls() -> None:
    X, Y = data(1)
    np.testing.assert_allclose(
        fit_nipals(X, Y, 8).coefficients,
        fit_simpls(from_rows(CrossProducts, X, Y), 8).coefficients,
        rtol=1e-8,
        atol=1e-10,
    )


def test_all_components_are_least_squares() -> None:
    X, Y = data()
    want = np.linalg.lstsq(np.hstack([X, np.ones((len(X), 1))]), Y)[0]
    fit = fit_nipals(X, Y, 8)
    np.testing.assert_allclose(np.vstack([fit.coefficients[-1], fit.intercepts[-1:]]), want, rtol=1e-8)


def test_first_component_by_hand() -> None:
    # One output: the weights are the covariances with it, 4 and 3 parts of 5.
    X = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])
    Y = X @ np.array([[4.0], [3.0]])
    fit = fit_nipals(X, Y, 2, scale=False)
    np.testing.assert_allclose(fit.weights[:, 0], [0.8, 0.6], rtol=1e-12)
    np.testing.assert_allclose(fit.y_loadings[0, 0], 5.0, rtol=1e-12)
    np.testing.assert_allclose(fit.explained_x[0], 0.5, rtol=1e-12)
    np.testing.assert_allclose(fit.explained_y[0], 1.0, rtol=1e-12)
    assert fit.extracted == 1
    np.testing.assert_allclose(fit.coefficients[1], [[4.0], [3.0]], rtol=1e-12)


def test_explained_variance_is_that_of_the_reconstruction() -> None:
    X, Y = data()
    fit = fit_nipals(X, Y, 4)
    E = (X - X.mean(axis=0)) / X.std(axis=0, ddof=1)
    T = fit.scores(X)
    assert fit.explained_x[-1] == pytest.approx(1.0 - np.sum((E - T @ fit.loadings.T) ** 2) / np.sum(E**2))
    left = np.sum((Y - X @ fit.coefficients[-1] - fit.intercepts[-1]) ** 2, axis=0)
    np.testing.assert_allclose(fit.explained_y[-1], 1.0 - left / np.sum((Y - Y.mean(axis=0)) ** 2, axis=0))
    np.testing.assert_allclose(T.T @ T, np.diag(np.diag(T.T @ T)), atol=1e-8)


def test_signs_do_not_depend_on_those_of_the_outputs() -> None:
    X, Y = data()
    one, other = fit_nipals(X, Y, 5), fit_nipals(X, -Y, 5)
    np.testing.assert_allclose(one.weights, other.weights, atol=1e-12)
    assert (one.weights[np.argmax(np.abs(one.weights), axis=0), np.arange(5)] > 0.0).all()


def test_constant_and_duplicate_columns_give_the_minimum_norm() -> None:
    X, Y = data()
    wide = np.hstack([X, X[:, :2], np.full((len(X), 1), 4.0)])
    fit = fit_nipals(wide, Y, 11)
    assert fit.extracted == 8
    np.testing.assert_allclose(fit.coefficients[-1][:2], fit.coefficients[-1][8:10], rtol=1e-9)
    np.testing.assert_array_equal(fit.coefficients[:, 10], 0.0)
    np.testing.assert_allclose(
        wide @ fit.coefficients[-1] + fit.intercepts[-1],
        X @ fit_nipals(X, Y, 8).coefficients[-1] + fit_nipals(X, Y, 8).intercepts[-1],
        rtol=1e-7,
    )


def test_says_when_it_did_not_settle_and_leaves_the_data_alone() -> None:
    X, Y = data()
    before = X.copy(), Y.copy()
    fit = fit_nipals(X, Y, 3, tolerance=1e-30, most_iterations=2)
    assert not fit.converged
    assert fit.iterations.tolist() == [2, 2, 2]
    np.testing.assert_array_equal(X, before[0])
    np.testing.assert_array_equal(Y, before[1])


@pytest.mark.slow
def test_covariance_is_the_largest_with_any_combination_of_outputs() -> None:
    X, Y = data()
    fit = fit_nipals(X, Y, 3)
    got = component_covariances(fit.rotations, X, Y)
    E, F = ((values - values.mean(axis=0)) / values.std(axis=0, ddof=1) for values in (X, Y))
    angles = np.random.default_rng(1).standard_normal((3, 20000))
    outputs = F @ (angles / np.linalg.norm(angles, axis=0))
    for a in range(3):
        r = fit.rotations[:, a] / np.linalg.norm(fit.rotations[:, a])
        sampled = np.abs((E @ r) @ outputs / (len(X) - 1)).max()
        assert sampled <= got[a] * (1.0 + 1e-12)
        assert sampled == pytest.approx(got[a], rel=1e-3)


@pytest.mark.parametrize("seed", range(6))
def test_simpls_holds_no_less_covariance_in_its_second_component(seed: int) -> None:
    # Both second scores are orthogonal to the same first ones, and SIMPLS takes the best of all such (De Jong 1993).
    X, Y = data(seed=seed)
    ours = component_covariances(fit_simpls(from_rows(CrossProducts, X, Y), 2).weights[0], X, Y)
    theirs = component_covariances(fit_nipals(X, Y, 2, tolerance=1e-26, most_iterations=20000).rotations, X, Y)
    assert ours[0] == pytest.approx(theirs[0], rel=1e-9)
    assert ours[1] > theirs[1]


def test_refuses_what_is_no_data() -> None:
    X, Y = data()
    hole = X.copy()
    hole[3, 2] = np.nan
    for call in (lambda: fit_nipals(X, Y, 0), lambda: fit_nipals(hole, Y, 2), lambda: fit_nipals(X[:1], Y[:1], 1)):
        with pytest.raises(FerryIdError, match="Fix:"):
            call()
    with pytest.raises(FerryIdError, match="same rows"):
        fit_nipals(X, Y[1:], 2)
