"""A Kalman filter of what a hypothesis leaves of the motion: its whitened prediction errors, compiled.

The states of each channel are what disturbances have made of the position and the velocity, the error of the measurement with
its rate, and a disturbance of the channel's own; then come shared disturbances, whose states push on all channels.
Gains depend on the noise alone and are computed once; every column of a linear problem then passes through the same filter.
What only leads from one series to the next is left to Python: compiled, it would hold all that it calls once more, which took
half of the time that the first diagnosis spends on compiling.
"""

from __future__ import annotations

import numpy as np

from ferryid.compiled import borrowing, compiled
from ferryid.types import Floats, Ints

CHANNEL_STATES = 5
"""States of a channel: position, velocity, measurement error, its rate, disturbance."""
CONVERGED = 1e-9
"""Change of gains, as a share of the largest, below which they stay as they are."""
FEW = 5
"""Series up to which `errors` takes them one after the other."""
WIDE = 24
"""States of a filter for which its loops are compiled: three channels' with waves and gusts; with more it is slower."""
DIFFUSE = 2
"""Steps after which position and velocity are known."""


@borrowing
def move_on(x: Floats, q: int, keep: Floats, blocks: Floats, columns: Floats, k: int, step_s: float) -> None:
    """Move q columns of states on by a step, in place.

    Parameters
    ----------
    x
        States of all channels, then the shared ones, shape (S, q or more).
    q
        Columns to move.
    keep
        Of each channel: what moves the error and its rate on, row by row, and what is kept of the disturbance, shape (c, 5).
    blocks
        Transition of the shared states, shape (s, s), of which each depends on itself and at most on one beside it.
    columns
        Acceleration of every channel by each of these, shape (n, c, s).
    k
        Which of the n.
    step_s
        Step [s].
    """
    c, s = columns.shape[1], columns.shape[2]
    h, half, shared = step_s, 0.5 * step_s * step_s, CHANNEL_STATES * c
    for j in range(c):
        i = CHANNEL_STATES * j
        first, second, third, fourth, fade = keep[j, 0], keep[j, 1], keep[j, 2], keep[j, 3], keep[j, 4]
        # The second state of a disturbance in a narrow band pushes nothing itself. Up to three push in one loop: a loop each
        # takes longer to begin than to run.
        at, one, two, three = 0, 0.0, 0.0, 0.0
        a, b, d = shared, shared, shared
        while at < s and three == 0.0:
            part = columns[k, j, at]
            if part != 0.0:
                if one == 0.0:
                    one, a = part, shared + at
                elif two == 0.0:
                    two, b = part, shared + at
                else:
                    three, d = part, shared + at
            at += 1
        if one != 0.0:
            for m in range(q):
                x[i, m] = x[i, m] + half * (one * x[a, m]) + half * (two * x[b, m]) + half * (three * x[d, m])
        for rest in range(at, s):
            part = columns[k, j, rest]
            if part != 0.0:
                for m in range(q):
                    x[i, m] += half * (part * x[shared + rest, m])
        for m in range(q):
            # Read all, then write all: only so is this loop vectorised.
            place, speed, wrong, rate, push = x[i, m], x[i + 1, m], x[i + 2, m], x[i + 3, m], x[i + 4, m]
            x[i, m] = place + (h * speed + half * push)
            x[i + 1, m] = speed + h * push
            x[i + 2, m] = first * wrong + second * rate
            x[i + 3, m] = third * wrong + fourth * rate
            x[i + 4, m] = fade * push
        if one != 0.0:
            for m in range(q):
                x[i + 1, m] = x[i + 1, m] + h * (one * x[a, m]) + h * (two * x[b, m]) + h * (three * x[d, m])
        for rest in range(at, s):
            part = columns[k, j, rest]
            if part != 0.0:
                for m in range(q):
                    x[i + 1, m] += h * (part * x[shared + rest, m])
    i = 0
    while i < s:
        if i + 1 < s and (blocks[i, i + 1] != 0.0 or blocks[i + 1, i] != 0.0):
            first, second, third, fourth = blocks[i, i], blocks[i, i + 1], blocks[i + 1, i], blocks[i + 1, i + 1]
            for m in range(q):
                along, across = x[shared + i, m], x[shared + i + 1, m]
                x[shared + i, m] = first * along + second * across
                x[shared + i + 1, m] = third * along + fourth * across
            i += 2
        else:
            fade = blocks[i, i]
            for m in range(q):
                x[shared + i, m] *= fade
            i += 1


