"""Actuators: lags, faults and losses, against small steps, quadrature and the vessel layer."""

from __future__ import annotations

from dataclasses import replace
from math import cos, exp, pi, radians, sin, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from ferryid.simulate.plant.lags import decay_of, follow, lag_weights
from ferryid.simulate.plant.thrusters import gear_of, move, thrust_load
from ferryid.simulate.sections import Fault, Thrusters
from ferryid.vessel.load import load_profile
from ferryid.vessel.profile import Actuator
from ferryid.vessel.thrusters import applied_force, thrust

PROFILE = load_profile("milliampere")
CURVE = PROFILE.actuators[0].thrust
STILL = (0.0,) * 6


def bollard(n):
    return thrust(CURVE, np.array([n]))[0][0]


def load(profile, dynamics, thrusters, nu=(0.0, 0.0, 0.0), factor=None, offset=None):
    """Return the force of the actuators as they stand, ordered to stay there."""
    k = len(profile.actuators)
    gear = gear_of(profile, dynamics, 0.02)
    states = np.array([[*row, 0.0] for row in thrusters])
    factor, offset = np.ones(k) if factor is None else factor, np.zeros(k) if offset is None else offset
    move(gear, states, states[:, :2].copy(), factor, offset, 0.02)
    return thrust_load(gear, 0, *nu)


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(st.floats(-200, 1200), st.floats(-200, 1200), st.floats(0.01, 2), st.floats(1, 900), st.floats(0.001, 3))
def test_follow_is_the_exact_lag_with_its_rate_limit(value, order, lag, limit, h):
    n = 4000
    stepped = value
    for _ in range(n):
        rate = min(max((order - stepped) / lag, -limit), limit)
        stepped += rate * h / n
    assert follow(value, order, lag, limit, h, exp(-h / lag)) == pytest.approx(stepped, abs=limit * h * 2e-3 + 1e-9)


def test_follow_in_two_halves_is_follow_in_one():
    half = follow(0.0, 900.0, 0.4, 600.0, 0.7, exp(-0.7 / 0.4))
    half = follow(half, 900.0, 0.4, 600.0, 0.7, exp(-0.7 / 0.4))
    assert half == pytest.approx(follow(0.0, 900.0, 0.4, 600.0, 1.4, exp(-1.4 / 0.4)), rel=1e-12)
    assert follow(0.0, 10.0, 0.0, 600.0, 1.0, decay_of(0.0, 1.0)) == 10.0
    assert follow(0.0, 10.0, 0.0, 5.0, 1.0, 0.0) == 5.0


@pytest.mark.parametrize("lag_s", [1e-3, 0.01, 0.039, 0.041, 0.3, 60.0])
@pytest.mark.parametrize("share", [0.5, 1.0])
def test_lag_of_a_parabola_against_quadrature(lag_s, share):
    h, old, ends = 0.02, 7.0, (3.0, -2.0, 5.0)
    parabola = np.polynomial.Polynomial.fit([0.0, 0.5 * h, h], ends, 2)
    d = share * h
    near = max(0.0, d - 40.0 * lag_s)
    exact = old * exp(-d / lag_s)
    exact += quad(lambda s: exp(-(d - s) / lag_s) / lag_s * parabola(s), near, d, epsabs=1e-13, epsrel=1e-13)[0]
    keep, *weights = lag_weights(lag_s, h, share)
    assert keep * old + np.dot(weights, ends) == pytest.approx(exact, abs=1e-11)


def test_no_lag_gives_the_input_itself():
    assert lag_weights(0.0, 0.02, 0.5) == (0.0, 0.0, 1.0, 0.0)
    assert lag_weights(0.0, 0.02, 1.0) == (0.0, 0.0, 0.0, 1.0)


def test_force_behind_speed_by_the_lag(make):
    run = make(seconds=3.0, thrusters=Thrusters(0.0, 1e9, 0.0, 1e9, force_lag_s=0.5))
    run.drive(STILL, ((700.0, 0.0), (700.0, 0.0)), 3.0)
    # The speed jumps in the first step, which a parabola follows to a part of it.
    assert run.thrusters[0, 2] == pytest.approx(bollard(700.0) * (1.0 - exp(-6.0)), rel=1e-4)


