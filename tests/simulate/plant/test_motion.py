"""The vessel in motion against an independent formulation, limits, symmetries and conservation."""

from __future__ import annotations

from dataclasses import replace
from math import cos, exp, pi, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial.legendre import leggauss
from scipy.integrate import solve_ivp

from ferryid.errors import FerryIdError
from ferryid.simulate.sections import (
    Current,
    Fault,
    Fouling,
    Mooring,
    Payload,
    Shallow,
    Thrusters,
    Wake,
    Waves,
    Wind,
)
from ferryid.vessel.load import load_profile
from ferryid.vessel.thrusters import thrust
from ferryid.vessel.wind import wind_force

PROFILE = load_profile("milliampere")
HULL = PROFILE.hull
STILL = (0.0,) * 6
NONE = (0.0, 0.0, 0.0)
AIRLESS = replace(PROFILE, wind=None)

angle = st.floats(-pi, pi)
speed = st.floats(-2.0, 2.0)
turn = st.floats(-0.5, 0.5)
states = st.tuples(st.floats(-50, 50), st.floats(-50, 50), angle, speed, speed, turn)
forces = st.tuples(st.floats(-900, 900), st.floats(-900, 900), st.floats(-1500, 1500))
flows = st.tuples(st.floats(-8, 8), st.floats(-8, 8))
streams = st.tuples(st.floats(-1, 1), st.floats(-1, 1))


def skew(M, n):
    c13, c23 = -M[1, 1] * n[1] - 0.5 * (M[1, 2] + M[2, 1]) * n[2], M[0, 0] * n[0]
    return np.array([[0, 0, c13], [0, 0, c23], [-c13, -c23, 0]])


