"""A whole trial: the loop follows its path, the sensors report the truth with their noise, the data is worth fitting."""

from __future__ import annotations

from dataclasses import replace
from math import pi, radians

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.simulate import list_scenarios, load_scenario, simulate
from ferryid.simulate.environment import Link
from ferryid.simulate.sections import Control as Controller
from ferryid.simulate.sections import Noise, Thrusters
from ferryid.simulate.sensors import _times, apparent_wind
from ferryid.simulate.trial import sail
from ferryid.vessel.hull import inverse_dynamics
from ferryid.vessel.load import load_profile

QUIET = Noise(**dict.fromkeys(vars(Noise()), 0.0))


@pytest.fixture(scope="module")
def trial():
    return simulate(replace(load_scenario("twelve-corner-wind"), duration_s=240.0))


@pytest.fixture(scope="module")
def calm():
    """Without wind or noise: what is left is the physics."""
    scenario = load_scenario("twelve-corner")
    wind = replace(scenario.wind, north_mps=0.0, east_mps=0.0, gust_std_mps=0.0)
    sensors = replace(scenario.sensors, noise=QUIET)
    return simulate(replace(scenario, duration_s=240.0, sensors=sensors, wind=wind))


def stream(simulation, topic):
    return next(stream for stream in simulation.streams if stream.topic == topic)


def at(simulation, values, stamp_ns):
    t = (stamp_ns - simulation.scenario.start_ns) * 1e-9
    return np.interp(t, simulation.truth.t, values)


def test_without_noise_the_truth_obeys_the_equations_of_motion(calm):
    """M nu_dot + C nu + D nu - wind resistance equals the applied force, with nu_dot differentiated from the track."""
    truth, hull = calm.truth, calm.profile.hull
    nu_dot = np.gradient(truth.nu, truth.t, axis=0)
    np.testing.assert_allclose(nu_dot[5:-5], truth.nu_dot[5:-5], atol=0.01)
    needed = inverse_dynamics(hull, truth.nu_dot, truth.nu)
    # Only the air's own resistance is left: at most q C A with 1.2 m/s and 8.6 m².
    assert np.abs(needed - truth.tau)[:, :2].max() < 0.5 * 1.225 * 1.2**2 * 8.6


def test_the_full_model_follows_better_than_the_scaled_one(calm):
    def miss(simulation):
        every = len(simulation.truth.t) // len(simulation.control.t)
        return np.sqrt(np.mean((simulation.truth.eta[::every] - simulation.control.eta_d)[:, :2] ** 2))

    quick = Thrusters(speed_lag_s=0.02, speed_rate_rpmps=1e5, azimuth_lag_s=0.02, azimuth_rate_degps=1e5)
    full = simulate(replace(calm.scenario, controller=Controller(), thrusters=quick))
    assert miss(full) < 0.1
    assert miss(full) < 0.5 * miss(calm)


CLOSED = [name for name in list_scenarios() if not load_scenario(name).manoeuvre.kind]


