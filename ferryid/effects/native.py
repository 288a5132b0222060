"""Loads and changes of thrust of effects, compiled for the simulator.

Each is compiled by itself and the simulator, which is compiled once whatever effects there are, calls it by its address.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from ferryid.compiler import callback
from ferryid.effects.simulated import Load, Thrust

ADDRESS, NUMBER = types.int64, types.float64
LOAD, THRUST = (ADDRESS, ADDRESS, *[NUMBER] * 9), (ADDRESS, NUMBER, NUMBER)
"""What loads and changes of thrust are called with."""


def address_of(array: np.ndarray[Any, np.dtype[np.float64]]) -> int:
    """Return where numbers lie, which have to be kept for as long as they are used."""
    return int(array.ctypes.data)


@intrinsic  # type: ignore[untyped-decorator]
def _numbers_at(typing: Any, address: Any) -> Any:
    """Take an address for that of an array of numbers."""

    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        return builder.inttoptr(given[0], context.get_value_type(signature.return_type))

    return types.CPointer(NUMBER)(ADDRESS), generate


def _called(context: Any, builder: Any, signature: Any, given: Any) -> Any:
    """Call the function at the first of the values given with the others."""
    kinds = [context.get_value_type(kind) for kind in signature.args[1:]]
    result = context.get_value_type(signature.return_type)
    function = builder.inttoptr(given[0], ir.FunctionType(result, kinds).as_pointer())
    return builder.call(function, given[1:])


# fmt: off
@intrinsic  # type: ignore[untyped-decorator]
def call_load(
    typing: Any, load: Any, p: Any, out: Any, t: Any, x: Any, y: Any, psi: Any, u: Any, v: Any, r: Any, u_r: Any, v_r: Any
) -> Any:
    """Write the force of the load at an address; `p` and `out` are the addresses of its parameters and of three numbers."""
    return NUMBER(ADDRESS, *LOAD), _called
# fmt: on


@intrinsic  # type: ignore[untyped-decorator]
def call_thrust(typing: Any, thrust: Any, p: Any, speed: Any, force: Any) -> Any:
    """Return a thruster's force by the change of thrust at an address; `p` is the address of its parameters."""
    return NUMBER(ADDRESS, *THRUST), _called


if numba.config.DISABLE_JIT:
    # Plain Python: what stands for an address of a function is its place in a list.
    _functions: list[Callable[..., Any]] = [lambda: None]

    def callback(function: Callable[..., Any], sig: Any) -> int:
        """Keep a function in the list."""
        _functions.append(function)
        return len(_functions) - 1

    def _numbers_at(address: int) -> Any:
        return ctypes.cast(int(address), ctypes.POINTER(ctypes.c_double))

    def call_load(address: int, *given: Any) -> Any:
        """Call the load at a place in the list."""
        return _functions[address](*given)

    call_thrust = call_load


@cache
def load_address(load: Load) -> int:
    """Return the address of a load for `call_load`."""
    compiled = numba.njit(load)

    def native(p, out, t, x, y, psi, u, v, r, u_r, v_r):  # type: ignore[no-untyped-def]
        X, Y, N = compiled(_numbers_at(p), t, x, y, psi, u, v, r, u_r, v_r)
        force = _numbers_at(out)
        force[0], force[1], force[2] = X, Y, N
        return 0.0

    return callback(native, NUMBER(*LOAD))


@cache
def thrust_address(thrust: Thrust) -> int:
    """Return the address of a change of thrust for `call_thrust`."""
    compiled = numba.njit(thrust)

    def native(p, speed, force):  # type: ignore[no-untyped-def]
        return compiled(_numbers_at(p), speed, force)

    return callback(native, NUMBER(*THRUST))
