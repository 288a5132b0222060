"""Units, frames and signs of pose, heading, velocity and yaw rate, from how they move together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import log

import numpy as np

from ferryid.draft.agreement import correlation, explained, usual
from ferryid.draft.charts import with_geodetic
from ferryid.draft.fields import FieldGroup
from ferryid.draft.mapped import MappedSignal, Motion, nearest_unit
from ferryid.draft.reckoned import reckoned_positions
from ferryid.draft.samples import Samples, angle_unit, geodetic_unit, metres, yaw
from ferryid.draft.thresholds import DRAFT
from ferryid.errors import FerryIdError
from ferryid.types import Floats
from ferryid.vessel.field_words import unit_of_name, words_of
from ferryid.vessel.frames import to_body
from ferryid.vessel.units import KINDS

_BODY = ("FRD", "FLU")
_WORLD = ("NED", "ENU")
_SPEED_UNITS = ("m/s", "km/h", "kn", "ft/s")
_RATE_UNITS = ("rad/s", "deg/s", "deg/min")


@dataclass(frozen=True)
class _Pose:
    """One position with one heading: velocity over ground in the frames assumed [m/s], heading [rad]."""

    position: FieldGroup | None
    heading: FieldGroup
    position_frame: str
    position_unit: str
    heading_frame: str
    heading_unit: str
    north: Floats
    east: Floats
    psi: Floats

    @property
    def usual(self) -> int:
        """Number of frames that are not the usual ones of their topics."""
        frames = ((self.position, self.position_frame), (self.heading, self.heading_frame))
        return sum(one is not None and frame in _WORLD and frame != (one.usual_frame or "NED") for one, frame in frames)

    def usual_body(self, velocity: FieldGroup | None) -> str:
        """Return the frame of a velocity along the hull that is usual beside this pose."""
        enu = velocity is not None and velocity.usual_frame == self.heading_frame == "ENU"
        return "FLU" if enu else "FRD"


@dataclass(frozen=True)
class _Agreement:
    """How a velocity agrees with a pose: share of it that the pose explains, its frame and gain."""

    share: float
    frame: str
    gain: float
    sway: float
    velocity: FieldGroup | None
    pose: _Pose


def navigation_signals(groups: Sequence[FieldGroup], samples: Samples) -> tuple[list[MappedSignal], Motion]:
    """Return the signals of pose, velocity and yaw rate that agree best, and the motion that they show."""
    groups = [one for one in groups if samples.has(one.topic, one.fields)]
    reckoned = reckoned_positions(groups, samples)
    if reckoned.left_out:
        groups = [one for one in groups if one not in reckoned.why]
    groups, placed = with_geodetic(groups, samples, set(reckoned.why))
    chosen = _best(groups, samples)
    unknown = np.full(samples.grid_s.shape, np.nan)
    if chosen is None:
        return [], Motion(unknown, unknown, unknown, unknown)
    pose, velocity = chosen.pose, chosen.velocity
    slope = np.asarray(np.gradient(pose.psi, samples.grid_s))
    motion_u, motion_v = to_body(pose.north, pose.east, pose.psi)
    named = _named_frame(pose)
    found = []
    if pose.position is not None:
        mapped = _position(pose, chosen, named)
        doubts = (*reckoned.doubts(pose.position), *mapped.doubts)
        shown = (*mapped.evidence, *placed.get(pose.position.label, ()), *reckoned.evidence())
        found.append(replace(mapped, evidence=shown, doubts=doubts))
    found.append(_heading(chosen, slope, named, groups, samples))
    if velocity is not None:
        found.append(_velocity(velocity, chosen, _others(groups, chosen, samples)))
        if chosen.frame in _BODY:
            scale = KINDS["speed"][found[-1].unit]
            first, second = (_smoothed(samples, velocity, place) * scale for place in (0, 1))
            motion_u, motion_v = first, second if chosen.frame == "FRD" else -second
    rate = _yaw_rate(groups, samples, slope, pose.heading)
    if rate is None and (unlike := [one for one in groups if one.kind == "yaw_rate"]):
        place = next(k for k, one in enumerate(found) if one.quantity == "heading")
        names = ", ".join(one.label for one in unlike)
        told = f"no yaw rate of the log follows it ({names}): none is mapped, and its slope stands for one"
        told += _turned_with_course(unlike, pose, slope, samples)
        found[place] = replace(found[place], doubts=(*found[place].doubts, told))
    if rate is not None:
        found.append(rate)
        # A heading that is interpolated across north has slopes that no vessel has.
        turn = KINDS["rate"][rate.unit] * (1.0 if rate.frame == "FRD" else -1.0)
        column = samples.raw(rate.topic, rate.fields[0])
        slope = samples.smooth(samples.on_grid(rate.topic, column), rate.topic) * turn
    return found, Motion(motion_u, motion_v, slope, pose.psi)


def _smoothed(samples: Samples, group: FieldGroup, place: int) -> Floats:
    return samples.smooth(samples.on_grid(group.topic, samples.raw(group.topic, group.fields[place])), group.topic)


def _of_kind(groups: Sequence[FieldGroup], kind: str) -> list[FieldGroup]:
    """Return the groups of a kind but those that are much slower than the fastest, or far shorter than the longest.

    What a log states once, an origin or the corners of a fence, comes in a burst.
    """
    some = [one for one in groups if one.kind == kind]
    longest = max((one.lasts_s for one in some), default=0.0)
    some = [one for one in some if one.lasts_s >= DRAFT.shorter * longest]
    fastest = max((one.rate_hz for one in some), default=0.0)
    return [one for one in some if one.rate_hz >= DRAFT.slower * fastest][: DRAFT.most_sources]


def _best(groups: Sequence[FieldGroup], samples: Samples) -> _Agreement | None:
    """Return the position, heading and velocity that agree best, and in which frames; names decide where motion does not."""
    headings = _of_kind(groups, "heading")
    positions: list[FieldGroup | None] = [*_of_kind(groups, "position")]
    velocities: list[FieldGroup | None] = [*_of_kind(groups, "velocity")]
    if not headings:
        return None
    poses = [
        pose
        for position, heading in product(positions or [None], headings)
        for pose in _poses(position, heading, samples)
    ]
    found = [_agreement(pose, velocity, samples) for pose, velocity in product(poses, velocities or [None])]
    top = max(one.share for one in found)
    near = [one for one in found if one.share >= top - DRAFT.even]
    best = min(near, key=_preference)
    if best.frame not in _WORLD:
        return best
    # A velocity over ground shows nothing of the heading: any that is along the hull does, and else motion along it.
    same = [
        one for one in near
        if (one.frame, one.velocity, one.pose.position_frame, one.pose.position) ==
        (best.frame, best.velocity, best.pose.position_frame, best.pose.position)
    ]  # fmt: skip
    others = [one for one in groups if one.kind == "velocity" and one != best.velocity]
    seen = [max((_along_hull(one.pose, other, samples) for other in others), default=0.0) for one in same]
    if max(seen) < DRAFT.agrees:
        seen = [_course(one.pose).steady for one in same]
    return same[int(np.argmax(seen))]


def _along_hull(pose: _Pose, velocity: FieldGroup, samples: Samples) -> float:
    """Return which share of a velocity a pose explains if it is along the hull."""
    first, second = (_smoothed(samples, velocity, place) for place in (0, 1))
    ahead, aside = to_body(pose.north, pose.east, pose.psi)
    return max(explained(first, second, ahead, aside)[0], explained(first, second, ahead, -aside)[0])


def _preference(one: _Agreement) -> tuple[float, ...]:
    """Return what comes first among what agrees alike: frames that names state, sources of one topic, NED."""
    pose = one.pose
    stated = _named_frame(pose)
    frames = [
        pose.heading_frame,
        *([pose.position_frame] if pose.position is not None and not pose.position.form else []),
    ]
    against = sum(bool(stated) and frame != stated for frame in frames)
    apart = sum(pose.position is not None and pose.position.topic != pose.heading.topic for _ in (0,))
    named = -sum("ned" in words_of(group.topic) for group in (pose.position, pose.heading) if group is not None)
    other_body = one.frame in _BODY and one.frame != pose.usual_body(one.velocity)
    return against, apart, named, pose.usual, other_body, -one.share


def _named_frame(pose: _Pose) -> str:
    """Return the frame that a topic's or field's name states, or an empty string."""
    for group in (pose.position, pose.heading):
        if group is not None and group.frame:
            return group.frame
        if group is not None:
            words = {word for name in (group.topic, *group.fields) for word in words_of(name)}
            if "enu" in words:
                return "ENU"
            if "ned" in words:
                return "NED"
            if group is pose.position and {"n", "e"} <= words:
                return "NED"
    return ""


def _poses(position: FieldGroup | None, heading: FieldGroup, samples: Samples) -> list[_Pose]:
    """Return a position and a heading in every frame that they may be in."""
    unit = "quaternion" if heading.form else angle_unit(samples, heading.topic, heading.fields)
    angle = samples.smooth(
        samples.on_grid(heading.topic, yaw(samples, heading.topic, heading.fields, unit)), heading.topic
    )
    unknown = np.full(samples.grid_s.shape, np.nan)
    if position is None:
        sides = [("", unknown, unknown)]
        metre = ""
    elif position.form == "geodetic":
        slopes = [
            samples.slope(samples.on_grid(position.topic, one), position.topic)
            for one in metres(samples, position.topic, position.fields)
        ]
        sides = [("geodetic", slopes[0], slopes[1])]
        metre = geodetic_unit(samples, position.topic, position.fields)
    else:
        first, second = (
            samples.slope(samples.on_grid(position.topic, samples.raw(position.topic, path)), position.topic)
            for path in position.fields
        )
        sides = [("NED", first, second), ("ENU", second, first)]
        metre = "m"
    return [
        _Pose(
            position, heading, frame, metre, other, unit, north, east, 0.5 * np.pi - angle if other == "ENU" else angle
        )
        for (frame, north, east), other in product(sides, [heading.frame] if heading.frame in _WORLD else _WORLD)
        if frame not in _WORLD or position is None or position.frame in ("", frame)
    ]


def _agreement(pose: _Pose, velocity: FieldGroup | None, samples: Samples) -> _Agreement:
    """Return how a velocity agrees with a pose; without a velocity, how steadily the vessel moves along its heading."""
    if velocity is None:
        return _Agreement(_course(pose).steady, "", 1.0, 0.0, None, pose)
    first, second = (_smoothed(samples, velocity, place) for place in (0, 1))
    ahead, aside = to_body(pose.north, pose.east, pose.psi)
    named = velocity.frame or velocity.named_frame
    body = pose.usual_body(velocity)
    if pose.position is None:
        return _Agreement(0.0, named or body, 1.0, 0.0, velocity, pose)
    seen = {}
    for frame in (*_BODY, *_WORLD):
        x, y = (ahead, aside) if frame in _BODY else (pose.north, pose.east)
        x, y = {"FLU": (x, -y), "ENU": (y, x)}.get(frame, (x, y))
        share, gain, sway = explained(first, second, x, y)
        seen[frame] = _Agreement(share, frame, gain, sway, velocity, pose)
    best = seen[named or body]
    if velocity.frame:
        return best
    for one in seen.values():
        # Where nothing moves, small differences say nothing against a name.
        if one.share > best.share + DRAFT.even and (not named or one.share >= DRAFT.agrees):
            best = one
    return best


@dataclass(frozen=True)
class _Course:
    """How the course goes with the heading: the mean of their difference as a point of the unit circle, and of its double.

    A vessel that goes astern as much as ahead has courses on either side, of which the double is the same (Mardia and Jupp
    2000, section 1.1: axial data).
    """

    mean: complex = 0j
    doubled: complex = 0j

    @property
    def along(self) -> float:
        """How nearly the vessel moves along its heading: 1 always, 0 in all directions alike, -1 always astern."""
        return self.mean.real

    @property
    def off_deg(self) -> float:
        """By how much the course is off the heading at all headings, clockwise [deg]; 0 where it is not by the same angle."""
        return float(np.degrees(np.angle(self.mean))) if abs(self.mean) >= DRAFT.steady_course else 0.0

    @property
    def steady(self) -> float:
        """How well heading and course agree: as `along`, or a little less where its zero would have to be another.

        Less still where the vessel would have to go astern as well as ahead.
        """
        return max(self.along, abs(self.mean) - DRAFT.other_zero, abs(self.doubled) - 2.0 * DRAFT.other_zero)

    @property
    def either_way_deg(self) -> float | None:
        """By how much the line of courses ahead and astern is off the heading, clockwise [deg]; None where there is no such."""
        if abs(self.doubled) < DRAFT.either_way or self.off_deg:
            return None
        return 0.5 * float(np.degrees(np.angle(self.doubled)))

    @property
    def both_ways(self) -> bool:
        """Whether the vessel goes along the hull, ahead and astern."""
        off = self.either_way_deg
        return off is not None and abs(off) <= DRAFT.along_hull_deg

    @property
    def doubled_length(self) -> str:
        """How nearly all courses lie on one line, in words."""
        return f"mean resultant length of the doubled angle {abs(self.doubled):.2f}"


def _course(pose: _Pose) -> _Course:
    """Return how the course of a vessel that moves goes with its heading."""
    speed = np.hypot(pose.north, pose.east)
    rows = np.isfinite(speed + pose.psi)
    if not rows.any():
        return _Course()
    rows &= usual(speed, rows)
    rows &= speed > DRAFT.moving * float(np.quantile(speed[rows], 0.95)) if rows.any() else rows
    if np.count_nonzero(rows) < DRAFT.fewest_rows:
        return _Course()
    apart = np.exp(1j * (np.arctan2(pose.east[rows], pose.north[rows]) - pose.psi[rows]))
    return _Course(complex(np.mean(apart)), complex(np.mean(apart**2)))


def _turned_with_course(rates: Sequence[FieldGroup], pose: _Pose, slope: Floats, samples: Samples) -> str:
    """Return which yaw rate turns as the course does where the heading does not: the heading is wrong then, not the rate.

    On a vessel that makes way, course and heading differ by the drift angle alone.
    """
    speed = np.hypot(pose.north, pose.east)
    known = np.isfinite(speed)
    if not known.any():
        return ""
    moving = known & usual(speed, known)
    moving &= speed > DRAFT.moving * float(np.quantile(speed[moving], 0.95))
    # The angle between neighbouring velocities: no course needs to be unwrapped over rows without way.
    cross = pose.north[:-1] * pose.east[1:] - pose.east[:-1] * pose.north[1:]
    along = pose.north[:-1] * pose.north[1:] + pose.east[:-1] * pose.east[1:]
    turns = np.full(speed.shape, np.nan)
    turns[1:] = np.where(moving[1:] & moving[:-1], np.arctan2(cross, along), np.nan) / np.diff(samples.grid_s)
    seen = {one.label: abs(correlation(_smoothed(samples, one, 0), turns)) for one in rates}
    best, mine = max(seen, key=lambda label: seen[label]), correlation(slope, turns)
    if seen[best] < DRAFT.seen_rate or mine >= DRAFT.seen_rate:
        return ""
    return (
        f". The course over ground turns as {best} says (correlation {seen[best]:.2f}), and not as the heading "
        f"({mine:.2f}): the heading is wrong, as of a compass beside iron or currents, and what is fitted to it would be, too"
    )


def _position(pose: _Pose, chosen: _Agreement, named: str) -> MappedSignal:
    position = pose.position
    assert position is not None
    if position.form == "geodetic":
        shown = f"latitude and longitude by their names; {_shown(chosen)}"
        return MappedSignal("position", position.topic, position.fields, pose.position_unit, "geodetic", 1.0, (shown,))
    return MappedSignal(
        "position",
        position.topic,
        position.fields,
        pose.position_unit,
        pose.position_frame,
        1.0,
        (_shown(chosen),),
        _mirror(pose, named),
    )


def _shown(chosen: _Agreement) -> str:
    if chosen.velocity is None:
        course = _course(chosen.pose)
        if course.along < DRAFT.agrees and course.both_ways:
            return f"the vessel moves along its heading, ahead and astern ({course.doubled_length})"
        how = (
            "moves along its heading"
            if course.along >= DRAFT.agrees
            else "does not move along its heading as it is read"
        )
        return f"the vessel {how} (mean cosine {course.along:.2f})"
    turned = ", turned by the heading," if chosen.frame in _BODY else ""
    label = chosen.velocity.label
    if chosen.share < DRAFT.agrees:
        return f"its slope{turned} does not explain {label} ({100 * chosen.share:.0f} %)"
    return f"its slope{turned} explains {100 * chosen.share:.0f} % of {label}; their size is {chosen.gain:.3g} of the slope's"


def _mirror(pose: _Pose, named: str) -> tuple[str, ...]:
    """Return that motion alone does not tell a chart from its mirror image, unless a name or a geodetic position does."""
    if named or (pose.position is not None and pose.position.form == "geodetic"):
        return ()
    told = "motion alone does not distinguish NED from its mirror image ENU"
    if pose.heading.usual_by and pose.heading_frame == pose.heading.usual_frame:
        way = "rise" if pose.heading_frame == "NED" else "fall"
        return (f"{told}: {pose.heading.usual_by}; in a turn to starboard the heading as recorded has to {way}",)
    return (f"{told}: in a turn to starboard the heading has to rise",)


def _heading(
    chosen: _Agreement, slope: Floats, named: str, groups: Sequence[FieldGroup], samples: Samples
) -> MappedSignal:
    pose = chosen.pose
    known = slope[np.isfinite(slope)]
    turned = float(np.degrees(np.quantile(np.abs(known), 0.99))) if known.size else 0.0
    seen, course = _hull_velocity(chosen, groups, samples), _course(pose)
    along = course.along
    doubts = list(_mirror(pose, named))
    evidence = f"it turns at up to {turned:.1f} deg/s"
    if seen is not None:
        share, label = seen
        evidence = f"turned by it, the slope of the position explains {100 * share:.0f} % of {label}; {evidence}"
    elif along >= DRAFT.agrees:
        evidence = f"the vessel moves along it (mean cosine {along:.2f}); {evidence}"
    elif course.off_deg:
        doubts.append(
            f"course and heading are {abs(course.off_deg):.0f} deg apart at all headings (mean resultant length "
            f"{abs(course.mean):.2f}): if the vessel moved ahead, add {_offset(pose, course.off_deg)}"
        )
    elif (off := course.either_way_deg) is not None:
        if course.both_ways:
            evidence = f"the vessel moves along it, ahead and astern ({course.doubled_length}); {evidence}"
            doubts.append(
                f"ahead or astern is not for the course to say: add {_offset(pose, 180.0)} if the vessel goes astern where its "
                "actuators push ahead"
            )
        else:
            back = off - 180.0 if off > 0.0 else off + 180.0
            doubts.append(
                f"ahead and astern, courses lie {abs(off):.0f} deg off the heading ({course.doubled_length}): add "
                f"{_offset(pose, off)}, or {_offset(pose, back)}, so that the vessel goes ahead where its actuators push ahead"
            )
    else:
        why = "no course to compare" if pose.position is None else f"mean cosine of course and heading {along:.2f}"
        doubts.append(
            f"the motion does not show its zero and sign ({why}): it has to rise in a turn to starboard, and be 0 with the bow "
            "north"
        )
    return MappedSignal(
        "heading", pose.heading.topic, pose.heading.fields, pose.heading_unit, pose.heading_frame, 1.0, (evidence,),
        tuple(doubts),
    )  # fmt: skip


def _offset(pose: _Pose, off_deg: float) -> str:
    """Return the line of a profile that turns a heading by an angle clockwise [deg]."""
    offset = -off_deg if pose.heading_frame == "ENU" else off_deg
    key = "offset_deg" if pose.heading_unit == "quaternion" else "offset"
    return f"{key} = {np.radians(offset) if pose.heading_unit == 'rad' else offset:.3g}"


def _hull_velocity(chosen: _Agreement, groups: Sequence[FieldGroup], samples: Samples) -> tuple[float, str] | None:
    """Return which share of a velocity along the hull position and heading explain, and its name; None where none agrees."""
    if chosen.pose.position is None:
        return None
    if chosen.frame in _BODY and chosen.velocity is not None:
        return chosen.share, chosen.velocity.label
    others = [one for one in groups if one.kind == "velocity" and one != chosen.velocity]
    share, label = max(((_along_hull(chosen.pose, one, samples), one.label) for one in others), default=(0.0, ""))
    return (share, label) if share >= DRAFT.agrees else None


def _others(groups: Sequence[FieldGroup], chosen: _Agreement, samples: Samples) -> tuple[str, ...]:
    """Return the other velocities of a log, with the share of each that the position's slope explains, in whatever frame.

    Raises
    ------
    FerryIdError
        Where several disagree with each other and no position decides.
    """
    others = [one for one in _of_kind(groups, "velocity") if one != chosen.velocity]
    if chosen.velocity is None or not others:
        return ()
    if chosen.pose.position is None or chosen.share < DRAFT.agrees:
        mine = [_smoothed(samples, chosen.velocity, place) for place in (0, 1)]
        apart = [one for one in others if not _alike(mine, [_smoothed(samples, one, place) for place in (0, 1)])]
        if apart:
            names = ", ".join(one.label for one in (chosen.velocity, *apart))
            what = "no position" if chosen.pose.position is None else "no position that agrees with one of them"
            raise FerryIdError(
                f"{1 + len(apart)} velocities disagree, and {what} decides which is right: {names}. Fix: choose a part of the "
                "log with --from and --to in which the vessel moves, or write the signal map by hand, see ferryid vessel show"
            )
        return ()
    shares = [(max(_agreement(chosen.pose, one, samples).share, 0.0), one.label) for one in others]
    return tuple(f"{label} {100.0 * share:.0f} %" for share, label in sorted(shares, reverse=True))


def _alike(a: Sequence[Floats], b: Sequence[Floats]) -> bool:
    """Tell whether two velocities are the same but for their unit and frame."""
    x, y = b
    turned = ((x, y), (x, -y), (y, x), (-x, -y))
    return any(explained(a[0], a[1], one, other)[0] >= DRAFT.agrees for one, other in turned)


def _velocity(velocity: FieldGroup, chosen: _Agreement, others: Sequence[str]) -> MappedSignal:
    stated = unit_of_name(velocity.fields[0], "speed")
    unit, left = (
        (stated, chosen.gain * KINDS["speed"][stated]) if stated else nearest_unit(chosen.gain, "speed", _SPEED_UNITS)
    )
    evidence = f"the position's slope explains {100 * chosen.share:.0f} % of it"
    if chosen.share >= DRAFT.agrees:
        evidence += f"; in {unit} it is {left:.2f} of the slope's size"
    doubts = []
    if others:
        evidence += f"; of other velocities: {', '.join(others)}"
    if chosen.pose.position is not None and chosen.share < DRAFT.agrees:
        frames = f"in {velocity.frame}, which its format states" if velocity.frame else "in any frame"
        doubts.append(f"pose and velocity do not agree {frames}: another topic may be right, or the log is too short")
    if chosen.pose.position is None:
        evidence = "no position to compare it with"
        if velocity.frame:
            evidence += f"; {velocity.frame} as its format states"
        elif velocity.named_frame:
            evidence += f"; {velocity.named_frame} by the names of its components"
        doubts.append("its unit is assumed" if velocity.frame or velocity.named_frame else "unit and frame are assumed")
    elif abs(log(max(left, 1e-3))) > DRAFT.gain:
        doubts.append(f"it is {left:.2f} times the position's slope, which no unit explains")
    elif not stated and unit != _SPEED_UNITS[0] and DRAFT.agrees <= chosen.share < DRAFT.shows_unit:
        doubts.append(
            f"its unit follows from its size alone, and the position's slope explains only {100 * chosen.share:.0f} % of it"
        )
    if chosen.frame in _BODY and abs(chosen.sway) < DRAFT.seen:
        doubts.append(
            f"sway is too small to show its sign (correlation {chosen.sway:.2f}): positive to "
            f"{'port' if chosen.frame == 'FLU' else 'starboard'} is assumed"
        )
    elif chosen.frame in _BODY:
        evidence += f"; sway with a correlation of {chosen.sway:.2f}"
    return MappedSignal(
        "velocity", velocity.topic, velocity.fields, unit, chosen.frame, 1.0, (evidence,), tuple(doubts)
    )


def _yaw_rate(
    groups: Sequence[FieldGroup], samples: Samples, slope: Floats, heading: FieldGroup
) -> MappedSignal | None:
    """Return the yaw rate that follows the slope of the heading best; None where none does, or only slow ones."""
    best: tuple[float, FieldGroup, float] | None = None
    for group in groups:
        if group.kind != "yaw_rate" or group.rate_hz < DRAFT.slower * heading.rate_hz:
            continue
        rate = _smoothed(samples, group, 0)
        rows = np.isfinite(rate + slope)
        if np.count_nonzero(rows) < DRAFT.fewest_rows:
            continue
        rows &= np.abs(slope) <= DRAFT.jump * max(float(np.quantile(np.abs(slope[rows]), 0.9)), 1e-9)
        seen = correlation(rate[rows], slope[rows])
        power = float(slope[rows] @ slope[rows])
        gain = float(rate[rows] @ slope[rows]) / power if power > 0.0 else 0.0
        same = group.topic == heading.topic
        if best is None or abs(seen) + 0.02 * same > abs(best[0]) + 0.02 * (best[1].topic == heading.topic):
            best = seen, group, gain
    if best is None or abs(best[0]) < DRAFT.seen_rate:
        return None
    seen, group, gain = best
    stated = unit_of_name(group.fields[0], "rate")
    unit, left = (stated, abs(gain) * KINDS["rate"][stated]) if stated else nearest_unit(abs(gain), "rate", _RATE_UNITS)
    evidence = f"follows the slope of the heading (correlation {seen:.2f}) with {left:.2f} of its size in {unit}"
    far = abs(log(max(left, 1e-3))) > DRAFT.gain
    doubts = (f"it is {left:.2f} times the slope of the heading, which no unit explains",) if far else ()
    frame = "FRD" if gain > 0.0 else "FLU"
    return MappedSignal("yaw_rate", group.topic, group.fields, unit, frame, 1.0, (evidence,), doubts)
