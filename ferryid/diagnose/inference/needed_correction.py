"""Corrections of a hull model that no vessel can have: they are not questioned, as no other effect makes up for what is wrong.

Actuators that are all too weak by one factor move a vessel as a hull does whose masses and damping are too small by it, and are
fewer parameters. Where the hull model's inertia is less than its rigid body's, it is the hull: added mass only adds.
"""

from __future__ import annotations

from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem
from ferryid.diagnose.inference.force_errors import mass_of
from ferryid.identify.inertia import light_axes, why_too_light
from ferryid.vessel.profile import Profile


def needed(problem: EstimationProblem, candidate: Candidate) -> bool:
    """Tell whether a candidate corrects the coefficients of a hull that is too light."""
    profile = problem.plain.measurements.profile
    known = candidate.effect.of_coefficients and profile.hull.is_known
    return known and bool(light_axes(profile, mass_of(problem.plain.hull)))


def note_on_light_hull(profile: Profile) -> tuple[str, ...]:
    """Return for a campaign that the profile's hull model is too light for any vessel, as a note; none where it is not."""
    why = why_too_light(profile)
    remedy = (
        "correct M and D in the profile (`ferryid vessel check`), or mass_kg, inertia_z or k_zz_m where that is too large, or "
        "leave M and D out, and the logs bring the hull"
    )
    return (f"{why}, so that nothing agrees with it. Fix: {remedy}.",) if why else ()
