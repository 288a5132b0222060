"""Wind load averaged over windows, of several winds in one pass: for the many windows of an archive, where NumPy takes long.

The same sums as `ferryid.vessel.wind.relative_wind_force` gives, to the last digits.
"""

from __future__ import annotations

import numpy as np

from ferryid.compiled import compiled
from ferryid.effects.wind_loads import Shape, load_at
from ferryid.types import Floats


@compiled
def mean_loads(
    winds: Floats, cosine: Floats, sine: Floats, surge: Floats, sway: Floats, weights: Floats, shape: Shape
) -> Floats:
    """Return the load of W winds averaged over J windows, shape (W, J, 3) [N, N, N·m].

    Parameters
    ----------
    winds
        True winds north and east of every window, where the air goes to [m/s], shape (W, J, 2).
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
    out = np.empty((winds.shape[0], J, 3))
    X, Y, N = np.empty(S), np.empty(S), np.empty(S)
    for j in range(J):
        c, s, u, v = cosine[j], sine[j], surge[j], sway[j]
        for w in range(winds.shape[0]):
            north, east = winds[w, j, 0], winds[w, j, 1]
            for i in range(S):
                X[i], Y[i], N[i] = load_at(c[i], s[i], u[i], v[i], north, east, shape)
            x = y = n = 0.0
            for i in range(S):
                x += weights[i] * X[i]
                y += weights[i] * Y[i]
                n += weights[i] * N[i]
            out[w, j, 0], out[w, j, 1], out[w, j, 2] = x, y, n
    return out
