"""One fit, or one sweep, over every log that was ingested: what is kept of each is added up, no row is read again.

Memory does not grow with the number of logs, apart from one cross-product each for the table of how well the model fits it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.cached import cached_property
from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.identify.archived_logs import archived_folders, refuse_other_basis
from ferryid.identify.block_sum_store import StoredSums, load_block_sums
from ferryid.identify.estimation import estimate_correction
from ferryid.identify.excitation import SECTORS, sector_coverage
from ferryid.identify.fit_data import Coefficients, Estimate, FitData
from ferryid.identify.fit_warnings import general_warnings, unused_window
from ferryid.identify.inertia.shares import axes_without_force
from ferryid.identify.log_sums import pooled_deviation, pooled_mean_square
from ferryid.identify.model_selection import select_model
from ferryid.identify.outcome import ArchivedLog, Excitation, FitOutcome, LogFit
from ferryid.identify.pipeline import accept_estimate
from ferryid.identify.settings import FOLDS, FitSettings, check_components
from ferryid.identify.split import validation_blocks
from ferryid.identify.weak_archive import fit_weak_archive
from ferryid.identify.window_store import load_windows
from ferryid.identify.windowed_data import NOT_RUN
from ferryid.log_warnings import log_warnings
from ferryid.models import ForceScores, ModelScores, span_ranges
from ferryid.models.prediction import FreeRun
from ferryid.models.store import check_name
from ferryid.regression import CrossProducts, singular_values, total, undetermined_terms
from ferryid.regression.bases import SWAY, Basis, make_basis
from ferryid.regression.cross_validation import Folds, FoldSums
from ferryid.types import Flags, Floats, RunContext
from ferryid.vessel.profile import Profile

MOST_DRAWN = 500
"""Blocks that the bootstrap draws from; with more of them several logs' blocks are joined."""


@dataclass(frozen=True, eq=False)
class _Log:
    """One log after its pieces were added up: what is told of it, and the sums of its validation rows.

    `reference` are the moments of the error of the model that others are judged against on these rows, shape (blocks, 3, 3).
    """

    name: str
    sha256: str
    files: tuple[str, ...]
    rate_hz: float
    rows: int
    training_rows: int
    validation: CrossProducts
    reference: Floats
    blocks: int
    warnings: tuple[str, ...]


