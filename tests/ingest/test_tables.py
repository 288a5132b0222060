"""Tables as logs: what is in the file is what comes out, and what does not come out is counted."""

from __future__ import annotations

import csv
import gzip
import io
import math
import subprocess
import sys
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ferryid.errors import FerryIdError
from ferryid.ingest import open_log
from ferryid.ingest.log import Reader, Series, TableLayout
from ferryid.ingest.table_time import datetimes_to_ns, guess_time, numbers_to_ns, unit_doubt
from ferryid.ingest.tables import columns_named


def write(folder: Path, name: str, content: str | bytes) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def read_all(path: Path, layout: TableLayout | None = None) -> tuple[Series, Reader]:
    reader = open_log(path, layout)
    series = reader.read({topic.name: tuple(topic.fields) for topic in reader.topics})
    return series["table"], reader


# --- what is read -------------------------------------------------------------------------------------------------


def test_plain_csv_without_a_layout_guesses_and_tells(tmp_path: Path) -> None:
    path = write(tmp_path, "log.csv", "t [s],u [m/s],mode\n0.0,1.5,auto\n0.1,-2,manual\n")
    assert open_log(path).topics[0].count == 2  # known before anything is read
    series, reader = read_all(path)
    assert series.receive_ns.tolist() == [0, 100_000_000]
    assert series.stamp_ns is None
    assert series.columns["u [m/s]"].tolist() == [1.5, -2.0]
    assert series.columns["mode"].tolist() == ["auto", "manual"]
    (topic,) = reader.topics
    assert dict(topic.fields) == {"t [s]": "float64", "u [m/s]": "float64", "mode": "string"}
    assert (topic.count, topic.start_ns, topic.end_ns) == (2, 0, 100_000_000)
    assert 'time guessed: column "t [s]" (s)' in topic.note
    assert reader.losses == ()


def test_only_wanted_columns_come(tmp_path: Path) -> None:
    reader = open_log(write(tmp_path, "log.csv", "time,a,b\n0,1,2\n1,3,4\n"))
    series = reader.read({"table": ("b",)})["table"]
    assert list(series.columns) == ["b"]
    assert reader.read({"table": ()})["table"].receive_ns.tolist() == [0, 1_000_000_000]


def test_semicolons_with_decimal_commas_and_byte_order_mark(tmp_path: Path) -> None:
    path = write(tmp_path, "log.csv", b"\xef\xbb\xbfTime;speed\r\n0,0;1,25\r\n0,5;-2,5\r\n")
    series, reader = read_all(path)
    assert series.receive_ns.tolist() == [0, 500_000_000]
    assert series.columns["speed"].tolist() == [1.25, -2.5]
    assert "decimal comma" in reader.topics[0].note
    assert "byte-order mark" in reader.topics[0].note
    stated, _ = read_all(path, TableLayout(time="Time", separator=";"))
    assert stated.columns["speed"].tolist() == [1.25, -2.5]


def test_utf16_and_cp1252_text(tmp_path: Path) -> None:
    text = "time,course [°]\n0,10.5\n1,11.5\n"
    for name, encoding in (("a.csv", "utf-16"), ("b.csv", "cp1252")):
        series, _ = read_all(write(tmp_path, name, text.encode(encoding)))
        assert series.columns["course [°]"].tolist() == [10.5, 11.5]


def test_blank_separated_text_with_lines_to_skip(tmp_path: Path) -> None:
    text = " Model basin\n Run 12 of 30\n\n   .000000   1.50\t -.25  \n   .050000   1.75   -.50\n  0.1 2 +3e0"
    layout = TableLayout(time="t", columns=("t", "x", "y"), skip_rows=3, separator="whitespace")
    path = write(tmp_path, "run.dat", text)
    for series, _ in (read_all(path, layout),):
        assert series.receive_ns.tolist() == [0, 50_000_000, 100_000_000]
        assert series.columns["x"].tolist() == [1.5, 1.75, 2.0]
        assert series.columns["y"].tolist() == [-0.25, -0.5, 3.0]
    guessed, reader = read_all(path)
    assert guessed.columns["column 3"].tolist() == [-0.25, -0.5, 3.0]
    assert "3 lines before the table skipped" in reader.topics[0].note


