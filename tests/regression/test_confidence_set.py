"""The model confidence set: how often it errs, what it must leave out, and limits."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from ferryid.regression.resampling.bootstrap import times_drawn
from ferryid.regression.resampling.confidence_set import model_confidence_set

Floats = NDArray[np.float64]


def judged(errors: Floats, draws: int = 400) -> Floats:
    """Return p of models from their errors in blocks of equal size, shape (B, S)."""
    times = times_drawn(len(errors), draws, 1)
    return model_confidence_set(errors.mean(axis=0), times @ errors / len(errors), len(errors))


@pytest.mark.slow
@pytest.mark.parametrize("blocks", [20, 100])
def test_of_equal_models_the_best_by_chance_drives_out_none_in_95_of_100(blocks: int) -> None:
    rng = np.random.default_rng(blocks)
    lost = [
        (judged(rng.normal(5.0, 1.0, (blocks, 1)) + 0.3 * rng.normal(size=(blocks, 8))) < 0.05).any()
        for _ in range(300)
    ]
    # 300 trials at 5 % have a standard deviation of 1.3 %.
    assert 0.005 < np.mean(lost) < 0.09


def test_the_true_best_stays_and_what_is_poorer_goes() -> None:
    rng = np.random.default_rng(3)
    kept = np.array(
        [
            judged(rng.normal(5.0, 2.0, (40, 1)) + 0.3 * rng.normal(size=(40, 4)) + [0.0, 0.05, 0.4, 3.0]) > 0.05
            for _ in range(200)
        ]
    ).mean(axis=0)
    # The scatter that all share cancels. 0.4 is six standard errors of a difference, 0.05 less than one.
    assert kept[0] > 0.95
    assert kept[1] > 0.8
    assert kept[2] < 0.05
    assert kept[3] == 0.0


def test_models_of_one_form_are_not_told_apart() -> None:
    errors = np.random.default_rng(0).normal(5.0, 1.0, (30, 1))
    twins = np.hstack([errors, errors * (1.0 + 1e-13), errors])
    assert judged(twins).tolist() == [1.0, 1.0, 1.0]
    p = judged(np.hstack([twins, errors + 2.0]))
    assert p.tolist() == [1.0, 1.0, 1.0, 0.0]


def test_the_order_and_the_unit_do_not_matter() -> None:
    rng = np.random.default_rng(5)
    errors = rng.normal(5.0, 1.0, (25, 1)) + 0.3 * rng.normal(size=(25, 5)) + [0.0, 0.1, 0.2, 0.3, 0.6]
    p = judged(errors)
    assert p.max() == 1.0
    assert len(set(p)) > 2
    turn = [3, 0, 4, 2, 1]
    np.testing.assert_array_equal(judged(errors[:, turn]), p[turn])
    np.testing.assert_array_equal(judged(1024.0 * errors), p)


@pytest.mark.slow
def test_two_models_against_the_normal_distribution() -> None:
    """With two models and many blocks, p is that of a two-sided z-test of the mean difference."""
    from scipy.stats import norm

    rng = np.random.default_rng(8)
    difference = rng.normal(0.0, 1.0, 2000)
    difference += 2.0 / np.sqrt(2000) - difference.mean()
    z = difference.mean() / difference.std(ddof=1) * np.sqrt(2000)
    p = judged(np.column_stack([np.full(2000, 5.0), 5.0 + difference]), draws=4000)
    assert p[0] == 1.0
    assert p[1] == pytest.approx(2.0 * norm.sf(z), abs=0.012)


def by_hand(scores: Floats, drawn: Floats, wider: float) -> Floats:
    """The procedure of Hansen, Lunde and Nason, pair by pair."""
    left, p, highest = set(range(len(scores))), np.ones(len(scores)), 0.0
    while len(left) > 1:
        pairs = [(i, j) for i in left for j in left if i != j]
        gap = {pair: scores[pair[0]] - scores[pair[1]] for pair in pairs}
        spread = {(i, j): (drawn[:, i] - drawn[:, j] - gap[i, j]) * wider for i, j in pairs}
        t = {pair: gap[pair] / np.sqrt(np.mean(spread[pair] ** 2)) for pair in pairs}
        null = np.max([np.abs(spread[pair]) / np.sqrt(np.mean(spread[pair] ** 2)) for pair in pairs], axis=0)
        (worst, _), largest = max(t.items(), key=lambda item: item[1])
        highest = max(highest, float(np.mean(null >= largest / (1.0 + 1e-12))))
        p[worst] = highest
        left.remove(worst)
    return p


def test_against_the_procedure_pair_by_pair() -> None:
    from scipy.stats import t

    rng = np.random.default_rng(12)
    rose = 0
    for _ in range(30):
        errors = rng.normal(5.0, 1.0, (25, 1)) + 0.3 * rng.normal(size=(25, 5)) * [1.0, 3.0, 0.5, 2.0, 1.0]
        errors += rng.uniform(0.0, 0.3, 5)
        times = times_drawn(25, 200, 2)
        drawn = times @ errors / 25.0
        p = by_hand(errors.mean(axis=0), drawn, np.sqrt(25.0 / 24.0) * t.ppf(0.975, 24) / 1.959964)
        np.testing.assert_allclose(model_confidence_set(errors.mean(axis=0), drawn, 25), p, atol=1e-12)
        rose += len(set(p.tolist())) < 5
    # Where a later test is less sure than an earlier one, the earlier p stands for both.
    assert rose > 3
