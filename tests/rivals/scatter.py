"""How far the ratio of two methods' errors may be due to chance: free runs drawn again, in blocks of runs that overlap."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ferryid.types import Floats

BLOCK = 10
"""Free runs that follow each other and are drawn together: they begin seconds apart and last a minute, so that they overlap."""
FEWEST = 2 * BLOCK
"""Runs from which on the ratio has an interval."""
DRAWS = 2000


class Ratio(NamedTuple):
    """Ratio of median errors, and the ends of its 95 % interval."""

    value: float
    low: float
    high: float

    @property
    def text(self) -> str:
        """The ratio and its interval, where there is one; a ratio to runs that diverged is 0."""
        return (
            f"{self.value:.2f} ({self.low:.2f} to {self.high:.2f})"
            if self.low <= self.high
            else f"{self.value:.2f} (few runs)"
        )


def ratio_of_medians(ours: Floats, theirs: Floats) -> Ratio:
    """Return the ratio of the median errors of the same free runs, with its interval by a block bootstrap (Künsch 1989).

    Parameters
    ----------
    ours, theirs
        Errors of every run, infinite where it diverged, NaN where the recording ended before, shape (runs,) each.
    """
    known = ~(np.isnan(ours) | np.isnan(theirs))
    ours, theirs = ours[known], theirs[known]
    n = len(ours)
    if n < FEWEST:
        return Ratio(float(_over(np.median(ours), np.median(theirs))) if n else np.nan, np.nan, np.nan)
    begins = np.random.default_rng(0).integers(0, n, (DRAWS, -(-n // BLOCK)))
    rows = ((begins[:, :, None] + np.arange(BLOCK)) % n).reshape(DRAWS, -1)[:, :n]
    drawn = _over(np.median(ours[rows], axis=1), np.median(theirs[rows], axis=1))
    low, high = np.quantile(drawn, [0.025, 0.975], method="nearest")
    return Ratio(float(_over(np.median(ours), np.median(theirs))), float(low), float(high))


def _over(ours: Floats, theirs: Floats) -> Floats:
    """Return ratios: 0 to a median that diverged, which is infinitely worse."""
    with np.errstate(invalid="ignore"):
        return np.where(np.isinf(theirs), 0.0, np.asarray(ours) / theirs)
