"""A stored model as a force model: hull, other forces, and the effects that a diagnosis put into it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ferryid.cached import cached_property
from ferryid.effects import effects
from ferryid.effects.force_model import COEFFICIENTS, ForceModel, Measurements, required_force
from ferryid.effects.measurements import hull_force_model
from ferryid.errors import FerryIdError
from ferryid.models.forces.estimator import Estimator, ForceLaw, hull_coefficients, model_estimator, with_hull
from ferryid.models.forces.hull_terms import hull_contribution
from ferryid.models.model import Model
from ferryid.models.stored_effect import StoredEffect
from ferryid.types import Floats
from ferryid.vessel import parse_profile


@dataclass(frozen=True)
class ActingEffects:
    """A force model with a model's effects in it, those that act, and those that do not with the reason."""

    force_model: ForceModel
    acting: tuple[StoredEffect, ...]
    idle: tuple[tuple[StoredEffect, str], ...]


@dataclass(frozen=True)
class ModelForces:
    """A model, ready to be applied to measurements.

    Raises
    ------
    FerryIdError
        For a model whose inertia couples surge to sway and yaw.
    """

    model: Model

    def __post_init__(self) -> None:
        model = self.model
        cross = [
            (term, axis)
            for term, axis in (("u_dot", 1), ("u_dot", 2), ("v_dot", 0), ("r_dot", 0))
            if term in model.terms and model.theta[model.terms.index(term), axis] != 0.0
        ]
        if cross:
            told = ", ".join(f"{term} in {('surge', 'sway', 'yaw')[axis]}" for term, axis in cross)
            raise FerryIdError(
                f"{model.label}: a diagnosis needs a mass matrix that keeps surge apart from sway and yaw, found "
                f"coefficients of {told}. Fix: fit the model with --structure decoupled"
            )

    @cached_property
    def force(self) -> Estimator:
        """The model's force without its effects."""
        return model_estimator(self.model)

    @cached_property
    def hull(self) -> Floats:
        """Coefficients of the hull, shape (26,)."""
        return hull_coefficients(self.model)

    @property
    def variance(self) -> Floats:
        """Variance of the hull's coefficients, shape (26,); 0 where the model does not tell."""
        variance = np.maximum(hull_contribution(self.model)[1], 0.0)
        if self.model.hull:
            ends = np.array([(self.model.hull[name].low, self.model.hull[name].high) for name in COEFFICIENTS])
            variance = np.nan_to_num(((ends[:, 1] - ends[:, 0]) / 3.92) ** 2)
        return variance

    def plain(self, measurements: Measurements) -> ForceModel:
        """Return the force model of measurements without effects.

        The model's coefficients of acceleration and damping become the hull's; all the rest of it, such as its own Coriolis
        terms, wind terms and intercept, is an external force, so that the force model's force at the measured motion is the
        model's. The air is still where no wind was measured and the model does not say otherwise.
        """
        bare = hull_force_model(measurements, self.hull)
        if bare.load is not None:
            # As the hull's coefficients are, and the wind load that the estimator takes off below.
            bare = replace(bare, load=bare.load / float(self.force.scale.get("zeta", 1.0)))
        functions = self.force.basis
        still = np.zeros((len(measurements.t), 2))
        wind, current = measurements.wind, measurements.current
        if wind is None and (functions is None or functions.needs_wind):
            wind = still
        if current is None and functions is not None and functions.needs_current:
            current = still
        at_rest = np.zeros_like(measurements.nu)
        needed = self.force(at_rest, measurements.nu, measurements.psi, wind, current)
        # What the force model's own hull needs for the same motion.
        alone = required_force(replace(bare, load=None), at_rest)
        return replace(bare, external=alone - needed)

    def altered(self, force_model: ForceModel, sha256: str, *, righted: bool = False) -> ActingEffects:
        """Return the plain force model of a log with the conditions of that log and the properties of the vessel in it.

        A condition that the log itself measures is not put into it again. With `righted`, the measurements come from `righted`
        already, and errors of the sensors are left out.
        """
        acting, idle = [], []
        for stored in self._effects(sha256):
            reason = effects()[stored.effect].cannot(force_model.measurements)
            if reason:
                idle.append((stored, reason))
                continue
            after = stored.act(force_model, sha256)
            if not righted or after.measurements is force_model.measurements:
                force_model = after
            acting.append(stored)
        return ActingEffects(force_model, tuple(acting), tuple(idle))

    def righted(self, measurements: Measurements, sha256: str) -> Measurements:
        """Return the measurements as sensors without the errors that the model knows would have measured it."""
        force_model = hull_force_model(measurements, self.hull)
        for stored in self._effects(sha256):
            if not effects()[stored.effect].cannot(measurements):
                force_model = replace(force_model, measurements=stored.act(force_model, sha256).measurements)
        return force_model.measurements

    def _effects(self, sha256: str) -> tuple[StoredEffect, ...]:
        every = (*self.model.conditions_of(sha256), *self.model.vessel_effects)
        return tuple(sorted(every, key=lambda stored: effects()[stored.effect].order))

    def altered_hull(self) -> Floats:
        """Return the hull's coefficients as the properties of the vessel alter them, shape (26,)."""
        profile = self.force.profile
        k, rows = len(profile.actuators), 2
        rest = np.zeros((rows, 3))
        measurements = Measurements(
            profile=profile,
            t=np.arange(float(rows)),
            eta=rest,
            nu_raw=rest,
            nu=rest,
            parts=np.zeros((rows, k, 3)),
            angles=np.zeros((rows, k)),
            usable=np.ones(rows, dtype=bool),
        )
        force_model = hull_force_model(measurements, self.hull)
        for stored in self.model.vessel_effects:
            force_model = stored.act(force_model, "")
        return force_model.hull


def acting_estimator(model: Model) -> Estimator:
    """Return the estimator of a model with the hull as the properties of the vessel alter it: the force that it needs.

    What thrusters make of an order is not part of it.
    """
    if not model.vessel_effects:
        return model_estimator(model)
    known = ModelForces(model)
    profile, scale = with_hull(model, parse_profile(model.profile_text, model.name), known.altered_hull())
    return replace(known.force, profile=profile, scale=scale)


def force_law(known: ModelForces, hull: Floats) -> ForceLaw:
    """Return the force that a motion takes with this hull, and all that the model knows besides its effects."""
    profile = known.force.profile

    def force(
        nu_dot: Floats, nu: Floats, psi: Floats, wind: Floats | None, current: Floats | None, held: Floats | None = None
    ) -> Floats:
        n = len(nu)
        measurements = Measurements(
            profile=profile,
            t=np.zeros(n),
            eta=np.column_stack([np.zeros((n, 2)), psi]),
            nu_raw=nu,
            nu=nu,
            parts=np.zeros((n, 0, 3)),
            angles=np.zeros((n, 0)),
            usable=np.ones(n, dtype=bool),
            wind=wind,
            current=current,
        )
        force_model = replace(known.plain(measurements), hull=hull)
        if held is not None:
            force_model = replace(force_model, load=held[:, :5], damping_factor=held[:, 5])
        return required_force(force_model, nu_dot)

    return force
