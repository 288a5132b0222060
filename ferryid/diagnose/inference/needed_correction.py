"""Corrections of a hull model that no vessel can have: they are not questioned, as no other effect makes up for what is wrong.

Actuators that are all too weak by one factor move a vessel as a hull does whose masses and damping are too small by it, and are
fewer parameters. Where the hull model's inertia is less than its rigid body's, it is the hull: added mass only adds.
"""

from __future__ import annotations

from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem
from ferryid.diagnose.inference.force_errors import mass_of
from ferryid.identify import inertia_checks


def too_light(problem: EstimationProblem) -> bool:
    """Tell whether the known hull has less inertia on an axis than its rigid body and the errors of a model admit."""
    plain = problem.plain
    profile = plain.measurements.profile
    if not profile.hull.is_known:
        return False
    checks = inertia_checks(profile, mass_of(plain.hull))
    return any(one.name.startswith("inertia") and one.value < one.limit and not one.passed for one in checks)


def needed(problem: EstimationProblem, candidate: Candidate) -> bool:
    """Tell whether a candidate corrects the coefficients of a hull that is too light."""
    return candidate.effect.of_coefficients and too_light(problem)
