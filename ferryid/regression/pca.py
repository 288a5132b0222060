"""Principal components of the basis: how many directions a log's motion really has; thesis 2.3.2."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.regression.cross_products import CrossProducts
from ferryid.regression.qr import QrFactor, standard_deviations
from ferryid.types import Floats


@dataclass(frozen=True, eq=False)
class Pca:
    """Principal components of K centred columns, r of them: as many as the columns have rank.

    Attributes
    ----------
    n
        Number of rows.
    variances
        Of the scores, descending, n - 1 in the denominator, shape (r,).
    explained
        Fraction of all variance in each component, shape (r,); they sum to one.
    loadings
        P, orthonormal columns, the largest entry of each positive, shape (K, r).
    mean, scale
        Subtracted from and divided into the columns, shape (K,); scale infinite for columns without variance.
    """

    n: int
    variances: Floats
    explained: Floats
    loadings: Floats
    mean: Floats
    scale: Floats

    def scores(self, X: Floats) -> Floats:
        """Return the scores T (n, r) of the rows of `X` (n, K)."""
        return np.asarray((X - self.mean) / self.scale @ self.loadings)


def principal_components(source: CrossProducts | QrFactor, *, standardise: bool = True) -> Pca:
    """Principal components of the columns whose cross-products or QR factor are given.

    Parameters
    ----------
    source
        Of all rows; its outputs play no part.
    standardise
        Divide every column by its standard deviation, so that units do not decide; else columns are centred only.

    Raises
    ------
    FerryIdError
        Where fewer than two rows are given or no column varies.
    """
    K = source.K
    mean, squares = source.moments()
    deviation = standard_deviations(mean, squares, source.n)
    varying = np.isfinite(deviation)
    columns = np.flatnonzero(varying[:K])
    if source.n < 2 or not len(columns):
        raise FerryIdError(
            f"PCA: two or more rows and a column that varies are needed, found {counted(source.n, 'row')} and "
            f"{counted(len(columns), 'such column')}. Fix: use a longer log, or one in which the vessel moves"
        )
    divisor = deviation if standardise else np.where(varying, 1.0, np.inf)
    eigenvalues, vectors, _ = source.spectrum(columns, np.arange(0), np.where(varying, divisor, 1.0))
    signs = np.sign(vectors[np.argmax(np.abs(vectors), axis=0), np.arange(len(eigenvalues))])
    loadings = np.zeros((K, len(eigenvalues)))
    loadings[columns] = vectors * signs
    return Pca(
        n=source.n,
        variances=eigenvalues / (source.n - 1),
        explained=eigenvalues / eigenvalues.sum(),
        loadings=loadings,
        mean=mean[:K],
        scale=divisor[:K],
    )
