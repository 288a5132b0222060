"""What a round cost and how precise it was: thesis (4.9)-(4.13)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ferryid.compare import Tracking, cumulative_integral, signal_power, tracking_error
from ferryid.simulate.states import Control, Truth
from ferryid.types import Floats


@dataclass(frozen=True)
class Performance(Tracking):
    """Measures of one round, at the control cycles.

    Attributes
    ----------
    feedback, feedforward
        Share of either in the desired force [N, N, N·m], shape (m, 3).
    """

    feedback: Floats
    feedforward: Floats

    @property
    def feedback_power(self) -> Floats:
        """Mean square of the feedback per axis [N², N², N²·m²], shape (3,), (4.13)."""
        return signal_power(self.feedback)


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
        np.interp(control.t, truth.t, cumulative_integral(power, truth.t)),
        control.tau_d - control.feedforward,
        control.feedforward,
    )
