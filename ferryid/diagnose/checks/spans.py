"""Windows for the checks, at the full rate of the measurements; `ferryid.diagnose.weak` has those for forces."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from ferryid.effects.picture import Scene
from ferryid.vessel.profile import Floats

LENGTH_S, STRIDE_S = 8.0, 2.0


@dataclass(frozen=True)
class Spans:
    """Windows that lie wholly in measured data.

    Attributes
    ----------
    starts
        First row of every window, shape (J,).
    middle_s
        Time of its middle [s], shape (J,).
    weight, slope, bend
        ``sin^4`` of unit area and its first two derivatives [1/s, 1/s², 1/s³], shape (m,).
    step_s
        Distance of two rows [s].
    """

    starts: NDArray[np.int64]
    middle_s: Floats
    weight: Floats
    slope: Floats
    bend: Floats
    step_s: float

    def mean(self, values: Floats) -> Floats:
        """Return ``∫ w f``, shape (J,) or (J, c)."""
        return self._sum(values, self.weight)

    def rate(self, values: Floats) -> Floats:
        """Return ``∫ w f' = -∫ w' f``, shape (J,) or (J, c)."""
        return -self._sum(values, self.slope)

    def curvature(self, values: Floats) -> Floats:
        """Return ``∫ w f'' = ∫ w'' f``, shape (J,) or (J, c)."""
        return self._sum(values, self.bend)

    def _sum(self, values: Floats, weight: Floats) -> Floats:
        rows = np.lib.stride_tricks.sliding_window_view(values, len(weight), axis=0)[self.starts]
        return np.asarray(rows @ weight) * self.step_s


def spans(scene: Scene, needed: Floats) -> Spans:
    """Return the windows of a scene in which all of `needed`, shape (n,) or (n, c), is finite and usable."""
    dt = scene.step_s
    m = max(8, round(LENGTH_S / dt))
    x = (np.arange(m) + 0.5) / m
    T = m * dt
    sine, cosine = np.sin(pi * x), np.cos(pi * x)
    weight = sine**4
    scale = 1.0 / (weight.sum() * dt)
    slope = 4.0 * sine**3 * cosine * (pi / T)
    bend = (12.0 * sine**2 * cosine**2 - 4.0 * sine**4) * (pi / T) ** 2
    good = scene.usable & np.isfinite(needed.reshape(len(needed), -1)).all(axis=1)
    until = np.concatenate([[0], np.cumsum(good)])
    starts = np.arange(0, len(good) - m + 1, max(1, round(STRIDE_S / dt)), dtype=np.int64)
    starts = starts[until[starts + m] - until[starts] == m]
    return Spans(starts, scene.t[starts] + 0.5 * (m - 1) * dt, scale * weight, scale * slope, scale * bend, dt)
