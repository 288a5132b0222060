"""Every basis: its functions are what their names say, units hold, its mask is symmetric, and its truth is found again."""

from __future__ import annotations

import re
from dataclasses import replace
from math import prod
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad

from ferryid.errors import FerryIdError
from ferryid.identify.adaptive.averaging import check_compatible
from ferryid.identify.adaptive.rounds import fit_motions, settings_of_model
from ferryid.identify.pipeline import fit_logs
from ferryid.identify.settings import FitSettings
from ferryid.models.forces.estimator import model_estimator
from ferryid.models.forces.residual import base_force
from ferryid.models.model import model_from_json, model_to_json
from ferryid.regression.bases import forms
from ferryid.regression.bases.basis import BASES, Basis, make_basis, with_hull_length
from ferryid.regression.bases.crossflow_integrals import crossflow_integrals
from ferryid.regression.qr import QrFactor
from ferryid.regression.simpls import fit_simpls
from ferryid.types import RunContext
from tests.identify.rounds import PROFILE, motion
from tests.regression.rows import from_rows

Floats = NDArray[np.float64]
State = dict[str, float]

NAMES = forms.basis_names()
LENGTH_M = 5.0
MIRROR = np.array([1.0, -1.0, -1.0])
ROOT = Path(__file__).resolve().parents[2]

_PART = re.compile(r"sgn\((?P<sign>[uvr])\)|\|(?P<size>[uvr])\||(?P<base>[uvr](?:_dot)?)(?:\^(?P<power>\d))?")
_STRIP = re.compile(r"(fore|aft) (x?)\|v\+xr\|\(v\+xr\)")


def built(name: str, structure: str = "coupled", length_m: float = LENGTH_M) -> Basis:
    return make_basis(with_hull_length(name, length_m, "test"), structure=structure)


def states(n: int = 200, seed: int = 0) -> tuple[Floats, Floats]:
    rng = np.random.default_rng(seed)
    return rng.normal(0, [1.0, 0.5, 0.2], (n, 3)), rng.normal(0, [0.1, 0.1, 0.05], (n, 3))


def read(name: str, at: State) -> float:
    """What a function's name says, number by number; integrals by quadrature."""
    if found := _STRIP.fullmatch(name):
        low, high = (0.0, LENGTH_M / 2.0) if found[1] == "fore" else (-LENGTH_M / 2.0, 0.0)
        turns = -at["v"] / at["r"]

        def across(x: float) -> float:
            w = at["v"] + x * at["r"]
            return (x if found[2] else 1.0) * abs(w) * w

        return float(quad(across, low, high, points=[turns] if low < turns < high else None, epsabs=1e-13)[0])
    assert _PART.sub("", name) == "", name
    return prod(
        np.sign(at[part["sign"]])
        if part["sign"]
        else abs(at[part["size"]])
        if part["size"]
        else at[part["base"]] ** int(part["power"] or 1)
        for part in _PART.finditer(name)
    )


def exponents(unit: str) -> dict[str, int]:
    """Powers of kg, m, s and rad in a unit such as N·s²/(m·rad)."""
    above, _, below = unit.partition("/")
    powers = {"kg": 0, "m": 0, "s": 0, "rad": 0}
    for side, parts in ((1, above), (-1, below.strip("()"))):
        for part in filter(None, parts.split("·")):
            symbol, power = re.fullmatch(r"([a-zN]+)([²³⁴]?)", part).groups()
            times = side * {"": 1, "²": 2, "³": 3, "⁴": 4}[power]
            for base, each in ({"kg": 1, "m": 1, "s": -2} if symbol == "N" else {symbol: 1}).items():
                powers[base] += each * times
    return powers


