"""Whether a new model may replace the old one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ferryid.effects.wording import uncapitalised
from ferryid.errors import FerryIdError
from ferryid.identify.settings import WITHOUT_SWAY
from ferryid.identify.thresholds import IDENTIFY
from ferryid.models import Model, mean_square, usable_rows
from ferryid.models.forces import Estimator, model_estimator
from ferryid.signals.track import Motion
from ferryid.types import AXES, Flags, Floats


@dataclass(frozen=True)
class Check:
    """One condition of acceptance.

    Attributes
    ----------
    name
        Its name, the same in every fit.
    passed
        Whether it holds; None where these data cannot show it, which does not stand in the way.
    value, limit, unit
        What was found, and the bound of it that the reason names.
    reason
        Value, limit and what they mean, in a sentence.
    """

    name: str
    passed: bool | None
    value: float
    limit: float
    unit: str
    reason: str

    def to_json(self) -> dict[str, Any]:
        """Return the check as plain values."""
        return {
            "name": self.name,
            "passed": self.passed,
            "value": self.value,
            "limit": self.limit,
            "unit": self.unit,
            "reason": self.reason,
        }


@dataclass(frozen=True)
class Acceptance:
    """Whether a model is accepted and why, in sentences that a person can act on."""

    accepted: bool
    normalised_mse: float
    """Validation MSE over the base model's, averaged over the three axes."""
    per_axis: Mapping[str, float]
    """The same per axis."""
    reasons: tuple[str, ...]
    """What stands in the way, then what else explains the verdict."""
    checks: tuple[Check, ...] = ()
    """Every condition, whether it holds or not."""
    criterion: str = "thesis"
    """``"full"``, or ``"thesis"``: the held-out error alone."""

    def with_checks(self, checks: Sequence[Check]) -> Acceptance:
        """Return the verdict under the full criterion: that of the held-out error and of all these checks."""
        failed = [f"Rejected: {uncapitalised(check.reason)}" for check in checks if check.passed is False]
        obstacles = sum(reason.startswith("Rejected:") for reason in self.reasons)
        notes = [check.reason for check in checks if check.passed is None]
        return Acceptance(
            self.accepted and not failed,
            self.normalised_mse,
            self.per_axis,
            (*self.reasons[:obstacles], *failed, *self.reasons[obstacles:], *notes),
            (*self.checks, *checks),
            "full",
        )

    def to_json(self) -> dict[str, Any]:
        """Return the verdict as plain values."""
        return {
            "criterion": self.criterion,
            "accepted": self.accepted,
            "checks": [check.to_json() for check in self.checks],
        }


_ROUNDING = 1e-12
_NOTHING = 1e-9
"""Root-mean-square error [N, N·m] that counts as none: rounding of forces of thousands of newtons is below it."""
NOT_JUDGED = Acceptance(False, float("nan"), dict.fromkeys(AXES, float("nan")), ("Not judged: no data were held out.",))
"""Acceptance of a model that was fitted to all rows there are."""


def accept(base_mse: Floats, model_mse: Floats, measure: str = "force", judged: Sequence[str] = AXES) -> Acceptance:
    """Judge a model by its error on validation rows against the base model's.

    Accepted when the MSE (in the thesis that of the estimated applied force), normalised per axis by the base
    model's and averaged over the three axes, falls by 5 % or more, and no axis gets worse by more than 5 % (thesis
    3.2.4). An axis on which the base model makes no error at all has nothing to divide by: its ratio is 1 where the new
    model makes none either, and infinite otherwise. An error that is not a finite number rejects the model.

    Parameters
    ----------
    base_mse, model_mse
        Validation MSE in surge, sway [N²] and yaw [N²·m²], shape (3,).
    measure
        What the error is of, in the sentences: ``"force"`` or ``"prediction"``.
    judged
        Names of the axes that count.

    Returns
    -------
    Acceptance
        With one sentence for the mean and one for every axis that stands in the way or needs an explanation.
    """
    base, model = np.asarray(base_mse, dtype=float), np.asarray(model_mse, dtype=float)
    places = [AXES.index(axis) for axis in judged]
    axes = [_error_on_axis(AXES[i], float(base[i]), float(model[i]), measure) for i in places]
    ratios = [check.value for check in axes]
    obstacles = [f"Rejected: {check.reason}" for check in axes if check.passed is False]
    reasons = [
        check.reason for check, mse in zip(axes, base[places], strict=True) if check.passed and mse <= _NOTHING**2
    ]
    mean = float(np.mean(ratios))
    sentence = f"the {measure} errors could not be compared."
    enough = False
    if np.isfinite(mean):
        enough = mean <= 1.0 - IDENTIFY.improvement + _ROUNDING
        sentence = (
            f"On held-out data the {measure} error (MSE relative to the base model, mean of "
            f"{'three axes' if len(places) == len(AXES) else ' and '.join(judged)}) changes by {_change(mean)}: "
            f"{', '.join(f'{axis} {_change(ratio)}' for axis, ratio in zip(judged, ratios, strict=True))}."
        )
        if not enough:
            obstacles.insert(0, f"Rejected: a fall of {100 * IDENTIFY.improvement:.0f} % or more is needed. {sentence}")
        else:
            reasons.insert(0, sentence)
    mean_check = Check("held_out_error", enough, mean, 1.0 - IDENTIFY.improvement, "of the base model's MSE", sentence)
    per_axis = dict.fromkeys(AXES, float("nan")) | dict(zip(judged, ratios, strict=True))
    return Acceptance(not obstacles, mean, per_axis, (*obstacles, *reasons), (mean_check, *axes))


