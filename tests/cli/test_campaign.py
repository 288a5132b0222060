"""Several logs of one vessel on the command line: a campaign, what it leaves out, and each log by itself."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from ferryid.simulate import parse_scenario, simulate, write_log
from tests.cli.test_every_command import conforms
from tests.command_line.in_process import Run

pytestmark = pytest.mark.slow

VESSEL = ("--vessel", "milliampere")
SHORT = Path(__file__).resolve().parents[2] / "fixtures" / "short.mcap"
SCENARIO = """schema = "ferryid.scenario/1"
vessel = "milliampere"
path = { kind = "four-corner", dwell_s = 20 }
controller = { delta = 0.7, sigma = 0.7 }
environment = { wind = { north_mps = -3.0, east_mps = 2.0 } }
sensors = { imu_rate_hz = 0.0, camera_rate_hz = 0.0 }
"""

LADEN = """schema = "ferryid.scenario/1"
vessel = "milliampere"
path = { kind = "twelve-corner", dwell_s = 18, rounds = 1 }
environment = { wind = { north_mps = 2.0, east_mps = 1.8, gust_std_mps = 0.3, gust_time_s = 8 } }
sensors = { wind_rate_hz = 0.0, imu_rate_hz = 0.0, camera_rate_hz = 0.0 }
payload = [{ mass_kg = 500.0, x_m = 0.5 }]
"""
Command = Callable[..., Run]


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Three logs in one wind that no anemometer measures."""
    folder, made = tmp_path_factory.mktemp("campaign"), []
    for seed in (1, 2, 3):
        scenario = parse_scenario(SCENARIO, f"bag{seed}")
        silent = replace(scenario, sensors=replace(scenario.sensors, wind_rate_hz=0.0))
        made.append(folder / f"bag{seed}.mcap")
        write_log(simulate(silent, seed), made[-1])
    return made


def result(run: Run) -> dict[str, Any]:
    assert run.code == 0, run.err
    return dict(json.loads(run.out))


def test_a_wind_is_named_in_every_log_of_a_campaign_and_kept_in_its_model(
    ferryid: Command, bags: list[Path], tmp_path: Path
) -> None:
    made = result(ferryid("diagnose", *bags, *VESSEL, "--out", tmp_path, "--json", "-"))
    conforms(json.dumps(made))
    assert [one["log"] for one in made["logs"]] == ["bag1", "bag2", "bag3"]
    for one in made["logs"]:
        (wind,) = (finding for finding in one["findings"] if finding["effect"] == "wind")
        assert wind["probability"] > 0.9
        for name, true in (("north", -3.0), ("east", 2.0)):
            assert wind["parameters"][name]["low"] < true < wind["parameters"][name]["high"]
            assert wind["parameters"][name]["value"] == pytest.approx(true, abs=0.4)
        assert any("estimated with one hull for all 3: confirmed" in note for note in one["notes"])
        # The errors of the log are held out, without the wind and with it; so are those of the finding, and of its figure.
        assert one["after"]["mse"]["yaw"] < 0.7 * one["before"]["mse"]["yaw"]
        assert one["after"]["ratio"]["yaw"]["high"] < 1.0
        assert wind["mse"] == {name: one[name]["mse"] for name in ("before", "after")}
    assert "With it, the squared force error on data that it was not fitted to falls" in Path(made["report"]).read_text(
        "utf-8"
    )
    model = json.loads(Path(made["model"]).read_text("utf-8"))
    assert [one["name"] for one in model["training"]] == ["bag1", "bag2", "bag3"]
    for one, log in zip(model["conditions"], made["logs"], strict=True):
        (stored,) = (effect for effect in one["effects"] if effect["effect"] == "wind")
        (wind,) = (finding for finding in log["findings"] if finding["effect"] == "wind")
        assert {name: stored["parameters"][name]["value"] for name in ("north", "east")} == {
            name: wind["parameters"][name]["value"] for name in ("north", "east")
        }
    # Its wind acts in the log in which it blew, and predicts it better than the profile's hull does.
    evaluated = result(ferryid("evaluate", made["model"], bags[0], "--out", tmp_path, "--json", "-"))
    (log,) = evaluated["logs"]
    assert [one["effect"] for one in log["effects"]["conditions"]] == ["wind"]
    (left_out,) = log["effects"]["left_out"]
    assert left_out == "Steady wind of bag2 and 1 other log does not act here: conditions are those of one log."
    assert log["mse"]["model"]["sway"] < 0.5 * log["mse"]["base"]["sway"]


def test_each_log_by_itself_has_no_word_of_the_others(ferryid: Command, bags: list[Path], tmp_path: Path) -> None:
    made = result(ferryid("diagnose", *bags[:2], *VESSEL, "--each", "--out", tmp_path, "--json", "-"))
    assert not any("for all" in note or "other log" in note for one in made["logs"] for note in one["notes"])


def test_what_cannot_be_used_is_left_out_and_the_rest_goes_on(
    ferryid: Command, bags: list[Path], tmp_path: Path
) -> None:
    copy = shutil.copy(bags[0], tmp_path / "copy.mcap")
    foreign = tmp_path / "foreign.csv"
    foreign.write_text("time,temperature\n0,1\n1,2\n2,3\n", encoding="utf-8")
    run = ferryid("diagnose", *bags[:2], copy, foreign, *VESSEL, "--out", tmp_path)
    assert run.code == 0, run.err
    text = " ".join(run.out.split())
    assert "Left out of the campaign:" in text
    assert "foreign.csv" in text
    assert "1 further log is a copy and left out of the estimate: copy.mcap (of bag1.mcap)." in text
    assert text.count("copy.mcap: it holds the motion of bag1.mcap, as the same recording does under another name") == 1
    # It has no row of its own.
    assert "Of 2 logs," in text
    assert "copy partly" not in text
    assert "one hull for all 2: confirmed" in text
    model = json.loads((tmp_path / "models" / "milliampere" / "1.json").read_text("utf-8"))
    assert [one["name"] for one in model["training"]] == [one["log"] for one in model["conditions"]] == ["bag1", "bag2"]


