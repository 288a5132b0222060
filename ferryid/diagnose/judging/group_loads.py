"""Mean wind and current of two groups of logs: what was measured, and what the logs of both show beside one hull."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.campaign_model import Campaign
from ferryid.diagnose.inference.group_differences import GROUPS
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.campaign_conditions import ConditionTest
from ferryid.effects import effects
from ferryid.types import Floats

BONFERRONI = 2.241 / 1.96
"""Half an interval of two at 95 % together over half a single one's at 95 %, of a normal distribution."""


@dataclass(frozen=True)
class LoadDifference:
    """A mean wind or current of group B less that of group A, north and east.

    Attributes
    ----------
    effect
        Its id.
    mean
        By group, of its logs.
    estimates
        The difference, by parameter.
    measured
        True where it was measured, and is not estimated from the motion.
    doubt
        Why the condition itself is not confirmed, as the end of a sentence; empty where it is.
    """

    effect: str
    mean: Mapping[str, Mapping[str, float]]
    estimates: Mapping[str, Estimate]
    measured: bool = False
    doubt: str = ""

    @property
    def differs(self) -> bool:
        """True where one of the two components differs from zero at 95 %, by Bonferroni's inequality."""
        return any(abs(one.value) > BONFERRONI * 0.5 * (one.high - one.low) for one in self.estimates.values())

    @property
    def says(self) -> str:
        """The difference as a sentence."""
        parts = ", ".join(
            f"{name} {one.value:+.2f} {one.unit} ({one.low:+.2f} to {one.high:+.2f})"
            for name, one in self.estimates.items()
        )
        how = "measured" if self.measured else "estimated"
        text = f"{effects()[self.effect].title}, {how}, mean of B less that of A: {parts}."
        return f"{text} It is estimated, not confirmed: {self.doubt}." if self.doubt else text


def load_differences(tests: Sequence[ConditionTest], campaign: Campaign) -> tuple[LoadDifference, ...]:
    """Return the mean of every condition of group B less that of group A, as measured and as estimated.

    What the evidence over all logs does not favour is left out.
    """
    found = [_measured(name, campaign) for name in ("wind", "current")]
    found += [_estimated(one) for one in tests if one.confirmed or one.estimated]
    return tuple(one for one in found if one is not None)


def _estimated(test: ConditionTest) -> LoadDifference | None:
    fit = test.fit
    campaign = fit.campaign
    groups = np.array([member.group for member in campaign.members])
    parameters, rows = test.parameters, test.rows
    size = np.array([one.size for one in parameters])
    # Weights of the logs' own parts in the difference; what all logs have in common cancels.
    weights = (groups == GROUPS[1]) / max(1, np.sum(groups == GROUPS[1])) - (groups == GROUPS[0]) / max(
        1, np.sum(groups == GROUPS[0])
    )
    back = -sum(w * one[rows] for w, one in zip(weights, fit.normal.back, strict=True))
    own = sum(w**2 * np.linalg.inv(one)[np.ix_(rows, rows)] for w, one in zip(weights, fit.normal.own, strict=True))
    covariance = back @ fit.normal.common_covariance @ back.T + own
    factor = INFERENCE.posterior_factor**2 * max(1.0, fit.disagreement)
    error = size * np.sqrt(factor * np.diag(covariance))
    neutral = np.array([one.neutral for one in parameters])
    each = neutral + size * (fit.common[campaign.means][rows] + fit.own[:, rows])
    mean = {
        group: dict(zip([one.name for one in parameters], each[groups == group].mean(axis=0).tolist(), strict=True))
        for group in GROUPS
    }
    apart = np.array([mean[GROUPS[1]][one.name] - mean[GROUPS[0]][one.name] for one in parameters])
    # What the formula of the load may be off, as of any reported estimate.
    error = np.hypot(error, effects()[test.effect].formula_error * np.abs(apart))
    estimates = {
        one.name: Estimate.normal(float(at), float(e), one.unit)
        for one, at, e in zip(parameters, apart, error, strict=True)
    }
    return LoadDifference(test.effect, mean, estimates, doubt=test.doubt)


def _measured(name: str, campaign: Campaign) -> LoadDifference | None:
    """Return what sensors measured; None where some log has none, or a group has no two logs to scatter."""
    every: dict[str, list[Floats]] = {group: [] for group in GROUPS}
    for member in campaign.members:
        seen = getattr(member.windows.measurements, name)
        if seen is None:
            return None
        every[member.group].append(np.nanmean(seen[member.windows.measurements.usable], axis=0))
    if any(len(one) < 2 for one in every.values()):
        return None
    axes = ("north", "east")
    means = {group: np.mean(one, axis=0) for group, one in every.items()}
    error = np.sqrt(sum(np.var(one, axis=0, ddof=1) / len(one) for one in every.values()))
    apart = means[GROUPS[1]] - means[GROUPS[0]]
    return LoadDifference(
        name,
        {group: dict(zip(axes, one.tolist(), strict=True)) for group, one in means.items()},
        {one: Estimate.normal(float(apart[k]), float(error[k]), "m/s") for k, one in enumerate(axes)},
        measured=True,
    )
