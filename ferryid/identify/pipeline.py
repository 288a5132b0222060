"""A fit from logs to a model: read, align, residual, split, estimate, accept.

A fit to an archive or to motions in memory begins with its own data and ends with the same `estimate_correction` and
`accept_estimate`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime

import numpy as np

from ferryid import __version__
from ferryid.errors import FerryIdError, with_sentence
from ferryid.identify.acceptance import NOT_JUDGED, Acceptance, accept
from ferryid.identify.beside_profile import beside_profile
from ferryid.identify.estimation import estimate_correction
from ferryid.identify.estimators import choose_estimator
from ferryid.identify.fit_data import Coefficients, Estimate, FitData
from ferryid.identify.fit_warnings import free_run_warnings, rest_warnings, unused_window
from ferryid.identify.force_signs import refuse_reversed_forces
from ferryid.identify.free_run_checks import free_run_checks
from ferryid.identify.held_out_checks import held_out_checks, skill_checks
from ferryid.identify.inertia import undetermined, why_too_light
from ferryid.identify.inputs import OddLogs, usable_logs
from ferryid.identify.judged_split import judged_split
from ferryid.identify.log_sums import folds_by_blocks, force_free_axes, sum_log
from ferryid.identify.model_selection import Selection, select_model, windows_to_try
from ferryid.identify.motion_data import LogData, numbered_names, prepared_data
from ferryid.identify.order_responses import estimate_order_responses
from ferryid.identify.outcome import ComponentCurve, EstimatorScore, Excitation, FitOutcome
from ferryid.identify.own_conditions import with_own_conditions
from ferryid.identify.physical_checks import law_of, physical_checks
from ferryid.identify.rows import basis_for
from ferryid.identify.settings import TEST_WINDOW_S, FitSettings, check_components
from ferryid.identify.sign_changes import sign_changes
from ferryid.identify.split import Split, TooShort
from ferryid.identify.thresholds import IDENTIFY
from ferryid.identify.weak_data import WeakData, weak_data
from ferryid.identify.window_length import with_best_length
from ferryid.log_warnings import left_out_together
from ferryid.models import Model, ModelScores
from ferryid.models.store import check_name
from ferryid.regression.bases import Basis
from ferryid.signals.artificial import NO_RECORDING
from ferryid.signals.copies import motion_marks
from ferryid.signals.data_quality import unread
from ferryid.signals.prepare import Opened
from ferryid.signals.smooth import smooth_measured
from ferryid.types import Flags, RunContext
from ferryid.vessel.profile import Profile


def fit_logs(
    paths: Sequence[str],
    profile: Profile,
    settings: FitSettings,
    run: RunContext,
    *,
    name: str = "",
    odd: OddLogs | None = None,
) -> FitOutcome:
    """Fit a correction of the base model to one or more logs and judge it on rows it did not see.

    Parameters
    ----------
    paths
        Logs; parts of one recording joined by ``+``.
    profile
        The vessel.
    settings
        How to fit.
    run
        Output folder, progress, and whether to check every checksum of the logs.
    name
        Name of the model; the profile's where empty.
    odd
        Finds logs of another vessel among several, which are left out; none is sought where None.

    Raises
    ------
    FerryIdError
        For input that cannot be used, with file, cause and remedy. One of several logs is left out instead, with a warning.
    """
    name, settings = check_name(name or profile.name), settings.on(profile)
    logs = usable_logs(paths, profile, settings, run, odd=odd)
    responses = estimate_order_responses(logs.opened, profile, settings, run.progress)
    said = tuple(map(str, responses))
    try:
        outcome = fit_opened(logs.opened, profile, settings, run, name)
    except FerryIdError as error:
        lost = _lost(logs.opened) if isinstance(error, TooShort) else ()
        if not logs.left_out and not said and not lost:
            raise
        # What is followed late, or what a file has lost, may be why.
        late = type(error)(with_sentence(error, *said, *lost))
        raise type(error)(logs.beside(late)) from error
    return replace(
        outcome,
        warnings=(*_of_light_base(profile), *said, *outcome.warnings, *logs.doubts, *left_out_together(logs.left_out)),
        order_responses=responses,
        notes=logs.notes,
        logs_left_out=logs.reasons,
    )


def _of_light_base(profile: Profile) -> tuple[str, ...]:
    """Return that the fit starts from a hull model that no hull has, as a sentence; empty where it does not."""
    why = why_too_light(profile)
    remedy = "correct [hull.M] in the profile, which is rigid body and added mass together, or the mass and inertia beside it"
    return (f"{why}, and the fit starts from it. Fix: {remedy} (`ferryid vessel check`).",) if why else ()


def _lost(opened: Sequence[Opened]) -> tuple[str, ...]:
    """Return what a single log has lost of its messages, as a sentence, such as the end of a file that was cut off."""
    if len(opened) != 1 or not any(loss.costs_messages for loss in opened[0].recording.losses):
        return ()
    (sentence,) = unread(opened[0].recording.losses)
    return (sentence[0].upper() + sentence[1:],)


def fit_opened(
    opened: Sequence[Opened], profile: Profile, settings: FitSettings, run: RunContext, name: str
) -> FitOutcome:
    """Fit a correction of a profile's hull to logs that were read and aligned; arguments and errors as of `fit_logs`."""
    chosen = estimator_for(opened, profile, settings, run)
    outcome = fit_and_judge(chosen.data, chosen.components, name, run)
    model = _with_marks(outcome.model, opened)
    judged = model if outcome.judged is outcome.model else _with_marks(outcome.judged, opened)
    told = [f"The derivative's estimator was used: {chosen.why}."] if chosen.why else []
    if chosen.estimator == "derivative":
        told += unused_window(settings, chosen.why or _preference(settings))
    return replace(
        outcome,
        model=model,
        judged=judged,
        warnings=(*outcome.warnings, *chosen.notes, *told),
        estimators=chosen.scores,
    )


