"""How alike effects look, on the page, as a figure, as text and as JSON."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from ferryid.diagnose.judging.likeness import Likeness, Pair, Seen
from ferryid.report.diagnosis_page import as_text, render
from ferryid.report.diagnosis_report import report
from ferryid.report.likeness import line, section
from tests.report.test_diagnosis import conforms, diagnosis

SEEN = (
    Seen("wind", None, "Steady wind", 120.4, 0.3),
    Seen("current", None, "Current", 56.0, 0.2),
    Seen("thruster_gain", "bow", "Thruster force (bow)", 3.25, 0.9),
)
MATRIX = np.array([[1.0, 0.97, 0.1], [0.97, 1.0, 0.45], [0.1, 0.45, 1.0]])
PAIR = Pair(0, 1, 0.97, 13.6, "a slow turn on the spot", "an anemometer")
LIKE = Likeness(SEEN, MATRIX, (PAIR,), (Seen("payload", None, "Payload", 0.4, 0.1),))


def test_the_page_has_figure_and_pairs_with_what_separates_them() -> None:
    page, drawings = render((replace(diagnosis("explained"), likeness=LIKE),), "trial")
    assert "How alike the effects look in this log" in page
    for shown in ("steady wind and current", "0.970", "14", "a slow turn on the spot", "an anemometer"):
        assert f">{shown}<" in page
    assert "noise would hide an effect of usual size: payload." in page
    drawn = drawings["likeness"]
    assert "1  Steady wind, 120" in drawn
    assert "3  Thruster force (bow), 3.2" in drawn
    # Numbers stand in the cells that are worth one: two of each of two pairs.
    assert drawn.count(">.97<") == drawn.count(">.45<") == 2
    assert ">.10<" not in drawn


def test_without_anything_to_compare_there_is_no_section() -> None:
    alone = Likeness(SEEN[:1], np.eye(1), ())
    for nothing in (None, alone):
        assert section(nothing, "likeness", True) == {}
        assert line(nothing) == ""
        assert "How alike" not in render((replace(diagnosis("matched"), likeness=nothing),), "trial")[0]


def test_where_everything_is_separated_it_is_said() -> None:
    apart = section(replace(LIKE, pairs=()), "likeness", False)
    assert apart["says"] == "This log separates every two of the 3 effects that it shows at their usual size."
    assert apart["figures"] == []


def test_text_and_json_have_the_pairs(tmp_path: Path) -> None:
    one = replace(diagnosis("explained"), likeness=LIKE)
    assert "Alike in this log (1: cannot be separated): steady wind and current (0.970)." in as_text((one,))
    plain = report((one,), tmp_path).json
    conforms(plain)
    assert plain["likeness"]["pairs"][0]["second"] == {"effect": "current", "instance": None}
    assert plain["likeness"]["effects"][0]["visibility"] == 120.4
    assert [one["effect"] for one in plain["likeness"]["faint"]] == ["payload"]
