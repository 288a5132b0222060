"""Adaptive rounds: models from motions in memory, corrections on top of a model, and updates of single axes.

Nothing is held out, as in the thesis's rounds: whether a new model may replace the old one is asked of other motions,
with `accept_on_motions`.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.errors import FerryIdError, did_you_mean
from ferryid.identify.acceptance import wanted_rows
from ferryid.identify.adaptive.averaging import check_vessel, merge_training_logs, model_reference
from ferryid.identify.estimation import estimate_correction
from ferryid.identify.fit_data import Coefficients, Estimate
from ferryid.identify.log_sums import folds_by_blocks, force_free_axes, sum_motions
from ferryid.identify.model_selection import select_model
from ferryid.identify.motion_data import MotionData, stacked
from ferryid.identify.outcome import Excitation, FitOutcome
from ferryid.identify.pipeline import accept_estimate
from ferryid.identify.rows import basis_for, grids, known_rows
from ferryid.identify.settings import FitSettings
from ferryid.identify.split import Split
from ferryid.models import Model, ModelScores, span_ranges
from ferryid.models.forces import Estimator, compute_residual, model_estimator
from ferryid.models.prediction import FreeRun
from ferryid.models.store import check_name
from ferryid.regression import CrossProducts, QrFactor
from ferryid.regression.bases import Basis, make_basis
from ferryid.signals.track import Motion
from ferryid.types import AXES, Flags, Floats, RunContext
from ferryid.vessel import parse_profile
from ferryid.vessel.profile import Profile

_LETTERS = ("u", "v", "r")
_NOTE = "Nothing was held out: the scores are those of the rows that trained the model, and flatter it."
_NOT_RUN = FreeRun.not_run("not run free: no rows were held out")
_IN_MEMORY = RunContext(Path())
"""A fit to motions in memory writes nothing."""


@dataclass(frozen=True, eq=False)
class AdaptiveData(MotionData):
    """Motions of which all wanted rows train, and the model that the correction comes on top of.

    Attributes
    ----------
    model
        The earlier model; None: the base model alone.
    draws
        Block-bootstrap draws.
    axes
        Axes that may change, shape (3,); the others are locked to the earlier model. None: all may.
    """

    model: Model | None
    draws: int
    axes: Flags | None = None

    @property
    def before(self) -> Floats | None:
        """Coefficients of the earlier model, shape (K, 3)."""
        return None if self.model is None else self.model.theta

    @property
    def validation(self) -> QrFactor | CrossProducts:
        """Basis and residual of the training rows: no others are there to judge by."""
        return self.training

    def base(self) -> Estimator:
        """Return the estimator of the earlier model."""
        return super().base() if self.model is None else model_estimator(self.model)

    def combined(self, found: Coefficients) -> Coefficients:
        """Return the sum of earlier model and correction; locked coefficients are the earlier model's to the last digit."""
        model = self.model
        if model is None:
            return found
        added = Coefficients(
            theta=model.theta + found.theta,
            intercept=model.intercept + found.intercept,
            low=model.theta + found.low,
            high=model.theta + found.high,
            intercept_low=model.intercept + found.intercept_low,
            intercept_high=model.intercept + found.intercept_high,
            covariance=found.covariance,
        )
        if self.axes is None:
            return added
        mask, axes = self.functions.mask, self.axes
        return Coefficients(
            theta=added.theta,
            intercept=np.where(axes, added.intercept, model.intercept),
            low=np.where(mask, added.low, model.low),
            high=np.where(mask, added.high, model.high),
            intercept_low=np.where(axes, added.intercept_low, model.intercept_low),
            intercept_high=np.where(axes, added.intercept_high, model.intercept_high),
            covariance=_spliced(model.covariance, found.covariance, mask, axes),
        )

    def free_runs(self, found: Coefficients, progress: Callable[[str], None]) -> tuple[FreeRun, FreeRun]:
        """Return no free runs, as no rows are held out for them."""
        return _NOT_RUN, _NOT_RUN

    def training_logs(self) -> tuple[Mapping[str, Any], ...]:
        """Return the motions and the earlier model's training logs as a model file lists them."""
        own = tuple(
            {
                "name": motion.log,
                "files": [],
                "sha256": _digest(motion),
                "seconds": float(mask.sum() / motion.rate_hz),
                "rows": int(mask.sum()),
            }
            for motion, mask in zip(self.motions, self.split.training, strict=True)
        )
        return own if self.model is None else merge_training_logs([self.model.training, own])

    def model_settings(self, estimate: Estimate) -> dict[str, Any]:
        """Return what the model stands on, and what to know of it."""
        told = {
            "split": "none",
            "draws": self.draws,
            "notes": [*estimate.held, *estimate.notes],
            **grids(self.motions, self.settings),
        }
        if self.model is None:
            return told
        told["base_model"] = model_reference(self.model)
        if self.axes is not None:
            mask = self.functions.mask
            changed = [self.model.terms[k] for k in np.flatnonzero(mask.any(axis=1))]
            told["structure"] = self.model.settings["structure"]
            told["updated"] = [*(AXES[axis] for axis in np.flatnonzero(self.axes)), *changed]
        return told

    def ranges(self, excitation: Excitation) -> Mapping[str, tuple[float, float]]:
        """Return ranges that span those of the motions and the earlier model's."""
        return excitation.ranges if self.model is None else span_ranges([self.model.ranges, excitation.ranges])

    def warnings(self, excitation: Excitation, scores: ModelScores) -> tuple[str, ...]:
        """Return that the scores flatter the model."""
        return (_NOTE,)


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
    data = _data(profile, motions, settings, base, rows, draws)
    return _fitted(data, check_name(name or profile.name))


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
    data = _data(profile, motions, settings, model, rows, draws)
    mask = _updated(data.functions, numbers, terms)
    data = replace(data, functions=replace(data.functions, mask=mask), axes=np.isin(np.arange(3), numbers))
    return _fitted(data, check_name(name or model.name))


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
    data = _data(profile, motions, settings, base, rows, draws=0)
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


