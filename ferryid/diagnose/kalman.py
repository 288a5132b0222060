"""A Kalman filter of what a hypothesis leaves of the motion: its whitened prediction errors, compiled.

The states of each channel are what disturbances have made of the position and the velocity, the error of the measurement, and
a disturbance of the channel's own; then come shared disturbances, each a block of states whose last one pushes on all channels.
Gains depend on the noise alone and are computed once; every column of a linear problem then passes through the same filter.
"""

from __future__ import annotations

import numpy as np

from ferryid.compiled import compiled
from ferryid.vessel.profile import Floats

OWN = 4
"""States of a channel: position, velocity, measurement error, disturbance."""
SETTLED = 1e-9
"""Change of gains, as a share of the largest, below which they stay as they are."""
DIFFUSE = 2
"""Steps after which position and velocity are known."""


@compiled
def gains(
    scale: Floats, noise: Floats, integrals: int, blocks: Floats, drive: Floats, columns: Floats, step_s: float
) -> tuple[Floats, Floats]:
    """Run the covariances of the filter.

    Parameters
    ----------
    scale
        Usual size of each channel's measurement, shape (c,); nothing is known of where a series starts beyond it.
    noise
        Of each channel, shape (c, 5): standard deviation of the white measurement error, standard deviation and time constant
        [s] of the coloured one, and of the disturbance [m/s² or rad/s²].
    integrals
        2 where positions are filtered, 1 where velocities are.
    blocks
        Transition over a step of the states of the shared disturbances, shape (s, s).
    drive
        Covariance of what enters them over a step, and of the states to begin with, shape (2, s, s).
    columns
        Acceleration of every channel by each of these states, shape (n, c, s).
    step_s
        Step [s].

    Returns
    -------
    ndarray
        Gains, shape (n, c, S), S = 4 c + s.
    ndarray
        Standard deviation of every prediction, shape (n, c).
    """
    n, c, s = columns.shape
    S = OWN * c + s
    F, Q, P = np.zeros((S, S)), np.zeros((S, S)), np.zeros((S, S))
    h = step_s
    known = 0 if integrals == 2 else 1
    for j in range(c):
        i = OWN * j
        coloured, coloured_s, pushed, pushed_s = noise[j, 1], noise[j, 2], noise[j, 3], noise[j, 4]
        F[i, i], F[i, i + 1], F[i, i + 3] = 1.0, h, 0.5 * h * h
        F[i + 1, i + 1], F[i + 1, i + 3] = 1.0, h
        erring, pushing = np.exp(-h / coloured_s), np.exp(-h / pushed_s)
        F[i + 2, i + 2], F[i + 3, i + 3] = erring, pushing
        P[i + 2, i + 2], P[i + 3, i + 3] = coloured * coloured, pushed * pushed
        Q[i + 2, i + 2] = (1.0 - erring * erring) * coloured * coloured
        Q[i + 3, i + 3] = (1.0 - pushing * pushing) * pushed * pushed
        vague = 1e3 * scale[j]
        P[i + known, i + known] = vague * vague
        if integrals == 2:
            P[i + 1, i + 1] = vague * vague / (h * h)
    F[OWN * c :, OWN * c :] = blocks
    Q[OWN * c :, OWN * c :] = drive[0]
    P[OWN * c :, OWN * c :] = drive[1]
    K, spread = np.zeros((n, c, S)), np.empty((n, c))
    for k in range(n):
        for j in range(c):
            i = OWN * j
            at, wrong = i + known, i + 2
            variance = P[at, at] + 2.0 * P[at, wrong] + P[wrong, wrong] + noise[j, 0] * noise[j, 0]
            spread[k, j] = np.sqrt(variance)
            for a in range(S):
                K[k, j, a] = (P[a, at] + P[a, wrong]) / variance
            for a in range(S):
                for b in range(a, S):
                    P[a, b] -= K[k, j, a] * K[k, j, b] * variance
                    P[b, a] = P[a, b]
        for j in range(c):
            for b in range(s):
                F[OWN * j, OWN * c + b] = 0.5 * h * h * columns[k, j, b]
                F[OWN * j + 1, OWN * c + b] = h * columns[k, j, b]
        P = F @ P @ F.T + Q
        if s == 0 and k > 0 and np.abs(K[k] - K[k - 1]).max() < SETTLED * np.abs(K[k]).max():
            for rest in range(k + 1, n):
                K[rest], spread[rest] = K[k], spread[k]
            break
    return K, spread


@compiled
def errors(
    K: Floats,
    spread: Floats,
    noise: Floats,
    integrals: int,
    blocks: Floats,
    columns: Floats,
    step_s: float,
    series: Floats,
) -> Floats:
    """Return whitened prediction errors of several series at once.

    Parameters
    ----------
    K, spread
        From `gains`.
    noise, integrals, blocks, columns, step_s
        As given to `gains`.
    series
        Positions or velocities, shape (n, c, q).

    Returns
    -------
    ndarray
        Shape (n, c, q).
    """
    n, c, q = series.shape
    s = blocks.shape[0]
    S = OWN * c + s
    h = step_s
    known = 0 if integrals == 2 else 1
    keep = np.exp(-h / noise)
    x, shared = np.zeros((S, q)), np.zeros(s)
    out = np.empty((n, c, q))
    for k in range(n):
        for j in range(c):
            at, wrong = OWN * j + known, OWN * j + 2
            for m in range(q):
                error = series[k, j, m] - x[at, m] - x[wrong, m]
                out[k, j, m] = error / spread[k, j]
                for i in range(S):
                    x[i, m] += K[k, j, i] * error
        for m in range(q):
            for i in range(s):
                shared[i] = x[OWN * c + i, m]
            for j in range(c):
                i = OWN * j
                push = x[i + 3, m]
                for b in range(s):
                    push += columns[k, j, b] * shared[b]
                x[i, m] += h * x[i + 1, m] + 0.5 * h * h * push
                x[i + 1, m] += h * push
                x[i + 2, m] *= keep[j, 2]
                x[i + 3, m] *= keep[j, 4]
            for i in range(s):
                total = 0.0
                for b in range(s):
                    total += blocks[i, b] * shared[b]
                x[OWN * c + i, m] = total
    return out
