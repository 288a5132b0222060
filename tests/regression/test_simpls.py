"""SIMPLS against De Jong's own table, a 60-digit reference, least squares, and other libraries on one output."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from sklearn.cross_decomposition import PLSRegression

from ferryid.errors import FerryIdError
from ferryid.regression.cross_products import CrossProducts
from ferryid.regression.qr import QrFactor
from ferryid.regression.recurrence import dominant
from ferryid.regression.simpls import (
    Simpls,
    fit_simpls,
    fit_simpls_many,
    total,
    training_sums,
)
from tests.regression.rows import from_rows

Floats = NDArray[np.float64]
KINDS = (CrossProducts, QrFactor)


def conditioned(n: int, K: int, m: int, condition: float, seed: int = 0) -> tuple[Floats, Floats]:
    """Data whose singular values fall off geometrically down to 1/condition."""
    rng = np.random.default_rng(seed)
    left = np.linalg.qr(rng.standard_normal((n, K)))[0]
    right = np.linalg.qr(rng.standard_normal((K, K)))[0]
    X = 30.0 * left * np.geomspace(1.0, 1.0 / condition, K) @ right.T
    Y = X @ rng.standard_normal((K, m)) + rng.standard_normal((n, m))
    return X + rng.standard_normal(K), Y + 5.0


def reference(X: Floats, Y: Floats, components: int, scale: bool) -> Floats:
    """Appendix A on the rows themselves with 60 digits, shape (A, K, m)."""
    with mpmath.workdps(60):

        def standard(values: Floats) -> tuple[mpmath.matrix, list[mpmath.mpf]]:
            table = mpmath.matrix(values.tolist())
            deviations = []
            for j in range(table.cols):
                mean = mpmath.fsum(table[:, j]) / table.rows
                square = mpmath.fsum((value - mean) ** 2 for value in table[:, j])
                deviations.append(mpmath.sqrt(square / (table.rows - 1)) if scale else mpmath.mpf(1))
                for i in range(table.rows):
                    table[i, j] = (table[i, j] - mean) / deviations[j]
            return table, deviations

        X0, sx = standard(X)
        Y0, sy = standard(Y)
        S = X0.T * Y0
        V: list[mpmath.matrix] = []
        B = mpmath.zeros(X0.cols, Y0.cols)
        found = []
        for _ in range(components):
            q = mpmath.eigsy(S.T * S)[1][:, Y0.cols - 1]
            r = S * q
            t = X0 * r
            norm = mpmath.norm(t)
            t, r = t / norm, r / norm
            p = X0.T * t
            q = Y0.T * t
            v = p
            for earlier in V:
                v = v - earlier * (earlier.T * p)[0]
            v = v / mpmath.norm(v)
            S = S - v * (v.T * S)
            V.append(v)
            B = B + r * q.T
            found.append([[float(B[k, j] * sy[j] / sx[k]) for j in range(Y0.cols)] for k in range(X0.cols)])
    return np.array(found)


def error(fit: Simpls, want: Floats) -> Floats:
    """Largest error over the largest coefficient, for every number of components."""
    return np.abs(fit.coefficients - want).max(axis=(1, 2)) / np.abs(want).max(axis=(1, 2))


def scaled(X: Floats) -> Floats:
    return (X - X.mean(axis=0)) / X.std(axis=0, ddof=1)


@pytest.mark.parametrize("kind", KINDS)
def test_de_jongs_own_example(kind) -> None:
    """The two-response example of De Jong (1993), printed with four decimals; signs are free."""
    X = np.array([[-4.0, 2.0, 1.0], [-4.0, -2.0, -1.0], [4.0, 2.0, -1.0], [4.0, -2.0, 1.0]])
    Y = np.array([[430.0, -94.0], [-436.0, 12.0], [-361.0, -22.0], [367.0, 104.0]])
    fit = fit_simpls(from_rows(kind, X, Y), 3, scale=False)
    weights = fit.weights[0] / np.linalg.norm(fit.weights[0], axis=0)
    printed_weights = [[0.0164, 0.1798, 0.9836], [0.4562, -0.7719, 0.4428], [0.3392, 0.7141, -0.6124]]
    printed_scores = [
        [0.6088, -0.6712, -0.2662, 0.3286],
        [-0.6018, -0.1489, -0.0333, 0.7840],
        [-0.1311, -0.5266, 0.8234, -0.1657],
    ]
    signs = np.sign(np.sum(fit.scores(X).T * printed_scores, axis=1))
    np.testing.assert_allclose(fit.scores(X).T * signs[:, None], printed_scores, atol=6e-5)
    np.testing.assert_allclose(np.abs(weights.T), np.abs(printed_weights), atol=6e-5)
    np.testing.assert_allclose(np.diff(fit.explained_x, prepend=0.0), [0.0672, 0.5077, 0.4251], atol=6e-5)
    in_y = np.sum(fit.y_loadings[0] ** 2, axis=0) / np.sum(Y**2)
    np.testing.assert_allclose(in_y, [0.9015, 0.0454, 0.0531], atol=6e-5)


@pytest.mark.parametrize("scale", [True, False])
@pytest.mark.parametrize(("m", "condition"), [(1, 40.0), (2, 40.0), (3, 40.0), (3, 1e3)])
def test_every_component_agrees_with_sixty_digits(m: int, condition: float, scale: bool) -> None:
    X, Y = conditioned(40, 10, m, condition)
    want = reference(X, Y, 10, scale)
    by_qr = error(fit_simpls(from_rows(QrFactor, X, Y), 10, scale=scale), want)
    by_products = error(fit_simpls(from_rows(CrossProducts, X, Y), 10, scale=scale), want)
    assert by_qr.max() < 1e-15 * max(30.0, condition)
    assert by_products.max() < 2e-16 * condition**2 + 1e-14


@pytest.mark.parametrize("condition", [1.8e6, 1e8])
def test_qr_keeps_the_digits_that_cross_products_lose(condition: float) -> None:
    X, Y = conditioned(40, 10, 3, condition)
    want = reference(X, Y, 10, True)
    by_qr = error(fit_simpls(from_rows(QrFactor, X, Y), 10), want)
    by_products = error(fit_simpls(from_rows(CrossProducts, X, Y), 10), want)
    assert by_qr.max() < 2e-16 * condition
    assert by_qr.max() < 1e-3 * by_products.max()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("condition", [3.0, 40.0, 1e3])
def test_scores_are_orthonormal_and_orthogonal_to_the_ones(kind, condition: float) -> None:
    X, Y = conditioned(200, 12, 3, condition)
    fit = fit_simpls(from_rows(kind, X, Y), 12)
    T = fit.scores(X)
    np.testing.assert_allclose(T.T @ T, np.eye(12), atol=1e-15 * condition**2 + 1e-13)
    np.testing.assert_allclose(T.sum(axis=0), 0.0, atol=1e-11 * condition)
    np.testing.assert_allclose(scaled(X).T @ T, fit.loadings[0], atol=1e-9)
    np.testing.assert_allclose(scaled(Y).T @ T, fit.y_loadings[0], atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_all_components_are_least_squares(kind) -> None:
    X, Y = conditioned(300, 8, 3, 20.0)
    want = np.linalg.lstsq(np.hstack([X, np.ones((300, 1))]), Y)[0]
    for scale in (True, False):
        fit = fit_simpls(from_rows(kind, X, Y), 8, scale=scale)
        np.testing.assert_allclose(fit.coefficients[-1], want[:-1], rtol=1e-9)
        np.testing.assert_allclose(fit.intercepts[-1], want[-1], rtol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("scale", [True, False])
def test_one_output_agrees_with_scikit_learn(kind, scale: bool) -> None:
    X, Y = conditioned(250, 9, 1, 30.0, seed=3)
    fit = fit_simpls(from_rows(kind, X, Y), 9, scale=scale)
    for components in range(1, 10):
        other = PLSRegression(components, scale=scale).fit(X, Y)
        np.testing.assert_allclose(fit.coefficients[components - 1], other.coef_.T, rtol=1e-10, atol=1e-11)


def test_one_output_agrees_with_improved_kernel_pls() -> None:
    library = pytest.importorskip("ikpls.numpy")
    X, Y = conditioned(250, 9, 1, 30.0, seed=4)
    other = library.PLS(algorithm=1, ddof=1)
    other.fit(X, Y, A=9)
    fit = fit_simpls(from_rows(CrossProducts, X, Y), 9)
    for components in range(1, 10):
        want = np.asarray(other.predict(X, n_components=components))
        got = X @ fit.coefficients[components - 1] + fit.intercepts[components - 1]
        np.testing.assert_allclose(got, want, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("m", [1, 2, 3])
def test_duplicate_constant_and_dependent_columns_give_the_minimum_norm(kind, m: int) -> None:
    rng = np.random.default_rng(m)
    base = rng.standard_normal((500, 6))
    columns = [base, base[:, :3], np.full((500, 1), 0.1), np.zeros((500, 1)), -base[:, 5:]]
    X = np.hstack(columns) * np.array([1.0] * 9 + [1.0, 1.0, 50.0])
    Y = base @ rng.standard_normal((6, m)) + 0.1 * rng.standard_normal((500, m))
    fit = fit_simpls(from_rows(kind, X, Y), 12)
    assert fit.rank == (6,)
    assert fit.extracted[0] <= 6
    theta = fit.coefficients[-1]
    np.testing.assert_allclose(theta[:3], theta[6:9], rtol=1e-9)
    np.testing.assert_array_equal(theta[9:11], 0.0)
    np.testing.assert_allclose(theta[5], -50.0 * theta[11], rtol=1e-9)
    varying = [0, 1, 2, 3, 4, 5, 6, 7, 8, 11]
    Xs = scaled(X[:, varying])
    want = np.linalg.pinv(Xs, rcond=1e-10) @ (Y - Y.mean(axis=0)) / X[:, varying].std(axis=0, ddof=1)[:, None]
    np.testing.assert_allclose(theta[varying], want, rtol=1e-9, atol=1e-11)
    # Components past the rank change nothing.
    np.testing.assert_array_equal(
        fit.coefficients[fit.extracted[0] - 1 :], theta[None].repeat(13 - fit.extracted[0], 0)
    )
    np.testing.assert_array_equal(fit.weights[:, :, fit.extracted[0] :], 0.0)


@pytest.mark.parametrize("kind", KINDS)
def test_a_motion_that_only_goes_ahead(kind) -> None:
    """With u, r > 0 throughout, |r|r and r² are one column: the pair shares its coefficient."""
    rng = np.random.default_rng(0)
    u, r = 1.0 + rng.random(2000), 0.1 + 0.2 * rng.random(2000)
    X = np.column_stack([u, r, r * r, np.abs(r) * r, np.abs(u) * u, u * u, u * r])
    Y = np.column_stack([3.0 * u * u - r, 5.0 * r * r + u, u * r])
    fit = fit_simpls(from_rows(kind, X, Y), 7)
    assert fit.rank == (5,)
    np.testing.assert_allclose(X @ fit.coefficients[-1] + fit.intercepts[-1], Y, atol=1e-8)
    np.testing.assert_allclose(fit.coefficients[-1][2:4, 1], [2.5, 2.5], rtol=1e-6)
    np.testing.assert_allclose(fit.coefficients[-1][4:6, 0], [1.5, 1.5], rtol=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_more_columns_than_rows(kind) -> None:
    rng = np.random.default_rng(5)
    X, Y = rng.standard_normal((7, 20)), rng.standard_normal((7, 3))
    fit = fit_simpls(from_rows(kind, X, Y), 20)
    assert fit.rank == (6,)
    np.testing.assert_allclose(X @ fit.coefficients[-1] + fit.intercepts[-1], Y, atol=1e-12)
    want = np.linalg.pinv(scaled(X), rcond=1e-10) @ (Y - Y.mean(axis=0)) / X.std(axis=0, ddof=1)[:, None]
    np.testing.assert_allclose(fit.coefficients[-1], want, atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_too_little_to_fit_is_one_clear_line(kind) -> None:
    X, Y = np.ones((1, 3)), np.ones((1, 2))
    for rows in (slice(0, 1), slice(0, 0)):
        with pytest.raises(FerryIdError, match=r"^trial: a fit needs at least two rows, found \d\. Fix: "):
            fit_simpls(from_rows(kind, X[rows], Y[rows]), 2, where="trial")
    with pytest.raises(FerryIdError, match="at least one component, 0 asked"):
        fit_simpls(from_rows(kind, np.eye(3), np.eye(3)), 0)


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_varies(kind) -> None:
    fit = fit_simpls(from_rows(kind, np.full((9, 3), 0.3), np.full((9, 2), 4.0)), 3)
    np.testing.assert_array_equal(fit.coefficients, 0.0)
    np.testing.assert_allclose(fit.intercepts, 4.0)
    np.testing.assert_array_equal(fit.vip(3), 0.0)
    assert fit.rank == (0,)


@pytest.mark.parametrize("kind", KINDS)
def test_an_output_without_variance_leaves_the_others_alone(kind) -> None:
    X, Y = conditioned(100, 5, 3, 10.0)
    Y[:, 1] = -2.0
    fit = fit_simpls(from_rows(kind, X, Y), 5)
    alone = fit_simpls(from_rows(kind, X, Y[:, [0, 2]]), 5)
    np.testing.assert_allclose(fit.coefficients[:, :, [0, 2]], alone.coefficients, rtol=1e-11)
    np.testing.assert_array_equal(fit.coefficients[:, :, 1], 0.0)
    np.testing.assert_allclose(fit.intercepts[:, 1], -2.0)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=20, deadline=None)
@given(
    seed=st.integers(0, 2**16),
    factors=st.lists(st.floats(1e-4, 1e4), min_size=6, max_size=6),
    offset=st.floats(-100.0, 100.0),
)
def test_units_offsets_order_and_rows_repeated_do_not_matter(
    kind, seed: int, factors: list[float], offset: float
) -> None:
    X, Y = conditioned(60, 6, 2, 5.0, seed=seed)
    fit = fit_simpls(from_rows(kind, X, Y), 6)
    d = np.array(factors)
    order = np.random.default_rng(seed).permutation(6)
    other = fit_simpls(from_rows(kind, (X * d + offset * d)[:, order], Y), 6)
    size = np.abs(fit.coefficients).max()
    np.testing.assert_allclose(other.coefficients * d[order][:, None], fit.coefficients[:, order], atol=1e-9 * size)
    twice = fit_simpls(from_rows(kind, np.tile(X, (2, 1)), np.tile(Y, (2, 1))), 6)
    np.testing.assert_allclose(twice.coefficients, fit.coefficients, atol=1e-9 * size)
    np.testing.assert_allclose(twice.vip(4), fit.vip(4), atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_unscaled_fit_does_not_change_under_rotation(kind) -> None:
    X, Y = conditioned(80, 6, 3, 10.0)
    rotation = np.linalg.qr(np.random.default_rng(0).standard_normal((6, 6)))[0]
    fit, turned = (fit_simpls(from_rows(kind, x, Y), 6, scale=False) for x in (X, X @ rotation))
    np.testing.assert_allclose(rotation @ turned.coefficients, fit.coefficients, atol=1e-10)


@pytest.mark.parametrize("kind", KINDS)
def test_explained_variance_and_vip_by_their_definitions(kind) -> None:
    X, Y = conditioned(120, 6, 3, 10.0)
    fit = fit_simpls(from_rows(kind, X, Y), 6)
    Xs = scaled(X)
    for a in range(1, 7):
        T = fit.scores(X)[:, :a]
        left = Xs - T @ (T.T @ Xs)
        assert fit.explained_x[a - 1] == pytest.approx(1.0 - np.sum(left**2) / np.sum(Xs**2), abs=1e-12)
        errors = Y - X @ fit.coefficients[a - 1] - fit.intercepts[a - 1]
        r_squared = 1.0 - np.sum(errors**2, axis=0) / np.sum((Y - Y.mean(axis=0)) ** 2, axis=0)
        np.testing.assert_allclose(fit.explained_y[a - 1], r_squared, atol=1e-11)
        assert np.mean(fit.vip(a) ** 2) == pytest.approx(1.0)
    weights = fit.weights[0, :, 0]
    np.testing.assert_allclose(fit.vip(1), np.sqrt(6.0) * np.abs(weights) / np.linalg.norm(weights))


@pytest.mark.parametrize("kind", KINDS)
def test_axes_fitted_apart_use_their_own_columns_alone(kind) -> None:
    X, Y = conditioned(150, 6, 3, 10.0)
    allowed = np.array([[1, 0, 0], [1, 1, 1], [0, 1, 1], [0, 1, 1], [1, 0, 0], [0, 1, 1]], dtype=bool)
    fit = fit_simpls(from_rows(kind, X, Y), 6, allowed=allowed)
    assert fit.groups == ((0,), (1, 2))
    assert fit.rank == (3, 4)
    surge = fit_simpls(from_rows(kind, X[:, [0, 1, 4]], Y[:, :1]), 6)
    sway_yaw = fit_simpls(from_rows(kind, X[:, [1, 2, 3, 5]], Y[:, 1:]), 6)
    np.testing.assert_allclose(fit.coefficients[:, [0, 1, 4], :1], surge.coefficients, rtol=1e-9)
    np.testing.assert_allclose(fit.coefficients[:, [1, 2, 3, 5], 1:], sway_yaw.coefficients, rtol=1e-9)
    np.testing.assert_array_equal(fit.coefficients[:, ~allowed], 0.0)
    np.testing.assert_allclose(fit.explained_y[:, 1:], sway_yaw.explained_y, rtol=1e-9)
    T = fit.scores(X, group=1)[:, :4]
    np.testing.assert_allclose(T.T @ T, np.eye(4), atol=1e-12)
    assert fit.explained_x[-1] == pytest.approx(1.0)
    none = fit_simpls(from_rows(kind, X, Y), 2, allowed=np.zeros((6, 3), dtype=bool))
    np.testing.assert_allclose(none.intercepts[0], Y.mean(axis=0))


def test_outputs_are_scaled_so_that_yaw_does_not_rule() -> None:
    X, Y = conditioned(150, 6, 3, 10.0)
    larger = Y * np.array([1.0, 1.0, 1e4])
    fit, other = (fit_simpls(from_rows(CrossProducts, X, y), 2) for y in (Y, larger))
    np.testing.assert_allclose(other.coefficients / [1.0, 1.0, 1e4], fit.coefficients, rtol=1e-9)
    ruled = fit_simpls(from_rows(CrossProducts, X, larger), 2, scale_y=False)
    yaw_alone = fit_simpls(from_rows(CrossProducts, X, larger[:, 2:]), 2)
    np.testing.assert_allclose(ruled.coefficients[:, :, 2:], yaw_alone.coefficients, rtol=1e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_several_fits_side_by_side_equal_one_by_one(kind) -> None:
    sources = [from_rows(kind, *conditioned(90, 7, 3, 5.0, seed=seed)) for seed in range(3)]
    X, Y = conditioned(90, 7, 3, 5.0, seed=9)
    X[:, 6], X[:, 2] = X[:, 5], 1.0
    Y[:, 0] = 0.0
    sources.append(from_rows(kind, X, Y))
    for fit, source in zip(fit_simpls_many(sources, 7), sources, strict=True):
        alone = fit_simpls(source, 7)
        np.testing.assert_allclose(fit.coefficients, alone.coefficients, atol=1e-11)
        assert (fit.rank, fit.extracted) == (alone.rank, alone.extracted)


@pytest.mark.parametrize("kind", KINDS)
def test_errors_on_other_rows_from_their_cross_products(kind) -> None:
    X, Y = conditioned(400, 6, 3, 10.0)
    fit = fit_simpls(from_rows(kind, X[:250], Y[:250]), 6)
    check = from_rows(kind, X[250:], Y[250:])
    want = [
        np.sum((Y[250:] - X[250:] @ theta - b) ** 2, axis=0)
        for theta, b in zip(fit.coefficients, fit.intercepts, strict=True)
    ]
    np.testing.assert_allclose(check.sse(fit.coefficients, fit.intercepts), want, rtol=1e-10)


@pytest.mark.parametrize("count", [2, 3, 6])
def test_training_sums_hold_all_folds_but_their_own(count: int) -> None:
    folds = [from_rows(CrossProducts, *conditioned(30 + i, 4, 2, 3.0, seed=i)) for i in range(count)]
    for i, rest in enumerate(training_sums(folds)):
        want = total(fold for j, fold in enumerate(folds) if j != i)
        assert rest.n == want.n
        np.testing.assert_allclose(rest.centred()[0], want.centred()[0], rtol=1e-12)


def test_the_same_rows_give_the_same_bits() -> None:
    X, Y = conditioned(300, 8, 3, 30.0)
    one, two = (fit_simpls(from_rows(CrossProducts, X, Y), 8) for _ in range(2))
    np.testing.assert_array_equal(one.coefficients, two.coefficients)


@pytest.mark.parametrize("kind", ["any", "rank one", "near tie", "diagonal", "nothing", "tiny", "huge"])
def test_dominant_eigenvectors_of_many_matrices(kind: str) -> None:
    A = np.random.default_rng(0).standard_normal((200, 21, 3))
    if kind == "rank one":
        A = A[:, :, :1] * A[:, :1, :]
    if kind == "near tie":
        A = np.linalg.qr(A)[0] * [1.0, 1.0 - 1e-5, 0.3]
    if kind == "diagonal":
        A[:] = 0.0
        A[:, [0, 1, 2], [0, 1, 2]] = [2.0, 1.0, 3.0]
    A = A * {"nothing": 0.0, "tiny": 1e-70, "huge": 1e70}.get(kind, 1.0)
    M = A.transpose(0, 2, 1) @ A
    got, want = dominant(M), np.linalg.eigh(M)[1][:, :, -1]
    np.testing.assert_allclose(np.linalg.norm(got, axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(got * np.sign(np.sum(got * want, axis=1, keepdims=True)), want, atol=1e-10)
