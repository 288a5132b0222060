"""Selection and judgement on a log in which one thruster's gain and a loss by inflow together look like the other's gain."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, Fit, fit, starting_point, without
from ferryid.diagnose.inference.search import list_candidates, search
from ferryid.diagnose.judging import backward_elimination
from ferryid.diagnose.judging.backward_elimination import (
    BRIEF,
    LAW,
    PLACEBO,
    _fallen,
    _told,
    eliminate_backward,
)
from ferryid.diagnose.judging.held_out import held_out_evidence
from ferryid.diagnose.judging.rivals import RivalComparison, RivalFit, with_both, without_companions
from tests.diagnose.trials import sailed, trial_on

pytestmark = pytest.mark.slow

TRIAL = """
schema = "ferryid.scenario/1"
vessel = "milliampere"
path = { kind = "twelve-corner", dwell_s = 26 }
controller = { delta = 0.7, sigma = 0.7 }
sensors = { imu_rate_hz = 0.0, camera_rate_hz = 0.0 }
thrusters = { inflow_loss_per_mps = 0.25, faults = [{ thruster = "thruster1", factor = 1.26 }] }
"""


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory) -> EstimationProblem:
    return trial_on(sailed(tmp_path_factory.mktemp("both"), "both", TRIAL, 8))


def candidates(problem: EstimationProblem) -> list[Candidate]:
    return [one for one in list_candidates(problem.plain.measurements)[0] if one.effect.unsteady is None]


def of(problem: EstimationProblem, *keys: tuple[str, str | None]) -> list[Candidate]:
    return [next(one for one in candidates(problem) if one.key == key) for key in keys]


LOSS, FIRST, SECOND = ("thrust_inflow_loss", None), ("thruster_gain", "thruster1"), ("thruster_gain", "thruster2")
RIGHT = {LOSS: pytest.approx(0.25, rel=0.1), FIRST: pytest.approx(1.26, rel=0.02)}


def sizes(made: Fit) -> dict[tuple[str, str | None], float]:
    return {one.key: values[0] for one, values in zip(made.candidates, made.values, strict=True)}


def test_a_fit_ends_at_the_same_place_wherever_it_begins(problem: EstimationProblem) -> None:
    rough = fit(problem, of(problem, LOSS, FIRST))
    # Under the little noise that is left the profile's hull is far away, in standard deviations.
    sharp = problem.with_noise_of(rough)
    afar = fit(sharp, rough.candidates)
    close = fit(sharp, rough.candidates, rough.values, begin=starting_point(sharp, rough))
    assert afar.evidence == pytest.approx(close.evidence, abs=0.5)
    for one, other, errors in zip(afar.values, close.values, (afar.errors(0), afar.errors(1)), strict=True):
        assert np.all(np.abs(one - other) < 0.05 * errors)


def test_what_a_rival_replaces_stays_beside_it_where_both_act(problem: EstimationProblem) -> None:
    loss, first = (fit(problem, of(problem, key)) for key in (LOSS, FIRST))
    assert with_both(problem, loss, 0, first).keys == {LOSS, FIRST}
    both, wrong = fit(problem, of(problem, LOSS, FIRST)), fit(problem, of(problem, SECOND))
    assert with_both(problem, wrong, 0, both) is both


def test_what_was_fitted_without_a_candidate_is_kept(problem: EstimationProblem) -> None:
    kept = fit(problem, of(problem, LOSS, FIRST))
    assert without(problem, kept, 0) is without(problem, kept, -2)
    assert without(problem, kept, 0) is not without(problem, kept, 1)
    assert without(problem, replace(kept), 0) is not without(problem, kept, 0)


def test_a_rival_that_acts_beside_a_finding_is_none_of_its_name(problem: EstimationProblem) -> None:
    """Here a loss and a thruster's gain both act: that the one alone is likelier tells nothing against the other."""
    first, loss = (fit(problem, of(problem, key)) for key in (FIRST, LOSS))
    bare = fit(problem, ())

    def standing(kept: Fit, rival: Fit) -> tuple[RivalComparison, RivalComparison]:
        gain = rival.evidence - kept.evidence
        against = RivalComparison((RivalFit(rival.candidates[0], rival, gain),), 0.0, kept.evidence - bare.evidence)
        return against, without_companions(problem, kept, 0, against)

    weaker, stronger = sorted((first, loss), key=lambda one: one.evidence)
    before, after = standing(weaker, stronger)
    assert before.unresolved(weaker.candidates[0]) == (stronger.candidates[0].effect.id,)
    assert after.rivals == after.unresolved(weaker.candidates[0]) == ()
    assert after.probability > 0.99
    # The other thruster does not act, and what it seems to is this loss.
    second = fit(problem, of(problem, SECOND))
    both = fit(problem, of(problem, LOSS, FIRST))
    wrong, judged = standing(second, both)
    assert judged.rivals == wrong.rivals
    assert judged.probability < 0.01


def test_both_are_found_though_the_other_thrusters_gain_is_likelier_alone(problem: EstimationProblem) -> None:
    alone = {key: fit(problem, of(problem, key)).evidence for key in (LOSS, FIRST, SECOND)}
    assert max(alone, key=lambda key: alone[key]) == SECOND
    found = search(problem, lambda stage: None)
    assert found.rounds[0].ranked[0].candidate.key == SECOND
    assert sizes(found.fit) == RIGHT


