"""Angles between headings."""

from __future__ import annotations

from math import pi

from ferryid.compiled import borrowing


@borrowing
def shorter_way(angle: float) -> float:
    """Wrap an angle [rad] to (-pi, pi]."""
    return pi - (pi - angle) % (2.0 * pi)
