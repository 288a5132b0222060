"""What sensors and navigation report of a motion that is known in closed form."""

from __future__ import annotations

from dataclasses import replace
from math import cos, pi, radians, sin

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ferryid.simulate import load_scenario
from ferryid.simulate.environment import controller_weather, wind_series
from ferryid.simulate.noise import measure, navigation_errors, navigation_sent
from ferryid.simulate.sections import Manoeuvre, Navigation, Noise, Wind
from ferryid.simulate.sensors import quaternion, sense
from ferryid.simulate.states import Control, Truth
from ferryid.vessel.load import load_profile

RADIUS_M, RATE_RADPS, SPEED_MPS = 20.0, 0.08, 1.6
QUIET = Noise(**{name: 0.0 for name in vars(Noise()) if name != "white_share"})
STEP_S = 0.02
END_S = 80.0


def scenario(**sensors):
    made = load_scenario("twelve-corner")
    return replace(made, sensors=replace(made.sensors, noise=QUIET, **sensors))


def turning(t):
    """A steady turn to starboard: the centre RADIUS_M to the east of the start, drift angle 0."""
    psi = RATE_RADPS * t
    zero = np.zeros_like(t)
    return (
        np.column_stack((RADIUS_M * np.sin(psi), RADIUS_M * (1.0 - np.cos(psi)), psi)),
        np.column_stack((zero + SPEED_MPS, zero, zero + RATE_RADPS)),
    )


def trial(**changes):
    """Truth and control of the steady turn, rolling and pitching."""
    t = np.arange(round(END_S / STEP_S)) * STEP_S
    eta, nu = turning(t)
    n = len(t)
    truth = Truth(
        t=t,
        eta=eta,
        nu=nu,
        nu_dot=np.zeros((n, 3)),
        tau=np.zeros((n, 3)),
        wave=np.zeros((n, 3)),
        attitude=np.column_stack((0.1 * np.sin(2.0 * t), 0.05 * np.cos(3.0 * t))),
        wind=np.zeros((n, 2)),
        current=np.column_stack((0.1 + 0.001 * t, -0.2 * np.ones(n))),
        payload=np.column_stack((np.where(t < 40.0, 0.0, 300.0), np.full(n, -0.5))),
        speeds=np.column_stack((t * 3.0, -t)),
        angles=np.column_stack((0.2 * t, -0.3 * t)),
    )
    m = round(END_S / 0.05)
    cycles = np.arange(m) * 0.05
    eta, nu = turning(cycles)
    nothing = np.zeros((m, 3))
    control = Control(
        t=cycles,
        t_order=cycles + STEP_S,
        measured=np.column_stack((eta, nu)),
        sent=np.ones(m, dtype=bool),
        goal=nothing,
        eta_d=nothing,
        nu_d=nothing,
        tau_d=nothing,
        feedforward=nothing,
        speeds=np.zeros((m, 2)),
        angles=np.zeros((m, 2)),
        saturated=np.zeros(m, dtype=bool),
        undefined_aims=0,
    )
    return replace(truth, **{k: v for k, v in changes.items() if k in vars(truth)}), replace(
        control, **{k: v for k, v in changes.items() if k in vars(control)}
    )


def streams(asked, **changes):
    made = sense(asked, load_profile("milliampere"), 1, *trial(**changes))
    return {stream.topic: stream for stream in made}


def taken(stream, asked):
    return (stream.stamp_ns - asked.start_ns) * 1e-9


def attitude(stream, path):
    q = np.column_stack([stream.columns[f"{path}.{axis}"] for axis in "xyzw"])
    np.testing.assert_allclose(np.sum(q * q, axis=1), 1.0, atol=1e-14)
    return Rotation.from_quat(q).as_euler("ZYX")


def test_quaternion_is_the_one_of_scipy():
    roll, pitch, yaw = np.random.default_rng(1).uniform(-1.5, 1.5, (3, 50))
    expected = Rotation.from_euler("ZYX", np.column_stack((yaw, pitch, roll))).as_quat()
    found = np.column_stack(quaternion(roll, pitch, yaw))
    np.testing.assert_allclose(found * np.sign(found[:, 3:]), expected * np.sign(expected[:, 3:]), atol=1e-14)


