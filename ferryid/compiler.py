"""What numba compiles, kept on disk beside its source; `ferryid.compiled` brings it here at the first call.

numba holds a compiled function to be current as long as its own file is; it does not look at the functions that it calls in
other files, and forgets it whenever anything in its own file changes. Here a function is known by its own code, that of the
compiled functions it calls, and the constants that these use: it is compiled again when one of them changes, and only then.
Of several processes that need the same function one compiles it, and the others wait.
"""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any, cast

import numba
import numpy as np
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.ccallback import CFunc
from numba.np import linalg

try:
    import fcntl
except ImportError:  # Windows: every process compiles
    fcntl = None  # type: ignore[assignment]


def _without_blas() -> None:
    """Load numba's functions of arrays without the matrix products that hardly any loop here calls.

    numba looks whether SciPy has them as it loads the first compiled function, which takes longer than a short simulation; it
    looks again where a function calls one.
    """
    looks = linalg.ensure_blas
    linalg.ensure_blas = lambda: None
    try:
        from numba.np import arraymath  # noqa: F401
    finally:
        linalg.ensure_blas = looks


_without_blas()
LONGEST_WAIT_S = 120.0
"""How long a process waits for another one that compiles the same function before it does so itself."""


def source_stamp(function: Callable[..., Any], sig: Any = ()) -> str:
    """Return a hash of all that a compiled function is made of.

    Parameters
    ----------
    function
        The plain function.
    sig
        numba's types of its arguments: the names of the fields of named tuples count.
    """
    found: dict[str, str] = {}
    _describe(function, found)
    return sha256(repr((sorted(found.items()), sorted(set(_fields(sig))))).encode()).hexdigest()


def _describe(function: Callable[..., Any], found: dict[str, str]) -> None:
    """Add a function, and the compiled functions that it calls, to descriptions by name."""
    name = f"{function.__module__}.{function.__qualname__}"
    if name in found:
        return
    found[name] = ""
    plain = cast("Any", function)
    code = plain.__code__
    cells = (cell.cell_contents for cell in plain.__closure__ or ())
    known = {**plain.__globals__, **dict(zip(code.co_freevars, cells, strict=True))}
    used = sorted(set(_names(code)))
    values = {one: _value(known[one], used, found) for one in used if one in known}
    found[name] = repr((_code(code, plain.__doc__), plain.__defaults__, values))


def _names(code: CodeType) -> Iterator[str]:
    yield from (*code.co_names, *code.co_freevars)
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)


def _code(code: CodeType, doc: str | None = None) -> tuple[Any, ...]:
    """Return what a function does, wherever in its file it stands and whatever its docstring says."""
    constants = (
        None if doc and one == doc else _code(one) if isinstance(one, CodeType) else one for one in code.co_consts
    )
    return code.co_code, code.co_names, code.co_varnames, tuple(constants)


def _value(value: Any, used: list[str], found: dict[str, str]) -> str:
    """Return what stands for something that a function uses by name."""
    plain = getattr(value, "py_func", None) or getattr(value, "_defn", None)
    if plain is not None:
        _describe(plain, found)
        return f"{plain.__module__}.{plain.__qualname__} {sorted(getattr(value, 'targetoptions', {}).items())}"
    if isinstance(value, ModuleType):
        inside = {one: getattr(value, one) for one in used if hasattr(getattr(value, one, None), "py_func")}
        return f"{value.__name__} { {name: _value(one, used, found) for name, one in inside.items()} }"
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape} {sha256(value.tobytes()).hexdigest()}"
    if isinstance(value, tuple):
        return f"({', '.join(_value(one, used, found) for one in value)})"
    if isinstance(value, bool | int | float | complex | str | bytes | None | np.generic):
        return repr(value)
    return f"{getattr(value, '__module__', '')}.{getattr(value, '__qualname__', type(value))} {getattr(value, '_fields', '')}"


def _fields(kind: Any) -> Iterator[str]:
    """Yield the fields of all named tuples in types of numba."""
    inside: Any = kind if isinstance(kind, tuple) else getattr(kind, "args", getattr(kind, "types", ()))
    for one in inside:
        yield from _fields(one)
    if getattr(kind, "fields", None):
        yield f"{kind.instance_class.__qualname__} {kind.fields}"


