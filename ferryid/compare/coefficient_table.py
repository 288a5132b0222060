"""Models in physics, side by side: the coefficients of their equations of motion, their terms, and what a diagnosis found."""

from __future__ import annotations

from collections.abc import Sequence

from ferryid.compare.candidates import Candidate
from ferryid.compare.comparison_result import Coefficient, CoefficientRow, EffectInModel, EffectRow, TermRow
from ferryid.models import Model, StoredEffect
from ferryid.models.coefficients import CUBES, EQUATION_UNITS, PRODUCTS, equation_coefficients
from ferryid.models.forces import MAPPED
from ferryid.types import AXES

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
    known = [equation_coefficients(one.model) for one in candidates]
    rows = []
    for name, unit in EQUATION_UNITS.items():
        values = {one.label: Coefficient(*found[name].tolist()) for one, found in zip(candidates, known, strict=True)}
        if any(one.value != 0.0 for one in values.values()):
            rows.append(CoefficientRow(name, unit, values))
    return tuple(rows)


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
