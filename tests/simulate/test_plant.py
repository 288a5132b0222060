"""The plant against an independent formulation, hand-worked limits, symmetries and conservation."""

from __future__ import annotations

from dataclasses import replace
from math import cos, exp, pi, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from ferryid.simulate import plant
from ferryid.vessel.hull import inverse_dynamics
from ferryid.vessel.load import load_profile
from ferryid.vessel.thrusters import thrust
from ferryid.vessel.wind import wind_force

PROFILE = load_profile("milliampere")
HULL = PROFILE.hull
P = plant.hydrodynamics(HULL)
CALM = (0.0, 0.0)
STILL = (0.0,) * 6

angle = st.floats(-pi, pi)
speed = st.floats(-2.0, 2.0)
turn = st.floats(-0.5, 0.5)
states = st.tuples(st.floats(-50, 50), st.floats(-50, 50), angle, speed, speed, turn)
forces = st.tuples(st.floats(-900, 900), st.floats(-900, 900), st.floats(-1500, 1500))
flows = st.tuples(st.floats(-8, 8), st.floats(-8, 8))


def run(state, tau, seconds, h=0.02, wind=CALM, current=CALM, p=P, areas=PROFILE.wind):
    for _ in range(round(seconds / h)):
        slope = plant.rates(p, areas, state, tau, wind, current)
        state = plant.advance(p, areas, state, slope, (tau, tau), (wind, wind), current, h)
    return state


def split_rates(eta, nu, tau, wind, current):
    """Rigid body on nu, added mass and damping on nu_r, in matrices, Fossen (2021) section 10.3: no shared code."""
    m, x_g, I_z = HULL.mass_kg, HULL.x_g_m, HULL.inertia_z
    M_RB = np.array([[m, 0, 0], [0, m, m * x_g], [0, m * x_g, I_z]])
    M_A = HULL.M - M_RB

    def C(M, n):
        c13, c23 = -M[1, 1] * n[1] - 0.5 * (M[1, 2] + M[2, 1]) * n[2], M[0, 0] * n[0]
        return np.array([[0, 0, c13], [0, 0, c23], [-c13, -c23, 0]])

    c, s = np.cos(eta[2]), np.sin(eta[2])
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    nu_c = R.T @ [*current, 0.0]
    nu_c_dot = np.array([nu[2] * nu_c[1], -nu[2] * nu_c[0], 0.0])
    n = nu - nu_c
    u, v, r = np.abs(n)
    d = HULL.D
    D = -np.array(
        [
            [d["X_u"] + d["X_|u|u"] * u + d["X_uuu"] * u**2, 0, 0],
            [
                0,
                d["Y_v"] + d["Y_|v|v"] * v + d["Y_|r|v"] * r + d["Y_vvv"] * v**2,
                d["Y_r"] + d["Y_|v|r"] * v + d["Y_|r|r"] * r,
            ],
            [
                0,
                d["N_v"] + d["N_|v|v"] * v + d["N_|r|v"] * r,
                d["N_r"] + d["N_|v|r"] * v + d["N_|r|r"] * r + d["N_rrr"] * r**2,
            ],
        ]
    )
    load = wind_force(PROFILE.wind, np.array([wind]), np.array([eta[2]]), nu[None, :])[0]
    right = tau + load - C(M_RB, nu) @ nu - C(M_A, n) @ n - D @ n + M_A @ nu_c_dot
    return np.concatenate([R @ nu, np.linalg.solve(HULL.M, right)])


@settings(max_examples=60, deadline=None)
@given(states, forces, flows, st.tuples(st.floats(-1, 1), st.floats(-1, 1)))
def test_rates_equal_the_split_into_rigid_body_and_added_mass(state, tau, wind, current):
    ours = plant.rates(P, PROFILE.wind, state, tau, wind, current)
    theirs = split_rates(np.array(state[:3]), np.array(state[3:]), np.array(tau), wind, current)
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9)


