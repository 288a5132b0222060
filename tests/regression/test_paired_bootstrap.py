"""The paired bootstrap: against series whose truth is known, hand computation, and its limits."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from ferryid.regression.resampling.paired_bootstrap import (
    compare_pairs,
    has_enough_blocks,
    holm,
    paired_block_seconds,
    sum_over_blocks,
)
from ferryid.regression.thresholds import REGRESSION

RATE_HZ = 2.0
DRAWS = 499


def coloured(rng: np.random.Generator, n: int, memory_s: float) -> np.ndarray:
    """Return noise of unit variance that forgets within `memory_s`."""
    phi = np.exp(-1.0 / (memory_s * RATE_HZ))
    return np.asarray(lfilter([np.sqrt(1.0 - phi**2)], [1.0, -phi], rng.standard_normal(n + 200))[200:])


def two_models(rng: np.random.Generator, seconds: float, ratio: float) -> np.ndarray:
    """Return the squared errors of two models that share most of their error, shape (n, 2, 1); their MSEs have this ratio."""
    n = int(seconds * RATE_HZ)
    shared = coloured(rng, n, 4.0)
    a, b = (shared + 0.5 * coloured(rng, n, 4.0) for _ in range(2))
    return np.stack([np.sqrt(ratio) * a, b], axis=1)[:, :, None] ** 2


def judged(rng: np.random.Generator, lengths_s: tuple[float, ...], ratio: float, seed: int):
    logs = []
    for seconds in lengths_s:
        squares = two_models(rng, seconds, ratio)
        block_s, _ = paired_block_seconds(squares[:, :, 0], RATE_HZ)
        logs.append(sum_over_blocks(squares, np.arange(len(squares)) / RATE_HZ, block_s))
    return compare_pairs(logs, draws=DRAWS, seed=seed)


@pytest.mark.slow
@pytest.mark.parametrize("lengths_s", [(600.0,), (300.0,), (100.0, 150.0, 300.0)])
@pytest.mark.parametrize("ratio", [1.0, 0.7])
def test_intervals_cover_what_is_true_as_often_as_they_say(lengths_s: tuple[float, ...], ratio: float) -> None:
    rng = np.random.default_rng(3)
    found = [judged(rng, lengths_s, ratio, seed) for seed in range(250)]
    covered = np.mean([one.low[0, 0] < ratio < one.high[0, 0] for one in found])
    # 95 % but for three standard errors of 250 trials, and for what blocks of 30 s do not hold of the memory.
    assert 0.90 <= covered <= 0.99
    p = np.array([one.p[0, 0] for one in found])
    if ratio == 1.0:
        for level in (0.1, 0.3, 0.5, 0.8):
            assert np.mean(p <= level) == pytest.approx(level, abs=0.11)
    else:
        assert np.mean(p <= 0.05) > 0.3


@pytest.mark.slow
def test_intervals_of_free_runs_that_overlap_cover_as_often() -> None:
    """Errors that grow along a run of 30 s, from starts 12 s apart, in blocks of twice a run."""
    rng, run = np.random.default_rng(9), 60
    starts = np.arange(0, int(720 * RATE_HZ) - run, 24)
    covered = []
    for seed in range(250):
        shared = coloured(rng, int(720 * RATE_HZ), 4.0)
        paths = [np.cumsum(shared + 0.6 * coloured(rng, len(shared), 4.0)) for _ in range(2)]
        squares = np.stack([(path[starts + run] - path[starts]) ** 2 for path in paths], axis=1)[:, :, None]
        one = compare_pairs([sum_over_blocks(squares, starts / RATE_HZ, 60.0)], draws=DRAWS, seed=seed)
        covered.append(one.low[0, 0] < 1.0 < one.high[0, 0])
    assert 0.90 <= np.mean(covered) <= 0.99


def test_an_interval_leaves_out_one_just_where_p_is_below_a_twentieth() -> None:
    rng = np.random.default_rng(4)
    for seed in range(60):
        one = judged(rng, (450.0,), 0.85, seed)
        outside = one.high[0, 0] < 1.0 or one.low[0, 0] > 1.0
        assert outside == (one.p[0, 0] <= 0.05)


def test_unpaired_scatter_cancels() -> None:
    """Two models with nearly the same large errors are told apart by the little in which they differ."""
    rng = np.random.default_rng(5)
    n = int(600 * RATE_HZ)
    shared = coloured(rng, n, 4.0)
    squares = np.stack([shared, 1.02 * shared + 0.01 * rng.standard_normal(n)], axis=1)[:, :, None] ** 2
    one = compare_pairs([sum_over_blocks(squares, np.arange(n) / RATE_HZ, 30.0)], draws=DRAWS)
    assert one.ratio[0, 0] == pytest.approx(1.0 / 1.02**2, rel=2e-3)
    assert one.high[0, 0] < 0.98
    assert one.p[0, 0] == pytest.approx(1.0 / (DRAWS + 1.0))


def test_ratios_of_several_logs_are_those_of_all_squares_together() -> None:
    first = np.array([[[4.0], [2.0]], [[6.0], [1.0]]])
    second = np.array([[[1.0], [9.0]]])
    pooled = compare_pairs([first, second])
    assert pooled.pairs == ((0, 1),)
    assert pooled.ratio[0, 0] == pytest.approx((4 + 6 + 1) / (2 + 1 + 9))
    assert np.isnan([pooled.low, pooled.high, pooled.p]).all()


def test_the_standard_error_is_that_of_a_ratio_of_sums() -> None:
    """The interval's reach over the delta method's standard error is near Student's t for so many blocks."""
    rng = np.random.default_rng(6)
    sums = rng.gamma(20.0, 1.0, (40, 2, 1))
    x, y = sums[:, :, 0].T / sums[:, :, 0].sum(axis=0)[:, None]
    error = np.sqrt(40.0 / 39.0 * np.sum((x - y) ** 2))
    one = compare_pairs([sums])
    reach = np.log(one.high[0, 0] / one.low[0, 0]) / 2.0
    assert reach / error == pytest.approx(2.02, abs=0.15)


