"""Whether the windows of the weak form are too long for a vessel: what it does within one is averaged out.

The usual length follows from the vessel's, by Froude's law. A light boat whose controller swings the bow about within seconds
answers its thrusters faster than that: of its yaw rate hardly anything is left in the windows, and what little is left is
explained by any inertia, or without the thrusters at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan

import numpy as np

from ferryid.effects.wording import listed
from ferryid.regression.test_function import window_starts, window_sums, window_weights
from ferryid.regression.thresholds import REGRESSION
from ferryid.signals.track import Motion, segments
from ferryid.types import AXES, Flags, Floats
from ferryid.vessel.dimensions import SHORTEST_WINDOW_S, window_seconds
from ferryid.vessel.profile import Profile

SHORTER = (0.5, 0.25)
"""Lengths that are tried instead, times the present one."""
VARIES = 1e-20
"""Of the squared mean: a variance below it is rounding."""


@dataclass(frozen=True)
class AveragedOut:
    """What windows of the vessel's usual length average out, and the length to state instead.

    Attributes
    ----------
    usual_s, window_s
        Length of the windows, and the one to state in the profile [s]; NaN where that is the usual one.
    shares
        What the usual ones keep, with its axis each.
    """

    usual_s: float
    window_s: float = nan
    shares: tuple[str, ...] = ()

    @property
    def kept(self) -> str:
        """How little is kept, as the end of a sentence."""
        return f"{listed(self.shares)} of the variance of the velocity"

    @property
    def says(self) -> tuple[str, ...]:
        """A sentence for a person; none where nothing is lost."""
        if not self.shares:
            return ()
        return (
            f"The vessel's windows of {self.usual_s:.3g} s, over which forces are averaged, are long for these manoeuvres: "
            f"they keep {self.kept}, so that little is seen of what the actuators do. At the top of "
            f"the profile, window_s = {self.window_s:.2g} keeps more, for every command.",
        )


def averaged_out(profile: Profile, motions: Sequence[Motion]) -> AveragedOut:
    """Return the axes whose motion windows average out, with the length to state.

    An axis counts where the windows keep less than `REGRESSION.least_kept` of the variance of its velocity, and of that of the
    force that its actuators put on it: either alone may be noise.

    Parameters
    ----------
    profile
        The vessel.
    motions
        Logs of it.
    """
    usual_s = window_seconds(profile)
    kept = kept_shares(motions, usual_s)
    # NaN, where no window fits, is neither.
    lost: Flags = np.max(kept, axis=0) < REGRESSION.least_kept
    nothing = AveragedOut(usual_s)
    if not lost.any():
        return nothing
    lengths = [share * usual_s for share in SHORTER if share * usual_s >= SHORTEST_WINDOW_S]
    tried = {length: kept_shares(motions, length).min(axis=0) for length in lengths}
    tried = {length: one for length, one in tried.items() if np.isfinite(one).all()}
    if not tried:
        return nothing
    better = [length for length, one in tried.items() if (one[lost] >= REGRESSION.least_kept).all()]
    length_s = max(better, default=min(tried))
    if np.any(tried[length_s][lost] < REGRESSION.shorter_keeps):
        # What is gone in shorter ones as well is noise.
        return nothing
    shares = (f"{100.0 * kept[0, k]:.0f} % in {axis}" for k, axis in enumerate(AXES) if lost[k])
    return AveragedOut(usual_s, length_s, tuple(shares))


def kept_shares(motions: Sequence[Motion], length_s: float) -> Floats:
    """Return the share of the variance of velocity, and of force, that means over windows keep, by axis, shape (2, 3).

    One where nothing varies, NaN where no window fits.
    """
    # Number, sum and sum of squares of the means and of the rows: of many logs, no copy of their rows is kept.
    totals = np.zeros((2, 3, 6))
    offset = np.zeros(6)
    for motion in motions:
        both = np.hstack([motion.nu, motion.tau])
        known = motion.valid & np.isfinite(both).all(axis=1)
        m = round(length_s * motion.rate_hz)
        starts, _ = window_starts(segments(known), m)
        if m < REGRESSION.fewest_rows or not len(starts):
            continue
        if not totals.any():
            offset = both[known].mean(axis=0)
        weight, _, _ = window_weights(m, 1.0 / motion.rate_hz)
        both -= offset
        for total, values in zip(
            totals, (window_sums(both, weight / motion.rate_hz, starts), both[known]), strict=True
        ):
            total += [np.full(6, float(len(values))), values.sum(axis=0), np.einsum("nk,nk->k", values, values)]
    if not totals.any():
        return np.full((2, 3), np.nan)
    count, sums, squares = totals.transpose(1, 0, 2)
    left, whole = squares / count - (sums / count) ** 2
    varies = whole > VARIES * offset**2
    return np.where(varies, left / np.where(varies, whole, 1.0), 1.0).reshape(2, 3)
