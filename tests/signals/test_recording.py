"""Recordings: what `record` makes of a log, that the cache gives the same back, and that it never leaves half of it."""

from __future__ import annotations

import errno
import json
import os
import shutil
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
import pytest

from ferryid.errors import FerryIdError
from ferryid.signals import cache
from ferryid.signals import parquet as ferryid_parquet
from ferryid.signals import recording as recording_module
from ferryid.signals.recording import Recording, data_quality, log_name, record
from ferryid.vessel.load import load_profile, parse_profile
from ferryid.vessel.profile import Profile

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"
TOML = """
schema = "ferryid.vessel/1"
name = "table-boat"
title = "A boat that is logged to a table"
source = "test"
[hull]
length_m = 3.0
beam_m = 0.5
draught_m = 0.2
mass_kg = 240.0
x_g_m = 0.1
k_zz_m = 0.7
[table]
time = "t"
stamp = ["stamp_secs", "stamp_nsecs"]
[[actuator]]
name = "main"
kind = "force"
position_m = [-1.5, 0.0]
angle_deg = 0.0
[signals.heading]
topic = "table"
field = "psi"
unit = "deg"
frame = "NED"
[signals.velocity]
topic = "table"
fields = ["u", "v"]
unit = "m/s"
frame = "FRD"
[signals."main.force"]
topic = "table"
field = "F"
unit = "kN"
"""


@pytest.fixture(scope="module")
def boat() -> Profile:
    return parse_profile(TOML, "boat.toml")


