"""The applied force as a model estimates it from motion: for fitting, judging and free runs alike."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ferryid.cached import cached_property
from ferryid.effects.force_model import COEFFICIENTS, hull_of
from ferryid.errors import FerryIdError
from ferryid.models.forces.hull_terms import hull_contribution
from ferryid.models.forces.residual import base_force, hull_force, scale_hull
from ferryid.models.model import NO_BASIS, Model
from ferryid.regression.bases import Basis, make_basis, relative_flow
from ferryid.signals.track import Motion
from ferryid.types import Floats
from ferryid.vessel import parse_profile
from ferryid.vessel.profile import Hull, Profile

ACCELERATIONS = ("u_dot", "v_dot", "r_dot")
"""Terms of inertia."""
ForceLaw = Callable[..., Floats]
"""``force(nu_dot (s, 3), nu (s, 3), psi (s,), wind (s, 2), current (s, 2)) -> tau (s, 3)``, linear in ``nu_dot``.

A sixth argument, the payload (s, 2), is passed where the log has one.
"""
CHUNK_ROWS = 16384
"""Rows of the basis held at a time, so that memory does not grow with the length of a log."""


@dataclass(frozen=True)
class Estimator:
    """``F_P = F_0 + theta' phi + intercept``, thesis (3.3), ready to be evaluated.

    Without `basis` it is the base model alone.
    """

    profile: Profile
    scale: Mapping[str, float]
    basis: Basis | None = None
    theta: Floats | None = None
    intercept: Floats | None = None

    @cached_property
    def _scaled(self) -> tuple[Hull, float]:
        """The hull with its factors, and that of the force: a free run asks for them a thousand times."""
        return scale_hull(self.profile.hull, self.scale), float(self.scale.get("zeta", 1.0))

    def of(self, motion: Motion) -> Floats:
        """Return the estimated applied force on every row of a motion [N, N, N·m], shape (n, 3)."""
        tau = base_force(self.profile, motion, self.scale)
        if self.basis is None or self.theta is None or self.intercept is None:
            return tau
        for low in range(0, len(tau), CHUNK_ROWS):
            rows = slice(low, low + CHUNK_ROWS)
            tau[rows] += self.basis.of(motion, rows) @ self.theta + self.intercept
        return tau

    def at_constant_velocity(self, nu: Floats) -> Floats:
        """Return the force that constant velocities, shape (n, 3), take in still water and still air, shape (n, 3)."""
        still = np.zeros((len(nu), 2))
        wind = still if self.basis is not None and self.basis.needs_wind else None
        current = still if self.basis is not None and self.basis.needs_current else None
        return self(np.zeros_like(nu), nu, np.zeros(len(nu)), wind, current)

    def __call__(
        self,
        nu_dot: Floats,
        nu: Floats,
        psi: Floats,
        wind: Floats | None,
        current: Floats | None,
        payload: Floats | None = None,
    ) -> Floats:
        """Return the force for given states, all with s rows; a `ForceLaw`."""
        hull, zeta = self._scaled
        tau = hull_force(hull, self.profile.wind, zeta, nu_dot, nu, psi, wind=wind, current=current, payload=payload)
        if self.basis is None or self.theta is None or self.intercept is None:
            return tau
        wind_rel = None if wind is None else relative_flow(nu, psi, wind)
        current_rel = None if current is None else relative_flow(nu, psi, current)
        values: Floats = tau + self.basis.evaluate(nu, nu_dot, wind_rel, current_rel) @ self.theta + self.intercept
        return values


def model_estimator(model: Model) -> Estimator:
    """Return the estimator of a stored model, with the refitted hull where it has one, and without its effects.

    Raises
    ------
    FerryIdError
        When the model's terms are not those of its basis: the file was changed by hand, or by another version.
    """
    profile, scale = parse_profile(model.profile_text, model.name), model.scale
    if model.hull:
        profile, scale = with_hull(model, profile, hull_coefficients(model))
    if not model.terms and model.settings["basis"] == NO_BASIS:
        return Estimator(profile, scale)
    functions = make_basis(str(model.settings["basis"]), structure=str(model.settings["structure"]))
    if functions.terms != model.terms:
        raise FerryIdError(
            f"model {model.name}@{model.version}: its terms are not those of the basis {functions.name}. "
            "Fix: fit the model again with this version of ferryid"
        )
    return Estimator(profile, scale, functions, model.theta, model.intercept)


def base_estimator(model: Model) -> Estimator:
    """Return the estimator of the base model that a model was fitted on."""
    return Estimator(parse_profile(model.profile_text, model.name), model.scale)


def hull_coefficients(model: Model) -> Floats:
    """Return the hull's coefficients in the order of `COEFFICIENTS`, a model's terms counted in, shape (26,)."""
    if model.hull:
        return np.array([model.hull[name].value for name in COEFFICIENTS])
    profile = parse_profile(model.profile_text, model.name)
    base = hull_of(replace(profile, hull=scale_hull(profile.hull, model.scale)))
    return base / float(model.scale.get("zeta", 1.0)) + hull_contribution(model)[0]


def with_hull(model: Model, profile: Profile, hull: Floats) -> tuple[Profile, Mapping[str, float]]:
    """Return profile and factors on it so that with the model's terms the hull has these coefficients, shape (26,)."""
    zeta = float(model.scale.get("zeta", 1.0))
    base = zeta * (hull - hull_contribution(model)[0])
    return replace(profile, hull=replace_hull_coefficients(scale_hull(profile.hull, model.scale), base)), {
        "delta": 1.0,
        "sigma": 1.0,
        "zeta": zeta,
    }


def replace_hull_coefficients(hull: Hull, coefficients: Floats) -> Hull:
    """Return a hull with other coefficients, in the order of `COEFFICIENTS`, shape (26,)."""
    m11, m22, m23, m32, m33 = coefficients[:5].tolist()
    return replace(
        hull,
        M=np.array([[m11, 0.0, 0.0], [0.0, m22, m23], [0.0, m32, m33]]),
        D=dict(zip(COEFFICIENTS[5:], coefficients[5:].tolist(), strict=True)),
    )


def effective_mass(profile: Profile, scale: Mapping[str, float], terms: Sequence[str], theta: Floats) -> Floats:
    """Return the mass matrix of base model and correction together [kg, kg·m, kg·m²], shape (3, 3)."""
    mass = profile.hull.M * scale.get("delta", 1.0) / scale.get("zeta", 1.0)
    for column, name in enumerate(ACCELERATIONS):
        if name in terms:
            mass[:, column] += theta[terms.index(name)]
    return np.asarray(mass, dtype=np.float64)


def without_sway_coupling(mass: Floats) -> Floats:
    """Return mass matrices, shape (..., 3, 3), without what couples sway to surge and yaw: as of a hull that cannot sway."""
    kept = np.eye(3, dtype=bool)
    kept[np.ix_((0, 2), (0, 2))] = True
    return np.asarray(np.where(kept, mass, 0.0))
