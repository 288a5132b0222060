"""Which fields of a log are speeds, angles and forces of actuators, and which actuator each belongs to, by their names."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ferryid.draft.autopilot_parameters import OutputSetting
from ferryid.draft.fields import ORDERS, numeric_fields, rate_of
from ferryid.draft.samples import Samples
from ferryid.ingest.log import Topic
from ferryid.vessel.field_words import words_of
from ferryid.vessel.signal_map import stream_name

_SPEED = frozenset({"rpm", "rps", "speed", "n", "revs", "revolutions", "rotation", "shaft"})
_ANGLE = frozenset({"azimuth", "azi", "angle", "alpha", "direction", "steering", "nozzle"})
_RUDDER = frozenset({"rudder", "delta"})
_OF_TIME = frozenset({"t", "time", "s", "sec", "ms", "us", "ns"})
"""What makes a delta a step of time."""
_FORCE = frozenset({"force", "thrust", "newton", "thruster"})
_DUTY = frozenset({"pwm", "throttle", "duty", "percent"})
BASES = (
    "thruster",
    "propeller",
    "prop",
    "motor",
    "azimuth",
    "azi",
    "pod",
    "actuator",
    "outboard",
    "engine",
    "esc",
    "rudder",
)
SIDES = (
    "stern",
    "aft",
    "bow",
    "fore",
    "front",
    "rear",
    "port",
    "starboard",
    "left",
    "right",
    "center",
    "centre",
    "mid",
)
_SHORT_SIDES = {"stbd": "starboard", "stb": "starboard", "sb": "starboard"}
_LETTERS = {"p": ("s", "port"), "s": ("p", "starboard"), "l": ("r", "left"), "r": ("l", "right")}
"""Letters of sides: each with that of the other side, and what it means."""
_BUS = frozenset({"motors", "lli", "can", "bus", "serial", "servo", "servos", "actuation"})
_SELECTORS = ("id", "channel", "index", "node", "number")
_VALUES = ("data", "value", "val", "setpoint", "pwm", "command", "cmd")
_MOST_SHARED = 16
"""Actuators on one topic."""
_FEEDBACK = frozenset({"state", "feedback", "actual", "measured", "encoder", "status"})
UNRELATED = frozenset(
    [
        "desired",
        "error",
        "err",
        "voltage",
        "current",
        "power",
        "temp",
        "temperature",
        "pcb",
        "stator",
        "battery",
        "charge",
        "supply",
        "torque",
        "fault",
        "stop",
        "limit",
        "menu",
        "miles",
        "minutes",
        "switches",
        "setup",
        "code",
        "wind",
        "wrench",
        "tau",
        "reset",
        "usbl",
        "sonar",
        "lidar",
        "radar",
        "antenna",
        "camera",
    ]
)
_MARKS = frozenset({*BASES, *SIDES, *_RUDDER, "rpm", "azi", "thrust", "pwm", "lpwm", "rpwm", "thrusters", "actuators"})
_SAME = frozenset(
    {"raw", "filtered", "filt", "smooth", "smoothed", "mean", "average", "avg", "min", "max", "data", "value"}
)
"""Words by which two fields of one actuator differ."""


@dataclass(frozen=True)
class ActuatorField:
    """One field of an actuator.

    Attributes
    ----------
    actuator
        Name of the actuator, made of the words of topic and field.
    role
        ``speed``, ``angle``, ``rudder``, ``force`` or ``duty`` (a share of full power, or a pulse width).
    order
        True for an order, False for feedback, None where no word says which.
    topic, path
        Where it is.
    rate_hz
        Messages per second.
    where
        Fields and values of the messages that are its own, on a topic that carries several actuators.
    setting
        What the parameters of an autopilot state of it; None where they do not.
    assumed
        What is assumed of it, as its name does not state it; empty where it does.
    """

    actuator: str
    role: str
    order: bool | None
    topic: str
    path: str
    rate_hz: float
    where: tuple[tuple[str, float], ...] = ()
    setting: OutputSetting | None = None
    assumed: str = ""

    @property
    def stream(self) -> str:
        """Name of its messages."""
        return stream_name(self.topic, self.where)

    @property
    def label(self) -> str:
        """Topic and field."""
        return f"{self.topic}: {self.path}"


def actuator_fields(topics: Sequence[Topic]) -> list[ActuatorField]:
    """Return the fields of actuators in the order of the log, each with the actuator that it belongs to."""
    found: list[ActuatorField] = []
    paired = paired_names(topics)
    for topic in topics:
        around = () if topic.name == "table" else sided(words_of(topic.name), paired)
        if topic.count < 2 or set(around) & (UNRELATED | {"odometry", "navigation"}):
            continue
        fields = numeric_fields(topic)
        bare = {words[0] for words in fields.values() if len(words) == 1}
        for path, own in fields.items():
            words = sided(own, paired)
            every = (*around, *words)
            marked = bool(set(every) & _MARKS) or (
                topic.encoding == "table" and words == ("n",) and "rudder" in bare and "e" not in bare
            )
            if not marked or set(words) & UNRELATED:
                continue
            role = _role(words, around)
            if role:
                found.append(
                    ActuatorField(_name(every, role), role, _order(every, role), topic.name, path, rate_of(topic))
                )
    names = {one.actuator for one in found}
    if names == {"azimuth", "propeller"}:
        # One speed and one angle without a number: one thruster.
        found = [replace(one, actuator="azimuth") for one in found]
    return _apart(found, paired)


def paired_names(topics: Sequence[Topic]) -> frozenset[tuple[str, ...]]:
    """Return the names of topics and fields, as words, that another has but for a letter of the other side."""
    names = {_split(words_of(topic.name)) for topic in topics} | {
        _split(words) for topic in topics for words in numeric_fields(topic).values()
    }
    return frozenset(
        words
        for words in names
        for k, word in enumerate(words)
        if word in _LETTERS and (*words[:k], _LETTERS[word][0], *words[k + 1 :]) in names
    )


def sided(words: tuple[str, ...], paired: frozenset[tuple[str, ...]]) -> tuple[str, ...]:
    """Return words with their sides written out: a letter is one beside a word of an actuator, where its pair is there too.

    A lone p or r is a roll rate or a yaw rate, and delta_r a rudder angle; l and r of an order are its sides.
    """
    parted = _split(words)
    marked = bool({*parted} & (_MARKS | {"n"})) or bool({*parted} & ORDERS and {*parted} & {"l", "r"})
    letters = parted in paired and marked
    return tuple(_LETTERS[word][1] if letters and word in _LETTERS else _SHORT_SIDES.get(word, word) for word in parted)


def _apart(fields: Sequence[ActuatorField], paired: frozenset[tuple[str, ...]]) -> list[ActuatorField]:
    """Return fields, those that would be the same signal of one actuator named after the words by which they differ.

    Where the actuator has other signals, its first field keeps the name. Fields that differ by words as raw and filtered
    are those of one actuator.
    """
    alike: dict[tuple[str, str, bool], list[ActuatorField]] = {}
    for one in fields:
        alike.setdefault((one.actuator, one.role, one.order is True), []).append(one)
    roles = {one.actuator: {other.role for other in fields if other.actuator == one.actuator} for one in fields}
    names: dict[str, str] = {}
    for (actuator, _, _), group in alike.items():
        rests = [_rest(one, paired) for one in group]
        first = len(group) > 1 and len(roles[actuator]) > 1
        for one, rest in zip(group[first:], rests[first:], strict=True):
            if rest and len(set(rests)) > 1:
                names[one.label] = "_".join((actuator, *rest))
    return [replace(one, actuator=names.get(one.label, one.actuator)) for one in fields]


def _rest(field: ActuatorField, paired: frozenset[tuple[str, ...]]) -> tuple[str, ...]:
    """Return the words of a field's name that say neither its actuator nor what it is."""
    said = {
        *_SPEED,
        *_ANGLE,
        *_RUDDER,
        *_FORCE,
        *_DUTY,
        *BASES,
        *_FEEDBACK,
        *_SAME,
        *ORDERS,
        *field.actuator.split("_"),
    }
    around = () if field.topic == "table" else sided(words_of(field.topic), paired)
    every = (*around, *sided(words_of(field.path), paired))
    # The number of an actuator stands behind its name.
    return tuple(word for word in dict.fromkeys(every) if word not in said and not field.actuator.endswith(word))


