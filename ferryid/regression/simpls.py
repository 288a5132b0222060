"""SIMPLS (De Jong 1993, thesis Appendix A) on accumulated cross-products, every number of components in one pass.

The rows enter only through their cross-products, or through the triangle of their QR factorisation. The centred,
scaled basis is first turned into its principal axes, where X'X is diagonal: SIMPLS does not depend on such a rotation,
directions without any variance drop out (so that dependent columns get the minimum-norm solution), and products of
small numbers keep their digits. The recurrence itself stands in `ferryid.regression.recurrence`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ferryid.errors import FerryIdError
from ferryid.regression.cross_products import CrossProducts
from ferryid.regression.qr import QrFactor, standard_deviations
from ferryid.regression.recurrence import extract
from ferryid.types import Flags, Floats

Source = TypeVar("Source", CrossProducts, QrFactor)


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
        Numerical rank of the scaled columns that each group may use, G of them.
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
    rank: tuple[int, ...]
    explained_x: Floats
    explained_y: Floats

    def scores(self, X: Floats, group: int = 0) -> Floats:
        """Return scores T (n, A) of the rows of `X` (n, K); orthonormal over the rows fitted."""
        return np.asarray((X - self.mean_x) / self.scale_x @ self.weights[group])

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


def fit_simpls(
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
    return fit_simpls_many([source], components, scale=scale, scale_y=scale_y, allowed=allowed, where=where)[0]


def fit_simpls_many(
    sources: Sequence[CrossProducts | QrFactor],
    components: int,
    *,
    scale: bool = True,
    scale_y: bool | None = None,
    allowed: Flags | None = None,
    where: str = "fit",
) -> list[Simpls]:
    """Fit several sets of rows side by side, each exactly as `fit_simpls` does, which also lists the parameters."""
    if components < 1:
        raise FerryIdError(f"{where}: a fit needs at least one component, {components} asked. Fix: ask for 1 or more")
    fewest = min(source.n for source in sources)
    if fewest < 2:
        raise FerryIdError(
            f"{where}: a fit needs at least two rows, found {fewest}. Fix: use a longer log or a wider time range"
        )
    scales = [_scales(source, scale, scale if scale_y is None else scale_y) for source in sources]
    groups = group_outputs(allowed, sources[0].K, sources[0].m)
    solved = [_solve(sources, scales, columns, outputs, components) for columns, outputs in groups]
    names = tuple(tuple(outputs.tolist()) for _, outputs in groups)
    return [
        _assemble(source, scales[i], names, [group[i] for group in solved], components)
        for i, source in enumerate(sources)
    ]


@dataclass(frozen=True, eq=False)
class _Factors:
    """One group of outputs of one fit, in the principal axes of the scaled columns."""

    columns: NDArray[np.intp]
    outputs: NDArray[np.intp]
    eigenvalues: Floats
    axes: Floats
    R: Floats
    P: Floats
    Q: Floats
    found: int


def _scales(source: CrossProducts | QrFactor, by_column: bool, by_output: bool) -> Floats:
    """Divisor of every column, infinite where a column is constant."""
    deviation = standard_deviations(*source.moments(), source.n)
    unit = np.where(np.isfinite(deviation), 1.0, np.inf)
    K = source.K
    return np.concatenate([(deviation if by_column else unit)[:K], (deviation if by_output else unit)[K:]])


def _solve(
    sources: Sequence[CrossProducts | QrFactor],
    scales: Sequence[Floats],
    columns: NDArray[np.intp],
    outputs: NDArray[np.intp],
    components: int,
) -> list[_Factors]:
    spectra = []
    for source, divisor in zip(sources, scales, strict=True):
        usable = np.isfinite(divisor)
        some, targets = columns[usable[columns]], outputs[usable[source.K + outputs]]
        finite = np.where(usable, divisor, 1.0)
        spectra.append((some, targets, *source.spectrum(some, targets, finite)))
    # Side by side, shorter ones filled with zeros: a direction without variance stays zero.
    widest = max(len(spectrum[2]) for spectrum in spectra)
    eigenvalues = np.zeros((len(sources), widest))
    S = np.zeros((len(sources), widest, len(outputs)))
    for i, (_, targets, values, _, covariance) in enumerate(spectra):
        eigenvalues[i, : len(values)] = values
        S[i, : len(values), : len(targets)] = covariance
    R, P, Q, found = extract(lambda r: eigenvalues * r, S, components)
    return [
        _Factors(
            some, targets, values, axes, R[i, : len(values)], P[i, : len(values)], Q[i, : len(targets)], int(found[i])
        )
        for i, (some, targets, values, axes, _) in enumerate(spectra)
    ]


def _assemble(
    source: CrossProducts | QrFactor,
    scales: Floats,
    groups: tuple[tuple[int, ...], ...],
    solved: Sequence[_Factors],
    components: int,
) -> Simpls:
    K, m = source.K, source.m
    mean, squares = source.moments()
    coefficients = np.zeros((components, K, m))
    weights = np.zeros((len(solved), K, components))
    loadings = np.zeros_like(weights)
    y_loadings = np.zeros((len(solved), m, components))
    explained_x = np.zeros(components)
    for number, one in enumerate(solved):
        weights[number, one.columns] = one.axes @ one.R
        loadings[number, one.columns] = one.axes @ one.P
        y_loadings[number, one.outputs] = one.Q
        steps = np.cumsum(one.R.T[:, :, None] * one.Q.T[:, None, :], axis=0)
        units = scales[K + one.outputs] / scales[one.columns][:, None]
        coefficients[:, one.columns[:, None], one.outputs] = one.axes @ steps * units
        if len(one.eigenvalues):
            explained_x += np.cumsum(np.sum(one.P**2, axis=0)) / one.eigenvalues.sum() / len(solved)
    variance_y = np.where(np.isfinite(scales[K:]), squares[K:] / scales[K:] ** 2, 0.0)
    explained_y = np.cumsum(np.sum(y_loadings**2, axis=0), axis=1).T
    return Simpls(
        n=source.n,
        coefficients=coefficients,
        intercepts=mean[K:] - mean[:K] @ coefficients,
        mean_x=mean[:K],
        scale_x=scales[:K],
        mean_y=mean[K:],
        scale_y=scales[K:],
        groups=groups,
        weights=weights,
        loadings=loadings,
        y_loadings=y_loadings,
        extracted=tuple(one.found for one in solved),
        rank=tuple(len(one.eigenvalues) for one in solved),
        explained_x=explained_x,
        explained_y=explained_y / np.where(variance_y > 0.0, variance_y, 1.0),
    )


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
