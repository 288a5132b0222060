"""Cross-products in pieces: cut by hand, and summed against the rows themselves."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from ferryid.errors import FerryIdError
from ferryid.regression.cross_products import CHUNK_ROWS, CrossProducts, Rows
from ferryid.regression.cross_validation.block_sums import OUT, BlockSums, block_edges

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
K, M = 4, 2


def rows_with(used: Flags, seed: int = 0) -> Rows:
    rng = np.random.default_rng(seed)
    X = 5.0 + rng.normal(size=(len(used), K)) * [1.0, 30.0, 0.01, 4.0]
    return Rows.of(X, rng.normal(size=(len(used), M)) - 200.0, used)


def block_of(used: Flags, blocks: int) -> NDArray[np.int64]:
    """Number of the block of every used row, counted row by row; -1 elsewhere."""
    size = np.count_nonzero(used)
    number = np.full(len(used), -1)
    for place, row in enumerate(np.flatnonzero(used)):
        number[row] = place * blocks // size
    return number


def far_from_others(used: Flags, labels: NDArray[np.int64], label: int, purge: int) -> Flags:
    """Used rows of a label with no used row of another label within `purge` rows, looked at one by one."""
    number = block_of(used, len(labels))
    of = np.where(number >= 0, labels[number], -99)
    kept = np.zeros(len(used), dtype=bool)
    for row in np.flatnonzero(of == label):
        near = of[max(0, row - purge) : row + purge + 1]
        kept[row] = bool(np.isin(near, [label, -99]).all())
    return kept


def same(found: CrossProducts, rows: Rows, kept: Flags) -> None:
    X, Y = rows.inputs[0], rows.Y
    assert X is not None
    assert found.n == np.count_nonzero(kept)
    Z = np.column_stack([np.hstack([X, Y]) - found.shift, np.ones(len(Y))])[kept]
    np.testing.assert_allclose(found.products, Z.T @ Z, rtol=1e-10, atol=1e-9)


def test_borders_by_hand() -> None:
    # Rows 0-3, 4-7 and 8-11, of which one on either side of a border is near it.
    assert block_edges(np.ones(12, dtype=bool), 3, 1).tolist() == [0, 0, 3, 4, 5, 7, 8, 9, 12, 12]


def test_borders_at_a_gap_by_hand() -> None:
    # Of ten used rows 4 and 5 end and begin a block, eight rows apart: nothing is near. With a purge of 9, row 4 to row 13 is.
    used = np.ones(18, dtype=bool)
    used[5:13] = False
    assert block_edges(used, 2, 3).tolist() == [0, 0, 10, 13, 13, 18, 18]
    assert block_edges(used, 2, 9).tolist() == [0, 0, 4, 13, 14, 18, 18]


def test_one_block_has_no_near_rows() -> None:
    assert block_edges(np.ones(7, dtype=bool), 1, 3).tolist() == [0, 0, 7, 7]
    rows = rows_with(np.ones(7, dtype=bool))
    pieces = BlockSums.of(rows, block_edges(np.ones(7, dtype=bool), 1, 3))
    assert pieces.n.tolist() == [[0, 7, 0]]
    same(pieces.labelled(np.zeros(1, dtype=np.int64)), rows, np.ones(7, dtype=bool))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("n", "blocks", "purge"), [(60, 3, 0), (200, 7, 3), (3 * CHUNK_ROWS + 11, 5, 40), (400, 12, 9)]
)
@pytest.mark.parametrize("gaps", [0, 4])
def test_labelled_blocks_are_the_rows_that_share_no_window_with_another_label(
    n: int, blocks: int, purge: int, gaps: int
) -> None:
    rng = np.random.default_rng(n + gaps)
    used = np.ones(n, dtype=bool)
    for start in rng.integers(0, n, gaps):
        used[start : start + n // 15] = False
    rows = rows_with(used)
    pieces = BlockSums.of(rows, block_edges(used, blocks, purge))
    assert pieces.blocks == blocks
    for _ in range(4):
        labels = rng.integers(OUT, 2, blocks)
        for label in (0, 1):
            same(pieces.labelled(labels, label), rows, far_from_others(used, labels, label, purge))


def test_other_rows_may_be_used_between_the_same_borders() -> None:
    used = np.ones(300, dtype=bool)
    edges = block_edges(used, 4, 10)
    fewer = used.copy()
    fewer[[*range(20), *range(140, 180), *range(290, 300)]] = False
    rows = rows_with(fewer)
    labels = np.array([0, 1, 0, 0])
    same(BlockSums.of(rows, edges).labelled(labels), rows, far_from_others(used, labels, 0, 10) & fewer)


def test_pieces_and_whole_blocks_sum_up() -> None:
    used = np.ones(90, dtype=bool)
    rows = rows_with(used)
    pieces = BlockSums.of(rows, block_edges(used, 3, 4))
    row = np.arange(90)
    same(pieces.summed(np.array([[True], [False], [True]])), rows, (row < 30) | (row >= 60))
    middle = np.tile([False, True, False], (3, 1))
    same(pieces.summed(middle), rows, (row < 26) | ((row >= 34) & (row < 56)) | (row >= 64))
    assert pieces.summed(np.zeros((3, 1), dtype=bool)).n == 0


def test_without_a_used_row_there_is_nothing_to_add() -> None:
    used = np.ones(50, dtype=bool)
    rows, none = rows_with(used), rows_with(np.zeros(50, dtype=bool))
    edges = block_edges(used, 2, 5)
    empty, full = (BlockSums.of(one, edges).labelled(np.zeros(2, dtype=np.int64)) for one in (none, rows))
    assert (empty.n, empty.products.any()) == (0, False)
    for one in (empty + full, full + empty):
        same(one, rows, used)


def test_what_is_not_finite_is_named() -> None:
    used = np.ones(50, dtype=bool)
    rows = rows_with(used)
    assert rows.inputs[0] is not None
    rows.inputs[0][31, 2] = np.inf
    with pytest.raises(FerryIdError, match=r'trial: basis term "rr" must be finite'):
        BlockSums.of(rows, block_edges(used, 2, 5), names=("u", "v", "rr", "r"), where="trial")
