"""Data of a fit as rows: smoothed motions, what the base model leaves of their force, and which rows train."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from ferryid.cached import cached_property
from ferryid.identify.contradictions import faint_force
from ferryid.identify.excitation import assess_excitation, still_axes, still_warnings
from ferryid.identify.fit_data import Coefficients, Estimate, FitData
from ferryid.identify.fit_warnings import fit_warnings
from ferryid.identify.inertia.shares import axes_without_force
from ferryid.identify.judged_split import judged_by_force
from ferryid.identify.outcome import Excitation, LogFit
from ferryid.identify.prediction_windows import PredictionWindows
from ferryid.identify.ratio_interval import LogErrors, ratio_interval
from ferryid.identify.rows import basis_for, grids, known_rows, rows_of
from ferryid.identify.settings import FitSettings, check_components
from ferryid.identify.shared_rows import SharedRows
from ferryid.identify.split import Split
from ferryid.identify.thresholds import IDENTIFY
from ferryid.models import ModelScores, force_scores
from ferryid.models.forces import Estimator, compute_residual, without_inputs
from ferryid.models.prediction import FreeRun, run_free
from ferryid.regression import CrossProducts, QrFactor, Rows, averaged_out, factorise
from ferryid.regression.resampling import Blocks, block_seconds
from ferryid.signals.prepare import Opened, Prepared, smoothed
from ferryid.signals.track import Motion, segments
from ferryid.types import Flags, Floats
from ferryid.vessel.dimensions import window_seconds
from ferryid.vessel.profile import Profile


@dataclass(frozen=True, eq=False)
class MotionData(FitData):
    """Motions and their residuals.

    Attributes
    ----------
    motions
        Smoothed motions of the logs.
    targets
        Residual that is fitted [N, N, N·m], shape (n, 3) each.
    split
        Which rows train and which validate.
    """

    motions: tuple[Motion, ...]
    targets: tuple[Floats, ...]
    split: Split

    @property
    def qualities(self) -> Sequence[Mapping[str, Any]]:
        """What is known of the quality of each log."""
        return [{} for _ in self.motions]

    @property
    def held_out(self) -> bool:
        """Whether some rows validate that do not train."""
        return self.split.kind != "none"

    @property
    def held_out_blocks(self) -> int:
        """Number of blocks as long as the usual window, whichever trained, that unbroken stretches of validation rows hold."""
        length_s = window_seconds(self.profile)
        return sum(
            int((stretch.stop - stretch.start) / motion.rate_hz / length_s + 1e-9)
            for motion, mask in zip(self.motions, self.split.validation, strict=True)
            for stretch in segments(mask)
        )

    @property
    def visited(self) -> Floats:
        """Velocities of training and validation rows, shape (n, 3)."""
        masks = [one | other for one, other in zip(self.split.training, self.split.validation, strict=True)]
        return stacked([motion.nu for motion in self.motions], masks)

    @property
    def where(self) -> str:
        """Name of the first log and how many there are beside it, for messages."""
        more = len(self.motions) - 1
        return self.motions[0].log + (f" and {more} more" if more else "")

    @cached_property
    def training(self) -> QrFactor | CrossProducts:
        """Basis and residual of the training rows."""
        return factorise(*self._training_rows(), names=self.functions.terms, where=self.where)

    @cached_property
    def without_force(self) -> Flags:
        """Axes on which no actuator acts on the training rows, shape (3,)."""
        rows = self.split.training
        tau = stacked([motion.tau for motion in self.motions], rows)
        return axes_without_force(np.std(tau, axis=0), np.std(tau - stacked(self.targets, rows), axis=0))

    def resampling_blocks(
        self, theta: Floats, intercept: Floats
    ) -> tuple[Blocks | Sequence[CrossProducts], float, tuple[str, ...]]:
        """Return blocks of training rows as long as the residual of these coefficients is correlated."""
        rows, rates = self._training_rows(), [motion.rate_hz for motion in self.motions]
        block_s, notes = block_seconds(rows, rates, theta, intercept)
        return Blocks.of(rows, rates, block_s), block_s, notes

    def base(self) -> Estimator:
        """Return the estimator that the correction comes on top of."""
        return Estimator(self.profile, self.settings.scale)

    def reference(self) -> tuple[Estimator, tuple[Motion, ...]]:
        """Return the estimator that the new model is judged against, and the motions as it sees them."""
        return self.base(), tuple(without_inputs(motion) for motion in self.motions)

    def estimator(self, found: Coefficients) -> Estimator:
        """Return the estimator of the new model."""
        return Estimator(self.profile, self.settings.scale, self.functions, found.theta, found.intercept)

    def excitation(self, estimate: Estimate) -> Excitation:
        """Return what the training rows determine."""
        return assess_excitation(
            self.training,
            self.functions.terms,
            estimate.regression.vip(estimate.components),
            self.motions,
            self.split.training,
            estimate.functions.mask,
        )

    def log_fits(self, found: Coefficients) -> tuple[LogFit, ...]:
        """Return the logs with the forces that both models estimate."""
        (old, seen), new = self.reference(), self.estimator(found)
        return tuple(
            LogFit(motion, training, validation, old.of(bare), new.of(motion), quality)
            for motion, bare, training, validation, quality in zip(
                self.motions, seen, self.split.training, self.split.validation, self.qualities, strict=True
            )
        )

    def scores(self, found: Coefficients, logs: Sequence[LogFit]) -> ModelScores:
        """Return the force errors on validation rows, or on training rows where nothing is held out."""
        masks = [log.validation if self.held_out else log.training for log in logs]
        tau = stacked([log.motion.tau for log in logs], masks)
        base, model = stacked([log.tau_base for log in logs], masks), stacked([log.tau_model for log in logs], masks)
        force = force_scores(tau, base, model, np.ones(len(tau), dtype=bool))
        errors = [
            LogErrors((log.motion.tau - log.tau_base)[mask], (log.motion.tau - log.tau_model)[mask], log.motion.t[mask])
            for log, mask in zip(logs, masks, strict=True)
        ]
        return ModelScores(
            force.without_sway() if self.settings.reduced else force,
            rows=len(tau),
            seconds=sum(float(mask.sum()) / log.motion.rate_hz for log, mask in zip(logs, masks, strict=True)),
            split=self.split.kind,
            split_notes=self.split.notes,
            interval=ratio_interval([one.without_sway() for one in errors] if self.settings.reduced else errors),
        )

    def _training_rows(self) -> list[Rows]:
        return rows_of(self.functions, self.motions, self.targets, self.split.training)


@dataclass(frozen=True, eq=False)
class LogData(MotionData):
    """Motions of logs, of which some rows train and others validate.

    Attributes
    ----------
    errors
        What the base model leaves of the measured force, shape (n, 3) each: the validation's residual.
    prepared
        The logs.
    shared
        Rows of the logs that folds and windows of several lengths have in common.
    """

    errors: tuple[Floats, ...]
    prepared: tuple[Prepared, ...]
    shared: SharedRows = field(default_factory=SharedRows, kw_only=True)

    @cached_property
    def validation(self) -> QrFactor | CrossProducts:
        """Basis and error of the validation rows."""
        return type(self.training).of(*rows_of(self.functions, self.motions, self.errors, self.split.validation))

    @cached_property
    def windows(self) -> PredictionWindows:
        """Windows in which models are judged."""
        return PredictionWindows(
            self.profile, self.settings, self.functions, self.motions, self.split, shared=self.shared
        )

    def scores(self, found: Coefficients, logs: Sequence[LogFit]) -> ModelScores:
        """Return prediction errors in windows; force errors for the thesis's estimator by its own criterion."""
        if self.settings.by_thesis or sum(len(one) for one in self.windows.judged) < IDENTIFY.fewest_judged:
            return super().scores(found, logs)
        return self.windows.scores(found)

    def undivided(self) -> Self | None:
        """Return the same data of which all rows train, where blocks were held out; logs held out whole may test the model."""
        if self.split.kind != "blocks":
            return None
        nothing = tuple(np.zeros_like(motion.valid) for motion in self.motions)
        return replace(self, split=Split("none", tuple(motion.valid for motion in self.motions), nothing, 0.0))

    def fold(self, split: Split) -> Self:
        """Return the same logs of whose training rows some validate."""
        return replace(self, split=split)

    @property
    def qualities(self) -> Sequence[Mapping[str, Any]]:
        """The logs' part of the `inspect` output."""
        return [one.quality for one in self.prepared]

    def free_runs(self, found: Coefficients, progress: Callable[[str], None]) -> tuple[FreeRun, FreeRun]:
        """Return free runs of the base model and of the new one on validation rows."""
        progress("running free")
        rows = self.split.validation
        base, seen = self.reference()
        return run_free(base, seen, rows), run_free(self.estimator(found), self.motions, rows)

    def training_logs(self) -> tuple[Mapping[str, Any], ...]:
        """Return the training logs as a model file lists them."""
        return tuple(
            {
                "name": one.motion.log,
                "files": [Path(file).name for file in one.recording.files],
                "sha256": one.recording.sha256,
                "seconds": float(mask.sum() / one.motion.rate_hz),
                "rows": int(mask.sum()),
            }
            for one, mask in zip(self.prepared, self.split.training, strict=True)
        )

    def model_settings(self, estimate: Estimate) -> dict[str, Any]:
        """Return grid rates and window lengths."""
        return {**grids(self.motions, self.settings), "estimator": "derivative"}

    def warnings(self, excitation: Excitation, scores: ModelScores) -> tuple[str, ...]:
        """Return what to know before trusting the scores, as sentences."""
        windows = [one for one in self.windows.training if len(one)]
        faint = ""
        if windows:
            force, needed = (
                np.concatenate(columns)
                for columns in zip(*((one.force, one.base(one.by_velocity)) for one in windows), strict=True)
            )
            known = np.array([1.0, 0.0 if self.settings.reduced else 1.0, 1.0])
            faint = faint_force(force * known, needed, f"the profile {self.profile.name}")
        unjudged = ""
        if (
            self.held_out
            and self.split.kind != "every-kth"
            and scores.measure == "force"
            and not self.settings.by_thesis
        ):
            unjudged = judged_by_force(self.split, self.motions, self.profile)
        return (
            *filter(None, [faint, unjudged]),
            *still_warnings(self.profile, self.motions),
            *averaged_out(self.profile, self.motions).says,
            *fit_warnings(self.settings, self.split, excitation, self.prepared, self.motions, scores),
        )