class _SealedFile(IndexDataCacheFile):  # type: ignore[misc]
    """numba's files, each compiled function with its checksum behind it, where numba does not look."""

    def save(self, key: Any, data: Any) -> None:
        # What was compiled from older source is of no use to anybody.
        current = {one: name for one, name in self._load_index().items() if one[:-1] != key[:-1]}
        self._save_index(current)
        super().save(key, data)

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

    def __init__(self, function: Callable[..., Any], *, inner: bool = False) -> None:
        super().__init__(function)
        # Not by the line, which moves with all that stands above.
        base = re.sub(r"-\d+(?=\.py\d+)", "-inner" * inner, self._impl.filename_base)
        self._cache_file = _SealedFile(self._cache_path, base, "")
        self._lock_path = Path(self._cache_path) / f"{base}.lock"
        self._lock: int | None = None

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        found = self._load(sig, target_context)
        if found is None and self._lock is None:
            self._wait()
            found = self._load(sig, target_context)
            if found is not None:
                self._release()
        return found

    def _load(self, sig: Any, target_context: Any) -> Any:
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
        finally:
            self._release()

    def _wait(self) -> None:
        """Take the function's lock, which lasts until the function is saved, or this process ends."""
        if fcntl is not None:
            with suppress(OSError):
                self._lock = os.open(self._lock_path, os.O_CREAT | os.O_RDWR, 0o666)
                end = time.monotonic() + LONGEST_WAIT_S
                while time.monotonic() < end:
                    try:
                        fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                        return
                    except BlockingIOError:
                        time.sleep(0.05)

    def _release(self) -> None:
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        # The stamp last: see _SealedFile.save.
        return sig, codegen.magic_tuple(), source_stamp(self._py_func, sig)


@dataclass(frozen=True)
class CacheState:
    """Where a compiled function is kept, None for nowhere, and whether it is there as its source stands."""

    folder: Path | None
    compiled: bool


def cache_state(function: Callable[..., Any]) -> CacheState:
    """Return what is kept of a compiled function, without compiling it."""
    kept = getattr(function, "_cache", None)
    if not isinstance(kept, _StampedCache):
        return CacheState(None, compiled=False)
    try:
        index = kept._cache_file._load_index()
    except Exception:  # noqa: BLE001 - what cannot be read is compiled again
        index = {}
    current = any(key[-1] == source_stamp(kept._py_func, key[0]) for key in index)
    return CacheState(Path(kept._cache_path), current)


def dispatcher_of(function: Callable[..., Any], *, inner: bool, options: dict[str, bool]) -> Any:
    """Return numba's dispatcher of a function, kept on disk; the plain function where nothing is to be compiled.

    Parameters
    ----------
    function
        The plain function.
    inner
        For calls from compiled functions alone: what takes Python's objects apart and puts the result together is left out. It
        is longer than most functions, and would be compiled again with every function that calls them.
    options
        Of `numba.njit`.
    """
    # Threads may run them side by side: see ferryid.side_by_side. No function is passed by its address: see `callback`.
    dispatcher = numba.njit(function, nogil=True, no_cfunc_wrapper=True, no_cpython_wrapper=inner, **options)
    if not numba.config.DISABLE_JIT:
        with suppress(RuntimeError, OSError):  # RuntimeError is numba's word for "no folder to keep it in"
            dispatcher._cache = _StampedCache(dispatcher.py_func, inner=inner)
    return dispatcher


_callbacks: list[Any] = []
"""They end with their last name, and an address is none."""


def callback(function: Callable[..., Any], sig: Any) -> int:
    """Compile a function that others call by its address, which is returned.

    Parameters
    ----------
    function
        Of numbers and addresses alone.
    sig
        numba's signature of it.
    """
    compiled: Any = CFunc(function, (sig.args, sig.return_type), {}, {})
    with suppress(RuntimeError, OSError):
        compiled._cache = _StampedCache(function)
    compiled.compile()
    _callbacks.append(compiled)
    return int(compiled.address)
