"""How far off a hull's coefficients may be: by a share where there is a model of it, else by its dimensions and speed."""

from __future__ import annotations

from math import isfinite, sqrt

import numpy as np

from ferryid.effects.force_model import COEFFICIENTS
from ferryid.effects.thresholds import EFFECTS
from ferryid.types import Flags, Floats
from ferryid.vessel.dimensions import BLOCK_COEFFICIENT, WATER_DENSITY, dimensions, froude_seconds
from ferryid.vessel.profile import Profile


def hull_model_spread(profile: Profile) -> float:
    """Return the standard deviation of a hull model's coefficients as a share of each: the profile's, or the usual one."""
    return profile.hull.spread if isfinite(profile.hull.spread) else EFFECTS.hull_spread


def left_out(hull: Floats) -> Flags:
    """Return which coefficients (26,) a hull model leaves out: damping of higher order and lift on an axis that has none.

    Every hull has them: where none of an axis is in the model, they were not measured.
    """
    missing = np.zeros(len(COEFFICIENTS), dtype=np.bool_)
    for axis in ("X", "Y", "N"):
        # X_u is of first order; X_|u|u and Y_uv are not.
        higher = np.array([name.startswith(f"{axis}_") and len(name) > 3 for name in COEFFICIENTS])
        missing |= higher & ~hull[higher].any()
    return missing


def default_hull_spread(profile: Profile, nu: Floats) -> Floats:
    """Return how large the hull's coefficients may be for a vessel of this size, at its velocities (n, 3), shape (26,).

    Added mass of a half-immersed cylinder of the hull's draught, cross-flow drag with a coefficient of 1 along the hull, lift
    and friction in proportion to the usual speed; Faltinsen (1990), chapters 3 and 6; Fossen (2021), chapter 6. Lift as of a
    plate of the hull's length and draught by slender-body theory, times what the hull's thickness adds; Clarke, Gedling and
    Hine (1983), The application of manoeuvring criteria in hull design using linear theory.
    """
    length, beam, draught = dimensions(profile)
    hull = profile.hull
    speed = float(np.quantile(np.hypot(nu[:, 0], nu[:, 1]), 0.9))
    usual = max(speed, 0.1 * sqrt(9.81 * length) * 0.5)
    turning = usual / length
    time_s = froude_seconds(profile, 20.0)
    plate = 0.5 * WATER_DENSITY * length * draught
    cylinder = 0.5 * np.pi * WATER_DENSITY * draught**2 * length
    m11 = 0.3 * hull.mass_kg
    m22 = max(0.5 * hull.mass_kg, cylinder)
    m33 = max(0.5 * hull.inertia_z, cylinder * length**2 / 12.0)
    m23 = 0.05 * hull.mass_kg * length
    second = {
        "X_|u|u": 0.15 * WATER_DENSITY * beam * draught,
        "Y_|v|v": plate,
        "Y_|r|v": plate * length / 4.0,
        "Y_|v|r": plate * length / 4.0,
        "Y_|r|r": plate * length**2 / 24.0,
        "N_|v|v": plate * length / 8.0,
        "N_|r|v": plate * length**2 / 12.0,
        "N_|v|r": plate * length**2 / 12.0,
        "N_|r|r": plate * length**3 / 32.0,
    }
    slender = 0.5 * np.pi * WATER_DENSITY * draught**2 * (1.0 + 0.4 * BLOCK_COEFFICIENT * beam / draught)
    ahead = {
        "Y_uv": slender,
        "Y_ur": slender * length / 2.0,
        "N_uv": slender * length / 2.0,
        "N_ur": slender * length**2 / 4.0,
    }
    lift = 0.4 * plate * usual
    first = {
        "X_u": hull.mass_kg / time_s,
        "Y_v": max(hull.mass_kg / time_s, lift),
        "Y_r": max(hull.mass_kg * 0.1 * length / time_s, 0.5 * lift * length),
        "N_v": max(hull.mass_kg * 0.1 * length / time_s, 0.5 * lift * length),
        "N_r": max(hull.inertia_z / time_s, 0.25 * lift * length**2),
    }
    third = {
        "X_uuu": second["X_|u|u"] / usual,
        "Y_vvv": second["Y_|v|v"] / usual,
        "N_rrr": second["N_|r|r"] / turning,
    }
    every = {"m11": m11, "m22": m22, "m23": m23, "m32": m23, "m33": m33, **first, **second, **third, **ahead}
    return np.array([every[name] for name in COEFFICIENTS])
