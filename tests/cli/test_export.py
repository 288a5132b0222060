"""Export from the command line: what it writes, and what it refuses in one line."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from pathlib import Path

import pytest

from ferryid.models.store.versions import save
from tests.cli.conftest import FIXTURES
from tests.cli.test_bad_input import refused
from tests.cli.test_every_command import conforms
from tests.export.models import MODELS


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """Return an output folder with models in it."""
    folder = tmp_path / "out"
    for name in ("decoupled", "diagnosed", "conditions"):
        save(MODELS[name], folder)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize(
    ("form", "suffix"),
    [
        *(("c", ".h"), ("fmi3", ".fmu"), ("gazebo", ".gazebo.sdf"), ("matlab", ".m")),
        *(("px4", ".px4.sdf"), ("python", ".py"), ("ros2", ".yaml")),
    ],
)
def test_a_model_in_every_form(ferryid, out: Path, form: str, suffix: str) -> None:
    file = f"milliampere_v2{suffix}"
    run = ferryid("export", "milliampere@2", "--to", form, "--out", out, "--json", "-")
    assert run.code == 0, run.err
    told = conforms(run.out)
    written = out / "exports" / file
    assert told["file"] == str(written)
    assert told["sha256"] == hashlib.sha256(written.read_bytes()).hexdigest()
    source = out / "models" / "milliampere" / "2.json"
    assert told["model"]["sha256"] == hashlib.sha256(source.read_bytes()).hexdigest()
    assert {one["acts_on"] for one in told["effects"]} == {"hull", "thrusters", "sensors"}
    if form in ("gazebo", "px4"):
        assert (
            "error of the force by the equations of"
            in ferryid("export", "milliampere@2", "--to", form, "--out", out).out
        )
        assert told["check"]["missing"]
    # What stays behind is told where results do not go.
    assert "not exported: steady wind of the log trial" in run.err
    assert told["left_out"]
    by_path = ferryid("export", source, "--to", form, "--file", out / "x" / file, "--out", out)
    assert by_path.code == 0
    assert (out / "x" / file).read_bytes() == written.read_bytes()
    assert "thrusters: thruster2 gives 60 %" in by_path.out


def test_a_module_runs_as_the_command_says(ferryid, out: Path) -> None:
    run = ferryid("export", "milliampere", "--to", "python", "--out", out)
    hint = run.out.splitlines()[-1]
    assert hint.startswith("check it with: python ")
    done = subprocess.run([sys.executable, hint.split()[-1]], capture_output=True, text=True, check=True)
    assert "every value as ferryid gives it" in done.stdout


@pytest.mark.slow
def test_a_model_of_conditions_alone_is_its_hull_and_says_so(ferryid, out: Path) -> None:
    run = ferryid("export", "milliampere@3", "--to", "c", "--out", out, "--json", "-")
    assert run.code == 0
    assert len(conforms(run.out)["left_out"]) == 2
    assert "what is exported is the hull alone" in run.err


@pytest.mark.slow
def test_a_log_for_a_viewer(ferryid, fixtures: Path, out: Path, tmp_path: Path) -> None:
    log, diagnosis, mcap = fixtures / "short.mcap", tmp_path / "d.json", tmp_path / "v.mcap"
    assert ferryid("diagnose", log, "--vessel", "milliampere", "--out", tmp_path / "d", "--json", diagnosis).code == 0
    options = ("--model", "milliampere@1", "--diagnosis", diagnosis, "--out", out, "--json", tmp_path / "result.json")
    run = ferryid("export", log, "--mcap", mcap, *options)
    assert run.code == 0, run.err
    told = conforms((tmp_path / "result.json").read_text(encoding="utf-8"))
    assert "/diagnostics" in {one["topic"] for one in told["topics"]}
    assert told["model"] == "milliampere@1"
    shown = ferryid("inspect", mcap, "--json", "-")
    assert json.loads(shown.out)["messages"] == sum(one["messages"] for one in told["topics"])


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("milliampere", "--to", "pyton"), 'Did you mean "python"'),
        (("miliampere", "--to", "c"), 'Did you mean "milliampere"'),
        (("milliampere@9", "--to", "c"), "there are 1, 2, 3"),
        (("milliampere",), "--to c|fmi3|gazebo|matlab|px4|python|ros2 for a model, --mcap FILE for a log"),
        (("milliampere", "--to", "c", "--vessel", "milliampere"), "--vessel: is for a log"),
        (("milliampere", "--to", "c", "--model", "milliampere"), "--model: is for a log"),
        (("milliampere", "--diagnosis", "d.json"), "--diagnosis: is for a log"),
        (("short.mcap", "--mcap", "v.mcap", "--to", "c"), "--to c: 'c' is no time"),
        (("short.mcap", "--mcap", "v.mcap", "--file", "v.h"), "--file: is for a model"),
        (("missing.mcap", "--mcap", "v.mcap", "--vessel", "milliampere"), "missing.mcap"),
        (("milliampere", "--to", "matlab", "--file", "my-boat.m"), "my-boat.m"),
        (("milliampere", "--to", "gazebo", "--file", "d/x.fmu"), ".fmu is the suffix of an FMU"),
        (("milliampere", "--to", "px4", "--file", "x.gazebo.sdf"), "or give --to gazebo"),
        (
            (str(FIXTURES / "short.mcap"), "--to", "gazebo"),
            "short.mcap: is a log (MCAP), where a model file (JSON) is wanted",
        ),
        (("milliampere", "--to", "c", "--file", "/proc/none/x.h"), "a place you may write to with --file"),
        (("milliampere", "--to", "c", "--file", "x.json", "--json", "x.json"), "two files"),
    ],
)
def test_what_means_nothing(
    ferryid, out: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: tuple[str, ...], told: str
) -> None:
    monkeypatch.chdir(tmp_path)
    before = {path for path in tmp_path.rglob("*") if path.is_file()}
    refused(ferryid("export", *options, "--out", out), told)
    assert {path for path in tmp_path.rglob("*") if path.is_file() and path.name != ".lock"} == before


@pytest.mark.slow
def test_places_that_will_not_do(ferryid, out: Path, tmp_path: Path) -> None:
    thesis = tmp_path / "thesis.tex"
    thesis.write_text("of years", encoding="utf-8")
    source = out / "models" / "milliampere" / "1.json"
    for place in (thesis, source, tmp_path):
        run = ferryid("export", "milliampere@1", "--to", "c", "--file", place, "--overwrite", "--out", out)
        refused(run, str(place), "cannot be replaced")
    assert thesis.read_text(encoding="utf-8") == "of years"
    refused(ferryid("export", source, "--to", "c", "--out", thesis), "cannot be written")
    header = tmp_path / "boat.h"
    assert ferryid("export", "milliampere@1", "--to", "c", "--file", header, "--out", out).code == 0
    # The same again is no harm, and another model is.
    assert ferryid("export", "milliampere@1", "--to", "c", "--file", header, "--out", out).code == 0
    other = ("export", "milliampere@2", "--to", "c", "--file", header, "--out", out)
    refused(ferryid(*other), "exists already")
    assert ferryid(*other, "--overwrite").code == 0


def test_a_damaged_model_is_told(ferryid, out: Path) -> None:
    source = out / "models" / "milliampere" / "1.json"
    source.write_text(source.read_text(encoding="utf-8")[:500], encoding="utf-8")
    refused(ferryid("export", source, "--to", "c", "--out", out), "1.json", "not readable as a model file")
