"""Adaptive rounds: models from motions in memory, corrections on top of a model, and updates of single axes.

Nothing is held out, as in the thesis's rounds: whether a new model may replace the old one is asked of other motions,
with `judge`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.errors import FerryIdError, did_you_mean
from ferryid.identify.basis import Basis
from ferryid.identify.combine import gathered, reference, spanned
from ferryid.identify.correction import bare_model, correct, scored, task_of
from ferryid.identify.estimate import Estimator, estimator
from ferryid.identify.model import AXES, Model
from ferryid.identify.settings import FitSettings
from ferryid.identify.store import checked_name
from ferryid.signals.track import Motion
from ferryid.vessel import parse_profile
from ferryid.vessel.profile import Profile

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

_LETTERS = ("u", "v", "r")


@dataclass(frozen=True, eq=False)
class DataMatrix:
    """Rows of a fit as one matrix, for methods that need the data itself.

    Attributes
    ----------
    functions
        The basis.
    X
        Its functions, shape (n, K).
    Y
        Lack-of-fit residual [N, N, N·m], shape (n, 3).
    """

    functions: Basis
    X: Floats
    Y: Floats


def fit_motions(
    profile: Profile,
    motions: Sequence[Motion],
    settings: FitSettings,
    *,
    name: str = "",
    base: Model | None = None,
    rows: Sequence[Flags] | None = None,
    draws: int = 0,
) -> Model:
    """Fit a model to motions in memory, every row of which trains.

    Parameters
    ----------
    profile
        The vessel.
    motions
        Smoothed motions; `settings` says with which window they were smoothed.
    settings
        How to fit; the split is not used. With ``components="auto"`` the number is found by cross-validation.
    name
        Name of the model; the profile's where empty.
    base
        Model that takes the base model's place: the residual is taken against its force, and the result is the
        sum of both. It brings its own factors delta, sigma and zeta, those of `settings` do not count. Thesis 3.2.5.
    rows
        Rows to use, one mask a motion, shape (n,); None: all.
    draws
        Block-bootstrap draws. Without them intervals and covariance are NaN. On top of a base they are those of
        the new correction, the base being what is known.

    Returns
    -------
    Model
        Version 0, not accepted, as it was not judged; its scores are those on the training rows. ``base_model`` in its
        settings names `base`, ``notes`` holds what a reader must know.

    Raises
    ------
    FerryIdError
        For motions that cannot be used, or a base of another vessel or basis.
    """
    if base is not None:
        settings = replace(settings, **_factors(base))
    task = task_of(profile, motions, settings, base, rows)
    found = correct(profile, settings, task, base, draws)
    model = bare_model(profile, settings, task, found, checked_name(name or profile.name), draws)
    if base is None:
        return scored(model, task, Estimator(profile, settings.scale))
    model = replace(
        model,
        settings={**model.settings, "base_model": reference(base)},
        theta=base.theta + found.theta,
        intercept=base.intercept + found.intercept,
        low=base.theta + found.low,
        high=base.theta + found.high,
        intercept_low=base.intercept + found.intercept_low,
        intercept_high=base.intercept + found.intercept_high,
        ranges=spanned([base.ranges, model.ranges]),
        training=gathered([base.training, model.training]),
    )
    return scored(model, task, estimator(base))


def update_axes(
    model: Model,
    motions: Sequence[Motion],
    *,
    axes: Sequence[str] = ("surge",),
    terms: Sequence[str] | None = None,
    settings: FitSettings | None = None,
    name: str = "",
    rows: Sequence[Flags] | None = None,
    draws: int = 0,
) -> Model:
    """Fit a further correction on some axes alone and lock the rest to the earlier model, thesis 5.6.5.

    The force of the locked axes stays the same to the last digit.

    Parameters
    ----------
    model
        The earlier model. The residual is taken against its force.
    motions
        Smoothed motions; a crossing, or some seconds of speeding up, may do for surge.
    axes
        Axes to update, of ``"surge"``, ``"sway"``, ``"yaw"``.
    terms
        Terms whose coefficients may change on these axes, besides the intercept. None: those of the motion along these
        axes alone (for surge u_dot, u, |u|u, u^3), because a log with hardly any sway and yaw says nothing of the
        others. They keep the earlier model's coefficients.
    settings
        How to fit; the earlier model's settings where None. Basis must be the earlier model's.
    name
        Name of the result; the earlier model's where empty.
    rows, draws
        As in `fit_motions`.

    Returns
    -------
    Model
        As in `fit_motions`; ``updated`` in its settings lists axes and terms.

    Raises
    ------
    FerryIdError
        For an axis or term that does not exist, or motions that cannot be used.
    """
    numbers = _axis_numbers(axes)
    profile = parse_profile(model.profile_text, model.name)
    settings = replace(settings or settings_of(model), **_factors(model))
    task = task_of(profile, motions, settings, model, rows)
    mask = _updated(task.functions, numbers, terms)
    found = correct(profile, settings, replace(task, functions=replace(task.functions, mask=mask)), model, draws)
    fresh = bare_model(profile, settings, task, found, checked_name(name or model.name), draws)
    constant = np.isin(np.arange(3), numbers)
    changed = [model.terms[k] for k in np.flatnonzero(mask.any(axis=1))]
    updated = replace(
        fresh,
        settings={
            **fresh.settings,
            "structure": model.settings["structure"],
            "base_model": reference(model),
            "updated": [*(AXES[axis] for axis in numbers), *changed],
        },
        theta=model.theta + found.theta,
        intercept=np.where(constant, model.intercept + found.intercept, model.intercept),
        low=np.where(mask, model.theta + found.low, model.low),
        high=np.where(mask, model.theta + found.high, model.high),
        intercept_low=np.where(constant, model.intercept + found.intercept_low, model.intercept_low),
        intercept_high=np.where(constant, model.intercept + found.intercept_high, model.intercept_high),
        covariance=_spliced(model.covariance, found.covariance, mask, numbers),
        ranges=spanned([model.ranges, fresh.ranges]),
        training=gathered([model.training, fresh.training]),
    )
    return scored(updated, task, estimator(model))


def data_matrix(
    profile: Profile,
    motions: Sequence[Motion],
    settings: FitSettings,
    *,
    base: Model | None = None,
    rows: Sequence[Flags] | None = None,
) -> DataMatrix:
    """Return basis and residual on the rows that `fit_motions` would use; arguments as there."""
    if base is not None:
        settings = replace(settings, **_factors(base))
    task = task_of(profile, motions, settings, base, rows)
    X = [task.functions.of(motion, mask) for motion, mask in zip(task.motions, task.masks, strict=True)]
    Y = [target[mask] for target, mask in zip(task.targets, task.masks, strict=True)]
    return DataMatrix(task.functions, np.concatenate(X), np.concatenate(Y))


def settings_of(model: Model) -> FitSettings:
    """Return the settings that a model was fitted with, factors on the base model included; all but split and draws."""
    kept = FitSettings.__dataclass_fields__.keys() - {"split", "draws", "windows_s"}
    known = {key: value for key, value in model.settings.items() if key in kept}
    return FitSettings(**{**known, **_factors(model)})


def _factors(model: Model) -> dict[str, Any]:
    return {key: float(model.scale.get(key, 1.0)) for key in ("delta", "sigma", "zeta")}


def _axis_numbers(axes: Sequence[str]) -> list[int]:
    names = [axes] if isinstance(axes, str) else list(axes)
    for axis in names:
        if axis not in AXES:
            raise FerryIdError(
                f'update: there is no axis called "{axis}".{did_you_mean(axis, AXES)} Fix: choose of {", ".join(AXES)}'
            )
    if not names:
        raise FerryIdError(f"update: no axis was given. Fix: choose of {', '.join(AXES)}")
    return sorted({AXES.index(axis) for axis in names})


def _updated(functions: Basis, axes: Sequence[int], terms: Sequence[str] | None) -> Flags:
    """Return the coefficients that may change, shape (K, 3)."""
    for term in terms or ():
        if term not in functions.terms:
            raise FerryIdError(
                f'update: the basis {functions.name} has no term "{term}".{did_you_mean(term, functions.terms)} '
                f"Fix: choose of {', '.join(functions.terms)}"
            )
    letters = {_LETTERS[axis] for axis in axes}
    own = {form for letter in letters for form in (letter, f"|{letter}|", f"{letter}_dot")}
    mask = np.zeros_like(functions.mask)
    for k, function in enumerate(functions.functions):
        chosen = own.issuperset(function.factors) if terms is None else function.name in terms
        mask[k, axes] = chosen & functions.mask[k, axes]
    return mask


def _spliced(before: Floats, found: Floats, mask: Flags, axes: Sequence[int]) -> Floats:
    """Return the earlier covariance with that of the coefficients fitted again in its place, apart from the rest."""
    covariance = before.copy()
    for axis in axes:
        again = np.append(np.flatnonzero(mask[:, axis]), len(mask))
        covariance[axis, again] = 0.0
        covariance[axis, :, again] = 0.0
        covariance[axis][np.ix_(again, again)] = found[axis][np.ix_(again, again)]
    return covariance
