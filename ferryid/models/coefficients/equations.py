"""The coefficients of the equations of motion in a model, whatever the base model and the terms of a fit have of each."""

from __future__ import annotations

from ferryid.effects.force_model import COEFFICIENTS, LIFT, MASS, UNITS
from ferryid.models.coefficients.intervals import coefficient_intervals, opposite, term_interval
from ferryid.models.forces import model_estimator
from ferryid.models.model import Model
from ferryid.types import Floats

PRODUCTS = (
    ("vr in surge", "vr", 0, "kg"),
    ("rr in surge", "rr", 0, "kg·m"),
    ("uv in sway", "uv", 1, "kg/m"),
    ("ur in sway", "ur", 1, "kg"),
    ("uv in yaw", "uv", 2, "kg"),
    ("ur in yaw", "ur", 2, "kg·m"),
)
"""Products of two velocities, their term, axis and unit: Coriolis force and lift, which no log can tell apart."""
CUBES = (("Y_rrr", "r^3", 1, "kg·m·s"), ("N_vvv", "v^3", 2, "kg·s/m"))
"""Damping that no profile has and a fit may find."""
_HULL = dict(zip(COEFFICIENTS, UNITS, strict=True))
EQUATION_UNITS = {
    **{name: _HULL[name] for name in MASS},
    **{name: unit for name, _, _, unit in PRODUCTS},
    **{name: unit for name, unit in _HULL.items() if name not in (*MASS, *LIFT)},
    **{name: unit for name, _, _, unit in CUBES},
}
"""Every coefficient in the order in which they are listed, and its unit."""


def equation_coefficients(model: Model) -> dict[str, Floats]:
    """Return value, low and high of every coefficient of a model, base model and terms together, shape (3,) each.

    Ends of the interval are NaN where a coefficient is the base model's.
    """
    found = coefficient_intervals(model)
    force = model_estimator(model)
    # The Coriolis force is that of the base model's mass: a correction of the inertia does not reach it.
    M = force.profile.hull.M * force.scale.get("delta", 1.0) / force.scale.get("zeta", 1.0)
    m11, m22, cross = M[0, 0], M[1, 1], (M[1, 2] + M[2, 1]) / 2.0
    coriolis = (-m22, -cross, 0.0, m11, m22 - m11, cross)
    for (name, term, axis, _), turning in zip(PRODUCTS, coriolis, strict=True):
        lift = f"{'XYN'[axis]}_{term}"
        found[name] = turning + (opposite(found[lift]) if lift in LIFT else term_interval(model, term, axis))
    for name, term, axis, _ in CUBES:
        found[name] = opposite(term_interval(model, term, axis))
    return found
