"""How much one series tells of another that follows it: directed information, in nats.

Past prediction errors of a motion tell of the next forces only what a controller put in them, as nothing that is ordered makes
the wind blow. `ferryid.diagnose.inference.feedback` says what follows for delays and lags.

References
----------
Massey (1990), Causality, feedback and directed information; Massey and Massey (2005), Conservation of mutual and directed
information; Geweke (1982), Measurement of linear dependence and feedback between multiple time series; Anderson (2003), An
introduction to multivariate statistical analysis, section 8.5, for the factor of the likelihood ratio.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import inf, sqrt

import numpy as np
from numpy.typing import NDArray

from ferryid.signals.thresholds import SIGNALS
from ferryid.types import Floats

SAME = 1e-6
"""Share of the largest spread, or of its own before its past is taken off, below which a force does not vary by itself."""


def spans(doublings: int) -> tuple[tuple[int, int], ...]:
    """Return the first and last step of each span of the past whose mean is regressed on: the last one, and what doubles it."""
    return ((1, 1), *((2**k + 1, 2 ** (k + 1)) for k in range(doublings)))


LAGS = spans(SIGNALS.feedback_doublings)
"""Together they are about a window."""


@dataclass(frozen=True)
class Feedback:
    """What the forces of a log tell of its disturbances [nat], less what chance gains, and the standard error by chance."""

    nats: float
    error: float

    @property
    def high(self) -> float:
        """The upper end of its 95 % interval [nat]; infinite where a log is too short to tell."""
        return max(self.nats, 0.0) + 1.96 * self.error


def directed_information(errors: Floats, forces: Floats, runs: Iterable[tuple[int, int]]) -> Feedback:
    """Return how much past prediction errors tell of the next forces beyond what the forces' own past does.

    Parameters
    ----------
    errors
        White prediction errors of the motion, shape (J, c).
    forces
        Mean force of every step in any unit, shape (J, 3). Axes that vary only as others do count once, what follows from its
        own past tells nothing, and forces that never vary show no feedback and no delay.
    runs
        Unbroken series of steps, as (first, end).
    """
    series = [(first, end) for first, end in runs if end - first > LAGS[-1][1]]
    if not series:
        return Feedback(0.0, inf)
    forces = _directions(forces - forces.mean(axis=0), SAME * float(forces.std(axis=0).max()))
    rows, own = _past(forces, series)
    _, others = _past(errors, series)
    basis, _ = np.linalg.qr(np.column_stack([np.ones(len(own)), own]))
    left, beside = (one - basis @ (basis.T @ one) for one in (forces[rows], others))
    left = _directions(left, SAME)
    axes, more = left.shape[1], others.shape[1]
    # Anderson's factor: the likelihood ratio of few rows is too large by as much as the coefficients take up.
    weight = len(left) - basis.shape[1] - 0.5 * (more + axes + 1)
    if forces.shape[1] == 0 or weight <= basis.shape[1] + more:
        return Feedback(0.0, inf)
    if axes == 0:
        return Feedback(0.0, 0.0)
    told, _ = np.linalg.qr(beside)
    gained = _log_volume(left) - _log_volume(left - told @ (told.T @ left))
    return Feedback(0.5 * weight * gained - 0.5 * more * axes, sqrt(0.5 * more * axes))


def _directions(values: Floats, least: float) -> Floats:
    """Return values of zero mean along the directions in which they vary, of unit spread, shape (J, directions).

    Channels that vary by no more than `least` are none, nor are those that vary only as others do.
    """
    spread = values.std(axis=0)
    varied = values[:, spread > max(least, 1e-300)]
    if not varied.size:
        return np.empty((len(values), 0))
    along, sizes, _ = np.linalg.svd(varied / varied.std(axis=0), full_matrices=False)
    return np.asarray(along[:, sizes > SAME * sizes[0]] * sqrt(len(values)))


def _past(values: Floats, runs: Iterable[tuple[int, int]]) -> tuple[NDArray[np.bool_], Floats]:
    """Return which rows have a whole past, and the means of each span of it there, shape (rows, spans times channels).

    Every run is longer than the longest past.
    """
    longest, rows = LAGS[-1][1], np.zeros(len(values), dtype=np.bool_)
    found = []
    for first, end in runs:
        rows[first + longest : end] = True
        sums = np.vstack([np.zeros(values.shape[1]), np.cumsum(values[first:end], axis=0)])
        at = np.arange(longest, end - first)
        found.append(np.hstack([(sums[at - near + 1] - sums[at - far]) / (far - near + 1) for near, far in LAGS]))
    return rows, np.concatenate(found)


def _log_volume(left: Floats) -> float:
    return float(np.linalg.slogdet(left.T @ left)[1])