def test_repeated_and_missing_names_are_numbered(tmp_path: Path) -> None:
    series, reader = read_all(write(tmp_path, "log.csv", ",time,u,u\n0,0.0,1,2\n1,0.1,3,4\n"))
    assert series.columns["u"].tolist() == [1, 3]
    assert series.columns["u (2)"].tolist() == [2, 4]
    assert series.columns["column 1"].tolist() == [0, 1]
    assert "repeated column names" in reader.topics[0].note
    assert [columns_named(reader.topics[0], name) for name in ("u", "time", "none")] == [2, 1, 0]


def test_a_name_that_ends_in_a_number_is_no_repeated_one(tmp_path: Path) -> None:
    _, reader = read_all(write(tmp_path, "log.csv", "time,u,u (2)\n0,1,2\n0.1,3,4\n"))
    assert columns_named(reader.topics[0], "u") == 1


def test_missing_cells_are_nan_and_booleans_are_kept(tmp_path: Path) -> None:
    series, _ = read_all(write(tmp_path, "log.csv", "time,a,n,ok\n0,,1,True\n1,nan,,False\n2,2.5,3,True\n"))
    np.testing.assert_array_equal(series.columns["a"], [np.nan, np.nan, 2.5])
    np.testing.assert_array_equal(series.columns["n"], [1, np.nan, 3])
    assert series.columns["ok"].dtype == bool


def test_header_with_a_units_line_below(tmp_path: Path) -> None:
    series, reader = read_all(write(tmp_path, "log.csv", "time,u\n[s],[m/s]\n0,1\n1,2\n"))
    assert series.columns["u"].tolist() == [1, 2]
    assert "units?" in reader.topics[0].note


def test_stamps_from_two_columns_keep_nanoseconds(tmp_path: Path) -> None:
    text = (
        "time,header_stamp_secs,header_stamp_nsecs,x\n2025/04/11 11:15:45.313396019,1744362945,312026019,1\n"
        "2025/04/11 11:15:45.413396020,1744362945,412026021,2\n"
    )
    path = write(tmp_path, "log.csv", text)
    layout = TableLayout(time="time", time_unit="datetime", stamp=("header_stamp_secs", "header_stamp_nsecs"))
    for series, _ in (read_all(path, layout), read_all(path)):
        assert series.receive_ns.tolist() == [1744370145313396019, 1744370145413396020]
        assert series.stamp_ns is not None
        assert series.stamp_ns.tolist() == [1744362945312026019, 1744362945412026021]


def test_unreadable_stamps_count_as_zero_and_are_told(tmp_path: Path) -> None:
    text = "time,stamp_secs,stamp_nsecs,x\n0,5,100,1\n1,,,2\n2,7,0,3\n3,8,0,3\n"
    series, reader = read_all(write(tmp_path, "log.csv", text))
    assert series.stamp_ns is not None
    assert series.stamp_ns.tolist() == [5_000_000_100, 0, 7_000_000_000, 8_000_000_000]
    assert "1 stamp is not readable" in reader.topics[0].note


def test_folder_is_one_topic_per_file(tmp_path: Path) -> None:
    (tmp_path / "run" / "nav").mkdir(parents=True)
    write(tmp_path / "run", "rpm.csv", "time,data\n0,1\n1,2\n2,2\n")
    write(tmp_path / "run" / "nav", "pose.csv", "time,x\n0.5,1\n")
    write(tmp_path / "run", "notes.csv", "who,what\nme,nothing\n")
    reader = open_log(tmp_path / "run")
    assert [topic.name for topic in reader.topics] == ["/nav/pose", "/rpm"]
    assert reader.read({"/rpm": ("data",)})["/rpm"].columns["data"].tolist() == [1, 2, 2]
    (loss,) = reader.losses
    assert loss.topic == "/notes"
    assert "not a table" in loss.what


