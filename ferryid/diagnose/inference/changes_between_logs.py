"""What changed between two logs of a campaign: a load came aboard or was put ashore, a thruster weakened or was mended.

What is alike in all logs looks like another hull or curve where nobody has modelled it; what acts in some of them does not.
Every time between two logs is weighed, by the evidence that a change in the logs before it, or in those after it, would add if
the gaps were linear in it: sums over the logs. What is likely is then a difference between two groups of logs, estimated and
weighed against every other difference between them.

References
----------
Chen and Gupta (2012), Parametric statistical change point analysis, for one change at an unknown place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import log

import numpy as np

from ferryid.diagnose.inference.campaign_estimation import CampaignFit, estimate_campaign
from ferryid.diagnose.inference.campaign_model import Campaign
from ferryid.diagnose.inference.campaign_properties import LOADS
from ferryid.diagnose.inference.candidate import Candidate
from ferryid.diagnose.inference.group_differences import (
    FAULTS,
    GROUPS,
    Contender,
    differences_of,
    gains_of_ways,
    in_groups,
    likeliest_difference,
)
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.effects.wording import ALL_THRUSTERS
from ferryid.types import Flags


@dataclass(frozen=True)
class Change:
    """A load or a fault that acts in some logs, as those before a time or those after it, beside everything else.

    Attributes
    ----------
    candidate
        The load or fault, in the logs of its group.
    fit
        The estimate with it, its logs in two groups.
    contenders
        Other differences that were tried in its place.
    count
        How many logs are before the time; None where the groups are not those before a time and after it.
    """

    candidate: Candidate
    fit: CampaignFit
    contenders: tuple[Contender, ...]
    count: int | None = None

    @property
    def after(self) -> bool:
        """Whether it acts in the logs after the time."""
        return self.candidate.group == GROUPS[1]

    @property
    def scales_all(self) -> bool:
        """Whether it is a factor of all forces, as one on all of the hull would be."""
        return _scales_all(self.candidate, self.fit.campaign)

    @property
    def acting(self) -> tuple[int, ...]:
        """The places in the campaign of the logs in which it acts, in order of time."""
        campaign = self.fit.campaign
        return tuple(i for i in campaign.order if campaign.members[i].group == self.candidate.group)

    @property
    def others(self) -> tuple[int, ...]:
        """Those of the other logs."""
        acting = set(self.acting)
        return tuple(i for i in self.fit.campaign.order if i not in acting)


@dataclass(frozen=True)
class Weighed:
    """A change at a time: the evidence that it would add if gaps were linear [nat], and how many logs are before the time."""

    evidence: float
    count: int
    candidate: Candidate


def weigh_changes(made: CampaignFit) -> list[Weighed]:
    """Return every change of load or force at every time between logs, the likeliest first; none of too few logs.

    Parameters
    ----------
    made
        What the logs say together without such a change, settled under its noise.
    """
    order = made.campaign.order
    if len(order) < 2 * INFERENCE.change_logs:
        return []
    weighed = [one for candidate in _changes(made, order) for one in _at_times(made, candidate, order)]
    return sorted(weighed, key=lambda one: -one.evidence)


def find_change(made: CampaignFit) -> Change | None:
    """Return a load or a fault that came or went between two logs; None where the evidence favours none.

    Parameters
    ----------
    made
        What the logs say together, without such a change.
    """
    # What is compared has settled under one noise.
    made = estimate_campaign(made.campaign, noise=made.noise, begin=made)
    weighed = weigh_changes(made)
    if not weighed or weighed[0].evidence < INFERENCE.prior_odds:
        return None
    count = weighed[0].count
    grouped = replace(made, campaign=_parted(made.campaign, made.campaign.order, count))
    rarity = {one.candidate.key: one.candidate.log_alternatives for one in weighed}
    differences = [
        replace(one, log_alternatives=rarity.get(one.key, one.log_alternatives))
        for one in differences_of(grouped.campaign)
    ]
    found = likeliest_difference(grouped, differences)
    if found is None or not _may_change(found.comparison.candidate):
        return None
    return Change(found.comparison.candidate, found.fit, found.contenders, count)


def change_of_part(made: CampaignFit, inside: Flags) -> Change | None:
    """Return a load or a fault that acts in some logs alone, or in the others; None where the evidence favours none.

    One log by itself shows no scatter, so that this may be what sets any log apart from others: it is to be asked of logs that
    are farther apart than that. A factor of all forces is none, as it does the same as one on all of the hull.

    Parameters
    ----------
    made
        What the logs say together, without such a change and without groups.
    inside
        Which of them, shape (L,).
    """
    made = estimate_campaign(made.campaign, noise=made.noise, begin=made)
    grouped = replace(made, campaign=in_groups(made.campaign, [GROUPS[int(one)] for one in inside]))
    changes = [
        one for one in differences_of(grouped.campaign) if _may_change(one) and not _scales_all(one, grouped.campaign)
    ]
    found = likeliest_difference(grouped, changes)
    return None if found is None else Change(found.comparison.candidate, found.fit, found.contenders)


def _scales_all(one: Candidate, campaign: Campaign) -> bool:
    names = campaign.members[0].windows.measurements.names
    return one.effect.id in FAULTS and (one.instance == ALL_THRUSTERS or len(names) == 1)


def _may_change(one: Candidate) -> bool:
    """Return whether an effect comes and goes between logs: another difference between them is one of circumstances."""
    return one.effect.id in LOADS | FAULTS


def _parted(campaign: Campaign, order: Sequence[int], count: int) -> Campaign:
    """Return the logs in two groups, those before a time and those after it."""
    before = set(order[:count])
    return in_groups(campaign, [GROUPS[0] if i in before else GROUPS[1] for i in range(len(order))])


def _changes(made: CampaignFit, order: Sequence[int]) -> list[Candidate]:
    """Return the loads and faults that the logs can show, in either group, as rare as one of all changes that are weighed."""
    ways = log(2.0 * (len(order) + 1 - 2 * INFERENCE.change_logs))
    differences = differences_of(_parted(made.campaign, order, INFERENCE.change_logs))
    return [replace(one, log_alternatives=one.log_alternatives + ways) for one in differences if _may_change(one)]


def _at_times(made: CampaignFit, change: Candidate, order: Sequence[int]) -> list[Weighed]:
    """Return the evidence that a change adds, for every number of logs before it."""
    counts, after = range(INFERENCE.change_logs, len(order) - INFERENCE.change_logs + 1), change.group == GROUPS[1]
    ways = []
    for count in counts:
        acts = np.zeros(len(order), dtype=np.bool_)
        acts[list(order[count:] if after else order[:count])] = True
        ways.append(acts)
    gains = gains_of_ways(made, change, ways)
    return [Weighed(gain, count, change) for gain, count in zip(gains, counts, strict=True)]
