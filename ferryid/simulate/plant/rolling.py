"""Roll and pitch of the vessel in waves: two oscillators that follow the slope of the water."""

from __future__ import annotations

from math import cos, exp, sin, sqrt

import numpy as np

from ferryid.compiled import borrowing
from ferryid.simulate.plant.waves import GRAVITY, Sea, slopes
from ferryid.types import Floats

ROLL_DAMPING, PITCH_DAMPING = 0.1, 0.3
"""Usual shares of the critical damping."""
ROLL_RADIUS, PITCH_RADIUS = 0.4, 0.3
"""Radii of gyration with added mass, as shares of beam and length; Faltinsen (1990), Sea Loads, ch. 3."""


def natural_frequency(length_m: float, draught_m: float, radius_m: float) -> float:
    """Return the frequency [rad/s] at which a box swings about its waterplane: ``sqrt(g GM) / k``.

    GM is taken as BM, ``length_m`` squared over ``12 T``: the centre of gravity lies about as high above the waterline as that
    of buoyancy below it, and both little against BM for a wide hull of small draught.

    Parameters
    ----------
    length_m
        Length of the box across the axis of rotation [m].
    draught_m
        Draught [m].
    radius_m
        Radius of gyration with added mass [m].
    """
    return sqrt(GRAVITY * length_m * length_m / (12.0 * draught_m)) / radius_m


def roll_pitch(sea: Sea, t: Floats, eta: Floats) -> Floats:
    """Return roll (starboard down) and pitch (bow up), shape (n, 2) [rad].

    Parameters
    ----------
    sea
        Waves and wakes.
    t
        Uniform grid of times [s], shape (n,).
    eta
        North, east [m] and heading [rad], shape (n, 3).
    """
    attitude = np.zeros((len(t), 2))
    if len(sea.frequency) and len(t) > 1:
        L, B, T = sea.box
        frequencies = (natural_frequency(B, T, ROLL_RADIUS * B), natural_frequency(L, T, PITCH_RADIUS * L))
        _slopes_along(sea, t, eta, attitude)
        h = (float(t[-1]) - float(t[0])) / (len(t) - 1)
        for column, (omega, damping) in enumerate(zip(frequencies, (ROLL_DAMPING, PITCH_DAMPING), strict=True)):
            swing(attitude[:, column], omega, damping, h)
    return attitude


@borrowing
def _slopes_along(sea: Sea, t: Floats, eta: Floats, out: Floats) -> None:
    """Write the roll and the pitch of a hull that lies flat on the water, everywhere along the track."""
    for i in range(len(t)):
        forward, starboard = slopes(sea, t[i], eta[i, 0], eta[i, 1], eta[i, 2])
        out[i, 0], out[i, 1] = -starboard, forward


@borrowing
def swing(values: Floats, omega: float, damping: float, h: float) -> None:
    """Turn what drives an oscillator into its answer, in place; it starts at rest in equilibrium.

    ``a'' + 2 d w a' + w² a = w² s``, exact for an `s` that is linear between its samples.

    Parameters
    ----------
    values
        s at steps of h seconds, shape (n,); overwritten by a.
    omega, damping
        Natural frequency [rad/s] and share of the critical damping, below 1.
    h
        Step [s].
    """
    own = omega * sqrt(1.0 - damping * damping)
    decay = exp(-damping * omega * h)
    c, s = decay * cos(own * h), decay * sin(own * h)
    before = values[0]
    a, a_dot = before, 0.0
    for i in range(1, len(values)):
        drive = values[i]
        # Against a linear s the oscillator settles at s less a constant; what is left of the start decays.
        slope = (drive - before) / h
        behind = 2.0 * damping / omega * slope
        e, e_dot = a - before + behind, a_dot - slope
        quarter = (e_dot + damping * omega * e) / own
        a = drive - behind + e * c + quarter * s
        a_dot = slope + e_dot * c - (damping * omega * e_dot + omega * omega * e) / own * s
        values[i] = a
        before = drive
