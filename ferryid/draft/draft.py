"""Drafting a profile: look at names, read what may be of use, compare it, choose."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ferryid.draft.actuator_fields import UNRELATED, actuator_fields, constant, parted, shared_topics
from ferryid.draft.actuators import UNKNOWN_ORDER, DraftedActuator, drafted_actuators
from ferryid.draft.autopilots import Orders, autopilot_fields, autopilot_groups, changing, orders, with_frames
from ferryid.draft.fields import ORDERS, FieldGroup, navigation_groups, numeric_fields, speeds_ahead
from ferryid.draft.guessed_orders import guessed_orders
from ferryid.draft.kinematics import navigation_signals
from ferryid.draft.mapped import MappedSignal
from ferryid.draft.samples import read_samples
from ferryid.draft.unnamed import shown_by_values
from ferryid.draft.wind import wind_fields, wind_signal
from ferryid.errors import FerryIdError
from ferryid.ingest import open_log
from ferryid.ingest.log import Reader, Topic
from ferryid.ingest.parameters import parameters_of
from ferryid.signals.artificial import simulator
from ferryid.types import TimeRanges
from ferryid.vessel.field_words import words_of
from ferryid.vessel.profile import Profile
from ferryid.vessel.thrusters import needed_roles

FRAME_ID = "header.frame_id"


@dataclass(frozen=True)
class Draft:
    """What a log shows of a vessel.

    Attributes
    ----------
    log
        Its path.
    signals
        Pose, velocity, yaw rate, wind and what a controller asked for.
    actuators
        With their signals.
    like
        The profile that hull, thrust and areas are taken from, where one was given.
    notes
        How the log was read, as sentences.
    unused
        Topics of which nothing is mapped.
    unused_fields
        Of topics of which something is mapped: the further columns of a log that is one table, and fields that look like an
        actuator's.
    remarks
        What a person has to check of the log as a whole: parameters of an autopilot that contradict what it recorded.
    """

    log: str
    signals: tuple[MappedSignal, ...]
    actuators: tuple[DraftedActuator, ...]
    like: Profile | None
    notes: tuple[str, ...]
    unused: tuple[str, ...]
    unused_fields: tuple[tuple[str, str], ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def every(self) -> tuple[MappedSignal, ...]:
        """All signals, those of actuators included."""
        return (*self.signals, *(signal for one in self.actuators for signal in one.signals))


def draft_profile(log: str | Path, like: Profile | None = None, ranges: TimeRanges = ()) -> Draft:
    """Draft a profile from a log.

    Parameters
    ----------
    log
        Path; parts of one recording joined by ``+``.
    like
        A profile that hull, thrust and the layout of tables are taken from; signals are looked for in any case.
    ranges
        What of the log is compared; all of it where empty.

    Raises
    ------
    FerryIdError
        For a log that cannot be read, one whose columns have no names, and one without anything that could be a heading or a
        velocity, or without an actuator.
    """
    reader = open_log(log, None if like is None else like.table)
    topics = reader.topics
    autopilot = autopilot_fields(topics)
    groups = with_frames([*navigation_groups(topics), *autopilot_groups(topics)], topics)
    groups = _with_usual_frames(groups, reader, like)
    fields, winds = autopilot or actuator_fields(topics), wind_fields(topics)
    if not groups and not fields and any("named by their place" in topic.note for topic in topics):
        raise FerryIdError(
            f"{log}: its columns have no names, so that nothing shows what they are. Fix: add a header row, or give --like a "
            "profile whose [table] has columns"
        )
    # What names its actuators by numbers is of use only where none has a name.
    shared = [] if fields else shared_topics(topics)
    if groups and not shared and not autopilot:
        fields = [*fields, *guessed_orders(topics, fields)]
    wanted: dict[str, list[str]] = {}
    for group in groups:
        wanted.setdefault(group.topic, []).extend(group.fields)
    for field in fields:
        wanted.setdefault(field.topic, []).append(field.path)
    for bus in shared:
        wanted.setdefault(bus.topic, []).extend((*bus.selectors, bus.value))
    for topic, speed, direction in winds:
        wanted.setdefault(topic, []).extend((speed, direction))
    if not wanted:
        shown = "; ".join(shown_by_values(reader, str(log), ranges))
        raise FerryIdError(
            f"{log}: {_nothing(topics)}, and names decide what is compared"
            f"{f'. By their values {shown}; which are orders no values show' if shown else ''}. Fix: "
            f"{_RENAME if any(one.name == 'table' for one in topics) else ''}{_BY_HAND}"
        )
    samples = read_samples(reader, wanted, str(log), ranges)
    looked_for = fields
    driven = orders(fields, samples, parameters_of(reader)) if autopilot else Orders(tuple(fields))
    fields = [one for one in driven.fields if not one.assumed or changing([one], samples)]
    for bus in shared:
        more, samples = parted(bus, samples)
        fields += more
    signals, motion = navigation_signals(groups, samples)
    if not signals:
        raise FerryIdError(
            f"{log}: no field looks like a heading that changes, found {_listed([one.label for one in groups])}"
            f"{_courses(topics)}. Fix: record the heading, or {_BY_HAND}"
        )
    actuators = drafted_actuators(fields, samples, motion, driven.placements)
    if not actuators:
        still = [] if changing(looked_for, samples) else [f"{one.topic}: {one.path}" for one in looked_for]
        still = still or [f"{one.topic}: {one.value}" for one in shared if constant(one, samples)]
        what = (
            f"nothing that looks like an actuator ever changes, found {_listed(still)}"
            if still
            else f"no field looks like an actuator's speed, angle, force or order, found {_other(topics, groups)}"
        )
        raise FerryIdError(
            f"{log}: {what}{''.join(f'; {one}' for one in driven.remarks)}. Fix: record "
            f"{'while the vessel is driven' if still else 'the orders'}, or {_BY_HAND}"
        )
    wind = wind_signal(winds, samples, motion)
    every = [*signals, *([] if wind is None else [wind]), *_tau_d(topics)]
    if like is not None:
        actuators = [with_kind(with_orders(one, like), like) for one in _named_like(actuators, like)]
    used = {signal.topic for one in actuators for signal in one.signals} | {signal.topic for signal in every}
    notes = tuple(
        dict.fromkeys(note for topic in topics if topic.name in used for note in topic.note.split("; ") if note)
    )
    mapped = [*every, *(signal for one in actuators for signal in one.signals)]
    return Draft(
        str(log),
        tuple(every),
        tuple(actuators),
        like,
        notes,
        tuple(t.name for t in topics if t.name not in used),
        _left_over([t for t in topics if t.name in used], mapped, {(one.topic, one.path) for one in fields}, like),
        (
            *((f"it is no recording of a vessel: {why}",) if (why := simulator(topics)) else ()),
            *_no_way(every, [topic for topic in topics if topic.name in used or len(topics) == 1]),
            *driven.remarks,
        ),
    )


def _no_way(signals: Sequence[MappedSignal], topics: Sequence[Topic]) -> tuple[str, ...]:
    """Return that nothing is mapped that shows how fast the vessel moves, with what may be a speed of surge alone."""
    if {"position", "velocity"} & {one.quantity for one in signals}:
        return ()
    mapped = {(one.topic, field) for one in signals for field in one.fields}
    speeds = [one for one in speeds_ahead(topics) if one not in mapped]
    told = "no position and no velocity is mapped, of which a fit needs one"
    if not speeds:
        return (f"{told}, and no field has a name of either",)
    topic, field = speeds[0]
    return (
        f'{told}: if "{field}" is the speed ahead, map it as surge alone, [signals.velocity] with topic = "{topic}", '
        f'fields = ["{field}"], unit = "m/s" and frame = "FRD"',
    )


def _left_over(
    topics: Sequence[Topic],
    mapped: Sequence[MappedSignal],
    of_actuators: set[tuple[str, str]],
    like: Profile | None,
) -> tuple[tuple[str, str], ...]:
    """Return topic and field of what is not mapped, though its topic is: columns of a single table, fields of actuators."""
    taken = {(one.topic, path) for one in mapped for path in (*one.fields, *(name for name, _ in one.where))}
    table = None if like is None else like.table
    times = set() if table is None else {table.time, *table.stamp}
    # The columns that a time was guessed from stand in the note of their table.
    taken |= {(t.name, path) for t in topics for path in t.fields if path in times or f'"{path}"' in t.note}
    return tuple(
        (topic.name, path)
        for topic in topics
        for path in topic.fields
        if (topic.name, path) not in taken and (topic.name == "table" or (topic.name, path) in of_actuators)
    )


_RENAME = 'name the columns after what they are, as in "N [m]", "psi [deg]", "u [m/s]", "r [deg/s]", "rpm", or '


_BY_HAND = "write the signal map by hand; ferryid vessel show vtec-usv --toml prints one"


def _nothing(topics: Sequence[Topic]) -> str:
    return f"no topic has a name of pose, velocity, heading or actuator, found {_listed(_fields(topics))}"


def _courses(topics: Sequence[Topic]) -> str:
    """Return that a course over ground is recorded, and that it is no heading; empty where none is."""
    found = [
        f"{topic.name}: {path}" for topic in topics for path, words in numeric_fields(topic).items()
        if words[-1:] in (("track",), ("cog",), ("course",)) and not set(words) & (ORDERS | UNRELATED) and topic.count > 1
    ]  # fmt: skip
    return (
        f"; {_listed(found)}: a course over ground, which differs from the heading where the vessel drifts"
        if found
        else ""
    )


def _fields(topics: Sequence[Topic]) -> list[str]:
    """Return the names of topics, and of the columns where the log is a table."""
    return [path for one in topics for path in ((*one.fields,) if one.name == "table" else (one.name,))]


def _with_usual_frames(groups: Sequence[FieldGroup], reader: Reader, like: Profile | None) -> list[FieldGroup]:
    """Return groups with the frame that holds where motion leaves NED and ENU open.

    That of a like profile, else what the messages state, else the convention of their type.
    """
    posed = {one.topic for one in groups if one.kind in ("position", "heading")}
    usual = {}
    for topic in (one for one in reader.topics if one.name in posed):
        if re.fullmatch(r"nav_msgs/(msg/)?Odometry", topic.type):
            usual[topic.name] = "ENU", f"ENU is the convention of {topic.type} (REP 103)"
        if stated := _stated_frame(reader, topic):
            usual[topic.name] = stated
    for signal in () if like is None else like.signals:
        if signal.quantity in ("position", "heading") and signal.frame in ("NED", "ENU"):
            usual[signal.topic] = signal.frame, f"{signal.frame} is as in the profile {like.name if like else ''}"
    return [
        replace(one, usual_frame=usual[one.topic][0], usual_by=usual[one.topic][1]) if one.topic in usual else one
        for one in groups
    ]


def _stated_frame(reader: Reader, topic: Topic) -> tuple[str, str] | None:
    """Return the frame that the headers of a topic name, and the words for it; None where they name none, or several."""
    if topic.fields.get(FRAME_ID) != "string":
        return None
    try:
        named = set(reader.read({topic.name: [FRAME_ID]})[topic.name].columns[FRAME_ID].tolist())
    except FerryIdError:
        # What cannot be read names nothing.
        return None
    frames = {frame for one in named for frame in ("NED", "ENU") if frame.lower() in words_of(str(one))}
    if len(frames) != 1:
        return None
    (frame,) = frames
    return frame, f"{frame} is what {FRAME_ID} of its messages says"


def _other(topics: Sequence[Topic], groups: Sequence[FieldGroup]) -> str:
    """Return the topics, and of a table the columns that are no pose or velocity, for an error."""
    if all(one.name != "table" for one in topics):
        return f"the topics {_listed([one.name for one in topics])}"
    taken = {path for one in groups if one.topic == "table" for path in one.fields}
    # The columns that a time was guessed from stand in the note of their table.
    taken |= {path for one in topics for path in one.fields if f'"{path}"' in one.note}
    return f"beside pose and velocity the columns {_listed([one for one in _fields(topics) if one not in taken])}"


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:8]) + (", ..." if len(names) > 8 else "") if names else "none"


def _tau_d(topics: Sequence[Topic]) -> list[MappedSignal]:
    """Return the forces that a controller asked for."""
    for topic in topics:
        words, fields = set(words_of(topic.name)), set(topic.fields)
        stem = next((path.removesuffix("force.x") for path in fields if path.endswith("force.x")), None)
        if (
            stem is None
            or not {"tau", "wrench"} & words
            or not {"d", "desired", "cmd", "command"} & words
            or topic.count < 2
        ):
            continue
        three = (f"{stem}force.x", f"{stem}force.y", f"{stem}torque.z")
        if set(three) <= fields:
            why = ("forces and a moment that a controller asked for, by its name",)
            options = (("moment_unit", "N*m"),)
            return [MappedSignal("tau_d", topic.name, three, "N", "FRD", 1.0, why, ("its frame is assumed",), options)]
    return []


def with_orders(actuator: DraftedActuator, like: Profile) -> DraftedActuator:
    """Return an actuator whose signals are orders where a profile has them as orders, and the log's names do not state it."""
    known = {signal.quantity for signal in like.signals}
    return replace(
        actuator,
        signals=tuple(
            as_order(signal)
            if UNKNOWN_ORDER in signal.doubts and signal.quantity not in known and f"{signal.quantity}.command" in known
            else signal
            for signal in actuator.signals
        ),
    )


