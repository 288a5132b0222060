"""What was measured of findings of forces, and which of it makes them hints."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
import pytest

from ferryid.diagnose.inference.estimation import EstimationProblem, fit
from ferryid.diagnose.judging import findings
from ferryid.diagnose.judging.backward_elimination import Elimination
from ferryid.diagnose.judging.claims import LogFigures
from ferryid.diagnose.judging.confidence_rules import Context, apply_rules, improves_no_claimed_axis
from ferryid.diagnose.judging.finding import Finding
from ferryid.diagnose.judging.findings import force_claims
from ferryid.diagnose.judging.held_out import held_out_evidence
from ferryid.diagnose.judging.posterior import posterior_of
from ferryid.diagnose.judging.rivals import RivalComparison
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects import effects
from ferryid.signals.feedback import Feedback
from ferryid.types import AXES
from tests.diagnose.judging.test_campaign_posterior import survey
from tests.diagnose.judging.test_held_out import FERRY, WIND, candidate, sailed, trial_on

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def windy() -> tuple[EstimationProblem, Elimination]:
    problem = trial_on(sailed(480.0, WIND))
    found = fit(problem, [candidate("wind")])
    problem = problem.with_noise_of(found)
    return problem, Elimination(found, held_out_evidence(problem, found), (RivalComparison((), 0.999),), ())


def with_lows(stands: Elimination, forces: list[float], runs: list[float], score: float = 20.0) -> Elimination:
    """Return the same with another score and lower ends: of force by axis, and of position, heading, speed and yaw rate."""
    assert stands.proof is not None
    (proof,) = stands.proof.proofs
    low = np.broadcast_to(runs, proof.free_runs.low.shape)
    other = replace(
        proof,
        improvement=replace(proof.improvement, low=np.array(forces), score=score),
        free_runs=replace(proof.free_runs, low=low),
    )
    return replace(stands, proof=replace(stands.proof, proofs=(other,)))


def judged_by_rules(problem: EstimationProblem, stands: Elimination) -> tuple[Finding, tuple[str, ...]]:
    (finding,), notes = apply_rules(
        force_claims(problem, stands, problem.windows.measurements, hull_known=True), LogFigures()
    )
    return finding, notes


def test_a_wind_that_blew_is_told_for_sure(windy: tuple[EstimationProblem, Elimination]) -> None:
    finding, notes = judged_by_rules(*windy)
    assert finding.sure
    assert notes == ()


def test_what_is_seen_to_improve_nothing_that_it_claims_is_a_hint(windy: tuple[EstimationProblem, Elimination]) -> None:
    problem, stands = windy
    finding, (note,) = judged_by_rules(problem, with_lows(stands, [-0.1] * 3, [np.nan, -0.1, -0.1, -0.1]))
    assert finding.probability == JUDGING.hint_probability
    assert note == (
        "Steady wind is a hint: on the axes that it claims, neither the held-out squared force error nor the free run "
        "improves by an interval that excludes zero."
    )


def test_a_value_at_the_bound_of_its_search_is_a_hint(windy: tuple[EstimationProblem, Elimination]) -> None:
    problem, stands = windy
    (wind,), (values,) = stands.fit.candidates, stands.fit.values
    north = replace(wind.parameters[0], low=float(values[0]) - 0.1)
    bounded = replace(wind, parameters=(north, *wind.parameters[1:]))
    (proof,) = stands.proof.proofs if stands.proof else ()
    assert stands.proof is not None
    stands = replace(
        stands,
        fit=replace(stands.fit, candidates=(bounded,)),
        proof=replace(stands.proof, proofs=(replace(proof, candidate=bounded),)),
    )
    finding, (note,) = judged_by_rules(problem, stands)
    assert finding.probability == JUDGING.hint_probability
    assert note.startswith("Steady wind is a hint: its north of -")
    assert note.endswith(" m/s stands at the bound of its search.")


def test_a_hull_that_is_another_vessels_is_not_stored(windy: tuple[EstimationProblem, Elimination]) -> None:
    problem, stands = windy
    finding, _ = judged_by_rules(problem, stands)
    known = posterior_of(problem, stands.fit, (), (finding,), survey())
    assert known is not None
    assert (known.hull is None, known.doubt) == (False, "")
    # The same move of a hull that was believed to be known to a thousandth.
    sure = replace(problem, hull_spread=1e-2 * problem.hull_spread)
    for is_known, stored in ((True, False), (False, True)):
        other = posterior_of(sure, stands.fit, (), (finding,), survey(), known=is_known)
        assert other is not None
        assert (other.hull is not None) == stored
        assert ("prior standard deviations" in other.doubt) != stored


def test_what_acted_in_a_place_that_was_visited_once_is_a_hint(windy: tuple[EstimationProblem, Elimination]) -> None:
    problem, stands = windy
    (blown,) = stands.fit.candidates
    brief = replace(blown, effect=replace(blown.effect, single_visit=lambda measurements, p: True))
    finding, (note,) = judged_by_rules(problem, replace(stands, fit=replace(stands.fit, candidates=(brief,))))
    assert finding.probability == JUDGING.hint_probability
    assert "the vessel was in that place once" in note


def test_what_acts_for_less_than_two_blocks_is_a_hint(windy: tuple[EstimationProblem, Elimination]) -> None:
    problem, stands = windy
    (blown,) = stands.fit.candidates
    for offset_s, sure in ((150.0, False), (300.0, True)):
        brief = replace(blown, onset_s=100.0, offset_s=offset_s)
        finding, notes = judged_by_rules(problem, replace(stands, fit=replace(stands.fit, candidates=(brief,))))
        assert finding.sure == sure
        assert any("held-out data judge nothing below 80 s" in note for note in notes) != sure


@pytest.mark.parametrize(
    ("onset_s", "offset_s", "passing", "sure"),
    [(100.0, 300.0, 4.0, False), (100.0, 300.0, 1.0, True), (100.0, inf, 4.0, True), (0.0, inf, 4.0, True)],
)
def test_what_comes_and_goes_by_little_is_a_hint(
    windy: tuple[EstimationProblem, Elimination], onset_s: float, offset_s: float, passing: float, sure: bool
) -> None:
    """A wind of 2.5 m/s northwards, where 4 m/s or 1 m/s are little."""
    problem, stands = windy
    (blown,) = stands.fit.candidates
    effect = replace(blown.effect, passing_size=lambda profile: passing, onset=True)
    candidate = replace(blown, effect=effect, onset_s=onset_s, offset_s=offset_s)
    made = replace(stands.fit, candidates=(candidate,), values=(np.array([2.5, 0.0, 1.0, 1.0, 1.0]),))
    finding, notes = judged_by_rules(problem, replace(stands, fit=made))
    assert finding.sure == sure
    assert any("by less than hull and formulas may be off" in note for note in notes) != sure


@pytest.mark.parametrize(("grown", "sure"), [(1.2, False), (1.05, True)])
def test_what_makes_an_axis_worse_is_a_hint(
    windy: tuple[EstimationProblem, Elimination], grown: float, sure: bool
) -> None:
    """By 44 and by 10 % of the squared error in yaw, where it improves surge by 19 % while it acts."""
    problem, stands = windy
    assert stands.proof is not None
    (proof,) = stands.proof.proofs
    after = proof.improvement.before * [0.9, 1.0, grown]
    other = replace(proof, improvement=replace(proof.improvement, after=after))
    finding, notes = judged_by_rules(problem, replace(stands, proof=replace(stands.proof, proofs=(other,))))
    assert finding.sure == sure
    assert notes == (
        () if sure else ("Steady wind is a hint: it makes the held-out squared force error in yaw 44 % larger.",)
    )


@pytest.mark.parametrize(
    ("shares", "forces", "runs", "shows"),
    [
        ([0.0, 0.1, 0.9], [0.1, 0.1, -0.2], [0.1, -0.1, 0.1, -0.1], False),
        ([0.0, 0.1, 0.9], [-0.1, -0.1, 0.02], [-0.1, -0.1, -0.1, -0.1], True),
        ([0.0, 0.1, 0.9], [-0.1, -0.1, -0.2], [-0.1, -0.1, -0.1, 0.01], True),
        ([0.0, 0.6, 0.4], [-0.1, 0.05, -0.2], [-0.1, -0.1, -0.1, -0.1], True),
        ([0.9, 0.1, 0.0], [-0.1, -0.1, -0.2], [-0.1, -0.1, 0.01, -0.1], True),
        ([0.9, 0.1, 0.0], [-0.1, 0.2, 0.2], [-0.1, 0.1, -0.1, 0.1], False),
        ([0.0, 0.0, 0.0], [-0.1, -0.1, 0.2], [-0.1, -0.1, -0.1, -0.1], True),
    ],
)
def test_only_an_axis_that_is_claimed_shows_a_finding(
    windy: tuple[EstimationProblem, Elimination],
    shares: list[float],
    forces: list[float],
    runs: list[float],
    shows: bool,
) -> None:
    problem, stands = windy
    (claim,) = force_claims(problem, with_lows(stands, forces, runs), problem.windows.measurements, hull_known=True)
    finding = replace(claim.finding, axes=dict(zip(AXES, shares, strict=True)))
    judged, _ = improves_no_claimed_axis(finding, Context(claim.figures))
    assert judged is not None
    assert judged.sure is shows


def test_a_strong_likelihood_needs_no_more(windy: tuple[EstimationProblem, Elimination]) -> None:
    problem, stands = windy
    (claim,) = force_claims(
        problem,
        with_lows(stands, [-0.1] * 3, [-0.1] * 4, score=45.0),
        problem.windows.measurements,
        hull_known=True,
    )
    assert improves_no_claimed_axis(claim.finding, Context(claim.figures)) == (claim.finding, "")


def test_a_motion_before_its_force_is_a_clocks() -> None:
    says = effects()["time_delay"].says
    assert says({"seconds": 0.2}, None) == "The navigation's data lag the actuators' by 0.20 s."
    assert says({"seconds": -0.09}, None).startswith("The actuators' data lag the navigation's by 0.09 s: ")


@pytest.mark.parametrize(
    ("effect", "most", "beyond"), [("time_delay", 9.9, True), ("time_delay", 10.0, False), ("wind", 0.0, False)]
)
def test_a_delay_is_weighed_against_what_the_forces_tell(
    windy: tuple[EstimationProblem, Elimination],
    effect: str,
    most: float,
    beyond: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem, stands = windy
    monkeypatch.setattr(findings, "feedback_of", lambda *_: Feedback(most, 0.0))
    late = fit(problem, [candidate("time_delay")]) if effect == "time_delay" else stands.fit
    assert stands.proof is not None
    (proof,) = stands.proof.proofs
    gained = replace(
        proof, candidate=late.candidates[0], improvement=replace(proof.improvement, score=30.0, score_low=10.0)
    )
    stands = replace(stands, fit=late, proof=replace(stands.proof, proofs=(gained,)))
    (claim,) = force_claims(problem, stands, problem.windows.measurements, hull_known=True)
    assert claim.figures.beyond_feedback == beyond


@pytest.mark.parametrize(
    ("effect", "values", "passes"),
    [
        # Both components of a current, and of a load its mass alone.
        ("current", {"north": 0.03, "east": -0.04}, 1.0),
        ("payload", {"mass": 0.05 * FERRY.hull.mass_kg, "x": 2.0}, 0.5),
        ("thruster_gain", {"factor": 0.85}, 1.5),
        ("wind", {"north": 0.1, "east": 0.1}, inf),
        # Of a step the level while it lasts: the other is that of all other times.
        ("step", {"factor": 0.85, "otherwise": 0.4}, 1.5),
    ],
)
def test_what_comes_and_goes_is_held_against_what_hull_and_formulas_may_be_off_by(
    windy: tuple[EstimationProblem, Elimination], effect: str, values: dict[str, float], passes: float
) -> None:
    problem, _ = windy
    gain = candidate("thruster_gain", "thruster1")
    lasts = {"thruster_gain": gain, "step": gain.as_step(FERRY)}.get(effect) or candidate(effect)
    both = replace(lasts, onset_s=100.0, offset_s=300.0)
    start = np.array([values.get(one.name, one.neutral) for one in lasts.parameters])
    for one, expected in ((both, passes), (replace(both, offset_s=inf), inf), (lasts, inf)):
        made = findings._figures(problem, one, start, values, None, {})
        assert made.passes == pytest.approx(expected)