def _with_marks(model: Model, opened: Sequence[Opened]) -> Model:
    """Return a model whose training logs have the marks by which their copies are known."""
    recordings = {one.recording.sha256: one.recording for one in opened}
    return replace(
        model,
        training=tuple(
            {**log, "motion": motion_marks(recordings[log["sha256"]])} if log["sha256"] in recordings else log
            for log in model.training
        ),
    )


def _preference(settings: FitSettings) -> str:
    """Return why the derivative's estimator was used where the weak form could have been."""
    if settings.estimator == "derivative":
        return "it was asked for"
    return "auto chose it by folds of the training rows; --estimator weak uses the weak form"


@dataclass(frozen=True, eq=False)
class ChosenData:
    """The data of the estimator that a fit uses.

    Attributes
    ----------
    data, components
        Its data, and its number of SIMPLS components.
    scores
        How well either estimator predicts, where both were compared.
    why
        Why the weak form, which was not ruled out, cannot be used; empty where it can.
    notes
        What the logs leave undecided, as sentences.
    """

    data: LogData
    components: int
    scores: tuple[EstimatorScore, ...] = ()
    why: str = ""
    notes: tuple[str, ...] = ()

    @property
    def estimator(self) -> str:
        """``"weak"`` or ``"derivative"``."""
        return "weak" if isinstance(self.data, WeakData) else "derivative"


def estimator_for(opened: Sequence[Opened], profile: Profile, settings: FitSettings, run: RunContext) -> ChosenData:
    """Return the data of the estimator that a fit of these settings to these logs uses; none is fitted.

    Raises
    ------
    FerryIdError
        For logs that a fit refuses, with cause and remedy.
    """
    parts = None
    if settings.windows_s:
        run.progress("choosing the window")
        settings, parts = _select_window(profile, settings, opened)
    data = prepared_data(profile, settings, opened, run.progress)
    undecided = refuse_reversed_forces(data) if settings.estimator != "derivative" else ""
    if parts is None:
        parts = _split(data, undecided)
    run.progress("fitting")
    data = replace(data, split=parts.within([motion.valid for motion in data.motions]))
    chosen = _choose_data(data, parts.training, opened, run)
    return replace(chosen, notes=(undecided,) if undecided else ())