@dataclass(frozen=True)
class SharedTopic:
    """A topic whose messages are of several actuators: the fields that tell them apart, and the one with the value."""

    topic: str
    selectors: tuple[str, ...]
    value: str


def shared_topics(topics: Sequence[Topic]) -> list[SharedTopic]:
    """Return topics of orders whose messages name their actuator by numbers, as those on a bus do."""
    found = []
    for topic in topics:
        around = set(words_of(topic.name))
        if topic.count < 2 or topic.name == "table" or not around & (ORDERS | _BUS | _MARKS):
            continue
        fields = numeric_fields(topic)
        whole = [path for path in fields if topic.fields[path].startswith(("int", "uint"))]
        selectors = tuple(path for path in whole if fields[path][-1] in _SELECTORS)
        values = [path for path, words in fields.items() if words[-1] in _VALUES and path not in selectors]
        if selectors and len(values) == 1:
            found.append(SharedTopic(topic.name, selectors, values[0]))
    return found


def constant(shared: SharedTopic, samples: Samples) -> bool:
    """Tell whether what a topic carries of several actuators never changes of any of them."""
    known = all((shared.topic, path) in samples.columns for path in (*shared.selectors, shared.value))
    return known and not parted(shared, samples)[0]


def parted(shared: SharedTopic, samples: Samples) -> tuple[list[ActuatorField], Samples]:
    """Return the actuators on a topic that carries several, and the samples with the messages of each apart."""
    if any((shared.topic, path) not in samples.columns for path in (*shared.selectors, shared.value)):
        return [], samples
    chosen = np.column_stack([samples.raw(shared.topic, path) for path in shared.selectors])
    values, times = samples.raw(shared.topic, shared.value), samples.times_s[shared.topic]
    found, all_times, columns = [], dict(samples.times_s), dict(samples.columns)
    for numbers in np.unique(chosen[np.isfinite(chosen).all(axis=1)], axis=0)[:_MOST_SHARED]:
        rows = (chosen == numbers).all(axis=1)
        if np.unique(values[rows]).size < 2:
            continue
        where = tuple(sorted(zip(shared.selectors, map(float, numbers), strict=True)))
        telling = max(range(len(numbers)), key=lambda k: np.unique(chosen[:, k]).size)
        word = "_".join(words_of(shared.selectors[telling])[:-1]) or "actuator"
        rate = np.count_nonzero(rows) / max(float(np.ptp(times[rows])), 1e-9)
        field = ActuatorField(f"{word}{numbers[telling]:g}", "duty", True, shared.topic, shared.value, rate, where)
        all_times[field.stream], columns[field.stream, shared.value] = times[rows], values[rows]
        found.append(field)
    return found, replace(samples, times_s=all_times, columns=columns)


