"""What ``ferryid diagnose`` says to input that cannot be used, or cannot tell anything."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.test_bad_input import drawn, refused


@pytest.mark.parametrize(
    ("options", "parts", "of_the_log"),
    [
        (("--vessel", "revolt"), ("stern_port.speed", "found no topic"), True),
        (("--vessel", "milliampere", "--withhold", "current"), ("current cannot be withheld",), True),
        (("--vessel", "milliampere", "--withhold", "wimd"), ('Did you mean "wind"',), False),
        (("--vessel", "milliampere", "--against", "absent.mcap"), ("absent.mcap", "no such file"), False),
    ],
)
def test_what_does_not_belong_together(
    ferryid, fixtures: Path, tmp_path: Path, options: tuple[str, ...], parts: tuple[str, ...], of_the_log: bool
) -> None:
    run = ferryid("diagnose", fixtures / "short.mcap", "--out", tmp_path, *options)
    refused(run, *parts)
    if of_the_log:
        missing = drawn(run, tmp_path)["logs"][0]["missing"]
        assert missing["stern_port.speed" if "revolt" in options else "current"].startswith("found no topic")
    else:
        assert not (tmp_path / "reports").exists()


@pytest.mark.slow
def test_a_simulation_too_short_to_learn_from(ferryid, fixtures: Path, tmp_path: Path) -> None:
    log = fixtures / "short.mcap"
    run = ferryid("diagnose", log, "--vessel", "milliampere", "--against", log, "--out", tmp_path)
    refused(run, "--against", "simulate and record the whole trial")


def test_one_bad_log_among_two_is_named(ferryid, fixtures: Path, tmp_path: Path) -> None:
    empty = tmp_path / "empty.mcap"
    empty.write_bytes(b"")
    words = ("diagnose", fixtures / "short.mcap", empty, "--vessel", "milliampere", "--out", tmp_path / "out")
    run = ferryid(*words)
    assert run.code == 0, run.err
    assert "Left out of the campaign:" in run.out
    assert "empty.mcap" in run.out
    run = ferryid(*words, "--each")
    assert run.code == 0, run.err
    assert f"note: Not diagnosed: {empty}" in " ".join(run.out.split())
    refused(ferryid("diagnose", empty, "--each", "--vessel", "milliampere", "--out", tmp_path / "none"), "empty.mcap")
    missing = ferryid(*words, tmp_path / "nowhere.mcap", "--each")
    refused(missing, "nowhere.mcap", "no such file")


def test_the_setting_of_the_command_counts_for_each_log(ferryid, fixtures: Path, tmp_path: Path) -> None:
    words = ("diagnose", fixtures / "short.mcap", "--vessel", "milliampere", "--setting", "tank", "--out", tmp_path)
    for way in ((), ("--each",)):
        run = ferryid(*words, *way, "--json", "-")
        assert run.code == 0, run.err
        assert "Record further runs that excite every axis, ten minutes in all" in run.out


@pytest.mark.slow
def test_a_log_of_two_minutes_cannot_tell(ferryid, fixtures: Path, tmp_path: Path) -> None:
    run = ferryid("diagnose", fixtures / "short.mcap", "--vessel", "milliampere", "--out", tmp_path, "--json", "-")
    assert run.code == 0
    told = json.loads(run.out)
    assert told["verdict"] == "not_testable"
    assert told["findings"] == []
    (short,) = [note for note in told["notes"] if "Record at least ten minutes" in note]
    assert " windows of 8 s, which overlap, are without a gap, and 60 are needed" in short


def test_thrust_of_the_wrong_sign_is_told_by_the_profile(ferryid, fixtures: Path, tmp_path: Path) -> None:
    from ferryid.vessel import load_profile

    text = load_profile("milliampere").text
    old = "coefficients = [2.39675290e-2,"
    assert old in text
    profile = tmp_path / "boat.toml"
    profile.write_text(text.replace(old, "coefficients = [-2.39675290e-2,"), encoding="utf-8")
    run = ferryid("diagnose", fixtures / "short.mcap", "--vessel", profile, "--out", tmp_path / "out")
    refused(run, "boat.toml")
