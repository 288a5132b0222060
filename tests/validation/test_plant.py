"""The plant against what can be worked out by hand, and against an integrator of a library."""

from __future__ import annotations

import ast
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import ferryid.validation.plant
from ferryid.validation.plant import hull as hulls
from ferryid.validation.plant.air import RHO_AIR, air_constants, air_load
from ferryid.validation.plant.effects import complete_conditions
from ferryid.validation.plant.effects.gusts import gusts
from ferryid.validation.plant.effects.waves import sea_constants, sea_load
from ferryid.validation.plant.hull import added_mass, coriolis, drag, hull_constants, inertia, rigid_mass
from ferryid.validation.plant.motion import BODY, World, changes, step
from ferryid.validation.plant.paths import DWELL_S, set_points
from ferryid.validation.plant.plant import build_plant
from ferryid.validation.plant.thrusters import STATES, thrust
from ferryid.validation.plant.trial import simulate_trial
from ferryid.validation.plant.vessels import FERRY, GRAVITY, RHO, SURVEYOR, VESSELS, WORKBOAT, Vessel

Floats = NDArray[np.float64]
STILL = np.zeros(2)


def world_of(vessel: Vessel, **conditions: Any) -> World:
    return build_plant(vessel, np.zeros(1), complete_conditions(conditions), 0).world


def driven(vessel: Vessel, y: Floats, seconds: float, order: Floats | None = None, **conditions: Any) -> Floats:
    """Return the states after some time without wind and sea, in steps of 0.05 s."""
    k = len(vessel.thrusters)
    order = np.zeros((k, 2)) if order is None else order
    world, state, parts = world_of(vessel, **conditions), y.copy(), np.zeros((k, 3))
    for number in range(round(seconds / 0.05)):
        step(world, 0.05 * number, 0.05, state, order, STILL, STILL, np.zeros(6), parts)
    return state


def at_rest(vessel: Vessel) -> Floats:
    return np.zeros(BODY + STATES * len(vessel.thrusters))


def test_the_plant_shares_no_code_with_what_is_to_find_it() -> None:
    """But for the oracle of an effect, which is part of the evaluation and imports what it needs itself."""
    # Of ferryid.types it has the names of array types, no code.
    allowed = ("ferryid.compiled", "ferryid.types", "ferryid.validation.case", "ferryid.validation.plant")
    for path in Path(ferryid.validation.plant.__file__).parent.rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        apart = [one for one in tree.body if isinstance(one, ast.FunctionDef) and one.name == "oracle"]
        apart += [one for one in tree.body if isinstance(one, ast.If) and ast.unparse(one.test) == "TYPE_CHECKING"]
        for top in tree.body:
            for node in ast.walk(top) if top not in apart else ():
                module = str(getattr(node, "module", "")) if isinstance(node, ast.ImportFrom) else ""
                assert not module.startswith("ferryid") or module.startswith(allowed), (path, module)
                if isinstance(node, ast.Import):
                    assert not any(name.name.startswith("ferryid") for name in node.names), path


@pytest.mark.parametrize("vessel", VESSELS.values(), ids=list(VESSELS))
def test_coriolis_forces_do_no_work(vessel: Vessel) -> None:
    rng = np.random.default_rng(1)
    for M in (rigid_mass(vessel.mass, vessel.x_g, vessel.z_g, inertia(vessel)), added_mass(vessel)):
        for _ in range(20):
            nu, out = rng.standard_normal(6), np.zeros(6)
            coriolis(M, nu, out)
            assert abs(nu @ out) < 1e-9 * np.abs(out).max() * np.abs(nu).max()


def test_a_turning_body_feels_the_centrifugal_force() -> None:
    """A point mass m at x on a body that turns with r and goes ahead with u: m x r² ahead, -m u r aside, -m x u r about z."""
    out = np.zeros(6)
    m, x, u, r = 100.0, 2.0, 1.5, 0.3
    coriolis(rigid_mass(m, x, 0.0, np.zeros((3, 3))), np.array([u, 0.0, 0.0, 0.0, 0.0, r]), out)
    assert out[[0, 1, 5]] == pytest.approx([m * x * r * r, -m * u * r, -m * x * u * r])


