"""A log of the simulator, written as MAT file, ULog and DataFlash: the commands do with it what they do with the MCAP."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io

from ferryid.ingest import open_log
from ferryid.ingest.log import Series
from ferryid.vessel import load_profile, select
from tests.cli.conftest import FIXTURES
from tests.command_line.in_process import invoke
from tests.ingest.autopilot_logs import DataFlash, ulog

SCALE = ("--delta", "0.4", "--sigma", "0.4", "--accept", "thesis", "--no-report")
MCAP = (FIXTURES / "short.mcap", "--vessel", "milliampere")
FORMATS = ["mat", "7.3.mat", "ulg", "bin"]


def recorded(log: Path) -> dict[str, Series]:
    reader = open_log(log)
    return reader.read(select(load_profile("milliampere"), reader.topics, str(log)).wanted)


def written_as(kind: str, log: Path, folder: Path) -> tuple[Path, Path]:
    """Write what the profile maps of a log in another format, and the profile with the names that this format has."""
    folder.mkdir(parents=True, exist_ok=True)
    series, path = recorded(log), folder / f"short.{kind}"
    if kind.endswith("mat"):
        names = _mat(path, series, hdf5=kind.startswith("7"))
    else:
        names = _ulog(path, series) if kind == "ulg" else _dataflash(path, series)
    text = load_profile("milliampere").text
    for old, new in names.items():
        text = text.replace(f'"{old}"', f'"{new}"')
    (folder / "vessel.toml").write_text(
        re.sub(r'name = "milliampere"', 'name = "boat"', text, count=1), encoding="utf-8"
    )
    return path, folder / "vessel.toml"


def _mat(path: Path, series: dict[str, Series], *, hdf5: bool) -> dict[str, str]:
    tree: dict[str, Any] = {}
    for topic, one in series.items():
        here = tree
        for part in topic.strip("/").split("/"):
            here = here.setdefault(part, {})
        seconds, nanoseconds = np.divmod(one.stamp_ns, 10**9)
        here |= {"time_ns": one.receive_ns, "header_stamp_sec": seconds, "header_stamp_nanosec": nanoseconds}
        for field, values in one.columns.items():
            *outer, last = field.split(".")
            inner = here
            for part in outer:
                inner = inner.setdefault(part, {})
            inner[last] = values
    if not hdf5:
        scipy.io.savemat(path, tree, do_compression=True)
        return {}

    def put(group: Any, node: dict[str, Any]) -> None:
        for name, value in node.items():
            if isinstance(value, dict):
                put(group.create_group(name), value)
            else:
                group[name] = value.reshape(1, -1)

    with h5py.File(path, "w", userblock_size=512) as file:
        put(file, tree)
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file")
    return {}


def _ulog(path: Path, series: dict[str, Series]) -> dict[str, str]:
    names, topics = {}, {}
    for topic, one in series.items():
        names[topic] = topic.strip("/").replace("/", "_")
        names |= {field: field.replace(".", "_") for field in one.columns}
        columns = {names[field]: values for field, values in one.columns.items()}
        times = {"timestamp": one.receive_ns // 1000, "timestamp_sample": one.stamp_ns // 1000}
        topics[names[topic]] = {name: values.astype(np.uint64) for name, values in times.items()} | columns
    path.write_bytes(ulog(topics))
    return names


def _dataflash(path: Path, series: dict[str, Series]) -> dict[str, str]:
    log, names, rows = DataFlash(), {}, []
    for number, (topic, one) in enumerate(series.items()):
        names[topic] = f"/M{number}"
        own = {
            field: "".join(word[0] for word in re.split(r"[._]", field)[:-1]) + field.split(".")[-1]
            for field in one.columns
        }
        names |= own
        log.define(f"M{number}", "Q" + "d" * len(own), ",".join(["TimeUS", *own.values()]))
        times = (one.stamp_ns // 1000).tolist()
        rows += [(f"M{number}", *row) for row in zip(times, *(v.tolist() for v in one.columns.values()), strict=True)]
    log.table(rows)
    path.write_bytes(log.content)
    return names


def coefficients(run: Any) -> np.ndarray:
    assert run.code == 0, run.err
    model = json.loads(Path(json.loads(run.out)["model"]["path"]).read_text(encoding="utf-8"))
    return np.array([entry["value"] for axis in model["coefficients"].values() for entry in axis.values()])


@pytest.fixture(scope="module")
def theirs(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    """Coefficients of a fit to the MCAP."""
    return coefficients(invoke("fit", *MCAP, *SCALE, "--out", tmp_path_factory.mktemp("theirs"), "--json", "-"))


@pytest.fixture(scope="module")
def of_their_archive(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    """Coefficients of a fit to an archive of the MCAP."""
    archive = ("--out", tmp_path_factory.mktemp("archive"), "--json", "-")
    assert invoke("ingest", *MCAP, *archive).code == 0
    return coefficients(invoke("fit", *MCAP, *SCALE, "--archive", *archive))


@pytest.mark.slow
@pytest.mark.parametrize("kind", FORMATS)
def test_a_fit_finds_the_same_coefficients(
    ferryid: Any, fixtures: Path, tmp_path: Path, theirs: np.ndarray, kind: str
) -> None:
    log, _ = written_as(kind, fixtures / "short.mcap", tmp_path / kind)
    # The profile beside the log is found.
    ours = coefficients(ferryid("fit", log, *SCALE, "--out", tmp_path / "out", "--json", "-"))
    # Autopilots count in microseconds, and what is in nanoseconds in the MCAP is rounded.
    np.testing.assert_allclose(ours, theirs, rtol=1e-9 if kind.endswith("mat") else 1e-4, atol=1e-6)


@pytest.mark.slow
@pytest.mark.usefixtures("batch_here")
@pytest.mark.parametrize("kind", FORMATS)
def test_ranges_archive_and_batch_take_them(
    ferryid: Any, fixtures: Path, tmp_path: Path, of_their_archive: np.ndarray, kind: str
) -> None:
    log, _ = written_as(kind, fixtures / "short.mcap", tmp_path / kind)
    out = ("--out", tmp_path / "out", "--json", "-")
    run = ferryid("fit", log, *SCALE, "--from", "10", "--to", "80", *out)
    assert run.code == 0, run.err
    assert json.loads(run.out)["logs"][0]["duration_s"] == pytest.approx(70.0, abs=0.3)
    archive = ("--out", tmp_path / f"out of {log.suffix}", "--json", "-")
    assert ferryid("ingest", log, *archive).code == 0
    ours = coefficients(ferryid("fit", log, *SCALE, "--archive", *archive))
    np.testing.assert_allclose(ours, of_their_archive, rtol=1e-3, atol=1e-4)
    (tmp_path / "recipe.toml").write_text('steps = ["evaluate"]\n', encoding="utf-8")
    run = ferryid("batch", f"{tmp_path / kind}/short.*", "--recipe", tmp_path / "recipe.toml", "--processes", "1", *out)
    (row,) = json.loads(run.out)["rows"]
    assert (row["status"], row["name"]) == ("done", "short" if kind != "7.3.mat" else "short.7.3"), run.err


@pytest.mark.parametrize("kind", FORMATS)
def test_inspect_finds_the_signals_and_a_cut_file_is_one_line_or_a_loss(
    ferryid: Any, fixtures: Path, tmp_path: Path, kind: str
) -> None:
    log, vessel = written_as(kind, fixtures / "short.mcap", tmp_path / kind)
    found = json.loads(ferryid("inspect", log, "--vessel", vessel, "--json", "-").out)
    whole = json.loads(ferryid("inspect", fixtures / "short.mcap", "--vessel", "milliampere", "--json", "-").out)
    assert found["vessel"]["found"].keys() == whole["vessel"]["found"].keys()
    log.write_bytes(log.read_bytes()[:2000])
    run = ferryid("ingest", log, "--vessel", vessel, "--out", tmp_path / "out")
    if kind.endswith("mat"):
        assert run.code == 2
        assert run.err.count("Fix: ") == 1
        assert not (tmp_path / "out" / "logs").exists()
    else:
        # What of an autopilot's log is there can be read.
        assert run.code == 0
        assert "ends within a message: the end of the recording is missing" in run.out
