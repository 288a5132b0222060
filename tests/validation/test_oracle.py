"""The oracle: it finds what it is given as well as a log can show it, and gains nothing from what is not there."""

from __future__ import annotations

import json
from collections.abc import Callable
from math import nan

import numpy as np
import pytest

from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.effects.thresholds import EFFECTS
from ferryid.errors import FerryIdError
from ferryid.simulate import parse_scenario, simulate, write_log
from ferryid.validation.case import Truth
from ferryid.validation.oracle import floor_of, oracle, oracle_of_each
from ferryid.validation.oracle_calibration import calibrated_thresholds, tail_quantile
from ferryid.validation.records import OracleEstimate, OracleResult
from ferryid.vessel import load_profile

pytestmark = pytest.mark.slow

FERRY = load_profile("milliampere")
BASE = """
schema = "ferryid.scenario/1"
vessel = "milliampere"
path = { kind = "four-corner", rounds = 2 }
controller = { delta = 0.7, sigma = 0.7 }
sensors = { imu_rate_hz = 0.0, camera_rate_hz = 0.0 SENSORS }
"""
HULL = 'true_hull = { m11 = 1.1, m22 = 0.9, "Y_|v|v" = 1.1, N_r = 0.9 }\n'
LAG = Truth("thruster_lag", None, {})
WIND = Truth("wind", None, {})

Logs = Callable[..., str]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Logs:
    made: dict[tuple[str, str], str] = {}

    def path(tables: str = "", sensors: str = "") -> str:
        if (tables, sensors) not in made:
            where = tmp_path_factory.mktemp("log") / "trial.mcap"
            usual = "" if "true_hull" in tables else HULL
            text = BASE.replace(" SENSORS", f", {sensors}" if sensors else "") + usual + tables
            write_log(simulate(parse_scenario(text, "trial"), 3), where)
            made[tables, sensors] = str(where)
        return made[tables, sensors]

    return path


def one(result: OracleResult, effect: str = "") -> OracleEstimate:
    return next(each for each in result.recovered if effect in ("", each.effect))


def wind_of(north_mps: float, more: str = "") -> str:
    return f"environment = {{ wind = {{ north_mps = {north_mps}, east_mps = 0.5{more} }} }}\n"


def test_a_known_wind_is_estimated_and_its_true_size_is_never_used(log: Logs) -> None:
    path = log(wind_of(1.0))
    result = oracle(path, FERRY, [Truth("wind", None, {"north": nan, "east": nan})])
    found = one(result)
    assert result.named
    assert found.named
    assert found.free == 2
    for name, true in (("north", 1.0), ("east", 0.5)):
        estimate = found.parameters[name]
        assert estimate.low < true < estimate.high
        assert estimate.value == pytest.approx(true, abs=0.03)
    assert result.gain == pytest.approx(found.gain, rel=0.02)
    again = oracle(path, FERRY, [Truth("wind", None, {"north": 9.0, "east": 9.0})])
    assert one(again) == found
    assert json.loads(json.dumps(result.to_json()))["recovered"][0]["parameters"]["north"]["unit"] == "m/s"


def test_what_is_too_small_to_be_worth_a_name_is_marked(log: Logs) -> None:
    def of(truth: Truth, tables: str = "", sensors: str = "") -> OracleEstimate:
        return one(oracle(log(tables, sensors), FERRY, [truth]))

    gain, bias = Truth("thruster_gain", "thruster1", {}), Truth("heading_bias", None, {})
    fault = "thrusters = {{ faults = [{{ thruster = 'thruster1', factor = {} }}] }}\n"
    error = "navigation = {{ heading_bias_deg = {} }}"
    assert [of(gain, fault.format(factor)).idle for factor in (0.998, 0.8)] == [True, False]
    assert [of(bias, sensors=error.format(angle)).idle for angle in (0.3, 3.0)] == [True, False]


