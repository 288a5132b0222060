"""NIPALS PLS2 on the data matrix, the textbook way, to set beside SIMPLS in time and in covariance explained.

References
----------
Wold, Martens and Wold (1983), Lecture Notes in Mathematics 973, 286-293; Martens and Naes (1989), Multivariate
Calibration, 3.5; Geladi and Kowalski (1986), Analytica Chimica Acta 185, 1-17.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.regression.qr import standard_deviations
from ferryid.types import Floats

TOLERANCE = 1e-6
"""Usual limit on the squared change of a weight vector of length one."""
MOST_ITERATIONS = 500
_EXHAUSTED = 1e-15
"""Stop when X'Y has fallen to this part of its first norm: what is left is rounding noise, as in SIMPLS."""
_BLAS_ENTRIES = 9000
"""Entries in one BLAS call, few enough that it starts no threads: these slow such products down many times over when
other programs are busy, and a comparison in time would be one of schedulers."""


@dataclass(frozen=True, eq=False)
class Nipals:
    """A NIPALS fit for 1..A components; every output shares them.

    Attributes
    ----------
    n
        Number of rows fitted.
    coefficients, intercepts
        For a = 1..A components, in the units of the data, shape (A, K, m) and (A, m). Past `extracted` the last solution
        is repeated.
    mean_x, scale_x, mean_y, scale_y
        Subtracted from and divided into the columns; scale infinite for columns without variance.
    weights
        W of the deflated columns, of length one, the largest entry positive, shape (K, A); zero past `extracted`.
    loadings, y_loadings
        P (K, A) and C (m, A): ``X = T P' + E``, ``Y = T C' + F``.
    rotations
        ``R = W (P'W)^-1`` of the columns as they are, ``T = X R``, shape (K, A).
    iterations
        Rounds that each component took, shape (A,).
    converged
        False where `iterations` ran out.
    extracted
        Number of components found.
    explained_x, explained_y
        Cumulative fraction of the scaled basis' variance, shape (A,), and of each output's, shape (A, m).
    """

    n: int
    coefficients: Floats
    intercepts: Floats
    mean_x: Floats
    scale_x: Floats
    mean_y: Floats
    scale_y: Floats
    weights: Floats
    loadings: Floats
    y_loadings: Floats
    rotations: Floats
    iterations: NDArray[np.int64]
    converged: bool
    extracted: int
    explained_x: Floats
    explained_y: Floats

    def scores(self, X: Floats) -> Floats:
        """Return scores T (n, A) of the rows of `X` (n, K); orthogonal over the rows fitted."""
        return np.asarray((X - self.mean_x) / self.scale_x @ self.rotations)


def fit_nipals(
    X: Floats,
    Y: Floats,
    components: int,
    *,
    scale: bool = True,
    tolerance: float = TOLERANCE,
    most_iterations: int = MOST_ITERATIONS,
) -> Nipals:
    """Fit Y to X by NIPALS, every number of components up to `components`.

    Parameters
    ----------
    X
        Basis, shape (n, K). Unlike SIMPLS, NIPALS needs the whole matrix and copies it.
    Y
        Outputs, shape (n, m).
    components
        A.
    scale
        Divide columns and outputs by their standard deviation.
    tolerance
        A component is found when the square of its weight vector's change is below this.
    most_iterations
        Rounds after which a component is taken as it is; `Nipals.converged` says so.

    Raises
    ------
    FerryIdError
        Without two rows or one component, or for values that are not finite.
    """
    if components < 1:
        raise FerryIdError(f"NIPALS: a fit needs at least one component, {components} asked. Fix: ask for 1 or more")
    E, mean_x, scale_x = _standardised(X, scale)
    F, mean_y, scale_y = _standardised(Y, scale)
    if len(E) != len(F):
        raise FerryIdError(f"NIPALS: X has {counted(len(E), 'row')} and Y {len(F)}. Fix: pass the same rows")
    K, m = E.shape[1], F.shape[1]
    W, P, C = np.zeros((K, components)), np.zeros((K, components)), np.zeros((m, components))
    squares_x, squares_y = float(np.sum(E**2)), np.sum(F**2, axis=0)
    in_x, in_y = np.zeros(components), np.zeros((components, m))
    rounds = np.zeros(components, dtype=np.int64)
    limit = _EXHAUSTED * float(np.linalg.norm(_transposed(E, F)))
    converged, found = True, 0
    for a in range(min(components, K)):
        if not float(np.linalg.norm(_transposed(E, F))) > limit:
            break
        w, rounds[a], settled = _weight(E, F, tolerance, most_iterations)
        converged &= settled
        w *= np.sign(w[np.argmax(np.abs(w))])
        t = _times(E, w)
        length = float(np.sum(t**2))
        p, c = _transposed(E, t) / length, _transposed(F, t) / length
        E -= np.outer(t, p)
        F -= np.outer(t, c)
        W[:, a], P[:, a], C[:, a] = w, p, c
        in_x[a], in_y[a] = length * float(p @ p), length * c**2
        found = a + 1
    R = np.zeros((K, components))
    R[:, :found] = W[:, :found] @ np.linalg.inv(P[:, :found].T @ W[:, :found])
    steps = np.cumsum(R.T[:, :, None] * C.T[:, None, :], axis=0)
    coefficients = steps * np.where(np.isfinite(scale_y), scale_y, 0.0) / scale_x[:, None]
    return Nipals(
        n=len(E),
        coefficients=coefficients,
        intercepts=mean_y - mean_x @ coefficients,
        mean_x=mean_x,
        scale_x=scale_x,
        mean_y=mean_y,
        scale_y=scale_y,
        weights=W,
        loadings=P,
        y_loadings=C,
        rotations=R,
        iterations=rounds,
        converged=converged,
        extracted=found,
        explained_x=np.cumsum(in_x) / (squares_x or 1.0),
        explained_y=np.cumsum(in_y, axis=0) / np.where(squares_y > 0.0, squares_y, 1.0),
    )