def test_parquet_with_typed_times_structs_and_missing_values(tmp_path: Path) -> None:
    times = pa.array([1744370145313396019, 1744370145413396020], pa.timestamp("ns"))
    pose = pa.array([{"x": 1.5, "y": 2}, {"x": 2.5, "y": None}])
    table = pa.table({"when": times, "pose": pose, "on": [True, None], "list": [[1.0], [2.0]], "who": ["a", None]})
    parquet.write_table(table, tmp_path / "log.parquet")
    for layout in (None, TableLayout(time="when")):
        series, reader = read_all(tmp_path / "log.parquet", layout)
        assert series.receive_ns.tolist() == [1744370145313396019, 1744370145413396020]
        assert "list" not in reader.topics[0].fields
        assert series.columns["pose.x"].tolist() == [1.5, 2.5]
        np.testing.assert_array_equal(series.columns["pose.y"], [2, np.nan])
        np.testing.assert_array_equal(series.columns["on"], [1, np.nan])
        assert series.columns["who"].tolist() == ["a", ""]
        assert reader.topics[0].end_ns == 1744370145413396020


def test_parquet_of_several_row_groups_reads_only_the_wanted_column(tmp_path: Path) -> None:
    table = pa.table({"time_ns": np.arange(1000) * 5, "u": np.arange(1000.0), "f": np.arange(1000, dtype=np.float32)})
    parquet.write_table(table, tmp_path / "log.parquet", row_group_size=300)
    reader = open_log(tmp_path / "log.parquet")
    series = reader.read({"table": ("u",)})["table"]
    assert list(series.columns) == ["u"]
    np.testing.assert_array_equal(series.columns["u"], np.arange(1000.0))
    np.testing.assert_array_equal(series.receive_ns, np.arange(1000) * 5)


@pytest.mark.slow
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    rows=st.lists(
        st.tuples(
            st.floats(allow_nan=False, allow_infinity=False),
            st.integers(-(2**53), 2**53),
            st.text(alphabet=st.characters(codec="ascii", exclude_characters="\r\n\0", min_codepoint=32), max_size=12),
        ),
        min_size=2,
        max_size=20,
    ),
    separator=st.sampled_from([",", ";", "\t"]),
    end=st.sampled_from(["\n", "\r\n"]),
)
def test_any_csv_reads_as_pythons_csv_module_reads_it(
    tmp_path: Path, rows: list[tuple[float, int, str]], separator: str, end: str
) -> None:
    buffer = io.StringIO()
    writer = csv.writer(buffer, delimiter=separator, lineterminator=end)
    writer.writerow(["time", "a", "b", "text"])
    for number, row in enumerate(rows):
        writer.writerow([number * 0.5, *row[:2], "x" + row[2]])
    path = write(tmp_path, "log.csv", buffer.getvalue())
    series, reader = read_all(path, TableLayout(time="time", separator=separator))
    expected = list(csv.reader(io.StringIO(buffer.getvalue(), newline=""), delimiter=separator))[1:]
    assert reader.losses == ()
    assert series.columns["a"].tolist() == [float(row[1]) for row in expected]
    assert series.columns["b"].tolist() == [int(row[2]) for row in expected]
    assert series.columns["text"].tolist() == [row[3] for row in expected]


# --- times --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("2025/04/11 11:15:45.313396019", (2025, 4, 11, 11, 15, 45, 313396019)),
        ("2024-02-29T23:59:59Z", (2024, 2, 29, 23, 59, 59, 0)),
        ("1969-12-31 23:59:59.5", (1969, 12, 31, 23, 59, 59, 500000000)),
        ("2025-04-11 13:15:45.25+02:00", (2025, 4, 11, 11, 15, 45, 250000000)),
        ("2025-04-11T11:15:45,123", (2025, 4, 11, 11, 15, 45, 123000000)),
        # As a script writes it with strftime("%Y-%m-%d_%H:%M:%S:%f").
        ("2024-03-07_15:34:58:080059", (2024, 3, 7, 15, 34, 58, 80059000)),
    ],
)
def test_datetimes_against_the_standard_library(text: str, expected: tuple[int, ...]) -> None:
    times, good, note = datetimes_to_ns([text])
    seconds = int((datetime(*expected[:6], tzinfo=UTC) - datetime(1970, 1, 1, tzinfo=UTC)).total_seconds())
    assert (times.tolist(), good.tolist(), note) == ([seconds * 10**9 + expected[6]], [True], "")


