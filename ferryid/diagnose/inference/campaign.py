"""Logs of one vessel that are diagnosed together: which of them have a say, and the hull that they speak for."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from ferryid.counts import counted
from ferryid.diagnose.inference.campaign_estimation import CampaignFit
from ferryid.diagnose.inference.campaign_logs import Member
from ferryid.diagnose.inference.campaign_model import INDUCED, Campaign, HullPrior, induced, induced_spread
from ferryid.diagnose.inference.estimation import Candidate
from ferryid.diagnose.inference.prior import correlation_root, prior_force_model
from ferryid.diagnose.inference.sessions import in_time, sessions
from ferryid.diagnose.inference.stages import AveragedLog
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.inference.weak_form import Windows
from ferryid.effects import effects
from ferryid.effects.force_model import COEFFICIENTS, ForceModel
from ferryid.models import Model
from ferryid.signals.copies import searchable
from ferryid.types import Floats
from ferryid.vessel.dimensions import dimensions
from ferryid.vessel.profile import Profile

SAME = 1e-3
"""Of the standard deviation of the measured accelerations: two logs that are nearer than this in all windows are one."""


@dataclass(frozen=True)
class CommonHull:
    """The hull of several logs; `place` gives each path's place among them, for logs that have a say."""

    fit: CampaignFit
    place: Mapping[str, int]

    def force_model(self, path: str, plain: ForceModel) -> tuple[ForceModel, Floats]:
        """Return a log's force model: the hull that the other logs speak for, lasting properties, the log's own conditions.

        Beside it the standard deviations of the hull's coefficients, shape (26,).
        """
        i, n = self.place.get(path), len(COEFFICIENTS)
        mean, covariance = self.fit.belief(i)
        modelled = induced(replace(plain, hull=mean[:n]), mean[n:])
        campaign = self.fit.campaign
        own = np.zeros(campaign.l) if i is None else self.fit.own[i]
        conditions, group = ((), "") if i is None else (campaign.members[i].conditions, campaign.members[i].group)
        modelled = campaign.acted(modelled, conditions, self.fit.common, own, group)
        return modelled, np.sqrt(np.diag(covariance))[:n]

    def says(self, path: str) -> str:
        """Return a sentence on where the hull comes from that a log is diagnosed with."""
        others = len(self.place) - (path in self.place)
        # As a ratio of standard deviations, which people have a feeling for; the hull's uncertainty is widened by it.
        apart = sqrt(self.fit.disagreement)
        agree = (
            f"They disagree about it {apart:.1f} times as much as the noise in them explains, and it was taken to be uncertain "
            "accordingly."
            if apart > 1.0
            else "They disagree about it by no more than the noise in them explains."
        )
        return f"The hull is that of {counted(others, 'other log')} of the vessel, lift included. {agree}"


def assemble(
    logs: Sequence[AveragedLog], profile: Profile, model: Model | None = None, references: Collection[str] = ()
) -> tuple[Campaign, dict[str, int]] | None:
    """Return the campaign of several logs, and the place of each path in it; None where they are too few or too short.

    Parameters
    ----------
    logs
        In the weak form; those with fewer than `INFERENCE.campaign_windows` windows have no say.
    profile
        The vessel.
    model
        A model that brings the hull; the profile's where None.
    references
        Paths of those that bring the hull only. One that measured a condition which a log did not, such as the wind, has no
        other condition either: all that a log may have is then judged on the same logs, so that a current which the references
        speak for does not stand in for the wind of a log.
    """
    members: list[Member] = []
    spreads: list[Floats] = []
    place: dict[str, int] = {}
    again = {path for path, _ in repeated(logs)}
    for log in logs:
        windows = log.windows
        if len(windows.starts) < INFERENCE.campaign_windows or log.path in place or log.path in again:
            continue
        sha256 = log.screened.measured.survey.recording.sha256
        plain, spread = prior_force_model(windows.measurements, profile, model, sha256)
        place[log.path] = len(members)
        members.append(Member(windows, plain, conditions_of(windows, profile)))
        spreads.append(spread)
    if len(members) < 2 or sum(len(one.windows.starts) for one in members) < INFERENCE.fewest_windows:
        return None
    members = _conditions_of_logs(members, [path in references for path in place])
    length, _, draught = dimensions(profile)
    known = model is not None or profile.hull.is_known
    size = np.zeros(len(INDUCED)) if known else induced_spread(length, draught)
    mean = np.concatenate([members[0].plain.hull, np.zeros(len(INDUCED))])
    spread = np.append(np.max(spreads, axis=0), size)
    prior = HullPrior(mean, spread, known, None if model is None else correlation_root(model, spread))
    by_path = {one.path: one for one in reversed(logs)}
    taken = [by_path[path] for path in place]
    return Campaign(tuple(members), prior, sessions=sessions(taken), order=in_time(taken)), place


def _conditions_of_logs(members: Sequence[Member], reference: Sequence[bool]) -> list[Member]:
    """Return the logs of a campaign without conditions of references that measured one that a log did not."""
    wanted = {
        one.key for member, brings in zip(members, reference, strict=True) if not brings for one in member.conditions
    }
    return [
        replace(member, conditions=()) if brings and not wanted <= {one.key for one in member.conditions} else member
        for member, brings in zip(members, reference, strict=True)
    ]


def repeated(logs: Sequence[AveragedLog]) -> list[tuple[str, str]]:
    """Return the paths of logs that hold the motion of another before them, in whatever format, and that other's path."""
    found: list[tuple[str, str]] = []
    samples = searchable([log.screened.measured.survey.recording for log in logs])
    for k, log in enumerate(logs):
        for other, before in zip(logs[:k], samples, strict=False):
            if log.path != other.path and (_same(log.windows, other.windows) or samples[k].same(before)):
                found.append((log.path, other.path))
                break
    return found


def _same(one: Windows, other: Windows) -> bool:
    """Return whether two logs measured the same to a thousandth of what it varies by; clocks may differ."""
    if len(one.starts) != len(other.starts) or len(one.starts) == 0:
        return False
    scale = np.std(one.measured, axis=0)
    return bool((np.abs(one.measured - other.measured).max(axis=0) <= SAME * np.maximum(scale, 1e-12)).all())


def conditions_of(windows: Windows, profile: Profile) -> tuple[Candidate, ...]:
    """Return the conditions that a log may have of its own: those that it did not measure."""
    return tuple(
        Candidate.of(one, None, profile)
        for one in effects().values()
        if one.of_log and not one.untestable(windows.measurements)
    )
