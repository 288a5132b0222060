"""Reference filter, controller and allocation."""

from __future__ import annotations

from itertools import pairwise
from math import cos, exp, pi, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ferryid.simulate import plant
from ferryid.simulate.control import Controller, Gains, Order, Reference, ReferenceTuning, allocate
from ferryid.simulate.paths import PATHS, TWELVE_CORNER, set_points, shorter_way
from ferryid.vessel.load import load_profile

PROFILE = load_profile("milliampere")
FREE = ReferenceTuning((0.3,) * 3, (1.0,) * 3, (1e3,) * 3, (1e3,) * 3)


def thrusters():
    table = plant.ThrustTable.of(PROFILE.actuators[0].thrust)
    return [plant.Azimuth(x, 0.0, table, 0.4, 600.0, 0.2, 1.0) for x in (1.8, -1.8)]


def test_reference_is_the_critically_damped_third_order_response():
    reference = Reference(FREE)
    for k in range(400):
        wt = 0.3 * k * 0.05
        expected = 15.0 * (1.0 - exp(-wt) * (1.0 + wt + 0.5 * wt * wt))
        assert reference.pose[0] == pytest.approx(expected, abs=0.03)
        reference.advance((15.0, 0.0, 0.0), 0.05)


@settings(max_examples=20, deadline=None)
@given(st.floats(-40, 40), st.floats(-40, 40), st.floats(-pi, pi))
def test_reference_keeps_its_limits_and_arrives_without_overshoot(x, y, psi):
    tuning = ReferenceTuning()
    reference = Reference(tuning)
    for _ in range(4000):
        before = list(reference.pose)
        reference.advance((x, y, psi), 0.05)
        for i, goal in enumerate((x, y, psi)):
            assert abs(reference.speed[i]) <= tuning.speed_limit[i]
            assert abs(reference.acceleration[i]) <= tuning.acceleration_limit[i]
            assert abs(reference.pose[i] - before[i]) <= 0.05 * tuning.speed_limit[i] + 1e-12
            assert abs(reference.pose[i]) <= abs(goal) * 1.12 + 1e-9
    assert reference.pose == pytest.approx([x, y, psi], abs=1e-3)


def test_body_velocities_of_the_reference_are_consistent():
    """Finite differences of nu along a turning reference equal the nu_dot it gives."""
    reference = Reference(FREE)
    for _ in range(60):
        reference.advance((15.0, -8.0, 2.0), 0.05)
    nu, nu_dot = (np.array(part) for part in reference.body())
    reference.advance((15.0, -8.0, 2.0), 0.002)
    later, dot_later = (np.array(part) for part in reference.body())
    np.testing.assert_allclose((later - nu) / 0.002, 0.5 * (nu_dot + dot_later), atol=2e-4)


def test_on_its_reference_the_controller_is_feedforward_alone():
    reference = Reference(FREE)
    for _ in range(60):
        reference.advance((15.0, -8.0, 2.0), 0.05)
    model = plant.hydrodynamics(PROFILE.hull, 0.4, 0.4)
    nu_d, nu_dot_d = reference.body()
    tau, ahead = Controller(model, reference, Gains()).desired_force(tuple(reference.pose), nu_d, 0.05, saturated=False)
    assert tau == pytest.approx(ahead)
    assert ahead == pytest.approx(plant.required_force(model, *nu_dot_d, *nu_d))


def test_feedback_pushes_back_in_the_body_frame():
    model = plant.hydrodynamics(PROFILE.hull)
    gains = Gains(Ki=(0.0, 0.0, 0.0))
    controller = Controller(model, Reference(FREE), gains)
    # 1 m north of the goal, bow to the east: north is to port, so the push is to starboard.
    tau, _ = controller.desired_force((1.0, 0.0, pi / 2), (0.0, 0.0, 0.0), 0.05, saturated=False)
    assert tau == pytest.approx((0.0, gains.Kp[0], -gains.Kp[2] * pi / 2), abs=1e-9)
    # A heading error beyond half a turn goes the shorter way.
    tau, _ = controller.desired_force((0.0, 0.0, 1.5 * pi), (0.0, 0.0, 0.0), 0.05, saturated=False)
    assert tau[2] == pytest.approx(gains.Kp[2] * pi / 2)


