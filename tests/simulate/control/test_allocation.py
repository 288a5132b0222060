"""Allocation: forces sum to the desired one and are the smallest that do; what happens out of reach."""

from __future__ import annotations

from dataclasses import replace
from math import cos, hypot, pi, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ferryid.errors import FerryIdError
from ferryid.simulate.control.allocation import HELD_BELOW, NSCA, PSEUDO_INVERSE, allocate, build_allocation
from ferryid.simulate.paths import set_points
from ferryid.simulate.plant.thrust import curves_of
from ferryid.simulate.scenario import Scenario
from ferryid.simulate.sections import Control, Manoeuvre
from ferryid.vessel.load import load_profile
from ferryid.vessel.profile import Actuator, ThrustCurve
from ferryid.vessel.thrusters import force_at, thrust

FERRY = load_profile("milliampere")
QUAD = load_profile("milliampere-2025")
CURVE = FERRY.actuators[0].thrust
LARGEST = float(thrust(CURVE, np.array([1050.0]))[0][0])
SCENARIO = Scenario("test", "test", "milliampere", set_points(((0.0, 0.0, 0.0),), 60.0), 60.0, 0, 1)


def vessel(*actuators):
    return replace(FERRY, actuators=actuators)


MIXED = vessel(
    Actuator("tunnel", "tunnel", (2.0, 0.0), CURVE, angle_rad=0.5 * pi),
    Actuator("pod", "azimuth", (-1.5, 0.3), CURVE, count=2),
    Actuator("left", "propeller", (-2.0, -0.8), CURVE),
    Actuator("slanted", "force", (1.0, 0.9), angle_rad=-0.7),
)
STERN = vessel(Actuator("left", "force", (-0.4, -0.2)), Actuator("right", "force", (-0.4, 0.2)))
RUDDER = vessel(replace(FERRY.actuators[1], kind="propeller_rudder"), FERRY.actuators[0])


def allocation_of(profile, name="auto"):
    scenario = replace(SCENARIO, controller=Control(allocation=name))
    return build_allocation(scenario, profile, curves_of(profile))


def allocated(allocation, tau, last=None):
    before = np.zeros((len(allocation.x), 2)) if last is None else np.asarray(last, dtype=float)
    after = np.full_like(before, np.nan)
    return allocate(allocation, tau, before, after), after


def acting(profile, orders):
    """Return the force of every actuator under its orders by the library's own thrust curves, shape (k, 3)."""
    rows = []
    for actuator, (speed, angle) in zip(profile.actuators, orders, strict=True):
        force = speed if actuator.kind == "force" else actuator.count * thrust(actuator.thrust, np.array([speed]))[0][0]
        rows.append(force_at(actuator, np.array(force), angle if actuator.kind == "azimuth" else actuator.angle_rad))
    return np.array(rows)


def configuration(profile):
    """Return the extended thrust configuration matrix, shape (3, columns)."""
    columns = []
    for actuator in profile.actuators:
        x, y = actuator.position_m
        ways = (0.0, 0.5 * pi) if actuator.kind == "azimuth" else (actuator.angle_rad,)
        columns += [(cos(a), sin(a), x * sin(a) - y * cos(a)) for a in ways]
    return np.array(columns).T


def test_nsca_gives_the_forces_worked_by_hand():
    """(200 N, 60 N, 90 N m) at +-1.8 m: 100 N ahead each, (60 +- 90 / 1.8) / 2 = 55 and 5 N across."""
    allocation = allocation_of(FERRY)
    assert allocation.kind == NSCA
    saturated, orders = allocated(allocation, (200.0, 60.0, 90.0))
    assert not saturated
    np.testing.assert_allclose(acting(FERRY, orders), [[100.0, 55.0, 99.0], [100.0, 5.0, -9.0]], atol=1e-3)


