"""What a scenario file may say, section by section: every key with its unit, default and limits.

A field's name is the key in the file; its unit ends the name. Reading is `ferryid.simulate.scenario`'s work.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

Triple = tuple[float, float, float]
"""North, east and heading; or surge, sway and yaw."""
Pair = tuple[float, float]


def limited(default: float, low: float = 0.0, high: float = 1e6) -> Any:
    """Return the field of a number that must lie between two limits."""
    return field(default=default, metadata={"low": low, "high": high, "least": low})


def signed(default: float, size: float) -> Any:
    """Return the field of a number of either sign, at most `size` large."""
    return limited(default, -size, size)


def positive(default: float, high: float = 1e6, *, least: float = 1e-3) -> Any:
    """Return the field of a number that is divided by, and so keeps a distance from zero."""
    return limited(default, least, high)


def off_or(default: float, least: float, high: float = 1e6) -> Any:
    """Return the field of a number that is 0 where there is no such thing, and otherwise at least `least`."""
    return field(default=default, metadata={"low": 0.0, "high": high, "least": least})


def chosen(default: str, *options: str) -> Any:
    """Return the field of a word out of a list; any word where the list is empty."""
    return field(default=default, metadata={"options": options})


def several(default: tuple[float, ...], low: float, high: float) -> Any:
    """Return the field of as many numbers as the default has, each between two limits."""
    return field(default=default, metadata={"low": low, "high": high, "least": low})


ALWAYS_S = 1e6
"""An end that no trial reaches [s]."""


@dataclass(frozen=True)
class Wind:
    """``[environment.wind]``: wind over ground, where the air goes to, with Ornstein-Uhlenbeck gusts on both components.

    `series` names a CSV file beside the scenario, with a header and the columns time [s], north, east [m/s]; it is added to
    the steady wind and held beyond its ends. Steady wind and gusts blow from `from_s` until `until_s`; the air is still else.
    """

    north_mps: float = signed(0.0, 60.0)
    east_mps: float = signed(0.0, 60.0)
    gust_std_mps: float = limited(0.0, 0.0, 60.0)
    gust_time_s: float = positive(8.0)
    series: str = chosen("")
    from_s: float = limited(0.0)
    until_s: float = limited(ALWAYS_S)


@dataclass(frozen=True)
class Current:
    """``[environment.current]``: current over ground, where the water goes to; it may turn, clockwise from above.

    It runs from `from_s` until `until_s`; the water is still else.
    """

    north_mps: float = signed(0.0, 10.0)
    east_mps: float = signed(0.0, 10.0)
    turn_degpmin: float = signed(0.0, 360.0)
    from_s: float = limited(0.0)
    until_s: float = limited(ALWAYS_S)


@dataclass(frozen=True)
class Waves:
    """``[environment.waves]``: long-crested sea of a JONSWAP spectrum; `direction_deg` is where the waves go to.

    `drift_coefficient` multiplies ``rho g H_s² B / 16``, the mean force of waves that are wholly reflected being of the
    order of 1; B is the width that the hull shows to the sea.
    """

    significant_height_m: float = off_or(0.0, 1e-6, 20.0)
    peak_period_s: float = limited(2.5, 0.5, 30.0)
    direction_deg: float = signed(0.0, 360.0)
    gamma: float = limited(3.3, 1.0, 10.0)
    components: int = 40
    drift_coefficient: float = limited(0.3, 0.0, 2.0)


@dataclass(frozen=True)
class Wake:
    """``[[environment.wakes]]``: the waves of one passing boat, a group that comes and goes.

    The group's height has a Gaussian envelope: `height_m` (crest to trough) at `at_s`, standard deviation `duration_s` / 4.
    """

    at_s: float = limited(60.0)
    height_m: float = off_or(0.3, 1e-6, 10.0)
    period_s: float = limited(2.0, 0.5, 30.0)
    duration_s: float = positive(20.0)
    direction_deg: float = signed(90.0, 360.0)


@dataclass(frozen=True)
class Shallow:
    """``[environment.shallow]``: a rectangle in which all damping is multiplied, blended in over `edge_m`."""

    north_m: Pair = several((0.0, 0.0), -1e5, 1e5)
    east_m: Pair = several((0.0, 0.0), -1e5, 1e5)
    damping_factor: float = limited(1.0, 0.0, 20.0)
    edge_m: float = positive(2.0, 1e3)


@dataclass(frozen=True)
class Mooring:
    """``[environment.mooring]``: a linear spring from the body origin to a point, force ``-k (p - p_0)`` in NED."""

    north_m: float = signed(0.0, 1e5)
    east_m: float = signed(0.0, 1e5)
    stiffness_north_Npm: float = limited(0.0)
    stiffness_east_Npm: float = limited(0.0)
    from_s: float = limited(0.0)
    until_s: float = limited(ALWAYS_S)


@dataclass(frozen=True)
class Payload:
    """``[[payload]]``: a mass that comes aboard at a place and leaves again, with no velocity of its own."""

    mass_kg: float = limited(0.0)
    x_m: float = signed(0.0, 1e3)
    from_s: float = limited(0.0)
    until_s: float = limited(ALWAYS_S)


@dataclass(frozen=True)
class Fouling:
    """``[fouling]``: factors on the damping of second order (``X_|u|u``, ``Y_|v|v``, ``Y_|r|v`` ...) of each axis."""

    surge: float = limited(1.0, 0.0, 20.0)
    sway: float = limited(1.0, 0.0, 20.0)
    yaw: float = limited(1.0, 0.0, 20.0)


@dataclass(frozen=True)
class Fault:
    """``[[thrusters.faults]]``: what is wrong with one thruster from a time on.

    `factor` multiplies its force; `offset_deg` is what its true angle is ahead of the one measured and ordered (turned
    clockwise from above).
    """

    thruster: str = chosen("")
    factor: float = limited(1.0, 0.0, 3.0)
    offset_deg: float = signed(0.0, 180.0)
    from_s: float = limited(0.0)
    until_s: float = limited(ALWAYS_S)


@dataclass(frozen=True)
class Thrusters:
    """``[thrusters]``: dynamics and losses that all of them share.

    Speed, angle and rudder follow their orders with first-order lags and rate limits. `force_lag_s` is the lag of the force
    behind the measured speed. `inflow_loss_per_mps` takes the share ``k V_a`` off the force, V_a the water's velocity
    against the thrust. `interaction_fraction` is the loss where one thruster's wake points straight at another.
    """

    speed_lag_s: float = off_or(0.4, 1e-3, 60.0)
    speed_rate_rpmps: float = positive(600.0, least=1e-6)
    azimuth_lag_s: float = off_or(0.2, 1e-3, 60.0)
    azimuth_rate_degps: float = positive(60.0, least=1e-6)
    rudder_lag_s: float = off_or(0.2, 1e-3, 60.0)
    rudder_rate_degps: float = positive(20.0, least=1e-6)
    force_lag_s: float = off_or(0.0, 1e-3, 60.0)
    inflow_loss_per_mps: float = limited(0.0, 0.0, 2.0)
    interaction_fraction: float = limited(0.0, 0.0, 1.0)
    faults: tuple[Fault, ...] = ()


@dataclass(frozen=True)
class Noise:
    """``[sensors.noise]``: standard deviations, Aurlien (2021), Table 5.2, then the other sensors.

    `white_share` is the part of the navigation's standard deviations that is white; the rest is coloured. `acceleration_mps2`
    and `yaw_acceleration_degps2` are those of the time derivative of the velocities' coloured noise; the IMU's own noise is
    `imu_acceleration_mps2` and `imu_turn_degps`, white, on each axis.
    """

    position_m: float = off_or(0.02, 1e-9)
    heading_deg: float = off_or(0.2, 1e-9)
    velocity_mps: float = off_or(0.05, 1e-9)
    yaw_rate_degps: float = off_or(0.2, 1e-9)
    acceleration_mps2: float = off_or(0.01, 1e-9)
    yaw_acceleration_degps2: float = off_or(0.1, 1e-9)
    white_share: float = limited(0.1, 0.0, 1.0)
    attitude_deg: float = off_or(0.05, 1e-9)
    imu_acceleration_mps2: float = off_or(0.03, 1e-9)
    imu_turn_degps: float = off_or(0.115, 1e-9)
    speed_rpm: float = off_or(1.0, 1e-9)
    azimuth_deg: float = off_or(0.05, 1e-9)
    wind_speed_mps: float = off_or(0.15, 1e-9)
    wind_direction_deg: float = off_or(1.5, 1e-9)
    current_mps: float = off_or(0.02, 1e-9)
    payload_kg: float = off_or(10.0, 1e-9)


@dataclass(frozen=True)
class Navigation:
    """``[sensors.navigation]``: systematic errors of the navigation, on which the controller acts as well.

    Position and velocity are those of the antenna at `antenna_m` (x forward, y starboard of the body origin), not corrected
    for. `delay_s` makes every state that much older than its stamp. In a dropout nothing is sent for `dropout_s`; the
    controller goes on with the last state.
    """

    antenna_m: Pair = several((0.0, 0.0), -100.0, 100.0)
    heading_bias_deg: float = signed(0.0, 180.0)
    yaw_rate_factor: float = limited(1.0, 0.0, 10.0)
    delay_s: float = limited(0.0, 0.0, 5.0)
    dropouts_per_min: float = off_or(0.0, 1e-6, 60.0)
    dropout_s: float = off_or(1.0, 1e-3, 60.0)


@dataclass(frozen=True)
class Sensors:
    """``[sensors]``: rates (0 leaves a topic out), clocks and resolutions.

    `clock_offset_ms` is how far the recorder's clock is ahead of all senders'; `thruster_clock_offset_ms` how far the
    thrusters' clock is ahead of the navigation's. `azimuth_step_deg` rounds measured azimuth angles to multiples of it, 1 for
    encoders read as integers (Aurlien 2021, section 4.8), 0 for none.
    """

    navigation_rate_hz: float = positive(20.0, 200.0, least=0.01)
    thruster_rate_hz: float = positive(20.0, 200.0, least=0.01)
    wind_rate_hz: float = off_or(0.0, 0.01, 200.0)
    current_rate_hz: float = off_or(0.0, 0.01, 200.0)
    payload_rate_hz: float = off_or(0.0, 0.01, 200.0)
    reference_rate_hz: float = off_or(0.0, 0.01, 200.0)
    imu_rate_hz: float = off_or(100.0, 0.01, 1000.0)
    camera_rate_hz: float = off_or(1.0, 0.01, 1000.0)
    clock_offset_ms: float = signed(0.0, 1e6)
    thruster_clock_offset_ms: float = signed(0.0, 1e4)
    azimuth_step_deg: float = off_or(0.0, 1e-3, 45.0)
    dropouts_per_min: float = off_or(0.0, 1e-6, 60.0)
    dropout_s: float = off_or(1.0, 1e-3, 60.0)
    navigation: Navigation = field(default_factory=Navigation)
    noise: Noise = field(default_factory=Noise)


@dataclass(frozen=True)
class ReferenceTuning:
    """``[controller.reference]``: third-order reference filter, per degree of freedom."""

    omega_radps: Triple = several((0.22, 0.22, 0.22), 0.0, 20.0)
    damping: Triple = several((1.0, 1.0, 1.0), 0.0, 1e6)
    speed_limit: Triple = several((0.8, 0.6, 0.15), 0.0, 1e6)
    acceleration_limit: Triple = several((0.1, 0.1, 0.03), 0.0, 1e6)


@dataclass(frozen=True)
class Gains:
    """PID gains for north/east [N/m], heading [N·m/rad], and the body-fixed rates; `integral_limit` in N, N, N·m."""

    Kp: Triple = several((200.0, 200.0, 700.0), 0.0, 1e9)
    Kd: Triple = several((700.0, 700.0, 2200.0), 0.0, 1e9)
    Ki: Triple = several((8.0, 8.0, 25.0), 0.0, 1e9)
    integral_limit: Triple = several((250.0, 250.0, 350.0), 0.0, 1e9)


@dataclass(frozen=True)
class Control:
    """``[controller]``: feedforward model, feedback gains, allocation.

    The feedforward is the profile's hull scaled by `delta` (M, C) and `sigma` (D), (4.2)-(4.4), or the ferryid model in the
    file `model` (a path relative to the scenario), which uses wind, current and payload where these are measured.
    """

    delta: float = limited(1.0, 0.0, 10.0)
    sigma: float = limited(1.0, 0.0, 10.0)
    model: str = chosen("")
    allocation: str = chosen("auto", "auto", "nsca", "pseudo-inverse")
    gains: Gains = field(default_factory=Gains)
    reference: ReferenceTuning = field(default_factory=ReferenceTuning)


@dataclass(frozen=True)
class Guidance:
    """``[guidance]``: how the points of the path become the reference filter's goal.

    ``set-points`` asks for one after the other, `dwell_s` each (the path's). The others follow the path through the points:
    ``look-ahead`` aims `look_ahead_m` along the path from the vessel's projection, ``enclosure`` at where the path leaves a
    circle of `look_ahead_m` around the vessel (Fossen 2021, ch. 12), ``carrot`` as in Aurlien (2021), Appendix B. A point
    is passed at `radius_m`.
    """

    law: str = chosen("set-points", "set-points", "look-ahead", "enclosure", "carrot")
    radius_m: float = positive(5.0, 1e4)
    look_ahead_m: float = positive(10.0, 1e4)


@dataclass(frozen=True)
class Manoeuvre:
    """``[manoeuvre]``, in place of ``[path]``: orders straight to the actuators, with no feedback but what the test defines.

    ``zigzag``: ahead at `speed_rpm` for `lead_s`, then the helm swings to ±`helm_deg` whenever the heading has changed by
    `heading_deg` to that side. ``turning-circle``: the same lead, then the helm stays at `helm_deg`. ``on-the-spot-turn``:
    every azimuth thruster pushes across, so that their moments add up, at `speed_rpm`, after the lead the other way round,
    changing every `hold_s`. ``rpm-steps``: straight ahead through `levels` (shares of `speed_rpm`), `hold_s` each, over
    and over. The helm is the angle of the azimuth thrusters or rudders aft of the body origin, positive turning to
    starboard. An actuator whose force is ordered directly takes `speed_rpm` for N.
    """

    kind: str = chosen("", "zigzag", "turning-circle", "on-the-spot-turn", "rpm-steps")
    speed_rpm: float = limited(500.0, 0.0, 1e5)
    helm_deg: float = signed(20.0, 180.0)
    heading_deg: float = limited(20.0, 0.0, 180.0)
    lead_s: float = limited(30.0)
    hold_s: float = positive(30.0, least=0.1)
    levels: tuple[float, ...] = (0.4, 0.8, 0.2, 1.0, 0.0, -0.4)
    duration_s: float = positive(600.0)