def _split(data: LogData, undecided: str) -> Split:
    """Return which rows train and validate; a refusal of logs that are too short says what else they leave undecided."""
    try:
        return judged_split(data.motions, data.profile, data.settings, data.settings.window_s)
    except TooShort as error:
        raise TooShort(with_sentence(error, undecided)) from error


def _choose_data(data: LogData, training: Sequence[Flags], opened: Sequence[Opened], run: RunContext) -> ChosenData:
    """Return the data of the estimator of the settings, or for ``"auto"`` of the one that folds of the training rows favour."""
    settings, kind = data.settings, data.settings.estimator
    weak = with_best_length(weak_data(data)) if kind != "derivative" else weak_data(data)
    why = weak.impossible if kind == "auto" else ""
    if why:
        kind = "derivative"
    components: dict[str, int] = {}
    if kind != "weak":
        wanted = settings.components
        if wanted == "auto":
            windows_s = (settings.window_s,)
            wanted = _select(data.profile, settings, data.functions, opened, windows_s, training).components
        components["derivative"] = int(wanted)
    if kind != "derivative":
        weak.refuse_contradictions()
        if len(opened) >= IDENTIFY.fewest_condition_logs:
            run.progress("estimating conditions of single logs")
            weak = with_own_conditions(weak)
        components["weak"] = weak.components()
    if kind != "auto":
        return ChosenData(data if kind == "derivative" else weak, components[kind], why=why)
    run.progress("comparing the estimators")
    chosen, scores = choose_estimator(data, weak, components)
    return ChosenData(chosen, components["weak" if isinstance(chosen, WeakData) else "derivative"], scores)


def fit_and_judge(data: FitData, components: int, name: str, run: RunContext) -> FitOutcome:
    """Estimate a correction from the training rows and judge it; the model is of all rows then, where blocks were held out.

    The verdict is on the estimate that has not seen the held-out rows. Number of components, window length and conditions that
    were chosen without them stay.
    """
    undivided, draws = data.undivided(), data.settings.draws
    if undivided is None:
        return accept_estimate(data, estimate_correction(data, components, draws, run.progress), name, run)
    judged = estimate_correction(data, components, 0, run.progress)
    run.progress("fitting to all rows")
    return accept_estimate(
        data, judged, name, run, (undivided, estimate_correction(undivided, components, draws, run.progress))
    )


def accept_estimate(
    data: FitData, estimate: Estimate, name: str, run: RunContext, whole: tuple[FitData, Estimate] | None = None
) -> FitOutcome:
    """Judge an estimated correction, and return it as a model with all that was found out about it.

    Parameters
    ----------
    data, estimate
        The data, and what was estimated from the training rows.
    name, run
        Of the model; progress.
    whole
        The same data of which all rows train, and the estimate from them that is to be stored; None: `estimate` is.
    """
    run.progress("judging")
    found = data.combined(estimate.coefficients)
    told, final = whole or (data, estimate)
    stored = told.combined(final.coefficients)
    logs = data.log_fits(found)
    scores = data.scores(found, logs)
    excitation = data.excitation(estimate)
    free_base, free_new = data.free_runs(found, run.progress)
    acceptance = NOT_JUDGED
    if data.held_out:
        acceptance = accept(scores.force.mse_base, scores.force.mse_model, scores.measure, data.settings.axes)
    if data.held_out and data.settings.accept == "full":
        physical = physical_checks(told, stored)
        acceptance = acceptance.with_checks(
            (
                *physical,
                *free_run_checks(free_base, free_new),
                *skill_checks(scores.force, undetermined(physical)),
                *held_out_checks(scores.seconds, data.held_out_blocks, scores.split),
            )
        )
    judged = _model(data, estimate, found, name, scores, acceptance, excitation)
    if data.held_out:
        acceptance = replace(acceptance, reasons=(*acceptance.reasons, *beside_profile(judged, data.profile, logs)))
    model = judged
    if whole is not None:
        model = _model(told, final, stored, name, scores, acceptance, told.excitation(final))
        model = replace(model, settings={**model.settings, "estimated_from": "all rows"})
    # Those of the model first: a season has many logs with something to say each.
    warnings = (
        *final.held,
        *free_run_warnings(free_base, free_new),
        *sign_changes(model),
        *rest_warnings(law_of(told, stored).at_constant_velocity, told.visited),
        *told.condition_notes,
        *final.notes,
        *data.warnings(excitation, scores),
    )
    return FitOutcome(
        model=model,
        judged=judged,
        acceptance=acceptance,
        scores=scores,
        curve=_component_curve(data, estimate, scores),
        excitation=excitation,
        free_run_base=free_base,
        free_run_model=free_new,
        # Before all: what was fitted is no vessel's motion.
        warnings=tuple(sorted(warnings, key=lambda one: NO_RECORDING not in one)),
        logs=logs,
        archive=data.archived_logs(found),
        winds=told.winds,
        conditions=told.log_conditions,
        condition_kinds=data.condition_kinds,
    )


