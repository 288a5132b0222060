"""Finding a profile's signals in a log, and turning their fields into canonical columns in SI units.

Canonical columns: ``x, y`` [m, NED]; ``psi`` [rad]; ``phi, theta`` [rad]; ``u, v`` [m/s, FRD, over ground];
``r`` [rad/s]; ``vel_N, vel_E`` [m/s]; ``wind_speed`` [m/s], ``wind_from`` [rad, clockwise]; ``wind_N, wind_E`` [m/s,
where the air goes to]; ``current_N, current_E`` [m/s, where the water goes to]; ``payload_kg`` [kg] and ``payload_x`` [m,
forward of the body origin]; for an actuator NAME ``n_NAME`` [rpm],
``alpha_NAME`` [rad], ``delta_NAME`` [rad], ``F_NAME`` [N]; orders with ``_cmd`` after the prefix (``n_cmd_NAME``);
``X_d, Y_d`` [N], ``N_d`` [N·m]; the desired pose ``x_d, y_d`` [m, NED] and ``psi_d`` [rad].
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ferryid.counts import counted, verb
from ferryid.errors import FerryIdError, did_you_mean, ended
from ferryid.ingest.log import Loss, Series, Topic
from ferryid.types import Floats
from ferryid.vessel.elements import TEXT_TYPES, array_fault, element_fields, has_element, picked
from ferryid.vessel.field_words import nearest_field
from ferryid.vessel.frames import heading_from_enu, local_north_east, yaw_of_quaternion
from ferryid.vessel.profile import Profile, Signal
from ferryid.vessel.pulses import share_of_pulse
from ferryid.vessel.thrusters import ROLE_PREFIX, needed_roles, order_note
from ferryid.vessel.units import factor

_SIMPLE = {
    "position": ("x", "y"),
    "heading": ("psi",),
    "yaw_rate": ("r",),
    "roll": ("phi",),
    "pitch": ("theta",),
    "current": ("current_N", "current_E"),
    "tau_d": ("X_d", "Y_d", "N_d"),
    "position_d": ("x_d", "y_d"),
    "heading_d": ("psi_d",),
}
_ROLE_KIND = {"speed": "rotation", "angle": "angle", "rudder": "angle", "force": "force", "thrust": "force"}

_NEAR_TURN = 0.1
"""A step is a full turn to within this share of one."""


@dataclass(frozen=True)
class Selection:
    """Which of a profile's signals a log holds.

    Attributes
    ----------
    wanted
        Topic name, as the log writes it, to the field paths to decode.
    found
        Canonical column to ``"topic: field"``.
    missing
        Quantity to the reason why the log does not give it.
    notes
        Sentences on what stands in for what.
    """

    wanted: dict[str, tuple[str, ...]]
    found: dict[str, str]
    missing: dict[str, str]
    notes: tuple[str, ...] = field(default=())


def canonical_columns(signal: Signal) -> tuple[str, ...]:
    """Return the names of the columns that `convert` makes of a signal."""
    if signal.quantity == "velocity":
        return ("u", "v")[: len(signal.fields)] if signal.frame in ("FRD", "FLU") else ("vel_N", "vel_E")
    if signal.quantity == "wind":
        return ("wind_N", "wind_E") if signal.frame else ("wind_speed", "wind_from")
    if signal.quantity == "payload":
        return ("payload_kg", "payload_x")[: len(signal.fields)]
    if signal.quantity in _SIMPLE:
        return _SIMPLE[signal.quantity]
    name, _, rest = signal.quantity.partition(".")
    prefix = ROLE_PREFIX[rest.removesuffix(".command")]
    return (f"{prefix}_cmd_{name}" if rest.endswith(".command") else f"{prefix}_{name}",)


def survey(profile: Profile, topics: Sequence[Topic], losses: Sequence[Loss] = ()) -> Selection:
    """Look for every signal of the profile in the topics of a log; nothing is raised for one that is missing.

    `losses` say why a topic is not there, where its file could not be read.
    """
    wanted: dict[str, list[str]] = {}
    found: dict[str, str] = {}
    missing: dict[str, str] = {}
    for signal in profile.signals:
        topic = _topic(signal.topic, topics)
        reason = _fault(signal, topic, topics, losses)
        if topic is None or reason:
            missing[signal.quantity] = reason
            continue
        paths = wanted.setdefault(topic.name, [])
        paths.extend(path for path in _read_fields(signal, topic) if path not in paths)
        columns = canonical_columns(signal)
        shown = _in_column_order(signal) if len(columns) == len(signal.fields) else (", ".join(signal.fields),)
        chosen = "" if signal.element is None else f" of {signal.element[1]}"
        found.update({column: f"{topic.name}: {path}{chosen}" for column, path in zip(columns, shown, strict=True)})
    notes = tuple(order_note(profile, name, role) for name, role in _orders_instead(profile, missing))
    return Selection({name: tuple(paths) for name, paths in wanted.items()}, found, missing, notes)


def lacking_signals(profile: Profile, selection: Selection) -> list[Signal]:
    """Return the signals without which a log cannot be used; feedback may be missing where the order is there."""
    lacking = [
        signal
        for signal in profile.signals
        if signal.required
        and signal.quantity in selection.missing
        and not _has_stand_in(profile, signal.quantity, selection.missing)
    ]
    lacking += [
        signal
        for signal in profile.signals
        if signal.quantity in selection.missing
        and signal not in lacking
        and _leaves_actuator_dark(profile, signal.quantity, selection.missing)
    ]
    return lacking


def select(profile: Profile, topics: Sequence[Topic], where: str, losses: Sequence[Loss] = ()) -> Selection:
    """Find the profile's signals in a log.

    Parameters
    ----------
    profile
        Vessel profile.
    topics
        Topics of the log.
    where
        The log's name for messages.
    losses
        What could not be read of the log.

    Raises
    ------
    FerryIdError
        For a required signal that the log does not have. Feedback may be missing where the order is there.
    """
    selection = survey(profile, topics, losses)
    lacking = lacking_signals(profile, selection)
    if lacking:
        signal = lacking[0]
        others = len(lacking) - 1
        more = f" ({counted(others, 'more required signal')} {verb(others, 'is')} missing)" if others else ""
        unread = _unread(signal, losses) if _topic(signal.topic, topics) is None else None
        if unread is not None:
            what, _, remedy = unread.what.partition(" Fix: ")
            raise FerryIdError(
                f"{unread.file}: {signal.quantity} is needed by the profile {profile.name}, and its file cannot be used: "
                f"{what.rstrip('.')}{more}. Fix: {remedy or 'copy it from the recorder again'}"
            )
        reason = selection.missing[signal.quantity].removesuffix(".")
        if _topic(signal.topic, topics) is None:
            there = _some([topic.name for topic in topics]) or "no topic"
            reason = f"{ended(reason)} The log has {there}"
        if not profile.path.endswith(".toml"):
            # Of a model that brings its profile along: nobody can go to a line of it.
            raise FerryIdError(
                f"{where}: {signal.quantity} is needed by the profile {profile.name} that is stored in the model "
                f"{profile.path}, {ended(f'{reason}{more}')} Fix: give a log of {profile.name}, or, where the topics of that "
                "vessel have changed, its profile with --vessel"
            )
        raise FerryIdError(
            f"{where}: {signal.quantity} is needed by the profile {profile.name} ({profile.path}:{signal.line}), "
            f"{ended(f'{reason}{more}')} Fix: correct the signal map, or set "
            "required = false where the signal can be missed"
        )
    return selection


def stream_name(topic: str, where: tuple[tuple[str, float], ...]) -> str:
    """Return the name of the messages of a topic that hold a signal: the topic's, with what they are chosen by."""
    chosen = " and ".join(f"{path} = {value:g}" for path, value in where)
    return f"{topic} where {chosen}" if chosen else topic


