"""The verdict: one word for a log, derived from its findings and from what is left, so that it cannot contradict them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite, nan

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.judging.finding import UNKNOWN, Finding
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.types import AXES

VERDICTS = ("matched", "explained", "partly_explained", "unexplained", "not_testable")


@dataclass(frozen=True)
class Remainder:
    """What is left of a log beside its findings.

    Attributes
    ----------
    testable
        True where the log would have shown more than half of the effects that can be tested, had they been there.
    eliminated
        True where a candidate was eliminated that the likelihood spoke for: there is a cause of it, known or not.
    ratio
        Held-out squared force error with the findings over the one without, by axis; empty where nothing was held out.
    left
        Squared force error with the findings over the squared force that moves the vessel, by axis that the log excites.
    """

    testable: bool = True
    eliminated: bool = False
    ratio: Mapping[str, Estimate] = field(default_factory=dict)
    left: Mapping[str, float] = field(default_factory=dict)

    @property
    def worse(self) -> tuple[str, ...]:
        """Axes on which the force error grows with the findings."""
        return worse_axes(self.ratio)

    @property
    def much(self) -> tuple[str, ...]:
        """Axes on which more is left than is explained."""
        return tuple(axis for axis in AXES if self.left.get(axis, 0.0) >= JUDGING.unexplained_share)


def worse_axes(ratio: Mapping[str, Estimate]) -> tuple[str, ...]:
    """Return the axes whose force error grows: by more than `JUDGING.worsening`, or by an interval that excludes no change."""
    return tuple(
        axis
        for axis in AXES
        if axis in ratio
        and (
            ratio[axis].value > 1.0 + JUDGING.worsening
            or (ratio[axis].value > 1.0 + JUDGING.reported_change and ratio[axis].low > 1.0)
        )
    )


def verdict_of(findings: Sequence[Finding], remainder: Remainder) -> str:
    """Return the verdict on a log.

    ========================= ============================================== =================================
    findings                  nothing more is left                           more is left, or cannot be tested
    ========================= ============================================== =================================
    a sure one with a name    explained                                      partly_explained
    a sure one without a name unexplained                                    unexplained
    hints                     unexplained                                    not_testable if untestable
    none                      matched, unexplained where one was eliminated  not_testable if untestable
    ========================= ============================================== =================================

    More is left where there are findings without a name or hints, a candidate was eliminated, the force error grows on an axis
    with the findings, or more of it is left there than is explained.

    Parameters
    ----------
    findings
        As they stand by the confidence rules.
    remainder
        What is left beside them.

    Returns
    -------
    str
        One of `VERDICTS`.
    """
    sure = [one for one in findings if one.sure]
    more = len(sure) < len(findings) or any(one.effect == UNKNOWN for one in findings) or remainder.eliminated
    if any(one.effect != UNKNOWN for one in sure):
        whole = remainder.testable and not (more or remainder.worse or remainder.much)
        return "explained" if whole else "partly_explained"
    if not remainder.testable and not sure:
        return "not_testable"
    return "unexplained" if more else "matched"


def campaign_verdict(verdicts: Sequence[str]) -> str:
    """Return one verdict for several logs, of those that could be tested.

    It is explained where all of them are explained or matched, partly explained where one of them is at least in part and
    another is not.
    """
    known = set(verdicts) - {"not_testable"}
    if not known:
        return "not_testable"
    if known <= {"explained", "matched"}:
        return "explained" if "explained" in known else "matched"
    return "partly_explained" if known & {"explained", "partly_explained"} else "unexplained"


def error_ratio(before: Mapping[str, float | None], after: Mapping[str, float | None]) -> dict[str, Estimate]:
    """Return one squared force error over another by axis; the ends of the intervals are NaN, as they are not known."""
    ratio = {}
    for axis in AXES:
        one, other = before.get(axis), after.get(axis)
        if one is not None and other is not None and one > 0.0 and isfinite(other):
            ratio[axis] = Estimate(other / one, nan, nan, "-")
    return ratio