def _model(
    data: FitData,
    estimate: Estimate,
    found: Coefficients,
    name: str,
    scores: ModelScores,
    acceptance: Acceptance,
    excitation: Excitation,
) -> Model:
    return Model(
        name=name,
        version=0,
        created=datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        ferryid_version=__version__,
        profile_text=data.profile.text,
        scale=data.settings.scale,
        settings={
            **data.settings.plain(),
            "basis": data.functions.name,
            "components": estimate.components,
            **data.model_settings(estimate),
        },
        terms=data.functions.terms,
        units=data.functions.units,
        theta=found.theta,
        intercept=found.intercept,
        low=found.low,
        high=found.high,
        intercept_low=found.intercept_low,
        intercept_high=found.intercept_high,
        covariance=found.covariance,
        ranges={
            name: span
            for name, span in data.ranges(excitation).items()
            if not (data.settings.reduced and name in ("v", "v_dot"))
        },
        training=data.training_logs(),
        scores=scores,
        accepted=acceptance.accepted,
    )


def _component_curve(data: FitData, estimate: Estimate, scores: ModelScores) -> ComponentCurve:
    """Return errors for every number of components over the base model's error on the validation rows."""
    unit = np.where(scores.force.mse_base > 0, scores.force.mse_base, 1.0)
    regression = estimate.regression
    training = data.training.sse(regression.coefficients, regression.intercepts) / max(data.training.n, 1) / unit
    validation = data.validation.sse(*data.fitted(regression)) / max(data.validation.n, 1) / unit
    return ComponentCurve(
        np.arange(1, len(regression.coefficients) + 1),
        training,
        validation,
        estimate.components,
        regression.explained_x,
        regression.explained_y,
    )


def _select_window(profile: Profile, settings: FitSettings, opened: Sequence[Opened]) -> tuple[FitSettings, Split]:
    """Return the settings with the window, and where that is asked for the component count, that cross-validation chose.

    Its split is to be kept: another, made for the window chosen, would validate on rows that took part in the choice.
    """
    windows_s = windows_to_try(
        settings.windows_s, [one.measured for one in opened], in_blocks=settings.split == "blocks"
    )
    motions = numbered_names([smooth_measured(one.measured, TEST_WINDOW_S) for one in opened])
    functions = basis_for(settings, motions)
    check_components(settings.components, functions)
    parts = judged_split(motions, profile, settings, max(TEST_WINDOW_S, *windows_s))
    choice = _select(profile, settings, functions, opened, windows_s, parts.training)
    return replace(settings, window_s=choice.window_s, components=choice.components), parts


def _select(
    profile: Profile,
    settings: FitSettings,
    functions: Basis,
    opened: Sequence[Opened],
    windows_s: Sequence[float],
    wanted: Sequence[Flags],
) -> Selection:
    """Return window and component count by cross-validation within the training rows."""
    logs = [
        sum_log(profile, settings, functions, one.measured, windows_s, wanted=rows)
        for one, rows in zip(opened, wanted, strict=True)
    ]
    return select_model(
        profile, settings, functions, windows_s, folds_by_blocks(logs), force_free_axes(logs), where=logs[0].log
    )