def test_orders_beyond_the_range_saturate(make):
    run = make(seconds=10.0)
    run.drive(STILL, ((5000.0, 0.3), (-5000.0, -9.0)), 10.0)
    np.testing.assert_allclose(run.thrusters[:, :2], [[1050.0, 0.3], [-1050.0, -9.0]], rtol=1e-4)


def test_azimuth_force_and_moment():
    actuator = replace(PROFILE.actuators[0], position_m=(1.8, 0.5), count=2)
    F = 2.0 * bollard(700.0)
    tau = load(replace(PROFILE, actuators=(actuator,)), Thrusters(), [(700.0, 0.6)])
    assert tau == pytest.approx((F * cos(0.6), F * sin(0.6), 1.8 * F * sin(0.6) - 0.5 * F * cos(0.6)), abs=1e-3)


def test_fixed_ones_keep_their_direction(make):
    actuators = (
        replace(PROFILE.actuators[0], name="tunnel", kind="tunnel", position_m=(2.0, 0.0), angle_rad=0.5 * pi),
        replace(PROFILE.actuators[0], name="left", kind="propeller", position_m=(-2.0, -1.0)),
        Actuator("skeg", "force", (-2.0, 1.0), angle_rad=0.3),
    )
    run = make(replace(PROFILE, actuators=actuators), seconds=10.0)
    _, rows = run.drive(STILL, ((800.0, 1.0), (-600.0, 2.0), (55.0, 3.0)), 10.0)
    T, P, S = bollard(800.0), bollard(-600.0), 55.0
    X, Y = S * cos(0.3), S * sin(0.3)
    expected = (P + X, T + Y, 2.0 * T + P - 2.0 * Y - X)
    assert tuple(rows[-1, 9:12]) == pytest.approx(expected, abs=1e-3)


def test_fault_takes_force_and_turns_it_between_its_times(make):
    fault = Fault("thruster2", 0.5, 30.0, 5.0, 8.0)
    run = make(seconds=10.0, thrusters=Thrusters(0.1, 1e6, 0.1, 1e6, faults=(fault,)))
    _, rows = run.drive(STILL, ((600.0, 0.0), (600.0, 0.0)), 10.0)
    F = bollard(600.0)
    at = lambda t: tuple(rows[round(t / 0.02), 9:12])  # noqa: E731
    assert at(4.98) == pytest.approx((2.0 * F, 0.0, 0.0), abs=1e-3)
    X, Y = 0.5 * F * cos(radians(30.0)), 0.5 * F * sin(radians(30.0))
    for t in (5.0, 7.98):
        assert at(t) == pytest.approx((F + X, Y, -1.8 * Y), abs=1e-3)
    assert at(8.0) == pytest.approx((2.0 * F, 0.0, 0.0), abs=1e-3)
    assert tuple(run.thrusters[1, :2]) == pytest.approx((600.0, 0.0))  # the sensor sees nothing of it


def test_inflow_takes_its_share_along_the_thrust():
    one = replace(PROFILE, actuators=(PROFILE.actuators[0],))
    dynamics = Thrusters(inflow_loss_per_mps=0.2)
    F, B = bollard(700.0), bollard(-700.0)
    assert load(one, dynamics, [(700.0, 0.0)], (1.5, 0.7, 0.0))[0] == pytest.approx(0.7 * F, abs=1e-3)
    assert load(one, dynamics, [(-700.0, 0.0)], (1.5, 0.0, 0.0))[0] == pytest.approx(1.3 * B, abs=1e-3)
    # Across: the sway of its own place, v + r x.
    assert load(one, dynamics, [(700.0, 0.5 * pi)], (1.0, 0.4, 0.5))[1] == pytest.approx(
        (1.0 - 0.2 * 1.3) * F, abs=1e-3
    )
    assert load(one, dynamics, [(700.0, 0.0)], (9.0, 0.0, 0.0))[0] == 0.0


