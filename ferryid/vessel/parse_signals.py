"""The signal map of a profile: which fields give which quantity, in what unit, with what sign, in what frame."""

from __future__ import annotations

import math

from ferryid.errors import did_you_mean
from ferryid.vessel.faults import Fault, TableReader
from ferryid.vessel.parse_choices import parse_element, parse_pulses, parse_where
from ferryid.vessel.profile import Actuator, Element, Signal
from ferryid.vessel.thrusters import needed_roles
from ferryid.vessel.units import unit_fault

BODY_FRAMES = ("FRD", "FLU")
WORLD_FRAMES = ("NED", "ENU")
VESSEL_QUANTITIES = (
    *("position", "heading", "velocity", "yaw_rate", "roll", "pitch"),
    *("wind", "current", "payload", "tau_d", "position_d", "heading_d"),
)
ROLE_KINDS = {"speed": "rotation", "angle": "angle", "rudder": "angle", "force": "force", "thrust": "force"}
Chosen = tuple[Element, ...]
SHARES = ("%", "fraction", "us")
"""Units of a signal that is a share of full power or of full travel."""
SCALED, MOST_SCALE = ("velocity", "yaw_rate"), 100.0
"""Quantities whose instruments may read too much or too little by a share, and the largest factor on them."""
LONGEST_RESPONSE_S = 60.0
"""Longest time constant and delay with which an actuator may follow its order [s]: what is slower is no actuator."""
_OPTIONAL = ("wind", "current", "payload", "tau_d", "position_d", "heading_d", "roll", "pitch")


def parse_signals(
    reader: TableReader | None, actuators: tuple[Actuator, ...], faults: list[Fault], with_curve: frozenset[str]
) -> tuple[Signal, ...]:
    """Read every ``[signals.<quantity>]``, noting faults, what the map lacks and where it contradicts itself.

    Of the actuators in `with_curve` it is known already what is wrong with a thrust curve that cannot be used.
    """
    if reader is None:
        return ()
    by_name = {actuator.name: actuator for actuator in actuators}
    before = len(faults)
    signals: list[Signal] = []
    read: dict[tuple[str, str, Chosen], Signal] = {}
    for quantity in reader.data:
        table = reader.table(quantity)
        if table is None:
            continue
        if quantity in VESSEL_QUANTITIES:
            signal = _vessel_signal(quantity, table)
        else:
            signal = _actuator_signal(quantity, table, by_name)
        if signal is not None:
            signals.append(signal)
            _check_own_fields(table, signal, read)
    if len(faults) == before:
        _check_complete(reader, signals, actuators, with_curve)
    return tuple(signals)


def _vessel_signal(quantity: str, table: TableReader) -> Signal | None:
    topic = table.text("topic", required=True)
    options: dict[str, str] = {}
    sign, offset = 1.0, 0.0
    scale = table.number("scale", 1.0, above=0.0, within=MOST_SCALE) if quantity in SCALED else 1.0
    mount_m = (0.0, 0.0)
    frame = ""
    if quantity == "wind" and not table.has("fields"):
        fields, unit = _wind_fields(table, options)
        sign, offset = _sign(table), table.number("offset", 0.0)
    elif quantity == "payload":
        fields, unit = _payload_fields(table, options)
        sign, offset = _sign(table), table.number("offset", 0.0)
        if len(fields) == 1:
            mount_m = (table.number("x_m", 0.0, within=1e3), 0.0)
    elif quantity in ("heading", "heading_d") and table.has("quaternion"):
        fields, unit = table.texts("quaternion", 4), "quaternion"
        frame = _frame(table, WORLD_FRAMES, quantity)
        offset = _degrees_offset(table)
    elif quantity in ("heading", "heading_d", "yaw_rate", "roll", "pitch"):
        fields = (table.text("field", required=True),)
        kind = "rate" if quantity == "yaw_rate" else "angle"
        unit = _unit(table, kind)
        frames = {
            **dict.fromkeys(("heading", "heading_d"), WORLD_FRAMES),
            "yaw_rate": (*BODY_FRAMES, *WORLD_FRAMES),
        }.get(quantity, BODY_FRAMES)
        frame = _frame(table, frames, quantity)
        sign, offset = _sign(table), table.number("offset", 0.0)
    elif quantity == "position":
        fields = table.texts("fields", 2, required=True)
        frame = _frame(table, (*WORLD_FRAMES, "geodetic"), quantity)
        unit = _unit(table, "angle" if frame == "geodetic" else "length")
        mount_m = _mount(table)
    elif quantity == "position_d":
        fields = table.texts("fields", 2, required=True)
        frame = _frame(table, WORLD_FRAMES, quantity)
        unit = _unit(table, "length")
    elif quantity == "tau_d":
        fields = table.texts("fields", 3, required=True)
        frame = _frame(table, BODY_FRAMES, quantity)
        unit = _unit(table, "force")
        options["moment_unit"] = _unit(table, "moment", "moment_unit", default="N*m")
    else:
        surge_alone = quantity == "velocity" and _has_one_field(table)
        fields = table.texts("fields", 1 if surge_alone else 2, required=True)
        frames = (*BODY_FRAMES, *WORLD_FRAMES) if quantity == "velocity" else WORLD_FRAMES
        frame = _frame(table, frames, quantity)
        unit = _unit(table, "speed")
        if quantity == "velocity":
            mount_m = _mount(table)
        if surge_alone:
            _check_surge(table, frame)
    required = table.flag("required", quantity not in _OPTIONAL)
    where = parse_where(table)
    table.close()
    return Signal(
        quantity=quantity,
        topic=topic,
        fields=fields,
        unit=unit,
        frame=frame,
        sign=sign,
        offset=offset,
        options=options,
        required=required,
        line=table.line(),
        mount_m=mount_m,
        where=where,
        scale=scale,
    )


