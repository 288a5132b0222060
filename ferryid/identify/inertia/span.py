"""Between which inertias the truth lies: that of acceleration over force, and that of force over acceleration.

The weak form explains acceleration by force and velocity. What acts beside the modelled forces moves the vessel, so that the
velocity goes with it; where damping balances the force within the windows, hardly any acceleration is left, and the estimate
makes force and damping together small beside the inertia: it is too large. Explained the other way round, force by
acceleration, it is too small. Of errors that neither force nor acceleration has alone, the truth lies between (Frisch 1934).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ferryid.models.forces import ACCELERATIONS
from ferryid.regression import CrossProducts
from ferryid.types import Flags, Floats


def inertia_spans(sums: CrossProducts, terms: Sequence[str], mask: Flags, mass: Floats) -> Floats:
    """Return the lower and upper inertia of each axis, shape (3, 2); NaN where force and acceleration do not go together.

    Parameters
    ----------
    sums
        Functions and target of the weak form; see `ferryid.identify.weak_rows`.
    terms, mask
        Names of the functions, and on which axes they are, shape (K, 3).
    mass
        The base model's mass matrix, shape (3, 3).
    """
    out = np.full((3, 2), np.nan)
    Sxx, Sxy, Syy = sums.centred()[:3]
    for axis, name in enumerate(ACCELERATIONS):
        if name not in terms or not mask[own := terms.index(name), axis]:
            continue
        others = np.flatnonzero(mask[:, axis] & (np.arange(len(terms)) != own))
        # Force left to accelerate, and the base model's mass times acceleration: the former less the target.
        covered = np.column_stack([Sxx[others, own], Sxx[others, own] - Sxy[others, axis]])
        across = Sxx[own, own] - Sxy[own, axis]
        squares = np.array([[Sxx[own, own], across], [across, across - Sxy[own, axis] + Syy[axis, axis]]])
        left = squares - covered.T @ np.linalg.pinv(Sxx[np.ix_(others, others)], hermitian=True) @ covered
        if left[0, 1] > 0.0 and left[0, 0] > 0.0 and left[1, 1] > 0.0:
            out[axis] = mass[axis, axis] * np.array([left[0, 1] / left[1, 1], left[0, 0] / left[0, 1]])
    return out
