"""Inner loops, compiled by numba when they are first called.

Importing numba takes longer than what many commands do, and most commands import loops that they never call.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import update_wrapper
from threading import Lock
from typing import Any, ParamSpec, TypeVar, cast

P = ParamSpec("P")
R = TypeVar("R")

_lock = Lock()


class _Loop:
    """A function that numba's dispatcher replaces at the first call, and wherever anything else of it is asked for."""

    def __init__(self, function: Callable[..., Any], options: dict[str, bool]) -> None:
        update_wrapper(self, function)
        self._options = options

    def __call__(self, *given: Any, **named: Any) -> Any:
        return self._dispatcher(*given, **named)

    def __getattr__(self, name: str) -> Any:
        if name in ("_dispatcher", "_inner"):
            from ferryid.compiler import dispatcher_of

            # Each of two threads would compile for itself.
            with _lock:
                if name not in self.__dict__:
                    self.__dict__[name] = dispatcher_of(self.__wrapped__, inner=name == "_inner", options=self._options)
            return self.__dict__[name]
        if name == "_numba_type_":
            # What compiled functions that call this one take it for.
            from numba import types

            return types.Dispatcher(self._inner)
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self._dispatcher, name)

    def __reduce__(self) -> str:
        return str(self.__wrapped__.__qualname__)


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function of numbers, arrays and named tuples at its first call.

    Strict arithmetic (no reordering, no fused multiply-add) gives the same numbers as plain Python would. Where nothing can be
    written beside the source or in the user's cache, it is compiled anew each time.
    """
    return cast("Callable[P, R]", _Loop(function, {}))


def borrowing(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function that makes no array of its own, without counting references to those it is given.

    A plant is some sixty arrays; counting references to each of them in every call took nine tenths of a step's time. numba
    refuses to compile a function this way that makes an array, a slice included.
    """
    return cast("Callable[P, R]", _Loop(function, {"forceinline": True, "_nrt": False}))