@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(st.floats(-400, 400), st.floats(-300, 300), st.floats(-400, 400), st.floats(-9, 9))
def test_nsca_forces_sum_to_the_desired_force(X, Y, N, last):
    saturated, orders = allocated(allocation_of(FERRY), (X, Y, N), [(0.0, last), (0.0, last)])
    forces = acting(FERRY, orders)
    sizes = np.hypot(forces[:, 0], forces[:, 1])
    assert not saturated
    assert (np.abs(orders[:, 1] - last) <= pi + 1e-12).all()
    assert (orders[:, 1] == last)[sizes < 0.99 * HELD_BELOW * LARGEST].all()
    exact = (sizes > 1.01 * HELD_BELOW * LARGEST).all()
    np.testing.assert_allclose(forces.sum(axis=0), (X, Y, N), atol=1e-3 if exact else 4.0 * HELD_BELOW * LARGEST * 1.8)


@pytest.mark.parametrize("profile", [FERRY, QUAD, MIXED], ids=["two", "four", "mixed"])
def test_shares_are_the_pseudo_inverse(profile):
    allocation = allocation_of(profile, "pseudo-inverse")
    assert allocation.kind == PSEUDO_INVERSE
    expected = np.linalg.pinv(configuration(profile))
    found = np.array(
        [row for turns, rows in zip(allocation.turns, allocation.shares, strict=True) for row in rows[: 1 + turns]]
    )
    np.testing.assert_allclose(found, expected, atol=1e-12)


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(st.floats(-500, 500), st.floats(-250, 250), st.floats(-300, 300), st.sampled_from([FERRY, QUAD, MIXED]))
def test_pseudo_inverse_forces_sum_to_the_desired_force(X, Y, N, profile):
    saturated, orders = allocated(allocation_of(profile, "pseudo-inverse"), (X, Y, N))
    forces = acting(profile, orders)
    sizes = [
        hypot(*row[:2]) / (HELD_BELOW * actuator.count * 400.0)
        for row, actuator in zip(forces, profile.actuators, strict=True)
        if actuator.kind == "azimuth"
    ]
    if not saturated and min(sizes) > 3.0:
        # The inverse of a bollard pull given as a table is a little off where a kink of it lies between two of its nodes.
        np.testing.assert_allclose(forces.sum(axis=0), (X, Y, N), atol=0.1 if profile is QUAD else 2e-3)


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(st.floats(-400, 400), st.floats(-300, 300), st.floats(-400, 400))
def test_nsca_is_the_pseudo_inverse_of_its_layout(X, Y, N):
    one, other = (allocated(allocation_of(FERRY, name), (X, Y, N)) for name in ("nsca", "pseudo-inverse"))
    assert one[0] == other[0]
    np.testing.assert_allclose(one[1][:, 0], other[1][:, 0], atol=1e-6)


def test_the_order_of_the_thrusters_does_not_matter():
    turned = vessel(*reversed(FERRY.actuators))
    one, other = (allocated(allocation_of(profile), (150.0, -80.0, 120.0))[1] for profile in (FERRY, turned))
    np.testing.assert_array_equal(one, other[::-1])


@pytest.mark.parametrize(
    ("profile", "twin"), [(FERRY, [0, 1]), (QUAD, [1, 0, 3, 2])], ids=["centre line", "either side"]
)
def test_a_force_mirrored_to_port_gives_mirrored_orders(profile, twin):
    allocation = allocation_of(profile)
    for X, Y, N in ((150.0, 80.0, -120.0), (-300.0, 10.0, 40.0), (50.0, 1500.0, 900.0)):
        _, one = allocated(allocation, (X, Y, N))
        _, other = allocated(allocation, (X, -Y, -N))
        np.testing.assert_allclose(other[:, 0], one[twin, 0], rtol=1e-9)
        np.testing.assert_allclose(other[:, 1], -one[twin, 1], atol=1e-12)


def test_nsca_shortens_each_force_and_keeps_its_direction():
    saturated, orders = allocated(allocation_of(FERRY), (2000.0, 0.0, 0.0))
    assert saturated
    np.testing.assert_array_equal(orders, [(1050.0, 0.0), (1050.0, 0.0)])
    # Only the fore thruster is out of reach.
    saturated, orders = allocated(allocation_of(FERRY), (0.0, 600.0, 900.0))
    assert saturated
    np.testing.assert_allclose(acting(FERRY, orders)[:, 1], [LARGEST, 50.0], rtol=1e-4)