def prepared_data(
    profile: Profile,
    settings: FitSettings,
    opened: Sequence[Opened],
    progress: Callable[[str], None] = lambda said: None,
) -> LogData:
    """Return aligned logs smoothed, with residuals and without axes that do not move; errors of `compute_residuals`."""
    prepared = [smoothed(one, settings.window_s, settings.smoother) for one in opened]
    progress("computing the residual")
    data = compute_residuals(profile, settings, prepared)
    return replace(data, functions=data.functions.without(still_axes(profile, data.motions)))


def compute_residuals(
    profile: Profile, settings: FitSettings, prepared: Sequence[Prepared], kind: type[LogData] = LogData
) -> LogData:
    """Return smoothed logs with their residuals; rows on which something that is needed was not measured are no longer valid.

    No row trains or validates yet.

    Raises
    ------
    FerryIdError
        For more components than the basis has functions, and a log without a row on which all is known.
    """
    motions = numbered_names([one.motion for one in prepared])
    functions = basis_for(settings, motions)
    check_components(settings.components, functions)
    targets = [compute_residual(profile, motion, settings.scale, settings.residual) for motion in motions]
    errors = targets
    if settings.residual != "measured":
        errors = [compute_residual(profile, motion, settings.scale) for motion in motions]
    if settings.reduced:
        for residual in (*targets, *errors):
            residual[:, 1] = 0.0
    motions = [
        replace(motion, valid=known_rows(motion, functions, target, error))
        for motion, target, error in zip(motions, targets, errors, strict=True)
    ]
    return kind(
        profile,
        settings,
        functions,
        tuple(motions),
        tuple(targets),
        Split.nothing(motions),
        tuple(errors),
        tuple(prepared),
    )


def stacked(columns: Sequence[Floats], masks: Sequence[Flags]) -> Floats:
    """Return the marked rows of values of every log, one log below the other."""
    return np.concatenate([values[mask] for values, mask in zip(columns, masks, strict=True)])


def numbered_names(motions: Sequence[Motion]) -> list[Motion]:
    """Number logs of the same name, so that messages and figures can tell them apart."""
    names = [motion.log for motion in motions]
    return [
        replace(motion, log=f"{motion.log} ({names[: i + 1].count(motion.log)})")
        if names.count(motion.log) > 1
        else motion
        for i, motion in enumerate(motions)
    ]
