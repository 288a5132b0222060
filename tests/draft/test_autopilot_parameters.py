"""What the parameters of an autopilot state of its boat: what each output drives, its pulses, and what contradicts the log."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from ferryid.draft import Answers, Draft, draft_profile, draft_text, questions
from ferryid.draft.write import as_json, as_text
from ferryid.errors import FerryIdError
from ferryid.signals.recording import record
from ferryid.types import Floats
from ferryid.vessel import parse_profile
from ferryid.vessel.pulses import pulse_of_share
from tests.draft.test_autopilots import ardupilot, px4
from tests.draft.test_draft import Columns

BOAT = {"FRAME_CLASS": 2.0, "FRAME_TYPE": 0.0, "MOT_PWM_TYPE": 0.0, "MOT_THR_MIN": 0.0, "MOT_VEC_ANGLEMAX": 0.0}


def servo(
    number: int, function: int, least: float, neutral: float, most: float, *, reverse: bool = False
) -> dict[str, float]:
    """Parameters of one output."""
    ends = {"FUNCTION": function, "MIN": least, "TRIM": neutral, "MAX": most, "REVERSED": float(reverse)}
    return {f"SERVO{number}_{name}": float(value) for name, value in ends.items()}


RUDDER, PROPELLER = servo(1, 26, 1200, 1480, 1800), servo(3, 70, 1100, 1500, 1900)


def pulses(share: Floats, parameters: dict[str, float], number: int, dead: float = 0.0) -> Floats:
    """Pulses that an output of these parameters sends for a share of full power."""
    least, neutral, most, reverse = (parameters[f"SERVO{number}_{end}"] for end in ("MIN", "TRIM", "MAX", "REVERSED"))
    return np.round(pulse_of_share(share * (1.0 - 2.0 * reverse), (least, neutral, most, dead)))


def both(trial: Columns, parameters: dict[str, float], dead: float = 0.0) -> dict[int, Floats]:
    """Pulses of a rudder and a propeller."""
    return {
        1: pulses(trial["rudder"] / 0.7, parameters, 1),
        3: pulses(trial["n"] / 1000.0, parameters, 3, dead),
    }


def drafted(folder: Path, log: bytes, name: str = "boat.bin") -> Draft:
    (folder / name).write_bytes(log)
    return draft_profile(folder / name)


def text_of(draft: Draft, **values: str) -> str:
    return draft_text(draft, Answers("boat", {one.key: one.hint for one in questions(draft)} | values))


def columns_of(folder: Path, draft: Draft, name: str = "boat.bin") -> Columns:
    streams = record(folder / name, parse_profile(text_of(draft), "boat.toml")).streams.values()
    return {name: values for stream in streams for name, values in stream.columns.items()}


def doubts(draft: Draft) -> str:
    signals = [doubt for one in draft.every for doubt in one.doubts]
    return "\n".join([*draft.remarks, *signals, *(doubt for one in draft.actuators for doubt in one.placement.doubts)])


@pytest.mark.parametrize("reverse", [False, True])
def test_a_propeller_and_a_rudder_are_what_their_functions_state(trial: Columns, tmp_path: Path, reverse: bool) -> None:
    stated = BOAT | servo(1, 26, 1200, 1480, 1800, reverse=reverse) | servo(3, 70, 1100, 1500, 1900, reverse=reverse)
    stated["MOT_THR_MIN"] = 10.0
    draft = drafted(tmp_path, ardupilot(trial, stated, both(trial, stated, dead=40.0)))
    assert [(one.name, one.kind) for one in draft.actuators] == [("propeller", "propeller_rudder")]
    assert not draft.remarks
    text = text_of(draft)
    sign = "\nsign = -1\n" if reverse else "\n\n"
    assert (
        f"pulse_us = [1100, 1500, 1900]    # full astern, neutral, full ahead\ndead_band_us = 40\nfull_rpm = 1000{sign}"
        in text
    )
    assert (
        f"pulse_us = [1200, 1480, 1800]    # full travel to one side, neutral, to the other\nfull_deg = 35{sign}"
        in text
    )
    assert "# SERVO3_FUNCTION = 70 (Throttle).\n" in text
    assert re.search(r"/RCOU: C3  \[us, .*SERVO3_FUNCTION = 70 \(Throttle\)\]", as_text(draft, "boat.toml", text))
    assert f"# SERVO1_MIN = 1200, SERVO1_TRIM = 1480, SERVO1_MAX = 1800, SERVO1_REVERSED = {int(reverse)}.\n" in text
    columns = columns_of(tmp_path, draft)
    np.testing.assert_allclose(columns["n_cmd_propeller"], trial["n"], atol=1000.0 / 360.0)
    np.testing.assert_allclose(columns["delta_cmd_propeller"], trial["rudder"] / 0.7 * np.radians(35.0), atol=2e-3)


def test_left_and_right_are_two_thrusters_at_their_sides(trial: Columns, tmp_path: Path) -> None:
    stated = BOAT | servo(2, 73, 1000, 1500, 2000) | servo(4, 74, 1000, 1500, 2000, reverse=True)
    more = 150.0 * trial["rudder"]
    share = {2: (trial["n"] + more) / 1000.0, 4: (trial["n"] - more) / 1000.0}
    outputs = {number: pulses(one, stated, number) for number, one in share.items()}
    draft = drafted(tmp_path, ardupilot(trial, stated, outputs))
    assert [(one.name, one.kind) for one in draft.actuators] == [("port", "propeller"), ("starboard", "propeller")]
    assert "More to port than to starboard turns to starboard" in text_of(draft)
    assert not doubts(draft)
    hints = {one.key: one.hint for one in questions(draft)}
    assert (hints["port.y_m"], hints["starboard.y_m"]) == ("-0.5", "0.5")
    columns = columns_of(tmp_path, draft)
    np.testing.assert_allclose(columns["n_cmd_port"], 1000.0 * share[2], atol=1.1)
    np.testing.assert_allclose(columns["n_cmd_starboard"], 1000.0 * share[4], atol=1.1)
    # Exchanged outputs turn the vessel the other way, and a thruster named after one side is not at the other.
    crossed = {2: 3000 - outputs[4], 4: 3000 - outputs[2]}
    exchanged = drafted(tmp_path, ardupilot(trial, stated, crossed))
    assert "the two are exchanged" in doubts(exchanged)
    assert "CHECK: at this place it does not turn the vessel to starboard" in text_of(draft, **{"port.y_m": "0.4"})
    assert "at this place" not in text_of(draft)


def test_a_thruster_that_is_turned_is_an_azimuth(trial: Columns, tmp_path: Path) -> None:
    stated = BOAT | RUDDER | PROPELLER | {"MOT_VEC_ANGLEMAX": 30.0}
    draft = drafted(tmp_path, ardupilot(trial, stated, both(trial, stated)))
    assert [(one.name, one.kind) for one in draft.actuators] == [("propeller", "azimuth")]
    angle = next(one for one in draft.every if one.quantity == "propeller.angle.command")
    # Pulses above neutral turn to starboard, so that the thruster at the stern pushes to port.
    assert (angle.sign, angle.full_deg) == (-1.0, 30.0)
    assert "states the other sign" not in doubts(draft)
    assert "MOT_VEC_ANGLEMAX = 30 deg: it turns the thruster" in angle.evidence
    assert not any(one.key == "propeller.full_deg" for one in questions(draft))
    expected = -np.radians(30.0) * trial["rudder"] / 0.7
    np.testing.assert_allclose(columns_of(tmp_path, draft)["alpha_cmd_propeller"], expected, atol=2e-3)


def test_a_negative_angle_of_vectored_thrust_is_none(trial: Columns, tmp_path: Path) -> None:
    stated = BOAT | RUDDER | PROPELLER | {"MOT_VEC_ANGLEMAX": -30.0}
    draft = drafted(tmp_path, ardupilot(trial, stated, both(trial, stated)))
    assert [one.kind for one in draft.actuators] == ["propeller_rudder"]
    parse_profile(text_of(draft), "boat.toml")


def test_motors_of_a_vessel_that_pushes_aside(trial: Columns, tmp_path: Path) -> None:
    stated = BOAT | {"FRAME_TYPE": 3.0}
    for motor in range(4):
        stated |= servo(motor + 1, 33 + motor, 1100, 1500, 1900)
    outputs = {k: pulses(np.roll(trial["n"], 50 * k) / 1000.0, stated, k) for k in range(1, 5)}
    draft = drafted(tmp_path, ardupilot(trial, stated, outputs))
    assert [(one.name, one.kind) for one in draft.actuators] == [
        ("motor1", "tunnel"), ("motor2", "propeller"), ("motor3", "tunnel"), ("motor4", "propeller"),
    ]  # fmt: skip
    assert [one.placement.hint_m[0] for one in draft.actuators if one.kind == "tunnel"] == [2.0, -2.0]
    stated["FRAME_TYPE"] = 2.0
    draft = drafted(tmp_path, ardupilot(trial, stated, outputs))
    assert [one.placement.angle_deg for one in draft.actuators] == [-45.0, 45.0, -45.0, 45.0]
    assert "angle_deg = -45    #" in text_of(draft)
    assert "measure where the thruster pushes to" in doubts(draft)
    # The places that are suggested turn the vessel the way in which the autopilot takes each motor to.
    assert [one.placement.hint_m[0] for one in draft.actuators] == [2.0, -2.0, -2.0, 2.0]
    assert "at this place" not in text_of(draft)
    stated["FRAME_TYPE"] = 0.0
    assert "FRAME_TYPE does not state it" in doubts(drafted(tmp_path, ardupilot(trial, stated, outputs)))


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"SERVO3_MIN": 1900.0, "SERVO3_MAX": 1100.0}, "SERVO3_MIN = 1900 is not below SERVO3_MAX = 1100: usual pulses"),
        ({"SERVO1_TRIM": 1900.0}, "SERVO1_TRIM = 1900 lies outside of SERVO1_MIN = 1200 to SERVO1_MAX = 1800"),
        ({"SERVO3_MIN": 0.0}, "SERVO3_MIN = 0 to SERVO3_MAX = 1900 are no pulses"),
        (
            {"SERVO3_MIN": 100.0, "SERVO3_TRIM": 2600.0, "SERVO3_MAX": 2600.0},
            "SERVO3_TRIM = SERVO3_MAX = 2600 and SERVO3_MIN = 100: a pulse as far beyond neutral, 5100 us, is none",
        ),
        (
            {"SERVO1_MIN": 100.0, "SERVO1_TRIM": 2600.0, "SERVO1_MAX": 2600.0},
            "SERVO1_TRIM = SERVO1_MAX = 2600 and SERVO1_MIN = 100: a pulse as far beyond neutral, 5100 us, is none",
        ),
        (
            {"SERVO3_TRIM": 5000.0, "SERVO3_MAX": 5000.0},
            "SERVO3_TRIM = SERVO3_MAX = 5000 leave no pulse beyond neutral: usual pulses",
        ),
        ({"SERVO3_MIN": 1899.9999}, "SERVO3_MIN = 1900 is not below SERVO3_MAX = 1900: usual pulses"),
        ({"SERVO3_MAX": 1700.0}, "us were sent, beyond SERVO3_MIN and SERVO3_MAX"),
        ({"SERVO1_REVERSED": 1.0}, "SERVO1_REVERSED = 1 states the other sign: the motion decides"),
        ({"SERVO3_REVERSED": 1.0}, "SERVO3_REVERSED = 1, but the vessel goes slower ahead when it pushes ahead"),
        ({"FRAME_CLASS": 1.0}, "FRAME_CLASS = 1, not 2 \\(boat\\)"),
        ({"MOT_PWM_TYPE": 3.0}, "MOT_PWM_TYPE = 3: a relay decides whether it pushes ahead or astern"),
        ({"MOT_THR_MIN": 8.0}, "dead_band_us is where the speed controller does nothing"),
        (servo(2, 70, 1100, 1500, 1900), "SERVO2_FUNCTION = 70 \\(Throttle\\), but C2 of /RCOU never changes"),
        (servo(9, 70, 1100, 1500, 1900), "SERVO9_FUNCTION = 70 \\(Throttle\\), but the log has no C9"),
        ({"SERVO1_REVERSED": float("nan")}, "SERVO1_REVERSED is no number in the log: such values are not used"),
        ({"SERVO3_FUNCTION": 73.5}, "SERVO3_FUNCTION = 73.5 is no whole number, and is not used"),
        ({"SERVO3_FUNCTION": 73.0}, "73 \\(ThrottleLeft\\) alone: no output that changes has the function 74"),
        ({"SERVO3_FUNCTION": 73.0}, "without a Throttle \\(70\\): .*C1 is not mapped"),
        ({"SERVO1_FUNCTION": 0.0}, "SERVO1_FUNCTION = 0 \\(Disabled\\), yet C1 changes: it is not mapped"),
        ({"SERVO1_FUNCTION": 89.0}, "SERVO1_FUNCTION = 89 \\(MainSail\\), yet C1 changes: it is not mapped"),
    ],
)  # fmt: skip
def test_parameters_that_contradict_the_log_or_themselves_are_named(
    trial: Columns,
    tmp_path: Path,
    changes: dict[str, float],
    told: str,
) -> None:
    stated = BOAT | RUDDER | PROPELLER
    outputs = both(trial, stated)
    plain = drafted(tmp_path, ardupilot(trial, stated, outputs))
    assert [doubt.partition(";")[0] for doubt in doubts(plain).splitlines()] == ["a rudder is assumed"]
    draft = drafted(tmp_path, ardupilot(trial, stated | changes, outputs))
    assert re.search(told, doubts(draft)), doubts(draft)
    text = text_of(draft)
    assert re.search(f"# CHECK: .*{told}", text, flags=re.IGNORECASE)
    parse_profile(text, "boat.toml")
    assert re.search(told, as_text(draft, "boat.toml", text))
    assert re.search(told, "\n".join([*as_json(draft, "", text)["check"], doubts(draft)]))


def test_what_a_remote_control_or_a_script_orders_is_left_to_a_person(trial: Columns, tmp_path: Path) -> None:
    stated = BOAT | servo(1, 1, 1100, 1500, 1900) | servo(3, 94, 1100, 1500, 1900)
    draft = drafted(tmp_path, ardupilot(trial, stated))
    assert [one.name for one in draft.actuators] == ["output1", "output3"]
    assert "SERVO1_FUNCTION = 1 (RCPassThru) leaves open what it drives" in draft.actuators[0].signals[0].evidence
    assert "what this output of the autopilot drives" in doubts(draft)
    assert "pulse_us = [1100, 1500, 1900]    # full astern, neutral, full ahead; dead_band_us" in text_of(draft)


def test_outputs_that_are_set_without_a_function_are_kept_where_nothing_else_drives(
    trial: Columns, tmp_path: Path
) -> None:
    stated = BOAT | servo(1, 0, 1100, 1500, 1900) | servo(3, 0, 1100, 1500, 1900)
    draft = drafted(tmp_path, ardupilot(trial, stated))
    assert [one.name for one in draft.actuators] == ["output1", "output3"]


def test_two_motors_of_one_order_are_one_actuator(trial: Columns, tmp_path: Path) -> None:
    stated = BOAT | RUDDER | PROPELLER | servo(4, 70, 1000, 1500, 2000)
    outputs = both(trial, stated)
    draft = drafted(tmp_path, ardupilot(trial, stated, outputs | {4: pulses(trial["n"] / 1000.0, stated, 4)}))
    assert [one.name for one in draft.actuators] == ["propeller"]
    assert "SERVO4_FUNCTION = 70 (Throttle) too: it follows the order of SERVO3" in doubts(draft)
    assert parse_profile(text_of(draft), "boat.toml").actuators[0].count == 2


def test_a_motor_that_runs_one_way_backwards(trial: Columns, tmp_path: Path) -> None:
    stated = BOAT | RUDDER | servo(3, 70, 1100, 1900, 1900, reverse=True)
    outputs = both(trial, RUDDER | PROPELLER) | {3: 1900.0 - 0.8 * trial["n"]}
    draft = drafted(tmp_path, ardupilot(trial, stated, outputs))
    np.testing.assert_allclose(columns_of(tmp_path, draft)["n_cmd_propeller"], trial["n"], atol=1.3)


def test_of_a_parameter_that_changes_often_the_first_values_are_listed(trial: Columns, tmp_path: Path) -> None:
    stated = BOAT | RUDDER | PROPELLER
    often = tuple((0.1 * k, "SERVO3_TRIM", 1480.0 + k) for k in range(1, 9))
    draft = drafted(tmp_path, ardupilot(trial, stated, both(trial, stated), often))
    assert "1484 from 0.4 s on, 4 more; 1488 held longest" in doubts(draft)


def test_of_a_parameter_that_changes_the_value_that_held_longest_is_used(trial: Columns, tmp_path: Path) -> None:
    stated = BOAT | RUDDER | PROPELLER
    outputs = both(trial, stated)
    early = ardupilot(trial, stated | {"SERVO3_TRIM": 1450.0}, outputs, ((12.0, "SERVO3_TRIM", 1500.0),))
    draft = drafted(tmp_path, early)
    said = "SERVO3_TRIM changed in the log: 1450 at first, 1500 from 12.0 s on; 1500 held longest and is used"
    assert draft.remarks == (said,)
    assert "pulse_us = [1100, 1500, 1900]" in text_of(draft)
    # The same value stated again is no change.
    again = ardupilot(trial, stated, outputs, ((12.0, "SERVO3_TRIM", 1500.0),))
    assert not drafted(tmp_path, again).remarks
    # A part of the log is read by what held in it.
    (tmp_path / "boat.bin").write_bytes(early)
    first = draft_profile(tmp_path / "boat.bin", ranges=((0.0, 11.0),))
    assert any("1450 held longest" in remark for remark in first.remarks)


def test_a_thruster_at_one_speed_is_kept_and_one_at_rest_is_not(trial: Columns, tmp_path: Path) -> None:
    stated = BOAT | RUDDER | PROPELLER
    outputs = both(trial, stated)
    draft = drafted(tmp_path, ardupilot(trial, stated, outputs | {3: np.full(len(trial["t"]), 1700.0)}))
    assert [one.kind for one in draft.actuators] == ["propeller_rudder"]
    assert "C3 is 1700 us throughout: how it acts does not show in this log" in doubts(draft)
    np.testing.assert_allclose(columns_of(tmp_path, draft)["n_cmd_propeller"], 500.0)
    (tmp_path / "boat.bin").write_bytes(ardupilot(trial, stated, outputs | {3: np.full(len(trial["t"]), 1500.0)}))
    told = r"no field looks like an actuator.*SERVO3_FUNCTION = 70 \(Throttle\), but C3 of /RCOU never changes.*Fix: record"
    with pytest.raises(FerryIdError, match=told):
        draft_profile(tmp_path / "boat.bin")


def test_outputs_beyond_the_fourteenth(trial: Columns, tmp_path: Path) -> None:
    stated = BOAT | RUDDER | servo(17, 70, 1100, 1500, 1900)
    outputs = {1: both(trial, RUDDER | PROPELLER)[1], 17: pulses(trial["n"] / 1000.0, stated, 17)}
    draft = drafted(tmp_path, ardupilot(trial, stated, outputs))
    speed = next(one for one in draft.every if one.quantity == "propeller.speed.command")
    assert (speed.topic, speed.fields) == ("/RCO2", ("C17",))
    np.testing.assert_allclose(columns_of(tmp_path, draft)["n_cmd_propeller"], trial["n"], atol=1.3)


def test_rotors_of_px4_are_where_their_parameters_state(trial: Columns, tmp_path: Path) -> None:
    stated: dict[str, float] = {"CA_AIRFRAME": 7, "CA_ROTOR_COUNT": 3}
    axes = ((1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    for k, (place, axis) in enumerate(zip(((-1.2, -0.4), (-1.2, 0.4), (0.9, 0.0)), axes, strict=True)):
        stated |= {f"CA_ROTOR{k}_P{letter}": value for letter, value in zip("XY", place, strict=True)}
        stated |= {f"CA_ROTOR{k}_A{letter}": value for letter, value in zip("XYZ", axis, strict=True)}
    orders = {"1": trial["n"] / 1000.0, "2": trial["n"] / 1200.0, "3": trial["rudder"]}
    draft = drafted(tmp_path, px4(trial, parameters=stated, motors=orders, servos={}), "boat.ulg")
    assert [(one.name, one.kind, one.placement.position_m) for one in draft.actuators] == [
        ("motor1", "propeller", (-1.2, -0.4)), ("motor2", "propeller", (-1.2, 0.4)), ("motor3", "tunnel", (0.9, 0.0)),
    ]  # fmt: skip
    assert not any(one.key.endswith(("x_m", "y_m")) for one in questions(draft))
    text = text_of(draft)
    assert "# CA_ROTOR0_PX = -1.2, CA_ROTOR0_PY = -0.4, from the centre of gravity.\n" in text
    assert "position_m = [-1.2, 0.4]\n" in text
    parse_profile(text, "boat.toml")
    # A rover's places of motors mean nothing.
    draft = drafted(tmp_path, px4(trial, parameters=stated | {"CA_AIRFRAME": 6}, motors=orders, servos={}), "boat.ulg")
    assert all(one.placement.position_m is None for one in draft.actuators)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"CA_ROTOR_COUNT": 3}, "CA_ROTOR_COUNT = 3, but the order of motor 3 never changes"),
        ({"CA_ROTOR_COUNT": 1}, "CA_ROTOR_COUNT = 1, yet the order of motor 2 changes: its place is not stated"),
        ({"CA_ROTOR1_PX": -1.0, "CA_ROTOR1_PY": -0.5}, "put several motors in one place"),
        ({"CA_ROTOR1_AX": 0.0, "CA_ROTOR1_AY": 0.0, "CA_ROTOR1_AZ": -1.0}, "an axis that points up or down"),
    ],
)
def test_rotors_of_px4_that_contradict_the_log(
    trial: Columns,
    tmp_path: Path,
    changes: dict[str, float],
    told: str,
) -> None:
    stated: dict[str, float] = {"CA_AIRFRAME": 9, "CA_ROTOR_COUNT": 2}
    for k, y in enumerate((-0.5, 0.5)):
        stated |= {f"CA_ROTOR{k}_PX": -1.0, f"CA_ROTOR{k}_PY": y}
        stated |= {f"CA_ROTOR{k}_AX": 1.0, f"CA_ROTOR{k}_AY": 0.0, f"CA_ROTOR{k}_AZ": 0.0}
    orders = {"1": trial["n"] / 1000.0, "2": trial["n"] / 1200.0}
    plain = drafted(tmp_path, px4(trial, parameters=stated, motors=orders, servos={}), "boat.ulg")
    assert told not in doubts(plain)
    assert not plain.remarks
    draft = drafted(tmp_path, px4(trial, parameters=stated | changes, motors=orders, servos={}), "boat.ulg")
    assert told in doubts(draft)
    assert told in text_of(draft)


def test_a_number_of_rotors_that_px4_cannot_have_is_not_counted_through(trial: Columns, tmp_path: Path) -> None:
    stated: dict[str, float] = {"CA_AIRFRAME": 9, "CA_ROTOR_COUNT": 100_000}
    draft = drafted(tmp_path, px4(trial, parameters=stated, servos={}), "boat.ulg")
    assert len(draft.remarks) == 11
    assert "CA_ROTOR_COUNT = 100000, but the order of motor 12 never changes" in draft.remarks[-1]


def test_a_motor_of_px4_that_a_servo_turns_is_no_tunnel_thruster(trial: Columns, tmp_path: Path) -> None:
    stated: dict[str, float] = {"CA_AIRFRAME": 9, "CA_ROTOR_COUNT": 2, "CA_SV_CS_COUNT": 0}
    for k, axis in enumerate(((0.0, 1.0, 0.0), (1.0, 0.0, 0.0))):
        stated |= {f"CA_ROTOR{k}_A{letter}": value for letter, value in zip("XYZ", axis, strict=True)}
    motors, servos = {"1": trial["n"] / 1e3, "2": trial["n"] / 2e3}, {"1": trial["rudder"], "2": -trial["rudder"]}
    draft = drafted(tmp_path, px4(trial, parameters=stated, motors=motors, servos=servos), "boat.ulg")
    assert [one.kind for one in draft.actuators] == ["azimuth", "azimuth"]
    parse_profile(text_of(draft), "boat.toml")


def test_the_servo_of_px4_that_is_a_rudder(trial: Columns, tmp_path: Path) -> None:
    servos = {"1": np.sin(trial["t"]), "2": trial["rudder"] / 0.7}
    draft = drafted(tmp_path, px4(trial, servos=servos), "boat.ulg")
    assert [one.kind for one in draft.actuators] == ["propeller"]
    stated: dict[str, float] = {"CA_SV_CS0_TYPE": 9, "CA_SV_CS1_TYPE": 4}
    draft = drafted(tmp_path, px4(trial, servos=servos, parameters=stated), "boat.ulg")
    assert [one.kind for one in draft.actuators] == ["propeller_rudder"]
    rudder = next(one for one in draft.every if one.quantity == "motor1.rudder.command")
    assert rudder.fields == ("control[1]",)
    assert "CA_SV_CS1_TYPE = 4 (Rudder)" in rudder.evidence


def test_rudders_of_px4_that_have_no_motor_of_their_own_are_named(trial: Columns, tmp_path: Path) -> None:
    servos = {"1": trial["rudder"], "2": -trial["rudder"]}
    stated: dict[str, float] = {"CA_SV_CS0_TYPE": 4, "CA_SV_CS1_TYPE": 4}
    draft = drafted(tmp_path, px4(trial, servos=servos, parameters=stated), "boat.ulg")
    assert [one.kind for one in draft.actuators] == ["propeller"]
    assert [one.partition(",")[0] for one in draft.remarks] == [f"CA_SV_CS{k}_TYPE = 4 (Rudder)" for k in range(2)]
