"""Options whose defaults are in a ``ferryid.toml`` beside the logs, and commands without ``--vessel``."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from ferryid.vessel.choice import VARIABLE


@pytest.fixture(autouse=True)
def alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No profile of the user's own."""
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))


@pytest.fixture
def log(tmp_path: Path, fixtures: Path) -> Path:
    """Give a log in a folder of its own."""
    (tmp_path / "day").mkdir()
    return Path(shutil.copy(fixtures / "short.mcap", tmp_path / "day" / "a.mcap"))


def put(log: Path, text: str) -> None:
    (log.parent / "ferryid.toml").write_text(text, encoding="utf-8")


def test_without_vessel_the_choice_is_one_line_beside_the_result(ferryid, log: Path, tmp_path: Path) -> None:
    run = ferryid("ingest", log, "--out", tmp_path / "out", "--json", "-")
    assert run.code == 0
    assert json.loads(run.out)["profile"] == "milliampere"
    assert run.err == "vessel milliampere: bundled, the only profile whose signals this log has\n"
    assert ferryid("ingest", log, "--vessel", "milliampere", "--out", tmp_path / "out").err == ""


def test_defaults_of_all_commands_and_of_one(ferryid, log: Path) -> None:
    put(log, 'out = "results"\nverify = true\n[ingest]\njson = "found.json"\n[fit]\ndelta = 0.4\n')
    assert ferryid("ingest", log).code == 0
    found = json.loads((log.parent / "found.json").read_text(encoding="utf-8"))
    assert Path(found["logs"][0]["folder"]).is_relative_to(log.parent / "results")


def test_the_command_line_counts_before_a_file(ferryid, log: Path, tmp_path: Path) -> None:
    put(log, 'out = "results"\n')
    assert ferryid("ingest", log, "--out", tmp_path / "here").code == 0
    assert (tmp_path / "here" / "logs").is_dir()
    assert not (log.parent / "results").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ("--json", "--out", "here"),
            "--json: a value must follow it, and --out is another option. Fix: give --json a file",
        ),
        (("--vessel", "--no-report"), "--vessel: a value must follow it, and --no-report is another option."),
        (("--vessel", "--out=here"), "--vessel: a value must follow it, and --out is another option."),
        (("--json", "--help"), "--json: a value must follow it, and --help is another option."),
        (("--json", "-h"), "--json: a value must follow it, and -h is another option."),
        (("--json", "--bogus"), "--json: a value must follow it, and --bogus is another option."),
    ],
)
def test_an_option_is_no_value_of_the_one_before_it(ferryid, log: Path, words: tuple[str, ...], said: str) -> None:
    before = sorted(log.parent.iterdir())
    run = ferryid("fit", log, *words)
    assert run.code == 2
    assert said in run.err
    assert sorted(log.parent.iterdir()) == before


@pytest.mark.parametrize("name", ["--vessel", "--name", "--from", "--out", "--rate", "--json"])
@pytest.mark.parametrize("joined", [True, False])
def test_an_empty_value_is_none(ferryid, log: Path, name: str, joined: bool) -> None:
    before = sorted(log.parent.iterdir())
    run = ferryid("fit", log, *([f"{name}="] if joined else [name, ""]))
    assert run.code == 2
    assert run.err.startswith(
        f"ferryid: {name}: its value is empty, as that of a shell variable that is not set. Fix: "
    )
    assert sorted(log.parent.iterdir()) == before


@pytest.mark.parametrize(
    "words",
    [
        ("diagnose", "LOG", "--model", ""),
        ("sweep", "window", "LOG", "--windows", ""),
        ("vessel", "new", "LOG", "--name", ""),
        ("models", "--out", ""),
    ],
    ids=" ".join,
)
def test_commands_of_all_kinds_refuse_an_empty_value(ferryid, log: Path, words: tuple[str, ...]) -> None:
    run = ferryid(*(str(log) if word == "LOG" else word for word in words))
    assert run.code == 2
    assert run.err.startswith(f"ferryid: {words[-2]}: its value is empty")


def test_commands_of_a_group_refuse_it_as_well(ferryid, log: Path) -> None:
    said = ferryid("vessel", "new", log, "--like", "--out", "x.toml").err
    assert said.startswith(
        "ferryid: --like: a value must follow it, and --out is another option. Fix: give --like its value"
    )


def test_a_value_that_looks_like_an_option_may_be_given_with_a_sign_of_equality(ferryid, log: Path) -> None:
    assert "no vessel profile of this name" in ferryid("fit", log, "--vessel=--out").err


def test_an_end_of_ranges_is_no_version_and_no_form(ferryid, log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put(log, "to = 60\n")
    monkeypatch.chdir(log.parent)
    assert "--to 60 is no" not in ferryid("models", "rollback", "boat", "--out", log.parent / "out").err
    assert "give --to c|fmi3" in ferryid("export", "boat", "--out", log.parent / "out").err


def test_a_log_to_write_is_no_log_to_read(ferryid, log: Path, tmp_path: Path) -> None:
    put(log, "sigmo = 1\n")
    run = ferryid("simulate", "no-such-scenario", "--log", log.parent / "new.mcap")
    assert run.code == 2
    assert "no-such-scenario" in run.err


def test_repeated_options_and_switches(ferryid, log: Path) -> None:
    put(log, '[diagnose]\nwithhold = ["wind", "wave"]\neach = true\n')
    run = ferryid("diagnose", log)
    assert run.code == 2
    assert '"wave" is not a signal that can be withheld' in run.err


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("sigmo = 1\n", 'ferryid.toml:1: "sigmo" is no option of any command. Did you mean "sigma"? Fix:'),
        ("[ingest]\nsigma = 1\n", 'ferryid.toml:2: "sigma" is no option of ferryid ingest.'),
        ("[ingst]\n", 'ferryid.toml:1: there is no command "ingst". Did you mean "ingest"?'),
        ("[ingest]\nverify = 3\n", "ferryid.toml:2: --verify takes true or false, found 3. Fix:"),
        ('[ingest]\nout = ""\n', "ferryid.toml:2: --out is empty. Fix: give it a value, or remove the line"),
        ("out = true\n", "ferryid.toml:1: --out takes a text or number, found True. Fix:"),
        ('[ingest]\nvessel = "milliampere"\n', "ferryid.toml:2: the vessel is of the logs"),
        ("out = \n", "ferryid.toml: the defaults for options cannot be read"),
    ],
)
def test_a_file_with_a_fault(ferryid, log: Path, text: str, told: str) -> None:
    put(log, text)
    run = ferryid("ingest", log)
    assert run.code == 2
    assert told in run.err
    assert len(run.err.splitlines()) == 1
    assert not (log.parent / "ferryid-out").exists()


def test_a_value_that_an_option_cannot_take(ferryid, log: Path) -> None:
    put(log, '[fit]\ndelta = "much"\n')
    run = ferryid("fit", log)
    assert run.code == 2
    assert "ferryid.toml:2: " in run.err
    assert "--delta" in run.err


@pytest.mark.slow
def test_the_archive_finds_its_vessel(ferryid, log: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    run = ferryid("fit", "--archive", "--out", out)
    assert run.code == 2
    assert "the ingested logs do not decide the vessel, found none" in run.err
    assert ferryid("ingest", log, "--out", out).code == 0
    run = ferryid("sweep", "components", "--archive", "--out", out)
    assert run.err.startswith(f"vessel milliampere: the one that was ingested to {out}\n")
