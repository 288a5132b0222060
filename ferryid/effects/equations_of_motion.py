"""The equations of motion in every row of a force model, compiled: one pass instead of some hundred over short-lived arrays.

The coefficients of the hull are in the order of `ferryid.effects.force_model.COEFFICIENTS`; what a force model has not
got is an array without rows.
"""

from __future__ import annotations

import numpy as np

from ferryid.compiled import borrowing, compiled
from ferryid.types import Floats, Ints

MASSES = 5
"""Coefficients that are masses; those of damping follow."""
DAMPED = (0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 2, 2, 1, 1, 2, 2)
"""Axis of every coefficient of damping."""


@borrowing
def relative(i: int, nu: Floats, flow: Floats) -> tuple[float, float, float]:
    """Return a row's velocity through the water, which moves by `flow`, shape (n, 2), along the vessel's axes."""
    if flow.shape[0] == 0:
        return nu[i, 0], nu[i, 1], nu[i, 2]
    return nu[i, 0] - flow[i, 0], nu[i, 1] - flow[i, 1], nu[i, 2]


@borrowing
def products(u: float, v: float, r: float, out: Floats) -> None:
    """Fill in what the coefficients of damping multiply, shape (21,)."""
    av, ar = abs(v), abs(r)
    vv, rv, vr, rr = av * v, ar * v, av * r, ar * r
    out[0], out[1], out[2] = u, abs(u) * u, u * u * u
    out[3], out[4], out[5], out[6], out[7], out[8], out[9] = v, vv, rv, v * v * v, r, vr, rr
    out[10], out[11], out[12], out[13], out[14], out[15], out[16] = v, vv, rv, r, vr, rr, r * r * r
    out[17], out[18], out[19], out[20] = u * v, u * r, u * v, u * r


PRODUCTS = (0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 16, 17, 18)
"""Of the products of damping those that differ; X are the first three."""
PRODUCT_OF = (0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 3, 4, 5, 7, 8, 9, 10, 11, 12, 11, 12)
"""Which of these every coefficient of damping multiplies."""
AHEAD = 3
"""How many of them push ahead."""


@borrowing
def masses(i: int, hull: Floats, load: Floats) -> tuple[float, float, float, float, float]:
    """Return the entries of a row's mass matrix, that of the load included."""
    if load.shape[0] == 0:
        return hull[0], hull[1], hull[2], hull[3], hull[4]
    return hull[0] + load[i, 0], hull[1] + load[i, 1], hull[2] + load[i, 2], hull[3] + load[i, 3], hull[4] + load[i, 4]


@borrowing
def damping(u: float, v: float, r: float, hull: Floats) -> tuple[float, float, float]:
    """Return the force of all damping: what `products` fills in, times its coefficients."""
    av, ar = abs(v), abs(r)
    vv, rv, vr, rr = av * v, ar * v, av * r, ar * r
    X = hull[5] * u + hull[6] * (abs(u) * u) + hull[7] * (u * u * u)
    Y = (
        hull[8] * v
        + hull[9] * vv
        + hull[10] * rv
        + hull[11] * (v * v * v)
        + hull[12] * r
        + hull[13] * vr
        + hull[14] * rr
    )
    N = (
        hull[15] * v
        + hull[16] * vv
        + hull[17] * rv
        + hull[18] * r
        + hull[19] * vr
        + hull[20] * rr
        + hull[21] * (r * r * r)
    )
    return X, Y + (hull[22] * (u * v) + hull[23] * (u * r)), N + (hull[24] * (u * v) + hull[25] * (u * r))


@borrowing
def other_forces(
    i: int,
    mass: tuple[float, float, float, float, float],
    u: float,
    v: float,
    r: float,
    damped: tuple[float, float, float],
    external: Floats,
    factor: Floats,
) -> tuple[float, float, float]:
    """Return the forces on the hull in a row but the actuators': external ones, `damping`, and the Coriolis forces."""
    m11, m22, m23, m32, _ = mass
    X, Y, N = damped
    much = 1.0 if factor.shape[0] == 0 else factor[i]
    c13, c23 = -m22 * v - 0.5 * (m23 + m32) * r, m11 * u
    return (
        external[i, 0] + much * X - c13 * r,
        external[i, 1] + much * Y - c23 * r,
        external[i, 2] + much * N + c13 * u + c23 * v,
    )


@borrowing
def solved(mass: tuple[float, float, float, float, float], X: float, Y: float, N: float) -> tuple[float, float, float]:
    """Return the acceleration that a force gives."""
    m11, m22, m23, m32, m33 = mass
    det = m22 * m33 - m23 * m32
    return X / m11, (m33 * Y - m23 * N) / det, (m22 * N - m32 * Y) / det


