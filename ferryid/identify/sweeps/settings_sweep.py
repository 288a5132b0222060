"""Settings swept: cross-validated error of every smoothing window and component count, and which to choose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any

from ferryid.counts import counted
from ferryid.effects.wording import listed
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.identify.archive import archive_folds
from ferryid.identify.inputs import OddLogs, UsableLogs, usable_logs
from ferryid.identify.log_sums import folds_by_blocks, folds_by_logs, force_free_axes, sum_log
from ferryid.identify.model_selection import Selection, select_model, windows_to_try
from ferryid.identify.outcome import EstimatorScore
from ferryid.identify.pipeline import estimator_for
from ferryid.identify.rows import basis_for
from ferryid.identify.settings import FOLDS, TEST_WINDOW_S, WINDOWS_S, FitSettings
from ferryid.identify.split import TooShort
from ferryid.identify.sweeps.swept import Swept, beats_base
from ferryid.identify.sweeps.weak_sweep import sweep_weak
from ferryid.log_warnings import left_out_together, log_warnings
from ferryid.regression.bases import Basis
from ferryid.regression.cross_validation import Folds
from ferryid.signals.prepare import Opened
from ferryid.signals.smooth import smooth_measured
from ferryid.types import AXES, Flags, RunContext
from ferryid.vessel.profile import Profile

KINDS = ("components", "window", "both")

SCHEMA = "ferryid.sweep/1"
_ALSO = {
    "--basis": "basis", "--structure": "structure", "--smoother": "smoother", "--residual": "residual", "--rate": "rate_hz",
    "--inertia": "inertia", "--delta": "delta", "--sigma": "sigma", "--zeta": "zeta",
}  # fmt: skip
"""Options of a sweep that a fit has as well, and their settings."""
_DERIVATIVE = "Estimator auto: the derivative's was swept"
BY = {"blocks": "contiguous stretches of every log", "logs": "whole logs"}


@dataclass(frozen=True)
class Sweep(Swept):
    """What a sweep found.

    Attributes
    ----------
    what
        One of `KINDS`.
    vessel, logs
        Name of the vessel; of each log its name, SHA-256, seconds, rows and warnings.
    windows_s
        Windows that were tried [s].
    by
        Cross-validation by contiguous stretches of every log (``"blocks"``) and, of several logs, by whole ones (``"logs"``).
    notes
        What a reader must know, as sentences.
    """

    what: str
    vessel: str
    logs: tuple[Mapping[str, Any], ...]
    windows_s: tuple[float, ...]
    by: Mapping[str, Selection]
    notes: tuple[str, ...]

    @property
    def choice(self) -> Selection:
        """What to fit with: the choice by stretches, which every set of logs has."""
        return self.by["blocks"]

    @property
    def choice_beats_base(self) -> bool:
        """Whether the choice errs less than the base model, without any correction, does."""
        return bool(beats_base(self.choice.over_base)[self.choice.window, self.choice.components - 1])

    @property
    def any_beats_base(self) -> bool:
        """Whether anything that was tried does."""
        return bool(beats_base(self.choice.over_base).any())

    @property
    def fit_options(self) -> tuple[str, ...]:
        """Options with which ``ferryid fit`` uses the choice, and what else of the settings is not the usual."""
        window = "--weak-window" if self.weak else "--window"
        usual = FitSettings()
        others = [
            (option, getattr(self.settings, name))
            for option, name in _ALSO.items()
            if getattr(self.settings, name) != getattr(usual, name)
        ]
        return (
            "--estimator", self.settings.estimator, window, f"{self.choice.window_s:g}",
            "--components", str(self.choice.components),
            *(word for option, value in others for word in (option, f"{value:g}" if isinstance(value, float) else str(value))),
        )  # fmt: skip


def sweep_settings(
    what: str,
    logs: Sequence[str],
    profile: Profile,
    settings: FitSettings,
    run: RunContext,
    *,
    windows_s: Sequence[float] = (),
    folds: int = FOLDS,
    archive: bool = False,
    odd: OddLogs | None = None,
) -> Sweep:
    """Cross-validate logs over windows and component counts of one estimator.

    For ``"auto"`` that which a fit to these logs uses. Of an archive it is the derivative's, as of a fit; with `windows_s` too,
    as these are smoothing windows unless the weak form was asked for, and where the logs are too short for the weak form in
    every fold.

    Parameters
    ----------
    what
        ``"components"``: at the settings' window. ``"window"``: at the settings' component count, or the best of each
        window. ``"both"``: every combination.
    logs
        Paths; parts of one recording joined by ``+``.
    profile, settings
        The vessel and how to fit.
    run
        Output folder and progress.
    windows_s
        Windows to try [s]; the usual ones where none is given.
    folds
        Number of folds by stretches, 2 to 20.
    archive
        True: take what is kept of the logs that were ingested to the output folder, all of them where `logs` is empty.
    odd
        Finds those of another vessel among several logs, which are left out; None does not ask.

    Raises
    ------
    FerryIdError
        For input that cannot be used, with file, cause and remedy. One of several logs is left out instead, with a note.
    """
    if what not in KINDS:
        raise FerryIdError(
            f'sweep: there is nothing called "{what}" to sweep.{did_you_mean(what, (*KINDS, "basis"))} Fix: choose one of '
            f"{', '.join(KINDS)} or basis"
        )
    check_folds(folds)
    if what == "components" and windows_s:
        option = "--weak-window" if settings.estimator == "weak" else "--window"
        raise FerryIdError(f"--windows: components are swept at one window. Fix: give {option}, or sweep both")
    asked, settings = settings.estimator, replace(settings, windows_s=()).on(profile)
    if what != "window":
        settings = replace(settings, components="auto")
    given = UsableLogs([]) if archive else usable_logs(logs, profile, settings, run, "sweep", odd)
    opened = tuple(given.opened)
    request = _Request(what, tuple(logs), opened, profile, settings, run, tuple(windows_s), folds, archive)
    kind, says, scores = _as_a_fit(request)
    if kind == "weak":
        try:
            found = _sweep_weak(request.of("weak"))
        except TooShort as error:
            if asked != "auto":
                raise
            says = derivative_instead(error)
            found = _sweep_derivative(request.of("derivative"))
    else:
        found = _sweep_derivative(request.of("derivative"))
    notes = (*found.notes, *given.notes, *given.doubts, *left_out_together(given.left_out))
    return replace(found, notes=notes, asked=asked, estimator_says=says, estimators=scores)


@dataclass(frozen=True, eq=False)
class _Request:
    """What is to be swept: the arguments of `sweep_settings`, and the logs that were read, none of an archive."""

    what: str
    logs: tuple[str, ...]
    opened: tuple[Opened, ...]
    profile: Profile
    settings: FitSettings
    run: RunContext
    windows_s: tuple[float, ...]
    folds: int
    archive: bool

    def of(self, estimator: str) -> _Request:
        """Return the same for one estimator."""
        return replace(self, settings=replace(self.settings, estimator=estimator))


def _as_a_fit(request: _Request) -> tuple[str, str, tuple[EstimatorScore, ...]]:
    """Return the estimator that a fit to the logs uses, a sentence that says so and why, and how well either predicts."""
    if request.settings.estimator == "auto" and request.archive:
        return (
            "derivative",
            f"{_DERIVATIVE}, as a fit to an archive uses it; --estimator weak sweeps the weak form.",
            (),
        )
    if request.settings.estimator == "auto" and request.windows_s:
        told = (
            "as --windows are its smoothing windows; --estimator weak takes them as lengths of the weak form's windows."
        )
        return "derivative", f"{_DERIVATIVE}, {told}", ()
    return as_a_fit(request.opened, request.profile, request.settings, request.run)


def derivative_instead(error: TooShort) -> str:
    """Return why the derivative's estimator is swept although a fit uses the weak form, as a sentence."""
    return f"{_DERIVATIVE}, as the weak form, which a fit uses, cannot be cross-validated: {_cause(error)}."


