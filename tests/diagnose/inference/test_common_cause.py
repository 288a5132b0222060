"""Fouling of a hull whose model is off in form as well: one cause, or several coefficients that are wrong each by itself."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.diagnose.data.measurements import read_measurements, window_lengths
from ferryid.diagnose.inference.estimation import Candidate, estimation_problem
from ferryid.diagnose.inference.prior import prior_force_model
from ferryid.diagnose.inference.search import search
from ferryid.diagnose.inference.weak_form import windows
from ferryid.effects import effects, hull_parameters
from ferryid.effects.thresholds import EFFECTS
from ferryid.validation.case import Case
from ferryid.validation.case_sampling import HULL_ERROR
from ferryid.validation.log_generation import generate
from ferryid.validation.plant.vessels import VESSELS
from ferryid.validation.prior_profile import MASSES, damping
from ferryid.vessel import load_profile


def test_each_further_coefficient_needs_the_odds_of_an_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    names = [f"c{k}" for k in range(5)]
    G = np.diag(np.full(5, 1e4))
    b = np.array([1e4 * 1.11, 1e4 * 0.45, 0.0, 0.0, 0.0])
    assert hull_parameters._best_subset(G, b, names, EFFECTS.hull_spread)[0] == {"c0"}
    free = replace(EFFECTS, coefficient_odds=0.0)
    monkeypatch.setattr(hull_parameters, "EFFECTS", free)
    assert hull_parameters._best_subset(G, b, names, EFFECTS.hull_spread)[0] == {"c0", "c1"}


def test_a_model_that_is_wrong_all_over_costs_no_more_than_a_few() -> None:
    names = [f"c{k}" for k in range(8)]
    G, b = np.diag(np.full(8, 1e4)), np.full(8, 1e4)
    chosen, cost = hull_parameters._best_subset(G, b, names, EFFECTS.hull_spread)
    assert chosen == set(names)
    assert cost == pytest.approx(np.log(8.0) + EFFECTS.coefficients_apart * EFFECTS.coefficient_odds)


@pytest.mark.slow
def test_fouling_is_named_beside_a_coefficient_that_is_wrong_in_any_case(tmp_path: Path) -> None:
    """Cross flow by strips is not quadratic in sway and yaw: a coefficient of the profile's form is off by itself."""
    rng = np.random.default_rng([1, 77])
    names = (*MASSES, *damping(VESSELS["ferry"]))
    signs = rng.choice([-1.0, 1.0], len(names)).tolist()
    factors = {name: 1.0 + HULL_ERROR * sign for name, sign in zip(names, signs, strict=True)}
    settings = {"fouling": (1.4, 1.4, 1.4)}
    case = Case(
        "fouled", "fouling", "single", "ferry", "calibration", "mcap", 5, conditions=settings, hull_factors=factors
    )
    made = generate(case, tmp_path / "log")
    profile = load_profile(str(made.profile))
    seen = windows(read_measurements(str(made.log), profile)[0], *window_lengths(profile))
    problem = estimation_problem(seen, *prior_force_model(seen.measurements, profile))
    known = [Candidate.of(effects()[name], None, profile) for name in ("fouling", "payload", "hull_parameters")]
    found = search(problem, lambda stage: None, known=known).fit
    assert found.candidates[0].effect.id == "fouling"
    assert (found.values[0] > 1.2).all()