def test_integrator_against_a_tight_adaptive_one():
    wind, current, seconds = (-3.0, 4.0), (0.2, -0.1), 30.0
    orders = ((620.0, 0.6), (480.0, -0.9))

    def thrusters():
        table = plant.ThrustTable.of(PROFILE.actuators[0].thrust)
        return [plant.Azimuth(x, 0.0, table, 0.4, 1e9, 0.2, 1e9) for x in (1.8, -1.8)]

    fore, aft = thrusters()
    state, h = STILL, 1.0 / 60.0
    tau = plant.total((fore.force(), aft.force()))
    for _ in range(round(seconds / h)):
        slope = plant.rates(P, PROFILE.wind, state, tau, wind, current)
        taus = []
        for _ in range(2):
            for thruster, order in zip((fore, aft), orders, strict=True):
                thruster.follow(*order, 0.5 * h)
            taus.append(plant.total((fore.force(), aft.force())))
        state = plant.advance(P, PROFILE.wind, state, slope, tuple(taus), (wind, wind), current, h)
        tau = taus[1]

    def derivative(t, y):
        tau = np.zeros(3)
        for (n, a), x in zip(orders, (1.8, -1.8), strict=True):
            F = thrust(PROFILE.actuators[0].thrust, np.array([n * (1 - exp(-t / 0.4))]))[0][0]
            b = a * (1 - exp(-t / 0.2))
            tau += [F * cos(b), F * sin(b), x * F * sin(b)]
        return split_rates(y[:3], y[3:], tau, wind, current)

    exact = solve_ivp(derivative, (0.0, seconds), np.zeros(6), method="DOP853", rtol=1e-11, atol=1e-11).y[:, -1]
    np.testing.assert_allclose(state, exact, rtol=0.0, atol=2e-6)


def test_integrator_is_of_fourth_order():
    # No velocity changes its sign here: |v| has a kink at zero, which would cost an order.
    start, tau = (0.0, 0.0, 0.3, 1.0, 0.4, 0.2), (300.0, 2500.0, 350.0)
    ends = [np.array(run(start, tau, 3.2, h, areas=None)) for h in (0.4, 0.2, 0.0125)]
    assert (ends[2][3:] > 0.0).all()
    coarse, fine = (np.abs(end - ends[2]).max() for end in ends[:2])
    assert 10.0 < coarse / fine < 26.0


def test_terminal_speed_is_where_drag_equals_thrust():
    # 27.632 + 110.064 + 13.965 = 151.661 N of drag at 1 m/s, Table 4.1.
    state = run(STILL, (151.661, 0.0, 0.0), 400.0, 0.05, areas=None)
    assert state[3] == pytest.approx(1.0, abs=1e-6)
    assert state[1:3] == (0.0, 0.0)


