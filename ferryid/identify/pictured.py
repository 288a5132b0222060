"""A model as a picture of the forces: its hull, what else it knows of them, and the effects that a diagnosis put into it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ferryid.effects import effects
from ferryid.effects.force_model import COEFFICIENTS, aboard, required_force
from ferryid.effects.force_model import ForceModel as Picture
from ferryid.effects.force_model import Measurements as Scene
from ferryid.errors import FerryIdError
from ferryid.identify.estimate import Estimator, estimator, hull_values, with_hull
from ferryid.identify.hull_terms import hull_part
from ferryid.identify.model import Model
from ferryid.identify.stored_effect import StoredEffect
from ferryid.vessel import actuator_columns, applied_force, parse_profile
from ferryid.vessel.profile import Floats, Profile

Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Acting:
    """A picture with a model's effects in it, those that act, and those that do not with the reason."""

    picture: Picture
    acting: tuple[StoredEffect, ...]
    idle: tuple[tuple[StoredEffect, str], ...]


@dataclass(frozen=True)
class Pictured:
    """A model, ready to be imagined in scenes.

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
        return estimator(self.model)

    @cached_property
    def hull(self) -> Floats:
        """Coefficients of the hull, shape (26,)."""
        return hull_values(self.model)

    @property
    def variance(self) -> Floats:
        """Variance of the hull's coefficients, shape (26,); 0 where the model does not tell."""
        variance = np.maximum(hull_part(self.model)[1], 0.0)
        if self.model.hull:
            ends = np.array([(self.model.hull[name].low, self.model.hull[name].high) for name in COEFFICIENTS])
            variance = np.nan_to_num(((ends[:, 1] - ends[:, 0]) / 3.92) ** 2)
        return variance

    def plain(self, scene: Scene) -> Picture:
        """Return the picture of a scene without effects.

        The model's coefficients of acceleration and damping become the hull's; all the rest of it, such as its own Coriolis
        terms, wind terms and intercept, is an external force, so that the picture's force at the measured motion is the
        model's. The air is still where no wind was measured and the model does not say otherwise.
        """
        bare = bare_picture(scene, self.hull)
        functions = self.force.basis
        still = np.zeros((len(scene.t), 2))
        wind, current = scene.wind, scene.current
        if wind is None and (functions is None or functions.needs_wind):
            wind = still
        if current is None and functions is not None and functions.needs_current:
            current = still
        at_rest = np.zeros_like(scene.nu)
        needed = self.force(at_rest, scene.nu, scene.psi, wind, current)
        # What the picture's own hull needs for the same motion.
        alone = required_force(replace(bare, load=None), at_rest)
        return replace(bare, external=alone - needed)

    def altered(self, picture: Picture, sha256: str, *, righted: bool = False) -> Acting:
        """Return the plain picture of a log with the conditions of that log and the properties of the vessel in it.

        A condition that the log itself measures is not put into it again. With `righted`, the picture's scene comes from
        `righted` already, and errors of the sensors are left out.
        """
        acting, idle = [], []
        for stored in self._effects(sha256):
            reason = effects()[stored.effect].cannot(picture.scene)
            if reason:
                idle.append((stored, reason))
                continue
            after = stored.act(picture, sha256)
            if not righted or after.scene is picture.scene:
                picture = after
            acting.append(stored)
        return Acting(picture, tuple(acting), tuple(idle))

    def righted(self, scene: Scene, sha256: str) -> Scene:
        """Return the scene as sensors without the errors that the model knows would have measured it."""
        picture = bare_picture(scene, self.hull)
        for stored in self._effects(sha256):
            if not effects()[stored.effect].cannot(scene):
                picture = replace(picture, scene=stored.act(picture, sha256).scene)
        return picture.scene

    def _effects(self, sha256: str) -> tuple[StoredEffect, ...]:
        every = (*self.model.conditions_of(sha256), *self.model.vessel_effects)
        return tuple(sorted(every, key=lambda stored: effects()[stored.effect].turn))

    def altered_hull(self) -> Floats:
        """Return the hull's coefficients as the properties of the vessel alter them, shape (26,)."""
        profile = self.force.profile
        k, rows = len(profile.actuators), 2
        rest = np.zeros((rows, 3))
        scene = Scene(
            profile=profile,
            t=np.arange(float(rows)),
            eta=rest,
            nu_raw=rest,
            nu=rest,
            parts=np.zeros((rows, k, 3)),
            angles=np.zeros((rows, k)),
            usable=np.ones(rows, dtype=bool),
        )
        picture = bare_picture(scene, self.hull)
        for stored in self.model.vessel_effects:
            picture = stored.act(picture, "")
        return picture.hull


def acting_estimator(model: Model) -> Estimator:
    """Return the estimator of a model with the hull as the properties of the vessel alter it: the force that it needs.

    What thrusters make of an order is not part of it.
    """
    if not model.vessel_effects:
        return estimator(model)
    known = Pictured(model)
    profile, scale = with_hull(model, parse_profile(model.profile_text, model.name), known.altered_hull())
    return replace(known.force, profile=profile, scale=scale)


def bare_picture(scene: Scene, hull: Floats) -> Picture:
    """Return the picture of a hull in a scene, in the water and with the payload that were measured, and no air."""
    load = None if scene.payload is None else aboard(scene.payload)
    return Picture(scene, hull, scene.parts, scene.angles, np.zeros((len(scene.t), 3)), scene.current, load)


def pushes(
    profile: Profile, columns: Mapping[str, Floats], through_water: Floats, usable: Flags
) -> tuple[Floats, Floats]:
    """Return the force of every actuator and the angles of azimuth thrusters on every row, bridged over gaps.

    Parameters
    ----------
    profile, columns
        The vessel, and the aligned signals of a log.
    through_water
        Velocities through the water, shape (n, 3).
    usable
        Rows on which everything was measured, shape (n,).

    Returns
    -------
    tuple
        Forces [N, N, N·m], shape (n, k, 3), and angles [rad], NaN for other actuators, shape (n, k).
    """
    chosen, _ = actuator_columns(profile, columns)
    parts, angles = [], []
    for actuator in profile.actuators:
        alone = replace(profile, actuators=(actuator,))
        parts.append(bridged(applied_force(alone, columns, through_water)[0], usable))
        if actuator.kind == "azimuth":
            angle = columns[chosen[actuator.name, "angle"]]
            angles.append(bridged(angle[:, None], usable)[:, 0])
        else:
            angles.append(np.full(len(usable), np.nan))
    return np.stack(parts, axis=1), np.column_stack(angles)


def bridged(values: Floats, usable: Flags, *, held: bool = False) -> Floats:
    """Return values with NaN replaced by what lies between, or was last, on usable rows; all NaN stays so."""
    result = values.copy()
    rows = np.arange(len(values))
    for column in result.T:
        missing = ~np.isfinite(column)
        known = np.flatnonzero(usable & ~missing)
        if not missing.any() or known.size == 0:
            continue
        if held:
            column[missing] = column[known[np.maximum(np.searchsorted(known, rows[missing]) - 1, 0)]]
        else:
            column[missing] = np.interp(rows[missing], known, column[known])
    return result
