"""Data of an adaptive round: motions in memory, on top of an earlier model."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.identify.acceptance import wanted_rows
from ferryid.identify.adaptive.averaging import check_vessel, merge_training_logs, model_reference
from ferryid.identify.fit_data import Coefficients, Estimate
from ferryid.identify.motion_data import MotionData
from ferryid.identify.outcome import Excitation
from ferryid.identify.rows import basis_for, grids, known_rows
from ferryid.identify.settings import FitSettings
from ferryid.identify.split import Split
from ferryid.models import Model, ModelScores, span_ranges
from ferryid.models.forces import Estimator, compute_residual, model_estimator
from ferryid.models.prediction import FreeRun
from ferryid.regression import CrossProducts, QrFactor
from ferryid.regression.bases import make_basis
from ferryid.signals.track import Motion
from ferryid.types import AXES, Flags, Floats
from ferryid.vessel import parse_profile
from ferryid.vessel.profile import Profile

_NOTE = "Nothing was held out: the scores are those of the rows that trained the model, and flatter it."
_NOT_RUN = FreeRun.not_run("not run free: no rows were held out")


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

    def reference(self) -> tuple[Estimator, tuple[Motion, ...]]:
        """Return the earlier model's estimator with the motions themselves, as its basis may need what they measure."""
        return super().reference() if self.model is None else (self.base(), self.motions)

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
            covariance=_splice_covariance(model.covariance, found.covariance, mask, axes),
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


def _splice_covariance(before: Floats, found: Floats, mask: Flags, axes: Flags) -> Floats:
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


def adaptive_data(
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
