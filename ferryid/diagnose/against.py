"""A recording against a simulation of it: the simulation's picture of the trial, learnt from its log, is the base.

The simulated log is data like any other, of a world that is the simulator's. What its hull and its conditions are is found in
the weak form as it would be for a recording, and put into the picture of the recording: what the diagnosis then finds is
the difference. An effect that the simulation has already has the simulation's values for its neutral ones.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from math import inf, isfinite
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.counts import counted
from ferryid.diagnose.checks import examine
from ferryid.diagnose.checks.check import SensorFinding
from ferryid.diagnose.hypothesis import HULL_SPREAD, Suspect, imagined, trial_of
from ferryid.diagnose.result import Estimate
from ferryid.diagnose.scene import plain_picture, scene_of, window_lengths
from ferryid.diagnose.search import search, suspects_of
from ferryid.diagnose.weak import windows
from ferryid.diagnose.withheld import aboard
from ferryid.effects import effects
from ferryid.effects.effect import Values
from ferryid.effects.picture import Picture, Scene
from ferryid.errors import FerryIdError
from ferryid.vessel.frames import wrap
from ferryid.vessel.profile import Floats, Profile

FREER = 2.5
"""A simulator's hull may be this much further from the profile's than a vessel's."""
FEWEST_WINDOWS = 60
FOREIGN = 0.35
"""A log is of another vessel if this share of its mean square acceleration follows neither from hull, force nor any effect."""
RATE_HZ = 2.0
MOST_SHIFT_S = 60.0
SAME_LENGTH = 0.2
"""Logs whose lengths differ by more than this share are not of the same manoeuvre."""
SAME_PATH = 0.5
"""Nor are paths whose distance is more than this part of their own extent, as root mean squares."""
SHOWN_ROWS = 400


@dataclass(frozen=True)
class Condition:
    """An effect that the simulation has, with its values and their standard deviations.

    `in_hull` where it is one of the hull's coefficients alone, so that it is in `Simulated.hull` already.
    """

    suspect: Suspect
    values: Floats
    errors: Floats
    in_hull: bool = False


@dataclass(frozen=True)
class Simulated:
    """What was learnt from a simulated log.

    Attributes
    ----------
    log
        Its name.
    scene
        What it holds, at its full rate.
    hull, spread
        Coefficients of its hull, shape (26,), and how far off they may be.
    conditions
        Effects that it has, in the order in which they act.
    sensors
        What is wrong with its sensors.
    """

    log: str
    scene: Scene
    hull: Floats
    spread: Floats
    conditions: tuple[Condition, ...]
    sensors: tuple[SensorFinding, ...]


@dataclass(frozen=True)
class Paths:
    """Two logs of one manoeuvre, row by row.

    Attributes
    ----------
    shift_s
        What is added to the simulation's time so that its path fits best.
    t
        Time of the recording [s], shape (n,).
    position_m, heading_rad, speed_mps
        Recording less simulation: distance of the positions, heading, and speed over ground, shape (n,).
    """

    shift_s: float
    t: Floats
    position_m: Floats
    heading_rad: Floats
    speed_mps: Floats


def learn(
    path: str, profile: Profile, out: Path | None, *, verify: bool = False, progress: Callable[[str], None]
) -> Simulated:
    """Return the picture that a simulated log shows.

    Parameters
    ----------
    path
        The log, recorded with the same signals as the vessel's own.
    profile
        The vessel that it simulates.
    out, verify, progress
        As in `ferryid.diagnose.diagnose.diagnose`.

    Raises
    ------
    FerryIdError
        For a log that cannot be used, is too short, or moves like no vessel of this profile.
    """
    scene, survey = scene_of(path, profile, out, verify=verify, progress=progress)
    sensors, scene = examine(scene)
    name = survey.motion.log
    seen = windows(scene, *window_lengths(profile))
    if len(seen.starts) < FEWEST_WINDOWS:
        raise FerryIdError(
            f"{name}: --against needs a simulation long enough to learn its model from, found "
            f"{counted(len(seen.starts), 'stretch')} of "
            f"{window_lengths(profile)[0]:.0f} s without a gap where {FEWEST_WINDOWS} are needed. "
            "Fix: simulate and record the whole trial"
        )
    plain, spread = plain_picture(seen.scene, profile)
    wide = FREER * spread if profile.hull.has_model else spread
    progress(f"learning what {name} simulates")
    result = search(trial_of(seen, plain, wide), progress)
    made = result.fit
    left = float(np.mean((seen.gap(imagined(plain, made)) / _size(seen.measured[:, seen.channels])) ** 2))
    if left > FOREIGN:
        raise FerryIdError(
            f"{name}: --against needs a simulation of {profile.name}, found a motion of which its hull and the actuators' "
            f"force explain no more than {100.0 * max(0.0, 1.0 - left):.0f} %. Fix: give a simulation of this vessel that "
            "moves, with signals as the profile maps them"
        )
    conditions = [
        Condition(suspect, values, made.errors(k), _in_hull(suspect, values, plain))
        for k, (suspect, values) in enumerate(zip(made.suspects, made.values, strict=True))
    ]
    hull = made.hull
    for one in conditions:
        if one.in_hull:
            hull = one.suspect.act(replace(plain, hull=hull), one.values).hull
    posterior = np.sqrt(np.diag(np.linalg.inv(result.trial.by_hull.T @ result.trial.by_hull + np.eye(len(wide)))))
    return Simulated(
        name,
        scene,
        hull,
        np.hypot(HULL_SPREAD * hull, posterior * wide),
        (*_measured(scene), *conditions),
        sensors,
    )


