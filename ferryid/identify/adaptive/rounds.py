"""Adaptive rounds: models from motions in memory, corrections on top of a model, and updates of single axes.

Nothing is held out, as in the thesis's rounds: whether a new model may replace the old one is asked of other motions,
with `accept_on_motions`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ferryid.errors import FerryIdError, did_you_mean
from ferryid.identify.adaptive.adaptive_data import AdaptiveData, adaptive_data
from ferryid.identify.estimation import estimate_correction
from ferryid.identify.log_sums import folds_by_blocks, force_free_axes, sum_motions
from ferryid.identify.model_selection import select_model
from ferryid.identify.motion_data import stacked
from ferryid.identify.outcome import FitOutcome
from ferryid.identify.pipeline import accept_estimate
from ferryid.identify.settings import FitSettings
from ferryid.models import Model
from ferryid.models.store import check_name
from ferryid.regression.bases import Basis
from ferryid.signals.track import Motion
from ferryid.types import AXES, IN_MEMORY, Flags, Floats
from ferryid.vessel import parse_profile
from ferryid.vessel.profile import Profile

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
) -> FitOutcome:
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
    FitOutcome
        Its model is not accepted, as it was not judged; its scores are those on the training rows. ``base_model`` in the
        model's settings names `base`, ``notes`` holds what a reader must know.

    Raises
    ------
    FerryIdError
        For motions that cannot be used, or a base of another vessel or basis.
    """
    if base is not None:
        settings = replace(settings, **_factors(base))
    data = adaptive_data(profile, motions, settings, base, rows, draws)
    return _fit(data, check_name(name or profile.name))


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
) -> FitOutcome:
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
    FitOutcome
        As in `fit_motions`; ``updated`` in the model's settings lists axes and terms.

    Raises
    ------
    FerryIdError
        For an axis or term that does not exist, or motions that cannot be used.
    """
    numbers = _axis_numbers(axes)
    profile = parse_profile(model.profile_text, model.name)
    settings = replace(settings or settings_of_model(model), **_factors(model))
    data = adaptive_data(profile, motions, settings, model, rows, draws)
    mask = _update_mask(data.functions, numbers, terms)
    data = replace(data, functions=replace(data.functions, mask=mask), axes=np.isin(np.arange(3), numbers))
    return _fit(data, check_name(name or model.name))


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
    data = adaptive_data(profile, motions, settings, base, rows, draws=0)
    X = [data.functions.of(motion, mask) for motion, mask in zip(data.motions, data.split.training, strict=True)]
    return DataMatrix(data.functions, np.concatenate(X), stacked(data.targets, data.split.training))


def settings_of_model(model: Model) -> FitSettings:
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


def _update_mask(functions: Basis, axes: Sequence[int], terms: Sequence[str] | None) -> Flags:
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


def _fit(data: AdaptiveData, name: str) -> FitOutcome:
    estimate = estimate_correction(data, _components(data), data.draws, IN_MEMORY.progress)
    return accept_estimate(data, estimate, name, IN_MEMORY)


def _components(data: AdaptiveData) -> int:
    """Return the number of components, by cross-validation where the settings leave it open."""
    settings = data.settings
    if settings.components != "auto":
        return int(settings.components)
    logs = [
        sum_motions(data.functions, (motion, target), [(motion, target)], settings.window_s, wanted=mask)
        for motion, target, mask in zip(data.motions, data.targets, data.split.training, strict=True)
    ]
    return select_model(
        data.profile,
        settings,
        data.functions,
        [settings.window_s],
        folds_by_blocks(logs),
        force_free_axes(logs),
        before=data.before,
        where=logs[0].log,
    ).components