def is_in(signal: Signal, stream: str) -> bool:
    """Tell whether a signal is in the messages of that name."""
    return _bare(stream_name(signal.topic, signal.where)) == _bare(stream)


def _read_fields(signal: Signal, topic: Topic) -> tuple[str, ...]:
    fields = signal.fields if signal.element is None else element_fields(signal, topic)
    return (*fields, *(path for path, _ in signal.where))


def convert(profile: Profile, series: Series, where: tuple[tuple[str, float], ...] = ()) -> dict[str, Floats]:
    """Turn the fields of one topic into canonical columns in SI units; frames that need another signal come later.

    Parameters
    ----------
    profile
        Vessel profile.
    series
        Decoded fields of one topic, n messages; with `where` those that hold such signals alone.
    where
        What the messages are chosen by: signals with another choice are left out.

    Returns
    -------
    dict
        Canonical column to values, shape (n,), new arrays.

    Raises
    ------
    FerryIdError
        For a field that is not numeric, latitudes beyond ±90°, and an angle that wraps at the full turn of another unit.
    """
    columns: dict[str, Floats] = {}
    for signal in profile.signals:
        if _bare(signal.topic) != _bare(series.topic) or signal.where != where:
            continue
        own = series
        if signal.element is not None and has_element(signal, series.columns):
            own = picked(signal, signal.element, series)
        if not set(signal.fields) <= set(own.columns):
            continue
        values = [_numeric(own, path, signal) for path in signal.fields]
        _check_turns(profile, signal, values)
        columns.update(zip(canonical_columns(signal), _convert(signal, values, series.topic), strict=True))
    return columns