def test_the_gain_grows_with_the_square_of_the_size(log: Logs) -> None:
    gains = [
        one(
            oracle(
                log(f"thrusters = {{ faults = [{{ thruster = 'thruster1', factor = {factor} }}] }}\n"), FERRY, [truth]
            )
        )
        for factor in (0.995, 0.99)
        for truth in [Truth("thruster_gain", "thruster1", {})]
    ]
    # Where it is larger, the noise that is learnt without it takes some of it up.
    assert gains[1].gain / gains[0].gain == pytest.approx(4.0, rel=0.3)
    # Of one parameter of a nearly linear model, the gain is half of the square of its deviate.
    for each in gains:
        factor = each.parameters["factor"]
        away, error = factor.value - 1.0, (factor.high - factor.low) / (2.0 * 1.96)
        deviate = away * INFERENCE.posterior_factor / np.sqrt(error**2 - (EFFECTS.definition_error * away) ** 2)
        assert each.gain == pytest.approx(0.5 * deviate**2, rel=0.25)


def test_a_clean_log_gains_little_from_any_effect(log: Logs) -> None:
    every = [
        WIND,
        LAG,
        Truth("thruster_gain", "thruster2", {}),
        Truth("payload", None, {}, onset_s=200.0),
        Truth("mooring", None, {}),
        Truth("hull_parameters", None, {}),
        Truth("lever_arm", None, {}),
        Truth("yaw_rate_scale", None, {}),
        Truth("azimuth_resolution", None, {}),
    ]
    result = oracle_of_each(log(), FERRY, every)
    assert [(each.effect, each.instance) for each in result.recovered] == [truth.key for truth in every]
    assert not any(each.named for each in result.recovered)
    assert all(each.gain >= 0.0 for each in result.recovered)
    # Each is estimated by itself, with others before it or not.
    assert result.recovered[1] == one(oracle(log(), FERRY, [LAG]))


def test_of_two_effects_each_gains_what_it_adds_to_the_other(log: Logs) -> None:
    path = log(wind_of(1.0))
    result = oracle(path, FERRY, [LAG, WIND])
    assert [each.effect for each in result.recovered] == ["thruster_lag", "wind"]
    assert one(result, "wind").named
    assert not one(result, "thruster_lag").named
    assert not result.named
    assert one(result, "wind").gain == pytest.approx(one(oracle(path, FERRY, [WIND])).gain, rel=0.1)
    assert result.gain == pytest.approx(one(result, "wind").gain, rel=0.1)


def test_a_known_onset_is_when_the_effect_begins(log: Logs) -> None:
    path = log("thrusters = { faults = [{ thruster = 'thruster1', factor = 0.85, from_s = 250.0 }] }\n")
    right, late, always, other = (
        one(oracle(path, FERRY, [Truth("thruster_gain", thruster, {}, onset_s=onset)]))
        for thruster, onset in (("thruster1", 250.0), ("thruster1", 400.0), ("thruster1", None), ("thruster2", 250.0))
    )
    assert right.gain > max(late.gain, always.gain, other.gain) + 20.0
    assert right.parameters["factor"].low < 0.85 < right.parameters["factor"].high


def test_a_gyro_is_corrected_before_forces_are_estimated(log: Logs) -> None:
    path = log(wind_of(1.0), "navigation = { yaw_rate_factor = 1.5 }")
    result = oracle(path, FERRY, [WIND, Truth("yaw_rate_scale", None, {})])
    assert result.named
    factor, north = one(result, "yaw_rate_scale").parameters["factor"], one(result, "wind").parameters["north"]
    assert factor.low < 1.5 < factor.high
    assert north.low < 1.0 < north.high
    assert result.gain == pytest.approx(sum(each.gain for each in result.recovered), rel=0.05)
    # Without the gyro among the known effects the wind is estimated less well.
    assert one(result, "wind").gain > one(oracle(path, FERRY, [WIND])).gain + 5.0


def test_an_unlikely_hull_is_no_explanation(log: Logs) -> None:
    # Refitted freely, the hull alone would explain a fouled log as well.
    grown = ', "X_|u|u" = 1.6, "N_|r|r" = 1.6, "Y_|v|v" = 1.76'
    found = one(oracle(log(f"true_hull = {{ m11 = 1.1, m22 = 0.9{grown} }}\n"), FERRY, [Truth("fouling", None, {})]))
    assert found.gain > 10.0