def test_a_thruster_in_the_wake_of_another_loses():
    dynamics = Thrusters(interaction_fraction=0.3)
    F, G = bollard(1050.0), bollard(525.0)
    # The fore one pushes ahead: its water goes astern, straight at the aft one.
    assert load(PROFILE, dynamics, [(1050.0, 0.0), (1050.0, 0.5 * pi)])[:2] == pytest.approx((F, 0.7 * F), abs=1e-3)
    weaker = 1.0 - 0.3 * sqrt(G / F)
    assert load(PROFILE, dynamics, [(525.0, 0.0), (1050.0, 0.5 * pi)])[1] == pytest.approx(weaker * F, abs=1e-3)
    # Both across: neither meets the other's water. Aft one astern: its water goes ahead, at the fore one.
    assert load(PROFILE, dynamics, [(1050.0, 0.5 * pi)] * 2)[1] == pytest.approx(2.0 * F, abs=1e-3)
    tau = load(PROFILE, dynamics, [(1050.0, 0.5 * pi), (-1050.0, 0.0)])
    assert tau[:2] == pytest.approx((bollard(-1050.0), 0.7 * F), abs=1e-3)
    # 17 degrees beside the wake half of the loss is left.
    half = load(PROFILE, dynamics, [(1050.0, radians(17.0)), (1050.0, 0.5 * pi)])[1] - F * sin(radians(17.0))
    assert half == pytest.approx((1.0 - 0.15) * F, rel=0.01)


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(
    # No encoder tells a speed of less than this from zero, and the advance ratio at it overflows.
    st.floats(-8, 12).filter(lambda n_rps: n_rps == 0.0 or abs(n_rps) > 1e-100),
    st.floats(-0.6, 0.6),
    st.floats(-0.5, 1.5),
    st.floats(-0.5, 0.5),
    st.floats(-0.3, 0.3),
    st.booleans(),
)
def test_propeller_and_rudder_equal_the_vessel_layer(n_rps, delta, u, v, r, esso):
    profile = load_profile("esso-osaka" if esso else "kvlcc2-model")
    actuator = profile.actuators[0]
    actuator = replace(actuator, thrust=replace(actuator.thrust, valid=(-30.0, 30.0)), count=2)
    profile = replace(profile, actuators=(actuator,))
    columns = {"n_propeller": np.array([60.0 * n_rps]), "delta_propeller": np.array([delta])}
    theirs, _ = applied_force(profile, columns, np.array([[u, v, r]]))
    ours = load(profile, Thrusters(), [(60.0 * n_rps, delta)], (u, v, r))
    np.testing.assert_allclose(ours, theirs[0], rtol=1e-9, atol=1e-9)


def test_faults_reach_propeller_and_rudder():
    profile = load_profile("kvlcc2-model")
    actuator = profile.actuators[0]
    profile = replace(profile, actuators=(replace(actuator, thrust=replace(actuator.thrust, valid=(-30.0, 30.0))),))
    straight = load(profile, Thrusters(), [(600.0, 0.2)])
    same = load(profile, Thrusters(), [(600.0, 0.1)], offset=np.array([0.1]))
    assert same == pytest.approx(straight, rel=1e-12)
    # At rest the slipstream's force on the rudder goes with the thrust.
    half = load(profile, Thrusters(), [(600.0, 0.2)], factor=np.array([0.5]))
    assert half == pytest.approx(tuple(0.5 * value for value in straight), rel=1e-9)


def test_thrusters_do_not_depend_on_the_step():
    ends = []
    for h, steps in ((0.1, 10), (0.01, 100)):
        gear = gear_of(PROFILE, Thrusters(force_lag_s=0.3), h)
        states = np.zeros((2, 3))
        for _ in range(steps):
            move(gear, states, np.array([[600.0, 0.8], [-300.0, -2.0]]), np.ones(2), np.zeros(2), h)
        ends.append(states)
    np.testing.assert_allclose(ends[0][:, :2], ends[1][:, :2], rtol=1e-12)
    np.testing.assert_allclose(ends[0][:, 2], ends[1][:, 2], rtol=1e-4)
