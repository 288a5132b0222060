"""Directions in words."""

from __future__ import annotations

WINDS = (
    *("north", "north-north-east", "north-east", "east-north-east"),
    *("east", "east-south-east", "south-east", "south-south-east"),
    *("south", "south-south-west", "south-west", "west-south-west"),
    *("west", "west-north-west", "north-west", "north-north-west"),
)
"""The sixteen points of the compass, clockwise."""


def compass_point(degrees: float) -> str:
    """Return the nearest of the sixteen points to a direction, clockwise from north."""
    return WINDS[round(degrees / (360.0 / len(WINDS))) % len(WINDS)]


def bearing(degrees: float) -> str:
    """Return a direction in whole degrees of a circle and in words: ``148 deg (south-south-east)``."""
    return f"{round(degrees) % 360} deg ({compass_point(degrees)})"