def as_a_fit(
    opened: Sequence[Opened], profile: Profile, settings: FitSettings, run: RunContext
) -> tuple[str, str, tuple[EstimatorScore, ...]]:
    """Return the estimator that a fit to logs uses; of ``"auto"`` why, as a sentence, and how well either predicts."""
    if settings.estimator != "auto":
        return settings.estimator, "", ()
    try:
        chosen = estimator_for(opened, profile, settings, run)
    except TooShort as error:
        return "derivative", f"{_DERIVATIVE}, as a fit cannot compare the two: {_cause(error)}.", ()
    if chosen.why:
        return "derivative", f"{_DERIVATIVE}, as a fit uses it: {chosen.why}.", ()
    told = ", ".join(_fold_error(one) for one in chosen.scores)
    name = "the weak form" if chosen.estimator == "weak" else "the derivative's"
    says = (
        f"Estimator auto: {name} was swept, which a fit uses; squared prediction error over the base model's on folds of the "
        f"training rows: {told}."
    )
    return chosen.estimator, " ".join([says, *chosen.notes]), chosen.scores


def _fold_error(score: EstimatorScore) -> str:
    """Return how well an estimator predicts on folds, and where no hull has such coefficients."""
    error = f"{score.folds:.3g}" if isfinite(score.folds) else "unknown"
    return f"{score.name} {error}{'' if score.possible else ' (no hull has such inertia or damping)'}"


