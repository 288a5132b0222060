"""From a log to a scene, and from a profile or a model to the picture of the forces that it has in mind."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite, sqrt
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.diagnose.hypothesis import HULL_SPREAD
from ferryid.diagnose.velocity import MEAN_S, steadied
from ferryid.effects.picture import COEFFICIENTS, Picture, Scene, hull_of
from ferryid.effects.scenes import actuator_forces, hull_picture, interpolate_gaps
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.models import Model
from ferryid.models.forces import ModelForces
from ferryid.signals.align import align
from ferryid.signals.data_quality import left_out_sentences
from ferryid.signals.prepare import doubts_of
from ferryid.signals.recording import Recording, data_quality, record
from ferryid.signals.sampling import check_sampling
from ferryid.signals.smooth import Measured, measure, odd_rows, smooth_measured, steady_mean
from ferryid.signals.track import LeftOut, Motion, Track
from ferryid.vessel.hull import current_in_body
from ferryid.vessel.profile import Floats, Profile

Flags = NDArray[np.bool_]

WITHHELD = {
    "wind": ("wind_N", "wind_E"),
    "current": ("current_N", "current_E"),
    "payload": ("payload_kg", "payload_x"),
}
"""What may be kept from the diagnosis, to be compared with what it finds, and the columns of it."""
WINDOW_S, WINDOW_LENGTH_M = 8.0, 5.0
"""Length of the weak form's windows for a vessel of this length; slower for longer ones, by Froude's law of time."""
STRIDES = 4
_POSITION_SHARE = 0.8
_WATER = 1000.0
_BLOCK = 0.7
"""Usual part of the box around a hull that it fills."""


@dataclass(frozen=True)
class Survey:
    """What is known of a log besides its scene.

    Attributes
    ----------
    recording
        The log's signals.
    motion
        Smoothed as for a fit: for free runs and figures.
    quality, doubts
        As in `ferryid.signals.prepare.Prepared`; here no doubt stops anything.
    hidden
        What was withheld, by name: shape (n, 2), NaN where it was not measured.
    left_out
        Which rows are not used and why, as sentences.
    t0_ns
        Absolute time of the scene's first row [ns].
    """

    recording: Recording
    motion: Motion
    quality: Mapping[str, Any]
    doubts: tuple[str, ...]
    hidden: Mapping[str, Floats]
    t0_ns: int
    left_out: tuple[str, ...]


def quiet(_stage: str) -> None:
    """Show no progress."""


def scene_of(
    path: str,
    profile: Profile,
    out: Path | None,
    *,
    withhold: Sequence[str] = (),
    window_s: float = MEAN_S,
    verify: bool = False,
    progress: Callable[[str], None] = quiet,
) -> tuple[Scene, Survey]:
    """Return the scene that a log shows, and what else is known of the log.

    Positions, heading and `nu_raw` are as measured; `nu`, wind and current pass through a moving mean, as they enter
    products. Across gaps all signals are bridged so that filters can run on, but no row there is `usable`.

    Parameters
    ----------
    path
        A file or folder; parts of one recording joined by ``+``.
    profile
        The vessel.
    out
        Output folder, whose ``logs`` keep the ingested tables; None keeps none.
    withhold
        Signals to hide, of `WITHHELD`.
    window_s
        Moving mean [s].
    verify
        Check every checksum.
    progress
        Called with the name of each stage.

    Raises
    ------
    FerryIdError
        For a log that cannot be used, one without actuators or heading, and a signal to withhold that it does not have.
    """
    check_withheld(withhold)
    if not profile.actuators:
        raise FerryIdError(
            f"{profile.path}: a diagnosis weighs motion against the actuators' force, found no actuator in the profile. "
            "Fix: describe them in [[actuator]] and map their signals"
        )
    progress(f"reading {Path(path).name}")
    recording = record(path, profile, out, verify=verify)
    check_sampling(recording, profile)
    track = align(recording, profile)
    track, hidden = _without(track, withhold)
    measured = measure(track, profile)
    motion = smooth_measured(measured, window_s)
    scene = _scene(track, measured, profile, window_s)
    doubts = doubts_of(recording, track)
    # Windows of a diagnosis end at a gap, so that smoothing loses nothing beside it; but they need the pose.
    placeless = LeftOut.of("the position or heading was not measured", measured.usable & ~scene.usable, track.rate_hz)
    motion = replace(motion, left_out=(*measured.left_out, *placeless))
    said = left_out_sentences(recording, motion)
    survey = Survey(recording, motion, data_quality(recording, motion), doubts, hidden, track.t0_ns, said)
    return scene, survey


def window_lengths(profile: Profile) -> tuple[float, float]:
    """Return length and stride [s] of the weak form's windows for a vessel."""
    length_s = WINDOW_S * sqrt(dimensions(profile)[0] / WINDOW_LENGTH_M)
    return length_s, length_s / STRIDES


