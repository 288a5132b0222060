"""Which logs come from a simulator and not from a vessel: by `artificial`, or since nothing in them is noisy.

A solution of equations of motion has no noise between pose and velocity.
"""

from __future__ import annotations

import numpy as np

from ferryid.diagnose.data.thresholds import DATA
from ferryid.effects.force_model import Measurements
from ferryid.signals.artificial import VELOCITIES, artificial
from ferryid.signals.stream import Recording
from ferryid.types import Floats


def simulated(recording: Recording, measurements: Measurements) -> str:
    """Return what shows that a log is a simulator's, as the end of a sentence; empty where nothing does."""
    if why := artificial(recording):
        return why
    measured = any(all(name in recording.found for name in pair) for pair in VELOCITIES)
    if not (measured and "r" in recording.found):
        # Velocities that are derived from the positions agree with them.
        return ""
    noise = relative_noise(measurements)
    if bool((noise < DATA.no_noise).all()):
        return (
            "its positions, headings and velocities have no noise: they agree to "
            f"{float(noise.max()):.1g} of the velocities' standard deviation"
        )
    return ""


def relative_noise(measurements: Measurements) -> Floats:
    """Return by how much steps of the pose differ from the integral of the velocity: north, east, heading, shape (3,).

    Root mean square, over a step at the velocity's standard deviation; infinite where there is no pose or no motion. The
    velocity is integrated by Hermite's formula, which is exact to the fourth order of the step.
    """
    good, dt = measurements.usable, measurements.step_s
    cos, sin = np.cos(measurements.psi), np.sin(measurements.psi)
    u, v, r = measurements.nu_raw.T
    velocity = np.column_stack([cos * u - sin * v, sin * u + cos * v, r])
    pose = np.column_stack([measurements.eta[:, :2], np.unwrap(measurements.psi)])
    change = np.gradient(velocity, dt, axis=0)
    steps = 0.5 * dt * (velocity[1:] + velocity[:-1]) - dt**2 / 12.0 * (change[1:] - change[:-1])
    both = good[1:] & good[:-1]
    if np.count_nonzero(both) < 2:
        return np.full(3, np.inf)
    left = np.sqrt(np.mean((np.diff(pose, axis=0) - steps)[both] ** 2, axis=0))
    moves = dt * np.std(velocity[good], axis=0)
    return np.where(np.isfinite(left) & (moves > 0.0), left / np.where(moves > 0.0, moves, 1.0), np.inf)