@pytest.mark.parametrize("profile", [FERRY, QUAD, MIXED], ids=["two", "four", "mixed"])
def test_the_pseudo_inverse_keeps_the_direction_of_a_force_out_of_reach(profile):
    tau = np.array([9000.0, 4000.0, -2500.0])
    saturated, orders = allocated(allocation_of(profile, "pseudo-inverse"), tuple(tau))
    total = acting(profile, orders).sum(axis=0)
    share = total[0] / tau[0]
    assert saturated
    assert 0.0 < share < 1.0
    np.testing.assert_allclose(total, share * tau, rtol=1e-5)
    # One thruster at least gives all it has.
    turning = [i for i, actuator in enumerate(profile.actuators) if actuator.kind != "force"]
    ends = [profile.actuators[i].thrust.valid[int(orders[i, 0] >= 0.0)] for i in turning]
    assert np.max(orders[turning, 0] / ends) == pytest.approx(1.0, abs=1e-4)


def test_a_propeller_that_cannot_reverse_does_not_stop_the_others():
    one_way = ThrustCurve("quadratic", "rpm", (-1000.0, 1000.0), ahead=4e-4, astern=0.0)
    profile = vessel(*FERRY.actuators, Actuator("main", "propeller", (-2.0, 0.0), one_way))
    saturated, orders = allocated(allocation_of(profile), (-300.0, 0.0, 0.0))
    assert saturated
    assert orders[2, 0] == 0.0
    np.testing.assert_allclose(acting(profile, orders).sum(axis=0), (-200.0, 0.0, 0.0), atol=1e-3)


def test_an_idle_thruster_keeps_its_angle():
    _, orders = allocated(allocation_of(FERRY), (-4.0, 0.0, 0.0), [(100.0, 0.5), (100.0, 0.5)])
    assert (orders[:, 1] == 0.5).all()


@pytest.mark.parametrize("name", ["nsca", "pseudo-inverse"])
def test_an_idle_thruster_never_pushes_against_the_force_wanted(name):
    """2 N ahead of each: one at angle 0.5 has 2 cos 0.5 N of it along its own way, one at angle 3 looks astern."""
    allocation = allocation_of(FERRY, name)
    _, orders = allocated(allocation, (4.0, 0.0, 0.0), [(100.0, 0.5), (100.0, 3.0)])
    np.testing.assert_array_equal(orders[:, 1], (0.5, 3.0))
    forces = np.hypot(*acting(FERRY, orders)[:, :2].T)
    np.testing.assert_allclose(forces, [2.0 * cos(0.5), 0.0], atol=1e-3)
    assert orders[1, 0] == 0.0


def test_angles_turn_the_shorter_way_over_many_turns():
    _, orders = allocated(allocation_of(FERRY), (-100.0, 1.0, 0.0), [(100.0, 4.0 * pi - 3.0), (100.0, -3.0)])
    np.testing.assert_allclose(orders[:, 1], [3.0 * pi - 0.01, -pi - 0.01], atol=1e-4)


@pytest.mark.parametrize(
    ("profile", "name", "told"),
    [
        (STERN, "auto", "push ahead, across and round independently, found force at"),
        (vessel(FERRY.actuators[0], FERRY.actuators[0]), "auto", "independently"),
        (QUAD, "nsca", "two azimuth thrusters on the centre line, found azimuth at"),
        (RUDDER, "auto", "no force is allocated to a rudder"),
    ],
)
def test_a_layout_that_cannot_follow_a_path_is_refused(profile, name, told):
    with pytest.raises(FerryIdError, match=rf"^test\.toml: .*{told}[^\n]* Fix: "):
        allocation_of(profile, name)


def test_a_manoeuvre_needs_no_allocation():
    scenario = replace(SCENARIO, manoeuvre=Manoeuvre(kind="rpm-steps"))
    assert not build_allocation(scenario, STERN, curves_of(STERN)).shares.any()