def _in_hull(suspect: Suspect, values: Floats, plain: Picture) -> bool:
    after = suspect.act(plain, values)
    same = all(
        getattr(after, field.name) is getattr(plain, field.name) for field in fields(plain) if field.name != "hull"
    )
    return same and bool((after.hull != plain.hull).any())


def _size(measured: Floats) -> Floats:
    return np.asarray(np.sqrt(np.mean(measured**2, axis=0)))


def _measured(scene: Scene) -> tuple[Condition, ...]:
    """Return the conditions that a simulation records, by their means, for a recording that lacks their sensors.

    Of a payload it is the mean while it was aboard.
    """
    found = []
    for name, values in (("wind", scene.wind), ("current", scene.current), ("payload", scene.payload)):
        if values is None:
            continue
        effect = effects()[name]
        suspect, rows = Suspect(effect, None, effect.parameters_of(scene.profile)), scene.usable
        if name == "payload":
            rows, ends = aboard(scene.t, values, rows)
            suspect = replace(suspect, onset_s=ends.get("onset", 0.0), offset_s=ends.get("offset", inf))
        mean = np.asarray(values[rows].mean(axis=0))
        found.append(Condition(suspect, mean, np.zeros_like(mean)))
    return tuple(found)


def base_picture(simulated: Simulated, scene: Scene, shift_s: float = 0.0) -> tuple[Picture, Floats]:
    """Return the simulation's picture of what a recording shows, and how far its hull's coefficients may be off.

    What the recording measured itself (wind, current, payload) is the recording's.

    Parameters
    ----------
    simulated
        From `learn`.
    scene
        The recording's.
    shift_s
        What is added to the simulation's times, of onsets and offsets.
    """
    plain, _ = plain_picture(scene, scene.profile)
    picture = replace(plain, hull=simulated.hull)
    for one in _carried(simulated, scene, shift_s):
        picture = one.suspect.act(picture, one.values)
    return picture, simulated.spread


def _carried(simulated: Simulated, scene: Scene, shift_s: float) -> list[Condition]:
    return [
        replace(one, suspect=_later(one.suspect, shift_s))
        for one in simulated.conditions
        if not one.in_hull and not one.suspect.effect.cannot(scene)
    ]


def _later(suspect: Suspect, shift_s: float) -> Suspect:
    for end in suspect.times:
        suspect = suspect.moved(end, max(getattr(suspect, end) + shift_s, 0.0))
    return suspect


def differing(simulated: Simulated, scene: Scene, shift_s: float = 0.0) -> list[Suspect]:
    """Return every suspect of a recording, those that the simulation has already as differences to it."""
    plain, _ = plain_picture(scene, scene.profile)
    bare = replace(plain, hull=simulated.hull)
    carried = _carried(simulated, scene, shift_s)
    known = {one.suspect.key: k for k, one in enumerate(carried)}
    suspects, _ = suspects_of(scene)
    return [_relative(one, carried, known[one.key], bare) if one.key in known else one for one in suspects]


