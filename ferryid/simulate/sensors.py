"""What the sensors report of a trial: sampled, noisy, late, in the order in which a recorder gets it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import pi, radians
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.simulate.noise import generator
from ferryid.simulate.scenario import Scenario
from ferryid.simulate.states import Control, Truth
from ferryid.vessel.profile import Profile

Floats = NDArray[np.float64]
Nanoseconds = NDArray[np.int64]

GRAVITY = 9.81
IMU_ACCELERATION_STD = 0.03
IMU_TURN_STD = 0.002


@dataclass(frozen=True)
class Stream:
    """All messages of one topic.

    Attributes
    ----------
    topic, type
        Topic name, and message type in ROS2 spelling.
    frame_id
        Frame in every header.
    stamp_ns, receive_ns
        The sender's stamp and the recorder's time of every message, since 1970, shape (n,); `receive_ns` ascends.
    columns
        Field path to values, shape (n,) or (n, length of an array field).
    constants
        Field path to a value that all messages share.
    blobs
        Payload of every message of a camera.
    """

    topic: str
    type: str
    frame_id: str
    stamp_ns: Nanoseconds
    receive_ns: Nanoseconds
    columns: Mapping[str, NDArray[Any]]
    constants: Mapping[str, Any] = field(default_factory=dict)
    blobs: tuple[bytes, ...] = ()


@dataclass(frozen=True)
class Link:
    """How a topic gets from its sensor to the recorder: when it is sampled, how late it arrives [s]."""

    phase_s: float
    latency_s: float
    jitter_s: float


LINKS = {
    "/navigation/odometry": Link(0.0, 0.012, 0.002),
    "/control/tau_d": Link(0.0, 0.001, 0.0004),
    "command": Link(0.0, 0.0015, 0.0004),
    "state": Link(0.011, 0.006, 0.0012),
    "/weather/wind": Link(0.037, 0.045, 0.006),
    "/imu/data": Link(0.004, 0.0025, 0.0005),
    "/camera/image/compressed": Link(0.31, 0.085, 0.012),
}
"""Typical figures of a small vessel's network; the jitter is the mean of a gamma distribution of shape 2."""


def sense(scenario: Scenario, profile: Profile, seed: int, truth: Truth, control: Control) -> tuple[Stream, ...]:
    """Return the streams of every topic of a trial, as `ferryid.simulate.trial.simulate` puts them into a log."""
    names = [actuator.name for actuator in profile.actuators]
    makers = [_odometry(scenario, seed, control), _tau_d(scenario, seed, control)]
    for index, name in enumerate(names):
        makers.append(_thruster_state(scenario, seed, truth, index, name))
        makers.append(_thruster_command(scenario, seed, control, index, name))
    if scenario.sensors.wind_rate_hz > 0.0:
        makers.append(_wind(scenario, seed, truth))
    if scenario.sensors.imu_rate_hz > 0.0:
        makers.append(_imu(scenario, seed, truth))
    if scenario.sensors.camera_rate_hz > 0.0:
        makers.append(_camera(scenario, seed, truth))
    return tuple(makers)


def apparent_wind(wind: Floats, psi: Floats, nu: Floats) -> tuple[Floats, Floats]:
    """Return what a masthead anemometer shows: speed [m/s] and where the wind comes FROM relative to the bow [rad].

    Parameters
    ----------
    wind
        Velocity of the air over ground, north and east, where it goes TO [m/s], shape (n, 2).
    psi, nu
        Heading [rad], shape (n,), and velocities [m/s, m/s, rad/s], shape (n, 3).

    Returns
    -------
    speed, direction
        Shape (n,); the direction is positive to starboard and lies in (-pi, pi].
    """
    c, s = np.cos(psi), np.sin(psi)
    u_rw = nu[:, 0] - (c * wind[:, 0] + s * wind[:, 1])
    v_rw = nu[:, 1] - (c * wind[:, 1] - s * wind[:, 0])
    return np.hypot(u_rw, v_rw), np.arctan2(v_rw, u_rw)


def _times(scenario: Scenario, seed: int, topic: str, link: Link, t: Floats) -> tuple[Nanoseconds, Nanoseconds]:
    """Stamp samples taken at `t` [s] and let them travel to the recorder, which is never out of order per topic.

    The recorder's clock is ahead of the senders' by the scenario's offset.
    """
    stamp = scenario.start_ns + np.rint(t * 1e9).astype(np.int64)
    jitter = generator(seed, f"jitter {topic}").gamma(2.0, 0.5 * link.jitter_s, len(t))
    late = link.latency_s + jitter + scenario.sensors.clock_offset_ms * 1e-3
    return stamp, np.maximum.accumulate(stamp + np.rint(late * 1e9).astype(np.int64))


def _sample_times(truth: Truth, rate_hz: float, phase_s: float) -> Floats:
    """Return the sample times of a sensor within the truth's time range [s]."""
    return np.arange(phase_s, truth.t[-1], 1.0 / rate_hz)


def _at(truth: Truth, values: Floats, t: Floats) -> Floats:
    """Interpolate true columns, shape (n, k), to sample times; linear, the grid being far finer than the motion."""
    return np.column_stack([np.interp(t, truth.t, column) for column in values.T])


def _wrapped(angle: Floats) -> Floats:
    """Wrap angles [rad] to (-pi, pi]."""
    return np.asarray(pi - np.mod(pi - angle, 2.0 * pi))


