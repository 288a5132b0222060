"""The words that names of topics, fields and columns are made of."""

from __future__ import annotations

import re

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
