"""What a log can and cannot determine: singular values, tied terms, ranges of motion and headings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ferryid.identify.cross_products import CrossProducts
from ferryid.identify.outcome import Excitation
from ferryid.identify.qr import QrFactor, standard_deviations
from ferryid.signals.track import Motion

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

COLLINEAR = 100.0
"""Condition index from which on a direction counts as not determined.

Belsley, Kuh and Welsch (1980) call 30 strong and 100 severe.
"""
_SHARE = 0.5
"""A term belongs to a weak direction when this part of its coefficient's variance comes from it (Belsley et al.)."""
_SAME = 1e-10
"""Columns whose correlation lies this close to one are the same column."""
SECTORS = 12
_SECTOR_SHARE = 0.01
_QUANTILES = (0.005, 0.995)


def excitation(
    source: CrossProducts | QrFactor,
    terms: Sequence[str],
    vip: Floats,
    motions: Sequence[Motion],
    masks: Sequence[Flags],
    allowed: Flags | None = None,
) -> Excitation:
    """Say what the training rows excite.

    Parameters
    ----------
    source
        Cross-products or QR factor of the training rows.
    terms
        Names of the K basis terms.
    vip
        Variable importance of each term, shape (K,).
    motions, masks
        Motion of each log and its training rows.
    allowed
        Terms that each output may use, shape (K, m): terms tie one another only where both may be used.
    """
    nu = np.concatenate([motion.nu[mask] for motion, mask in zip(motions, masks, strict=True)])
    nu_dot = np.concatenate([motion.nu_dot[mask] for motion, mask in zip(motions, masks, strict=True)])
    psi = np.concatenate([motion.eta[mask, 2] for motion, mask in zip(motions, masks, strict=True)])
    payload = None
    if any(motion.payload is not None for motion in motions):
        payload = np.concatenate([payload_kg(motion, mask) for motion, mask in zip(motions, masks, strict=True)])
    return Excitation(
        singular_values=singular_values(source),
        ranges=ranges(nu, nu_dot, payload),
        heading_coverage=heading_coverage(psi),
        undetermined=undetermined(source, terms, allowed),
        vip=vip,
    )


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


def undetermined(
    source: CrossProducts | QrFactor, terms: Sequence[str], allowed: Flags | None = None, limit: float = COLLINEAR
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
        same = [i for i in keep if i < j and abs(correlation[i, j]) > 1.0 - _SAME]
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
    for i in np.flatnonzero((share >= _SHARE) & ~lost).tolist():
        direction = int(np.argmax(np.where(weak, within[i], 0.0)))
        part = np.abs(vectors[:, direction])
        others = ", ".join(terms[single[j]] for j in np.argsort(-part) if j != i and part[j] >= 0.2 * part.max())
        reasons.setdefault(int(single[i]), f"nearly a combination of {others} (condition index {index[direction]:.0f})")
    return reasons


RANGE_UNITS = {
    **dict.fromkeys(("u", "v", "U"), "m/s"),
    "r": "rad/s",
    **dict.fromkeys(("u_dot", "v_dot"), "m/s²"),
    "r_dot": "rad/s²",
    "payload_kg": "kg",
}


def ranges(nu: Floats, nu_dot: Floats, payload: Floats | None = None) -> dict[str, tuple[float, float]]:
    """0.5 % and 99.5 % quantiles of what `range_columns` gives."""
    found = {}
    for name, values in range_columns(nu, nu_dot, payload).items():
        low, high = np.quantile(values, _QUANTILES) if len(values) else (np.nan, np.nan)
        found[name] = (float(low), float(high))
    return found


def range_columns(nu: Floats, nu_dot: Floats, payload: Floats | None = None) -> dict[str, Floats]:
    """Return the columns that ranges of validity are given for: u, v, r, u_dot, v_dot, r_dot and the speed U, SI.

    The velocities and accelerations have the shape (n, 3). A payload [kg], shape (n,), has a range where it is known: its
    mass is, but not what the deeper draught does to damping and added mass.
    """
    return {
        **({} if payload is None else {"payload_kg": payload}),
        **{name: nu[:, i] for i, name in enumerate("uvr")},
        **{f"{name}_dot": nu_dot[:, i] for i, name in enumerate("uvr")},
        "U": np.hypot(nu[:, 0], nu[:, 1]),
    }


def payload_kg(motion: Motion, rows: Flags) -> Floats:
    """Return the payload on the marked rows [kg], none where the log does not measure it, shape (rows,)."""
    return np.zeros(int(rows.sum())) if motion.payload is None else motion.payload[rows, 0]


def heading_coverage(psi: Floats) -> float:
    """Fraction of twelve 30° sectors that hold at least 1 % of the headings `psi` (n,) [rad]; NaN without headings."""
    return sector_coverage(heading_sectors(psi))


def heading_sectors(psi: Floats) -> NDArray[np.int64]:
    """Return how many headings `psi` (n,) [rad] lie in each of twelve 30° sectors, shape (12,)."""
    sector = np.floor(psi[np.isfinite(psi)] / (2.0 * np.pi / SECTORS)).astype(np.int64) % SECTORS
    return np.bincount(sector, minlength=SECTORS)


def sector_coverage(rows: NDArray[np.int64]) -> float:
    """Return the fraction of sectors that hold at least 1 % of the rows, counted in each (12,); NaN without rows."""
    total = int(rows.sum())
    return float(np.mean(rows >= _SECTOR_SHARE * total)) if total else float("nan")


def _scales(source: CrossProducts | QrFactor) -> tuple[Floats, NDArray[np.intp]]:
    """Scale of every column (1 where constant), shape (K + m,), and the columns of the basis that vary."""
    deviation = standard_deviations(*source.moments(), source.n)
    varying = np.isfinite(deviation)
    return np.where(varying, deviation, 1.0), np.flatnonzero(varying[: source.K])
