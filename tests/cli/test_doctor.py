"""The state of an installation: what is reported of packages, the cache and the output folder, and what is a problem."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from ferryid import api, doctor
from ferryid.compiler import cache_state
from ferryid.recursive_filter import _filtered, recursive_filter
from tests.cli.test_every_command import conforms

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.slow
def test_a_sound_installation_has_no_problem(ferryid, tmp_path: Path) -> None:
    run = ferryid("doctor", "--out", tmp_path / "out", "--json", "-")
    assert run.code == 0, run.err
    result = conforms(run.out)
    assert result["problems"] == []
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert [f"{one['name']}{one['wanted']}" for one in result["packages"]] == sorted(project["dependencies"])
    extras = set(project["optional-dependencies"]) - set(doctor.DEVELOPING)
    assert {one["extra"] for one in result["optional"]} == extras
    assert not (tmp_path / "out").exists()
    assert "no problem found" in (text := ferryid("doctor", "--out", tmp_path).out) or "note:" in text


@pytest.mark.parametrize("there", [True, False])
def test_what_figures_lack_is_a_note(there: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "available", lambda: there)
    notes = [one for one in doctor.examine(tmp_path)["notes"] if "uPlot" in one]
    assert [one.partition("Fix: ")[2][:10] for one in notes] == ([] if there else ["make uplot"])


@pytest.mark.slow
def test_what_stops_commands_is_a_problem(ferryid, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    versions = {"numpy": "1.26.4", "scipy": None}
    monkeypatch.setattr(doctor, "_version", lambda name: versions.get(name, "99.0"))
    (tmp_path / "file").touch()
    run = ferryid("doctor", "--out", tmp_path / "file", "--json", "-")
    assert run.code == 2
    told = conforms(run.out)["problems"]
    assert len(told) == 3
    assert told[0].startswith("numpy>=2.0 is needed, found 1.26.4. Fix: pip install")
    assert "scipy" in told[1]
    assert "it is missing" in told[1]
    assert told[2] == f"{tmp_path / 'file'}: cannot be written. Fix: give --out another folder"


@pytest.mark.parametrize(
    ("version", "wanted", "enough"),
    [
        ("2.0", ">=2", True),
        ("2", ">=2.0", True),
        ("1.10.1", ">=1.9", True),
        ("1.9.9", ">=1.10", False),
        ("3.0rc1", ">=3", True),
        ("0.5", "", True),
        (None, ">=1", False),
    ],
)
def test_versions_are_compared_as_numbers(version: str | None, wanted: str, enough: bool) -> None:
    assert doctor._enough(version, wanted) is enough


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("numpy>=2.0", ("numpy", ">=2.0", None)),
        ("ruamel.yaml>=0.18", ("ruamel.yaml", ">=0.18", None)),
        ('distributed; extra == "dask"', ("distributed", "", "dask")),
        ("fsspec[http]>=2024.1; extra == 'remote'", ("fsspec", ">=2024.1", "remote")),
        ('pymavlink>=2.4 ; python_version < "4" and extra == "ardupilot"', ("pymavlink", ">=2.4", "ardupilot")),
    ],
)
def test_requirements_are_read(text: str, parts: tuple[str, str, str | None]) -> None:
    found = doctor._REQUIREMENT.match(text)
    assert found is not None
    assert found.groups() == parts


def test_a_folder_that_cannot_be_written_is_known(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert doctor._writable(tmp_path / "not" / "yet" / "there")

    def full(**_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(doctor.tempfile, "TemporaryFile", full)
    assert not doctor._writable(tmp_path)


@pytest.mark.slow
def test_the_cache_is_warm_once_a_loop_was_compiled() -> None:
    import numpy as np

    recursive_filter(np.ones(1), np.ones(1), np.zeros(3))
    state = cache_state(_filtered)
    assert state.compiled
    assert state.folder is not None
    assert not cache_state(len).compiled


@pytest.mark.slow
def test_a_cold_cache_is_announced(tmp_path: Path) -> None:
    code = "import ferryid.api; print(ferryid.api.doctor().json['compile_cache'])"
    environment = {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PATH": "/usr/bin"}
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    assert "'compiled': 0" in run.stdout
    assert str(tmp_path / "cache") in run.stdout


def test_text_of_problems_and_notes() -> None:
    result = api.doctor().json
    text = doctor.render({**result, "problems": ["x is missing. Fix: y"], "notes": ["slow"]})
    assert text.endswith("problem: x is missing. Fix: y\nnote: slow")
    assert doctor.render({**result, "problems": [], "notes": []}).endswith("no problem found")
