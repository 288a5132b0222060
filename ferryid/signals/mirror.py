"""Frames of the wrong hand: positions, headings or velocities that are the mirror image of what the others say.

With positions as complex numbers p = north + i east and velocities as w = u + i v, ``dp = w exp(i psi) dt``. East taken for
north conjugates p up to a turn, a heading that counts the other way conjugates the exponential, and a y axis to port conjugates
w. A turn and a factor remain free in each, so that none of them is taken for a heading's bias, or for a unit.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ferryid.signals.thresholds import SIGNALS
from ferryid.types import Floats

Complex = NDArray[np.complex128]


SAYS = {
    "position": "The positions are mirrored against heading and velocity, as with north and east exchanged",
    "heading": "The heading turns the wrong way round against positions and velocity",
    "velocity": "The sway velocity has the wrong sign against positions and heading, as with y to port, or heading and "
    "positions are both mirrored",
}
"""What is mirrored, by the signal to look at first."""


def mirrored(eta: Floats, nu: Floats, usable: NDArray[np.bool_], rate_hz: float) -> tuple[str, str]:
    """Return which signal is of the wrong hand and a sentence that says so, empty where none certainly is.

    Parameters
    ----------
    eta
        Position north, east [m] and heading [rad], shape (n, 3), NaN where not measured.
    nu
        Surge and sway velocity over ground [m/s], shape (n, 2) or more.
    usable
        Rows that were measured, shape (n,).
    rate_hz
        Rows per second.
    """
    span = max(2, round(SIGNALS.mirror_span_s * rate_hz))
    good = usable & np.isfinite(eta).all(axis=1) & np.isfinite(nu[:, :2]).all(axis=1)
    starts = np.arange(0, len(good) - span, span)
    starts = starts[[bool(good[start : start + span + 1].all()) for start in starts]]
    if len(starts) < SIGNALS.mirror_spans:
        return "", ""
    # Sums run over the whole log: what was not measured counts as nothing there, and no span holds any of it.
    eta, nu = np.where(good[:, None], eta, 0.0), np.where(good[:, None], nu[:, :2], 0.0)
    place = eta[:, 0] + 1j * eta[:, 1]
    way = place[starts + span] - place[starts]
    if np.sqrt(np.mean(np.abs(way) ** 2)) < SIGNALS.mirror_way_m:
        return "", ""
    body = nu[:, 0] + 1j * nu[:, 1]
    pointing, mirrored_pointing = np.exp(1j * eta[:, 2]), np.exp(-1j * eta[:, 2])
    every = {"": body * pointing, "position": np.conj(body * pointing), "heading": body * mirrored_pointing}
    every["velocity"] = np.conj(body) * pointing
    # Water may carry the vessel, and the antenna may be elsewhere than what measures the velocity.
    free = np.column_stack([np.ones(len(starts)), pointing[starts + span] - pointing[starts]])
    fits = {name: _fit(way, _summed(values, starts, span), free) for name, values in every.items()}
    best = max(fits, key=lambda name: fits[name])
    if fits[best] < SIGNALS.mirror_correlation or SIGNALS.mirror_ratio * (1.0 - fits[best] ** 2) > 1.0 - fits[""] ** 2:
        return "", ""
    return best, f"{SAYS[best]} (correlation {fits[best]:.2f} so, {fits['']:.2f} as declared)."


def _summed(values: Complex, starts: NDArray[np.int64], span: int) -> Complex:
    total = np.concatenate([[0.0], np.cumsum(values)])
    return np.asarray(total[starts + span] - total[starts])


def _fit(one: Complex, other: Complex, free: Complex) -> float:
    """Return the size of the correlation of two complex series, what is free in both left out."""
    both = np.column_stack([one, other])
    a, b = (both - free @ np.linalg.lstsq(free, both, rcond=None)[0]).T
    return float(np.abs(np.vdot(a, b)) / max(np.linalg.norm(a) * np.linalg.norm(b), 1e-12))