def _convert(signal: Signal, values: list[Floats], topic: str) -> list[Floats]:
    quantity = signal.quantity
    if quantity in ("position", "position_d"):
        return _position(signal, values, topic)
    if quantity in ("velocity", "current") or (quantity == "wind" and signal.frame):
        scale = factor(signal.unit, "speed") * signal.scale
        return _turned([value * scale for value in values], signal.frame)
    if quantity in ("heading", "heading_d"):
        return [_heading(signal, values)]
    if quantity == "wind":
        direction = _scalar(signal, values[1], factor(signal.options["direction_unit"], "angle"))
        return [values[0] * factor(signal.unit, "speed"), direction]
    if quantity == "payload":
        mass = _scalar(signal, values[0], factor(signal.unit, "mass"))
        return [mass, *(place * factor(signal.options["x_unit"], "length") for place in values[1:])]
    if quantity == "tau_d":
        force = factor(signal.unit, "force")
        moment = factor(signal.options["moment_unit"], "moment")
        flip = -1.0 if signal.frame == "FLU" else 1.0
        return [values[0] * force, values[1] * (force * flip), values[2] * (moment * flip)]
    if quantity == "yaw_rate":
        rate = _scalar(signal, values[0], factor(signal.unit, "rate") * signal.scale)
        return [-rate if signal.frame in ("FLU", "ENU") else rate]
    if quantity in ("roll", "pitch"):
        angle = _scalar(signal, values[0], factor(signal.unit, "angle"))
        return [-angle if quantity == "pitch" and signal.frame == "FLU" else angle]
    role = quantity.partition(".")[2].removesuffix(".command")
    if signal.pulse_us is not None:
        return [signal.sign * signal.full * share_of_pulse(values[0], signal.pulse_us)]
    if signal.full:
        return [_scalar(signal, values[0], factor(signal.unit, "fraction") * signal.full)]
    return [_scalar(signal, values[0], factor(signal.unit, _ROLE_KIND[role]))]


