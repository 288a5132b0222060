"""What a round cost and how precise it was: thesis (4.9)-(4.13)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ferryid.simulate.states import Control, Truth

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Performance:
    """Measures of one round.

    Attributes
    ----------
    t
        Time [s] at the control cycles, shape (m,).
    error
        Tracking error `e` [m], see `tracking_error`, shape (m,).
    energy
        Mechanical work ``∫ |nu' tau| dt`` [J] up to each cycle, shape (m,).
    feedback, feedforward
        Share of either in the desired force [N, N, N·m], shape (m, 3).
    """

    t: Floats
    error: Floats
    energy: Floats
    feedback: Floats
    feedforward: Floats

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

    @property
    def feedback_power(self) -> Floats:
        """Mean square of the feedback per axis [N², N², N²·m²], shape (3,), (4.13)."""
        return signal_power(self.feedback)

    def cumulative(self) -> dict[str, Floats]:
        """Return the four integrals up to each cycle, by name, shape (m,) each."""
        iae = _running(self.error, self.t)
        return {"ISE": _running(self.error**2, self.t), "IAE": iae, "IAEW": iae * self.energy, "EC": self.energy}


MEASURES = ("ISE", "IAE", "IAEW", "EC")


def performance(truth: Truth, control: Control, length_m: float) -> Performance:
    """Measure a round by what really happened, not by what the sensors saw.

    Parameters
    ----------
    truth, control
        Of a simulation.
    length_m
        Length of the hull, see `tracking_error`.
    """
    eta = np.column_stack([np.interp(control.t, truth.t, column) for column in truth.eta.T])
    power = np.abs(np.sum(truth.nu * truth.tau, axis=1))
    return Performance(
        control.t,
        tracking_error(eta, control.eta_d, length_m),
        np.interp(control.t, truth.t, _running(power, truth.t)),
        control.tau_d - control.feedforward,
        control.feedforward,
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


def _running(values: Floats, t: Floats) -> Floats:
    steps = 0.5 * (values[1:] + values[:-1]) * np.diff(t)
    return np.concatenate([[0.0], np.cumsum(steps)])
