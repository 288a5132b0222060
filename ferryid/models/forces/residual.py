"""The lack-of-fit residual: measured force less the force that the base model holds the motion to need."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ferryid.errors import FerryIdError, did_you_mean
from ferryid.signals.track import Motion
from ferryid.types import Floats
from ferryid.vessel.hull import current_in_body, inverse_dynamics, payload_force, payload_mass
from ferryid.vessel.profile import Hull, Profile, WindAreas
from ferryid.vessel.wind import wind_force

FORMS = ("measured", "commanded", "parallel")
HORIZON_S = 1.0
"""Length of the parallel simulation [s], centred on the row that it judges."""

_PASSES = 3
_RUNS = 4096


def base_force(profile: Profile, motion: Motion, scale: Mapping[str, float]) -> Floats:
    """Return the applied force as the base model estimates it from the motion of a log [N, N, N·m], shape (n, 3).

    See `motion_force`; wind, current and payload take part where the log has them.
    """
    return motion_force(
        profile,
        scale,
        motion.nu_dot,
        motion.nu,
        motion.eta[:, 2],
        wind=motion.wind,
        current=motion.current,
        payload=motion.payload,
    )


def without_inputs(motion: Motion) -> Motion:
    """Return a motion without measured wind, current and payload: what a hull alone sees of it.

    The base model that models are judged against sees no more, so that figures of two fits to one log compare, whatever
    either of their profiles maps.
    """
    return replace(motion, wind=None, current=None, payload=None)


def motion_force(
    profile: Profile,
    scale: Mapping[str, float],
    nu_dot: Floats,
    nu: Floats,
    psi: Floats,
    *,
    wind: Floats | None = None,
    current: Floats | None = None,
    payload: Floats | None = None,
) -> Floats:
    """Return ``(delta M* nu_dot + delta C*(nu) nu + sigma D*(nu) nu - tau_wind) / zeta``, (4.2)-(4.5).

    This estimates the actuator force as it is measured: (4.5) puts the factor zeta on the measured force, and dividing
    by it instead keeps base model, correction and validation error in the units of the measurement.

    Parameters
    ----------
    profile
        Vessel with hull and, if known, wind areas. Without areas the wind is left to the correction.
    scale
        ``{"delta": 1.0, "sigma": 1.0, "zeta": 1.0}``; a factor that is missing is 1.
    nu_dot, nu
        Acceleration and velocity over ground, FRD at the body origin, shape (n, 3).
    psi
        Heading [rad], shape (n,); used for wind and current only.
    wind, current
        Where air and water go to, north and east [m/s], shape (n, 2), or None. A current acts exactly, through the
        relative velocity.
    payload
        Mass [kg] and its place forward of the body origin [m], shape (n, 2), or None. It is known, so that delta leaves it
        as it is.

    Returns
    -------
    ndarray
        Surge and sway force [N] and yaw moment [N·m], shape (n, 3); NaN where an input is.
    """
    zeta = float(scale.get("zeta", 1.0))
    return hull_force(
        scale_hull(profile.hull, scale),
        profile.wind,
        zeta,
        nu_dot,
        nu,
        psi,
        wind=wind,
        current=current,
        payload=payload,
    )


def hull_force(
    hull: Hull,
    areas: WindAreas | None,
    zeta: float,
    nu_dot: Floats,
    nu: Floats,
    psi: Floats,
    *,
    wind: Floats | None = None,
    current: Floats | None = None,
    payload: Floats | None = None,
) -> Floats:
    """Return what `motion_force` does, of a hull that has its factors on it, for many calls with the same one.

    Parameters
    ----------
    hull, areas, zeta
        Hull from `scale_hull`, wind areas of the profile or None, and the factor on the measured force.
    nu_dot, nu, psi, wind, current, payload
        As in `motion_force`.

    Returns
    -------
    ndarray
        Surge and sway force [N] and yaw moment [N·m], shape (n, 3); NaN where an input is.
    """
    nu_c = None if current is None else current_in_body(current, psi)
    tau = inverse_dynamics(hull, nu_dot, nu, nu_c)
    if wind is not None and areas is not None:
        tau = tau - wind_force(areas, wind, psi, nu)
    if payload is not None:
        tau = tau + payload_force(payload, nu_dot, nu)
    return tau / zeta


def scale_hull(hull: Hull, scale: Mapping[str, float]) -> Hull:
    """Return the hull with delta on its masses (M, and so C) and sigma on its damping, (4.2)-(4.4)."""
    delta, sigma = float(scale.get("delta", 1.0)), float(scale.get("sigma", 1.0))
    return replace(
        hull,
        mass_kg=delta * hull.mass_kg,
        inertia_z=delta * hull.inertia_z,
        M=delta * hull.M,
        D={name: sigma * value for name, value in hull.D.items()},
    )


def compute_residual(
    profile: Profile,
    motion: Motion,
    scale: Mapping[str, float],
    form: str = "measured",
    *,
    horizon_s: float = HORIZON_S,
) -> Floats:
    """Return the lack-of-fit residual [N, N, N·m], shape (n, 3).

    Parameters
    ----------
    profile, scale
        Base model, as in `motion_force`.
    motion
        Smoothed motion and forces of one log.
    form
        ``"measured"``: ``tau_mes - F_0``, thesis (3.1). ``"commanded"``: ``tau_d - F_0`` (Jervan 2020); actuator
        dynamics become part of the correction. ``"parallel"`` (after Gale et al. 2017): the base model runs beside the
        vessel under the same measured force, from the measured velocity half a horizon before each row to half a
        horizon after it; the residual is the constant force that it must be relieved of to arrive at the measured velocity.
        It never forms an acceleration, and tends to ``"measured"`` as the horizon shrinks.
    horizon_s
        Horizon of ``"parallel"`` [s], rounded to an even number of rows.

    Returns
    -------
    ndarray
        NaN where a measurement is missing, or where the horizon leaves measured data.

    Raises
    ------
    FerryIdError
        For an unknown form, or ``"commanded"`` on a log without commanded force.
    """
    if form == "measured":
        return motion.tau - base_force(profile, motion, scale)
    if form == "commanded":
        if motion.tau_d is None or not np.isfinite(motion.tau_d).any():
            raise FerryIdError(
                f"{motion.log}: the commanded residual needs tau_d, and the profile finds none in this log. "
                'Fix: map [signals.tau_d], or use the residual "measured"'
            )
        return motion.tau_d - base_force(profile, motion, scale)
    if form == "parallel":
        return _parallel(profile, motion, scale, horizon_s)
    raise FerryIdError(
        f'settings: there is no residual called "{form}".{did_you_mean(form, FORMS)} '
        f"Fix: choose one of {', '.join(FORMS)}"
    )


def _parallel(profile: Profile, motion: Motion, scale: Mapping[str, float], horizon_s: float) -> Floats:
    half = max(1, round(horizon_s * motion.rate_hz / 2))
    result = np.full_like(motion.nu, np.nan)
    # Runs that are simulated together fit into the cache.
    for first in range(0, len(motion.t) - 2 * half, _RUNS):
        count = min(_RUNS, len(motion.t) - 2 * half - first)
        result[first + half : first + half + count] = _relief(profile, motion, scale, first, count, 2 * half)
    return result


def _relief(profile: Profile, motion: Motion, scale: Mapping[str, float], first: int, count: int, steps: int) -> Floats:
    """Return the constant force that each of `count` runs must be relieved of, from row `first` on, shape (count, 3)."""
    every = slice(first, first + count + steps)
    mass = scale_hull(profile.hull, scale).M[None]
    if motion.payload is not None:
        mass = mass + payload_mass(motion.payload[every])
    mass = mass / float(scale.get("zeta", 1.0))
    # A row whose payload is unknown has no mass to invert.
    inverse = np.linalg.inv(np.where(np.isfinite(mass), mass, np.eye(3)))
    dt = 1.0 / motion.rate_hz
    still = np.zeros((count, 3))
    relief = still

    def nu_dot(nu: Floats, start: int, aboard: int) -> Floats:
        rows = slice(start, start + count)
        wind = None if motion.wind is None else motion.wind[rows]
        current = None if motion.current is None else motion.current[rows]
        payload = None if motion.payload is None else motion.payload[aboard : aboard + count]
        needed = motion_force(
            profile, scale, still, nu, motion.eta[rows, 2], wind=wind, current=current, payload=payload
        )
        return _times(inverse, motion.tau[rows] - relief - needed, aboard - first)

    with np.errstate(over="ignore", invalid="ignore"):
        for _ in range(_PASSES):
            nu = motion.nu[first : first + count]
            for step in range(first, first + steps):
                # Heun's rule uses the measured forces at both ends and invents none in between; a payload holds.
                before = nu_dot(nu, step, step)
                after = nu_dot(nu + dt * before, step + 1, step)
                nu = nu + dt / 2 * (before + after)
            # What remains after a pass is what damping and turning took of its correction.
            parted = nu - motion.nu[first + steps : first + steps + count]
            relief = relief + _times(mass, parted, steps // 2) / (steps * dt)
    return np.where(np.isfinite(relief), relief, np.nan)


def _times(matrices: Floats, vectors: Floats, start: int) -> Floats:
    """Return the products of vectors, shape (n, 3), with one matrix for all, or with one each from `start` on."""
    if len(matrices) == 1:
        return np.asarray(vectors @ matrices[0].T)
    return np.asarray(np.einsum("nij,nj->ni", matrices[start : start + len(vectors)], vectors))
