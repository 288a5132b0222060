"""The reach study itself: draws, scores, and a run of it from end to end."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.reach.__main__ import main
from tests.reach.cells import cells, draws
from tests.reach.places import PLACES, merged
from tests.reach.record import done_before, key_of
from tests.reach.scores import NONE, OTHER, Share, confusion, first_name, score


def line(
    truths: list[dict[str, Any]], findings: list[dict[str, Any]], cell: str = "wind", **draw: Any
) -> dict[str, Any]:
    return {
        "draw": {"cell": cell, "place": "twelve-corner", "truths": truths, "allowed": [], **draw},
        "findings": findings,
        "verdict": "explained",
        "seconds": 1.0,
    }


def truth(
    effect: str, values: dict[str, float], instance: str | None = None, onset_s: float | None = None
) -> dict[str, Any]:
    return {"effect": effect, "instance": instance, "values": values, "onset_s": onset_s}


def finding(
    effect: str,
    values: dict[str, float],
    half: float,
    instance: str | None = None,
    p: float = 1.0,
    onset: float | None = None,
) -> dict[str, Any]:
    parameters = {name: {"value": v, "low": v - half, "high": v + half, "unit": ""} for name, v in values.items()}
    return {"effect": effect, "instance": instance, "probability": p, "parameters": parameters, "onset": onset}


def test_draws_are_the_same_for_the_same_seed_and_what_they_say_can_be_simulated() -> None:
    for cell in cells():
        one, again, other = (draws(cell, 1, seed) for seed in (7, 7, 8))
        assert one == again
        assert one != other or not one
        for draw in one:
            if not draw.series:
                scenario = PLACES[draw.place].scenario(draw.tables)
                assert all(draw.tables["true_hull"][name] == factor for name, factor in scenario.true_hull.items())
    every = [draw for cell in cells() for draw in draws(cell, 1, 0)]
    assert len({key_of(draw, "v") for draw in every}) == len(every)


def test_tables_are_merged_as_two_concealed_things_would_be() -> None:
    one = {
        "true_hull": {"m11": 0.9},
        "environment": {"wind": {"north_mps": 1.0}},
        "thrusters": {"faults": [{"factor": 0.5}]},
    }
    other = {
        "true_hull": {"m11": 2.0, "m22": 1.5},
        "environment": {"waves": {"gamma": 2.0}},
        "thrusters": {"faults": [{"factor": 0.7}]},
    }
    assert merged(one, other) == {
        "true_hull": {"m11": 1.8, "m22": 1.5},
        "environment": {"wind": {"north_mps": 1.0}, "waves": {"gamma": 2.0}},
        "thrusters": {"faults": [{"factor": 0.5}, {"factor": 0.7}]},
    }


def test_scores_of_runs_worked_by_hand() -> None:
    wind = truth("wind", {"north": 3.0, "east": 4.0})
    weak = truth("thruster_gain", {"factor": 0.8}, "thruster1", 300.0)
    lines = [
        # A vector of 5 that is off by 0.5, with one component outside of its interval.
        line([wind], [finding("wind", {"north": 3.3, "east": 4.4}, 0.35)]),
        # Named, but not first, and doubtful: no name.
        line(
            [wind],
            [
                finding("current", {"north": 0.1, "east": 0.1}, 0.1),
                finding("wind", {"north": 3.0, "east": 4.0}, 0.1, p=0.4),
            ],
        ),
        # Of the wrong thruster.
        line([weak], [finding("thruster_gain", {"factor": 0.8}, 0.01, "thruster2")], cell="thruster_gain later"),
        # A factor of 0.81 for one of 0.8 is 5 % of the 0.2 that are lost; 4 s late.
        line(
            [weak],
            [finding("thruster_gain", {"factor": 0.81}, 0.02, "thruster1", onset=304.0)],
            cell="thruster_gain later",
        ),
        line([], [], cell="clean"),
        line([], [finding("wind", {"north": 1.0, "east": 0.0}, 0.1, p=0.3)], cell="clean"),
    ]
    one = score(lines)
    assert (one.first, one.every) == (Share(2, 4), Share(2, 4))
    assert (one.false, one.mentioned.count) == (Share(2, 6), 5)
    assert one.errors == pytest.approx([0.1, 0.05])
    assert one.half_widths == pytest.approx([0.35 * 2**0.5 / 5.0, 0.1])
    assert one.covered == Share(2, 3)
    assert one.reaches == pytest.approx([0.3 / 0.35, 0.4 / 0.35, 0.5])
    assert (one.onsets_s, one.onset_held) == ([4.0], Share(0, 1))
    assert [first_name(each) for each in lines] == ["wind", "current", OTHER, "thruster_gain", NONE, NONE]
    rows, columns, counts = confusion(lines)
    assert rows == ["wind", "thruster_gain later", "clean"]
    assert counts[rows.index("clean")][columns.index(NONE)] == 2
    assert counts[rows.index("thruster_gain later")][columns.index(OTHER)] == 1


def test_intervals_are_those_of_clopper_and_pearson() -> None:
    # Clopper and Pearson's own closed forms at the ends: 1 - 0.025^(1/n) and 0.025^(1/n).
    assert Share(0, 100).interval == pytest.approx((0.0, 1.0 - 0.025**0.01))
    assert Share(20, 20).interval == pytest.approx((0.025**0.05, 1.0))


def test_the_study_runs_and_goes_on_where_it_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    only = "wind @ twelve-corner,clean @ four-corner"
    command = [
        "reach",
        "--runs",
        "1",
        "--only",
        only,
        "--processes",
        "1",
        "--out",
        str(tmp_path),
        "--cache",
        str(tmp_path),
    ]
    monkeypatch.setattr("sys.argv", command)
    assert main() == 0
    cache = tmp_path / "runs.jsonl"
    first = cache.read_text("utf-8")
    told = json.loads((tmp_path / "diagnosis.json").read_text("utf-8"))
    assert {row["cell"]: row["runs"] for row in told["cells"]} == {"wind": 1, "clean": 2}
    assert next(row for row in told["cells"] if row["cell"] == "wind")["first"]["count"] == 1
    page = (tmp_path / "diagnosis.md").read_text("utf-8")
    assert "| wind | 100 % (1/1) |" in page
    assert (tmp_path / "diagnosis" / "confusion.svg").read_text("utf-8").startswith("<?xml")
    # A line that broke off is run again, and nothing else is.
    lines = first.splitlines(keepends=True)
    broken = "".join(lines[:-1]) + lines[-1][:20]
    cache.write_text(broken, encoding="utf-8")
    assert main() == 0
    assert set(done_before(cache)) == {json.loads(text)["key"] for text in lines}
    again = cache.read_text("utf-8")
    assert again.startswith(broken + "\n")
    assert len(again.splitlines()) == len(lines) + 1