@pytest.fixture(scope="module")
def ferry() -> Profile:
    return load_profile("milliampere")


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A table with a row out of order, a repeated row, a gap, an unreadable cell, and stamps 20 ms before receipt."""
    numbers = [0, 1, 2, 4, 3, 5, 5, *range(6, 60), *range(100, 160)]
    rows = [
        f"{0.02 + 0.1 * k:.2f},{k // 10},{k % 10 * 10**8},{k},{0.01 * k},0.5,{'ERR' if k == 7 else 2}" for k in numbers
    ]
    path = tmp_path / "trial.csv"
    path.write_text("t,stamp_secs,stamp_nsecs,psi,u,v,F\n" + "\n".join(rows) + "\n")
    return path


def assert_same(one: Recording, other: Recording) -> None:
    for field in fields(Recording):
        if field.name != "streams":
            assert getattr(one, field.name) == getattr(other, field.name), field.name
    assert list(one.streams) == list(other.streams)
    for topic, stream in one.streams.items():
        twin = other.streams[topic]
        # NaN compares unequal to itself, so reports are compared as they are written.
        assert stream.clock.to_dict() == twin.clock.to_dict()
        np.testing.assert_array_equal(stream.time_ns, twin.time_ns)
        np.testing.assert_array_equal(stream.receive_ns, twin.receive_ns)
        assert stream.time_ns.dtype == twin.time_ns.dtype == np.int64
        assert list(stream.columns) == list(twin.columns)
        for name, values in stream.columns.items():
            assert twin.columns[name].dtype == np.float64
            np.testing.assert_array_equal(values.view(np.int64), twin.columns[name].view(np.int64))


def forbid_reading(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("the log was read although it is cached")

    monkeypatch.setattr(recording_module, "read_recording", refuse)


def test_a_table_becomes_si_signals_in_order(log: Path, boat: Profile) -> None:
    recording = record(log, boat)
    (stream,) = recording.streams.values()
    kept = np.r_[0:60, 100:160]
    np.testing.assert_array_equal(stream.time_ns, kept * 100_000_000)
    np.testing.assert_array_equal(stream.receive_ns, kept * 100_000_000 + 20_000_000)
    np.testing.assert_allclose(stream.columns["psi"], np.deg2rad(kept))
    np.testing.assert_allclose(stream.columns["u"], 0.01 * kept)
    np.testing.assert_array_equal(stream.columns["F_main"], np.where(kept == 7, np.nan, 2000.0))
    clock = stream.clock
    assert (clock.source, clock.out_of_order, clock.duplicates) == ("stamp", 1, 1)
    assert clock.gaps == ((5_900_000_000, 10_000_000_000),)
    assert recording.name == "trial"
    assert recording.found["F_main"] == "table: F"
    assert any("not a number" in loss.what for loss in recording.losses)


def test_quality_tells_all_of_it(log: Path, boat: Profile) -> None:
    quality = data_quality(record(log, boat))
    json.dumps(quality, allow_nan=False)
    assert quality["streams"]["table"]["signals"]["F_main"]["missing"] == 1
    assert quality["streams"]["table"]["signals"]["v"]["constant"]
    text = "\n".join(quality["remarks"])
    for told in ("not a number", "out of order", "repeats the time", "1 gap in", "4.10 s"):
        assert told in text


@pytest.mark.slow
@pytest.mark.parametrize("name", ["short.mcap", "short.bag", "short_ros2", "short_ros2_mcap", "truncated.bag"])
def test_cache_gives_the_identical_recording(
    tmp_path: Path, ferry: Profile, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = record(FIXTURES / name, ferry, tmp_path)
    assert_same(record(FIXTURES / name, ferry), first)
    forbid_reading(monkeypatch)
    assert_same(first, record(FIXTURES / name, ferry, tmp_path))


def test_cache_of_a_damaged_table_is_identical_too(tmp_path: Path, log: Path, boat: Profile) -> None:
    assert_same(record(log, boat, tmp_path), record(log, boat, tmp_path))


@pytest.mark.slow
def test_same_trial_in_every_format_gives_the_same_signals(ferry: Profile) -> None:
    bag, mcap = record(FIXTURES / "short.bag", ferry), record(FIXTURES / "short.mcap", ferry)
    assert set(bag.streams) == set(mcap.streams)
    for topic, stream in bag.streams.items():
        np.testing.assert_array_equal(stream.time_ns, mcap.streams[topic].time_ns)
        for name, values in stream.columns.items():
            np.testing.assert_array_equal(values, mcap.streams[topic].columns[name])


def test_parquet_carries_units_and_provenance(tmp_path: Path, log: Path, boat: Profile) -> None:
    recording = record(log, boat, tmp_path)
    (path,) = (tmp_path / "logs").rglob("*.parquet")
    assert path.parent.name == f"trial-{recording.sha256[:8]}-{boat.sha256[:8]}"
    table = parquet.read_table(path)
    assert table.column_names == ["time_ns", "receive_ns", "psi", "u", "v", "F_main"]
    assert [table.schema.field(k).metadata[b"unit"].decode() for k in range(6)] == [
        "ns",
        "ns",
        "rad",
        "m/s",
        "m/s",
        "N",
    ]
    metadata = json.loads(table.schema.metadata[b"ferryid"])
    assert metadata["log_sha256"] == recording.sha256
    assert metadata["profile_sha256"] == boat.sha256
    assert metadata["clock"]["duplicates"] == 1
    assert any("not a number" in loss["what"] for loss in metadata["losses"])


def test_a_changed_log_is_seen(tmp_path: Path, log: Path, boat: Profile) -> None:
    first = record(log, boat, tmp_path)
    state = log.stat()
    # Same size, same time of change, another content and inode: as when a file is replaced by a copy with its times kept.
    changed = log.read_text().replace("0.5,2", "0.6,2")
    log.unlink()
    (tmp_path / "other").write_text("keeps the inode from being used again")
    log.write_text(changed)
    os.utime(log, ns=(state.st_atime_ns, state.st_mtime_ns + 1))
    second = record(log, boat, tmp_path)
    assert second.sha256 != first.sha256
    assert second.streams["table"].columns["v"][0] == 0.6


def test_a_touched_log_is_hashed_and_not_read(
    tmp_path: Path, log: Path, boat: Profile, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = record(log, boat, tmp_path)
    os.utime(log, ns=(0, 0))
    forbid_reading(monkeypatch)
    assert_same(first, record(log, boat, tmp_path))
    monkeypatch.setattr(recording_module, "content_hash", None)  # noted anew: not even hashed the second time
    assert_same(first, record(log, boat, tmp_path))


def test_a_changed_profile_or_version_is_seen(
    tmp_path: Path, log: Path, boat: Profile, monkeypatch: pytest.MonkeyPatch
) -> None:
    record(log, boat, tmp_path)
    in_newtons = parse_profile(TOML.replace('"kN"', '"N"'), "boat.toml")
    assert record(log, in_newtons, tmp_path).streams["table"].columns["F_main"][0] == 2.0
    assert len(list((tmp_path / "logs").iterdir())) == 2
    monkeypatch.setattr(cache, "__version__", "99.0")
    forbid_reading(monkeypatch)
    with pytest.raises(AssertionError, match="was read"):
        record(log, boat, tmp_path)


@pytest.mark.slow
def test_verify_does_not_take_what_was_not_verified(
    tmp_path: Path, ferry: Profile, monkeypatch: pytest.MonkeyPatch
) -> None:
    record(FIXTURES / "short.mcap", ferry, tmp_path)
    with monkeypatch.context() as patch:
        forbid_reading(patch)
        with pytest.raises(AssertionError, match="was read"):
            record(FIXTURES / "short.mcap", ferry, tmp_path, verify=True)
    verified = record(FIXTURES / "short.mcap", ferry, tmp_path, verify=True)
    forbid_reading(monkeypatch)
    assert_same(verified, record(FIXTURES / "short.mcap", ferry, tmp_path, verify=True))
    assert_same(verified, record(FIXTURES / "short.mcap", ferry, tmp_path))


def test_a_damaged_cache_is_made_anew(tmp_path: Path, log: Path, boat: Profile) -> None:
    first = record(log, boat, tmp_path)
    (path,) = (tmp_path / "logs").rglob("*.parquet")
    data = bytearray(path.read_bytes())
    data[40] ^= 0xFF
    path.write_bytes(data)
    with pytest.raises(FerryIdError, match=r"delete its folder"):
        ferryid_parquet.read_table(path)
    assert_rebuilt(record(log, boat, tmp_path), first, f"{path.name}: ")
    ferryid_parquet.read_table(path)
    assert_same(first, record(log, boat, tmp_path))


def assert_rebuilt(again: Recording, first: Recording, fault: str) -> None:
    """Check that a recording was read again because of damage, and says so."""
    said = again.notes[-1]
    assert fault in said
    assert "were damaged" in said
    assert said in data_quality(again)["remarks"]
    assert_same(replace(again, notes=again.notes[:-1]), first)


@pytest.mark.slow
@pytest.mark.parametrize("touched", [False, True])
def test_any_flipped_byte_of_a_cached_description_is_found(
    tmp_path: Path, log: Path, boat: Profile, touched: bool
) -> None:
    first = record(log, boat, tmp_path)
    (path,) = (tmp_path / "logs").rglob("recording.json")
    written = path.read_bytes()
    if touched:
        os.utime(log, ns=(0, 0))
    for place in range(5, len(written), len(written) // 40):
        path.write_bytes(written[:place] + bytes([written[place] ^ 4]) + written[place + 1 :])
        assert_rebuilt(record(log, boat, tmp_path), first, "recording.json: ")
        assert_same(record(log, boat, tmp_path), first)


def test_any_flipped_byte_of_a_cached_table_is_found(tmp_path: Path, log: Path, boat: Profile) -> None:
    record(log, boat, tmp_path)
    (path,) = (tmp_path / "logs").rglob("*.parquet")
    data = path.read_bytes()
    checksum = ferryid_parquet.table_checksum(path)
    for place in range(0, len(data), max(1, len(data) // 40)):
        path.write_bytes(data[:place] + bytes([data[place] ^ 4]) + data[place + 1 :])
        with pytest.raises(FerryIdError, match=r"cannot be read .*delete its folder"):
            ferryid_parquet.read_table(path, checksum)


@pytest.mark.parametrize("failure", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()])
def test_nothing_half_written_is_left(
    tmp_path: Path, log: Path, boat: Profile, monkeypatch: pytest.MonkeyPatch, failure: BaseException
) -> None:
    def fail(path: Path, *_: object) -> None:
        path.write_bytes(b"PAR1")
        raise failure

    monkeypatch.setattr(cache, "write_table", fail)
    expected = FerryIdError if isinstance(failure, OSError) else KeyboardInterrupt
    with pytest.raises(expected) as caught:
        record(log, boat, tmp_path)
    assert list((tmp_path / "logs").iterdir()) == []
    if isinstance(failure, OSError):
        assert "disk is full" in str(caught.value)
        assert "Fix:" in str(caught.value)


def test_output_that_is_a_file_is_refused(tmp_path: Path, log: Path, boat: Profile) -> None:
    (tmp_path / "out").write_text("not a folder")
    with pytest.raises(FerryIdError, match=r"cannot be written.*Fix:"):
        record(log, boat, tmp_path / "out")


def test_missing_signal_is_refused_before_anything_is_written(tmp_path: Path, log: Path, boat: Profile) -> None:
    log.write_text(log.read_text().replace("psi", "course"))
    with pytest.raises(FerryIdError, match="heading"):
        record(log, boat, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_parts_of_one_recording(tmp_path: Path, log: Path, boat: Profile) -> None:
    lines = log.read_text().splitlines(keepends=True)
    first, second = tmp_path / "a.csv", tmp_path / "b.csv"
    first.write_text("".join(lines[:50]))
    second.write_text("".join([lines[0], *lines[50:]]))
    whole, parts = record(log, boat), record(f"{first}+{second}", boat, tmp_path)
    np.testing.assert_array_equal(whole.streams["table"].time_ns, parts.streams["table"].time_ns)
    assert parts.name == "a-and-1-more"
    assert_same(parts, record(f"{first}+{second}", boat, tmp_path))


@pytest.mark.parametrize(
    ("path", "name"),
    [
        ("a/b/trial 3.bag", "trial_3"),
        ("x.mcap", "x"),
        ("a_0.bag+a_1.bag+a_2.bag", "a_0-and-2-more"),
        ("run.v2", "run.v2"),
    ],
)
def test_log_names(path: str, name: str) -> None:
    assert log_name(path) == name


def test_moved_log_is_read_again_under_its_new_path(tmp_path: Path, log: Path, boat: Profile) -> None:
    first = record(log, boat, tmp_path)
    (tmp_path / "elsewhere").mkdir()
    moved = tmp_path / "elsewhere" / "trial.csv"
    shutil.move(log, moved)
    second = record(moved, boat, tmp_path)
    assert second.files == (str(moved),)
    assert_same(replace(first, files=second.files, losses=second.losses), second)
    assert all(loss.file == str(moved) for loss in second.losses)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("profile", "relative", "start_s", "rows"),
    [
        ("milliampere-2025", "milliampere1", 495, "/vectorVS330/fix"),
        ("vtec-usv", "vtec_usv/exp37_1_2016-02-11-10-41-20.bag", 34, "/local_vel"),
        ("gunnerus", "gunnerus/RVG_ManeuveringTests.csv", 8850, "table"),
        ("kvlcc2-model", "kvlcc2/HSVA_CPMC_KVLCC2_Z_10_05.dat", 175, "table"),
        ("esso-osaka", "esso_osaka/zigzag/zigzag_31-Jul-2020_13_04_24.csv", 140, "table"),
    ],
)
def test_real_recordings(
    shared_data: Callable[[str], Path], tmp_path: Path, profile: str, relative: str, start_s: float, rows: str
) -> None:
    path = shared_data(relative)
    recording = record(path, load_profile(profile), tmp_path)
    assert (recording.end_ns - recording.start_ns) * 1e-9 == pytest.approx(start_s, abs=3)
    assert len(recording.streams[rows].time_ns) > 100
    assert_same(recording, record(path, load_profile(profile), tmp_path))
    json.dumps(data_quality(recording), allow_nan=False)
