"""The test function of the weak form: a weight that moves derivatives from a noisy signal onto itself.

It and its first three derivatives vanish at both ends of a window, so that ``∫ w p'' = ∫ w'' p`` for a position and
``∫ w nu' = -∫ w' nu`` for a velocity: no measured signal is differentiated.

References
----------
Shinbrot (1957); Messenger and Bortz (2021), Weak SINDy, for the choice of test functions.
"""

from __future__ import annotations

from math import pi

import numpy as np

from ferryid.types import Floats


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
