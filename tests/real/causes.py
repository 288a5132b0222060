"""Why an aim was missed, as far as the figures of the same runs show it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from ferryid.diagnose.inference.thresholds import INFERENCE
from tests.real.shared_force import SharedForce

Floats = NDArray[np.float64]

MEDIAN = float(norm.ppf(0.75))
"""Median of the size of a normal variable, over its standard deviation."""


@dataclass(frozen=True)
class Winds:
    """Winds of several runs, and how far the vessel turned in them.

    Attributes
    ----------
    measured, estimated, errors
        North and east: as measured, as estimated, and standard errors as reported [m/s], shape (runs, 2).
    turns
        Circular standard deviation of the heading of each run [deg], shape (runs,).
    """

    measured: Floats
    estimated: Floats
    errors: Floats
    turns: Floats

    @property
    def across(self) -> Floats:
        """Standard errors across the measured wind [m/s], shape (runs,)."""
        side = np.column_stack([-self.measured[:, 1], self.measured[:, 0]]) / np.hypot(*self.measured.T)[:, None]
        return np.asarray(np.hypot(*(side * self.errors).T))

    @property
    def expected_deg(self) -> Floats:
        """Standard deviation of the direction that the reported errors stand for [deg], shape (runs,)."""
        return np.asarray(np.degrees(np.arctan2(self.across, np.hypot(*self.measured.T))))

    @property
    def common(self) -> Floats:
        """Mean error of all runs, north and east [m/s], shape (2,)."""
        return np.asarray((self.estimated - self.measured).mean(axis=0))

    @property
    def scatter(self) -> Floats:
        """Standard deviation of the errors about their mean [m/s], shape (2,)."""
        return np.asarray((self.estimated - self.measured).std(axis=0))


def spread_deg(psi: Floats) -> float:
    """Return the circular standard deviation of headings [rad], in degrees."""
    length = max(abs(complex(np.mean(np.exp(1j * psi)))), 1e-12)
    return float(np.degrees(np.sqrt(max(-2.0 * np.log(length), 0.0))))


def of_directions(winds: Winds, within_deg: float, wanted: float, beside: Winds | None = None) -> str:
    """Return why too few winds point within an angle of the measured ones; `wanted` is the share of runs aimed at."""
    share = float(np.mean(2.0 * norm.cdf(within_deg / winds.expected_deg) - 1.0))
    count = len(winds.turns)
    if share < wanted:
        return (
            f"The reported standard errors, {np.median(winds.across):.2f} m/s across the wind in the median, let "
            f"{share * count:.0f} of {count} be expected within {within_deg:.0f} deg."
        )
    return (
        f"The reported standard errors, {np.median(winds.across):.2f} m/s across the wind in the median, would let "
        f"{share * count:.0f} of {count} be expected within {within_deg:.0f} deg: all runs have an error in common, "
        f"{_common(winds)}. {_turns(winds, beside)}"
    )


def of_the_vessel(shared: SharedForce, measured: Floats, within_deg: float) -> str:
    """Return whether a steady force of the vessel is the error of all runs, and what the hull has to do with it.

    `measured` are the winds of the runs, shape (runs, 2).
    """
    apart = np.arctan2(*shared.winds.T[::-1]) - np.arctan2(*measured.T[::-1])
    near = int(np.sum(np.abs((np.degrees(apart) + 180.0) % 360.0 - 180.0) <= within_deg))
    seen = min(shared.evidence, shared.beside_measured) >= INFERENCE.prior_odds
    told = (
        f"A steady sway force and yaw moment of the vessel, the same in all runs, {'explains' if seen else 'does not explain'} "
        f"it: as large as makes its evidence largest, it gains {shared.evidence:.1f} nat beside the estimated winds and "
        f"{shared.beside_measured:.1f} beside the measured one, of {INFERENCE.prior_odds:.0f} that an effect needs; with it, "
        f"{near} of {len(measured)} are within {within_deg:.0f} deg."
    )
    damping, true_damping = shared.damping
    told += (
        f" The hull is another with the measured wind, gusts included: a sway damping Y_v of {true_damping:.1f} kg/s, against "
        f"{damping:.1f} kg/s with the estimated steady one."
    )
    if damping > true_damping:
        told += (
            " Beside a steady wind, what gusts do to the motion is taken for less damping, and a hull that is damped less "
            "leaves less of a wind on the beam to balance."
        )
    return told


def of_the_median(winds: Winds) -> str:
    """Return what median angle the reported errors let expect."""
    return (
        f"The reported standard errors, {np.median(winds.across):.2f} m/s across winds of "
        f"{np.median(np.hypot(*winds.measured.T)):.1f} m/s in the median, stand for "
        f"{MEDIAN * np.median(winds.expected_deg):.0f} deg in the median."
    )


def of_intervals(winds: Winds) -> str:
    """Return why too few components lie in their intervals."""
    north, east = winds.common / np.median(winds.errors, axis=0)
    return (
        f"The errors of the runs are not independent: all have {_common(winds)}, which is {north:+.1f} and {east:+.1f} of the "
        "reported standard errors, so that the components of one direction leave their intervals together."
    )


def of_the_gain(mean_share: float, scaled_share: float, wanted: float) -> str:
    """Return why a steady wind gains too little of what the measured one does; empty where its own mean gains enough.

    Parameters
    ----------
    mean_share, scaled_share
        What the mean of the measured wind over each run gains of the measured wind's gain, with the profile's loads and with
        the estimated factors on them.
    wanted
        The share that is aimed at.
    """
    most = max(mean_share, scaled_share)
    if most >= wanted:
        return ""
    return (
        f"The measured wind's own mean over each run gains {100.0 * mean_share:.0f} %, and {100.0 * scaled_share:.0f} % with "
        "the estimated load factors: no wind that is steady in a run gains half. The rest is of gusts, which the anemometer "
        "measures."
    )


def _common(winds: Winds) -> str:
    (north, east), (a, b) = winds.common, winds.scatter
    return (
        f"{north:+.2f} m/s north and {east:+.2f} east in the mean, with a scatter between runs of {a:.2f} and {b:.2f}"
    )


def _turns(winds: Winds, beside: Winds | None) -> str:
    other = "" if beside is None else f", against {np.median(beside.turns):.0f} deg in the random runs"
    return f"The heading varies by {np.median(winds.turns):.0f} deg (standard deviation within a run, median){other}."