@borrowing
def acceleration_in(
    i: int,
    u: float,
    v: float,
    r: float,
    hull: Floats,
    parts: Floats,
    external: Floats,
    load: Floats,
    factor: Floats,
) -> tuple[float, float, float]:
    """Return the acceleration through the water that the forces of a row give at a velocity through it."""
    mass = masses(i, hull, load)
    X, Y, N = other_forces(i, mass, u, v, r, damping(u, v, r, hull), external, factor)
    for k in range(parts.shape[1]):
        X, Y, N = X + parts[i, k, 0], Y + parts[i, k, 1], N + parts[i, k, 2]
    return solved(mass, X, Y, N)


@compiled
def accelerations(
    nu: Floats, hull: Floats, parts: Floats, external: Floats, flow: Floats, load: Floats, factor: Floats
) -> Floats:
    """Return the acceleration over ground of every row, shape (n, 3).

    Parameters
    ----------
    nu
        Velocities over ground, shape (n, 3).
    hull
        Shape (26,).
    parts, external, load, factor
        As `parts`, `external`, `load` and `damping_factor` of a force model.
    flow
        Velocity of the water along the vessel's axes, shape (n, 2).
    """
    out = np.empty_like(nu)
    for i in range(nu.shape[0]):
        u, v, r = relative(i, nu, flow)
        a, b, c = acceleration_in(i, u, v, r, hull, parts, external, load, factor)
        if flow.shape[0] > 0:
            # The body frame turns through the water.
            a, b = a + r * flow[i, 1], b - r * flow[i, 0]
        out[i, 0], out[i, 1], out[i, 2] = a, b, c
    return out


@compiled
def required(
    nu_dot: Floats, nu: Floats, hull: Floats, external: Floats, flow: Floats, load: Floats, factor: Floats
) -> Floats:
    """Return the force of the actuators that an acceleration over ground needs, shape (n, 3); see `accelerations`."""
    out = np.empty_like(nu)
    for i in range(nu.shape[0]):
        u, v, r = relative(i, nu, flow)
        mass = masses(i, hull, load)
        X, Y, N = other_forces(i, mass, u, v, r, damping(u, v, r, hull), external, factor)
        a, b, c = nu_dot[i, 0], nu_dot[i, 1], nu_dot[i, 2]
        if flow.shape[0] > 0:
            a, b = a - r * flow[i, 1], b + r * flow[i, 0]
        m11, m22, m23, m32, m33 = mass
        out[i, 0], out[i, 1], out[i, 2] = m11 * a - X, m22 * b + m23 * c - Y, m32 * b + m33 * c - N
    return out


@compiled
def slopes(
    places: Ints,
    moves: Floats,
    nu: Floats,
    hull: Floats,
    parts: Floats,
    external: Floats,
    flow: Floats,
    load: Floats,
    factor: Floats,
) -> Floats:
    """Return by how much the acceleration changes if coefficients of the hull move one by one, shape (n, 3, q).

    Damping is linear in its coefficients, so that one pass gives the change of all; masses are moved.

    Parameters
    ----------
    places, moves
        Which coefficients move and by how much, shape (q,) each.
    nu, hull, parts, external, flow, load, factor
        As of `accelerations`.
    """
    out, product, moved = np.empty((nu.shape[0], 3, places.shape[0])), np.empty(len(DAMPED)), hull.copy()
    for i in range(nu.shape[0]):
        u, v, r = relative(i, nu, flow)
        products(u, v, r, product)
        mass, damped = masses(i, hull, load), damping(u, v, r, hull)
        m11, m22, m23, m32, m33 = mass
        det = m22 * m33 - m23 * m32
        X, Y, N = other_forces(i, mass, u, v, r, damped, external, factor)
        thrust_X, thrust_Y, thrust_N = 0.0, 0.0, 0.0
        for k in range(parts.shape[1]):
            thrust_X, thrust_Y, thrust_N = (
                thrust_X + parts[i, k, 0],
                thrust_Y + parts[i, k, 1],
                thrust_N + parts[i, k, 2],
            )
        here = solved(mass, X + thrust_X, Y + thrust_Y, N + thrust_N)
        much = 1.0 if factor.shape[0] == 0 else factor[i]
        for q in range(places.shape[0]):
            k = places[q]
            if k < MASSES:
                moved[k] = hull[k] + moves[q]
                other = masses(i, moved, load)
                X, Y, N = other_forces(i, other, u, v, r, damped, external, factor)
                there = solved(other, X + thrust_X, Y + thrust_Y, N + thrust_N)
                moved[k] = hull[k]
                out[i, 0, q], out[i, 1, q], out[i, 2, q] = there[0] - here[0], there[1] - here[1], there[2] - here[2]
            else:
                push, axis = moves[q] * much * product[k - MASSES], DAMPED[k - MASSES]
                # As `solved`, of a force along one axis: what divides takes most of the time.
                if axis == 0:
                    out[i, 0, q], out[i, 1, q], out[i, 2, q] = push / m11, 0.0, 0.0
                elif axis == 1:
                    out[i, 0, q], out[i, 1, q], out[i, 2, q] = 0.0, m33 * push / det, -(m32 * push) / det
                else:
                    out[i, 0, q], out[i, 1, q], out[i, 2, q] = 0.0, -(m23 * push) / det, m22 * push / det
    return out


