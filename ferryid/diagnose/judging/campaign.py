"""What several logs of a vessel say together: lasting properties, and each log's own conditions."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from ferryid.cached import cached_property
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.campaign import CommonHull
from ferryid.diagnose.inference.campaign_estimation import CampaignFit, bare_campaign, estimate_campaign
from ferryid.diagnose.inference.campaign_model import Campaign
from ferryid.diagnose.inference.campaign_properties import properties_of
from ferryid.diagnose.inference.estimation import Candidate
from ferryid.diagnose.inference.group_differences import grouped_as
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.campaign_conditions import JudgedConditions, judge_conditions, note
from ferryid.diagnose.judging.campaign_errors import LogErrors
from ferryid.diagnose.judging.campaign_evidence import HeldOutLoss, held_out_loss, without_conditions
from ferryid.diagnose.judging.campaign_properties import PropertyTest, judge_properties, tested
from ferryid.diagnose.judging.changes_between_logs import ChangeTest, judge_change
from ferryid.diagnose.judging.claims import Claim, Figures
from ferryid.diagnose.judging.credibility import campaign_hull
from ferryid.diagnose.judging.finding import Finding
from ferryid.diagnose.judging.posterior import HullPosterior
from ferryid.diagnose.judging.size_estimates import UNCONFIRMED, sizes_text
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects.force_model import COEFFICIENTS, ForceModel


@dataclass(frozen=True)
class JudgedCampaign:
    """What several logs say together.

    Attributes
    ----------
    conditions
        Of each log, with the hull of all.
    properties
        Of the vessel.
    change
        A load or a loss of force in some of the logs; None where the evidence favours none.
    bare, loss
        The logs without what is confirmed, under the same noise, and the loss of held-out blocks without and with it; None
        where nothing is confirmed.
    undefended
        Properties against which held-out stretches speak: they are no hints.
    """

    conditions: JudgedConditions
    properties: tuple[PropertyTest, ...]
    change: ChangeTest | None = None
    bare: CampaignFit | None = None
    loss: tuple[HeldOutLoss, HeldOutLoss] | None = None
    undefended: tuple[PropertyTest, ...] = ()

    @property
    def hull(self) -> CommonHull:
        """The common hull, with what is confirmed beside it."""
        return self.conditions.hull

    @cached_property
    def hull_doubt(self) -> str:
        """Why the common hull cannot be the vessel's, as the end of a sentence; empty where it can."""
        return campaign_hull(self.hull.fit).doubt

    @cached_property
    def hull_posterior(self) -> HullPosterior | None:
        """What all logs say of a hull that was known before.

        None of a guessed one, which has drag that no model file has, and of one that cannot be the vessel's.
        """
        prior, h = self.hull.fit.campaign.hull, len(COEFFICIENTS)
        if not prior.known or self.hull_doubt:
            return None
        mean, covariance = self.hull.fit.belief()
        return HullPosterior(prior.mean[:h], prior.spread[:h], mean[:h], covariance[:h, :h])

    @cached_property
    def weighed(self) -> frozenset[tuple[str, str | None]]:
        """Lasting properties that most logs can show, were weighed for together, and do not confirm."""
        campaign = self.hull.fit.campaign
        logs = [one.windows.measurements for one in campaign.members]

        def most(one: Candidate) -> bool:
            able = sum(not one.effect.cannot_be_of(measurements, one.instance) for measurements in logs)
            return able > JUDGING.campaign_share * len(logs)

        confirmed = {one.key for one in campaign.properties}
        return frozenset(one.key for one in properties_of(campaign) if one.key not in confirmed and most(one))

    @property
    def notes(self) -> tuple[str, ...]:
        """What was tested over all logs, as sentences."""
        change = () if self.change is None else (self.change.says,)
        dropped = (
            f"{one.candidate.title} was considered, but dropped: {one.undefended}. "
            f"{UNCONFIRMED}{sizes_text(one.estimates)}."
            for one in self.undefended
        )
        return (*change, *dropped, *(note(one, self.hull.place) for one in self.conditions.tests))

    def claims(self, path: str) -> tuple[Claim, ...]:
        """Return what all logs together say of one of them, as findings."""
        i = self.hull.place.get(path)
        if i is None:
            return ()
        windows = self.hull.fit.campaign.members[i].windows
        lasting = (
            Claim(one.finding(windows), Figures("property", beyond_feedback=one.beyond_feedback))
            for one in self.properties
        )
        change = None if self.change is None else self.change.finding(i)
        changed = () if change is None else (Claim(change, Figures("property")),)
        return (*self.conditions.claims(path), *lasting, *changed)

    def errors(self, path: str, findings: Sequence[Finding]) -> LogErrors | None:
        """Return the held-out errors of a log without and with what is confirmed over all logs; None where it shows none of it.

        `findings` are those of the log as they are reported.
        """
        i, made = self.hull.place.get(path), self.hull.fit
        confirmed = {one.key for one in (*made.campaign.conditions, *made.campaign.properties)}
        if i is None or self.loss is None or not any(one.key in confirmed and one.sure for one in findings):
            return None
        return LogErrors.of(made, self.loss, i)

    def force_models(self, path: str) -> tuple[ForceModel, ForceModel] | None:
        """Return a log's force models without and with what is confirmed; None where nothing is."""
        i = self.hull.place.get(path)
        if i is None or self.bare is None:
            return None
        return self.bare.whole_force_model(i), self.hull.fit.whole_force_model(i)


