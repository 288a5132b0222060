"""A fit to what a model leaves: its hull, its effects and the conditions of each log stand in the place of the base model.

What the model knows of a log is taken off the measured force, so that all that follows (split, estimators, acceptance) is
that of any other fit, and a steady wind that a diagnosis has named is not estimated once more.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ferryid.effects.measurements import interpolate_gaps
from ferryid.errors import FerryIdError
from ferryid.identify.outcome import FitOutcome
from ferryid.identify.pipeline import fit_opened
from ferryid.identify.rows import basis_for
from ferryid.identify.settings import FitSettings
from ferryid.models import Model, Quantity
from ferryid.models.forces import (
    ModelForces,
    base_force,
    effective_mass,
    hull_contribution,
    replace_hull_coefficients,
)
from ferryid.models.prediction import predict, predict_with_effects, window_errors
from ferryid.regression.bases import Basis
from ferryid.signals.prepare import Opened, Prepared, smoothed
from ferryid.signals.smooth import Measured
from ferryid.signals.track import Motion
from ferryid.types import Flags, Floats, RunContext
from ferryid.vessel.dimensions import window_seconds
from ferryid.vessel.profile import Profile


def fit_remainder(
    model: Model, opened: Sequence[Opened], profile: Profile, settings: FitSettings, run: RunContext
) -> FitOutcome:
    """Fit a correction of a model to logs, and judge it against that model on rows that it did not see.

    Parameters
    ----------
    model
        The model that takes the place of the base model. A log whose conditions it knows is taken with these.
    opened
        Logs that were read and aligned.
    profile, settings, run
        As of `ferryid.identify.fit_logs`; terms and smoothing are those of the model where it has terms.

    Returns
    -------
    FitOutcome
        Its model holds the correction alone; `with_remainder` puts it on top.

    Raises
    ------
    FerryIdError
        For input that cannot be used, with file, cause and remedy.
    """
    settings = _settings_of(model, settings).on(profile)
    start = _with_terms(model, basis_for(settings, [one.measured for one in opened]))
    hull = replace_hull_coefficients(profile.hull, ModelForces(start).altered_hull())
    # The load of the wind is among the forces that are taken off.
    bare = replace(profile, hull=hull, wind=None)
    settings = replace(settings, delta=1.0, sigma=1.0, zeta=1.0)
    left = [replace(one, measured=_unexplained(start, one, profile, bare, settings)) for one in opened]
    return fit_opened(left, bare, settings, run, model.name)


def with_remainder(model: Model, remainder: Model) -> Model:
    """Return a model with a correction on top of it that `fit_remainder` estimated.

    The coefficients of the hull have those of the correction's terms counted in, before the properties of the vessel act on
    them. Intervals of what was corrected are the correction's.
    """
    before = model.theta if model.terms else np.zeros_like(remainder.theta)
    constant = model.intercept if model.terms else np.zeros(3)
    corrected = replace(
        model,
        settings={**remainder.settings, **_kept(model), "learned": True},
        terms=remainder.terms,
        units=remainder.units,
        theta=before + remainder.theta,
        intercept=constant + remainder.intercept,
        low=before + remainder.low,
        high=before + remainder.high,
        intercept_low=constant + remainder.intercept_low,
        intercept_high=constant + remainder.intercept_high,
        covariance=remainder.covariance,
        ranges=remainder.ranges,
        training=_trained(model, remainder),
    )
    if not model.hull:
        return corrected
    known = ModelForces(model)
    factor = np.divide(known.altered_hull(), known.hull, out=np.ones_like(known.hull), where=known.hull != 0.0)
    more, variance = hull_contribution(remainder)
    more, ends = more / factor, 1.96 * np.sqrt(np.maximum(variance, 0.0)) / np.abs(factor)
    hull = {}
    for (name, one), value, end in zip(model.hull.items(), more.tolist(), ends.tolist(), strict=True):
        moved = Quantity(one.value + value, one.low + value, one.high + value, one.unit)
        hull[name] = replace(moved, low=moved.value - end, high=moved.value + end) if end > 0.0 else moved
    return replace(corrected, hull=hull)


def prediction_errors(
    models: Sequence[Model],
    opened: Sequence[Opened],
    profile: Profile,
    settings: FitSettings,
    rows: Sequence[Flags],
) -> list[Floats]:
    """Return how well models predict the acceleration of logs, averaged over windows, as force on the profile's mass.

    Parameters
    ----------
    models
        Stored models of any kind; each sees a log with the effects that it knows.
    opened
        Logs that were read and aligned.
    profile, settings
        As of `ferryid.identify.fit_logs`.
    rows
        Rows of each log, shape (n,), whose windows count.

    Returns
    -------
    list of ndarray
        Mean square error of each model, shape (3,) [N², N², (N·m)²], on the same windows; NaN where there is none.
    """
    mass = effective_mass(profile, settings.scale, (), np.zeros((0, 3)))
    length_s = window_seconds(profile)
    squares = [[np.zeros((0, 3))] for _ in models]
    for one, wanted in zip(opened, rows, strict=True):
        prepared = smoothed(one, settings.window_s, settings.smoother, keep_track=True)
        found = [
            predict(model, prepared, profile, window_s=settings.window_s, smoother=settings.smoother)
            for model in models
        ]
        errors = window_errors(found, prepared.motion, wanted, mass, length_s).errors
        for own, error in zip(squares, errors, strict=True):
            own.append(error**2)
    every = [np.concatenate(own) for own in squares]
    return [one.mean(axis=0) if len(one) else np.full(3, np.nan) for one in every]


def _settings_of(model: Model, settings: FitSettings) -> FitSettings:
    """Return the settings with terms and smoothing of a model that has terms: corrections add up term by term."""
    if not model.terms:
        return settings
    known = model.settings
    return replace(
        settings,
        basis=str(known["basis"]),
        structure=str(known["structure"]),
        window_s=float(known["window_s"]),
        smoother=str(known.get("smoother", settings.smoother)),
        windows_s=(),
    )


def _with_terms(model: Model, functions: Basis) -> Model:
    """Return a model with the terms of a basis, without coefficients where it had no terms.

    Raises
    ------
    FerryIdError
        Where it has other terms.
    """
    if model.terms:
        if model.terms != functions.terms:
            raise FerryIdError(
                f"{model.label}: its terms are not those of the basis {functions.name}. Fix: fit the model again"
            )
        return model
    K = len(functions.terms)
    nothing = np.zeros((K, 3))
    return replace(
        model,
        settings={**model.settings, "basis": functions.name, "structure": functions.structure},
        terms=functions.terms,
        units=functions.units,
        theta=nothing,
        low=nothing,
        high=nothing,
        covariance=np.zeros((3, K + 1, K + 1)),
    )


def _unexplained(model: Model, opened: Opened, profile: Profile, bare: Profile, settings: FitSettings) -> Measured:
    """Return what was measured, with the forces of the model beyond its hull's taken off the applied force.

    They go with the velocity: beside a velocity with slow errors a wind would load the vessel otherwise than beside a better
    one, and a fit to what is left would put the difference into the damping.
    """
    prepared = smoothed(opened, settings.window_s, settings.smoother, keep_track=True)
    before, measured = prepared.motion, opened.measured
    seen, more, known = _beyond_hull(model, prepared, profile, bare, settings, steadied=False)
    _, steadied, also = _beyond_hull(model, prepared, profile, bare, settings, steadied=True)

    def bridged(values: Floats, rows: Flags) -> Floats:
        # Smoothing once more would lose as many rows again beside every gap.
        return interpolate_gaps(np.where(rows[:, None], values, np.nan), rows)

    return replace(
        measured,
        tau=measured.tau + bridged(more, known),
        tau_steadied=measured.tau + bridged(steadied, also),
        nu=measured.nu + bridged(seen.nu - before.nu, known),
        eta=measured.eta if seen.eta is before.eta else measured.eta + bridged(seen.eta - before.eta, known),
    )


def _beyond_hull(
    model: Model, prepared: Prepared, profile: Profile, bare: Profile, settings: FitSettings, *, steadied: bool
) -> tuple[Motion, Floats, Flags]:
    """Return a log as a model sees it, which force acts that its hull does not know, (n, 3), and where that is known, (n,)."""
    found = predict_with_effects(
        model, prepared, profile, window_s=settings.window_s, smoother=settings.smoother, steadied=steadied
    )
    before, seen = prepared.motion, found.motion
    needed = found.force(seen.nu_dot, seen.nu, seen.eta[:, 2], seen.wind, seen.current, seen.payload)
    hull = base_force(bare, replace(seen, current=before.current, payload=before.payload), settings.scale)
    known = before.valid & np.isfinite(needed - hull).all(axis=1)
    return seen, seen.tau - before.tau - needed + hull, known


def _kept(model: Model) -> dict[str, object]:
    """Return what the settings of a corrected model say of its diagnosis."""
    return {name: model.settings[name] for name in ("diagnosed_from",) if name in model.settings}


def _trained(model: Model, remainder: Model) -> tuple[Mapping[str, Any], ...]:
    """Return the logs that a model and its correction have seen, each once."""
    known = {str(one["sha256"]): one for one in model.training}
    return tuple({**{str(one["sha256"]): one for one in remainder.training}, **known}.values())
