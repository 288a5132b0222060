"""Coefficients in physics: written out as equations of motion they give the model's own force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.compare.candidates import Candidate
from ferryid.compare.coefficient_table import coefficient_rows, effect_rows, is_of_a_hull, term_rows
from ferryid.models.forces.estimator import model_estimator
from ferryid.models.model import Model, blank_model
from ferryid.report.comparison_words import render_effects
from ferryid.types import AXES
from ferryid.vessel import load_profile
from tests.export.models import MODELS, fitted

PROFILE = load_profile("milliampere")


def equations(model: Model, nu: np.ndarray, nu_dot: np.ndarray) -> np.ndarray:
    """Return the force on states of shape (n, 3) from nothing but the rows, as their documentation writes it out."""
    candidates = [Candidate("it", model)]
    c = {row.coefficient: row.values["it"].value for row in coefficient_rows(candidates)}
    found: set[str] = set()

    def of(name: str) -> float:
        found.add(name)
        return float(c.get(name, 0.0))

    u, v, r = nu.T
    up, vp, rp = nu_dot.T
    X = of("m11") * up + of("vr in surge") * v * r + of("rr in surge") * r**2
    X -= of("X_u") * u + of("X_|u|u") * np.abs(u) * u + of("X_uuu") * u**3
    turning = [of("m22") * vp + of("m23") * rp, of("m32") * vp + of("m33") * rp]
    for k, (axis, letter) in enumerate((("sway", "Y"), ("yaw", "N"))):
        turning[k] = turning[k] + of(f"uv in {axis}") * u * v + of(f"ur in {axis}") * u * r
        for name, product in (
            *(("v", v), ("|v|v", np.abs(v) * v), ("|r|v", np.abs(r) * v), ("vvv", v**3)),
            *(("r", r), ("|v|r", np.abs(v) * r), ("|r|r", np.abs(r) * r), ("rrr", r**3)),
        ):
            turning[k] = turning[k] - of(f"{letter}_{name}") * product
    assert set(c) <= found
    force = np.column_stack([X, *turning])
    values = {
        **dict(zip(("u", "v", "r"), nu.T, strict=True)),
        **dict(zip(("u_dot", "v_dot", "r_dot"), nu_dot.T, strict=True)),
        **{f"|{name}|{name}": np.abs(one) * one for name, one in (("u", u), ("v", v), ("r", r))},
        **{f"sgn({name}){name}^2": np.abs(one) * one for name, one in (("u", u), ("v", v), ("r", r))},
        **{f"{name}^3": one**3 for name, one in (("u", u), ("v", v), ("r", r))},
        "|v|r": np.abs(v) * r,
        "|r|v": np.abs(r) * v,
        "uv": u * v,
        "ur": u * r,
        "vr": v * r,
        "rr": r * r,
        "1": 1.0,
    }
    for row in term_rows(candidates):
        if not is_of_a_hull(row.term, row.axis):
            force[:, AXES.index(row.axis)] += row.values["it"].value * values[row.term]
    return force


@pytest.mark.parametrize("basis", ["modulus", "thesis"])
@pytest.mark.parametrize("structure", ["coupled", "decoupled"])
@pytest.mark.parametrize("scale", [{}, {"delta": 0.7, "sigma": 1.6, "zeta": 0.8}])
def test_the_equations_of_motion_are_those_of_the_model(basis: str, structure: str, scale: dict[str, float]) -> None:
    model = fitted(basis, structure, seed=3, **scale)
    rng = np.random.default_rng(1)
    nu, nu_dot = rng.normal(size=(50, 3)), rng.normal(size=(50, 3))
    expected = model_estimator(model)(nu_dot, nu, np.zeros(50), None, None)
    assert equations(model, nu, nu_dot) == pytest.approx(expected, rel=1e-9, abs=1e-6)


def test_so_are_those_of_a_diagnosed_model() -> None:
    model = MODELS["diagnosed"].undiagnosed()
    model = replace(model, hull=MODELS["diagnosed"].hull)
    rng = np.random.default_rng(2)
    nu, nu_dot = rng.normal(size=(20, 3)), rng.normal(size=(20, 3))
    expected = model_estimator(model)(nu_dot, nu, np.zeros(20), None, None)
    assert equations(model, nu, nu_dot) == pytest.approx(expected, rel=1e-9, abs=1e-6)


def test_a_base_model_has_the_coefficients_of_its_profile() -> None:
    rows = {row.coefficient: row for row in coefficient_rows([Candidate("base", blank_model(PROFILE, "base"))])}
    assert rows["m22"].values["base"].value == PROFILE.hull.M[1, 1]
    assert rows["m22"].unit == "kg"
    assert rows["N_r"].values["base"].value == PROFILE.hull.D["N_r"]
    assert np.isnan(rows["N_r"].values["base"].low)
    # The Munk moment.
    assert rows["uv in yaw"].values["base"].value == pytest.approx(PROFILE.hull.M[1, 1] - PROFILE.hull.M[0, 0])


def test_intervals_are_those_of_the_model_file_and_turn_with_the_sign() -> None:
    """Those of a bootstrap, which need not lie evenly about the value."""
    model = fitted("modulus", "decoupled")
    low, high = model.low.copy(), model.high.copy()
    for axis, term in ((0, "u"), (1, "ur"), (2, "r_dot")):
        k = model.terms.index(term)
        low[k, axis], high[k, axis] = model.theta[k, axis] - 7.0, model.theta[k, axis] + 5.0
    rows = {
        row.coefficient: row.values["it"]
        for row in coefficient_rows([Candidate("it", replace(model, low=low, high=high))])
    }
    for name, below, above in (("X_u", 5.0, 7.0), ("ur in sway", 7.0, 5.0), ("m33", 7.0, 5.0)):
        assert rows[name].value - rows[name].low == pytest.approx(below)
        assert rows[name].high - rows[name].value == pytest.approx(above)


def test_effects_that_differ_are_told_for_every_model() -> None:
    found, bare = MODELS["diagnosed"], MODELS["diagnosed"].undiagnosed()
    rows = effect_rows([Candidate("with", found), Candidate("without", bare)])
    assert len(rows) == len(found.vessel_effects) + sum(len(one.effects) for one in found.conditions)
    assert all(row.values["without"] is None and row.values["with"] for row in rows)
    lines = render_effects(rows)
    assert "  without: not in it" in lines
    assert any("a property of the vessel" in line for line in lines)
    assert effect_rows([Candidate("a", found), Candidate("b", replace(found, version=9))]) == ()
