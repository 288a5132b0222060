"""How closely a vessel kept to where it was told to be, and at what cost: thesis (4.9)-(4.13)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ferryid.compare.comparison_result import TrackingScores
from ferryid.signals.track import Motion, segments
from ferryid.types import Floats

MEASURES = ("ISE", "IAE", "IAEW", "EC")


@dataclass(frozen=True)
class Tracking:
    """Measures of one round, or of an unbroken stretch of one.

    Attributes
    ----------
    t
        Time [s], shape (m,).
    error
        Tracking error `e` [m], see `tracking_error`, shape (m,).
    energy
        Mechanical work ``∫ |nu' tau| dt`` [J] up to each time, shape (m,).
    """

    t: Floats
    error: Floats
    energy: Floats

    @property
    def ISE(self) -> float:
        """Integral of the squared error [m² s], (4.9)."""
        return float(np.trapezoid(self.error**2, self.t))

    @property
    def IAE(self) -> float:
        """Integral of the error [m s], (4.10)."""
        return float(np.trapezoid(self.error, self.t))

    @property
    def EC(self) -> float:
        """Energy consumption [J], (4.12)."""
        return float(self.energy[-1])

    @property
    def IAEW(self) -> float:
        """Integral of the error times the energy [m s J], (4.11)."""
        return self.IAE * self.EC

    def cumulative(self) -> dict[str, Floats]:
        """Return the four integrals up to each cycle, by name, shape (m,) each."""
        iae = cumulative_integral(self.error, self.t)
        return {
            "ISE": cumulative_integral(self.error**2, self.t),
            "IAE": iae,
            "IAEW": iae * self.energy,
            "EC": self.energy,
        }


def tracking_scores(motion: Motion, length_m: float) -> TrackingScores | None:
    """Return the measures of a log that tells where the vessel was to be; None for another.

    The integrals are taken over unbroken stretches of measured data and added up; what lies between is left out.

    Parameters
    ----------
    motion
        Smoothed motion with the force of the actuators.
    length_m
        Length of the hull; where it is not known (NaN) a heading error does not count in `e`, and is none by itself.
    """
    if motion.eta_d is None:
        return None
    off = motion.eta - motion.eta_d
    told = np.asarray(np.isfinite(off[motion.valid]).any(axis=0))
    if not told.any():
        return None
    valid = motion.valid & np.isfinite(off[:, told]).all(axis=1) & np.isfinite(motion.tau).all(axis=1)
    # What is not told, such as a position under an autopilot that keeps a heading, counts for nothing.
    pose, wanted = np.where(told, motion.eta, 0.0), np.where(told, motion.eta_d, 0.0)
    error = tracking_error(pose, wanted, length_m if np.isfinite(length_m) else 0.0)
    if not (told[:2].any() or np.isfinite(length_m)):
        error = np.full(len(error), np.nan)
    power = np.abs(np.sum(motion.nu * motion.tau, axis=1))
    parts: Sequence[Tracking] = [
        Tracking(motion.t[rows], error[rows], cumulative_integral(power[rows], motion.t[rows]))
        for rows in segments(valid)
        if rows.stop - rows.start > 1
    ]
    if not parts:
        return None
    ISE, IAE, EC = (sum(values) for values in zip(*((part.ISE, part.IAE, part.EC) for part in parts), strict=True))
    turn = np.arctan2(np.sin(off[valid, 2]), np.cos(off[valid, 2]))
    return TrackingScores(
        ISE=ISE,
        IAE=IAE,
        EC=EC,
        IAEW=IAE * EC,
        seconds=float(sum(part.t[-1] - part.t[0] for part in parts)),
        position_m=float(np.sqrt(np.mean(np.sum(off[valid, :2] ** 2, axis=1)))),
        heading_rad=float(np.sqrt(np.mean(turn**2))),
    )


def tracking_error(eta: Floats, eta_d: Floats, length_m: float) -> Floats:
    """Return one error [m] for position and heading together, shape (n,).

    The thesis leaves open how it puts metres and degrees into one `e`. Here a heading error counts by how far it moves the
    ends of the hull: ``e² = (x - x_d)² + (y - y_d)² + (L/2 (psi - psi_d))²``.
    """
    off = eta - eta_d
    turn = np.arctan2(np.sin(off[:, 2]), np.cos(off[:, 2]))
    return np.asarray(np.sqrt(off[:, 0] ** 2 + off[:, 1] ** 2 + (length_m / 2 * turn) ** 2))


def signal_power(values: Floats) -> Floats:
    """Return the mean square per column, (4.13) without its stray 2, shape (c,)."""
    return np.asarray(np.mean(values**2, axis=0))


def cumulative_integral(values: Floats, t: Floats) -> Floats:
    """Return the integral of values over time up to each, by the trapezoidal rule, shape (m,)."""
    steps = 0.5 * (values[1:] + values[:-1]) * np.diff(t)
    return np.concatenate([[0.0], np.cumsum(steps)])
