"""How well the windows that a hypothesis was fitted to determine the hull in those that it is judged by.

Errors of the windows that are held out are predicted with the covariance ``S = I + N C N^T``, whitened: ``N`` are their
derivatives by the hull's coefficients, ``C`` what the others leave open of these. Where the vessel moves there as it does
nowhere else, a coefficient is what the profile says, and may be far off: errors within that speak neither for an effect nor
against it.

Reference
---------
Rasmussen and Williams (2006), section 5.4.2: the logarithm of the predictive probability of what is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ferryid.diagnose.inference.autoregression import ORDER
from ferryid.diagnose.inference.estimation import EstimationProblem
from ferryid.diagnose.inference.folds import Folds
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.types import Flags, Floats


@dataclass(frozen=True)
class HullUncertainty:
    """What the windows outside of a fold leave open of the hull in the fold.

    Attributes
    ----------
    rows
        Which of the whitened errors are the fold's, shape (w,).
    slopes
        Derivatives of these by the hull's coefficients, in their spreads, shape (n, 26).
    precision
        Of the coefficients, in their spreads, by what is believed of them and the other folds' windows, shape (26, 26).
    """

    rows: Flags
    slopes: Floats
    precision: Floats

    def move(self, white: Floats) -> Floats:
        """Return how far the hull has likely moved, in spreads, shape (26,), by whitened errors of all windows, shape (w,)."""
        return -self._beside(white[self.rows])

    def weighed(self, white: Floats) -> Floats:
        """Return the inverse of `S` times the fold's of whitened errors of all windows, shape (w,); shape (n,)."""
        own = white[self.rows]
        return np.asarray(own - self.slopes @ self._beside(own))

    def _beside(self, own: Floats) -> Floats:
        return np.asarray(np.linalg.solve(self.precision + self.slopes.T @ self.slopes, self.slopes.T @ own))


def hull_uncertainty(problem: EstimationProblem, folds: Folds) -> tuple[HullUncertainty, ...]:
    """Return how well the hull is known in each fold.

    Parameters
    ----------
    problem
        Its noise whitens the windows.
    folds
        From `ferryid.diagnose.inference.folds.folds_of`.
    """
    runs, channels = problem.windows.runs, int(problem.windows.channels.sum())
    whitened = np.concatenate([np.arange(first + ORDER, end) for first, end in runs if end - first > ORDER])
    slopes = problem.window_slopes
    made = []
    for k, training in enumerate(folds.training):
        rows = np.repeat(folds.fold[whitened] == k, channels)
        free, _, information = problem.part(training).origin.by_free_hull
        precision = np.eye(slopes.shape[1])
        precision[np.ix_(free, free)] += information
        made.append(HullUncertainty(rows, slopes[rows], precision / INFERENCE.posterior_factor**2))
    return tuple(made)
