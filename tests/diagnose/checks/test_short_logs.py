"""Errors of sensors in logs of a minute and a half, which leave few independent residuals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.diagnose.checks import (
    clock_offset,
    examine,
    heading_bias,
    held_samples,
    lever_arm,
    refilter_velocity,
    velocity_scale,
    yaw_rate_scale,
)
from ferryid.diagnose.checks.check import SensorFinding
from ferryid.diagnose.checks.regression import independence
from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.effects.force_model import Measurements
from ferryid.vessel import load_profile
from ferryid.vessel.frames import to_body, to_world

FERRY = load_profile("milliampere")
STEP_S = 0.1


def turning(seed: int, seconds: float = 90.0, arm: tuple[float, float] = (0.0, 0.0)) -> Measurements:
    """Return a vessel that turns to and fro at about 1 m/s, with an antenna off its origin, and noise."""
    rng = np.random.default_rng(seed)
    n = round(seconds / STEP_S)
    t = STEP_S * np.arange(n)
    psi, rate = 1.2 * np.sin(0.25 * t), 0.3 * np.cos(0.25 * t)
    nu = np.column_stack([1.0 + 0.3 * np.sin(0.11 * t), 0.1 * np.sin(0.17 * t), rate])
    over_ground = np.column_stack(to_world(nu[:, 0], nu[:, 1], psi))
    place = np.vstack([[0.0, 0.0], np.cumsum(0.5 * STEP_S * (over_ground[1:] + over_ground[:-1]), axis=0)])
    one = np.ones(n)
    place += np.column_stack(to_world(arm[0] * one, arm[1] * one, psi))
    eta = np.column_stack([place, psi]) + rng.normal(size=(n, 3)) * [0.02, 0.02, 0.003]
    nu = nu + rng.normal(size=(n, 3)) * [0.02, 0.02, 0.003]
    return Measurements(FERRY, t, eta, nu, nu, np.zeros((n, 2, 3)), np.zeros((n, 2)), np.ones(n, dtype=np.bool_))


def holds(finding: SensorFinding | None, **truth: float) -> None:
    assert finding is not None
    for name, value in truth.items():
        one = finding.parameters[name]
        assert one.low <= value <= one.high, (name, one)


def scaled(measurements: Measurements, *factors: float) -> Measurements:
    return replace(measurements, nu_raw=measurements.nu_raw * factors, nu=measurements.nu * factors)


def turned(measurements: Measurements, degrees: float) -> Measurements:
    return replace(measurements, eta=measurements.eta + np.array([0.0, 0.0, np.radians(degrees)]))


@pytest.mark.parametrize("arm", [(0.8, -0.6), (3.2, 2.4), (-4.0, 0.0)])
def test_an_antenna_off_the_origin_is_found_whole(arm: tuple[float, float]) -> None:
    found = lever_arm.find(turning(1, arm=arm))
    holds(found, x=arm[0], y=arm[1])
    assert found is not None
    assert found.parameters["x"].high - found.parameters["x"].low < 0.2


def test_scales_and_a_bias_are_found() -> None:
    holds(yaw_rate_scale.find(scaled(turning(2), 1.0, 1.0, 0.8)), factor=0.8)
    holds(velocity_scale.find(scaled(turning(3), 1.2, 1.2, 1.0)), factor=1.2)
    holds(heading_bias.find(turned(turning(4), 5.0)), angle=5.0)


@pytest.mark.parametrize("seed", range(12))
def test_nothing_is_found_where_nothing_is_wrong(seed: int) -> None:
    measurements = turning(100 + seed)
    for one in (yaw_rate_scale, velocity_scale, heading_bias, lever_arm):
        assert one.find(measurements) is None


def test_two_errors_that_hide_each_other_are_found() -> None:
    # A heading that is off looks like a drift on the mean course; what is left of it and a delay are each other's scatter.
    measurements = turning(5)
    eta = measurements.eta.copy()
    eta[:, :2] = np.column_stack([np.interp(measurements.t + 0.6, measurements.t, one) for one in eta[:, :2].T])
    holds(heading_bias.find(turned(replace(measurements, eta=eta), 5.0)), angle=5.0)


def test_blocks_of_a_long_log_are_those_of_the_convention() -> None:
    long, short = (independence(np.arange(n, dtype=np.int64)) for n in (400, 60))
    assert long == (CHECKS.independent_strides, 1.0)
    assert short[0] == 5
    assert 1.0 < short[1] < 2.0


def repeated(measurements: Measurements, first_s: float, last_s: float, *channels: int) -> Measurements:
    """Return measurements from which a stretch of repeats was taken out while they were read: bridged and not usable."""
    gone = (measurements.t > first_s) & (measurements.t < last_s)
    both = np.column_stack([measurements.eta, measurements.nu_raw])
    t = measurements.t
    bridged = np.column_stack([np.interp(t, t[~gone], one[~gone]) for one in both.T])
    return replace(
        measurements,
        eta=bridged[:, :3],
        nu_raw=bridged[:, 3:],
        usable=measurements.usable & ~gone,
        repeats=((channels, first_s, last_s),),
    )


def test_repeats_that_were_taken_out_while_reading_are_found() -> None:
    finding = held_samples.find(repeated(turning(6), 40.0, 42.0, 0, 1, 2, 3, 4, 5))
    holds(finding, share=100.0 * 2.0 / 90.0, longest=2.0)
    assert finding is not None
    assert "heading" in finding.says


def test_a_vessel_at_rest_repeats_itself_rightly() -> None:
    measurements = turning(7)
    nu = measurements.nu_raw.copy()
    # What comes after the repeats is what came before them.
    nu[419:422, 0] = nu[400, 0]
    assert held_samples.find(repeated(replace(measurements, nu_raw=nu), 40.0, 42.0, 3)) is None
    nu[419:422, 0] = nu[400, 0] + 0.5
    assert held_samples.find(repeated(replace(measurements, nu_raw=nu), 40.0, 42.0, 3)) is not None


@pytest.mark.parametrize("seconds", [90.0, 400.0])
def test_a_clock_offset_is_corrected_in_a_log_that_is_long_enough(seconds: float) -> None:
    measured = turning(3, seconds)
    eta = np.column_stack([np.roll(measured.eta[:, :2], 8, axis=0), measured.eta[:, 2]])
    late = replace(measured, eta=eta, usable=np.arange(len(eta)) >= 8)
    found = clock_offset.find(late)
    holds(found, seconds=0.8)
    assert found is not None
    assert ("not corrected" in found.says) == (seconds < 100.0)
    moved = found.correct(late)
    assert (moved is late) == (seconds < 100.0)


def test_the_velocity_in_products_has_no_part_of_a_late_clock() -> None:
    right = turning(3, 400.0)
    late_by = 8
    over_ground = np.column_stack(to_world(right.nu_raw[:, 0], right.nu_raw[:, 1], right.psi))
    north, east = np.roll(over_ground, late_by, axis=0).T
    nu_raw = np.column_stack([*to_body(north, east, right.psi), right.nu_raw[:, 2]])
    # As it is made while a log is read: slow from the positions, which are not late, and fast from the velocities.
    wrong = replace(right, nu_raw=nu_raw, usable=np.arange(len(nu_raw)) >= late_by)
    steady, made = (refilter_velocity(one) for one in (right, wrong))
    findings, corrected = examine(made)
    assert [one.effect for one in findings] == ["clock_offset"]
    holds(findings[0], seconds=-0.8)
    rows = corrected.usable & (right.t > 10.0) & (right.t < 390.0)
    assert np.abs(corrected.nu - steady.nu)[rows, :2].max() < 0.06
