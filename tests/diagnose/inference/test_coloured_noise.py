"""Coloured noise of short series: the autoregression that made them, white from the first row on."""

from __future__ import annotations

import numpy as np
import pytest

from ferryid.diagnose.inference.coloured_noise import fit_coloured_noise
from ferryid.types import Floats

TRUE = np.array([1.3, -0.5])
MIX = np.array([[1.0, 0.5], [0.0, 1.0]])


def series(lengths: list[int], seed: int = 0) -> tuple[Floats, list[tuple[int, int]]]:
    """Return series of a process of second order, two channels, each in its steady state."""
    random, parts, runs, count = np.random.default_rng(seed), [], list[tuple[int, int]](), 0
    for length in lengths:
        shocks = random.normal(size=(length + 100, 2)) @ MIX
        made = np.zeros_like(shocks)
        for t in range(2, len(made)):
            made[t] = TRUE[0] * made[t - 1] + TRUE[1] * made[t - 2] + shocks[t]
        parts.append(made[100:])
        runs.append((count, count + length))
        count += length
    return np.vstack(parts), runs


def test_the_autoregression_is_the_one_that_made_the_series() -> None:
    noise = fit_coloured_noise(*series([2000, 1000]), order=4)
    assert noise.coefficients[2] == pytest.approx(np.tile(TRUE, (2, 1)), abs=0.03)
    assert noise.scale[2] == pytest.approx(np.sqrt(np.diag(MIX.T @ MIX)), rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("lengths", [[3000], [12] * 250, [1, 2, 3, 5, 8] * 150])
def test_what_is_left_is_white_from_the_first_row_on(lengths: list[int]) -> None:
    gaps, runs = series(lengths)
    white = fit_coloured_noise(gaps, runs, order=4).white(gaps, runs)
    assert white.shape == gaps.shape
    assert np.cov(white.T) == pytest.approx(np.eye(2), abs=0.08)
    first = white[[first for first, _ in runs]]
    if len(runs) > 1:
        assert np.mean(first**2) == pytest.approx(1.0, abs=0.2)
    pairs = [(white[a : b - 1], white[a + 1 : b]) for a, b in runs]
    before, after = (np.vstack(one) for one in zip(*pairs, strict=True))
    assert abs(np.mean(before * after)) < 0.06


def test_columns_are_whitened_as_gaps_are() -> None:
    gaps, runs = series([300, 20, 3])
    noise = fit_coloured_noise(gaps, runs)
    both = noise.white(np.stack([gaps, -2.0 * gaps], axis=2), runs)
    assert both[:, :, 1] == pytest.approx(-2.0 * noise.white(gaps, runs))


def test_nothing_left_over_is_no_error() -> None:
    noise = fit_coloured_noise(np.zeros((20, 3)), [(0, 20)])
    assert np.isfinite(noise.white(np.zeros((20, 3)), [(0, 20)])).all()