def test_a_path_that_leads_nowhere_is_refused(ferryid: Command, bags: list[Path], tmp_path: Path) -> None:
    run = ferryid("diagnose", *bags[:2], tmp_path / "nowhere.mcap", *VESSEL, "--out", tmp_path)
    assert run.code == 2
    assert "nowhere.mcap: no such file" in run.err


def test_logs_of_which_none_can_be_used_are_refused(ferryid: Command, tmp_path: Path) -> None:
    for name in "ab":
        (tmp_path / f"{name}.csv").write_text("time,temperature\n0,1\n1,2\n2,3\n", encoding="utf-8")
    run = ferryid("diagnose", tmp_path / "a.csv", tmp_path / "b.csv", *VESSEL, "--out", tmp_path)
    assert run.code == 2
    assert run.err.count("Fix:") == 1


def test_references_bring_the_hull_and_have_no_diagnosis(ferryid: Command, bags: list[Path], tmp_path: Path) -> None:
    made = result(ferryid("diagnose", bags[0], "--reference", *bags[1:], *VESSEL, "--out", tmp_path, "--json", "-"))
    conforms(json.dumps(made))
    assert made["log"] == "bag1"
    assert "logs" not in made
    (wind,) = (finding for finding in made["findings"] if finding["effect"] == "wind")
    assert wind["parameters"]["north"]["value"] == pytest.approx(-3.0, abs=0.5)
    assert any(note.startswith("References: bag2.mcap and bag3.mcap.") for note in made["notes"])
    model = json.loads(Path(made["model"]).read_text("utf-8"))
    assert [one["name"] for one in model["training"]] == ["bag1"]


def test_a_reference_that_cannot_serve_is_refused(ferryid: Command, bags: list[Path], tmp_path: Path) -> None:
    copy = shutil.copy(bags[0], tmp_path / "copy.mcap")
    foreign = tmp_path / "foreign.csv"
    foreign.write_text("time,temperature\n0,1\n1,2\n2,3\n", encoding="utf-8")
    for other, cause in (
        (bags[0], "it is one of the logs to be diagnosed"),
        (copy, "it holds the motion of"),
        (tmp_path / "nowhere.mcap", "no such file"),
        (foreign, "foreign.csv"),
    ):
        run = ferryid("diagnose", bags[0], "--reference", other, *VESSEL, "--out", tmp_path)
        assert run.code == 2
        assert cause in run.err
        assert run.err.count("Fix:") == 1
    run = ferryid("diagnose", bags[0], "--against", bags[1], "--reference", bags[2], *VESSEL, "--out", tmp_path)
    assert run.code == 2
    assert "both --against and --reference" in run.err
    assert not (tmp_path / "reports").exists()


def test_a_load_aboard_in_all_logs_is_no_weak_thruster(ferryid: Command, tmp_path: Path) -> None:
    """Beside a hull that comes from the same logs a load was not tried, and a thruster of 92 % named in its place."""
    logs = []
    for seed in (11, 12, 13):
        logs.append(tmp_path / f"laden{seed}.mcap")
        write_log(simulate(parse_scenario(LADEN, f"laden{seed}"), seed), logs[-1])
    made = result(ferryid("diagnose", *logs, *VESSEL, "--out", tmp_path, "--json", "-"))
    for one in made["logs"]:
        named = {finding["effect"]: finding for finding in one["findings"] if finding["probability"] > 0.5}
        assert "thruster_gain" not in named
        assert named["payload"]["parameters"]["mass"]["low"] < 500.0 < named["payload"]["parameters"]["mass"]["high"]
    model = json.loads(Path(made["model"]).read_text("utf-8"))
    assert all("payload" in {effect["effect"] for effect in one["effects"]} for one in model["conditions"])
    assert result(ferryid("evaluate", made["model"], logs[0], "--out", tmp_path, "--json", "-"))["logs"]


def test_a_fit_of_several_logs_names_the_one_that_it_leaves_out(
    ferryid: Command, bags: list[Path], tmp_path: Path
) -> None:
    foreign = tmp_path / "foreign.csv"
    foreign.write_text("time,temperature\n0,1\n1,2\n2,3\n", encoding="utf-8")
    run = ferryid("fit", *bags[:2], foreign, *VESSEL, "--out", tmp_path)
    assert run.code == 0, run.err
    assert "warning: Left out of the fit: " in run.out
    page = (tmp_path / "reports" / "milliampere-v1" / "report.html").read_text("utf-8")
    assert "Left out of the fit: " in page
    made = result(ferryid("evaluate", "milliampere@1", bags[2], foreign, "--out", tmp_path, "--json", "-"))
    conforms(json.dumps(made))
    assert "foreign.csv" in made["warnings"][0]
    run = ferryid("fit", *bags[:2], tmp_path / "nowhere.mcap", *VESSEL, "--out", tmp_path)
    assert run.code == 2
    assert "nowhere.mcap: no such file" in run.err
