"""What a model expects of a log: the applied force, and free runs; with its effects where a diagnosis gave it any."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ferryid.counts import counted
from ferryid.effects import effects
from ferryid.effects.measurements import interpolate_gaps, measurements_of_motion, payload_and_damping
from ferryid.errors import FerryIdError
from ferryid.models.forces.estimator import ForceLaw, base_estimator, model_estimator
from ferryid.models.forces.model_forces import ModelForces, force_law
from ferryid.models.model import Model
from ferryid.models.prediction.free_run import FreeRun, run_free
from ferryid.models.stored_effect import Conditions, StoredEffect
from ferryid.signals.complementary_filter import complementary_filter
from ferryid.signals.prepare import Prepared
from ferryid.signals.smooth import central_difference, measure, smooth_measured
from ferryid.signals.track import Motion
from ferryid.types import Flags, Floats
from ferryid.vessel import parse_profile
from ferryid.vessel.profile import Profile


@dataclass(frozen=True)
class Prediction:
    """What a model expects of one log.

    Attributes
    ----------
    tau
        The applied force that it would have the actuators measure [N, N, N·m], shape (n, 3).
    motion
        The log as the model sees it: with the forces that act, and without errors of the sensors that it knows.
    force
        Force that a motion takes.
    vessel, conditions
        Effects that act: the vessel's, and those of this very log.
    idle
        Why others do not act, as sentences.
    """

    tau: Floats
    motion: Motion
    force: ForceLaw
    vessel: tuple[StoredEffect, ...] = ()
    conditions: tuple[StoredEffect, ...] = ()
    idle: tuple[str, ...] = ()

    def free_run(self, rows: Flags) -> FreeRun:
        """Run the model free on the marked rows."""
        return run_free(self.force, [self.motion], [rows])


def predict(model: Model, prepared: Prepared, profile: Profile, *, window_s: float, smoother: str) -> Prediction:
    """Return what a model expects of a log.

    The forces of the actuators are those that the properties of the vessel leave of the measured ones; hull, water, load and
    all other forces have to balance them. Conditions act on the log that they were found in and on no other. What a mooring
    or a wind pulls depends on where the vessel is; free runs take it as it was along the measured path.

    Parameters
    ----------
    model
        The model.
    prepared
        The log; with its track for a model with a diagnosis.
    profile
        Signal map of the log.
    window_s, smoother
        How its motion was smoothed.

    Raises
    ------
    FerryIdError
        For a diagnosed model and a log without heading.
    """
    if model.diagnosed:
        return predict_with_effects(model, prepared, profile, window_s=window_s, smoother=smoother)
    force = model_estimator(model)
    return Prediction(force.of(prepared.motion), prepared.motion, force)


def predict_base(model: Model, prepared: Prepared, profile: Profile, *, window_s: float, smoother: str) -> Prediction:
    """Return what was expected of a log before the model: by its base model, or by a diagnosed one without its diagnosis.

    Parameters and errors as of `predict`.
    """
    if model.diagnosed:
        return predict_with_effects(model.undiagnosed(), prepared, profile, window_s=window_s, smoother=smoother)
    base = base_estimator(model)
    return Prediction(base.of(prepared.motion), prepared.motion, base)


def signal_map(model: Model, profile: Profile | None) -> Profile:
    """Return the profile to read a log with: the one that is given, or the model's own where None.

    Raises
    ------
    FerryIdError
        For a profile of another vessel.
    """
    own = parse_profile(model.profile_text, model.name)
    if profile is not None and profile.name != own.name:
        raise FerryIdError(
            f"{model.name}@{model.version}: a model of {own.name} does not apply to {profile.name}. "
            "Fix: give a model and logs of one vessel"
        )
    return profile or own


def predict_with_effects(
    model: Model, prepared: Prepared, profile: Profile, *, window_s: float, smoother: str, steadied: bool = False
) -> Prediction:
    """Return what a model expects of a log by way of a force model; see `predict`.

    With `steadied`, slow errors of the velocities are replaced by the position's; see `ferryid.signals.complementary_filter`.
    Of a model without a diagnosis this is what the diagnosis started from: the force of its estimator, and the drag of still
    air where no wind was measured and the model has no terms of its own.
    """
    motion, track = prepared.motion, prepared.track
    if track is None or not np.isfinite(motion.eta[motion.valid, 2]).any():
        raise FerryIdError(
            f"{motion.log}: {model.label} holds effects that need the heading, to distinguish forces of the environment "
            "from the vessel's, found none in the log. Fix: map [signals.heading] in the profile, or use a log that has it"
        )
    known, sha256 = ModelForces(model), prepared.recording.sha256
    measurements = measurements_of_motion(track, motion, profile)
    right = known.righted(measurements, sha256)
    if right is not measurements:
        slope = central_difference(right.nu, motion.rate_hz)
        motion = replace(motion, eta=right.eta, nu=right.nu, nu_dot=np.where(np.isfinite(motion.nu_dot), slope, np.nan))
    if steadied:
        motion = replace(motion, nu=complementary_filter(motion.nu, motion.nu, motion.eta, motion.rate_hz))
        right = replace(right, nu=interpolate_gaps(motion.nu, motion.valid))
    plain = known.plain(right)
    found = known.altered(plain, sha256, righted=True)
    force_model, tau = found.force_model, motion.tau
    if force_model.parts is not measurements.parts:
        measured = measure(track, profile)
        more = force_model.parts.sum(axis=1) - measurements.parts.sum(axis=1)
        tau = smooth_measured(replace(measured, tau=measured.tau + more), window_s, smoother).tau
    seen = replace(
        motion,
        tau=tau + force_model.external - plain.external,
        current=force_model.flow,
        payload=payload_and_damping(force_model),
    )
    force = force_law(known, force_model.hull)
    needed = force(seen.nu_dot, seen.nu, seen.eta[:, 2], seen.wind, seen.current, seen.payload)
    own = {id(one) for one in model.vessel_effects}
    return Prediction(
        tau=prepared.motion.tau - (seen.tau - needed),
        motion=seen,
        force=force,
        vessel=tuple(one for one in found.acting if id(one) in own),
        conditions=tuple(one for one in found.acting if id(one) not in own),
        idle=(
            *(f"{effects()[one.effect].title} of the model does not act here: {reason}." for one, reason in found.idle),
            *_of_other_logs(model.conditions, sha256),
        ),
    )


def _of_other_logs(conditions: Sequence[Conditions], sha256: str) -> Iterator[str]:
    """Return the conditions of other logs than this one, as sentences: logs that have the same ones in one."""
    logs: dict[str, list[str]] = {}
    for other in conditions:
        if other.sha256 != sha256:
            logs.setdefault(_named(other.effects), []).append(other.log)
    for named, several in logs.items():
        where = several[0] if len(several) == 1 else f"{several[0]} and {counted(len(several) - 1, 'other log')}"
        acts = "do" if " and " in named else "does"
        yield f"{named} of {where} {acts} not act here: conditions are those of one log."


def _named(stored: Sequence[StoredEffect]) -> str:
    titles = [effects()[one.effect].title for one in stored]
    told = " and ".join([", ".join(titles[:-1]), titles[-1]] if len(titles) > 1 else titles)
    return told[:1].upper() + told[1:].lower()
