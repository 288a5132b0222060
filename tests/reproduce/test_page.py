"""Page, JSON and figures of studies whose numbers are made up."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace
from pkgutil import iter_modules

import numpy as np
import pytest

from ferryid.cli.cmd_reproduce import STUDIES
from ferryid.report.drawing import Drawing, Line, Panel
from ferryid.report.thesis_figures import LONGEST, draw
from ferryid.reproduce import studies
from ferryid.reproduce.page import page
from ferryid.reproduce.study import Row, Study, Table, change, changes, number, plain, spread

X = np.linspace(0.0, 1.0, 5)
DRAWING = Drawing("one", "A caption.", "x", (Panel("y", (Line("ours", X, X**2),)),))
STUDY = Study(
    "made-up",
    "A study",
    "What for?",
    ("Thus.",),
    (
        Row("error", "%", -75.0, (-10.0, -30.0, -20.0)),
        Row("window", "s", "short", (1.0,)),
        Row("new", "", None, (2.5,)),
        Row("up", "%", 5.0, (4.0,)),
    ),
    (Table("A table.", ("a", "b"), (("1", "2"),)),),
    ("It follows.",),
    (DRAWING,),
)


def test_theirs_stands_beside_the_median_and_range_of_ours() -> None:
    text = page([STUDY], (1, 2, 3), "thesis")
    assert "| error | −75 % | −20 % (−30 to −10) |" in text
    assert "| window | short | 1 s |" in text
    assert "| new | – | 2.50 |" in text
    assert "| up | +5 % | +4 % |" in text
    assert "- It follows." in text
    assert "![A caption.](thesis/one.svg)" in text
    assert "median of 3 runs" in text
    assert "[at the end](#chosen)" in text
    assert '<a id="chosen"></a>' in text
    assert "| a | b |\n|---|---|\n| 1 | 2 |" in text


def test_the_page_begins_with_what_became_of_their_numbers() -> None:
    text = page([STUDY], (1, 2, 3), "thesis")
    # -75 lies outside -30 to -10 on the same side; 5 lies outside 4 to 4 likewise; the others give no number.
    assert "| [A study](#made-up): 2 | 0 | 2 | 0 |" in text
    met = replace(
        STUDY, rows=(Row("a", "%", -20.0, (-30.0, -10.0)), Row("b", "%", -20.0, (10.0,)), Row("c", "s", 1.0, (2.0,)))
    )
    assert "| [A study](#made-up): 3 | 1 | 0 | 2 |" in page([met], (1,), "thesis")
    assert "median of 1 run with" in page([met], (1,), "thesis")


def test_the_command_names_every_study() -> None:
    assert set(STUDIES) == {study.name for study in iter_modules(studies.__path__)}


def test_json_holds_every_value() -> None:
    row = plain(STUDY)["rows"][0]
    assert row["theirs"] == -75.0
    assert row["ours"] == {"median": -20.0, "low": -30.0, "high": -10.0, "values": [-10.0, -30.0, -20.0]}
    assert plain(STUDY)["figures"] == [{"file": "one.svg", "caption": "A caption."}]


def test_changes_are_relative_to_the_old_value() -> None:
    assert change(1.0, 4.0) == -75.0
    assert changes([3.0, 1.0], [2.0, 2.0]) == (50.0, -50.0)


@pytest.mark.parametrize(
    ("value", "text"), [(1234.5, "1234"), (12.345, "12.3"), (1.2345, "1.23"), (0.12345, "0.123"), (-0.5, "−0.500")]
)
def test_three_digits_count(value: float, text: str) -> None:
    assert number(value) == text


def test_nothing_known_is_a_dash() -> None:
    assert number(float("nan")) == "–"
    assert spread([3.0], "m") == "3 m"


@pytest.mark.slow
def test_a_drawing_is_well_formed_and_the_same_every_time() -> None:
    drawing = Drawing(
        "two",
        "",
        "t [s]",
        (
            Panel("a", (Line("one", X, X, X - 0.1, X + 0.1, marked=True), Line("two", X, -X))),
            Panel("b", (Line("two", X, X + 1.0),), "titled", logarithmic=True),
            Panel("c", (Line("one", X, X),)),
        ),
        columns=2,
    )
    text = draw(drawing)
    assert ET.fromstring(text).tag.endswith("svg")
    assert text == draw(drawing)
    assert "titled" in text
    assert text.count(">two<") == 1  # one legend for all panels


def test_a_long_line_keeps_its_peaks_but_not_its_size() -> None:
    x = np.arange(20.0 * LONGEST)
    y = 0.1 * np.random.default_rng(1).standard_normal(len(x))
    y[777] = 5.0
    short = draw(Drawing("s", "", "x", (Panel("y", (Line("l", x[:1000], y[:1000]),)),)))
    long = draw(Drawing("l", "", "x", (Panel("y", (Line("l", x, y),)),)))
    assert len(long) < 3 * len(short)
    assert ">5<" in long


def test_ticks_of_counts_are_whole_and_a_narrow_logarithmic_axis_has_several() -> None:
    x = np.arange(1.0, 19.0)
    narrow = Line("l", x, np.linspace(0.72, 1.3, 18), marked=True)
    text = draw(Drawing("t", "", "x", (Panel("y", (narrow,), logarithmic=True),)))
    labels = [element.text for element in ET.fromstring(text).iter() if element.tag.endswith("}text") and element.text]
    assert not {"2.5", "7.5", "17.5"} & set(labels)
    assert sum("." in label for label in labels) >= 3  # 0.75, 0.9, 1.05 ...