def _data(
    profile: Profile,
    motions: Sequence[Motion],
    settings: FitSettings,
    model: Model | None,
    rows: Sequence[Flags] | None,
    draws: int,
) -> AdaptiveData:
    """Return basis, residual and usable rows of motions; arguments and errors as of `fit_motions`."""
    if not motions:
        raise FerryIdError("fit: there are no motions to fit. Fix: give one or more")
    sized = settings.on(profile)
    if model is None:
        functions = basis_for(sized, motions)
    else:
        _check_base(model, profile, sized)
        functions = make_basis(str(model.settings["basis"]), structure=settings.structure)
    targets = [compute_residual(profile, motion, settings.scale, settings.residual) for motion in motions]
    measured = (
        targets
        if settings.residual == "measured"
        else [compute_residual(profile, motion, settings.scale) for motion in motions]
    )
    masks = []
    for motion, target, error, wanted in zip(motions, targets, measured, wanted_rows(motions, rows), strict=True):
        mask = known_rows(motion, functions, target, error) & wanted
        if not mask.any():
            raise FerryIdError(
                f"{motion.log}: none of the rows asked for has velocity, acceleration and applied force. "
                "Fix: ask for other rows, or leave the motion out"
            )
        masks.append(mask)
    if model is not None:
        targets = [
            target - (functions.of(motion) @ model.theta + model.intercept)
            for motion, target in zip(motions, targets, strict=True)
        ]
    nothing = tuple(np.zeros(len(motion.t), dtype=bool) for motion in motions)
    split = Split("none", tuple(masks), nothing, 0.0, (_NOTE,))
    return AdaptiveData(profile, settings, functions, tuple(motions), tuple(targets), split, model, draws)


def _fitted(data: AdaptiveData, name: str) -> FitOutcome:
    estimate = estimate_correction(data, _components(data), data.draws, _IN_MEMORY.progress)
    return accept_estimate(data, estimate, name, _IN_MEMORY)


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


def _check_base(base: Model, profile: Profile, settings: FitSettings) -> None:
    where, name = f"{base.name}@{base.version}", str(base.settings["basis"])
    if base.diagnosed:
        raise FerryIdError(
            f"model {where}: a diagnosis has changed its hull or forces, and a correction would be fitted to what these "
            "explain. Fix: take the model that was diagnosed as the base"
        )
    if settings.basis not in (name, name.partition("+")[0]):
        raise FerryIdError(
            f"model {where}: as a base its basis {name} must be that of the fit, which is {settings.basis}. "
            f"Fix: set the basis to {name}"
        )
    model_estimator(base)  # refuses a model whose terms were changed
    if base.profile_text != profile.text:
        check_vessel(profile, parse_profile(base.profile_text, base.name), where)
    if settings.residual == "parallel":
        raise FerryIdError(
            f"model {where}: the parallel residual runs the physical base model and cannot be taken against a model. "
            "Fix: use the residual measured or commanded"
        )


def _spliced(before: Floats, found: Floats, mask: Flags, axes: Flags) -> Floats:
    """Return the earlier covariance with that of the coefficients fitted again in its place, apart from the rest."""
    covariance = before.copy()
    for axis in np.flatnonzero(axes).tolist():
        again = np.append(np.flatnonzero(mask[:, axis]), len(mask))
        covariance[axis, again] = 0.0
        covariance[axis, :, again] = 0.0
        covariance[axis][np.ix_(again, again)] = found[axis][np.ix_(again, again)]
    return covariance


def _digest(motion: Motion) -> str:
    """SHA-256 of a motion in memory, which has no file to name: of its velocity, acceleration and force."""
    digest = hashlib.sha256(f"{motion.rate_hz!r} {len(motion.t)}".encode())
    for values in (motion.nu, motion.nu_dot, motion.tau):
        digest.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
    return digest.hexdigest()
