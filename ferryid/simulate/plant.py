"""The simulated vessel: hull in relative velocity, wind load and actuators, advanced on plain floats.

Scalars instead of small arrays make a step four times faster than NumPy would; nothing here allocates arrays.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, cos, exp, pi, sin, sqrt
from typing import TypeAlias

import numpy as np

from ferryid.vessel.profile import Hull, ThrustCurve, WindAreas
from ferryid.vessel.thrusters import thrust

AIR_DENSITY = 1.225
"""Density of air [kg/m³] of the wind load."""

Force: TypeAlias = tuple[float, float, float]
State: TypeAlias = tuple[float, float, float, float, float, float]
"""North, east [m], heading [rad], surge, sway [m/s], yaw rate [rad/s]; all over ground."""

Hydrodynamics: TypeAlias = tuple[float, ...]
"""M (5), then the 17 damping coefficients in the order of `DAMPING`."""

DAMPING = (
    *("X_u", "X_|u|u", "X_uuu", "Y_v", "Y_|v|v", "Y_|r|v", "Y_vvv", "Y_r", "Y_|v|r", "Y_|r|r"),
    *("N_v", "N_|v|v", "N_|r|v", "N_r", "N_|v|r", "N_|r|r", "N_rrr"),
)


def hydrodynamics(hull: Hull, delta: float = 1.0, sigma: float = 1.0) -> Hydrodynamics:
    """Return the hull's coefficients as one flat tuple, with M and C scaled by `delta` and D by `sigma`.

    References
    ----------
    Aurlien (2021), (4.2)-(4.4).
    """
    M = hull.M
    mass = (float(M[0, 0]), float(M[1, 1]), float(M[1, 2]), float(M[2, 1]), float(M[2, 2]))
    return (*(delta * m for m in mass), *(sigma * float(hull.D.get(name, 0.0)) for name in DAMPING))


def hull_load(p: Hydrodynamics, u: float, v: float, r: float) -> Force:
    """Return C(nu) nu + D(nu) nu [N, N, N·m] for velocities through the water [m/s, m/s, rad/s].

    References
    ----------
    Aurlien (2021), (2.8)-(2.14), with the sign of (2.8) restored.
    """
    (
        m11,
        m22,
        m23,
        m32,
        _,
        X_u,
        X_uu,
        X_uuu,
        Y_v,
        Y_vv,
        Y_rv,
        Y_vvv,
        Y_r,
        Y_vr,
        Y_rr,
        N_v,
        N_vv,
        N_rv,
        N_r,
        N_vr,
        N_rr,
        N_rrr,
    ) = p
    au, av, ar = abs(u), abs(v), abs(r)
    c13 = -m22 * v - 0.5 * (m23 + m32) * r
    c23 = m11 * u
    X = c13 * r - (X_u + X_uu * au + X_uuu * u * u) * u
    Y = c23 * r - (Y_v + Y_vv * av + Y_rv * ar + Y_vvv * v * v) * v - (Y_r + Y_vr * av + Y_rr * ar) * r
    N = -c13 * u - c23 * v - (N_v + N_vv * av + N_rv * ar) * v - (N_r + N_vr * av + N_rr * ar + N_rrr * r * r) * r
    return X, Y, N


def required_force(p: Hydrodynamics, u_dot: float, v_dot: float, r_dot: float, u: float, v: float, r: float) -> Force:
    """Return M nu_dot + C nu + D nu [N, N, N·m]: what a motion through still water takes, (2.3)."""
    X, Y, N = hull_load(p, u, v, r)
    return X + p[0] * u_dot, Y + p[1] * v_dot + p[2] * r_dot, N + p[3] * v_dot + p[4] * r_dot


def wind_load(w: WindAreas, u_rw: float, v_rw: float) -> Force:
    """Return Blendermann's wind load [N, N, N·m] for the hull's velocity relative to the air [m/s].

    References
    ----------
    Aurlien (2021), (2.15)-(2.18), Table 4.2.
    """
    V2 = u_rw * u_rw + v_rw * v_rw
    if V2 == 0.0:
        return 0.0, 0.0, 0.0
    V = sqrt(V2)
    cos_gamma, sin_gamma = u_rw / V, -v_rw / V
    gamma = abs(atan2(v_rw, u_rw))
    CD_l = w.CD_l_AF * w.frontal_m2 / w.lateral_m2
    sin_2gamma = 2.0 * sin_gamma * cos_gamma
    den = 1.0 - 0.5 * w.delta * (1.0 - CD_l / w.CD_t) * sin_2gamma * sin_2gamma
    q = 0.5 * AIR_DENSITY * V2 / den
    X = -q * w.CD_l_AF * cos_gamma * w.frontal_m2
    Y = q * w.CD_t * sin_gamma * w.lateral_m2
    return X, Y, (w.S_L_m / w.length_m - 0.18 * (gamma - 0.5 * pi)) * w.length_m * Y


def rates(
    p: Hydrodynamics,
    areas: WindAreas | None,
    state: State,
    tau: Force,
    wind: tuple[float, float],
    current: tuple[float, float],
) -> State:
    """Return the time derivative of the state under actuator force, wind and a steady, irrotational current.

    Rigid-body terms act on nu and added-mass terms on nu_r = nu - nu_c. For an irrotational current the two
    add up to the whole M and C acting on nu_r, with nu_c_dot = [r v_c, -r u_c, 0] added at the end.

    Parameters
    ----------
    p
        Coefficients of the hull from `hydrodynamics`.
    areas
        Wind areas, None for a hull that feels no wind.
    state
        See `State`.
    tau
        Actuator force [N, N, N·m].
    wind, current
        Velocity of the air and of the water over ground, north and east [m/s].
    """
    _, _, psi, u, v, r = state
    c, s = cos(psi), sin(psi)
    u_c = c * current[0] + s * current[1]
    v_c = c * current[1] - s * current[0]
    X, Y, N = hull_load(p, u - u_c, v - v_c, r)
    X, Y, N = tau[0] - X, tau[1] - Y, tau[2] - N
    if areas is not None:
        X_w, Y_w, N_w = wind_load(areas, u - c * wind[0] - s * wind[1], v - c * wind[1] + s * wind[0])
        X, Y, N = X + X_w, Y + Y_w, N + N_w
    det = p[1] * p[4] - p[2] * p[3]
    return (
        c * u - s * v,
        s * u + c * v,
        r,
        X / p[0] + r * v_c,
        (p[4] * Y - p[2] * N) / det - r * u_c,
        (p[1] * N - p[3] * Y) / det,
    )


def advance(
    p: Hydrodynamics,
    areas: WindAreas | None,
    state: State,
    slope: State,
    taus: tuple[Force, Force],
    winds: tuple[tuple[float, float], tuple[float, float]],
    current: tuple[float, float],
    h: float,
) -> State:
    """Take one classical Runge-Kutta step of `h` seconds.

    `slope` is `rates` at the start of the step; `taus` and `winds` hold the force and the wind in the middle and at the
    end of the step.
    """
    x, y, psi, u, v, r = state
    a0, a1, a2, a3, a4, a5 = slope
    d = 0.5 * h
    mid, end = taus
    wind_mid, wind_end = winds
    b0, b1, b2, b3, b4, b5 = rates(
        p,
        areas,
        (x + d * a0, y + d * a1, psi + d * a2, u + d * a3, v + d * a4, r + d * a5),
        mid,
        wind_mid,
        current,
    )
    c0, c1, c2, c3, c4, c5 = rates(
        p,
        areas,
        (x + d * b0, y + d * b1, psi + d * b2, u + d * b3, v + d * b4, r + d * b5),
        mid,
        wind_mid,
        current,
    )
    d0, d1, d2, d3, d4, d5 = rates(
        p,
        areas,
        (x + h * c0, y + h * c1, psi + h * c2, u + h * c3, v + h * c4, r + h * c5),
        end,
        wind_end,
        current,
    )
    d = h / 6.0
    return (
        x + d * (a0 + 2.0 * (b0 + c0) + d0),
        y + d * (a1 + 2.0 * (b1 + c1) + d1),
        psi + d * (a2 + 2.0 * (b2 + c2) + d2),
        u + d * (a3 + 2.0 * (b3 + c3) + d3),
        v + d * (a4 + 2.0 * (b4 + c4) + d4),
        r + d * (a5 + 2.0 * (b5 + c5) + d5),
    )


def follow(value: float, order: float, lag_s: float, rate_limit: float, h: float) -> float:
    """Return where a first-order lag with a rate limit stands after `h` seconds of a constant order; exact.

    Far from the order it moves at `rate_limit` [unit/s], and from ``rate_limit * lag_s`` on it decays exponentially.
    """
    error = order - value
    knee = rate_limit * lag_s
    if abs(error) > knee:
        straight_s = (abs(error) - knee) / rate_limit
        step = rate_limit if error > 0.0 else -rate_limit
        if straight_s >= h:
            return value + step * h
        h -= straight_s
        error = knee if error > 0.0 else -knee
    return order - error * exp(-h / lag_s) if lag_s > 0.0 else order


@dataclass(frozen=True)
class ThrustTable:
    """A thrust curve on a fine grid, so that force and its inverse cost the same for every kind of curve.

    Linear between nodes 0.1 % of the valid range apart at most; outside the range the end values hold.
    """

    low: float
    spacing: float
    forces: Sequence[float]
    rising: Sequence[float]
    """Largest force up to each node from zero speed on: what `speed` searches, so that it is monotonous."""
    zero: int

    @classmethod
    def of(cls, curve: ThrustCurve, nodes: int = 8001) -> ThrustTable:
        """Sample the curve over its valid range [rpm]; zero speed is a node when the range is symmetric."""
        rpm = 60.0 if curve.input_unit == "rps" else 1.0
        low, high = (rpm * end for end in curve.valid)
        speeds = np.linspace(low, high, nodes)
        forces = thrust(curve, speeds)[0]
        zero = int(np.argmin(np.abs(speeds)))
        rising = np.maximum.accumulate(forces[zero:])
        return cls(low, (high - low) / (nodes - 1), forces.tolist(), rising.tolist(), zero)

    @property
    def largest(self) -> float:
        """Largest force ahead [N]."""
        return self.rising[-1]

    def force(self, speed: float) -> float:
        """Return the force [N] at a speed [rpm]."""
        place = (speed - self.low) / self.spacing
        if place <= 0.0:
            return self.forces[0]
        node = int(place)
        if node >= len(self.forces) - 1:
            return self.forces[-1]
        share = place - node
        return self.forces[node] * (1.0 - share) + self.forces[node + 1] * share

    def speed(self, force: float) -> float:
        """Return the speed ahead [rpm] that gives a force >= 0 [N]; the largest one where the force is out of reach."""
        rising = self.rising
        node = bisect_right(rising, force) - 1
        if node < 0:
            return 0.0
        if node >= len(rising) - 1:
            return self.low + self.spacing * (self.zero + len(rising) - 1)
        share = (force - rising[node]) / (rising[node + 1] - rising[node])
        return self.low + self.spacing * (self.zero + node + share)


@dataclass
class Azimuth:
    """One azimuth thruster with its present speed [rpm] and angle [rad, not wrapped]."""

    x_m: float
    y_m: float
    table: ThrustTable
    speed_lag_s: float
    speed_rate: float
    angle_lag_s: float
    angle_rate: float
    units: float = 1.0
    speed: float = 0.0
    angle: float = 0.0

    def force(self) -> Force:
        """Return its force on the hull [N, N, N·m]."""
        F = self.units * self.table.force(self.speed)
        X, Y = F * cos(self.angle), F * sin(self.angle)
        return X, Y, self.x_m * Y - self.y_m * X

    def follow(self, speed: float, angle: float, h: float) -> None:
        """Move towards an order for `h` seconds."""
        self.speed = follow(self.speed, speed, self.speed_lag_s, self.speed_rate, h)
        self.angle = follow(self.angle, angle, self.angle_lag_s, self.angle_rate, h)


def total(forces: Sequence[Force]) -> Force:
    """Return the sum of forces on the hull [N, N, N·m]."""
    X = Y = N = 0.0
    for force in forces:
        X += force[0]
        Y += force[1]
        N += force[2]
    return X, Y, N
