"""A satellite receiver whose filter lags: what small vessels record, where no observer of inertial instruments is aboard.

It measures position, heading, velocity over ground and yaw rate, and passes all of them through one filter of first order, so
that what it reports is late and its errors are correlated from sample to sample.
"""

from __future__ import annotations

from math import exp, radians

import numpy as np
from scipy.signal import lfilter

from ferryid.types import Floats
from ferryid.validation.plant.navigation import RATE_HZ, slow_errors
from ferryid.validation.plant.trial import Trial, instrument_motion

FIX_M, DRIFT_M, DRIFT_S = 0.03, 0.05, 30.0
"""Errors of the position before the filter: of single samples, and slow ones with their time constant."""
SPEED_MPS, SPEED_DRIFT_MPS, SPEED_DRIFT_S = 0.08, 0.01, 20.0
HEADING_DEG, HEADING_DRIFT_DEG, HEADING_DRIFT_S = 0.6, 0.4, 25.0
RATE_DEGPS, RATE_DRIFT_DEGPS, RATE_DRIFT_S = 0.6, 0.02, 200.0


def received(trial: Trial, rng: np.random.Generator, lag_s: float, factor: float) -> Floats:
    """Return what the receiver reports of a trial, with the errors of the navigation that its plant has.

    Parameters
    ----------
    trial
        From `ferryid.validation.plant.trial.simulate_trial`.
    rng
        Of its errors.
    lag_s
        Time constant of its filter [s].
    factor
        On its usual errors.

    Returns
    -------
    Floats
        North, east [m], heading [rad], surge, sway [m/s] and yaw rate [rad/s], shape (n, 6).
    """
    pose, rates = instrument_motion(trial.states)
    n, deg = len(pose), radians(1.0)
    position = pose[:, :2] + factor * _errors(rng, n, 2, FIX_M, DRIFT_M, DRIFT_S)
    velocity = rates[:, :2] + factor * _errors(rng, n, 2, SPEED_MPS, SPEED_DRIFT_MPS, SPEED_DRIFT_S)
    heading = pose[:, 2:] + factor * deg * _errors(rng, n, 1, HEADING_DEG, HEADING_DRIFT_DEG, HEADING_DRIFT_S)
    turn = rates[:, 2:] + factor * deg * _errors(rng, n, 1, RATE_DEGPS, RATE_DRIFT_DEGPS, RATE_DRIFT_S)
    found = _filtered(np.hstack([position, heading, velocity, turn]), lag_s)
    c, s = np.cos(found[:, 2]), np.sin(found[:, 2])
    north, east = found[:, 3].copy(), found[:, 4].copy()
    found[:, 3], found[:, 4] = c * north + s * east, c * east - s * north
    for row in found if trial.plant.reports else ():
        for report in trial.plant.reports:
            report(row)
    return found


def _errors(rng: np.random.Generator, samples: int, columns: int, white: float, slow: float, time_s: float) -> Floats:
    """Return white errors and slow ones, each of its standard deviation, shape (samples, columns)."""
    return white * rng.standard_normal((samples, columns)) + slow_errors(rng, samples, columns, slow, time_s)


def _filtered(values: Floats, lag_s: float) -> Floats:
    """Return a filter of first order that has settled at the first row, shape (n, k)."""
    gain = 1.0 - exp(-1.0 / (RATE_HZ * lag_s))
    start = (1.0 - gain) * values[:1]
    return np.asarray(lfilter([gain], [1.0, gain - 1.0], values, axis=0, zi=start)[0])
