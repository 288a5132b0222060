"""One fit from logs to verdict, in the order in which a person would do it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid import __version__
from ferryid.identify.accept import accept
from ferryid.identify.basis import Basis
from ferryid.identify.bootstrap import Blocks, block_seconds, bootstrap
from ferryid.identify.cautions import cautions, free_run_cautions
from ferryid.identify.choose import Choice, choose, folds_by_blocks, force_free, studied, tried
from ferryid.identify.cross_products import CrossProducts
from ferryid.identify.crossed import TEST_WINDOW_S
from ferryid.identify.estimate import Estimator
from ferryid.identify.excitation import excitation
from ferryid.identify.free_run import free_run
from ferryid.identify.inertia import effective_mass, reason, unbelievable, unforced, without_inertia
from ferryid.identify.model import AXES, Model
from ferryid.identify.qr import QrFactor, factorise
from ferryid.identify.residual import residual
from ferryid.identify.result import ComponentCurve, FitResult, LogFit
from ferryid.identify.rows import basis_of, grids, known_rows, rows_of
from ferryid.identify.scores import force_scores
from ferryid.identify.settings import FitSettings, check_components
from ferryid.identify.simpls import Simpls, simpls, sse
from ferryid.identify.split import Split, split
from ferryid.identify.store import checked_name
from ferryid.signals.prepare import Opened, open_track, refuse_twice, smoothed
from ferryid.signals.smooth import smooth_measured
from ferryid.signals.track import Motion
from ferryid.vessel.profile import Profile

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


def quiet(_stage: str) -> None:
    """Show no progress."""


def fit(
    logs: Sequence[str],
    profile: Profile,
    settings: FitSettings,
    out: Path,
    *,
    name: str = "",
    verify: bool = False,
    progress: Callable[[str], None] = quiet,
) -> FitResult:
    """Fit a correction of the base model to one or more logs and judge it on rows it did not see.

    Parameters
    ----------
    logs
        Paths; parts of one recording joined by ``+``.
    profile
        The vessel.
    settings
        How to fit.
    out
        Output folder, whose ``logs`` keep the ingested tables.
    name
        Name of the model; the profile's where empty.
    verify
        Check every checksum of the logs.
    progress
        Called with the name of each stage.

    Raises
    ------
    FerryIdError
        For input that cannot be used, with file, cause and remedy.
    """
    name = checked_name(name or profile.name)
    settings = settings.on(profile)
    opened = []
    for path in logs:
        progress(f"reading {Path(path).name}")
        opened.append(open_track(path, profile, out, rate_hz=settings.rate_hz, verify=verify))
    refuse_twice(opened)
    parts = None
    if settings.windows_s:
        progress("choosing the window")
        settings, parts = _windowed(profile, settings, opened)
    prepared = [smoothed(one, settings.window_s, settings.smoother) for one in opened]
    motions = _told_apart([one.motion for one in prepared])
    functions = basis_of(settings, motions)
    check_components(settings.components, functions)
    progress("computing the residual")
    targets = [residual(profile, motion, settings.scale, settings.residual) for motion in motions]
    measured = [residual(profile, motion, settings.scale) for motion in motions]
    motions = [
        replace(motion, valid=known_rows(motion, functions, target, error))
        for motion, target, error in zip(motions, targets, measured, strict=True)
    ]
    if parts is None:
        parts = split(motions, settings.split, window_s=settings.window_s)
    else:
        parts = parts.within([motion.valid for motion in motions])

    progress("fitting")
    training = factorise(
        *rows_of(functions, motions, targets, parts.training), names=functions.terms, where=motions[0].log
    )
    validation = type(training).of(*rows_of(functions, motions, measured, parts.validation))
    components = settings.components
    if components == "auto":
        components = _choice(profile, settings, functions, opened, (settings.window_s,), parts.training).components
    functions, model_fit, chosen, held = regress(
        profile, settings, functions, training, int(components), forceless(motions, targets, parts.training)
    )
    theta, intercept = model_fit.coefficients[chosen - 1], model_fit.intercepts[chosen - 1]

    progress("resampling blocks for the intervals")
    rows = rows_of(functions, motions, targets, parts.training)
    rates = [motion.rate_hz for motion in motions]
    block_s, narrow = block_seconds(rows, rates, theta, intercept)
    spread = bootstrap(
        Blocks.of(rows, rates, block_s),
        chosen,
        draws=settings.draws,
        seed=settings.seed,
        allowed=functions.mask,
        block_s=block_s,
        notes=narrow,
    )

    progress("judging")
    base = Estimator(profile, settings.scale)
    new = Estimator(profile, settings.scale, functions, theta, intercept)
    fitted = [
        LogFit(motion, train, check, base.of(motion), new.of(motion), one.quality)
        for one, motion, train, check in zip(prepared, motions, parts.training, parts.validation, strict=True)
    ]
    scores = _scores(fitted, parts)
    verdict = accept(
        np.array([scores["mse"]["base"][axis] for axis in AXES]),
        np.array([scores["mse"]["model"][axis] for axis in AXES]),
    )
    known = excitation(training, functions.terms, model_fit.vip(chosen), motions, parts.training, functions.mask)
    progress("running free")
    free_base = free_run(base, motions, parts.validation)
    free_new = free_run(new, motions, parts.validation)
    model = Model(
        name=name,
        version=0,
        created=datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        ferryid_version=__version__,
        profile_text=profile.text,
        scale=settings.scale,
        settings={**settings.plain(), "basis": functions.name, "components": chosen, **grids(motions, settings)},
        terms=functions.terms,
        units=functions.units,
        theta=theta,
        intercept=intercept,
        low=spread.low,
        high=spread.high,
        intercept_low=spread.intercept_low,
        intercept_high=spread.intercept_high,
        covariance=spread.covariance,
        ranges=known.ranges,
        training=tuple(
            {
                "name": one.motion.log,
                "files": [Path(file).name for file in one.recording.files],
                "sha256": one.recording.sha256,
                "seconds": float(mask.sum() / one.motion.rate_hz),
                "rows": int(mask.sum()),
            }
            for one, mask in zip(prepared, parts.training, strict=True)
        ),
        scores=scores,
        accepted=verdict.accepted,
    )
    curve = curve_of(model_fit, training, validation, scores, chosen)
    warnings = (
        *held,
        *cautions(settings, parts, known, prepared, motions, scores),
        *free_run_cautions(free_base, free_new),
        *spread.notes,
    )
    return FitResult(model, verdict, tuple(fitted), curve, known, free_base, free_new, warnings)


def _windowed(profile: Profile, settings: FitSettings, opened: Sequence[Opened]) -> tuple[FitSettings, Split]:
    """Return the settings with the window, and where that is asked for the component count, that cross-validation chose.

    Its split is to be kept: another, made for the window chosen, would validate on rows that took part in the choice.
    """
    windows_s = tried(settings.windows_s, [one.measured for one in opened], in_blocks=settings.split == "blocks")
    motions = _told_apart([smooth_measured(one.measured, TEST_WINDOW_S) for one in opened])
    functions = basis_of(settings, motions)
    check_components(settings.components, functions)
    parts = split(motions, settings.split, window_s=max(TEST_WINDOW_S, *windows_s))
    choice = _choice(profile, settings, functions, opened, windows_s, parts.training)
    return replace(settings, window_s=choice.window_s, components=choice.components), parts


def _choice(
    profile: Profile,
    settings: FitSettings,
    functions: Basis,
    opened: Sequence[Opened],
    windows_s: Sequence[float],
    wanted: Sequence[Flags],
) -> Choice:
    logs = [
        studied(profile, settings, functions, one.measured, windows_s, wanted=rows)
        for one, rows in zip(opened, wanted, strict=True)
    ]
    return choose(profile, settings, functions, windows_s, folds_by_blocks(logs), force_free(logs), where=logs[0].log)


def _told_apart(motions: Sequence[Motion]) -> list[Motion]:
    """Number logs of the same name, so that messages and figures can tell them apart."""
    names = [motion.log for motion in motions]
    return [
        replace(motion, log=f"{motion.log} ({names[: i + 1].count(motion.log)})")
        if names.count(motion.log) > 1
        else motion
        for i, motion in enumerate(motions)
    ]


def regress(
    profile: Profile,
    settings: FitSettings,
    functions: Basis,
    training: CrossProducts | QrFactor,
    components: int,
    without_force: Flags,
    *,
    before: Floats | None = None,
) -> tuple[Basis, Simpls, int, tuple[str, ...]]:
    """Return basis, SIMPLS fit and number of components, and on which axes the inertia had to be held and why.

    Parameters
    ----------
    profile, settings, functions, training
        Vessel, how to fit, basis and training rows.
    components
        Number wanted; beyond the terms as many as there are terms.
    without_force
        Axes on which no actuator acts, shape (3,).
    before
        Coefficients that those fitted here come on top of, shape (K, 3); they count in the effective inertia.
    """
    already = 0.0 if before is None else before
    most = len(functions.terms)
    chosen = min(components, most)
    fitted = functions.mask.any(axis=0)
    axes = without_force & fitted if settings.inertia == "auto" else np.zeros(3, dtype=bool)
    told = {axis: reason(axis, np.zeros((3, 3)), profile, True) for axis in np.flatnonzero(axes).tolist()}
    while True:
        functions = replace(functions, mask=without_inertia(functions.mask, functions.terms, axes))
        model_fit = simpls(training, most, allowed=functions.mask)
        mass = effective_mass(profile, settings.scale, functions.terms, model_fit.coefficients[chosen - 1] + already)
        more = unbelievable(profile, mass) & fitted & ~axes
        if settings.inertia == "fitted" or not more.any():
            return functions, model_fit, chosen, tuple(told.values())
        told |= {axis: reason(axis, mass, profile, False) for axis in np.flatnonzero(more).tolist()}
        axes = axes | more


def forceless(motions: Sequence[Motion], targets: Sequence[Floats], rows: Sequence[Flags]) -> Flags:
    """Return the axes on which no actuator acts on the given rows, shape (3,)."""
    tau = np.concatenate([motion.tau[mask] for motion, mask in zip(motions, rows, strict=True)])
    base = tau - np.concatenate([target[mask] for target, mask in zip(targets, rows, strict=True)])
    return unforced(np.std(tau, axis=0), np.std(base, axis=0))


def _scores(fitted: Sequence[LogFit], parts: Split) -> dict[str, Any]:
    rows = [log.validation for log in fitted]
    tau, base, model = (
        np.concatenate([values[mask] for values, mask in zip(columns, rows, strict=True)])
        for columns in (
            (log.motion.tau for log in fitted),
            (log.tau_base for log in fitted),
            (log.tau_model for log in fitted),
        )
    )
    scores = force_scores(tau, base, model, np.ones(len(tau), dtype=bool))
    seconds = sum(float(mask.sum()) / log.motion.rate_hz for log, mask in zip(fitted, rows, strict=True))
    return {**scores, "rows": len(tau), "seconds": seconds, "split": parts.kind, "split_notes": list(parts.notes)}


def curve_of(
    model_fit: Simpls,
    training: CrossProducts | QrFactor,
    validation: CrossProducts | QrFactor,
    scores: dict[str, Any],
    chosen: int,
) -> ComponentCurve:
    """Return errors for every number of components over the base model's error on the validation rows."""
    unit = np.array([scores["mse"]["base"][axis] for axis in AXES])
    unit = np.where(unit > 0, unit, 1.0)
    most = len(model_fit.coefficients)
    return ComponentCurve(
        np.arange(1, most + 1),
        sse(training, model_fit.coefficients, model_fit.intercepts) / max(training.n, 1) / unit,
        sse(validation, model_fit.coefficients, model_fit.intercepts) / max(validation.n, 1) / unit,
        chosen,
        model_fit.explained_x,
        model_fit.explained_y,
    )
