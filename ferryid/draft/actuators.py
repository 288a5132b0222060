"""Kinds, roles, units and signs of actuators, by names and by what the vessel does when they act."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ferryid.draft.actuator_fields import ActuatorField
from ferryid.draft.autopilot_parameters import NOT_STATED, OutputSetting, Placement
from ferryid.draft.guessed_orders import WHETHER
from ferryid.draft.mapped import MappedSignal, Motion
from ferryid.draft.samples import Samples
from ferryid.draft.thresholds import DRAFT
from ferryid.types import Floats
from ferryid.vessel.field_words import unit_of_name, words_of
from ferryid.vessel.pulses import share_of_pulse

USUAL_PULSES_US = (1100.0, 1500.0, 1900.0, 0.0)
"""Pulses of full astern, neutral and full ahead, and the dead band, where none are stated [us]."""
UNKNOWN_ORDER = "whether it is an order or was measured: an order has .command behind its name"
"""Doubt of a signal whose name does not state it."""
_LAGS_S = (0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0)
"""Delays at which a motion is compared with an actuator [s]."""
_AT_ONCE_S = (0.0, 0.2, 0.5)
"""Delays at which an acceleration is compared with an actuator [s]."""


@dataclass(frozen=True)
class DraftedActuator:
    """An actuator: its name, its kind as of `ferryid.vessel.profile.Actuator`, its signals, and what is stated of it."""

    name: str
    kind: str
    signals: tuple[MappedSignal, ...]
    placement: Placement = NOT_STATED


def drafted_actuators(
    fields: Sequence[ActuatorField], samples: Samples, motion: Motion, placements: Mapping[str, Placement] | None = None
) -> list[DraftedActuator]:
    """Return the actuators of a log with their signals; `placements` is what parameters state of them, by name."""
    fields = [one for one in fields if (one.stream, one.path) in samples.columns]
    names = list(dict.fromkeys(one.actuator for one in fields))
    chosen = {name: _chosen([one for one in fields if one.actuator == name]) for name in names}
    chosen = {name: roles for name, roles in chosen.items() if roles}
    kinds = {name: _kind(name, roles) for name, roles in chosen.items()}
    turning = _azimuth_sign(chosen, kinds, samples, motion)
    found = []
    for name, roles in chosen.items():
        signals = []
        for (role, order), field in roles.items():
            measured = field.order is None and (role, True) in roles
            signal = _signal(name, kinds[name], role, order, field, samples, measured=measured)
            if role == "angle":
                signal = _signed(signal, _as_stated(field, turning))
            elif role == "rudder":
                signal = _signed(signal, _as_stated(field, _rudder_sign(field, samples, motion)))
            elif role == "force" and kinds[name] == "force":
                signal = _signed(signal, _pair_doubt(name, "force", chosen, samples, motion))
            elif role == "duty" and field.setting is not None and field.setting.pushes_ahead:
                signal = _signed(signal, _ahead_sign(field, samples, motion))
                _, evidence, doubt = _pair_doubt(name, "duty", chosen, samples, motion)
                signal = _signed(signal, (signal.sign, evidence, doubt))
            elif field.setting is not None:
                signal = replace(signal, sign=field.setting.sign)
            signals.append(signal)
        placement = (placements or {}).get(name, NOT_STATED)
        # What has an angle or a rudder does not push to one side alone.
        kind = placement.kind if placement.kind and kinds[name] == "propeller" else kinds[name]
        found.append(DraftedActuator(name, kind, tuple(signals), placement))
    return found


def _as_stated(field: ActuatorField, seen: _Sign) -> _Sign:
    """Return the sign that the motion shows, or else the one that parameters state; a doubt where they disagree."""
    setting = field.setting
    if setting is None or not setting.in_pulses:
        return seen
    value, evidence, doubt = seen
    if not evidence:
        return setting.sign, "", f"{doubt.partition(':')[0]}: it is that of {setting.sign_by}"
    if value != setting.sign:
        return value, evidence, f"{setting.sign_by} states the other sign: the motion decides"
    return value, evidence, ""


def _ahead_sign(field: ActuatorField, samples: Samples, motion: Motion) -> _Sign:
    """Return the stated sign of what pushes ahead, and a doubt where the vessel goes astern when it does."""
    setting = field.setting
    if setting is None:
        return 1.0, "", ""
    seen = setting.sign * _response(_on_grid(field, samples), motion.u, _step(samples))
    if seen <= -DRAFT.acts:
        doubt = f"{setting.sign_by}, but the vessel goes slower ahead when it pushes ahead (correlation {seen:.2f})"
        return setting.sign, "", f"{doubt}: the sign may be the other one, or the velocity's"
    return setting.sign, "", ""


_Roles = dict[tuple[str, bool], ActuatorField]
_Sign = tuple[float, str, str]
"""Sign, evidence and doubt."""


def _chosen(fields: Sequence[ActuatorField]) -> _Roles:
    """Return one field for every role, feedback and order; a duty only where nothing else shows how hard it pushes."""
    found: _Roles = {}
    for field in fields:
        order = field.order is True
        found.setdefault((field.role, order), field)
    strong = any(role in ("speed", "force") for role, _ in found)
    return {key: field for key, field in found.items() if not (key[0] == "duty" and strong)}


def _kind(name: str, roles: _Roles) -> str:
    kinds = {role for role, _ in roles}
    if "rudder" in kinds:
        return "propeller_rudder"
    if "angle" in kinds:
        return "azimuth"
    if "tunnel" in name:
        return "tunnel"
    return "force" if kinds == {"force"} else "propeller"


def _signal(
    name: str, kind: str, role: str, order: bool, field: ActuatorField, samples: Samples, *, measured: bool = False
) -> MappedSignal:
    """Return the signal of a field; `measured` where its name does not state it, but another field is the order."""
    quantity = {"duty": "speed", "force": "force" if kind == "force" else "thrust"}.get(role, role)
    values = samples.raw(field.stream, field.path)
    values = values[np.isfinite(values)]
    largest = float(np.quantile(np.abs(values), 0.99)) if values.size else 0.0
    is_output = re.fullmatch(r"output[0-9]+", name) is not None
    # An output that is off has pulses of zero.
    on = values[values != 0.0] if role == "duty" else values
    low = float(np.quantile(on, 0.01)) if on.size else 0.0
    unit, why, doubt = _unit(role, field, largest, low)
    stated = field.setting or OutputSetting()
    shown = (
        "an order, by its name"
        if order and field.assumed != WHETHER
        else "feedback, by its name"
        if field.order is False
        else ""
    )
    if measured:
        shown = "feedback, as another field of the actuator is the order"
    evidence = (*filter(None, [shown]), *stated.evidence, why if stated.in_pulses else f"in {unit}: {why}")
    return MappedSignal(
        f"{name}.{quantity}{'.command' if order else ''}",
        field.topic,
        (field.path,),
        unit,
        where=field.where,
        evidence=evidence,
        doubts=tuple(
            filter(
                None,
                [
                    field.assumed,
                    doubt,
                    f"it never changes in this log: it is always {values[0]:.4g}"
                    if values.size and not np.ptp(values)
                    else "",
                    *stated.doubts,
                    "" if field.order is not None or measured else UNKNOWN_ORDER,
                    "what this output of the autopilot drives: a thruster, or a rudder, which is an actuator of kind "
                    '"propeller_rudder" with NAME.rudder.command'
                    if is_output
                    else "",
                ],
            )
        ),
        pulse_us=stated.pulse_us,
        full_deg=stated.full_deg,
    )


def _share(least: float, largest: float, shown: str) -> tuple[str, str, str]:
    """Return unit, why, and what to check of a share of full power or travel, by its least and its largest values."""
    if DRAFT.least_pulse_us <= least and largest <= DRAFT.most_pulse_us:
        return "us", shown, "pulses of full astern, neutral and full ahead, and the dead band, are usual ones"
    if largest <= 1.0:
        return "fraction", shown, ""
    if largest > DRAFT.most_percent:
        return "%", shown, "counts of a motor driver, as they go beyond 100: full_rpm is the speed at a count of 100"
    return "%", shown, "a share of full power, or a pulse width: offset and full_rpm turn it into a speed"


def _unit(role: str, field: ActuatorField, largest: float, least: float = 0.0) -> tuple[str, str, str]:
    """Return unit, why, and what to check."""
    if field.setting is not None and field.setting.in_pulses:
        return "us", "pulses, as all outputs of ArduPilot are", ""
    kind = {"angle": "angle", "rudder": "angle", "force": "force", "speed": "rotation", "duty": "fraction"}[role]
    # In messages a number in brackets is the place in an array.
    stated = "" if re.search(r"\[[0-9]+\]$", field.path) else unit_of_name(field.path, kind)
    words = {*words_of(field.path), *words_of(field.topic)}
    shown = f"99 % of the values lie within {largest:.4g}"
    if stated:
        return stated, "in its name", ""
    if kind == "angle" and field.path.startswith("control["):
        return "fraction", f"{shown}, of full travel as PX4 orders it", "full_deg is the angle at full travel"
    if kind == "angle":
        if DRAFT.least_pulse_us <= least and largest <= DRAFT.most_pulse_us:
            doubt = "pulses of full port, neutral and full starboard, and the dead band, are usual ones"
            return "us", shown, f"{doubt}; full_deg is the angle at full travel"
        if largest > DRAFT.most_rad:
            return "deg", f"{shown}, more than a turn in radians", ""
        return "rad", shown, "" if "rad" in words else "degrees are possible where it never turns far"
    if kind == "force":
        return "N", shown, "the unit is assumed"
    if kind == "fraction":
        return _share(least, largest, shown)
    named = next((unit for unit in ("rpm", "rps") if unit in words), "")
    if named:
        return named, "in its name", ""
    if largest > DRAFT.most_rps:
        return "rpm", shown, "" if "motor" in words or largest > 2.0 * DRAFT.most_rps else "a percentage is possible"
    return "rps", f"{shown}, too slow for rpm", "the unit is assumed"


def _signed(signal: MappedSignal, sign: _Sign) -> MappedSignal:
    value, evidence, doubt = sign
    return replace(
        signal,
        sign=value,
        evidence=(*signal.evidence, *filter(None, [evidence])),
        doubts=(*signal.doubts, *filter(None, [doubt])),
    )


def _on_grid(field: ActuatorField, samples: Samples) -> Floats:
    """Return a field on the grid; an output whose pulses are stated as a share of full power, or as an angle [rad]."""
    values, setting = samples.raw(field.stream, field.path), field.setting
    if setting is not None and setting.pulse_us is not None:
        values = (np.radians(setting.full_deg) or 1.0) * share_of_pulse(values, setting.pulse_us)
    elif setting is not None and setting.in_pulses:
        values = share_of_pulse(values, USUAL_PULSES_US)
    return samples.on_grid(field.stream, values, held=True)


def _response(cause: Floats, effect: Floats, step_s: float) -> float:
    """Return the correlation of a motion with what causes it, at the delay where it is strongest."""
    best = 0.0
    for lag_s in _LAGS_S:
        rows = round(lag_s / step_s)
        if rows >= cause.size:
            break
        early, late = cause[: cause.size - rows], effect[rows:]
        known = np.isfinite(early + late)
        if np.count_nonzero(known) < DRAFT.fewest_rows or np.ptp(early[known]) == 0.0:
            continue
        value = float(np.corrcoef(early[known], late[known])[0, 1]) if np.ptp(late[known]) > 0.0 else 0.0
        best = value if abs(value) > abs(best) else best
    return best


def _turns(cause: Floats, rate: Floats, step_s: float) -> float:
    """Return the correlation of yaw acceleration with what causes it, less what the yaw rate explains of both.

    A controller that ends a turn pushes against the yaw rate, so that their correlation alone shows the controller, not the
    vessel; the acceleration shows the push, and at once.
    """
    best = 0.0
    for lag_s in _AT_ONCE_S:
        rows = round(lag_s / step_s)
        if rows >= cause.size:
            break
        early, damping = cause[: cause.size - rows], rate[rows:]
        late = np.asarray(np.gradient(rate, step_s))[rows:]
        known = np.isfinite(early + late + damping)
        if np.count_nonzero(known) < DRAFT.fewest_rows or np.ptp(early[known]) == 0.0:
            continue
        explained = np.column_stack([np.ones(np.count_nonzero(known)), damping[known]])
        a, b = (one - explained @ np.linalg.lstsq(explained, one, rcond=None)[0] for one in (early[known], late[known]))
        size = float(np.sqrt((a @ a) * (b @ b)))
        value = float(a @ b) / size if size > 0.0 else 0.0
        best = value if abs(value) > abs(best) else best
    return best


def _turning(cause: Floats, rate: Floats, step_s: float) -> tuple[float, str]:
    """Return how a cause turns the vessel, and by what that is shown: the acceleration, or else the rate that follows."""
    seen = _turns(cause, rate, step_s)
    if abs(seen) >= DRAFT.acts:
        return seen, "yaw acceleration"
    return _response(cause, rate, step_s), "yaw rate"


def _step(samples: Samples) -> float:
    return float(samples.grid_s[1] - samples.grid_s[0])


def _rudder_sign(field: ActuatorField, samples: Samples, motion: Motion) -> _Sign:
    """Return the sign of a rudder angle: the positive one turns a vessel that goes ahead to starboard."""
    ahead = np.where(motion.u > 0.0, 1.0, np.nan)
    seen, by = _turning(_on_grid(field, samples), motion.r * ahead, _step(samples))
    if abs(seen) < DRAFT.acts:
        return (
            1.0,
            "",
            f"the yaw rate does not show its sign (correlation {seen:.2f}): positive to starboard is assumed",
        )
    side = "starboard" if seen > 0.0 else "port"
    return (1.0 if seen > 0.0 else -1.0), f"positive turns to {side} (correlation with the {by} {seen:.2f})", ""


def _azimuth_sign(chosen: dict[str, _Roles], kinds: dict[str, str], samples: Samples, motion: Motion) -> _Sign:
    """Return the sign of azimuth angles: one thruster is taken to be at the stern, several move the hull."""
    side = np.zeros(samples.grid_s.shape)
    names = [name for name, kind in kinds.items() if kind == "azimuth"]
    for name in names:
        angle = _any(chosen[name], "angle")
        if angle is None:
            continue
        turn = np.pi / 180.0 if _unit("angle", angle, _largest(angle, samples))[0] == "deg" else 1.0
        speed, duty = _any(chosen[name], "speed"), _any(chosen[name], "duty")
        if speed is None and duty is not None and duty.setting is not None:
            speed = duty
        push = np.ones(side.shape) if speed is None else _on_grid(speed, samples)
        if speed is not None and speed.setting is not None:
            push = speed.setting.sign * push
        side = side + push * np.abs(push) * np.sin(_on_grid(angle, samples) * turn)
    if len(names) == 1:
        seen = -_turning(side, motion.r, _step(samples))[0]
        what, where = "turns to port when it pushes to starboard at the stern", " (if it is at the bow, sign = -1)"
    else:
        seen, what, where = _response(side, motion.v, _step(samples)), "moves to starboard when they push there", ""
    if abs(seen) < DRAFT.acts:
        return 1.0, "", f"the motion does not show the sign of the angle (correlation {seen:.2f}): clockwise is assumed"
    return (1.0 if seen > 0.0 else -1.0), f"the vessel {what} (correlation {abs(seen):.2f}){where}", ""


def _any(roles: _Roles, role: str) -> ActuatorField | None:
    return roles.get((role, False)) or roles.get((role, True))


def _largest(field: ActuatorField, samples: Samples) -> float:
    values = samples.raw(field.stream, field.path)
    values = values[np.isfinite(values)]
    return float(np.quantile(np.abs(values), 0.99)) if values.size else 0.0


def _pair_doubt(name: str, role: str, chosen: dict[str, _Roles], samples: Samples, motion: Motion) -> _Sign:
    """Return what the yaw rate shows of two forces side by side: more to port turns to starboard."""
    sides = {}
    for other, roles in chosen.items():
        field = _any(roles, role)
        words = set(other.split("_"))
        if field is not None and words & {"left", "port"}:
            sides["port"] = field
        if field is not None and words & {"right", "starboard"}:
            sides["starboard"] = field
    if len(sides) < 2 or not set(name.split("_")) & {"left", "right", "port", "starboard"}:
        return 1.0, "", ""
    port, starboard = (
        (1.0 if one.setting is None else one.setting.sign) * _on_grid(one, samples)
        for one in (sides["port"], sides["starboard"])
    )
    more = port - starboard
    # Without the fallback on the yaw rate: nothing else than a doubt hangs on it.
    seen = _turns(more, motion.r, _step(samples))
    if seen > DRAFT.acts:
        return (
            1.0,
            f"more to port than to starboard turns to starboard (correlation with the yaw acceleration {seen:.2f})",
            "",
        )
    if seen < -DRAFT.acts:
        return (
            1.0,
            "",
            f"more to port turns to port (correlation with the yaw acceleration {seen:.2f}): the two are exchanged, or the "
            "heading mirrored",
        )
    return 1.0, "", ""