def _split(words: Sequence[str]) -> tuple[str, ...]:
    """Part what is written as one: a side before pwm or behind motor, the mark of an order before rudder."""
    parted: list[str] = []
    for word in words:
        if match := re.fullmatch(r"(l|r|left|right)(pwm|rpm|thruster|motor)", word):
            parted += [{"l": "left", "r": "right"}.get(match[1], match[1]), match[2]]
        elif match := re.fullmatch(r"(cmd|mot|motor)(l|r)", word):
            parted += [{"mot": "motor"}.get(match[1], match[1]), match[2]]
        elif match := re.fullmatch(r"(cmd|ref)(rudder|throttle|thrust|thruster|motor|rpm|pwm|azimuth)", word):
            parted += [match[1], match[2]]
        else:
            parted.append(word)
    return tuple(parted)


def _role(words: Sequence[str], around: Sequence[str]) -> str:
    """Return the role of a field: by its own words, and of one that is called data, by its topic's."""
    own = [word for word in words if word not in ("data", "value", "x", "cmd", "command", "reference", "ref")]
    if own[:1] == ["delta"] and set(own[1:]) & _OF_TIME:
        return ""
    for said in (set(own), set(around)):
        for role, names in (
            ("duty", _DUTY),
            ("rudder", _RUDDER),
            ("angle", _ANGLE),
            ("speed", _SPEED),
            ("force", _FORCE),
        ):
            if said & names and not (role == "force" and said & {"speed", "rpm"}):
                return role
        if "prop" in said:
            return "speed"
        if own:
            return ""
    return ""


def _order(words: Sequence[str], role: str) -> bool | None:
    said = set(words)
    if said & (ORDERS | _DUTY):
        return True
    if said & _FEEDBACK or {"motor", "speed"} <= said:
        return False
    # A force on a hull is hardly ever measured: what has that name is what a controller asks for.
    return True if role == "force" and "thruster" in said else None


def _name(words: Sequence[str], role: str) -> str:
    """Return the name of an actuator: side and number, or what it is where there is but one."""
    sides = [word for word in dict.fromkeys(words) if word in SIDES]
    number = next((word for word in words if word.isdigit()), "")
    base = next((word for word in words if word in BASES), "")
    base = {"prop": "propeller", "azi": "azimuth"}.get(base, base)
    if sides:
        return "_".join(sides) + number
    if number:
        return (base or "actuator") + number
    return base if base and base not in ("rudder", "azimuth") else {"angle": "azimuth"}.get(role, "propeller")
