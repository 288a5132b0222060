"""Steps of the heading that stay, though neither the measured yaw rate nor the rest of the log turns with them.

A compass that is aligned anew, or a receiver that changes the antenna it points with, moves its reference at once and for
good. The step is far smaller than what a vessel can turn in general, and shows against the integral of the yaw rate alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ferryid.signals.pose_limits import Samples, integral
from ferryid.signals.thresholds import SIGNALS
from ferryid.types import Floats


def heading_steps(samples: Samples) -> tuple[tuple[int, int, float], ...]:
    """Return time of the last sample before and of the first one after each step [ns], and its size [rad].

    Parameters
    ----------
    samples
        Canonical name to times and cleaned values; `psi` unwrapped, without what is known to be wrong, and `r`.
    """
    turning = integral(samples, "r")
    if turning is None or "psi" not in samples:
        return ()
    time_ns, psi = samples["psi"]
    apart = psi - turning(np.asarray(time_ns * 1e-9, dtype=np.float64))[0].real
    known = np.isfinite(apart)
    time_ns, apart = time_ns[known], apart[known]
    if time_ns.size < SIGNALS.step_samples:
        return ()
    time_s = (time_ns - time_ns[0]) * 1e-9
    period = float(np.median(np.diff(time_s)))
    side, within = max(3, round(SIGNALS.step_side_s / period)), max(1, round(SIGNALS.step_within_s / period))
    if time_s.size < 4 * side + within:
        return ()
    # The place between rows k - 1 and k, for k in `place`; a window of `within` rows on it holds the step.
    place = np.arange(side, time_s.size - side - within)
    means = _means(apart, side)
    change = means[place + within] - means[place - side]
    # Rows on both sides lie where they would without a gap.
    whole = time_s[place + within + side - 1] - time_s[place - side] < 2.0 * (2 * side + within) * period
    change = np.where(whole, change, 0.0)
    noise = 1.4826 * float(np.median(np.abs(change[whole]))) if whole.any() else 0.0
    large = np.abs(change) > max(SIGNALS.step_rad, SIGNALS.step_noises * noise)
    found = []
    edges = np.flatnonzero(np.diff(np.concatenate([[False], large, [False]]).astype(np.int8)))
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        peak = int(first + np.argmax(np.abs(change[first:last])))
        size = float(change[peak])
        inside = slice(int(place[peak]) - 1, int(place[peak]) + within + 1)
        steps = np.diff(apart[inside])
        if abs(float(steps.sum())) < SIGNALS.step_share * abs(size):
            continue
        rows = np.flatnonzero(np.abs(steps) > 0.1 * abs(size)) + inside.start
        if rows.size:
            found.append((int(time_ns[rows[0]]), int(time_ns[rows[-1] + 1]), size))
    return tuple(found)


def _means(values: Floats, rows: int) -> Floats:
    """Return the mean of `rows` values from each on, shape (n - rows + 1,)."""
    total: NDArray[np.float64] = np.concatenate([[0.0], np.cumsum(values)])
    return np.asarray((total[rows:] - total[:-rows]) / rows)
