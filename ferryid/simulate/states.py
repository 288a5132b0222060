"""What a simulated trial goes through: the truth, and what the controller did."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ferryid.types import Floats


@dataclass(frozen=True)
class Truth:
    """What really happened, on the integrator's uniform grid of n rows; what no log shows.

    Attributes
    ----------
    t
        Time [s], shape (n,).
    eta
        North, east [m], heading [rad, not wrapped], shape (n, 3).
    nu, nu_dot
        Velocities over ground [m/s, m/s, rad/s] and their time derivatives, FRD, shape (n, 3).
    tau
        Force of the actuators that really acts, faults and losses included [N, N, N·m], shape (n, 3).
    wave
        Force of the waves [N, N, N·m], shape (n, 3).
    attitude
        Roll and pitch [rad], shape (n, 2).
    wind, current
        Velocity of air and water over ground [m/s], north and east, shape (n, 2).
    payload
        Mass aboard [kg] and where its centre lies forward of the body origin [m], shape (n, 2).
    speeds, angles
        Speed [rpm] of every thruster and its angle [rad, not wrapped], shape (n, k).
    """

    t: Floats
    eta: Floats
    nu: Floats
    nu_dot: Floats
    tau: Floats
    wave: Floats
    attitude: Floats
    wind: Floats
    current: Floats
    payload: Floats
    speeds: Floats
    angles: Floats


@dataclass(frozen=True)
class Control:
    """What the controller did, once per cycle, m rows.

    Attributes
    ----------
    t
        Time of the measurement that each cycle acts on [s], shape (m,).
    t_order
        Time at which its orders reach the thrusters, one integration step later [s], shape (m,).
    measured
        Pose and velocities that it acted on (also what the log holds), shape (m, 6).
    sent
        False where the navigation sent nothing and the controller went on with the last state, shape (m,).
    goal
        Pose that the guidance asks the reference filter for, shape (m, 3).
    eta_d, nu_d
        Desired pose and velocities, shape (m, 3).
    tau_d, feedforward
        Desired force and its feedforward share [N, N, N·m], shape (m, 3); zero in an open-loop manoeuvre.
    speeds, angles
        Orders to every thruster, shape (m, k).
    saturated
        True where the desired force was out of reach, shape (m,).
    undefined_aims
        How many cycles the enclosure law found no point of the path on its circle and aimed at the nearest.
    """

    t: Floats
    t_order: Floats
    measured: Floats
    sent: NDArray[np.bool_]
    goal: Floats
    eta_d: Floats
    nu_d: Floats
    tau_d: Floats
    feedforward: Floats
    speeds: Floats
    angles: Floats
    saturated: NDArray[np.bool_]
    undefined_aims: int
