"""How certainly a new model errs less than its base model on held-out data: the interval of the verdict's ratio."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ferryid.regression import REGRESSION
from ferryid.regression.resampling import paired_block_seconds, sum_over_blocks
from ferryid.types import Floats


@dataclass(frozen=True)
class LogErrors:
    """Force errors on held-out rows or windows of a log: of both models, shape (n, 3) each, and their times [s], shape (n,)."""

    base: Floats
    model: Floats
    at_s: Floats

    @property
    def rate_hz(self) -> float:
        """How many rows or windows there are in a second where they follow one another."""
        return 1.0 / float(np.median(np.diff(self.at_s))) if len(self.at_s) > 1 else 1.0

    def without_sway(self) -> LogErrors:
        """Return the errors where sway was not measured: none there, of either model."""
        known = np.array([1.0, 0.0, 1.0])
        return LogErrors(self.base * known, self.model * known, self.at_s)


def ratio_interval(logs: Sequence[LogErrors], least_block_s: float = 0.0) -> tuple[float, float] | None:
    """Return the 95 % interval of the mean square of the new model's errors over the base model's, averaged over the axes.

    Sums over blocks of time are independent where blocks outlast the memory of the errors. The logarithm of a mean of ratios of
    such sums, linearised, has Student's distribution (Cochran 1977, chapter 6, ratio estimators). The base model's mean square
    of an axis, which its ratio is over, is as uncertain as the new model's.

    Parameters
    ----------
    logs
        Errors of each log.
    least_block_s
        Shortest block [s].

    Returns
    -------
    Lower and upper end; None where the blocks are too few, or nothing can be compared.

    References
    ----------
    Cochran (1977), Sampling Techniques, 3rd edition.
    """
    some = [one for one in logs if len(one.at_s)]
    if not some:
        return None
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        scale = np.mean(np.concatenate([one.base for one in some]) ** 2, axis=0)
        known = np.isfinite(scale) & (scale > 0.0)
        pairs = [np.stack([one.model[:, known] ** 2, one.base[:, known] ** 2], axis=1) / scale[known] for one in some]
    if not known.any() or not all(np.isfinite(one).all() for one in pairs):
        return None
    sums = []
    for one, squares in zip(some, pairs, strict=True):
        block_s, _ = paired_block_seconds(squares.reshape(len(squares), -1), one.rate_hz)
        sums.append(sum_over_blocks(squares, one.at_s, max(block_s, least_block_s)))
    return _interval(np.concatenate(sums))


def _interval(sums: Floats) -> tuple[float, float] | None:
    """Return the interval of a mean of ratios of sums over blocks, shape (blocks, 2, axes), the first over the second."""
    blocks = len(sums)
    if blocks < REGRESSION.paired_fewest_blocks:
        return None
    model, base = sums.sum(axis=0)
    if not model.any():
        return None
    ratios = model / base
    ratio = float(ratios.mean())
    # A tenth of a second to import: only where it is needed.
    from scipy.special import stdtrit

    # A block's part in the logarithm of the mean; that of all blocks is none.
    parts = ((sums[:, 0] - ratios * sums[:, 1]) / base).mean(axis=1) / ratio
    error = np.sqrt(blocks / (blocks - 1.0) * np.sum(parts**2))
    reach = float(stdtrit(blocks - 1, 0.975) * error)
    return ratio * np.exp(-reach), ratio * np.exp(reach)
