"""Pulses of remote controls and speed controllers (PWM) as shares of full power or of full travel."""

from __future__ import annotations

import numpy as np

from ferryid.types import Floats

PULSE_LIMITS_US = (100.0, 5000.0)
"""Shortest and longest pulse that a profile may state [us]."""


def share_of_pulse(pulse_us: Floats, pulse: tuple[float, float, float, float]) -> Floats:
    """Return the share of full power, from -1 to 1, that pulses order.

    Within the dead band about neutral the share is zero, and from its edges on it grows in proportion; beyond the ends it is
    full. A pulse of zero is none: the output is off, and its share zero.

    Parameters
    ----------
    pulse_us
        Lengths of pulses [us], shape (n,).
    pulse
        Length at full astern, at neutral and at full ahead, and the dead band on each side of neutral [us]. Astern and neutral
        alike are of a controller that cannot reverse.

    Returns
    -------
    share
        Shape (n,), NaN where the pulse is NaN.
    """
    astern, neutral, ahead, dead = pulse
    beyond = np.sign(pulse_us - neutral) * np.maximum(np.abs(pulse_us - neutral) - dead, 0.0)
    span = np.where(beyond >= 0.0, ahead - neutral - dead, neutral - astern - dead)
    share = np.clip(np.where(span > 0.0, beyond / np.where(span > 0.0, span, 1.0), 0.0), -1.0, 1.0)
    return np.where(pulse_us <= 0.0, 0.0, share)


def pulse_of_share(share: Floats, pulse: tuple[float, float, float, float]) -> Floats:
    """Return the pulses [us] that order shares of full power from -1 to 1, shape (n,): the inverse of `share_of_pulse`."""
    astern, neutral, ahead, dead = pulse
    forward = neutral + dead + share * (ahead - neutral - dead)
    backward = neutral - dead + share * (neutral - astern - dead)
    return np.where(share > 0.0, forward, np.where(share < 0.0, backward, neutral))
