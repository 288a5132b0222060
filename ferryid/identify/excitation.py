"""What a log can and cannot determine: singular values, tied terms, ranges of motion and headings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ferryid.identify.outcome import Excitation
from ferryid.identify.thresholds import IDENTIFY
from ferryid.models import payload_kg, validity_ranges
from ferryid.regression import CrossProducts, QrFactor, singular_values, undetermined_terms
from ferryid.regression.bases import SWAY
from ferryid.signals.track import Motion
from ferryid.types import AXES, Flags, Floats
from ferryid.vessel.profile import Profile

SECTORS = 12


def assess_excitation(
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
    tied = undetermined_terms(source, terms, allowed)
    if allowed is not None:
        # A term that acts nowhere is not asked for.
        tied = {name: why for name, why in tied.items() if allowed[list(terms).index(name)].any()}
    return Excitation(
        singular_values=singular_values(source),
        ranges=validity_ranges(nu, nu_dot, payload),
        heading_coverage=heading_coverage(psi),
        undetermined=tied,
        vip=vip,
    )


def still_axes(profile: Profile, motions: Sequence[Motion]) -> tuple[int, ...]:
    """Return the axes on which the vessel hardly moves, so that noise alone would determine their coefficients.

    Velocities are compared as parts of the kinetic energy of the base model, in which metres and radians are alike.
    """
    nu = np.concatenate([motion.nu[motion.valid] for motion in motions])
    sizes = np.sqrt(np.diag(profile.hull.M) * np.mean(nu**2, axis=0))
    return tuple(np.flatnonzero(sizes < IDENTIFY.least_motion * np.linalg.norm(sizes)).tolist())


def still_warnings(profile: Profile, motions: Sequence[Motion]) -> list[str]:
    """Return which axes the logs do not excite, as sentences; not sway where it was not measured at all."""
    return [
        f"These logs do not excite {AXES[axis]}: the vessel hardly moves there, and the base model's coefficients are kept."
        for axis in still_axes(profile, motions)
        if axis != SWAY or all(motion.sway_measured for motion in motions)
    ]


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
    return float(np.mean(rows >= IDENTIFY.sector_share * total)) if total else float("nan")
