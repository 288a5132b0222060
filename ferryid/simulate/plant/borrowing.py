"""Compiled functions that only borrow the arrays they are given."""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar

from ferryid.simulate.compiled import compiled

P = ParamSpec("P")
R = TypeVar("R")


def borrowing(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function that makes no arrays of its own, without counting references to those it is given.

    A plant is some sixty arrays. Counting references to each of them in every call took two thirds of a step's time.
    numba refuses to compile a function this way that makes an array.
    """
    dispatcher = compiled(function)
    options = getattr(dispatcher, "targetoptions", None)
    if options is not None:  # None where compilation is switched off
        options["_nrt"] = False
    return dispatcher
