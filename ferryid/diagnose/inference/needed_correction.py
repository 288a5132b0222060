"""Corrections of a hull model that no vessel can have: they are not questioned, as no other effect makes up for what is wrong.

Actuators that are all too weak by one factor move a vessel as a hull does whose masses and damping are too small by it, and are
fewer parameters. Where the hull model's inertia is less than its rigid body's, it is the hull: added mass only adds.
"""

from __future__ import annotations

from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem
from ferryid.diagnose.inference.force_errors import mass_of
from ferryid.effects.force_model import hull_of
from ferryid.effects.wording import listed
from ferryid.identify import inertia_checks
from ferryid.types import AXES, Floats
from ferryid.vessel.profile import Profile


def needed(problem: EstimationProblem, candidate: Candidate) -> bool:
    """Tell whether a candidate corrects the coefficients of a hull that is too light."""
    plain = problem.plain
    return candidate.effect.of_coefficients and bool(_shares(plain.measurements.profile, plain.hull))


def why_too_light(profile: Profile) -> str:
    """Return that a profile's hull model is too light for any vessel, and what to do, as sentences; empty where it is not."""
    shares = _shares(profile, hull_of(profile))
    if not shares:
        return ""
    told = listed([f"{share:.2g} in {axis}" for axis, share in shares.items()])
    return (
        f"The inertia of the profile's hull model is less than its rigid body's ({told}), as no hull's is, so that nothing "
        "agrees with it. Fix: correct M and D in the profile (`ferryid vessel check`), or mass_kg, inertia_z or k_zz_m where "
        "that is too large, or leave M and D out, and the logs bring the hull"
    )


def _shares(profile: Profile, hull: Floats) -> dict[str, float]:
    """Return the inertia of a known hull (26,) over the rigid body's on the axes where it is too small for any vessel."""
    if not profile.hull.is_known:
        return {}
    checks = {one.name: one for one in inertia_checks(profile, mass_of(hull))}
    found = {axis: checks[f"inertia_{axis}"] for axis in AXES}
    return {axis: one.value for axis, one in found.items() if one.value < one.limit and not one.passed}
