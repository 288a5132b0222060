"""Resampling of blocks: intervals of coefficients, paired comparisons, and sets of models that cannot be told apart."""

from ferryid.regression.resampling.bootstrap import (
    Blocks,
    block_seconds,
    bootstrap_coefficients,
    percentiles,
    times_drawn,
)
from ferryid.regression.resampling.confidence_set import model_confidence_set
from ferryid.regression.resampling.paired_bootstrap import (
    PairedRatios,
    compare_pairs,
    has_enough_blocks,
    holm,
    paired_block_seconds,
    sum_over_blocks,
)

__all__ = [
    "Blocks",
    "PairedRatios",
    "block_seconds",
    "bootstrap_coefficients",
    "compare_pairs",
    "has_enough_blocks",
    "holm",
    "model_confidence_set",
    "paired_block_seconds",
    "percentiles",
    "sum_over_blocks",
    "times_drawn",
]
