"""What ties the axes of an effect: a weak thruster is weak on all of them, one that lies elsewhere only turns otherwise."""

from __future__ import annotations

import numpy as np
import pytest

from ferryid.diagnose.inference.estimation import Fit, Suspect, Trial, fit, imagined
from ferryid.diagnose.inference.folds import folds_of
from ferryid.diagnose.judging.axis_consistency import tie_of
from ferryid.diagnose.judging.sparse_regression import law_of
from ferryid.effects import effects
from tests.diagnose.judging.test_unexplained import FERRY, sailed, trial_with

GAIN = effects()["thruster_gain"]


def weak(trial: Trial) -> Fit:
    """Return the fit of a weak first thruster."""
    name = FERRY.actuators[0].name
    return fit(trial, [Suspect(GAIN, name, GAIN.parameters_of(FERRY))])


def test_a_weak_thruster_is_weak_on_every_axis() -> None:
    trial = trial_with(-0.2 * sailed(0).parts[:, 0])
    made = weak(trial)
    assert made.values[0][0] == pytest.approx(0.8, abs=0.03)
    tie = tie_of(trial.with_noise_of(made), made, 0)
    assert not tie.torn
    assert np.all(np.abs(tie.beyond[tie.acts > 0.1]) < 0.3)


def test_a_thruster_that_lies_elsewhere_is_none() -> None:
    """Its moment lacks a third, its force nothing."""
    force = np.zeros_like(sailed(0).parts[:, 0])
    force[:, 2] = -0.33 * sailed(0).parts[:, 0, 2]
    trial = trial_with(force)
    made = weak(trial)
    assert made.values[0][0] < 0.95, "a case in which it looks weak"
    tie = tie_of(trial.with_noise_of(made), made, 0)
    assert tie.torn
    assert tie.beyond[2] > 0.0


def test_no_law_that_says_the_same_is_held_against_an_effect() -> None:
    trial = trial_with(-0.2 * sailed(0).parts[:, 0])
    folds = folds_of(trial.windows)
    assert folds is not None
    bare = fit(trial, ())
    law = law_of(trial, bare, folds)
    assert law is not None
    own = f"force of {FERRY.actuators[0].name}"
    assert own in {term.on for term in law.terms if term.name == "1"}
    made = weak(trial)
    idle = Fit((), (), np.empty((0, 0)), made.hull, 0.0)
    moved = trial.windows.gap(imagined(trial.plain, made)) - trial.windows.gap(imagined(trial.plain, idle))
    other = law_of(trial, bare, folds, unlike=moved)
    assert other is None or own not in {term.on for term in other.terms if term.name == "1"}
