"""Figures of merit of campaigns at sea: what was named of the concealed effect and of the wind, and what an oracle sees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from ferryid.json_record import Record
from ferryid.validation.campaign_oracle import deviation, visible
from ferryid.validation.case import Truth
from ferryid.validation.estimate_errors import EstimateErrors, estimate_errors
from ferryid.validation.name_scores import Share, names, outcome_of_missed, why_missed, wrong_names
from ferryid.validation.records import CaseResult

SEA = "sea"
"""Kind of these cells."""
TWICE = 2.0
"""Of what the oracle just sees: from there on an effect is to be named."""
WIND = "wind"


@dataclass(frozen=True)
class SeaCampaign(Record):
    """What became of one campaign.

    Attributes
    ----------
    effect
        What was concealed; empty where it was the weather alone.
    size
        In the unit of its detection curve.
    seen, wind_seen
        How far effect and wind change the logs, over what an oracle sees 19 times in 20; 0 where that is less than what a
        diagnosis reports, or where there was none.
    named, wind_named
        Whether the diagnosis named them.
    wrong
        Names of what is not in the logs.
    missed
        What became of an effect that was not named, and why; empty where it was named, or nothing was concealed.
    """

    effect: str
    size: float
    seen: float
    wind_seen: float
    named: bool
    wind_named: bool
    wrong: tuple[str, ...]
    missed: str = ""


@dataclass(frozen=True)
class SeaScores(Record):
    """What was found in all campaigns, and the errors of the estimates: of everything first, then by effect."""

    DERIVED: ClassVar[dict[str, str]] = {
        name: name for name in ("named", "named_from_twice", "winds_from_twice", "false")
    }

    campaigns: tuple[SeaCampaign, ...]
    recoveries: tuple[EstimateErrors, ...]

    @property
    def named(self) -> Share:
        """Share of the concealed effects that were named, of all sizes."""
        return _share([one.named for one in self.campaigns if one.effect])

    @property
    def named_from_twice(self) -> Share:
        """The same of those that change the logs twice as much as an oracle just sees, or more."""
        return _share([one.named for one in self.campaigns if one.effect and one.seen >= TWICE])

    @property
    def winds_from_twice(self) -> Share:
        """Share of the winds that were named, of those that change the logs so much."""
        return _share([one.wind_named for one in self.campaigns if one.wind_seen >= TWICE])

    @property
    def false(self) -> Share:
        """Share of the campaigns with a wrong name."""
        return _share([bool(one.wrong) for one in self.campaigns])


def sea_scores(results: Sequence[CaseResult]) -> SeaScores | None:
    """Return the scores of campaigns at sea; None where there are none."""
    if not results:
        return None
    return SeaScores(tuple(map(_campaign, results)), estimate_errors(results))


def _campaign(result: CaseResult) -> SeaCampaign:
    # The concealed effect stands before the wind of the day, which it may be itself.
    wind = next(truth for truth in result.truths if truth.effect == WIND)
    concealed = result.truths[0] if result.case.size > 0.0 else None
    named = names(result)
    return SeaCampaign(
        "" if concealed is None else concealed.effect,
        result.case.size,
        0.0 if concealed is None else _seen(result, concealed),
        _seen(result, wind),
        concealed is not None and concealed.key in named,
        wind.key in named,
        tuple(" ".join(filter(None, key)) for key in wrong_names(result)),
        "" if concealed is None or concealed.key in named else _missed(result, concealed),
    )


def _missed(result: CaseResult, truth: Truth) -> str:
    outcome, why = outcome_of_missed(result, truth.key), why_missed(result, truth.key)
    if outcome == f"taken for {WIND}":
        # The wind of the day is in every campaign.
        outcome = "the wind of the day alone was named"
    return f"{outcome}: {why}" if why else outcome


def _seen(result: CaseResult, truth: Truth) -> float:
    every = () if result.oracle is None else result.oracle.recovered
    one = next((one for one in every if one.key == truth.key and not one.idle), None)
    return 0.0 if one is None else deviation(one) / visible(one.free)


def _share(flags: Sequence[bool]) -> Share:
    return Share(sum(flags), len(flags))