@compiled
def kept(noise: Floats, step_s: float) -> Floats:
    """Return what each channel keeps over a step; see `move_on`. The error is critically damped, as a filter's is."""
    keep = np.empty((noise.shape[0], 5))
    for j in range(noise.shape[0]):
        x = step_s / noise[j, 2]
        fade = np.exp(-x)
        keep[j, 0], keep[j, 1] = fade * (1.0 + x), fade * step_s
        keep[j, 2], keep[j, 3] = -fade * x / noise[j, 2], fade * (1.0 - x)
        keep[j, 4] = np.exp(-step_s / noise[j, 4])
    return keep


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
        Gains, shape (n, c, S), S = 5 c + s.
    ndarray
        Standard deviation of every prediction, shape (n, c).
    """
    n, c, s = columns.shape
    S = CHANNEL_STATES * c + s
    K, spread = np.zeros((n, c, S)), np.empty((n, c))
    given = scale, noise, integrals, blocks, drive, columns, step_s, kept(noise, step_s)
    if S <= WIDE:
        _run_narrow(*given, K, spread)
    else:
        P, Q, turned = (np.zeros((S, S)) for _ in range(3))
        run_covariances(*given, P, Q, turned, np.zeros((c, S)), K, spread)
    return K, spread


@compiled
def _run_narrow(
    scale: Floats,
    noise: Floats,
    integrals: int,
    blocks: Floats,
    drive: Floats,
    columns: Floats,
    step_s: float,
    keep: Floats,
    K: Floats,
    spread: Floats,
) -> None:
    """Fill in gains and standard deviations as `run_covariances`, of at most `WIDE` states.

    Rows lie at distances that are known when this is compiled: only so are loops over several of them vectorised.
    """
    S, c = K.shape[2], columns.shape[1]
    P, Q, turned = np.zeros((S, WIDE)), np.zeros((S, WIDE)), np.zeros((S, WIDE))
    sights = np.zeros((c, WIDE))
    run_covariances(scale, noise, integrals, blocks, drive, columns, step_s, keep, P, Q, turned, sights, K, spread)


@borrowing
def run_covariances(
    scale: Floats,
    noise: Floats,
    integrals: int,
    blocks: Floats,
    drive: Floats,
    columns: Floats,
    step_s: float,
    keep: Floats,
    P: Floats,
    Q: Floats,
    turned: Floats,
    sights: Floats,
    K: Floats,
    spread: Floats,
) -> None:
    """Fill in gains and standard deviations, `K` and `spread` of `gains`.

    Parameters
    ----------
    scale, noise, integrals, blocks, drive, columns, step_s
        As given to it.
    keep
        From `kept`.
    P, Q, turned, sights
        Zeros, S columns of which are used: covariance, what enters over a step, room for P, shape (S, S or more), and for what
        a channel sees, shape (c, S or more). The columns beyond stay zero; loops take them along where that makes them as long
        as is known when they are compiled.
    K, spread
        Shapes (n, c, S) and (n, c).
    """
    n, c, s = columns.shape
    S, h, known, width = CHANNEL_STATES * c + s, step_s, 0 if integrals == 2 else 1, P.shape[1]
    for j in range(c):
        i = CHANNEL_STATES * j
        vague = (1e3 * scale[j]) ** 2
        P[i + known, i + known] = vague
        if integrals == 2:
            P[i + 1, i + 1] = vague / (h * h)
        wrong, rate = noise[j, 1] ** 2, (noise[j, 1] / noise[j, 2]) ** 2
        pushed = noise[j, 3] ** 2
        P[i + 2, i + 2], P[i + 3, i + 3], P[i + 4, i + 4] = wrong, rate, pushed
        a, b, d, e, f = keep[j, 0], keep[j, 1], keep[j, 2], keep[j, 3], keep[j, 4]
        Q[i + 2, i + 2] = wrong - a * a * wrong - b * b * rate
        Q[i + 3, i + 3] = rate - d * d * wrong - e * e * rate
        Q[i + 2, i + 3] = Q[i + 3, i + 2] = -a * d * wrong - b * e * rate
        Q[i + 4, i + 4] = (1.0 - f * f) * pushed
    for i in range(s):
        for m in range(s):
            P[CHANNEL_STATES * c + i, CHANNEL_STATES * c + m] = drive[1, i, m]
            Q[CHANNEL_STATES * c + i, CHANNEL_STATES * c + m] = drive[0, i, m]
    for k in range(n):
        # One measurement after the other; what the ones before have told is taken off the rows that the next one looks at.
        for j in range(c):
            at, wrong_ = CHANNEL_STATES * j + known, CHANNEL_STATES * j + 2
            for i in range(width):
                sights[j, i] = P[at, i] + P[wrong_, i]
            for before in range(j):
                gain = K[k, before, at] + K[k, before, wrong_]
                for i in range(width):
                    sights[j, i] -= gain * sights[before, i]
            variance = sights[j, at] + sights[j, wrong_] + noise[j, 0] * noise[j, 0]
            spread[k, j] = np.sqrt(variance)
            for i in range(S):
                # NumPy's division does not look for zeros, at which a loop could not be vectorised.
                K[k, j, i] = np.divide(sights[j, i], variance)
        if c == 3:
            for i in range(S):
                first, second, third = K[k, 0, i], K[k, 1, i], K[k, 2, i]
                for m in range(width):
                    P[i, m] = P[i, m] - first * sights[0, m] - second * sights[1, m] - third * sights[2, m]
        else:
            for i in range(S):
                for j in range(c):
                    gain = K[k, j, i]
                    for m in range(width):
                        P[i, m] -= gain * sights[j, m]
        # F P F' by moving the columns, then the rows: P is symmetric.
        move_on(P, width, keep, blocks, columns, k, h)
        for i in range(S):
            for m in range(S):
                turned[m, i] = P[i, m]
        move_on(turned, width, keep, blocks, columns, k, h)
        for i in range(S):
            for m in range(width):
                P[i, m] = turned[i, m] + Q[i, m]
        for i in range(S):
            for m in range(i):
                P[m, i] = P[i, m]
        if s == 0 and k > 0:
            change, largest = 0.0, 0.0
            for j in range(c):
                for i in range(S):
                    change = max(change, abs(K[k, j, i] - K[k - 1, j, i]))
                    largest = max(largest, abs(K[k, j, i]))
            if change < CONVERGED * largest:
                for rest in range(k + 1, n):
                    for j in range(c):
                        spread[rest, j] = spread[k, j]
                        for i in range(S):
                            K[rest, j, i] = K[k, j, i]
                break


@compiled
def _errors_of_few(
    K: Floats,
    spread: Floats,
    noise: Floats,
    integrals: int,
    blocks: Floats,
    columns: Floats,
    step_s: float,
    series: Floats,
) -> Floats:
    """Return `errors` of fewer series than there are states: loops over the states are longer then."""
    n, c, q = series.shape
    s = blocks.shape[0]
    S = CHANNEL_STATES * c + s
    h, half = step_s, 0.5 * step_s * step_s
    known = 0 if integrals == 2 else 1
    keep = kept(noise, step_s)
    scratch = np.empty(s)
    out = np.empty((n, c, q))
    for m in range(q):
        x = np.zeros(S)
        for k in range(n):
            for j in range(c):
                error = series[k, j, m] - x[CHANNEL_STATES * j + known] - x[CHANNEL_STATES * j + 2]
                out[k, j, m] = error / spread[k, j]
                for i in range(S):
                    x[i] += K[k, j, i] * error
            for j in range(c):
                # As `move_on`.
                i = CHANNEL_STATES * j
                place, speed, wrong, rate, push = x[i], x[i + 1], x[i + 2], x[i + 3], x[i + 4]
                more = speed + h * push
                for b in range(s):
                    pushed = columns[k, j, b] * x[CHANNEL_STATES * c + b]
                    place += half * pushed
                    more += h * pushed
                x[i], x[i + 1] = place + (h * speed + half * push), more
                x[i + 2] = keep[j, 0] * wrong + keep[j, 1] * rate
                x[i + 3] = keep[j, 2] * wrong + keep[j, 3] * rate
                x[i + 4] = keep[j, 4] * push
            for i in range(s):
                scratch[i] = 0.0
                for b in range(s):
                    scratch[i] += blocks[i, b] * x[CHANNEL_STATES * c + b]
            for i in range(s):
                x[CHANNEL_STATES * c + i] = scratch[i]
    return out


@compiled
def _errors_of_many(
    K: Floats,
    spread: Floats,
    noise: Floats,
    integrals: int,
    blocks: Floats,
    columns: Floats,
    step_s: float,
    series: Floats,
) -> Floats:
    """Return `errors` of many series."""
    n, c, q = series.shape
    s = blocks.shape[0]
    S = CHANNEL_STATES * c + s
    known = 0 if integrals == 2 else 1
    keep = kept(noise, step_s)
    x, error = np.zeros((S, q)), np.empty(q)
    out, begun = np.zeros((n, c, q)), 0
    for k in range(n):
        begun = begun_by(series, k, begun)
        for j in range(c):
            at, wrong = CHANNEL_STATES * j + known, CHANNEL_STATES * j + 2
            for m in range(begun):
                error[m] = series[k, j, m] - x[at, m] - x[wrong, m]
                out[k, j, m] = error[m] / spread[k, j]
            for i in range(S):
                gain = K[k, j, i]
                for m in range(begun):
                    x[i, m] += gain * error[m]
        move_on(x, begun, keep, blocks, columns, k, step_s)
    return out


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
    of_series = _errors_of_few if series.shape[2] <= FEW else _errors_of_many
    return of_series(K, spread, noise, integrals, blocks, columns, step_s, series)


@borrowing
def begun_by(series: Floats, k: int, begun: int) -> int:
    """Return how many of the series, shape (n, c, q), have begun by a row: all up to the last that is not zero there.

    One that has not, as of a candidate that acts later, has nothing to predict.
    """
    for m in range(series.shape[2] - 1, begun - 1, -1):
        for j in range(series.shape[1]):
            if series[k, j, m] != 0.0:
                return m + 1
    return begun


@compiled
def summed(gaps: Floats, integrals: int, step_s: float) -> Floats:
    """Return accelerations, shape (n, c, q), as the velocities that they sum up to, or the positions with two integrals."""
    n, c, q = gaps.shape
    out, speed, place = np.empty((n, c, q)), np.zeros((c, q)), np.zeros((c, q))
    for k in range(n):
        for j in range(c):
            for m in range(q):
                speed[j, m] += gaps[k, j, m]
                moved = speed[j, m] * step_s
                if integrals == 2:
                    place[j, m] += moved
                    moved = place[j, m] * step_s
                out[k, j, m] = moved
    return out


def gains_alone(
    scale: Floats, noise: Floats, integrals: int, step_s: float, runs: Ints, n: int
) -> tuple[Floats, Floats]:
    """Return `gains` of channels that share no disturbance, in all series of a trial.

    Parameters
    ----------
    scale, noise, integrals, step_s
        As given to `gains`, of c channels.
    runs
        First row of every series and the one after its last, shape (runs, 2).
    n
        Rows of all series.

    Returns
    -------
    ndarray
        Gains of each channel's own states, shape (n, c, 5).
    ndarray
        Standard deviation of every prediction, shape (n, c).
    """
    c, longest = len(noise), int(np.max(runs[:, 1] - runs[:, 0], initial=0))
    blocks, drive, columns = np.empty((0, 0)), np.empty((2, 0, 0)), np.empty((longest, 1, 0))
    K, spread = np.zeros((n, c, CHANNEL_STATES)), np.ones((n, c))
    for j in range(c):
        # Every series begins alike: the longest has the gains of all.
        own, scales = gains(scale[j : j + 1], noise[j : j + 1], integrals, blocks, drive, columns, step_s)
        for first, end in runs.tolist():
            K[first:end, j], spread[first:end, j] = own[: end - first, 0], scales[: end - first, 0]
    return K, spread


Followed = tuple[tuple[float, float], float, float, float, float, float]
"""What a channel's accelerations sum up to, as a velocity and as a position, and the five states of its filter."""


