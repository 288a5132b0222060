"""Which logs come from a simulator and not from a vessel: by their message types, or since nothing in them is noisy.

Three signs are in the numbers. A solution of equations of motion has no noise between pose and velocity. A simulator that adds
up its velocities step by step, as a dead reckoning does, leaves steps of the position that are the speed times one length of
time to the last digit: no sensor measures that, so that the positions are no measurement beside the velocities. And no vessel
that turns moves exactly along its heading: positions that do are those of a point that cannot drift.
"""

from __future__ import annotations

import numpy as np

from ferryid.diagnose.data.thresholds import DATA
from ferryid.effects.force_model import Measurements
from ferryid.signals.stream import Recording, Stream
from ferryid.types import Floats, Ints

SIMULATORS = (
    "gazebo_msgs/",
    "ros_gz_interfaces/",
    "ros_ign_interfaces/",
    "uuv_gazebo_ros_plugins_msgs/",
    "webots_ros/",
)
"""Beginnings of the names of messages that simulators alone send."""
VELOCITIES = (("u", "v"), ("vel_N", "vel_E"))


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


def artificial(recording: Recording) -> str:
    """Return the same of a recording that need not be fit for a diagnosis."""
    for topic in recording.topics:
        if topic.count and topic.type.startswith(SIMULATORS):
            return f"its topic {topic.name} holds messages of a simulator ({topic.type})"
    return _summed(recording) or _along(recording)


def _along(recording: Recording) -> str:
    """Return that positions move exactly along the heading; empty where they do not."""
    place = next((one for one in recording.streams.values() if {"x", "y"} <= set(one.columns)), None)
    turn = next((one for one in recording.streams.values() if "psi" in one.columns), None)
    if place is None or turn is None or along_share(place, turn) < DATA.summed_share:
        return ""
    return (
        "each step of its positions points along the heading to the last digit, as if no vessel drifted in a turn: they are "
        "simulated, or one is reckoned from the other, and not measured"
    )


def along_share(place: Stream, turn: Stream) -> float:
    """Return the share of steps of the position that point along a heading at about their time.

    0 where the vessel hardly moves or turns, which shows nothing.

    Parameters
    ----------
    place
        With columns ``x`` and ``y`` [m].
    turn
        With a column ``psi`` [rad].
    """
    north, east = np.diff(place.columns["x"]), np.diff(place.columns["y"])
    length, psi = np.hypot(north, east), turn.columns["psi"]
    moving = np.isfinite(length) & (length > DATA.along_step * np.nanmax(length, initial=0.0))
    known = np.isfinite(psi)
    if np.count_nonzero(moving) < DATA.summed_steps or not known.any():
        return 0.0
    if np.ptp(np.unwrap(psi[known])) < DATA.along_turn_rad:
        return 0.0
    at: Ints = np.searchsorted(turn.time_ns, place.time_ns[1:])
    course = np.arctan2(east, north)
    away = np.full(len(course), np.inf)
    for shift in range(-DATA.along_samples, DATA.along_samples + 1):
        heading = psi[np.clip(at + shift, 0, len(psi) - 1)]
        away = np.fmin(away, np.abs(np.sin(course - heading)))
    return float(np.mean(away[moving] <= DATA.along_rad))


def _summed(recording: Recording) -> str:
    """Return that positions are the sum of the velocities, where one topic has both; empty where they are not."""
    for stream in recording.streams.values():
        for names in VELOCITIES:
            if not all(name in stream.columns for name in ("x", "y", *names)):
                continue
            if summed_share(stream, names) >= DATA.summed_share:
                sway = stream.columns[names[1]]
                still = (
                    ", and the sway velocity is zero throughout" if names == VELOCITIES[0] and not sway.any() else ""
                )
                return (
                    f"each step of its positions is the speed of {stream.topic} times one length of time to the last "
                    f"digit{still}: they are simulated, or reckoned from the velocities, and not measured"
                )
    return ""


def summed_share(stream: Stream, velocity: tuple[str, str]) -> float:
    """Return the share of steps of the position that are the speed before or after them times one length of time.

    Lengths are compared, so that no heading is needed; 0 where the vessel hardly moves or its speed is all but constant, which
    shows nothing.
    """
    step = np.hypot(np.diff(stream.columns["x"]), np.diff(stream.columns["y"]))
    speed = np.hypot(*(stream.columns[name] for name in velocity))
    best = 0.0
    for beside in (speed[:-1], speed[1:]):
        moving = np.isfinite(step) & (beside > DATA.summed_digits * np.nanmax(speed, initial=0.0))
        if np.count_nonzero(moving) < DATA.summed_steps:
            continue
        if np.ptp(beside[moving]) <= DATA.summed_variation * np.max(beside[moving]):
            continue
        length_s = float(np.median(step[moving] / beside[moving]))
        away = np.abs(step[moving] - length_s * beside[moving])
        best = max(best, float(np.mean(away <= DATA.summed_digits * length_s * np.median(beside[moving]))))
    return best


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
