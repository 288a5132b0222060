"""Which frequencies errors have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ferryid.diagnose.evidence import force_errors
from ferryid.diagnose.hypothesis import Trial
from ferryid.diagnose.weak import Windows, windows
from ferryid.effects.picture import Picture, Scene
from ferryid.vessel.profile import Floats

FINE = 8
"""The spectrum's windows are this much shorter than those of the fit, as they must not hide what is fast."""
BANDS_HZ = (0.0, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2)


@dataclass(frozen=True)
class Band:
    """One frequency band: power of the force error before and after by axis, shape (3,) [N², N², N²m²]."""

    low_hz: float
    high_hz: float
    before: Floats
    after: Floats


def bands_of(trial: Trial, pictures: Sequence[Picture], scene: Scene | None) -> tuple[Band, ...]:
    """Return the power of the force errors in frequency bands, by windows short enough to let them through.

    The weight of a window of length T passes frequencies up to about 1/T; the power of each is that of the filtered error.
    """
    full = trial.windows.scene if scene is None else scene
    length_s = len(trial.windows.weight) * trial.windows.scene.step_s / FINE
    step_s = trial.windows.scene.step_s
    short = windows(full, max(length_s, 8.0 * step_s), step_s)
    spectra = [_spectrum(short, force_errors(short, picture, trial.plain)) for picture in pictures]
    if not spectra[0][0].size:
        return ()
    frequency = spectra[0][0]
    edges = [edge for edge in BANDS_HZ if edge < frequency[-1]] + [float(frequency[-1])]
    bands = []
    for low, high in pairwise(edges):
        inside = (frequency > low) & (frequency <= high)
        if inside.any():
            bands.append(Band(low, high, *(power[inside].sum(axis=0) for _, power in spectra)))
    return tuple(bands)


def _spectrum(short: Windows, errors: Floats) -> tuple[Floats, Floats]:
    """Return frequencies [Hz] and power of each, shapes (f,) and (f, 3), from stretches of equal length, half overlapping."""
    longest = max((b - a for a, b in short.runs), default=0)
    size = min(longest, 512)
    if size < 16:
        return np.empty(0), np.empty((0, 3))
    step_s = float(np.median(np.diff(short.starts))) * short.scene.step_s
    taper = np.sin(np.pi * (np.arange(size) + 0.5) / size)[:, None]
    total, count = np.zeros((size // 2 + 1, 3)), 0
    for a, b in short.runs:
        for first in range(a, b - size + 1, size // 2):
            part = errors[first : first + size]
            total += np.abs(np.fft.rfft(taper * part, axis=0)) ** 2
            count += 1
    power = 2.0 * total / (count * size * float((taper**2).sum()))
    return np.asarray(np.fft.rfftfreq(size, step_s)), power