class _Sums:
    """What a fit needs of all logs, added up for each window.

    Parameters
    ----------
    windows
        W, the number of windows.
    logs
        How many logs will be added.
    by_logs
        True: whole logs validate, one of every three in a row. False: blocks of every log.
    """

    def __init__(self, windows: int, logs: int, *, by_logs: bool) -> None:
        self.folds = FoldSums(windows, FOLDS)
        self.training: list[CrossProducts | None] = [None] * windows
        self.drawn: list[list[CrossProducts]] = [[] for _ in range(windows)]
        self.logs: list[_Log] = []
        self.ranges: list[Mapping[str, tuple[float, float]]] = []
        self.sectors = np.zeros(SECTORS, dtype=np.int64)
        self.force: list[Floats] = []
        self.base: list[Floats] = []
        self.validation_force: list[Floats] = []
        self.visited: list[Floats] = []
        self._apiece = max(1, MOST_DRAWN // logs)
        self._short = 0
        self._whole = validation_blocks(logs) if by_logs else None

    def add(self, log: StoredSums) -> None:
        """Add one log."""
        one = log.sums
        validates = self._validates(one.test.blocks)
        self.folds.add(one.training, one.test, ~validates)
        training_rows = 0
        for window, pieces in enumerate(one.training):
            parts = [part for part in pieces.separately(~validates) if part.n]
            if parts:
                sums = total(parts)
                training_rows = sums.n
                before = self.training[window]
                self.training[window] = sums if before is None else before + sums
                self._draw(self.drawn[window], parts)
        self.force.append(one.force)
        self.base.append(one.base)
        self.validation_force.append(one.force[validates])
        self.ranges.append(log.ranges)
        self.sectors += log.sectors
        self.visited.append(log.visited)
        validation = one.test.summed(validates[:, None])
        rows = int(one.test.n.sum())
        held_out = int(np.count_nonzero(validates & (one.test.n.sum(axis=1) > 0)))
        self.logs.append(
            _Log(
                log.name,
                log.sha256,
                log.files,
                log.rate_hz,
                rows,
                training_rows,
                validation,
                one.reference[validates],
                held_out,
                log.warnings,
            )
        )

    def _validates(self, blocks: int) -> Flags:
        if self._whole is not None:
            return np.full(blocks, self._whole[len(self.logs)])
        if blocks >= 3:
            return validation_blocks(blocks)
        # A log too short for blocks of its own is one block among those of its kind.
        self._short += 1
        return np.full(blocks, self._short % 3 == 2)

    def _draw(self, drawn: list[CrossProducts], parts: Sequence[CrossProducts]) -> None:
        """Add a log's training blocks to those that the bootstrap draws from, joined so that there are not too many."""
        joined = -(-len(parts) // self._apiece)
        for low in range(0, len(parts), joined):
            block = total(parts[low : low + joined])
            if len(drawn) < MOST_DRAWN:
                drawn.append(block)
            else:
                drawn[len(self.logs) % MOST_DRAWN] += block


@dataclass(frozen=True, eq=False)
class ArchiveData(FitData):
    """Sums of the logs of an archive at one window.

    Attributes
    ----------
    sums
        Sums at every window that was tried.
    window
        Which of these is fitted.
    """

    sums: _Sums
    window: int = 0

    @property
    def where(self) -> str:
        """Name of the first log, for messages."""
        return self.sums.logs[0].name

    @property
    def training(self) -> CrossProducts:
        """Basis and residual of the training blocks."""
        training = self.sums.training[self.window]
        assert training is not None
        return training

    @cached_property
    def validation(self) -> CrossProducts:
        """Basis and error of the validation blocks."""
        return total([log.validation for log in self.sums.logs])

    @property
    def without_force(self) -> Flags:
        """Axes on which no actuator acts, shape (3,)."""
        return axes_without_force(
            pooled_deviation(np.concatenate(self.sums.force)), pooled_deviation(np.concatenate(self.sums.base))
        )

    def resampling_blocks(
        self, theta: Floats, intercept: Floats
    ) -> tuple[Sequence[CrossProducts], float, tuple[str, ...]]:
        """Return the training blocks as they were kept."""
        return self.sums.drawn[self.window], float("nan"), ()

    def scores(self, found: Coefficients, logs: Sequence[LogFit]) -> ModelScores:
        """Return the force errors on validation blocks."""
        logged, validation = self.sums.logs, self.validation
        variance = pooled_deviation(np.concatenate(self.sums.validation_force)) ** 2
        trained = sum(log.training_rows / log.rate_hz for log in logged)
        validated = sum(log.validation.n / log.rate_hz for log in logged)
        by_logs = self.settings.split == "logs"
        note = f"{counted(len(logged), 'log')}: {trained:.0f} s train, {validated:.0f} s validate, " + (
            "whole logs, one of every three in a row." if by_logs else "in blocks of every log."
        )
        reference = np.concatenate([log.reference for log in logged])
        force = ForceScores.of(*_errors(validation, reference, found), variance)
        return ModelScores(
            force.without_sway() if self.settings.reduced else force,
            validation.n,
            validated,
            self.settings.split,
            (note,),
        )

    def archived_logs(self, found: Coefficients) -> tuple[ArchivedLog, ...]:
        """Return how well the model fits each log: the ratio of MSE on its validation rows, NaN where it has none."""
        logs = []
        for log in self.sums.logs:
            base, new = _errors(log.validation, log.reference, found)
            with np.errstate(divide="ignore", invalid="ignore"):
                ratio = np.where(base > 0.0, new / base, np.nan)
            logs.append(ArchivedLog(log.name, log.files, log.sha256, log.rows, log.validation.n, ratio, log.warnings))
        return tuple(logs)

    def excitation(self, estimate: Estimate) -> Excitation:
        """Return what the training blocks determine."""
        return Excitation(
            singular_values=singular_values(self.training),
            ranges=span_ranges(self.sums.ranges),
            heading_coverage=sector_coverage(self.sums.sectors),
            undetermined=undetermined_terms(self.training, self.functions.terms, estimate.functions.mask),
            vip=estimate.regression.vip(estimate.components),
        )

    @property
    def held_out_blocks(self) -> int:
        """Number of blocks that the validation rows come in."""
        return sum(log.blocks for log in self.sums.logs)

    @property
    def visited(self) -> Floats:
        """Velocities of evenly spaced rows of every log, shape (n, 3)."""
        return np.concatenate(self.sums.visited)

    def free_runs(self, found: Coefficients, progress: Callable[[str], None]) -> tuple[FreeRun, FreeRun]:
        """Return no free runs, as there is no motion."""
        return NOT_RUN, NOT_RUN

    def training_logs(self) -> tuple[Mapping[str, Any], ...]:
        """Return the training logs as a model file lists them."""
        return tuple(
            {
                "name": log.name,
                "files": list(log.files),
                "sha256": log.sha256,
                "seconds": log.training_rows / log.rate_hz,
                "rows": log.training_rows,
            }
            for log in self.sums.logs
            if log.training_rows
        )

    def model_settings(self, estimate: Estimate) -> dict[str, Any]:
        """Return that the fit was to an archive, and the rates of its logs."""
        return {"archive": True, "grid_hz": sorted({log.rate_hz for log in self.sums.logs})}

    def warnings(self, excitation: Excitation, scores: ModelScores) -> list[str]:
        """Return what to know before trusting the scores, as sentences."""
        logs = self.sums.logs
        auto = "The derivative's estimator was used, as auto does for an archive; --estimator weak uses the weak form."
        return [
            *([auto] if self.settings.estimator == "auto" else []),
            *unused_window(self.settings, "it is what an archive is fitted with unless another is asked for"),
            *general_warnings(self.settings, excitation, scores, len(logs)),
            *log_warnings([(log.name, log.warnings) for log in logs]),
        ]


def fit_archive(
    profile: Profile, settings: FitSettings, run: RunContext, names: Sequence[str] = (), *, name: str = ""
) -> FitOutcome:
    """Fit one correction to every log under an output folder; other arguments as in `ferryid.identify.pipeline.fit_logs`.

    Parameters
    ----------
    names
        Names or paths of the logs to take, all that were ingested with the profile where none is given.

    Raises
    ------
    FerryIdError
        For logs that cannot be added up, by name.
    """
    name, settings = check_name(name or profile.name), settings.on(profile)
    if settings.split == "every-kth":
        raise FerryIdError("--split every-kth: an archive keeps blocks, no rows. Fix: give blocks or logs")
    if settings.estimator == "weak":
        return fit_weak_archive(profile, settings, run, names, name)
    windows_s = settings.windows_s or (settings.window_s,)
    where = archived_folders(run.tables or run.out, profile, names)
    sums = _Sums(len(windows_s), len(where), by_logs=settings.split == "logs")
    functions = _add_logs(where, profile, settings, windows_s, sums.add, run.progress)
    check_components(settings.components, functions)
    data = ArchiveData(profile, settings, functions, sums)
    if not data.validation.n or not any(one.n for one in sums.training if one is not None):
        raise FerryIdError(
            f"{data.where}: too little for training and validation, found {counted(len(sums.logs), 'log')} of "
            f"{counted(sum(log.rows for log in sums.logs), 'row')}. Fix: ingest more or longer logs"
        )
    run.progress("fitting")
    components = settings.components
    if settings.windows_s or components == "auto":
        choice = select_model(
            profile, settings, functions, windows_s, sums.folds.folds(), data.without_force, where=data.where
        )
        components = choice.components
        data = replace(data, settings=replace(settings, window_s=choice.window_s), window=choice.window)
    estimate = estimate_correction(data, int(components), settings.draws, run.progress)
    return accept_estimate(data, estimate, name, run)


def keep_for_archive(folder: Path, profile: Profile, settings: FitSettings) -> None:
    """Work out what a fit to an archive adds up of the log in a folder of ``out/logs``, and keep it there.

    Raises
    ------
    FerryIdError
        For a log that cannot be used, and a folder that cannot be written.
    """
    settings = settings.on(profile)
    if settings.estimator == "weak":
        load_windows(folder, profile, settings, divided=settings.split == "blocks")
    else:
        load_block_sums(folder, profile, settings, settings.windows_s or (settings.window_s,))


def archive_folds(
    profile: Profile,
    settings: FitSettings,
    run: RunContext,
    windows_s: Sequence[float],
    names: Sequence[str],
    folds: int,
) -> tuple[Basis, Flags, dict[str, Folds], list[dict[str, Any]]]:
    """Return what a sweep needs of an archive: basis, axes without force, folds by stretches and whole logs, and the logs."""
    where = archived_folders(run.tables or run.out, profile, names)
    by = {"blocks": FoldSums(len(windows_s), folds)}
    if len(where) > 1:
        by["logs"] = FoldSums(len(windows_s), len(where), whole=True)
    force, base, told = [], [], []

    def add(log: StoredSums) -> None:
        for sums in by.values():
            sums.add(log.sums.training, log.sums.test)
        force.append(log.sums.force)
        base.append(log.sums.base)
        rows = int(log.sums.test.n.sum())
        told.append(
            {
                "name": log.name,
                "sha256": log.sha256,
                "seconds": rows / log.rate_hz,
                "rows": rows,
                "warnings": [*log.warnings],
            }
        )

    functions = _add_logs(where, profile, settings, windows_s, add, run.progress)
    free = axes_without_force(pooled_deviation(np.concatenate(force)), pooled_deviation(np.concatenate(base)))
    return functions, free, {key: sums.folds() for key, sums in by.items()}, told


def _add_logs(
    where: Sequence[Path],
    profile: Profile,
    settings: FitSettings,
    windows_s: Sequence[float],
    add: Callable[[StoredSums], None],
    progress: Callable[[str], None],
) -> Basis:
    """Add every log, one after the other, and return the basis that they share."""
    first: StoredSums | None = None
    for number, folder in enumerate(where):
        progress(f"adding up log {number + 1} of {len(where)}")
        log = load_block_sums(folder, profile, settings, windows_s)
        first = first or log
        refuse_other_basis((first.name, first.basis), (log.name, log.basis))
        add(log)
    assert first is not None
    functions = make_basis(first.basis, structure=settings.structure)
    return functions.without((SWAY,)) if settings.reduced else functions


def _errors(rows: CrossProducts, reference: Floats, found: Coefficients) -> tuple[Floats, Floats]:
    """Return the mean square error of the model to judge against and of the new model per axis, shape (3,)."""
    errors = rows.sse(found.theta[None], found.intercept[None])[0]
    return pooled_mean_square(reference), errors / max(rows.n, 1)
