"""What several logs of a vessel say together: lasting properties, and each log's own conditions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from ferryid.diagnose.inference.campaign import CommonHull
from ferryid.diagnose.inference.campaign_model import Campaign
from ferryid.diagnose.judging.campaign_conditions import JudgedConditions, judge_conditions, note
from ferryid.diagnose.judging.campaign_properties import PropertyTest, judge_properties, tested
from ferryid.diagnose.judging.claims import Claim, Figures

NO_MODEL = (
    "No model is stored of a campaign: ferryid fit makes one of these logs, and ferryid diagnose --each one with the findings "
    "of each."
)


@dataclass(frozen=True)
class JudgedCampaign:
    """What several logs say together.

    Attributes
    ----------
    conditions
        Of each log, with the hull of all.
    properties
        Of the vessel.
    """

    conditions: JudgedConditions
    properties: tuple[PropertyTest, ...]

    @property
    def hull(self) -> CommonHull:
        """The common hull, with what is confirmed beside it."""
        return self.conditions.hull

    @property
    def notes(self) -> tuple[str, ...]:
        """What was tested over all logs, as sentences."""
        tests = (note(one, len(self.hull.place)) for one in self.conditions.tests)
        return (*tests, NO_MODEL)

    def claims(self, path: str) -> tuple[Claim, ...]:
        """Return what all logs together say of one of them, as findings."""
        i = self.hull.place.get(path)
        if i is None:
            return ()
        windows = self.hull.fit.campaign.members[i].windows
        lasting = (one.finding(windows) for one in self.properties)
        return (*self.conditions.claims(path), *(Claim(one, Figures("property")) for one in lasting))


def judge_campaign(campaign: Campaign, place: Mapping[str, int], progress: Callable[[str], None]) -> JudgedCampaign:
    """Judge what several logs say together: conditions, then properties beside them, then conditions beside these."""
    conditions = judge_conditions(campaign, place, progress)
    properties = judge_properties(conditions.hull.fit, progress)
    confirmed = tuple(one.candidate for one in properties if one.confirmed)
    if not confirmed:
        return JudgedCampaign(conditions, properties)
    conditions = judge_conditions(replace(campaign, properties=confirmed), place, progress)
    made = conditions.hull.fit
    again = {one.key: tested(made, one, ()) for one in made.campaign.properties}
    beside = tuple(
        replace(again[one.candidate.key], rivals=one.rivals) if one.candidate.key in again else one
        for one in properties
    )
    return JudgedCampaign(conditions, beside)