def component_covariances(weights: Floats, X: Floats, Y: Floats, *, scale: bool = True) -> Floats:
    """Return what each component holds of the covariance of X and Y: ``|Y'X r| / |r| / (n - 1)``, shape (A,).

    This is what SIMPLS maximises with regard to the data as they are, and NIPALS with regard to what its earlier
    components left of them (De Jong 1993, section 4): the largest covariance of the scores ``X r``, `r` of length one,
    with any combination of outputs of length one.

    Parameters
    ----------
    weights
        Weights of the (scaled) columns as they are, shape (K, A): ``Simpls.weights[0]`` or ``Nipals.rotations``.
    X, Y
        Data, shape (n, K) and (n, m).
    scale
        Divide columns and outputs by their standard deviation, as the fit did.
    """
    S = _standardised(X, scale)[0].T @ _standardised(Y, scale)[0] / (len(X) - 1)
    norms = np.linalg.norm(weights, axis=0)
    return np.asarray(np.linalg.norm(S.T @ weights, axis=0) / np.where(norms > 0.0, norms, 1.0))


def _weight(E: Floats, F: Floats, tolerance: float, most: int) -> tuple[Floats, int, bool]:
    """Return the weight vector of the next component, the rounds it took, and whether it settled."""
    u = F[:, np.argmax(np.sum(F**2, axis=0))].copy()
    before = np.zeros(E.shape[1])
    for count in range(1, most + 1):
        w = _transposed(E, u)
        w /= np.linalg.norm(w)
        t = _times(E, w)
        c = _transposed(F, t) / np.sum(t**2)
        step = w - before
        if float(step @ step) < tolerance or F.shape[1] == 1:
            return w, count, True
        before = w
        u = _times(F, c) / (c @ c)
    return before, most, False


def _times(A: Floats, x: Floats) -> Floats:
    """Return ``A x``, shape (n,), in blocks of `_BLAS_ENTRIES`."""
    block = max(1, _BLAS_ENTRIES // A.shape[1])
    whole = len(A) // block * block
    product = np.empty(len(A))
    np.matmul(A[:whole].reshape(-1, block, A.shape[1]), x, out=product[:whole].reshape(-1, block))
    product[whole:] = A[whole:] @ x
    return product


def _transposed(A: Floats, B: Floats) -> Floats:
    """Return ``A'B`` for B of shape (n,) or (n, m), in blocks of `_BLAS_ENTRIES`."""
    columns = B.reshape(len(B), -1)
    block = max(1, _BLAS_ENTRIES // A.shape[1])
    whole = len(A) // block * block
    left = A[:whole].reshape(-1, block, A.shape[1]).transpose(0, 2, 1)
    product = np.matmul(left, columns[:whole].reshape(-1, block, columns.shape[1])).sum(axis=0)
    product += A[whole:].T @ columns[whole:]
    return np.asarray(product.reshape(A.shape[1], *B.shape[1:]))


def _standardised(values: Floats, scale: bool) -> tuple[Floats, Floats, Floats]:
    """Return the columns about their mean, divided by their scale, with both; constant columns become zero."""
    values = np.asarray(values, dtype=np.float64)
    if values.ndim != 2 or len(values) < 2 or not np.isfinite(values).all():
        raise FerryIdError(
            f"NIPALS: a fit needs two or more rows of finite values, found an array of shape {values.shape}. "
            "Fix: leave out rows without measurements"
        )
    mean = values.mean(axis=0)
    centred = values - mean
    deviation = standard_deviations(mean, np.sum(centred**2, axis=0), len(values))
    divisor = deviation if scale else np.where(np.isfinite(deviation), 1.0, np.inf)
    return centred / divisor, mean, divisor
