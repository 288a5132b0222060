"""Whether a model is physically possible: its mass matrix can be one, and its damping dissipates where the vessel went."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ferryid.effects.wording import listed
from ferryid.identify.acceptance import Check
from ferryid.identify.fit_data import Coefficients, FitData
from ferryid.identify.inertia import largest_inertia, relative_inertia, rigid_body, scaled_eigenvalue
from ferryid.identify.thresholds import IDENTIFY
from ferryid.models.forces import Estimator, effective_mass
from ferryid.types import AXES, Floats
from ferryid.vessel.profile import Profile

MOST_ROWS = 10_000
"""Rows at which damping is evaluated; of more, evenly spaced ones."""
_ALONE = ("u", "v", "r")
_UNITS = ("kg", "kg", "kg·m²")
_ROUNDING = 1e-3
"""Part of a bound within which an inertia is at it."""


def light_base(profile: Profile) -> tuple[str, ...]:
    """Return that the hull model of a profile has less inertia than its rigid body, as a sentence; empty where it has not."""
    if not profile.hull.is_known:
        return ()
    checks = {one.name: one for one in inertia_checks(profile, np.asarray(profile.hull.M))}
    found = {axis: checks[f"inertia_{axis}"] for axis in AXES}
    light = [f"{one.value:.2g} in {axis}" for axis, one in found.items() if one.value < one.limit and not one.passed]
    if not light:
        return ()
    return (
        f"The inertia of the profile's hull model is less than its rigid body's ({listed(light)}), as no hull's is, and the "
        "fit starts from it. Fix: correct [hull.M] in the profile, which is rigid body and added mass together "
        "(`ferryid vessel check`).",
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


def some_of(visited: Floats) -> Floats:
    """Return the velocities that are known, at most `MOST_ROWS`, evenly spaced, shape (n, 3)."""
    nu = visited[np.isfinite(visited).all(axis=1)]
    return nu[:: max(1, -(-len(nu) // MOST_ROWS))]


def damping_checks(force: Callable[[Floats], Floats], visited: Floats) -> tuple[Check, ...]:
    """Return whether the damping of a model dissipates at the velocities that the vessel had, and somewhat beyond.

    All of the force that depends on velocity counts, but for the Coriolis force, which does no work: with the force F at
    constant velocity, the power is ``nu' (F(nu) - F(0))``. Each axis is also judged alone, the other velocities zero.

    Parameters
    ----------
    force
        Force that a constant velocity takes in still water and air, of velocities (n, 3) to (n, 3).
    visited
        Velocities of the motions, shape (n, 3).
    """
    nu = some_of(visited)
    whole = float(np.mean(np.sum(np.abs(nu * (force(nu) - force(np.zeros((1, 3))))), axis=1))) if len(nu) else 0.0
    alone = [np.where(np.arange(3) == axis, nu, 0.0) for axis in range(3)]
    checks = []
    for name, where, several in (
        ("damping", "The damping force, all axes together,", nu),
        *(
            (f"damping_{axis}", f"The damping force in pure {axis} (only {_ALONE[i]} is not zero)", alone[i])
            for i, axis in enumerate(AXES)
        ),
    ):
        shares = [_feeding_share(force, scale * several, whole) for scale in (1.0, IDENTIFY.damping_margin)]
        share = max(shares)
        passed = share <= IDENTIFY.damping_rows
        at = (
            "at the visited velocities"
            if shares[0] >= share
            else f"at {IDENTIFY.damping_margin:g} times the visited velocities"
        )
        meaning = (
            "it dissipates."
            if passed
            else "there it drives the vessel instead of damping it, and a simulation may gain speed without thrust. "
            "Do the logs excite that motion? Fix: record more of it, or take fewer terms (--components, --basis)."
        )
        checks.append(
            Check(
                name,
                passed,
                share,
                IDENTIFY.damping_rows,
                "of the rows",
                f"{where} adds energy on {100.0 * share:.1f} % of the rows {at}, and {100.0 * IDENTIFY.damping_rows:.0f} % is "
                f"allowed: {meaning}",
            )
        )
    return tuple(checks)


def _feeding_share(force: Callable[[Floats], Floats], nu: Floats, whole: float) -> float:
    """Return the share of velocities at which the damping force adds energy to the motion.

    `whole` is the mean power of damping in all axes: an axis whose damping is held at none has rounding beside it.
    """
    if not len(nu):
        return 0.0
    damping = force(nu) - force(np.zeros((1, 3)))
    power = np.sum(nu * damping, axis=1)
    usual = max(float(np.mean(np.abs(power))), IDENTIFY.damping_power * whole)
    return float(np.mean(power < -IDENTIFY.damping_power * usual))


def law_of(data: FitData, found: Coefficients) -> Estimator:
    """Return the force law of a fit's coefficients, base model included."""
    return Estimator(data.profile, data.settings.scale, data.functions, found.theta, found.intercept)


def physical_checks(data: FitData, found: Coefficients) -> tuple[Check, ...]:
    """Return whether the inertia and the damping of a fit's coefficients, base model included, can be a hull's."""
    profile, scale, functions = data.profile, data.settings.scale, data.functions
    every = (
        *inertia_checks(profile, effective_mass(profile, scale, functions.terms, found.theta), data.inertia_spans),
        *damping_checks(law_of(data, found).at_constant_velocity, data.visited),
    )
    return tuple(check for check in every if not (data.settings.reduced and check.name.endswith("_sway")))
