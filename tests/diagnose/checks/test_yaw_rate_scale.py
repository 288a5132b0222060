"""The gyro's factor at the full noise of Table 5.2, where turns are few against it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.diagnose.checks.yaw_rate_scale import find
from ferryid.effects.force_model import Measurements
from ferryid.simulate import load_scenario
from ferryid.simulate.sections import Navigation
from ferryid.simulate.trial import sail
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
