"""Main dimensions of a vessel, and the lengths of time that follow from them."""

from __future__ import annotations

from math import isfinite, sqrt

from ferryid.vessel.profile import Profile

WATER_DENSITY = 1000.0
BLOCK_COEFFICIENT = 0.7
"""Usual part of the box around a hull that it fills."""
_WINDOW_S, _WINDOW_LENGTH_M = 8.0, 5.0


def dimensions(profile: Profile) -> tuple[float, float, float]:
    """Return length, beam and draught [m], from mass and inertia where the profile does not state them."""
    hull = profile.hull
    # The radius of gyration is about a quarter of the length.
    length = hull.length_m if isfinite(hull.length_m) else 4.0 * sqrt(hull.inertia_z / hull.mass_kg)
    beam = hull.beam_m if isfinite(hull.beam_m) else 0.4 * length
    draught = (
        hull.draught_m
        if isfinite(hull.draught_m)
        else hull.mass_kg / (BLOCK_COEFFICIENT * WATER_DENSITY * length * beam)
    )
    return length, beam, draught


def froude_seconds(profile: Profile, seconds: float) -> float:
    """Return a time [s] that is `seconds` for a vessel of 5 m: longer ones are slower, by Froude's law."""
    return seconds * sqrt(dimensions(profile)[0] / _WINDOW_LENGTH_M)


def window_seconds(profile: Profile) -> float:
    """Return the length [s] of the windows over which the weak form averages the equations of motion of a vessel."""
    return froude_seconds(profile, _WINDOW_S)
