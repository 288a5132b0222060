"""Counted nouns in sentences: one row, two rows."""

from __future__ import annotations

_IRREGULAR = {"axis": "axes", "basis": "bases", "is": "are", "was": "were", "has": "have", "this": "these"}
_HISSING = ("s", "x", "ch", "sh")


def plural(number: float, noun: str) -> str:
    """Return a noun, or a verb such as "is", as it stands beside a number: ``plural(1, "row")`` is "row".

    Of several words the last one changes: "damaged row" becomes "damaged rows".
    """
    if number == 1:
        return noun
    rest, space, last = noun.rpartition(" ")
    if last in _IRREGULAR:
        many = _IRREGULAR[last]
    elif last.endswith(_HISSING):
        many = f"{last}es"
    elif last.endswith("y") and last[-2:-1] not in "aeiou":
        many = f"{last[:-1]}ies"
    else:
        many = f"{last}s"
    return f"{rest}{space}{many}"


def counted(number: int, noun: str) -> str:
    """Return a number with its noun: ``counted(1, "row")`` is "1 row", ``counted(2, "row")`` is "2 rows"."""
    return f"{number} {plural(number, noun)}"
