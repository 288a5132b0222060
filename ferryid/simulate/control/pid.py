"""PID in NED with feedforward from a vessel model."""

from __future__ import annotations

from math import cos, sin
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ferryid.compiled import borrowing
from ferryid.simulate.control.angle import shorter_way
from ferryid.simulate.control.feedforward import Feedforward, ahead_of
from ferryid.simulate.control.reference import body_reference
from ferryid.types import Floats

if TYPE_CHECKING:
    from ferryid.simulate.scenario import Scenario
    from ferryid.vessel.profile import Profile

Pair = tuple[float, float]
Triple = tuple[float, float, float]


class Pid(NamedTuple):
    """Gains as in `sections.Gains`; `limit` is where the integral of the error stops [m s, m s, rad s]."""

    Kp: Triple
    Kd: Triple
    Ki: Triple
    limit: Triple


def build_pid(scenario: Scenario, profile: Profile) -> tuple[Pid, Floats]:
    """Return the PID of ``[controller]`` and its integral at the start, shape (3,)."""
    gains = scenario.controller.gains
    reach = [limit / Ki if Ki > 0.0 else 0.0 for limit, Ki in zip(gains.integral_limit, gains.Ki, strict=True)]
    return Pid(gains.Kp, gains.Kd, gains.Ki, (reach[0], reach[1], reach[2])), np.zeros(3)


@borrowing
def desired_force(
    pid: Pid,
    feedforward: Feedforward,
    ref: Floats,
    integral: Floats,
    eta: Triple,
    nu: Triple,
    wind: Pair,
    current: Pair,
    payload: Pair,
    h: float,
    saturated: bool,
) -> tuple[Triple, Triple]:
    """Return desired force and its feedforward share in the body frame [N, N, N·m].

    Parameters
    ----------
    pid, feedforward
        From `build_pid` and `build_feedforward`.
    ref
        State of the reference filter, shape (3, 3).
    integral
        Integral of the pose's error in NED, shape (3,), moved on in place.
    eta, nu
        Measured pose (NED) and velocities (FRD).
    wind, current
        Measured velocity of air and water over ground, north and east [m/s].
    payload
        Measured mass [kg] and where it is, forward of the body origin [m].
    h
        Time since the last call [s].
    saturated
        True when the last desired force could not be had; the integral then rests.

    References
    ----------
    Aurlien (2021), (2.21)-(2.24) and (4.6).
    """
    e0, e1, e2 = eta[0] - ref[0, 0], eta[1] - ref[0, 1], shorter_way(eta[2] - ref[0, 2])
    if not saturated:
        integral[0] = min(max(integral[0] + h * e0, -pid.limit[0]), pid.limit[0])
        integral[1] = min(max(integral[1] + h * e1, -pid.limit[1]), pid.limit[1])
        integral[2] = min(max(integral[2] + h * e2, -pid.limit[2]), pid.limit[2])
    p0 = pid.Kp[0] * e0 + pid.Ki[0] * integral[0]
    p1 = pid.Kp[1] * e1 + pid.Ki[1] * integral[1]
    p2 = pid.Kp[2] * e2 + pid.Ki[2] * integral[2]
    nu_d, nu_dot_d = body_reference(ref)
    ahead = ahead_of(feedforward, nu_dot_d, nu_d, eta[2], wind, current, payload)
    c, s = cos(eta[2]), sin(eta[2])
    X = ahead[0] - (c * p0 + s * p1) - pid.Kd[0] * (nu[0] - nu_d[0])
    Y = ahead[1] - (c * p1 - s * p0) - pid.Kd[1] * (nu[1] - nu_d[1])
    N = ahead[2] - p2 - pid.Kd[2] * (nu[2] - nu_d[2])
    return (X, Y, N), ahead