@pytest.mark.parametrize("vessel", VESSELS.values(), ids=list(VESSELS))
def test_masses_are_those_of_bodies(vessel: Vessel) -> None:
    M = rigid_mass(vessel.mass, vessel.x_g, vessel.z_g, inertia(vessel)) + added_mass(vessel)
    assert pytest.approx(M.T) == M
    assert np.linalg.eigvalsh(M).min() > 0.0
    assert vessel.mass < RHO * vessel.length * vessel.beam * vessel.draught


def test_cross_flow_is_the_integral_over_the_length() -> None:
    vessel = replace(FERRY, cross_drag=(0.8, 0.8, 0.8), linear=(0.0,) * 6)
    hull = hull_constants(vessel)
    side, turn = np.zeros(6), np.zeros(6)
    drag(hull, np.array([0.0, 0.5, 0, 0, 0, 0.0]), 0.0, 1.0, side)
    drag(hull, np.array([0.0, 0.0, 0, 0, 0, -0.2]), 0.0, 1.0, turn)
    q = 0.5 * RHO * 0.8 * vessel.draught
    assert side[1] == pytest.approx(-q * vessel.length * 0.25)
    assert side[5] == pytest.approx(0.0, abs=1e-9)
    # The integral of |x|³ over the length is L⁴/32; strips see it within a per cent.
    assert turn[5] == pytest.approx(q * 0.04 * vessel.length**4 / 32.0, rel=0.01)


def test_friction_follows_the_line_of_the_ittc() -> None:
    """C_F is 0.003 at a Reynolds number of ten million, by the line's own table."""
    vessel = replace(FERRY, form=0.0, residual=0.0, linear=(0.0,) * 6)
    u = 1e7 * hulls.VISCOSITY / vessel.length
    out = np.zeros(6)
    drag(hull_constants(vessel), np.array([u, 0, 0, 0, 0, 0.0]), 0.0, 1.0, out)
    assert out[0] == pytest.approx(-0.5 * RHO * vessel.wetted_m2 * 0.003 * u * u, rel=1e-6)


def test_the_wind_pushes_as_on_real_ships() -> None:
    """Drag coefficients of superstructures lie between 0.5 and 1.4, none push aside ahead, and one from port pushes over."""
    for vessel in VESSELS.values():
        constants = air_constants(vessel)
        frontal = sum(house.width * house.height for house in vessel.houses)
        lateral = sum(house.length * house.height for house in vessel.houses)
        head, beam, slant, mirrored = (np.zeros(6) for _ in range(4))
        air_load(constants, -10.0, 0.0, head)
        air_load(constants, 0.0, 10.0, beam)
        air_load(constants, 6.0, 5.0, slant)
        air_load(constants, 6.0, -5.0, mirrored)
        q = 0.5 * RHO_AIR * 100.0
        assert 0.5 < -head[0] / (q * frontal) < 1.4
        assert 0.5 < beam[1] / (q * lateral) < 1.4
        assert head[[1, 5]] == pytest.approx([0.0, 0.0], abs=1e-9)
        assert beam[3] > 0.0
        assert mirrored[[0, 1, 5]] == pytest.approx(slant[[0, 1, 5]] * [1.0, -1.0, -1.0])


@pytest.mark.slow
def test_gusts_have_their_size_and_memory() -> None:
    t = np.arange(0.0, 4000.0, 0.25)
    made = np.concatenate([gusts(np.random.default_rng(seed), t, 1.3, 8.0) for seed in range(6)], axis=1)
    assert made.std(axis=0) == pytest.approx(1.3, rel=0.25)
    # Kaimal's: the spectrum at f = 1/T is 7^(-5/3) of that of slow changes, within the scatter of few cosines.
    power = np.abs(np.fft.rfft(made, axis=0)) ** 2
    f = np.fft.rfftfreq(len(t), 0.25)

    def mean(low: float, high: float) -> float:
        return float(power[(f > low) & (f < high)].sum() / (high - low))

    assert mean(0.1, 0.16) / mean(0.002, 0.006) == pytest.approx(7.2 ** (-5.0 / 3.0), rel=0.5)


