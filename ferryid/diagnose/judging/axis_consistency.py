"""Whether an effect is of one size on all axes: its own geometry ties them, and what only looks like it on one is torn.

About the fit, what the effect does on each axis may grow or shrink by a share of its own, beside the hull and all other
parameters. A thruster that lies elsewhere than the profile has it seems too weak in yaw, say, but not ahead.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ferryid.diagnose.inference.estimation import EstimationProblem, Fit, fitted_force_model
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.sparse_regression import nuisance_columns
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.types import Floats


@dataclass(frozen=True)
class AxisConsistency:
    """What is there of an effect on each axis, less one, with standard errors, shape (c,), and on which axes it acts."""

    beyond: Floats
    errors: Floats
    acts: Floats

    @property
    def inconsistent(self) -> bool:
        """Whether most of it is missing on an axis where it acts."""
        missing = -self.beyond
        return bool(
            np.any(
                (self.acts > JUDGING.acting_share)
                & (missing > JUDGING.missing_share)
                & (missing - JUDGING.missing_errors * self.errors > 0.0)
            )
        )


def check_axis_consistency(problem: EstimationProblem, kept: Fit, index: int) -> AxisConsistency:
    """Return how an effect's axes hang together.

    Parameters
    ----------
    problem
        With the noise that the fit leaves.
    kept
        Hull and effects.
    index
        Which effect.
    """
    windows, runs = problem.windows, problem.windows.runs
    neutral = np.array([one.neutral for one in kept.candidates[index].parameters])
    idle = replace(kept, values=(*kept.values[:index], neutral, *kept.values[index + 1 :]))
    here = windows.gap(fitted_force_model(problem.plain, kept))
    does = here - windows.gap(fitted_force_model(problem.plain, idle))
    c = does.shape[1]
    known, centre = nuisance_columns(problem, kept, but=index)
    columns = problem.noise.white(does[:, :, None] * np.eye(c), runs)
    work = np.sum(columns**2, axis=0)
    A = np.concatenate([problem.noise.white(known, runs), columns], axis=1)
    # Hull and parameters are believed to lie about their usual values, the shares about one whole.
    bend = A.T @ A + np.eye(A.shape[1])
    slope = A.T @ problem.noise.white(here, runs) + np.concatenate([centre, np.zeros(c)])
    covariance = np.linalg.inv(bend)
    errors = INFERENCE.posterior_factor * np.sqrt(np.diag(covariance))[-c:]
    return AxisConsistency(-(covariance @ slope)[-c:], errors, work / max(float(work.sum()), 1e-12))
