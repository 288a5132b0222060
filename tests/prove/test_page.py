"""The page of a proof: every figure where a reader looks for it, and targets that are not called reached before they are."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

import pytest

from ferryid.prove.names import Share
from ferryid.prove.page import _target, figures, page, targets
from ferryid.prove.score import score
from tests.prove.test_score import WIND, curve_lines, finding, line

RESULT: dict[str, Any] = {
    "seed": 5,
    "settings": {"runs": 4.0, "only": []},
    "counts": {"cases": 41, "diagnosed": 40, "refused": 1, "crashed": 0},
    "commitment": "0123" * 16,
    "sources": "89ab" * 4,
    "guard": "audit",
}


@pytest.mark.parametrize(
    ("share", "limits", "reached"),
    [
        (Share(0, 400), {"at_most": 0.01}, True),
        (Share(0, 20), {"at_most": 0.01}, None),
        (Share(1, 20), {"at_most": 0.01}, False),
        (Share(950, 1000), {"at_least": 0.93, "at_most": 0.97}, True),
        (Share(19, 20), {"at_least": 0.93, "at_most": 0.97}, None),
        (Share(990, 1000), {"at_least": 0.93, "at_most": 0.97}, False),
        (Share(0, 0), {"at_least": 0.9}, None),
    ],
)
def test_a_target_is_reached_when_its_interval_says_so(
    share: Share, limits: dict[str, float], reached: bool | None
) -> None:
    assert _target("so much", share, **limits)["reached"] is reached


def test_the_page_tells_seal_guard_sizes_and_what_was_missed() -> None:
    absent = {"sindy": {"mse": dict.fromkeys(("surge", "sway", "yaw")), "why": "pysindy is not installed"}}
    lines = [*curve_lines(), line([WIND], [finding("current")], "pair", "pair", second=absent)]
    scores = score(lines)
    told = page({**RESULT, "targets": targets(scores)}, scores)
    assert RESULT["commitment"] in told
    assert "40 were diagnosed, 1 refused" in told
    assert "this kernel has no Landlock" in told
    # Half of the sizes of the diagnosis: the oracle names from 1 m/s on, which the diagnosis does from 2 on.
    (row,) = (text for text in told.splitlines() if text.startswith("| wind | m/s |"))
    assert row.endswith("| **more than 1.5**: 4 none |")
    assert "sizes named 19 times in 20 at most 1.5 times the oracle's: 0 of 1 effects | **missed** |" in told
    assert "| nothing | 20 |  |  | 0/20 |" in told
    assert "| two effects | 1 | 0/1 | 0/1 | 1/1 |" in told
    assert "- `sindy` could not be asked: pysindy is not installed" in told
    # Clean logs come before effects, effects before pairs.
    assert told.index("### Nothing") < told.index("### One effect, from") < told.index("### Two effects")


@pytest.mark.parametrize(
    ("share", "told"),
    [
        (Share(0, 400), "yes"),
        (Share(0, 20), "reached, though the interval allows either"),
        (Share(1, 20), "**missed**, though the interval allows either"),
        (Share(20, 20), "**missed**"),
    ],
)
def test_a_target_that_an_interval_leaves_open_is_told_as_such(share: Share, told: str) -> None:
    scores = score(curve_lines())
    text = page({**RESULT, "targets": [_target("so much", share, at_most=0.01)]}, scores)
    (row,) = (line for line in text.splitlines() if line.startswith("| so much"))
    assert row.endswith(f" | {told} |")


def test_the_figures_are_drawings_of_what_there_is() -> None:
    scores = score(curve_lines())
    drawn = figures(scores)
    assert set(drawn) == {"confusion.svg", "detection.svg", "errors.svg"}
    for text in drawn.values():
        assert ElementTree.fromstring(text).tag.endswith("svg")
    nothing = score([line([], [], "clean", "clean")])
    assert set(figures(nothing)) == {"confusion.svg"}
    # Of no sizes none is near the oracle's.
    assert targets(nothing)[-1]["reached"] is None
