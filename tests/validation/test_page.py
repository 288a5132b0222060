"""The page: every figure where a reader looks for it, and targets that are not called reached before they are."""

from __future__ import annotations

from dataclasses import replace
from typing import Any
from xml.etree import ElementTree

import pytest

from ferryid.validation.detection_curves import curve
from ferryid.validation.name_scores import Share
from ferryid.validation.page import figures, page
from ferryid.validation.page_parts import how_well_known
from ferryid.validation.plant.effects import plant_effects
from ferryid.validation.records import TransferResult, TransferScore
from ferryid.validation.run import render_summary
from ferryid.validation.scores import score
from ferryid.validation.targets import both_of_pairs, middle_sizes, share_target, targets
from tests.validation.test_scores import WIND, curve_results, finding, result

pytestmark = pytest.mark.draws

RESULT: dict[str, Any] = {
    "seed": 5,
    "settings": {"runs": 4.0, "only": []},
    "counts": {"cases": 41, "diagnosed": 40, "refused": 1, "crashed": 0},
    "commitment": "0123" * 16,
    "sources": "89ab" * 4,
    "folder": "out/proof",
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
    ],
)
def test_a_target_is_reached_when_its_interval_says_so(
    share: Share, limits: dict[str, float], reached: bool | None
) -> None:
    assert share_target("so much", share, **limits).reached is reached


@pytest.mark.slow
def test_the_page_has_commitment_sizes_and_what_was_missed() -> None:
    absent = TransferScore(dict.fromkeys(("surge", "sway", "yaw")), why="pysindy is not installed")
    transfer = TransferResult(absent, {"sindy": absent})
    results = [*curve_results(), result([WIND], [finding("current")], "pair", "pair", transfer=transfer)]
    text = page(RESULT, score(results))
    assert RESULT["commitment"] in text
    assert "40 were diagnosed, 1 refused, each in 2 s" in text
    # Half of the sizes of the diagnosis: the oracle names from 1 m/s on, which the diagnosis does from 2 on.
    (row,) = (line for line in text.splitlines() if line.startswith("| wind | m/s |"))
    assert row.endswith("| **more than 1.5**: 4 none |")
    assert "sizes named 19 times in 20 at most 1.5 times the oracle's: 0 of 1 effects | **missed** |" in text
    assert "| nothing | 20 |  |  | 0/20 |" in text
    assert "| two effects | 1 | 0/1 | 0/1 | 1/1 |" in text
    assert "- `sindy` has no result: pysindy is not installed" in text
    # Clean logs come before effects, effects before pairs.
    assert text.index("### Nothing") < text.index("### One effect, from") < text.index("### Two effects")
    assert not any(line.startswith(("{%", "{{")) for line in text.splitlines())


def test_middle_sizes_and_pairs_are_counted_among_the_targets() -> None:
    least, most = plant_effects()["wind"].sizes
    inside, outside = least * (most / least) ** 0.45, least * (most / least) ** 0.65
    results = [
        result([WIND], [finding("wind")], level=2, size=inside),
        result([WIND], [finding("current")], level=2, size=inside),
        result([WIND], [finding("wind")], level=3, size=outside),
        result([WIND], [finding("wind")], "pair", "pair"),
    ]
    found = score(results)
    assert middle_sizes(found.detections) == Share(1, 2)
    assert both_of_pairs(found.cells) == Share(1, 1)
    (middle, pairs, *_) = targets(found)
    assert middle.what.startswith("effects of the middle of five sizes named: at least 95 %; 50.0 % (1/2)")
    assert pairs.what.startswith("pairs of effects, both named: at least 85 %; 100.0 % (1/1)")


