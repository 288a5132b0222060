"""Simulated streams in the topics and fields of a vessel's own profile, so that the log is read as its recordings are."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace
from itertools import count
from keyword import iskeyword
from math import cos, pi, radians, sin, sqrt
from typing import Any

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.ingest.log import Series
from ferryid.ingest.row_columns import path_steps
from ferryid.simulate.sensors import Stream, quaternion
from ferryid.types import Floats, Nanoseconds
from ferryid.vessel.frames import WGS84_A_M, WGS84_E2, to_world, wrap, yaw_of_quaternion
from ferryid.vessel.load import load_profile
from ferryid.vessel.profile import Profile, Signal
from ferryid.vessel.pulses import pulse_of_share
from ferryid.vessel.signal_map import canonical_columns, convert
from ferryid.vessel.thrusters import thrust
from ferryid.vessel.units import factor

ODOMETRY = "/navigation/odometry"
ORIGIN_DEG = (63.44, 10.4)
"""Latitude and longitude of the origin of simulated positions, for vessels that measure these; in the Trondheimsfjord."""
SIMULATED = "milliampere"
"""A profile whose signals are those of the simulator."""
_HEADER = re.compile(r"\s*\[{1,2}\s*([A-Za-z_]+)[^\[\]]*\]{1,2}\s*(?:#.*)?")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_SAME = 1e-6
APART_NS = 100_000
"""Between messages of one topic that a device sends one after the other."""


class _CannotHold(Exception):
    """A signal that no message of a simulated log can hold; the text is why."""


@dataclass(frozen=True)
class _Written:
    """A signal as it is to be written: its stream in the simulator's own topics, and the values of its fields."""

    signal: Signal
    source: Stream
    values: Mapping[str, Floats]


def in_vessel_topics(streams: Sequence[Stream], profile: Profile) -> tuple[tuple[Stream, ...], tuple[str, ...]]:
    """Return the streams of a trial with the profile's topics in the place of the simulator's, and why that was not possible.

    What the profile reads of the simulator's own topics as it is meant stays as it is; so do topics that no signal takes the
    place of, as those of an IMU or a camera. Where messages cannot hold a signal of the profile, as a column of a table, all
    stay in the simulator's topics: see `matching_profile`.
    """
    own = {stream.topic: stream for stream in streams}
    by_topic: dict[str, list[Signal]] = {}
    for signal in profile.signals:
        by_topic.setdefault(_topic(signal.topic), []).append(signal)
    made: list[Stream] = []
    used: set[str] = set()
    kept: set[str] = set()
    faults: list[str] = []
    for topic, signals in by_topic.items():
        if topic in own and all(_reads(profile, one, own) for one in signals):
            kept.add(topic)
            continue
        there = [(one, source) for one in signals if (source := _source(one.quantity, own)) is not None]
        if not there:
            continue
        try:
            written = [
                _Written(one, source, _fields(one, _canonical(one, source, own, profile))) for one, source in there
            ]
            made.append(_stream(topic, written, {stream.type for stream in made}))
            used |= {source.topic for _, source in there}
        except _CannotHold as why:
            faults.append(f"{signals[0].topic}: {why}")
    if faults:
        return tuple(streams), tuple(faults)
    if made:
        # Feedback and orders that the vessel's own logs do not have.
        used |= {f"/{one.name}/{what}" for one in profile.actuators for what in ("state", "command")}
    replaced = {stream.topic for stream in made} | (used - kept)
    return (*made, *(stream for stream in streams if stream.topic not in replaced)), ()


