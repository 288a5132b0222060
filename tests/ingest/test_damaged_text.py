"""Damaged text tables: every line below the header is a row or counted as lost."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.ingest import open_log
from ferryid.ingest.log import Reader, Series, TableLayout
from ferryid.ingest.table_rows import LONGEST_LINE

HEADER = b"time,a,mode\n"
ROWS = [b"%d.0,%d.5,auto" % (n, n) for n in range(10)]


def read(folder: Path, content: bytes, layout: TableLayout | None = None) -> tuple[Series, Reader]:
    path = folder / "log.csv"
    path.write_bytes(content)
    reader = open_log(path, layout)
    return reader.read({"table": tuple(reader.topics[0].fields)})["table"], reader


def lost(reader: Reader) -> int:
    return sum(loss.messages or 0 for loss in reader.losses)


def with_row(row: bytes, place: int = 4) -> bytes:
    return HEADER + b"\n".join([*ROWS[:place], row, *ROWS[place:]]) + b"\n"


@pytest.mark.parametrize(
    ("row", "what"),
    [
        (b"4.5,\xff\xfe,auto,7,8", "without 3 fields"),
        (b"4.5,1\xff", "without 3 fields"),
        (b'4.5,"1.5,auto', "a quote that is not closed"),
        (b'"4.5,1.5,auto', "a quote that is not closed"),
        (b'4.5,1,"au""to', "a quote that is not closed"),
        (b"4.5;1.5;auto", "without 3 fields"),
        (b"\0" * 5000, "without 3 fields"),
        (b"4.5," + b"9" * (LONGEST_LINE + 1) + b",auto", "more than a million characters"),
    ],
)
def test_a_damaged_row_costs_itself_and_is_counted(tmp_path: Path, row: bytes, what: str) -> None:
    series, reader = read(tmp_path, with_row(row))
    assert series.columns["a"].tolist() == [n + 0.5 for n in range(10)]
    assert lost(reader) == 1
    assert any(what in loss.what for loss in reader.losses)


def test_a_row_of_bad_utf8_and_wrong_width_far_down_is_counted_in_silence(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    rows = [b"%d.0,%d.5,auto" % (n, n) for n in range(6000)]  # more than the first look at the file
    series, reader = read(tmp_path, HEADER + b"\n".join([*rows[:5500], b"0.5,\xff,auto,7", *rows[5500:]]) + b"\n")
    assert (len(series.receive_ns), lost(reader)) == (6000, 1)
    assert capfd.readouterr() == ("", "")


def test_bytes_that_are_not_text_cost_their_cell_only(tmp_path: Path) -> None:
    content = with_row(b"4.5,1.\xff5,auto").replace(b"9.5,auto", b"9.5,au\xc3to").replace(b"0.5,auto", "0.5,à".encode())
    content = content.replace(b"1.5,auto", "1.5,à".encode()).replace(b"2.5,auto", "2.5,à".encode())
    series, reader = read(tmp_path, content)
    np.testing.assert_array_equal(series.columns["a"][3:6], [3.5, np.nan, 4.5])
    assert series.columns["mode"][-1] == "au\ufffdto"
    assert any("2 rows hold bytes that are not utf-8 text" in loss.what for loss in reader.losses)
    assert any('1 cell of column "a" is not a number' in loss.what for loss in reader.losses)


def test_one_damaged_byte_in_the_head_does_not_make_utf8_text_cp1252(tmp_path: Path) -> None:
    content = "time,course [°]\n".encode() + "0,1\n1,2°\n2,3\n".encode() + b"3,\xff4\n4,5\n"
    series, _ = read(tmp_path, content)
    np.testing.assert_array_equal(series.columns["course [°]"], [1, np.nan, 3, np.nan, 5])


def test_quoted_cells_may_go_over_lines(tmp_path: Path) -> None:
    series, reader = read(tmp_path, with_row(b'4.5,1.5,"several\nlines"'))
    assert series.columns["mode"][4] == "several\nlines"
    assert len(series.receive_ns) == 11
    assert lost(reader) == 0


def test_two_stray_quotes_do_not_take_the_rows_between_them(tmp_path: Path) -> None:
    rows = list(ROWS)
    rows[2], rows[7] = b'2.0,"2.5,auto', b'7.0,7.5",auto'
    series, reader = read(tmp_path, HEADER + b"\n".join(rows) + b"\n")
    assert len(series.receive_ns) + lost(reader) == 10
    assert len(series.receive_ns) >= 8


def test_lines_that_end_in_cr_are_rows(tmp_path: Path) -> None:
    series, reader = read(tmp_path, (HEADER + b"\n".join(ROWS) + b"\n").replace(b"\n", b"\r"))
    assert (len(series.receive_ns), lost(reader)) == (10, 0)


def test_quotes_on_lines_that_end_in_cr_are_no_pair(tmp_path: Path) -> None:
    rows = list(ROWS)
    rows[2], rows[7] = b'2.0,2.5,"', b'7.0,",auto'
    series, reader = read(tmp_path, (HEADER + b"\n".join(rows) + b"\n").replace(b"\n", b"\r"))
    assert (len(series.receive_ns), lost(reader)) == (8, 2)


def test_a_form_feed_is_no_end_of_a_line(tmp_path: Path) -> None:
    series, reader = read(tmp_path, b"run\x0c12\n" + HEADER + b"\n".join(ROWS))
    assert (len(series.receive_ns), lost(reader)) == (10, 0)


def test_zeros_after_a_power_loss_cost_the_last_row(tmp_path: Path) -> None:
    series, reader = read(tmp_path, HEADER + b"\n".join(ROWS) + b"\n10.0,1" + b"\0" * 4096)
    assert (len(series.receive_ns), lost(reader)) == (10, 1)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-be", "utf-32"])
def test_wide_text_reads_as_any_other(tmp_path: Path, encoding: str) -> None:
    text = (HEADER + b"\n".join(ROWS)).decode()
    mark = "\ufeff" if encoding == "utf-16-be" else ""
    series, reader = read(tmp_path, (mark + text).encode(encoding))
    assert series.columns["a"].tolist() == [n + 0.5 for n in range(10)]
    assert reader.topics[0].end_ns == 9 * 10**9


def test_utf16_without_a_mark_is_read_where_the_profile_names_it(tmp_path: Path) -> None:
    content = (HEADER + b"\n".join(ROWS)).decode().encode("utf-16-le")
    series, _ = read(tmp_path, content, TableLayout(time="time", encoding="utf-16-le"))
    assert len(series.receive_ns) == 10


@pytest.mark.slow
def test_a_header_longer_than_the_first_look(tmp_path: Path) -> None:
    names = ",".join(["time", *(f"a long name of column {n}" for n in range(6000))])
    rows = "\n".join(",".join([str(t), *["1"] * 6000]) for t in range(3))
    path = tmp_path / "log.csv"
    path.write_text(names + "\n" + rows + "\n")
    assert open_log(path).read({"table": ("a long name of column 5999",)})["table"].receive_ns.tolist() == [
        0,
        10**9,
        2 * 10**9,
    ]


def test_whole_nanoseconds_stay_exact_beside_missing_cells(tmp_path: Path) -> None:
    times = [1744362945123456789 + n * 100_000_001 for n in range(10)]
    for missing in (b"", b"ERR"):
        rows = [b"%d,%d.5,auto" % (t, n) for n, t in enumerate(times)]
        rows[5] = missing + b",5.5,auto"
        series, reader = read(tmp_path, HEADER + b"\n".join(rows))
        assert series.receive_ns.tolist() == times[:5] + times[6:]
        assert lost(reader) == 1


def test_times_that_nanoseconds_cannot_hold_are_lost_rows(tmp_path: Path) -> None:
    series, reader = read(tmp_path, with_row(b"9223372036854775807,1.5,auto").replace(b".0,", b","))
    assert (len(series.receive_ns), lost(reader)) == (10, 1)
    dates = b"".join(b"%s-04-11 11:15:4%d,1,auto\n" % (year, n) for n, year in enumerate([b"2025", b"9999", b"2025"]))
    series, reader = read(tmp_path, HEADER + dates)
    assert (len(series.receive_ns), lost(reader)) == (2, 1)


def test_numbers_that_only_python_reads_are_unreadable(tmp_path: Path) -> None:
    series, _ = read(tmp_path, with_row(b"4.5,1_0,auto") + "11,١٢,auto\n".encode())
    assert np.isnan(series.columns["a"][[4, 11]]).all()


def test_a_table_without_time_lists_the_columns_that_may_be_meant(tmp_path: Path) -> None:
    with pytest.raises(FerryIdError, match=r'found "boot_time" of 2 columns, whose values do not rise.*time under'):
        read(tmp_path, b"boot_time,u\n9,1\n5,2\n3,1\n1,2\n")


@pytest.mark.parametrize("encoding", ["idna", "undefined", "base64", "punycode", "utf-99"])
def test_an_encoding_that_is_not_for_files_is_refused(tmp_path: Path, encoding: str) -> None:
    with pytest.raises(FerryIdError, match=rf'names the encoding "{encoding}", which cannot be used|readable time'):
        read(tmp_path, with_row(ROWS[0]), TableLayout(time="time", encoding=encoding))


@pytest.mark.parametrize("damaged", ["16\\xff\\xff,2,ok", "0.0,2", "0.0,2,ok,4,5"])
def test_a_damaged_first_row_is_lost_by_itself_and_leaves_the_names(tmp_path: Path, damaged: str) -> None:
    rows = "".join(f"{n},{n * 2},ok\n" for n in range(1, 40))
    path = tmp_path / "t.csv"
    path.write_bytes(f"time,a,note\n{damaged}\n{rows}".encode("latin-1").replace(b"\\xff", b"\xff"))
    reader = open_log(path)
    series = reader.read({"table": ("a",)})["table"]
    assert len(series.receive_ns) == 39
    assert sum(loss.messages or 0 for loss in reader.losses) == 1


@pytest.mark.parametrize(
    ("damaged", "count"),
    [
        ("0;2;ok", 1),
        ("\\xff\\xfe~)d0|\\x1a", 1),
        ("0;2;ok\n1|3|ok", 2),
        ("0;2;ok\n0.5,3", 2),
        ("0;2,ok", 1),
        ("\n0;2;ok", 1),
    ],
)
def test_damaged_first_rows_without_a_number_are_lost_by_themselves_and_leave_the_names(
    tmp_path: Path, damaged: str, count: int
) -> None:
    rows = "".join(f"{n},{n * 2},ok\n" for n in range(2, 40))
    content = f"time,a,note\n{damaged}\n{rows}".encode().decode("unicode_escape").encode("latin-1")
    series, reader = read(tmp_path, content)
    assert series.columns["a"].tolist() == [n * 2 for n in range(2, 40)]
    assert lost(reader) == count


def test_a_damaged_first_row_of_two_columns_is_not_taken_for_their_names(tmp_path: Path) -> None:
    series, reader = read(tmp_path, b"time,a\n0;0\n" + b"".join(b"%d,%d\n" % (n, n * 2) for n in range(1, 40)))
    assert series.columns["a"].tolist() == [n * 2 for n in range(1, 40)]
    assert lost(reader) == 1


@pytest.mark.parametrize("separator", [",", " "])
@pytest.mark.parametrize("damaged", ["time;a;note\n0;2;7", "&}~(?\n|#^"])
def test_names_and_first_row_that_cannot_be_told_apart_are_a_loss(tmp_path: Path, damaged: str, separator: str) -> None:
    rows = "".join(separator.join((str(n / 20), "1.5", "7")) + "\n" for n in range(1, 40))
    path = tmp_path / "t.csv"
    path.write_text(f"{damaged}\n{rows}", encoding="utf-8")
    reader = open_log(path)
    reader.read({"table": ()})
    assert [(loss.messages, "names of columns and rows may be lost" in loss.what) for loss in reader.losses] == [
        (None, True)
    ]


def test_a_header_without_the_name_of_the_last_column_stands_above_a_damaged_row(tmp_path: Path) -> None:
    rows = "".join(f"{n},{n * 2},\n" for n in range(1, 40))
    series, reader = read(tmp_path, f"time,a\n0;2;\n{rows}".encode())
    assert series.columns["a"].tolist() == [n * 2 for n in range(1, 40)]
    assert lost(reader) == 1


def test_lines_before_the_first_row_that_hold_numbers_but_no_names_are_a_loss(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("time,a;0,1;1,2\n2,3;3,4\n" + "".join(f"{n},{n * 2}\n" for n in range(4, 40)), encoding="utf-8")
    reader = open_log(path)
    reader.read({"table": ()})
    assert any("lines" in loss.what or "lines before" in loss.what for loss in reader.losses)


def test_a_line_of_units_below_the_names_is_no_row(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("time,a,b\ns,m,1\n" + "".join(f"{n},{n * 2},0\n" for n in range(40)), encoding="utf-8")
    reader = open_log(path)
    assert len(reader.read({"table": ("a",)})["table"].receive_ns) == 40
    assert reader.losses == ()
