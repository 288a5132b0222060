"""What a model expects of a log: the applied force, and free runs; with its effects where a diagnosis gave it any."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ferryid.effects import effects
from ferryid.effects.force_model import ForceModel as Picture
from ferryid.effects.force_model import Measurements as Scene
from ferryid.effects.force_model import required_force
from ferryid.errors import FerryIdError
from ferryid.identify.estimate import base_estimator, estimator
from ferryid.identify.free_run import ForceModel, free_run
from ferryid.identify.model import Model
from ferryid.identify.pictured import Pictured, bridged, pushes
from ferryid.identify.result import FreeRun
from ferryid.identify.stored_effect import StoredEffect
from ferryid.signals.prepare import Prepared
from ferryid.signals.smooth import central_difference, measure, smooth_measured
from ferryid.signals.track import Motion, Track
from ferryid.vessel import parse_profile
from ferryid.vessel.hull import current_in_body
from ferryid.vessel.profile import Floats, Profile

Flags = NDArray[np.bool_]


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
    force: ForceModel
    vessel: tuple[StoredEffect, ...] = ()
    conditions: tuple[StoredEffect, ...] = ()
    idle: tuple[str, ...] = ()

    def free_run(self, rows: Flags) -> FreeRun:
        """Run the model free on the marked rows."""
        return free_run(self.force, [self.motion], [rows])


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
        return imagine(model, prepared, profile, window_s=window_s, smoother=smoother)
    force = estimator(model)
    return Prediction(force.of(prepared.motion), prepared.motion, force)


def predict_before(model: Model, prepared: Prepared, profile: Profile, *, window_s: float, smoother: str) -> Prediction:
    """Return what was expected of a log before the model: by its base model, or by a diagnosed one without its diagnosis.

    Parameters and errors as of `predict`.
    """
    if model.diagnosed:
        return imagine(model.undiagnosed(), prepared, profile, window_s=window_s, smoother=smoother)
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
            f"{model.name}@{model.version}: a model of {own.name} says nothing about {profile.name}. "
            "Fix: give a model and logs of one vessel"
        )
    return profile or own


def imagine(model: Model, prepared: Prepared, profile: Profile, *, window_s: float, smoother: str) -> Prediction:
    """Return what a model expects of a log by way of a picture of the forces; see `predict`.

    Of a model without a diagnosis this is what the diagnosis started from: the force of its estimator, and the drag of still
    air where no wind was measured and the model has no terms of its own.
    """
    motion, track = prepared.motion, prepared.track
    if track is None or not np.isfinite(motion.eta[motion.valid, 2]).any():
        raise FerryIdError(
            f"{motion.log}: {model.label} holds effects that need the heading, to tell the world's forces from the vessel's, "
            "found none in the log. Fix: map [signals.heading] in the profile, or use a log that has it"
        )
    known, sha256 = Pictured(model), prepared.recording.sha256
    scene = smoothed_scene(track, motion, profile)
    right = known.righted(scene, sha256)
    if right is not scene:
        slope = central_difference(right.nu, motion.rate_hz)
        motion = replace(motion, eta=right.eta, nu=right.nu, nu_dot=np.where(np.isfinite(motion.nu_dot), slope, np.nan))
    plain = known.plain(right)
    found = known.altered(plain, sha256, righted=True)
    picture, tau = found.picture, motion.tau
    if picture.parts is not scene.parts:
        measured = measure(track, profile)
        more = picture.parts.sum(axis=1) - scene.parts.sum(axis=1)
        tau = smooth_measured(replace(measured, tau=measured.tau + more), window_s, smoother).tau
    seen = replace(motion, tau=tau + picture.external - plain.external, current=picture.flow, payload=held_in(picture))
    force = force_with(known, picture.hull)
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
            *(
                f"{_named(other.effects)} of {other.log} {'does' if len(other.effects) == 1 else 'do'} not act here: "
                "conditions are those of one log."
                for other in model.conditions
                if other.sha256 != sha256
            ),
        ),
    )


def _named(stored: Sequence[StoredEffect]) -> str:
    titles = [effects()[one.effect].title for one in stored]
    told = " and ".join([", ".join(titles[:-1]), titles[-1]] if len(titles) > 1 else titles)
    return told[:1].upper() + told[1:].lower()


def smoothed_scene(track: Track, motion: Motion, profile: Profile) -> Scene:
    """Return a smoothed log as a scene, bridged where nothing was measured."""
    rows = motion.valid
    over_ground = motion.raw_nu
    through_water = (
        over_ground if motion.current is None else over_ground - current_in_body(motion.current, motion.eta[:, 2])
    )
    parts, angles = pushes(profile, track.columns, through_water, np.ones_like(rows))
    return Scene(
        profile=profile,
        t=motion.t,
        eta=bridged(motion.eta, rows),
        nu_raw=bridged(motion.raw_nu, rows),
        nu=bridged(motion.nu, rows),
        parts=parts,
        angles=angles,
        usable=rows,
        wind=None if motion.wind is None else bridged(motion.wind, rows),
        current=None if motion.current is None else bridged(motion.current, rows),
        payload=None if motion.payload is None else bridged(motion.payload, rows, held=True),
    )


def held_in(picture: Picture) -> Floats | None:
    """Return load and factor on the damping on every row, shape (n, 6), where there is either."""
    if picture.load is None and picture.damping_factor is None:
        return None
    n = len(picture.scene.t)
    load = np.zeros((n, 5)) if picture.load is None else picture.load
    return np.column_stack([load, np.ones(n) if picture.damping_factor is None else picture.damping_factor])


def force_with(known: Pictured, hull: Floats) -> ForceModel:
    """Return the force that a motion takes with this hull, and all that the model knows besides its effects."""
    profile = known.force.profile

    def force(
        nu_dot: Floats, nu: Floats, psi: Floats, wind: Floats | None, current: Floats | None, held: Floats | None = None
    ) -> Floats:
        n = len(nu)
        scene = Scene(
            profile=profile,
            t=np.zeros(n),
            eta=np.column_stack([np.zeros((n, 2)), psi]),
            nu_raw=nu,
            nu=nu,
            parts=np.zeros((n, 0, 3)),
            angles=np.zeros((n, 0)),
            usable=np.ones(n, dtype=bool),
            wind=wind,
            current=current,
        )
        picture = replace(known.plain(scene), hull=hull)
        if held is not None:
            picture = replace(picture, load=held[:, :5], damping_factor=held[:, 5])
        return required_force(picture, nu_dot)

    return force
