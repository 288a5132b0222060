"""Regression with instruments, and errors that hold for correlated residuals.

Nothing is whitened: vessels move slowly, whitening would weigh the fast rest, in which positions are noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.diagnose.data.estimate import Estimate
from ferryid.types import Floats


@dataclass(frozen=True)
class Solution:
    """Solved parameters.

    Attributes
    ----------
    values, errors
        Parameters and their standard errors, shape (q,).
    freedom
        Degrees of freedom of the errors.
    """

    values: Floats
    errors: Floats
    freedom: int

    def estimate(self, index: int, unit: str, scale: float = 1.0) -> Estimate:
        """Return a parameter with its 95 % interval, multiplied by `scale`."""
        value, reach = float(self.values[index]), float(stdtrit(self.freedom, 0.975) * self.errors[index])
        low, high = sorted((scale * (value - reach), scale * (value + reach)))
        return Estimate(scale * value, low, high, unit)

    def score(self, index: int, neutral: float = 0.0) -> float:
        """Return how many standard errors a parameter is off its neutral value."""
        return abs(float(self.values[index]) - neutral) / max(float(self.errors[index]), 1e-300)

    def certain(self, index: int, neutral: float = 0.0) -> bool:
        """Return whether a parameter is not neutral, beyond reasonable doubt."""
        return self.score(index, neutral) > float(stdtrit(self.freedom, 1.0 - 0.5 * CHECKS.false_alarm))


def scatter(parts: Sequence[Solution | None], index: int) -> float:
    """Return by what an error of a parameter is too small where parts of a log disagree about it more than theirs allow.

    It is Birge's ratio (1932, Physical Review 40): the root of chi-squared over its degrees of freedom, at least one. A factor
    of an instrument is the same throughout; what resembles one, as a filter of a receiver that takes more from fast motions,
    is not. Errors of few degrees of freedom scatter by themselves, which is taken off.
    """
    known = [one for one in parts if one is not None and one.freedom >= CHECKS.part_freedom]
    if len(known) < 2:
        return 1.0
    values = np.array([one.values[index] for one in known])
    weights = np.array([(one.freedom - 2.0) / one.freedom * one.errors[index] ** -2.0 for one in known])
    mean = float(weights @ values / weights.sum())
    excess = float(weights @ (values - mean) ** 2) / (len(known) - 1)
    return sqrt(max(excess, 1.0))


def independence(place: NDArray[np.int64]) -> tuple[int, float]:
    """Return how far apart residuals of a log are taken as independent, and by what errors are too small for it.

    Residuals of a long log are, `CHECKS.independent_strides` apart. A short log would have too few such blocks to know an
    error by; its blocks are shorter, and its errors larger by what longer blocks usually add.

    Parameters
    ----------
    place
        Number of each window, in strides from the start, ascending, shape (m,).
    """
    fits = int(place[-1] - place[0] + 1) // CHECKS.fewest_blocks
    strides = min(max(fits, CHECKS.overlapping_strides), CHECKS.independent_strides)
    return strides, float((CHECKS.independent_strides / strides) ** CHECKS.error_growth)


def step(
    Z: Floats,
    J: Floats,
    e: Floats,
    place: NDArray[np.int64],
    size: Floats,
    away: Floats,
    independent: int = CHECKS.independent_strides,
    growth: float = 1.0,
) -> Solution | None:
    """Return the change p for which ``e + J p`` has nothing of the instruments in it; None where there is too little data.

    The errors are the larger of two: from sums over blocks, which hold whatever the noise is like but trust a few strong
    blocks too much, and from the residual's autocovariance, as if the noise were the same throughout.

    Parameters
    ----------
    Z, J
        Instruments and derivatives in c channels, shape (m, c, q).
    e
        Residual, shape (m, c).
    place
        Number of each window, in strides from the start, ascending, shape (m,).
    size
        How large a parameter can be thought to be, shape (q,): what the data do not tell stays within it.
    away
        How far the parameters are from their neutral values already, shape (q,).
    independent
        Residuals so many strides apart are taken as independent.
    growth
        Factor on the errors.
    """
    block = np.unique(place // independent, return_inverse=True)[1]
    count, (m, c, q) = int(block.max(initial=-1)) + 1, J.shape
    # Of c values in a block, all parameters together take q / c blocks.
    freedom = count + -q // c
    if freedom < 3:
        return None
    Z, J = Z * size, J * size
    flat = Z.reshape(m * c, q)
    variance = max(float(np.mean(e**2)), 1e-18)
    inverse = np.linalg.inv(flat.T @ J.reshape(m * c, q) + variance * np.eye(q))
    p = -inverse @ (flat.T @ e.ravel() + variance * away / size)
    left = e + J @ p
    variance = float(np.mean(left**2))
    sums = np.zeros((count, q))
    np.add.at(sums, block, np.einsum("ncq,nc->nq", Z, left))
    whole = np.arange(place[-1] - place[0] + 1)
    row = place - place[0]
    all_Z, all_left, known = np.zeros((len(whole), c, q)), np.zeros((len(whole), c)), np.zeros(len(whole))
    all_Z[row], all_left[row], known[row] = Z, left, 1.0
    even = np.zeros((q, q))
    for lag in range(min(independent, len(whole) - 1)):
        pairs = c * float(known[lag:] @ known[: len(whole) - lag])
        if pairs == 0.0:
            continue
        covariance = float(np.sum(all_left[lag:] * all_left[: len(whole) - lag])) / pairs * (1.0 - lag / independent)
        product = np.einsum("ncq,ncp->qp", all_Z[lag:], all_Z[: len(whole) - lag])
        even += covariance * (product if lag == 0 else product + product.T)
    prior = variance**2 * np.eye(q)
    spreads = [np.diag(inverse @ (middle * (count / freedom) + prior) @ inverse.T) for middle in (sums.T @ sums, even)]
    return Solution(size * p, growth * size * np.sqrt(np.maximum(*spreads)), freedom)