@pytest.mark.slow
@given(st.lists(st.datetimes(min_value=datetime(1700, 1, 1), max_value=datetime(2200, 1, 1)), min_size=1, max_size=5))
def test_datetimes_of_any_day_against_numpy(moments: list[datetime]) -> None:
    texts = [moment.isoformat(sep=" ", timespec="microseconds") for moment in moments]
    times, good, _ = datetimes_to_ns(texts)
    assert good.all()
    assert times.tolist() == np.array(texts, dtype="datetime64[ns]").astype(np.int64).tolist()


@pytest.mark.parametrize(
    "text", ["", "11:15", "2025-02-30 00:00:00", "2025-13-01 00:00:00", "11.04.2025 11:15:45", "2025-04-11 11:15:45 pm"]
)
def test_what_is_no_date_is_unreadable(text: str) -> None:
    _, good, _ = datetimes_to_ns(["2025-04-11 11:15:45.5", text])
    assert good.tolist() == [True, False]


def test_dates_without_a_zone_give_way_to_seconds_since_1970() -> None:
    dates = [f"2024-04-23_12:39:08:{k}82522" for k in range(3)]
    alone = guess_time({"column 1": dates, "u": ["1", "2", "3"]})
    assert alone is not None
    assert (alone.column, alone.unit) == ("column 1", "datetime")
    seconds = ["1713868748.08", "1713868748.18", "1713868748.28"]
    both = guess_time({"column 1": dates, "current_time": seconds})
    assert both is not None
    assert (both.column, both.unit) == ("current_time", "s")
    # Not to a time of something else that stands before these.
    counted = {"column 1": dates, "time_in_mode": ["10.08", "10.18", "10.28"], "current_time": seconds}
    since = guess_time(counted)
    assert since is not None
    assert since.column == "current_time"
    assert '"time_in_mode" may be it too' in since.note
    # A date that states its zone is as good, and of a time that is written once a second most rows are late.
    zoned = guess_time({"column 1": [f"{date[:19]}+02:00" for date in dates], "current_time": seconds})
    coarse = guess_time(
        {"column 1": [*dates, "2024-04-23_12:39:08:382522"], "fix_time": [seconds[0]] * 2 + [seconds[2]] * 2}
    )
    assert [one.column if one else None for one in (zoned, coarse)] == ["column 1", "column 1"]


def test_fractions_without_leading_zeros_are_recognised_by_order() -> None:
    nanoseconds = [981391041, 1081833647, 1182833862, 1294568436, 2004000001]
    texts = [f"2025/04/11 11:15:{44 + ns // 10**9}.{ns % 10**9}" for ns in nanoseconds]
    assert texts[1].endswith("45.81833647")
    times, _, note = datetimes_to_ns(texts)
    assert np.diff(times).tolist() == np.diff(nanoseconds).tolist()
    assert "leading zeros" in note
    # Fractions cut of their trailing zeros are the ordinary case, and not touched.
    times, _, note = datetimes_to_ns(["2025-04-11 11:15:45.25", "2025-04-11 11:15:45.251", "2025-04-11 11:15:45.3"])
    assert np.diff(times).tolist() == [1_000_000, 49_000_000]
    assert note == ""


def test_epoch_seconds_keep_what_a_float_can_hold() -> None:
    times, good = numbers_to_ns(np.array([1744362945.5, -0.25, np.nan, 1e300]), "s")
    assert times[:2].tolist() == [1744362945_500_000_000, -250_000_000]
    assert good.tolist() == [True, True, False, False]


