"""Axes on which the velocity's noise drowns the motion.

Damping is taken at the measured velocity. Where a vessel is as quick as its controller and hardly moves, the noise of the
velocity, times damping, is no longer small against the thrust. Regressors that are noise bias what is fitted to them, and a
controller that answers this noise makes it look like a change of mass, delay or thrust (Fuller 1987, Measurement error models).
"""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

import numpy as np

from ferryid.diagnose.inference.estimation import EstimationProblem
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects.force_model import acceleration
from ferryid.signals.complementary_filter import velocity_from_pose
from ferryid.signals.smooth import odd_rows, steady_mean
from ferryid.types import AXES


def velocity_noise_shares(problem: EstimationProblem) -> dict[str, float]:
    """Return how large the velocity's noise is, times damping, against what moves the vessel, on axes with thrust.

    Nothing is known of it without positions.

    The noise is that between two velocities: the one in use, and the slope of positions. It is shared between them evenly.
    """
    windows, plain = problem.windows, problem.plain
    measurements = windows.measurements
    rows = odd_rows(JUDGING.noise_mean_s, 1.0 / measurements.step_s)
    if not windows.channels[0] or len(measurements.t) < rows:
        return {}
    # Motion that is faster than the mean is left out of both.
    own = steady_mean(measurements.nu, rows)
    other = steady_mean(np.nan_to_num(velocity_from_pose(measurements.eta, 1.0 / measurements.step_s)), rows)
    here, there = (acceleration(replace(plain, measurements=replace(measurements, nu=nu))) for nu in (own, other))
    idle = acceleration(replace(plain, parts=np.zeros_like(plain.parts)))
    noise = np.std(windows.mean(here - there), axis=0) / sqrt(2.0)
    thrust = np.std(windows.mean(here - idle), axis=0)
    moved = np.maximum(thrust, np.std(windows.mean(here), axis=0))
    # Where nothing pushes, noise is not taken for what a push does.
    return {axis: float(noise[j] / moved[j]) for j, axis in enumerate(AXES) if thrust[j] > 0.0}
