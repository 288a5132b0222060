"""A sea of waves as a sum of sines: which frequencies, and how high, from a JONSWAP spectrum."""

from __future__ import annotations

from math import exp, log, pi, sqrt

import numpy as np

from ferryid.compiled import borrowing, compiled
from ferryid.types import Floats

LOWEST, HIGHEST = 0.4, 5.0
"""Frequencies that hold the energy, as multiples of the peak's: less than 1e-20 lies below, 0.2 % above."""
INTERVALS = 4600


@borrowing
def jonswap(share: float, gamma: float) -> float:
    """Return the spectral density, but for a constant factor, at a share of the peak frequency.

    References
    ----------
    Hasselmann et al. (1973); Fossen (2021), section 10.2.
    """
    width = 0.07 if share <= 1.0 else 0.09
    beside = (share - 1.0) / width
    s2 = share * share
    return exp(-1.25 / (s2 * s2) + log(gamma) * exp(-0.5 * beside * beside)) / (s2 * s2 * share)


@compiled
def equal_shares(gamma: float, places: Floats) -> Floats:
    """Return one frequency out of each of n parts of the spectrum with the same energy, as multiples of the peak's.

    Parameters
    ----------
    gamma
        Peakedness.
    places
        Where in its part each frequency lies, by energy, between 0 and 1, shape (n,).
    """
    step = (HIGHEST - LOWEST) / INTERVALS
    below = np.zeros(INTERVALS + 1)
    before = jonswap(LOWEST, gamma)
    for i in range(INTERVALS):
        after = jonswap(LOWEST + (i + 1) * step, gamma)
        below[i + 1] = below[i] + 0.5 * step * (before + after)
        before = after
    n = len(places)
    shares = np.empty(n)
    i = 0
    for j in range(n):
        energy = (j + places[j]) / n * below[INTERVALS]
        while below[i + 1] < energy and i < INTERVALS - 1:
            i += 1
        shares[j] = LOWEST + step * (i + (energy - below[i]) / (below[i + 1] - below[i]))
    return shares


def components(height_m: float, period_s: float, gamma: float, places: Floats) -> tuple[Floats, float]:
    """Return frequencies [1/s], shape (n,), and the one amplitude [m] of all components of a sea.

    Each carries the same energy, so the significant height ``4 sqrt(m0)`` is exact for any number of them. Their
    frequencies have no common spacing, so the sea does not repeat itself within a trial.
    """
    return equal_shares(gamma, places) / period_s, height_m * sqrt(2.0 / len(places)) / 4.0


def deep_water(frequency_hz: float, gravity: float) -> float:
    """Return the wave number in deep water [rad/m]."""
    omega = 2.0 * pi * frequency_hz
    return omega * omega / gravity
