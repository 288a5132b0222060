"""The actuators: how they follow their orders, and the force they then give in the flow along the hull.

Speeds and angles depend on orders alone and are exact at the start, the middle and the end of a step; what the flow does
to the force follows the state of each Runge-Kutta stage.
"""

from __future__ import annotations

from math import cos, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from ferryid.compiled import borrowing
from ferryid.simulate.plant.added import Added, added_thrust, build_added
from ferryid.simulate.plant.hull import Force
from ferryid.simulate.plant.lags import Weights, decay_of, follow, lag_weights
from ferryid.simulate.plant.rudder import COLUMNS, rudder_load, rudder_row
from ferryid.simulate.plant.thrust import Curves, curves_of, force_at, largest_force
from ferryid.simulate.sections import Thrusters
from ferryid.types import Floats, Ints
from ferryid.vessel.order_response import OrderResponse
from ferryid.vessel.profile import Profile
from ferryid.vessel.thrusters import FRESH_WATER

FIXED, AZIMUTH, RUDDER = 0, 1, 2
"""What an actuator's second order turns: nothing, itself, or its rudder."""

UNLIMITED = 1e12
"""A limit of the rate that nothing reaches, in any unit."""

FORCE, COS, SIN, RPS, HELM, FACTOR, DEFICIT, KEEP = range(8)
"""Columns of `Gear.acting`: bollard force with losses [N], its direction, propeller speed [1/s], rudder angle [rad], the
factor of fault and interaction, how far the lagged force is behind the curve [N], and what the wakes of others leave."""


class Gear(NamedTuple):
    """All k actuators; arrays of shape (k,) unless said otherwise.

    `unit` is the share of one propeller, before thrust deduction, in the force on the hull. `advance` and `k_t` (k, m) are
    the open-water tables, `points` their lengths (0 for other curves), `open_water` (k, 2) ``rho D^4`` of all units after
    deduction and K_T astern. `delay` (k, 2) is by how many steps speed and angle follow their orders late. `acting`
    (3, k, 8) is written anew in every step, for its start, middle and end. `added` changes
    what the curves give.
    """

    curves: Curves
    x: Floats
    y: Floats
    steers: Ints
    angle: Floats
    speed_lag: Floats
    speed_rate: Floats
    speed_decay: Floats
    angle_lag: Floats
    angle_rate: Floats
    angle_decay: Floats
    delay: Ints
    force_lag: Floats
    half: Weights
    whole: Weights
    inflow_loss: float
    interaction: float
    units: Floats
    unit: Floats
    wake_fraction: Floats
    diameter: Floats
    points: Ints
    advance: Floats
    k_t: Floats
    open_water: Floats
    rudder: Floats
    acting: Floats
    added: Added


def gear_of(profile: Profile, dynamics: Thrusters, h: float, added: Added | None = None) -> Gear:
    """Return the actuators of a profile with the dynamics of a scenario and its added effects, for steps of `h` seconds.

    Raises
    ------
    FerryIdError
        When an actuator has no usable thrust curve.
    """
    actuators = profile.actuators
    k = len(actuators)
    curves = curves_of(profile)
    longest = max([len(a.thrust.table[0]) for a in actuators if a.thrust is not None], default=0)
    steers = {"azimuth": AZIMUTH, "propeller_rudder": RUDDER}
    turning = {
        AZIMUTH: (dynamics.azimuth_lag_s, dynamics.azimuth_rate_degps),
        RUDDER: (dynamics.rudder_lag_s, dynamics.rudder_rate_degps),
        FIXED: (0.0, 1.0),
    }
    gear = Gear(
        curves=curves,
        x=np.array([float(a.position_m[0]) for a in actuators]),
        y=np.array([float(a.position_m[1]) for a in actuators]),
        steers=np.array([steers.get(a.kind, FIXED) for a in actuators], dtype=np.int64),
        angle=np.array([float(a.angle_rad) for a in actuators]),
        speed_lag=np.full(k, dynamics.speed_lag_s),
        # The rate limit is one of propeller speed; a force given directly has none.
        speed_rate=np.where(curves.direct > 0, UNLIMITED, dynamics.speed_rate_rpmps),
        speed_decay=np.full(k, decay_of(dynamics.speed_lag_s, 0.5 * h)),
        angle_lag=np.zeros(k),
        angle_rate=np.zeros(k),
        angle_decay=np.zeros(k),
        delay=np.zeros((k, 2), dtype=np.int64),
        force_lag=np.full(k, dynamics.force_lag_s),
        half=lag_weights(dynamics.force_lag_s, h, 0.5),
        whole=lag_weights(dynamics.force_lag_s, h, 1.0),
        inflow_loss=dynamics.inflow_loss_per_mps,
        interaction=dynamics.interaction_fraction,
        units=np.array([float(a.count) for a in actuators]),
        unit=np.zeros(k),
        wake_fraction=np.array([float(a.inflow.get("wake_fraction", 0.0)) for a in actuators]),
        diameter=np.array([float(a.inflow.get("diameter_m", 1.0)) for a in actuators]),
        points=np.zeros(k, dtype=np.int64),
        advance=np.zeros((k, longest)),
        k_t=np.zeros((k, longest)),
        open_water=np.zeros((k, 2)),
        rudder=np.zeros((k, COLUMNS)),
        acting=np.zeros((3, k, KEEP + 1)),
        added=build_added((), profile) if added is None else added,
    )
    for i, actuator in enumerate(actuators):
        deduction = 1.0 - actuator.inflow.get("thrust_deduction", 0.0)
        gear.unit[i] = 1.0 / (actuator.count * deduction)
        lag, rate = turning[int(gear.steers[i])]
        gear.angle_lag[i], gear.angle_rate[i] = lag, rate * pi / 180.0
        gear.angle_decay[i] = decay_of(lag, 0.5 * h)
        _follow_as_stated(gear, profile, i, h)
        if actuator.rudder:
            gear.rudder[i] = rudder_row(actuator)
        curve = actuator.thrust
        if curve is not None and curve.kind == "open_water" and actuator.kind != "force":
            n, D = len(curve.table[0]), actuator.inflow["diameter_m"]
            gear.points[i] = n
            gear.advance[i, :n], gear.k_t[i, :n] = curve.table
            density = actuator.inflow.get("water_density", FRESH_WATER)
            gear.open_water[i] = actuator.count * deduction * density * D * D * D * D, curve.astern
    return gear


