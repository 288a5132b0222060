"""Data of a fit in the weak form of which windows are known and no motion: those kept of an archive, or folds of a sweep."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ferryid.cached import cached_property
from ferryid.counts import counted
from ferryid.identify.excitation import sector_coverage
from ferryid.identify.fit_data import Coefficients, Estimate
from ferryid.identify.fit_warnings import general_warnings
from ferryid.identify.inertia.shares import axes_without_force
from ferryid.identify.log_sums import pooled_deviation
from ferryid.identify.log_windows import LogWindows, WindowPart
from ferryid.identify.outcome import ArchivedLog, Excitation, LogFit
from ferryid.identify.prediction_windows import PredictionWindows
from ferryid.identify.settings import FitSettings
from ferryid.identify.split import Split
from ferryid.identify.weak_data import WeakData
from ferryid.identify.weak_rows import WeakRows
from ferryid.identify.window_loads import LoadSamples
from ferryid.log_warnings import log_warnings
from ferryid.models import ModelScores, span_ranges
from ferryid.models.prediction import FreeRun
from ferryid.regression import CrossProducts, singular_values, undetermined_terms
from ferryid.regression.bases import Basis
from ferryid.types import Flags, Floats
from ferryid.vessel.profile import Profile

NOT_RUN = FreeRun.not_run("not run free: a fit over an archive sees no motion; ferryid evaluate runs it on a log")


@dataclass(frozen=True, eq=False)
class KnownWindows(PredictionWindows):
    """Windows of logs of which no motion is known.

    Attributes
    ----------
    trained, validated
        Training and validation windows, one part a log.
    chosen
        Whether the steadied velocity enters products; None: as the training windows say.
    """

    trained: tuple[WindowPart, ...]
    validated: tuple[WindowPart, ...]
    chosen: bool | None = None

    @cached_property
    def steadied(self) -> bool:
        """Whether the velocity that enters products is steadied by positions; see `PredictionWindows.velocities`."""
        if self.chosen is not None:
            return self.chosen
        if not any(len(part.nu) for part in self.trained):
            return False
        measured, steadied = (self._left([part.windows(each) for part in self.trained]) for each in (False, True))
        return steadied < measured

    @cached_property
    def training(self) -> tuple[WeakRows, ...]:
        """Windows within training rows, one a log."""
        return tuple(part.windows(self.steadied) for part in self.trained)

    @cached_property
    def validation(self) -> tuple[WeakRows, ...]:
        """Windows within validation rows, one a log."""
        return tuple(part.windows(self.steadied) for part in self.validated)

    def of_log(self, number: int) -> KnownWindows:
        """Return the windows of one log."""
        one = slice(number, number + 1)
        return replace(self, trained=self.trained[one], validated=self.validated[one], chosen=self.steadied)


@dataclass(frozen=True, eq=False)
class WindowedData(WeakData):
    """Logs as windows of the weak form; `motions` and what else has rows is empty.

    Attributes
    ----------
    logs
        The logs.
    trained, validated
        Their training and validation windows.
    """

    logs: tuple[LogWindows, ...]
    trained: tuple[WindowPart, ...]
    validated: tuple[WindowPart, ...]

    @classmethod
    def of(
        cls,
        profile: Profile,
        settings: FitSettings,
        functions: Basis,
        logs: Sequence[LogWindows],
        trained: Sequence[WindowPart],
        validated: Sequence[WindowPart],
        training_s: float | None = None,
    ) -> WindowedData:
        """Return the data of logs whose windows were divided; those that train may have a length of their own [s]."""
        parts = Split(settings.split, (), (), min(log.purge_s for log in logs))
        return cls(
            profile=profile,
            settings=settings,
            functions=functions,
            motions=(),
            targets=(),
            split=parts,
            errors=(),
            prepared=(),
            logs=tuple(logs),
            trained=tuple(trained),
            validated=tuple(validated),
            training_s=training_s,
        )

    def of_logs(self, places: Sequence[int]) -> WindowedData:
        """Return the data of the logs at some places."""
        if len(places) == len(self.logs):
            return self
        return replace(
            self,
            logs=tuple(self.logs[k] for k in places),
            trained=tuple(self.trained[k] for k in places),
            validated=tuple(self.validated[k] for k in places),
        )

    def undivided(self) -> None:
        """Return none: of validation rows no windows as long as those that train are kept."""

    @property
    def where(self) -> str:
        """Name of the first log, for messages."""
        return self.logs[0].name

    @property
    def log_names(self) -> tuple[str, ...]:
        """Names of the logs."""
        return tuple(log.name for log in self.logs)

    @cached_property
    def windows(self) -> KnownWindows:
        """Windows in which models are fitted and judged."""
        return KnownWindows(
            self.profile,
            self.settings,
            self.functions,
            (),
            self.split,
            self.trained,
            self.validated,
            training_s=self.training_s,
        )

    @property
    def load_samples(self) -> tuple[LoadSamples | None, ...]:
        """Motion at which the wind load of the training windows is evaluated, one a log."""
        return tuple(part.load(self.windows.steadied) for part in self.trained)

    @property
    def training_velocities(self) -> Floats:
        """Velocities of the training rows, one row a second, shape (n, 3)."""
        return np.concatenate([part.nu for part in self.trained])

    @property
    def visited(self) -> Floats:
        """Velocities of training and validation rows, one row a second, shape (n, 3)."""
        return np.concatenate([part.nu for part in (*self.trained, *self.validated)])

    @property
    def without_force(self) -> Flags:
        """Axes on which no actuator acts on the training rows, shape (3,)."""
        force, base = (np.array([getattr(part, name) for part in self.trained]) for name in ("force", "base"))
        return axes_without_force(pooled_deviation(force), pooled_deviation(base))

    @property
    def held_out_blocks(self) -> int:
        """Number of blocks as long as a window that the unbroken stretches of the validation rows hold."""
        return sum(part.blocks for part in self.validated)

    def scores(self, found: Coefficients, logs: Sequence[LogFit]) -> ModelScores:
        """Return the prediction errors in validation windows."""
        trained, validated = (
            sum(part.rows / log.rate_hz for log, part in zip(self.logs, parts, strict=True))
            for parts in (self.trained, self.validated)
        )
        by_logs = self.split.kind == "logs"
        note = f"{counted(len(self.logs), 'log')}: {trained:.0f} s train, {validated:.0f} s validate, " + (
            "whole logs, one of every three in a row." if by_logs else "in blocks of every log."
        )
        return ModelScores(
            self.windows.errors(found),
            rows=sum(len(one) for one in self.windows.validation),
            seconds=validated,
            split=self.split.kind,
            split_notes=(note,),
            measure="prediction",
        )

    def archived_logs(self, found: Coefficients) -> tuple[ArchivedLog, ...]:
        """Return how well the model predicts each log: the ratio of squared errors, NaN where it has no validation window."""
        told = []
        for number, log in enumerate(self.logs):
            held_out = self.validated[number]
            ratio = np.full(3, np.nan)
            if len(held_out.measured):
                ratio = self.windows.of_log(number).errors(found).ratio
            told.append(ArchivedLog(log.name, log.files, log.sha256, log.rows, held_out.rows, ratio, log.warnings))
        return tuple(told)

    def excitation(self, estimate: Estimate) -> Excitation:
        """Return what the training windows determine by themselves, without the prior."""
        source = CrossProducts.of(*self.whitened.rows)
        return Excitation(
            singular_values=singular_values(source),
            ranges=span_ranges([part.ranges for part in self.trained]),
            heading_coverage=sector_coverage(np.sum([part.sectors for part in self.trained], axis=0)),
            undetermined=undetermined_terms(source, self.functions.terms, estimate.functions.mask),
            vip=estimate.regression.vip(estimate.components),
        )

    def log_fits(self, found: Coefficients) -> tuple[LogFit, ...]:
        """Return none, as there is no motion."""
        return ()

    def free_runs(self, found: Coefficients, progress: Callable[[str], None]) -> tuple[FreeRun, FreeRun]:
        """Return no free runs, as there is no motion."""
        return NOT_RUN, NOT_RUN

    def training_logs(self) -> tuple[Mapping[str, Any], ...]:
        """Return the training logs as a model file lists them."""
        return self.with_conditions(
            (
                log.name,
                {
                    "name": log.name,
                    "files": list(log.files),
                    "sha256": log.sha256,
                    "seconds": part.rows / log.rate_hz,
                    "rows": part.rows,
                },
            )
            for log, part in zip(self.logs, self.trained, strict=True)
            if part.rows
        )

    def model_settings(self, estimate: Estimate) -> dict[str, Any]:
        """Return that the fit was to an archive, the rates of its logs, and the estimator."""
        return {
            "archive": True,
            "grid_hz": sorted({log.rate_hz for log in self.logs}),
            "estimator": "weak",
            "weak_window_s": self.windows.training_length_s,
        }

    def warnings(self, excitation: Excitation, scores: ModelScores) -> tuple[str, ...]:
        """Return what to know before trusting the scores, as sentences."""
        return (
            *general_warnings(self.settings, excitation, scores, len(self.logs)),
            *log_warnings([(log.name, log.warnings) for log in self.logs]),
        )
