"""The prior of a log: the forces of a profile's hull or of a model, and how far off its coefficients may be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ferryid.effects.force_model import COEFFICIENTS, ForceModel, Measurements, hull_of
from ferryid.effects.hull_spread import default_hull_spread, hull_model_spread, left_out
from ferryid.effects.measurements import hull_force_model
from ferryid.effects.thresholds import EFFECTS
from ferryid.errors import FerryIdError
from ferryid.models import Model
from ferryid.models.forces import ModelForces, hull_covariance
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
        Standard deviations, shape (26,), in the units of the coefficients: those of `hull_model_spread` where a hull
        model is known, of `EFFECTS.hull_spread` with the intervals of a fitted model, and what a vessel of this size may have
        at most where none is known, or for damping that the hull model leaves out (`left_out`).

    Raises
    ------
    FerryIdError
        For a model of another vessel, or one whose inertia couples surge to sway and yaw.
    """
    if model is not None:
        return _modelled(measurements, profile, model, sha256)
    bare = hull_force_model(measurements, hull_of(profile))
    largest = default_hull_spread(profile, measurements.nu[measurements.usable])
    spread = largest
    if profile.hull.is_known:
        spread = np.where(left_out(bare.hull), largest, hull_model_spread(profile) * np.abs(bare.hull))
    return replace(bare, external=measurements.air_load, ambient=lambda now: now.air_load), spread


def correlation_root(model: Model, spread: Floats) -> Floats | None:
    """Return the Cholesky factor of the correlation of a model's coefficients in its prior, shape (h, h); None without any.

    The fit's covariance is a part of the prior's variance; the rest, by which formulas may be off, is independent. Where a
    diagnosis refitted the hull, intervals are stored alone.

    Parameters
    ----------
    model
        The model.
    spread
        Standard deviations of the prior, `COEFFICIENTS` first, shape (h,).
    """
    if model.hull:
        return None
    n, covariance = len(COEFFICIENTS), hull_covariance(model)
    scale = np.where(spread[:n] > 0.0, spread[:n], np.inf)
    correlation = np.eye(len(spread))
    correlation[:n, :n] += (covariance - np.diag(np.diag(covariance))) / np.outer(scale, scale)
    return np.asarray(np.linalg.cholesky(correlation), dtype=np.float64) if covariance.any() else None


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
    if not known.force.profile.hull.is_known:
        # What the base does not know, the fit had to learn; terms that it left out may be anything.
        spread = np.where(
            force_model.hull == 0.0, default_hull_spread(profile, measurements.nu[measurements.usable]), spread
        )
    return force_model, spread
