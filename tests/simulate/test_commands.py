"""What `ferryid simulate` refuses before it simulates, and what it tells afterwards."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import ferryid.simulate.commands as commands
from ferryid.errors import FerryIdError
from ferryid.simulate import load_scenario, run_scenario, simulate, write_log
from ferryid.simulate.size import check_size
from ferryid.vessel.load import load_profile

TEXT = """schema = "ferryid.scenario/1"
vessel = "boat.toml"
duration_s = 2

[path]
kind = "four-corner"

[environment.wind]
series = "wind.csv"
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "mine.toml").write_text(TEXT)
    (tmp_path / "boat.toml").write_text(load_profile("milliampere").text, encoding="utf-8")
    (tmp_path / "wind.csv").write_text("time,north,east\n0,1,0\n")
    return tmp_path


def run(folder: Path, **asked: Any) -> dict[str, Any]:
    asked = {"log": folder / "log.mcap", **asked}
    return run_scenario(str(folder / "mine.toml"), folder, **asked, progress=lambda stage: None)


@pytest.fixture
def never(monkeypatch: pytest.MonkeyPatch) -> None:
    def simulated(*_: object) -> None:
        raise AssertionError("simulated before the places were looked at")

    monkeypatch.setattr(commands, "simulate", simulated)


@pytest.mark.usefixtures("never")
@pytest.mark.parametrize("seed", [-1, 2**63, -(10**400)])
def test_a_seed_that_no_scenario_could_have(folder: Path, seed: int) -> None:
    with pytest.raises(FerryIdError, match=r"^--seed: must be a whole number of at least 0"):
        run(folder, seed=seed)


@pytest.mark.usefixtures("never")
@pytest.mark.parametrize("name", ["mine.toml", "boat.toml", "wind.csv"])
def test_no_source_is_written_over(folder: Path, name: str) -> None:
    before = (folder / name).read_bytes()
    for asked in ({"truth": folder / name}, {"json": folder / name}):
        with pytest.raises(FerryIdError, match=f"{name}: .*cannot take the place of what it is made from"):
            run(folder, overwrite=True, **asked)
    assert (folder / name).read_bytes() == before


@pytest.mark.usefixtures("never")
def test_places_come_before_the_simulation(folder: Path) -> None:
    (folder / "truth").write_bytes(b"PAR1")
    with pytest.raises(FerryIdError, match="exists already"):
        run(folder, truth=folder / "truth")
    with pytest.raises(FerryIdError, match="cannot be the same file"):
        run(folder, json=folder / "log.mcap")


def test_a_truth_that_fails_leaves_no_log_either(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pyarrow.parquet.write_table", failing)
    before = sorted(folder.iterdir())
    with pytest.raises(FerryIdError, match="truth: the disk is full"):
        run(folder, truth=folder / "truth")
    assert sorted(folder.iterdir()) == before


def test_a_profile_beside_the_scenario_is_taken_and_nothing_is_warned_of(folder: Path) -> None:
    result = run(folder, truth=folder / "truth.parquet", seed=2**63 - 1)
    assert result["warnings"] == []
    assert "warning" not in commands.render_simulation(result)
    assert json.loads(json.dumps(result)) == result
    again = run(folder, truth=folder / "truth.parquet", overwrite=True)
    assert again["seed"] == 0


@pytest.mark.parametrize(("column", "value"), [(0, 15.1), (1, -15.1), (2, -3.2)])
def test_motion_beyond_any_ferry_is_told(
    folder: Path, monkeypatch: pytest.MonkeyPatch, column: int, value: float
) -> None:
    def wild(*asked: Any, **more: Any) -> Any:
        simulation = simulate(*asked, **more)
        nu = simulation.truth.nu.copy()
        nu[40, column] = value
        return replace(simulation, truth=replace(simulation.truth, nu=nu))

    monkeypatch.setattr(commands, "simulate", wild)
    result = run(folder)
    (warning,) = result["warnings"]
    assert "the motion is not plausible: up to " in warning
    assert f"warning: {warning}" in commands.render_simulation(result).splitlines()


@pytest.mark.parametrize(
    ("asked", "keys"),
    [
        ({"imu_rate_hz": 1000.0}, "lower imu_rate_hz, navigation_rate_hz or duration_s"),
        ({"camera_rate_hz": 1000.0}, "lower camera_rate_hz, imu_rate_hz or duration_s"),
        ({"navigation_rate_hz": 200.0, "thruster_rate_hz": 200.0}, "lower navigation_rate_hz, "),
    ],
)
def test_a_trial_that_does_not_fit_into_memory_is_refused(asked: dict[str, float], keys: str) -> None:
    scenario = load_scenario("twelve-corner")
    large = replace(scenario, duration_s=14400.0, sensors=replace(scenario.sensors, **asked))
    with pytest.raises(FerryIdError, match=rf"^twelve-corner.toml: the trial would take .* GB .*Fix: {keys}"):
        simulate(large)
    check_size(replace(large, duration_s=1440.0), 2)
    check_size(replace(scenario, duration_s=14400.0), 2)


def test_what_came_while_it_was_simulated_stays(folder: Path) -> None:
    simulation = simulate(load_scenario(folder / "mine.toml"))
    write_log(simulation, folder / "log.mcap")
    before = (folder / "log.mcap").read_bytes()
    with pytest.raises(FerryIdError, match="exists already"):
        write_log(simulation, folder / "log.mcap")
    assert (folder / "log.mcap").read_bytes() == before
