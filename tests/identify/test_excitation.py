"""Excitation: what is named as undetermined is, and what can be determined is not."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from ferryid.identify.excitation import assess_excitation, heading_coverage
from ferryid.models.validity import range_columns, validity_ranges
from ferryid.regression.collinearity import singular_values, undetermined_terms
from ferryid.regression.cross_products import CrossProducts
from ferryid.regression.qr import QrFactor
from ferryid.signals.track import Motion
from tests.regression.rows import from_rows

Floats = NDArray[np.float64]
KINDS = (CrossProducts, QrFactor)
TERMS = ("a", "b", "c", "d", "e")


def independent(n: int = 800, K: int = 5) -> Floats:
    return np.random.default_rng(0).standard_normal((n, K))


def source(kind, X: Floats) -> CrossProducts | QrFactor:
    return from_rows(kind, X, np.zeros((len(X), 1)))


@pytest.mark.parametrize("kind", KINDS)
def test_singular_values_are_those_of_the_correlation_matrix(kind) -> None:
    X = independent() * [1.0, 1e5, 1.0, 1.0, 1e-4] + 3.0
    X[:, 2] = X[:, 3]
    values = singular_values(source(kind, X))
    want = np.sqrt(np.maximum(np.linalg.eigvalsh(np.corrcoef(X, rowvar=False))[::-1], 0.0))
    np.testing.assert_allclose(values, want, atol=1e-7)
    assert values[-1] == 0.0


@pytest.mark.parametrize("kind", KINDS)
def test_a_well_excited_basis_is_determined(kind) -> None:
    assert undetermined_terms(source(kind, independent() * np.geomspace(1.0, 1e8, 5)), TERMS) == {}


@pytest.mark.parametrize("kind", KINDS)
def test_constant_duplicate_and_mirrored_terms_are_named(kind) -> None:
    X = independent()
    X[:, 1], X[:, 3], X[:, 4] = 0.1, 7.0 * X[:, 0], -X[:, 2]
    assert undetermined_terms(source(kind, X), TERMS) == {
        "a": "same column as d in this log",
        "b": "does not vary in this log",
        "c": "same column as minus e in this log",
        "d": "same column as a in this log",
        "e": "same column as minus c in this log",
    }


@pytest.mark.parametrize("kind", KINDS)
def test_an_exact_dependence_names_all_who_share_it(kind) -> None:
    X = independent()
    X[:, 4] = X[:, 0] - 2.0 * X[:, 2]
    found = undetermined_terms(source(kind, X), TERMS)
    assert found == {
        "a": "linear combination of c, e in this log",
        "c": "linear combination of a, e in this log",
        "e": "linear combination of a, c in this log",
    }


@pytest.mark.parametrize("kind", KINDS)
def test_a_duplicate_is_not_counted_again_in_a_dependence(kind) -> None:
    X = independent()
    X[:, 3], X[:, 4] = X[:, 0], X[:, 0] - 2.0 * X[:, 2]
    found = undetermined_terms(source(kind, X), TERMS)
    assert found == {
        "a": "same column as d in this log",
        "c": "linear combination of a, e in this log",
        "d": "same column as a in this log",
        "e": "linear combination of a, c in this log",
    }


@pytest.mark.parametrize("kind", KINDS)
def test_a_near_dependence_is_named_above_the_limit_alone(kind) -> None:
    X = independent()
    X[:, 4] = X[:, 1] + 1e-3 * X[:, 4]
    found = undetermined_terms(source(kind, X), TERMS)
    assert set(found) == {"b", "e"}
    assert found["b"].startswith("nearly a combination of e (condition index ")
    assert undetermined_terms(source(kind, X), TERMS, limit=1e4) == {}


@pytest.mark.parametrize("kind", KINDS)
def test_terms_are_tied_only_where_an_output_may_use_both(kind) -> None:
    X = independent()
    X[:, 4] = X[:, 0]
    apart = np.array([[1, 0], [1, 0], [0, 1], [0, 1], [0, 1]], dtype=bool)
    assert undetermined_terms(source(kind, X), TERMS, apart) == {}
    together = apart.copy()
    together[0, 1] = True
    assert set(undetermined_terms(source(kind, X), TERMS, together)) == {"a", "e"}


def test_undetermined_terms_are_those_whose_least_squares_spread_explodes() -> None:
    """Independent check on powers of a speed that hardly changes: variance inflation by plain inversion."""
    u = 1.0 + 0.02 * np.random.default_rng(1).standard_normal(3000)
    X = np.column_stack([u, u**2, u**3, independent(3000, 2)])
    found = undetermined_terms(source(QrFactor, X), ("u", "u^2", "u^3", "d", "e"))
    inflation = np.diag(np.linalg.inv(np.corrcoef(X, rowvar=False)))
    assert set(found) == {
        name for name, factor in zip(("u", "u^2", "u^3", "d", "e"), inflation, strict=True) if factor > 1e3
    }
    assert set(found) == {"u", "u^2", "u^3"}


def test_ranges_are_quantiles_in_si() -> None:
    nu = np.column_stack([np.linspace(0.0, 2.0, 1001), np.linspace(-1.0, 1.0, 1001), np.zeros(1001)])
    found = validity_ranges(nu, 10.0 * nu)
    assert found["u"] == pytest.approx((0.01, 1.99))
    assert found["v_dot"] == pytest.approx((-9.9, 9.9))
    assert found["r"] == (0.0, 0.0)
    assert found["U"][1] == pytest.approx(np.hypot(1.99, 0.99), rel=1e-3)
    assert set(range_columns(nu, nu)) == {"u", "v", "r", "u_dot", "v_dot", "r_dot", "U"}
    assert np.isnan(validity_ranges(nu[:0], nu[:0])["u"]).all()


def test_heading_coverage_counts_twelve_sectors() -> None:
    assert heading_coverage(np.linspace(-20.0, 20.0, 5000)) == 1.0
    assert heading_coverage(np.radians([10.0, 370.0, -350.0])) == pytest.approx(1 / 12)
    assert heading_coverage(np.radians([5.0, 355.0])) == pytest.approx(2 / 12)
    seldom = np.radians(np.append(np.full(999, 15.0), 45.0))
    assert heading_coverage(seldom) == pytest.approx(1 / 12)
    assert np.isnan(heading_coverage(np.full(3, np.nan)))


def test_excitation_of_masked_logs() -> None:
    n = 240
    nu = np.random.default_rng(0).standard_normal((n, 3))
    nu[200:] = np.nan
    eta = np.zeros((n, 3))
    eta[:, 2] = np.linspace(0.0, 2.0 * np.pi, n)
    motion = Motion("a", np.arange(n) / 10.0, 10.0, eta, nu, nu, nu, np.ones(n, dtype=bool), nu)
    mask = np.arange(n) < 120
    cross = from_rows(CrossProducts, np.hstack([nu, nu[:, :1]])[mask], nu[mask])
    vip = np.ones(4)
    found = assess_excitation(cross, ("u", "v", "r", "w"), vip, [motion, motion], [mask, mask])
    assert found.heading_coverage == pytest.approx(0.5)
    assert found.ranges["u"][1] == pytest.approx(np.quantile(nu[mask, 0], 0.995), rel=0.05)
    assert set(found.undetermined) == {"u", "w"}
    assert found.vip is vip
    assert found.singular_values.shape == (4,)
