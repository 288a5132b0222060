"""Which logs hold no recording of a vessel: a simulator's messages, and positions that no sensor measured.

Two signs are in the numbers. A simulator that adds up its velocities step by step, as a dead reckoning does, leaves steps of
the position that are the speed times one length of time to the last digit: no sensor measures that, so that the positions are
no measurement beside the velocities. And no vessel that turns moves exactly along its heading: positions that do are those of
a point that cannot drift.
"""

from __future__ import annotations

import numpy as np

from ferryid.signals.stream import Recording, Stream
from ferryid.signals.thresholds import SIGNALS
from ferryid.types import Ints

SIMULATORS = (
    "gazebo_msgs/",
    "ros_gz_interfaces/",
    "ros_ign_interfaces/",
    "uuv_gazebo_ros_plugins_msgs/",
    "webots_ros/",
)
"""Beginnings of the names of messages that simulators alone send."""
VELOCITIES = (("u", "v"), ("vel_N", "vel_E"))


def artificial(recording: Recording) -> str:
    """Return what shows that a log is no recording of a vessel, as the end of a sentence; empty where nothing does."""
    for topic in recording.topics:
        if topic.count and topic.type.startswith(SIMULATORS):
            return f"its topic {topic.name} holds messages of a simulator ({topic.type})"
    return _summed(recording) or _along(recording)


def _along(recording: Recording) -> str:
    """Return that positions move exactly along the heading; empty where they do not."""
    place = next((one for one in recording.streams.values() if {"x", "y"} <= set(one.columns)), None)
    turn = next((one for one in recording.streams.values() if "psi" in one.columns), None)
    if place is None or turn is None or along_share(place, turn) < SIGNALS.summed_share:
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
    moving = np.isfinite(length) & (length > SIGNALS.along_step * np.nanmax(length, initial=0.0))
    known = np.isfinite(psi)
    if np.count_nonzero(moving) < SIGNALS.summed_steps or not known.any():
        return 0.0
    if np.ptp(np.unwrap(psi[known])) < SIGNALS.along_turn_rad:
        return 0.0
    at: Ints = np.searchsorted(turn.time_ns, place.time_ns[1:])
    course = np.arctan2(east, north)
    away = np.full(len(course), np.inf)
    for shift in range(-SIGNALS.along_samples, SIGNALS.along_samples + 1):
        heading = psi[np.clip(at + shift, 0, len(psi) - 1)]
        away = np.fmin(away, np.abs(np.sin(course - heading)))
    return float(np.mean(away[moving] <= SIGNALS.along_rad))


def _summed(recording: Recording) -> str:
    """Return that positions are the sum of the velocities, where one topic has both; empty where they are not."""
    for stream in recording.streams.values():
        for names in VELOCITIES:
            if not all(name in stream.columns for name in ("x", "y", *names)):
                continue
            if summed_share(stream, names) >= SIGNALS.summed_share:
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
        moving = np.isfinite(step) & (beside > SIGNALS.summed_digits * np.nanmax(speed, initial=0.0))
        if np.count_nonzero(moving) < SIGNALS.summed_steps:
            continue
        if np.ptp(beside[moving]) <= SIGNALS.summed_variation * np.max(beside[moving]):
            continue
        length_s = float(np.median(step[moving] / beside[moving]))
        away = np.abs(step[moving] - length_s * beside[moving])
        best = max(best, float(np.mean(away <= SIGNALS.summed_digits * length_s * np.median(beside[moving]))))
    return best