def plain_picture(
    scene: Scene, profile: Profile, model: Model | None = None, sha256: str = ""
) -> tuple[Picture, Floats]:
    """Return the picture before any suspect, and how far each of its hull's coefficients is believed to be off.

    The air is still where no wind was measured, and the water too. A model is imagined as `Pictured` has it, with its vessel's
    properties and, in a log that it was diagnosed on, that log's conditions.

    Parameters
    ----------
    scene
        From `scene_of`.
    profile
        The vessel.
    model
        A model to start from; the profile's hull where None.
    sha256
        Hash of the log, by which a model knows its conditions.

    Returns
    -------
    Picture
        Without suspects.
    ndarray
        Standard deviations, shape (26,), in the units of the coefficients: `HULL_SPREAD` of each where a hull model is
        known (with the model's own intervals added), and what a vessel of this size may have at most where it is not.

    Raises
    ------
    FerryIdError
        For a model of another vessel, or one whose inertia couples surge to sway and yaw.
    """
    if model is not None:
        return _modelled(scene, profile, model, sha256)
    bare = hull_picture(scene, hull_of(profile))
    spread = HULL_SPREAD * np.abs(bare.hull) if profile.hull.has_model else broad_spread(scene, profile)
    return replace(bare, external=scene.air_load, ambient=lambda now: now.air_load), spread


def broad_spread(scene: Scene, profile: Profile) -> Floats:
    """Return how large the hull's coefficients may be for a vessel of this size and speed, shape (26,).

    Added mass of a half-immersed cylinder of the hull's draught, cross-flow drag with a coefficient of 1 along the hull, lift
    and friction in proportion to the usual speed; Faltinsen (1990), chapters 3 and 6; Fossen (2021), chapter 6. Lift as of a
    plate of the hull's length and draught by slender-body theory, times what the hull's thickness adds; Clarke, Gedling and
    Hine (1983), The application of manoeuvring criteria in hull design using linear theory.
    """
    length, beam, draught = dimensions(profile)
    hull = profile.hull
    speed = float(np.quantile(np.hypot(scene.nu[scene.usable, 0], scene.nu[scene.usable, 1]), 0.9))
    usual = max(speed, 0.1 * sqrt(9.81 * length) * 0.5)
    turning = usual / length
    time_s = 20.0 * sqrt(length / WINDOW_LENGTH_M)
    plate = 0.5 * _WATER * length * draught
    cylinder = 0.5 * np.pi * _WATER * draught**2 * length
    m11 = 0.3 * hull.mass_kg
    m22 = max(0.5 * hull.mass_kg, cylinder)
    m33 = max(0.5 * hull.inertia_z, cylinder * length**2 / 12.0)
    m23 = 0.05 * hull.mass_kg * length
    second = {
        "X_|u|u": 0.15 * _WATER * beam * draught,
        "Y_|v|v": plate,
        "Y_|r|v": plate * length / 4.0,
        "Y_|v|r": plate * length / 4.0,
        "Y_|r|r": plate * length**2 / 24.0,
        "N_|v|v": plate * length / 8.0,
        "N_|r|v": plate * length**2 / 12.0,
        "N_|v|r": plate * length**2 / 12.0,
        "N_|r|r": plate * length**3 / 32.0,
    }
    slender = 0.5 * np.pi * _WATER * draught**2 * (1.0 + 0.4 * _BLOCK * beam / draught)
    ahead = {
        "Y_uv": slender,
        "Y_ur": slender * length / 2.0,
        "N_uv": slender * length / 2.0,
        "N_ur": slender * length**2 / 4.0,
    }
    lift = 0.4 * plate * usual
    first = {
        "X_u": hull.mass_kg / time_s,
        "Y_v": max(hull.mass_kg / time_s, lift),
        "Y_r": max(hull.mass_kg * 0.1 * length / time_s, 0.5 * lift * length),
        "N_v": max(hull.mass_kg * 0.1 * length / time_s, 0.5 * lift * length),
        "N_r": max(hull.inertia_z / time_s, 0.25 * lift * length**2),
    }
    third = {
        "X_uuu": second["X_|u|u"] / usual,
        "Y_vvv": second["Y_|v|v"] / usual,
        "N_rrr": second["N_|r|r"] / turning,
    }
    every = {"m11": m11, "m22": m22, "m23": m23, "m32": m23, "m33": m33, **first, **second, **third, **ahead}
    return np.array([every[name] for name in COEFFICIENTS])


