"""What no force of the motion explains is known beside a hull that nobody knew; what a hull could be is not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, Fit, fit
from ferryid.diagnose.inference.search import largest_gain_beside, list_candidates
from ferryid.diagnose.judging import motion_evidence
from ferryid.diagnose.judging.motion_evidence import beyond_any_hull, gain_beside_motion
from ferryid.effects import effects
from tests.diagnose.judging.test_onset_evidence import GAIN, of_unknown_hull, weak
from tests.diagnose.trials import FERRY

WIND = Candidate.of(effects()["wind"], None, FERRY)
LOAD = Candidate.of(effects()["payload"], None, FERRY)


def blown(folder: Path, speed_mps: float) -> EstimationProblem:
    """Return a trial in a steady wind, for one who knows no hull but its mass."""
    wind = f"environment = {{ wind = {{ north_mps = {-0.8 * speed_mps:g}, east_mps = {0.6 * speed_mps:g} }} }}\n"
    return of_unknown_hull(folder, f"blown-{speed_mps:g}", wind)


def library(problem: EstimationProblem) -> list[Candidate]:
    """Return the whole library."""
    return list_candidates(problem.plain.measurements)[0]


def settled(problem: EstimationProblem, candidate: Candidate) -> tuple[EstimationProblem, Fit]:
    """Return the trial under the noise that a candidate leaves, and its fit there."""
    problem = problem.with_noise_of(fit(problem, [candidate]))
    return problem, fit(problem, [candidate])


@pytest.mark.slow
def test_a_strong_wind_is_known_beside_an_unknown_hull(tmp_path: Path) -> None:
    case, made = settled(blown(tmp_path, 8.0), WIND)
    assert beyond_any_hull(case, made, 0, library(case))
    # Forces of the motion take up a part of it.
    whole = made.evidence - fit(case, []).evidence
    assert 8.0 < gain_beside_motion(case, made, 0) < whole
    # What begins in the log has a rule of its own.
    assert not beyond_any_hull(case, fit(case, [replace(WIND, onset_s=100.0)]), 0, library(case))


@pytest.mark.slow
def test_what_is_no_stronger_than_what_else_is_missing_is_not(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    case, made = settled(blown(tmp_path, 8.0), WIND)
    own = made.evidence - fit(case, []).evidence
    for share, beyond in ((4.5, True), (3.5, False)):
        monkeypatch.setattr(motion_evidence, "largest_gain_beside", lambda *_: own / share)  # noqa: B023
        assert beyond_any_hull(case, made, 0, []) == beyond
    # A rival that is a little less likely may be what acts.
    monkeypatch.setattr(motion_evidence, "largest_gain_beside", lambda *_: 0.0)
    assert beyond_any_hull(case, made, 0, [], -8.5)
    assert not beyond_any_hull(case, made, 0, [], -7.5)
    # What a force of the motion explains as well is one.
    monkeypatch.setattr(motion_evidence, "gain_beside_motion", lambda *_: 7.0)
    assert not beyond_any_hull(case, made, 0, [])


@pytest.mark.slow
def test_the_best_further_effect_is_weighed_beside_the_fit(tmp_path: Path) -> None:
    case = blown(tmp_path, 8.0)
    without, made = fit(case, []), fit(case, [WIND])
    # The wind, where it is not in the fit.
    assert largest_gain_beside(case, without, [WIND]) > 0.5 * (made.evidence - without.evidence)
    assert largest_gain_beside(case, made, [WIND]) == 0.0


@pytest.mark.slow
def test_how_strong_a_thruster_is_all_along_is_not(tmp_path: Path) -> None:
    case, made = settled(weak(tmp_path, 0.6, 0.0), GAIN)
    assert made.evidence - fit(case, []).evidence > 32.0
    assert not beyond_any_hull(case, made, 0, [])


@pytest.mark.slow
def test_a_load_gains_nothing_beside_the_masses_of_a_hull(tmp_path: Path) -> None:
    case = blown(tmp_path, 0.0)
    made = fit(case, [LOAD])
    assert gain_beside_motion(case, made, 0) < 8.0
    assert not beyond_any_hull(case, made, 0, library(case))
