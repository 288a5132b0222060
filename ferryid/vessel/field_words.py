"""The words that names of topics, fields and columns are made of."""

from __future__ import annotations

import re
from collections.abc import Iterable

from ferryid.errors import did_you_mean
from ferryid.vessel.units import KINDS, unit_name


def words_of(path: str) -> tuple[str, ...]:
    """Return the words of a field's path or a topic's name in lower case, units in brackets excepted."""
    text = re.sub(r"\[[^\]]*\]|\([^)]*\)", " ", path)
    text = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", text)
    return tuple(word for word in re.split(r"[^A-Za-z0-9]+|(?<=[a-z]{3})(?=[0-9])", text.lower()) if word)


def unit_of_name(path: str, kind: str) -> str:
    """Return the unit of a kind that a column's name has in brackets, ``"n_prop [rps]"``, or an empty string."""
    for text in re.findall(r"[\[(]([^\])]*)[\])]", path):
        if unit_name(text.strip()) in KINDS[kind]:
            return unit_name(text.strip())
    return ""


def nearest_field(path: str, fields: Iterable[str]) -> str:
    """Return ``' Did you mean "x"?'`` for the field that is meant, or an empty string.

    One of the same name in another unit, ``"u [kn]"`` for ``"u [m/s]"``, comes before any that is spelt alike.
    """
    name, there = _without_unit(path)[0], list(fields)
    same = next((field for field in there if _without_unit(field)[0] == name), None)
    if same is None:
        return did_you_mean(path, there)
    unit = _without_unit(same)[1]
    stated = f', with unit = "{unit}"' if unit else ""
    return f' Did you mean "{same}"{stated}?'


def _without_unit(path: str) -> tuple[str, str]:
    """Return a column's name without the unit that ends it in brackets, and the unit; a number is a place in an array."""
    found = re.fullmatch(r"(.+?)\s*[\[(]([^\[\]()]+)[\])]", path)
    unit = unit_name(found[2].strip()) if found else ""
    if found is None or unit.isdigit() or not any(unit in units for units in KINDS.values()):
        return path, ""
    return found[1], unit
