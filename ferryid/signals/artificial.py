"""Which logs hold no recording of a vessel: a simulator's messages, and positions that no sensor measured.

Two signs are in the numbers. A simulator that adds up its velocities step by step, as a dead reckoning does, leaves steps of
the position that are the speed times one length of time to the last digit: no sensor measures that, so that the positions are
no measurement beside the velocities. And no vessel that turns moves exactly along its heading: positions that do are those of
a point that cannot drift.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ferryid.ingest.log import Topic
from ferryid.signals.stream import Recording
from ferryid.signals.thresholds import SIGNALS
from ferryid.types import Floats, Ints, Nanoseconds

SIMULATORS = (
    "gazebo_msgs/",
    "ros_gz_interfaces/",
    "ros_ign_interfaces/",
    "uuv_gazebo_ros_plugins_msgs/",
    "webots_ros/",
)
"""Beginnings of the names of messages that simulators alone send."""
NO_RECORDING = "is no recording of a vessel"
"""What is told of such a log."""
VELOCITIES = (("u", "v"), ("vel_N", "vel_E"))
ALONG = (
    "each step of its positions points along the heading to the last digit, as if no vessel drifted in a turn: they are "
    "simulated, or one is reckoned from the other, and not measured"
)
"""Of a log whose positions are those of `along_share`."""


def artificial(recording: Recording) -> str:
    """Return what shows that a log is no recording of a vessel, as the end of a sentence; empty where nothing does."""
    return simulator(recording.topics) or _summed(recording) or _along(recording)


def simulator(topics: Sequence[Topic]) -> str:
    """Return which topic holds messages that simulators alone send, as the end of a sentence; empty where none does."""
    for topic in topics:
        if topic.count and topic.type.startswith(SIMULATORS):
            return f"its topic {topic.name} holds messages of a simulator ({topic.type})"
    return ""


def _along(recording: Recording) -> str:
    """Return that positions move exactly along the heading; empty where they do not."""
    place = next((one for one in recording.streams.values() if {"x", "y"} <= set(one.columns)), None)
    turn = next((one for one in recording.streams.values() if "psi" in one.columns), None)
    if place is None or turn is None:
        return ""
    share = along_share(place.time_ns, place.columns["x"], place.columns["y"], turn.time_ns, turn.columns["psi"])
    return ALONG if share >= SIGNALS.summed_share else ""


def along_share(
    time: Nanoseconds | Floats, x: Floats, y: Floats, heading_time: Nanoseconds | Floats, psi: Floats
) -> float:
    """Return the share of steps of the position that point along a heading at about their time.

    0 where the vessel hardly moves or turns, which shows nothing.

    Parameters
    ----------
    time, x, y
        Times, and the position at them [m], shape (n,).
    heading_time, psi
        Times on the same clock and in the same unit, and the heading at them, from x towards y [rad], shape (m,).
    """
    north, east = np.diff(x), np.diff(y)
    length = np.hypot(north, east)
    moving = np.isfinite(length) & (length > SIGNALS.along_step * np.nanmax(length, initial=0.0))
    known = np.isfinite(psi)
    if np.count_nonzero(moving) < SIGNALS.summed_steps or not known.any():
        return 0.0
    if np.ptp(np.unwrap(psi[known])) < SIGNALS.along_turn_rad:
        return 0.0
    at: Ints = np.searchsorted(heading_time, time[1:])
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
            first, second = (stream.columns[name] for name in names)
            if summed_share(stream.columns["x"], stream.columns["y"], first, second) >= SIGNALS.summed_share:
                return summed_says(stream.topic, still=names == VELOCITIES[0] and not second.any())
    return ""


def summed_says(topic: str, *, still: bool) -> str:
    """Return that the positions of a topic are the sum of its velocities, and that the sway is zero if it is `still`."""
    return (
        f"each step of its positions is the speed of {topic} times one length of time to the last digit"
        f"{', and the sway velocity is zero throughout' if still else ''}: they are simulated, or reckoned from the "
        "velocities, and not measured"
    )


def summed_share(x: Floats, y: Floats, first: Floats, second: Floats) -> float:
    """Return the share of steps of the position that are the speed before or after them times one length of time.

    Lengths are compared, so that no heading is needed; 0 where the vessel hardly moves or its speed is all but constant, which
    shows nothing.

    Parameters
    ----------
    x, y
        Position [m], shape (n,).
    first, second
        Components of the velocity at the same times, in any unit and frame, shape (n,).
    """
    step, speed = np.hypot(np.diff(x), np.diff(y)), np.hypot(first, second)
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