@pytest.mark.parametrize(
    ("topic", "path"), [("/navigation/odometry", "pose.pose.orientation"), ("/imu/data", "orientation")]
)
def test_quaternions_hold_roll_pitch_and_heading(topic, path):
    asked = scenario()
    stream = streams(asked)[topic]
    t = taken(stream, asked)
    yaw, pitch, roll = attitude(stream, path).T
    np.testing.assert_allclose(roll, 0.1 * np.sin(2.0 * t), atol=1e-4)
    np.testing.assert_allclose(pitch, 0.05 * np.cos(3.0 * t), atol=1e-4)
    assert np.abs(np.sin(0.5 * (yaw - RATE_RADPS * t))).max() < 1e-4


def test_attitude_of_the_odometry_is_as_old_as_the_rest():
    asked = scenario(navigation=Navigation(delay_s=0.2))
    stream = streams(asked)["/navigation/odometry"]
    t = np.maximum(taken(stream, asked) - 0.2, 0.0)
    np.testing.assert_allclose(attitude(stream, "pose.pose.orientation")[:, 2], 0.1 * np.sin(2.0 * t), atol=1e-4)


def test_imu_feels_rates_and_gravity_of_roll_and_pitch():
    """Body rates and specific force against the rotation matrix, differentiated."""
    asked = scenario()
    noise = replace(QUIET, imu_acceleration_mps2=0.06, imu_turn_degps=0.2)
    asked = replace(asked, sensors=replace(asked.sensors, noise=noise))
    stream = streams(asked)["/imu/data"]
    t = taken(stream, asked)
    inside = (t > 1.0) & (t < END_S - 1.0)

    def rotation(at):
        return Rotation.from_euler(
            "ZYX", np.column_stack((RATE_RADPS * at, 0.05 * np.cos(3.0 * at), 0.1 * np.sin(2.0 * at)))
        )

    h = 1e-4
    rates = (rotation(t - h).inv() * rotation(t + h)).as_rotvec() / (2.0 * h)
    down = rotation(t).inv().apply(np.array([0.0, 0.0, 9.81]))
    for i, axis in enumerate("xyz"):
        rate = stream.columns[f"angular_velocity.{axis}"] - rates[:, i]
        assert abs(rate[inside].mean()) < 2e-4
        assert rate[inside].std() == pytest.approx(radians(0.2), rel=0.05)
        centripetal = SPEED_MPS * RATE_RADPS if axis == "y" else 0.0
        force = stream.columns[f"linear_acceleration.{axis}"] + down[:, i] - centripetal
        assert abs(force[inside].mean()) < 4e-3
        assert force[inside].std() == pytest.approx(0.06, rel=0.05)


def test_current_and_payload_are_measured_where_asked():
    assert not {"/weather/current", "/payload/waterline"} & set(streams(scenario()))
    asked = scenario(current_rate_hz=2.0, payload_rate_hz=4.0)
    found = streams(asked)
    current, payload = found["/weather/current"], found["/payload/waterline"]
    np.testing.assert_allclose(current.columns["north"], 0.1 + 0.001 * taken(current, asked), atol=1e-9)
    np.testing.assert_allclose(current.columns["east"], -0.2)
    late = taken(payload, asked) > 40.1
    assert (payload.columns["mass"][late] == 300.0).all()
    assert (payload.columns["mass"][taken(payload, asked) < 39.9] == 0.0).all()
    assert (payload.columns["x"] == -0.5).all()
    noisy = replace(asked, sensors=replace(asked.sensors, noise=replace(QUIET, current_mps=0.02, payload_kg=10.0)))
    found = streams(noisy)
    assert (found["/weather/current"].columns["east"] + 0.2).std() == pytest.approx(0.02, rel=0.2)
    assert found["/payload/waterline"].columns["mass"][late].std() == pytest.approx(10.0, rel=0.2)


def test_the_thrusters_clock_moves_their_stamps_alone():
    one, two = streams(scenario()), streams(scenario(thruster_clock_offset_ms=120.0))
    for topic, stream in one.items():
        other = two[topic]
        np.testing.assert_array_equal(other.receive_ns, stream.receive_ns)
        ahead = 120_000_000 if topic in ("/thruster1/state", "/thruster2/state") else 0
        np.testing.assert_array_equal(other.stamp_ns - stream.stamp_ns, ahead)