def test_steps_of_the_angles_are_read_off_them(log: Logs) -> None:
    found = one(oracle(log("", "azimuth_step_deg = 3.0"), FERRY, [Truth("azimuth_resolution", None, {})]))
    assert found.named
    assert found.parameters["step"].value == pytest.approx(3.0, abs=1e-3)


def test_an_antenna_that_everything_was_measured_at_is_estimated_by_forces(log: Logs) -> None:
    found = one(oracle(log("", "navigation = { antenna_m = [1.0, 0.4] }"), FERRY, [Truth("lever_arm", None, {})]))
    assert found.named
    assert found.floor == pytest.approx(floor_of(2, tries=2))
    for name, true in (("x", 1.0), ("y", 0.4)):
        assert found.parameters[name].low < true < found.parameters[name].high


def test_gusts_are_estimated_beside_their_wind_whether_that_is_given_or_not(log: Logs) -> None:
    path = log(wind_of(4.0, ", gust_std_mps = 1.0, gust_time_s = 8.0"))
    alone = oracle(path, FERRY, [Truth("gusts", None, {})])
    both = oracle(path, FERRY, [WIND, Truth("gusts", None, {})])
    assert both.named
    assert one(both, "gusts").parameters["std"].value == pytest.approx(1.0, abs=0.25)
    assert one(both, "gusts").gain == pytest.approx(one(alone).gain, rel=0.05)
    north = one(both, "wind").parameters["north"]
    assert north.low < 4.0 < north.high
    # Slow gusts could stand in for a steady wind: less of it is certain than would be in steady air.
    assert 5.0 < one(both, "wind").gain < 0.5 * both.gain


def test_what_a_log_cannot_show_has_a_reason(log: Logs) -> None:
    bare = FERRY.__class__(**{**vars(FERRY), "wind": None})
    found = one(oracle(log(), bare, [WIND]))
    assert "wind areas" in found.cannot
    assert not found.named


def test_unknown_effects_are_refused(log: Logs) -> None:
    with pytest.raises(FerryIdError, match=r'called "wnd".*wind.*Fix:'):
        oracle("nowhere.mcap", FERRY, [Truth("wnd", None, {})])
    with pytest.raises(FerryIdError, match=r"no instance thruster9 .* thruster1, thruster2. Fix:"):
        oracle("nowhere.mcap", FERRY, [Truth("thruster_gain", "thruster9", {})])


def test_floors_are_half_of_the_chi_squared_quantiles() -> None:
    # Fisher's table: 6.635 for one and 9.210 for two degrees of freedom, 7.879 at half a per cent.
    assert floor_of(1) == pytest.approx(0.5 * 6.635, abs=1e-3)
    assert floor_of(2) == pytest.approx(0.5 * 9.210, abs=1e-3)
    assert floor_of(1, tries=2) == pytest.approx(0.5 * 7.879, abs=1e-3)


def test_clean_logs_raise_what_must_be_gained_and_never_lower_it() -> None:
    rng = np.random.default_rng(0)
    floor = floor_of(2)
    # Twice what chance should gain, half of it, and too few to tell.
    gains = {
        "wind": 2.0 * rng.exponential(size=60),
        "current": 0.5 * rng.exponential(size=60),
        "waves": np.full(7, 50.0),
    }
    clean = [OracleEstimate(name, None, gain, 2, floor) for name, some in gains.items() for gain in some.tolist()]
    found = calibrated_thresholds(clean)
    assert found["wind"] == pytest.approx(2.0 * floor, rel=0.25)
    assert found["current"] == floor
    assert found["waves"] == floor
    # An exponential tail: one in a hundred exceeds it, on average over many sets of clean logs.
    shares = [float(np.exp(-tail_quantile(rng.exponential(size=60)))) for _ in range(400)]
    assert 0.007 < float(np.mean(shares)) < 0.016
