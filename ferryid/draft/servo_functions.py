"""Outputs of ArduPilot by the parameters of its log: what each drives, and its pulses.

Numbers of functions, and what becomes a pulse, as of ArduPilot's libraries/SRV_Channel/SRV_Channel.cpp and
libraries/AR_Motors/AP_MotorsUGV.cpp.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from math import atan2, degrees

import numpy as np

from ferryid.draft.actuator_fields import ActuatorField
from ferryid.draft.autopilot_parameters import OutputSetting, Placement, UsedValues
from ferryid.draft.samples import Samples
from ferryid.vessel.pulses import PULSE_LIMITS_US

_STEERING, _THROTTLE, _LEFT, _RIGHT = 26, 70, 73, 74
_MOTORS = range(33, 41)
_OUTPUTS = 32
"""Outputs that ArduPilot has at most."""
_BOAT = 2
"""FRAME_CLASS of a boat."""
_RELAY = 3
"""MOT_PWM_TYPE of brushed motors whose direction a relay sets."""
_NAMES: Mapping[int, str] = {
    -1: "GPIO", 0: "Disabled", 1: "RCPassThru", 21: "Rudder", 26: "GroundSteering", 70: "Throttle", 73: "ThrottleLeft",
    74: "ThrottleRight", 88: "Winch", 89: "MainSail", 128: "WingSailElevator", 137: "MastRotation",
    **{33 + k: f"Motor{k + 1}" for k in range(8)}, **{51 + k: f"RCIN{k + 1}" for k in range(16)},
    **{94 + k: f"Script{k + 1}" for k in range(16)}, **{140 + k: f"RCIN{k + 1}Scaled" for k in range(16)},
}  # fmt: skip
_OPEN = frozenset({1, 21, *range(51, 67), *range(94, 110), *range(140, 156)})
"""Functions that may drive anything: sticks of the remote control, and scripts."""
_OMNI: Mapping[int, tuple[str, tuple[tuple[int, int, int], ...]]] = {
    1: ("Omni3", ((1, -1, -1), (0, -1, 1), (1, 1, 1))),
    2: ("OmniX", ((1, -1, -1), (1, -1, 1), (1, 1, -1), (1, 1, 1))),
    3: ("OmniPlus", ((0, 1, 1), (1, 0, 0), (0, -1, 1), (1, 0, 0))),
}
"""FRAME_TYPE to its name, and how much each motor pushes ahead, turns to starboard and pushes to starboard."""


@dataclass(frozen=True)
class ConfiguredOutputs:
    """Fields of the actuators that the parameters state, what is stated of each by its name, and what a person has to check."""

    fields: tuple[ActuatorField, ...]
    placements: Mapping[str, Placement]
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class _Output:
    number: int
    function: int
    field: ActuatorField
    moves: bool

    @property
    def stated(self) -> str:
        return f"SERVO{self.number}_FUNCTION = {self.function} ({_NAMES.get(self.function, 'another function')})"


def configured_outputs(
    fields: Sequence[ActuatorField], values: UsedValues, samples: Samples
) -> ConfiguredOutputs | None:
    """Return what the outputs of ArduPilot drive; None where the log has no parameters of them.

    Parameters
    ----------
    fields
        All outputs of the log.
    values
        The parameters.
    samples
        The outputs as recorded.
    """
    outputs, others = [], []
    for field in fields:
        number = int(field.path.removeprefix("C")) if field.path.removeprefix("C").isdigit() else 0
        function = values.whole(f"SERVO{number}_FUNCTION")
        if function is None:
            others.append(field)
        else:
            outputs.append(_Output(number, function, field, _moves(field, samples)))
    if not outputs:
        return None
    driven = {_STEERING, _THROTTLE, _LEFT, _RIGHT, *_MOTORS}
    remarks = [*_frame(values), *_not_recorded({one.number for one in outputs}, driven, values)]
    chosen: dict[int, tuple[_Output, int]] = {}
    for function in sorted(driven, key=lambda one: (one == _STEERING, one)):
        same = [one for one in outputs if one.function == function]
        live = [one for one in same if one.moves or _steady_us(one, values, samples)]
        remarks += [
            f"{one.stated}, but {one.field.path} of {one.field.topic} never changes: it is not mapped"
            for one in same
            if one not in live
        ]
        if live:
            chosen[function] = (live[0], len(live))
            remarks += [
                f"{one.stated} too: it follows the order of SERVO{live[0].number}, and is not mapped"
                for one in live[1:]
            ]
    found, placements = _thrusters(chosen, values, samples)
    if _STEERING in chosen:
        steering, _ = chosen[_STEERING]
        if _THROTTLE in chosen:
            found += _steering(steering, values, samples)
        else:
            remarks.append(
                f"{steering.stated} without a Throttle (70): which thruster it turns, or whether it is a rudder, is not "
                f"stated, and {steering.field.path} is not mapped"
            )
    for function, other in ((_LEFT, _RIGHT), (_RIGHT, _LEFT)):
        if function in chosen and other not in chosen:
            stated = chosen[function][0].stated
            remarks.append(f"{stated} alone: no output that changes has the function {other} ({_NAMES[other]})")
    rest = [one for one in outputs if one.moves and one.function not in driven]
    driving = bool(found)
    for one in rest:
        if one.function in _OPEN or (one.function == 0 and not driving):
            # A person knows what it drives; limits of the output do not apply to what is passed through.
            setting = OutputSetting(evidence=(f"{one.stated} leaves open what it drives",))
            found.append(replace(one.field, setting=setting))
        else:
            remarks.append(f"{one.stated}, yet {one.field.path} changes: it is not mapped")
    found += [field for field in others if _moves(field, samples)]
    return ConfiguredOutputs(tuple(found), placements, (*remarks, *values.remarks.values()))


def _not_recorded(recorded: Collection[int], driven: Collection[int], values: UsedValues) -> list[str]:
    """Return the outputs that drive the vessel and of which the log has no pulses, a sentence each."""
    found = []
    for number in sorted(set(range(1, _OUTPUTS + 1)) - set(recorded)):
        function = values.whole(f"SERVO{number}_FUNCTION")
        if function is not None and function in driven:
            found.append(f"SERVO{number}_FUNCTION = {function} ({_NAMES[function]}), but the log has no C{number}")
    return found


def _moves(field: ActuatorField, samples: Samples) -> bool:
    """Tell whether an output changes, apart from being switched off, which is a pulse of zero."""
    if (field.stream, field.path) not in samples.columns:
        return False
    pulses = samples.raw(field.stream, field.path)
    return bool(np.unique(pulses[np.isfinite(pulses) & (pulses > 0.0)]).size > 1)


def _steady_us(output: _Output, values: UsedValues, samples: Samples) -> float:
    """Return the one pulse that an output sends all the time [us], 0 where that is its neutral, and where it changes."""
    if output.moves or (output.field.stream, output.field.path) not in samples.columns:
        return 0.0
    pulses = samples.raw(output.field.stream, output.field.path)
    pulses = pulses[np.isfinite(pulses) & (pulses > 0.0)]
    neutral = values.get(f"SERVO{output.number}_TRIM")
    return 0.0 if neutral is None or not pulses.size or pulses[0] == neutral else float(pulses[0])


def _frame(values: UsedValues) -> list[str]:
    frame = values.whole("FRAME_CLASS")
    if frame is None or frame == _BOAT:
        return []
    return [f"FRAME_CLASS = {frame}, not {_BOAT} (boat): outputs are read as those of ArduPilot Rover"]


def _thrusters(
    chosen: Mapping[int, tuple[_Output, int]], values: UsedValues, samples: Samples
) -> tuple[list[ActuatorField], dict[str, Placement]]:
    """Return the fields of what pushes, and what is stated of each thruster."""
    found: list[ActuatorField] = []
    placements: dict[str, Placement] = {}
    sides = {
        _THROTTLE: ("propeller", Placement()),
        _LEFT: ("port", Placement(hint_m=(-2.0, -0.5), angle_deg=0.0, turns=1)),
        _RIGHT: ("starboard", Placement(hint_m=(-2.0, 0.5), angle_deg=0.0, turns=-1)),
    }
    for function, (output, count) in chosen.items():
        if function in sides:
            name, placement = sides[function]
            if count > 1:
                placement = replace(placement, evidence=(f"{count} outputs have the function {function}",), count=count)
        elif function in _MOTORS:
            name, placement = f"motor{function - _MOTORS[0] + 1}", _omni(function - _MOTORS[0], values)
        else:
            continue
        ahead = function in sides
        setting = _setting(output, values, samples, thruster=True)
        setting = replace(setting, pushes_ahead=ahead, evidence=(output.stated, *setting.evidence))
        found.append(replace(output.field, actuator=name, role="duty", setting=setting))
        placements[name] = placement
    return found, placements


def _omni(motor: int, values: UsedValues) -> Placement:
    """Return what the frame states of one motor of a vessel that can push aside."""
    frame = values.whole("FRAME_TYPE")
    name, mix = _OMNI.get(frame or 0, ("", ()))
    if motor >= len(mix):
        return Placement(
            doubts=("where it pushes to: FRAME_TYPE does not state it, angle_deg is clockwise from ahead",)
        )
    ahead, turns, aside = mix[motor]
    angle = degrees(atan2(aside, ahead))
    evidence = (f"FRAME_TYPE = {frame} ({name}): motor {motor + 1} is mixed as one that pushes at {angle:g} deg",)
    if angle == 90.0:
        return Placement("tunnel", None, (2.0 * turns, 0.0), None, turns, evidence=evidence)
    doubts = ("angle_deg is that of the autopilot's mix: measure where the thruster pushes to",) if angle else ()
    # One that pushes to port turns the vessel to port at the bow, and to starboard at the stern.
    hint_m = (2.0 * turns * aside or -2.0, 0.0)
    return Placement("propeller", None, hint_m, angle, turns, evidence=evidence, doubts=doubts)


def _steering(output: _Output, values: UsedValues, samples: Samples) -> list[ActuatorField]:
    """Return the steering of the vessel's one throttle: a rudder, or the angle of a thruster that turns."""
    setting = _setting(output, values, samples, thruster=False)
    most = values.get("MOT_VEC_ANGLEMAX")
    if most is not None and most > 0.0:
        vectored = f"MOT_VEC_ANGLEMAX = {most:g} deg: it turns the thruster"
        setting = replace(
            setting,
            # Steering to starboard takes a thruster at the stern that pushes to port.
            sign=-setting.sign,
            full_deg=most,
            evidence=(output.stated, vectored, *setting.evidence),
        )
        return [replace(output.field, actuator="propeller", role="angle", setting=setting)]
    doubt = (
        'a rudder is assumed; of an outboard or a jet that turns, the kind is "azimuth", with propeller.angle.command, whose '
        "sign is the opposite one"
    )
    setting = replace(setting, evidence=(output.stated, *setting.evidence), doubts=(*setting.doubts, doubt))
    return [replace(output.field, actuator="propeller", role="rudder", setting=setting)]