def judge_campaign(
    campaign: Campaign, place: Mapping[str, int], progress: Callable[[str], None], changed: Collection[str] = ()
) -> JudgedCampaign:
    """Judge what several logs say together.

    Conditions come first, then properties beside them, then a load or a loss of force that is in some of the logs. Beside a
    confirmed one, conditions and properties are judged from the beginning: what they stood in for would be counted twice.
    `changed` are as of `judge_change`.
    """
    bare = estimate_campaign(bare_campaign(campaign))

    def judged(one: Campaign) -> JudgedConditions:
        return judge_conditions(one, place, progress, bare)

    conditions, properties = _judged(campaign, judged, progress)
    progress("weighing what may have changed between logs")
    change = judge_change(conditions.hull.fit, place, changed)
    if change is not None and change.confirmed:
        acting = _begun(change.change.candidate, change.difference.estimates)
        parted = grouped_as(campaign, change.fit.campaign)
        beside = _judged(replace(parted, properties=(acting,)), judged, progress)
        again = change.beside(beside[0].hull.fit, acting)
        # A change that conditions or properties beside it explain is none.
        change, (conditions, properties) = (again, beside) if again.confirmed else (None, (conditions, properties))
    hinted = tuple(one for one in properties if not one.undefended)
    undefended = tuple(one for one in properties if one.undefended)
    return JudgedCampaign(conditions, hinted, change, *_without_confirmed(conditions), undefended)


def _judged(
    campaign: Campaign, judged: Callable[[Campaign], JudgedConditions], progress: Callable[[str], None]
) -> tuple[JudgedConditions, tuple[PropertyTest, ...]]:
    """Return conditions judged beside the properties that are confirmed, and the properties tested beside these."""
    alone = judged(campaign)
    conditions, acting = alone, campaign.properties
    properties = tuple(one for one in judge_properties(alone.hull.fit, progress) if one.candidate not in acting)
    confirmed = tuple(_begun(one.candidate, one.estimates) for one in properties if one.confirmed)
    while confirmed:
        conditions = judged(replace(campaign, properties=(*confirmed, *acting)))
        again = {one.key: tested(conditions.hull.fit, one, ()) for one in confirmed}
        held = tuple(one for one in confirmed if again[one.key].evidence >= INFERENCE.prior_odds)
        # What the evidence does not speak for beside the conditions is no hint either, and acts no longer.
        gone = {one.key for one in confirmed} - {one.key for one in held}
        properties = tuple(
            replace(again[one.candidate.key], rivals=one.rivals, alike=one.alike) if one.candidate.key in again else one
            for one in properties
            if one.candidate.key not in gone
        )
        if not gone:
            break
        confirmed, conditions = held, alone
    return conditions, properties


def _begun(candidate: Candidate, estimates: Mapping[str, Estimate]) -> Candidate:
    """Return a property from whose estimate a search begins."""
    parameters = tuple(
        replace(one, start=estimates[one.name].value) if one.name in estimates else one for one in candidate.parameters
    )
    return replace(candidate, parameters=parameters)


def _without_confirmed(
    conditions: JudgedConditions,
) -> tuple[CampaignFit | None, tuple[HeldOutLoss, HeldOutLoss] | None]:
    """Return the logs without what is confirmed, and the loss of held-out blocks without and with it."""
    made = conditions.hull.fit
    if not (made.campaign.conditions or made.campaign.properties):
        return None, None
    if not made.campaign.properties and len(made.campaign.conditions) == 1:
        for one in conditions.tests:
            if one.fit is made:
                return one.none, one.loss
    bare = replace(without_conditions(made.campaign), properties=())
    none = estimate_campaign(bare, noise=made.noise)
    return none, (held_out_loss(none), held_out_loss(made))
