"""The gyro's factor at the full noise of Table 5.2, where turns are few against it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.diagnose.checks.heading_rounding import rounding_steps
from ferryid.diagnose.checks.yaw_rate_scale import compared, find
from ferryid.effects.force_model import Measurements
from ferryid.simulate import load_scenario
from ferryid.simulate.sections import Navigation
from ferryid.simulate.trial import sail
from ferryid.types import Floats
from ferryid.vessel.load import load_profile

PROFILE = load_profile("milliampere")


def sailed(seed: int, factor: float) -> Measurements:
    scenario = load_scenario("twelve-corner-calm")
    sensors = replace(scenario.sensors, navigation=Navigation(yaw_rate_factor=factor))
    control = sail(replace(scenario, duration_s=600.0, sensors=sensors), PROFILE, seed)[1]
    n, nu = len(control.t), control.measured[:, 3:]
    forces, angles = np.zeros((n, 2, 3)), np.zeros((n, 2))
    return Measurements(PROFILE, control.t, control.measured[:, :3], nu, nu, forces, angles, np.ones(n, dtype=np.bool_))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_six_per_cent_are_found_and_none_is_not(seed: int) -> None:
    finding = find(sailed(seed, 1.06))
    assert finding is not None
    factor = finding.parameters["factor"]
    assert factor.low <= 1.06 <= factor.high
    assert find(sailed(seed, 1.0)) is None


def test_an_error_that_grows_with_the_rate_widens_the_interval() -> None:
    measurements = sailed(2, 1.06)
    even = find(measurements)
    assert find(replace(measurements, slopes=frozenset("r"))) is None, "nothing measured the rate"
    slow = np.repeat(np.random.default_rng(2).standard_normal(len(measurements.t) // 300 + 1), 300)[
        : len(measurements.t)
    ]
    uneven = measurements.nu_raw + np.column_stack([0.0 * slow, 0.0 * slow, 0.08 * slow * measurements.nu_raw[:, 2]])
    wide = find(replace(measurements, nu_raw=uneven))
    assert even is not None
    assert wide is None or wide.parameters["factor"].high - wide.parameters["factor"].low > 1.3 * (
        even.parameters["factor"].high - even.parameters["factor"].low
    )


def ship(factor: float, digits_deg: float, seed: int, *, circle: bool) -> Measurements:
    """Return a ship that turns at tenths of a degree a second: a circle that slows down, or slow turns to either side."""
    t = 0.1 * np.arange(24_000)
    rng = np.random.default_rng(seed)
    slow = 0.45 * (1.0 - 0.87 * np.clip((t - 1500.0) / 100.0, 0.0, 1.0))
    r = np.radians(slow if circle else 0.4 * np.sin(2.0 * np.pi * t / 400.0))
    psi = np.cumsum(r) * 0.1
    read = psi if digits_deg == 0.0 else np.radians(digits_deg * np.round(np.degrees(psi) / digits_deg))
    zero = np.zeros_like(t)
    nu = np.column_stack([zero + 8.0, zero, factor * r + 2e-5 * rng.standard_normal(len(t))])
    eta = np.column_stack([zero, zero, read])
    return Measurements(
        PROFILE, t, eta, nu, nu, np.zeros((len(t), 2, 3)), np.zeros((len(t), 2)), np.ones(len(t), dtype=np.bool_)
    )


@pytest.mark.parametrize("digits_deg", [1.0, 0.1, 0.0])
@pytest.mark.parametrize("circle", [True, False])
def test_a_rounded_heading_is_no_scale_of_the_yaw_rate(digits_deg: float, circle: bool) -> None:
    assert find(ship(1.0, digits_deg, 1, circle=circle)) is None
    finding = find(ship(0.95, digits_deg, 1, circle=circle))
    assert finding is not None
    factor = finding.parameters["factor"]
    assert factor.low <= 0.95 <= factor.high
    assert factor.high - factor.low < 0.02


def test_steps_of_a_rounded_heading() -> None:
    ramp = np.radians(np.concatenate([np.arange(0.0, 20.0, 0.01), np.arange(20.0, 40.0, 0.01)]))
    whole, tenths = (np.radians(size * np.round(np.degrees(ramp) / size)) for size in (1.0, 0.1))
    assert rounding_steps(whole)[300:-300] == pytest.approx(np.radians(1.0))
    mixed = rounding_steps(np.concatenate([tenths[:2000], whole[2000:]]))
    assert np.median(mixed[:1900]) == pytest.approx(np.radians(0.1))
    assert np.median(mixed[2300:]) == pytest.approx(np.radians(1.0))
    assert not rounding_steps(ramp).any(), "moves from row to row"
    noise = ramp + 1e-4 * np.random.default_rng(1).standard_normal(len(ramp))
    noise[1::50] = noise[::50]
    assert not rounding_steps(noise).any(), "repeats a value now and then, and moves between"
    jumped = whole.copy()
    jumped[2000:] += 0.5
    assert rounding_steps(jumped).max() == pytest.approx(np.radians(1.0)), "a jump is no rounding"
    assert not rounding_steps(np.zeros(1)).any()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("digits_deg", [1.0, 0.1])
def test_trials_with_rounded_headings(seed: int, digits_deg: float) -> None:
    for factor in (0.95, 1.0):
        measurements = sailed(seed, factor)
        rounded = np.radians(digits_deg * np.round(np.degrees(measurements.psi) / digits_deg))
        finding = find(replace(measurements, eta=np.column_stack([measurements.eta[:, :2], rounded])))
        assert (finding is None) == (factor == 1.0)
        if finding is not None:
            assert finding.parameters["factor"].low <= 0.95 <= finding.parameters["factor"].high


def turning(rate_degps: Floats, heading_degps: Floats, step_s: float = 0.5) -> Measurements:
    """Return a ship that turns at a rate, with a heading whose slope is another."""
    n = len(rate_degps)
    zero, rng = np.zeros(n), np.random.default_rng(4)
    # The roll of a ship moves its compass by a degree and a half with a period of fifteen seconds.
    swing = np.radians(1.5) * np.sin(
        2.0 * np.pi * step_s * np.arange(n) / 15.0 + 0.3 * np.cumsum(rng.standard_normal(n))
    )
    psi = np.cumsum(np.radians(heading_degps)) * step_s + swing
    nu = np.column_stack([zero + 4.0, zero, np.radians(rate_degps + 0.05 * rng.standard_normal(n))])
    eta = np.column_stack([zero, zero, psi])
    return Measurements(
        PROFILE,
        step_s * np.arange(n),
        eta,
        nu,
        nu,
        np.zeros((n, 2, 3)),
        np.zeros((n, 2)),
        np.ones(n, dtype=np.bool_),
    )


def test_a_steady_turn_shows_no_scale() -> None:
    # The bias of a gyro that makes up for a factor of 0.3 would be 1.7 degrees a second.
    rate = -2.4 - 0.3 * np.exp(-0.5 * np.arange(450) / 20.0)
    rates = compared(turning(rate, rate))
    assert rates is not None
    assert (rates.solution.values[0], rates.without_bias) == (pytest.approx(0.0, abs=0.5), pytest.approx(1.0, abs=0.04))
    assert find(turning(rate, rate)) is None
    # One that is off by a tenth is off so without a bias, too, and turns to either side show it.
    sides = 3.0 * np.sin(2.0 * np.pi * np.arange(1200) / 240.0)
    assert find(turning(1.1 * sides, sides)) is not None


def test_a_factor_that_differs_from_turn_to_turn_is_a_hint() -> None:
    sides = 3.0 * np.sin(2.0 * np.pi * np.arange(2400) / 240.0)
    # Every second of the blocks of a minute has a factor of 1.2, the others none.
    uneven = np.where((np.arange(2400) // 120) % 2 == 0, 1.2, 1.0)
    even, some = find(turning(1.1 * sides, sides)), find(turning(uneven * sides, sides))
    assert even is not None
    assert some is not None
    assert even.doubt == ""
    assert some.doubt.startswith("it scatters by 0.09")
