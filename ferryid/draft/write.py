"""The text of a drafted profile: evidence beside each signal, and lines that a person has to fill in."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from shlex import quote
from typing import Any

from ferryid.counts import counted
from ferryid.draft.actuators import UNKNOWN_ORDER, DraftedActuator
from ferryid.draft.draft import Draft, as_order
from ferryid.draft.mapped import MappedSignal
from ferryid.vessel.field_words import words_of
from ferryid.vessel.profile import Actuator
from ferryid.vessel.signal_map import stream_name

USUAL_THRUST = 0.08
"""Bollard pull of a propeller [N] over square of the speed [rpm] and D⁴: a thrust coefficient of 0.3 in water."""
MARK = "# FILL IN:"
"""How a line begins that a person has to complete."""


_RUDDER = (
    ("diameter_m", "diameter of the propeller [m]", "0.2", "of the propeller"),
    ("area_m2", "area of the rudder [m²]", "0.05", ""),
    ("aspect_ratio", "height of the rudder over its mean chord", "1.5", ""),
    (
        "rudder_x_m",
        "place of the rudder, metres ahead of midship (negative astern)",
        "-2.5",
        "of the rudder, ahead of midship",
    ),
)
"""What a propeller with a rudder needs: key, question, hint, and the comment beside it."""
_AREAS = (
    ("frontal_m2", "Area above water seen from ahead [m²]", "2.0"),
    ("lateral_m2", "Area above water seen from the side [m²]", "5.0"),
)
"""What a wind acts on: key, question and hint."""
_STATED = re.compile(r"(SERVO[0-9]+_FUNCTION|CA_SV_CS[0-9]+_TYPE) = ")
"""Evidence that a parameter of an autopilot names what a signal drives."""
_ANY_SIGN = ("x_m", "y_m")
"""Ends of keys whose answer may be negative or zero."""


@dataclass(frozen=True)
class Question:
    """What only a person knows: the key under which the answer is kept, the words, and what stands in the marked line."""

    key: str
    text: str
    hint: str

    @property
    def wanted(self) -> str:
        """What an answer has to be, to stand after "give"."""
        if self.key.endswith(".order"):
            return "order or measured"
        return "a number without a unit" if self.key.endswith(_ANY_SIGN) else "a number above 0, without a unit"

    def accepts(self, answer: str) -> bool:
        """Tell whether a text answers it: a number, or a word that begins as one of its choices; or nothing."""
        answer = answer.strip().lower()
        if not answer:
            return True
        if self.key.endswith(".order"):
            return answer[0] in "om"
        try:
            value = float(answer)
        except ValueError:
            return False
        return math.isfinite(value) and (value > 0.0 or self.key.endswith(_ANY_SIGN))


@dataclass(frozen=True)
class Answers:
    """Name of the vessel, and answers to `questions` by their keys, as text."""

    name: str
    values: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class StatedWindow:
    """Length of the windows that a profile states [s], and why, as a sentence."""

    length_s: float
    why: str


_FULL = {
    "full_rpm": ("speed at full power [rpm]", "1000.0"),
    "full_deg": ("angle at full travel [deg]", "35.0"),
    "full_N": ("force at full power [N]", "100.0"),
}
"""What a share of one is: key to its meaning and an example."""


def _full_key(signal: MappedSignal) -> str:
    """Return the key of a signal that is a share of full power or travel, empty for others."""
    if signal.unit not in ("%", "fraction", "us"):
        return ""
    if signal.full_deg:
        return ""
    role = signal.quantity.partition(".")[2].removesuffix(".command")
    return {"speed": "full_rpm", "angle": "full_deg", "rudder": "full_deg", "force": "full_N"}.get(role, "")


def _full(signal: MappedSignal, key: str) -> tuple[str, str]:
    """Return the meaning of such a key and an example; a count beyond 100 is taken as a share of 100 all the same."""
    what, hint = _FULL[key]
    return (re.sub("full (power|travel)", "a value of 100", what) if signal.unit == "%" else what), hint


def open_lines(text: str) -> int:
    """Return how many lines of a drafted profile a person has to complete."""
    return sum(line.startswith(MARK) for line in text.splitlines())


def as_json(draft: Draft, file: str, text: str) -> dict[str, Any]:
    """Return a draft for JSON, schema ``ferryid.vessel-draft/1``."""
    return {
        "schema": "ferryid.vessel-draft/1",
        "log": draft.log,
        "file": file,
        "like": None if draft.like is None else draft.like.name,
        "fill_in": open_lines(text),
        "actuators": [{"name": one.name, "kind": one.kind} for one in draft.actuators],
        "signals": [
            {
                "quantity": one.quantity,
                "topic": one.topic,
                "fields": list(one.fields),
                "unit": one.unit,
                "frame": one.frame,
                "sign": one.sign,
                "evidence": list(one.evidence),
                "check": list(one.doubts),
                **dict(one.options),
                **({"where": dict(one.where)} if one.where else {}),
            }
            for one in draft.every
        ],
        "check": list(draft.remarks),
        "unused": list(draft.unused),
        "unused_fields": [{"topic": topic, "field": path} for topic, path in draft.unused_fields],
    }


def as_text(draft: Draft, file: str, text: str) -> str:
    """Return an account of a draft: each signal with its unit and frame, and what is left to do."""
    wide = max(len(one.quantity) for one in draft.every)
    lines = [f"{file}: {counted(len(draft.every), 'signal')}, {counted(len(draft.actuators), 'actuator')}"]
    for one in draft.every:
        stated = next((shown for shown in one.evidence if _STATED.match(shown)), "")
        how = ", ".join(filter(None, [one.unit, one.frame, "sign -1" if one.sign < 0.0 else "", stated]))
        lines.append(f"  {one.quantity:<{wide}}  {stream_name(one.topic, one.where)}: {', '.join(one.fields)}  [{how}]")
        lines += [f"  {'':<{wide}}    check: {doubt}" for doubt in one.doubts]
    for actuator in draft.actuators:
        place = actuator.placement
        if place.evidence or place.doubts:
            lines.append(f"  {actuator.name:<{wide}}  {'; '.join(place.evidence)}")
            lines += [f"  {'':<{wide}}    check: {doubt}" for doubt in place.doubts]
    lines += [f"  check: {remark}" for remark in draft.remarks]
    lines += [f"  not mapped of {topic}: {', '.join(paths)}" for topic, paths in _by_topic(draft).items()]
    count, mark = open_lines(text), MARK.removeprefix("# ").rstrip(":")
    # A profile can do without the areas that a wind acts on.
    wind = " (those of [wind] only if a wind is to be tested)" if f"{MARK} [wind]" in text else ""
    steps = [f"fill in {counted(count, 'line')} marked {mark}{wind}, then"] if count else []
    steps.append(f"ferryid vessel check {quote(file)}")
    steps += [f"ferryid {verb} {quote(draft.log)} --vessel {quote(file)}" for verb in ("inspect", "fit")]
    # Each on a line of its own, to be copied.
    lines += [f"{'' if k else 'next':<8}{step}" for k, step in enumerate(steps)]
    return "\n".join(lines)


def _by_topic(draft: Draft) -> dict[str, list[str]]:
    """Return the fields that are not mapped, by their topics."""
    found: dict[str, list[str]] = {}
    for topic, path in draft.unused_fields:
        found.setdefault(topic, []).append(path)
    return found


def questions(draft: Draft) -> list[Question]:
    """Return what a person is asked of a draft; nothing of what a like profile has."""
    asked: list[Question] = []
    if draft.like is None:
        asked += [
            Question("length_m", "Length of the hull [m]", "5.0"),
            Question("beam_m", "Beam [m]", "2.0"),
            Question("mass_kg", "Mass with crew and load, as on the trial [kg]", "1500.0"),
            *(Question(f"wind.{key}", text, hint) for key, text, hint in _AREAS),
        ]
    known = set() if draft.like is None else {one.name for one in draft.like.actuators}
    for one in draft.actuators:
        if any(UNKNOWN_ORDER in signal.doubts for signal in one.signals):
            roles = ", ".join(signal.quantity.partition(".")[2] for signal in one.signals)
            asked.append(
                Question(f"{one.name}.order", f"{one.name}: is its {roles} an order or measured? (order, measured)", "")
            )
        if one.name in known:
            continue
        if one.placement.position_m is None:
            x, y = _hint(one)
            asked.append(Question(f"{one.name}.x_m", f"{one.name}: metres ahead of midship (negative astern)", f"{x}"))
            asked.append(Question(f"{one.name}.y_m", f"{one.name}: metres to starboard (negative to port)", f"{y}"))
        if one.kind != "force":
            asked.append(
                Question(f"{one.name}.full", f"{one.name}: a speed [rpm] at which its thrust is known", "1000")
            )
            asked.append(Question(f"{one.name}.thrust", f"{one.name}: its thrust ahead at that speed [N]", "500"))
        if one.kind == "propeller_rudder":
            asked += [Question(f"{one.name}.{key}", f"{one.name}: {what}", hint) for key, what, hint, _ in _RUDDER]
        for signal in one.signals:
            key = _full_key(signal)
            if key and not any(question.key == f"{one.name}.{key}" for question in asked):
                what, hint = _full(signal, key)
                asked.append(Question(f"{one.name}.{key}", f"{one.name}: {what}", hint))
    return asked


def answered(draft: Draft, answers: Answers) -> Draft:
    """Return a draft whose signals are orders, or measured, as a person answered."""

    def settled(name: str, signal: MappedSignal) -> MappedSignal:
        answer = answers.values.get(f"{name}.order", "").strip().lower()
        if UNKNOWN_ORDER not in signal.doubts or not answer:
            return signal
        ordered = as_order(signal)
        return ordered if answer.startswith("o") else replace(ordered, quantity=signal.quantity)

    actuators = (
        replace(one, signals=tuple(settled(one.name, signal) for signal in one.signals)) for one in draft.actuators
    )
    return replace(draft, actuators=tuple(actuators))


def draft_text(draft: Draft, answers: Answers, window: StatedWindow | None = None) -> str:
    """Return a draft as TOML; what was not answered is a marked comment. `window` is the length of windows that it states."""
    draft = answered(draft, answers)
    like = draft.like
    lines = [
        'schema = "ferryid.vessel/1"',
        f'name = "{answers.name}"',
        f'source = "drafted from {_quoted(Path(draft.log).name)}'
        + (f", hull and thrust as of {like.name}" if like is not None else "")
        + '; numbers of the hull and the thrusters: state where they come from"',
        *([f"window_s = {like.window_s:g}"] if like is not None and math.isfinite(like.window_s) else []),
        *([] if window is None else [f"# {window.why}", f"window_s = {window.length_s:.2g}"]),
        "",
        f"# Lines marked {MARK.removeprefix('# ')} are what no log shows: remove the mark and correct the number. Evidence",
        "# stands above each signal, CHECK is what is assumed. Then: ferryid vessel check, ferryid inspect, ferryid fit.",
        *(f"# Log: {note}." for note in draft.notes),
        *(f"# CHECK: {remark}." for remark in draft.remarks),
        "",
    ]
    lines += _hull(answers) if like is None else _like_sections(draft, like.text)
    known = {} if like is None else {one.name: one for one in like.actuators}
    for one in draft.actuators:
        if one.name not in known:
            lines += _actuator(one, answers)
    if like is not None:
        lines += _unmapped(draft, like.actuators)
    for signal in draft.every:
        lines += _signal(signal, answers)
    if draft.unused_fields:
        lines += ["", "# Fields that are not mapped, of topics that are:"]
        lines += [f"#   {topic}: {', '.join(paths)}" for topic, paths in _by_topic(draft).items()]
    if draft.unused:
        lines += ["", "# Topics of which nothing is mapped:", *(f"#   {name}" for name in draft.unused)]
    return "\n".join(lines) + "\n"


def _quoted(text: str) -> str:
    return text.replace("\\", "/").replace('"', "'")


def _number(answers: Answers, key: str) -> str | None:
    text = answers.values.get(key, "").strip()
    return f"{float(text):g}" if text else None


def _entry(answers: Answers, key: str, name: str, hint: str, what: str) -> str:
    value = _number(answers, key)
    note = f"    # {what}" if what else ""
    return f"{name} = {value}" if value is not None else f"{MARK} {name} = {hint}{note}"


def _hull(answers: Answers) -> list[str]:
    length = _number(answers, "length_m")
    turning = f"k_zz_m = {0.25 * float(length):g}" if length else f"{MARK} k_zz_m = 1.25"
    return [
        "[hull]",
        _entry(answers, "length_m", "length_m", "5.0", "between perpendiculars, or over all"),
        _entry(answers, "beam_m", "beam_m", "2.0", ""),
        _entry(answers, "mass_kg", "mass_kg", "1500.0", "with crew and load, as on the trial"),
        f"{turning}    # radius of gyration: a quarter of the length, usual for boats; not measured",
        "",
        *_wind_load(answers, length),
        "",
    ]


def _wind_load(answers: Answers, length: str | None) -> list[str]:
    """Return the areas that a wind acts on; marked as a whole where they are not known, as a profile can do without."""
    areas = [_number(answers, f"wind.{key}") for key, _, _ in _AREAS]
    usual = ("CD_t = 0.9", "CD_l_AF = 0.55", "delta = 0.6")
    note = "# of a speed boat in Blendermann's table (Fossen 2021, Table 10.1); not measured"
    if length is None or None in areas:
        lines = ["[wind]    # or remove these lines: then no wind is tested, nor estimated beside the hull"]
        lines += [f"{key} = {hint}    # {text[0].lower()}{text[1:]}" for key, text, hint in _AREAS]
        return [
            f"{MARK} {line}"
            for line in (*lines, f"length_m = {length or '5.0'}", *usual[:-1], f"{usual[-1]}    {note}")
        ]
    lines = ["[wind]", *(f"{key} = {area}" for (key, _, _), area in zip(_AREAS, areas, strict=True))]
    return [*lines, f"length_m = {length}", *usual[:-1], f"{usual[-1]}    {note}"]


def _hint(one: DraftedActuator) -> tuple[float, float]:
    """Return an example of a place, on the side that the name states: on the centre line, two thrusters turn no vessel."""
    x, y = one.placement.hint_m
    words = set(words_of(one.name))
    side = bool(words & {"right", "starboard"}) - bool(words & {"left", "port"})
    return x, y or 0.5 * side


def _actuator(one: DraftedActuator, answers: Answers) -> list[str]:
    stated = one.placement
    x, y = _number(answers, f"{one.name}.x_m"), _number(answers, f"{one.name}.y_m")
    if stated.position_m is not None:
        x, y = (f"{value:g}" for value in stated.position_m)
    hint = ", ".join(f"{value}" for value in _hint(one))
    place = (
        f"position_m = [{x}, {y}]"
        if x and y
        else f"{MARK} position_m = [{hint}]    # x ahead, y to starboard of midship"
    )
    doubts = [*stated.doubts, *_turned(one, x, y)]
    lines = [*(f"# {line}." for line in stated.evidence), *(f"# CHECK: {doubt}." for doubt in doubts)]
    lines += ["[[actuator]]", f'name = "{one.name}"', f'kind = "{one.kind}"', place]
    if stated.angle_deg and one.kind == "propeller":
        lines.append(f"angle_deg = {stated.angle_deg:g}    # where it pushes to, clockwise from ahead")
    if stated.count > 1:
        lines.append(
            f"count = {stated.count}    # side by side, as one: position_m is the middle, the thrust that of one"
        )
    if one.kind == "force":
        return [*lines, ""]
    if one.kind == "propeller_rudder":
        lines.append(_entry(answers, f"{one.name}.diameter_m", "diameter_m", "0.2", "of the propeller"))
    full, thrust = _number(answers, f"{one.name}.full"), _number(answers, f"{one.name}.thrust")
    lines += ["", "[actuator.thrust]", 'kind = "quadratic"    # a bollard pull as a table is better', 'input = "rpm"']
    if full and thrust:
        lines.append(
            f"ahead = {float(thrust) / float(full) ** 2:.4g}    # {thrust} N at {full} rpm; astern the same, if not given"
        )
    else:
        lines.append(_usual_thrust(_number(answers, f"{one.name}.diameter_m")))
    if one.kind == "propeller_rudder":
        lines += ["", "[actuator.rudder]"]
        lines += [
            _entry(answers, f"{one.name}.{key}", key.removeprefix("rudder_"), hint, what)
            for key, _, hint, what in _RUDDER[1:]
        ]
    return [*lines, ""]


def _turned(one: DraftedActuator, x: str | None, y: str | None) -> list[str]:
    """Return how the place of a thruster contradicts the way in which the autopilot turns the vessel by it."""
    stated = one.placement
    if not (x and y and stated.turns):
        return []
    angle = math.radians(stated.angle_deg or 0.0) if one.kind != "tunnel" else 0.5 * math.pi
    arm = float(x) * math.sin(angle) - float(y) * math.cos(angle)
    side = "starboard" if stated.turns > 0 else "port"
    if arm * stated.turns > 0.0:
        return []
    return [f"at this place it does not turn the vessel to {side}, as the autopilot takes it to"]


def _usual_thrust(diameter: str | None) -> str:
    """Return the line of a thrust that is not known, with the one that is usual for the propeller's diameter."""
    what = (
        f"thrust [N] over the square of the speed [rpm]; without a bollard pull about {USUAL_THRUST} D⁴, diameter D [m]"
    )
    value = 5e-4 if diameter is None else USUAL_THRUST * float(diameter) ** 4
    return f"{MARK} ahead = {value:.3g}    # {what}"


