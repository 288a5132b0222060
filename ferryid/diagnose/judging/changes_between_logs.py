"""What changed between two logs of a campaign, a load or a thruster's force, judged on held-out stretches of its logs."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ferryid.counts import counted
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.campaign_estimation import CampaignFit
from ferryid.diagnose.inference.campaign_properties import LOADS, without_property
from ferryid.diagnose.inference.candidate import Candidate
from ferryid.diagnose.inference.changes_between_logs import Change, change_of_part, find_change
from ferryid.diagnose.judging.campaign_errors import LogErrors
from ferryid.diagnose.judging.campaign_evidence import HeldOutLoss, held_out_loss
from ferryid.diagnose.judging.difference import Difference
from ferryid.diagnose.judging.finding import Finding
from ferryid.diagnose.judging.group_differences import judged_difference
from ferryid.effects.payload import whereabouts
from ferryid.effects.wording import ALL_THRUSTERS, amount, listed
from ferryid.files import name_of_log
from ferryid.types import AXES, Flags


@dataclass(frozen=True)
class ChangeTest:
    """What speaks for a load or a fault that acts in the logs on one side of a time alone.

    Attributes
    ----------
    change
        The load or fault, and the logs in which it acts.
    difference
        The same as a difference between the logs after the time and those before it.
    loss
        Of held-out blocks, without it and with it.
    names
        Of the last log before the time and of the first one after it, or of all in which it acts where there is no such time.
    """

    change: Change
    difference: Difference
    loss: tuple[HeldOutLoss, HeldOutLoss]
    names: tuple[str, ...]

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
        says = _load if self.change.candidate.effect.id in LOADS else _loss_of_force
        rest = len(self.change.others)
        if self.change.count is None:
            what, _ = says(self.change, self.difference.estimates, f"in the {counted(rest, 'other log')}")
            text = f"{what}: in {listed(self.names)} alone."
        else:
            others = f"in the {counted(rest, 'log')} {'before' if self.change.after else 'after'}"
            what, how = says(self.change, self.difference.estimates, others)
            text = f"{what}: {how} between {self.names[0]} and {self.names[1]}."
        return text if self.confirmed else f"{text} It is estimated, not confirmed: {self.difference.doubt}."

    def beside(self, made: CampaignFit, candidate: Candidate) -> ChangeTest:
        """Return what speaks for it in another estimate of the same groups, in which it is `candidate`."""
        return _tested(replace(self.change, fit=made, candidate=candidate), self.names)

    def finding(self, i: int) -> Finding | None:
        """Return it as a finding on a log; None where it does not act."""
        if i not in self.change.acting:
            return None
        errors = LogErrors.of(self.fit, self.loss, i)
        improvement = errors.removed
        gained = np.maximum(improvement, 0.0)
        shares = gained / gained.sum() if gained.any() else np.zeros(len(AXES))
        t = errors.windows.measurements.t
        return Finding(
            effect=self.change.candidate.effect.id,
            instance=self.change.candidate.instance,
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


def _load(change: Change, estimates: Mapping[str, Estimate], others: str) -> tuple[str, str]:
    """Return what is aboard, and how it came to be so."""
    mass, x = (estimates[name].value for name in ("mass", "x"))
    how = "a load came aboard" if change.after else "a load was put ashore"
    return f"Aboard were {amount(mass)} kg more than {others}, {whereabouts(x)}", how


def _loss_of_force(change: Change, estimates: Mapping[str, Estimate], others: str) -> tuple[str, str]:
    """Return how much less force there is, and how that came to be so."""
    whose = change.candidate.instance
    gave = "Every actuator gave" if whose == ALL_THRUSTERS else f"{whose} gave"
    how = "it weakened" if change.after else "it came back"
    return f"{gave} {100.0 * estimates['factor'].value:.0f} % of the force that it had {others}", how


def judge_change(made: CampaignFit, place: Mapping[str, int], changed: Collection[str] = ()) -> ChangeTest | None:
    """Find a load or a loss of force in some of the logs, and judge it; None where the evidence favours none.

    Parameters
    ----------
    made
        What the logs say together, without it.
    place
        Which of the logs each path is.
    changed
        Paths of logs that no hull fits that is common to them and the others, unless something of that kind acts in them.
    """
    paths = {i: path for path, i in place.items()}
    inside = np.array([paths[i] in changed for i in range(len(paths))])
    part = judge_part(made, inside, [name_of_log(paths[i]) for i in range(len(paths))]) if changed else None
    change = None if part is not None and part.confirmed else find_change(made)
    if change is None:
        return part
    assert change.count is not None
    last, first = (name_of_log(paths[i]) for i in made.campaign.order[change.count - 1 : change.count + 1])
    return _tested(change, (last, first))


def judge_part(made: CampaignFit, inside: Flags, names: Sequence[str]) -> ChangeTest | None:
    """Judge a load or a loss of force in some logs, or in the others; None where the evidence favours none.

    Parameters
    ----------
    made
        What the logs say together, without it.
    inside
        Which of them, shape (L,).
    names
        Those of all.
    """
    change = change_of_part(made, inside)
    return None if change is None else _tested(change, tuple(names[i] for i in change.acting))


def _tested(change: Change, names: tuple[str, ...]) -> ChangeTest:
    fit = change.fit
    difference = judged_difference(fit, change.candidate, change.contenders)
    loss = held_out_loss(without_property(fit, change.candidate)), held_out_loss(fit)
    return ChangeTest(change, difference, loss, names)