def test_more_models_make_no_pair_another_one() -> None:
    rng = np.random.default_rng(7)
    sums = rng.gamma(5.0, 1.0, (20, 4, 2))
    all_pairs, alone = compare_pairs([sums], draws=DRAWS), compare_pairs([sums[:, [1, 3]]], draws=DRAWS)
    k = all_pairs.pairs.index((1, 3))
    for part in ("ratio", "low", "high", "p"):
        assert getattr(all_pairs, part)[k] == pytest.approx(getattr(alone, part)[0])


def test_the_same_model_is_no_better_and_what_never_errs_has_no_ratio() -> None:
    sums = np.ones((12, 3, 1)) * np.arange(1.0, 13.0)[:, None, None]
    sums[:, 2] = 0.0
    one = compare_pairs([sums], draws=DRAWS)
    assert one.ratio[0, 0] == one.low[0, 0] == one.high[0, 0] == 1.0
    assert one.p[0, 0] == 1.0
    assert np.isnan(one.ratio[1:]).all()
    assert np.isnan(one.p[1:]).all()
    # Better in every block by as much.
    sums[:, 1] *= 2.0
    assert compare_pairs([sums], draws=DRAWS).p[0, 0] == pytest.approx(1.0 / (DRAWS + 1.0))


def test_too_few_blocks_give_no_interval() -> None:
    many, few = np.ones((REGRESSION.paired_fewest_blocks, 2, 1)), np.ones((REGRESSION.paired_fewest_blocks - 1, 2, 1))
    assert has_enough_blocks([many])
    assert not has_enough_blocks([few])
    # Short logs are blocks of one another.
    assert has_enough_blocks([many[:1]] * REGRESSION.paired_fewest_blocks)
    assert not has_enough_blocks([many[:1]] * (REGRESSION.paired_fewest_blocks - 1))
    assert np.isnan(compare_pairs([few]).p).all()


def test_blocks_are_stretches_of_time_and_gaps_are_none() -> None:
    at = np.array([0.0, 10.0, 29.0, 30.0, 95.0, 130.0])
    sums = sum_over_blocks(np.arange(1.0, 7.0)[:, None], at, 30.0)
    # 0-30, 30-60, nothing from 60 to 90, and 90-130: a remainder of a third of a block joins the last one.
    assert sums[:, 0].tolist() == [6.0, 4.0, 11.0]


def test_blocks_are_as_long_as_errors_are_remembered() -> None:
    rng = np.random.default_rng(8)
    n = int(7200 * RATE_HZ)
    short, _ = paired_block_seconds(coloured(rng, n, 2.0)[:, None] ** 2, RATE_HZ)
    long, told = paired_block_seconds(coloured(rng, n, 120.0)[:, None] ** 2, RATE_HZ)
    assert short == 30.0
    assert long > 200.0
    assert not told
    # Errors that only grow are remembered throughout.
    cut, told = paired_block_seconds(np.linspace(1.0, 2.0, int(360 * RATE_HZ))[:, None], RATE_HZ)
    assert told
    assert cut == pytest.approx(360.0 / REGRESSION.paired_fewest_blocks)


def test_holm_against_a_hand_computation() -> None:
    # Sorted 0.01, 0.02, 0.021, 0.5 times 4, 3, 2, 1, never falling: 0.042 is raised to 0.06.
    p = np.array([[0.021, 0.01], [np.nan, 0.5], [0.02, np.nan]])
    assert holm(p) == pytest.approx(np.array([[0.06, 0.04], [np.nan, 0.5], [0.06, np.nan]]), nan_ok=True)
    assert holm(np.array([0.4, 0.9])) == pytest.approx([0.8, 0.9])