def test_a_file_is_a_basis() -> None:
    files = sorted(path.stem.replace("_", "-") for path in Path(forms.__file__).parent.glob("[!_]*.py"))
    assert tuple(files) == NAMES == tuple(BASES)
    assert len({form.title for form in forms.basis_forms().values()}) == len(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_the_guide_says_what_it_is(name: str) -> None:
    assert f"| `{name}` |" in (ROOT / "docs" / "guide.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", NAMES)
def test_every_function_is_what_its_name_says(name: str) -> None:
    functions = built(name)
    nu, nu_dot = states(40)
    X = functions.evaluate(nu, nu_dot)
    for row, velocity, rate in zip(X, nu, nu_dot, strict=True):
        at = dict(zip(("u", "v", "r", "u_dot", "v_dot", "r_dot"), (*velocity.tolist(), *rate.tolist()), strict=True))
        np.testing.assert_allclose(row, [read(term, at) for term in functions.terms], rtol=1e-11, atol=1e-13)
    out = np.full((len(functions.terms), len(nu)), np.nan)
    functions.fill(out, nu, nu_dot)
    np.testing.assert_array_equal(out.T, X)


@pytest.mark.parametrize("name", NAMES)
def test_no_function_occurs_twice_but_in_the_thesis(name: str) -> None:
    X = built(name).evaluate(*states(2000))
    rank = np.linalg.matrix_rank(X / np.linalg.norm(X, axis=0), tol=1e-6)
    assert rank == X.shape[1] - (3 if name == "thesis" else 0)


@pytest.mark.parametrize("name", NAMES)
def test_functions_scale_with_metre_second_and_radian_as_their_dimension_says(name: str) -> None:
    a, b, c = 1.7, 0.6, 1.3
    nu, nu_dot = states(20)
    per_axis = np.array([a, a, 1.0])
    functions = built(name)
    plain = functions.evaluate(nu, nu_dot)
    longer = replace(functions, length_m=a * functions.length_m).evaluate(nu * per_axis / b, nu_dot * per_axis / b**2)
    turned = functions.evaluate(nu * [1.0, 1.0, c], nu_dot * [1.0, 1.0, c])
    for k, term in enumerate(functions.functions):
        metre, second, radian = term.dimension
        np.testing.assert_allclose(longer[:, k], plain[:, k] * a**metre * b**second, rtol=1e-12)
        if "xr" not in term.name:
            np.testing.assert_allclose(turned[:, k], plain[:, k] * c**radian, rtol=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_coefficient_times_function_is_a_force_or_a_moment(name: str) -> None:
    functions = built(name)
    for term, units in zip(functions.functions, functions.units, strict=True):
        for unit, wanted in zip(units, ({"kg": 1, "m": 1, "s": -2},) * 2 + ({"kg": 1, "m": 2, "s": -2},), strict=True):
            found = exponents(unit)
            for symbol, power in zip(("m", "s"), term.dimension, strict=False):
                found[symbol] += power
            assert {key: found[key] for key in wanted} == wanted, (term.name, unit)
            # Radians are left out of inertia, as in every table of added mass.
            assert "_dot" in term.name or found["rad"] + term.dimension[2] == 0, (term.name, unit)


@pytest.mark.parametrize("name", NAMES)
def test_decoupled_a_mirrored_motion_takes_the_mirrored_force(name: str) -> None:
    nu, nu_dot = states()
    decoupled, coupled = built(name, "decoupled"), built(name)
    assert coupled.mask.all()
    assert decoupled.terms == coupled.terms
    assert decoupled.mask.any(axis=1).all()
    theta = np.random.default_rng(1).normal(size=decoupled.mask.shape) * decoupled.mask
    tau, mirrored = (decoupled.evaluate(nu * side, nu_dot * side) @ theta for side in (1.0, MIRROR))
    np.testing.assert_allclose(mirrored, tau * MIRROR, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("name", ["second-order", "lift"])
def test_by_symmetry_every_function_acts_where_it_can(name: str) -> None:
    """What stays the same in the mirror acts in surge, what changes sign in sway and yaw."""
    nu, nu_dot = states()
    functions = built(name, "decoupled")
    plain, mirrored = functions.evaluate(nu, nu_dot), functions.evaluate(nu * MIRROR, nu_dot * MIRROR)
    same = np.abs(mirrored - plain).max(axis=0) < 1e-12
    np.testing.assert_array_equal(functions.mask, np.column_stack([same, ~same, ~same]))


def truth(functions: Basis, seed: int) -> Floats:
    """Coefficients of the size of milliAmpère's; the same for columns that are the same, which nothing can tell apart."""
    rng = np.random.default_rng(seed)
    theta = 500.0 * rng.uniform(0.5, 1.5, functions.mask.shape) * rng.choice([-1.0, 1.0], functions.mask.shape)
    first: dict[tuple[str, ...], int] = {}
    for k, term in enumerate(functions.functions):
        theta[k] = theta[first.setdefault(term.factors, k)]
    return theta * functions.mask


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_truth_of_its_form_is_found_again(name: str) -> None:
    functions = built(name, "decoupled")
    theta, constant = truth(functions, 2), np.array([3.0, -2.0, 1.0])
    settings = FitSettings(basis=name, components=len(functions.terms), inertia="fitted", window_s=0.0)
    trial = motion(1, seconds=1200.0)
    trial = replace(trial, tau=base_force(PROFILE, trial, settings.scale) + functions.of(trial) @ theta + constant)
    model = fit_motions(PROFILE, [trial], settings).model
    assert model.settings["basis"] == functions.name
    np.testing.assert_allclose(model.theta, theta, rtol=1e-5, atol=1e-4)
    np.testing.assert_allclose(model.intercept, constant, rtol=1e-5)
    kept = model_from_json(model_to_json(model), "here")
    other = motion(2)
    expected = base_force(PROFILE, other, settings.scale) + functions.of(other) @ theta + constant
    np.testing.assert_allclose(model_estimator(kept).of(other), expected, rtol=1e-6, atol=1e-3)
    # A correction on top of it knows the basis by either name, and has nothing left to correct.
    for again in (settings, settings_of_model(kept)):
        on_top = fit_motions(PROFILE, [trial], replace(again, inertia="fitted"), base=kept).model
        np.testing.assert_allclose(on_top.theta, theta, rtol=1e-4, atol=1e-3)


@pytest.mark.parametrize("name", NAMES)
def test_a_coupled_truth_is_found_again(name: str) -> None:
    functions = built(name)
    theta = truth(functions, 3)
    X = functions.evaluate(*states(4000))
    found = fit_simpls(from_rows(QrFactor, X, X @ theta), len(functions.terms)).coefficients[-1]
    np.testing.assert_allclose(found, theta, rtol=1e-7, atol=1e-6)


def sums(v: float, r: float, length_m: float) -> tuple[float, float]:
    """Force and moment of the whole hull."""
    made = crossflow_integrals(np.array([v]), np.array([r]), length_m)
    return float(made["fore"][0] + made["aft"][0]), float(made["x_fore"][0] + made["x_aft"][0])


def test_integrals_by_hand() -> None:
    assert sums(-0.5, 0.0, 8.0) == pytest.approx((-0.25 * 8.0, 0.0), abs=1e-15)
    # Turning on the spot: the force cancels, and 2 ∫ x³ dx from 0 to L/2 is L⁴/32.
    assert sums(0.0, -0.3, 8.0) == pytest.approx((0.0, -0.09 * 8.0**4 / 32.0), rel=1e-14)
    # A turn about the stern, v = r L/2: the flow grows from 0 to r L along the hull.
    assert sums(0.8, 0.2, 8.0) == pytest.approx((0.04 * 8.0**3 / 3.0, 0.04 * (8.0**4 / 4.0 - 4.0 * 8.0**3 / 3.0)))
    assert sums(0.0, 0.0, 8.0) == (0.0, 0.0)


def test_integrals_against_quadrature_wherever_the_flow_turns_round() -> None:
    length_m = 6.0
    for place in (-4.0, -3.0, -2.9, -1.0, -1e-9, 0.0, 1e-9, 0.5, 2.999, 3.0, 40.0):
        for r in (-0.7, 1e-7, 0.2):
            v = -place * r
            made = crossflow_integrals(np.array([v]), np.array([r]), length_m)
            size = (abs(v) + abs(r) * length_m) ** 2
            for name, (low, high) in {"fore": (0.0, 3.0), "aft": (-3.0, 0.0)}.items():
                turn = [place] if low < place < high else None
                for prefix, lever in (("", lambda x: 1.0), ("x_", lambda x: x)):
                    wanted = quad(
                        lambda x, v=v, r=r, lever=lever: lever(x) * abs(v + x * r) * (v + x * r),
                        low, high, points=turn, epsabs=0.0, epsrel=1e-12,
                    )[0]  # fmt: skip
                    assert made[prefix + name][0] == pytest.approx(wanted, rel=1e-11, abs=1e-13 * size)


def test_integrals_keep_their_digits_where_the_vessel_hardly_turns() -> None:
    """∫(v + x r)² dx = v² h + v r h² + ..., to the first order in r."""
    for r in (1e-16, 1e-11, 1e-9):
        made = crossflow_integrals(np.array([2.0]), np.array([r]), 6.0)
        assert made["fore"][0] == pytest.approx(12.0 + 18.0 * r, rel=1e-15)
        assert made["x_aft"][0] == pytest.approx(-18.0 + 36.0 * r, rel=1e-15)


def test_bow_and_stern_change_places_with_the_sense_of_the_turn() -> None:
    nu, _ = states()
    one, other = crossflow_integrals(nu[:, 1], nu[:, 2], 7.0), crossflow_integrals(nu[:, 1], -nu[:, 2], 7.0)
    np.testing.assert_array_equal(one["fore"], other["aft"])
    np.testing.assert_array_equal(one["x_fore"], -other["x_aft"])


def test_a_length_in_the_name_is_all_that_it_takes() -> None:
    assert with_hull_length("cross-flow", 33.9, "boat.toml") == "cross-flow-33.9m"
    assert with_hull_length("cross-flow+wind-paper", 5.0, "boat.toml") == "cross-flow-5m+wind-paper"
    assert with_hull_length("cross-flow-4.5m", 5.0, "boat.toml") == "cross-flow-4.5m"
    assert with_hull_length("modulus", float("nan"), "boat.toml") == "modulus"
    functions = make_basis("cross-flow-4.50m+wind-paper")
    assert (functions.name, functions.length_m) == ("cross-flow-4.5m+wind-paper", 4.5)


@pytest.mark.parametrize("name", ["cross-flow", "cross-flow-0m", "cross-flow+wind-thesis"])
def test_a_length_that_is_missing_is_refused(name: str) -> None:
    with pytest.raises(
        FerryIdError, match=r'"cross-flow(-0m)?" needs the hull\'s length .* Fix: write cross-flow-5m [^\n]*$'
    ):
        make_basis(name)


@pytest.mark.parametrize("name", ["modulus-5m", "cross-flow-m", "cross-flow--5m"])
def test_a_length_that_is_not_wanted_is_refused(name: str) -> None:
    with pytest.raises(FerryIdError, match=f'no basis called "{name}". Did you mean'):
        make_basis(name)


def test_a_profile_without_length_is_told_so_before_any_log_is_read(tmp_path: Path) -> None:
    nameless = replace(PROFILE, hull=replace(PROFILE.hull, length_m=float("nan")), path="boat.toml")
    settings = FitSettings(basis="cross-flow", components=6)
    wanted = r"^boat\.toml: the basis cross-flow needs the hull's length.* Fix: [^\n]*--basis cross-flow-5m[^\n]*$"
    with pytest.raises(FerryIdError, match=wanted):
        fit_logs(["nowhere.mcap"], nameless, settings, RunContext(tmp_path))
    with pytest.raises(FerryIdError, match=wanted):
        fit_motions(nameless, [motion(1)], settings)
    said = fit_motions(nameless, [motion(1)], replace(settings, basis="cross-flow-4m")).model
    assert said.settings["basis"] == "cross-flow-4m"


def test_models_over_different_lengths_do_not_add_up() -> None:
    one, other = (
        fit_motions(PROFILE, [motion(1)], FitSettings(basis=f"cross-flow-{metres}m", components=6)).model
        for metres in (5, 6)
    )
    assert one.terms == other.terms
    with pytest.raises(FerryIdError, match="its basis is cross-flow-6m"):
        check_compatible([one, other])
    with pytest.raises(FerryIdError, match="its basis cross-flow-6m must be that of the fit"):
        fit_motions(PROFILE, [motion(1)], FitSettings(basis="cross-flow", components=6), base=other)
