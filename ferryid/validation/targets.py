"""The targets of a validation run, and whether they were reached."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import log

from ferryid.json_record import Record
from ferryid.validation.case_sampling import LEVELS
from ferryid.validation.estimate_errors import EstimateErrors
from ferryid.validation.name_scores import Cell, Share
from ferryid.validation.plant.effects import plant_effects
from ferryid.validation.scores import CLEAN, Detection, Scores
from ferryid.validation.sea_scores import SeaScores

MOST_RATIO = 1.5
"""Ratio of the sizes named reliably, the diagnosis's over the oracle's, that is allowed."""
COVERED = (0.93, 0.97)
"""Share of 95 % intervals that is to hold the truth."""
FALSE = 0.01
"""Share of logs that may have a wrong name."""
AT_SEA = 0.95
"""Share of the effects that change a campaign at sea twice as much as an oracle just sees, or more, which is to be named."""
MIDDLE = 0.95
"""Share of the effects of a middle size that is to be named."""
PAIRS = 0.85
"""Share of the logs with two effects of which both are to be named."""
MEDIAN_ERROR = 0.03
"""Median relative error of parameters that is allowed."""
IN_TIME = 0.9
"""Share of onsets and offsets that is to be within 5 s."""


@dataclass(frozen=True)
class Target(Record):
    """A target.

    Attributes
    ----------
    what
        What was to be reached, and the value.
    reached
        None where the value is within the target and its interval allows either, and where nothing was tested.
    sure
        Whether the interval lies on one side of the target alone.
    tested
        False where the run has no case that tests it.
    """

    what: str
    reached: bool | None
    sure: bool
    tested: bool = True

    @property
    def outcome(self) -> str:
        """Whether it was reached, in words."""
        if not self.tested:
            return "not tested"
        if self.reached is None:
            return "reached, though the interval allows either"
        return "yes" if self.reached else "**missed**" if self.sure else "**missed**, though the interval allows either"


def targets(scores: Scores) -> list[Target]:
    """Return every target."""
    every = scores.recoveries[0]
    near = [
        one
        for one in scores.detections
        if one.ratio is not None and one.ratio.value is not None and one.ratio.value <= MOST_RATIO
    ]
    tested = len(scores.detections)
    sizes = f"sizes named 19 times in 20 at most {MOST_RATIO} times the oracle's"
    return [
        share_target(
            f"effects of the middle of five sizes named: at least {100.0 * MIDDLE:.0f} %",
            middle_sizes(scores.detections),
            at_least=MIDDLE,
        ),
        share_target(
            f"pairs of effects, both named: at least {100.0 * PAIRS:.0f} %", both_of_pairs(scores.cells), at_least=PAIRS
        ),
        share_target(
            "clean logs with a wrong name: at most 1 %", scores.false_names.get(CLEAN, Share(0, 0)), at_most=FALSE
        ),
        share_target("all logs with a wrong name: at most 1 %", scores.false_names["all"], at_most=FALSE),
        share_target(
            "95 % intervals that hold the truth: 93 to 97 %", every.covered, at_least=COVERED[0], at_most=COVERED[1]
        ),
        share_target("onsets and offsets within 5 s: at least 90 %", every.in_time, at_least=IN_TIME),
        _median_error("", every),
        Target(f"{sizes}: {len(near)} of {tested} effects", len(near) == tested, True)
        if tested
        else Target(sizes, None, False, tested=False),
        *_at_sea(scores.sea),
    ]


def _at_sea(sea: SeaScores | None) -> list[Target]:
    if sea is None:
        named, false, every = Share(0, 0), Share(0, 0), None
    else:
        named, false, every = sea.named_from_twice, sea.false, sea.recoveries[0]
    covered = Share(0, 0) if every is None else every.covered
    return [
        share_target(
            f"at sea, effects named from twice what the oracle sees on: at least {100.0 * AT_SEA:.0f} %",
            named,
            at_least=AT_SEA,
        ),
        share_target("at sea, campaigns with a wrong name: at most 1 %", false, at_most=FALSE),
        share_target(
            "at sea, 95 % intervals that hold the truth: 93 to 97 %", covered, at_least=COVERED[0], at_most=COVERED[1]
        ),
        _median_error("at sea, ", every),
    ]


def _median_error(where: str, found: EstimateErrors | None) -> Target:
    what = f"{where}median relative error of parameters: at most {100.0 * MEDIAN_ERROR:.0f} %"
    if found is None or not found.errors:
        return Target(what, None, False, tested=False)
    return Target(f"{what}; {100.0 * found.median_error:.1f} %", found.median_error <= MEDIAN_ERROR, True)


def middle_sizes(detections: Iterable[Detection]) -> Share:
    """Return how many effects of the middle of five sizes were named, each size being a fifth of the range by the logarithm."""
    named: list[bool] = []
    for one in detections:
        least, most = plant_effects()[one.effect].sizes
        for size, found in zip(one.sizes, one.blind_named, strict=True):
            if int(LEVELS * log(size / least) / log(most / least)) == LEVELS // 2:
                named.append(found)
    return Share(sum(named), len(named))


def both_of_pairs(cells: Iterable[Cell]) -> Share:
    """Return in how many logs with two effects both were named."""
    pairs = [one.every for one in cells if one.kind == "pair"]
    return Share(sum(one.count for one in pairs), sum(one.of for one in pairs))


def share_target(what: str, share: Share, *, at_least: float = 0.0, at_most: float = 1.0) -> Target:
    """Return the target that a share lies within limits."""
    if not share.of:
        return Target(what, None, False, tested=False)
    low, high = share.interval
    inside = at_least <= share.value <= at_most
    sure = at_least <= low and high <= at_most if inside else high < at_least or low > at_most
    return Target(f"{what}; {share.text}", inside if sure or not inside else None, sure)
