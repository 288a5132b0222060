"""``--from`` and ``--to`` on the command line: every command that takes logs has them, and keeps them."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from tests.cli.test_every_command import COMMANDS

LOGLESS = ("doctor", "prove", "reproduce", "simulate", "vessel")
BOAT = ("--vessel", "milliampere")
SCALE = ("--delta", "0.4", "--sigma", "0.4", "--accept", "thesis")


@pytest.mark.parametrize("command", [name for name in COMMANDS if name not in LOGLESS])
def test_every_command_that_takes_logs_has_them(ferryid, command: str) -> None:
    text = ferryid(command, "--help").out
    assert "--from <str>" in text
    assert "--to <str>" in text


@pytest.mark.slow
def test_a_model_keeps_the_ranges_it_was_fitted_to(ferryid, fixtures: Path, tmp_path: Path) -> None:
    log, out = fixtures / "short.mcap", tmp_path / "out"
    run = ferryid("fit", log, *BOAT, *SCALE, "--to", "60", "--no-report", "--out", out, "--json", "-")
    assert run.code == 0, run.err
    fit = json.loads(run.out)
    assert fit["logs"][0]["duration_s"] == pytest.approx(60.0, abs=0.2)
    (training,) = json.loads(Path(fit["model"]["path"]).read_text(encoding="utf-8"))["training"]
    assert training["sha256"].endswith("#t=0.000,60.000")
    for options, trained in ((("--from", "60"), False), (("--from", "50"), True), ((), True)):
        found = json.loads(ferryid("evaluate", "milliampere@1", log, *options, "--out", out, "--json", "-").out)
        assert any("was trained on this log" in warning for warning in found["logs"][0]["warnings"]) is trained


@pytest.mark.slow
@pytest.mark.usefixtures("batch_here")
def test_a_batch_with_another_range_is_done_again(ferryid, fixtures: Path, tmp_path: Path) -> None:
    log = shutil.copy(fixtures / "short.mcap", tmp_path / "a.mcap")
    (tmp_path / "recipe.toml").write_text('steps = ["evaluate"]\n', encoding="utf-8")
    options = (
        log,
        *BOAT,
        "--recipe",
        tmp_path / "recipe.toml",
        "--out",
        tmp_path / "out",
        "--processes",
        "1",
        "--json",
        "-",
    )
    lengths = []
    for more in ((), ("--from", "10", "--to", "60"), ("--from", "10", "--to", "60"), ("--from", "500")):
        run = ferryid("batch", *options, *more)
        result = json.loads(run.out)
        lengths.append((result["counts"]["done_before"], result["rows"][0]["status"], result["rows"][0]["duration_s"]))
    assert [(before, status) for before, status, _ in lengths] == [
        (0, "done"),
        (0, "done"),
        (1, "done"),
        (0, "refused"),
    ]
    assert lengths[1][2] == pytest.approx(50.0, abs=0.2)
    assert "is outside the log" in result["rows"][0]["reason"]


def test_bad_ranges_end_in_one_line(ferryid, fixtures: Path, tmp_path: Path) -> None:
    log, out = fixtures / "short.mcap", tmp_path / "out"
    for options, told in (
        (("--from", "500"), "is outside the log"),
        (("--from", "50", "--to", "20"), "ends before it begins"),
        (("--from", "noon"), "'noon' is no time"),
    ):
        for command in (("fit", log, *BOAT, "--out", out), ("inspect", log, *BOAT)):
            run = ferryid(*command, *options)
            assert (run.code, run.out) == (2, "")
            assert told in run.err
            assert run.err.count("\n") == 1
    # A fault of the options has no page on what the log holds.
    assert not (out / "reports").exists()
    assert ferryid("fit", "--archive", *BOAT, "--from", "3", "--out", out).code == 2
    assert ferryid("export", "milliampere", "--to", "c", "--from", "3", "--out", out).code == 2


@pytest.mark.slow
def test_a_diagnosis_of_a_range(ferryid, fixtures: Path, tmp_path: Path) -> None:
    run = ferryid("diagnose", fixtures / "short.mcap", *BOAT, "--from", "-60", "--out", tmp_path, "--json", "-")
    assert run.code == 0, run.err
    found = json.loads(run.out)
    assert found["duration_s"] == pytest.approx(60.0, abs=0.3)
    assert found["notes"][0].startswith("Used is 29.9 to 89.9 s of 89.9 s")