def _like_sections(draft: Draft, text: str) -> list[str]:
    """Return the text of a profile without its head and its signals."""
    kept: list[str] = []
    within, begun = False, False
    pending: list[str] = []
    for line in text.splitlines():
        header = re.match(r"\s*\[+\s*([A-Za-z_]+)", line)
        if header:
            begun, within = True, header[1] != "signals"
            if within:
                kept += pending
            pending = []
        if begun and (line.startswith("#") or not line.strip()):
            # A comment belongs to what follows it.
            pending.append(line)
            continue
        if begun and within:
            kept += [*pending, line]
            pending = []
    return [*kept, ""]


def _unmapped(draft: Draft, actuators: Sequence[Actuator]) -> list[str]:
    """Return marks for actuators of the like profile of which the log shows nothing."""
    here = {one.name for one in draft.actuators}
    return [
        f"{MARK} a signal of the actuator {one.name}, of which this log shows none"
        for one in actuators
        if one.name not in here
    ]


def _signal(signal: MappedSignal, answers: Answers) -> list[str]:
    name = signal.quantity if re.fullmatch(r"[A-Za-z0-9_]+", signal.quantity) else f'"{signal.quantity}"'
    lines = ["", *(f"# {one[:1].upper()}{one[1:]}." for one in signal.evidence)]
    lines += [f"# CHECK: {one}." for one in signal.doubts]
    lines += [f"[signals.{name}]", f"topic = {_text(signal.topic)}"]
    if signal.quantity == "wind":
        lines += [f"speed = {_text(signal.fields[0])}", f"direction = {_text(signal.fields[1])}"]
    elif signal.unit == "quaternion":
        lines.append(f"quaternion = [{', '.join(map(_text, signal.fields))}]")
    elif len(signal.fields) == 1:
        lines.append(f"field = {_text(signal.fields[0])}")
    else:
        lines.append(f"fields = [{', '.join(map(_text, signal.fields))}]")
    if signal.where:
        chosen = ", ".join(f"{_key(path)} = {value:g}" for path, value in signal.where)
        lines.append(f"where = {{ {chosen} }}")
    if signal.unit != "quaternion":
        lines.append(f"unit = {_text(signal.unit)}")
    if signal.pulse_us is not None:
        *pulses, dead = (f"{value:g}" for value in signal.pulse_us)
        turned = signal.quantity.removesuffix(".command").endswith((".rudder", ".angle"))
        meaning = "full travel to one side, neutral, to the other" if turned else "full astern, neutral, full ahead"
        lines.append(f"pulse_us = [{', '.join(pulses)}]    # {meaning}")
        lines += [f"dead_band_us = {dead}"] if dead != "0" else []
    elif signal.unit == "us":
        lines.append(
            "pulse_us = [1100, 1500, 1900]    # full astern, neutral, full ahead; dead_band_us = ... beside neutral"
        )
    if key := _full_key(signal):
        what, hint = _full(signal, key)
        lines.append(_entry(answers, f"{signal.quantity.partition('.')[0]}.{key}", key, hint, what))
    if signal.full_deg:
        lines.append(f"full_deg = {signal.full_deg:g}")
    lines += [f"{key} = {_text(value)}" for key, value in signal.options]
    if signal.frame:
        lines.append(f"frame = {_text(signal.frame)}")
    if signal.sign != 1.0:
        lines.append(f"sign = {signal.sign:g}")
    return lines


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _text(name)


def _text(value: str) -> str:
    return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
