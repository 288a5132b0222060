"""Cross-validation from cross-products of blocks."""

from ferryid.regression.cross_validation.block_sums import BlockSums, block_edges, unpurged_parts
from ferryid.regression.cross_validation.folds import MOST_GROUPS, Curves, Folds, FoldSums

__all__ = [
    "MOST_GROUPS",
    "BlockSums",
    "Curves",
    "FoldSums",
    "Folds",
    "block_edges",
    "unpurged_parts",
]
