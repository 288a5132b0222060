"""Which regressors the rows determine: singular values of the basis, and terms that are tied to one another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ferryid.regression.cross_products import CrossProducts
from ferryid.regression.qr import QrFactor, standard_deviations
from ferryid.regression.thresholds import REGRESSION
from ferryid.types import Flags, Floats


def singular_values(source: CrossProducts | QrFactor) -> Floats:
    """Singular values of the standardised basis over sqrt(n - 1), descending, shape (K,).

    They are the square roots of the correlation matrix' eigenvalues: all one for terms without any correlation, zero
    for every direction that the rows do not excite at all.
    """
    scales, columns = _scales(source)
    eigenvalues = source.spectrum(columns, np.arange(0), scales)[0]
    values = np.zeros(source.K)
    values[: len(eigenvalues)] = np.sqrt(eigenvalues / max(source.n - 1, 1))
    return values


def undetermined_terms(
    source: CrossProducts | QrFactor,
    terms: Sequence[str],
    allowed: Flags | None = None,
    limit: float = REGRESSION.condition_index,
) -> Mapping[str, str]:
    """Name the terms whose coefficients the rows cannot determine, and why.

    A term is named when it is constant, when it is the same column as another, or when at least half of its
    coefficient's variance comes from directions with a condition index of `limit` or more (Belsley, Kuh and Welsch
    1980, chapter 3); the terms that share the direction are given with it.

    Parameters
    ----------
    source
        Cross-products or QR factor of the rows.
    terms
        Names of the K terms.
    allowed
        Terms that each output may use, shape (K, m); None: all.
    limit
        Condition index.

    Returns
    -------
    Mapping
        Term to reason, in the order of `terms`.
    """
    reasons: dict[int, str] = {}
    scales, varying = _scales(source)
    for k in sorted(set(range(source.K)) - set(varying.tolist())):
        reasons[k] = "does not vary in this log"
    patterns = [varying]
    if allowed is not None:
        patterns = [varying[allowed[varying, output]] for output in range(allowed.shape[1])]
    for columns in patterns:
        for k, reason in _tied(source, columns, scales, terms, limit).items():
            reasons.setdefault(k, reason)
    return {terms[k]: reasons[k] for k in sorted(reasons)}


def _tied(
    source: CrossProducts | QrFactor, columns: NDArray[np.intp], scales: Floats, terms: Sequence[str], limit: float
) -> dict[int, str]:
    eigenvalues, vectors, _ = source.spectrum(columns, np.arange(0), scales)
    if not len(eigenvalues):
        return {}
    reasons: dict[int, str] = {}
    correlation = (vectors * eigenvalues) @ vectors.T
    norm = np.sqrt(np.diag(correlation))
    correlation = correlation / np.outer(norm, norm)
    keep = list(range(len(columns)))
    for j in range(len(columns)):
        same = [i for i in keep if i < j and abs(correlation[i, j]) > 1.0 - REGRESSION.same_column]
        if same:
            i = same[0]
            sign = "" if correlation[i, j] > 0.0 else "minus "
            reasons[int(columns[j])] = f"same column as {sign}{terms[columns[i]]} in this log"
            reasons.setdefault(int(columns[i]), f"same column as {sign}{terms[columns[j]]} in this log")
            keep.remove(j)
    single = columns[keep]
    eigenvalues, vectors, _ = source.spectrum(single, np.arange(0), scales)
    # Directions below the noise are not returned: complete them as the part of each unit vector that is left over.
    index = np.sqrt(eigenvalues[0] / eigenvalues)
    within = vectors**2 / eigenvalues
    missing = 1.0 - np.sum(vectors**2, axis=1)
    lost = missing > 1e-6
    dependent = np.flatnonzero(lost).tolist()
    for i in dependent:
        others = ", ".join(terms[single[j]] for j in dependent if j != i)
        reasons.setdefault(int(single[i]), f"linear combination of {others} in this log")
    weak = index >= limit
    share = within[:, weak].sum(axis=1) / within.sum(axis=1)
    for i in np.flatnonzero((share >= REGRESSION.variance_share) & ~lost).tolist():
        direction = int(np.argmax(np.where(weak, within[i], 0.0)))
        part = np.abs(vectors[:, direction])
        others = ", ".join(terms[single[j]] for j in np.argsort(-part) if j != i and part[j] >= 0.2 * part.max())
        reasons.setdefault(int(single[i]), f"nearly a combination of {others} (condition index {index[direction]:.0f})")
    return reasons


def _scales(source: CrossProducts | QrFactor) -> tuple[Floats, NDArray[np.intp]]:
    """Scale of every column (1 where constant), shape (K + m,), and the columns of the basis that vary."""
    deviation = standard_deviations(*source.moments(), source.n)
    varying = np.isfinite(deviation)
    return np.where(varying, deviation, 1.0), np.flatnonzero(varying[: source.K])