def split_rates(eta, nu, tau, wind, current, *, turning=0.0, payload=(0.0, 0.0), shallow=1.0):
    """Rigid body on nu, added mass and damping on nu_r, in matrices, Fossen (2021) section 10.3: no shared code."""
    m, x_g, I_z = HULL.mass_kg, HULL.x_g_m, HULL.inertia_z
    M_RB = np.array([[m, 0, 0], [0, m, m * x_g], [0, m * x_g, I_z]])
    M_A = HULL.M - M_RB
    extra, place = payload
    M_RB = M_RB + extra * np.array([[1, 0, 0], [0, 1, place], [0, place, place**2]])
    c, s = np.cos(eta[2]), np.sin(eta[2])
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    V = np.array([*current, 0.0])
    nu_c = R.T @ V
    V_dot = R.T @ (turning * np.array([-V[1], V[0], 0.0]))
    nu_c_dot = np.array([nu[2] * nu_c[1], -nu[2] * nu_c[0], 0.0]) + V_dot
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
    right = tau + load - skew(M_RB, nu) @ nu - skew(M_A, n) @ n - shallow * D @ n + M_A @ nu_c_dot
    # Archimedes in accelerating water: the vessel displaces its own mass, and what carries its weight goes through its centre.
    right += M_RB @ V_dot
    return np.concatenate([R @ nu, np.linalg.solve(M_RB + M_A, right)])


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(states, forces, flows, streams, st.floats(-90, 90), st.floats(0, 900), st.floats(-2, 2))
def test_rates_equal_the_split_into_rigid_body_and_added_mass(adrift, state, tau, wind, current, turning, mass, place):
    run = adrift(
        seconds=0.02,
        wind=Wind(*wind),
        current=Current(*current, turning),
        payload=(Payload(mass, place),),
    )
    _, rows = run.push(state, tau, 0.02)
    theirs = split_rates(
        np.array(state[:3]),
        np.array(state[3:]),
        np.array(tau),
        wind,
        current,
        turning=np.radians(turning) / 60.0,
        payload=(mass, place),
    )
    np.testing.assert_allclose(rows[0, 6:9], theirs[3:], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(rows[0, 9:12], tau, rtol=1e-12, atol=1e-9)


def pressure_force(sea, t, x, y, psi):
    """Wave force: Gauss-Legendre quadrature of the pressure over the sides of the box, and added mass for diffraction."""
    L, B, T = sea.box
    points, weights = leggauss(24)
    k = 2.0 * pi * np.hypot(sea.north, sea.east)
    # Amplitudes cannot be read from the table without trusting it: they follow from the scenario.
    a = sea_amplitude * np.ones(len(k))
    toward = np.arctan2(sea.east, sea.north) - psi

    def p(xb, yb, z):
        along = np.cos(toward) * xb[..., None] + np.sin(toward) * yb[..., None]
        phase = 2.0 * pi * (sea.frequency * t - sea.north * x - sea.east * y + sea.phase)
        return 1000.0 * 9.81 * (a * np.exp(k * z[..., None]) * np.cos(phase - k * along)).sum(-1)

    z, wz = 0.5 * T * (points - 1.0), 0.5 * T * weights
    xs, wx = 0.5 * L * points, 0.5 * L * weights
    ys, wy = 0.5 * B * points, 0.5 * B * weights
    Y, Z = np.meshgrid(ys, z, indexing="ij")
    W = np.outer(wy, wz)
    bow, stern = (p(np.full_like(Y, end), Y, Z) for end in (0.5 * L, -0.5 * L))
    X = -(W * (bow - stern)).sum()
    N = (W * Y * (bow - stern)).sum()
    Xs, Z = np.meshgrid(xs, z, indexing="ij")
    W = np.outer(wx, wz)
    starboard, port = (p(Xs, np.full_like(Xs, end), Z) for end in (0.5 * B, -0.5 * B))
    froude_krylov = np.array([X, -(W * (starboard - port)).sum(), N - (W * Xs * (starboard - port)).sum()])
    m = 1000.0 * L * B * T
    inertia = np.array([m, m, m * (L**2 + B**2) / 12.0])
    return froude_krylov * (inertia + np.diag(HULL.M) - [HULL.mass_kg, HULL.mass_kg, HULL.inertia_z]) / inertia


WAVES = Waves(significant_height_m=0.2, peak_period_s=3.0, direction_deg=50.0, components=6, drift_coefficient=0.0)
sea_amplitude = 0.2 / 4.0 * np.sqrt(2.0 / 6.0)


@pytest.mark.slow
@pytest.mark.parametrize(("waves", "tolerance"), [(Waves(), 2e-6), (WAVES, 2e-5)])
def test_integrator_against_a_tight_adaptive_one(make, waves, tolerance):
    """All of it at once; the table of wave force over heading is the only approximation."""
    wind, current, seconds, h = (-3.0, 4.0), (0.2, -0.1), 20.0, 1.0 / 60.0
    orders = ((620.0, 0.6), (480.0, -0.9))
    run = make(
        h=h,
        seconds=seconds,
        wind=Wind(*wind),
        current=Current(*current, 30.0),
        waves=waves,
        payload=(Payload(200.0, 1.0),),
        mooring=Mooring(1.0, -2.0, 20.0, 10.0),
        shallow=Shallow((-100.0, 100.0), (-100.0, 100.0), 1.7),
        thrusters=Thrusters(0.4, 1e9, 0.2, 5e4, inflow_loss_per_mps=0.2, faults=(Fault("thruster2", 0.7, 10.0),)),
    )
    state, _ = run.drive(STILL, orders, seconds)
    turning = np.radians(30.0) / 60.0

    def derivative(t, y):
        eta, nu = y[:3], y[3:]
        c, s = cos(turning * t), sin(turning * t)
        V = c * current[0] - s * current[1], s * current[0] + c * current[1]
        c, s = cos(eta[2]), sin(eta[2])
        body = nu - [c * V[0] + s * V[1], c * V[1] - s * V[0], 0.0]
        tau = np.zeros(3)
        for (n, a), x, factor, offset in zip(orders, (1.8, -1.8), (1.0, 0.7), (0.0, 10.0), strict=True):
            F = factor * thrust(PROFILE.actuators[0].thrust, np.array([n * (1 - exp(-t / 0.4))]))[0][0]
            b = a * (1 - exp(-t / 0.2)) + np.radians(offset)
            F *= 1.0 - 0.2 * (body[0] * cos(b) + (body[1] + x * body[2]) * sin(b))
            tau += [F * cos(b), F * sin(b), x * F * sin(b)]
        north, east = -20.0 * (eta[0] - 1.0), -10.0 * (eta[1] + 2.0)
        tau += [c * north + s * east, c * east - s * north, 0.0]
        if waves.significant_height_m:
            tau += pressure_force(run.plant.sea, t, *eta)
        return split_rates(eta, nu, tau, wind, V, turning=turning, payload=(200.0, 1.0), shallow=1.7)

    exact = solve_ivp(derivative, (0.0, seconds), np.zeros(6), method="DOP853", rtol=1e-9, atol=1e-9).y[:, -1]
    np.testing.assert_allclose(state, exact, rtol=0.0, atol=tolerance)


@pytest.mark.slow
def test_integrator_is_of_fourth_order(adrift):
    # No velocity changes its sign here: |v| has a kink at zero, which would cost an order.
    start, tau = (0.0, 0.0, 0.3, 1.0, 0.4, 0.2), (300.0, 2500.0, 350.0)
    ends = [np.array(adrift(h=h, seconds=3.2).push(start, tau, 3.2)[0]) for h in (0.4, 0.2, 0.0125)]
    assert (ends[2][3:] > 0.0).all()
    coarse, fine = (np.abs(end - ends[2]).max() for end in ends[:2])
    assert 10.0 < coarse / fine < 26.0


def test_terminal_speed_is_where_drag_equals_thrust(adrift):
    # 27.632 + 110.064 + 13.965 = 151.661 N of drag at 1 m/s, Table 4.1.
    state, _ = adrift(AIRLESS, h=0.05, seconds=400.0).push(STILL, (151.661, 0.0, 0.0), 400.0)
    assert state[3] == pytest.approx(1.0, abs=1e-6)
    assert np.abs(state[1:3]).max() < 1e-12
    foul, _ = adrift(AIRLESS, h=0.05, seconds=400.0, fouling=Fouling(surge=2.0)).push(STILL, (261.725, 0.0, 0.0), 400.0)
    assert foul[3] == pytest.approx(1.0, abs=1e-6)


def test_drifts_with_the_current_and_then_feels_nothing(adrift):
    run = adrift(AIRLESS, h=0.5, seconds=20_000.0, current=Current(0.3, -0.2))
    state, _ = run.push((0.0, 0.0, 0.7, 0.0, 0.0, 0.0), NONE, 20_000.0)
    c, s = cos(state[2]), sin(state[2])
    assert (c * state[3] - s * state[4], s * state[3] + c * state[4]) == pytest.approx((0.3, -0.2), abs=2e-3)


@settings(max_examples=15, deadline=None)
@given(states, forces, flows, streams)
def test_moving_with_the_water_changes_nothing(adrift, start, tau, wind, current):
    c, s = cos(start[2]), sin(start[2])
    moved = (
        *start[:3],
        start[3] + c * current[0] + s * current[1],
        start[4] + c * current[1] - s * current[0],
        start[5],
    )
    blown = Wind(wind[0] + current[0], wind[1] + current[1])
    still, _ = adrift(seconds=2.0, wind=Wind(*wind)).push(start, tau, 2.0)
    carried, _ = adrift(seconds=2.0, wind=blown, current=Current(*current)).push(moved, tau, 2.0)
    expected = (still[0] + 2.0 * current[0], still[1] + 2.0 * current[1], still[2])
    np.testing.assert_allclose(carried[:3], expected, atol=1e-7)


@settings(max_examples=15, deadline=None)
@given(states, forces, flows, angle)
def test_turning_the_world_turns_the_track(adrift, start, tau, wind, by):
    c, s = cos(by), sin(by)
    turned = lambda x, y: (c * x - s * y, s * x + c * y)  # noqa: E731
    one, _ = adrift(seconds=2.0, wind=Wind(*wind)).push(start, tau, 2.0)
    start = (*turned(*start[:2]), start[2] + by, *start[3:])
    other, _ = adrift(seconds=2.0, wind=Wind(*turned(*wind))).push(start, tau, 2.0)
    np.testing.assert_allclose(other, (*turned(*one[:2]), one[2] + by, *one[3:]), atol=1e-8)


@settings(max_examples=15, deadline=None)
@given(states, forces, flows)
def test_port_and_starboard_are_mirror_images(adrift, start, tau, wind):
    mirror = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
    waves = {"significant_height_m": 0.3, "components": 5}
    mirrored = {"fouling": Fouling(1.5, 2.0, 0.7), "payload": (Payload(100.0, 1.0),), "seconds": 2.0}
    one, _ = adrift(wind=Wind(*wind), waves=Waves(**waves, direction_deg=40.0), **mirrored).push(start, tau, 2.0)
    flipped = tuple(float(value) for value in mirror * start)
    run = adrift(wind=Wind(wind[0], -wind[1]), waves=Waves(**waves, direction_deg=-40.0), **mirrored)
    other, _ = run.push(flipped, (tau[0], -tau[1], -tau[2]), 2.0)
    np.testing.assert_allclose(other, mirror * one, atol=1e-9)


@settings(max_examples=25, deadline=None)
@given(states, st.floats(0, 500))
def test_a_hull_without_thrust_never_gains_energy(adrift, start, stiffness):
    # A hull whose mass matrix is symmetric, as energy needs; moored, with payload aboard that leaves, in shallow water.
    M = 0.5 * (HULL.M + HULL.M.T)
    profile = replace(AIRLESS, hull=replace(HULL, M=M))
    mooring = Mooring(start[0] + 1.0, start[1] - 1.0, stiffness, stiffness)
    shallow = Shallow((-1e3, 1e3), (-1e3, 1e3), 2.0)
    run = adrift(profile, seconds=8.0, mooring=mooring, shallow=shallow, payload=(Payload(250.0, 1.5, 0.0, 6.0),))
    _, rows = run.push(start, NONE, 6.0)
    loaded = M + 250.0 * np.array([[1, 0, 0], [0, 1, 1.5], [0, 1.5, 2.25]])
    nu, place = rows[:, 3:6], rows[:, :2] - (mooring.north_m, mooring.east_m)
    energy = 0.5 * np.einsum("ni,ij,nj->n", nu, loaded, nu) + 0.5 * stiffness * (place**2).sum(1)
    assert (np.diff(energy) <= 1e-9 * (1.0 + energy[0])).all()


def test_boarding_conserves_momentum_and_leaving_takes_it_along(adrift):
    start = (0.0, 0.0, 0.4, 1.0, 0.5, 0.2)
    run = adrift(seconds=3.0, payload=(Payload(300.0, 2.0, 1.0, 2.0), Payload(50.0, -1.0)))
    _, rows = run.push(start, NONE, 3.0)
    M = HULL.M + 50.0 * np.array([[1, 0, 0], [0, 1, -1.0], [0, -1.0, 1.0]])
    loaded = M + 300.0 * np.array([[1, 0, 0], [0, 1, 2.0], [0, 2.0, 4.0]])
    nu = rows[:, 3:6]
    # A step moves momentum by drag alone, which two neighbouring steps tell.
    drag = M @ (nu[49] - nu[48])
    np.testing.assert_allclose(loaded @ nu[50], M @ nu[49] + drag, atol=0.1)
    assert np.abs(nu[50] - nu[49]).max() > 0.02
    assert np.abs(nu[100] - nu[99]).max() < 5e-3
    np.testing.assert_allclose(run.plant.phases.payload, [[50.0, -1.0], [350.0, 550.0 / 350.0], [50.0, -1.0]])


def test_a_change_begins_and_ends_on_its_step(adrift):
    run = adrift(seconds=3.0, mooring=Mooring(5.0, 0.0, 10.0, 0.0, 1.0, 2.0))
    _, rows = run.push(STILL, NONE, 3.0)
    pulled = np.flatnonzero(rows[:, 6] > 0.01)
    assert (pulled[0], pulled[-1]) == (50, 99)
    assert rows[50, 6] == pytest.approx(50.0 / 2389.657)


def test_shallow_water_multiplies_damping_inside_alone(adrift):
    run = adrift(AIRLESS, seconds=0.02, shallow=Shallow((10.0, -10.0), (0.0, 5.0), 3.0, 2.0))
    shares = []
    for place in ((0.0, 2.0), (10.0, 5.0), (11.0, 2.0), (12.0, 2.0), (0.0, -1.0), (0.0, -2.0), (50.0, 2.0)):
        run.step = 0
        _, rows = run.push((*place, 0.0, 1.0, 0.0, 0.0), NONE, 0.02)
        shares.append(rows[0, 6] * 2389.657 / -151.661)
    assert shares == pytest.approx([3.0, 3.0, 2.0, 1.0, 2.0, 1.0, 1.0])


def test_mean_drift_by_hand(adrift):
    # rho g H² / 16 = 1000 * 9.81 * 0.04 / 16 = 24.525 N/m; 2.8 m of width ahead, 5 m abeam, half of it reflected.
    waves = Waves(significant_height_m=0.2, direction_deg=0.0, drift_coefficient=0.5)
    run = adrift(seconds=0.02, waves=waves)
    calm = adrift(seconds=0.02, waves=replace(waves, drift_coefficient=0.0))
    for psi, expected in ((0.0, (0.5 * 24.525 * 2.8, 0.0)), (0.5 * pi, (0.0, -0.5 * 24.525 * 5.0))):
        forces = []
        for one in (run, calm):
            one.step = 0
            forces.append(one.push((0.0, 0.0, psi, 0.0, 0.0, 0.0), NONE, 0.02)[1][0, 12:15])
        assert tuple(forces[0] - forces[1])[:2] == pytest.approx(expected, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("direction", "psi"), [(0.0, 0.0), (90.0, 0.0), (180.0, 0.0), (60.0, 0.3), (0.0, 0.5 * pi)])
def test_in_a_long_wave_group_an_undamped_hull_moves_as_the_water_does(adrift, direction, psi):
    """Particles by linear wave theory, integrated from rest; waves of 100 m against a hull of 5 m."""
    height, period, middle, duration = 0.2, 8.0, 100.0, 100.0
    w = 2.0 * pi / period
    k = w**2 / 9.81
    go = np.array([cos(np.radians(direction)), sin(np.radians(direction))])
    undamped = replace(AIRLESS, hull=replace(HULL, D=dict.fromkeys(HULL.D, 0.0)))
    run = adrift(undamped, h=0.05, seconds=200.0, wakes=(Wake(middle, height, period, duration, direction),))
    _, rows = run.push((0.0, 0.0, psi, 0.0, 0.0, 0.0), NONE, 200.0)
    t = 0.05 * np.arange(len(rows))

    def rates(t, y):
        envelope = exp(-0.5 * ((t - middle) / (0.25 * duration)) ** 2)
        # The water's acceleration is g times the slope of the surface, downhill: -g d/dx of a cos(w t - k x).
        a = -9.81 * k * 0.5 * height * envelope * sin(w * (t - middle) - k * (go @ y[:2]))
        return [*y[2:], *(a * go)]

    water = solve_ivp(rates, (0.0, 200.0), np.zeros(4), t_eval=t, rtol=1e-8, atol=1e-10).y.T
    c, s = np.cos(rows[:, 2]), np.sin(rows[:, 2])
    u, v = rows[:, 3], rows[:, 4]
    hull = np.column_stack((rows[:, :2], c * u - s * v, s * u + c * v))
    largest = np.abs(water[:, 2:] @ go).max()
    # By hand: orbital speed w a at the surface.
    assert largest == pytest.approx(w * 0.5 * height, rel=0.01)
    assert np.abs(hull[:, 2:] - water[:, 2:]).max() < 0.02 * largest
    # A hull with its masses off the middle is turned a little on the way, and drifts.
    assert np.abs(hull[:, :2] - water[:, :2]).max() < 0.05 * 0.5 * height


def test_a_turning_current_carries_an_undamped_hull_along(adrift):
    """A particle that goes with the water at the start goes with it for good, whatever turns the water."""
    undamped = replace(AIRLESS, hull=replace(HULL, D=dict.fromkeys(HULL.D, 0.0)))
    run = adrift(undamped, seconds=60.0, current=Current(0.4, -0.1, 90.0), payload=(Payload(200.0, 1.0),))
    state, _ = run.push((0.0, 0.0, 0.0, 0.4, -0.1, 0.0), NONE, 60.0)
    # A quarter turn clockwise in 60 s.
    assert state[3:] == pytest.approx((0.1, 0.4, 0.0), abs=1e-6)
    assert state[2] == pytest.approx(0.0, abs=1e-9)


def test_same_seed_same_run_and_another_seed_another(make):
    orders = ((500.0, 0.2), (400.0, -0.2))
    for random in ({"wind": Wind(2.0, 0.0, 1.0)}, {"waves": Waves(significant_height_m=0.2)}):
        first, again, other = (make(seed=seed, **random).drive(STILL, orders, 10.0)[0] for seed in (1, 1, 2))
        assert first == again
        assert first != other


def test_a_vessel_without_a_hull_model_is_refused(make):
    with pytest.raises(FerryIdError, match=r"found no \[hull.D\]"):
        make(load_profile("gunnerus"))


def test_a_fault_in_an_unknown_thruster_is_refused(make):
    with pytest.raises(FerryIdError, match=r'found "thruster3"\. Did you mean "thruster1"|Fix: use one of thruster1'):
        make(thrusters=Thrusters(faults=(Fault("thruster3", 0.5),)))
