"""Counted nouns in sentences, and verbs that agree with them: "1 row is left out", "2 rows are left out"."""

from __future__ import annotations

_NOUNS = {"axis": "axes", "basis": "bases"}
_VERBS = {"is": "are", "was": "were", "has": "have", "does": "do"}
_HISSING = ("s", "x", "ch", "sh")


def plural(number: float, noun: str) -> str:
    """Return a noun as it stands beside a number: ``plural(1, "row")`` is "row", ``plural(2, "row")`` is "rows".

    Of several words the last one changes: "damaged row" becomes "damaged rows".
    """
    if number == 1:
        return noun
    rest, space, last = noun.rpartition(" ")
    if last in _NOUNS:
        many = _NOUNS[last]
    elif last.endswith(_HISSING):
        many = f"{last}es"
    elif last.endswith("y") and last[-2:-1] not in "aeiou":
        many = f"{last[:-1]}ies"
    else:
        many = f"{last}s"
    return f"{rest}{space}{many}"


def verb(number: float, singular: str) -> str:
    """Return a verb as it agrees with a number: ``verb(1, "repeats")`` is "repeats", ``verb(2, "repeats")`` is "repeat"."""
    return singular if number == 1 else _VERBS.get(singular, singular.removesuffix("s"))


def counted(number: int, noun: str) -> str:
    """Return a number with its noun: ``counted(1, "row")`` is "1 row", ``counted(2, "row")`` is "2 rows"."""
    return f"{number} {plural(number, noun)}"


def all_counted(number: int, noun: str) -> str:
    """Return all of a number of things: ``all_counted(3, "log")`` is "all 3 logs", ``all_counted(2, "log")`` "both logs"."""
    return f"both {plural(number, noun)}" if number == 2 else f"all {counted(number, noun)}"


def per_cent(share: float) -> str:
    """Return a share in two digits, without a power of ten from 0.01 % on.

    ``per_cent(0.0057)`` is "0.57 %", ``per_cent(1.0)`` "100 %".
    """
    value = float(f"{100.0 * share:.2g}")
    return f"{value:.0f} %" if abs(value) >= 10.0 else f"{value:g} %"
