"""``ferryid vessel new``: from a log to a profile that a fit takes."""

from __future__ import annotations

import io
import shutil
import sys
from pathlib import Path
from shlex import split

import pytest

from tests.cli.test_every_command import conforms


@pytest.fixture
def log(tmp_path: Path, fixtures: Path) -> Path:
    """Give a log in a folder of its own."""
    (tmp_path / "day").mkdir()
    return Path(shutil.copy(fixtures / "short.mcap", tmp_path / "day" / "a.mcap"))


class _Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_draft_beside_the_log_is_what_the_next_command_uses(ferryid, log: Path, tmp_path: Path) -> None:
    run = ferryid("vessel", "new", log, "--like", "milliampere", "--json", "-")
    assert run.code == 0, run.err
    draft = conforms(run.out)
    assert draft["fill_in"] == 0
    assert {one["quantity"] for one in draft["signals"]} >= {
        "position",
        "heading",
        "velocity",
        "yaw_rate",
        "thruster1.speed",
    }
    run = ferryid("ingest", log, "--out", tmp_path / "out")
    assert run.code == 0, run.err
    assert run.err == f"vessel day: from {log.parent / 'vessel.toml'}\n"
    run = ferryid("vessel", "new", log)
    assert run.code == 2
    assert "vessel.toml: is there already. Fix:" in run.err


def test_without_a_person_lines_are_marked(ferryid, log: Path) -> None:
    run = ferryid("vessel", "new", log, "--name", "boat")
    assert run.code == 0
    assert (
        "marked FILL IN (those of [wind] only if a wind is to be tested), then\n        ferryid vessel check" in run.out
    )
    assert "# FILL IN: mass_kg" in (log.parent / "vessel.toml").read_text(encoding="utf-8")
    run = ferryid("fit", log)
    assert run.code == 2
    assert "vessel.toml:" in run.err


def test_commands_that_come_next_quote_their_paths(ferryid, log: Path, tmp_path: Path) -> None:
    folder = tmp_path / "first day's trial"
    folder.mkdir()
    own = folder / log.name
    own.write_bytes(log.read_bytes())
    run = ferryid("vessel", "new", own)
    assert run.code == 0, run.err
    lines = run.out.splitlines()
    profile, first = folder / "vessel.toml", next(k for k, line in enumerate(lines) if line.startswith("next "))
    # What is to be done by hand stands before.
    commands = [split(line) for line in lines[first + 1 :]]
    assert commands == [
        ["ferryid", "vessel", "check", str(profile)],
        ["ferryid", "inspect", str(own), "--vessel", str(profile)],
        ["ferryid", "fit", str(own), "--vessel", str(profile)],
    ]


def test_a_draft_to_standard_output_is_toml_alone(ferryid, log: Path) -> None:
    run = ferryid("vessel", "new", log, "--file", "-")
    assert run.out.startswith('schema = "ferryid.vessel/1"\n')
    assert not (log.parent / "vessel.toml").exists()


def test_a_person_is_asked_until_the_answer_is_one(ferryid, log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    answers = "five\n5\n2.8\n1670\n3\n8\n1.8\n0\n1000\n400\n-1.8\n0\n1000\n400\n"
    monkeypatch.setattr(sys, "stdin", _Terminal(answers))
    monkeypatch.setattr(type(sys.stderr), "isatty", lambda self: True, raising=False)
    run = ferryid("vessel", "new", log)
    assert run.code == 0, run.err
    assert "'five' is no answer here: give a number above 0, without a unit\n" in run.err
    assert "next    ferryid vessel check" in run.out
    text = (log.parent / "vessel.toml").read_text(encoding="utf-8")
    assert "FILL IN:" not in text.partition("[hull]")[2]
    assert "position_m = [-1.8, 0]" in text
    assert ferryid("vessel", "check", log.parent / "vessel.toml").code == 0


def test_the_end_of_the_answers_leaves_the_rest_open(ferryid, log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", _Terminal("5\n2.8\n"))
    monkeypatch.setattr(type(sys.stderr), "isatty", lambda self: True, raising=False)
    run = ferryid("vessel", "new", log)
    assert run.code == 0, run.err
    text = (log.parent / "vessel.toml").read_text(encoding="utf-8")
    assert "beam_m = 2.8" in text
    assert "# FILL IN: mass_kg" in text


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("nowhere.bag",), "no such file or folder"),
        (("LOG", "--like", "nobody"), "no vessel profile of this name"),
        (("LOG", "--name", "a b"), '--name: cannot be "a b"'),
        (("LOG", "--from", "500"), "is outside the log"),
    ],
)
def test_what_cannot_be_drafted_writes_nothing(ferryid, log: Path, arguments: tuple[str, ...], told: str) -> None:
    run = ferryid("vessel", "new", *(str(log) if one == "LOG" else one for one in arguments))
    assert run.code == 2
    assert told in run.err
    assert run.err.count("\n") == 1
    assert [path.name for path in log.parent.iterdir()] == ["a.mcap"]