@pytest.mark.slow
@pytest.mark.parametrize("name", CLOSED)
def test_bundled_scenarios_stay_on_their_path(name):
    scenario = load_scenario(name)
    truth, control = sail(scenario, load_profile(scenario.vessel), scenario.seed)
    miss = np.abs(truth.eta[:: len(truth.t) // len(control.t)] - control.eta_d)
    assert miss[:, :2].max() < 4.0
    assert miss[:, 2].max() < radians(40.0)
    assert control.saturated.mean() < 0.15


def test_thrusters_keep_their_rates(trial):
    truth, thrusters = trial.truth, trial.scenario.thrusters
    step = np.diff(truth.t)[:, None]
    assert (np.abs(np.diff(truth.speeds, axis=0)) / step).max() <= thrusters.speed_rate_rpmps * (1 + 1e-9)
    assert (np.abs(np.diff(truth.angles, axis=0)) / step).max() <= radians(thrusters.azimuth_rate_degps) * (1 + 1e-9)


def test_same_seed_same_trial_another_seed_another(trial):
    short = replace(trial.scenario, duration_s=20.0)
    one, same, other = simulate(short), simulate(short), simulate(short, seed=1)
    np.testing.assert_array_equal(one.truth.eta, same.truth.eta)
    assert np.abs(one.truth.eta - other.truth.eta).max() > 1e-3
    assert other.seed == 1


def test_odometry_is_the_truth_with_the_noise_of_table_5_2(trial):
    odometry = stream(trial, "/navigation/odometry")
    psi = 2.0 * np.arctan2(odometry.columns["pose.pose.orientation.z"], odometry.columns["pose.pose.orientation.w"])
    errors = {
        0.02: odometry.columns["pose.pose.position.x"] - at(trial, trial.truth.eta[:, 0], odometry.stamp_ns),
        0.05: odometry.columns["twist.twist.linear.y"] - at(trial, trial.truth.nu[:, 1], odometry.stamp_ns),
        radians(0.2): odometry.columns["twist.twist.angular.z"] - at(trial, trial.truth.nu[:, 2], odometry.stamp_ns),
    }
    for std, error in errors.items():
        assert error.std() == pytest.approx(std, rel=0.35)
    heading = psi - at(trial, trial.truth.eta[:, 2], odometry.stamp_ns)
    assert np.abs(np.sin(heading)).max() < radians(0.2) * 5
    assert np.cos(heading).min() > 0.99


def test_thruster_feedback_is_the_truth_and_wrapped(trial):
    for index in (0, 1):
        state = stream(trial, f"/thruster{index + 1}/state")
        assert np.abs(state.columns["azimuth"]).max() <= pi
        angle = state.columns["azimuth"] - at(trial, trial.truth.angles[:, index], state.stamp_ns)
        assert np.sin(angle).std() == pytest.approx(radians(0.05), rel=0.1)
        assert np.cos(angle).min() > 0.9999
        speed = state.columns["speed"] - at(trial, trial.truth.speeds[:, index], state.stamp_ns)
        assert speed.std() == pytest.approx(1.0, rel=0.1)


def test_orders_come_before_their_effect(calm):
    """The thruster's speed is the order through the lag that the scenario states, from the order's own stamp on."""
    command = stream(calm, "/thruster1/command")
    t = (command.stamp_ns - calm.scenario.start_ns) * 1e-9
    first = np.flatnonzero(calm.truth.speeds[:, 0] > 0.0)[0]
    assert calm.truth.t[first] > t[0]
    assert calm.truth.t[first] < t[0] + 0.05


def test_times_are_realistic(trial):
    period = {"/navigation/odometry": 0.05, "/imu/data": 0.01, "/weather/wind": 0.1, "/thruster2/state": 0.05}
    for s in trial.streams:
        late = s.receive_ns - s.stamp_ns
        assert late.min() > 0
        assert late.std() > 1e4
        assert (np.diff(s.receive_ns) >= 0).all()
        if s.topic in period:
            assert np.median(np.diff(s.stamp_ns)) == pytest.approx(period[s.topic] * 1e9, abs=2)
    assert stream(trial, "/navigation/odometry").stamp_ns[0] == trial.scenario.start_ns


def test_clock_offset_shifts_the_recorder_alone(trial):
    short = replace(trial.scenario, duration_s=5.0)
    ahead = replace(short, sensors=replace(short.sensors, clock_offset_ms=250.0))
    for one, two in zip(simulate(short).streams, simulate(ahead).streams, strict=True):
        np.testing.assert_array_equal(one.stamp_ns, two.stamp_ns)
        np.testing.assert_allclose(two.receive_ns - one.receive_ns, 250_000_000, atol=2)


def test_apparent_wind_by_hand():
    wind = np.array([[-5.0, 0.0], [0.0, -5.0], [0.0, 0.0], [-5.0, 0.0]])
    psi = np.array([0.0, 0.0, 0.0, pi / 2])
    nu = np.array([[2.0, 0, 0], [0.0, 0, 0], [2.0, 0, 0], [0.0, 0, 0]])
    speed, direction = apparent_wind(wind, psi, nu)
    # Ahead and stronger; from the east, that is starboard; own motion; bow to the east, wind from the north: port.
    np.testing.assert_allclose(speed, [7.0, 5.0, 2.0, 5.0])
    np.testing.assert_allclose(direction, [0.0, pi / 2, 0.0, -pi / 2], atol=1e-12)


def test_anemometer_tells_the_true_wind_with_motion_taken_out(trial):
    wind = stream(trial, "/weather/wind")
    psi = at(trial, trial.truth.eta[:, 2], wind.stamp_ns)
    u, v = (at(trial, trial.truth.nu[:, i], wind.stamp_ns) for i in (0, 1))
    speed, direction = (wind.columns[name].astype(float) for name in ("speed", "direction"))
    u_w, v_w = u - speed * np.cos(direction), v - speed * np.sin(direction)
    north, east = np.cos(psi) * u_w - np.sin(psi) * v_w, np.sin(psi) * u_w + np.cos(psi) * v_w
    assert north.mean() == pytest.approx(trial.truth.wind[:, 0].mean(), abs=0.05)
    assert east.mean() == pytest.approx(trial.truth.wind[:, 1].mean(), abs=0.05)


def test_imu_feels_gravity_and_the_turn(trial):
    imu = stream(trial, "/imu/data")
    assert imu.columns["linear_acceleration.z"].mean() == pytest.approx(-9.81, abs=0.01)
    turn = imu.columns["angular_velocity.z"] - at(trial, trial.truth.nu[:, 2], imu.stamp_ns)
    assert turn.std() == pytest.approx(0.002, rel=0.05)


@pytest.mark.slow
def test_the_trial_tells_the_hull_from_the_scaled_base_model():
    """Ordinary least squares on the logged motion brings the force error far below the scaled model's, on other data."""
    scenario = replace(load_scenario("twelve-corner"), duration_s=720.0)
    hull = load_profile("milliampere").hull
    base = replace(hull, M=0.4 * hull.M, D={name: 0.4 * value for name, value in hull.D.items()})

    def table(simulation):
        window = np.ones(21) / 21

        def smooth(columns):
            return np.column_stack([np.convolve(column, window, "valid") for column in columns.T])

        control, truth = simulation.control, simulation.truth
        nu = smooth(control.measured[:, 3:])
        tau = smooth(np.column_stack([np.interp(control.t, truth.t, column) for column in truth.tau.T]))
        nu_dot = np.gradient(nu, 0.05, axis=0)
        u, v, r = nu.T
        X = [*nu_dot.T, u, v, r, u * v, u * r, v * r, abs(u) * u, abs(v) * v, abs(r) * r, abs(r) * v, abs(v) * r]
        return np.column_stack([*X, np.ones(len(u))]), tau - inverse_dynamics(base, nu_dot, nu)

    X, Y = table(simulate(scenario))
    X_new, Y_new = table(simulate(scenario, seed=99))
    theta = np.linalg.lstsq(X, Y, rcond=None)[0]
    left = np.mean((Y_new - X_new @ theta) ** 2, axis=0) / np.mean(Y_new**2, axis=0)
    assert (left < 0.5).all()
    assert theta[0, 0] == pytest.approx(0.6 * 2389.657, rel=0.2)


def test_vessels_that_cannot_be_simulated_are_refused():
    scenario = load_scenario("twelve-corner")
    with pytest.raises(FerryIdError, match=r"^twelve-corner\.toml:\d+: the simulator needs the hull's damping"):
        simulate(replace(scenario, vessel="vtec-usv"))
    with pytest.raises(FerryIdError, match=r"^twelve-corner\.toml:\d+: a trial needs at least two control cycles"):
        simulate(replace(scenario, duration_s=0.01))


def test_a_wild_scenario_still_gives_finite_numbers():
    """Gains and noise far from any sense saturate the thrusters; nothing overflows."""
    scenario = load_scenario("twelve-corner-wind")
    control = scenario.controller
    wild = replace(
        scenario,
        duration_s=20.0,
        controller=replace(
            control,
            gains=replace(control.gains, Kp=(1e6,) * 3, Kd=(1e6,) * 3, Ki=(1e6,) * 3),
            reference=replace(control.reference, omega_radps=(20.0,) * 3, speed_limit=(1e6,) * 3),
        ),
        wind=replace(scenario.wind, north_mps=60.0, gust_std_mps=60.0),
        sensors=replace(
            scenario.sensors,
            navigation_rate_hz=1.0,
            noise=replace(scenario.sensors.noise, velocity_mps=1e6, position_m=1e6),
        ),
    )
    simulation = simulate(wild)
    assert simulation.control.saturated.any()
    for values in (*vars(simulation.truth).values(), simulation.control.tau_d):
        assert np.isfinite(values).all()


def test_imu_feels_the_acceleration_over_ground(calm):
    """Its horizontal reading, turned to NED and averaged, is the slope of the true velocity over ground."""
    imu, truth = stream(calm, "/imu/data"), calm.truth
    c, s = np.cos(truth.eta[:, 2]), np.sin(truth.eta[:, 2])
    velocity = np.column_stack((c * truth.nu[:, 0] - s * truth.nu[:, 1], s * truth.nu[:, 0] + c * truth.nu[:, 1]))
    slope = np.gradient(velocity, truth.t, axis=0)
    body = np.column_stack((c * slope[:, 0] + s * slope[:, 1], c * slope[:, 1] - s * slope[:, 0]))
    for axis, expected in zip(("x", "y"), body.T, strict=True):
        error = imu.columns[f"linear_acceleration.{axis}"] - at(calm, expected, imu.stamp_ns)
        moved = np.abs(at(calm, truth.nu[:, 2], imu.stamp_ns)) > 0.08
        assert moved.sum() > 500
        assert abs(error[moved].mean()) < 0.005
        assert np.corrcoef(error[moved], at(calm, truth.nu[:, 2] * truth.nu[:, 0], imu.stamp_ns)[moved])[0, 1] < 0.2


def test_a_topic_never_arrives_out_of_order():
    stamp, receive = _times(load_scenario("four-corner"), 1, "late", Link(0.0, 0.1, 0.5), np.arange(200) * 0.01)
    assert (np.diff(stamp) > 0).all()
    assert (np.diff(receive) >= 0).all()
    assert (receive > stamp).all()


def test_the_controller_uses_the_scaled_model():
    """The reference does not depend on the model, so that the feedforward scales with delta = sigma."""
    scenario = replace(load_scenario("twelve-corner"), duration_s=10.0)
    one, half = (simulate(replace(scenario, controller=Controller(k, k))).control.feedforward for k in (1.0, 0.5))
    assert np.abs(one).max() > 100.0
    np.testing.assert_allclose(half, 0.5 * one, rtol=1e-12, atol=1e-12)
