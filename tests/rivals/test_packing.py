"""Results kept as lines: what was done is not done again, and what was cut off or is of other sources does not count."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.evidence import Lines
from tests.rivals.__main__ import run
from tests.rivals.causes import damping, free_runs, intervals
from tests.rivals.measures import OURS
from tests.rivals.packing import packed, packed_scores, unpacked, unpacked_scores
from tests.rivals.recorded import CASES, Recorded
from tests.rivals.scores import Score
from tests.rivals.simulated import Found


def test_a_run_that_was_ended_goes_on_where_it_stood(tmp_path: Path) -> None:
    done: list[str] = []

    def work(name: str) -> str:
        done.append(name)
        return name.upper()

    units = [(name, work, (name,)) for name in ("a", "b", "c")]
    lines = Lines(tmp_path / "lines.jsonl", "now")
    run(units[:2], lines, 1)
    text = lines.path.read_text()
    lines.path.write_text(text[: text.rindex('"result"')])
    run(units, lines, 1)
    assert done == ["a", "b", "b", "c"]
    assert lines.known() == {"a": "A", "b": "B", "c": "C"}
    assert Lines(lines.path, "later").known() == {}


def test_findings_and_scores_come_back(tmp_path: Path) -> None:
    runs = np.full((2, 3, 4), 0.25)
    runs[0, 1] = np.inf
    runs[1, 2] = np.nan
    found = Found(np.array([0.1, -0.2, 0.3]), 0.04, np.array([1.0, 0.0, np.nan]), runs, 1.5, 0.03)
    score = Score(np.zeros((0, 3)), np.ones((2, 3)), np.ones(2), runs, 2.0, ("mass matrix not positive",))
    lines = Lines(tmp_path / "lines.jsonl", "now")
    lines.add("trial", packed({"weak": found, "thesis": "no model"}))
    lines.add("case", packed_scores({"weak": score}))
    known = lines.known()
    back = unpacked(known["trial"])
    assert back["thesis"] == "no model"
    one = back["weak"]
    assert isinstance(one, Found)
    np.testing.assert_array_equal(one.runs, runs)
    np.testing.assert_array_equal(one.covered, found.covered)
    assert (one.damping, one.expected) == (0.04, 0.03)
    again = unpacked_scores(known["case"])["weak"]
    assert again.windows.shape == (0, 3)
    assert again.failed == score.failed
    assert again.diverged == 1


def test_the_page_says_whose_intervals_hold_too_much_and_what_chance_leaves_open() -> None:
    def trial(covered: float) -> dict[str, Found | str]:
        inertia = np.array([0.001, -0.01, 0.02])
        return {OURS: Found(inertia, 0.04, np.array([1.0, 1.0, covered]), np.zeros((1, 3, 4)), 1.0, 0.03)}

    (line,) = intervals({"calm": [trial(1.0)] * 29 + [trial(0.0)]})
    assert "98.9 % (89/90) [94.0, 100.0]. By inertia: m11 100.0 % (median error 0.1 %)" in line
    assert "m33 96.7 % (median error 2.0 %)" in line
    assert intervals({"calm": [trial(1.0)] * 17 + [trial(0.0)] * 3}) == []


def test_the_page_says_where_a_fit_to_the_judged_recordings_is_no_better_either() -> None:
    def score(position_m: float) -> Score:
        runs = np.full((40, 3, 4), position_m)
        return Score(np.ones((2, 3)), np.ones((2, 3)), np.ones(2), runs, 2.0)

    def case(ours: float, inside: float) -> Recorded:
        return Recorded(CASES[0], {OURS: score(ours), "output error": score(1.0)}, score(inside), 1, 60.0, ())

    (line,) = free_runs([case(0.9, 0.8), case(0.95, 0.5)])
    assert "aim a quarter less in the median: 0.93" in line or "aim a quarter less in the median: 0.92" in line
    assert "has 0.50, 0.80 of that error in the 2 sets: on 1 of them not even it is a quarter better" in line
    assert free_runs([case(0.5, 0.4), case(0.7, 0.6)]) == []


def test_the_page_says_where_the_damping_misses_and_what_is_to_be_expected() -> None:
    def trial(damping: float, expected: float) -> dict[str, Found | str]:
        return {OURS: Found(np.zeros(3), damping, np.ones(3), np.zeros((1, 3, 4)), 1.0, expected)}

    found = {"met": [trial(0.04, 0.03)], "limit": [trial(0.07, 0.06)], "worse": [trial(0.09, 0.02)]}
    text = "\n".join(damping(found))
    assert "met" not in text
    assert "Damping force, limit: 7.0 %, expected by the covariance of the fit 6.0 %: the aim is below that." in text
    assert (
        "Damping force, worse: 9.0 %, expected by the covariance of the fit 2.0 %: more than is to be expected." in text
    )
    assert damping({"met": found["met"]}) == []
