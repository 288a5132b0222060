"""Cross-products and QR factors: sums over the rows, whatever the order in which the rows came."""

from __future__ import annotations

import tracemalloc
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from ferryid import side_by_side
from ferryid.errors import FerryIdError
from ferryid.regression import cross_products
from ferryid.regression.cross_products import Accumulator, CrossProducts, Rows
from ferryid.regression.qr import QrFactor, condition, factorise
from ferryid.regression.thresholds import REGRESSION
from tests.regression.rows import from_rows

Floats = NDArray[np.float64]
KINDS = (CrossProducts, QrFactor)


def sample(n: int, K: int = 4, m: int = 2, offset: float = 0.0, seed: int = 0) -> tuple[Floats, Floats]:
    rng = np.random.default_rng(seed)
    X = rng.standard_normal((n, K)) * np.geomspace(1.0, 100.0, K) + offset
    return X, X[:, :m] * 2.0 + rng.standard_normal((n, m))


def test_centred_sums_equal_numpys_covariance() -> None:
    X, Y = sample(500, offset=30.0)
    Sxx, Sxy, Syy, mean_x, mean_y = from_rows(CrossProducts, X, Y).centred()
    covariance = np.cov(np.hstack([X, Y]), rowvar=False) * 499
    np.testing.assert_allclose(np.block([[Sxx, Sxy], [Sxy.T, Syy]]), covariance, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(np.append(mean_x, mean_y), np.hstack([X, Y]).mean(axis=0), rtol=1e-14)


def test_qr_triangle_is_the_cholesky_factor_of_the_cross_products() -> None:
    X, Y = sample(3000, offset=5.0)
    factor = from_rows(QrFactor, X, Y)
    ones = np.hstack([np.ones((len(X), 1)), np.hstack([X, Y]) - factor.shift])
    np.testing.assert_allclose(factor.triangle.T @ factor.triangle, ones.T @ ones, rtol=1e-11, atol=1e-9)
    np.testing.assert_array_equal(np.tril(factor.triangle, -1), 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=25, deadline=None)
@given(
    cuts=st.lists(st.integers(0, 700), max_size=5),
    seed=st.integers(0, 2**16),
    offset=st.sampled_from([0.0, 1e3, -1e6]),
)
def test_any_split_in_any_order_gives_the_same_moments(kind, cuts: list[int], seed: int, offset: float) -> None:
    X, Y = sample(700, offset=offset, seed=seed)
    bounds = [0, *sorted(cuts), 700]
    parts = [from_rows(kind, X[a:b], Y[a:b]) for a, b in pairwise(bounds) if b > a]
    np.random.default_rng(seed).shuffle(parts)
    added = parts[0]
    for part in parts[1:]:
        added = added + part
    whole = from_rows(kind, X, Y)
    assert added.n == whole.n == 700
    for got, want in zip(added.moments(), whole.moments(), strict=True):
        np.testing.assert_allclose(got, want, rtol=1e-9)
    B, b = np.ones((1, 4, 2)), np.zeros((1, 2))
    np.testing.assert_allclose(added.sse(B, b), np.sum((Y - X @ B[0]) ** 2, axis=0)[None], rtol=1e-9)
    np.testing.assert_allclose(whole.sse(B, b), np.sum((Y - X @ B[0]) ** 2, axis=0)[None], rtol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("order", ["C", "F"])
def test_chunks_layout_mask_and_evaluation_do_not_matter(kind, order: str, monkeypatch: pytest.MonkeyPatch) -> None:
    X, Y = sample(5000, offset=3.0)
    mask = np.random.default_rng(1).random(5000) < 0.7
    mask[1000:2100] = False
    want = from_rows(kind, X[mask], Y[mask])
    for module in (cross_products, __import__("ferryid.regression.qr", fromlist=["qr"])):
        monkeypatch.setattr(module, "CHUNK_ROWS", 1000)
    monkeypatch.setattr(cross_products, "SEGMENT_ROWS", 2000)
    laid = np.asarray(X, order=order)
    whole = Rows((laid,), Y, mask)

    def write(out: Floats, a: Floats, _: None, b: Floats) -> None:
        out[:2], out[2:] = a.T, b.T

    filled = Rows((X[:, :2], None, X[:, 2:]), Y, mask, fill=write, terms=4)
    two = (Rows((laid[:1500],), Y[:1500], mask[:1500]), Rows((laid[1500:],), Y[1500:], mask[1500:]))
    for parts in ((whole,), (filled,), two):
        got = kind.of(*parts)
        assert got.n == mask.sum()
        for one, other in zip(got.moments(), want.moments(), strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-12)


def test_the_number_of_workers_changes_no_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(side_by_side, "usable_cores", lambda: 3)
    X, Y = sample(3 * cross_products.SEGMENT_ROWS + 17, K=2, m=1)
    results = []
    for workers in (1, 2, 3):
        accumulator = Accumulator(2, 1, workers=workers)
        accumulator.add(X, Y)
        results.append(accumulator.result().products)
    np.testing.assert_array_equal(results[0], results[1])
    np.testing.assert_array_equal(results[0], results[2])


def test_an_offset_of_a_million_costs_no_digits() -> None:
    X, Y = sample(4000)
    offset = 2.0**20
    shifted = (X + offset) - offset  # the digits that survive the addition itself
    got = from_rows(CrossProducts, X + offset, Y).centred()[0]
    np.testing.assert_allclose(got, from_rows(CrossProducts, shifted, Y).centred()[0], rtol=1e-12, atol=1e-9)


def test_memory_does_not_grow_with_the_rows() -> None:
    def fill(out: Floats, part: Floats) -> None:
        out[:] = np.repeat(part, 7, axis=1).T

    def peak(n: int) -> int:
        nu = np.zeros((n, 3))
        Y = np.zeros((n, 3))
        accumulator = Accumulator(21, 3, workers=1)
        tracemalloc.start()
        accumulator.add_rows(Rows((nu,), Y, fill=fill, terms=21))
        found = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return found

    assert peak(200_000) < 1.1 * peak(20_000) < 10e6


def test_the_callers_arrays_stay_as_they_are() -> None:
    X, Y = sample(100)
    before = X.copy(), Y.copy()
    factorise(Rows.of(X, Y))
    from_rows(QrFactor, X, Y)
    np.testing.assert_array_equal(X, before[0])
    np.testing.assert_array_equal(Y, before[1])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e200])
