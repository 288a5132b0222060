"""Topics decoded in several threads give what they give one after the other."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

from ferryid.ingest.side_by_side import MANY, decode_together, of_each


class Taking:
    """A decoder that keeps what it is given, and the thread that gave it."""

    def __init__(self, fault: str = "") -> None:
        self.taken: list[tuple[Any, ...]] = []
        self.threads: set[int] = set()
        self.fault = fault

    def add(self, buffer: Any, starts: Any, sizes: Any, receive_ns: Any) -> None:
        if self.fault:
            raise ValueError(self.fault)
        self.threads.add(threading.get_ident())
        self.taken.append((buffer, len(starts), len(sizes), int(receive_ns[0])))


def batch(decoders: list[Taking], rows: int, number: int) -> list[Any]:
    return [(one, b"", np.zeros(rows), np.zeros(rows), np.full(rows, number)) for one in decoders]


@pytest.mark.parametrize(("rows", "threads"), [(MANY // 2 - 1, 1), (MANY // 2, 2)])
def test_every_topic_takes_its_batches_in_order_and_large_ones_side_by_side(rows: int, threads: int) -> None:
    decoders = [Taking(), Taking()]
    with ThreadPoolExecutor(1) as pool:
        for number in range(20):
            decode_together(pool, batch(decoders, rows, number))
    for one in decoders:
        assert one.taken == [(b"", rows, rows, number) for number in range(20)]
    assert len(decoders[0].threads | decoders[1].threads) == threads


@pytest.mark.parametrize("faulty", [0, 1])
def test_an_error_of_any_topic_is_raised(faulty: int) -> None:
    decoders = [Taking("no room" if number == faulty else "") for number in range(2)]
    with ThreadPoolExecutor(1) as pool, pytest.raises(ValueError, match="no room"):
        decode_together(pool, batch(decoders, MANY, 0))


@pytest.mark.parametrize("rows", [1, MANY])
def test_results_come_in_the_order_of_their_items_and_the_first_error_is_raised(rows: int) -> None:
    assert of_each(lambda item: 2 * item, [3, 1, 2], rows) == [6, 2, 4]

    def failing(item: int) -> int:
        raise ValueError(f"item {item}")

    with pytest.raises(ValueError, match="item 3"):
        of_each(failing, [3, 1, 2], rows)
