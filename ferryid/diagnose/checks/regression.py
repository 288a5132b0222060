"""Regression with instruments, and errors that hold for autocorrelated residuals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from ferryid.diagnose.result import Estimate
from ferryid.vessel.profile import Floats

BLOCK_S = 30.0
"""Residuals further apart than this are taken as independent [s]."""
FALSE_ALARM = 1e-4
"""Probability at which a value that is not neutral counts as one, before the practical threshold."""


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
        value, reach = float(self.values[index]), float(student.ppf(0.975, self.freedom) * self.errors[index])
        low, high = sorted((scale * (value - reach), scale * (value + reach)))
        return Estimate(scale * value, low, high, unit)

    def certain(self, index: int, neutral: float = 0.0) -> bool:
        """Return whether a parameter is not neutral, beyond reasonable doubt."""
        score = abs(float(self.values[index]) - neutral) / max(float(self.errors[index]), 1e-300)
        return score > float(student.ppf(1.0 - 0.5 * FALSE_ALARM, self.freedom))


def step(Z: Floats, J: Floats, e: Floats, block: NDArray[np.int64], size: Floats, away: Floats) -> Solution | None:
    """Return the change p of the parameters for which ``e + J p`` has nothing of the instruments in it; None where there is too little data.

    Rows are summed up block by block, and the spread of these sums gives the errors, whatever the correlation within a block.

    Parameters
    ----------
    Z, J
        Instruments and derivatives, shape (m, q).
    e
        Residual, shape (m,).
    block
        Which block each row lies in, shape (m,).
    size
        How large a parameter can be thought to be, shape (q,): what the data do not tell stays within it.
    away
        How far the parameters are from their neutral values already, shape (q,).
    """
    _, block = np.unique(block, return_inverse=True)
    count, q = int(block.max(initial=-1)) + 1, J.shape[1]
    freedom = count - q
    if freedom < 3:
        return None
    Z, J = Z * size, J * size
    variance = max(float(e @ e) / len(e), 1e-18)
    inverse = np.linalg.inv(Z.T @ J + variance * np.eye(q))
    p = -inverse @ (Z.T @ e + variance * away / size)
    left = e + J @ p
    sums = np.zeros((count, q))
    np.add.at(sums, block, Z * left[:, None])
    covariance = inverse @ (sums.T @ sums * (count / freedom) + variance**2 * np.eye(q)) @ inverse.T
    return Solution(size * p, size * np.sqrt(np.diag(covariance)), freedom)
