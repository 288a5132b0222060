"""How much of what a hidden sensor explains an estimate explains: held-out gains over all logs of a campaign."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite

import numpy as np

from ferryid.counts import all_counted
from ferryid.diagnose.data.measurements import window_lengths
from ferryid.diagnose.inference.campaign_estimation import estimate_campaign
from ferryid.diagnose.inference.campaign_logs import Member
from ferryid.diagnose.inference.folds import draws
from ferryid.diagnose.inference.prior import prior_force_model
from ferryid.diagnose.inference.stages import AveragedLog
from ferryid.diagnose.inference.weak_form import windows
from ferryid.diagnose.judging.campaign_conditions import ConditionTest
from ferryid.diagnose.judging.campaign_evidence import Gain, held_out_loss, with_conditions
from ferryid.effects.force_model import Measurements
from ferryid.models import Model
from ferryid.signals.complementary_filter import CUBIC_S
from ferryid.signals.smooth import odd_rows, steady_cubic
from ferryid.types import Floats


@dataclass(frozen=True)
class HiddenGain:
    """Held-out log-likelihood over no such condition, of all logs of a campaign together.

    Attributes
    ----------
    estimated
        Of the condition as it was estimated, steady in each log.
    measured
        Of what the hidden sensor measured, over time, with the loads of the profile.
    share, low, high
        The one over the other with its 95 % block-bootstrap interval; NaN where what was measured does not surely gain.
    logs
        How many they are.
    """

    estimated: Gain
    measured: Gain
    share: float
    low: float
    high: float
    logs: int

    @classmethod
    def of(cls, estimated: Floats, measured: Floats, logs: int) -> HiddenGain:
        """Return it from the gains of the same blocks, shape (blocks,) each."""
        gains = Gain.of(estimated), Gain.of(measured)
        if gains[1].low <= 0.0:
            return cls(*gains, np.nan, np.nan, np.nan, logs)
        picks = draws(np.arange(len(measured)))
        low, high = np.quantile((picks @ estimated) / (picks @ measured), [0.025, 0.975])
        return cls(*gains, gains[0].total / gains[1].total, float(low), float(high), logs)

    def says(self, signal: str) -> str:
        """Return it as a sentence."""
        where = "Held out" if self.logs == 1 else f"Held out over {all_counted(self.logs, 'log')}"
        told = f"{where}, the {signal} as it was measured gains {_range(self.measured)}"
        estimated = f"the estimated one, steady in each log, {_range(self.estimated)}"
        if not isfinite(self.share):
            return f"{told}, which may be nothing, so that no share of it can be given; {estimated}."
        return (
            f"{told}; {estimated}: {100.0 * self.share:.0f} % of it "
            f"({100.0 * self.low:.0f} to {100.0 * self.high:.0f} %)."
        )

    def to_json(self) -> dict[str, object]:
        """Return it as plain values; null where nothing is known."""
        known = isfinite(self.share)
        return {
            "estimated": vars(self.estimated),
            "measured": vars(self.measured),
            "share": {"value": self.share, "low": self.low, "high": self.high} if known else None,
            "logs": self.logs,
        }


def _range(gain: Gain) -> str:
    return f"{gain.total:+.0f} nat ({gain.low:+.0f} to {gain.high:+.0f})"


def hidden_gains(
    tests: Sequence[ConditionTest], place: Mapping[str, int], logs: Sequence[AveragedLog], model: Model | None = None
) -> dict[str, HiddenGain]:
    """Return by hidden signal how much of what it explains was found; none for what is no condition of a campaign.

    Parameters
    ----------
    tests
        Of the conditions.
    place
        Each path's place in the campaign.
    logs
        In the weak form, with what was hidden of each.
    model
        That brings the hull; the profile's where None.
    """
    found = {}
    for test in tests:
        members, told = list(test.fit.campaign.members), set[int]()
        for log in logs:
            i = place.get(log.path)
            known = None if i is None else _informed(test, i, log, model)
            if i is not None and known is not None:
                members[i] = known
                told.add(i)
        blind = {i for i, one in enumerate(members) if any(has.effect.id == test.effect for has in one.conditions)}
        # Some may have had no sensor; references measured what they had.
        if told and blind == told:
            found[test.effect] = gain_of(test, members, len(told))
    return found


def gain_of(test: ConditionTest, informed: Sequence[Member], logs: int) -> HiddenGain:
    """Return the gain of a condition that some logs know, in the place of estimating it, under the noise of the estimate."""
    campaign = with_conditions(replace(test.fit.campaign, members=tuple(informed)), frozenset(test.beside))
    made = estimate_campaign(campaign, noise=test.fit.noise)
    estimated, measured = (one.gain(test.loss[0]) for one in (test.loss[1], held_out_loss(made)))
    return HiddenGain.of(estimated, measured, logs)


def _informed(test: ConditionTest, i: int, log: AveragedLog, model: Model | None) -> Member | None:
    """Return a log of a campaign that knows what was hidden from it; None where nothing of that was."""
    hidden = log.screened.measured.survey.hidden.get(test.effect)
    if hidden is None:
        return None
    measurements, member = log.screened.measurements, test.fit.campaign.members[i]
    flow = bridged(measurements, hidden)
    shown = replace(measurements, wind=flow) if test.effect == "wind" else replace(measurements, current=flow)
    seen = windows(shown, *window_lengths(measurements.profile))
    sha256 = log.screened.measured.survey.recording.sha256
    plain, _ = prior_force_model(seen.measurements, measurements.profile, model, sha256)
    return replace(member, windows=seen, plain=plain)


def bridged(measurements: Measurements, hidden: Floats) -> Floats:
    """Return a hidden flow on the rows of the measurements, gaps bridged, smoothed as a measured one is, shape (n, 2)."""
    known = np.isfinite(hidden).all(axis=1)
    t = measurements.t
    columns = [np.interp(t, t[: len(hidden)][known], column[known]) for column in hidden.T]
    return steady_cubic(np.column_stack(columns), odd_rows(CUBIC_S, 1.0 / measurements.step_s))
