"""Principal components of the basis against NumPy's SVD and scikit-learn."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from sklearn.decomposition import PCA

from ferryid.errors import FerryIdError
from ferryid.regression.bases.basis import make_basis
from ferryid.regression.cross_products import CrossProducts
from ferryid.regression.pca import principal_components
from ferryid.regression.qr import QrFactor
from tests.identify.rounds import motion
from tests.regression.rows import from_rows

Floats = NDArray[np.float64]


def data() -> Floats:
    rng = np.random.default_rng(0)
    return rng.standard_normal((300, 6)) @ rng.standard_normal((6, 6)) * np.geomspace(1.0, 30.0, 6) + 9.0


@pytest.mark.parametrize("kind", [CrossProducts, QrFactor])
@pytest.mark.parametrize("standardise", [True, False])
def test_agrees_with_the_svd(kind, standardise: bool) -> None:
    X = data()
    found = principal_components(from_rows(kind, X, np.zeros((300, 1))), standardise=standardise)
    E = X - X.mean(axis=0)
    E = E / E.std(axis=0, ddof=1) if standardise else E
    left, singular, right = np.linalg.svd(E, full_matrices=False)
    signs = np.sign(np.sum(found.loadings * right.T, axis=0))
    np.testing.assert_allclose(found.explained, singular**2 / np.sum(singular**2), rtol=1e-9)
    np.testing.assert_allclose(found.variances, singular**2 / 299, rtol=1e-9)
    np.testing.assert_allclose(found.loadings, right.T * signs, atol=1e-8)
    np.testing.assert_allclose(found.scores(X), left * singular * signs, atol=1e-6)
    assert (found.loadings[np.argmax(np.abs(found.loadings), axis=0), np.arange(6)] > 0.0).all()


def test_agrees_with_scikit_learn() -> None:
    X = data()
    other = PCA().fit(X)
    found = principal_components(from_rows(QrFactor, X, np.zeros((300, 1))), standardise=False)
    np.testing.assert_allclose(found.explained, other.explained_variance_ratio_, rtol=1e-9)
    np.testing.assert_allclose(found.variances, other.explained_variance_, rtol=1e-9)


def test_two_columns_by_hand() -> None:
    # Correlation 0.6: standardised variances are 1.6 and 0.4, along the diagonals.
    rng = np.random.default_rng(2)
    Z = np.linalg.qr(rng.standard_normal((50, 3)) - rng.standard_normal((50, 3)).mean(axis=0))[0]
    Z = np.linalg.qr(Z - Z.mean(axis=0))[0]
    X = np.column_stack([Z[:, 0], 500.0 * (0.6 * Z[:, 0] + 0.8 * Z[:, 1])])
    found = principal_components(from_rows(CrossProducts, X, np.zeros((50, 1))))
    np.testing.assert_allclose(found.variances, [1.6, 0.4], rtol=1e-9)
    np.testing.assert_allclose(found.explained, [0.8, 0.2], rtol=1e-9)
    np.testing.assert_allclose(np.abs(found.loadings), np.sqrt(0.5), rtol=1e-9)


def test_duplicate_and_constant_columns_add_no_component() -> None:
    X = data()
    wide = np.hstack([X, X[:, :2], np.full((300, 1), 2.0)])
    found = principal_components(from_rows(QrFactor, wide, np.zeros((300, 1))))
    assert found.variances.shape == (6,)
    assert found.explained.sum() == pytest.approx(1.0)
    np.testing.assert_array_equal(found.loadings[8], 0.0)
    np.testing.assert_allclose(found.loadings.T @ found.loadings, np.eye(6), atol=1e-12)


def test_the_thesis_basis_has_eighteen_directions() -> None:
    # 21 functions with three pairs of identical columns.
    logs = [motion(1), motion(2)]
    functions = make_basis("thesis")
    X = np.concatenate([functions.of(log) for log in logs])
    found = principal_components(from_rows(CrossProducts, X, np.zeros((len(X), 1))))
    E = (X - X.mean(axis=0)) / X.std(axis=0, ddof=1)
    singular = np.linalg.svd(E, compute_uv=False)
    assert found.variances.shape == (18,)
    np.testing.assert_allclose(found.variances, singular[:18] ** 2 / (len(X) - 1), rtol=1e-8)


def test_refuses_what_has_no_direction() -> None:
    with pytest.raises(FerryIdError, match="Fix:"):
        principal_components(from_rows(CrossProducts, np.ones((50, 3)), np.zeros((50, 1))))
