"""The weak form of a fit: equations of motion of a log averaged over windows, so that no measured signal is differentiated.

Measured acceleration is noise for the most part. As a regressor it pulls the inertia towards zero; here it is what is
explained: forces and velocities stand on the right, where there is hardly any noise. With the base model's mass M0, the force e
that it leaves to accelerate the vessel (applied force less its damping, Coriolis and wind forces) and the functions phi,

    e - M0 a = (I - G) e + H phi + c,        G = M0 / M,  H = G theta,  c = G intercept,

which is linear, and in which the base model is zero. `to_force` leads back to the force,
``tau = F_0 + (M - M0) a + theta' phi + intercept``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ferryid.models.forces import ACCELERATIONS, base_force, without_inputs
from ferryid.regression import window_rows, window_starts, window_sums, window_weights
from ferryid.regression.bases import Basis
from ferryid.signals.track import Motion, segments
from ferryid.types import Flags, Floats, Ints
from ferryid.vessel.hull import payload_mass
from ferryid.vessel.profile import Profile

_CHUNK_WINDOWS = 4096


@dataclass(frozen=True, eq=False)
class WeakRows:
    """Equations of motion of one log averaged over J windows.

    Attributes
    ----------
    functions
        Means of the basis functions, those of acceleration left empty, shape (J, K).
    force
        Applied force [N, N, N·m], shape (J, 3).
    steady
        What the base model needs of it without acceleration, shape (J, 3).
    bare
        The same of the base model without measured wind, current and payload, which models are judged against.
    inertia
        The base model's mass matrix in every window, payload included, shape (J, 3, 3).
    by_velocity, by_pose
        Acceleration [m/s², m/s², rad/s²] from velocities, and from position and heading (NaN where they were not
        measured), shape (J, 3) each.
    heading
        Means of its cosine and sine, shape (J, 2); zero where it was not measured.
    run
        Number of the unbroken stretch that a window lies in, shape (J,).
    start
        First row of every window, shape (J,).
    """

    functions: Floats
    force: Floats
    steady: Floats
    bare: Floats
    inertia: Floats
    by_velocity: Floats
    by_pose: Floats
    heading: Floats
    run: Ints
    start: Ints

    def __len__(self) -> int:
        """Return the number of windows."""
        return len(self.run)

    def acceleration(self, posed: Flags) -> Floats:
        """Return the acceleration of each axis from poses where `posed` (3,) says so, else from velocities, shape (J, 3)."""
        return np.where(posed & np.isfinite(self.by_pose), self.by_pose, self.by_velocity)

    def base(self, acceleration: Floats) -> Floats:
        """Return the applied force as the base model estimates it, shape (J, 3)."""
        return np.asarray(self.steady + np.einsum("jab,jb->ja", self.inertia, acceleration))

    def reference(self, mass: Floats) -> Floats:
        """Return the applied force as the base model of this mass (3, 3) estimates it without measured inputs, (J, 3)."""
        return np.asarray(self.bare + self.by_velocity @ mass.T)

    def regressors(self, terms: tuple[str, ...]) -> Floats:
        """Return the functions with the force that is left to accelerate in the place of the accelerations, shape (J, K)."""
        return self._with(self.force - self.steady, terms)

    def basis(self, terms: tuple[str, ...], acceleration: Floats) -> Floats:
        """Return the functions with a measured acceleration, shape (J, K)."""
        return self._with(acceleration, terms)

    def _with(self, values: Floats, terms: tuple[str, ...]) -> Floats:
        filled = self.functions.copy()
        for column, name in enumerate(ACCELERATIONS):
            if name in terms:
                filled[:, terms.index(name)] = values[:, column]
        return filled


def average_over_windows(
    motion: Motion,
    rows: Flags,
    profile: Profile,
    scale: Mapping[str, float],
    functions: Basis,
    length_s: float,
    velocity: Floats | None = None,
    columns: Mapping[str, Floats] | None = None,
) -> WeakRows:
    """Average the equations of motion over windows that lie wholly within marked rows.

    Parameters
    ----------
    motion
        Motion and forces of one log.
    rows
        Rows to use, shape (n,).
    profile, scale, functions
        Base model, factors on it, and basis.
    length_s
        Length of a window [s].
    velocity
        Velocity that enters products, shape (n, 3); the measured one where it is None.
    columns
        What `row_columns` returns of these, where it is known already.
    """
    step_s = 1.0 / motion.rate_hz
    m = window_rows(length_s, motion.rate_hz)
    weight, slope, bend = (step_s * each for each in window_weights(m, step_s))
    start, run = window_starts(segments(rows), m)

    nu = motion.nu if velocity is None else velocity
    columns = row_columns(motion, profile, scale, functions, nu) if columns is None else columns
    means = {name: window_sums(values, weight, start) for name, values in columns.items()}
    mass = profile.hull.M * scale.get("delta", 1.0)
    inertia = np.broadcast_to(mass, (len(start), 3, 3))
    if motion.payload is not None:
        inertia = inertia + payload_mass(window_sums(np.nan_to_num(motion.payload), weight, start))
    return WeakRows(
        functions=means["functions"],
        force=means["force"],
        steady=means["steady"],
        bare=means["bare"],
        inertia=inertia / scale.get("zeta", 1.0),
        by_velocity=-window_sums(motion.nu, slope, start),
        by_pose=_by_pose(motion.eta, nu[:, 2], slope, bend, start),
        heading=means["heading"],
        run=run,
        start=start,
    )


def row_columns(
    motion: Motion, profile: Profile, scale: Mapping[str, float], functions: Basis, velocity: Floats
) -> dict[str, Floats]:
    """Return what is averaged over windows in every row, whatever their length; arguments as of `average_over_windows`."""
    still = replace(motion, nu=velocity, nu_dot=np.zeros_like(velocity))
    heading = motion.eta[:, 2]
    columns = {
        "steady": base_force(profile, still, scale),
        "bare": base_force(profile, without_inputs(still), scale),
        "force": motion.tau,
        "functions": functions.of(still),
        "heading": np.column_stack([np.cos(heading), np.sin(heading)]),
    }
    return {name: np.nan_to_num(values) for name, values in columns.items()}


def to_force(gains: Floats, intercept: Floats, terms: tuple[str, ...], mass: Floats) -> tuple[Floats, Floats]:
    """Return coefficients and intercept of the force from those of the weak form.

    Parameters
    ----------
    gains
        ``I - G`` in the rows of the accelerations, H in the others, shape (..., K, 3).
    intercept
        c, shape (..., 3).
    terms
        Names of the functions.
    mass
        The base model's mass matrix M0, shape (3, 3).

    Returns
    -------
    ndarray, ndarray
        theta, shape (..., K, 3), and intercept, shape (..., 3).
    """
    places = [(column, terms.index(name)) for column, name in enumerate(ACCELERATIONS) if name in terms]
    G = np.broadcast_to(np.eye(3), (*gains.shape[:-2], 3, 3)).copy()
    for column, row in places:
        G[..., :, column] -= gains[..., row, :]
    inverse = np.linalg.inv(G)
    theta = gains @ np.swapaxes(inverse, -1, -2)
    added = inverse @ mass - mass
    for column, row in places:
        theta[..., row, :] = added[..., :, column]
    return theta, np.einsum("...ab,...b->...a", inverse, intercept)


def _by_pose(eta: Floats, yaw_rate: Floats, slope: Floats, bend: Floats, starts: Ints) -> Floats:
    """Return ``∫ w nu'`` from position and heading, shape (J, 3).

    ``nu = R(psi)' p'`` for the position p, so that by parts ``∫ w nu' = ∫ (w' R')' p = ∫ (w'' R' + w' r dR'/dpsi) p``.
    """
    out = np.empty((len(starts), 3))
    if not len(starts):
        return out
    m = len(slope)
    north, east, psi, r = (sliding_window_view(column, m) for column in (*eta.T, yaw_rate))
    for low in range(0, len(starts), _CHUNK_WINDOWS):
        chunk = starts[low : low + _CHUNK_WINDOWS]
        n, e = north[chunk], east[chunk]
        # Exact sums would not need it; sums over rows do, far from the origin.
        n, e = n - n.mean(axis=1, keepdims=True), e - e.mean(axis=1, keepdims=True)
        angle = psi[chunk]
        c, s = np.cos(angle), np.sin(angle)
        ahead, aside = c * n + s * e, c * e - s * n
        turning = slope * r[chunk]
        out[low : low + len(chunk)] = np.column_stack(
            [
                ahead @ bend + np.sum(turning * aside, axis=1),
                aside @ bend - np.sum(turning * ahead, axis=1),
                (angle - angle.mean(axis=1, keepdims=True)) @ bend,
            ]
        )
    return out
