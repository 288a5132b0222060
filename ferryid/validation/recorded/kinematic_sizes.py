"""Sizes of sensors' errors that an oracle sees in kinematics: by the standard errors of the regressions of the checks."""

from __future__ import annotations

from math import inf

import numpy as np
from scipy.stats import norm

from ferryid.diagnose.checks.kinematics import kinematics
from ferryid.diagnose.checks.yaw_rate_scale import compared
from ferryid.effects.force_model import Measurements
from ferryid.validation.detection_curves import RELIABLE
from ferryid.validation.oracle_calibration import FALSE_SHARE

SIGMAS = float(norm.isf(0.5 * FALSE_SHARE) + norm.ppf(RELIABLE))
"""Standard errors that a parameter is off where an oracle names it 19 times in 20, and by chance in `FALSE_SHARE` of logs."""


def kinematic_size(measurements: Measurements, indices: tuple[int, ...], least: float) -> float:
    """Return the size that an oracle sees of parameters of the kinematics, at least what a check reports.

    Parameters
    ----------
    measurements
        Of the recording as it was.
    indices
        Places in `ferryid.diagnose.checks.kinematics`; of the components of a vector the larger error counts.
    least
        Below which a check reports nothing, in the unit of the parameters.
    """
    found = kinematics(measurements, indices)
    if found is None:
        return inf
    return max(SIGMAS * float(np.max(found.solution.errors[list(indices)])), least)


def rate_scale_size(measurements: Measurements, least: float) -> float:
    """Return the same of the scale of the yaw rate."""
    rates = compared(measurements)
    return inf if rates is None else max(SIGMAS * float(rates.solution.errors[0]), least)