def _error_on_axis(axis: str, base: float, model: float, measure: str) -> Check:
    """Return whether the error of an axis does not get worse; the value is the ratio of MSE."""
    unit = "N·m" if axis == "yaw" else "N"
    name, limit = f"held_out_error_{axis}", 1.0 + IDENTIFY.worsening

    def check(passed: bool, value: float, reason: str) -> Check:
        return Check(name, passed, value, limit, "of the base model's MSE", reason)

    if not np.isfinite(base) or not np.isfinite(model):
        which = "base" if not np.isfinite(base) else "new"
        return check(
            False,
            float("nan"),
            f"the {which} model's validation error in {axis} is not a finite number; "
            "are there validation rows on which everything was measured?",
        )
    if base <= _NOTHING**2:
        if model <= _NOTHING**2:
            return check(True, 1.0, f"In {axis} both models are without error, so that axis decides nothing.")
        return check(
            False,
            float("inf"),
            f"in {axis} the base model makes no error and the new one {np.sqrt(model):.3g} {unit} RMS.",
        )
    ratio = model / base
    size = f"{_change(ratio)} in MSE ({np.sqrt(base):.3g} to {np.sqrt(model):.3g} {unit} RMS)"
    if ratio > limit:
        return check(False, ratio, f"{axis} gets worse, {size}; {100 * IDENTIFY.worsening:.0f} % is allowed.")
    return check(True, ratio, f"In {axis} the {measure} error changes by {size}.")


def _change(ratio: float) -> str:
    """Return a ratio as a signed change in per cent."""
    return f"{100.0 * (ratio - 1.0):+.1f} %"


def force_mse(
    model: Model | Estimator, motions: Motion | Sequence[Motion], rows: Sequence[Flags] | None = None
) -> Floats:
    """Return the mean square of measured less estimated force per axis, shape (3,) [N², N², (N·m)²].

    Parameters
    ----------
    model
        A model, or an estimator such as ``Estimator(profile, scale)`` for a base model alone.
    motions
        One or several motions, whose rows count alike.
    rows
        Rows to use, one mask a motion, shape (n,); None: all. Rows on which force or estimate are not known are
        left out; NaN where none remains.
    """
    force = _force(model)
    motions = [motions] if isinstance(motions, Motion) else list(motions)
    estimates = [force.of(motion) for motion in motions]
    masks = [
        usable_rows(motion, estimate) & wanted
        for motion, estimate, wanted in zip(motions, estimates, wanted_rows(motions, rows), strict=True)
    ]
    return mean_square(
        np.concatenate([motion.tau for motion in motions]), np.concatenate(estimates), np.concatenate(masks)
    )


def accept_on_motions(
    old: Model | Estimator,
    new: Model | Estimator,
    motions: Motion | Sequence[Motion],
    rows: Sequence[Flags] | None = None,
) -> Acceptance:
    """Say whether a new model may replace the old one, by the updating criterion of thesis 3.2.4; see `accept`.

    Both are judged on the same rows: those of motions that neither was fitted to, on which both can be evaluated.
    """
    motions = [motions] if isinstance(motions, Motion) else list(motions)
    known = [
        usable_rows(motion, _force(old).of(motion), _force(new).of(motion)) & wanted
        for motion, wanted in zip(motions, wanted_rows(motions, rows), strict=True)
    ]
    judged = AXES if all(motion.sway_measured for motion in motions) else WITHOUT_SWAY
    return accept(force_mse(old, motions, known), force_mse(new, motions, known), judged=judged)


def wanted_rows(motions: Sequence[Motion], rows: Sequence[Flags] | None) -> list[Flags]:
    """Return the mask asked for of every motion."""
    if rows is None:
        return [np.ones(len(motion.t), dtype=bool) for motion in motions]
    if [len(mask) for mask in rows] != [len(motion.t) for motion in motions]:
        raise FerryIdError(
            f"rows: every motion needs one mask of its own length, found lengths {[len(mask) for mask in rows]} for "
            f"{[len(motion.t) for motion in motions]} rows. Fix: pass one mask a motion"
        )
    return [np.asarray(mask, dtype=bool) for mask in rows]


def _force(model: Model | Estimator) -> Estimator:
    return model_estimator(model) if isinstance(model, Model) else model