@pytest.mark.slow
def test_long_waves_push_the_hull_as_the_water_it_displaces() -> None:
    """In waves much longer than the hull the force of the pressure is the displaced mass times the water's acceleration."""
    vessel = replace(FERRY, added=dict.fromkeys(FERRY.added, 0.0))
    conditions = complete_conditions({"wakes": ((0.0, 0.3, 12.0, 1e9, 90.0),)})
    sea = sea_constants(np.random.default_rng(2), vessel, conditions)._replace(drift=np.zeros(2))
    sea = sea._replace(amplitude=sea.amplitude * [0.0, 1.0, 0.0])
    loads = np.zeros((600, 6))
    for row in range(600):
        sea_load(sea, 0.05 * row, 0.0, 0.0, 0.0, loads[row])
    omega = 2.0 * np.pi / 12.0
    displaced = RHO * vessel.length * vessel.beam * vessel.draught
    assert loads[:, 1].max() == pytest.approx(displaced * omega**2 * 0.05, rel=0.03)
    assert loads[:, 2].max() == pytest.approx(RHO * GRAVITY * vessel.length * vessel.beam * 0.05, rel=0.03)
    assert np.abs(loads[:, [0, 5]]).max() < 0.01 * np.abs(loads[:, 1]).max()


def pushed(vessel: Vessel, speeds: list[float], angles: list[float], u: float = 0.0, **conditions: Any) -> Floats:
    """Return the load of thrusters whose races have formed."""
    k = len(vessel.thrusters)
    state = np.zeros((k, STATES))
    state[:, 0] = state[:, 2] = speeds
    state[:, 1] = np.radians(angles)
    out, parts = np.zeros(6), np.zeros((k, 3))
    nu = np.array([u, 0, 0, 0, 0, 0.0])
    thrusters = world_of(vessel, **conditions).thrusters
    thrust(thrusters, 0.0, state, nu, np.zeros((k, 2)), np.zeros((k, STATES)), out, parts)
    return out


def test_thrusters_push_where_they_point() -> None:
    one = FERRY.thrusters[0]
    full = one.ahead * 1000.0**2
    out = pushed(FERRY, [1000.0, 0.0], [30.0, 0.0])
    Y = full * 0.5
    assert out == pytest.approx(
        [full * np.cos(np.pi / 6), Y, 0.0, -one.z * Y, one.z * full * np.cos(np.pi / 6), one.x * Y]
    )
    # Port ahead and starboard astern turn a twin-screw vessel to starboard.
    assert pushed(SURVEYOR, [900.0, -900.0, 0.0], [0.0, 0.0, 90.0])[5] > 0.0


def test_losses_are_as_large_as_they_are_asked_for() -> None:
    one = FERRY.thrusters[0]
    rpm = 0.6 * one.most_rpm
    free = pushed(FERRY, [rpm, 0.0], [0.0, 0.0], u=0.5)[0]
    lossy = pushed(FERRY, [rpm, 0.0], [0.0, 0.0], u=0.5, inflow=0.2)[0]
    assert lossy == pytest.approx(0.9 * free)
    # Fore blows astern, straight at aft: Ekstrom's and Brown's loss is whole there, and gone at right angles.
    alone = pushed(FERRY, [0.0, rpm], [0.0, 0.0])[0]
    both = pushed(FERRY, [rpm, rpm], [0.0, 0.0], interaction=0.3)[0]
    assert both - free == pytest.approx(0.7 * alone)
    beside = pushed(FERRY, [rpm, rpm], [90.0, 0.0], interaction=0.3)[0]
    assert beside == pytest.approx(alone, rel=0.01)


