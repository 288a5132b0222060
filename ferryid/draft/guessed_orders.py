"""Which fields may be orders to thrusters though no word says so: side, number or order beside what may be a thruster."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from ferryid.draft.actuator_fields import BASES, SIDES, UNRELATED, ActuatorField, paired_names, sided
from ferryid.draft.fields import ORDERS, numeric_fields, rate_of
from ferryid.ingest.log import Topic
from ferryid.vessel.field_words import unit_of_name, words_of

OF_WHAT = "its name does not state of what it is an order: a share of full power is assumed, not a speed or a force"
"""Doubt of what is an order by its name."""
WHETHER = "its name states neither that it is an order nor of what: an order as a share of full power is assumed"
"""Doubt of what is named after a thruster alone."""
OF_POWER = "its name states a power: an order as a share of full power is assumed; an electric power is no order"
"""Doubt of a column such as ``propeller_power``."""
_ELECTRIC = frozenset({"voltage", "volt", "volts", "current", "battery", "amps", "ampere", "watt", "watts"})
"""Words of a column beside which a power is an electric one."""
_THRUSTERS = {
    **{one: one for one in BASES if one not in ("rudder", "azimuth", "azi")},
    "prop": "propeller",
    "thr": "thruster",
    "thrusters": "thruster",
    "motors": "motor",
    "propellers": "propeller",
    "engines": "engine",
    "servo": "output",
}
"""Words of what pushes, with the name of it; a servo that has a number is an output of an autopilot."""
_BOTH_SIDES = (frozenset({"port", "starboard"}), frozenset({"left", "right"}))
_VALUES = frozenset({"data", "value", "raw", "out", "output"})
_UNITS_OF_SHARES = frozenset({"us", "pwm", "pct", "percent", "cmd"})
_NUMBERED = re.compile(r"([Tun])([0-9]+)")
"""Columns of forces, orders or propeller speeds as textbooks number them; a lower t is a time."""
_AS_SPEED = "its name does not state of what it is: the speed of a propeller is assumed"
_OUTPUT = re.compile(r"RCOU[._ ](?:C|Ch)([0-9]+)")
"""Columns of a table made of a log of ArduPilot."""


@dataclass(frozen=True)
class _Guess:
    """A field, the words of its name that say which thruster it is, and how sure its name is."""

    field: ActuatorField
    said: frozenset[str]
    sure: bool


def guessed_orders(topics: Sequence[Topic], named: Sequence[ActuatorField]) -> list[ActuatorField]:
    """Return fields that may be orders to thrusters, but for those that are named as what they are.

    Sides with an order and nothing else, and columns as ``T1`` and ``u1``, are taken only where no thruster has a better name:
    both sides, several of one letter, or the one throttle.
    """
    known, paired = {one.label for one in named}, paired_names(topics)
    found = [
        guess
        for topic in topics
        if topic.count > 1
        for path, own in numeric_fields(topic).items()
        for guess in [_guess(topic, path, own, paired)]
        if guess is not None and guess.field.label not in known
    ]
    sure = [one.field for one in found if one.sure]
    if sure or any(one.role in ("speed", "force", "duty") for one in named):
        return sure
    every = frozenset().union(*(one.said for one in found))
    sides = [one.field for one in found if any(one.said & both and both <= every for both in _BOTH_SIDES)]
    return sides or _numbered(topics) or _throttle(topics) or _powers(topics, paired)


def _guess(topic: Topic, path: str, own: tuple[str, ...], paired: frozenset[tuple[str, ...]]) -> _Guess | None:
    """Return what a field may be if its name has a thruster, a side or an order, and nothing that is neither."""
    table = topic.name == "table"
    if table and (match := _OUTPUT.fullmatch(path)):
        return _Guess(_field(topic, path, f"output{match[1]}", WHETHER), frozenset(), True)
    around = () if table else sided(words_of(topic.name), paired)
    telling = (*_THRUSTERS, *SIDES, *ORDERS)
    first = next((k for k, word in enumerate(around) if word in telling), len(around))
    words = (*around[first:], *sided(own, paired))
    said = frozenset(words)
    plain = all(word in telling or word in _VALUES or word.isdigit() for word in words)
    if not plain or said & UNRELATED or set(around) & UNRELATED:
        return None
    base = next((_THRUSTERS[word] for word in words if word in _THRUSTERS), "")
    sides = [word for word in dict.fromkeys(words) if word in SIDES]
    number = next((word for word in words if word.isdigit()), "")
    ordered = bool(said & ORDERS)
    if not (sides or number or ordered) or not (base or (sides and ordered)):
        return None
    name = "_".join(sides) + number if sides else base + number
    field = _field(topic, path, name, OF_WHAT if ordered else WHETHER)
    if "[" in path and table:
        # What its unit states it is; one of another kind is no order.
        kinds = {"speed": "rotation", "force": "force", "duty": "fraction"}
        role = next((role for role, kind in kinds.items() if unit_of_name(path, kind)), "")
        if not role:
            return None
        order = True if ordered else None
        field = ActuatorField(name, role, order, topic.name, path, rate_of(topic))
    return _Guess(field, said, bool(base))


def _field(topic: Topic, path: str, name: str, assumed: str) -> ActuatorField:
    return ActuatorField(name, "duty", True, topic.name, path, rate_of(topic), assumed=assumed)


def _numbered(topics: Sequence[Topic]) -> list[ActuatorField]:
    """Return columns of one letter and a number, where there are several of the letter."""
    columns = [
        (topic, path, match) for topic in topics if topic.name == "table" for path in numeric_fields(topic)
        if (match := _NUMBERED.fullmatch(path))
    ]  # fmt: skip
    letters = [match[1] for _, _, match in columns]
    several = next((letter for letter in letters if letters.count(letter) > 1), "")
    return [
        ActuatorField(f"actuator{match[2]}", "speed", None, topic.name, path, rate_of(topic), assumed=_AS_SPEED)
        if several == "n"
        else _field(topic, path, f"actuator{match[2]}", WHETHER)
        for topic, path, match in columns
        if match[1] == several
    ]


def _throttle(topics: Sequence[Topic]) -> list[ActuatorField]:
    """Return the column of a throttle if it is the only one: it drives the one propeller, ahead of a rudder if there is one."""
    found = [
        _field(topic, path, "propeller", OF_WHAT)
        for topic in topics if topic.name == "table"
        for path, words in numeric_fields(topic).items()
        if words[:1] == ("throttle",) and set(words[1:]) <= _VALUES | _UNITS_OF_SHARES
    ]  # fmt: skip
    return found if len(found) == 1 else []


def _powers(topics: Sequence[Topic], paired: frozenset[tuple[str, ...]]) -> list[ActuatorField]:
    """Return columns named after the power of a thruster: of the only one, or of several by their sides or numbers."""
    columns = [(topic, path, sided(words, paired)) for topic in topics if topic.name == "table"
               for path, words in numeric_fields(topic).items()]  # fmt: skip
    if any(_ELECTRIC & set(words) for _, _, words in columns):
        return []
    powers = [
        (topic, path, tuple(word for word in words if word != "power" and word not in _VALUES | _UNITS_OF_SHARES))
        for topic, path, words in columns
        if "power" in words and "[" not in path
    ]
    found = [
        _field(topic, path, _THRUSTERS[words[0]] if len(powers) == 1 else "_".join(words), OF_POWER)
        for topic, path, words in powers
        if any(word in _THRUSTERS for word in words)
        and all(word in _THRUSTERS or word in SIDES or word.isdigit() for word in words)
        and (len(powers) == 1) == (len(words) == 1)
    ]
    return found if len(found) == len(powers) else []
