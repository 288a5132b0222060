"""The prior of a log: the forces of a profile's hull or of a model, and how far off its coefficients may be."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

import numpy as np

from ferryid.diagnose.data.measurements import BLOCK_COEFFICIENT, WATER_DENSITY, WINDOW_LENGTH_M, dimensions
from ferryid.effects.force_model import COEFFICIENTS, ForceModel, Measurements, hull_of
from ferryid.effects.measurements import hull_force_model
from ferryid.effects.thresholds import EFFECTS
from ferryid.errors import FerryIdError
from ferryid.models import Model
from ferryid.models.forces import ModelForces
from ferryid.types import Floats
from ferryid.vessel.profile import Profile


def prior_force_model(
    measurements: Measurements, profile: Profile, model: Model | None = None, sha256: str = ""
) -> tuple[ForceModel, Floats]:
    """Return the force model before any candidate, and how far each of its hull's coefficients is believed to be off.

    The air is still where no wind was measured, and the water too. A model is taken as `ModelForces` has it, with its
    vessel's properties and, in a log that it was diagnosed on, that log's conditions.

    Parameters
    ----------
    measurements
        From `read_measurements`.
    profile
        The vessel.
    model
        A model to start from; the profile's hull where None.
    sha256
        Hash of the log, by which a model knows its conditions.

    Returns
    -------
    ForceModel
        Without candidates.
    ndarray
        Standard deviations, shape (26,), in the units of the coefficients: `EFFECTS.hull_spread` of each where a hull model
        is known (with the model's own intervals added), and what a vessel of this size may have at most where it is not.

    Raises
    ------
    FerryIdError
        For a model of another vessel, or one whose inertia couples surge to sway and yaw.
    """
    if model is not None:
        return _modelled(measurements, profile, model, sha256)
    bare = hull_force_model(measurements, hull_of(profile))
    spread = (
        EFFECTS.hull_spread * np.abs(bare.hull)
        if profile.hull.has_model
        else default_hull_spread(measurements, profile)
    )
    return replace(bare, external=measurements.air_load, ambient=lambda now: now.air_load), spread


def default_hull_spread(measurements: Measurements, profile: Profile) -> Floats:
    """Return how large the hull's coefficients may be for a vessel of this size and speed, shape (26,).

    Added mass of a half-immersed cylinder of the hull's draught, cross-flow drag with a coefficient of 1 along the hull, lift
    and friction in proportion to the usual speed; Faltinsen (1990), chapters 3 and 6; Fossen (2021), chapter 6. Lift as of a
    plate of the hull's length and draught by slender-body theory, times what the hull's thickness adds; Clarke, Gedling and
    Hine (1983), The application of manoeuvring criteria in hull design using linear theory.
    """
    length, beam, draught = dimensions(profile)
    hull = profile.hull
    speed = float(
        np.quantile(np.hypot(measurements.nu[measurements.usable, 0], measurements.nu[measurements.usable, 1]), 0.9)
    )
    usual = max(speed, 0.1 * sqrt(9.81 * length) * 0.5)
    turning = usual / length
    time_s = 20.0 * sqrt(length / WINDOW_LENGTH_M)
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


def _modelled(measurements: Measurements, profile: Profile, model: Model, sha256: str) -> tuple[ForceModel, Floats]:
    known = ModelForces(model)
    if known.force.profile.name != profile.name:
        raise FerryIdError(
            f"{model.label}: a model of {known.force.profile.name} does not apply to {profile.name}. "
            "Fix: give a model and logs of one vessel"
        )
    plain = replace(known.plain(measurements), ambient=lambda now: known.plain(now).external)
    force_model = known.altered(plain, sha256).force_model
    spread = np.sqrt((EFFECTS.hull_spread * force_model.hull) ** 2 + known.variance)
    if not known.force.profile.hull.has_model:
        # What the base does not know, the fit had to learn; terms that it left out may be anything.
        spread = np.where(force_model.hull == 0.0, default_hull_spread(measurements, profile), spread)
    return force_model, spread
