"""What the sensors report of a trial: sampled, noisy, late, in the order in which a recorder gets it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import pi, radians
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.simulate.environment import CURRENT, PAYLOAD, WIND, Link, current_samples, payload_samples
from ferryid.simulate.noise import gaps, generator, interpolated, sample_times
from ferryid.simulate.scenario import Scenario
from ferryid.simulate.states import Control, Truth
from ferryid.types import Floats, Nanoseconds
from ferryid.vessel.profile import Profile

GRAVITY = 9.81


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
    whole
        Every message as bytes already, of a type whose messages differ in length; then nothing but type and times counts.
    definition
        Of a type that is made for a vessel's own topics, with those of the types in it; empty for a known one.
    """

    topic: str
    type: str
    frame_id: str
    stamp_ns: Nanoseconds
    receive_ns: Nanoseconds
    columns: Mapping[str, NDArray[Any]]
    constants: Mapping[str, Any] = field(default_factory=dict)
    blobs: tuple[bytes, ...] = ()
    whole: tuple[bytes, ...] = ()
    definition: str = ""


LINKS = {
    "/navigation/odometry": Link(0.0, 0.012, 0.002),
    "/control/tau_d": Link(0.0, 0.001, 0.0004),
    "/control/reference": Link(0.0, 0.001, 0.0004),
    "command": Link(0.0, 0.0015, 0.0004),
    "state": Link(0.011, 0.006, 0.0012),
    "/weather/wind": WIND,
    "/weather/current": CURRENT,
    "/payload/waterline": PAYLOAD,
    "/imu/data": Link(0.004, 0.0025, 0.0005),
    "/camera/image/compressed": Link(0.31, 0.085, 0.012),
}
"""Typical figures of a small vessel's network; the jitter is the mean of a gamma distribution of shape 2."""

TURNING = ("azimuth", "propeller_rudder")
"""Kinds of actuators whose angle is measured; that of the others is how they are built in."""


def sense(scenario: Scenario, profile: Profile, seed: int, truth: Truth, control: Control) -> tuple[Stream, ...]:
    """Return the streams of every topic of a trial, as `ferryid.simulate.trial.simulate` puts them into a log."""
    sensors = scenario.sensors
    made = [_odometry(scenario, seed, truth, control)]
    if not scenario.manoeuvre.kind:
        made.append(_tau_d(scenario, seed, control))
        if sensors.reference_rate_hz > 0.0:
            made.append(_reference(scenario, seed, control))
    for index, actuator in enumerate(profile.actuators):
        turning = actuator.kind in TURNING
        made.append(_thruster_state(scenario, seed, truth, index, actuator.name, turning=turning))
        made.append(_thruster_command(scenario, seed, control, index, actuator.name))
    for rate_hz, make in (
        (sensors.wind_rate_hz, _wind),
        (sensors.current_rate_hz, _current),
        (sensors.payload_rate_hz, _payload),
        (sensors.imu_rate_hz, _imu),
        (sensors.camera_rate_hz, _camera),
    ):
        if rate_hz > 0.0:
            made.append(make(scenario, seed, truth))
    return tuple(made)


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
    s, c = np.sin(psi), np.cos(psi)
    u_rw = nu[:, 0] - (c * wind[:, 0] + s * wind[:, 1])
    v_rw = nu[:, 1] - (c * wind[:, 1] - s * wind[:, 0])
    return np.hypot(u_rw, v_rw), np.arctan2(v_rw, u_rw)


