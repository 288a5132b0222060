"""DataFlash: against pymavlink, and what logs of a vehicle hold that a sample does not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import zstandard
from pymavlink import DFReader

from ferryid.errors import FerryIdError
from ferryid.ingest import open_log
from ferryid.ingest.join import join
from ferryid.ingest.parameters import parameters_of
from tests.ingest.autopilot_logs import DataFlash

N = 40


def boat() -> DataFlash:
    log = DataFlash()
    log.define("GPS", "QBBIHBcLLef", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd")
    log.define("ATT", "QccCC", "TimeUS,Roll,Pitch,Yaw,DesYaw")
    log.define("RCOU", "QHHHH", "TimeUS,C1,C2,C3,C4")
    log.define("MSG", "QZ", "TimeUS,Message")
    log.define("PARM", "QNf", "TimeUS,Name,Value")
    log.define("ODD", "fa", "Value,Samples")
    log.units("GPS", "s#-------DUmn"[:11])
    log.add("PARM", 900, b"SERVO1_MIN", 1100.0)
    rows = [("MSG", 1000, b"ArduRover V4.5")]
    for k in range(N):
        us = 1_000_000 + 20_000 * k
        rows += [
            ("ATT", us, 100 * k, -50 * k, 9000 + k, 18000),
            ("RCOU", us + 1, 1500 + k, 1900 - k, 1100, 0),
            (
                "GPS",
                us + 2,
                k % 2,
                3,
                345_600_000 + 20 * k,
                2300,
                12,
                90,
                634_000_000 + k,
                104_000_000 - k,
                150,
                0.1 * k,
            ),
        ]
    log.table(rows)
    log.add("ODD", 1.0, *range(32))
    return log


def written(folder: Path, content: bytes, name: str = "00000001.BIN") -> Path:
    (folder / name).write_bytes(content)
    return folder / name


@pytest.mark.filterwarnings("ignore")
def test_every_value_is_the_one_that_pymavlink_reads(tmp_path: Path) -> None:
    path = written(tmp_path, boat().content)
    reader = open_log(path)
    listed = {topic.name: topic for topic in reader.topics}
    assert listed.keys() == {"/GPS", "/GPS[1]", "/ATT", "/RCOU", "/MSG"}
    theirs: dict[str, list[object]] = {}
    with_times: dict[str, list[float]] = {}
    log = DFReader.DFReader_binary(str(path))
    while (message := log.recv_msg()) is not None:
        name = f"/{message.get_type()}" + ("[1]" if message.get_type() == "GPS" and message.I == 1 else "")
        theirs.setdefault(name, []).append(message)
        with_times.setdefault(name, []).append(message._timestamp)
    log.close()
    for name, topic in listed.items():
        series = reader.read({name: list(topic.fields)})[name]
        assert len(series.receive_ns) == len(theirs[name])
        for field, column in series.columns.items():
            values = [getattr(one, field) for one in theirs[name]]
            assert column.tolist() == (values if field == "Message" else pytest.approx(values, abs=0, rel=1e-15))
        assert np.abs(series.receive_ns * 1e-9 - with_times[name]).max() < 2e-6
    # What cannot be placed in time is counted: its definition may be damaged.
    (loss,) = reader.losses
    assert (loss.topic, loss.messages) == ("/ODD", 1)
    assert "no field of its definition is a time" in loss.what


def test_scales_of_the_format_are_applied(tmp_path: Path) -> None:
    found = open_log(written(tmp_path, boat().content)).read({"/GPS": ["Lat", "HDop"], "/ATT": ["Yaw"]})
    assert found["/GPS"].columns["Lat"][0] == pytest.approx(63.4)
    assert found["/GPS"].columns["HDop"][0] == 0.9
    assert found["/ATT"].columns["Yaw"][1] == 90.01


def test_times_are_utc_where_the_receiver_knew_it(tmp_path: Path) -> None:
    # GPS week 2300 began on 2024-02-04 at 00:00:00 GPS time; 345600 s into it, and 18 leap seconds.
    start = open_log(written(tmp_path, boat().content)).read({"/GPS": []})["/GPS"].receive_ns[0]
    assert np.datetime64(int(start), "ns").astype("datetime64[s]") == np.datetime64("2024-02-07T23:59:42")


def test_a_damaged_stretch_is_left_out_and_what_follows_is_read(tmp_path: Path) -> None:
    content = bytearray(boat().content)
    middle = len(content) // 2
    content[middle : middle + 60] = b"\xff" * 60
    reader = open_log(written(tmp_path, bytes(content)))
    assert N - 5 <= next(topic.count for topic in reader.topics if topic.name == "/ATT") < N + 1
    assert sum(topic.count for topic in reader.topics) < 3 * N + 1
    loss, _ = reader.losses
    assert "damaged stretch" in loss.what


def test_definitions_alone_are_no_log(tmp_path: Path) -> None:
    log = DataFlash()
    log.define("ATT", "Qc", "TimeUS,Roll")
    with pytest.raises(FerryIdError, match=r"holds no data, found 1 definitions.*Fix: "):
        open_log(written(tmp_path, log.content))


def test_it_is_known_by_its_content_whatever_its_name(tmp_path: Path) -> None:
    assert len(open_log(written(tmp_path, boat().content, "log")).topics) == 5
    with pytest.raises(FerryIdError, match="not a log of a supported format"):
        open_log(written(tmp_path, b"\0\1\2\3" * 40, "firmware.bin"))


def test_parameters_are_read_with_the_times_at_which_they_were_set(tmp_path: Path) -> None:
    log = boat()
    log.add("PARM", 1_500_000, b"SERVO1_MIN", 1150.0)
    log.add("PARM", 1_500_001, b"MOT_VEC_ANGLEMAX", 30.5)
    path = written(tmp_path, log.content)
    found = parameters_of(open_log(path))
    assert set(found) == {"SERVO1_MIN", "MOT_VEC_ANGLEMAX"}
    assert found["SERVO1_MIN"].values.tolist() == [1100.0, 1150.0]
    assert found["MOT_VEC_ANGLEMAX"].values.tolist() == [30.5]
    # On the clock of the topics, which is UTC here.
    attitude = next(topic.start_ns for topic in open_log(path).topics if topic.name == "/ATT")
    assert attitude is not None
    assert (found["SERVO1_MIN"].time_ns - attitude).tolist() == [-999_100_000, 500_000_000]
    # Of a compressed log, and of two parts of one recording, they are the same and one after another.
    (tmp_path / "a.bin.zst").write_bytes(zstandard.compress(log.content))
    assert parameters_of(open_log(tmp_path / "a.bin.zst"))["SERVO1_MIN"].values.tolist() == [1100.0, 1150.0]
    later = DataFlash()
    later.define("ATT", "QccC", "TimeUS,Roll,Pitch,Yaw")
    later.parameters({"SERVO1_MIN": 1200.0}, 9_000_000)
    later.add("ATT", 9_000_001, 0, 0, 1)
    both = join([open_log(written(tmp_path, later.content, "b.bin")), open_log(path)])
    # The part without a receiver counts from the start-up, and so comes first.
    assert parameters_of(both)["SERVO1_MIN"].values.tolist() == [1200.0, 1100.0, 1150.0]


def test_a_log_that_is_cut_while_its_parameters_are_read(tmp_path: Path) -> None:
    path = written(tmp_path, boat().content)
    reader = open_log(path)
    path.write_bytes(path.read_bytes()[:400])
    with pytest.raises(FerryIdError, match="became shorter while it was read"):
        parameters_of(reader)


def test_parameters_without_a_number_are_kept_and_those_without_a_name_are_not(tmp_path: Path) -> None:
    log = boat()
    log.add("PARM", 1_500_000, b"SERVO2_MIN", float("nan"))
    log.add("PARM", 1_500_000, b"", 3.0)
    found = parameters_of(open_log(written(tmp_path, log.content)))
    assert set(found) == {"SERVO1_MIN", "SERVO2_MIN"}
    # Who asks for it is to say so.
    assert np.isnan(found["SERVO2_MIN"].values).tolist() == [True]


def of_2014(labels: str, letters: str, *clock: int) -> bytes:
    """A log as of 2014, whose receiver states the time of the week as TimeMS."""
    log = DataFlash()
    log.define("ATT", "Icc", "TimeMS,Roll,Yaw")
    log.define("GPS", letters, labels)
    for k in range(100):
        log.add("ATT", 313_000 + 100 * k, 0, 100 * k)
        log.add("GPS", 3, 580_013_000 + 100 * k, 1814, 634_000_000, *(one + 100 * k for one in clock))
    return log.content


def test_a_receiver_of_2014_is_on_the_clock_of_the_autopilot(tmp_path: Path) -> None:
    (tmp_path / "boat.bin").write_bytes(of_2014("Status,TimeMS,Week,Lat,T", "BIHLI", 313_040))
    reader = open_log(tmp_path / "boat.bin")
    gps, attitude = (next(one for one in reader.topics if one.name == name) for name in ("/GPS", "/ATT"))
    assert gps.start_ns is not None
    assert attitude.start_ns is not None
    assert gps.start_ns - attitude.start_ns == 40_000_000
    # 2014-10-18, when GPS time was ahead of UTC by 16 s.
    assert np.datetime64(gps.start_ns, "ns") == np.datetime64("2014-10-18T17:06:37")
    assert "TimeMS" in gps.fields
    assert not reader.losses


def test_a_receiver_that_states_the_time_of_the_week_alone_is_lost_and_counted(tmp_path: Path) -> None:
    (tmp_path / "boat.bin").write_bytes(of_2014("Status,TimeMS,Week,Lat", "BIHL"))
    reader = open_log(tmp_path / "boat.bin")
    assert [one.name for one in reader.topics] == ["/ATT"]
    (loss,) = reader.losses
    assert (loss.topic, loss.messages) == ("/GPS", 100)
    assert "here TimeMS is the time of the week" in loss.what