def _check_turns(profile: Profile, signal: Signal, values: list[Floats]) -> None:
    """Refuse an angle that jumps from end to end of its range by the full turn of the unit that it is not declared in."""
    if signal.quantity == "wind" and not signal.frame:
        unit, path, angle = signal.options["direction_unit"], signal.fields[1], values[1]
    elif signal.quantity in ("heading", "heading_d") or signal.quantity.removesuffix(".command").endswith(".angle"):
        unit, path, angle = signal.unit, signal.fields[0], values[0]
    else:
        return
    other = {"deg": "rad", "rad": "deg"}.get(unit, "")
    known = angle[np.isfinite(angle)]
    if not other or known.size < 3:
        return
    turn = 2.0 * math.pi / factor(other, "angle")
    step = np.abs(np.diff(known))
    jump = np.abs(step / turn - 1.0) < _NEAR_TURN
    jumps, moving = int(np.count_nonzero(jump)), step[step > 0.0]
    # Small steps but for the jumps: what swings between two angles a full turn of radians apart is in degrees.
    if jumps < 2 or np.ptp(known) > 1.001 * turn or np.quantile(moving, 0.5) > _NEAR_TURN * turn:
        return
    # At a full turn the motion goes on as it was, but for the turn.
    if np.median(np.abs(step[jump] - turn)) > np.quantile(step[~jump], 0.99):
        return
    raise FerryIdError(
        f"{profile.path}:{signal.line}: {signal.quantity} is declared in {unit}, found a field {path} in {signal.topic} that "
        f"stays within {turn:.4g} and jumps by as much {counted(jumps, 'time')}, as {other} do at a full "
        "turn. Fix: correct the unit"
    )


def _in_column_order(signal: Signal) -> tuple[str, ...]:
    """Return the fields of a signal in the order of the columns that `convert` makes of them, one each."""
    turned = signal.frame == "ENU" and len(signal.fields) == 2
    return signal.fields[::-1] if turned else signal.fields


def _scalar(signal: Signal, values: Floats, scale: float) -> Floats:
    return (signal.sign * values + signal.offset) * scale


def _turned(values: list[Floats], frame: str) -> list[Floats]:
    """Return a vector in NED or FRD order and signs; of a velocity, surge may stand alone."""
    if frame == "ENU":
        return [values[1], values[0]]
    if frame == "FLU":
        return [values[0], *(-value for value in values[1:])]
    return values


def _position(signal: Signal, values: list[Floats], topic: str) -> list[Floats]:
    if signal.frame != "geodetic":
        return _turned([value * factor(signal.unit, "length") for value in values], signal.frame)
    latitude, longitude = (value * factor(signal.unit, "angle") for value in values)
    beyond = np.abs(latitude) > 0.5 * math.pi
    if np.any(beyond):
        raise FerryIdError(
            f"{topic}: position needs a latitude within ±90 deg, found "
            f"{math.degrees(float(latitude[np.argmax(beyond)])):g} deg in {signal.fields[0]}. Fix: give the "
            "latitude first in fields, and its unit"
        )
    return list(local_north_east(latitude, longitude))


def _heading(signal: Signal, values: list[Floats]) -> Floats:
    if signal.unit == "quaternion":
        yaw = yaw_of_quaternion(*values) + math.radians(signal.offset)
    else:
        yaw = _scalar(signal, values[0], factor(signal.unit, "angle"))
    return heading_from_enu(yaw) if signal.frame == "ENU" else yaw


def _numeric(series: Series, path: str, signal: Signal) -> Floats:
    column = np.asarray(series.columns[path])
    if column.dtype.kind not in "fiub":
        sample = str(column[0]) if column.size else ""
        raise FerryIdError(
            f"{series.topic}: {signal.quantity} needs numbers, found text in {path} ({sample[:40]!r}). "
            f"Fix: name a numeric field on line {signal.line} of the vessel profile"
        )
    # A float32 signalling NaN, as firmware writes for "no value", sets the flag that NumPy would warn of.
    with np.errstate(invalid="ignore"):
        return np.asarray(column, dtype=np.float64)


def _bare(topic: str) -> str:
    return topic.strip("/")


