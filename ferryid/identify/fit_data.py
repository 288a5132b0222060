"""What a fit needs of its data, whether these are rows of logs, motions in memory, or sums kept of an archive."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ferryid.identify.feasible import Feasible
from ferryid.identify.log_condition import KindOutcome, LogCondition
from ferryid.identify.outcome import ArchivedLog, Excitation, LogFit, LogWind
from ferryid.identify.settings import FitSettings
from ferryid.models import ModelScores
from ferryid.models.prediction import FreeRun
from ferryid.regression import CrossProducts, QrFactor, Simpls
from ferryid.regression.bases import Basis
from ferryid.regression.resampling import Blocks
from ferryid.types import Flags, Floats
from ferryid.vessel.profile import Profile


@dataclass(frozen=True, eq=False)
class Coefficients:
    """Coefficients and intercepts with 95 % intervals and covariance, NaN where no draws were asked for.

    Attributes
    ----------
    theta, low, high
        Shape (K, 3).
    intercept, intercept_low, intercept_high
        Shape (3,).
    covariance
        Per axis, over coefficients and intercept (last), shape (3, K + 1, K + 1).
    """

    theta: Floats
    intercept: Floats
    low: Floats
    high: Floats
    intercept_low: Floats
    intercept_high: Floats
    covariance: Floats


@dataclass(frozen=True, eq=False)
class Estimate:
    """An estimated correction.

    Attributes
    ----------
    functions
        The basis; its mask is without the acceleration terms of axes on which the inertia was held.
    regression
        SIMPLS with every number of components.
    components
        Number of components of the correction.
    coefficients
        The correction.
    held
        Why the inertia was held, a sentence for each axis.
    notes
        What to know before trusting the intervals.
    """

    functions: Basis
    regression: Simpls
    components: int
    coefficients: Coefficients
    held: tuple[str, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class FitData(ABC):
    """Data of a fit.

    Attributes
    ----------
    profile, settings, functions
        Vessel, how to fit, and basis.
    """

    profile: Profile
    settings: FitSettings
    functions: Basis

    @property
    @abstractmethod
    def where(self) -> str:
        """Name of the first log, for messages."""

    @property
    def held_out(self) -> bool:
        """Whether some rows validate that do not train."""
        return True

    @property
    @abstractmethod
    def training(self) -> CrossProducts | QrFactor:
        """Basis and residual of the training rows."""

    @property
    @abstractmethod
    def validation(self) -> CrossProducts | QrFactor:
        """Basis and residual of the rows that the model is judged on."""

    @property
    @abstractmethod
    def without_force(self) -> Flags:
        """Axes on which no actuator acts on the training rows, shape (3,)."""

    @property
    def before(self) -> Floats | None:
        """Coefficients that those estimated come on top of, shape (K, 3); None: on top of the base model alone."""
        return None

    @abstractmethod
    def resampling_blocks(
        self, theta: Floats, intercept: Floats
    ) -> tuple[Blocks | Sequence[CrossProducts], float, tuple[str, ...]]:
        """Return blocks of training rows for the bootstrap of these coefficients, their length [s], and notes on it."""

    def fitted(self, regression: Simpls) -> tuple[Floats, Floats]:
        """Return coefficients and intercepts for every number of components, as `validation` takes them."""
        return regression.coefficients, regression.intercepts

    def force_form(self, coefficients: Floats, intercepts: Floats) -> tuple[Floats, Floats]:
        """Return estimated coefficients, shape (..., K, 3), and intercepts, (..., 3), as those of the applied force."""
        return coefficients, intercepts

    def scattered(self, coefficients: Floats, mask: Flags) -> Floats:
        """Return coefficients of draws, (draws, K, 3), with the scatter that drawing rows again does not bring.

        `mask`, shape (K, 3), has those that are estimated: what is held has no scatter.
        """
        return coefficients

    def feasible(self, coefficients: Floats, mask: Flags) -> Feasible | None:
        """Return the coefficients nearest to estimated ones, (K, 3), that physics allows; None: they stay as they are."""
        return None

    @property
    def inertia_spans(self) -> Floats:
        """Between which inertias the truth lies on each axis, shape (3, 2); NaN where nothing is known of it."""
        return np.full((3, 2), np.nan)

    def undivided(self) -> FitData | None:
        """Return the same data of which all rows train, for the coefficients that are stored; None: the training rows' are."""
        return None

    def combined(self, found: Coefficients) -> Coefficients:
        """Return the coefficients of the new model: those found on top of what was there before."""
        return found

    @abstractmethod
    def scores(self, found: Coefficients, logs: Sequence[LogFit]) -> ModelScores:
        """Return the force errors of the new model; `logs` are those of `log_fits`."""

    @abstractmethod
    def excitation(self, estimate: Estimate) -> Excitation:
        """Return what the training rows determine."""

    @property
    @abstractmethod
    def held_out_blocks(self) -> int:
        """Number of blocks that the validation rows come in."""

    @property
    @abstractmethod
    def visited(self) -> Floats:
        """Velocities of training and validation rows, or of evenly spaced ones of them, shape (n, 3)."""

    @abstractmethod
    def free_runs(self, found: Coefficients, progress: Callable[[str], None]) -> tuple[FreeRun, FreeRun]:
        """Return free runs of the base model and of the new one on validation rows."""

    def log_fits(self, found: Coefficients) -> tuple[LogFit, ...]:
        """Return the logs with the forces that both models estimate, where there are rows of them."""
        return ()

    @property
    def winds(self) -> tuple[LogWind, ...]:
        """Steady winds of the logs in which nobody measured them."""
        return ()

    @property
    def condition_notes(self) -> tuple[str, ...]:
        """Why no wind is estimated where the profile has its load, as sentences."""
        return ()

    @property
    def condition_kinds(self) -> tuple[KindOutcome, ...]:
        """What spoke for each kind of condition that was considered besides wind."""
        return ()

    @property
    def log_conditions(self) -> tuple[LogCondition, ...]:
        """Conditions besides wind that the logs have of their own."""
        return ()

    def archived_logs(self, found: Coefficients) -> tuple[ArchivedLog, ...]:
        """Return the logs of an archive with their scores."""
        return ()

    @abstractmethod
    def training_logs(self) -> tuple[Mapping[str, Any], ...]:
        """Return the training logs as a model file lists them."""

    @abstractmethod
    def model_settings(self, estimate: Estimate) -> dict[str, Any]:
        """Return what a model file says of the fit besides its settings, basis and number of components."""

    def ranges(self, excitation: Excitation) -> Mapping[str, tuple[float, float]]:
        """Return the new model's ranges of validity."""
        return excitation.ranges

    @abstractmethod
    def warnings(self, excitation: Excitation, scores: ModelScores) -> Sequence[str]:
        """Return what to know before trusting the scores, as sentences."""
