"""Whether a model is physically possible: its mass matrix can be one, and its damping dissipates where the vessel went."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ferryid.identify.acceptance import Check
from ferryid.identify.fit_data import Coefficients, FitData
from ferryid.identify.inertia import inertia_checks
from ferryid.identify.thresholds import IDENTIFY
from ferryid.models.forces import Estimator, effective_mass
from ferryid.types import AXES, Floats

MOST_ROWS = 10_000
"""Rows at which damping is evaluated; of more, evenly spaced ones."""
_ALONE = ("u", "v", "r")


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