def test_encoders_round_to_their_step():
    asked = scenario(azimuth_step_deg=1.0)
    stream = streams(asked)["/thruster1/state"]
    degrees = np.degrees(stream.columns["azimuth"])
    np.testing.assert_allclose(degrees, np.rint(degrees), atol=1e-9)
    error = stream.columns["azimuth"] - 0.2 * taken(stream, asked)
    error = np.abs(np.angle(np.exp(1j * error)))
    assert error.max() <= radians(0.5) + 1e-9
    assert error.max() > radians(0.49)


@pytest.mark.slow
def test_silences_are_as_frequent_and_as_long_as_asked():
    asked = scenario(dropouts_per_min=6.0, dropout_s=1.0)
    silent, full = streams(asked), streams(scenario())
    assert len(silent["/imu/data"].stamp_ns) == len(full["/imu/data"].stamp_ns)
    for topic in ("/thruster1/state", "/thruster2/state"):
        steps = np.diff(silent[topic].stamp_ns) * 1e-9
        long = steps[steps > 0.06]
        assert ((long > 0.999) & (long < 1.101)).all() or (long > 1.9).any()
        assert set(silent[topic].stamp_ns) < set(full[topic].stamp_ns)
    assert not np.array_equal(silent["/thruster1/state"].stamp_ns, silent["/thruster2/state"].stamp_ns)
    lost = ~navigation_sent(scenario(navigation=Navigation(dropouts_per_min=30.0, dropout_s=3.0)), 3, 400_000, 0.05)
    # On average 2 s between silences of 3 s.
    assert lost.mean() == pytest.approx(0.6, rel=0.03)
    assert not lost[0]
    assert navigation_sent(scenario(), 3, 100, 0.05).all()


def test_what_the_navigation_did_not_send_is_not_in_the_log():
    sent = np.ones(round(END_S / 0.05), dtype=bool)
    sent[300:340] = False
    found, full = streams(scenario(), sent=sent), streams(scenario())
    np.testing.assert_array_equal(found["/navigation/odometry"].stamp_ns, full["/navigation/odometry"].stamp_ns[sent])
    np.testing.assert_array_equal(
        found["/navigation/odometry"].columns["pose.pose.position.x"],
        full["/navigation/odometry"].columns["pose.pose.position.x"][sent],
    )
    assert len(found["/control/tau_d"].stamp_ns) == len(sent)


def test_navigation_without_errors_is_the_truth_plus_noise():
    state = (1.0, 2.0, 0.3, 0.4, 0.5, 0.06)
    noise = np.arange(6) * 0.001
    eta, nu = measure(navigation_errors(scenario()), noise, state)
    np.testing.assert_allclose((*eta, *nu), state + noise, rtol=1e-15)


def test_an_antenna_off_the_origin_moves_as_its_point_of_the_hull_does():
    """Its velocity, turned to NED, is the slope of its position."""
    errors = navigation_errors(scenario(navigation=Navigation(antenna_m=(2.0, -1.0))))
    t = np.array([9.999, 10.0, 10.001])
    pose, velocity = turning(t)
    seen = [measure(errors, np.zeros(6), (*e, *n)) for e, n in zip(pose.tolist(), velocity.tolist(), strict=True)]
    slope = (np.array(seen[2][0]) - np.array(seen[0][0])) / 0.002
    (_, _, psi), (u, v, r) = seen[1]
    np.testing.assert_allclose(slope, (cos(psi) * u - sin(psi) * v, sin(psi) * u + cos(psi) * v, r), atol=1e-6)
    # At heading 0 the antenna lies 2 m north and 1 m west of the origin.
    eta, nu = measure(errors, np.zeros(6), (0.0, 0.0, 0.0, 1.0, 0.0, 0.1))
    np.testing.assert_allclose((*eta, *nu), (2.0, -1.0, 0.0, 1.1, 0.2, 0.1))


