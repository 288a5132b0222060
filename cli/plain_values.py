"""Words of the command line as values, without pydantic.

typer has pydantic check every value, also those of options that are not given, and importing it takes longer than all else that
a command needs to begin. Texts, numbers and paths are plain enough to be made here; whatever is not goes to typer, which says
what is wrong with it.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from typer.core import TyperCommand, TyperGroup

from ferryid.cli.forgotten_values import refuse_forgotten_values

_INTEGER = re.compile(r"[+-]?[0-9]{1,18}")
_NUMBER = re.compile(r"[+-]?[0-9]+(\.[0-9]*)?([eE][+-]?[0-9]{1,2})?")


class PlainValues:
    """A command or group of typer, as a class beside its own, that makes plain values by itself."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the options and arguments, that for the help included."""
        params: list[Any] = super().get_params(ctx)  # type: ignore[misc]
        for param in params:
            # Other versions of typer may have no such method; theirs is what happens then.
            own = getattr(param, "get_runtime_param", None)
            make = None if own is None else _maker(param)
            if make is not None and not isinstance(getattr(own, "__self__", None), _Coercion):
                param.get_runtime_param = _Coercion(make, own, param).itself
        return params

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Refuse an option whose value was forgotten; an unfinished command line may have such."""
        if not ctx.resilient_parsing:
            refuse_forgotten_values(self.get_params(ctx), args)
        words: list[str] = super().parse_args(ctx, args)  # type: ignore[misc]
        return words


class PlainCommand(PlainValues, TyperCommand):
    """A command that makes plain values."""


class PlainGroup(PlainValues, TyperGroup):
    """A group that makes plain values; its commands are of classes of their own."""


class _Coercion:
    """What typer asks for a value, in the place of its own."""

    def __init__(self, make: Callable[[Any], Any], own: Callable[[], Any], param: Any) -> None:
        self._make, self._own, self._param = make, own, param

    def __getattr__(self, name: str) -> Any:
        """Return what else typer asks its own for."""
        return getattr(self._own(), name)

    def itself(self) -> _Coercion:
        return self

    def coerce(self, value: Any, *given: Any, **named: Any) -> Any:
        """Return the value of a word, or of several."""
        if value is None:
            return () if self._param.multiple or self._param.nargs == -1 else None
        try:
            return self._make(value)
        except ValueError:
            return self._own().coerce(value, *given, **named)


def _maker(param: Any) -> Callable[[Any], Any] | None:
    """Return what makes values of a parameter, None where typer has to."""
    try:
        kind, info = param.type_descriptor.annotation, param.type_descriptor.parameter_info
        if info.parser is not None or info.min is not None or info.max is not None:
            return None
        if kind is Path:
            stated = info.exists or info.writable or info.resolve_path or info.allow_dash or info.path_type is not None
            return None if stated or not (info.file_okay and info.dir_okay) else _path
    except AttributeError:
        # Another version of typer, which keeps what is asked of a value elsewhere.
        return None
    return {bool: _flag, str: _text, int: _integer, float: _number, list[str]: _texts}.get(kind)


def _flag(value: Any) -> bool:
    if not isinstance(value, bool):
        raise ValueError
    return value


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError
    return value


def _texts(value: Any) -> list[str]:
    if not isinstance(value, list | tuple):
        raise ValueError
    return [_text(one) for one in value]


def _integer(value: Any) -> int:
    if type(value) is int:
        return value
    if not _INTEGER.fullmatch(_text(value)):
        raise ValueError
    return int(value)


def _number(value: Any) -> float:
    if type(value) in (int, float):
        return float(value)
    if not _NUMBER.fullmatch(_text(value)):
        raise ValueError
    return float(value)


def _path(value: Any) -> Path:
    if not isinstance(value, Path):
        value = Path(_text(value))
    if "\0" in str(value):
        raise ValueError
    if os.path.exists(value) and not os.access(value, os.R_OK):
        raise ValueError
    return value
