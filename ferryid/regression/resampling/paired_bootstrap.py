"""How certainly one model errs less than another: squared errors on the same rows, resampled in blocks and in pairs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ferryid.regression.resampling.bootstrap import correlated_rows
from ferryid.regression.thresholds import REGRESSION
from ferryid.types import Floats, Ints

DRAWS = 9999
NOTHING = 1e-7
"""A difference of ratios that is rounding."""


@dataclass(frozen=True)
class PairedRatios:
    """Ratios of the summed squares of every two of m models, the first over the second, in c columns.

    Attributes
    ----------
    pairs
        Which two models, (i, j) with i < j.
    ratio, low, high
        Ratio with its 95 % interval, shape (pairs, c); NaN where there is none.
    p
        Probability of a ratio this far from one, in either direction, if both models erred alike; shape (pairs, c).
    """

    pairs: tuple[tuple[int, int], ...]
    ratio: Floats
    low: Floats
    high: Floats
    p: Floats


def paired_block_seconds(squares: Floats, rate_hz: float) -> tuple[float, bool]:
    """Return the length of a block [s] for squared errors, shape (n, c), and whether they stay correlated for longer.

    It is what `correlated_rows` asks for, at least `REGRESSION.paired_block_s`, and no longer than leaves enough blocks.
    Means over `REGRESSION.paired_mean_s` are what is asked about: shorter memory does not matter, and more
    samples would hide a longer one.
    """
    seconds, width = len(squares) / rate_hz, max(1, round(REGRESSION.paired_mean_s * rate_hz))
    means = squares[: len(squares) // width * width].reshape(-1, width, squares.shape[1]).mean(axis=1)
    wanted = max(
        REGRESSION.paired_block_s,
        seconds / REGRESSION.paired_most_blocks,
        correlated_rows(means) * width / rate_hz if len(means) else 0.0,
    )
    length = max(REGRESSION.paired_block_s, min(wanted, seconds / REGRESSION.paired_fewest_blocks))
    return length, wanted > length


def sum_over_blocks(squares: Floats, at_s: Floats, block_s: float) -> Floats:
    """Return sums over blocks of time, shape (blocks, ...), of what belongs to times [s] `at_s`, shape (n,).

    Blocks in which nothing lies are none. A remainder of less than half a block joins the last one.
    """
    if not len(at_s):
        return np.zeros((0, *squares.shape[1:]))
    since = at_s - at_s[0]
    last = max(0, round(float(since[-1]) / block_s) - 1)
    _, which = np.unique(np.minimum(np.floor(since / block_s), last), return_inverse=True)
    sums = np.zeros((int(which.max()) + 1, *squares.shape[1:]))
    np.add.at(sums, which, squares)
    return sums


def has_enough_blocks(logs: Sequence[Floats]) -> bool:
    """Tell whether the blocks of some logs, shape (blocks, ...) each, are enough for an interval."""
    return any(len(sums) >= REGRESSION.paired_fewest_blocks for sums in _strata(logs))


def _strata(logs: Sequence[Floats]) -> list[Floats]:
    """Return the blocks that are drawn from together: those of a log, and those of all logs that are too short alone."""
    short = [sums for sums in logs if 0 < len(sums) < REGRESSION.paired_fewest_blocks]
    return [
        *(sums for sums in logs if len(sums) >= REGRESSION.paired_fewest_blocks),
        *([np.concatenate(short)] if short else []),
    ]


def compare_pairs(logs: Sequence[Floats], draws: int = DRAWS, seed: int = 0) -> PairedRatios:
    """Compare the mean squares of every two models over one log or several.

    The logarithm of a ratio gets a symmetric bootstrap-t interval: each draw takes as many blocks from a log as it has (from
    all logs together that are too short for draws of their own), with replacement and the same for all models, and is held
    against its own standard error, that of a ratio of sums over blocks. Percentiles of the ratio itself would be too narrow
    where blocks are few. `p` is the share of draws that lie, in standard errors, at least as far from the ratio found as
    that lies from one; it is never less than one over the draws, and below 0.05 where the interval leaves out one.

    Parameters
    ----------
    logs
        Squared errors summed over each block of a log, shape (blocks, m, c).
    draws, seed
        Of the bootstrap.

    Returns
    -------
    Paired
        Without intervals where there are too few blocks.

    References
    ----------
    Hall (1988), Annals of Statistics 16, 927-953; Davison and Hinkley (1997), Bootstrap Methods, chapters 2 and 8.
    """
    kept = _strata(logs)
    m, c = logs[0].shape[1:]
    pairs = tuple(combinations(range(m), 2))
    i, j = (np.array([pair[side] for pair in pairs], dtype=np.int64) for side in (0, 1))
    total = sum((sums.sum(axis=0) for sums in kept), np.zeros((m, c)))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = total[i] / total[j]
        ratio[~np.isfinite(ratio) | (ratio == 0.0)] = np.nan
    low, high, p = (np.full(ratio.shape, np.nan) for _ in range(3))
    if has_enough_blocks(kept):
        rng = np.random.default_rng(seed)
        times = [rng.multinomial(len(sums), np.full(len(sums), 1.0 / len(sums)), draws).astype(float) for sums in kept]
        once = [np.ones((1, len(sums))) for sums in kept]
        for column in range(c):
            # In units of the whole, so that nothing but the difference of two models is small.
            with np.errstate(divide="ignore", invalid="ignore"):
                parts = [sums[:, :, column] / total[:, column] for sums in kept]
                _, error = _statistics(parts, once, i, j)
                strayed, errors = _statistics(parts, times, i, j)
                away = np.abs(np.log(ratio[:, column])) / error[0]
                strayed = np.sort(np.nan_to_num(np.abs(strayed) / errors, nan=np.inf), axis=0)
            # Blocks that all say the same leave no doubt, and nothing to stray by.
            same = error[0] == 0.0
            away = np.where(same, np.where(np.abs(ratio[:, column] - 1.0) > NOTHING, np.inf, 0.0), away)
            strayed[:, same] = 0.0
            reach = strayed[int(np.ceil(REGRESSION.paired_level * (draws + 1))) - 1] * error[0]
            low[:, column], high[:, column] = ratio[:, column] * np.exp(-reach), ratio[:, column] * np.exp(reach)
            beyond = draws - np.array([np.searchsorted(strayed[:, k], away[k]) for k in range(len(pairs))])
            p[:, column] = (1.0 + beyond) / (draws + 1.0)
        for values in (low, high, p):
            values[~np.isfinite(ratio)] = np.nan
    return PairedRatios(pairs, ratio, low, high, p)


def _statistics(parts: Sequence[Floats], times: Sequence[Floats], i: Ints, j: Ints) -> tuple[Floats, Floats]:
    """Return the logarithm of each pair's ratio in some draws, and its standard error; shape (draws, pairs).

    `parts` are the blocks of each log, shape (blocks, m), and `times` how often each is drawn, shape (draws, blocks).
    """
    sums = [drawn @ part for part, drawn in zip(parts, times, strict=True)]
    total = np.sum(sums, axis=0)
    variance = np.zeros((len(total), len(i)))
    for part, drawn, own in zip(parts, times, sums, strict=True):
        blocks = len(part)
        if blocks > 1:
            squares = drawn @ part**2
            crossed = drawn @ (part[:, i] * part[:, j])
            # A block's share in the one sum less its share in the other, squared and summed over the blocks.
            spread = (
                squares[:, i] / total[:, i] ** 2
                - 2.0 * crossed / (total[:, i] * total[:, j])
                + squares[:, j] / total[:, j] ** 2
            )
            mean = own[:, i] / total[:, i] - own[:, j] / total[:, j]
            variance += blocks / (blocks - 1.0) * (spread - mean**2 / blocks)
    return np.log(total[:, i] / total[:, j]), np.sqrt(np.where(variance > NOTHING**2, variance, 0.0))


def holm(p: Floats) -> Floats:
    """Return probabilities corrected for their number after Holm (1979), in the same shape; NaN stays, and does not count."""
    flat = p.ravel()
    known = np.flatnonzero(np.isfinite(flat))
    corrected = flat.copy()
    order = known[np.argsort(flat[known], kind="stable")]
    factors = np.arange(len(order), 0, -1)
    corrected[order] = np.minimum(1.0, np.maximum.accumulate(flat[order] * factors)) if len(order) else []
    return corrected.reshape(p.shape)