def _topic(name: str, topics: Sequence[Topic]) -> Topic | None:
    for topic in topics:
        if topic.name == name:
            return topic
    for topic in topics:
        if _bare(topic.name) == _bare(name):
            return topic
    return None


def _unread(signal: Signal, losses: Sequence[Loss]) -> Loss | None:
    """Return the loss of a signal's whole topic."""
    return next((loss for loss in losses if loss.topic and _bare(loss.topic) == _bare(signal.topic)), None)


def _fault(signal: Signal, topic: Topic | None, topics: Sequence[Topic], losses: Sequence[Loss]) -> str:
    """Say why a signal cannot be read, or return an empty string."""
    if topic is None and (unread := _unread(signal, losses)) is not None:
        what = unread.what.partition(" Fix: ")[0].rstrip(".")
        return f"its file {unread.file.rpartition('/')[2]} cannot be used: {what}."
    if topic is None:
        hint = did_you_mean(signal.topic, [candidate.name for candidate in topics])
        return f'found no topic "{signal.topic}".{hint}'
    if topic.count == 0:
        return f"found {topic.name} without a single message"
    if signal.element is not None and (fault := array_fault(signal, topic)):
        return fault
    for path in (*(signal.fields if signal.element is None else ()), *(one for one, _ in signal.where)):
        kind = _field_type(path, topic)
        if kind is None:
            return (
                f'found no field "{path}" in {topic.name} (it has {_some(list(topic.fields)) or "no readable definition"}).'
                f"{nearest_field(path, topic.fields)}"
            )
        if kind in TEXT_TYPES:
            return f'found text ("{kind}") in the field {path} of {topic.name}, where a number is needed'
    return ""


def _some(names: Sequence[str]) -> str:
    """Return the first six names."""
    return ", ".join(names[:6]) + (", ..." if len(names) > 6 else "")


def _field_type(path: str, topic: Topic) -> str | None:
    """Return the type of a field, an element of an array included, or None where the topic has no such field."""
    fields = topic.fields
    # "name[3]" is listed for an array of three and asked for as its fourth element, but where elements are listed.
    if topic.lists_elements or not path.endswith("]"):
        return fields.get(path)
    if "[" in path:
        name, _, index = path[:-1].rpartition("[")
        if not index.isdigit():
            return None
        if f"{name}[]" in fields:
            return fields[f"{name}[]"]
        for known, kind in fields.items():
            if known.startswith(f"{name}[") and known[len(name) + 1 : -1].isdigit():
                return kind if int(index) < int(known[len(name) + 1 : -1]) else None
    return None


def _alternatives(profile: Profile, quantity: str) -> tuple[str, ...]:
    """Return every mapped quantity that gives what `quantity` gives, or nothing for one of the vessel's own."""
    name, _, rest = quantity.partition(".")
    mapped = {signal.quantity for signal in profile.signals}
    for actuator in profile.actuators:
        if actuator.name != name:
            continue
        for roles in needed_roles(actuator):
            if rest.removesuffix(".command") in roles:
                names = (f"{name}.{role}{order}" for role in roles for order in ("", ".command"))
                return tuple(known for known in names if known in mapped)
    return ()


def _has_stand_in(profile: Profile, quantity: str, missing: Mapping[str, str]) -> bool:
    return any(other not in missing for other in _alternatives(profile, quantity))


def _leaves_actuator_dark(profile: Profile, quantity: str, missing: Mapping[str, str]) -> bool:
    others = _alternatives(profile, quantity)
    return bool(others) and all(other in missing for other in others)


def _orders_instead(profile: Profile, missing: Mapping[str, str]) -> list[tuple[str, str]]:
    instead = []
    for actuator in profile.actuators:
        for roles in needed_roles(actuator):
            mapped = _alternatives(profile, f"{actuator.name}.{roles[0]}")
            here = [name for name in mapped if name not in missing]
            if here and all(name.endswith(".command") for name in here):
                role = here[0].partition(".")[2].removesuffix(".command")
                instead.append((actuator.name, role))
    return instead
