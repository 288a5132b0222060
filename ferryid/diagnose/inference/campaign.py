"""Logs of one vessel, diagnosed together: read, and given one hull, before each is looked at by itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np

from ferryid.counts import counted
from ferryid.diagnose.inference.campaign_hull import INDUCED, CampaignHull, Member, fit_campaign_hull, induced_spread
from ferryid.diagnose.inference.estimation import Candidate
from ferryid.diagnose.inference.prior import prior_force_model
from ferryid.diagnose.inference.stages import AveragedLog
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.inference.weak_form import Windows
from ferryid.effects import effects
from ferryid.effects.force_model import ForceModel
from ferryid.errors import FerryIdError
from ferryid.types import Floats
from ferryid.vessel.dimensions import dimensions
from ferryid.vessel.profile import Profile

OWN = "wind"
"""What every log has its own of, where it can be told: the commonest of what a hull would otherwise take upon itself."""


@dataclass(frozen=True)
class Campaign:
    """Logs of one vessel and their common hull; `place` gives each path's place in it, for logs that have a say."""

    members: tuple[Member, ...]
    hull: CampaignHull
    place: Mapping[str, int]

    def force_model(self, path: str, plain: ForceModel) -> tuple[ForceModel, Floats]:
        """Return a log's force model with the hull that the other logs speak for, as `CampaignHull.force_model` does."""
        return self.hull.force_model(plain, self.place.get(path))

    def says(self, path: str) -> str:
        """Return a sentence on where the hull comes from that a log is diagnosed with."""
        others = len(self.members) - (path in self.place)
        # Told as a ratio of standard deviations, which people have a feeling for; the hull's uncertainty is widened by it.
        apart = sqrt(self.hull.disagreement)
        agree = (
            f"They disagree about it {apart:.1f} times as much as the noise in them explains, and it was taken to be uncertain "
            "accordingly."
            if apart > 1.0
            else "They disagree about it by no more than the noise in them explains."
        )
        return f"The hull is that of {counted(others, 'other log')} of the vessel, lift included. {agree}"


def fit_campaign(logs: Sequence[AveragedLog], profile: Profile, progress: Callable[[str], None]) -> Campaign:
    """Fit one hull to all logs of a vessel, with a steady wind of its own to each that did not measure it.

    Parameters
    ----------
    logs
        In the weak form; those with fewer than `INFERENCE.campaign_windows` windows have no say.
    profile
        The vessel.
    progress
        Called with the name of the stage.

    Raises
    ------
    FerryIdError
        For fewer than two logs with enough in them.
    """
    members: list[Member] = []
    spreads: list[Floats] = []
    place: dict[str, int] = {}
    for log in logs:
        windows = log.windows
        if len(windows.starts) < INFERENCE.campaign_windows or log.path in place:
            continue
        plain, spread = prior_force_model(windows.measurements, profile)
        place[log.path] = len(members)
        members.append(Member(windows, plain, own_candidates(windows, profile)))
        spreads.append(spread)
    if len(members) < 2:
        raise FerryIdError(
            f"--together: a common hull needs two logs of {profile.name} with a minute or more of motion each, found "
            f"{len(members)} of {len(logs)}. Fix: give more logs, or leave out --together"
        )
    progress(f"fitting one hull to {counted(len(members), 'log')}")
    length, _, draught = dimensions(profile)
    induced_size = np.zeros(len(INDUCED)) if profile.hull.has_model else induced_spread(length, draught)
    return Campaign(tuple(members), fit_campaign_hull(members, np.max(spreads, axis=0), induced_size), place)


def own_candidates(windows: Windows, profile: Profile) -> tuple[Candidate, ...]:
    """Return what a log is given of its own while the hull is fitted to all."""
    effect = effects()[OWN]
    return () if effect.cannot(windows.measurements) else (Candidate(effect, None, effect.parameters_of(profile)),)