def _has_one_field(table: TableReader) -> bool:
    fields = table.data.get("fields")
    return isinstance(fields, list) and len(fields) == 1


def _check_surge(table: TableReader, frame: str) -> None:
    """Note what a velocity of one field, surge alone, cannot be."""
    if frame in WORLD_FRAMES:
        table.fault(
            f'one field of a velocity is surge alone, which is measured along the hull, found frame "{frame}". '
            'Fix: give frame = "FRD" or "FLU", or both fields of the velocity over ground',
            "frame",
        )
    if table.data.get("required") is False:
        table.fault(
            "one field of a velocity is surge alone, and a model reduced to surge and yaw needs it, found required = false. "
            "Fix: leave out required, or leave out [signals.velocity] where position and heading give surge and sway",
            "required",
        )


def _wind_fields(table: TableReader, options: dict[str, str]) -> tuple[tuple[str, ...], str]:
    fields = (table.text("speed", required=True), table.text("direction", required=True))
    unit = _unit(table, "speed")
    options["direction_unit"] = _unit(table, "angle", "direction_unit")
    options["reference"] = table.text("reference", required=True, options=("bow", "north"))
    options["air"] = table.text("air", required=True, options=("apparent", "true"))
    return fields, unit


def _payload_fields(table: TableReader, options: dict[str, str]) -> tuple[tuple[str, ...], str]:
    """Take the field of the mass and, where it is measured, that of the payload's place along the vessel."""
    mass = table.text("mass", required=True)
    unit = _unit(table, "mass")
    if not table.has("x"):
        return (mass,), unit
    options["x_unit"] = _unit(table, "length", "x_unit", default="m")
    return (mass, table.text("x")), unit


def _actuator_signal(quantity: str, table: TableReader, actuators: dict[str, Actuator]) -> Signal | None:
    name, _, rest = quantity.partition(".")
    role = rest.removesuffix(".command")
    if name in actuators and not rest:
        table.fault(
            f'[signals.{name}] must say which signal of {name} it is. Fix: write [signals."{name}.speed"], '
            "with the quotes"
        )
        return None
    if name not in actuators and not rest:
        options = (*VESSEL_QUANTITIES, *(f"{actuator}.speed" for actuator in actuators))
        table.fault(
            f'unknown signal "{quantity}".{did_you_mean(quantity, options)} Fix: use one of '
            f"{', '.join(VESSEL_QUANTITIES)}, or <actuator>.<{'|'.join(ROLE_KINDS)}>"
        )
        return None
    if name not in actuators:
        table.fault(
            f'signal "{quantity}" is for an actuator "{name}" that the file does not list.'
            f'{did_you_mean(name, actuators)} Fix: add [[actuator]] with name = "{name}", or correct the name'
        )
        return None
    kind = actuators[name].kind
    usable = [option for roles in needed_roles(actuators[name]) for option in roles]
    if role not in usable:
        table.fault(
            f'"{role}" is no signal of {name}, which is of kind "{kind}".{did_you_mean(role, usable)} Fix: use one of '
            f'{", ".join(usable)}, each with ".command" for the order'
        )
        return None
    topic = table.text("topic", required=True)
    fields: tuple[str, ...] = (table.text("field", required=True),)
    full, pulse_us = 0.0, None
    if table.data.get("unit") in SHARES:
        unit = table.text("unit")
        full = _full(table, role)
        pulse_us = parse_pulses(table) if unit == "us" else None
    else:
        unit = _unit(table, ROLE_KINDS[role])
    sign, offset = _sign(table), 0.0 if pulse_us is not None else table.number("offset", 0.0)
    element = parse_element(table)
    if element is not None:
        fields = tuple(path if "[]" in path else f"{path}[]" for path in fields)
    required = table.flag("required", not quantity.endswith(".command"))
    time_constant_s, delay_s = (_response(table, quantity, key) for key in ("time_constant_s", "delay_s"))
    table.has("shared")
    where = parse_where(table)
    table.close()
    return Signal(
        quantity=quantity,
        topic=topic,
        fields=fields,
        unit=unit,
        sign=sign,
        offset=offset,
        required=required,
        line=table.line(),
        full=full,
        where=where,
        pulse_us=pulse_us,
        element=element,
        time_constant_s=time_constant_s,
        delay_s=delay_s,
    )


