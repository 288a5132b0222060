"""Bases: the functions of the thesis and the paper, and what they must be able to express."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from ferryid.errors import FerryIdError
from ferryid.regression.bases.basis import make_basis, relative_flow
from ferryid.vessel import load_profile
from ferryid.vessel.hull import inverse_dynamics
from ferryid.vessel.wind import wind_force

Floats = NDArray[np.float64]

PROFILE = load_profile("milliampere")


def states(n: int = 400, seed: int = 0) -> tuple[Floats, Floats]:
    rng = np.random.default_rng(seed)
    return rng.normal(0, [1.0, 0.5, 0.2], (n, 3)), rng.normal(0, [0.1, 0.1, 0.05], (n, 3))


def test_the_thesis_basis_is_3_4_written_out() -> None:
    nu, nu_dot = states()
    (u, v, r), (u_dot, v_dot, r_dot) = nu.T, nu_dot.T
    sgn = np.sign
    expected = np.column_stack(
        (
            *(u_dot, v_dot, r_dot, u * v, u * r, v * r, r * r, u, v, r),
            *(sgn(u) * u**2, sgn(v) * v**2, sgn(r) * r**2, u**3, v**3, r**3),
            *(abs(u) * u, abs(v) * v, abs(r) * r, abs(v) * r, abs(r) * v),
        )
    )
    thesis = make_basis("thesis")
    assert len(thesis.terms) == 21
    np.testing.assert_allclose(thesis.evaluate(nu, nu_dot), expected, rtol=1e-15)


def test_the_thesis_basis_has_three_pairs_of_identical_columns_and_modulus_has_none() -> None:
    nu, nu_dot = states()
    thesis, modulus = make_basis("thesis"), make_basis("modulus")
    columns = list(zip(thesis.terms, thesis.evaluate(nu, nu_dot).T, strict=True))
    twins = {(a, b) for i, (a, x) in enumerate(columns) for b, y in columns[i + 1 :] if np.array_equal(x, y)}
    assert twins == {("sgn(u)u^2", "|u|u"), ("sgn(v)v^2", "|v|v"), ("sgn(r)r^2", "|r|r")}
    assert np.linalg.matrix_rank(thesis.evaluate(nu, nu_dot)) == 18
    assert np.linalg.matrix_rank(modulus.evaluate(nu, nu_dot)) == len(modulus.terms) == 18


def fitted(columns: Floats, target: Floats) -> Floats:
    """What least squares makes of a target, scaled columns."""
    size = np.linalg.norm(columns, axis=0)
    solution: Floats = (columns / size) @ np.linalg.lstsq(columns / size, target, rcond=None)[0]
    return solution


@pytest.mark.parametrize("structure", ["coupled", "decoupled"])
@pytest.mark.parametrize("name", ["thesis", "modulus"])
def test_every_hull_of_the_model_lies_in_the_span_on_the_axes_that_the_mask_allows(name: str, structure: str) -> None:
    rng = np.random.default_rng(3)
    nu, nu_dot = states()
    functions = make_basis(name, structure=structure)
    X = functions.evaluate(nu, nu_dot)
    M = np.array([[2000.0, 0, 0], [0, 2500.0, 60.0], [0, 30.0, 5000.0]]) * rng.uniform(0.5, 1.5, (3, 3))
    D = {key: value * rng.uniform(0.5, 1.5) for key, value in {**PROFILE.hull.D, "N_rrr": -50.0}.items()}
    tau = inverse_dynamics(replace(PROFILE.hull, M=M, D=D), nu_dot, nu)
    for axis in range(3):
        target = tau[:, axis]
        allowed = X[:, functions.mask[:, axis]]
        np.testing.assert_allclose(fitted(allowed, target), target, atol=1e-9 * np.abs(target).max())


def test_the_decoupled_mask_keeps_surge_apart() -> None:
    functions = make_basis("modulus", structure="decoupled")
    surge = [term for term, row in zip(functions.terms, functions.mask, strict=True) if row[0]]
    assert surge == ["u_dot", "vr", "rr", "u", "u^3", "|u|u"]
    assert not np.any(functions.mask[:, 0] & (functions.mask[:, 1] | functions.mask[:, 2]))
    assert functions.mask.any(axis=1).all()
    assert make_basis("modulus").mask.all()


def flow(n: int, seed: int) -> tuple[Floats, Floats]:
    rng = np.random.default_rng(seed)
    return rng.uniform(-np.pi, np.pi, n), rng.normal(0, 5, (n, 2))


def wind_columns(form: str, seed: int = 1) -> tuple[dict[str, Floats], Floats, Floats, Floats, Floats]:
    nu, nu_dot = states()
    psi, wind = flow(len(nu), seed)
    # Written out from (2.15)-(2.16), apart from the implementation.
    u_rw = nu[:, 0] - (np.cos(psi) * wind[:, 0] + np.sin(psi) * wind[:, 1])
    v_rw = nu[:, 1] - (-np.sin(psi) * wind[:, 0] + np.cos(psi) * wind[:, 1])
    V2, gamma = u_rw**2 + v_rw**2, -np.arctan2(v_rw, u_rw)
    functions = make_basis("modulus", wind=form)
    X = functions.evaluate(nu, nu_dot, relative_flow(nu, psi, wind))
    return dict(zip(functions.terms, X.T, strict=True)), V2, gamma, psi, wind


@pytest.mark.parametrize("form", ["thesis", "paper"])
def test_the_wind_functions_are_3_6_and_18(form: str) -> None:
    columns, V2, gamma, _, _ = wind_columns(form)
    expected = {"V_rw^2 cos(gamma_rw)": V2 * np.cos(gamma), "V_rw^2 sin(gamma_rw)": V2 * np.sin(gamma)}
    if form == "thesis":
        expected["V_rw^2 sin(2gamma_rw)"] = V2 * np.sin(2 * gamma)
    else:
        expected["V_rw^2 sin(gamma_rw)gamma_rw"] = V2 * gamma * np.sin(gamma)
    assert list(columns)[18:] == list(expected)
    for name, values in expected.items():
        np.testing.assert_allclose(columns[name], values, rtol=1e-12, atol=1e-12)


def test_wind_load_without_cross_flow_correction_is_exactly_two_of_the_functions() -> None:
    columns, _, _, psi, wind = wind_columns("thesis")
    assert PROFILE.wind is not None
    # With delta = 0 Blendermann's denominator is 1, and surge and sway are pure cosine and sine.
    tau = wind_force(replace(PROFILE.wind, delta=0.0), wind, psi, states()[0])
    for axis, name in enumerate(("V_rw^2 cos(gamma_rw)", "V_rw^2 sin(gamma_rw)")):
        column = columns[name][:, None]
        np.testing.assert_allclose(fitted(column, tau[:, axis]), tau[:, axis], atol=1e-9)


def test_the_current_functions_are_3_7_and_19() -> None:
    nu, nu_dot = states()
    psi, water = flow(len(nu), 2)
    relative = relative_flow(nu, psi, water)
    V2, gamma = np.sum(relative**2, axis=1), -np.arctan2(relative[:, 1], relative[:, 0])
    c, s = np.cos(gamma), np.sin(gamma)
    for form, expected in {
        "thesis": [V2 * c * abs(c), V2 * s * abs(s), V2 * s, V2 * np.sin(2 * gamma)],
        "paper": [V2 * c, V2 * s, V2 * s * gamma],
    }.items():
        functions = make_basis("modulus", current=form)
        X = functions.evaluate(nu, nu_dot, current_rel=relative)[:, 18:]
        np.testing.assert_allclose(X, np.column_stack(expected), rtol=1e-12, atol=1e-12)


def test_still_air_and_water_give_zero_not_nan() -> None:
    still = np.zeros((2, 3))
    functions = make_basis("modulus+wind-paper+current-thesis")
    X = functions.evaluate(still, still, np.zeros((2, 2)), np.zeros((2, 2)))
    np.testing.assert_array_equal(X, 0.0)


def test_a_name_says_everything_and_comes_back_as_it_went_in() -> None:
    functions = make_basis("thesis", wind="paper", current="thesis", structure="decoupled")
    assert functions.name == "thesis+wind-paper+current-thesis"
    assert make_basis(functions.name, structure="decoupled").terms == functions.terms
    assert len(functions.terms) == 21 + 3 + 4
    assert (functions.needs_wind, functions.needs_current) == (True, True)
    assert (make_basis("thesis").needs_wind, make_basis("thesis").needs_current) == (False, False)


@settings(max_examples=30, deadline=None)
@given(n=st.integers(1, 50), cut=st.integers(0, 50))
def test_rows_do_not_know_of_each_other(n: int, cut: int) -> None:
    nu, nu_dot = states(n)
    functions = make_basis("thesis")
    whole = functions.evaluate(nu, nu_dot)
    parts = [functions.evaluate(nu[part], nu_dot[part]) for part in (slice(0, cut), slice(cut, None))]
    np.testing.assert_array_equal(whole, np.vstack(parts))
    out = np.empty((21, n))
    functions.fill(out, nu, nu_dot)
    np.testing.assert_array_equal(out.T, whole)


def test_units_of_coefficients() -> None:
    functions = make_basis("modulus+wind-thesis+current-thesis")
    units = dict(zip(functions.terms, functions.units, strict=True))
    assert units["u_dot"] == ("kg", "kg", "kg·m")
    assert units["r_dot"] == ("kg·m", "kg·m", "kg·m²")
    assert units["u"] == ("kg/s", "kg/s", "N·s")
    assert units["r"] == ("N·s/rad", "N·s/rad", "N·m·s/rad")
    assert units["|u|u"] == ("N·s²/m²", "N·s²/m²", "N·s²/m")
    assert units["ur"] == ("N·s²/(m·rad)", "N·s²/(m·rad)", "N·s²/rad")
    assert units["r^3"] == ("N·s³/rad³", "N·s³/rad³", "N·m·s³/rad³")
    assert units["V_rw^2 sin(2gamma_rw)"] == ("N·s²/m²", "N·s²/m²", "N·s²/m")


def test_unknown_names_and_missing_measurements_are_refused() -> None:
    with pytest.raises(FerryIdError, match=r'no basis called "modulo". Did you mean "modulus"\? Fix: '):
        make_basis("modulo")
    with pytest.raises(FerryIdError, match=r'no wind basis called "pper". Did you mean "paper"\?'):
        make_basis("modulus+wind-pper")
    with pytest.raises(FerryIdError, match=r'no structure called "couple". Did you mean "coupled"\?'):
        make_basis("modulus", structure="couple")
    nu, nu_dot = states(3)
    with pytest.raises(FerryIdError, match="needs wind, and there is none"):
        make_basis("modulus+wind-thesis").evaluate(nu, nu_dot)
