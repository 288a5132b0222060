"""What a reader must know before trusting a fit: doubts about data, verdict and free runs, as sentences."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ferryid.counts import counted, verb
from ferryid.effects.wording import listed
from ferryid.identify.outcome import Excitation
from ferryid.identify.physical_checks import some_of
from ferryid.identify.settings import FitSettings
from ferryid.identify.split import Split
from ferryid.identify.thresholds import IDENTIFY
from ferryid.log_warnings import log_warnings
from ferryid.models import ModelScores
from ferryid.models.prediction import FreeRun
from ferryid.signals.prepare import Prepared
from ferryid.signals.track import Motion
from ferryid.types import AXES, Floats


def fit_warnings(
    settings: FitSettings,
    parts: Split,
    known: Excitation,
    prepared: Sequence[Prepared],
    motions: Sequence[Motion],
    scores: ModelScores,
) -> tuple[str, ...]:
    """Return what a reader must know before trusting the verdict."""
    warnings = []
    if parts.kind == "every-kth":
        warnings.append("Validation rows share smoothing windows with training rows: the error is underestimated.")
    warnings += general_warnings(settings, known, scores, len(prepared))
    weighed = [motion.payload is not None for motion in motions]
    without = len(weighed) - sum(weighed)
    if any(weighed) and without:
        warnings.append(
            f"{without} of {counted(len(weighed), 'log')} {verb(without, 'has')} no payload measured and "
            f"{verb(without, 'is')} taken as "
            "empty: a load aboard there ends up in the coefficients."
        )
    warnings += log_warnings([(one.recording.name, (*one.doubts, *one.left_out)) for one in prepared])
    for one in prepared:
        moved = max((s.clock.out_of_order + s.clock.duplicates for s in one.recording.streams.values()), default=0)
        if moved >= IDENTIFY.moved_rows:
            warnings.append(
                f"{one.recording.name}: up to {counted(moved, 'row')} of a topic were out of order or "
                "repeated a time, as when a clock "
                "is set back during the recording: stretches may lie over one another."
            )
    return tuple(warnings)


def unused_window(settings: FitSettings, why: str) -> tuple[str, ...]:
    """Return that a window of the weak form was given in vain: `why` is the reason for the derivative's estimator."""
    if settings.weak_window_s is None:
        return ()
    return (f"--weak-window {settings.weak_window_s:g} had no effect, as the derivative's estimator was used: {why}.",)


def general_warnings(settings: FitSettings, known: Excitation, scores: ModelScores, logs: int) -> list[str]:
    """Return what scores and excitation alone tell a reader to mind."""
    warnings = []
    if np.isfinite(known.heading_coverage) and known.heading_coverage < 0.5:
        warnings.append(
            f"Headings cover only {100.0 * known.heading_coverage:.0f} % of the compass: a steady wind or current could not be "
            "separated from the hull: do not rely on one that is estimated."
        )
    if known.undetermined:
        terms = list(known.undetermined)
        named = ", ".join(terms[:6]) + (f" and {len(terms) - 6} more" if len(terms) > 6 else "")
        which = "These logs" if logs > 1 else "This log"
        warnings.append(f"{which} cannot determine {len(terms)} of the terms: {named}.")
    if scores.seconds < IDENTIFY.validation_s and settings.accept == "thesis":
        warnings.append(f"Only {scores.seconds:.0f} s validate: the verdict rests on little data.")
    if scores.interval is not None and scores.force.normalised_mse < 1.0 < scores.interval[1]:
        low, high = scores.interval
        warnings.append(
            f"The 95 % interval of the ratio of squared errors, {low:.3g} to {high:.3g}, includes 1: the held-out stretches "
            "are too few, or too unlike, to be sure that the model predicts better than the base model. Record more of them."
        )
    if settings.residual == "commanded":
        warnings.append("The correction was fitted to commanded forces; its error is judged against measured ones.")
    return [*warnings, *_axis_warnings(scores)]


def _axis_warnings(scores: ModelScores) -> list[str]:
    """Say on which axes the model predicts no motion, or explains no force."""
    force, warnings = scores.force, []
    useless = force.skill_warnings
    errors = np.sqrt(force.mse_model), np.sqrt(force.mse_constant_velocity)
    for k, axis in enumerate(AXES):
        more = " The base model, with which the verdict compares, errs more still." if force.ratio[k] < 1.0 else ""
        if axis in useless:
            warnings.append(f"{useless[axis]}{more}")
        elif force.r2_model[k] < 0.0 and not errors[0][k] <= errors[1][k]:
            warnings.append(
                f"In {axis} the model explains the measured force worse than its mean does (R² {force.r2_model[k]:.2f}): "
                f"hardly any force varies there, or something else moves the vessel. Do not rely on the model there.{more}"
            )
    return warnings


def _beside(ratio: float) -> str:
    """Return how large something is beside another, which follows: no percentage where the other is next to nothing."""
    return f"{100.0 * ratio:.0f} % of" if ratio <= IDENTIFY.most_percentage else "many times"


def rest_warnings(force: Callable[[Floats], Floats], visited: Floats) -> tuple[str, ...]:
    """Say where a model is driven by a constant force that counts beside its damping: without thrust it does not stay at rest.

    Parameters
    ----------
    force, visited
        As of `ferryid.identify.physical_checks.damping_checks`.
    """
    nu = some_of(visited)
    if not len(nu):
        return ()
    constant = force(np.zeros((1, 3)))[0]
    # In motion along one axis alone there is no Coriolis force.
    alone = [force(np.where(np.arange(3) == k, nu, 0.0))[:, k] - constant[k] for k in range(3)]
    usual = np.array([float(np.mean(np.abs(one))) for one in alone])
    drives = [
        f"{-constant[k]:.3g} {'N·m' if axis == 'yaw' else 'N'} in {axis} "
        f"({_beside(abs(constant[k]) / usual[k])} the mean damping)"
        for k, axis in enumerate(AXES)
        if abs(constant[k]) > IDENTIFY.constant_share * usual[k] > 0.0
    ]
    if not drives:
        return ()
    return (
        f"Without thrust the model moves by itself, by a constant force of {listed(drives)}: the logs have it at all speeds, "
        "as by a wind, a current, or thrust that differs from its curve. Simulate only what the logs have.",
    )


def free_run_warnings(base: FreeRun, new: FreeRun) -> tuple[str, ...]:
    """Say where the new model runs free badly, or worse than the base model, which its force error does not show."""
    if base.starts and not new.starts:
        return (f"The new model cannot be run free: {new.note}.",)
    warnings = []
    lost = np.flatnonzero((new.heading_rad > IDENTIFY.useless_rad) & (new.horizons_s <= IDENTIFY.useless_s))
    if lost.size:
        k = int(lost[0])
        warnings.append(
            f"Run free for {new.horizons_s[k]:g} s the model's heading is off by {np.degrees(new.heading_rad[k]):.0f}° (rms)."
        )
    for name, label, unit, factor in (
        ("position_m", "position", "m", 1.0),
        ("heading_rad", "heading", "deg", float(np.degrees(1.0))),
    ):
        before, after = getattr(base, name), getattr(new, name)
        worse = np.flatnonzero(after > (1.0 + IDENTIFY.free_run_worsening) * before)
        if worse.size:
            k = int(worse[-1])
            warnings.append(
                f"Run free for {new.horizons_s[k]:g} s the new model's {label} is worse than the base model's "
                f"({after[k] * factor:.3g} against {before[k] * factor:.3g} {unit}): do not simulate with it unchecked."
            )
    return tuple(warnings)
