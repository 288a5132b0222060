"""The likeness of effects on a page: the figure, sentences that agree with it, nothing where nothing can be compared."""

from __future__ import annotations

import numpy as np

from ferryid.diagnose import Likeness, Pair
from ferryid.diagnose.judging.likeness import EffectVisibility
from ferryid.report import likeness

EFFECTS = (
    EffectVisibility("wind", None, "Steady wind", 120.0, 0.1),
    EffectVisibility("current", None, "Current", 40.0, 0.2),
    EffectVisibility("payload", None, "Payload", 0.7, 0.9),
)
PAIRS = (
    Pair(("wind", None), ("current", None), 0.998, 1.4, alike=True),
    Pair(("wind", None), ("payload", None), 0.4, 3.8, alike=False),
    Pair(("current", None), ("payload", None), 0.1, 3.5, alike=False),
)
MATRIX = np.array([[1.0, 0.998, 0.4], [0.998, 1.0, 0.1], [0.4, 0.1, 1.0]])
FOUND = Likeness(EFFECTS, MATRIX, PAIRS)


def test_the_map_names_every_effect_with_how_visible_it_is() -> None:
    drawing = likeness.heat_map(FOUND)
    for text in ("Steady wind · 120 σ  1", "Current · 40 σ  2", "Payload · 0.7 σ  3", "likeness"):
        assert text in drawing
    # Each of a pair once, both ways; what is small stays blank, and no log shows a 1.
    assert drawing.count(">.99<") == 2
    assert drawing.count(">.40<") == 2
    assert ">.10<" not in drawing
    assert ">1.00<" not in drawing


def test_sentences_and_rows_agree_with_the_figures() -> None:
    section = likeness.section(FOUND, "likeness", "this log")
    first, unresolved, hidden = section["says"]
    assert (
        first
        == "Before anything is fitted: of 2 effects that this log would show at their usual size, one pair looks much alike."
    )
    assert unresolved == "1 pair cannot be distinguished at the usual size."
    assert hidden == "Too small at their usual size to be named here: payload."
    (row,) = section["rows"]
    assert (row["names"], row["likeness"], row["from"]) == ("steady wind and current", "above 0.99", "1.4 usual sizes")
    assert row["record"].startswith("a slow turn")
    assert "anemometer" in row["measure"]
    assert likeness.notes(FOUND, "this log") == [
        "In this log these look alike (1: cannot be distinguished): steady wind and current (above 0.99)."
    ]


def test_nothing_is_shown_where_nothing_can_be_compared() -> None:
    alone = Likeness(EFFECTS[:1], np.eye(1), ())
    assert likeness.section(None, "x", "this log") == likeness.section(alone, "x", "this log") == {}
    assert likeness.notes(None, "this log") == []
    assert likeness.section(FOUND, "x", "this log", drawn=False)["figures"] == []
