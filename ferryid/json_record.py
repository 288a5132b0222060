"""Frozen dataclasses as JSON objects: keys are the names of the fields, values follow the type hints.

A named tuple is an array. A field whose key in JSON is another than its name is declared by
`json_key`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from functools import cache
from math import nan
from types import UnionType
from typing import Any, ClassVar, Self, Union, get_args, get_origin, get_type_hints

from ferryid.files import finite

Number = int | float
"""A number that is written as it was read: a whole one stays whole."""


def json_key(key: str) -> dict[str, str]:
    """Return the metadata of a dataclass field whose key in JSON is another than its name."""
    return {"key": key}


class Record:
    """Base of dataclasses that are kept as JSON objects.

    Attributes
    ----------
    DERIVED
        Properties that are written beside the fields, by JSON key; they are not read back.
    """

    DERIVED: ClassVar[Mapping[str, str]] = {}

    def to_json(self) -> dict[str, Any]:
        """Return it as plain data; what is not finite becomes None."""
        made = _plain(self)
        assert isinstance(made, dict)
        return made

    @classmethod
    def from_json(cls, data: Any) -> Self:
        """Return it from plain data.

        Raises
        ------
        ValueError
            For keys that are missing or unknown, and for values of another type.
        """
        made = _parsed(cls, data)
        assert isinstance(made, cls)
        return made


def _plain(value: Any) -> Any:
    if is_dataclass(value) and not isinstance(value, type):
        made = {_key(one): _plain(getattr(value, one.name)) for one in fields(value)}
        derived = getattr(type(value), "DERIVED", {})
        return made | {key: _plain(getattr(value, name)) for key, name in derived.items()}
    if isinstance(value, Mapping):
        return {str(key): _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    return finite(value)


def _key(one: Field[Any]) -> str:
    return str(one.metadata.get("key", one.name))


@cache
def _hints(kind: type) -> dict[str, Any]:
    return get_type_hints(kind)


def _parsed(kind: Any, value: Any) -> Any:
    """Return a value of a type from plain data."""
    origin, arguments = get_origin(kind), get_args(kind)
    if kind is Any:
        return value
    if origin in (Union, UnionType):
        if value is None and type(None) in arguments:
            return None
        kinds = [one for one in arguments if one is not type(None)]
        # Of several only simple ones: an integer that may be one is not made a float.
        return _parsed(next((one for one in kinds if type(value) is one), kinds[-1]), value)
    if isinstance(kind, type) and issubclass(kind, tuple) and isinstance(value, list):
        inner = tuple(_hints(kind).values())
        return kind(*(_parsed(one, each) for one, each in zip(inner, value, strict=True)))
    if origin is tuple and isinstance(value, list):
        inner = arguments[:1] * len(value) if arguments[-1] is Ellipsis else arguments
        return tuple(_parsed(one, each) for one, each in zip(inner, value, strict=True))
    if origin is not None and issubclass(origin, Mapping) and isinstance(value, dict):
        return {key: _parsed(arguments[1], each) for key, each in value.items()}
    if is_dataclass(kind) and isinstance(kind, type):
        return _parsed_dataclass(kind, value)
    if kind is float and (value is None or (isinstance(value, int | float) and not isinstance(value, bool))):
        return nan if value is None else float(value)
    if isinstance(kind, type) and isinstance(value, kind):
        return value
    raise ValueError(f"expected {kind}, found {type(value).__name__}")


def _parsed_dataclass(kind: type, value: Any) -> Any:
    if not isinstance(value, dict):
        raise ValueError(f"{kind.__name__}: expected an object, found {type(value).__name__}")
    assert is_dataclass(kind)
    known = {_key(one): one for one in fields(kind)}
    derived = getattr(kind, "DERIVED", {})
    missing = [
        key
        for key, one in known.items()
        if key not in value and one.default is MISSING and one.default_factory is MISSING
    ]
    unknown = [key for key in value if key not in known and key not in derived]
    if missing or unknown:
        raise ValueError(f"{kind.__name__}: missing {missing}, unknown {unknown}")
    hints = _hints(kind)
    return kind(**{one.name: _parsed(hints[one.name], value[key]) for key, one in known.items() if key in value})
