"""A load that came aboard, or was put ashore, between two logs of a campaign.

A load aboard in all logs looks like a heavier hull where nobody has modelled it; one that is aboard in some of them does not.
Every time between two logs is weighed, by the evidence that a load in the logs before it, or in those after it, would add if
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
    GROUPS,
    Contender,
    differences_of,
    gains_of_ways,
    in_groups,
    likeliest_difference,
)
from ferryid.diagnose.inference.thresholds import INFERENCE


@dataclass(frozen=True)
class LoadChange:
    """A load that is aboard in the logs before a time, or in those after it, beside everything else.

    Attributes
    ----------
    candidate
        The load, in the logs of its group.
    fit
        The estimate with it, its logs in two groups.
    contenders
        Other differences that were tried in its place.
    count
        How many logs are before the time.
    """

    candidate: Candidate
    fit: CampaignFit
    contenders: tuple[Contender, ...]
    count: int

    @property
    def after(self) -> bool:
        """Whether it came aboard, and was not put ashore."""
        return self.candidate.group == GROUPS[1]

    @property
    def aboard(self) -> tuple[int, ...]:
        """The places in the campaign of the logs in which it is aboard, in order of time."""
        order = self.fit.campaign.order
        return order[self.count :] if self.after else order[: self.count]

    @property
    def ashore(self) -> tuple[int, ...]:
        """Those of the others."""
        order = self.fit.campaign.order
        return order[: self.count] if self.after else order[self.count :]


def find_load_change(made: CampaignFit) -> LoadChange | None:
    """Return a load that came aboard or was put ashore between two logs; None where the evidence favours none.

    Parameters
    ----------
    made
        What the logs say together, without such a change.
    """
    order = made.campaign.order
    if len(order) < 2 * INFERENCE.load_logs:
        return None
    # What is compared has settled under one noise.
    made = estimate_campaign(made.campaign, noise=made.noise, begin=made)
    weighed = [one for candidate in _loads(made, order) for one in _weighed(made, candidate, order)]
    evidence, count, candidate = max(weighed, key=lambda one: one[0], default=(0.0, 0, None))
    if candidate is None or evidence < INFERENCE.prior_odds:
        return None
    grouped = replace(made, campaign=_parted(made.campaign, order, count))
    found = likeliest_difference(grouped, [_as_rare(one, candidate) for one in differences_of(grouped.campaign)])
    if found is None or found.comparison.candidate.effect.id not in LOADS:
        return None
    return LoadChange(found.comparison.candidate, found.fit, found.contenders, count)


def _parted(campaign: Campaign, order: Sequence[int], count: int) -> Campaign:
    """Return the logs in two groups, those before a time and those after it."""
    before = set(order[:count])
    return in_groups(campaign, [GROUPS[0] if i in before else GROUPS[1] for i in range(len(order))])


def _loads(made: CampaignFit, order: Sequence[int]) -> list[Candidate]:
    """Return the loads that the logs can show, in either group, as rare as one of all changes that are weighed."""
    ways = log(2.0 * (len(order) + 1 - 2 * INFERENCE.load_logs))
    differences = differences_of(_parted(made.campaign, order, INFERENCE.load_logs))
    loads = [one for one in differences if one.effect.id in LOADS]
    return [replace(one, log_alternatives=one.log_alternatives + ways) for one in loads]


def _as_rare(one: Candidate, load: Candidate) -> Candidate:
    return replace(one, log_alternatives=load.log_alternatives) if one.key == load.key else one


def _weighed(made: CampaignFit, load: Candidate, order: Sequence[int]) -> list[tuple[float, int, Candidate]]:
    """Return the evidence that a load adds, for every number of logs before the change."""
    counts, after = range(INFERENCE.load_logs, len(order) - INFERENCE.load_logs + 1), load.group == GROUPS[1]
    ways = []
    for count in counts:
        aboard = np.zeros(len(order), dtype=np.bool_)
        aboard[list(order[count:] if after else order[:count])] = True
        ways.append(aboard)
    return [(gain, count, load) for gain, count in zip(gains_of_ways(made, load, ways), counts, strict=True)]