def test_a_thruster_gives_nothing_in_its_dead_band_less_astern_and_no_more_than_its_limit() -> None:
    one = SURVEYOR.thrusters[0]

    def port(rpm: float, **conditions: Any) -> float:
        return float(pushed(SURVEYOR, [rpm, 0.0, 0.0], [0.0, 0.0, 90.0], **conditions)[0])

    band = {"dead_band_rpm": {one.name: (300.0, 400.0)}}
    ends = [port(rpm, **band) / port(rpm) for rpm in (299.0, 301.0, -399.0, -401.0)]
    assert ends == [0.0, 1.0, 0.0, 1.0]
    worn = {"astern": {one.name: 0.7}}
    assert [port(rpm, **worn) / port(rpm) for rpm in (900.0, -900.0)] == pytest.approx([1.0, 0.7])
    limit = {"thrust_limit_N": {one.name: (60.0, 40.0)}}
    assert [port(rpm, **limit) for rpm in (1700.0, -1700.0)] == pytest.approx([60.0, -40.0], rel=1e-3)
    assert port(600.0, **limit) == pytest.approx(port(600.0))


def test_a_late_force_comes_as_late_as_it_should() -> None:
    """The centre of the answer to a step is the sum of both stages."""
    one = replace(FERRY, thrusters=FERRY.thrusters[:1])
    gear = world_of(one, lag_s=0.8).thrusters
    state, forces = np.array([[800.0, 0.0, 800.0, 0.0, 0.0, 0.0]]), []
    change, parts = np.zeros((1, STATES)), np.zeros((1, 3))
    for _ in range(2000):
        thrust(gear, 0.0, state, np.zeros(6), np.array([[800.0, 0.0]]), change, np.zeros(6), parts)
        forces.append(parts[0, 0])
        state += 0.005 * change
    full = one.thrusters[0].ahead * 800.0**2
    assert forces[-1] == pytest.approx(full)
    assert 0.005 * np.sum(1.0 - np.array(forces) / full) == pytest.approx(0.8, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("lag_s", [0.02, 0.0298, 0.05])
def test_a_short_lag_is_no_trouble_to_the_integrator(lag_s: float) -> None:
    """Steps of 0.05 s diverge where the stages' rate is 2 / 0.0298 s; a force so little late changes hardly anything."""
    late, none = (simulate_trial(FERRY, {"lag_s": lag}, "short", 3) for lag in (lag_s, 0.0))
    assert np.abs(late.states[:2000, :2] - none.states[:2000, :2]).max() < 0.3


@pytest.mark.slow
def test_steps_agree_with_a_library_integrator() -> None:
    world = world_of(FERRY, payload=(300.0, 1.0, 0.5), mooring=(20.0, 30.0, 4.0, -3.0))
    order = np.array([[700.0, 0.6], [500.0, -1.2]])
    y = at_rest(FERRY)
    y[6:12] = [0.6, -0.3, 0.02, 0.03, -0.02, 0.12]
    spare = np.zeros((2, 3))
    flow, air = np.array([0.1, -0.2]), np.array([3.0, 4.0])

    def rates(t: float, state: Floats) -> Floats:
        out = np.zeros_like(state)
        changes(world, t, state, order, flow, air, np.zeros(6), out, spare)
        return out

    exact = solve_ivp(rates, (0.0, 20.0), y, rtol=1e-10, atol=1e-12, max_step=0.01).y[:, -1]
    ours = y.copy()
    for number in range(400):
        step(world, 0.05 * number, 0.05, ours, order, flow, air, np.zeros(6), spare)
    # The orders' limits have corners, which no step of fixed length meets.
    assert ours[:12] == pytest.approx(exact[:12], abs=5e-4)


def test_full_ahead_ends_where_drag_is_thrust() -> None:
    # Not for long: like most double-enders it does not hold its course by itself.
    order = np.array([[600.0, 0.0], [600.0, 0.0]])
    u = driven(FERRY, at_rest(FERRY), 90.0, order)[6]
    water = np.zeros(6)
    drag(hull_constants(FERRY), np.array([u, 0, 0, 0, 0, 0.0]), 0.0, 1.0, water)
    air_load(air_constants(FERRY), -u, 0.0, water)
    assert water[0] == pytest.approx(-2.0 * FERRY.thrusters[0].ahead * 600.0**2, rel=5e-3)


def test_what_comes_aboard_takes_its_momentum_from_the_vessel() -> None:
    vessel = replace(FERRY, linear=(0.0, 0.0, *FERRY.linear[2:5], 0.0), form=0.0, residual=0.0, wetted_m2=0.0)
    y = at_rest(vessel)
    y[6] = 0.8
    masses = vessel.mass + vessel.added["11"]
    loaded = driven(vessel, y, 20.0, payload=(600.0, 0.0, 0.0), payload_span=(10.0, 1e9))
    # Heave and pitch follow, air slows it a little, and the deeper hull drags more water along.
    deeper = 1.0 + 600.0 / (RHO * vessel.waterplane_m2) / vessel.draught
    assert loaded[6] == pytest.approx(0.8 * masses / (vessel.mass + 600.0 + vessel.added["11"] * deeper), rel=0.02)
    kept = driven(vessel, y, 20.0, payload=(600.0, 0.0, 0.0), payload_span=(-1e9, 10.0))
    assert kept[6] == pytest.approx(0.8, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("vessel", VESSELS.values(), ids=list(VESSELS))
def test_the_autopilot_reaches_its_set_points(vessel: Vessel) -> None:
    trial = simulate_trial(vessel, {}, "calibration", 5)
    goals = set_points("calibration", vessel, np.random.default_rng([5, 0]))
    rows = [int((number + 1) * DWELL_S * 20) - 1 for number in range(len(goals))]
    away = np.hypot(*(trial.states[rows, :2] - goals[:, :2]).T)
    turned = np.abs((trial.states[rows, 5] - goals[:, 2] + np.pi) % (2.0 * np.pi) - np.pi)
    assert np.median(away) < 0.1 * vessel.leg_m
    assert np.median(np.degrees(turned)) < 6.0


@pytest.mark.slow
def test_navigation_errs_by_what_its_instruments_do() -> None:
    trial = simulate_trial(WORKBOAT, {"noise": 1.0}, "calibration", 6)
    true = trial.states[:, [0, 1, 5, 6, 7, 11]]
    error = trial.reported - true
    error[:, 2] = (error[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    rms = np.sqrt(np.mean(error**2, axis=0))
    assert (rms[:2] > 0.008).all()
    assert (rms[:2] < 0.04).all()
    assert 0.05 < np.degrees(rms[2]) < 0.4
    assert (rms[3:5] > 0.003).all()
    assert (rms[3:5] < 0.03).all()
    # Coloured: a second later, errors of velocity are still alike.
    v = error[:, 3]
    assert np.mean(v[20:] * v[:-20]) > 0.1 * np.mean(v * v)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_trial_and_another_another() -> None:
    conditions = {"wind": (2.0, 1.0), "gust_std": 0.5, "wave_height": 0.03}
    first, again = (simulate_trial(FERRY, conditions, "short", 7) for _ in range(2))
    other = simulate_trial(FERRY, conditions, "short", 8)
    assert np.array_equal(first.reported, again.reported)
    assert not np.allclose(first.reported, other.reported)


@pytest.mark.slow
def test_mistakes_of_the_navigation_are_those_asked_for() -> None:
    right = simulate_trial(FERRY, {}, "short", 9)
    errors = {"lever_m": (0.5, -0.3), "heading_bias_deg": 4.0, "yaw_rate_factor": 1.1}
    # The autopilot answers to what is reported, so that only the first report of both is of the same motion.
    off = simulate_trial(FERRY, errors, "short", 9)
    c, s = np.cos(right.reported[0, 2]), np.sin(right.reported[0, 2])
    moved = off.reported[0] - right.reported[0]
    assert moved[:2] == pytest.approx([c * 0.5 + s * 0.3, s * 0.5 - c * 0.3])
    assert np.degrees(moved[2]) == pytest.approx(4.0)
    assert off.reported[0, 5] == pytest.approx(1.1 * right.reported[0, 5])
