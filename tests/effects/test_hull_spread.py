"""How far off a hull model is believed to be: what a diagnosis blames on the hull before it names a force."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from pathlib import Path

import numpy as np
import pytest

from ferryid.diagnose.data.measurements import read_measurements
from ferryid.diagnose.inference.prior import prior_force_model
from ferryid.effects import effects
from ferryid.effects.force_model import COEFFICIENTS, Measurements, hull_of
from ferryid.effects.hull_spread import default_hull_spread, left_out
from ferryid.effects.thresholds import EFFECTS
from ferryid.simulate import parse_scenario, simulate, write_log
from ferryid.vessel import describe, load_profile
from ferryid.vessel.profile import Profile

FERRY = load_profile("milliampere")
SCENARIO = """
schema = "ferryid.scenario/1"
vessel = "milliampere"
duration_s = 60
sensors = { imu_rate_hz = 0.0, camera_rate_hz = 0.0 }
path = { kind = "four-corner", dwell_s = 15 }
"""


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("spread") / "trial.mcap"
    write_log(simulate(parse_scenario(SCENARIO, "trial"), 1), path)
    return path


def of_spread(spread: float) -> Profile:
    return replace(FERRY, hull=replace(FERRY.hull, spread=spread))


def measured(log: Path, profile: Profile) -> Measurements:
    return read_measurements(str(log), profile)[0]


def test_a_diagnosis_believes_the_profile(log: Path) -> None:
    for stated, share in ((np.nan, EFFECTS.hull_spread), (0.03, 0.03), (0.5, 0.5)):
        profile = of_spread(stated)
        _, spread = prior_force_model(measured(log, profile), profile)
        np.testing.assert_allclose(spread, share * np.abs(hull_of(FERRY)))


def test_a_hull_of_unknown_spread_is_where_estimates_start(log: Path) -> None:
    profile = of_spread(inf)
    seen = measured(log, profile)
    plain, spread = prior_force_model(seen, profile)
    np.testing.assert_array_equal(plain.hull, hull_of(FERRY))
    np.testing.assert_allclose(spread, default_hull_spread(profile, seen.nu[seen.usable]))
    for name in ("fouling", "hull_parameters", "shallow_water"):
        assert effects()[name].cannot(seen) == "the profile says that the spread of its hull model is unknown"
        assert not effects()[name].cannot(measured(log, FERRY))


def test_a_profile_says_how_far_off_its_hull_may_be() -> None:
    assert "standard deviation 30 % of each" in describe(of_spread(0.3))
    assert "may be off by any amount" in describe(of_spread(inf))
    assert "of each" not in describe(FERRY)


def test_damping_that_a_hull_model_leaves_out_may_be_as_large_as_of_any_hull_of_its_size(log: Path) -> None:
    measurements, _ = read_measurements(str(log), FERRY)
    hull = hull_of(FERRY)
    yaw = [k for k, name in enumerate(COEFFICIENTS) if name.startswith("N_") and len(name) > 3]
    assert not left_out(hull).any()
    linear = hull.copy()
    linear[yaw] = 0.0
    assert np.flatnonzero(left_out(linear)).tolist() == yaw
    # One that is in the model tells that the axis was measured; masses are never left out.
    linear[yaw[0]] = -1.0
    assert not left_out(linear).any()
    assert not left_out(np.zeros_like(hull))[:5].any()
    revolt = load_profile("revolt")
    _, spread = prior_force_model(replace(measurements, profile=revolt), revolt)
    free = left_out(hull_of(revolt))
    assert free.sum() > 10
    np.testing.assert_array_equal(spread[free], default_hull_spread(revolt, measurements.nu[measurements.usable])[free])
    np.testing.assert_allclose(spread[~free], EFFECTS.hull_spread * np.abs(hull_of(revolt))[~free])