def quaternion(roll: Floats, pitch: Floats, yaw: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return x, y, z and w of the turn from NED to body by yaw, pitch and roll [rad], in this order, shape (n,) each."""
    (s1, c1), (s2, c2), (s3, c3) = ((np.sin(0.5 * angle), np.cos(0.5 * angle)) for angle in (roll, pitch, yaw))
    return (
        s1 * c2 * c3 - c1 * s2 * s3,
        c1 * s2 * c3 + s1 * c2 * s3,
        c1 * c2 * s3 - s1 * s2 * c3,
        c1 * c2 * c3 + s1 * s2 * s3,
    )


def _times(
    scenario: Scenario, seed: int, topic: str, link: Link, t: Floats, ahead_ms: float = 0.0
) -> tuple[Nanoseconds, Nanoseconds]:
    """Stamp samples taken at `t` [s] and let them travel to the recorder, which is never out of order per topic.

    The recorder's clock is ahead of the senders' by the scenario's offset, the sender's own by `ahead_ms`.
    """
    taken = scenario.start_ns + np.rint(t * 1e9).astype(np.int64)
    # From streams of their own, so that a longer trial begins like a shorter one; so is all noise, by stream or by row.
    first, second = (
        generator(seed, f"{name} {topic}").standard_exponential(len(t)) for name in ("jitter", "more jitter")
    )
    jitter = 0.5 * link.jitter_s * (first + second)
    late = link.latency_s + jitter + scenario.sensors.clock_offset_ms * 1e-3
    return taken + round(ahead_ms * 1e6), np.maximum.accumulate(taken + np.rint(late * 1e9).astype(np.int64))


def _sample_times(truth: Truth, rate_hz: float, link: Link) -> Floats:
    """Return the sample times of a sensor within the truth's time range [s]."""
    return sample_times(float(truth.t[-1]), rate_hz, link.phase_s)


def _at(truth: Truth, t: Floats, *columns: Floats) -> list[Floats]:
    """Interpolate true columns to sample times; linear, the grid being far finer than the motion."""
    return list(interpolated(t, truth.t, np.column_stack(columns)).T.copy())


def _wrapped(angle: Floats) -> Floats:
    """Wrap angles [rad] to (-pi, pi]."""
    return np.asarray(pi - np.mod(pi - angle, 2.0 * pi))


def _odometry(scenario: Scenario, seed: int, truth: Truth, control: Control) -> Stream:
    topic = "/navigation/odometry"
    sent = control.sent
    t = control.t[sent]
    x, y, psi, u, v, r = control.measured[sent].T
    noise = scenario.sensors.noise
    errors = radians(noise.attitude_deg) * generator(seed, topic).normal_columns(len(control.t), 2)[sent]
    tilt = interpolated(t - scenario.sensors.navigation.delay_s, truth.t, truth.attitude) + errors
    roll, pitch = tilt.T.copy()
    q = quaternion(roll, pitch, _wrapped(psi))
    pose, twist = np.zeros(36), np.zeros(36)
    turn, attitude, yaw = (radians(std) for std in (noise.yaw_rate_degps, noise.attitude_deg, noise.heading_deg))
    pose[[0, 7]], pose[[21, 28]], pose[35] = noise.position_m * noise.position_m, attitude * attitude, yaw * yaw
    twist[[0, 7]], twist[35] = noise.velocity_mps * noise.velocity_mps, turn * turn
    return Stream(
        topic,
        "nav_msgs/msg/Odometry",
        "ned",
        *_times(scenario, seed, topic, LINKS[topic], t),
        columns={
            "pose.pose.position.x": x,
            "pose.pose.position.y": y,
            **{f"pose.pose.orientation.{axis}": values for axis, values in zip("xyzw", q, strict=True)},
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


def _reference(scenario: Scenario, seed: int, control: Control) -> Stream:
    """Return the desired pose, as it is at the control cycle of each sample."""
    topic = "/control/reference"
    taken = sample_times(float(control.t[-1]), scenario.sensors.reference_rate_hz, LINKS[topic].phase_s)
    rows = np.maximum(np.searchsorted(control.t, taken, side="right") - 1, 0)
    x, y, psi = control.eta_d[rows].T
    level = np.zeros_like(psi)
    return Stream(
        topic,
        "geometry_msgs/msg/PoseStamped",
        "ned",
        *_times(scenario, seed, topic, LINKS[topic], taken),
        columns={
            "pose.position.x": x,
            "pose.position.y": y,
            **{
                f"pose.orientation.{axis}": values
                for axis, values in zip("xyzw", quaternion(level, level, _wrapped(psi)), strict=True)
            },
        },
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


def _thruster_state(scenario: Scenario, seed: int, truth: Truth, index: int, name: str, *, turning: bool) -> Stream:
    topic = f"/{name}/state"
    link, sensors = LINKS["state"], scenario.sensors
    t = _sample_times(truth, sensors.thruster_rate_hz, link)
    speed_noise, angle_noise = generator(seed, topic).normal_columns(len(t), 2).T
    speed, angle = _at(truth, t, truth.speeds[:, index], truth.angles[:, index])
    speed += sensors.noise.speed_rpm * speed_noise
    if turning:
        angle += radians(sensors.noise.azimuth_deg) * angle_noise
        if sensors.azimuth_step_deg > 0.0:
            step = radians(sensors.azimuth_step_deg)
            angle = np.rint(angle / step) * step
    sent = ~gaps(generator(seed, f"gaps {topic}"), t, sensors.dropouts_per_min, sensors.dropout_s)
    stamp, receive = _times(scenario, seed, topic, link, t, sensors.thruster_clock_offset_ms)
    return Stream(
        topic,
        "ferry_msgs/msg/ThrusterState",
        name,
        stamp[sent],
        receive[sent],
        columns={"speed": speed[sent], "azimuth": _wrapped(angle)[sent]},
    )


def _wind(scenario: Scenario, seed: int, truth: Truth) -> Stream:
    topic = "/weather/wind"
    link, noise = LINKS[topic], scenario.sensors.noise
    t = _sample_times(truth, scenario.sensors.wind_rate_hz, link)
    speed_noise, direction_noise = generator(seed, topic).normal_columns(len(t), 2).T
    values = interpolated(t, truth.t, np.column_stack((truth.wind, truth.eta[:, 2], truth.nu)))
    true_speed, true_direction = apparent_wind(values[:, :2], values[:, 2].copy(), values[:, 3:])
    speed = np.abs(true_speed + noise.wind_speed_mps * speed_noise)
    direction = true_direction + radians(noise.wind_direction_deg) * direction_noise
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


def _current(scenario: Scenario, seed: int, truth: Truth) -> Stream:
    topic = "/weather/current"
    t, values = current_samples(scenario, seed, truth.t, truth.current)
    return Stream(
        topic,
        "ferry_msgs/msg/Current",
        "ned",
        *_times(scenario, seed, topic, LINKS[topic], t),
        columns={"north": values[:, 0], "east": values[:, 1]},
    )


def _payload(scenario: Scenario, seed: int, truth: Truth) -> Stream:
    topic = "/payload/waterline"
    t, values = payload_samples(scenario, seed, truth.t, truth.payload)
    return Stream(
        topic,
        "ferry_msgs/msg/Payload",
        "body",
        *_times(scenario, seed, topic, LINKS[topic], t),
        columns={"mass": values[:, 0], "x": values[:, 1]},
    )


def _imu(scenario: Scenario, seed: int, truth: Truth) -> Stream:
    """Return attitude, turn rates and specific force at the body origin; heave is left out."""
    topic = "/imu/data"
    link, sensors = LINKS[topic], scenario.sensors
    t = _sample_times(truth, sensors.imu_rate_hz, link)
    errors = iter(generator(seed, topic).normal_columns(len(t), 6).T)
    rolling = np.gradient(truth.attitude, float(truth.t[1] - truth.t[0]), axis=0)
    psi, u, v, r, u_dot, v_dot, roll, pitch, roll_dot, pitch_dot = _at(
        truth, t, truth.eta[:, 2], truth.nu, truth.nu_dot[:, :2], truth.attitude, rolling
    )
    s1, c1, s2, c2 = np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
    q = quaternion(roll, pitch, _wrapped(psi))
    rates = (roll_dot - r * s2, pitch_dot * c1 + r * c2 * s1, r * c2 * c1 - pitch_dot * s1)
    force = (u_dot - r * v + GRAVITY * s2, v_dot + r * u - GRAVITY * c2 * s1, -GRAVITY * c2 * c1)
    columns = {f"orientation.{axis}": values for axis, values in zip("xyzw", q, strict=True)}
    for field_name, std, values in (
        ("angular_velocity", radians(sensors.noise.imu_turn_degps), rates),
        ("linear_acceleration", sensors.noise.imu_acceleration_mps2, force),
    ):
        for axis, one in zip("xyz", values, strict=True):
            columns[f"{field_name}.{axis}"] = one + std * next(errors)
    return Stream(topic, "sensor_msgs/msg/Imu", "imu", *_times(scenario, seed, topic, link, t), columns=columns)


def _camera(scenario: Scenario, seed: int, truth: Truth) -> Stream:
    """Return frames of random bytes between the markers of a JPEG: bulk of no content that a reader must skip."""
    topic = "/camera/image/compressed"
    link = LINKS[topic]
    t = _sample_times(truth, scenario.sensors.camera_rate_hz, link)
    random = generator(seed, topic)
    sizes = (900.0 + np.floor(600.0 * generator(seed, f"sizes {topic}").random(len(t)))).astype(np.int64).tolist()
    return Stream(
        topic,
        "sensor_msgs/msg/CompressedImage",
        "camera",
        *_times(scenario, seed, topic, link, t),
        columns={},
        constants={"format": "jpeg"},
        blobs=tuple(b"\xff\xd8" + random.bytes(size) + b"\xff\xd9" for size in sizes),
    )
