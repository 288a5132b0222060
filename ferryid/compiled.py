"""Inner loops, compiled by numba and kept on disk beside their source.

numba holds a compiled function to be current as long as its own file is; it does not look at the functions that it calls
in other files. The stamp below makes every one depend on all source of its package, such as the whole simulator.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

import numba
from numba.core.caching import FunctionCache, IndexDataCacheFile

P = ParamSpec("P")
R = TypeVar("R")


@cache
def source_stamp(package: str) -> str:
    """Return a hash over the source of a package of ferryid, such as ``"simulate"``."""
    files = sorted((Path(__file__).parent / package).rglob("*.py"))
    return sha256(b"".join(file.read_bytes() for file in files)).hexdigest()


class _SealedFile(IndexDataCacheFile):  # type: ignore[misc]
    """numba's files, each compiled function with its checksum behind it, where numba does not look."""

    def _save_data(self, name: str, data: Any) -> None:
        content = self._dump(data)
        with self._open_for_write(self._data_path(name)) as file:
            file.write(content + sha256(content).digest())

    def _load_data(self, name: str) -> Any:
        content = Path(self._data_path(name)).read_bytes()
        if sha256(content[:-32]).digest() != content[-32:]:
            raise ValueError(f"{name} is damaged")
        return super()._load_data(name)


class _StampedCache(FunctionCache):  # type: ignore[misc]
    """numba's cache on disk, with the stamp in every key; a file that cannot be used, or written, counts as none.

    numba takes whatever stands in its files. What a full disk or a crash has damaged ends in any error of Python, and machine
    code with wrong bits in worse, so that it is sealed with a checksum.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        self._package = function.__module__.partition(".")[2].partition(".")[0]
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = _SealedFile(self._cache_path, self._impl.filename_base, stamp)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # noqa: BLE001 - see above
            with suppress(OSError):
                self.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        try:
            super().save_overload(sig, data)
        except Exception:  # noqa: BLE001 - see above
            self.disable()

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        return (*super()._index_key(sig, codegen), source_stamp(self._package))


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function of numbers, arrays and named tuples at its first call.

    Strict arithmetic (no reordering, no fused multiply-add) gives the same numbers as plain Python would. Where nothing can be
    written beside the source or in the user's cache, it is compiled anew each time.
    """
    return _compiled(function)


def borrowing(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function that makes no array of its own, without counting references to those it is given.

    A plant is some sixty arrays; counting references to each of them in every call took nine tenths of a step's time. numba
    refuses to compile a function this way that makes an array, a slice included.
    """
    return _compiled(function, forceinline=True, _nrt=False)


def _compiled(function: Callable[P, R], **options: bool) -> Callable[P, R]:
    # Threads may run them side by side: see ferryid.diagnose.parallel.
    dispatcher = numba.njit(function, nogil=True, **options)
    if not numba.config.DISABLE_JIT:
        with suppress(RuntimeError, OSError):  # RuntimeError is numba's word for "no folder to keep it in"
            dispatcher._cache = _StampedCache(dispatcher.py_func)
    return cast("Callable[P, R]", dispatcher)