def test_a_target_without_data_is_not_tested() -> None:
    clean = score([result([], [], "clean", "clean")])
    every = targets(clean)
    assert [one.tested for one in every] == [False, False, True, True, *[False] * 8]
    assert {one.reached for one in every if not one.tested} == {None}
    text = page(RESULT, clean)
    for what in ("95 % intervals that hold the truth", "onsets and offsets within 5 s", "sizes named 19 times in 20"):
        (row,) = (line for line in text.splitlines() if line.startswith(f"| {what}"))
        assert row.endswith("| not tested |")
    summary = render_summary({**RESULT, "targets": [one.to_json() for one in every]})
    assert summary.count("not tested") == 10
    # Nor are figures linked that there are not.
    assert "detection.svg" not in text
    assert "errors.svg" not in text


@pytest.mark.parametrize(
    ("share", "outcome"),
    [
        (Share(0, 400), "yes"),
        (Share(0, 20), "reached, though the interval allows either"),
        (Share(1, 20), "**missed**, though the interval allows either"),
        (Share(20, 20), "**missed**"),
        (Share(0, 0), "not tested"),
    ],
)
def test_the_outcome_of_a_target_is_open_where_its_interval_allows_either(share: Share, outcome: str) -> None:
    assert share_target("so much", share, at_most=0.01).outcome == outcome


@pytest.mark.slow
def test_the_figures_are_drawings_of_what_there_is() -> None:
    drawn = figures(score(curve_results()))
    assert set(drawn) == {"confusion.svg", "detection.svg", "errors.svg"}
    for text in drawn.values():
        assert ElementTree.fromstring(text).tag.endswith("svg")
    assert set(figures(score([result([], [], "clean", "clean")]))) == {"confusion.svg"}


def test_the_page_says_how_well_sizes_are_known() -> None:
    # Many runs on either side of one, few runs, and two whose sizes are not among those tried.
    many = curve([0.8] * 60 + [1.2] * 60, [False] * 60 + [True] * 60)
    few = curve([0.25, 0.5, 2.0, 4.0], [False, False, True, True])
    beyond, below = curve([1.0, 2.0], [False, False]), curve([1.0, 2.0], [True, True])
    assert many.high / many.low < 4.0 < few.high / few.low
    said = how_well_known([many, few, beyond, below])
    assert said.startswith("Of 4 such sizes 2 are among the sizes tried and known to a factor of ")
    assert said.endswith(", 1 of them to a factor of two or better.")
    assert how_well_known([beyond, below]) == ""


def test_campaigns_at_sea_have_a_section_of_their_own() -> None:
    from tests.validation.test_sea import DRAG, found
    from tests.validation.test_sea import WIND as OF_THE_DAY
    from tests.validation.test_sea import result as campaign

    every = [
        campaign((DRAG, OF_THE_DAY), [found("current", 0, north=0.1, east=0.0)], {"current": 99.0}, 0.1),
        campaign((OF_THE_DAY,), [], {}, 0.0),
    ]
    text = page(RESULT, score(every))
    assert "# Validation at sea: " in text
    assert "Written by `ferryid prove --seed 5 --runs 4`: 2 campaigns of 10 logs." in text
    both = page(RESULT, score([*every, result([], [], "clean", "clean")]))
    assert "## At sea" in both
    assert ": 1 logs, 4 of each size of each effect, and 2 campaigns of 10 logs." in both
    (row,) = (line for line in text.splitlines() if line.startswith("| current | 0.1 m/s |"))
    assert row.endswith("| yes | 0.0 | no |  |")
    assert "| at sea, campaigns with a wrong name: at most 1 %; 0.0 % (0/2)" in text
    # Winds of the day are most of what is named: half as strong as it was is an error of a half.
    half = found("wind", 3, north=1.0, east=2.0)
    named = replace(every[0].diagnosis, findings=(*every[0].diagnosis.findings, half))
    errors = page(RESULT, score([replace(every[0], diagnosis=named)]))
    assert "(50.0 % of 1 wind, 0.0 % of 1 other)" in " ".join(errors.split())
    # Nothing is said of single logs where there are none.
    assert "| clean logs with a wrong name" not in text
    assert "Allowed is `hull_parameters`" not in text
    # No trial: no table of names.
    assert "## Names by cell" not in text
    assert "confusion.svg" not in text
    assert "## At sea" not in page(RESULT, score([result([], [], "clean", "clean")]))
