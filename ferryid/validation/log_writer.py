"""A trial as a log: what each sensor sent and when the recorder got it, as ROS 1 bag, ROS 2 folder or MCAP."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.files import replacing
from ferryid.simulate.recorders import write_mcap
from ferryid.simulate.rosbag_recorders import write_ros1, write_ros2
from ferryid.simulate.sensors import Stream
from ferryid.types import Floats
from ferryid.validation.plant.motion import BODY
from ferryid.validation.plant.plant import wrapped
from ferryid.validation.plant.thrusters import STATES
from ferryid.validation.plant.trial import CONTROL_EVERY, Trial

START_NS = 1_790_000_000_000_000_000
CHUNK_BYTES = 768 * 1024
LATENCY_S, JITTER_S = 0.004, 0.002
"""From a sensor to the recorder, and how much that varies."""
SPEED_RPM, ANGLE_DEG = 1.0, 0.1
"""Errors of the thrusters' sensors."""
PHASE_S = 0.013
"""By how much the thrusters' samples lie behind the navigation's."""


def streams(trial: Trial, seed: int) -> list[Stream]:
    """Return the messages of a trial."""
    rng = np.random.default_rng([seed, 7])
    t = trial.t + trial.plant.delay_s
    x, y, psi, u, v, r = trial.reported.T
    half = 0.5 * wrapped(psi)
    zero = np.zeros(len(t))
    made = [
        _stream(
            rng,
            "/navigation/odometry",
            "nav_msgs/msg/Odometry",
            t,
            {"pose.pose.position.x": x, "pose.pose.position.y": y}
            | {"pose.pose.orientation.x": zero, "pose.pose.orientation.y": zero}
            | {"pose.pose.orientation.z": np.sin(half), "pose.pose.orientation.w": np.cos(half)}
            | {"twist.twist.linear.x": u, "twist.twist.linear.y": v, "twist.twist.angular.z": r},
            {"child_frame_id": "body"},
        )
    ]
    rows = slice(None, None, CONTROL_EVERY)
    X, Y, N = trial.wanted[rows].T
    wrench = {"wrench.force.x": X, "wrench.force.y": Y, "wrench.torque.z": N}
    made.append(_stream(rng, "/control/tau_d", "geometry_msgs/msg/WrenchStamped", trial.t[rows], wrench))
    thrusters = trial.states[:, BODY:].reshape(len(t), -1, STATES)
    for i, one in enumerate(trial.plant.vessel.thrusters):
        at = trial.t[:-1] + PHASE_S
        speed = np.interp(at, trial.t, thrusters[:, i, 0]) + SPEED_RPM * rng.standard_normal(len(at))
        angle = np.interp(at, trial.t, np.unwrap(thrusters[:, i, 1]))
        if one.angle_deg is None:
            angle = angle + np.radians(ANGLE_DEG) * rng.standard_normal(len(at))
            for encoder in trial.plant.encoders:
                angle = encoder(angle)
        made.append(_thruster_stream(rng, f"/{one.name}/state", at, speed, angle))
        orders = trial.orders[rows, i]
        made.append(_thruster_stream(rng, f"/{one.name}/command", trial.t[rows], orders[:, 0], orders[:, 1]))
    return made


def write_log(every: list[Stream], folder: Path, name: str, kind: str) -> Path:
    """Write a log of one of `ferryid.validation.case.FORMATS`, whole or not at all, and return its path."""
    if kind == "ros2":
        path = folder / name
        write_ros2(every, path, "sqlite3")
        return path
    path = folder / f"{name}.{'bag' if kind == 'ros1' else 'mcap'}"
    with replacing(path, new=False) as temporary:
        (write_ros1 if kind == "ros1" else write_mcap)(every, temporary, CHUNK_BYTES)
    return path


def _thruster_stream(rng: np.random.Generator, topic: str, t: Floats, speed: Floats, angle: Floats) -> Stream:
    columns = {"speed": speed, "azimuth": wrapped(angle)}
    return _stream(rng, topic, "ferry_msgs/msg/ThrusterState", t, columns)


def _stream(
    rng: np.random.Generator,
    topic: str,
    kind: str,
    t: Floats,
    columns: Mapping[str, Floats],
    constants: Mapping[str, Any] | None = None,
) -> Stream:
    stamp = START_NS + np.rint(t * 1e9).astype(np.int64)
    late = np.rint(1e9 * (LATENCY_S + JITTER_S * rng.standard_exponential(len(t)))).astype(np.int64)
    return Stream(topic, kind, "ned", stamp, np.maximum.accumulate(stamp + late), dict(columns), constants or {})
