"""Models in physics, side by side: the coefficients of their equations of motion, their terms, and what a diagnosis found."""

from __future__ import annotations

from collections.abc import Sequence

from ferryid.compare.candidates import Candidate
from ferryid.compare.comparison_result import Coefficient, CoefficientRow, EffectInModel, EffectRow, TermRow
from ferryid.effects.force_model import COEFFICIENTS, LIFT, MASS, UNITS
from ferryid.models import Model, StoredEffect
from ferryid.models.coefficients import coefficient_intervals, opposite, term_interval
from ferryid.models.forces import MAPPED, model_estimator
from ferryid.types import AXES, Floats

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
CONSTANT = "1"
"""Name of the constant among the terms, as in a model file."""


def coefficient_rows(candidates: Sequence[Candidate]) -> tuple[CoefficientRow, ...]:
    """Return the coefficients of the equations of motion, base model and correction counted together.

    With these the force that a motion takes in still water and without wind is::

        X = m11 u' + (vr) v r + (rr) r² - X_u u - X_|u|u |u| u - X_uuu u³
        Y = m22 v' + m23 r' + (uv) u v + (ur) u r - Y_v v - Y_|v|v |v| v - Y_|r|v |r| v - Y_vvv v³
            - Y_r r - Y_|v|r |v| r - Y_|r|r |r| r - Y_rrr r³
        N = m32 v' + m33 r' + (uv) u v + (ur) u r - N_v v - ... - N_vvv v³ - N_r r - ... - N_rrr r³

    and the terms that are no hull's, such as the constant, come on top. Intervals are 95 %; a base model has none.
    """
    known = [_effective(one.model) for one in candidates]
    rows = []
    for name, unit in _UNITS.items():
        values = {one.label: Coefficient(*found[name].tolist()) for one, found in zip(candidates, known, strict=True)}
        if any(one.value != 0.0 for one in values.values()):
            rows.append(CoefficientRow(name, unit, values))
    return tuple(rows)


_HULL = dict(zip(COEFFICIENTS, UNITS, strict=True))
_UNITS = {
    **{name: _HULL[name] for name in MASS},
    **{name: unit for name, _, _, unit in PRODUCTS},
    **{name: unit for name, unit in _HULL.items() if name not in (*MASS, *LIFT)},
    **{name: unit for name, _, _, unit in CUBES},
}


def _effective(model: Model) -> dict[str, Floats]:
    """Return value, low and high of every coefficient, shape (3,) each."""
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


def term_rows(candidates: Sequence[Candidate]) -> tuple[TermRow, ...]:
    """Return the terms of the corrections, on every axis on which a model has them, as they stand in the model files."""
    rows = []
    for term in dict.fromkeys((*(term for one in candidates for term in one.model.terms), CONSTANT)):
        for axis, name in enumerate(AXES):
            values, unit = {}, ""
            for one in candidates:
                found = _raw(one.model, term, axis)
                if found is not None:
                    unit, values[one.label] = found
            if any(one.value != 0.0 for one in values.values()):
                rows.append(TermRow(term, name, unit, values))
    return tuple(rows)


def _raw(model: Model, term: str, axis: int) -> tuple[str, Coefficient] | None:
    if term == CONSTANT:
        interval = (model.intercept[axis], model.intercept_low[axis], model.intercept_high[axis])
        return ("N·m" if axis == 2 else "N"), Coefficient(*map(float, interval))
    if term not in model.terms:
        return None
    k = model.terms.index(term)
    interval = (model.theta[k, axis], model.low[k, axis], model.high[k, axis])
    return model.units[k][axis], Coefficient(*map(float, interval))


def is_of_a_hull(term: str, axis: str) -> bool:
    """Tell whether a term of a correction is counted in among the coefficients of the equations of motion."""
    place = (term, AXES.index(axis))
    mapped = {place for places in MAPPED.values() for place in places}
    return place in mapped | {(term, axis) for _, term, axis, _ in (*PRODUCTS, *CUBES)}


def effect_rows(candidates: Sequence[Candidate]) -> tuple[EffectRow, ...]:
    """Return the effects that are not the same in all models: of the vessel, then of the logs that each was diagnosed on."""
    known = {one.label: _all(one.model) for one in candidates if not one.is_base}
    rows = []
    for key in dict.fromkeys(key for effects_of in known.values() for key in effects_of):
        log, _, effect, instance = key
        row = EffectRow(
            effect, instance, log or None, {label: _in_model(known_of.get(key)) for label, known_of in known.items()}
        )
        # As plain data: an end of an interval that is not known is no difference.
        first, *others = row.to_json()["values"].values()
        if any(other != first for other in others):
            rows.append(row)
    return tuple(rows)


def _all(model: Model) -> dict[tuple[str, str, str, str | None], StoredEffect]:
    return {
        **{("", "", *one.key): one for one in model.vessel_effects},
        **{(known.log, known.sha256, *one.key): one for known in model.conditions for one in known.effects},
    }


def _in_model(stored: StoredEffect | None) -> EffectInModel | None:
    return None if stored is None else EffectInModel(stored.parameters, stored.says())