@pytest.mark.parametrize(
    ("sample", "column", "unit"),
    [
        ({"": ["0", "1"], "tvec": ["0.0", "0.5"]}, "tvec", "s"),
        ({"a": ["1", "2"], "time (ms)": ["0", "20"]}, "time (ms)", "ms"),
        ({"timestamp": ["1744362945123456789", "1744362945223456789"]}, "timestamp", "ns"),
        ({"%time": ["1744362945.1", "1744362945.2"]}, "%time", "s"),
        ({"column 1": ["0.0", "0.05", "0.1"], "column 2": ["3", "2", "3"]}, "column 1", "s"),
        ({"a": ["1", "2"], "original_timestamp": ["1744362945.1", "1744362945.2"]}, "original_timestamp", "s"),
        ({"speed": ["1", "2"], "sensorTime": ["0", "100"]}, "sensorTime", "ms"),
        ({"time_zone": ["1", "2"], "stamp_nsecs": ["1", "2"], "stamp_secs": ["7", "8"]}, "stamp_secs", "s"),
        ({"time": ["0", "50", "100"]}, "time", "ms"),
        ({"time": ["0", "50000", "100000"]}, "time", "us"),
        ({"time": ["0", "50000000", "100000000"]}, "time", "ns"),
        ({"time [s]": ["0", "50", "100"]}, "time [s]", "s"),
        ({"time": ["1744362945123", "1744362945223"]}, "time", "ms"),
    ],
)
def test_time_column_is_guessed(sample: dict[str, list[str]], column: str, unit: str) -> None:
    plan = guess_time(sample)
    assert plan is not None
    assert (plan.column, plan.unit) == (column, unit)


def test_dates_in_whole_seconds_give_way_to_a_clock_that_is_finer(tmp_path: Path) -> None:
    seconds = [f"2024-04-25 20:48:{44 + k // 10}" for k in range(60)]
    clock = [f"{1714049324781.1 + 92.0 * k:.4f}" for k in range(60)]
    rows = [f"{one},{other},{k}" for k, (one, other) in enumerate(zip(seconds, clock, strict=True))]
    path = tmp_path / "boat.csv"
    path.write_text("\n".join(["Date,timeStamp,u", *rows]) + "\n", encoding="utf-8")
    (topic,) = open_log(path).topics
    assert 'column "timeStamp" (ms), as most rows repeat the time of "Date"' in topic.note
    assert topic.start_ns == pytest.approx(1714049324781100000, abs=1000)
    # A clock that stands still as often, and a counter without a word for time, are no better.
    for others in ({"timeStamp": [one[:-5] for one in seconds]}, {"row": [str(k) for k in range(60)]}):
        plan = guess_time({"Date": seconds, **others})
        assert plan is not None
        assert (plan.column, "repeat" in plan.note) == ("Date", False)


def test_a_time_of_day_beside_a_date_that_is_not_read_goes_on_over_midnight(tmp_path: Path) -> None:
    clock = ["23:59:58", "23:59:59.5", "0:00:01", "00:00:02.250"]
    rows = [f"{'11/03/17' if k < 2 else '12/03/17'}\t{one}\t{k}" for k, one in enumerate(clock)]
    path = tmp_path / "boat.txt"
    path.write_text("\n".join(["Date\tTime\tBoatspeed", *rows]) + "\n", encoding="utf-8")
    reader = open_log(path)
    assert 'column "Time" (time of day, of which date is not known)' in reader.topics[0].note
    series = reader.read({"table": ("Boatspeed",)})["table"]
    assert (np.diff(series.receive_ns) / 1e9).tolist() == [1.5, 1.5, 1.25]
    assert series.receive_ns[0] == (24 * 3600 - 2) * 10**9


def test_a_time_of_day_that_cannot_be_read_is_no_time_of_its_row() -> None:
    times, good, _ = datetimes_to_ns(["12:00:00", "12:00:01", "", "25:00:00", "12:00:04"])
    assert good.tolist() == [True, True, False, False, True]
    assert np.diff(times[good]).tolist() == [10**9, 3 * 10**9]


def test_several_columns_that_may_be_the_time_are_listed() -> None:
    plan = guess_time({"u": ["1", "2"], "gps_week_time": ["1", "2"], "host_time": ["5", "6"]})
    assert plan is not None
    assert plan.column == "gps_week_time"
    assert '"host_time" may be it too: set time under [table] in the profile' in plan.note