def test_a_biased_heading_turns_the_velocity_and_keeps_the_course():
    errors = navigation_errors(scenario(navigation=Navigation(heading_bias_deg=10.0, yaw_rate_factor=1.1)))
    eta, nu = measure(errors, np.zeros(6), (0.0, 0.0, 0.5, 2.0, 0.0, 0.1))
    assert eta[2] == pytest.approx(0.5 + radians(10.0))
    assert nu == pytest.approx((2.0 * cos(radians(10.0)), -2.0 * sin(radians(10.0)), 0.11))
    eta, nu = measure(errors, np.zeros(6), (0.0, 0.0, 0.5, 1.0, 1.0, 0.0))
    assert eta[2] + np.arctan2(nu[1], nu[0]) == pytest.approx(0.5 + pi / 4)
    assert np.hypot(*nu[:2]) == pytest.approx(2.0**0.5)


def test_the_feedforward_gets_only_what_is_measured():
    t, cycles = np.arange(1000) * 0.02, np.arange(400) * 0.05
    wind = np.column_stack((t, np.full(1000, 3.0)))
    current, payload = np.full((1000, 2), 0.3), np.column_stack((np.full(1000, 200.0), np.ones(1000)))
    for values in controller_weather(scenario(), 1, cycles, t, wind, current, payload):
        assert not values.any()
    asked = scenario(wind_rate_hz=10.0, current_rate_hz=2.0, payload_rate_hz=1.0)
    seen_wind, seen_current, seen_payload = controller_weather(asked, 1, cycles, t, wind, current, payload)
    old = cycles - seen_wind[:, 0]
    # Held between samples of 10 Hz, each 0.045 s on its way; zero before the first.
    assert (seen_wind[:2] == 0.0).all()
    assert old[2:].min() >= 0.045 - 1e-12
    assert old[2:].max() < 0.145
    assert (seen_wind[2:, 1] == 3.0).all()
    assert (seen_current[3:] == 0.3).all()
    assert (seen_payload[4:] == (200.0, 1.0)).all()


def test_the_controller_gets_the_samples_of_the_log_once_they_are_there():
    """Current (0.08 s on its way) and payload (0.12 s), noise and all, against the streams."""
    noise = replace(QUIET, current_mps=0.02, payload_kg=10.0)
    asked = scenario(current_rate_hz=2.0, payload_rate_hz=4.0)
    asked = replace(asked, sensors=replace(asked.sensors, noise=noise))
    truth, control = trial()
    found = streams(asked)
    _, current, payload = controller_weather(asked, 1, control.t, truth.t, truth.wind, truth.current, truth.payload)
    for seen, topic, names, late_s in (
        (current, "/weather/current", ("north", "east"), 0.08),
        (payload, "/payload/waterline", ("mass", "x"), 0.12),
    ):
        stream = found[topic]
        logged = np.column_stack([stream.columns[name] for name in names])
        for k in range(0, len(seen), 7):
            there = np.flatnonzero(taken(stream, asked) + late_s <= control.t[k] + 1e-9)
            np.testing.assert_array_equal(seen[k], logged[there[-1]] if len(there) else 0.0)


def test_sensor_rates_do_not_change_the_weather():
    asked = replace(scenario(), wind=Wind(north_mps=1.0, gust_std_mps=0.8, gust_time_s=3.0))
    coarse, fine = (np.column_stack(wind_series(asked, 1, n, h)) for n, h in ((301, 0.1), (3601, 1.0 / 120.0)))
    np.testing.assert_allclose(coarse, fine[::12], atol=1e-12)
    assert coarse.std(axis=0).min() > 0.2
    # Linear within 0.02 s, so that the finer grid adds no quicker gusts.
    between = np.column_stack(wind_series(asked, 1, 1501, 0.02))
    half = np.column_stack(wind_series(asked, 1, 3001, 0.01))
    np.testing.assert_allclose(half[1::2], 0.5 * (between[1:] + between[:-1]), atol=1e-12)


