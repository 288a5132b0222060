"""A recording against a simulation of the same trial: only what differs is found, whatever the two have in common."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.diagnose.data.measurements import read_measurements, window_lengths
from ferryid.diagnose.data.path_comparison import PathComparison, compare_paths
from ferryid.diagnose.inference import simulation_baseline as against
from ferryid.diagnose.inference.estimation import estimation_problem
from ferryid.diagnose.inference.prior import prior_force_model
from ferryid.diagnose.inference.search import Search, search
from ferryid.diagnose.inference.simulation_baseline import (
    Simulation,
    differing_candidates,
    learn_simulation,
    simulated_force_model,
)
from ferryid.diagnose.inference.weak_form import windows
from ferryid.diagnose.pipeline import DiagnosisSettings, diagnose
from ferryid.effects.force_model import Measurements, acceleration
from ferryid.errors import FerryIdError
from ferryid.simulate import parse_scenario, simulate, write_log
from ferryid.types import IN_MEMORY, no_progress
from ferryid.vessel import load_profile

pytestmark = pytest.mark.slow

FERRY = load_profile("milliampere")
FIXTURES = Path(__file__).resolve().parents[3] / "fixtures"
BASE = """
schema = "ferryid.scenario/1"
vessel = "milliampere"
path = { kind = "twelve-corner", dwell_s = 26 }
controller = { delta = 0.7, sigma = 0.7 }
sensors = { imu_rate_hz = 0.0, camera_rate_hz = 0.0 }
"""
FAULT = 'thrusters = { faults = [ { thruster = "thruster1", factor = 0.8, from_s = 160.0 } ] }\n'
HULL = ("m11", "m22", "m33", "X_u", "X_|u|u", "Y_v", "Y_|v|v", "Y_|r|v", "Y_|v|r", "N_r", "N_|r|r", "N_|r|v")


def wind(north: float) -> str:
    return f"environment = {{ wind = {{ north_mps = {north}, east_mps = 0.0 }} }}\n"


def sailed(folder: Path, name: str, tables: str, seed: int, hull: float = 1.0, dwell_s: int = 26) -> str:
    text = BASE.replace("dwell_s = 26", f"dwell_s = {dwell_s}")
    scenario = replace(parse_scenario(text + tables, name), true_hull=dict.fromkeys(HULL, hull) if hull != 1.0 else {})
    write_log(simulate(scenario, seed), folder / f"{name}.mcap")
    return str(folder / f"{name}.mcap")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("against")


@pytest.fixture(scope="module")
def windy(folder: Path) -> str:
    return sailed(folder, "simulation", wind(2.0), 2)


@pytest.fixture(scope="module")
def simulated(windy: str) -> Simulation:
    return learn_simulation(windy, FERRY)


def found(simulated: Simulation, log: str) -> Search:
    seen = windows(read_measurements(log, FERRY)[0], *window_lengths(FERRY))
    plain, spread = simulated_force_model(simulated, seen.measurements)
    return search(
        estimation_problem(seen, plain, spread), no_progress, known=differing_candidates(simulated, seen.measurements)
    )


def test_only_the_fault_is_found_where_both_have_the_wind(folder: Path, windy: str) -> None:
    log = sailed(folder, "recording", wind(2.0) + FAULT, 4)
    result = diagnose([log], FERRY, DiagnosisSettings(against=windy), IN_MEMORY)[0]
    assert result.verdict == "explained"
    (fault,) = result.findings
    assert (fault.effect, fault.instance) == ("thruster_gain", "thruster1")
    assert fault.parameters["factor"].value == pytest.approx(0.8, abs=0.02)
    assert fault.parameters["onset"].low - 1.0 <= 160.0 <= fault.parameters["onset"].high + 1.0
    (condition,) = result.against["conditions"]
    assert condition["effect"] == "wind"
    assert condition["parameters"]["north"]["value"] == pytest.approx(2.0, abs=0.1)
    assert result.against["paths"]["shift_s"] == pytest.approx(0.0, abs=1.0)
    assert 0.1 < result.against["paths"]["rms"]["position_m"] < 1.0
    assert result.against["says"] in result.notes


def test_what_the_simulation_learnt_is_what_was_simulated(simulated: Simulation) -> None:
    (blown,) = simulated.conditions
    assert blown.candidate.effect.id == "wind"
    np.testing.assert_allclose(blown.values[:2], [2.0, 0.0], atol=0.1)


def test_a_wind_that_the_simulation_measures_is_a_condition_with_its_load_as_the_profile_has_it(folder: Path) -> None:
    text = BASE.replace("camera_rate_hz = 0.0", "camera_rate_hz = 0.0, wind_rate_hz = 2.0") + wind(3.0)
    write_log(simulate(parse_scenario(text, "measured"), 7), folder / "measured.mcap")
    known = learn_simulation(str(folder / "measured.mcap"), FERRY)
    (condition,) = against.simulation_as_json(known, "no path")["conditions"]
    assert set(condition["parameters"]) == {"north", "east"}
    assert condition["parameters"]["north"]["value"] == pytest.approx(3.0, abs=0.1)
    (blown,) = known.conditions
    np.testing.assert_array_equal(blown.values[2:], 1.0)


def test_the_same_trial_with_other_noise_differs_in_nothing(folder: Path, simulated: Simulation) -> None:
    result = found(simulated, sailed(folder, "again", wind(2.0), 11))
    assert result.fit.candidates == ()
    assert result.rounds[0].none > 0.9


@pytest.mark.parametrize("north", [3.1, 0.0])
def test_a_wind_that_differs_is_told_with_both_values(folder: Path, simulated: Simulation, north: float) -> None:
    result = found(simulated, sailed(folder, f"wind-{north}", wind(north), 3))
    (one,) = result.fit.candidates
    assert one.effect.id == "wind"
    np.testing.assert_allclose(result.fit.values[0][:2], [north, 0.0], atol=0.1)
    says = one.effect.says({"north": north, "east": 0.0}, None)
    assert re.search(rf"north 2\.0\d m/s in the simulation, {north:.2f} m/s in the recording", says)
    assert "C_X" not in says


def test_a_simulated_hull_of_seven_tenths_hides_no_fault(folder: Path) -> None:
    light = learn_simulation(sailed(folder, "light", wind(2.0), 5, hull=0.7), FERRY)
    assert light.hull[0] == pytest.approx(0.7 * FERRY.hull.M[0, 0], rel=0.1)
    result = found(light, sailed(folder, "heavy", wind(2.0) + FAULT, 6))
    names = {one.key: values for one, values in zip(result.fit.candidates, result.fit.values, strict=True)}
    assert names["thruster_gain", "thruster1"][0] == pytest.approx(0.8, abs=0.03)
    # The hulls do differ; nothing else does.
    assert set(names) <= {("thruster_gain", "thruster1"), ("hull_parameters", None), ("fouling", None)}


def test_an_effect_that_both_have_is_taken_out_and_put_in_exactly(simulated: Simulation) -> None:
    measurements = windows(simulated.measurements, 8.0, 2.0).measurements
    force_model, _ = simulated_force_model(simulated, measurements)
    (one,) = [one for one in differing_candidates(simulated, measurements) if one.effect.id == "wind"]
    neutral = np.array([parameter.neutral for parameter in one.parameters])
    np.testing.assert_allclose(acceleration(one.act(force_model, neutral)), acceleration(force_model), atol=1e-12)
    still = replace(prior_force_model(measurements, FERRY)[0], hull=simulated.hull)
    np.testing.assert_allclose(acceleration(one.act(force_model, np.zeros(2))), acceleration(still), atol=1e-12)


def test_a_clock_that_started_later_is_found_from_the_path(simulated: Simulation) -> None:
    measurements = simulated.measurements
    compared = compare_paths(replace(measurements, t=measurements.t - 12.0), measurements)
    assert isinstance(compared, PathComparison)
    assert compared.shift_s == pytest.approx(12.0, abs=0.5)
    assert np.sqrt(np.mean(compared.position_m**2)) < 0.05


def test_paths_of_another_manoeuvre_are_not_compared(simulated: Simulation) -> None:
    def moved(eta: np.ndarray) -> Measurements:
        return replace(simulated.measurements, eta=eta)

    eta = simulated.measurements.eta
    assert "apart" in str(compare_paths(moved(eta[:, [1, 0, 2]] * [-3.0, 3.0, 1.0]), simulated.measurements))
    assert "no positions" in str(compare_paths(moved(np.full_like(eta, np.nan)), simulated.measurements))
    half = replace(simulated.measurements, usable=simulated.measurements.usable & (simulated.measurements.t < 200.0))
    assert "lasts" in str(compare_paths(half, simulated.measurements))


def test_a_simulation_too_short_to_learn_from_is_refused() -> None:
    with pytest.raises(FerryIdError, match="simulate and record the whole trial"):
        learn_simulation(str(FIXTURES / "short.mcap"), FERRY)


def test_a_simulation_of_another_vessel_is_refused(folder: Path) -> None:
    # The same signals, from a hull that answers its thrusters in another way altogether.
    other = replace(FERRY, actuators=tuple(replace(one, position_m=(0.3, 1.5)) for one in FERRY.actuators))
    log = sailed(folder, "hasty", "", 7, dwell_s=20)
    with pytest.raises(FerryIdError, match="needs a simulation of milliampere"):
        learn_simulation(log, other)


def test_model_and_simulation_exclude_each_other(windy: str) -> None:
    with pytest.raises(FerryIdError, match="both --model and --against"):
        diagnose([windy], FERRY, DiagnosisSettings(model=object(), against=windy), IN_MEMORY)  # type: ignore[arg-type]


def test_a_load_that_a_simulation_records_for_a_part_of_it_is_aboard_for_that_part() -> None:
    t = np.arange(0.0, 100.0)
    zero, usable = np.zeros((len(t), 3)), np.ones(len(t), dtype=bool)
    load = np.where(((t >= 30.0) & (t < 80.0))[:, None], [300.0, 0.5], 0.0)
    measurements = Measurements(
        FERRY, t, zero, zero, zero, np.zeros((len(t), 2, 3)), np.zeros((len(t), 2)), usable, payload=load
    )
    (one,) = against._measured(measurements)
    assert one.values == pytest.approx([300.0, 0.5])
    assert (one.candidate.onset_s, one.candidate.offset_s) == (30.0, 79.0)
