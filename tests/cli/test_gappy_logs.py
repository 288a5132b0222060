"""Every command on a log with gaps of 0.3 to 60 s in navigation, in one thruster and in the heading."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.command_line.in_process import Run, invoke
from tests.damage import NAVIGATION, THRUSTER, silent, ten_minutes, without_heading, written

pytestmark = pytest.mark.slow

SECONDS = (0.3, 1.0, 5.0, 60.0)
VESSEL = ("--vessel", "milliampere")
LOST = 3 * 66
"""Seconds in the gaps that are not interpolated."""

Command = Callable[..., Run]


@pytest.fixture(scope="session")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the log gaps.mcap, the same without gaps, and the output of the commands."""
    folder = tmp_path_factory.mktemp("gaps")
    made = silent(ten_minutes(), NAVIGATION, [*zip((30.0, 40.0, 50.0, 100.0), SECONDS, strict=True)])
    made = silent(made, THRUSTER, [*zip((230.0, 240.0, 250.0, 300.0), SECONDS, strict=True)])
    made = without_heading(made, [*zip((430.0, 440.0, 450.0, 500.0), SECONDS, strict=True)])
    written(made, folder / "gaps.mcap")
    written(ten_minutes(), folder / "whole.mcap")
    return folder


def result(run: Run) -> dict[str, Any]:
    assert run.code == 0, run.err
    return dict(json.loads(run.out))


def counted(text: str) -> bool:
    """Tell whether a text gives the rows that were left out and why."""
    joined = " ".join(text.split())
    return "rows" in joined and "are left out" in joined and "actuator was not measured" in joined


def shown(page: str) -> None:
    """Check that a page lists the longest stretches, counts the others, and shades all beside what validates."""
    assert counted(page)
    assert "left out from [s]" in page
    assert page.count('<td class="text">not measured</td>') == 9 or "shorter stretch" in page
    assert ">left out</text>" in page


def test_inspect_and_ingest_count_the_gaps(ferryid: Command, place: Path) -> None:
    clocks = {
        topic["name"]: topic["clock"]
        for topic in result(ferryid("inspect", place / "gaps.mcap", *VESSEL, "--json", "-"))["topics"]
    }
    assert [len(clocks[topic]["gaps"]) for topic in (NAVIGATION, THRUSTER)] == [4, 4]
    tables = result(ferryid("ingest", place / "gaps.mcap", *VESSEL, "--out", place / "out", "--json", "-"))["logs"]
    assert "4 gaps in the recording, the longest 60" in " ".join(tables[0]["data_quality"]["remarks"])


@pytest.fixture(scope="module")
def fitted(place: Path) -> Run:
    """What the fit of the model milliampere@1 printed; its JSON is in fit.json."""
    out = ("--out", place / "out", "--json", place / "fit.json")
    return invoke("fit", place / "gaps.mcap", *VESSEL, *out, "--components", "3")


@pytest.mark.draws
def test_a_fit_leaves_the_rows_out_counts_them_and_shows_them(fitted: Run, place: Path) -> None:
    run = fitted
    assert run.code == 0, run.err
    assert counted(run.out)
    told = json.loads((place / "fit.json").read_text(encoding="utf-8"))
    measured, beside = told["logs"][0]["left_out"]
    assert measured["seconds"] == pytest.approx(LOST, abs=2.0)
    assert measured["stretches"] == 9
    assert beside["rows"] == 9 * 22
    assert sum(one["end_s"] - one["start_s"] for one in measured["intervals"]) == pytest.approx(measured["seconds"])
    assert any(
        one["start_s"] == pytest.approx(300.0, abs=0.5) and "n_thruster1" in one["signals"]
        for one in measured["intervals"]
    )
    page = Path(told["report"]).read_text(encoding="utf-8")
    shown(page)
    assert ">validation</text>" in page


@pytest.mark.usefixtures("fitted")
def test_evaluate_compare_and_export_leave_the_rows_out_and_count_them(ferryid: Command, place: Path) -> None:
    log, out = place / "gaps.mcap", ("--out", place / "out")
    used = result(ferryid("models", "milliampere@1", *out, "--json", "-"))["training"][0]["rows"]
    assert used < 20 * (600 - LOST)

    entry = result(ferryid("evaluate", "milliampere@1", log, *out, "--json", "-"))["logs"][0]
    assert entry["rows"] <= 20 * (600 - LOST)
    assert counted(" ".join(entry["warnings"]))
    assert ferryid("fit", log, *VESSEL, *out, "--components", "1", "--no-report").code == 0
    run = ferryid("compare", "milliampere@1", "milliampere@2", "--on", log, *out)
    assert run.code == 0, run.err
    assert counted(run.out)
    exported = result(ferryid("export", log, "--mcap", place / "forces.mcap", *VESSEL, *out, "--json", "-"))
    assert counted(" ".join(exported["warnings"]))