def test_a_longer_trial_begins_like_a_shorter_one():
    """Every stream of it: stamps, times of receipt, values and frames."""
    asked = scenario(
        wind_rate_hz=10.0, current_rate_hz=2.0, payload_rate_hz=4.0, dropouts_per_min=6.0, navigation=Navigation()
    )
    asked = replace(asked, sensors=replace(asked.sensors, noise=Noise()))
    truth, control = trial()
    part = {
        "truth": {name: values[:2000] for name, values in vars(truth).items()},
        "control": {name: values[:799] for name, values in vars(control).items() if name != "undefined_aims"},
    }
    profile = load_profile("milliampere")
    short = sense(asked, profile, 1, replace(truth, **part["truth"]), replace(control, **part["control"]))
    for one, two in zip(short, sense(asked, profile, 1, truth, control), strict=True):
        # The last sample but one, as the rates of roll and pitch are differences.
        n = len(one.stamp_ns) - 2
        assert n > 5
        np.testing.assert_array_equal(one.stamp_ns[:n], two.stamp_ns[:n])
        np.testing.assert_array_equal(one.receive_ns[:n], two.receive_ns[:n])
        assert one.blobs[:n] == two.blobs[:n]
        for path, values in one.columns.items():
            np.testing.assert_array_equal(values[:n], two.columns[path][:n])


def test_the_reference_is_the_desired_pose_of_its_cycle():
    m = round(END_S / 0.05)
    wanted = np.column_stack((np.arange(m) * 0.1, np.arange(m) * -0.2, 0.01 * np.arange(m)))
    asked = scenario(reference_rate_hz=4.0)
    stream = streams(asked, eta_d=wanted)["/control/reference"]
    t = taken(stream, asked)
    assert np.diff(t) == pytest.approx(0.25)
    rows = np.floor(t / 0.05 + 1e-6).astype(int)
    assert stream.columns["pose.position.y"] == pytest.approx(wanted[rows, 1])
    # Level, so that the turn about z is all.
    yaw = attitude(stream, "pose.orientation")[:, 0]
    assert np.cos(yaw - wanted[rows, 2]) == pytest.approx(1.0)
    assert "/control/reference" not in streams(scenario())
    assert "/control/reference" not in streams(replace(asked, manoeuvre=Manoeuvre(kind="zigzag")))


def test_a_manoeuvre_has_no_desired_force():
    asked = scenario()
    assert "/control/tau_d" in streams(asked)
    assert set(streams(asked)) - set(streams(replace(asked, manoeuvre=Manoeuvre(kind="zigzag")))) == {"/control/tau_d"}


def test_a_recorded_wind_is_added_and_held(tmp_path):
    (tmp_path / "w.csv").write_text("time,north,east\n1,0,5\n3,2,-5\n")
    asked = scenario()
    asked = replace(asked, folder=tmp_path, wind=Wind(north_mps=10.0, series="w.csv"))
    north, east = wind_series(asked, 1, 9, 0.5)
    np.testing.assert_allclose(north, [10, 10, 10, 10.5, 11, 11.5, 12, 12, 12])
    np.testing.assert_allclose(east, [5, 5, 5, 2.5, 0, -2.5, -5, -5, -5], atol=1e-12)


def test_a_wind_gets_up_and_drops():
    asked = replace(scenario(), wind=Wind(north_mps=-3.0, gust_std_mps=0.5, from_s=1.0, until_s=3.0))
    north, east = wind_series(asked, 1, 9, 0.5)
    still = np.array([True, True, False, False, False, False, True, True, True])
    assert ((north == 0.0) & (east == 0.0)).tolist() == still.tolist()
    always = wind_series(replace(asked, wind=replace(asked.wind, from_s=0.0, until_s=1e6)), 1, 9, 0.5)
    np.testing.assert_array_equal(north[~still], always[0][~still])


def test_headings_are_wrapped_before_they_are_halved():
    """A heading of one turn more is the same quaternion, not its negative."""
    asked = scenario()
    eta = trial()[0].eta
    measured = trial()[1].measured.copy()
    measured[:, 2] += 2.0 * pi
    once, twice = (
        streams(asked, **changes)["/navigation/odometry"] for changes in ({}, {"measured": measured, "eta": eta})
    )
    np.testing.assert_allclose(
        twice.columns["pose.pose.orientation.w"], once.columns["pose.pose.orientation.w"], atol=1e-12
    )
