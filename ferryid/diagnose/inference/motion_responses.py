"""What every force that the motion through the water decides does to the prediction errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ferryid.diagnose.inference.candidate_terms import terms_of
from ferryid.diagnose.inference.estimation import EstimationProblem, Fit, fitted_force_model
from ferryid.types import AXES, Floats

VAGUE = 1e3
"""Standard deviations by which a force of the motion may change the prediction errors, as the length of them all: anything."""


def motion_responses(problem: EstimationProblem, made: Fit) -> Floats:
    """Return what every force that the motion decides does to the prediction errors, of length `VAGUE`, shape (w, terms)."""
    force_model = fitted_force_model(problem.plain, made)
    here, columns = problem.white(force_model), []
    for term in terms_of(problem.steps.measurements):
        if term.on not in AXES or not term.of_vessel:
            continue
        force = term.force(force_model)
        size = float(np.sqrt(np.nanmean(force**2)))
        if not size > 0.0:
            continue
        moved = replace(force_model, external=force_model.external + force / size)
        change = problem.white(moved) - here
        columns.append(change * (VAGUE / max(float(np.linalg.norm(change)), 1e-300)))
    return np.stack(columns, axis=1)