def test_drifts_with_the_current_and_then_feels_nothing():
    state = run((0.0, 0.0, 0.7, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 20_000.0, 0.5, current=(0.3, -0.2), areas=None)
    c, s = cos(state[2]), sin(state[2])
    assert (c * state[3] - s * state[4], s * state[3] + c * state[4]) == pytest.approx((0.3, -0.2), abs=2e-3)


@settings(max_examples=15, deadline=None)
@given(states, forces, flows, st.tuples(st.floats(-1, 1), st.floats(-1, 1)))
def test_moving_with_the_water_changes_nothing(start, tau, wind, current):
    c, s = cos(start[2]), sin(start[2])
    moved = (
        *start[:3],
        start[3] + c * current[0] + s * current[1],
        start[4] + c * current[1] - s * current[0],
        start[5],
    )
    blown = (wind[0] + current[0], wind[1] + current[1])
    still = run(start, tau, 2.0, wind=wind)
    carried = run(moved, tau, 2.0, wind=blown, current=current)
    expected = (still[0] + 2.0 * current[0], still[1] + 2.0 * current[1], still[2])
    np.testing.assert_allclose(carried[:3], expected, atol=1e-7)


@settings(max_examples=15, deadline=None)
@given(states, forces, flows, angle)
def test_turning_the_world_turns_the_track(start, tau, wind, by):
    c, s = cos(by), sin(by)
    turned = lambda x, y: (c * x - s * y, s * x + c * y)  # noqa: E731
    one = run(start, tau, 2.0, wind=wind)
    other = run((*turned(*start[:2]), start[2] + by, *start[3:]), tau, 2.0, wind=turned(*wind))
    np.testing.assert_allclose(other, (*turned(*one[:2]), one[2] + by, *one[3:]), atol=1e-8)


@settings(max_examples=15, deadline=None)
@given(states, forces, flows)
def test_port_and_starboard_are_mirror_images(start, tau, wind):
    mirror = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
    one = run(start, tau, 2.0, wind=wind)
    flipped = tuple(float(value) for value in mirror * start)
    other = run(flipped, (tau[0], -tau[1], -tau[2]), 2.0, wind=(wind[0], -wind[1]))
    np.testing.assert_allclose(other, mirror * one, atol=1e-9)


@settings(max_examples=25, deadline=None)
@given(states)
def test_a_hull_without_thrust_never_gains_energy(start):
    M = 0.5 * (HULL.M + HULL.M.T)
    p = plant.hydrodynamics(replace(HULL, M=M))
    state, before = start, np.inf
    for _ in range(40):
        nu = np.array(state[3:])
        energy = 0.5 * nu @ M @ nu
        assert energy <= before * (1.0 + 1e-12)
        before = energy
        state = run(state, (0.0, 0.0, 0.0), 0.1, p=p, areas=None)


@settings(max_examples=40, deadline=None)
@given(speed, speed, turn, speed, speed, turn)
def test_required_force_equals_the_vessel_layer(u, v, r, u_dot, v_dot, r_dot):
    ours = plant.required_force(P, u_dot, v_dot, r_dot, u, v, r)
    theirs = inverse_dynamics(HULL, np.array([[u_dot, v_dot, r_dot]]), np.array([[u, v, r]]))[0]
    np.testing.assert_allclose(ours, theirs, rtol=1e-10, atol=1e-9)


def test_base_model_is_scaled():
    still = plant.required_force(plant.hydrodynamics(HULL, 0.4, 0.0), 1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert still[0] == pytest.approx(0.4 * 2389.657)
    steady = plant.required_force(plant.hydrodynamics(HULL, 0.0, 0.4), 0.0, 0.0, 0.0, 1.0, 0.0, 0.0)
    assert steady[0] == pytest.approx(0.4 * 151.661)


def test_wind_from_ahead_and_abeam_by_hand():
    # q = 0.5 * 1.225 * 10² = 61.25 Pa; head wind: 61.25 * 0.5 * 2.9 m²; beam: 61.25 * 0.90 * 8.6 m², no moment at pi/2.
    assert plant.wind_load(PROFILE.wind, 10.0, 0.0) == pytest.approx((-61.25 * 0.5 * 2.9, 0.0, 0.0))
    X, Y, N = plant.wind_load(PROFILE.wind, 0.0, -10.0)
    assert pytest.approx((0.0, 61.25 * 0.90 * 8.6, 0.0), abs=1e-9) == (X, Y, N)
    assert plant.wind_load(PROFILE.wind, 0.0, 0.0) == (0.0, 0.0, 0.0)


@settings(max_examples=40, deadline=None)
@given(st.floats(-200, 1200), st.floats(-200, 1200), st.floats(0.01, 2), st.floats(1, 900), st.floats(0.001, 3))
def test_follow_is_the_exact_lag_with_its_rate_limit(value, order, lag, limit, h):
    n = 4000
    stepped = value
    for _ in range(n):
        rate = min(max((order - stepped) / lag, -limit), limit)
        stepped += rate * h / n
    assert plant.follow(value, order, lag, limit, h) == pytest.approx(stepped, abs=limit * h * 2e-3 + 1e-9)


def test_follow_in_two_halves_is_follow_in_one():
    half = plant.follow(plant.follow(0.0, 900.0, 0.4, 600.0, 0.7), 900.0, 0.4, 600.0, 0.7)
    assert half == pytest.approx(plant.follow(0.0, 900.0, 0.4, 600.0, 1.4), rel=1e-12)
    assert plant.follow(0.0, 10.0, 0.0, 600.0, 1.0) == 10.0


def test_thrust_table_is_the_curve_and_its_inverse():
    curve = PROFILE.actuators[0].thrust
    table = plant.ThrustTable.of(curve)
    for n in np.linspace(-1300.0, 1300.0, 301):
        assert table.force(n) == pytest.approx(thrust(curve, np.array([n]))[0][0], abs=1e-4)
    assert table.largest == pytest.approx(496.82, abs=0.01)  # (4.1) at 1050 rpm, by hand
    for force in (0.0, 1.0, 57.3, 300.0, 495.0):
        assert table.force(table.speed(force)) == pytest.approx(force, abs=1e-9)
    assert table.speed(1e4) == 1050.0
    rps = replace(curve, kind="quadratic", input_unit="rps", valid=(-10.0, 10.0), ahead=3.0, astern=2.0)
    assert plant.ThrustTable.of(rps).force(300.0) == pytest.approx(75.0, abs=1e-3)


def test_azimuth_force_and_moment():
    table = plant.ThrustTable.of(PROFILE.actuators[0].thrust)
    thruster = plant.Azimuth(1.8, 0.5, table, 0.4, 600.0, 0.2, 1.0, units=2.0, speed=700.0, angle=0.6)
    F = 2.0 * thrust(PROFILE.actuators[0].thrust, np.array([700.0]))[0][0]
    assert thruster.force() == pytest.approx(
        (F * cos(0.6), F * sin(0.6), 1.8 * F * sin(0.6) - 0.5 * F * cos(0.6)), abs=1e-3
    )
