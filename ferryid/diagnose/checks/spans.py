"""Windows for the checks; `ferryid.diagnose.inference.weak_form` has those for forces."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import pi

import numpy as np
from numpy.typing import NDArray

from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.effects.force_model import Measurements
from ferryid.types import Floats

LENGTH_S, STRIDE_S = 8.0, 2.0
RATE_HZ = 5.0
"""Measurements are averaged down to this, all alike: windows are long against it."""


def least_off(step_s: float, least: float) -> float:
    """Return by how much a factor has to be off at least, in a log of rows so far apart [s]; `least` where they are near."""
    return least if step_s * CHECKS.window_samples <= LENGTH_S else CHECKS.sparse_scale


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
    stride
        Distance of two windows, in rows.
    """

    starts: NDArray[np.int64]
    middle_s: Floats
    weight: Floats
    slope: Floats
    bend: Floats
    step_s: float
    stride: int

    @property
    def place(self) -> NDArray[np.int64]:
        """Number of each window, in strides from the start, shape (J,)."""
        return np.asarray(self.starts // self.stride, dtype=np.int64)

    def only(self, chosen: NDArray[np.bool_]) -> Spans:
        """Return some of the windows."""
        return replace(self, starts=self.starts[chosen], middle_s=self.middle_s[chosen])

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


def spans(measurements: Measurements, needed: Floats, length_s: float = LENGTH_S) -> tuple[Spans, Floats]:
    """Return the windows in which all of some measurements are finite and usable, and these at `RATE_HZ`.

    Parameters
    ----------
    measurements
        Where they come from.
    needed
        Measurements, shape (n, c).
    length_s
        Length of a window [s]; longer ones lie farther apart, by as much.

    Returns
    -------
    Spans
        The windows.
    Floats
        Measurements, zero where not finite, shape (n', c).
    """
    return spans_of(float(measurements.t[0]), measurements.step_s, measurements.usable, needed, length_s)


def spans_of(
    first_s: float, step_s: float, usable: NDArray[np.bool_], needed: Floats, length_s: float = LENGTH_S
) -> tuple[Spans, Floats]:
    """Return the same of columns on any uniform grid, which starts at a time and has a step [s]."""
    every = max(1, round(1.0 / (RATE_HZ * step_s)))
    n = len(needed) // every
    thin = needed[: n * every].reshape(n, every, -1).mean(axis=1)
    good = usable[: n * every].reshape(n, every).all(axis=1) & np.isfinite(thin).all(axis=1)
    dt = step_s * every
    m = max(8, round(length_s / dt))
    x = (np.arange(m) + 0.5) / m
    T = m * dt
    sine, cosine = np.sin(pi * x), np.cos(pi * x)
    weight = sine**4
    scale = 1.0 / (weight.sum() * dt)
    slope = 4.0 * sine**3 * cosine * (pi / T)
    bend = (12.0 * sine**2 * cosine**2 - 4.0 * sine**4) * (pi / T) ** 2
    until = np.concatenate([[0], np.cumsum(good)])
    stride = max(1, round(STRIDE_S * length_s / LENGTH_S / dt))
    starts = np.arange(0, n - m + 1, stride, dtype=np.int64)
    starts = starts[until[starts + m] - until[starts] == m]
    middle_s = first_s + (starts + 0.5 * m) * dt - 0.5 * step_s
    found = Spans(starts, middle_s, scale * weight, scale * slope, scale * bend, dt, stride)
    return found, np.where(good[:, None], np.where(np.isfinite(thin), thin, 0.0), 0.0)
