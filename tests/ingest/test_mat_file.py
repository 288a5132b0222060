"""MAT files: every version, the forms in which MATLAB keeps time series, and what is no time series."""

from __future__ import annotations

import struct
import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io
import scipy.sparse
from scipy.io.matlab import MatlabOpaque

from ferryid.errors import FerryIdError
from ferryid.ingest import open_log
from ferryid.ingest.log import TableLayout
from ferryid.ingest.mat_variables import MatVariables, _node
from ferryid.signals.inspect import inspect

N = 30
T = np.arange(N) * 0.1
U = np.sin(T)
LONG = np.arange(60.0)
R = np.linspace(0.0, 1.0, N) ** 2


def saved(folder: Path, variables: dict[str, Any], **options: Any) -> Path:
    scipy.io.savemat(folder / "log.mat", variables, **options)
    return folder / "log.mat"


def _cells(*values: Any) -> Any:
    cells = np.empty(len(values), object)
    cells[:] = values
    return cells


def as_hdf5(folder: Path, variables: dict[str, Any]) -> Path:
    """Write the way MATLAB does with -v7.3: axes reversed, classes as attributes, a block of 512 bytes in front."""

    def put(group: Any, name: str, value: Any) -> None:
        if isinstance(value, dict):
            inner = group.create_group(name)
            inner.attrs["MATLAB_class"] = np.bytes_("struct")
            for key, one in value.items():
                put(inner, key, one)
            return
        if isinstance(value, str):
            made = group.create_dataset(name, data=np.array([[ord(c)] for c in value], np.uint16))
            made.attrs["MATLAB_class"] = np.bytes_("char")
            return
        array = np.atleast_2d(np.asarray(value))
        made = group.create_dataset(name, data=array.astype(np.uint8 if array.dtype == bool else array.dtype).T)
        made.attrs["MATLAB_class"] = np.bytes_("logical" if array.dtype == bool else "double")

    path = folder / "log.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in variables.items():
            put(file, name, value)
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + struct.pack("<HH", 0x0200, 0x4D49))
    return path


