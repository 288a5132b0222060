"""The vessel's motion control: reference filter, PID with model feedforward, and thrust allocation."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import atan2, ceil, cos, hypot, sin

from ferryid.simulate.paths import Pose, shorter_way
from ferryid.simulate.plant import Azimuth, Force, Hydrodynamics, required_force


@dataclass(frozen=True)
class ReferenceTuning:
    """Third-order reference filter: natural frequency, relative damping and saturations, per degree of freedom."""

    omega_radps: tuple[float, float, float] = (0.22, 0.22, 0.22)
    damping: tuple[float, float, float] = (1.0, 1.0, 1.0)
    speed_limit: tuple[float, float, float] = (0.8, 0.6, 0.15)
    acceleration_limit: tuple[float, float, float] = (0.1, 0.1, 0.03)


@dataclass(frozen=True)
class Gains:
    """PID gains for north/east [N/m], heading [N·m/rad], and the body-fixed rates; `integral_limit` in N, N, N·m."""

    Kp: tuple[float, float, float] = (200.0, 200.0, 700.0)
    Kd: tuple[float, float, float] = (700.0, 700.0, 2200.0)
    Ki: tuple[float, float, float] = (8.0, 8.0, 25.0)
    integral_limit: tuple[float, float, float] = (250.0, 250.0, 350.0)


@dataclass
class Reference:
    """State of the reference filter: desired pose and its first two time derivatives in NED.

    References
    ----------
    Aurlien (2021), (2.26), corrected; saturation of velocity and acceleration after Fossen (2021).
    """

    tuning: ReferenceTuning
    pose: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    speed: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    acceleration: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])

    def advance(self, goal: Pose, h: float) -> None:
        """Move towards `goal` for `h` seconds.

        The acceleration that the filter asks for is limited before it is integrated, and so is the speed: an
        integrator that had run on behind its limit would overshoot afterwards.
        """
        tuning = self.tuning
        substeps = max(5, ceil(40.0 * max(tuning.omega_radps) * h))
        d = h / substeps
        for i in range(3):
            w, zeta = tuning.omega_radps[i], tuning.damping[i]
            k = 2.0 * zeta + 1.0
            top_speed, top_acceleration = tuning.speed_limit[i], tuning.acceleration_limit[i]
            x, v, a = self.pose[i], self.speed[i], self.acceleration[i]
            for _ in range(substeps):
                jerk = w * w * w * (goal[i] - x) - k * w * w * v - k * w * a
                a = min(max(a + d * jerk, -top_acceleration), top_acceleration)
                faster = v + d * a
                v = min(max(faster, -top_speed), top_speed)
                if v != faster:
                    a = 0.0
                x += d * v
            self.pose[i], self.speed[i], self.acceleration[i] = x, v, a

    def body(self) -> tuple[Force, Force]:
        """Return desired nu and nu_dot in the body frame of the desired heading."""
        c, s = cos(self.pose[2]), sin(self.pose[2])
        r = self.speed[2]
        u = c * self.speed[0] + s * self.speed[1]
        v = c * self.speed[1] - s * self.speed[0]
        u_dot = c * self.acceleration[0] + s * self.acceleration[1] + r * v
        v_dot = c * self.acceleration[1] - s * self.acceleration[0] - r * u
        return (u, v, r), (u_dot, v_dot, self.acceleration[2])


@dataclass
class Controller:
    """PID in NED with feedforward from a vessel model.

    References
    ----------
    Aurlien (2021), (2.21)-(2.24) and (4.6).
    """

    model: Hydrodynamics
    reference: Reference
    gains: Gains
    integral: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])

    def desired_force(
        self, eta: Pose, nu: tuple[float, float, float], h: float, *, saturated: bool
    ) -> tuple[Force, Force]:
        """Return desired force and its feedforward share in the body frame [N, N, N·m].

        Parameters
        ----------
        eta, nu
            Measured pose (NED) and velocities (FRD).
        h
            Time since the last call [s].
        saturated
            True when the last desired force could not be had; the integral then rests.
        """
        reference, gains = self.reference, self.gains
        error = (
            eta[0] - reference.pose[0],
            eta[1] - reference.pose[1],
            shorter_way(eta[2] - reference.pose[2]),
        )
        if not saturated:
            for i in range(3):
                limit = gains.integral_limit[i] / gains.Ki[i] if gains.Ki[i] > 0.0 else 0.0
                self.integral[i] = min(max(self.integral[i] + h * error[i], -limit), limit)
        p0, p1, p2 = (gains.Kp[i] * error[i] + gains.Ki[i] * self.integral[i] for i in range(3))
        nu_d, nu_dot_d = reference.body()
        ahead = required_force(self.model, *nu_dot_d, *nu_d)
        c, s = cos(eta[2]), sin(eta[2])
        X = ahead[0] - (c * p0 + s * p1) - gains.Kd[0] * (nu[0] - nu_d[0])
        Y = ahead[1] - (c * p1 - s * p0) - gains.Kd[1] * (nu[1] - nu_d[1])
        N = ahead[2] - p2 - gains.Kd[2] * (nu[2] - nu_d[2])
        return (X, Y, N), ahead


@dataclass(frozen=True)
class Order:
    """What one azimuth thruster is told: speed [rpm], angle [rad, not wrapped]."""

    speed: float
    angle: float


HELD_BELOW_N = 8.0
"""A thruster asked for less than this keeps its angle: a direction means nothing without a force."""


def allocate(tau_d: Force, fore: Azimuth, aft: Azimuth, before: tuple[Order, Order]) -> tuple[Order, Order, bool]:
    """Share a desired force between two azimuth thrusters on the centre line (NSCA).

    Thruster forces are ``F_x = X_d / 2`` each, ``F_1y = (L Y_d + N_d) / 2L`` and ``F_2y = (L Y_d - N_d) / 2L``,
    generalised to unequal distances, so that they sum to `tau_d`. A force out of reach is shortened
    and keeps its direction.

    Parameters
    ----------
    tau_d
        Desired force [N, N, N·m].
    fore, aft
        The thrusters, at different x.
    before
        The last orders; angles turn the shorter way from there.

    Returns
    -------
    fore, aft
        New orders.
    saturated
        True when a force was shortened.

    References
    ----------
    Torben et al. (2019); Aurlien (2021), (2.30)-(2.32), whose sign order is another.
    """
    X_d, Y_d, N_d = tau_d
    span = fore.x_m - aft.x_m
    sides = ((N_d - aft.x_m * Y_d) / span, (fore.x_m * Y_d - N_d) / span)
    orders: list[Order] = []
    saturated = False
    for thruster, Y, last in zip((fore, aft), sides, before, strict=True):
        size = hypot(0.5 * X_d, Y)
        largest = thruster.units * thruster.table.largest
        saturated = saturated or size > largest
        angle = last.angle
        if size > HELD_BELOW_N:
            angle += shorter_way(atan2(Y, 0.5 * X_d) - last.angle)
        orders.append(Order(thruster.table.speed(size / thruster.units), angle))
    return orders[0], orders[1], saturated