def _modelled(scene: Scene, profile: Profile, model: Model, sha256: str) -> tuple[Picture, Floats]:
    known = ModelForces(model)
    if known.force.profile.name != profile.name:
        raise FerryIdError(
            f"{model.label}: a model of {known.force.profile.name} says nothing about {profile.name}. "
            "Fix: give a model and logs of one vessel"
        )
    plain = replace(known.plain(scene), ambient=lambda now: known.plain(now).external)
    picture = known.altered(plain, sha256).picture
    spread = np.sqrt((HULL_SPREAD * picture.hull) ** 2 + known.variance)
    if not known.force.profile.hull.has_model:
        # What the base does not know, the fit had to learn; terms that it left out may be anything.
        spread = np.where(picture.hull == 0.0, broad_spread(scene, profile), spread)
    return picture, spread


def dimensions(profile: Profile) -> tuple[float, float, float]:
    """Return length, beam and draught [m], from mass and inertia where the profile does not state them."""
    hull = profile.hull
    # The radius of gyration is about a quarter of the length.
    length = hull.length_m if isfinite(hull.length_m) else 4.0 * sqrt(hull.inertia_z / hull.mass_kg)
    beam = hull.beam_m if isfinite(hull.beam_m) else 0.4 * length
    draught = hull.draught_m if isfinite(hull.draught_m) else hull.mass_kg / (_BLOCK * _WATER * length * beam)
    return length, beam, draught


def check_withheld(withhold: Collection[str]) -> None:
    """Refuse the name of what is no signal that can be withheld."""
    for name in withhold:
        if name not in WITHHELD:
            raise FerryIdError(
                f'--withhold: "{name}" is not a signal that can be withheld.{did_you_mean(name, WITHHELD)} '
                f"Fix: choose one of {', '.join(WITHHELD)}"
            )


def _without(track: Track, withhold: Sequence[str]) -> tuple[Track, dict[str, Floats]]:
    columns, hidden = dict(track.columns), {}
    for name in withhold:
        pair = [columns.pop(column, None) for column in WITHHELD[name]]
        first, second = pair
        if first is None or second is None or not np.any(np.isfinite(first + second)):
            raise FerryIdError(
                f"{track.log}: the {name} cannot be withheld, found none in the log. Fix: leave out --withhold {name}"
            )
        hidden[name] = np.column_stack([first, second])
    return replace(track, columns=columns), hidden


def _scene(track: Track, measured: Measured, profile: Profile, window_s: float) -> Scene:
    rows = odd_rows(window_s, track.rate_hz)
    usable = measured.usable & np.isfinite(measured.eta[:, 2])
    if not usable.any():
        raise FerryIdError(
            f"{track.log}: a diagnosis needs the heading, to tell the world's forces from the vessel's, found none while "
            "velocities and actuators were measured. Fix: map [signals.heading] in the profile, or use a log that has it"
        )
    eta = measured.eta
    placed: Flags = np.asarray(np.isfinite(eta[:, :2]).all(axis=1))
    if float(np.mean(placed[usable])) >= _POSITION_SHARE:
        usable &= placed
    else:
        eta = np.column_stack([np.full((len(eta), 2), np.nan), eta[:, 2]])
    current = None if measured.current is None else interpolate_gaps(measured.current, usable)
    eta = np.column_stack([interpolate_gaps(column[:, None], usable) for column in eta.T])
    through_water = (
        measured.nu if measured.current is None else measured.nu - current_in_body(measured.current, eta[:, 2])
    )
    parts, angles = actuator_forces(profile, track.columns, through_water, usable)
    nu_raw = interpolate_gaps(measured.nu, usable)
    return Scene(
        profile=profile,
        t=measured.t,
        eta=eta,
        nu_raw=nu_raw,
        nu=steadied(steady_mean(nu_raw, rows), nu_raw, eta, track.rate_hz),
        parts=parts,
        angles=angles,
        usable=usable,
        wind=None if measured.wind is None else steady_mean(interpolate_gaps(measured.wind, usable), rows),
        current=None if current is None else steady_mean(current, rows),
        payload=None if measured.payload is None else interpolate_gaps(measured.payload, usable, held=True),
    )