def _follow_as_stated(gear: Gear, profile: Profile, i: int, h: float) -> None:
    """Let an actuator follow its orders as the profile states, in the place of the scenario's lags and rate limits."""
    for signal in profile.signals:
        name, _, role = signal.quantity.partition(".")
        if name != profile.actuators[i].name or not signal.states_response:
            continue
        response = OrderResponse.of(signal)
        turns = role in ("angle.command", "rudder.command")
        lag, rate, decay = (
            (gear.angle_lag, gear.angle_rate, gear.angle_decay)
            if turns
            else (gear.speed_lag, gear.speed_rate, gear.speed_decay)
        )
        lag[i], rate[i] = response.time_constant_s, UNLIMITED
        decay[i] = decay_of(response.time_constant_s, 0.5 * h)
        gear.delay[i, int(turns)] = round(response.delay_s / h)


@borrowing
def move(gear: Gear, thrusters: Floats, orders: Floats, factor: Floats, offset: Floats, h: float) -> None:
    """Move all actuators towards their orders for one step, and note how they act at its start, middle and end.

    Parameters
    ----------
    gear
        Actuators.
    thrusters
        Speed [rpm or N], angle [rad] and lagged force [N] of each, shape (k, 3); overwritten.
    orders
        Speed [rpm or N] and angle or rudder [rad] of each, shape (k, 2).
    factor, offset
        Faults: factor on each force, and how far each true angle is ahead of the measured one [rad], shape (k,).
    h
        The step that `gear` was made for [s].
    """
    d = 0.5 * h
    for k in range(len(gear.x)):
        n0, a0 = thrusters[k, 0], thrusters[k, 1]
        n_order = min(max(orders[k, 0], gear.curves.low[k]), gear.curves.high[k])
        n1 = follow(n0, n_order, gear.speed_lag[k], gear.speed_rate[k], d, gear.speed_decay[k])
        n2 = follow(n1, n_order, gear.speed_lag[k], gear.speed_rate[k], d, gear.speed_decay[k])
        a1, a2 = a0, a0
        if gear.steers[k] != FIXED:
            a1 = follow(a0, orders[k, 1], gear.angle_lag[k], gear.angle_rate[k], d, gear.angle_decay[k])
            a2 = follow(a1, orders[k, 1], gear.angle_lag[k], gear.angle_rate[k], d, gear.angle_decay[k])
        F0 = added_thrust(gear.added, k, n0, force_at(gear.curves, k, n0))
        F1 = added_thrust(gear.added, k, n1, force_at(gear.curves, k, n1))
        F2 = added_thrust(gear.added, k, n2, force_at(gear.curves, k, n2))
        f0, f1, f2 = F0, F1, F2
        if gear.force_lag[k] > 0.0:
            f0 = thrusters[k, 2]
            w = gear.half
            f1 = w[0] * f0 + w[1] * F0 + w[2] * F1 + w[3] * F2
            w = gear.whole
            f2 = w[0] * f0 + w[1] * F0 + w[2] * F1 + w[3] * F2
        _note(gear, 0, k, n0, a0, f0, f0 - F0, factor[k], offset[k])
        _note(gear, 1, k, n1, a1, f1, f1 - F1, factor[k], offset[k])
        _note(gear, 2, k, n2, a2, f2, f2 - F2, factor[k], offset[k])
        thrusters[k, 0], thrusters[k, 1], thrusters[k, 2] = n2, a2, f2
    if gear.interaction > 0.0:
        for node in range(3):
            _interact(gear, node)