def differing_sensors(
    simulated: Simulated, sensors: Sequence[SensorFinding], scene: Scene
) -> tuple[tuple[SensorFinding, ...], list[str]]:
    """Return the recording's sensor findings that the simulation does not have, and what else differs, in sentences."""
    own = {one.effect: one for one in simulated.sensors}
    told = [f"The simulation's log: {one.says}" for one in simulated.sensors]
    told += [
        f"The {one.suspect.effect.id} differs by what was measured, and is no finding: "
        f"{_described(one, simulated.scene)} in the simulation; the recording's own is part of its picture."
        for one in simulated.conditions
        if one.suspect.effect.cannot(scene) and not one.in_hull
    ]
    return tuple(one for one in sensors if not _alike(one, own.get(one.effect))), told


def _described(one: Condition, scene: Scene) -> str:
    untold = one.suspect.effect.untold(scene, one.values)
    return ", ".join(
        f"{parameter.name} {_told(value, parameter.unit)}"
        for parameter, value in zip(one.suspect.parameters, one.values.tolist(), strict=True)
        if parameter.name not in untold
    )


def _alike(one: SensorFinding, other: SensorFinding | None) -> bool:
    return other is not None and all(
        name in other.parameters and mine.low <= other.parameters[name].high and other.parameters[name].low <= mine.high
        for name, mine in one.parameters.items()
    )


def _relative(suspect: Suspect, carried: Sequence[Condition], index: int, bare: Picture) -> Suspect:
    """Return an effect that takes the simulation's values for neutral, and changes a picture from these to its own."""
    own = carried[index]
    neutral = dict(zip((one.name for one in suspect.parameters), own.values.tolist(), strict=True))

    def pictured(hull: Floats, p: Floats) -> Picture:
        picture = replace(bare, hull=hull)
        for k, one in enumerate(carried):
            picture = one.suspect.act(picture, p if k == index else one.values)
        return picture

    def apply(picture: Picture, p: Floats, instance: str | None) -> Picture:
        return _changed(picture, pictured(picture.hull, own.values), pictured(picture.hull, p))

    def says(values: Values, instance: str | None) -> str:
        name = suspect.effect.title + (f" ({instance})" if instance else "")
        parts = [
            f"{one.name.replace('_', ' ')} {_told(neutral[one.name], one.unit)} in the simulation, "
            f"{_told(values[one.name], one.unit)} in the recording"
            for one in suspect.parameters
            if one.name in values
        ]
        return f"{name} differs: {'; '.join(parts)}."

    def kick(picture: Picture, p: Floats) -> Floats:
        # What the simulation has aboard already gives none.
        assert suspect.effect.kick is not None
        return suspect.effect.kick(picture, p) - suspect.effect.kick(picture, own.values)

    # Where the simulation has it for a while, no other span of it can be told, and its own has its own kick.
    kicks = suspect.effect.kick is not None and not own.suspect.times
    effect = replace(suspect.effect, apply=apply, says=says, kick=kick if kicks else None)
    parameters = tuple(replace(one, neutral=neutral[one.name]) for one in suspect.parameters)
    return Suspect(effect, suspect.instance, parameters)


def _told(value: float, unit: str) -> str:
    return f"{value:.2f}" + ("" if unit == "-" else f" {unit}")


def _changed(picture: Picture, old: Picture, new: Picture) -> Picture:
    """Return a picture changed as `old` becomes `new`: hull and factors by the ratio, all else by the difference."""
    scene = picture.scene
    if new.scene is not old.scene:
        scene = replace(scene, eta=scene.eta + new.scene.eta - old.scene.eta, nu=scene.nu + new.scene.nu - old.scene.nu)
    changed: dict[str, Any] = {"scene": scene}
    for field in fields(picture):
        own, before, after = (getattr(one, field.name) for one in (picture, old, new))
        if field.name == "scene" or before is after:
            continue
        if field.name in ("hull", "damping_factor"):
            upper, lower = (np.ones(1) if one is None else one for one in (after, before))
            # What was zero stays so, whatever it is multiplied by.
            ratio = np.divide(upper, lower, out=np.ones(np.broadcast(upper, lower).shape), where=lower != 0.0)
            changed[field.name] = ratio if own is None else own * ratio
        else:
            change = (0.0 if after is None else after) - (0.0 if before is None else before)
            changed[field.name] = change if own is None else own + change
    return replace(picture, **changed)