def test_a_unit_that_the_profile_states_is_kept_where_the_column_is_guessed(tmp_path: Path) -> None:
    path = write(tmp_path, "log.csv", "time,u\n0,1\n1,2\n")
    series, reader = read_all(path, TableLayout(time_unit="us"))
    assert series.receive_ns.tolist() == [0, 1000]
    assert "us as the profile states" in reader.topics[0].note


def test_an_assumed_unit_is_reported() -> None:
    plan = guess_time({"time": ["0", "100", "200"]})
    assert plan is not None
    assert "ms, since steps of 100 are too long for seconds" in plan.note


@pytest.mark.parametrize(
    ("numbers", "unit", "told"),
    [
        ([0.0, 100.0, 200.0], "s", 'look like milliseconds, so set time_unit = "ms"'),
        ([1744362945123.0, 1744362945223.0], "s", 'look like milliseconds, so set time_unit = "ms"'),
        ([1744362945.1, 1744362945.2], "ns", 'look like seconds, so set time_unit = "s"'),
        ([0.0, 0.01, 0.02], "ms", 'look like seconds, so set time_unit = "s"'),
        ([0.0, 0.1, 0.2], "s", ""),
        ([1744362945.0, 1744362946.0], "s", ""),
        ([0.0, 20.0, 40.0], "ms", ""),
    ],
)
def test_a_stated_unit_that_cannot_be_right_is_doubted(numbers: list[float], unit: str, told: str) -> None:
    doubt = unit_doubt(np.array(numbers), unit)
    assert told in doubt
    assert bool(told) == bool(doubt)


def test_a_row_counter_or_a_named_rising_column_is_no_time() -> None:
    assert guess_time({"column 1": ["0", "1", "2"], "u": ["1", "2", "3"]}) is None
    assert guess_time({"J": ["0", "0.05", "0.1"], "Kt": ["0.3", "0.2", "0.1"]}) is None


# --- damage -------------------------------------------------------------------------------------------------------


def test_rows_with_a_wrong_number_of_fields_are_counted(tmp_path: Path) -> None:
    series, reader = read_all(write(tmp_path, "log.csv", "time,a\n0,1\n1,2,3\n2,4\n3\n4,5\n"))
    assert series.columns["a"].tolist() == [1, 4, 5]
    (loss,) = reader.losses
    assert loss.messages == 2
    assert "line 3" in loss.what
    assert '"1,2,3"' in loss.what


def test_a_row_cut_at_the_end_is_told_apart(tmp_path: Path) -> None:
    series, reader = read_all(write(tmp_path, "log.csv", "time,a,b\n0,1,1\n1,2,2\n2,4"))
    assert series.columns["a"].tolist() == [1, 2]
    assert [loss.messages for loss in reader.losses] == [1]
    assert "ends in the middle of a row" in reader.losses[0].what


@pytest.mark.parametrize("last", ["3,4,5", '3,4,"5'])
def test_a_short_row_in_the_middle_is_not_taken_for_the_last(tmp_path: Path, last: str) -> None:
    _, reader = read_all(write(tmp_path, "log.csv", f"time,a,b\n0,1,1\n1,2\n2,2,2\n2.5,2,2\n2.7,2,2\n{last}"))
    short = reader.losses[0]
    assert short.messages == 1
    assert "without 3 fields" in short.what
    assert "line 3" in short.what
    assert not any("middle of a row" in loss.what for loss in reader.losses)


@pytest.mark.parametrize("last", ["3,4", "3 , 4"])
def test_the_last_row_is_told_apart_from_short_ones_before_it(tmp_path: Path, last: str) -> None:
    _, reader = read_all(write(tmp_path, "log.csv", f"time,a,b\n0,1,1\n1,2\n2,2,2\n2.5,2,2\n2.7,2,2\n{last}"))
    assert [loss.messages for loss in reader.losses] == [1, 1]
    assert "ends in the middle of a row" in reader.losses[0].what
    assert "line 3" in reader.losses[1].what