def _response(table: TableReader, quantity: str, key: str) -> float:
    """Take a time with which an actuator follows its order [s]; NaN where it is not stated."""
    if not table.has(key):
        return math.nan
    if not quantity.endswith(".command"):
        table.fault(
            f'"{key}" is of an order, and {quantity} is what was measured. '
            f'Fix: remove it, or write [signals."{quantity}.command"] where the signal is the order',
            key,
        )
        return math.nan
    return table.number(key, math.nan, at_least=0.0, at_most=LONGEST_RESPONSE_S)


def _full(table: TableReader, role: str) -> float:
    """Take what a share of one is: rpm, N, or an angle, returned in radians."""
    if role == "speed":
        return table.number("full_rpm", required=True, above=0.0, within=1e6, needs="the speed at full throttle")
    if role in ("force", "thrust"):
        return table.number("full_N", required=True, above=0.0, within=1e9, needs="the force at full throttle")
    return math.radians(
        table.number("full_deg", required=True, above=0.0, within=360.0, needs="the angle at full travel")
    )


def _unit(table: TableReader, kind: str, key: str = "unit", *, default: str = "") -> str:
    unit = table.text(key, default, required=not default)
    if unit and (fault := unit_fault(unit, kind)):
        table.fault(fault, key)
    return unit


def _frame(table: TableReader, frames: tuple[str, ...], quantity: str) -> str:
    frame = table.text("frame")
    meanings = {
        "NED": "x north, y east, heading clockwise from north",
        "ENU": "x east, y north, heading anticlockwise from east",
        "FRD": "x forward, y starboard, turning to starboard positive",
        "FLU": "x forward, y port, turning to port positive",
        "geodetic": "latitude, longitude",
    }
    usable = ", ".join(f'"{name}" ({meanings[name]})' for name in frames)
    if not frame:
        if "frame" not in table.data:
            table.fault(f'{table.title} lacks "frame", so its signs are not known. Fix: add frame = one of {usable}')
        return ""
    if frame not in frames:
        why = f'frame "{frame}" is not one that {quantity} can be in'
        if frame in BODY_FRAMES and quantity in ("heading", "position", "heading_d", "position_d"):
            why = f'{quantity} in the body frame "{frame}" is always zero: it is measured in the world'
        table.fault(f"{why}.{did_you_mean(frame, frames)} Fix: use one of {usable}", "frame")
        return ""
    return frame


def _sign(table: TableReader) -> float:
    sign = table.number("sign", 1.0)
    if abs(sign) != 1.0:
        table.fault(
            f'"sign" must be 1 or -1, found {sign:g}. Fix: a scale belongs into the unit, that of a velocity or yaw rate '
            'into "scale"',
            "sign",
        )
        return 1.0
    return sign


def _degrees_offset(table: TableReader) -> float:
    """Take the offset of a heading from a quaternion [deg]."""
    return table.number("offset_deg", 0.0, at_least=-360.0, at_most=360.0)


def _mount(table: TableReader) -> tuple[float, float]:
    place = table.numbers("mount_m", 2, within=1e3)
    return (place[0], place[1]) if place else (0.0, 0.0)


