"""The velocity that enters products: fast from the velocity measured, slow from the position.

The errors of a navigation filter's velocity last for seconds and are as large as its motion in sway and yaw; multiplied into
damping and Coriolis terms they look like a small current. Over the same seconds the position knows better.
"""

from __future__ import annotations

import numpy as np

from ferryid.signals.smooth import odd_rows, steady_mean
from ferryid.types import Floats
from ferryid.vessel.frames import derivative, to_body

CUBIC_S = 2.25
"""Window of the local cubic through velocities, wind and current [s]: it leaves the noise of a moving mean of 1 s (4/9 of the
window), but the mean takes 7 % of motion at 0.2 Hz, and of its products more, the cubic 1 %."""
SLOW_S = 5.0
"""Time over which the two are compared [s]."""


def complementary_filter(nu: Floats, nu_raw: Floats, eta: Floats, rate_hz: float, slow_s: float = SLOW_S) -> Floats:
    """Return `nu` with its slow errors replaced by those of the position, which are smaller; shape (n, 3).

    Parameters
    ----------
    nu
        Smoothed velocities [m/s, m/s, rad/s], shape (n, 3).
    nu_raw
        As measured, shape (n, 3).
    eta
        North, east [m] and heading [rad, unwrapped], shape (n, 3); without positions the yaw rate alone is steadied.
    rate_hz
        Rows per second.
    slow_s
        Window of the comparison [s].
    """
    rows = odd_rows(slow_s, rate_hz)
    if len(nu) < rows:
        return nu
    apart = nu_raw - velocity_from_pose(eta, rate_hz)
    apart = np.where(np.isfinite(apart), apart, 0.0)
    return nu - steady_mean(apart, rows)


def velocity_from_pose(eta: Floats, rate_hz: float) -> Floats:
    """Return the velocities that positions and headings give [m/s, m/s, rad/s], shape (n, 3); NaN at the ends."""
    north, east, turn = (derivative(column, rate_hz) for column in eta.T)
    surge, sway = to_body(north, east, eta[:, 2])
    return np.column_stack([surge, sway, turn])
