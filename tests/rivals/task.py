"""What every method is given: logs of one vessel to learn from, smoothed alike, and what every method returns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ferryid.cached import cached_property
from ferryid.identify.fit_data import Coefficients
from ferryid.identify.motion_data import LogData, compute_residuals
from ferryid.identify.prediction_windows import PredictionWindows
from ferryid.identify.settings import TEST_WINDOW_S, FitSettings
from ferryid.identify.split import Split
from ferryid.models.forces import Estimator
from ferryid.regression.bases import Basis
from ferryid.signals.prepare import Opened, Prepared
from ferryid.signals.smooth import smooth_measured
from ferryid.types import Floats
from ferryid.vessel.profile import Profile


@dataclass(frozen=True, eq=False)
class Task:
    """Logs of one vessel to learn from.

    Attributes
    ----------
    profile
        The vessel; its model is the base model.
    logs
        Logs on their grids.
    settings
        Those of `ferryid fit`.
    """

    profile: Profile
    logs: tuple[Opened, ...]
    settings: FitSettings

    @classmethod
    def of(cls, profile: Profile, logs: Sequence[Opened], **settings: object) -> Task:
        """Return a task with the default settings, except for those given."""
        return cls(profile, tuple(logs), FitSettings(**settings).on(profile))

    @cached_property
    def data(self) -> LogData:
        """Smoothed motions of which every valid row trains."""
        motions = [smooth_measured(one.measured, TEST_WINDOW_S) for one in self.logs]
        prepared = [Prepared(one.recording, motion) for one, motion in zip(self.logs, motions, strict=True)]
        data = compute_residuals(self.profile, self.settings, prepared)
        none = tuple(np.zeros(len(motion.t), dtype=bool) for motion in data.motions)
        valid = tuple(motion.valid for motion in data.motions)
        return LogData(**{**vars_of(data), "split": Split("none", valid, none, 0.0)})

    @property
    def functions(self) -> Basis:
        """Terms of the correction and where they act."""
        return self.data.functions

    @cached_property
    def windows(self) -> PredictionWindows:
        """Windows over which the equations of motion are averaged."""
        return self.data.windows

    def estimator(self, found: Coefficients) -> Estimator:
        """Return the force of base model and correction."""
        return Estimator(self.profile, self.settings.scale, self.functions, found.theta, found.intercept)


def vars_of(data: LogData) -> dict[str, object]:
    """Return the fields of a fit's data, without what was worked out from them."""
    return {name: getattr(data, name) for name in data.__dataclass_fields__}


def coefficients(theta: Floats, intercept: Floats, error: Floats | None = None) -> Coefficients:
    """Return coefficients, with 95 % intervals where their standard errors are known, (K, 3)."""
    K = len(theta)
    reach = np.full((K, 3), np.nan) if error is None else 1.96 * error
    nothing = np.full(3, np.nan)
    covariance = np.full((3, K + 1, K + 1), np.nan)
    return Coefficients(theta, intercept, theta - reach, theta + reach, nothing, nothing, covariance)
