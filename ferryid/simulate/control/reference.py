"""Third-order reference filter: a smooth pose with its first two time derivatives on the way to a goal."""

from __future__ import annotations

from math import ceil, cos, sin
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ferryid.compiled import borrowing
from ferryid.types import Floats

if TYPE_CHECKING:
    from ferryid.simulate.scenario import Scenario

Triple = tuple[float, float, float]


class Tuning(NamedTuple):
    """Natural frequency [rad/s], relative damping, and limits of speed and acceleration, per degree of freedom (NED)."""

    omega: Triple
    damping: Triple
    speed_limit: Triple
    acceleration_limit: Triple


def build_reference(scenario: Scenario) -> tuple[Tuning, Floats]:
    """Return the filter of ``[controller.reference]`` and its state at rest, shape (3, 3): pose, speed, acceleration."""
    tuning = scenario.controller.reference
    return (
        Tuning(tuning.omega_radps, tuning.damping, tuning.speed_limit, tuning.acceleration_limit),
        np.zeros((3, 3)),
    )


@borrowing
def advance_reference(tuning: Tuning, ref: Floats, goal: Triple, h: float) -> None:
    """Move the filter towards `goal` for `h` seconds.

    The acceleration that the filter asks for is limited before it is integrated, and so is the speed: an
    integrator that had run on behind its limit would overshoot afterwards.

    Parameters
    ----------
    tuning
        From `build_reference`.
    ref
        Desired pose (NED), its first and its second time derivative, shape (3, 3), overwritten.
    goal
        North, east [m] and heading [rad, not wrapped].

    References
    ----------
    Aurlien (2021), (2.26), corrected; saturation of velocity and acceleration after Fossen (2021).
    """
    fastest = max(tuning.omega[0], tuning.omega[1], tuning.omega[2])
    substeps = max(5, ceil(40.0 * fastest * h))
    d = h / substeps
    for i in range(3):
        w = tuning.omega[i]
        k = 2.0 * tuning.damping[i] + 1.0
        top_speed, top_acceleration = tuning.speed_limit[i], tuning.acceleration_limit[i]
        x, v, a = ref[0, i], ref[1, i], ref[2, i]
        for _ in range(substeps):
            jerk = w * w * w * (goal[i] - x) - k * w * w * v - k * w * a
            a = min(max(a + d * jerk, -top_acceleration), top_acceleration)
            faster = v + d * a
            v = min(max(faster, -top_speed), top_speed)
            if v != faster:
                a = 0.0
            x += d * v
        ref[0, i], ref[1, i], ref[2, i] = x, v, a


@borrowing
def body_reference(ref: Floats) -> tuple[Triple, Triple]:
    """Return desired nu [m/s, m/s, rad/s] and nu_dot in the body frame of the desired heading."""
    c, s = cos(ref[0, 2]), sin(ref[0, 2])
    r = ref[1, 2]
    u = c * ref[1, 0] + s * ref[1, 1]
    v = c * ref[1, 1] - s * ref[1, 0]
    u_dot = c * ref[2, 0] + s * ref[2, 1] + r * v
    v_dot = c * ref[2, 1] - s * ref[2, 0] - r * u
    return (u, v, r), (u_dot, v_dot, ref[2, 2])