@borrowing
def _followed(
    state: Followed,
    gap: float,
    K: Floats,
    k: int,
    j: int,
    keep: Floats,
    integrals: int,
    h: float,
    half: float,
) -> tuple[Followed, float]:
    """Return the states of a channel one step later, and the prediction error, of its acceleration in that step."""
    (reached, way), p, v, w, r, u = state
    reached += gap
    there = reached * h
    if integrals == 2:
        way += there
        there = way * h
    error = there - (p if integrals == 2 else v) - w
    p += K[k, j, 0] * error
    v += K[k, j, 1] * error
    w += K[k, j, 2] * error
    r += K[k, j, 3] * error
    u += K[k, j, 4] * error
    p += h * v + half * u
    v += h * u
    w, r = keep[j, 0] * w + keep[j, 1] * r, keep[j, 2] * w + keep[j, 3] * r
    return ((reached, way), p, v, w, r, keep[j, 4] * u), error


@compiled
def whitened_alone(
    gaps: Floats, runs: Ints, K: Floats, spread: Floats, noise: Floats, integrals: int, step_s: float
) -> Floats:
    """Return whitened prediction errors of accelerations in channels that share no disturbance.

    `errors` of what they are `summed` up to, in one pass, channel by channel and many times as fast; those of the first steps
    of every series, which only tell where it starts, are zero.

    Parameters
    ----------
    gaps
        Shape (n, c, q).
    runs, K, spread
        As given to `gains_alone`, and from it.
    noise, integrals, step_s
        As given to it.

    Returns
    -------
    ndarray
        Shape (n, c, q).
    """
    n, c, q = gaps.shape
    out, keep = np.zeros((n, c, q)), kept(noise, step_s)
    h, half = step_s, 0.5 * step_s * step_s
    if q == 1:
        # States that stay in registers; of three channels side by side, as each step of one waits for the step before.
        rest = ((0.0, 0.0), 0.0, 0.0, 0.0, 0.0, 0.0)
        for run in range(runs.shape[0]):
            first = runs[run, 0]
            if c == 3:
                one, two, three = rest, rest, rest
                for k in range(first, runs[run, 1]):
                    one, error = _followed(one, gaps[k, 0, 0], K, k, 0, keep, integrals, h, half)
                    two, other = _followed(two, gaps[k, 1, 0], K, k, 1, keep, integrals, h, half)
                    three, third = _followed(three, gaps[k, 2, 0], K, k, 2, keep, integrals, h, half)
                    if k >= first + DIFFUSE:
                        out[k, 0, 0], out[k, 1, 0] = error / spread[k, 0], other / spread[k, 1]
                        out[k, 2, 0] = third / spread[k, 2]
                continue
            for j in range(c):
                one = rest
                for k in range(first, runs[run, 1]):
                    one, error = _followed(one, gaps[k, j, 0], K, k, j, keep, integrals, h, half)
                    if k >= first + DIFFUSE:
                        out[k, j, 0] = error / spread[k, j]
        return out
    series, total, moved = np.empty(q), np.empty(q), np.empty(q)
    place, speed, wrong, rate, push = np.empty(q), np.empty(q), np.empty(q), np.empty(q), np.empty(q)
    for run in range(runs.shape[0]):
        first = runs[run, 0]
        for j in range(c):
            a, b, d, e, fade = keep[j, 0], keep[j, 1], keep[j, 2], keep[j, 3], keep[j, 4]
            for m in range(q):
                total[m], moved[m], place[m], speed[m] = 0.0, 0.0, 0.0, 0.0
                wrong[m], rate[m], push[m] = 0.0, 0.0, 0.0
            begun = 0
            for k in range(first, runs[run, 1]):
                # One that has not begun, as of a candidate that acts later, has nothing to predict.
                for m in range(q - 1, begun - 1, -1):
                    if gaps[k, j, m] != 0.0:
                        begun = m + 1
                        break
                for m in range(begun):
                    total[m] += gaps[k, j, m]
                    series[m] = total[m] * h
                if integrals == 2:
                    for m in range(begun):
                        moved[m] += series[m]
                        series[m] = moved[m] * h
                to_place, to_speed, to_wrong, to_rate, to_push = (
                    K[k, j, 0],
                    K[k, j, 1],
                    K[k, j, 2],
                    K[k, j, 3],
                    K[k, j, 4],
                )
                share = spread[k, j]
                for m in range(begun):
                    # Read all, then write all: only so is this loop vectorised.
                    p, v, w, r, u = place[m], speed[m], wrong[m], rate[m], push[m]
                    error = series[m] - (p if integrals == 2 else v) - w
                    series[m] = error / share
                    v, w, r, u = v + to_speed * error, w + to_wrong * error, r + to_rate * error, u + to_push * error
                    place[m] = p + to_place * error + (h * v + half * u)
                    speed[m] = v + h * u
                    wrong[m] = a * w + b * r
                    rate[m] = d * w + e * r
                    push[m] = fade * u
                if k >= first + DIFFUSE:
                    for m in range(begun):
                        out[k, j, m] = series[m]
    return out


