"""Thresholds as data: a frozen dataclass a stage, each value with its unit, its meaning and what it rests on."""

from __future__ import annotations

from dataclasses import field
from typing import TypeVar

Value = TypeVar("Value", int, float, tuple[float, ...])

BASES = ("derived", "convention", "tuned on")
"""What a basis begins with: it follows from something else, it is a choice that stands for something, or data led to it."""


def threshold(value: Value, unit: str, meaning: str, basis: str) -> Value:
    """Return the field of a dataclass that holds a threshold.

    Parameters
    ----------
    value
        The threshold.
    unit
        Unit, "-" of a pure number.
    meaning
        What it decides, as a phrase that a table can hold.
    basis
        What the value rests on: "derived", "convention" or "tuned on" and, after a colon or the data's name, from or for what.
    """
    return field(default=value, metadata={"unit": unit, "meaning": meaning, "basis": basis})