def test_a_likelier_rival_takes_the_place_of_what_was_selected_first(problem: EstimationProblem) -> None:
    wrong = fit(problem, of(problem, LOSS, SECOND))
    told = eliminate_backward(problem.with_noise_of(wrong), wrong, candidates(problem), lambda stage: None)
    assert sizes(told.fit) == RIGHT
    assert all(one.probability > 0.99 for one in told.standings)
    assert all(one.gain < 0.0 for standing in told.standings for one in standing.rivals)


def test_what_helps_no_held_out_stretch_falls_and_is_told(problem: EstimationProblem) -> None:
    right = fit(problem, of(problem, LOSS, FIRST))
    negligible = of(problem, ("wind", None))
    breeze = Fit(
        (*right.candidates, *negligible),
        (*right.values, np.array([0.2, 0.1, 1.0, 1.0, 1.0])),
        np.eye(7),
        right.hull,
        right.evidence,
    )
    told = eliminate_backward(problem.with_noise_of(right), breeze, [], lambda stage: None)
    assert {one.key for one in told.fit.candidates} == {LOSS, FIRST}
    (sentence,) = told.dropped
    # With its size, which nothing confirms.
    assert sentence.startswith(f"{negligible[0].effect.title} was considered, but dropped: {PLACEBO}. Estimated, not")
    assert sentence.endswith(" north 0.2 m/s (-2.7 to 3.1); east 0.1 m/s (-2.8 to 3.0).")


def test_what_makes_one_axis_worse_and_none_better_falls(problem: EstimationProblem) -> None:
    kept = fit(problem, of(problem, LOSS, FIRST))
    judged = held_out_evidence(problem.with_noise_of(kept), kept)
    assert judged is not None
    for removed, falls in (
        ((-0.38, -0.07, -0.22), True),
        ((-0.38, 0.2, -0.22), False),
        ((-0.05, -0.05, -0.05), False),
    ):
        worse = replace(judged.proofs[1].improvement, removed=np.array(removed))
        proofs = (judged.proofs[0], replace(judged.proofs[1], improvement=worse))
        place, why = _fallen(problem.with_noise_of(kept), kept, replace(judged, proofs=proofs))
        assert (place == 1 and "in surge 38 % larger, and on none smaller" in why) == falls


def test_a_correction_that_is_needed_does_not_fall_for_harm(
    problem: EstimationProblem, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = fit(problem, of(problem, LOSS, FIRST))
    judged = held_out_evidence(problem.with_noise_of(kept), kept)
    assert judged is not None
    monkeypatch.setattr(backward_elimination, "needed", lambda _, one: one.key == FIRST)
    worse = replace(judged.proofs[1].improvement, removed=np.array((-0.38, -0.07, -0.22)))
    proofs = (judged.proofs[0], replace(judged.proofs[1], improvement=worse))
    assert _fallen(problem.with_noise_of(kept), kept, replace(judged, proofs=proofs)) == (None, "")


def test_what_fell_for_one_reason_is_one_sentence() -> None:
    fallen = {LAW: {"Wind": "north 2.0 m/s (1.0 to 3.0)", "Current": ""}, PLACEBO: {"Payload": "mass 50 kg (10 to 90)"}}

    def kept(*titles: str) -> Any:
        return SimpleNamespace(candidates=[SimpleNamespace(title=one) for one in titles])

    assert _told(fallen, kept("Mooring")) == (
        f"Wind and Current were considered, but dropped: {LAW}. Estimated, not confirmed: Wind: north 2.0 m/s (1.0 to 3.0).",
        f"Payload was considered, but dropped: {PLACEBO}. Estimated, not confirmed: mass 50 kg (10 to 90).",
    )
    # What came back stands among the findings.
    (alone,) = _told(fallen, kept("Current", "Payload"))
    assert alone == f"Wind was considered, but dropped: {LAW}. Estimated, not confirmed: north 2.0 m/s (1.0 to 3.0)."


def test_what_is_too_small_to_matter_falls_without_a_word(problem: EstimationProblem) -> None:
    """A loss of 0.25 that is judged by somebody to whom one of less than 1 does not matter."""
    loss, first = of(problem, LOSS, FIRST)
    careless = replace(loss, effect=replace(loss.effect, negligible=1.0))
    for one, falls in ((loss, (None, "")), (careless, (0, ""))):
        both = fit(problem, [one, first])
        assert _fallen(problem.with_noise_of(both), both, None) == falls


def test_what_is_too_brief_to_be_judged_and_may_be_nothing_falls(problem: EstimationProblem) -> None:
    """A wind of 5 m/s, known to 4 m/s and to 0.4 m/s, for 30 s; and throughout the log, of which stretches can be kept."""
    loss, wind = of(problem, LOSS, ("wind", None))
    brief = {"onset_s": 200.0, "offset_s": 230.0}
    right = fit(problem, [loss])
    values = (*right.values, np.array([4.0, 3.0, 1.0, 1.0, 1.0]))
    for one, error, falls in (
        (replace(wind, **brief), 4.0, True),
        (replace(wind, **brief), 0.4, False),
        (wind, 4.0, False),
    ):
        blown = Fit((loss, one), values, np.diag([0.01, *5 * [error]]) ** 2, right.hull, right.evidence)
        assert (_fallen(problem.with_noise_of(right), blown, None)[1] == BRIEF) == falls
