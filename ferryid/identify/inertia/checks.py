"""Whether an effective mass matrix is one that a hull can have."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ferryid.effects.wording import listed
from ferryid.identify.acceptance import Check
from ferryid.identify.inertia.shares import largest_inertia, relative_inertia, rigid_body, scaled_eigenvalue
from ferryid.identify.thresholds import IDENTIFY
from ferryid.types import AXES, Floats
from ferryid.vessel.profile import Profile

_UNITS = ("kg", "kg", "kg·m²")
_ROUNDING = 1e-3
"""Part of a bound within which an inertia is at it."""


def light_axes(profile: Profile, mass: Floats) -> dict[str, float]:
    """Return an effective mass matrix, shape (3, 3), over the rigid body's on the axes where it is too small for any hull."""
    shares = zip(AXES, relative_inertia(profile, mass).tolist(), strict=True)
    return {axis: share for axis, share in shares if share < IDENTIFY.least_inertia * (1.0 - _ROUNDING)}


def why_too_light(profile: Profile) -> str:
    """Return that a profile's hull model has less inertia than its rigid body, as a sentence without an end.

    Empty where it has not, and where there is no hull model that estimates lean on.
    """
    light = light_axes(profile, np.asarray(profile.hull.M)) if profile.hull.is_known else {}
    told = listed([f"{share:.2g} in {axis}" for axis, share in light.items()])
    return f"The inertia of the profile's hull model is less than its rigid body's ({told}), as no hull's is" * bool(
        light
    )


def inertia_checks(profile: Profile, mass: Floats, spans: Floats | None = None) -> tuple[Check, ...]:
    """Return whether an effective mass matrix, shape (3, 3), is one that a hull can have.

    An inertia at its upper bound counts against a model unless the data leave open whether it is below.

    Parameters
    ----------
    profile
        The vessel.
    mass
        The matrix.
    spans
        Between which inertias the truth lies on each axis, shape (3, 2); NaN or None where nothing is known of it.
    """
    spans = np.full((3, 2), np.nan) if spans is None else spans
    smallest = scaled_eigenvalue(profile, mass)
    says = f"The smallest eigenvalue of the effective mass matrix is {smallest:.3g} of the rigid body's and must be above 0"
    checks = [
        Check(
            "mass_matrix",
            smallest > 0.0,
            smallest,
            0.0,
            "of the rigid body's",
            f"{says}: the matrix is positive definite."
            if smallest > 0.0
            else f"{says}: a force in some direction would accelerate the model backwards, and it cannot be simulated.",
        )
    ]
    largest, of_axis = largest_inertia(profile, mass)
    for number, (axis, share) in enumerate(zip(AXES, relative_inertia(profile, mass).tolist(), strict=True)):
        low, high = IDENTIFY.least_inertia, IDENTIFY.most_inertia
        lowest, highest = low * (1.0 - _ROUNDING), high * (1.0 + _ROUNDING)
        # Only the upper bound counts against a model: noise takes some inertia, but nothing gives that much of it.
        coupled = number == of_axis and largest > high * (1.0 - _ROUNDING) >= share
        at_most = coupled or share > high * (1.0 - _ROUNDING)
        possible: bool | None = lowest <= share and not at_most
        if low * (1.0 + _ROUNDING) < share and not at_most:
            meaning = "it is possible"
        elif at_most and (largest if coupled else share) <= highest:
            # A mass is weighed, a moment of inertia mostly guessed, and a lever arm is as good as a thrust.
            small, rest = (
                (", the inertia of the profile too small", "position_m of the actuators, inertia_z or k_zz_m")
                if axis == "yaw"
                else ("", "mass_kg")
            )
            told, least = ("", float("nan")) if coupled else _span(spans[number], axis)
            rigid = float(np.diag(rigid_body(profile.hull))[number])
            if told and low * rigid <= least <= high * rigid:
                possible = None
                meaning = (
                    f"it is held at that bound, and the data do not determine it. {told}. Do not rely on it. To narrow it, "
                    "record thrust that changes often and abruptly, from rest too, or state a shorter window_s at the top of "
                    "the profile"
                )
            else:
                told = f" {told}." if told else ""
                admits = f", more than {least / high:.2g} {_UNITS[number]} to admit that much" if told else ""
                meaning = (
                    "it is held at that bound, and the data would have more, which no hull has: the applied force may be "
                    f"too large or of the wrong sign{small}, or the actuators were not engaged.{told} Fix: in the profile, "
                    f"correct the unit and sign of the actuators' signals, the thrust curve{',' if small else ' or'} {rest}"
                    f"{admits}"
                )
        elif possible:
            meaning = "it is held at that bound, beyond which the data would have it"
        elif share < low:
            meaning = "added mass only adds, so that the model is too light there"
        else:
            meaning = "no hull carries that much added mass"
        checks.append(
            Check(
                f"inertia_{axis}",
                possible,
                share,
                high if at_most else low,
                "of the rigid body's",
                f"The effective inertia in {axis} is {share:.2f} times the rigid body's"
                f"{f', {largest:.2f} with its coupling to the other axes' if coupled else ''}, and {low:g} to {high:g} is "
                f"possible: {meaning}.",
            )
        )
    return tuple(checks)


def undetermined(checks: Sequence[Check]) -> tuple[str, ...]:
    """Return the axes of which `inertia_checks` leave open whether their inertia, held at its upper bound, is possible."""
    return tuple(axis for axis in AXES for one in checks if one.name == f"inertia_{axis}" and one.passed is None)


def _span(span: Floats, axis: str) -> tuple[str, float]:
    """Return between what an inertia lies, as a sentence, and the least of it; none where force says hardly anything of it."""
    least, most = span.tolist()
    if not least >= IDENTIFY.followed * most:
        return "", float("nan")
    unit, force = _UNITS[AXES.index(axis)], "moment" if axis == "yaw" else "force"
    return (
        f"The {force} explains acceleration with {most:.3g} {unit}, acceleration the {force} with {least:.3g} {unit}, and the "
        f"truth lies between: where damping balances most of the {force} within the windows, what acts beside it makes the "
        "inertia look too large"
    ), least