def _cause(error: FerryIdError) -> str:
    """Return what is wrong, without the remedy."""
    return str(error).partition(". Fix: ")[0]


def _sweep_derivative(request: _Request) -> Sweep:
    what, profile, settings, run = request.what, request.profile, request.settings, request.run
    if what != "components" and settings.smoother == "kalman":
        raise FerryIdError(
            "--smoother: the Kalman smoother finds its window by likelihood, so that windows cannot be swept. "
            "Fix: sweep components, or take another --smoother"
        )
    settings = replace(settings, windows_s=request.windows_s)
    fixed = (settings.window_s,) if what == "components" else request.windows_s
    if request.archive:
        windows = fixed or WINDOWS_S
        functions, free, cuts, told = archive_folds(profile, settings, run, windows, request.logs, request.folds)
    else:
        windows, functions, free, cuts, told = _from_logs(request.opened, profile, settings, run, fixed, request.folds)
    if what != "components" and len(windows) < 2:
        raise FerryIdError(
            f"{told[0]['name']}: nothing to compare, as every window given is {windows[0]:g} s, rounded to samples of this "
            "log. Fix: give --windows that are apart, or a higher --rate"
        )
    run.progress("cross-validating")
    by = {
        key: select_model(profile, settings, functions, windows, cut, free, where=str(told[0]["name"]))
        for key, cut in cuts.items()
    }
    return Sweep(
        what,
        profile.name,
        tuple(told),
        windows,
        by,
        (*_notes(by, windows, settings), *log_warnings([(log["name"], log["warnings"]) for log in told])),
        settings=replace(settings, basis=functions.name),
    )


def _sweep_weak(request: _Request) -> Sweep:
    what, profile, settings = request.what, request.profile, request.settings
    lengths_s, basis, test_s, by, told, notes = sweep_weak(
        request.logs,
        profile,
        settings,
        request.run,
        what=what,
        windows_s=request.windows_s,
        folds=request.folds,
        archive=request.archive,
        opened=request.opened,
    )
    if what != "components" and len(lengths_s) < 2:
        raise TooShort(
            f"{told[0]['name']}: nothing to compare, as only windows of {lengths_s[0]:.3g} s can be fitted. "
            "Fix: give at least two --windows, or longer logs"
        )
    return Sweep(
        what,
        profile.name,
        tuple(told),
        lengths_s,
        by,
        (*notes, *_notes(by, lengths_s, settings), *log_warnings([(log["name"], log["warnings"]) for log in told])),
        settings=replace(settings, basis=basis),
        test_window_s=test_s,
    )