def _setting(output: _Output, values: UsedValues, samples: Samples, *, thruster: bool) -> OutputSetting:
    """Return pulses and sign of an output that goes both ways from its neutral, as all of a boat's do."""
    setting = _limits(output, values, samples, thruster=thruster)
    if steady_us := _steady_us(output, values, samples):
        doubt = f"{output.field.path} is {steady_us:g} us throughout: how it acts does not show in this log"
        setting = replace(setting, doubts=(*setting.doubts, doubt))
    return setting


def _limits(output: _Output, values: UsedValues, samples: Samples, *, thruster: bool) -> OutputSetting:
    """Return pulses and sign as the parameters state them, and how these contradict the log and each other."""
    servo = f"SERVO{output.number}"
    names = tuple(f"{servo}_{end}" for end in ("MIN", "TRIM", "MAX"))
    # As the profile shows them: ends that are alike there leave no travel.
    stated = [None if (value := values.get(name)) is None else float(f"{value:g}") for name in names]
    reversed_ = bool(values.whole(f"{servo}_REVERSED") or 0)
    sign, sign_by = (-1.0 if reversed_ else 1.0), f"{servo}_REVERSED = {int(reversed_)}"
    least, neutral, most = stated
    if least is None or neutral is None or most is None:
        return OutputSetting(
            True, None, sign, sign_by, doubts=("pulses of full astern, neutral and full ahead are usual ones",)
        )
    shown = ", ".join(f"{name} = {value:g}" for name, value in zip(names, stated, strict=True))
    fault = _fault(names, least, neutral, most)
    if fault:
        return OutputSetting(True, None, sign, sign_by, doubts=(f"{fault}: usual pulses stand in their place",))
    evidence, doubts = [f"{shown}, {sign_by}"], []
    pulses = samples.raw(output.field.stream, output.field.path)
    pulses = pulses[np.isfinite(pulses) & (pulses > 0.0)]
    if pulses.min() < least - 1.0 or pulses.max() > most + 1.0:
        doubts.append(
            f"pulses of {pulses.min():g} to {pulses.max():g} us were sent, beyond {names[0]} and {names[2]}: these are not the "
            "limits that held in the log"
        )
    if thruster and values.whole("MOT_PWM_TYPE") == _RELAY:
        # The pulses begin at the lowest whatever the neutral, and the reversal is the relay's.
        neutral, sign, sign_by = least, 1.0, f"MOT_PWM_TYPE = {_RELAY}"
        doubts.append(
            f"MOT_PWM_TYPE = {_RELAY}: a relay decides whether it pushes ahead or astern, and these pulses only how hard; "
            "stretches astern have the wrong sign"
        )
    if neutral == most:
        # No pulse goes beyond; a profile needs a longer one for the other direction all the same.
        mirrored = 2.0 * neutral - least
        most = min(mirrored, PULSE_LIMITS_US[1])
        evidence.append(f"{most:g} us is never sent, as no pulse goes beyond neutral")
        if most < mirrored:
            doubts.append(
                f"{names[1]} = {names[2]} = {neutral:g} and {names[0]} = {least:g}: a pulse as far beyond neutral, "
                f"{mirrored:g} us, is none, and {most:g} us stands in its place; such pulses are unusual"
            )
    dead = _dead_band(values, least, neutral, most) if thruster else 0.0
    if dead:
        evidence.append(
            f"MOT_THR_MIN = {values.get('MOT_THR_MIN'):g} %: the autopilot leaps over {dead:g} us on each side of neutral"
        )
        doubts.append(
            "dead_band_us is where the speed controller does nothing; leave it out where MOT_THR_MIN keeps an engine running"
        )
    return OutputSetting(
        True, (least, neutral, most, dead), sign, sign_by, evidence=tuple(evidence), doubts=tuple(doubts)
    )


def _fault(names: tuple[str, ...], least: float, neutral: float, most: float) -> str:
    """Return how the stated pulses contradict each other, empty where they do not."""
    if least >= most:
        return f"{names[0]} = {least:g} is not below {names[2]} = {most:g}"
    if not least <= neutral <= most:
        return f"{names[1]} = {neutral:g} lies outside of {names[0]} = {least:g} to {names[2]} = {most:g}"
    if neutral == most == PULSE_LIMITS_US[1]:
        return f"{names[1]} = {names[2]} = {most:g} leave no pulse beyond neutral"
    if least < PULSE_LIMITS_US[0] or most > PULSE_LIMITS_US[1]:
        return f"{names[0]} = {least:g} to {names[2]} = {most:g} are no pulses"
    return ""


def _dead_band(values: UsedValues, least: float, neutral: float, most: float) -> float:
    """Return what the autopilot leaps over on each side of neutral [us]: the lesser where the sides differ."""
    percent = min(max(values.get("MOT_THR_MIN") or 0.0, 0.0), 20.0)
    sides = [side for side in (neutral - least, most - neutral) if side > 0.0]
    return round(0.01 * percent * min(sides), 1)