def matching_profile(streams: Sequence[Stream], profile: Profile) -> str:
    """Return a vessel's profile, as TOML, that reads the simulator's own topics of a trial."""
    there = {stream.topic for stream in streams}
    kept: list[str] = []
    keep = True
    for line in profile.text.splitlines():
        if header := _HEADER.fullmatch(line):
            keep = header[1] not in ("signals", "table")
        if keep:
            kept.append(line)
    lines = ["\n".join(kept).rstrip(), ""]
    for signal in load_profile(SIMULATED).signals:
        if "." not in signal.quantity and signal.topic in there:
            lines += [_block(load_profile(SIMULATED).text, signal.quantity), ""]
    for actuator in profile.actuators:
        force = actuator.kind == "force"
        turn = {"azimuth": "angle", "propeller_rudder": "rudder"}.get(actuator.kind)
        roles = [("force" if force else "speed", "speed", "N" if force else "rpm")]
        roles += [(turn, "azimuth", "rad")] if turn else []
        for what, order in (("state", ""), ("command", ".command")):
            for role, field, unit in roles:
                lines += [
                    f'[signals."{actuator.name}.{role}{order}"]',
                    f'topic = "/{actuator.name}/{what}"',
                    f'field = "{field}"',
                    f'unit = "{unit}"',
                    "",
                ]
    return "\n".join(lines)


def _block(text: str, quantity: str) -> str:
    """Return the section of a signal."""
    lines = text.splitlines()
    start = next(k for k, line in enumerate(lines) if line.startswith(f"[signals.{quantity}]"))
    end = next((k for k in range(start + 1, len(lines)) if _HEADER.fullmatch(lines[k])), len(lines))
    return "\n".join(lines[start:end]).rstrip()


def _topic(name: str) -> str:
    return f"/{name.strip('/')}"


def _reads(profile: Profile, signal: Signal, own: Mapping[str, Stream]) -> bool:
    """Tell whether a signal of one of the simulator's topics is read from it as it is meant."""
    stream = own[_topic(signal.topic)]
    if not set(signal.fields) <= set(stream.columns) or signal.where or signal.element or _mounted(signal):
        return False
    if signal.quantity == "wind" and (signal.options.get("reference"), signal.options.get("air")) != (
        "bow",
        "apparent",
    ):
        return False
    series = Series(signal.topic, stream.receive_ns, stream.stamp_ns, dict(stream.columns))
    try:
        read = convert(replace(profile, signals=(signal,)), series)
        meant = _canonical(signal, stream, own, profile)
    except (FerryIdError, _CannotHold):
        return False
    angles = ("psi", "psi_d", "wind_from")
    for name in canonical_columns(signal):
        if name not in read or name not in meant:
            return False
        off = read[name] - meant[name]
        off = wrap(off) if name in angles or name.startswith("alpha") else off
        if not np.all(np.abs(off) <= _SAME * (1.0 + np.abs(meant[name]))):
            return False
    return True


def _mounted(signal: Signal) -> bool:
    return signal.quantity in ("position", "velocity") and any(signal.mount_m)


def _source(quantity: str, own: Mapping[str, Stream]) -> Stream | None:
    """Return the simulator's stream that holds a quantity; None where the trial does not have it."""
    name, _, role = quantity.partition(".")
    if role:
        return own.get(f"/{name}/{'command' if role.endswith('.command') else 'state'}")
    topics = {
        "wind": "/weather/wind",
        "current": "/weather/current",
        "payload": "/payload/waterline",
        "tau_d": "/control/tau_d",
        "position_d": "/control/reference",
        "heading_d": "/control/reference",
    }
    return own.get(topics.get(quantity, ODOMETRY))


def _canonical(signal: Signal, source: Stream, own: Mapping[str, Stream], profile: Profile) -> dict[str, Floats]:
    """Return the canonical columns of a signal from the simulator's stream, with heading and velocities where it needs them."""
    columns = {path: np.asarray(values, dtype=np.float64) for path, values in source.columns.items()}
    quantity = signal.quantity
    if source.topic == "/imu/data":
        if quantity not in ("heading", "yaw_rate"):
            raise _CannotHold(f"{quantity} is not what the simulated IMU measures")
        return {"psi": _yaw(columns, "orientation"), "r": columns["angular_velocity.z"]}
    if source.topic == ODOMETRY:
        return _motion(source)
    if source.topic == "/control/reference":
        return {
            "x_d": columns["pose.position.x"],
            "y_d": columns["pose.position.y"],
            "psi_d": _yaw(columns, "pose.orientation"),
        }
    if source.topic == "/control/tau_d":
        return dict(zip(("X_d", "Y_d", "N_d"), columns.values(), strict=True))
    if source.topic == "/weather/current":
        return {"current_N": columns["north"], "current_E": columns["east"]}
    if source.topic == "/payload/waterline":
        return {"payload_kg": columns["mass"], "payload_x": columns["x"]}
    if source.topic == "/weather/wind":
        return _wind(signal, columns, _motion(own[ODOMETRY]), own[ODOMETRY].stamp_ns, source.stamp_ns)
    return _actuator(signal, columns, profile)


