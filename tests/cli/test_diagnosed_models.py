"""A model with effects from the command line: diagnosed, stored, listed, judged, compared and simulated."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.test_every_command import conforms

pytestmark = pytest.mark.slow

BROKEN = """
schema = "ferryid.scenario/1"
vessel = "milliampere"
seed = 6
sensors = { imu_rate_hz = 0.0, camera_rate_hz = 0.0 }
path = { kind = "twelve-corner", dwell_s = 20 }
controller = { delta = 0.7, sigma = 0.7 }
[environment.wind]
north_mps = -2.0
east_mps = 2.0
[[thrusters.faults]]
thruster = "thruster2"
factor = 0.6
"""


def test_from_a_diagnosis_to_a_simulation(ferryid, tmp_path: Path) -> None:
    out, scenario, log = tmp_path / "out", tmp_path / "trial.toml", tmp_path / "trial.mcap"
    scenario.write_text(BROKEN, encoding="utf-8")
    assert ferryid("simulate", scenario, "--log", log).code == 0

    refused = ferryid("diagnose", log, "--vessel", "milliampere", "--name", "../a", "--out", out)
    assert refused.code == 2
    assert "cannot name a model" in refused.err
    ours = ("--out", out, "--json", tmp_path / "result.json")
    run = ferryid("diagnose", log, "--vessel", "milliampere", "--name", "ferry", *ours)
    assert run.code == 0, run.err
    result = conforms((tmp_path / "result.json").read_text(encoding="utf-8"))
    assert {one["effect"] for one in result["findings"]} >= {"wind", "thruster_gain"}
    learned = result["learned"]
    assert any(note == learned["says"] for note in result["notes"])
    assert set(learned["over_fit"]) == {"surge", "sway", "yaw"}
    assert sum(learned["over_fit"].values()) < 3.0
    path = Path(result["model"])
    assert path == out / "models" / "ferry" / "1.json"
    assert "ferryid evaluate ferry@1 LOG" in " ".join(run.out.split())
    model = conforms(path.read_text(encoding="utf-8"))
    assert {one["effect"] for one in model["vessel_effects"]} == {"thruster_gain"}
    assert {one["effect"] for one in model["conditions"][0]["effects"]} >= {"wind"}
    page = Path(result["report"]).read_text(encoding="utf-8")
    assert "ferryid evaluate ferry@1 LOG" in page

    listed = ferryid("models", "--out", out, "--json", "-")
    (shown,) = conforms(listed.out)["models"]
    assert any("thruster force (thruster2): factor" in told for told in shown["vessel_effects"])
    assert any("steady wind" in told for told in shown["conditions"]["trial"])
    text = ferryid("models", "--out", out).out
    assert "vessel: thruster force (thruster2)" in text
    assert "thruster2 gives" in ferryid("models", "ferry@1", "--out", out).out

    entry = conforms(ferryid("evaluate", "ferry@1", log, "--out", out, "--json", "-").out)["logs"][0]
    assert [one["effect"] for one in entry["effects"]["vessel"]] == ["thruster_gain"]
    assert entry["per_axis"]["yaw"] < 0.5

    # The same model without what was found in it, as somebody would edit it.
    model.pop("vessel_effects")
    bare = tmp_path / "bare.json"
    bare.write_text(json.dumps(model), encoding="utf-8")
    compared = conforms(ferryid("compare", bare, "ferry@1", "--on", log, "--out", out, "--json", "-").out)
    assert [row["effect"] for row in compared["effects"]] == ["thruster_gain"]
    pair = compared["logs"][0]["pairs"][-1]
    assert (pair["first"], pair["second"]) == (f"ferry@1 ({bare})", "ferry@1 (ferry@1)")
    assert pair["mse"]["yaw"]["low"] > 1.0

    sailed = ferryid(
        "simulate", scenario, "--model", "ferry@1", "--models", out, "--conditions", log, "--log", tmp_path / "a.bag",
        "--json", "-",
    )  # fmt: skip
    assert sailed.code == 0, sailed.err
    told = conforms(sailed.out)
    assert (told["model"], told["conditions"]) == ("ferry@1", "trial")
    assert told["warnings"] == ["the scenario's [thrusters.faults] is set aside: the vessel is ferry@1"]
    alone = ferryid("simulate", scenario, "--conditions", "trial", "--log", tmp_path / "b.bag")
    assert alone.code == 2
    assert "found no --model" in alone.err

    data = json.loads(path.read_text(encoding="utf-8"))
    data["vessel_effects"][0]["effect"] = "sea_monster"
    path.write_text(json.dumps(data), encoding="utf-8")
    for command in (("evaluate", "ferry", log), ("simulate", scenario, "--model", path)):
        unknown = ferryid(*command, "--out", out)
        assert unknown.code == 2
        assert '"sea_monster", which this version of ferryid does not know' in unknown.err
        assert unknown.err.count("\n") == 1
    listed = ferryid("models", "--out", out)
    assert listed.code == 0
    assert '"sea_monster", which this version of ferryid does not know' in " ".join(listed.out.split())
