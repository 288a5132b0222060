"""Frames of the wrong hand: positions, headings or velocities that are the mirror image of what the others say.

With positions as complex numbers p = north + i east and velocities as w = u + i v, ``dp = w exp(i psi) dt``. East taken for
north conjugates p up to a turn, a heading that counts the other way conjugates the exponential, and a y axis to port conjugates
w. A turn and a factor remain free in each, so that none of them is taken for a heading's bias, or for a unit.
"""

from __future__ import annotations

from dataclasses import dataclass

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
    declared = fits[""]
    if fits[best] < SIGNALS.mirror_correlation or not _far_better(fits[best], declared):
        return "", ""
    return best, f"{SAYS[best]} (correlation {fits[best]:.2f} so, {declared:.2f} as declared)."


def _far_better(other: float, declared: float) -> bool:
    """Return whether another hand leaves far less of the variance than the declared one, by correlations of either.

    Both are exact on a straight track that was made from the velocities: then rounding would decide.
    """
    left, of_other = (max(1.0 - one**2, SIGNALS.mirror_rounding) for one in (declared, other))
    return SIGNALS.mirror_ratio * of_other <= left


@dataclass(frozen=True)
class CourseAgainstHeading:
    """How a heading goes with the course, where no velocity was measured.

    A vessel moves ahead for the most part: of course less heading the mean resultant length is near one, at an angle of nearly
    none (Mardia & Jupp 2000, section 2.3.1). Where it is of course plus heading instead, the heading counts the other way;
    where its zero is does not matter.

    Attributes
    ----------
    declared, mirrored
        Mean resultant length of course less heading, and of course plus heading.
    angle_rad
        Mean angle from the heading to the course, clockwise [rad].
    headings
        Mean resultant length of the headings: one where there is but one.
    """

    declared: float
    mirrored: float
    angle_rad: float
    headings: float

    @property
    def says(self) -> str:
        """A sentence where the heading turns the wrong way round; empty where it does not certainly."""
        if self.mirrored < SIGNALS.course_mirrored or not _far_better(self.mirrored, self.declared):
            return ""
        return (
            f"The heading turns the wrong way round against the course (mean resultant length {self.mirrored:.2f} so, "
            f"{self.declared:.2f} as declared)."
        )

    @property
    def turned_deg(self) -> float:
        """By how much the course is off the heading at all headings [deg]; 0 where it is not, or by little."""
        many = self.headings < SIGNALS.course_mirrored and self.declared >= SIGNALS.course_mirrored
        degrees = float(np.degrees(self.angle_rad))
        return degrees if many and abs(degrees) > SIGNALS.course_off_deg else 0.0


def course_against_heading(eta: Floats, usable: NDArray[np.bool_], rate_hz: float) -> CourseAgainstHeading | None:
    """Compare the course of ways of seconds with the heading; None where there are too few. Parameters as of `mirrored`."""
    span = max(2, round(SIGNALS.mirror_span_s * rate_hz))
    good = usable & np.isfinite(eta).all(axis=1)
    starts = np.arange(0, len(good) - span, span)
    starts = starts[[bool(good[start : start + span + 1].all()) for start in starts]]
    way = eta[starts + span, 0] - eta[starts, 0] + 1j * (eta[starts + span, 1] - eta[starts, 1])
    moved = np.abs(way) >= SIGNALS.mirror_way_m
    if np.count_nonzero(moved) < SIGNALS.mirror_spans:
        return None
    course = way[moved] / np.abs(way[moved])
    heading = np.exp(1j * eta[starts[moved] + span // 2, 2])
    turned = np.mean(course * np.conj(heading))
    return CourseAgainstHeading(
        float(np.abs(turned)),
        float(np.abs(np.mean(course * heading))),
        float(np.angle(turned)),
        float(np.abs(np.mean(heading))),
    )


def _summed(values: Complex, starts: NDArray[np.int64], span: int) -> Complex:
    total = np.concatenate([[0.0], np.cumsum(values)])
    return np.asarray(total[starts + span] - total[starts])


def _fit(one: Complex, other: Complex, free: Complex) -> float:
    """Return the size of the correlation of two complex series, what is free in both left out."""
    both = np.column_stack([one, other])
    a, b = (both - free @ np.linalg.lstsq(free, both, rcond=None)[0]).T
    return float(np.abs(np.vdot(a, b)) / max(np.linalg.norm(a) * np.linalg.norm(b), 1e-12))
