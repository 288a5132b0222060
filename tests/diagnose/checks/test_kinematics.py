"""Slopes of positions, from which the check of the kinematics begins."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import savgol_filter

from ferryid.diagnose.checks import kinematics, velocity_scale
from ferryid.diagnose.checks.regression import Solution, scatter
from ferryid.diagnose.checks.spans import least_off, spans_of
from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.effects.force_model import Measurements
from ferryid.types import Floats
from ferryid.vessel import load_profile

FERRY = load_profile("milliampere")


@pytest.mark.parametrize("rows", [5, 9])
def test_slopes_are_those_of_savitzky_and_golay(rows: int) -> None:
    values = np.random.default_rng(8).standard_normal((60, 2)).cumsum(axis=0)
    known = savgol_filter(values, rows, 2, deriv=1, axis=0)
    np.testing.assert_allclose(kinematics._slope(values, rows), known, atol=1e-12)


@pytest.mark.parametrize(
    "p", [kinematics.NEUTRAL, np.array([1.2, 0.3, 0.5, -2.0, 0.13, 0.1, -0.2])], ids=["neutral", "all off"]
)
def test_derivatives_are_those_of_the_residual(p: Floats) -> None:
    t, rng = np.arange(0.0, 200.0, 0.1), np.random.default_rng(5)
    velocity = np.column_stack([1.0 + 0.3 * np.sin(t / 9.0), 0.2 * np.cos(t / 5.0)])
    walk = 0.02 * np.cumsum(rng.standard_normal((len(t), 3)), axis=0)
    problem, both = spans_of(0.0, 0.1, np.ones(len(t), dtype=bool), np.hstack([walk, velocity]))
    data = kinematics._Data(problem, both[:, :3], both[:, 3:], both[:, :2])
    derivatives = data.derivatives(p)
    for k, move in enumerate([1e-5, 1e-5, 1e-3, 1e-3, 1e-2, 1e-3, 1e-3]):
        ends = [data.residual(p + sign * move * np.eye(7)[k]) for sign in (1.0, -1.0)]
        np.testing.assert_allclose(derivatives[:, :, k], (ends[0] - ends[1]) / (2.0 * move), atol=1e-7)


def gauged(north: float, east: float, seed: int) -> Measurements:
    """Return a vessel that goes about, whose velocity over ground is multiplied by a factor to the north and to the east."""
    rng, step_s = np.random.default_rng(seed), 0.1
    t = np.arange(0.0, 900.0, step_s)
    psi = 0.8 * np.sin(t / 31.0) + 0.02 * t
    u, v = 1.0 + 0.5 * np.sin(t / 17.0), 0.2 * np.sin(t / 11.0)
    c, s = np.cos(psi), np.sin(psi)
    over = np.column_stack([c * u - s * v, s * u + c * v])
    eta = np.column_stack([np.cumsum(over, axis=0) * step_s, psi]) + rng.standard_normal((len(t), 3)) * [
        0.02,
        0.02,
        1e-3,
    ]
    seen = over * [north, east]
    r = np.gradient(psi, step_s)
    nu = np.column_stack([c * seen[:, 0] + s * seen[:, 1], c * seen[:, 1] - s * seen[:, 0], r])
    nu[:, :2] += 0.01 * rng.standard_normal((len(t), 2))
    still = np.zeros((len(t), len(FERRY.actuators), 3))
    return Measurements(FERRY, t, eta, nu, nu, still, still[:, :, 0], np.ones(len(t), dtype=np.bool_))


def test_a_factor_that_is_another_to_the_north_than_to_the_east_is_no_instruments() -> None:
    found = velocity_scale.find(gauged(0.94, 0.94, 1))
    assert found is not None
    assert found.parameters["factor"].low < 0.94 < found.parameters["factor"].high
    assert found.parameters["factor"].high - found.parameters["factor"].low < 0.02
    assert velocity_scale.find(gauged(0.99, 0.89, 1)) is None


def test_parts_that_agree_do_not_widen_an_error_and_parts_that_do_not_do() -> None:
    def parts(*values: float, freedom: int = 400) -> list[Solution | None]:
        return [None, *(Solution(np.array([one]), np.array([0.1]), freedom) for one in values)]

    assert scatter(parts(1.0, 1.1, 0.9), 0) == 1.0
    assert scatter(parts(1.0, 1.4), 0) == pytest.approx(np.sqrt(0.08 / 0.01), rel=0.01)
    # An error of few degrees of freedom is not known well, and one part has nothing to agree with.
    assert scatter(parts(1.0, 1.4, freedom=4), 0) == pytest.approx(np.sqrt(0.04 / 0.01), rel=0.01)
    assert scatter(parts(1.0, 1.4, freedom=3), 0) == 1.0
    assert scatter(parts(1.4), 0) == 1.0


def test_few_samples_a_window_leave_wrong_units_alone() -> None:
    assert least_off(0.1, 0.02) == least_off(1.0, 0.02) == 0.02
    assert least_off(1.1, 0.02) == CHECKS.sparse_scale


def test_a_slow_log_has_no_scale_that_its_samples_can_make() -> None:
    fast = gauged(0.9, 0.9, 2)
    assert velocity_scale.find(fast) is not None
    every = ("t", "eta", "nu_raw", "nu", "parts", "angles", "usable")
    assert velocity_scale.find(replace(fast, **{name: getattr(fast, name)[::11] for name in every})) is None


def test_velocities_that_are_slopes_of_the_position_show_no_error_of_a_sensor() -> None:
    wrong = gauged(0.9, 0.9, 2)
    assert kinematics.kinematics(wrong) is not None
    assert kinematics.kinematics(replace(wrong, slopes=frozenset("uv"))) is None
