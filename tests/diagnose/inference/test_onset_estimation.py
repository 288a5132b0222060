"""When an effect acts: the scan finds the span of a push that can be worked out, and searches find what ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ferryid.diagnose.inference import onset_estimation
from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, fit, starting_point
from ferryid.diagnose.inference.folds import block_s
from ferryid.diagnose.inference.noise_model import stride_s
from ferryid.diagnose.inference.onset_estimation import (
    is_brief,
    lasts_s,
    linearise,
    part_s,
    promising_spans,
    refine_span,
    refit_spans,
)
from ferryid.diagnose.inference.search import ScoredCandidate, _in_the_same_span, list_candidates, search
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.inference.weak_form import windows
from ferryid.diagnose.judging.rivals import compare_rivals
from tests.diagnose.inference.test_estimation import PUSH, problem
from tests.diagnose.trials import sailed, trial_on

TWELVE = """
schema = "ferryid.scenario/1"
vessel = "milliampere"
path = { kind = "twelve-corner", dwell_s = 40 }
controller = { delta = 0.7, sigma = 0.7 }
sensors = { imu_rate_hz = 0.0, camera_rate_hz = 0.0 }
"""


def pushed(force: float, first_s: float, last_s: float) -> EstimationProblem:
    """The trial of a vessel at rest that a force was said to push, but for some time only."""
    case = problem(force)
    t = case.plain.measurements.t
    missing = (t < first_s) | (t >= last_s)
    away = case.plain.external + np.array([force, 0.0, 0.0]) * missing[:, None]
    # What is not there pushes the other way in the force model: measured and modelled differ within the span only.
    return replace(case, plain=replace(case.plain, external=away))


@pytest.mark.slow
@pytest.mark.parametrize(("first_s", "last_s"), [(0.0, inf), (100.0, inf), (0.0, 180.0), (90.0, 170.0)])
def test_the_span_of_a_push_is_the_most_promising_one(first_s: float, last_s: float) -> None:
    case = pushed(240.0, first_s, last_s)
    bare = fit(case, ())
    begin = starting_point(case, bare)
    whole = fit(case, [PUSH]).evidence
    spans = promising_spans(case, linearise(case, bare, begin), PUSH)
    gains = [fit(case, [one]).evidence - whole for one in spans]
    if (first_s, last_s) == (0.0, inf):
        assert max(gains, default=-1.0) < 0.0
        return
    best, wide = spans[0], part_s(case, PUSH)
    assert gains[0] == max(gains)
    assert gains[0] > 0.0
    # Ends are scanned step by step: within two of them, far less than a part of the log.
    assert best.onset_s == pytest.approx(first_s, abs=2.0 * stride_s(case.steps))
    assert best.offset_s == pytest.approx(last_s, abs=2.0 * stride_s(case.steps))
    assert wide > 5.0 * stride_s(case.steps)
    sharp = refine_span(case, fit(case, [best]), 0, begin, 0.5 * wide).candidates[0]
    # It is some ten times as strong as what else pushes, which forgets itself in 8 s.
    assert sharp.onset_s == pytest.approx(first_s, abs=2.0)
    assert sharp.offset_s == pytest.approx(last_s, abs=2.0)


@pytest.mark.slow
def test_what_ended_is_found_beside_another_that_made_up_for_it_from_then_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ferryid.diagnose.inference.onset_estimation.promising_spans", lambda *_: [])
    case = pushed(240.0, 90.0, 170.0)
    other = replace(PUSH, effect=replace(PUSH.effect, id="other", onset=True), onset_s=170.0)
    lasting = replace(PUSH, effect=replace(PUSH.effect, onset=True), onset_s=90.0)
    both = fit(case, [lasting, other])
    assert both.values[1] == pytest.approx(-both.values[0], rel=0.2)
    ended, idle = refit_spans(case, both).candidates
    assert (ended.onset_s, ended.offset_s) == (pytest.approx(90.0, abs=2.0), pytest.approx(170.0, abs=2.0))
    assert idle.offset_s == inf


@pytest.mark.slow
def test_a_wide_dead_band_is_found_from_a_start_of_its_own(tmp_path: Path) -> None:
    band = '[[effects]]\neffect = "dead_band"\nthruster = "thruster1"\nahead = 450\nastern = 450\n'
    case = trial_on(sailed(tmp_path, "band", TWELVE + band, 5))
    known = [one for one in list_candidates(case.plain.measurements)[0] if one.effect.id == "dead_band"]
    found = search(case, lambda stage: None, known=known).fit
    assert [one.key for one in found.candidates] == [("dead_band", "thruster1")]
    assert found.values[0][0] == pytest.approx(450.0, rel=0.1)
    # Starts lie within what is possible, and an effect without an end of a range has one.
    assert known[0].start_shares == (3.0, 2.0, 1.0, 0.75, 0.5, 0.25)
    assert PUSH.start_shares == (1.0,)


@pytest.mark.slow
def test_what_lasts_less_than_two_blocks_is_brief() -> None:
    case = problem(0.0)
    two_s = 2.0 * block_s(case.windows)
    assert two_s == pytest.approx(80.0)
    assert is_brief(case, replace(PUSH, onset_s=100.0, offset_s=97.0 + two_s))
    assert not is_brief(case, replace(PUSH, onset_s=100.0, offset_s=103.0 + two_s))
    assert not is_brief(case, PUSH)
    # It has no rivals: no name could be judged there.
    made = fit(case, [replace(PUSH, onset_s=100.0, offset_s=130.0)])
    assert compare_rivals(case, made, 0, [PUSH]).rivals == ()


@pytest.mark.slow
def test_where_nothing_pushes_no_span_is_promising() -> None:
    case = problem(0.0)
    bare = fit(case, ())
    assert promising_spans(case, linearise(case, bare, starting_point(case, bare)), PUSH) == []


@pytest.mark.slow
def test_every_other_effect_is_tried_in_the_span_that_one_has_found(tmp_path: Path) -> None:
    pushing = '[[effects]]\neffect = "external_push"\nnorth = 0\neast = 400\nmoment = 0\nfrom_s = 200\nuntil_s = 320\n'
    case = trial_on(sailed(tmp_path, "pushed", TWELVE + pushing, 5))
    none = fit(case, ())
    library = {one.key: one for one in list_candidates(case.plain.measurements)[0]}
    mooring = replace(library["mooring", None], onset_s=200.0, offset_s=320.0)
    made = fit(case, [mooring])
    best = ScoredCandidate(mooring, made, made.evidence - none.evidence)
    found = {one.candidate.effect.id: one for one in _in_the_same_span(case, best, list(library.values()))}
    assert {(one.candidate.onset_s, one.candidate.offset_s) for one in found.values()} == {(200.0, 320.0)}
    push = found["external_push"]
    assert push.gain == max(one.gain for one in found.values())
    # Under its own noise it is far ahead of what the mooring is under that of the whole.
    assert push.gain > best.gain + 100.0
    assert push.fit.values[-1][:2] == pytest.approx([0.0, 400.0], abs=20.0)
    # Neither itself, nor what never sets in.
    assert "mooring" not in found
    assert "dead_band" not in found


@pytest.mark.slow
def test_a_long_log_has_fewer_times_about_an_end(monkeypatch: pytest.MonkeyPatch) -> None:
    case, counts = pushed(240.0, 90.0, 170.0), list[int]()
    cross_products = onset_estimation._cross_products

    def spy(*given: Any) -> Any:
        counts.append(len(given[-1]))
        return cross_products(*given)

    monkeypatch.setattr(onset_estimation, "_cross_products", spy)
    bare = fit(case, ())
    line = linearise(case, bare, starting_point(case, bare))
    promising_spans(case, line, PUSH)
    usual = max(counts[1:])
    counts.clear()
    room = 12
    monkeypatch.setattr(
        onset_estimation, "MOST_VALUES", room * len(case.steps.middle_s) * int(case.steps.channels.sum())
    )
    promising_spans(case, line, PUSH)
    # Both ends of the log, and the two edges themselves, come besides.
    assert max(counts[1:]) <= room + 4 < usual


@pytest.mark.slow
def test_no_span_begins_within_the_first_half_window() -> None:
    case = pushed(240.0, 2.0, inf)
    bare = fit(case, ())
    spans = promising_spans(case, linearise(case, bare, starting_point(case, bare)), PUSH)
    first, last = case.windows.middle_s[[0, -1]]
    times = [getattr(one, end) for one in spans for end in one.times]
    assert times
    assert all(first < time < last for time in times)


@pytest.mark.slow
def test_what_is_brief_keeps_the_ends_of_the_scan() -> None:
    case, lasting = pushed(240.0, 103.0, 125.0), replace(PUSH, effect=replace(PUSH.effect, onset=True))
    bare = fit(case, ())
    spans = promising_spans(case, linearise(case, bare, starting_point(case, bare)), lasting)
    brief = [one for one in spans if is_brief(case, one)]
    edges = onset_estimation._edges(case, lasting).tolist()
    assert brief
    assert all(getattr(one, end) in edges for one in brief for end in one.times)
    assert min(one.offset_s - one.onset_s for one in spans) >= INFERENCE.span_s


@pytest.mark.slow
def test_the_gain_of_a_span_is_that_of_its_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []

    def spy(gains: Callable[..., np.ndarray]) -> Callable[..., np.ndarray]:
        def told(G: np.ndarray, g: np.ndarray, a: np.ndarray, b: np.ndarray, candidate: Candidate) -> np.ndarray:
            found = gains(G, g, a, b, candidate)
            seen.append((a, b, found.copy()))
            return found

        return told

    from ferryid.diagnose.inference import onset_estimation as module

    monkeypatch.setattr(module, "_gains", spy(module._gains))
    case = pushed(20.0, 90.0, 170.0)
    bare = fit(case, ())
    promising_spans(case, linearise(case, bare, starting_point(case, bare)), PUSH)
    a, b, gains = seen[0]
    edges = module._edges(case, PUSH)
    for k in range(0, len(a), 29):
        span = replace(PUSH, onset_s=edges[a[k]] if a[k] else 0.0, offset_s=edges[b[k]] if b[k] < b.max() else inf)
        # The push is linear, so that the two differ by the step that an edge lies in alone.
        exact = fit(case, [span]).evidence - bare.evidence + len(span.times) * np.log(len(case.windows.starts))
        assert gains[k] == pytest.approx(exact, abs=0.1 + 0.15 * abs(exact))


@pytest.mark.slow
def test_in_a_gap_nothing_begins_or_ends() -> None:
    case = problem(0.0)
    t = case.plain.measurements.t
    seen = windows(replace(case.plain.measurements, usable=(t < 100.0) | (t >= 200.0)), 8.0, 2.0)
    # At rest in the log, pushed back in the force model.
    pushed_back = np.outer((t >= 60.0) & (t < 240.0), [-240.0, 0.0, 0.0])
    gappy = replace(case, windows=seen, plain=replace(case.plain, measurements=seen.measurements, external=pushed_back))
    bare = fit(gappy, ())
    spans = promising_spans(gappy, linearise(gappy, bare, starting_point(gappy, bare)), PUSH)
    assert spans
    assert (spans[0].onset_s, spans[0].offset_s) == (pytest.approx(60.0, abs=10.0), pytest.approx(240.0, abs=10.0))
    # Of the 180 s of the push 100 s are missing, and half a window at each side of the gap.
    assert lasts_s(gappy, replace(PUSH, onset_s=60.0, offset_s=240.0)) == pytest.approx(80.0, abs=9.0)
    ends = [end for one in spans for end in (one.onset_s, one.offset_s)]
    assert not [end for end in ends if 101.0 < end < 199.0]


@pytest.mark.slow
def test_a_load_that_leaves_is_no_fault_of_the_thrusters(tmp_path: Path) -> None:
    load = "[[payload]]\nmass_kg = 300\nx_m = 0.6\nuntil_s = 280\n"
    case = trial_on(sailed(tmp_path, "leaves", TWELVE + load, 5))
    known = [one for one in list_candidates(case.plain.measurements)[0] if one.effect.onset and not one.effect.unsteady]
    found = search(case, lambda stage: None, known=known).fit
    assert [one.key for one in found.candidates] == [("payload", None)]
    (one,) = found.candidates
    assert one.onset_s == 0.0
    assert one.offset_s == pytest.approx(280.0, abs=5.0)
    assert found.values[0] == pytest.approx([300.0, 0.6], rel=0.1)


@pytest.mark.slow
def test_a_fault_that_passes_is_found_with_both_its_ends(tmp_path: Path) -> None:
    fault = '[[thrusters.faults]]\nthruster = "thruster2"\nfactor = 0.55\nfrom_s = 180\nuntil_s = 290\n'
    case = trial_on(sailed(tmp_path, "passes", TWELVE + fault, 6))
    known = [one for one in list_candidates(case.plain.measurements)[0] if one.effect.onset and not one.effect.unsteady]
    found = search(case, lambda stage: None, known=known).fit
    assert [one.key for one in found.candidates] == [("thruster_gain", "thruster2")]
    (one,) = found.candidates
    assert (one.onset_s, one.offset_s) == (pytest.approx(180.0, abs=5.0), pytest.approx(290.0, abs=5.0))
    assert found.values[0] == pytest.approx([0.55], abs=0.03)


@pytest.mark.slow
def test_a_current_that_sets_in_is_found_with_its_beginning(tmp_path: Path) -> None:
    current = "[environment.current]\nnorth_mps = 0.1\neast_mps = -0.12\nfrom_s = 210\n"
    case = trial_on(sailed(tmp_path, "sets in", TWELVE + current, 5))
    known = [one for one in list_candidates(case.plain.measurements)[0] if one.effect.onset and not one.effect.unsteady]
    found = search(case, lambda stage: None, known=known).fit
    assert [one.key for one in found.candidates] == [("current", None)]
    (one,) = found.candidates
    assert (one.onset_s, one.offset_s) == (pytest.approx(210.0, abs=5.0), inf)
    assert found.values[0] == pytest.approx([0.1, -0.12], abs=0.02)


@pytest.mark.slow
def test_a_wind_that_gets_up_is_found_with_its_beginning(tmp_path: Path) -> None:
    wind = "[environment.wind]\nnorth_mps = -3.0\neast_mps = 4.0\nfrom_s = 210\n"
    case = trial_on(sailed(tmp_path, "gets up", TWELVE + wind, 5))
    known = [one for one in list_candidates(case.plain.measurements)[0] if one.effect.onset and not one.effect.unsteady]
    found = search(case, lambda stage: None, known=known).fit
    assert [one.key for one in found.candidates] == [("wind", None)]
    (one,) = found.candidates
    assert (one.onset_s, one.offset_s) == (pytest.approx(210.0, abs=5.0), inf)
    assert found.values[0][:2] == pytest.approx([-3.0, 4.0], abs=0.4)


def test_cross_products_of_parts_that_begin_one_after_another_are_those_of_all_rows() -> None:
    rng = np.random.default_rng(2)
    for parts, p, rows in ((11, 2, 60), (3, 1, 30), (40, 3, 90)):
        begun = np.sort(rng.integers(0, rows, parts))
        C = rng.normal(size=(rows, parts * p)) * (np.arange(rows)[:, None] >= np.repeat(begun, p))
        np.testing.assert_allclose(onset_estimation._products_of_later(C, begun, p), C.T @ C, rtol=0.0, atol=1e-12)