def _from_logs(
    opened: Sequence[Opened],
    profile: Profile,
    settings: FitSettings,
    run: RunContext,
    windows_s: Sequence[float],
    folds: int,
) -> tuple[tuple[float, ...], Basis, Flags, dict[str, Folds], list[dict[str, Any]]]:
    """Return windows, basis, axes without force, folds by stretches and whole logs, and what is told of the logs."""
    windows = windows_to_try(windows_s, [one.measured for one in opened])
    functions = basis_for(settings, [smooth_measured(one.measured, TEST_WINDOW_S) for one in opened])
    pieces = []
    for one in opened:
        run.progress(f"cutting {one.recording.name} into pieces")
        pieces.append(sum_log(profile, settings, functions, one.measured, windows, blocks=folds))
    cuts = {"blocks": folds_by_blocks(pieces, folds)} | ({"logs": folds_by_logs(pieces)} if len(pieces) > 1 else {})
    told = [log_json(one, int(log.test.n.sum())) for one, log in zip(opened, pieces, strict=True)]
    return windows, functions, force_free_axes(pieces), cuts, told


def check_folds(folds: int) -> None:
    """Refuse what is no number of folds."""
    if not 2 <= folds <= 20:
        raise FerryIdError(f"--folds: {folds} is no number of folds. Fix: give 2 to 20, {FOLDS} is usual")


def log_json(one: Opened, rows: int) -> dict[str, Any]:
    """Return name, hash, length by the number of its rows, and warnings of a log."""
    return {
        "name": one.recording.name,
        "sha256": one.recording.sha256,
        "seconds": rows / one.measured.rate_hz,
        "rows": rows,
        "warnings": [*one.doubts, *one.left_out],
    }


def _notes(by: Mapping[str, Selection], windows_s: Sequence[float], settings: FitSettings) -> list[str]:
    notes = []
    blocks, logs = by["blocks"], by.get("logs")
    if logs is not None and (blocks.window_s, blocks.components) != (logs.window_s, logs.components):
        notes.append(
            f"By whole logs the choice is {logs.title}. Take it where the model is for other days than those of these logs."
        )
    for key, one in by.items():
        if one.held.any():
            axes = listed([axis for axis, held in zip(AXES, one.held, strict=True) if held])
            notes.append(f"By {BY[key]} the base model's inertia was held in {axes}, as a fit does.")
        if one.curves.folds < FOLDS:
            notes.append(
                f"Only {counted(one.curves.folds, 'fold')} by {BY[key]}: their scatter, and so the choice, is rough."
            )
    if len(windows_s) > 1 and blocks.window_s in (windows_s[0], windows_s[-1]):
        end = "shortest" if blocks.window_s == windows_s[0] else "longest"
        notes.append(f"The window chosen is the {end} that was tried.")
    if settings.residual != "measured":
        notes.append(f"Fitted to the {settings.residual} residual, tested against measured force.")
    return notes


def sweep_json(found: Sweep, report: str | None = None) -> dict[str, Any]:
    """Return a sweep in the form of schema ``ferryid.sweep/1``."""
    return {
        "schema": SCHEMA,
        "what": found.what,
        "vessel": found.vessel,
        "logs": [dict(log) for log in found.logs],
        "settings": {**found.settings.plain(), **found.settings.scale},
        "windows_s": list(found.windows_s),
        "components": list(range(1, found.choice.curves.mse.shape[1] + 1)),
        "test_window_s": found.test_window_s,
        "by": {key: _choice_json(choice) for key, choice in found.by.items()},
        "choice": {"window_s": found.choice.window_s, "components": found.choice.components},
        "beats_base": found.choice_beats_base,
        "notes": list(found.notes),
        **found.estimator_json(),
        "fit_options": list(found.fit_options),
        "report": report,
    }


def _choice_json(choice: Selection) -> dict[str, Any]:
    curves = choice.curves
    score, band = curves.normalised()
    axes = list(enumerate(AXES))
    return {
        "folds": curves.folds,
        "rows": curves.rows,
        "base_mse": {axis: float(curves.base[j]) for j, axis in axes},
        "mse": {axis: curves.mse[:, :, j].tolist() for j, axis in axes},
        "standard_error": {axis: curves.standard_error[:, :, j].tolist() for j, axis in axes},
        "score": score.tolist(),
        "score_standard_error": band.tolist(),
        "choice": {"window_s": choice.window_s, "components": choice.components},
        "held_inertia": [axis for j, axis in axes if choice.held[j]],
    }
