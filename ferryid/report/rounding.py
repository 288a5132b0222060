"""Coefficients that are nothing but rounding."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ferryid.effects.force_model import MASS
from ferryid.types import Floats

ROUNDINGS = 16.0 * float(np.finfo(np.float64).eps)
"""Beside the largest of its kind, what some sums and products leave of a coefficient that is none."""


def without_rounding(values: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return coefficients to be shown, with zero for what is nothing but rounding: beside the mass matrix, or all the rest.

    Parameters
    ----------
    values
        Value, low and high of each by its name, shape (3,); NaN where there is no interval.
    """
    shown: dict[str, Floats] = {}
    for part in (set(MASS), set(values) - set(MASS)):
        sizes = np.array([abs(float(values[name][0])) for name in values if name in part])
        least = ROUNDINGS * np.max(sizes, initial=0.0, where=np.isfinite(sizes))
        shown |= {name: np.where(np.abs(one) <= least, 0.0, one) for name, one in values.items() if name in part}
    return shown
