"""SIMPLS (De Jong 1993, thesis Appendix A) on accumulated cross-products, every number of components in one pass.

The rows enter only through their cross-products, or through the triangle of their QR factorisation. The centred,
scaled basis is first turned into its principal axes, where X'X is diagonal: SIMPLS does not depend on such a rotation,
directions without any variance drop out (so that dependent columns get the minimum-norm solution), and products of
small numbers keep their digits. De Jong's recurrence is then followed literally, with one step added: each weight
vector is orthogonalised again in the metric of X'X, ``r -= R (P'r)`` - the same as ``t -= T (T't)`` on the scores,
because ``P = X'T`` and ``T = X R``. Without it the scores lose their orthogonality, and the coefficients their digits,
component by component.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ferryid.errors import FerryIdError
from ferryid.identify.cross_products import CrossProducts
from ferryid.identify.qr import QrFactor, standard_deviations

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Source = TypeVar("Source", CrossProducts, QrFactor)

EXHAUSTED = 1e-15
"""Stop when the deflated covariance S has fallen to this part of its first norm: what is left is rounding noise."""


@dataclass(frozen=True, eq=False)
class Simpls:
    """A SIMPLS fit for 1..A components. Outputs that may use the same terms are one group and share their factors.

    Attributes
    ----------
    n
        Number of rows fitted.
    coefficients
        For a = 1..A components, in the units of the data, shape (A, K, m). Past `extracted` the last solution is
        repeated: the least-squares solution of minimum norm in the scaled columns.
    intercepts
        Shape (A, m).
    mean_x, scale_x
        Subtracted from and divided into the columns, shape (K,); scale infinite for columns without variance.
    mean_y, scale_y
        The same for the outputs, shape (m,).
    groups
        Outputs fitted together, G tuples of output numbers.
    weights
        R of the scaled columns, ``T = X R``, shape (G, K, A); zero past `extracted`.
    loadings
        ``P = X'T``, shape (G, K, A).
    y_loadings
        ``Q = Y'T`` of the scaled outputs, zero outside the group, shape (G, m, A).
    extracted
        Number of components found in each group, G of them.
    rank
        Numerical rank of the scaled basis.
    explained_x
        Cumulative fraction of the scaled basis' variance, shape (A,), mean over the groups.
    explained_y
        Cumulative fraction of each output's variance, shape (A, m).
    """

    n: int
    coefficients: Floats
    intercepts: Floats
    mean_x: Floats
    scale_x: Floats
    mean_y: Floats
    scale_y: Floats
    groups: tuple[tuple[int, ...], ...]
    weights: Floats
    loadings: Floats
    y_loadings: Floats
    extracted: tuple[int, ...]
    rank: int
    explained_x: Floats
    explained_y: Floats

    def scores(self, X: Floats, group: int = 0) -> Floats:
        """Return scores T (n, A) of the rows of `X` (n, K); orthonormal over the rows fitted."""
        return np.asarray((X - self.mean_x) / self.scale_x @ self.weights[group])

    def leverages(self, X: Floats, components: int, group: int = 0) -> Floats:
        """Return ``diag(T T') + 1/n`` with the first `components` scores, shape (n,); Appendix A, line 24."""
        T = self.scores(X, group)[:, :components]
        return np.asarray(np.sum(T**2, axis=1) + 1.0 / self.n)

    def variances(self, group: int = 0) -> tuple[Floats, Floats]:
        """Return ``diag(P'P)/(n-1)`` and ``diag(Q'Q)/(n-1)``, shape (A,) each; Appendix A, lines 25-26."""
        degrees = max(self.n - 1, 1)
        P, Q = self.loadings[group], self.y_loadings[group]
        return np.sum(P**2, axis=0) / degrees, np.sum(Q**2, axis=0) / degrees

    def vip(self, components: int) -> Floats:
        """Variable importance in projection with the first `components`, shape (K,); the squares' mean is one.

        ``VIP_k² = K Σ_a |q_a|² (r_ka/|r_a|)² / Σ_a |q_a|²``, summed over the groups as well.
        """
        R, Q = self.weights[:, :, :components], self.y_loadings[:, :, :components]
        norms = np.sum(R**2, axis=1, keepdims=True)
        explained = np.sum(Q**2, axis=1, keepdims=True)
        whole = float(explained.sum())
        if whole == 0.0:
            return np.zeros(R.shape[1])
        share = R**2 / np.where(norms > 0.0, norms, 1.0) * explained
        return np.asarray(np.sqrt(R.shape[1] * share.sum(axis=(0, 2)) / whole))


def simpls(
    source: CrossProducts | QrFactor,
    components: int,
    *,
    scale: bool = True,
    scale_y: bool | None = None,
    allowed: Flags | None = None,
    where: str = "fit",
) -> Simpls:
    """Fit by SIMPLS with 1..`components` components.

    Parameters
    ----------
    source
        Cross-products or QR factor of the training rows.
    components
        A, the largest number of components.
    scale
        Divide every column by its standard deviation, because basis terms have different units. False: De Jong exactly.
    scale_y
        The same for the outputs, so that yaw [N·m] does not rule over surge and sway [N]; by default as `scale`.
    allowed
        Terms that each output may use, shape (K, m). Outputs with the same terms are fitted together, the others apart.
    where
        What is fitted, for messages.

    Raises
    ------
    FerryIdError
        When there are fewer than two rows, or `components` is less than one.

    References
    ----------
    De Jong (1993), Chemometrics and Intelligent Laboratory Systems 18, 251-263; thesis Appendix A.
    """
    if components < 1:
        raise FerryIdError(f"{where}: a fit needs at least one component, {components} asked. Fix: ask for 1 or more")
    if source.n < 2:
        raise FerryIdError(
            f"{where}: a fit needs at least two rows, found {source.n}. Fix: use a longer log or a wider time range"
        )
    K, m = source.K, source.m
    mean, squares = source.moments()
    deviation = standard_deviations(mean, squares, source.n)
    by_output = scale if scale_y is None else scale_y
    unit = np.where(np.isfinite(deviation), 1.0, np.inf)
    scales = np.concatenate([(deviation if scale else unit)[:K], (deviation if by_output else unit)[K:]])
    groups = group_outputs(allowed, K, m)

    coefficients = np.zeros((components, K, m))
    weights = np.zeros((len(groups), K, components))
    loadings = np.zeros_like(weights)
    y_loadings = np.zeros((len(groups), m, components))
    extracted, explained_x = [], np.zeros(components)
    for number, (columns, outputs) in enumerate(groups):
        columns = columns[np.isfinite(scales[columns])]
        outputs = outputs[np.isfinite(scales[K + outputs])]
        eigenvalues, axes, S = source.spectrum(columns, outputs, np.where(np.isfinite(scales), scales, 1.0))
        R, P, Q, found = extract(_diagonal(eigenvalues), S[None], components)
        extracted.append(int(found[0]))
        weights[number, columns] = axes @ R[0]
        loadings[number, columns] = axes @ P[0]
        y_loadings[number, outputs] = Q[0]
        steps = np.cumsum(R[0].T[:, :, None] * Q[0].T[:, None, :], axis=0)
        scaled = axes @ steps * scales[K + outputs] / scales[columns][:, None]
        coefficients[np.ix_(np.arange(components), columns, outputs)] = scaled
        if len(eigenvalues):
            explained_x += np.cumsum(np.sum(P[0] ** 2, axis=0)) / eigenvalues.sum() / len(groups)
    variance_y = squares[K:] / np.where(np.isfinite(scales[K:]), scales[K:], 1.0) ** 2
    explained_y = np.cumsum(np.sum(y_loadings**2, axis=0), axis=1).T
    everything = np.flatnonzero(np.isfinite(scales[:K]))
    rank = len(source.spectrum(everything, np.arange(0), np.where(np.isfinite(scales), scales, 1.0))[0])
    return Simpls(
        n=source.n,
        coefficients=coefficients,
        intercepts=mean[K:] - mean[:K] @ coefficients,
        mean_x=mean[:K],
        scale_x=scales[:K],
        mean_y=mean[K:],
        scale_y=scales[K:],
        groups=tuple(tuple(int(output) for output in outputs) for _, outputs in groups),
        weights=weights,
        loadings=loadings,
        y_loadings=y_loadings,
        extracted=tuple(extracted),
        rank=rank,
        explained_x=explained_x,
        explained_y=explained_y / np.where(variance_y > 0.0, variance_y, 1.0),
    )


def extract(
    gram: Callable[[Floats], Floats], S: Floats, components: int
) -> tuple[Floats, Floats, Floats, NDArray[np.int64]]:
    """De Jong's recurrence for B problems side by side.

    Parameters
    ----------
    gram
        Returns ``X'X r`` for r of shape (B, k).
    S
        Covariance ``X'Y``, shape (B, k, g).
    components
        A.

    Returns
    -------
    tuple
        R (B, k, A), P (B, k, A), Q (B, g, A) and the number of components found, shape (B,); the rest is zero.
    """
    B, k, g = S.shape
    R, P, V = np.zeros((B, components, k)), np.zeros((B, components, k)), np.zeros((B, components, k))
    Q = np.zeros((B, components, g))
    found = np.zeros(B, dtype=np.int64)
    first = S
    norm = np.sqrt(np.einsum("bkg,bkg->b", S, S))
    alive = norm > 0.0
    for a in range(min(components, k) if g else 0):
        alive = alive & (np.sqrt(np.einsum("bkg,bkg->b", S, S)) > EXHAUSTED * norm)
        if not alive.any():
            break
        r = _times(S, dominant(S.transpose(0, 2, 1) @ S))
        if a:
            # Scores orthogonal to the earlier ones: t - T (T't) = X (r - R (P'r)).
            r -= _combine(R[:, :a], _times(P[:, :a], r))
        p = gram(r)
        length = np.sqrt(np.maximum(np.einsum("bk,bk->b", r, p), 0.0))
        alive = alive & (length > 0.0)
        norm_t = np.where(alive, length, np.inf)[:, None]
        r, p = r / norm_t, p / norm_t
        v = p.copy()
        for _ in range(2 if a else 0):
            v -= _combine(V[:, :a], _times(V[:, :a], v))
        length = np.sqrt(np.einsum("bk,bk->b", v, v))
        v /= np.where(length > 0.0, length, np.inf)[:, None]
        S = S - v[:, :, None] * (v[:, None, :] @ S)
        R[:, a], P[:, a], V[:, a] = r, p, v
        Q[:, a] = (r[:, None, :] @ first)[:, 0]
        found += alive
    return R.transpose(0, 2, 1), P.transpose(0, 2, 1), Q.transpose(0, 2, 1), found


def dominant(M: Floats) -> Floats:
    """Unit eigenvector of the largest eigenvalue of each symmetric matrix, (B, g, g) to (B, g)."""
    if M.shape[-1] == 1:
        return np.ones(M.shape[:-1])
    return np.asarray(np.linalg.eigh(M)[1][:, :, -1])


def group_outputs(allowed: Flags | None, K: int, m: int) -> list[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Return (columns, outputs) of the outputs that may use the same columns."""
    if allowed is None:
        return [(np.arange(K), np.arange(m))]
    if allowed.shape != (K, m):
        raise ValueError(f"allowed has shape {allowed.shape}, expected {(K, m)}")
    patterns: dict[bytes, list[int]] = {}
    for output in range(m):
        patterns.setdefault(allowed[:, output].tobytes(), []).append(output)
    return [(np.flatnonzero(allowed[:, outputs[0]]), np.array(outputs)) for outputs in patterns.values()]


def sse(source: CrossProducts | QrFactor, coefficients: Floats, intercepts: Floats) -> Floats:
    """Sum of squared errors (A, m) over the rows of `source`, for coefficients (A, K, m) and intercepts (A, m)."""
    return source.sse(coefficients, intercepts)


def total(parts: Iterable[Source]) -> Source:
    """Sum of cross-products, or of QR factors; at least one."""
    return reduce(add, parts)


def training_sums(folds: Sequence[Source]) -> list[Source]:
    """For each fold the sum of all others, by running sums from both ends: nothing is subtracted, no digit cancels."""
    before, after = list(folds), list(folds)
    for i in range(1, len(folds)):
        before[i] = before[i - 1] + folds[i]
        after[-1 - i] = folds[-1 - i] + after[-i]
    last = len(folds) - 1
    sums = [after[1]]
    sums.extend(before[i - 1] + after[i + 1] for i in range(1, last))
    sums.append(before[last - 1])
    return sums


def sweep_components(
    folds: Sequence[Source],
    components: int,
    *,
    scale: bool = True,
    scale_y: bool | None = None,
    allowed: Flags | None = None,
    where: str = "fit",
) -> tuple[Floats, Floats]:
    """Cross-validated mean squared error for 1..A components, and its standard error over the folds, shape (A, m) each.

    Raises
    ------
    FerryIdError
        With fewer than two folds that hold rows.
    """
    folds = [fold for fold in folds if fold.n]
    if len(folds) < 2:
        raise FerryIdError(
            f"{where}: cross-validation needs two folds with rows, found {len(folds)}. "
            "Fix: use a longer log or fewer folds"
        )
    errors = []
    for fold, rest in zip(folds, training_sums(folds), strict=True):
        fit = simpls(rest, components, scale=scale, scale_y=scale_y, allowed=allowed, where=where)
        errors.append(fold.sse(fit.coefficients, fit.intercepts))
    squares = np.array(errors)
    rows = np.array([fold.n for fold in folds], dtype=float)
    mean = squares.sum(axis=0) / rows.sum()
    spread = np.std(squares / rows[:, None, None], axis=0, ddof=1) / np.sqrt(len(folds))
    return mean, spread


def one_standard_error(mse: Floats, standard_error: Floats) -> int:
    """Fewest components (1..A) whose error lies within one standard error of the best; Breiman et al. (1984), 3.4.3.

    Both arguments of shape (A, m); each output is divided by its own smallest error, so that all count alike.
    """
    best = mse.min(axis=0)
    unit = np.where(best > 0.0, best, 1.0)
    curve = (mse / unit).mean(axis=1)
    band = (standard_error / unit).mean(axis=1)
    lowest = int(np.argmin(curve))
    return int(np.argmax(curve <= curve[lowest] + band[lowest])) + 1


def _diagonal(eigenvalues: Floats) -> Callable[[Floats], Floats]:
    return lambda r: eigenvalues * r


def _times(matrix: Floats, vector: Floats) -> Floats:
    return np.asarray((matrix @ vector[:, :, None])[:, :, 0])


def _combine(rows: Floats, weights: Floats) -> Floats:
    return np.asarray((weights[:, None, :] @ rows)[:, 0])
