"""Topics side by side: NumPy copies columns of many rows without the interpreter's lock."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from ferryid.ingest.bulk import Decoder

T = TypeVar("T")
R = TypeVar("R")

Call = tuple["Decoder", Any, Any, Any, Any]
"""A decoder, and what its `add` takes: buffer, starts, sizes and receive times."""

MANY = 4096
"""Messages of a batch, or rows of a table, from which on a second thread is worth its cost."""


def decode_together(pool: ThreadPoolExecutor, calls: Sequence[Call]) -> None:
    """Let every decoder take its messages of one batch, side by side where they are many; each is named once."""
    here, beside = calls[:1], calls[1:]
    if sum(len(starts) for _, _, starts, _, _ in calls) < MANY:
        here, beside = calls, []
    others = [pool.submit(decoder.add, *rest) for decoder, *rest in beside]
    # This thread would wait otherwise.
    for decoder, *rest in here:
        decoder.add(*rest)
    for other in others:
        other.result()


def of_each(function: Callable[[T], R], items: Iterable[T], rows: int) -> list[R]:
    """Return what a function makes of each item, two at a time where they have many rows together.

    Of several errors, that of the first item is raised.
    """
    if rows < MANY:
        return [function(item) for item in items]
    with ThreadPoolExecutor(2) as pool:
        return list(pool.map(function, items))
