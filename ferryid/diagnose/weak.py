"""The weak form: equations of motion averaged over windows, so that no noisy signal is ever differentiated.

A window's weight w and its first derivatives vanish at both ends, so that integration by parts moves every derivative
onto w: ``∫ w p'' = ∫ w'' p`` for a position, ``∫ w nu' = -∫ w' nu`` for a velocity. Both are compared with the acceleration that
a picture of the forces gives, averaged with the same weight: six numbers a window.

References
----------
Shinbrot (1957); Messenger and Bortz (2021), Weak SINDy, for the choice of test functions.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from ferryid.effects.picture import Picture, Scene, acceleration
from ferryid.vessel.profile import Floats

CHANNELS = ("north", "east", "heading", "surge", "sway", "yaw rate")
"""Where the measured acceleration comes from: second derivative of the first three, first of the others."""


@dataclass(frozen=True)
class Windows:
    """Windows of a scene.

    Attributes
    ----------
    scene
        What was measured.
    starts
        First row of every window, shape (J,); every window lies in measured data.
    runs
        Windows of an unbroken series, as (first, end) of `starts`.
    weight, slope, bend
        w [1/s], w' and w'' on the rows of a window, shape (m,).
    measured
        Measured accelerations in the order of `CHANNELS`, shape (J, 6).
    channels
        Which of them there are: positions may be missing, shape (6,).
    """

    scene: Scene
    starts: NDArray[np.int64]
    runs: tuple[tuple[int, int], ...]
    weight: Floats
    slope: Floats
    bend: Floats
    measured: Floats
    channels: NDArray[np.bool_]

    @property
    def middle_s(self) -> Floats:
        """Time of the middle of every window [s], shape (J,)."""
        return self.scene.t[self.starts] + 0.5 * (len(self.weight) - 1) * self.scene.step_s

    def mean(self, values: Floats, weight: Floats | None = None) -> Floats:
        """Return ``∫ w f dt`` in every window, shape (J,) or (J, c), of values with n rows."""
        chosen = self.weight if weight is None else weight
        view = np.lib.stride_tricks.sliding_window_view(values, len(chosen), axis=0)[self.starts]
        return np.asarray(view @ chosen) * self.scene.step_s

    def gap(self, picture: Picture) -> Floats:
        """Return the picture's acceleration less the measured one in every window, shape (J, channels)."""
        scene = self.scene
        rates = acceleration(picture)
        u, v, r = scene.nu.T
        c, s = np.cos(scene.psi), np.sin(scene.psi)
        ahead, across = rates[:, 0] - r * v, rates[:, 1] + r * u
        north, east = c * ahead - s * across, s * ahead + c * across
        all_six = np.column_stack([north, east, rates[:, 2], rates])
        return (self.mean(all_six) - self.measured)[:, self.channels]


def windows(scene: Scene, length_s: float, stride_s: float) -> Windows:
    """Return windows of `length_s` every `stride_s` seconds, as many as lie wholly in measured data.

    The weight is ``sin^4``: it and its first three derivatives vanish at the ends.
    """
    dt = scene.step_s
    m = round(length_s / dt) + 1
    x = np.arange(m) / (m - 1)
    T = (m - 1) * dt
    sine, cosine = np.sin(pi * x), np.cos(pi * x)
    weight = sine**4
    scale = 1.0 / (weight.sum() * dt)
    slope = 4.0 * sine**3 * cosine * (pi / T)
    bend = (12.0 * sine**2 * cosine**2 - 4.0 * sine**4) * (pi / T) ** 2
    weight, slope, bend = scale * weight, scale * slope, scale * bend
    stride = max(1, round(stride_s / dt))
    starts: list[int] = []
    runs: list[tuple[int, int]] = []
    for first, end in _stretches(scene.usable):
        before = len(starts)
        starts += range(first, end - m + 1, stride)
        if len(starts) > before:
            runs.append((before, len(starts)))
    known = np.isfinite(scene.eta[scene.usable, :2]).all() if scene.usable.any() else False
    channels = np.array([known, known, True, True, True, True])
    empty = Windows(scene, np.array(starts, dtype=np.int64), tuple(runs), weight, slope, bend, np.empty((0, 6)), channels)
    eta = np.where(np.isfinite(scene.eta), scene.eta, 0.0)
    measured = np.hstack([empty.mean(eta, bend), -empty.mean(scene.nu_raw, slope)])
    return Windows(scene, empty.starts, empty.runs, weight, slope, bend, measured, channels)


def _stretches(usable: NDArray[np.bool_]) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], usable, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