def _motion(odometry: Stream) -> dict[str, Floats]:
    columns = odometry.columns
    x, y, z, w = (columns[f"pose.pose.orientation.{axis}"] for axis in "xyzw")
    return {
        "x": columns["pose.pose.position.x"],
        "y": columns["pose.pose.position.y"],
        "psi": yaw_of_quaternion(x, y, z, w),
        "phi": np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
        "theta": np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0)),
        "u": columns["twist.twist.linear.x"],
        "v": columns["twist.twist.linear.y"],
        "r": columns["twist.twist.angular.z"],
    }


def _yaw(columns: Mapping[str, Floats], path: str) -> Floats:
    x, y, z, w = (columns[f"{path}.{axis}"] for axis in "xyzw")
    return yaw_of_quaternion(x, y, z, w)


def _wind(
    signal: Signal, columns: Mapping[str, Floats], motion: Mapping[str, Floats], known: Nanoseconds, asked: Nanoseconds
) -> dict[str, Floats]:
    """Return the wind as a signal has it: apparent or true, from the bow or from north, or as a vector."""
    apparent = columns["speed"] * np.cos(columns["direction"]), columns["speed"] * np.sin(columns["direction"])
    u, v, psi = (np.interp(asked, known, values) for values in (motion["u"], motion["v"], np.unwrap(motion["psi"])))
    surge, sway = u - apparent[0], v - apparent[1]
    north, east = to_world(surge, sway, psi)
    ahead, aside = apparent if signal.options.get("air") == "apparent" else (-surge, -sway)
    turned = 0.0 if signal.options.get("reference") == "bow" else psi
    return {
        "wind_N": north,
        "wind_E": east,
        "wind_speed": np.hypot(ahead, aside),
        "wind_from": np.mod(np.arctan2(aside, ahead) + turned, 2.0 * pi),
    }


def _actuator(signal: Signal, columns: Mapping[str, Floats], profile: Profile) -> dict[str, Floats]:
    """Return what is known of an actuator, by the column of the signal."""
    name, _, role = signal.quantity.partition(".")
    role = role.removesuffix(".command")
    (column,) = canonical_columns(signal)
    actuator = next(one for one in profile.actuators if one.name == name)
    if role in ("angle", "rudder"):
        return {column: columns["azimuth"]}
    if role == "speed":
        return {column: columns["speed"]}
    if actuator.kind == "force":
        # The order of a force is a force, and so is what a simulated vessel reports.
        return {column: columns["speed"]}
    if role != "thrust" or actuator.thrust is None or actuator.thrust.kind == "open_water":
        raise _CannotHold(
            f"{signal.quantity} follows from more than the propeller's speed, which the simulator reports"
        )
    return {column: thrust(actuator.thrust, columns["speed"])[0]}


