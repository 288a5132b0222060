"""The weak form against a trajectory integrated by SciPy, and against integrals known in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ferryid.diagnose.inference.weak_form import windows
from ferryid.effects.force_model import ForceModel, Measurements, hull_of
from ferryid.signals.complementary_filter import complementary_filter
from ferryid.simulate.plant.hull import hydrodynamics, required_force
from ferryid.types import Floats
from ferryid.vessel import load_profile

FERRY = load_profile("milliampere")
RATE_HZ = 20.0


def sailed(seconds: float = 60.0, current: tuple[float, float] = (0.0, 0.0)) -> tuple[Measurements, Floats]:
    """Return measurements of a hull under smooth forces of two thrusters, its motion from SciPy, and these forces (n, 2, 3)."""
    p = hydrodynamics(FERRY.hull)
    M = FERRY.hull.M

    def pushes(t: float) -> Floats:
        fore = np.array([150.0 * np.sin(0.13 * t), 90.0 * np.sin(0.21 * t + 1.0)])
        aft = np.array([100.0 + 50.0 * np.cos(0.11 * t), -70.0 * np.sin(0.17 * t)])
        return np.array([[*fore, 1.8 * fore[1]], [*aft, -1.8 * aft[1]]])

    def rates(t: float, y: Floats) -> Floats:
        c, s = np.cos(y[2]), np.sin(y[2])
        u_c, v_c = c * current[0] + s * current[1], c * current[1] - s * current[0]
        load = np.array(required_force(p, 0.0, 0.0, 0.0, y[3] - u_c, y[4] - v_c, y[5]))
        turned = np.array([y[5] * v_c, -y[5] * u_c, 0.0])
        nu_dot = np.linalg.solve(M, pushes(t).sum(axis=0) - load) + turned
        return np.array([c * y[3] - s * y[4], s * y[3] + c * y[4], y[5], *nu_dot])

    t = np.arange(0.0, seconds, 1.0 / RATE_HZ)
    y = solve_ivp(rates, (0.0, seconds), np.zeros(6), t_eval=t, rtol=1e-10, atol=1e-12, method="DOP853").y.T
    parts = np.array([pushes(one) for one in t])
    angles = np.arctan2(parts[:, :, 1], parts[:, :, 0])
    return Measurements(FERRY, t, y[:, :3], y[:, 3:], y[:, 3:], parts, angles, np.ones(len(t), dtype=bool)), parts


def still_air(measurements: Measurements) -> ForceModel:
    return ForceModel(
        measurements, hull_of(FERRY), measurements.parts, measurements.angles, np.zeros((len(measurements.t), 3))
    )


@pytest.mark.slow
@pytest.mark.parametrize("placed", [True, False], ids=["positions", "velocities"])
def test_the_right_force_model_leaves_no_gap(placed: bool) -> None:
    measurements, _ = sailed()
    if not placed:
        measurements = replace(
            measurements, eta=np.column_stack([np.full((len(measurements.t), 2), np.nan), measurements.eta[:, 2]])
        )
    seen = windows(measurements, 8.0, 2.0)
    gap = seen.gap(still_air(seen.measurements))
    assert np.abs(gap).max() < 2e-4
    assert np.abs(seen.measured[:, seen.channels]).max() > 0.03


@pytest.mark.slow
def test_a_current_leaves_no_gap_once_it_is_in_the_force_model() -> None:
    measurements, _ = sailed(current=(0.3, -0.2))
    seen = windows(measurements, 8.0, 2.0)
    plain = still_air(seen.measurements)
    flow = np.broadcast_to([0.3, -0.2], (len(seen.measurements.t), 2))
    assert np.abs(seen.gap(replace(plain, flow=flow))).max() < 2e-4
    assert np.abs(seen.gap(plain)).max() > 2e-3


@pytest.mark.parametrize("still", [True, False], ids=["still water", "current"])
@pytest.mark.parametrize("placed", [True, False], ids=["positions", "velocities"])
def test_changes_with_the_hull_are_those_of_the_gap(placed: bool, still: bool) -> None:
    measurements, _ = sailed(30.0)
    if not placed:
        measurements = replace(
            measurements, eta=np.column_stack([np.full((len(measurements.t), 2), np.nan), measurements.eta[:, 2]])
        )
    seen = windows(measurements, 8.0, 2.0)
    plain = still_air(seen.measurements)
    if not still:
        plain = replace(plain, flow=np.tile([0.3, -0.2], (len(seen.measurements.t), 1)))
    places = np.arange(len(plain.hull))
    moves = np.where(plain.hull != 0.0, 0.1 * plain.hull, 40.0)
    found = seen.hull_changes(plain, places, moves)
    for q, (place, move) in enumerate(zip(places, moves, strict=True)):
        hull = plain.hull.copy()
        hull[place] += move
        moved = seen.gap(replace(plain, hull=hull)) - seen.gap(plain)
        np.testing.assert_allclose(found[:, :, q], moved, rtol=0.0, atol=1e-9 * np.abs(moved).max())


def test_windows_average_derivatives_of_polynomials_exactly() -> None:
    t = np.arange(0.0, 40.0, 0.05)
    eta = np.column_stack([0.5 * 0.3 * t**2, 7.0 + 0.0 * t, 0.02 * t])
    nu = np.column_stack([0.1 * t, 0.2 * t - 3.0, 0.0 * t])
    blank = np.zeros((len(t), 2, 3))
    measurements = Measurements(FERRY, t, eta, nu, nu, blank, blank[:, :, 0], np.ones(len(t), dtype=bool))
    measured = windows(measurements, 8.0, 2.0).measured
    np.testing.assert_allclose(measured, np.broadcast_to([0.3, 0.0, 0.0, 0.1, 0.2, 0.0], measured.shape), atol=1e-9)


@pytest.mark.slow
def test_no_window_reaches_over_unusable_rows() -> None:
    measurements, _ = sailed()
    usable = np.ones(len(measurements.t), dtype=bool)
    usable[500:520] = False
    seen = windows(replace(measurements, usable=usable), 8.0, 2.0)
    half = 4.0
    middle = seen.middle_s
    assert ((middle + half <= measurements.t[500] + 0.05) | (middle - half >= measurements.t[519] - 0.05)).all()
    assert len(seen.runs) == 2
    assert sum(end - first for first, end in seen.runs) == len(seen.starts)


def test_slow_errors_of_the_velocity_are_taken_from_the_position_and_fast_motion_is_kept() -> None:
    measurements, _ = sailed()
    slow = 0.05 * np.sin(2.0 * np.pi * measurements.t / 40.0)[:, None] * np.ones(3)
    wrong = measurements.nu + slow
    better = complementary_filter(wrong, wrong, measurements.eta, RATE_HZ)
    inner = slice(100, -100)
    assert np.abs(better - measurements.nu)[inner].max() < 0.15 * np.abs(slow).max()
    assert (
        np.abs(complementary_filter(measurements.nu, measurements.nu, measurements.eta, RATE_HZ) - measurements.nu)[
            inner
        ].max()
        < 1e-3
    )