def as_order(signal: MappedSignal) -> MappedSignal:
    """Return the signal of an actuator as an order."""
    doubts = tuple(one for one in signal.doubts if one != UNKNOWN_ORDER)
    return replace(signal, quantity=f"{signal.quantity}.command", doubts=doubts)


def with_kind(actuator: DraftedActuator, like: Profile) -> DraftedActuator:
    """Return an actuator of the kind that a profile has it of, with signals of this kind.

    What looks like the speed of an actuator that the profile has as a force is that force, unless the log has its force or
    thrust as well; an angle of one that does not turn is none of its signals.
    """
    twin = next((one for one in like.actuators if one.name == actuator.name), None)
    if twin is None:
        return actuator
    usual = {role for roles in needed_roles(twin) for role in roles}
    roles = {signal.quantity.split(".")[1] for signal in actuator.signals}
    meant = "thrust" if "thrust" in roles else "speed"
    signals = []
    for signal in actuator.signals:
        role, dot, order = signal.quantity.partition(".")[2].partition(".")
        as_force = f"{actuator.name}.force{dot}{order}"
        if role in usual:
            signals.append(signal)
        elif twin.kind == "force" and role == meant and "force" not in roles:
            shares = ("%", "fraction", "us")
            doubt = f"its field is called a {role}: that it is the force is as in the profile {like.name}"
            signals.append(
                replace(
                    signal,
                    quantity=as_force,
                    unit=signal.unit if role == "thrust" or signal.unit in shares else "N",
                    evidence=tuple(one for one in signal.evidence if not one.startswith("in ")),
                    doubts=(*(one for one in signal.doubts if not one.startswith("the unit")), doubt),
                )
            )
    return replace(actuator, kind=twin.kind, signals=tuple(signals))


def _named_like(actuators: Sequence[DraftedActuator], like: Profile) -> list[DraftedActuator]:
    """Return actuators under the names that a profile gives them: of the same name, or else of the same kind in order."""
    free = [one for one in like.actuators if one.name not in {other.name for other in actuators}]
    named = {one.name for one in like.actuators}
    found = []
    for one in actuators:
        if one.name in named:
            found.append(one)
            continue
        twin = next((other for other in free if other.kind == one.kind), None)
        if twin is None:
            found.append(one)
            continue
        free.remove(twin)
        signals = tuple(
            replace(signal, quantity=f"{twin.name}.{signal.quantity.partition('.')[2]}") for signal in one.signals
        )
        found.append(replace(one, name=twin.name, signals=signals))
    return found