def _fields(signal: Signal, known: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return the values of a signal's fields: the inverse of what `ferryid.vessel.convert` and `resolve` do with them."""
    if signal.element is not None:
        raise _CannotHold(f"{signal.quantity} is in an array whose entries have names")
    return dict(zip(signal.fields, _values(signal, known), strict=True))


def _values(signal: Signal, known: Mapping[str, Floats]) -> list[Floats]:
    quantity, fields = signal.quantity, len(signal.fields)
    if quantity in ("position", "position_d"):
        return _position(signal, known)
    if quantity in ("heading", "heading_d"):
        return _heading(signal, known["psi" if quantity == "heading" else "psi_d"])
    if quantity == "velocity":
        forward, starboard = signal.mount_m
        body = known["u"] - known["r"] * starboard, known["v"] + known["r"] * forward
        scale = factor(signal.unit, "speed") * signal.scale
        vector = body if signal.frame in ("FRD", "FLU") else to_world(*body, known["psi"])
        return [value / scale for value in _turned(vector, signal.frame)[:fields]]
    if quantity == "yaw_rate":
        rate = -known["r"] if signal.frame in ("FLU", "ENU") else known["r"]
        return [_scalar(signal, rate, factor(signal.unit, "rate") * signal.scale)]
    if quantity in ("roll", "pitch"):
        angle = known["phi" if quantity == "roll" else "theta"]
        flipped = quantity == "pitch" and signal.frame == "FLU"
        return [_scalar(signal, -angle if flipped else angle, factor(signal.unit, "angle"))]
    if quantity == "wind" and not signal.frame:
        direction = _scalar(signal, known["wind_from"], factor(signal.options["direction_unit"], "angle"))
        return [known["wind_speed"] / factor(signal.unit, "speed"), direction]
    if quantity in ("wind", "current"):
        scale = factor(signal.unit, "speed") * signal.scale
        vector = known[f"{quantity}_N"], known[f"{quantity}_E"]
        return [value / scale for value in _turned(vector, signal.frame)]
    if quantity == "payload":
        mass = _scalar(signal, known["payload_kg"], factor(signal.unit, "mass"))
        return [mass, *(known["payload_x"] / factor(signal.options["x_unit"], "length") for _ in range(fields - 1))]
    if quantity == "tau_d":
        force, moment = factor(signal.unit, "force"), factor(signal.options["moment_unit"], "moment")
        flip = -1.0 if signal.frame == "FLU" else 1.0
        return [known["X_d"] / force, known["Y_d"] * flip / force, known["N_d"] * flip / moment]
    return [_order(signal, known[canonical_columns(signal)[0]])]


def _position(signal: Signal, known: Mapping[str, Floats]) -> list[Floats]:
    desired = signal.quantity == "position_d"
    north, east = (known["x_d"], known["y_d"]) if desired else (known["x"], known["y"])
    if not desired and any(signal.mount_m):
        forward, starboard = (np.full_like(north, value) for value in signal.mount_m)
        ahead, aside = to_world(forward, starboard, known["psi"])
        north, east = north + ahead, east + aside
    if signal.frame != "geodetic":
        return [value / factor(signal.unit, "length") for value in _turned((north, east), signal.frame)]
    latitude, longitude = (radians(value) for value in ORIGIN_DEG)
    squash = 1.0 - WGS84_E2 * sin(latitude) ** 2
    meridian_m, prime_vertical_m = WGS84_A_M * (1.0 - WGS84_E2) / squash**1.5, WGS84_A_M / sqrt(squash)
    unit = factor(signal.unit, "angle")
    return [
        (latitude + north / meridian_m) / unit,
        (longitude + east / (prime_vertical_m * cos(latitude))) / unit,
    ]


def _heading(signal: Signal, psi: Floats) -> list[Floats]:
    yaw = 0.5 * pi - psi if signal.frame == "ENU" else psi
    if signal.unit != "quaternion":
        return [_scalar(signal, wrap(yaw), factor(signal.unit, "angle"))]
    level = np.zeros_like(yaw)
    return list(quaternion(level, level, wrap(yaw - radians(signal.offset))))


def _order(signal: Signal, value: Floats) -> Floats:
    """Return what an order or a feedback of an actuator is written as."""
    role = signal.quantity.partition(".")[2].removesuffix(".command")
    if signal.pulse_us is not None:
        return pulse_of_share(np.clip(signal.sign * value / signal.full, -1.0, 1.0), signal.pulse_us)
    if signal.full:
        return _scalar(signal, value, factor(signal.unit, "fraction") * signal.full)
    kind = {"speed": "rotation", "angle": "angle", "rudder": "angle"}.get(role, "force")
    return _scalar(signal, value, factor(signal.unit, kind))


def _turned(vector: tuple[Floats, Floats], frame: str) -> list[Floats]:
    """Return a vector from NED or FRD in the order and signs of a frame."""
    first, second = vector
    return [second, first] if frame == "ENU" else [first, -second] if frame == "FLU" else [first, second]


def _scalar(signal: Signal, value: Floats, scale: float) -> Floats:
    return signal.sign * (value / scale - signal.offset)


def _stream(topic: str, written: Sequence[_Written], types: Set[str]) -> Stream:
    """Return the stream of a topic, of a type that is none of `types`.

    Where a field distinguishes its messages, there is one message for each of its values in turn.
    """
    groups: dict[tuple[tuple[str, float], ...], list[_Written]] = {}
    for one in written:
        groups.setdefault(one.signal.where, []).append(one)
    paths = [path for one in written for path in (*one.values, *(name for name, _ in one.signal.where))]
    names = (f"vessel_msgs/msg/{_type_name(topic)}{number or ''}" for number in count())
    kind = next(name for name in names if name not in types)
    sizes, definition = _definition(kind, list(dict.fromkeys(paths)))
    bases, parts = [], []
    for where, group in groups.items():
        base = max((one.source for one in group), key=lambda source: len(source.stamp_ns))
        part = {path: np.zeros(len(base.stamp_ns)) for path in dict.fromkeys(paths)}
        part.update({path: np.full(len(base.stamp_ns), value) for path, value in where})
        for one in group:
            part.update({path: _held(values, one.source, base) for path, values in one.values.items()})
        bases.append(base)
        parts.append(part)
    stamp_ns, receive_ns = (
        np.concatenate([getattr(base, name) + k * APART_NS for k, base in enumerate(bases)])
        for name in ("stamp_ns", "receive_ns")
    )
    order = np.argsort(receive_ns, kind="stable")
    columns = {path: np.concatenate([part[path] for part in parts])[order] for path in parts[0]}
    return Stream(
        topic,
        kind,
        bases[0].frame_id,
        stamp_ns[order],
        receive_ns[order],
        _arrays(columns, sizes),
        definition=definition,
    )


def _held(values: Floats, source: Stream, base: Stream) -> Floats:
    """Return values at the times of another stream: the last one that was known then."""
    if source is base:
        return values
    return np.asarray(values[np.maximum(np.searchsorted(source.stamp_ns, base.stamp_ns, side="right") - 1, 0)])


def _type_name(topic: str) -> str:
    name = "".join(part[:1].upper() + part[1:] for part in re.findall(r"[A-Za-z0-9]+", topic))
    return name if name[:1].isalpha() else f"Message{name}"


def _definition(kind: str, paths: Sequence[str]) -> tuple[dict[str, int], str]:
    """Return the lengths of the arrays among fields, and the definition of a message that has these fields."""
    sizes: dict[str, int] = {}
    types: dict[str, dict[str, str]] = {kind: {"header": "std_msgs/Header"}}
    for path in paths:
        steps = path_steps(path) or ()
        names = [step for step in steps if isinstance(step, str)]
        bad = next((name for name in names if not _NAME.fullmatch(name) or iskeyword(name)), None)
        if not names or bad is not None or names[0] == "header":
            raise _CannotHold(f'no message has a field "{path}", as a table has')
        if [type(step) for step in steps[len(names) :]] not in ([], [int]):
            raise _CannotHold(f"{path} is in an array of messages or arrays")
        holder = kind
        for name in names[:-1]:
            inner = f"{holder}{name[:1].upper()}{name[1:]}".replace("_", "")
            if types[holder].setdefault(name, inner) != inner:
                raise _CannotHold(f"{path} is in what is a number elsewhere")
            types.setdefault(inner, {})
            holder = inner
        array = ".".join(names)
        if len(steps) > len(names):
            sizes[array] = max(sizes.get(array, 0), int(steps[-1]) + 1)
            types[holder][names[-1]] = f"float64[{sizes[array]}]"
        else:
            types[holder][names[-1]] = "float64"
    parts = {name: "".join(f"{form} {field}\n" for field, form in fields.items()) for name, fields in types.items()}
    first, *others = parts.items()
    return sizes, first[1] + "".join(f"{'=' * 80}\nMSG: {name}\n{text}" for name, text in others)


def _arrays(columns: Mapping[str, Floats], sizes: Mapping[str, int]) -> dict[str, Any]:
    """Return columns with the elements of an array as one column of rows."""
    out: dict[str, Any] = {}
    for path, values in columns.items():
        array, _, index = path.partition("[")
        if array in sizes and index:
            rows = out.setdefault(array, np.zeros((len(values), sizes[array])))
            rows[:, int(index[:-1])] = values
        else:
            out[path] = values
    return out
