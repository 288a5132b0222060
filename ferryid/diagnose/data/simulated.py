"""Which logs come from a simulator and not from a vessel: by their message types, or since nothing in them is noisy."""

from __future__ import annotations

import numpy as np

from ferryid.diagnose.data.measurements import MeasuredLog
from ferryid.diagnose.data.thresholds import DATA
from ferryid.effects.force_model import Measurements
from ferryid.types import Floats

SIMULATORS = (
    "gazebo_msgs/",
    "ros_gz_interfaces/",
    "ros_ign_interfaces/",
    "uuv_gazebo_ros_plugins_msgs/",
    "webots_ros/",
)
"""Beginnings of the names of messages that simulators alone send."""
VELOCITIES = (("u", "v"), ("vel_N", "vel_E"))


def simulated(log: MeasuredLog) -> str:
    """Return what shows that a log is a simulator's, as the end of a sentence; empty where nothing does."""
    recording = log.survey.recording
    for topic in recording.topics:
        if topic.count and topic.type.startswith(SIMULATORS):
            return f"its topic {topic.name} holds messages of a simulator ({topic.type})"
    measured = any(all(name in recording.found for name in pair) for pair in VELOCITIES)
    if not (measured and "r" in recording.found):
        # Velocities that are derived from the positions agree with them.
        return ""
    noise = relative_noise(log.measurements)
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
