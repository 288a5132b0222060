"""The effective mass of a fitted model, and where a log says too little of inertia to be believed.

A regression of force on acceleration is degenerate where hardly any force acts: an estimate of "no inertia, no damping"
then predicts the force perfectly. Noise in the derivative pulls the same way. Such a model fits and cannot be
simulated, so the inertia of that axis is held at the base model's, which fixes the scale of everything else on the axis.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ferryid.identify.thresholds import IDENTIFY
from ferryid.models.forces import ACCELERATIONS
from ferryid.types import AXES, Flags, Floats
from ferryid.vessel.parse_hull import rigid_mass
from ferryid.vessel.profile import Hull, Profile


def axes_without_force(tau: Floats, base: Floats) -> Flags:
    """Return the axes on which no actuator acts, shape (3,), from standard deviations of measured and base force, (3,)."""
    return np.asarray(tau <= IDENTIFY.no_force * base)


def implausible_inertia(profile: Profile, mass: Floats) -> Flags:
    """Return the axes whose effective inertia cannot be right, shape (3,); all of them where the matrix as a whole is."""
    share = relative_inertia(profile, mass)
    wrong = (share < IDENTIFY.least_inertia) | (share > IDENTIFY.most_inertia)
    return wrong if wrong.any() or scaled_eigenvalue(profile, mass) > 0.0 else np.ones(3, dtype=bool)


def relative_inertia(profile: Profile, mass: Floats) -> Floats:
    """Return the diagonal of an effective mass matrix over the rigid body's, shape (3,)."""
    return np.asarray(np.diag(mass) / np.diag(rigid_body(profile.hull)))


def scaled_eigenvalue(profile: Profile, mass: Floats) -> float:
    """Return the smallest eigenvalue of the symmetric part of a mass matrix in units of the rigid body's diagonal.

    So scaled, masses and moments of inertia compare; its sign is that of the matrix itself.
    """
    root = np.sqrt(np.diag(rigid_body(profile.hull)))
    return float(np.linalg.eigvalsh((mass + mass.T) / 2 / np.outer(root, root))[0])


def largest_inertia(profile: Profile, mass: Floats) -> tuple[float, int]:
    """Return the largest eigenvalue of a mass matrix with respect to the rigid body's, and the axis that it is most of.

    It is the largest inertia in any direction over the rigid body's in the same direction: where sway and yaw are coupled,
    another one than those on the diagonal.
    """
    root = np.linalg.inv(np.linalg.cholesky(rigid_body(profile.hull)))
    values, vectors = np.linalg.eigh(root @ ((mass + mass.T) / 2) @ root.T)
    return float(values[-1]), int(np.argmax(np.abs(vectors[:, -1])))


def without_inertia(mask: Flags, terms: Sequence[str], axes: Flags) -> Flags:
    """Return the mask of a basis, shape (K, 3), without the acceleration terms on the given axes."""
    kept = mask.copy()
    for name in ACCELERATIONS:
        if name in terms:
            kept[terms.index(name), axes] = False
    return kept


def held_inertia_reason(axis: int, mass: Floats, profile: Profile, force_free: bool) -> str:
    """Return why the inertia of an axis is held, in a sentence."""
    if force_free:
        return (
            f"No actuator acts in {AXES[axis]}: its inertia is the base model's, and its error is that of an equation "
            "without a force."
        )
    rigid = rigid_body(profile.hull)[axis, axis]
    unit = "kg·m²" if axis == 2 else "kg"
    return (
        f"In {AXES[axis]} the log would give an inertia of {mass[axis, axis]:.3g} {unit} (rigid body: {rigid:.3g} {unit}), "
        "which cannot be: force and acceleration say too little of each other there, or the thrust curve is wrong. "
        "The base model's inertia is kept."
    )


def rigid_body(hull: Hull) -> Floats:
    """Return the rigid-body mass matrix of a hull [kg, kg·m, kg·m²], shape (3, 3)."""
    return np.asarray(rigid_mass(hull.mass_kg, hull.x_g_m, hull.inertia_z), dtype=np.float64)
