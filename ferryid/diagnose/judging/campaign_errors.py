"""Held-out force errors of one log of a campaign, without and with what is confirmed over all logs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ferryid.diagnose.inference.campaign_estimation import CampaignFit
from ferryid.diagnose.inference.folds import by_block, draws
from ferryid.diagnose.inference.force_errors import mass_of
from ferryid.diagnose.inference.weak_form import Windows
from ferryid.diagnose.judging.campaign_evidence import HeldOutLoss, held_out_blocks
from ferryid.types import AXES, Floats, Ints


@dataclass(frozen=True)
class LogErrors:
    """Force errors of every window of a log under two hypotheses that were not fitted to it.

    Attributes
    ----------
    windows
        Of the log.
    before, after
        Model less measured, shape (J, 3) [N, N, N·m].
    """

    windows: Windows
    before: Floats
    after: Floats

    @classmethod
    def of(cls, made: CampaignFit, loss: tuple[HeldOutLoss, HeldOutLoss], i: int) -> LogErrors:
        """Return the errors of a log of a campaign, from its accelerations."""
        member = made.campaign.members[i]
        M = mass_of(member.plain.hull)
        before, after = (one.errors[i] @ M.T for one in loss)
        return cls(member.windows, before, after)

    @property
    def mse(self) -> tuple[Mapping[str, float], Mapping[str, float]]:
        """Their mean squares by axis, before and after."""
        before, after = (
            dict(zip(AXES, np.mean(one**2, axis=0).tolist(), strict=True)) for one in (self.before, self.after)
        )
        return before, after

    @property
    def removed(self) -> Floats:
        """Share of the mean square that the second hypothesis removes, by axis, shape (3,)."""
        before, after = (np.mean(one**2, axis=0) for one in (self.before, self.after))
        return np.asarray(1.0 - after / np.where(before > 0.0, before, np.inf))

    def beside(self, before: Floats, after: Floats) -> LogErrors:
        """Return the errors with what findings of the log alone change as well: their held-out errors, shape (J, 3) each."""
        return replace(self, after=self.after + (after - before))

    def ratio(self) -> dict[str, dict[str, float]]:
        """Return mean square after over before by axis, each with its 95 % block-bootstrap interval."""
        block = _blocks(self.windows)
        sums = [by_block(one**2, block) for one in (self.before, self.after)]
        picks = draws(block)
        drawn = (picks @ sums[1]) / np.maximum(picks @ sums[0], 1e-300)
        low, high = np.quantile(drawn, [0.025, 0.975], axis=0)
        return {
            axis: {"value": 1.0 - float(removed), "low": float(a), "high": float(b)}
            for axis, removed, a, b in zip(AXES, self.removed, low, high, strict=True)
        }

    def scores(self, window_s: float) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return `before` and `after` of a `Diagnosis`, without free runs; windows are so long [s]."""
        before, after = self.mse
        return {"mse": dict(before), "rows": len(self.before), "window_s": window_s}, {
            "mse": dict(after),
            "ratio": self.ratio(),
        }


def _blocks(windows: Windows) -> Ints:
    """Return the held-out block of every window, shape (J,)."""
    block = np.zeros(len(windows.starts), dtype=np.int64)
    for k, (rows, _) in enumerate(held_out_blocks(windows)):
        block[rows] = k
    return block