def test_a_value_that_is_not_finite_is_named(kind, value: float) -> None:
    X, Y = sample(50)
    X[20, 2] = value
    with pytest.raises(FerryIdError) as error:
        from_rows(kind, X, Y, names=("u", "v", "|v|v", "r"), where="trial.mcap")
    message = str(error.value)
    assert message.startswith('trial.mcap: basis term "|v|v"')
    assert f"found {value} in 1 of 50 rows" in message
    assert "Fix:" in message
    assert "\n" not in message
    Y[3:5, 1] = value
    X[20, 2] = 0.0
    with pytest.raises(FerryIdError, match=r"output 2 .* in 2 of 50 rows"):
        from_rows(kind, X, Y)


@pytest.mark.parametrize("kind", KINDS)
def test_rows_that_do_not_match_are_refused(kind) -> None:
    X, Y = sample(50)
    with pytest.raises(FerryIdError, match=r"same rows.*\(50, 4\), \(49, 2\)"):
        from_rows(kind, X, Y[1:])
    with pytest.raises(ValueError, match="do not add up"):
        from_rows(kind, X, Y) + from_rows(kind, X[:, 1:], Y)


def test_qr_is_chosen_by_condition_alone() -> None:
    rng = np.random.default_rng(0)
    X = rng.standard_normal((400, 5))
    Y = rng.standard_normal((400, 2))

    def chosen(columns: Floats) -> type:
        return type(factorise(Rows.of(columns, Y)))

    assert chosen(X) is CrossProducts
    assert chosen(X * np.geomspace(1.0, 1e9, 5)) is CrossProducts  # units are no loss of digits
    assert chosen(np.hstack([X, X[:, :2], np.full((400, 1), 7.0)])) is CrossProducts  # duplicates and a constant
    assert chosen(np.hstack([X, X[:, :1] + X[:, 1:2]])) is QrFactor  # exactly dependent: only QR can tell
    near = np.hstack([X, X[:, :1] + 1e-4 * rng.standard_normal((400, 1))])
    assert condition(from_rows(CrossProducts, near, Y))[0] > REGRESSION.condition_for_qr
    assert chosen(near) is QrFactor
    assert chosen(np.zeros((400, 3))) is CrossProducts


def test_condition_is_that_of_the_standardised_columns() -> None:
    X, Y = sample(300)
    X[:, 1] += X[:, 0] / X[:, 0].std() * 5.0
    standard = (X - X.mean(axis=0)) / X.std(axis=0)
    for kind in KINDS:
        assert condition(from_rows(kind, X, Y))[0] == pytest.approx(np.linalg.cond(standard), rel=1e-10)
