"""Main dimensions of a vessel, and the lengths of time that follow from them."""

from __future__ import annotations

from math import isfinite, sqrt

from ferryid.vessel.profile import Profile

WATER_DENSITY = 1000.0
BLOCK_COEFFICIENT = 0.7
"""Usual part of the box around a hull that it fills."""
_WINDOW_S, _WINDOW_LENGTH_M = 8.0, 5.0
SHORTEST_WINDOW_S, LONGEST_WINDOW_S = 0.2, 120.0
"""What windows may be set to [s]: a few rows of a fast log, and the windows of a ship of a kilometre."""


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


def off_hull(profile: Profile, x: float, y: float) -> str:
    """Return that a point is not on the hull, as the end of a sentence; empty where it is.

    The body origin is taken to be amidships or at the centre of gravity, whichever leaves more room.

    Parameters
    ----------
    profile
        The vessel.
    x, y
        How far the point is ahead and to starboard of the body origin [m].
    """
    length, beam, _ = dimensions(profile)
    middle = profile.hull.x_g_m
    ends = (min(middle, 0.0) - 0.5 * length, max(middle, 0.0) + 0.5 * length)
    if not ends[0] <= x <= ends[1]:
        return f"{abs(x):.2f} m {'ahead' if x > 0.0 else 'astern'} of the body origin is off a hull of {length:.3g} m"
    if abs(y) > 0.5 * beam:
        return f"{abs(y):.2f} m to {'starboard' if y > 0.0 else 'port'} is off a hull that is {beam:.3g} m wide"
    return ""


def froude_seconds(profile: Profile, seconds: float) -> float:
    """Return a time [s] that is `seconds` for a vessel of 5 m: longer ones are slower, by Froude's law."""
    return seconds * sqrt(dimensions(profile)[0] / _WINDOW_LENGTH_M)


def window_seconds(profile: Profile) -> float:
    """Return the length [s] of the windows over which the weak form averages the equations of motion of a vessel.

    That which its profile states, or else 8 s for a vessel of 5 m, by Froude's law.
    """
    return profile.window_s if isfinite(profile.window_s) else froude_seconds(profile, _WINDOW_S)
