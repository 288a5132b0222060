"""Topics decoded in several threads give what they give one after the other."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import pytest

from ferryid import side_by_side
from ferryid.ingest.many_rows import MANY, of_each
from ferryid.ingest.mcap_reader import _decode_together


@pytest.fixture(autouse=True)
def several(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three cores, whatever machine this is and whatever runs beside."""
    monkeypatch.setattr(side_by_side, "usable_cores", lambda: 3)


class Taking:
    """A decoder that keeps what it is given, and the thread that gave it; it takes some messages with another decoder."""

    def __init__(self, fault: str = "", beside: threading.Barrier | None = None) -> None:
        self.taken: list[tuple[Any, ...]] = []
        self.threads: list[int] = []
        self.fault = fault
        self.beside = beside

    def add(self, buffer: Any, starts: Any, sizes: Any, receive_ns: Any) -> None:
        if self.fault:
            raise ValueError(self.fault)
        if self.beside is not None:
            self.beside.wait()
        self.threads.append(threading.get_ident())
        self.taken.append((buffer, len(starts), len(sizes), int(receive_ns[0])))


def batch(decoders: list[Taking], rows: int, number: int) -> list[Any]:
    return [(one, b"", np.zeros(rows), np.zeros(rows), np.full(rows, number)) for one in decoders]


@pytest.mark.parametrize(("rows", "threads"), [(MANY // 2 - 1, 1), (MANY // 2, 2)])
def test_every_topic_takes_its_batches_in_order_and_large_ones_side_by_side(rows: int, threads: int) -> None:
    beside = threading.Barrier(2, timeout=10.0) if threads > 1 else None
    decoders = [Taking(beside=beside), Taking(beside=beside)]
    for number in range(20):
        _decode_together(batch(decoders, rows, number))
    for one in decoders:
        assert one.taken == [(b"", rows, rows, number) for number in range(20)]
    for pair in zip(decoders[0].threads, decoders[1].threads, strict=True):
        assert len(set(pair)) == threads


def test_large_batches_are_taken_on_one_thread_where_the_cores_are_busy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()
    monkeypatch.setattr(side_by_side, "_alone", True)
    decoders = [Taking(), Taking()]
    for number in range(20):
        _decode_together(batch(decoders, MANY, number))
    assert {*decoders[0].threads, *decoders[1].threads} == {threading.get_ident()}
    assert decoders[1].taken == [(b"", MANY, MANY, number) for number in range(20)]


@pytest.mark.parametrize("faulty", [0, 1])
def test_an_error_of_any_topic_is_raised(faulty: int) -> None:
    decoders = [Taking("no room" if number == faulty else "") for number in range(2)]
    with pytest.raises(ValueError, match="no room"):
        _decode_together(batch(decoders, MANY, 0))


@pytest.mark.parametrize("rows", [1, MANY])
def test_results_come_in_the_order_of_their_items_and_the_first_error_is_raised(rows: int) -> None:
    assert of_each(lambda item: 2 * item, [3, 1, 2], rows) == [6, 2, 4]

    def failing(item: int) -> int:
        raise ValueError(f"item {item}")

    with pytest.raises(ValueError, match="item 3"):
        of_each(failing, [3, 1, 2], rows)
