"""What a sweep of either kind says of its estimator."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ferryid.identify.outcome import EstimatorScore
from ferryid.identify.settings import TEST_WINDOW_S, FitSettings
from ferryid.types import Flags, Floats


def beats_base(over_base: Floats) -> Flags:
    """Return what errs less than the base model, on average over the axes on which that errs at all.

    Parameters
    ----------
    over_base
        Errors over the base model's, shape (..., 3); NaN where that makes none.
    """
    known = np.isfinite(over_base)
    mean = np.where(known, over_base, 0.0).sum(axis=-1) / np.maximum(known.sum(axis=-1), 1)
    return np.asarray(known.any(axis=-1) & (mean < 1.0))


@dataclass(frozen=True, kw_only=True)
class Swept:
    """The estimator that was swept.

    Attributes
    ----------
    settings
        How every fit was made; of a sweep of settings, its basis is the one that all logs allow.
    asked, estimator_says, estimators
        The estimator that was asked for; of ``"auto"`` a sentence that says which one was swept and why, and how well either
        predicts, where both were compared.
    test_window_s
        Smoothing window of the test rows [s], or in the weak form the length of the windows that are tested in.
    """

    settings: FitSettings
    asked: str = "derivative"
    estimator_says: str = ""
    estimators: tuple[EstimatorScore, ...] = ()
    test_window_s: float = TEST_WINDOW_S

    @property
    def weak(self) -> bool:
        """Whether the weak form was swept."""
        return self.settings.estimator == "weak"

    @property
    def tested(self) -> str:
        """What a fold tests: a row, or a window."""
        return "overlapping window" if self.weak else "row"

    @property
    def error(self) -> str:
        """What is compared."""
        return "squared prediction error" if self.weak else "force MSE"

    def estimator_json(self) -> dict[str, Any]:
        """Return the estimator as a sweep in JSON has it."""
        return {
            "estimator": {"asked": self.asked, "swept": self.settings.estimator, "says": self.estimator_says},
            "estimators": [one.to_json() for one in self.estimators],
        }
