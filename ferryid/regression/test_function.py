"""The test function of the weak form: a weight that moves derivatives from a noisy signal onto itself.

It and its first three derivatives vanish at both ends of a window, so that ``∫ w p'' = ∫ w'' p`` for a position and
``∫ w nu' = -∫ w' nu`` for a velocity: no measured signal is differentiated.

References
----------
Shinbrot (1957); Messenger and Bortz (2021), Weak SINDy, for the choice of test functions.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ferryid.types import Floats, Ints

STRIDES = 2
"""Windows begin this often in the length of one: neighbours then share little, and no row is lost."""
_CHUNK_WINDOWS = 4096


def window_rows(length_s: float, rate_hz: float) -> int:
    """Return the number of rows of a window of a length [s]: 4 at least."""
    return max(4, round(length_s * rate_hz))


def window_weights(m: int, step_s: float) -> tuple[Floats, Floats, Floats]:
    """Return w = sin^4 [1/s] of integral one, w' and w'' in the middle of m rows that share a window, shape (m,) each."""
    x = (np.arange(m) + 0.5) / m
    T = m * step_s
    sine, cosine = np.sin(pi * x), np.cos(pi * x)
    weight = sine**4
    scale = 1.0 / (weight.sum() * step_s)
    slope = 4.0 * sine**3 * cosine * (pi / T)
    bend = (12.0 * sine**2 * cosine**2 - 4.0 * sine**4) * (pi / T) ** 2
    return scale * weight, scale * slope, scale * bend


def window_starts(stretches: Sequence[slice], m: int) -> tuple[Ints, Ints]:
    """Return the first row of every window of m rows that lies wholly within an unbroken stretch, and the stretch's number."""
    starts, numbers = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for number, stretch in enumerate(stretches):
        starts.append(np.arange(stretch.start, stretch.stop - m + 1, max(1, m // STRIDES)))
        numbers.append(np.full(len(starts[-1]), number))
    return np.concatenate(starts), np.concatenate(numbers)


def window_sums(values: Floats, weights: Floats, starts: Ints) -> Floats:
    """Return the sum of m rows times m weights from every start on, shape (J, c), of values with c columns."""
    out = np.empty((len(starts), values.shape[1]))
    if len(starts):
        windows = sliding_window_view(values, len(weights), axis=0)
        for low in range(0, len(starts), _CHUNK_WINDOWS):
            chunk = starts[low : low + _CHUNK_WINDOWS]
            out[low : low + len(chunk)] = windows[chunk] @ weights
    return out