def test_integral_is_limited_and_rests_when_saturated():
    gains = Gains()
    controller = Controller(plant.hydrodynamics(PROFILE.hull), Reference(FREE), gains)
    for _ in range(20_000):
        tau, _ = controller.desired_force((2.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.05, saturated=False)
    assert tau[0] == pytest.approx(-2.0 * gains.Kp[0] - gains.integral_limit[0])
    fresh = Controller(plant.hydrodynamics(PROFILE.hull), Reference(FREE), gains)
    fresh.desired_force((2.0, 0.0, 0.0), (0.0, 0.0, 0.0), 10.0, saturated=True)
    assert fresh.integral == [0.0, 0.0, 0.0]


@settings(max_examples=100, deadline=None)
@given(st.floats(-400, 400), st.floats(-300, 300), st.floats(-400, 400), st.floats(-9, 9))
def test_allocated_forces_sum_to_the_desired_force(X, Y, N, last):
    fore, aft = thrusters()
    before = (Order(0.0, last), Order(0.0, last))
    one, two, saturated = allocate((X, Y, N), fore, aft, before)
    assert not saturated
    total = np.zeros(3)
    for thruster, order in ((fore, one), (aft, two)):
        assert abs(order.angle - last) <= pi + 1e-12
        F = thruster.table.force(order.speed)
        if F >= 8.0:
            total += [F * cos(order.angle), F * sin(order.angle), thruster.x_m * F * sin(order.angle)]
        else:
            assert order.angle == last
    np.testing.assert_allclose(total, (X, Y, N), atol=2.0 * 1.8 * 8.0)
    if min(fore.table.force(order.speed) for order in (one, two)) >= 8.0:
        np.testing.assert_allclose(total, (X, Y, N), atol=1e-6)


def test_a_force_out_of_reach_is_shortened():
    fore, aft = thrusters()
    one, two, saturated = allocate((2000.0, 0.0, 0.0), fore, aft, (Order(0.0, 0.0), Order(0.0, 0.0)))
    assert saturated
    assert one.speed == two.speed == 1050.0
    assert one.angle == 0.0


def test_an_idle_thruster_keeps_its_angle():
    fore, aft = thrusters()
    one, _, _ = allocate((-4.0, 0.0, 0.0), fore, aft, (Order(100.0, 0.5), Order(100.0, 0.5)))
    assert one.angle == 0.5


def test_twelve_corner_is_table_4_3():
    path = set_points(TWELVE_CORNER, 60.0)
    assert path.duration_s == 720.0
    assert path.at(0.0)[:2] == (0.0, -15.0)
    assert path.at(59.9)[2] == pytest.approx(-pi / 2)
    assert path.at(330.0) == pytest.approx((30.0, -15.0, pi))
    assert path.at(1e6)[:2] == (0.0, 0.0)


@pytest.mark.parametrize("kind", PATHS)
def test_headings_turn_the_shorter_way(kind):
    path = set_points(PATHS[kind](), 10.0, size=2.0, rounds=3)
    headings = [0.0, *(pose[2] for pose in path.poses)]
    assert max(abs(b - a) for a, b in pairwise(headings)) <= pi + 1e-12
    assert len(path.poses) == 3 * len(PATHS[kind]())


def test_shorter_way_wraps_to_the_half_open_interval():
    assert shorter_way(pi) == pytest.approx(pi)
    assert shorter_way(-pi) == pytest.approx(pi)
    assert shorter_way(3.5 * pi) == pytest.approx(-0.5 * pi)