def gains_together(
    scale: Floats,
    noise: Floats,
    integrals: int,
    blocks: Floats,
    drive: Floats,
    columns: Floats,
    step_s: float,
    runs: Ints,
) -> tuple[Floats, Floats]:
    """Return `gains` of channels that share disturbances, in all series of a trial.

    Parameters
    ----------
    scale, noise, integrals, blocks, drive, columns, step_s
        As given to `gains`, of all rows.
    runs
        First row of every series and the one after its last, shape (runs, 2).

    Returns
    -------
    ndarray
        Gains, shape (n, c, S).
    ndarray
        Standard deviation of every prediction, shape (n, c).
    """
    n, c, s = columns.shape
    K, spread = np.zeros((n, c, CHANNEL_STATES * c + s)), np.ones((n, c))
    for first, end in runs.tolist():
        K[first:end], spread[first:end] = gains(scale, noise, integrals, blocks, drive, columns[first:end], step_s)
    return K, spread


def whitened_together(
    gaps: Floats,
    runs: Ints,
    K: Floats,
    spread: Floats,
    noise: Floats,
    integrals: int,
    blocks: Floats,
    columns: Floats,
    step_s: float,
) -> Floats:
    """Return whitened prediction errors of accelerations, shape (n, c, q); as `whitened_alone`, of all channels together.

    Parameters
    ----------
    gaps
        Shape (n, c, q).
    runs, noise, integrals, blocks, columns, step_s
        As given to `gains_together`.
    K, spread
        From it.
    """
    out = np.zeros(gaps.shape)
    for first, end in runs.tolist():
        series = summed(gaps[first:end], integrals, step_s)
        given = K[first:end], spread[first:end], noise, integrals, blocks, columns[first:end], step_s, series
        out[first + DIFFUSE : end] = errors(*given)[DIFFUSE:]
    return out


