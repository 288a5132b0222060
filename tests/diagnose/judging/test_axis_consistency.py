"""What ties the axes of an effect: a weak thruster is weak on all of them, one that lies elsewhere only turns otherwise."""

from __future__ import annotations

import numpy as np
import pytest

from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, Fit, fit, fitted_force_model
from ferryid.diagnose.inference.folds import folds_of
from ferryid.diagnose.judging.axis_consistency import check_axis_consistency
from ferryid.diagnose.judging.sparse_regression import select_law
from ferryid.effects import effects
from tests.diagnose.judging.test_unexplained import FERRY, sailed, trial_with

pytestmark = pytest.mark.slow

GAIN = effects()["thruster_gain"]


def weak(problem: EstimationProblem) -> Fit:
    """Return the fit of a weak first thruster."""
    name = FERRY.actuators[0].name
    return fit(problem, [Candidate(GAIN, name, GAIN.parameters_of(FERRY))])


def test_a_weak_thruster_is_weak_on_every_axis() -> None:
    problem = trial_with(-0.2 * sailed(0).parts[:, 0])
    made = weak(problem)
    assert made.values[0][0] == pytest.approx(0.8, abs=0.03)
    tie = check_axis_consistency(problem.with_noise_of(made), made, 0)
    assert not tie.inconsistent
    assert np.all(np.abs(tie.beyond[tie.acts > 0.1]) < 0.3)


def test_a_thruster_that_lies_elsewhere_is_none() -> None:
    """Its moment lacks a third, its force nothing."""
    force = np.zeros_like(sailed(0).parts[:, 0])
    force[:, 2] = -0.33 * sailed(0).parts[:, 0, 2]
    problem = trial_with(force)
    made = weak(problem)
    assert made.values[0][0] < 0.95, "a case in which it looks weak"
    tie = check_axis_consistency(problem.with_noise_of(made), made, 0)
    assert tie.inconsistent
    assert tie.beyond[2] > 0.0


def test_no_law_that_says_the_same_is_held_against_an_effect() -> None:
    problem = trial_with(-0.2 * sailed(0).parts[:, 0])
    folds = folds_of(problem.windows)
    assert folds is not None
    bare = fit(problem, ())
    law = select_law(problem, bare, folds)
    assert law is not None
    own = f"force of {FERRY.actuators[0].name}"
    assert own in {term.on for term in law.terms if term.name == "1"}
    made = weak(problem)
    idle = Fit((), (), np.empty((0, 0)), made.hull, 0.0)
    moved = problem.windows.gap(fitted_force_model(problem.plain, made)) - problem.windows.gap(
        fitted_force_model(problem.plain, idle)
    )
    other = select_law(problem, bare, folds, unlike=moved)
    assert other is None or own not in {term.on for term in other.terms if term.name == "1"}