def _check_own_fields(table: TableReader, signal: Signal, read: dict[tuple[str, str, Chosen], Signal]) -> None:
    """Note a field that is read twice: lines that were copied and not changed.

    Two actuators may follow one signal where the file says so, and the commanded force may be the order of the only one.
    """
    if signal.quantity == "tau_d":
        return
    name, _, rest = signal.quantity.partition(".")
    may_share = bool(rest) and table.flag("shared", False)
    for place, path in enumerate(signal.fields):
        chosen = signal.where if signal.element is None else (*signal.where, signal.element)
        other = read.setdefault((signal.topic.strip("/"), path, chosen), signal)
        if not path or (other is signal and path not in signal.fields[:place]):
            continue
        other_name, _, other_rest = other.quantity.partition(".")
        alike = bool(rest) and _role(rest) == _role(other_rest) and name != other_name
        if may_share and alike:
            continue
        who = "it is named twice here" if other is signal else f"so is {other.quantity} on line {other.line}"
        table.fault(
            f'{signal.quantity} is read from the field "{path}" of {signal.topic}, and {who}. '
            "Fix: correct the topic or the field"
            + (f", or add shared = true here where {other_name} and {name} really have one signal" if alike else "")
        )
        return


def _role(rest: str) -> str:
    return rest.removesuffix(".command")


def _check_complete(
    reader: TableReader, signals: list[Signal], actuators: tuple[Actuator, ...], with_curve: frozenset[str]
) -> None:
    """Note what the map lacks as a whole, and frames that contradict each other."""
    mapped = {signal.quantity: signal for signal in signals}
    if "velocity" not in mapped and not {"position", "heading"} <= set(mapped):
        reader.fault(
            "no surge and sway velocity is available. Fix: map [signals.velocity], or both [signals.position] and "
            "[signals.heading]"
        )
    if "yaw_rate" not in mapped and "heading" not in mapped:
        reader.fault("no yaw rate is available. Fix: map [signals.yaw_rate] or [signals.heading]")
    velocity = mapped.get("velocity")
    if velocity is not None and velocity.frame in WORLD_FRAMES and "heading" not in mapped:
        reader.fault(
            f"velocity is in the world frame {velocity.frame}, and without a heading it cannot be turned into "
            'surge and sway. Fix: map [signals.heading], or give frame = "FRD" if it is in the body frame',
            "velocity",
        )
    position, wanted = mapped.get("position"), mapped.get("position_d")
    if wanted is not None and (position is None or position.frame == "geodetic"):
        reader.fault(
            "position_d is measured from an origin of its own"
            + (", and position from its first fix. " if position is not None else ", and there is no position. ")
            + "Fix: map [signals.position] in the same metres, or leave position_d out",
            "position_d",
        )
    wind = mapped.get("wind")
    if wind is not None and wind.options.get("reference") == "bow" and "heading" not in mapped:
        reader.fault(
            "the wind direction is relative to the bow, and without a heading it cannot be turned to north. "
            "Fix: map [signals.heading]",
            "wind",
        )
    rate = mapped.get("yaw_rate")
    if (
        velocity is not None
        and rate is not None
        and velocity.topic == rate.topic != "table"
        and velocity.frame in BODY_FRAMES
        and rate.frame in BODY_FRAMES
        and rate.frame != velocity.frame
    ):
        reader.fault(
            f"velocity is {velocity.frame} and yaw_rate {rate.frame} in the same message {rate.topic}: one "
            "message has one body frame. Fix: give both the same frame (and sign = -1 where the sender errs)",
            "yaw_rate",
        )
    for actuator in actuators:
        _check_actuator(reader, mapped, actuator, with_curve)


def _check_actuator(
    reader: TableReader, mapped: dict[str, Signal], actuator: Actuator, with_curve: frozenset[str]
) -> None:
    for roles in needed_roles(actuator):
        names = [f"{actuator.name}.{role}{order}" for role in roles for order in ("", ".command")]
        given = [name for name in names if name in mapped]
        if not given:
            reader.fault(
                f'{actuator.name} is of kind "{actuator.kind}" and has no {" or ".join(roles)} signal. '
                f'Fix: map [signals."{actuator.name}.{roles[0]}"], or its ".command" where there is no feedback'
            )
        by_speed = [name for name in given if f"{actuator.name}.speed" in name]
        if by_speed and actuator.thrust is None and actuator.name not in with_curve:
            reader.fault(
                f"{actuator.name} has a speed signal but no thrust curve. Fix: add thrust = {{ ... }} to the actuator",
                by_speed[0],
            )
        open_water = actuator.thrust is not None and actuator.thrust.kind == "open_water"
        if by_speed and open_water and "diameter_m" not in actuator.inflow:
            reader.fault(
                f'{actuator.name} has an open-water curve but no "diameter_m". Fix: add diameter_m = ...',
                by_speed[0],
            )
