"""Rounded azimuth angles: the step is read off them, the true angle comes back nearer, and fine steps are no finding."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.diagnose.checks.azimuth_resolution import find, restored, step_of
from ferryid.effects.force_model import Measurements
from ferryid.simulate import load_scenario
from ferryid.simulate.trial import sail
from ferryid.types import Floats
from ferryid.vessel.load import load_profile

PROFILE = load_profile("milliampere")


def true_angle(seed: int) -> Floats:
    truth = sail(replace(load_scenario("twelve-corner-calm"), duration_s=300.0), PROFILE, seed)[0]
    rows = np.arange(truth.t[0], truth.t[-1], 0.05)
    noise = np.radians(0.05) * np.random.default_rng(seed).standard_normal(len(rows))
    return np.asarray(np.interp(rows, truth.t, np.unwrap(truth.angles[:, 0])) + noise)


def read(angle: Floats, step_deg: float) -> Floats:
    step = np.radians(step_deg)
    return np.asarray(step * np.round(angle / step))


def measurements(angle: Floats, step_deg: float) -> Measurements:
    n = len(angle)
    seen = read(angle, step_deg)
    force = 100.0 * np.stack([np.cos(seen), np.sin(seen), 1.8 * np.sin(seen)], axis=1)
    parts = np.stack([force, np.zeros((n, 3))], axis=1)
    still = np.zeros((n, 3))
    angles = np.column_stack([seen, np.zeros(n)])
    return Measurements(PROFILE, 0.05 * np.arange(n), still, still, still, parts, angles, np.ones(n, dtype=np.bool_))


@pytest.mark.parametrize("step_deg", [1.0, 5.0, 10.0, 22.5])
def test_the_step_is_read_off_and_a_smooth_angle_has_none(step_deg: float) -> None:
    angle = true_angle(1)
    assert step_of(read(angle, step_deg)) == pytest.approx(step_deg, rel=1e-6)
    assert step_of(angle) == 0.0
    assert step_of(np.full(500, 0.3)) == 0.0


@pytest.mark.parametrize("step_deg", [10.0, 20.0])
@pytest.mark.parametrize("seed", [1, 2])
def test_the_true_angle_comes_back_nearer(seed: int, step_deg: float) -> None:
    angle = true_angle(seed)
    seen = read(angle, step_deg)
    again = restored(seen, step_deg, 0.05)
    assert np.std(again - angle) < 0.8 * np.std(seen - angle)
    assert np.abs(again - seen).max() < np.radians(1.01 * step_deg)


def test_a_coarse_step_is_found_and_the_force_turned() -> None:
    angle = true_angle(3)
    seen = measurements(angle, 15.0)
    finding = find(seen)
    assert finding is not None
    assert finding.parameters["step"].value == pytest.approx(15.0)
    assert "15 deg" in finding.says
    after = finding.correct(seen)
    true = 100.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    assert np.std(after.parts[:, 0, :2] - true) < 0.8 * np.std(seen.parts[:, 0, :2] - true)
    x, y = PROFILE.actuators[0].position_m
    X, Y, N = after.parts[:, 0].T
    assert np.allclose(N, x * Y - y * X)


def test_whole_degrees_make_no_difference_and_are_no_finding() -> None:
    assert find(measurements(true_angle(3), 1.0)) is None
    assert find(measurements(true_angle(3), 3.5)) is None


@pytest.mark.parametrize("step_deg", [4.1, 11.5, 17.0])
def test_steps_that_no_turn_is_a_multiple_of_are_read_within_half_a_turn(step_deg: float) -> None:
    rows = np.arange(0.0, 300.0, 0.05)
    angle = 9.0 * np.sin(0.05 * rows) + 0.5 * np.sin(0.9 * rows)
    seen = np.unwrap(read(np.mod(angle + np.pi, 2.0 * np.pi) - np.pi, step_deg))
    assert step_of(seen) == pytest.approx(step_deg, rel=1e-6)
    again = restored(seen, step_deg, 0.05)
    assert np.std(again - angle) < 0.8 * np.std(seen - angle)
