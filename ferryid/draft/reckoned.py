"""Which positions of a log no sensor measured, and whether a receiver gave enough of them to take its own instead."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ferryid.counts import counted
from ferryid.draft.fields import FieldGroup
from ferryid.draft.samples import Samples, angle_unit, metres, yaw
from ferryid.draft.thresholds import DRAFT
from ferryid.signals.artificial import ALONG, along_share, summed_says, summed_share
from ferryid.signals.thresholds import SIGNALS
from ferryid.types import Floats


@dataclass(frozen=True)
class Reckoned:
    """Positions of a log that are reckoned or simulated.

    Attributes
    ----------
    why
        Each with what shows it, as the end of a sentence.
    left_out
        They are not taken, as another position was measured often enough.
    few
        Why what was measured is not enough, empty where it is or nothing is reckoned.
    """

    why: Mapping[FieldGroup, str] = field(default_factory=dict)
    left_out: bool = False
    few: str = ""

    def evidence(self) -> tuple[str, ...]:
        """Return what is left out and why, a sentence each."""
        return tuple(f"{one.label} is not taken: {why}" for one, why in self.why.items()) if self.left_out else ()

    def doubts(self, position: FieldGroup) -> tuple[str, ...]:
        """Return that a position which is taken was not measured, and why no other is taken; nothing where it was."""
        return (f"{self.why[position]}; {self.few}",) if position in self.why else ()


def reckoned_positions(groups: Sequence[FieldGroup], samples: Samples) -> Reckoned:
    """Return which positions are reckoned from headings or velocities, and whether others are enough to do without.

    A receiver at a fifth of the rate, or one that starts late, measures, whereas a sum of velocities shows nothing that
    they do not.
    """
    positions = [one for one in groups if one.kind == "position"]
    why = {one: says for one in positions if (says := _reckoned(one, groups, samples))}
    if not why:
        return Reckoned()
    few = []
    for one in (one for one in positions if one not in why):
        times_s = _fixes(one, samples)
        lasts_s = float(np.ptp(times_s)) if times_s.size else 0.0
        # As many as a comparison needs rows, over as much of the trial as any source has to last.
        if times_s.size >= DRAFT.fewest_rows and lasts_s >= DRAFT.shorter * max(other.lasts_s for other in positions):
            return Reckoned(why, left_out=True)
        few.append(
            f"{one.label} has {counted(times_s.size, 'position')} in {lasts_s:.3g} s, too few to take it instead"
        )
    return Reckoned(why, few="; ".join(few) or "the log has no other position")


def _fixes(position: FieldGroup, samples: Samples) -> Floats:
    """Return the times at which a position is another than before [s]: a receiver without a fix repeats its last."""
    north, east = _place(position, samples)
    known = np.isfinite(north) & np.isfinite(east) & samples.counts(position.topic)
    # Of the first nothing is before; NaN differs from every number.
    moved = np.diff(north[known], prepend=np.nan) != 0.0
    moved |= np.diff(east[known], prepend=np.nan) != 0.0
    return np.asarray(samples.times_s[position.topic][known][moved])


def _place(position: FieldGroup, samples: Samples) -> tuple[Floats, Floats]:
    """Return both components of a position as recorded, of a latitude and a longitude north and east [m], shape (n,)."""
    if position.form == "geodetic":
        return metres(samples, position.topic, position.fields)
    first, second = (samples.raw(position.topic, path) for path in position.fields)
    return first, second


def _reckoned(position: FieldGroup, groups: Sequence[FieldGroup], samples: Samples) -> str:
    """Return what shows that no sensor measured a position, as the end of a sentence; empty where nothing does."""
    x, y = _place(position, samples)
    for velocity in (one for one in groups if one.kind == "velocity" and one.topic == position.topic):
        first, second = (samples.raw(velocity.topic, path) for path in velocity.fields)
        if summed_share(x, y, first, second) >= SIGNALS.summed_share:
            return summed_says(position.topic, still=not second.any())
    at_s = samples.times_s[position.topic]
    for heading in (one for one in groups if one.kind == "heading"):
        unit = "quaternion" if heading.form else angle_unit(samples, heading.topic, heading.fields)
        psi, psi_s = yaw(samples, heading.topic, heading.fields, unit), samples.times_s[heading.topic]
        # Which of the two components is north, and from which the heading counts, is not known yet.
        if max(along_share(at_s, *place, psi_s, psi) for place in ((x, y), (y, x))) >= SIGNALS.summed_share:
            return ALONG
    return ""
