"""Names in a log that hold control characters: escaped for whoever reads or prints them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.ingest import open_log
from ferryid.ingest.log import Loss

NASTY = "a\x1b[2J\x07b"
LONG = "x" * 64
"""Text is recognised by its first bytes, which must be printable."""
SHOWN = r"a\x1b[2J\x07b"


@pytest.fixture
def table(tmp_path: Path) -> Path:
    path = tmp_path / "t.csv"
    path.write_text(f"time,{LONG},{NASTY},plain\n0,9,1,2\n1,9,3,4\n", encoding="utf-8")
    return path


def test_a_column_with_control_characters_is_listed_and_read_by_its_escaped_name(table: Path) -> None:
    reader = open_log(table)
    (topic,) = reader.topics
    assert SHOWN in topic.fields
    assert "escaped" in topic.note
    series = reader.read({"table": (SHOWN, "plain")})["table"]
    np.testing.assert_array_equal(series.columns[SHOWN], [1, 3])
    np.testing.assert_array_equal(series.columns["plain"], [2, 4])


def test_two_names_that_look_alike_when_escaped_stay_apart(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text(f"time,{LONG},a\x1b,a\\x1b\n0,9,1,2\n1,9,3,4\n", encoding="utf-8")
    reader = open_log(path)
    names = [name for name in reader.topics[0].fields if name.startswith("a")]
    series = reader.read({"table": names})["table"]
    assert [series.columns[name].tolist() for name in names] == [[1, 3], [2, 4]]


def test_printable_names_of_any_language_stay_as_they_are(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("time,Geschwindigkeit\u00a0[m/s],速度\n0,1,2\n1,3,4\n", encoding="utf-8")
    (topic,) = open_log(path).topics
    assert {"Geschwindigkeit\u00a0[m/s]", "速度"} <= set(topic.fields)
    assert "escaped" not in topic.note


def test_a_loss_quotes_nothing_raw() -> None:
    loss = Loss("f\x1b.bag", "chunk \x07 is\ndamaged", "/t\u202e")
    assert loss == Loss(r"f\x1b.bag", r"chunk \x07 is\ndamaged", r"/t\u202e")


def test_an_empty_path_is_refused_instead_of_reading_the_working_folder() -> None:
    with pytest.raises(FerryIdError, match="the path is empty"):
        open_log("")