@pytest.fixture(params=["5", "5 compressed", "4", "7.3"])
def version(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def write(version: str, folder: Path, variables: dict[str, Any]) -> Path:
    if version == "7.3":
        return as_hdf5(folder, variables)
    return saved(folder, variables, format=version[0], do_compression="compressed" in version)


def test_arrays_beside_a_time_are_one_table_in_every_version(version: str, tmp_path: Path) -> None:
    path = write(version, tmp_path, {"t": T, "u": U, "K": np.eye(3), "tau": np.column_stack([U, R]), "gain": 3.0})
    reader = open_log(path)
    (topic,) = reader.topics
    assert (topic.name, topic.count, topic.start_ns, topic.end_ns) == ("table", N, 0, 2_900_000_000)
    assert list(topic.fields) == ["u", "tau[0]", "tau[1]"]
    series = reader.read({"table": ["u", "tau[1]"]})["table"]
    np.testing.assert_array_equal(series.columns["u"], U)
    np.testing.assert_array_equal(series.columns["tau[1]"], R)
    assert series.receive_ns.tolist() == [100_000_000 * k for k in range(N)]
    assert "time guessed" in topic.note


@pytest.mark.parametrize("version", ["5", "7.3"])
def test_structures_with_times_of_their_own_are_topics(version: str, tmp_path: Path) -> None:
    slow = T[::3]
    log = {
        "gps": {"time": slow, "lat": 63.0 + 1e-5 * slow, "fix": {"east": slow * 2.0}, "ok": slow > 1.0},
        "imu": {"time": T, "gyro": np.column_stack([0 * T, 0 * T, R]), "name": "xsens"},
    }
    reader = open_log(write(version, tmp_path, {"log": log, "note": "a calm day"}))
    topics = {topic.name: topic for topic in reader.topics}
    assert {name: topic.count for name, topic in topics.items()} == {"/log/gps": 10, "/log/imu": N}
    assert set(topics["/log/gps"].fields) == {"lat", "fix.east", "ok"}
    found = reader.read({"/log/gps": ["fix.east", "ok"], "/log/imu": ["gyro[2]"]})
    np.testing.assert_array_equal(found["/log/gps"].columns["fix.east"], slow * 2.0)
    assert found["/log/gps"].columns["ok"].astype(bool).tolist() == (slow > 1.0).tolist()
    np.testing.assert_array_equal(found["/log/imu"].columns["gyro[2]"], R)


@pytest.mark.parametrize("version", ["5", "7.3"])
def test_time_and_data_of_a_timeseries_as_a_structure(version: str, tmp_path: Path) -> None:
    speed = {"Name": "speed", "Time": T, "Data": np.column_stack([U, R]).T.reshape(2, 1, N)}
    reader = open_log(write(version, tmp_path, {"speed": speed, "rpm": {"Time": T[:20], "Data": R[:20]}}))
    assert {topic.name for topic in reader.topics} == {"/speed", "/rpm"}
    found = reader.read({"/speed": ["Data[1]"], "/rpm": ["Data"]})
    np.testing.assert_array_equal(found["/speed"].columns["Data[1]"], R)
    np.testing.assert_array_equal(found["/rpm"].columns["Data"], R[:20])


def test_a_structure_with_time_of_simulink(tmp_path: Path) -> None:
    signals = np.zeros((1, 2), dtype=[("values", object), ("dimensions", object), ("label", object)])
    signals[0, 0] = (np.column_stack([U, R]), 2, "nu")
    signals[0, 1] = (R.reshape(-1, 1), 1, "")
    reader = open_log(saved(tmp_path, {"out": {"time": T, "signals": signals, "blockName": "trial/To Workspace"}}))
    (topic,) = reader.topics
    assert list(topic.fields) == ["nu[0]", "nu[1]", "signals[1]"]
    np.testing.assert_array_equal(reader.read({topic.name: ["nu[1]"]})[topic.name].columns["nu[1]"], R)


def test_an_array_of_structures_with_a_number_each(tmp_path: Path) -> None:
    rows = np.array(list(zip(T, U, strict=True)), dtype=[("t", "f8"), ("u", "f8")]).reshape(1, -1)
    series = open_log(saved(tmp_path, {"samples": rows})).read({"table": ["u"]})["table"]
    np.testing.assert_array_equal(series.columns["u"], U)


def test_serial_date_numbers_become_utc(tmp_path: Path) -> None:
    # datenum(2024, 5, 2, 12, 0, 0) is 739374.5.
    reader = open_log(saved(tmp_path, {"time": 739374.5 + T / 86400.0, "u": U}))
    assert "serial date numbers" in reader.topics[0].note
    start = np.datetime64("2024-05-02T12:00:00", "ns").astype(np.int64)
    assert reader.topics[0].start_ns == start
    times = reader.read({"table": ["u"]})["table"].receive_ns - start
    assert np.abs(times - T * 1e9).max() < 20_000  # what doubles hold of days since year 0


def test_a_matrix_whose_first_column_is_the_time(tmp_path: Path) -> None:
    path = saved(tmp_path, {"data": np.column_stack([T, U, R])})
    assert list(open_log(path).topics[0].fields) == ["column 2", "column 3"]
    layout = TableLayout(time="t", columns=("t", "u", "r"))
    np.testing.assert_array_equal(open_log(path, layout).read({"table": ["r"]})["table"].columns["r"], R)


def test_the_profile_names_time_and_unit(tmp_path: Path) -> None:
    path = saved(tmp_path, {"clk": T * 1e3, "u": U, "other": {"clk": T[:9] * 1e3, "r": R[:9]}})
    reader = open_log(path, TableLayout(time="clk", time_unit="ms"))
    assert {topic.name: topic.end_ns for topic in reader.topics} == {"table": 2_900_000_000, "/other": 800_000_000}
    with pytest.raises(FerryIdError, match=r'no array "clock".*\[table\].*found clk, u, other.*Fix: '):
        open_log(path, TableLayout(time="clock"))


def test_a_damaged_name_of_version_7_3_is_read_as_it_is(tmp_path: Path) -> None:
    path = as_hdf5(tmp_path, {"log": {"t": T, "u_surge": U, "r": R}})
    path.write_bytes(path.read_bytes().replace(b"u_surge", b"u_s\xffrge"))
    log = open_log(path)
    (topic,) = log.topics
    assert sorted(topic.fields) == ["r", "u_s\\xffrge"]
    np.testing.assert_array_equal(log.read({topic.name: ["u_s\\xffrge"]})[topic.name].columns["u_s\\xffrge"], U)


@pytest.mark.parametrize("sizes", [(2**31 - 1,) * 60, (2**31 - 1,) * 60 + (0,)], ids=["too large", "and a zero"])
def test_sizes_beyond_all_numbers_are_a_variable_that_cannot_be_read(tmp_path: Path, sizes: tuple[int, ...]) -> None:
    path = saved(tmp_path, {"t": T, "u": U, "r": R})
    content = path.read_bytes()
    flags = struct.pack("<IIII", 6, 8, 6, 0)
    body = flags + struct.pack(f"<II{len(sizes)}i", 5, 4 * len(sizes), *sizes) + b"\0" * (-4 * len(sizes) % 8)
    path.write_bytes(content + struct.pack("<II", 14, len(body) + 64) + body + b"\0" * 64)
    log = open_log(path)
    assert [topic.count for topic in log.topics] == [N]
    assert log.losses


@pytest.mark.parametrize("kind", [0, 8, 14, 164])
def test_a_type_that_there_is_not_is_a_loss_and_no_crash(tmp_path: Path, kind: int) -> None:
    path = saved(tmp_path, {"t": T, "u": U, "r": R, "last": R})
    content = bytearray(path.read_bytes())
    # The tag of its numbers, 9 for double precision, is the last before them.
    at = content.rindex(struct.pack("<II", 9, 8 * N))
    struct.pack_into("<I", content, at, kind)
    path.write_bytes(content)
    log = open_log(path)
    assert sorted(log.topics[0].fields) == ["r", "u"]
    (loss,) = log.losses
    assert f"has type {kind}, not one of its class" in loss.what


def test_numbers_that_are_said_to_be_complex_are_a_loss_and_no_crash(tmp_path: Path) -> None:
    path = saved(tmp_path, {"a": {"t": T, "u": U}, "b": {"t": T, "u": R}})
    content = bytearray(path.read_bytes())
    # The flags of the time in the second structure, which another variable follows in the place of imaginary parts.
    at = content.index(struct.pack("<III", 6, 8, 6), content.rindex(struct.pack("<III", 6, 8, 2)))
    struct.pack_into("<I", content, at + 8, 6 | 0x800)
    path.write_bytes(content)
    log = open_log(path)
    assert [sorted(topic.fields) for topic in log.topics] == [["u"]]
    (loss,) = log.losses
    assert "it has 4 parts, and its class needs 5" in loss.what


def test_what_is_empty_or_complex_or_sparse_costs_nothing(tmp_path: Path) -> None:
    others = {
        "none": np.zeros((0, 0)),
        "text": "",
        "z": np.array([1 + 2j]),
        "sparse": scipy.sparse.csc_matrix(np.eye(3)),
    }
    for inner in (others, {"s": others}, {"c": _cells(np.zeros((0, 0)), "", 1j)}):
        log = open_log(saved(tmp_path, {"t": T, "u": U, **inner}))
        assert sorted(log.topics[0].fields) == ["u"]
        assert not log.losses


def test_more_structures_than_there_are_need_no_memory(tmp_path: Path) -> None:
    path = saved(tmp_path, {"t": T, "u": U, "last": {"a": R}})
    content = bytearray(path.read_bytes())
    at = content.rindex(struct.pack("<IIII", 5, 8, 1, 1), 0, content.rindex(b"last"))
    struct.pack_into("<I", content, at + 8, 2**26)
    path.write_bytes(content)
    (loss,) = open_log(path).losses
    assert "it states 67108864 elements and holds 1" in loss.what


def test_one_damaged_variable_does_not_cost_the_others(tmp_path: Path) -> None:
    path = saved(tmp_path, {"a": {"t": T, "u": U}, "b": {"t": T, "u": R}}, do_compression=True)
    content = bytearray(path.read_bytes())
    (size,) = struct.unpack_from("<I", content, 132)
    content[136 + size // 2] ^= 0xFF
    path.write_bytes(bytes(content))
    reader = open_log(path)
    (loss,) = reader.losses
    assert "variable at byte 128" in loss.what
    np.testing.assert_array_equal(reader.read({"table": ["u"]})["table"].columns["u"], R)


@pytest.mark.parametrize("complex_too", [False, True])
def test_a_length_that_swallows_the_next_variable_is_told_and_costs_nothing(tmp_path: Path, complex_too: bool) -> None:
    extra = {"cells": np.array([[U, "text"]], dtype=object), "z": U * 1j} if complex_too else {}
    path = saved(tmp_path, {"a": {"t": T, "u": U, **extra}, "b": {"t": T, "u": R}}, do_compression=False)
    whole = open_log(path)
    assert whole.losses == ()
    content = bytearray(path.read_bytes())
    content[132:136] = struct.pack("<I", len(content) - 136)
    path.write_bytes(bytes(content))
    reader = open_log(path)
    (loss,) = reader.losses
    assert "that it states" in loss.what
    assert [topic.count for topic in reader.topics] == [topic.count for topic in whole.topics]


@pytest.mark.parametrize(
    ("variables", "found"),
    [
        ({"hgS_070000": {"type": "figure", "x": T}}, "a figure of MATLAB.*save the data"),
        ({"A": np.eye(4), "b": np.ones((4, 1)), "name": "boat"}, "looks like a time.*found A, b, name"),
        ({"t": T}, "looks like a time"),
        (
            {"times": _cells(LONG, T), "speeds": _cells(LONG, U), "gain": 2.0},
            r"2 cell arrays \(times, speeds\), which are not read, .*struct\('t', \.\.\., 'u', times\{1\}\)",
        ),
        ({"stamps": T, "settings": _cells(1.0, "auto")}, "looks like a time.*found stamps"),
        ({}, "looks like a time.*found nothing"),
    ],
)
def test_what_is_no_time_series_is_one_line(tmp_path: Path, variables: dict[str, Any], found: str) -> None:
    with pytest.raises(FerryIdError, match=found) as caught:
        open_log(saved(tmp_path, variables))
    assert "Fix: " in str(caught.value)


def test_cell_arrays_of_signals_beside_a_time_series_are_listed_as_lost(tmp_path: Path) -> None:
    cells = {"runs": _cells({"t": LONG, "u": LONG}, "a note"), "names": _cells("a", "b"), "gains": _cells(T[:3], 2.0)}
    (loss,) = open_log(saved(tmp_path, {"t": T, "u": U, **cells})).losses
    assert loss.what.startswith("runs is a cell array, which is not read. Fix: in MATLAB, save ")


def test_a_figure_is_known_by_its_content(tmp_path: Path) -> None:
    path = saved(tmp_path, {"hgS_070000": {"type": "figure"}}).rename(tmp_path / "plot.fig")
    with pytest.raises(FerryIdError, match="a figure of MATLAB"):
        open_log(path)


def test_objects_of_matlab_are_named_with_how_to_save_them(tmp_path: Path) -> None:
    path = as_hdf5(tmp_path, {"speed": np.zeros((1, 6), np.uint32)})
    with h5py.File(path, "r+") as file:
        file["speed"].attrs["MATLAB_class"] = np.bytes_("timeseries")
        file["speed"].attrs["MATLAB_object_decode"] = np.int32(3)
    with pytest.raises(
        FerryIdError, match=r"1 object of MATLAB \(speed: timeseries\).*s.speed = struct\('Time', speed.Time"
    ):
        open_log(path)


def test_objects_beside_other_series_are_reported(tmp_path: Path) -> None:
    path = as_hdf5(tmp_path, {"t": T, "u": U, "speed": np.zeros((1, 6), np.uint32)})
    with h5py.File(path, "r+") as file:
        file["speed"].attrs["MATLAB_class"] = np.bytes_("timeseries")
        file["speed"].attrs["MATLAB_object_decode"] = np.int32(3)
    reader = open_log(path)
    assert [topic.name for topic in reader.topics] == ["table"]
    (loss,) = reader.losses
    assert loss.what.startswith(
        "speed is a timeseries object of MATLAB, which only MATLAB reads. Fix: in MATLAB, s.speed ="
    )


@pytest.mark.parametrize("rows", [N, 80])
def test_arrays_without_a_time_are_reported_where_they_are_as_long_as_a_signal(tmp_path: Path, rows: int) -> None:
    values = np.ones(rows)
    path = saved(tmp_path, {"a": {"tima_ns": values, "u": values}, "b": {"t": T, "u": U}, "lookup": np.ones(21)})
    log = open_log(path)
    assert [topic.name for topic in log.topics] == ["table"]
    if rows == N:
        assert not log.losses, "a lookup table of a vessel is no signal"
        return
    (loss,) = log.losses
    assert loss.messages == 80
    assert "the structure a has 2 arrays of 80 rows without a time of as many rows (a.tima_ns, a.u)" in loss.what
    assert "Fix: save the time beside them" in loss.what


def test_an_object_of_level_5_has_the_name_inside_it() -> None:
    # As SciPy returns what MATLAB's save writes of a timeseries.
    parts = [("s0", "O"), ("s1", "O"), ("s2", "O"), ("arr", "O")]
    opaque = MatlabOpaque(np.array([(b"speed", b"MCOS", b"timeseries", np.zeros((6, 1), np.uint32))], parts))
    found = MatVariables()
    assert _node(opaque, "None", found, 0) is None
    assert found.objects == {"speed": "timeseries"}


def test_structures_of_one_file_are_one_file(tmp_path: Path) -> None:
    path = saved(tmp_path, {"gps": {"t": T, "x": U}, "imu": {"t": T, "r": R}})
    assert open_log(path).paths == (path,)
    assert inspect(path)["format"] == "MAT file of MATLAB"


@pytest.mark.parametrize(
    ("content", "found"),
    [
        (b"MATLAB 5.0 MAT-file, cut", "within its head"),
        (b"MATLAB 7.3 MAT-file" + bytes(600), "within its head"),
        (b"# Created by Octave 8.4\n# name: t\n", "Octave's own format.*save -v7"),
        (b"\x1f\x8b\x08 something else", "not a MAT file"),
        (b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + bytes(64), "is no variable"),
    ],
)
def test_what_is_no_mat_file_is_one_line(tmp_path: Path, content: bytes, found: str) -> None:
    (tmp_path / "log.mat").write_bytes(content)
    with pytest.raises(FerryIdError, match=found) as caught:
        open_log(tmp_path / "log.mat")
    assert "Fix: " in str(caught.value)


def test_a_cut_file_of_version_7_3_is_one_line(tmp_path: Path) -> None:
    path = as_hdf5(tmp_path, {"t": T, "u": U})
    path.write_bytes(path.read_bytes()[:-400])
    with pytest.raises(FerryIdError, match=r"log.mat: the MAT file cannot be read.*Fix: "):
        open_log(path)


def test_without_h5py_the_message_has_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = as_hdf5(tmp_path, {"t": T, "u": U})
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(FerryIdError, match=r"needs h5py. Fix: pip install 'ferryid\[matlab\]'"):
        open_log(path)