def test_unreadable_numbers_and_times_are_counted(tmp_path: Path) -> None:
    series, reader = read_all(write(tmp_path, "log.csv", "time,a\n0,1\n1,ERR\n2,4\nreset,9\n4,5\n"))
    assert series.receive_ns.tolist() == [0, 10**9, 2 * 10**9, 4 * 10**9]
    np.testing.assert_array_equal(series.columns["a"], [1, np.nan, 4, 5])
    by_text = {loss.what.split(" ")[1]: loss for loss in reader.losses}
    assert set(by_text) == {"cell", "row"}
    assert by_text["row"].messages == 1
    assert by_text["row"].seconds == pytest.approx(2.0)


def test_reading_twice_does_not_count_twice(tmp_path: Path) -> None:
    reader = open_log(write(tmp_path, "log.csv", "time,a\n0,1\n1,2,3\n2,4\n"))
    for _ in range(2):
        reader.read({"table": ("a",)})
    assert len(reader.losses) == 1


@pytest.mark.parametrize(
    ("name", "content", "layout", "expected"),
    [
        ("a.csv", "time,u\n", None, "header and no rows"),
        ("a.csv", "time,u\n", TableLayout(time="time"), "header and no rows"),
        ("a.txt", "Dear all,\nthe trial went well,\nregards\n", None, "not a table"),
        ("a.csv", "a,b\n1,2\n1,2\n", None, "looks like a time"),
        ("a.csv", "c,d\n0.5,2\n1,1\n1.5,3\n", None, "it may be c (by 0.5), which rises from row to row. Fix: "),
        ("a.csv", "time,u\n0,1\n1,2\n", TableLayout(time="tiem"), 'Did you mean "time"?'),
        ("a.csv", "time;u\n0;1\n1;2\n", TableLayout(time="time"), 'Fix: add separator = ";" under [table]'),
        ("a.csv", "time\tu\n0\t1\n1\t2\n", TableLayout(time="time"), 'Fix: add separator = "\\t" under [table]'),
        ("a.csv", "time,u\n0,1\n1,2\n", TableLayout(time="c", columns=("a", "b", "c")), "3 column names but 2 fields"),
        ("a.csv", "time,u\nx,1\ny,2\n", TableLayout(time="time"), "readable time"),
        ("a.csv", "time,u\n0,1\n", TableLayout(time="time", time_unit="datetime"), "readable time"),
        ("a.csv", "time,u\n0,1\n", TableLayout(time="time", skip_rows=9), "no rows after 9 lines"),
        ("a.csv", "time,u\n0,1\n", TableLayout(time="time", encoding="utf-99"), "encoding"),
        ("a.parquet", b"PAR1 and then nothing", None, "Parquet file cannot be read"),
        ("a.csv", "time,u\n0,1\n", TableLayout(time="time", separator="::"), "separator"),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line(
    tmp_path: Path, name: str, content: str | bytes, layout: TableLayout | None, expected: str
) -> None:
    path = write(tmp_path, name, content)
    with pytest.raises(FerryIdError) as caught:
        read_all(path, layout)
    message = str(caught.value)
    assert expected in message
    assert message.startswith(str(path))
    assert "Fix:" in message
    assert "\n" not in message


NMEA = "$GNHDT,251.5847,T*13\r\n$GPVTG,278.601,T,282.034,M,0.12312,N,0.22802,K,D*34\r\n"
DATAFLASH_TEXT = "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns\nATT, 1000, 0.0, 1.2, 0.0, -2.1, 3.4, 5.6\n"


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        (
            "a.txt",
            "888,T,177.3,M,0.14,N,0.26,K,D*39\n" + 5 * NMEA,
            r"found sentences of NMEA 0183.*Fix: convert them to a table",
        ),
        ("a.nmea", NMEA, "found sentences of NMEA 0183.*Fix: convert them to a table"),
        (
            "a.csv",
            "".join(f"2023-09-01 15:56:44 | {one}\n" for one in 3 * NMEA.split("\r\n")[:2]),
            "sentences of NMEA 0183",
        ),
        (
            "a.log",
            DATAFLASH_TEXT + "RCOU, 1000, 1500, 1500, 1600\n" * 9,
            r"ArduPilot as text.*Fix: take the binary log",
        ),
        ("a.tlog", (1693609000000000).to_bytes(8, "big") + b"\xfd\x1f\x00\x00" + bytes(60), "telemetry log of MAVLink"),
        ("a.ulg.gz", gzip.compress(b"ULog" * 100, mtime=0), "packed by gzip.*Fix: unpack it"),
        ("a.xlsx", b"PK\x03\x04\x14\x00\x06\x00" + bytes(22) + b"[Content_Types].xml" + bytes(90), "workbook.*as CSV"),
        ("b.xlsx", b"PK\x03\x04" + bytes(26) + b"docProps/PK\x03\x04" + bytes(90), "workbook.*as CSV"),
        (
            "a.ods",
            b"PK\x03\x04" + bytes(26) + b"mimetypeapplication/vnd.oasis.opendocument.spreadsheet" + bytes(90),
            "workbook.*as CSV",
        ),
    ],
    ids=lambda one: one if isinstance(one, str) and one.startswith("a.") else "",
)
def test_recordings_of_other_kinds_are_named_in_the_refusal(
    tmp_path: Path, name: str, content: str | bytes, expected: str
) -> None:
    (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(FerryIdError, match=expected) as error:
        open_log(tmp_path / name)
    assert len(str(error.value).splitlines()) == 1


def test_misspelt_column_gets_the_nearest_name(tmp_path: Path) -> None:
    reader = open_log(write(tmp_path, "log.csv", "time,speed\n0,1\n1,2\n"))
    with pytest.raises(FerryIdError, match='Did you mean "speed"'):
        reader.read({"table": ("sped",)})
    with pytest.raises(FerryIdError, match="no topic"):
        reader.read({"/odom": ("x",)})


@pytest.mark.slow
def test_opening_and_reading_a_csv_does_not_import_pandas(tmp_path: Path) -> None:
    path = write(tmp_path, "log.csv", "time,u,mode\n0,1.5,a\n1,,b\n")
    code = (
        "import sys; from ferryid.ingest import open_log, supported_formats; supported_formats()\n"
        "assert 'pandas' not in sys.modules and 'pyarrow' not in sys.modules\n"
        f"open_log({str(path)!r}).read({{'table': ('u', 'mode')}})\n"
        "assert 'pandas' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


# --- real recordings ----------------------------------------------------------------------------------------------


def test_kvlcc2_text(shared_data: Callable[[str], Path]) -> None:
    names = ("t", "x", "y", "psi", "u", "v", "r", "p", "delta", "n", "T", "Q")
    layout = TableLayout(time="t", columns=names, skip_rows=4, separator="whitespace", encoding="cp1252")
    series, reader = read_all(shared_data("kvlcc2/HSVA_CPMC_KVLCC2_Z_10_05.dat"), layout)
    assert len(series.receive_ns) == 3501
    assert set(np.diff(series.receive_ns).tolist()) == {50_000_000}
    assert series.columns["Q"][-1] == 1.11433
    assert reader.losses == ()


@pytest.mark.slow
def test_milliampere_2025_folder(shared_data: Callable[[str], Path]) -> None:
    reader = open_log(shared_data("milliampere1"))
    assert len(reader.topics) == 21
    series = reader.read({"/vectorVS330/fix": ("latitude",), "/actuators/actuator_1/azimuth_angle": ("data",)})
    fix = series["/vectorVS330/fix"]
    assert fix.stamp_ns is not None
    # The recorder wrote local time: two hours ahead, and otherwise within a second of the receiver's stamps.
    latency_s = (fix.receive_ns - fix.stamp_ns) * 1e-9 - 7200
    assert float(latency_s.min()) > 0
    assert float(latency_s.max()) < 1
    assert bool((np.diff(fix.receive_ns) > 0).all())
    assert math.isclose(fix.columns["latitude"][0], 63.44119928516667)
