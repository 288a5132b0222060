"""Topics side by side where they have many rows: NumPy copies columns of many rows without the interpreter's lock."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeVar

from ferryid.side_by_side import over

T = TypeVar("T")
R = TypeVar("R")

MANY = 4096
"""Messages of a batch, or rows of a table, from which on a second thread is worth its cost."""
THREADS = 2
"""Threads for the topics of one log, and for their tables: further ones would wait for the interpreter's lock."""


def of_each(function: Callable[[T], R], items: Iterable[T], rows: int) -> list[R]:
    """Return what a function makes of each item, two at a time where they have many rows together.

    On one thread where the cores are busy already; see `ferryid.side_by_side.over`. Of several errors, that of the first item
    is raised.
    """
    return over(function, items, most=THREADS if rows >= MANY else 1)