def _odometry(scenario: Scenario, seed: int, control: Control) -> Stream:
    topic = "/navigation/odometry"
    x, y, psi, u, v, r = control.measured.T
    noise = scenario.noise
    pose, twist = np.zeros(36), np.zeros(36)
    pose[[0, 7]], pose[35] = noise.position_m**2, radians(noise.heading_deg) ** 2
    twist[[0, 7]], twist[35] = noise.velocity_mps**2, radians(noise.yaw_rate_degps) ** 2
    return Stream(
        topic,
        "nav_msgs/msg/Odometry",
        "ned",
        *_times(scenario, seed, topic, LINKS[topic], control.t),
        columns={
            "pose.pose.position.x": x,
            "pose.pose.position.y": y,
            "pose.pose.orientation.z": np.sin(0.5 * _wrapped(psi)),
            "pose.pose.orientation.w": np.cos(0.5 * _wrapped(psi)),
            "twist.twist.linear.x": u,
            "twist.twist.linear.y": v,
            "twist.twist.angular.z": r,
        },
        constants={"child_frame_id": "body", "pose.covariance": pose, "twist.covariance": twist},
    )


def _tau_d(scenario: Scenario, seed: int, control: Control) -> Stream:
    topic = "/control/tau_d"
    X, Y, N = control.tau_d.T
    return Stream(
        topic,
        "geometry_msgs/msg/WrenchStamped",
        "body",
        *_times(scenario, seed, topic, LINKS[topic], control.t_order),
        columns={"wrench.force.x": X, "wrench.force.y": Y, "wrench.torque.z": N},
    )


def _thruster_command(scenario: Scenario, seed: int, control: Control, index: int, name: str) -> Stream:
    topic = f"/{name}/command"
    return Stream(
        topic,
        "ferry_msgs/msg/ThrusterState",
        name,
        *_times(scenario, seed, topic, LINKS["command"], control.t_order),
        columns={"speed": control.speeds[:, index], "azimuth": _wrapped(control.angles[:, index])},
    )


def _thruster_state(scenario: Scenario, seed: int, truth: Truth, index: int, name: str) -> Stream:
    topic = f"/{name}/state"
    link = LINKS["state"]
    t = _sample_times(truth, scenario.sensors.thruster_rate_hz, link.phase_s)
    random = generator(seed, topic)
    both = _at(truth, np.column_stack((truth.speeds[:, index], truth.angles[:, index])), t)
    speed = both[:, 0] + scenario.noise.speed_rpm * random.standard_normal(len(t))
    angle = both[:, 1] + radians(scenario.noise.azimuth_deg) * random.standard_normal(len(t))
    return Stream(
        topic,
        "ferry_msgs/msg/ThrusterState",
        name,
        *_times(scenario, seed, topic, link, t),
        columns={"speed": speed, "azimuth": _wrapped(angle)},
    )


def _wind(scenario: Scenario, seed: int, truth: Truth) -> Stream:
    topic = "/weather/wind"
    link = LINKS[topic]
    t = _sample_times(truth, scenario.sensors.wind_rate_hz, link.phase_s)
    random = generator(seed, topic)
    true_speed, true_direction = apparent_wind(
        _at(truth, truth.wind, t), np.interp(t, truth.t, truth.eta[:, 2]), _at(truth, truth.nu, t)
    )
    speed = np.abs(true_speed + scenario.noise.wind_speed_mps * random.standard_normal(len(t)))
    direction = true_direction + radians(scenario.noise.wind_direction_deg) * random.standard_normal(len(t))
    return Stream(
        topic,
        "ferry_msgs/msg/Wind",
        "mast",
        *_times(scenario, seed, topic, link, t),
        columns={
            "speed": speed.astype(np.float32),
            "direction": np.mod(direction, 2.0 * pi).astype(np.float32),
        },
    )


def _imu(scenario: Scenario, seed: int, truth: Truth) -> Stream:
    topic = "/imu/data"
    link = LINKS[topic]
    t = _sample_times(truth, scenario.sensors.imu_rate_hz, link.phase_s)
    random = generator(seed, topic)
    u, v, r = _at(truth, truth.nu, t).T
    u_dot, v_dot, _ = _at(truth, truth.nu_dot, t).T
    psi = _wrapped(np.interp(t, truth.t, truth.eta[:, 2]))
    shake = IMU_ACCELERATION_STD * random.standard_normal((3, len(t)))
    turn = IMU_TURN_STD * random.standard_normal((3, len(t)))
    return Stream(
        topic,
        "sensor_msgs/msg/Imu",
        "imu",
        *_times(scenario, seed, topic, link, t),
        columns={
            "orientation.z": np.sin(0.5 * psi),
            "orientation.w": np.cos(0.5 * psi),
            "angular_velocity.x": turn[0],
            "angular_velocity.y": turn[1],
            "angular_velocity.z": r + turn[2],
            "linear_acceleration.x": u_dot - r * v + shake[0],
            "linear_acceleration.y": v_dot + r * u + shake[1],
            "linear_acceleration.z": shake[2] - GRAVITY,
        },
    )


def _camera(scenario: Scenario, seed: int, truth: Truth) -> Stream:
    """Return frames of random bytes between the markers of a JPEG: bulk of no content that a reader must skip."""
    topic = "/camera/image/compressed"
    link = LINKS[topic]
    t = _sample_times(truth, scenario.sensors.camera_rate_hz, link.phase_s)
    random = generator(seed, topic)
    sizes = random.integers(900, 1500, len(t)).tolist()
    return Stream(
        topic,
        "sensor_msgs/msg/CompressedImage",
        "camera",
        *_times(scenario, seed, topic, link, t),
        columns={},
        constants={"format": "jpeg"},
        blobs=tuple(b"\xff\xd8" + random.bytes(size) + b"\xff\xd9" for size in sizes),
    )
