"""Wind load averaged over windows, and its slope, in one pass: for the many windows of an archive, where NumPy takes long.

The same sums as `ferryid.vessel.wind.relative_wind_force` and `relative_wind_slope` give, to the last digits.
"""

from __future__ import annotations

import math

import numpy as np

from ferryid.compiled import compiled
from ferryid.effects.wind_loads import LEAST, Shape, angle, load_at
from ferryid.types import Floats


@compiled
def mean_loads(
    winds: Floats, cosine: Floats, sine: Floats, surge: Floats, sway: Floats, weights: Floats, shape: Shape
) -> Floats:
    """Return the load of the wind averaged over J windows, shape (J, 3) [N, N, N·m].

    Parameters
    ----------
    winds
        True wind north and east of every window, where the air goes to [m/s], shape (J, 2).
    cosine, sine
        Of the heading at S points of each window, shape (J, S) each.
    surge, sway
        Velocity over ground there [m/s], shape (J, S) each.
    weights
        Of the points, shape (S,).
    shape
        See `ferryid.effects.wind_loads`.
    """
    J, S = cosine.shape
    out = np.empty((J, 3))
    X, Y, N = np.empty(S), np.empty(S), np.empty(S)
    for j in range(J):
        c, s, u, v = cosine[j], sine[j], surge[j], sway[j]
        north, east = winds[j, 0], winds[j, 1]
        for i in range(S):
            X[i], Y[i], N[i] = load_at(c[i], s[i], u[i], v[i], north, east, shape)
        x = y = n = 0.0
        for i in range(S):
            x += weights[i] * X[i]
            y += weights[i] * Y[i]
            n += weights[i] * N[i]
        out[j, 0], out[j, 1], out[j, 2] = x, y, n
    return out


@compiled
def mean_slopes(
    winds: Floats, cosine: Floats, sine: Floats, surge: Floats, sway: Floats, weights: Floats, shape: Shape
) -> tuple[Floats, Floats]:
    """Return the mean load, shape (J, 3), and its derivative by the wind north and east, (J, 3, 2) [N·s/m, N·s/m, N·s].

    Parameters as of `mean_loads`.
    """
    J, S = cosine.shape
    longitudinal, transverse, oblique, lever, moved = shape
    load, slope = np.zeros((J, 3)), np.zeros((J, 3, 2))
    for j in range(J):
        for i in range(S):
            c, s, w = cosine[j, i], sine[j, i], weights[i]
            ahead = surge[j, i] - (c * winds[j, 0] + s * winds[j, 1])
            aside = sway[j, i] - (c * winds[j, 1] - s * winds[j, 0])
            square = max(ahead * ahead + aside * aside, LEAST)
            u_share, v_share = ahead / square, aside / square
            sin_2gamma = 2.0 * ahead * v_share
            denominator = 1.0 - oblique * sin_2gamma * sin_2gamma
            pressure = -math.sqrt(square) / denominator
            turning = 4.0 * oblique * sin_2gamma * (aside * v_share - ahead * u_share) / denominator
            by_u, by_v = pressure * (u_share + turning * v_share), pressure * (v_share - turning * u_share)
            push = transverse * pressure * aside
            arm = lever + moved * (0.5 * math.pi - angle(abs(aside), ahead))
            X_u, X_v = longitudinal * (pressure + ahead * by_u), longitudinal * ahead * by_v
            Y_u, Y_v = transverse * aside * by_u, transverse * (pressure + aside * by_v)
            N_u = arm * Y_u + moved * abs(v_share) * push
            N_v = arm * Y_v - moved * (u_share if aside > 0.0 else -u_share) * push
            load[j, 0] += w * longitudinal * pressure * ahead
            load[j, 1] += w * push
            load[j, 2] += w * arm * push
            # The wind to north takes c from the velocity ahead and gives s to that aside, the one to east takes s and c.
            slope[j, 0, 0] += w * (s * X_v - c * X_u)
            slope[j, 0, 1] -= w * (s * X_u + c * X_v)
            slope[j, 1, 0] += w * (s * Y_v - c * Y_u)
            slope[j, 1, 1] -= w * (s * Y_u + c * Y_v)
            slope[j, 2, 0] += w * (s * N_v - c * N_u)
            slope[j, 2, 1] -= w * (s * N_u + c * N_v)
    return load, slope
