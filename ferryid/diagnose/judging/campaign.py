"""What several logs of a vessel say together: lasting properties, and each log's own conditions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

from ferryid.diagnose.inference.campaign import CommonHull
from ferryid.diagnose.inference.campaign_model import Campaign
from ferryid.diagnose.judging.campaign_conditions import JudgedConditions, judge_conditions, note
from ferryid.diagnose.judging.campaign_properties import PropertyTest, judge_properties, tested
from ferryid.diagnose.judging.claims import Claim, Figures
from ferryid.diagnose.judging.posterior import HullPosterior
from ferryid.effects.force_model import COEFFICIENTS


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

    @cached_property
    def hull_posterior(self) -> HullPosterior | None:
        """What all logs say of a hull that was known before; None of a guessed one, which has drag that no model file has."""
        prior, h = self.hull.fit.campaign.hull, len(COEFFICIENTS)
        if not prior.known:
            return None
        mean, covariance = self.hull.fit.belief()
        return HullPosterior(prior.mean[:h], prior.spread[:h], mean[:h], covariance[:h, :h])

    @property
    def notes(self) -> tuple[str, ...]:
        """What was tested over all logs, as sentences."""
        return tuple(note(one, len(self.hull.place)) for one in self.conditions.tests)

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
