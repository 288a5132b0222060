"""``ferryid diagnose A... --versus B...``: text, JSON and page, and input that cannot be compared."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from ferryid import api
from ferryid.batch.changes import GroupTask, compare_groups_of
from ferryid.diagnose import Versus
from ferryid.report import versus_report
from ferryid.report.batch_rows import Change
from ferryid.report.interactive import SCRIPTS, available
from ferryid.simulate import parse_scenario, simulate, write_log
from ferryid.vessel import load_profile
from tests.cli.test_diagnose_input import refused
from tests.cli.test_every_command import conforms
from tests.command_line.in_process import Run

pytestmark = pytest.mark.draws

VESSEL = ("--vessel", "milliampere")
SCENARIO = """schema = "ferryid.scenario/1"
vessel = "milliampere"
path = {{ kind = "four-corner", dwell_s = 20 }}
controller = {{ delta = 0.7, sigma = 0.7 }}
sensors = {{ imu_rate_hz = 0.0, camera_rate_hz = 0.0 }}
{effects}
"""
WEAK = '[[thrusters.faults]]\nthruster = "thruster1"\nfactor = 0.8\n'

Command = Callable[..., Run]


@pytest.mark.slow
def test_two_groups_and_several_logs_after_one_option(
    ferryid: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    logs = []
    for seed, effects in enumerate(("", "", WEAK, WEAK), 1):
        scenario = parse_scenario(SCENARIO.format(effects=effects), f"bag{seed}")
        silent = replace(scenario, sensors=replace(scenario.sensors, wind_rate_hz=0.0))
        logs.append(tmp_path / f"bag{seed}.mcap")
        write_log(simulate(silent, seed), logs[-1])
    run = ferryid("diagnose", *logs[:2], "--versus", *logs[2:], *VESSEL, "--out", tmp_path / "out", "--json", "-")
    assert run.code == 0, run.err
    found = conforms(run.out)
    assert {group: [one["log"] for one in of] for group, of in found["groups"].items()} == {
        "A": ["bag1", "bag2"],
        "B": ["bag3", "bag4"],
    }
    assert found["verdict"] == "different"
    (weak,) = (one for one in found["differences"] if one["confirmed"])
    assert (weak["effect"], weak["instance"], weak["group"]) == ("thruster_gain", "thruster1", "B")
    assert weak["parameters"]["factor"]["low"] < 0.8 < weak["parameters"]["factor"]["high"]
    page = Path(found["report"]).read_text(encoding="utf-8")
    assert "<svg" in page
    assert weak["says"] in page
    # The typed call leaves the same.
    compare, asked, answers = versus_report.compare_groups, [], []

    def compared(*of: object) -> Versus:
        asked.append(of)
        answers.append(compare(*of) if not answers else answers[0])
        return answers[0]

    monkeypatch.setattr(versus_report, "compare_groups", compared)
    again = api.compare_groups(logs[:2], logs[2:], "milliampere", tmp_path / "api")
    assert {**again.json, "report": ""} == {**json.loads(run.out), "report": ""}
    assert weak["says"] in again.text
    assert again.tables["differences"].query("confirmed")["value"].tolist() == [weak["parameters"]["factor"]["value"]]
    # So does a batch of them, which asks the same of the tables that are there: it is answered without doing it once more.
    profile = load_profile("milliampere")
    change = Change(profile.name, ("bag1", "bag2"), ("bag3", "bag4"), "the last 2 logs against the first 2")
    paths = [tuple(map(str, one)) for one in (logs[:2], logs[2:])]
    folder = tmp_path / "api" / "batch" / "changes" / "x"
    task = GroupTask(*paths, change, folder, tmp_path / "api", profile.text, profile.path, None, (), (), 4 << 30)
    done = compare_groups_of(task)
    (*of_call, call), (*of_batch, batch) = asked
    assert [list(map(str, group)) for group in of_call[:2]] == [list(map(str, group)) for group in of_batch[:2]]
    assert of_call[2].sha256 == of_batch[2].sha256
    assert of_call[3] == of_batch[3]
    assert (batch.tables, batch.ranges) == (call.tables, call.ranges)
    assert (done.verdict, done.summary) == (found["verdict"], found["summary"])
    assert weak["says"] in done.differences
    made = tmp_path / "api" / "batch" / str(done.report)
    # Its scripts are those of the output folder, not copied for every comparison.
    scripts = re.findall(r'src="([^"]+)"', made.read_text(encoding="utf-8"))
    assert len(scripts) == (len(SCRIPTS) + 1) * available()
    assert all((made.parent / script).is_file() for script in scripts)
    assert len(list(tmp_path.glob("api/**/uplot.js"))) == available()


@pytest.mark.parametrize(
    ("options", "parts"),
    [
        (("--versus", "short.mcap"), ("short.mcap: stands on both sides of --versus",)),
        (("--versus", "short.bag", "--each"), ("found both --versus and --each",)),
        (("--versus", "short.bag", "--against", "short.csv"), ("found both --versus and --against",)),
        (("--versus", "short.bag", "--name", "new"), ("--versus stores no model",)),
        (("--versus", "absent.mcap"), ("absent.mcap", "no such file")),
        (("--versus",), ("--versus: no log follows it",)),
        (("--versus", "short.csv"), ()),
    ],
)
def test_groups_that_cannot_be_compared(
    ferryid: Command, fixtures: Path, tmp_path: Path, options: tuple[str, ...], parts: tuple[str, ...]
) -> None:
    words = [str(fixtures / word) if "." in word else word for word in options]
    refused(ferryid("diagnose", fixtures / "short.mcap", *words, *VESSEL, "--out", tmp_path), *parts)
    assert not (tmp_path / "reports").exists()
