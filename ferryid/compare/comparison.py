"""Compare models of one vessel: on logs their errors on the same rows, and the coefficients of their equations of motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ferryid.compare.candidates import Candidate, CandidateSet, trained_on
from ferryid.compare.coefficient_table import coefficient_rows, effect_rows, term_rows
from ferryid.compare.comparison_result import (
    Coefficients,
    CommonErrors,
    ComparedModel,
    ComparisonResult,
    FreeRunCounts,
    LogErrors,
    ModelErrors,
    ModelPair,
    PredictionErrors,
    Ratio,
)
from ferryid.compare.comparison_statements import PairedErrors, comparison_statements
from ferryid.compare.evaluation import range_warnings
from ferryid.compare.thresholds import COMPARE
from ferryid.compare.tracking import tracking_scores
from ferryid.counts import counted, verb
from ferryid.errors import FerryIdError
from ferryid.identify import check_window
from ferryid.log_warnings import left_out_together
from ferryid.models import usable_rows
from ferryid.models.forces import effective_mass, model_estimator
from ferryid.models.prediction import (
    HORIZONS_S,
    NO_MASS,
    Prediction,
    WindowErrors,
    predict,
    runs_free,
    single_paths,
    starting_points,
    window_errors,
)
from ferryid.regression.resampling import (
    PairedRatios,
    compare_pairs,
    has_enough_blocks,
    paired_block_seconds,
    sum_over_blocks,
)
from ferryid.signals.copies import GivenLogs
from ferryid.signals.prepare import Prepared, prepare
from ferryid.signals.track import Motion
from ferryid.signals.usable import left_out_of, usable
from ferryid.types import AXES, Flags, Floats, Ints, RunContext, by_axis
from ferryid.vessel.dimensions import window_seconds
from ferryid.vessel.profile import Profile

KEYS = ("position_m", "heading_rad", "speed_mps", "yaw_rate_radps")
"""Errors of free runs in JSON, in the order of `QUANTITIES`."""


@dataclass(frozen=True)
class ComparedLog:
    """One log, and what every model makes of it.

    Attributes
    ----------
    name, sha256
        Of the log; the name is unique in a comparison.
    motion
        Smoothed motion with the measured force.
    rows
        The rows on which measurement and every model's force are known, shape (n,).
    taus
        Force that each of m models estimates [N, N, N·m], shape (m, n, 3).
    sums
        Squared force errors summed over blocks, shape (blocks, m, 3); zero in sway where that was not measured.
    block_s
        Length of a block [s].
    window_force
        Force in J windows [N, N, N·m], shape (J, 3).
    window_sums
        Squared errors of the acceleration in these windows, as forces, summed over blocks, shape (blocks, m, 3).
    starts_s
        When each free run starts [s], shape (s,).
    errors
        Absolute errors of the free runs, shape (m, s, horizons, 4); NaN where a run did not get there.
    reached
        Horizons that lie within the stretch of a run, shape (s, horizons).
    runnable
        Models whose mass matrix allows free runs, shape (m,).
    paths, path_rows
        Where the free runs went north and east [m], shape (m, s, k, 2), and the rows of the log at these k times, shape (s, k);
        NaN where a run did not get there.
    warnings
        What a reader must know of this log.
    trained
        Labels of the models that were trained on it.
    """

    name: str
    sha256: str
    motion: Motion
    rows: Flags
    taus: Floats
    sums: Floats
    block_s: float
    window_force: Floats
    window_sums: Floats
    starts_s: Floats
    errors: Floats
    reached: Flags
    runnable: Flags
    paths: Floats
    path_rows: Ints
    warnings: tuple[str, ...]
    trained: tuple[str, ...] = ()


@dataclass(frozen=True)
class Comparison:
    """The result, and the logs for figures."""

    result: ComparisonResult
    logs: tuple[ComparedLog, ...]


def compare(
    field: CandidateSet,
    logs: Sequence[str],
    run: RunContext,
    *,
    window_s: float = 1.0,
    leave_out: bool = True,
) -> Comparison:
    """Compare two or more models, and their base model with them.

    All are judged on the same rows of test data smoothed alike, whatever each was trained with, and run free from the same
    starts. Ratios of their errors come with 95 % intervals from resampling blocks of each log, in pairs.

    Parameters
    ----------
    field
        The models, from `ferryid.compare.candidates.select_candidates`.
    logs
        Paths; parts of one recording joined by ``+``.
    run
        Output folder and progress.
    window_s
        Smoothing window of the test data [s].
    leave_out
        Leave out one of several logs that cannot be used, with a warning; False: refuse it.

    Raises
    ------
    FerryIdError
        For a log given twice, and where none can be used: one that lacks what a model needs, or has no row that all can be
        judged on, is left out of several with a warning.
    """
    check_window(window_s)
    compared: list[ComparedLog] = []
    given = GivenLogs()

    def on(path: str) -> ComparedLog:
        run.progress(f"comparing on {Path(path).name}")
        return _compare_log(field, path, run, window_s, given, [log.name for log in compared])

    errors: dict[str, FerryIdError] = {}
    for log in usable(logs, on, errors) if leave_out else map(on, logs):
        compared.append(log)
    run.progress("comparing")
    runnable, notes = _models_that_run(field.candidates, compared)
    judged = [_pair_errors(field, [log], runnable) for log in compared]
    pooled = _pair_errors(field, compared, runnable) if len(compared) > 1 else None
    every = [*judged, *([pooled] if pooled else [])]
    result = ComparisonResult(
        schema="ferryid.compare/1",
        vessel=field.profile.name,
        window_s=window_s,
        prediction_window_s=window_seconds(field.profile),
        models=tuple(_model(one) for one in field.candidates),
        warnings=(*field.warnings, *notes, *left_out_together(left_out_of("comparison", errors))),
        logs=tuple(
            LogErrors(
                name=log.name,
                sha256=log.sha256,
                block_s=log.block_s,
                **vars(_errors(field, [log], one, runnable)),
                tracking=tracking_scores(log.motion, field.profile.hull.length_m),
                warnings=(*log.warnings, *_too_few_blocks(log)),
            )
            for log, one in zip(compared, judged, strict=True)
        ),
        pooled=_errors(field, compared, pooled, runnable) if pooled else None,
        statements=tuple(statement for one in every for statement in comparison_statements(one)),
        coefficients=Coefficients(coefficient_rows(field.candidates), term_rows(field.candidates)),
        effects=effect_rows(field.candidates),
    )
    run.progress("")
    return Comparison(result, tuple(compared))


def _model(candidate: Candidate) -> ComparedModel:
    model = candidate.model
    return ComparedModel(
        label=candidate.label,
        name=model.name,
        version=model.version,
        is_base=candidate.is_base,
        accepted=None if candidate.is_base else model.accepted,
        basis=str(model.settings["basis"]),
        diagnosed=model.diagnosed,
        scale=model.scale,
        training=tuple(str(log["name"]) for log in model.training),
        validation=None if model.scores is None else by_axis(model.scores.force.ratio),
        normalised_mse=None if model.scores is None else model.scores.force.normalised_mse,
    )


def _compare_log(
    field: CandidateSet, path: str, run: RunContext, window_s: float, given: GivenLogs, before: Sequence[str]
) -> ComparedLog:
    diagnosed = any(one.model.diagnosed for one in field.candidates)
    prepared = prepare(path, field.profile, run.tables, window_s=window_s, keep_track=diagnosed, ranges=run.ranges)
    motion, sha256 = prepared.motion, prepared.recording.sha256
    given.add(prepared.recording)
    seen = [_prediction(one, prepared, field, window_s) for one in field.candidates]
    taus = np.stack([prediction.tau for prediction in seen])
    rows = _common_rows(field, motion, taus)
    at = motion.t[rows]
    with np.errstate(over="ignore"):
        squares = np.moveaxis((motion.tau - taus) ** 2, 0, 1)[rows]
    for number, one in enumerate(field.candidates):
        if not np.isfinite(squares[:, number]).all():
            raise FerryIdError(
                f"{one.label}: its force on {path} is too large to be squared. Fix: fit the model again, or restore its file"
            )
    if not motion.sway_measured:
        squares[:, :, 1] = 0.0
    block_s, remembered = paired_block_seconds(squares.reshape(len(squares), -1), motion.rate_hz)
    starts, ends = starting_points(motion, rows, HORIZONS_S[0], HORIZONS_S[-1])
    steps = np.round(np.array(HORIZONS_S) * motion.rate_hz).astype(int)
    reached = starts[:, None] + steps < ends[:, None]
    errors = np.full((len(seen), len(starts), len(HORIZONS_S), len(KEYS)), np.nan)
    went: dict[int, Floats] = {}
    stride = 1
    runnable = np.array([runs_free(prediction.force, prediction.motion) for prediction in seen])
    for k, prediction in enumerate(seen):
        if len(starts) and runnable[k]:
            errors[k], went[k], stride = single_paths(prediction.force, prediction.motion, starts, ends, HORIZONS_S)
    paths = np.full((len(seen), len(starts), max((one.shape[1] for one in went.values()), default=0), 2), np.nan)
    for k, places in went.items():
        paths[k] = places
    path_rows = np.minimum(starts[:, None] + np.arange(paths.shape[2]) * stride, len(motion.t) - 1)
    predicted = _predict_windows(seen, motion, rows, field.profile)
    warnings, trained = [*prepared.doubts, *prepared.left_out], []
    for one in field.candidates:
        warnings += [f"{one.label}: {caution}" for caution in range_warnings(one.model, motion, rows)]
        if trained_on(one.model, prepared.recording):
            trained.append(one.label)
            warnings.append(f"{one.label} was trained on this log: its scores here are no evidence")
    if remembered:
        warnings.append(
            f"squared errors stay correlated for longer than blocks of {block_s:.3g} s: its intervals are probably too narrow"
        )
    name = motion.log if motion.log not in before else f"{motion.log} ({len(before) + 1})"
    return ComparedLog(
        name=name,
        sha256=sha256,
        motion=motion,
        rows=rows,
        taus=taus,
        sums=sum_over_blocks(squares, at, block_s),
        block_s=block_s,
        window_force=predicted.force,
        window_sums=_window_sums(predicted, block_s, field.profile, sway=motion.sway_measured),
        starts_s=motion.t[starts],
        errors=errors,
        reached=reached,
        runnable=runnable,
        paths=paths,
        path_rows=path_rows,
        warnings=tuple(warnings),
        trained=tuple(trained),
    )


def _predict_windows(seen: Sequence[Prediction], motion: Motion, rows: Flags, profile: Profile) -> WindowErrors:
    """Return what each model predicts of the acceleration in windows, as a fit is judged; all errors on the profile's mass.

    An error of the force in single rows is mostly noise of the differentiated velocity, and counts in each model's own thrust.
    """
    mass = effective_mass(profile, {}, (), np.zeros((0, 3)))
    return window_errors(seen, motion, rows, mass, window_seconds(profile), reduced=not profile.measures_sway)


def _window_sums(predicted: WindowErrors, block_s: float, profile: Profile, *, sway: bool) -> Floats:
    """Return squared errors in windows summed over blocks, shape (blocks, m, 3).

    Windows that overlap are no two, so that a block is twice as long as one. What a model cannot predict has no errors.
    """
    with np.errstate(over="ignore"):
        squares = np.stack([error**2 for error in predicted.errors], axis=1)
    squares[:, ~np.isfinite(squares).all(axis=(0, 2))] = np.nan
    if not sway:
        squares[:, :, 1] = 0.0
    return sum_over_blocks(squares, predicted.starts_s, max(block_s, 2.0 * window_seconds(profile)))


def _prediction(candidate: Candidate, prepared: Prepared, field: CandidateSet, window_s: float) -> Prediction:
    model, motion = candidate.model, prepared.motion
    functions = model_estimator(model).basis
    if functions is not None and not model.diagnosed:
        for what, needed, measured in (
            ("wind", functions.needs_wind, motion.wind),
            ("current", functions.needs_current, motion.current),
        ):
            if needed and measured is None:
                raise FerryIdError(
                    f"{motion.log}: {candidate.label} needs the {what}, found none measured, or not on enough rows. "
                    f"Fix: compare on a log that has it, or leave {candidate.label} out"
                )
    return predict(model, prepared, field.profile, window_s=window_s, smoother="square")


def _common_rows(field: CandidateSet, motion: Motion, taus: Floats) -> Flags:
    """Return the rows on which measurement and every estimate are known, or say which model has none."""
    rows = usable_rows(motion, *taus)
    if rows.any():
        return rows
    blind = [one.label for one, tau in zip(field.candidates, taus, strict=True) if not usable_rows(motion, tau).any()]
    raise FerryIdError(
        f"{motion.log}: no row on which {', '.join(blind) if blind else 'all models'} can be judged, as something that "
        "is needed was not measured there. Fix: compare on another log, or leave a model out"
    )


def _models_that_run(candidates: Sequence[Candidate], compared: Sequence[ComparedLog]) -> tuple[Flags, list[str]]:
    """Return the models whose free runs can be compared, shape (m,), and why others cannot.

    A run that diverges counts for no model, so that all are judged by the same runs; a model of which many diverge is left out
    instead.
    """
    runs, notes = np.ones(len(candidates), dtype=bool), []
    reached = sum(int(log.reached.sum()) for log in compared)
    for k, one in enumerate(candidates):
        came = sum(int(np.isfinite(log.errors[k, :, :, 2])[log.reached].sum()) for log in compared)
        if not reached:
            continue
        lost = 1.0 - came / reached
        runs[k] = lost <= COMPARE.diverged
        if not came:
            why = "all its runs diverge" if any(log.runnable[k] for log in compared) else NO_MASS
            notes.append(f"{one.label} is left out of free runs: {why}")
        elif not runs[k]:
            notes.append(f"{one.label} is left out of free runs: {100.0 * lost:.0f} % of its runs diverge")
        elif lost:
            notes.append(f"{100.0 * lost:.1f} % of the free runs of {one.label} diverge, and count for no model")
    return runs, notes


def _common_runs(log: ComparedLog, runnable: Flags) -> Flags:
    """Return the errors of free runs that count, as all models that run have them, shape (s, horizons, 4)."""
    return np.asarray(np.isfinite(log.errors[runnable]).all(axis=0) & runnable.any())


def _run_sums(log: ComparedLog, runnable: Flags, h: int) -> Floats:
    """Return squared errors of free runs at a horizon summed over blocks of starts, shape (blocks, m, 4).

    Runs from starts that are close see the same waves and gusts, so that a block is twice as long as a run.
    """
    counted = _common_runs(log, runnable)[:, h]
    some = counted.any(axis=1)
    squares = np.where(counted[some, None], np.moveaxis(log.errors[:, :, h], 0, 1)[some] ** 2, 0.0)
    # A model that does not run has no errors, and no ratio.
    squares[:, ~runnable] = np.nan
    return sum_over_blocks(squares, log.starts_s[some], max(log.block_s, 2.0 * HORIZONS_S[h]))


def _pair_errors(field: CandidateSet, compared: Sequence[ComparedLog], runnable: Flags) -> PairedErrors:
    runs, told = [], None
    for h, horizon in enumerate(HORIZONS_S):
        sums = [_run_sums(log, runnable, h) for log in compared]
        runs.append(compare_pairs(sums))
        if horizon <= COMPARE.statement_s and has_enough_blocks(sums):
            told = horizon
    trained = {label for log in compared for label in log.trained}
    return PairedErrors(
        on=compared[0].name if len(compared) == 1 else None,
        labels=field.labels,
        force=compare_pairs([log.sums for log in compared]),
        prediction=compare_pairs([log.window_sums for log in compared]),
        runs=tuple(runs),
        horizons_s=HORIZONS_S,
        told_s=told,
        trained=frozenset(trained),
    )


def _too_few_blocks(log: ComparedLog) -> list[str]:
    if has_enough_blocks([log.sums]):
        return []
    count = len(log.sums)
    return [
        f"{counted(count, 'block')} of {log.block_s:.3g} s {verb(count, 'is')} too few for an interval, "
        "so that nothing is said to be better on this log alone"
    ]


def _errors(
    field: CandidateSet, compared: Sequence[ComparedLog], judged: PairedErrors, runnable: Flags
) -> CommonErrors:
    """Return rows, blocks, errors of every model and ratios of every two, on one log or on several together."""
    tau = np.concatenate([log.motion.tau[log.rows] for log in compared])
    mse = np.sum([log.sums.sum(axis=0) for log in compared], axis=0) / len(tau)
    if not all(log.motion.sway_measured for log in compared):
        mse[:, 1] = np.nan
    r2 = _r_squared(mse, tau)
    force = np.concatenate([log.window_force for log in compared])
    with np.errstate(divide="ignore", invalid="ignore"):
        in_windows = np.sum([log.window_sums.sum(axis=0) for log in compared], axis=0) / len(force)
        in_windows[:, np.isnan(mse).any(axis=0)] = np.nan
        counted = [_common_runs(log, runnable) for log in compared]
        squares = np.sum(
            [np.where(use, log.errors**2, 0.0).sum(axis=1) for log, use in zip(compared, counted, strict=True)],
            axis=0,
        )
        rms = np.sqrt(squares / np.sum([use.sum(axis=0) for use in counted], axis=0))
    rms[~runnable] = np.nan
    return CommonErrors(
        rows=len(tau),
        seconds=float(sum(log.rows.sum() / log.motion.rate_hz for log in compared)),
        blocks=sum(len(log.sums) for log in compared),
        windows=len(force),
        scores={
            label: ModelErrors(
                mse=by_axis(mse[k]),
                r2=by_axis(r2[k]),
                prediction=PredictionErrors(by_axis(in_windows[k]), by_axis(_r_squared(in_windows, force)[k])),
                trained=label in judged.trained,
                free_run={key: tuple(rms[k, :, c].tolist()) for c, key in enumerate(KEYS)},
            )
            for k, label in enumerate(field.labels)
        },
        free_run=FreeRunCounts(
            horizons_s=HORIZONS_S,
            told_s=judged.told_s,
            starts=sum(len(log.starts_s) for log in compared),
            counted=tuple(int(sum(use[:, h].any(axis=1).sum() for use in counted)) for h in range(len(HORIZONS_S))),
            blocks=tuple(sum(len(_run_sums(log, runnable, h)) for log in compared) for h in range(len(HORIZONS_S))),
        ),
        pairs=tuple(
            ModelPair(
                first=field.labels[i],
                second=field.labels[j],
                mse={axis: _ratio(judged.force, k, c) for c, axis in enumerate(AXES)},
                prediction={axis: _ratio(judged.prediction, k, c) for c, axis in enumerate(AXES)},
                free_run={
                    key: tuple(_ratio(runs, k, c, root=True) for runs in judged.runs) for c, key in enumerate(KEYS)
                },
            )
            for k, (i, j) in enumerate(judged.force.pairs)
        ),
    )


def _r_squared(mse: Floats, force: Floats) -> Floats:
    """Return R² of models with mean square errors, shape (m, 3), of a force, shape (n, 3)."""
    variance = np.var(force, axis=0) if len(force) else np.zeros(force.shape[1])
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(variance > 0.0, 1.0 - mse / variance, np.nan))


def _ratio(paired: PairedRatios, k: int, column: int, *, root: bool = False) -> Ratio:
    values = np.array([values[k, column] for values in (paired.ratio, paired.low, paired.high)])
    value, low, high = (np.sqrt(values) if root else values).tolist()
    return Ratio(value, low, high, float(paired.p[k, column]))