@pytest.mark.parametrize(
    "what", [("components",), ("window", "--windows", "0.5,1"), ("both", "--windows", "0.5,1"), ("basis",)]
)
def test_sweeps(ferryid: Command, place: Path, what: tuple[str, ...]) -> None:
    options = (*VESSEL, *what[1:], "--out", place / "out", "--json", place / "sweep.json")
    run = ferryid("sweep", what[0], place / "gaps.mcap", *options)
    assert run.code == 0, run.err
    assert counted(run.out)
    (log,) = json.loads((place / "sweep.json").read_text(encoding="utf-8"))["logs"]
    assert counted(" ".join(log["warnings"]))


def test_fit_and_sweep_of_an_archive(ferryid: Command, place: Path) -> None:
    out = (*VESSEL, "--out", place / "archive")
    assert ferryid("ingest", place / "gaps.mcap", place / "whole.mcap", *out).code == 0
    for command in (("fit", "--components", "3"), ("fit", "--components", "3"), ("sweep", "components")):
        run = ferryid(*command, "--archive", *out, "--json", place / "archive.json")
        assert run.code == 0, run.err
        assert counted(run.out)
        assert "gaps: " in run.out
        assert "whole: " not in run.out
        told = json.loads((place / "archive.json").read_text(encoding="utf-8"))
        gaps, whole = told["archive"] if command[0] == "fit" else told["logs"]
        assert counted(" ".join(gaps["warnings"]))
        assert whole["warnings"] == []


@pytest.mark.draws
def test_diagnoses(ferryid: Command, place: Path) -> None:
    log, out = place / "gaps.mcap", ("--out", place / "out", "--json", "-")
    # By themselves, as they hold one recording.
    found = result(ferryid("diagnose", log, place / "whole.mcap", "--each", *VESSEL, *out))
    assert any(counted(note) for note in found["logs"][0]["notes"])
    assert not any(counted(note) for note in found["logs"][1]["notes"])
    gaps = [stretch for one in found["logs"][0]["left_out"] for stretch in one["intervals"]]
    assert any(one["start_s"] == pytest.approx(100.0, abs=0.5) and {"u", "v", "r"} <= {*one["signals"]} for one in gaps)
    assert found["logs"][1]["left_out"] == []
    shown(Path(found["report"]).read_text(encoding="utf-8"))


def test_diagnosis_against_a_simulation(ferryid: Command, place: Path) -> None:
    run = ferryid("diagnose", place / "gaps.mcap", "--against", place / "whole.mcap", *VESSEL, "--out", place / "out")
    assert run.code == 0, run.err
    assert counted(run.out)


@pytest.mark.usefixtures("batch_here")
def test_batch(ferryid: Command, place: Path) -> None:
    recipe = place / "recipe.toml"
    recipe.write_text('steps = ["fit"]\n\n[fit]\ncomponents = 3\nreport = false\n', encoding="utf-8")
    options = (*VESSEL, "--recipe", recipe, "--processes", "1", "--out", place / "batch")
    (row,) = result(ferryid("batch", place / "gaps.mcap", *options, "--json", "-"))["rows"]
    assert row["status"] == "done", row
    assert row["lost"]["seconds_left_out"] == pytest.approx(LOST, abs=2.0)
    assert row["lost"]["rows_left_out"] == pytest.approx(20 * LOST, abs=40)
    assert row["lost"]["messages"] == 0
    assert counted(" ".join(row["lost"]["says"]))
    assert counted((place / "batch" / "batch" / "index.html").read_text(encoding="utf-8"))


def test_a_stray_time_is_counted_on_the_terminal_of_a_fit(ferryid: Command, place: Path) -> None:
    made = ten_minutes()
    streams = []
    for stream in made.streams:
        if stream.topic == THRUSTER:
            stamp = stream.stamp_ns.copy()
            stamp[700], stamp[5000] = 0, stamp[5000] - 10**17
            stream = replace(stream, stamp_ns=stamp)
        streams.append(stream)
    log = written(replace(made, streams=tuple(streams)), place / "stray.mcap")
    run = ferryid("fit", log, *VESSEL, "--components", "1", "--no-report", "--out", place / "stray")
    assert run.code == 0, run.err
    assert "2 of 12000 rows had a senseless stamp and are put at their receive time" in run.out
    assert "are left out" not in run.out