@borrowing
def _note(
    gear: Gear, node: int, k: int, n: float, a: float, f: float, deficit: float, factor: float, offset: float
) -> None:
    acting = gear.acting[node, k]
    turned = gear.steers[k] == RUDDER
    angle = gear.angle[k] if turned else a + offset
    acting[FORCE] = factor * f
    acting[COS], acting[SIN] = (1.0, 0.0) if angle == 0.0 else (cos(angle), sin(angle))
    acting[RPS] = n / 60.0
    acting[HELM] = a + offset if turned else 0.0
    acting[FACTOR] = factor
    acting[DEFICIT] = deficit


@borrowing
def _interact(gear: Gear, node: int) -> None:
    """Take off what each thruster loses in the wakes of the others.

    The loss is largest, ``interaction_fraction``, where a wake of full thrust points straight at it. It falls with the 16th
    power of the cosine of the angle beside the wake, half of it at 17 degrees, and with the root of the force as a jet's
    speed does.
    """
    acting = gear.acting[node]
    k = len(gear.x)
    for i in range(k):
        keep = 1.0
        for j in range(k):
            if j == i:
                continue
            F = acting[j, FORCE]
            largest = largest_force(gear.curves, j, F >= 0.0)
            dx, dy = gear.x[i] - gear.x[j], gear.y[i] - gear.y[j]
            apart = sqrt(dx * dx + dy * dy)
            if F == 0.0 or apart == 0.0:
                continue
            # Water leaves against the force.
            towards = -(acting[j, COS] * dx + acting[j, SIN] * dy) / apart
            if F < 0.0:
                towards = -towards
            if towards > 0.0:
                c2 = towards * towards
                c4 = c2 * c2
                c8 = c4 * c4
                keep *= 1.0 - gear.interaction * c8 * c8 * min(sqrt(abs(F) / largest), 1.0)
        acting[i, KEEP] = keep
    for i in range(k):
        acting[i, FORCE] *= acting[i, KEEP]
        acting[i, FACTOR] *= acting[i, KEEP]


@borrowing
def thrust_load(gear: Gear, node: int, u: float, v: float, r: float) -> Force:
    """Return the force of all actuators on the hull [N, N, N·m].

    Parameters
    ----------
    gear
        Actuators, after `move`.
    node
        0, 1 or 2: start, middle or end of the step.
    u, v, r
        Velocities through the water [m/s, m/s, rad/s].
    """
    X, Y, N = 0.0, 0.0, 0.0
    for k in range(len(gear.x)):
        acting = gear.acting[node, k]
        F, c, s = acting[FORCE], acting[COS], acting[SIN]
        u_p = u * (1.0 - gear.wake_fraction[k]) if u > 0.0 else u
        if gear.points[k] > 0:
            F = added_thrust(gear.added, k, 60.0 * acting[RPS], _open_water(gear, k, acting[RPS], u_p))
            F = acting[FACTOR] * (F + acting[DEFICIT])
        elif gear.inflow_loss > 0.0:
            along = c * (u - r * gear.y[k]) + s * (v + r * gear.x[k])
            share = gear.inflow_loss * (along if F >= 0.0 else -along)
            F *= 1.0 - min(max(share, -1.0), 1.0)
        X += F * c
        Y += F * s
        N += F * (gear.x[k] * s - gear.y[k] * c)
        if gear.steers[k] == RUDDER:
            R = rudder_load(gear.rudder[k], acting[HELM], F * gear.unit[k], u_p, v, r)
            X += gear.units[k] * R[0]
            Y += gear.units[k] * R[1]
            N += gear.units[k] * R[2]
    return X, Y, N


@borrowing
def _open_water(gear: Gear, k: int, n: float, u_p: float) -> float:
    """Return ``rho n² D⁴ K_T(J)`` of all units, deduction taken off [N]; K_T is linear between its points."""
    if n == 0.0:
        return 0.0
    k_t = -gear.open_water[k, 1]
    if n > 0.0:
        J = u_p / (n * gear.diameter[k])
        advance = gear.advance[k]
        last = gear.points[k] - 1
        J = min(max(J, advance[0]), advance[last])
        i = 1
        while i < last and advance[i] < J:
            i += 1
        share = (J - advance[i - 1]) / (advance[i] - advance[i - 1])
        k_t = gear.k_t[k, i - 1] + share * (gear.k_t[k, i] - gear.k_t[k, i - 1])
    return float(gear.open_water[k, 0] * n * n * k_t)
