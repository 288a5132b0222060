"""Cross-products of one log in pieces, from which every fold, split and bootstrap draw is a sum.

A log is cut into contiguous blocks, and each block into three: the rows near the block before it, the middle, and the rows near
the block after it. Rows near a border share smoothing windows with rows beyond it, so they sit out wherever the two blocks
stand on different sides of a comparison, and take part wherever both stand on the same side.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ferryid.regression.cross_products import CHUNK_ROWS, CrossProducts, Rows, first_mean, gram, not_finite, subtract
from ferryid.types import Flags, Floats, Ints

OUT = -1
"""Label of a block that sits out."""


def block_edges(used: Flags, blocks: int, purge: int) -> Ints:
    """Cut rows into blocks of equally many used ones, and each into three pieces; return the borders.

    Parameters
    ----------
    used
        Rows that count, shape (n,).
    blocks
        B, the number of blocks; each must hold more than two purges, so that no row is near both of its borders.
    purge
        Rows within which two rows share a smoothing window.

    Returns
    -------
    ndarray
        First row of each piece, and n at the end, shape (3 B + 1,): near the block before, middle, near the block after.
    """
    where = np.flatnonzero(used)
    bounds = -(-np.arange(1, blocks) * where.size // blocks)
    first, last = where[bounds], where[bounds - 1]
    edges = np.empty(3 * blocks + 1, dtype=np.int64)
    edges[0::3] = [0, *first, used.size]
    edges[1::3] = [0, *(last + purge + 1)]
    edges[2::3] = [*(first - purge), used.size]
    return np.maximum.accumulate(np.clip(edges, 0, used.size))


def unpurged_parts(labels: Ints) -> Flags:
    """Return the pieces that are not near a block of another label, shape (B, 3), of the label of each block, shape (B,)."""
    same = labels[1:] == labels[:-1]
    return np.column_stack([np.append(True, same), np.ones(len(labels), dtype=bool), np.append(same, True)])


@dataclass(frozen=True, eq=False)
class BlockSums:
    """Cross-products of B blocks of one log, in three pieces each, about one shift; see `CrossProducts`.

    Attributes
    ----------
    n
        Rows of each piece, shape (B, 3).
    K, m
        Number of regressors and of outputs.
    shift
        Shape (K + m,).
    products
        Shape (B, 3, K + m + 1, K + m + 1).
    """

    n: Ints
    K: int
    m: int
    shift: Floats
    products: Floats

    @classmethod
    def of(cls, rows: Rows, edges: Ints, *, names: Sequence[str] = (), where: str = "fit") -> BlockSums:
        """Cross-products of the rows between the `edges` of one log, shape (3 B + 1,).

        Raises
        ------
        FerryIdError
            When a value is not finite; the message names the column.
        """
        X, Y = rows.chunk(0, 0)
        K, m = X.shape[1], Y.shape[1]
        count = len(edges) - 1
        products = np.zeros((count, K + m + 1, K + m + 1))
        shift = first_mean(rows)
        if shift is None:
            return cls(
                np.zeros((count // 3, 3), dtype=np.int64),
                K,
                m,
                np.zeros(K + m),
                products.reshape(-1, 3, *products.shape[1:]),
            )
        used = np.ones(len(rows.Y), dtype=bool) if rows.mask is None else rows.mask
        before = np.concatenate([[0], np.cumsum(used)])
        ends = before[edges]
        scratch = np.empty((K + m + 1, CHUNK_ROWS))
        scratch[-1] = 1.0
        for low in range(0, len(used), CHUNK_ROWS):
            high = min(low + CHUNK_ROWS, len(used))
            start, stop = before[low], before[high]
            if start == stop:
                continue
            X, Y = rows.chunk(low, high, scratch[:K])
            filled = scratch[:, : len(Y)].T
            with np.errstate(all="ignore"):
                subtract(X, shift[:K], filled[:, :K])
                subtract(Y, shift[K:], filled[:, K:-1])
            first, last = np.searchsorted(ends, [start, stop - 1], side="right") - 1
            for piece in range(first, last + 1):
                part = slice(max(ends[piece], start) - start, min(ends[piece + 1], stop) - start)
                with np.errstate(all="ignore"):
                    products[piece] += gram(filled[part])
            if not np.isfinite(products[first : last + 1]).all():
                raise not_finite(X, Y, names, where)
        return cls(np.diff(ends).reshape(-1, 3), K, m, shift, products.reshape(-1, 3, *products.shape[1:]))

    @property
    def blocks(self) -> int:
        """B, the number of blocks."""
        return len(self.n)

    def separately(self, chosen: Flags) -> list[CrossProducts]:
        """Return the cross-products of each chosen block, shape (B,), without its rows near blocks that are not."""
        kept = unpurged_parts(np.where(chosen, 0, OUT))
        return [
            CrossProducts(int(n[keep].sum()), self.K, self.m, self.shift, products[keep].sum(axis=0))
            for n, products, keep, one in zip(self.n, self.products, kept, chosen, strict=True)
            if one
        ]

    def labelled(self, labels: Ints, label: int = 0) -> CrossProducts:
        """Return the cross-products of all blocks with one label, without their rows near blocks of another.

        Parameters
        ----------
        labels
            Label of each block, shape (B,); `OUT` for a block that sits out.
        label
            Which blocks to sum.
        """
        return self.summed(unpurged_parts(labels) & (labels == label)[:, None])

    def summed(self, kept: Flags) -> CrossProducts:
        """Return the cross-products of the pieces that `kept` marks, shape (B, 3), or whole blocks, shape (B, 1)."""
        pieces = np.broadcast_to(kept, self.n.shape)
        products = self.products[pieces].sum(axis=0)
        return CrossProducts(int(self.n[pieces].sum()), self.K, self.m, self.shift, products)