def paths(simulated: Scene, recorded: Scene) -> Paths | str:
    """Compare the paths of a simulation and a recording of one manoeuvre.

    The simulation's clock may have started up to `MOST_SHIFT_S` earlier or later.

    Returns
    -------
    Paths or str
        The reason, where they are not of the same manoeuvre, or there is no position.
    """
    scenes = (simulated, recorded)
    if not all(np.isfinite(one.eta[one.usable, :2]).all() for one in scenes):
        return "a log has no positions"
    lengths = [float(one.t[one.usable][-1] - one.t[one.usable][0]) for one in scenes]
    if abs(lengths[0] - lengths[1]) > SAME_LENGTH * max(lengths):
        return f"the simulation lasts {lengths[0]:.0f} s, the recording {lengths[1]:.0f} s"
    step = 1.0 / RATE_HZ
    t = np.arange(recorded.t[0], recorded.t[-1], step)
    own, other = _sampled(recorded, t), None
    best, shift = np.inf, 0.0
    for tried in np.arange(-MOST_SHIFT_S, MOST_SHIFT_S + step, step):
        moved = _sampled(simulated, t - tried)
        away = np.hypot(*(own[:, :2] - moved[:, :2]).T)
        if np.isfinite(away).mean() < 1.0 - 2.0 * SAME_LENGTH:
            continue
        distance = float(np.sqrt(np.nanmean(away**2)))
        if distance < best:
            best, shift, other = distance, float(tried), moved
    place = own[:, :2]
    extent = float(np.sqrt(np.nansum(np.nanvar(place, axis=0))))
    if other is None or best > SAME_PATH * extent:
        return f"the paths are {best:.1f} m apart, on a manoeuvre with an extent of {extent:.1f} m"
    both = np.isfinite(own).all(axis=1) & np.isfinite(other).all(axis=1)
    own, other, t = own[both], other[both], t[both]
    away = own - other
    return Paths(shift, t, np.hypot(away[:, 0], away[:, 1]), wrap(away[:, 2]), away[:, 3])


def _sampled(scene: Scene, t: Floats) -> Floats:
    """Return north, east, heading and speed at some times, NaN outside of what was measured, shape (n, 4)."""
    columns = np.column_stack([scene.eta, np.hypot(scene.nu[:, 0], scene.nu[:, 1])])
    known = scene.usable
    inside = np.interp(t, scene.t, known.astype(np.float64), left=0.0, right=0.0) > 0.5
    found = np.column_stack([np.interp(t, scene.t[known], column[known]) for column in columns.T])
    return np.where(inside[:, None], found, np.nan)


def plain_against(simulated: Simulated, compared: Paths | str) -> dict[str, Any]:
    """Return the simulation and its path against the recording's as plain values, for JSON."""
    conditions = [
        {
            "effect": one.suspect.effect.id,
            "instance": one.suspect.instance,
            "onset": one.suspect.onset_s if one.suspect.onset_s > 0.0 else None,
            "offset": one.suspect.offset_s if isfinite(one.suspect.offset_s) else None,
            "parameters": {
                parameter.name: vars(Estimate(value, value - 1.96 * error, value + 1.96 * error, parameter.unit))
                for parameter, value, error in zip(
                    one.suspect.parameters, one.values.tolist(), one.errors.tolist(), strict=True
                )
                if parameter.name not in one.suspect.effect.untold(simulated.scene, one.values)
            },
        }
        for one in simulated.conditions
    ]
    made: dict[str, Any] = {"log": simulated.log, "conditions": conditions, "paths": None}
    if isinstance(compared, str):
        return {**made, "says": f"The paths are not compared: {compared}."}
    every = max(1, -(-len(compared.t) // SHOWN_ROWS))
    columns: Mapping[str, Floats] = {
        "t_s": compared.t,
        "position_m": compared.position_m,
        "heading_rad": compared.heading_rad,
        "speed_mps": compared.speed_mps,
    }
    rms = {name: float(np.sqrt(np.mean(column**2))) for name, column in columns.items() if name != "t_s"}
    worst = int(np.argmax(compared.position_m))
    made["paths"] = {
        "shift_s": compared.shift_s,
        "rms": rms,
        **{name: column[::every].tolist() for name, column in columns.items()},
    }
    made["says"] = (
        f"The recording's path is {rms['position_m']:.2f} m, {np.degrees(rms['heading_rad']):.1f} deg and "
        f"{rms['speed_mps']:.2f} m/s from the simulation's (root mean square), most at {compared.t[worst]:.0f} s: "
        f"{compared.position_m[worst]:.2f} m."
    )
    return made
