"""A vessel profile in words, for a person to check."""

from __future__ import annotations

import math

from ferryid.vessel.profile import Actuator, Profile, Signal
from ferryid.vessel.signal_map import canonical_columns, stream_name
from ferryid.vessel.thrusters import response_words


def describe(profile: Profile) -> str:
    """Return a plain-text page on a profile: hull, actuators, wind and signal map, with units."""
    return "\n".join([*_heading(profile), *_hull(profile), *_actuators(profile), *_wind(profile), *_signals(profile)])


def _heading(profile: Profile) -> list[str]:
    setting = [f"Setting: {profile.setting}"] if profile.setting else []
    window = [f"Forces are averaged over: {profile.window_s:g} s"] if math.isfinite(profile.window_s) else []
    return [
        f"{profile.name}: {profile.title}",
        f"Source: {profile.source}",
        *setting,
        *window,
        f"File: {profile.path}",
        "",
    ]


def _hull(profile: Profile) -> list[str]:
    hull = profile.hull
    size = ", ".join(
        f"{name} {value:g} m"
        for name, value in (("length", hull.length_m), ("beam", hull.beam_m), ("draught", hull.draught_m))
        if not math.isnan(value)
    )
    lines = [
        f"Hull: {size}",
        f"  mass {hull.mass_kg:g} kg, inertia in yaw {hull.inertia_z:g} kg·m², centre of gravity {hull.x_g_m:+g} m",
        "  M = " + "; ".join(" ".join(f"{value:.6g}" for value in row) for row in hull.M.tolist()),
    ]
    if hull.has_model:
        lines.append("  D: " + ", ".join(f"{term} {value:g}" for term, value in hull.D.items()))
    if math.isinf(hull.spread):
        lines.append("  coefficients of M and D: may be off by any amount")
    elif math.isfinite(hull.spread):
        lines.append(f"  coefficients of M and D: standard deviation {100.0 * hull.spread:g} % of each")
    else:
        lines.append("  D: none known. The base model is mass alone.")
    return [*lines, ""]


def _actuators(profile: Profile) -> list[str]:
    return ["Actuators:", *(f"  {_actuator(actuator)}" for actuator in profile.actuators), ""]


def _actuator(actuator: Actuator) -> str:
    x_m, y_m = actuator.position_m
    text = f"{actuator.name}: {actuator.kind.replace('_', ' + ')} at ({x_m:g}, {y_m:g}) m"
    if actuator.count > 1:
        text += f", {actuator.count} driven as one"
    if actuator.kind in ("propeller", "force") and actuator.angle_rad:
        text += f", pushing towards {math.degrees(actuator.angle_rad):g} deg"
    if actuator.thrust is not None:
        low, high = actuator.thrust.valid
        reach = f", {low:g} to {high:g} {actuator.thrust.input_unit}" if math.isfinite(low + high) else ""
        text += f", thrust by {actuator.thrust.kind.replace('_', ' ')}{reach}"
    if actuator.inflow:
        text += ", " + ", ".join(f"{key.removesuffix('_m')} {value:g}" for key, value in actuator.inflow.items())
    if actuator.rudder:
        text += f", rudder {actuator.rudder['area_m2']:g} m² at x = {actuator.rudder['x_m']:g} m"
    return text


def _wind(profile: Profile) -> list[str]:
    areas = profile.wind
    if areas is None:
        return ["Wind areas: none given.", ""]
    return [
        f"Wind areas: frontal {areas.frontal_m2:g} m², lateral {areas.lateral_m2:g} m², length {areas.length_m:g} m, "
        f"CD_t {areas.CD_t:g}, CD_l_AF {areas.CD_l_AF:g}, delta {areas.delta:g}, S_L {areas.S_L_m:g} m",
        "",
    ]


def _signals(profile: Profile) -> list[str]:
    rows = [
        (
            signal.quantity,
            ", ".join(canonical_columns(signal)),
            f"{stream_name(signal.topic, signal.where)}: {_fields(signal)}",
            _how(signal),
        )
        for signal in profile.signals
    ]
    widths = [max(len(row[column]) for row in rows) for column in range(3)]
    return [
        "Signals:",
        *(
            "  " + "  ".join([*(cell.ljust(width) for cell, width in zip(row, widths, strict=False)), row[3]])
            for row in rows
        ),
    ]


def _fields(signal: Signal) -> str:
    """Shorten four quaternion fields, which differ in their last letter, to one."""
    first = signal.fields[0]
    if signal.unit == "quaternion" and all(path[:-1] == first[:-1] for path in signal.fields):
        return f"{first[:-1]}{{{','.join(path[-1] for path in signal.fields)}}}"
    return ", ".join(signal.fields)


def _full(signal: Signal) -> str:
    """Full power or travel in the unit that a profile states it in."""
    role = signal.quantity.partition(".")[2].removesuffix(".command")
    if role == "speed":
        return f"{signal.full:g} rpm"
    return f"{signal.full:g} N" if role in ("force", "thrust") else f"{math.degrees(signal.full):g} deg"


def _how(signal: Signal) -> str:
    parts = [signal.unit, signal.frame]
    if signal.quantity == "wind" and signal.options:
        parts += [
            f"from {signal.options['direction_unit']} of {signal.options['reference']}",
            f"{signal.options['air']} wind",
        ]
    if signal.sign < 0:
        parts.append("sign reversed")
    if signal.offset:
        parts.append(f"offset {signal.offset:+g}")
    if signal.scale != 1.0:
        parts.append(f"times {signal.scale:g}")
    if signal.element is not None:
        parts.append(f"of {signal.element[1]} in {signal.element[0]}")
    if signal.pulse_us is not None:
        astern, neutral, ahead, dead = signal.pulse_us
        parts.append(f"pulses of {astern:g}, {neutral:g} and {ahead:g} with a dead band of {dead:g}")
    if signal.full:
        parts.append(f"of {_full(signal)}")
    if signal.quantity == "payload" and len(signal.fields) == 1:
        parts.append(f"standing at x = {signal.mount_m[0]:g} m")
    elif signal.mount_m != (0.0, 0.0):
        parts.append(f"measured at ({signal.mount_m[0]:g}, {signal.mount_m[1]:g}) m")
    if told := response_words(signal):
        parts.append(f"followed {told}")
    if not signal.required:
        parts.append("may be missing")
    return ", ".join(part for part in parts if part)
