"""Defects of recording that real logs showed: positions of a coarse grid, interpolated tables, orders that went another way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.diagnose.checks.held_samples import find as held
from ferryid.diagnose.checks.unrecorded_force import find as unrecorded
from ferryid.effects.force_model import Measurements
from ferryid.types import Floats
from ferryid.vessel import load_profile
from tests.diagnose.checks.test_checks import sailed

FERRY = load_profile("milliampere")


def straight(surge: Floats, pushed: Floats, step_s: float = 0.1) -> Measurements:
    """Return measurements of a vessel that goes north, by its surge velocity and the force ahead [N], shape (n,) each."""
    n = len(surge)
    zero = np.zeros(n)
    nu = np.column_stack([surge, zero, zero])
    parts = np.zeros((n, 2, 3))
    parts[:, :, 0] = 0.5 * pushed[:, None]
    return Measurements(
        profile=FERRY,
        t=step_s * np.arange(n),
        eta=np.column_stack([np.cumsum(surge) * step_s, zero, zero]),
        nu_raw=nu,
        nu=nu,
        parts=parts,
        angles=np.zeros((n, 2)),
        usable=np.ones(n, dtype=np.bool_),
    )


def run(idle: Floats) -> Measurements:
    """Return a minute under 400 N at 1 m/s, and half a minute without force in which the surge velocity is as given."""
    driven = np.full(600, 1.0)
    return straight(np.concatenate([driven, idle]), np.concatenate([np.full(600, 400.0), np.zeros(len(idle))]))


def test_a_vessel_that_speeds_up_with_idle_actuators_was_driven_by_something_else() -> None:
    ramp = np.interp(0.1 * np.arange(300), [0.0, 10.0, 15.0, 30.0], [0.0, 0.0, 1.5, 1.5])
    finding = unrecorded(run(ramp))
    assert finding is not None
    assert finding.effect == "unrecorded_force"
    assert finding.parameters["duration"].value == pytest.approx(30.0)
    assert finding.parameters["force"].value == pytest.approx(FERRY.hull.mass_kg * 0.3, rel=0.02)
    assert finding.intervals == ((pytest.approx(60.0), pytest.approx(89.9)),)
    assert not finding.correct(run(ramp)).usable[600:].any()
    assert finding.correct(run(ramp)).usable[:600].all()


def test_a_vessel_that_stops_or_drifts_with_idle_actuators_is_left_alone() -> None:
    seconds = 0.1 * np.arange(300)
    assert unrecorded(run(np.exp(-seconds / 8.0))) is None
    assert unrecorded(run(0.4 * (1.0 - np.exp(-seconds / 3.0)))) is None


def test_an_actuator_that_pushes_explains_its_own_motion() -> None:
    ramp = np.interp(0.1 * np.arange(300), [0.0, 10.0, 15.0, 30.0], [0.0, 0.0, 1.5, 1.5])
    measurements = run(ramp)
    parts = measurements.parts.copy()
    parts[600:, 0, 0] = 300.0
    assert unrecorded(replace(measurements, parts=parts)) is None


def test_positions_on_a_coarse_grid_are_not_held() -> None:
    measurements = sailed(3, 300.0)
    turn = np.array([[np.cos(0.03), -np.sin(0.03)], [np.sin(0.03), np.cos(0.03)]])
    grid = np.array([0.22, 0.06])
    # The grid of a receiver that gives degrees in single precision, not quite along north and east.
    coarse = np.round(measurements.eta[:, :2] @ turn / grid) * grid @ turn.T
    assert held(replace(measurements, eta=np.column_stack([coarse, measurements.psi]))) is None


def test_equal_readings_in_an_interpolated_table_are_not_held() -> None:
    measurements = sailed(4, 300.0)
    rows = np.arange(len(measurements.t))
    some = rows[::15]
    slow = np.column_stack([np.interp(rows, some, np.round(column[some], 2)) for column in measurements.nu_raw.T])
    assert held(replace(measurements, nu_raw=slow)) is None


def test_a_position_that_stands_still_while_the_vessel_moves_is_held() -> None:
    measurements = sailed(5, 300.0)
    eta = measurements.eta.copy()
    fast = int(np.argmax(np.abs(measurements.nu[200:-200, 0]))) + 200
    eta[fast - 60 : fast + 60, :2] = eta[fast - 60, :2]
    finding = held(replace(measurements, eta=eta))
    assert finding is not None
    assert "north, east" in finding.says
    assert "heading" not in finding.says


def test_the_force_of_what_was_not_recorded_has_the_interval_of_velocity_and_pose() -> None:
    ramp = np.interp(0.1 * np.arange(300), [0.0, 10.0, 15.0, 30.0], [0.0, 0.0, 1.5, 1.5])
    true = FERRY.hull.mass_kg * 0.3
    widths = []
    for noise in (0.02, 0.1):
        inside = 0
        for seed in range(20):
            clean = run(ramp)
            nu = clean.nu_raw + noise * np.random.default_rng(seed).standard_normal(clean.nu_raw.shape)
            finding = unrecorded(replace(clean, nu_raw=nu))
            assert finding is not None
            force = finding.parameters["force"]
            # The steepest of many slopes is picked, so that it lies above the true one.
            inside += force.low <= true <= force.high
        widths.append(force.high - force.low)
        assert inside >= 14
    assert 0.0 < widths[0] < 0.4 * widths[1]