def predictions_alone(
    scale: Floats, noises: Floats, integrals: int, step_s: float, gaps: Floats, runs: Ints
) -> tuple[Floats, Floats]:
    """Return whitened prediction errors of channels with the same noise, and their scale, under each of several noises.

    Parameters
    ----------
    scale, integrals, step_s
        As given to `gains`.
    noises
        Each as given to it, shape (p, 5).
    gaps
        Accelerations, shape (n, 1, q).
    runs
        First row of every series and the one after its last, shape (runs, 2).

    Returns
    -------
    ndarray
        Whitened errors, shape (p, n, q); those of the first steps of every series, which only tell where it starts, are zero.
    ndarray
        Logarithm of the standard deviation of every prediction, shape (p, n, q); zero for the first steps.
    """
    n, q = gaps.shape[0], gaps.shape[2]
    whitened, log_scales = np.empty((len(noises), n, q)), np.zeros((len(noises), n, q))
    for i in range(len(noises)):
        noise = noises[i : i + 1]
        K, spread = gains_alone(scale, noise, integrals, step_s, runs, n)
        whitened[i] = whitened_alone(gaps, runs, K, spread, noise, integrals, step_s)[:, 0]
        log_scales[i] = _log_scales(spread[:, 0], runs)[:, None]
    return whitened, log_scales


@compiled
def _log_scales(spread: Floats, runs: Ints) -> Floats:
    """Return the logarithm of standard deviations, shape (n,), zero for the first steps of every series."""
    out = np.zeros(spread.shape[0])
    for run in range(runs.shape[0]):
        last, size = 0.0, 0.0
        for k in range(runs[run, 0] + DIFFUSE, runs[run, 1]):
            # Most are alike.
            if spread[k] != last:
                last = spread[k]
                size = np.log(last)
            out[k] = size
    return out
