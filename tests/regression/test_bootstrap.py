"""Block bootstrap: the same draws one by one, known spreads, and intervals that hold the truth as often as they say."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from ferryid.errors import FerryIdError
from ferryid.regression.cross_products import CrossProducts, Rows
from ferryid.regression.resampling.bootstrap import (
    Blocks,
    Bootstrap,
    block_seconds,
    bootstrap_coefficients,
    correlated_rows,
)
from ferryid.regression.simpls import fit_simpls
from ferryid.regression.thresholds import REGRESSION
from ferryid.types import Flags
from tests.regression.rows import from_rows

Floats = NDArray[np.float64]


def bootstrap_rows(
    X: Floats,
    Y: Floats,
    rate_hz: float,
    components: int,
    *,
    draws: int,
    seed: int = 0,
    scale: bool = True,
    block_s: float | None = None,
    mask: Flags | None = None,
) -> Bootstrap:
    """Bootstrap the rows of one log, in blocks as long as the residual of the fit is correlated."""
    rows, notes = Rows.of(X, Y, mask), ()
    if block_s is None:
        fit = fit_simpls(CrossProducts.of(rows), components, scale=scale)
        block_s, notes = block_seconds([rows], [rate_hz], fit.coefficients[-1], fit.intercepts[-1])
    blocks = Blocks.of([rows], [rate_hz], block_s)
    return bootstrap_coefficients(blocks, components, draws=draws, seed=seed, scale=scale, block_s=block_s, notes=notes)


def coloured(n: int, columns: int, memory: float, rng: np.random.Generator) -> Floats:
    """First-order autoregressive noise of unit variance, stationary from the first row."""
    white = rng.standard_normal((n, columns)) * np.sqrt(1.0 - memory**2)
    white[0] /= np.sqrt(1.0 - memory**2)
    return lfilter([1.0], [1.0, -memory], white, axis=0)


def trial(seed: int, n: int = 4000, memory: float = 0.95, K: int = 3) -> tuple[Floats, Floats, Floats]:
    rng = np.random.default_rng(seed)
    theta = np.array([[1.0, -2.0], [0.5, 0.0], [0.0, 3.0]])[:K]
    X = coloured(n, K, memory, rng)
    return X, X @ theta + 4.0 + coloured(n, 2, memory, rng), theta


@pytest.mark.parametrize("allowed", [None, np.array([[1, 0], [1, 1], [1, 1], [0, 1], [1, 1]], dtype=bool)])
def test_every_draw_is_a_fit_to_the_rows_drawn(allowed) -> None:
    rng = np.random.default_rng(0)
    X = rng.standard_normal((1200, 5)) * [1.0, 10.0, 1.0, 1.0, 1e3] + 20.0
    X[:, 3] = X[:, 2]
    Y = X @ rng.standard_normal((5, 2)) + rng.standard_normal((1200, 2))
    cuts = np.array_split(np.arange(1200), 12)
    blocks = [from_rows(CrossProducts, X[rows], Y[rows]) for rows in cuts]
    options = {"allowed": allowed, "scale": False}
    got = bootstrap_coefficients(blocks, 3, draws=40, seed=7, level=1.0 - 1e-12, **options)
    fits = []
    for picked in np.random.default_rng(7).integers(0, 12, (40, 12)):
        rows = np.concatenate([cuts[i] for i in picked])
        fits.append(fit_simpls(from_rows(CrossProducts, X[rows], Y[rows]), 3, **options))
    theta = np.array([fit.coefficients[-1] for fit in fits])
    intercept = np.array([fit.intercepts[-1] for fit in fits])
    np.testing.assert_allclose(got.low, theta.min(axis=0), atol=1e-9)
    np.testing.assert_allclose(got.high, theta.max(axis=0), atol=1e-9)
    np.testing.assert_allclose(got.intercept_low, intercept.min(axis=0), rtol=1e-8)
    np.testing.assert_allclose(got.intercept_high, intercept.max(axis=0), rtol=1e-8)
    # Hesterberg's expanded percentiles for 12 blocks: Φ(sqrt(12/11) t) with t = -2.2010 for 11 degrees, 1.0757 %.
    usual = bootstrap_coefficients(blocks, 3, draws=40, seed=7, **options)
    np.testing.assert_allclose(usual.low, np.quantile(theta, 0.0107566, axis=0), rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(usual.high, np.quantile(theta, 1.0 - 0.0107566, axis=0), rtol=1e-4, atol=1e-6)
    for output in range(2):
        joint = np.hstack([theta[:, :, output], intercept[:, output, None]])
        np.testing.assert_allclose(got.covariance[output], np.cov(joint, rowvar=False) * 12 / 11, rtol=1e-6, atol=1e-10)


def test_draws_keep_the_scale_of_the_whole() -> None:
    X, Y, _ = trial(0, n=600)
    X *= [1.0, 50.0, 1e-3]
    spread = bootstrap_rows(X, Y, 10.0, 2, draws=50, block_s=2.0)
    plain = bootstrap_rows(
        X / X.std(axis=0, ddof=1), Y / Y.std(axis=0, ddof=1), 10.0, 2, draws=50, block_s=2.0, scale=False
    )
    units = Y.std(axis=0, ddof=1) / X.std(axis=0, ddof=1)[:, None]
    np.testing.assert_allclose(spread.low, plain.low * units, rtol=1e-8)


def test_spread_of_independent_rows_is_that_of_least_squares() -> None:
    rng = np.random.default_rng(3)
    X = rng.standard_normal((5000, 4))
    Y = X @ rng.standard_normal((4, 2)) + rng.standard_normal((5000, 2)) * [1.0, 3.0]
    got = bootstrap_rows(X, Y, 1.0, 4, draws=2000)
    assert got.blocks == 500
    want = np.sqrt(np.diag(np.linalg.inv(X.T @ X)))
    for output, noise in enumerate([1.0, 3.0]):
        deviation = np.sqrt(np.diag(got.covariance[output]))
        np.testing.assert_allclose(deviation[:4], noise * want, rtol=0.12)
        np.testing.assert_allclose(deviation[4], noise / np.sqrt(5000), rtol=0.12)
    np.testing.assert_allclose((got.high - got.low)[:, 0], 2 * 1.96 * want, rtol=0.12)


@pytest.mark.slow
@pytest.mark.parametrize("memory", [0.0, 0.9, 0.98])
def test_intervals_hold_the_truth_as_often_as_they_say(memory: float) -> None:
    """95 % intervals of six coefficients and two intercepts over 40 trials with autocorrelated noise."""
    hits, naive = [], []
    for seed in range(40):
        X, Y, theta = trial(seed, memory=memory)
        got = bootstrap_rows(X, Y, 20.0, 3, draws=300, seed=seed)
        hits.append(
            np.append(
                (got.low <= theta) & (theta <= got.high), (got.intercept_low <= 4.0) & (got.intercept_high >= 4.0)
            )
        )
        if memory == 0.98:
            short = bootstrap_rows(X, Y, 20.0, 3, draws=300, seed=seed, block_s=0.4)
            naive.append((short.low <= theta) & (theta <= short.high))
    assert 0.88 < np.mean(hits) < 0.99
    if naive:
        assert np.mean(naive) < 0.75  # short blocks would promise far too much


def test_block_length_follows_the_memory_and_not_the_sampling() -> None:
    rng = np.random.default_rng(1)
    lengths = [correlated_rows(coloured(8000, 2, memory, rng)) for memory in (0.0, 0.9, 0.98)]
    assert lengths[0] < 30 < lengths[1] < lengths[2]
    slow = coloured(2000, 1, 0.9, rng)
    held = np.repeat(slow, 50, axis=0)  # the same signal, sampled fifty times as often
    assert correlated_rows(held) == pytest.approx(50 * correlated_rows(slow), rel=0.1)
    assert correlated_rows(np.column_stack([rng.standard_normal(2000), slow[:, 0]])) == correlated_rows(slow)
    assert correlated_rows(np.full((500, 2), 3.0)) == 1
    assert correlated_rows(np.zeros((5, 1))) == 1


def test_block_length_of_politis_and_white_for_first_order_noise() -> None:
    """For correlation a^k, G = 2 a/(1 - a)² and spectrum (1 + a)/(1 - a), so b = (2 a/(1 - a²))^(2/3) n^(1/3)."""
    a, n = 0.9, 2000
    rng = np.random.default_rng(5)
    found = [correlated_rows(coloured(n, 1, a, rng)) for _ in range(30)]
    want = (2.0 * a / (1.0 - a**2)) ** (2.0 / 3.0) * n ** (1.0 / 3.0)
    assert np.median(found) == pytest.approx(want, rel=0.35)


def test_a_log_too_short_for_its_memory_is_told() -> None:
    drift = np.linspace(-1.0, 1.0, 200)[:, None]
    rng = np.random.default_rng(0)
    X = rng.standard_normal((200, 2))
    Y = X[:, :1] + np.sin(3.0 * drift) + 0.01 * rng.standard_normal((200, 1))
    length, notes = block_seconds([Rows.of(X, Y)], [10.0], np.array([[1.0], [0.0]]), np.zeros(1))
    assert length == pytest.approx(20.0 / REGRESSION.fewest_blocks)
    assert "probably too narrow" in notes[0]
    got = bootstrap_rows(X, Y, 10.0, 2, draws=20)
    assert got.blocks == REGRESSION.fewest_blocks
    assert got.block_s == length
    assert len(got.notes) == 2
    assert "Only 10 independent stretches" in got.notes[1]


def test_blocks_of_several_logs_cover_the_masked_rows_once() -> None:
    X, Y, _ = trial(0, n=1000)
    mask = np.random.default_rng(0).random(1000) < 0.8
    mask[300:500] = False
    parts = [Rows((X[:400],), Y[:400], mask[:400]), Rows((X[400:],), Y[400:], mask[400:]), Rows.of(X[:0], Y[:0])]
    blocks = Blocks.of(parts, [10.0, 20.0, 10.0], 3.0)
    whole = from_rows(CrossProducts, X[mask], Y[mask])
    assert blocks.n.sum() == whole.n
    assert np.all(np.abs(blocks.n - np.where(np.arange(len(blocks.n)) < round(mask[:400].sum() / 30), 30, 60)) < 8)
    for got, want in zip(blocks.whole().moments(), whole.moments(), strict=True):
        np.testing.assert_allclose(got, want, rtol=1e-10)
    stacked = Blocks.stack([from_rows(CrossProducts, X[i : i + 100], Y[i : i + 100]) for i in range(0, 1000, 100)])
    np.testing.assert_allclose(stacked.whole().moments(), from_rows(CrossProducts, X, Y).moments(), rtol=1e-10)


def test_constant_and_duplicate_terms_draw_no_noise() -> None:
    X, Y, _ = trial(0, n=900)
    wide = np.hstack([X, X[:, :1], np.full((900, 1), 0.7)])
    got = bootstrap_rows(wide, Y, 10.0, 5, draws=100, block_s=3.0)
    alone = bootstrap_rows(X, Y, 10.0, 5, draws=100, block_s=3.0)
    np.testing.assert_array_equal(got.low[4], 0.0)
    np.testing.assert_array_equal(got.high[4], 0.0)
    np.testing.assert_allclose(got.low[0], got.low[3], rtol=1e-9)
    np.testing.assert_allclose(2.0 * got.low[0], alone.low[0], rtol=1e-9)


def test_a_seed_gives_the_same_bits_and_another_does_not() -> None:
    X, Y, _ = trial(0, n=500)
    one, two, other = (bootstrap_rows(X, Y, 10.0, 2, draws=30, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.covariance, two.covariance)
    assert not np.array_equal(one.covariance, other.covariance)


def test_one_block_is_refused() -> None:
    X, Y, _ = trial(0, n=50)
    with pytest.raises(FerryIdError, match=r"trial: intervals by block bootstrap need two blocks or more, found 1"):
        bootstrap_coefficients([from_rows(CrossProducts, X, Y)], 2, where="trial")
    with pytest.raises(FerryIdError, match="no rows to draw from"):
        Blocks.of([Rows.of(X[:0], Y[:0])], [10.0], 1.0)


def test_a_term_excited_in_one_block_alone_is_as_uncertain_as_that() -> None:
    """Draws without the block cannot tell the term: they give zero, never NaN, and the interval reaches it."""
    X, Y, _ = trial(0, n=1200)
    once = np.zeros((1200, 1))
    once[50:60] = np.random.default_rng(0).standard_normal((10, 1))
    got = bootstrap_rows(np.hstack([X, once]), Y + 30.0 * once, 10.0, 4, draws=400, block_s=10.0)
    assert np.isfinite(got.covariance).all()
    assert got.low[3, 0] <= 1e-9
    assert got.high[3, 0] > 25.0
