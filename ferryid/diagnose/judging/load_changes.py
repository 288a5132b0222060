"""A load that came aboard, or was put ashore, between two logs of a campaign, judged on held-out stretches of its logs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ferryid.counts import counted
from ferryid.diagnose.inference.campaign_estimation import CampaignFit
from ferryid.diagnose.inference.campaign_properties import without_property
from ferryid.diagnose.inference.candidate import Candidate
from ferryid.diagnose.inference.load_changes import LoadChange, find_load_change
from ferryid.diagnose.judging.campaign_errors import LogErrors
from ferryid.diagnose.judging.campaign_evidence import HeldOutLoss, held_out_loss
from ferryid.diagnose.judging.finding import Finding
from ferryid.diagnose.judging.group_differences import Difference, judged_difference
from ferryid.effects.payload import whereabouts
from ferryid.types import AXES


@dataclass(frozen=True)
class LoadChangeTest:
    """What speaks for a load that is aboard in the logs on one side of a time alone.

    Attributes
    ----------
    change
        The load, and the logs in which it is aboard.
    difference
        The same as a difference between the logs after the time and those before it.
    loss
        Of held-out blocks, without it and with it.
    names
        Of the last log before the time and of the first one after it.
    """

    change: LoadChange
    difference: Difference
    loss: tuple[HeldOutLoss, HeldOutLoss]
    names: tuple[str, str]

    @property
    def fit(self) -> CampaignFit:
        """The logs with it."""
        return self.change.fit

    @property
    def confirmed(self) -> bool:
        """True where held-out data confirm it."""
        return not self.difference.doubt

    @property
    def says(self) -> str:
        """What it is, as sentences."""
        mass, x = (self.difference.estimates[name].value for name in ("mass", "x"))
        when, how = ("before", "came aboard") if self.change.after else ("after", "was put ashore")
        text = (
            f"Aboard were {mass:.0f} kg more than in the {counted(len(self.change.ashore), 'log')} {when}, {whereabouts(x)}: "
            f"a load {how} between {self.names[0]} and {self.names[1]}."
        )
        return text if self.confirmed else f"{text} It is estimated, not confirmed: {self.difference.doubt}."

    def beside(self, made: CampaignFit, candidate: Candidate) -> LoadChangeTest:
        """Return what speaks for it in another estimate of the same groups, of which `candidate` is the load."""
        return _tested(replace(self.change, fit=made, candidate=candidate), self.names)

    def finding(self, i: int) -> Finding | None:
        """Return it as a finding on a log; None where it is not aboard."""
        if i not in self.change.aboard:
            return None
        errors = LogErrors.of(self.fit, self.loss, i)
        improvement = errors.removed
        gained = np.maximum(improvement, 0.0)
        shares = gained / gained.sum() if gained.any() else np.zeros(len(AXES))
        t = errors.windows.measurements.t
        return Finding(
            effect=self.change.candidate.effect.id,
            instance=None,
            probability=self.difference.probability,
            parameters=self.difference.estimates,
            axes=dict(zip(AXES, shares.tolist(), strict=True)),
            intervals=((float(t[0]), float(t[-1])),),
            improvement=dict(zip(AXES, improvement.tolist(), strict=True)),
            mse=errors.mse,
            held_out=True,
            rivals=self.difference.rivals,
            unresolved_with=self.difference.unresolved_with,
            separating_manoeuvre=self.difference.separating_manoeuvre,
            says=self.says,
            evidence={"t": errors.windows.middle_s},
        )


def judge_load_change(made: CampaignFit, place: Mapping[str, int]) -> LoadChangeTest | None:
    """Find a load that is aboard in some of the logs, and judge it; None where the evidence favours none.

    `place` is which of the logs each path is.
    """
    change = find_load_change(made)
    if change is None:
        return None
    paths = {i: path for path, i in place.items()}
    last, first = (Path(paths[i]).name for i in made.campaign.order[change.count - 1 : change.count + 1])
    return _tested(change, (last, first))


def _tested(change: LoadChange, names: tuple[str, str]) -> LoadChangeTest:
    fit = change.fit
    difference = judged_difference(fit, change.candidate, change.contenders)
    loss = held_out_loss(without_property(fit, change.candidate)), held_out_loss(fit)
    return LoadChangeTest(change, difference, loss, names)
