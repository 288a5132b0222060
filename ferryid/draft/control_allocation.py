"""Motors and servos of PX4 by the parameters of its log: places and directions of its rotors, and which servo is a rudder.

Names and meaning as of PX4's src/modules/control_allocator/module.yaml.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from math import atan2, degrees, hypot

from ferryid.draft.actuator_fields import ActuatorField
from ferryid.draft.autopilot_parameters import NOT_STATED, Placement, UsedValues

_FIXED = {5: "Rover (Ackermann)", 6: "Rover (Differential)", 13: "Rover (Mecanum)"}
"""CA_AIRFRAME of vehicles whose places of motors PX4 does not ask for: what stands in the parameters means nothing."""
_MOST = 12
"""Rotors that PX4 has parameters of."""
_RUDDERS = {4: "Rudder", 16: "Steering Wheel"}
"""CA_SV_CSn_TYPE of what steers."""


def rudders_alone(fields: Sequence[ActuatorField], values: UsedValues) -> list[ActuatorField]:
    """Return fields without the servos that are not rudders, where the parameters state which one is."""
    servos = {one: _surface(one, values) for one in fields if one.actuator.startswith("servo")}
    if not any(kind in _RUDDERS for kind in servos.values()):
        return list(fields)
    return [one for one in fields if one not in servos or servos[one] in _RUDDERS]


def rudder_evidence(field: ActuatorField, values: UsedValues) -> str:
    """Return what states that a servo is a rudder, empty where nothing does."""
    kind = _surface(field, values)
    return f"CA_SV_CS{_index(field)}_TYPE = {kind} ({_RUDDERS[kind]})" if kind in _RUDDERS else ""


def rotor_placements(
    names: Sequence[str], every: Sequence[ActuatorField], values: UsedValues
) -> tuple[dict[str, Placement], list[str]]:
    """Return what the parameters state of each motor, and what a person has to check.

    Parameters
    ----------
    names
        The motors whose orders change.
    every
        All orders of the log.
    values
        The parameters.
    """
    airframe, count = values.whole("CA_AIRFRAME"), values.whole("CA_ROTOR_COUNT")
    motors = [name for name in names if re.fullmatch(r"motor[0-9]+", name)]
    if not motors or not any(one.topic.strip("/") == "actuator_motors" for one in every) or airframe in _FIXED:
        return {}, []
    placements = {}
    remarks = [] if count is None else _counted(motors, count)
    for name in motors:
        if count is None or int(name.removeprefix("motor")) <= count:
            placement = _placement(int(name.removeprefix("motor")) - 1, values)
            if placement is not None:
                placements[name] = placement
    places = [one.position_m for one in placements.values() if one.position_m is not None]
    if len(places) > 1 and len(set(places)) < len(places):
        remarks.append("CA_ROTORn_PX and CA_ROTORn_PY put several motors in one place")
    return placements, [*remarks, *values.remarks.values()]


def _counted(motors: Sequence[str], count: int) -> list[str]:
    """Return how the motors that change contradict the number that is stated."""
    numbers = {int(name.removeprefix("motor")) for name in motors}
    still = [k for k in range(1, min(count, _MOST) + 1) if k not in numbers]
    beyond = sorted(number for number in numbers if number > count)
    return [
        *(f"CA_ROTOR_COUNT = {count}, but the order of motor {k} never changes: it is not mapped" for k in still),
        *(f"CA_ROTOR_COUNT = {count}, yet the order of motor {k} changes: its place is not stated" for k in beyond),
    ]


def _placement(rotor: int, values: UsedValues) -> Placement | None:
    """Return place and direction of a rotor, None where the log does not have them, or has them as they are unless set."""
    x, y = values.get(f"CA_ROTOR{rotor}_PX"), values.get(f"CA_ROTOR{rotor}_PY")
    axis = tuple(values.get(f"CA_ROTOR{rotor}_A{letter}") for letter in "XYZ")
    placement = NOT_STATED
    if x is not None and y is not None and (x, y) != (0.0, 0.0):
        place = f"CA_ROTOR{rotor}_PX = {x:.4g}, CA_ROTOR{rotor}_PY = {y:.4g}, from the centre of gravity"
        placement = replace(placement, position_m=(round(x, 4), round(y, 4)), evidence=(place,))
    ahead, aside, down = axis
    if ahead is not None and aside is not None and down is not None:
        flat = hypot(ahead, aside)
        shown = f"CA_ROTOR{rotor}_AX = {ahead:.4g}, _AY = {aside:.4g}, _AZ = {down:.4g}"
        if flat > abs(down):
            # Parameters have two decimals.
            angle = round(degrees(atan2(aside, ahead)), 1)
            tunnel = angle == 90.0
            placement = replace(
                placement,
                kind="tunnel" if tunnel else "",
                angle_deg=None if tunnel else angle,
                evidence=(*placement.evidence, shown),
            )
        elif placement.position_m is not None:
            doubt = f"{shown} is an axis that points up or down: the thruster is taken to push ahead"
            placement = replace(placement, doubts=(doubt,))
    return placement if placement != NOT_STATED else None


def _surface(field: ActuatorField, values: UsedValues) -> int | None:
    is_servo = field.topic.strip("/") == "actuator_servos"
    return values.whole(f"CA_SV_CS{_index(field)}_TYPE") if is_servo else None


def _index(field: ActuatorField) -> int:
    match = re.search(r"\[([0-9]+)\]$", field.path)
    return int(match[1]) if match is not None else -1
