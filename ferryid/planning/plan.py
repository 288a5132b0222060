"""The trial that would tell most: manoeuvres are simulated once, and chosen one by one by what each still adds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from ferryid.counts import counted
from ferryid.diagnose.judging import Key, Responses, likeness, together
from ferryid.effects import effects
from ferryid.effects.force_model import COEFFICIENTS, UNITS, hull_of
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.identifiability.trial import sailing
from ferryid.ingest import open_log
from ferryid.ingest.hashing import content_hash
from ferryid.models import Model
from ferryid.planning.information import deviations, information
from ferryid.planning.limits import CLEARANCE, Limits, limits_of, room_of, within
from ferryid.planning.segments import STEP_S, segments
from ferryid.planning.selection import choose, separated_from
from ferryid.planning.steering import LEAD_S, Manoeuvre, manoeuvres
from ferryid.planning.waters import Waters
from ferryid.simulate import Scenario
from ferryid.simulate.control.allocation import pushes_every_way
from ferryid.simulate.scenario import check_seed
from ferryid.types import Floats, RunContext
from ferryid.vessel import parse_profile
from ferryid.vessel.dimensions import dimensions
from ferryid.vessel.profile import Profile

LEAST_MINUTES, MOST_MINUTES = 2.0, 120.0
SETTLING_S = 10.0
"""At rest before the first manoeuvre, for a vessel of 5 m."""
Pairs = Sequence[tuple[Key, Key]]
HARDLY_BETTER = 0.95
"""Of the standard deviations after the usual trial, expected after the planned one, as of which it is hardly better."""
ROOM = 12.0
"""Longer side of the area in lengths of the vessel, where none is given; the other is two thirds of it."""


@dataclass(frozen=True)
class PlanSettings:
    """What a plan is asked for.

    Attributes
    ----------
    minutes
        Longest it may take.
    area
        Length and breadth of the water there is [m]; `ROOM` where None.
    separate
        Pairs of effects to separate, by names; beside those that the logs left unresolved.
    model
        That brings the hull; the profile's where None.
    seed
        Of the simulated noise.
    """

    minutes: float = 12.0
    area: tuple[float, float] | None = None
    separate: tuple[tuple[str, str], ...] = ()
    model: Model | None = None
    seed: int = 1

    def check(self) -> None:
        """Refuse times that no trial has.

        Raises
        ------
        FerryIdError
            For the first fault.
        """
        if not LEAST_MINUTES <= self.minutes <= MOST_MINUTES:
            raise FerryIdError(
                f"--minutes: a plan takes {LEAST_MINUTES:g} to {MOST_MINUTES:g} minutes, found {self.minutes:g}. "
                "Fix: give such a time"
            )
        check_seed(self.seed)


@dataclass(frozen=True)
class Chosen:
    """A manoeuvre of the plan, and what it adds.

    Attributes
    ----------
    kind, says
        Its name, and what it is, as a part of a sentence.
    begin_s, end_s
        When it begins and ends [s].
    gain
        By how much it brings down the logarithm of the mean standard deviation of the coefficients, each over that of the
        prior, beside those before it, and with pairs of effects to separate that of the sizes from which they do.
    scenario
        Of the manoeuvre by itself, where there is no path.
    orders
        Those of it, where there is no path.
    """

    kind: str
    says: str
    begin_s: float
    end_s: float
    gain: float
    scenario: Scenario | None = None
    orders: Manoeuvre | None = None


@dataclass(frozen=True)
class Expected:
    """A coefficient of the hull and its standard deviation: known now, after the usual trial, and after the plan.

    Attributes
    ----------
    name, unit, value
        Of the coefficient, as it is believed now.
    now, usual, planned
        Standard deviations in that unit.
    """

    name: str
    unit: str
    value: float
    now: float
    usual: float
    planned: float


@dataclass(frozen=True)
class Separated:
    """Two effects, and the multiple of usual sizes from which they separate: now, after the usual trial, after the plan."""

    first: Key
    second: Key
    now: float | None
    usual: float | None
    planned: float | None


@dataclass(frozen=True)
class Track:
    """The path of a plan.

    Attributes
    ----------
    poses
        North, east [m] and heading [rad, not wrapped] from the middle of the area, its longer side to the north, one every
        `step_s`, shape (n, 3).
    step_s
        Time between poses [s].
    limits
        Speeds and accelerations along it.
    area
        Its sides [m].
    scenario
        Of the trial, to be simulated.
    """

    poses: Floats
    step_s: float
    limits: Limits
    area: tuple[float, float]
    scenario: Scenario


@dataclass(frozen=True)
class Plan:
    """A trial.

    Attributes
    ----------
    vessel
        As it was simulated.
    chosen
        Its manoeuvres in their order.
    track
        The path through them; None for a vessel that steers, whose manoeuvres are orders.
    duration_s
        How long it takes [s].
    hull
        What is expected of each coefficient that may move.
    pairs
        What is expected of each pair of effects.
    usual
        The usual trial that it is compared with.
    drawn
        How many manoeuvres were tried.
    after
        Names of the logs whose information was taken in.
    generic_hull
        True where the profile has no hull model, so that a generic one of its dimensions was simulated.
    area, usual_area
        Sides of the area that it keeps to, the longer first, None where there is none; and of that which the usual trial
        takes, the hull included [m].
    """

    vessel: Profile
    chosen: tuple[Chosen, ...]
    track: Track | None
    duration_s: float
    hull: tuple[Expected, ...]
    pairs: tuple[Separated, ...]
    usual: str
    drawn: int
    after: tuple[str, ...] = ()
    generic_hull: bool = False
    area: tuple[float, float] | None = None
    usual_area: tuple[float, float] = (0.0, 0.0)

    @property
    def ratio(self) -> float:
        """Median over the coefficients of the planned trial's standard deviation over the usual one's."""
        return float(np.median([one.planned / one.usual for one in self.hull]))

    @property
    def mean_ratio(self) -> float:
        """Geometric mean of the same."""
        return float(np.exp(np.mean([np.log(one.planned / one.usual) for one in self.hull])))

    @property
    def expected_ratio(self) -> float:
        """Mean deviation, over that now, after the planned trial over that after the usual one: what the choice brings down."""
        planned, usual = (np.mean([getattr(one, name) / one.now for one in self.hull]) for name in ("planned", "usual"))
        return float(planned / usual)

    @property
    def hardly_better(self) -> bool:
        """True where the planned trial is not worth its trouble: it tells about as much as the usual one, or less."""
        return not self.expected_ratio < HARDLY_BETTER

    @property
    def usual_fits(self) -> bool:
        """True where the usual trial keeps to the area."""
        return self.area is None or all(a <= b for a, b in zip(self.usual_area, self.area, strict=True))


def check_request(profile: Profile, settings: PlanSettings) -> Profile:
    """Return the vessel with the hull that is planned with, before anything is read or simulated.

    Raises
    ------
    FerryIdError
        For times, models, effects and vessels that make no trial.
    """
    settings.check()
    profile = _believed(profile, settings.model)
    if not profile.actuators:
        raise FerryIdError(
            f"{profile.path}: a plan is made of motion by the actuators, found none in the profile. "
            "Fix: describe them in [[actuator]] and map their signals"
        )
    for pair in settings.separate:
        for name in pair:
            _key(name, profile)
    return profile


def plan(profile: Profile, logs: Sequence[str], settings: PlanSettings, run: RunContext) -> Plan:
    """Return the trial that would tell most of a vessel.

    A vessel that can push every way gets a path with headings; one that steers gets orders to its actuators.

    Parameters
    ----------
    profile
        The vessel.
    logs
        What was recorded already: what they tell of the hull counts, and effects that they cannot separate are to be.
    settings
        What is asked for.
    run
        Folder of the ingested tables, and progress.

    Raises
    ------
    FerryIdError
        For a vessel that cannot be simulated, an area without room, and settings that make no trial.
    """
    profile = check_request(profile, settings)
    known, pairs = _recorded(profile, logs, settings, run)
    with TemporaryDirectory() as folder:
        keys = frozenset(key for pair in pairs for key in pair)
        waters = Waters(profile, sailing(profile), keys, Path(folder), settings.seed)
        make = _path if pushes_every_way(profile.actuators) else _orders
        made = make(waters, known, pairs, settings, run)
    run.progress("")
    names = tuple(Path(log).name for log in _once(logs, profile))
    return replace(made, after=names, generic_hull=not profile.hull.has_model)


def _path(waters: Waters, known: Sequence[Responses], pairs: Pairs, settings: PlanSettings, run: RunContext) -> Plan:
    """Return the plan of a vessel that can follow a path with headings."""
    length, time = dimensions(waters.profile)[0], waters.scale[1]
    area = settings.area or (ROOM * length, ROOM * length * 2.0 / 3.0)
    limits = limits_of(waters.vessel, area)
    step, seconds = STEP_S * time, settings.minutes * 60.0
    before = np.zeros((max(1, round(SETTLING_S * time / step)), 3))
    every = segments(limits, time)
    drawn = [one for one in every if len(one.poses) * step <= seconds] or [min(every, key=lambda one: len(one.poses))]
    run.progress(f"simulating {counted(len(drawn), 'manoeuvre')}")
    all_poses = [before, *(one.poses for one in drawn)]
    ends = step * np.cumsum([len(one) for one in all_poses])
    (start, *parts), sailed = waters.tells(waters.following(np.vstack(all_poses), limits), ends.tolist())
    # The vessel overshoots what it is asked for, more with a quick manoeuvre: some leave the area.
    cuts = np.searchsorted(np.linspace(0.0, ends[-1], len(sailed)), ends)
    pieces = np.split(sailed, cuts[:-1])[1:]
    beam = dimensions(waters.profile)[1]
    # Half of the clearance is left to what another run does otherwise.
    room = length + CLEARANCE * length, beam + CLEARANCE * length
    inside = [k for k, piece in enumerate(pieces) if within(piece, area, room)]
    # Where none stays within, the shortest is refused or taken as the others are.
    kept = inside or list(range(len(drawn)))
    drawn, parts = [drawn[k] for k in kept], [parts[k] for k in kept]
    lasts = [len(one.poses) * step for one in drawn]
    chosen = choose(lasts, parts, [start, *known], pairs, seconds - len(before) * step)
    poses = _joined([before, *(drawn[k].poses for k, _ in chosen)])
    run.progress("simulating the trial")
    scenario = waters.following(poses, limits)
    (planned,), _ = waters.tells(scenario, [len(poses) * step])
    run.progress("simulating the usual trial")
    (usual,), corners = waters.tells(waters.twelve_corners(len(poses) * step), [len(poses) * step])
    times = step * (len(before) + np.cumsum([0, *(len(drawn[k].poses) for k, _ in chosen)]))
    return Plan(
        waters.vessel,
        tuple(
            Chosen(drawn[k].kind, drawn[k].says, float(times[i]), float(times[i + 1]), gain)
            for i, (k, gain) in enumerate(chosen)
        ),
        Track(poses, step, limits, area, scenario),
        len(poses) * step,
        _expected(waters.vessel, known, usual, planned),
        _separated(pairs, known, usual, planned),
        "the twelve-corner trial of the same length",
        len(all_poses) - 1,
        area=(max(area), min(area)),
        usual_area=room_of(corners, (length, beam)),
    )


def _joined(parts: Sequence[Floats]) -> Floats:
    """Return poses one after the other, the headings without a jump where a manoeuvre went all the way round."""
    joined = np.vstack(list(parts))
    joined[:, 2] = np.unwrap(joined[:, 2])
    return joined


def _orders(waters: Waters, known: Sequence[Responses], pairs: Pairs, settings: PlanSettings, run: RunContext) -> Plan:
    """Return the plan of a vessel that steers: each manoeuvre is a trial by itself."""
    time, size = waters.scale[1], dimensions(waters.profile)[:2]
    drawn, parts, scenarios = list[Manoeuvre](), list[Responses](), list[Scenario]()
    narrowest = np.inf
    every = manoeuvres(time)
    for k, one in enumerate(every, 1):
        run.progress(f"simulating manoeuvre {k} of {len(every)}")
        scenario = waters.steering(one)
        (told,), track = waters.tells(scenario, [one.duration_s])
        sides = room_of(track, size)
        narrowest = min(narrowest, sides[0])
        if settings.area is not None and any(
            side > room for side, room in zip(sides, sorted(settings.area, reverse=True), strict=True)
        ):
            continue
        order = scenario.manoeuvre.speed_rpm
        unit = "N" if waters.vessel.actuators[0].kind == "force" else "rpm"
        drawn.append(replace(one, says=f"{one.says} at {order:.3g} {unit}"))
        parts.append(told)
        scenarios.append(scenario)
    if not drawn:
        assert settings.area is not None
        raise FerryIdError(
            f"--area: {settings.area[0]:g}x{settings.area[1]:g} m has no room for any manoeuvre of {waters.vessel.name}. "
            f"Fix: give at least {ceil(narrowest)}x{ceil(narrowest)}"
        )
    chosen = choose([one.duration_s for one in drawn], parts, known, pairs, settings.minutes * 60.0)
    ends = np.cumsum([0.0, *(drawn[k].duration_s for k, _ in chosen)])
    run.progress("simulating the usual trial")
    zigzag = replace(manoeuvres(time)[1], share=1.0, helm_deg=20.0, heading_deg=20.0, lead_s=LEAD_S * time)
    (usual,), track = waters.tells(waters.steering(replace(zigzag, duration_s=float(ends[-1]))), [float(ends[-1])])
    planned = together([parts[k] for k, _ in chosen])
    return Plan(
        waters.vessel,
        tuple(
            Chosen(drawn[k].kind, drawn[k].says, float(ends[i]), float(ends[i + 1]), gain, scenarios[k], drawn[k])
            for i, (k, gain) in enumerate(chosen)
        ),
        None,
        float(ends[-1]),
        _expected(waters.vessel, known, usual, planned),
        _separated(pairs, known, usual, planned),
        "a 20/20 zigzag of the same length",
        len(drawn),
        area=None if settings.area is None else (max(settings.area), min(settings.area)),
        usual_area=room_of(track, size),
    )


def _believed(profile: Profile, model: Model | None) -> Profile:
    """Return a profile with the hull of a model, where one is given that has its own."""
    if model is None:
        return profile
    own = parse_profile(model.profile_text, model.name).name
    if own != profile.name:
        raise FerryIdError(
            f"--model: {model.label} is a model of {own}, and the plan is for {profile.name}. Fix: give a model of that vessel"
        )
    if not model.hull:
        what = (
            "it was learned as a correction of the profile's hull"
            if model.terms
            else "its findings leave the profile's hull"
        )
        raise FerryIdError(
            f"--model: {model.label} has no hull of its own to plan with: {what}. Fix: leave --model out and plan with the "
            "profile's hull, or give a model whose hull a diagnosis has refitted: its file has a hull"
        )
    M, D = profile.hull.M.copy(), dict(profile.hull.D)
    places = {"m11": (0, 0), "m22": (1, 1), "m23": (1, 2), "m32": (2, 1), "m33": (2, 2)}
    for name, one in model.hull.items():
        if name in places:
            M[places[name]] = one.value
        else:
            D[name] = one.value
    return replace(profile, hull=replace(profile.hull, M=M, D=D))


def _recorded(
    profile: Profile, logs: Sequence[str], settings: PlanSettings, run: RunContext
) -> tuple[list[Responses], list[tuple[Key, Key]]]:
    """Return what logs tell already, and the pairs of effects to separate."""
    known = []
    for log in _once(logs, profile):
        run.progress(f"reading {Path(log).name}")
        known += information(log, profile, None, run=run)
    unresolved = [one for one in likeness(together(known)).alike if not one.resolved] if known else []
    pairs = [(one.first, one.second) for one in unresolved]
    for pair in settings.separate:
        keys = [_key(name, profile) for name in pair]
        pairs += [] if (keys[0], keys[1]) in pairs else [(keys[0], keys[1])]
    kept = {key for pair in pairs for key in pair}
    return [_only(one, kept) for one in known], pairs


def _once(logs: Sequence[str], profile: Profile) -> list[str]:
    """Return logs without further copies of one."""
    found = dict[str, str]()
    for log in logs:
        found.setdefault(content_hash(open_log(log, profile.table).paths), log)
    return list(found.values())


def _key(name: str, profile: Profile) -> Key:
    """Return effect and instance of ``effect`` or ``effect(actuator)``."""
    effect, _, instance = name.removesuffix(")").partition("(")
    if effect not in effects():
        raise FerryIdError(
            f'--separate: there is no effect "{effect}".{did_you_mean(effect, list(effects()))} '
            "Fix: give two of them, as wind,current or thruster_gain(bow),fouling"
        )
    names = [one.name for one in profile.actuators]
    if instance and instance not in names:
        raise FerryIdError(
            f'--separate: {profile.name} has no actuator "{instance}", found {", ".join(names)}. Fix: give one of these'
        )
    return effect, instance or None


def _only(found: Responses, keys: set[Key]) -> Responses:
    """Return responses of some effects alone."""
    h = len(found.hull_spread)
    own = [k for k, (key, _) in enumerate(found.parameters) if key in keys]
    places = [*range(h), *(h + k for k in own)]
    return replace(
        found,
        titles={key: title for key, title in found.titles.items() if key in keys},
        errors={key: error for key, error in found.errors.items() if key in keys},
        parameters=tuple(found.parameters[k] for k in own),
        products=found.products[np.ix_(places, places)],
    )


def _expected(
    vessel: Profile, known: Sequence[Responses], usual: Responses, planned: Responses
) -> tuple[Expected, ...]:
    spread = together([*known, usual, planned]).hull_spread
    bare = np.ones(len(spread)) if not known else deviations(together(known, spread))
    after = [deviations(together([*known, one], spread)) for one in (usual, planned)]
    values = hull_of(vessel)
    return tuple(
        Expected(COEFFICIENTS[k], UNITS[k], float(values[k]), *(float(spread[k] * one[k]) for one in (bare, *after)))
        for k in np.flatnonzero(spread)
    )


def _separated(
    pairs: Sequence[tuple[Key, Key]], known: Sequence[Responses], usual: Responses, planned: Responses
) -> tuple[Separated, ...]:
    if not pairs:
        return ()
    now = separated_from(together(known), pairs) if known else [None] * len(pairs)
    after = [separated_from(together([*known, one]), pairs) for one in (usual, planned)]
    return tuple(Separated(*pair, *sizes) for pair, *sizes in zip(pairs, now, *after, strict=True))
