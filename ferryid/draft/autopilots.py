"""What the autopilots PX4 and ArduPilot record: the names are theirs; what they steer, their parameters state."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ferryid.draft.actuator_fields import ActuatorField
from ferryid.draft.autopilot_parameters import OutputSetting, Placement, UsedValues
from ferryid.draft.control_allocation import rotor_placements, rudder_evidence, rudders_alone
from ferryid.draft.fields import FieldGroup, rate_of, span_of
from ferryid.draft.samples import Samples
from ferryid.draft.servo_functions import configured_outputs
from ferryid.ingest.log import Topic
from ferryid.ingest.parameters import Parameter

_ORDERS = (
    ("actuator_motors", "control[{}]", 0, "motor", "duty"),
    ("actuator_servos", "control[{}]", 0, "servo", "rudder"),
    ("actuator_outputs", "output[{}]", 0, "output", "duty"),
    ("RCOU", "C{}", 1, "output", "duty"),
    ("RCOU", "Ch{}", 1, "output", "duty"),
    ("RCO2", "C{}", 15, "output", "duty"),
    ("RCO3", "C{}", 19, "output", "duty"),
)
"""Topic, field, number of the first, name and role of what autopilots order; Ch1 is the name of C1 up to 2014."""
_MOST = 16


_ARRAYS = (
    ("vehicle_attitude", "heading", ("q[1]", "q[2]", "q[3]", "q[0]"), "quaternion"),
    ("vehicle_angular_velocity", "yaw_rate", ("xyz[2]",), ""),
)
"""Topics of PX4 that are arrays without names of their elements: what they are. Its quaternions begin with the scalar."""


_VELOCITIES = {
    "vehicle_local_position": "NED",
    "vehicle_local_position_groundtruth": "NED",
    "vehicle_global_position": "NED",
    "vehicle_gps_position": "NED",
    "sensor_gps": "NED",
    "control_state": "FRD",
}
"""Topics of PX4 whose definitions state the frame of their velocity; that of an odometry is in a field of its own."""


_SPARES = {
    ("XKF6", ""): "XKF1",
    ("NKF6", ""): "NKF1",
    ("AHR2", "heading"): "ATT",
    ("AHR2", "position"): "POS",
}
"""Topic of a spare estimator, and of which kind of signal (empty: of any), with the topic that takes its place."""


def with_frames(groups: Sequence[FieldGroup], topics: Sequence[Topic]) -> list[FieldGroup]:
    """Return groups with the frame that the formats of the autopilots state: both keep poses in NED, velocities as named.

    What a spare estimator of the autopilot has, it does not steer by: where the first one is in the log, it is left out.
    """
    encodings = {topic.name: topic.encoding for topic in topics}
    names = {one.topic for one in groups}
    names_of_autopilot = {name for name, encoding in encodings.items() if encoding in ("ulog", "dataflash")}
    groups = [one for one in groups if not _is_spare(one, encodings.get(one.topic, ""), names)]
    framed = [replace(one, frame=_stated_frame(one, encodings.get(one.topic, ""))) for one in groups]
    if not any(one.kind == "velocity" and one.frame for one in framed):
        return framed
    # Beside a velocity whose definition is known, one of a controller may be in any unit and frame.
    return [one for one in framed if one.kind != "velocity" or one.frame or one.topic not in names_of_autopilot]


def _is_spare(group: FieldGroup, encoding: str, names: set[str]) -> bool:
    """Whether a group is of another core of the same estimator, whose first is among the names of topics.

    The second core was XKF6 or NKF6 until the cores of a message had numbers; AHR2 is the attitude by the older method.
    """
    if encoding not in ("ulog", "dataflash") or group.kind == "yaw_rate":
        return False
    bare = group.topic.strip("/")
    numbered = re.fullmatch(r"((?:XKF|NKF)1|estimator_\w+)\[[1-9][0-9]*\]", bare)
    first = numbered[1] if numbered else _SPARES.get((bare, group.kind), _SPARES.get((bare, ""), ""))
    return bool(first) and group.topic.replace(bare, first) in names


def _stated_frame(group: FieldGroup, encoding: str) -> str:
    """Return the frame of a group as its format states it, or an empty string."""
    if encoding not in ("ulog", "dataflash"):
        return group.frame
    if group.kind != "velocity":
        return "NED"
    if encoding == "ulog":
        return _VELOCITIES.get(re.sub(r"\[[0-9]+\]$", "", group.topic.strip("/")), "")
    return group.named_frame


def autopilot_groups(topics: Sequence[Topic]) -> list[FieldGroup]:
    """Return attitude and yaw rate of PX4; nothing for a log of something else."""
    by_name = {topic.name.strip("/"): topic for topic in topics if topic.encoding == "ulog" and topic.count > 1}
    return [
        FieldGroup(kind, topic.name, fields, form, rate_of(topic), lasts_s=span_of(topic))
        for name, kind, fields, form in _ARRAYS
        for topic in [by_name.get(name)]
        if topic is not None and set(fields) <= topic.fields.keys()
    ]


def autopilot_fields(topics: Sequence[Topic]) -> list[ActuatorField]:
    """Return the orders of an autopilot to its motors, servos or outputs; nothing for a log of something else."""
    by_name = {topic.name.strip("/"): topic for topic in topics if topic.encoding in ("ulog", "dataflash")}
    found: list[ActuatorField] = []
    for name, path, first, base, role in _ORDERS:
        topic = by_name.get(name)
        # Outputs are what motors and servos become, in pulses.
        if topic is None or topic.count < 2 or (name == "actuator_outputs" and found):
            continue
        found += [
            ActuatorField(f"{base}{k + (first or 1)}", role, True, topic.name, path.format(k + first), rate_of(topic))
            for k in range(_MOST)
            if path.format(k + first) in topic.fields
        ]
    return found


@dataclass(frozen=True)
class Orders:
    """The orders of an autopilot that change, what is stated of each thruster by its name, and what a person has to check."""

    fields: tuple[ActuatorField, ...]
    placements: Mapping[str, Placement] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()


def orders(fields: Sequence[ActuatorField], samples: Samples, parameters: Mapping[str, Parameter]) -> Orders:
    """Return the orders of an autopilot that change, as its parameters state what they drive.

    Parameters
    ----------
    fields
        All orders of the log, of `autopilot_fields`.
    samples
        The orders as recorded.
    parameters
        Parameters of the log by name; without them the orders keep the names of motors, servos or outputs.
    """
    values = UsedValues(parameters, samples)
    if any(one.actuator.startswith("output") for one in fields):
        outputs = configured_outputs(fields, values, samples)
        if outputs is None:
            return Orders(tuple(moving(fields, samples)))
        return Orders(outputs.fields, outputs.placements, outputs.remarks)
    chosen = moving(rudders_alone(fields, values), samples)
    rudders = [one for one in chosen if one.role == "rudder"]
    chosen = [
        replace(one, setting=OutputSetting(evidence=(stated,)))
        if one.role == "rudder" and (stated := rudder_evidence(one, values))
        else one
        for one in chosen
    ]
    placements, remarks = rotor_placements([one.actuator for one in chosen if one not in rudders], fields, values)
    mapped = {one.path for one in chosen if one.role in ("rudder", "angle")}
    remarks += [
        f"{stated}, but {one.path} of {one.topic} is not mapped: it never changes, or the motor before it is not stated"
        for one in fields
        if (stated := rudder_evidence(one, values)) and one.path not in mapped
    ]
    return Orders(tuple(chosen), placements, tuple(remarks))


def moving(fields: Sequence[ActuatorField], samples: Samples) -> list[ActuatorField]:
    """Return the orders that change, each servo as the angle of its motor where that is clear.

    One motor and one servo are a propeller and a rudder, as many servos as motors azimuths; of other numbers only a person
    knows what a servo turns.
    """
    kept = changing(fields, samples)
    motors = [one for one in kept if not one.actuator.startswith("servo")]
    servos = [one for one in kept if one.actuator.startswith("servo")]
    if not servos or len(servos) != len(motors):
        return motors
    role = "rudder" if len(motors) == 1 else "angle"
    return motors + [
        replace(servo, actuator=motor.actuator, role=role) for motor, servo in zip(motors, servos, strict=True)
    ]


def changing(fields: Sequence[ActuatorField], samples: Samples) -> list[ActuatorField]:
    """Return the fields that take more than one value."""
    kept = []
    for one in fields:
        values = samples.raw(one.stream, one.path) if (one.stream, one.path) in samples.columns else np.empty(0)
        if np.unique(values[np.isfinite(values)]).size > 1:
            kept.append(one)
    return kept
