"""The base model in a log: the profile's hull, ready for terms to be laid on top of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ferryid.cached import cached_property
from ferryid.effects.force_model import ForceModel, as_measured, required_force
from ferryid.effects.measurements import measurements_of_motion, payload_and_damping
from ferryid.models import blank_model, usable_rows
from ferryid.models.forces import ModelForces, force_law
from ferryid.models.prediction import Prediction, predict_with_effects
from ferryid.signals.prepare import Prepared, prepare
from ferryid.signals.smooth import odd_rows, steady_mean
from ferryid.types import Floats
from ferryid.validation.rivals.learner import SMOOTHER, WINDOW_S
from ferryid.vessel.profile import Profile

Rows = NDArray[np.bool_]


@dataclass(frozen=True)
class Base:
    """One log as the base model sees it.

    Attributes
    ----------
    prepared
        The log.
    prediction
        What the profile's hull expects of it, in still air where no wind was measured.
    force_model
        The same as a force model, with the thrusters' forces smoothed as the motion was.
    known
        The profile's hull as a model.
    """

    prepared: Prepared
    prediction: Prediction
    force_model: ForceModel
    known: ModelForces

    @property
    def residual(self) -> Floats:
        """Measured force less the expected one [N, N, N·m], shape (n, 3)."""
        return np.asarray(self.prepared.motion.tau - self.prediction.tau)

    @property
    def rows(self) -> Rows:
        """Rows on which the residual is known, shape (n,)."""
        return usable_rows(self.prepared.motion, self.prediction.tau)

    @cached_property
    def rates(self) -> Floats:
        """Acceleration that the base model gives at the measured velocities and thrusts, shape (n, 3)."""
        return as_measured(self.force_model)

    def force_between(self, force_model: ForceModel) -> Floats:
        """Return by how much more force a force model moves the vessel than the base model does [N, N, N·m], shape (n, 3).

        Both at the measured velocities and thrusts. The measured acceleration plays no part in it: terms that held it beside
        those of the thrusters would add up to what is to be explained, whatever that is.
        """
        plain = self.force_model
        return np.asarray(required_force(plain, as_measured(force_model)) - required_force(plain, self.rates))

    def expected(self, force_model: ForceModel) -> Prediction:
        """Return what a force model expects that has another hull, load, damping or external force than the base model's.

        External forces are taken as they were along the measured path, as for a diagnosed model.
        """
        motion, seen = self.prepared.motion, self.prediction.motion
        more = force_model.external - self.force_model.external
        seen = replace(seen, tau=seen.tau + more, payload=payload_and_damping(force_model))
        force = force_law(self.known, force_model.hull)
        needed = force(seen.nu_dot, seen.nu, seen.eta[:, 2], seen.wind, seen.current, seen.payload)
        return Prediction(motion.tau - (seen.tau - needed), seen, force)


def prepared_log(log: str, profile: Profile, out: Path) -> Prepared:
    """Return a log smoothed as for every learner, with its aligned signals."""
    return prepare(log, profile, out, window_s=WINDOW_S, smoother=SMOOTHER, keep_track=True)


def base_of(prepared: Prepared, profile: Profile) -> Base:
    """Return the base model in a log of `prepared_log`.

    Raises
    ------
    FerryIdError
        For a log without heading.
    """
    model = blank_model(profile, profile.name)
    prediction = predict_with_effects(model, prepared, profile, window_s=WINDOW_S, smoother=SMOOTHER)
    assert prepared.track is not None  # or there was no prediction
    known, motion = ModelForces(model), prepared.motion
    measurements = measurements_of_motion(prepared.track, motion, profile)
    n, k, _ = measurements.parts.shape
    parts = steady_mean(measurements.parts.reshape(n, 3 * k), odd_rows(WINDOW_S, motion.rate_hz)).reshape(n, k, 3)
    return Base(prepared, prediction, known.plain(replace(measurements, parts=parts)), known)