@compiled
def pushes(nu: Floats) -> Floats:
    """Return unit responses to damping in still water: each of `PRODUCTS` as an acceleration along one axis, shape (n, 3, 23).

    First those ahead, then the others to starboard, then the same as turns.
    """
    count = len(PRODUCTS) - AHEAD
    out, product = np.zeros((nu.shape[0], 3, AHEAD + 2 * count)), np.empty(len(DAMPED))
    for i in range(nu.shape[0]):
        products(nu[i, 0], nu[i, 1], nu[i, 2], product)
        for k in range(AHEAD):
            out[i, 0, k] = product[k]
        for k in range(count):
            out[i, 1, AHEAD + k] = out[i, 2, AHEAD + count + k] = product[PRODUCTS[AHEAD + k]]
    return out


@compiled
def damping_changes(responses: Floats, hull: Floats, places: Ints, moves: Floats, out: Floats) -> None:
    """Fill in by how much an acceleration changes if coefficients of damping move one by one, in still water.

    Parameters
    ----------
    responses
        `pushes`, or means of them along other axes, shape (J, 3, 23).
    hull
        Shape (26,).
    places, moves
        As of `slopes`; masses are left as they are.
    out
        Shape (J, 3, q).
    """
    count = len(PRODUCTS) - AHEAD
    mass = (hull[0], hull[1], hull[2], hull[3], hull[4])
    place = np.empty((places.shape[0], 2), np.int64)
    weight = np.empty((places.shape[0], 2))
    for q in range(places.shape[0]):
        k = max(places[q] - MASSES, 0)
        axis, product = DAMPED[k], PRODUCT_OF[k]
        X, Y, N = moves[q] if axis == 0 else 0.0, moves[q] if axis == 1 else 0.0, moves[q] if axis == 2 else 0.0
        ahead, aside, turn = solved(mass, X, Y, N)
        place[q, 0], place[q, 1] = product, product if axis == 0 else count + product
        weight[q, 0], weight[q, 1] = ahead if axis == 0 else aside, 0.0 if axis == 0 else turn
    for j in range(responses.shape[0]):
        for i in range(3):
            for q in range(places.shape[0]):
                if places[q] >= MASSES:
                    first, second = responses[j, i, place[q, 0]], responses[j, i, place[q, 1]]
                    out[j, i, q] = weight[q, 0] * first + weight[q, 1] * second


@compiled
def from_antenna(values: Floats, x: float, y: float, cosine: float, sine: float) -> None:
    """Turn accelerations of the body origin, shape (n, 3, q), into those of an antenna along other axes, in place.

    Parameters
    ----------
    values
        Surge, sway, yaw.
    x, y
        Place of the antenna, ahead and to starboard of the origin [m].
    cosine, sine
        Of the angle from the other axes to the vessel's, counterclockwise.
    """
    for i in range(values.shape[0]):
        for q in range(values.shape[2]):
            turn = values[i, 2, q]
            a, b = values[i, 0, q] - y * turn, values[i, 1, q] + x * turn
            values[i, 0, q], values[i, 1, q] = cosine * a + sine * b, cosine * b - sine * a


@compiled
def to_ground(values: Floats, cosine: Floats, sine: Floats) -> None:
    """Turn vectors along the vessel's axes, shape (n, 3, q), to north and east, in place; cosine and sine of the heading."""
    for i in range(values.shape[0]):
        c, s = cosine[i], sine[i]
        for q in range(values.shape[2]):
            a, b = values[i, 0, q], values[i, 1, q]
            values[i, 0, q], values[i, 1, q] = c * a - s * b, s * a + c * b


@compiled
def along_vessel(values: Floats, cosine: Floats, sine: Floats) -> Floats:
    """Return vectors to north and east, shape (n, 2), along the vessel's axes; cosine and sine of the heading."""
    out = np.empty(values.shape)
    for i in range(values.shape[0]):
        c, s, north, east = cosine[i], sine[i], values[i, 0], values[i, 1]
        out[i, 0], out[i, 1] = c * north + s * east, c * east - s * north
    return out


@compiled
def over_ground(rates: Floats, nu: Floats, cosine: Floats, sine: Floats) -> None:
    """Turn rates of velocities along the vessel's axes, shape (n, 3), into accelerations north and east, in place.

    The axes turn with the vessel: velocities that stay as they are along them, shape (n, 3), accelerate it too.
    """
    for i in range(rates.shape[0]):
        a, b = rates[i, 0] - nu[i, 2] * nu[i, 1], rates[i, 1] + nu[i, 2] * nu[i, 0]
        c, s = cosine[i], sine[i]
        rates[i, 0], rates[i, 1] = c * a - s * b, s * a + c * b
