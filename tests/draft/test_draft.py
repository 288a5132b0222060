"""Profiles drafted from logs: what is mapped, in which unit, frame and sign, and what is left to a person."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ferryid import api
from ferryid.draft import Answers, Draft, Question, StatedWindow, draft_profile, draft_text, new_profile, questions
from ferryid.draft.actuators import UNKNOWN_ORDER, DraftedActuator
from ferryid.draft.draft import with_kind
from ferryid.draft.mapped import MappedSignal
from ferryid.draft.write import as_text
from ferryid.errors import FerryIdError
from ferryid.vessel import check_profile, load_profile, parse_profile
from ferryid.vessel.profile import Profile

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"
Columns = dict[str, np.ndarray]


def sailed(seconds: float = 240.0) -> Columns:
    """Return a trial in NED, FRD and SI: a boat whose two thrusters and rudder turn it, at 10 Hz."""
    t = np.arange(0.0, seconds, 0.1)
    rudder = 0.4 * np.sign(np.sin(2.0 * np.pi * t / 31.0)) + 0.2 * np.sin(2.0 * np.pi * t / 47.0)
    speed = 700.0 + 200.0 * np.sin(2.0 * np.pi * t / 60.0)
    u, v, r, psi, north, east = (np.zeros_like(t) for _ in range(6))
    for k in range(len(t) - 1):
        u[k + 1] = u[k] + 0.1 * (0.002 * speed[k] - 0.7 * u[k]) * 0.3
        r[k + 1] = r[k] + 0.1 * (0.8 * rudder[k] * u[k] - 2.0 * r[k])
        v[k + 1] = v[k] + 0.1 * (-0.5 * u[k] * r[k] - 0.8 * v[k])
        psi[k + 1] = psi[k] + 0.1 * r[k]
        north[k + 1] = north[k] + 0.1 * (u[k] * np.cos(psi[k]) - v[k] * np.sin(psi[k]))
        east[k + 1] = east[k] + 0.1 * (u[k] * np.sin(psi[k]) + v[k] * np.cos(psi[k]))
    return {"t": t, "rudder": rudder, "n": speed, "u": u, "v": v, "r": r, "psi": psi, "N": north, "E": east}


def table(folder: Path, columns: Columns) -> Path:
    """Write columns as a table."""
    path = folder / "trial.csv"
    rows = zip(*columns.values(), strict=True)
    text = "\n".join([",".join(columns), *(",".join(f"{value:.9g}" for value in row) for row in rows)])
    path.write_text(text + "\n", encoding="utf-8")
    return path


def drafted(folder: Path, columns: Columns) -> tuple[Draft, dict[str, MappedSignal]]:
    """Return the draft of a table, and its signals by their quantity."""
    draft = draft_profile(table(folder, columns))
    return draft, {signal.quantity: signal for signal in draft.every}


def wrapped_deg(angle: np.ndarray) -> np.ndarray:
    return np.degrees(angle) % 360.0


def in_ned(c: Columns) -> Columns:
    return {"t": c["t"], "N": c["N"], "E": c["E"], "psi": c["psi"], "u": c["u"], "v": c["v"], "r": c["r"],
            "rudder": c["rudder"], "rpm": c["n"]}  # fmt: skip


def in_degrees_and_knots(c: Columns) -> Columns:
    knots = 3600.0 / 1852.0
    return {"t": c["t"], "N": c["N"], "E": c["E"], "heading": wrapped_deg(c["psi"]), "u": c["u"] * knots, "v": c["v"] * knots,
            "r": np.degrees(c["r"]), "rudder": -np.degrees(c["rudder"]), "rpm": c["n"]}  # fmt: skip


def in_latitude_and_enu(c: Columns) -> Columns:
    over_n = c["u"] * np.cos(c["psi"]) - c["v"] * np.sin(c["psi"])
    over_e = c["u"] * np.sin(c["psi"]) + c["v"] * np.cos(c["psi"])
    longitude = 10.4 + c["E"] / (111_400.0 * np.cos(np.radians(63.4)))
    return {"t": c["t"], "latitude": 63.4 + c["N"] / 111_400.0, "longitude": longitude, "yaw": 0.5 * np.pi - c["psi"],
            "vx": over_e, "vy": over_n, "yaw_rate": -c["r"], "rudder": c["rudder"], "rpm": c["n"] / 60.0}  # fmt: skip


def in_flu(c: Columns) -> Columns:
    return {"t": c["t"], "N": c["N"], "E": c["E"], "psi": c["psi"], "u": c["u"], "v": -c["v"], "r": -c["r"],
            "rudder": c["rudder"], "rpm": c["n"]}  # fmt: skip


@pytest.mark.parametrize(
    ("recorded", "expected"),
    [
        (
            in_ned,
            {
                "position": ("m", "NED"),
                "heading": ("rad", "NED"),
                "velocity": ("m/s", "FRD"),
                "yaw_rate": ("rad/s", "FRD"),
            },
        ),
        (
            in_degrees_and_knots,
            {
                "position": ("m", "NED"),
                "heading": ("deg", "NED"),
                "velocity": ("kn", "FRD"),
                "yaw_rate": ("deg/s", "FRD"),
            },
        ),
        (
            in_latitude_and_enu,
            {
                "position": ("deg", "geodetic"),
                "heading": ("rad", "ENU"),
                "velocity": ("m/s", "ENU"),
                "yaw_rate": ("rad/s", "FLU"),
            },
        ),
        (
            in_flu,
            {
                "position": ("m", "NED"),
                "heading": ("rad", "NED"),
                "velocity": ("m/s", "FLU"),
                "yaw_rate": ("rad/s", "FLU"),
            },
        ),
    ],
)
def test_units_and_frames_show_in_the_motion(
    tmp_path: Path, recorded: Callable[[Columns], Columns], expected: dict[str, tuple[str, str]]
) -> None:
    _, found = drafted(tmp_path, recorded(sailed()))
    assert {name: (found[name].unit, found[name].frame) for name in expected} == expected
    assert all(found[name].evidence for name in expected)


def test_latitude_and_longitude_in_radians(tmp_path: Path) -> None:
    columns = in_latitude_and_enu(sailed())
    columns |= {name: np.radians(columns[name]) for name in ("latitude", "longitude")}
    _, found = drafted(tmp_path, columns)
    assert (found["position"].unit, found["velocity"].unit, found["velocity"].frame) == ("rad", "m/s", "ENU")


@pytest.mark.parametrize("names", [("lat", "long"), ("Lat", "Lng"), ("lat_deg", "lon_deg")])
def test_latitude_and_longitude_by_their_short_names(tmp_path: Path, names: tuple[str, str]) -> None:
    columns = in_latitude_and_enu(sailed())
    short = dict(zip(("latitude", "longitude"), names, strict=True))
    _, found = drafted(tmp_path, {short.get(name, name): values for name, values in columns.items()})
    assert (found["position"].fields, found["position"].frame) == (names, "geodetic")


def test_a_rudder_that_is_positive_to_port_has_its_sign_reversed(tmp_path: Path) -> None:
    _, found = drafted(tmp_path, in_degrees_and_knots(sailed()))
    assert (found["propeller.rudder"].sign, found["propeller.rudder"].unit) == (-1.0, "deg")
    assert any("positive turns to port" in one for one in found["propeller.rudder"].evidence)
    _, found = drafted(tmp_path, in_ned(sailed()))
    assert (found["propeller.rudder"].sign, found["propeller.rudder"].unit) == (1.0, "rad")
    assert (found["propeller.speed"].unit, found["propeller.speed"].fields) == ("rpm", ("rpm",))


def test_what_motion_does_not_show_is_to_be_checked(tmp_path: Path) -> None:
    columns = in_ned(sailed())
    named = {"N": "x", "E": "y"}
    _, found = drafted(tmp_path, {named.get(name, name): values for name, values in columns.items()})
    assert found["position"].frame == "NED"
    assert any("mirror image" in one for one in found["heading"].doubts)
    _, found = drafted(tmp_path, columns)
    assert not found["heading"].doubts
    assert any("order" in one for one in found["propeller.speed"].doubts)


def test_velocities_of_surge_sway_and_yaw_are_found_by_these_names(tmp_path: Path) -> None:
    c = in_ned(sailed())
    named = {"u": "surge_vel", "v": "sway_vel", "r": "yaw_vel", "psi": "yaw"}
    columns = {named.get(name, name): values for name, values in c.items()}
    step = np.gradient(c["t"])
    columns |= {f"{named[name]}_derivated": np.gradient(c[name]) / step for name in ("u", "v", "r")}
    _, found = drafted(tmp_path, columns)
    assert found["velocity"].fields == ("surge_vel", "sway_vel")
    assert found["yaw_rate"].fields == ("yaw_vel",)
    assert found["heading"].fields == ("yaw",)


def test_names_may_end_in_their_unit(tmp_path: Path) -> None:
    c = in_ned(sailed())
    named = {"N": "north_m", "E": "east_m", "u": "u_mps", "v": "v_mps"}
    _, found = drafted(tmp_path, {named.get(name, name): values for name, values in c.items()})
    assert (found["position"].fields, found["position"].frame) == (("north_m", "east_m"), "NED")
    assert found["velocity"].fields == ("u_mps", "v_mps")


def test_the_azimuth_of_a_positioning_system_is_no_thruster(tmp_path: Path) -> None:
    columns = in_ned(sailed())
    bearing = {"/usbl_data/azimuth": np.degrees(np.arctan2(columns["E"], columns["N"] + 30.0))}
    draft, _ = drafted(tmp_path, columns | bearing)
    assert [one.name for one in draft.actuators] == ["propeller"]


def test_an_order_written_as_one_word_with_its_rudder_is_found(tmp_path: Path) -> None:
    columns = {{"rudder": "cmdrudder"}.get(name, name): values for name, values in in_ned(sailed()).items()}
    _, found = drafted(tmp_path, columns)
    assert found["propeller.rudder.command"].fields == ("cmdrudder",)


def test_a_velocity_that_no_unit_explains_is_to_be_checked(tmp_path: Path) -> None:
    columns = in_ned(sailed())
    columns |= {"u": 1.4 * columns["u"], "v": 1.4 * columns["v"]}
    _, found = drafted(tmp_path, columns)
    assert any(re.search(r"1\.4\d? times the position's slope", one) for one in found["velocity"].doubts)
    assert any("; in m/s it is 1.4" in one for one in found["velocity"].evidence)
    assert any("their size is 1.4" in one for one in found["position"].evidence)


@pytest.mark.parametrize(("noise_m", "told"), [(0.01, False), (1.0, True)])
def test_a_unit_that_noise_may_have_made_is_to_be_checked(tmp_path: Path, noise_m: float, told: bool) -> None:
    c = in_ned(sailed())
    noise = noise_m * np.random.default_rng(5).normal(size=(2, len(c["t"])))
    columns = c | {"N": c["N"] + noise[0], "E": c["E"] + noise[1], "u": 3.6 * c["u"], "v": 3.6 * c["v"]}
    _, found = drafted(tmp_path, columns)
    assert found["velocity"].unit == "km/h"
    assert any("its unit follows from its size alone" in one for one in found["velocity"].doubts) == told
    plain = drafted(tmp_path, columns | {"u": c["u"], "v": c["v"]})[1]["velocity"]
    assert plain.unit == "m/s"
    assert not any("its unit follows" in one for one in plain.doubts)


def test_no_size_is_stated_of_a_velocity_that_does_not_agree(tmp_path: Path) -> None:
    c = in_ned(sailed())
    noise = np.random.default_rng(3).normal(size=(2, len(c["t"])))
    _, found = drafted(tmp_path, c | {"u": noise[0], "v": noise[1]})
    (position,), (velocity,) = found["position"].evidence, found["velocity"].evidence
    assert "does not explain" in position
    assert "size" not in position + velocity


def test_a_yaw_rate_that_does_not_follow_the_heading_is_named(tmp_path: Path) -> None:
    c = in_ned(sailed())
    noise = np.random.default_rng(4).normal(size=len(c["t"]))
    _, found = drafted(tmp_path, c | {"r": noise})
    assert "yaw_rate" not in found
    assert found["heading"].doubts == (
        "no yaw rate of the log follows it (table: r): none is mapped, and its slope stands for one",
    )


def test_the_velocity_that_agrees_is_taken_and_the_others_are_named(tmp_path: Path) -> None:
    c = sailed()
    noise = np.random.default_rng(1).normal(size=(4, len(c["t"])))
    columns = in_ned(c) | {"velx": noise[0], "vely": noise[1]}
    _, found = drafted(tmp_path, columns)
    assert found["velocity"].fields == ("u", "v")
    assert "of other velocities: table: velx, vely 0 %" in found["velocity"].evidence[0]


@pytest.mark.parametrize(
    ("columns", "told"),
    [
        (
            ("t", "N", "E", "u", "v", "rudder", "n"),
            "no field looks like a heading that changes.* Fix: record the heading",
        ),
        (
            ("t", "N", "E", "track", "still_cap", "track_ref", "n"),
            r"heading that changes, found .*table: still_cap; table: track: a course over ground, which differs from the "
            r"heading where the vessel drifts\. Fix: .* ferryid vessel show vtec-usv --toml",
        ),
        (("t", "N", "E", "psi", "u", "v", "r"), "no field looks like an actuator.* Fix: record the orders"),
        (("t", "level", "flag"), "no topic has a name of pose, velocity, heading or actuator"),
    ],
)
def test_a_log_that_lacks_what_is_needed(tmp_path: Path, columns: tuple[str, ...], told: str) -> None:
    c = sailed(60.0)
    c |= {"level": c["n"], "flag": c["u"], "track": c["psi"], "track_ref": c["psi"], "still_cap": 0.0 * c["t"]}
    with pytest.raises(FerryIdError, match=told):
        draft_profile(table(tmp_path, {name: c[name] for name in columns}))


def test_velocities_that_disagree_without_a_position(tmp_path: Path) -> None:
    c = sailed(60.0)
    noise = np.random.default_rng(1).normal(size=(4, len(c["t"])))
    columns = {"t": c["t"], "psi": c["psi"], "u": c["u"], "v": c["v"], "vx": noise[0], "vy": noise[1], "vn": noise[2],
               "ve": noise[3], "rpm": c["n"]}  # fmt: skip
    with pytest.raises(FerryIdError, match=r"velocities disagree, and no position decides.* Fix: choose a part"):
        draft_profile(table(tmp_path, columns))


def test_columns_without_names(tmp_path: Path) -> None:
    path = tmp_path / "bare.dat"
    path.write_text("".join(f"{0.1 * k:.1f} {k} {k * 2}\n" for k in range(100)), encoding="utf-8")
    with pytest.raises(FerryIdError, match=r"its columns have no names.* Fix: add a header row"):
        draft_profile(path)


def test_a_part_of_a_log(tmp_path: Path) -> None:
    columns = in_ned(sailed())
    late = columns["t"] > 120.0
    # In its second half, the velocity is that of another boat.
    columns |= {"u": np.where(late, -columns["u"], columns["u"])}
    path = table(tmp_path, columns)
    halves = [
        next(one for one in draft_profile(path, ranges=(part,)).every if one.quantity == "velocity")
        for part in ((0, 110), (130, 240))
    ]
    assert "explains 100 %" in halves[0].evidence[0]
    assert halves[1].doubts


def test_marked_lines_are_all_that_a_draft_lacks(tmp_path: Path) -> None:
    draft = draft_profile(FIXTURES / "short.mcap")
    text = draft_text(draft, Answers("boat"))
    path = tmp_path / "boat.toml"
    path.write_text(text, encoding="utf-8")
    faults = [fault.message for fault in check_profile(path)]
    assert faults
    assert all("lacks" in one for one in faults)
    path.write_text(text.replace("# FILL IN: ", ""), encoding="utf-8")
    assert [fault for fault in check_profile(path) if not fault.warning] == []


def test_a_check_counts_the_lines_that_are_still_marked(tmp_path: Path) -> None:
    path = tmp_path / "boat.toml"
    whole = api.check_vessel("milliampere")
    assert whole.json["fill_in"] == 0
    path.write_text(
        load_profile("gunnerus").text + "# FILL IN: [wind]\n# FILL IN: frontal_m2 = 2.0\n", encoding="utf-8"
    )
    found = api.check_vessel(path)
    assert (found.json["faults"], found.json["fill_in"]) == ([], 2)
    assert found.text.endswith("no faults\n2 lines marked FILL IN are not used")


def test_answers_complete_a_draft(tmp_path: Path) -> None:
    draft = draft_profile(FIXTURES / "short.mcap")
    asked = questions(draft)
    assert [one.key for one in asked][:5] == ["length_m", "beam_m", "mass_kg", "wind.frontal_m2", "wind.lateral_m2"]
    values = {
        one.key: {"length_m": "5", "beam_m": "2.8", "mass_kg": "1670", "thruster2.x_m": "-1.8"}.get(one.key, "1.8")
        for one in asked
    }
    profile = parse_profile(draft_text(draft, Answers("boat", values)), "boat.toml")
    assert profile.hull.mass_kg == 1670.0
    assert profile.wind is not None
    assert profile.wind.lateral_m2 == 1.8
    assert profile.actuators[1].position_m == (-1.8, 1.8)
    assert not any(Question("thruster1.full", "", "").accepts(one) for one in ("five", "0", "-3", "inf"))
    place, order = Question("thruster1.x_m", "", ""), Question("a.order", "", "")
    assert place.accepts("-1.8")
    assert (place.wanted, order.wanted) == ("a number without a unit", "order or measured")
    assert Question("a.order", "", "").accepts("order")


def test_a_propeller_with_a_rudder_is_asked_for_both(tmp_path: Path) -> None:
    draft, _ = drafted(tmp_path, in_ned(sailed()))
    values = {
        one.key: "-2" if one.key.endswith("x_m") else "measured" if one.key.endswith("order") else "1.5"
        for one in questions(draft)
    }
    profile = parse_profile(draft_text(draft, Answers("boat", values)), "boat.toml")
    assert (profile.actuators[0].kind, profile.actuators[0].rudder["x_m"]) == ("propeller_rudder", -2.0)
    assert profile.actuators[0].inflow["diameter_m"] == 1.5


def test_a_thrust_that_is_not_known_is_hinted_at_by_the_diameter(tmp_path: Path) -> None:
    draft, _ = drafted(tmp_path, in_ned(sailed()))
    # K_T 0.3 of a propeller of 84 mm in water of 1000 kg/m³: 0.3 * 1000 * 0.084^4 / 3600 N/rpm².
    text = draft_text(draft, Answers("boat", {"propeller.diameter_m": "0.084"}))
    hint = float(re.search(r"# FILL IN: ahead = (\S+)", text)[1])  # type: ignore[index]
    assert hint == pytest.approx(0.3 * 1000.0 * 0.084**4 / 3600.0, rel=0.05)


def test_beside_an_order_the_other_field_of_an_actuator_was_measured(tmp_path: Path) -> None:
    made = in_ned(sailed())
    made["rudder_command"] = np.roll(made["rudder"], -3)
    _, signals = drafted(tmp_path, made)
    assert UNKNOWN_ORDER not in signals["propeller.rudder"].doubts
    assert signals["propeller.rudder"].evidence[0] == "feedback, as another field of the actuator is the order"


def test_a_controller_that_ends_turns_does_not_exchange_the_sides(tmp_path: Path) -> None:
    # A boat that swings after gusts, and thrusters that push against its yaw rate after half a second.
    rng = np.random.default_rng(3)
    t = np.arange(0.0, 60.0, 0.1)
    gust, wiggle = (
        np.convolve(rng.normal(0.0, size, t.size), np.ones(rows) / rows, mode="same")
        for size, rows in ((3.0, 60), (2.0, 8))
    )
    r, psi, left, right = (np.zeros(t.size) for _ in range(4))
    for k in range(t.size - 1):
        push = -10.0 * r[max(k - 5, 0)] + wiggle[k]
        left[k], right[k] = 20.0 + push, 20.0 - push
        r[k + 1] = r[k] + 0.1 * ((left[k] - right[k]) * 0.05 + gust[k] - 0.5 * r[k])
        psi[k + 1] = psi[k] + 0.1 * r[k]
    left[-1], right[-1] = left[-2], right[-2]
    columns = {"t": t, "N": np.cumsum(np.cos(psi)) * 0.1, "E": np.cumsum(np.sin(psi)) * 0.1, "psi": psi, "r": r,
               "left_thrust": left, "right_thrust": right}  # fmt: skip
    draft, signals = drafted(tmp_path, columns)
    force = next(one for name, one in signals.items() if name.startswith("left."))
    # On the centre line, as the example of either was, they would turn no vessel.
    text = draft_text(draft, Answers("boat"))
    assert [line[:40] for line in text.splitlines() if "position_m" in line] == [
        "# FILL IN: position_m = [-2.0, -0.5]    ",
        "# FILL IN: position_m = [-2.0, 0.5]    #",
    ]
    assert {one.key: one.hint for one in questions(draft)}["left.y_m"] == "-0.5"
    assert any("turns to starboard" in one for one in force.evidence)
    assert not any("exchanged" in one for one in force.doubts)
    swapped = {**columns, "left_thrust": right, "right_thrust": left}
    _, signals = drafted(tmp_path, swapped)
    force = next(one for name, one in signals.items() if name.startswith("left."))
    assert any("exchanged" in one for one in force.doubts)


def test_a_heading_that_the_motion_does_not_show_is_to_be_checked(tmp_path: Path) -> None:
    made = sailed()
    astray = np.cumsum(np.where(np.arange(made["t"].size) % 400 < 200, 0.02, -0.023))
    columns = {"t": made["t"], "N": made["N"], "E": made["E"], "heading": np.degrees(astray) % 360.0, "rpm": made["n"]}
    _, signals = drafted(tmp_path, columns)
    assert "does not show its zero and sign" in signals["heading"].doubts[-1]
    assert "moves along" not in signals["heading"].evidence[0]
    _, signals = drafted(tmp_path, {**columns, "heading": np.degrees(made["psi"]) % 360.0})
    assert "the vessel moves along it" in signals["heading"].evidence[0]


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("u", 'fields = ["u"]'),
        ("speed", 'fields = ["speed"]'),
        ("speed_through_water", 'fields = ["speed_through_water"]'),
        ("linear.y", "no field"),
        ("depth", "no field"),
        ("motor_speed", "no field"),
        ("SpeedSet", "no field"),
        ("wind_speed", "no field"),
    ],
)
def test_a_draft_without_a_position_and_a_velocity_says_so(tmp_path: Path, name: str, told: str) -> None:
    columns = sailed()
    some = {"t": columns["t"], "psi": columns["psi"], name: columns["u"], "speed_setpoint": columns["u"]}
    draft, signals = drafted(
        tmp_path, some | {key: columns[key] for key in columns if key.startswith(("rpm", "rudder"))}
    )
    assert not {"position", "velocity"} & set(signals)
    (remark,) = draft.remarks
    assert remark.startswith("no position and no velocity is mapped, of which a fit needs one")
    assert told in remark
    assert any("(no course to compare)" in doubt for doubt in signals["heading"].doubts)


def test_columns_that_are_not_mapped_are_listed(tmp_path: Path) -> None:
    made = in_ned(sailed())
    draft, _ = drafted(tmp_path, {**made, "bow_temp": made["t"], "depth": made["u"]})
    assert draft.unused_fields == (("table", "bow_temp"), ("table", "depth"))
    text = draft_text(draft, Answers("boat"))
    assert "# Fields that are not mapped, of topics that are:\n#   table: bow_temp, depth\n" in text
    assert "  not mapped of table: bow_temp, depth\n" in as_text(draft, "vessel.toml", text)


def test_actuators_that_share_a_topic(tmp_path: Path) -> None:
    c = sailed(60.0)
    folder = tmp_path / "log"
    folder.mkdir()
    nav = np.column_stack([c[name] for name in ("t", "N", "E", "psi", "u", "v", "r")])
    orders = [
        f"{t + 0.01 * k:.2f},10,{number},{value:.1f}\n"
        for t, n, turn in zip(c["t"], c["n"], c["rudder"], strict=True)
        for k, (number, value) in enumerate(((5, n - 100.0 * turn), (3, n + 100.0 * turn), (9, 7.0)))
    ]
    np.savetxt(folder / "nav.csv", nav, "%.6g", ",", header="t,N,E,psi,u,v,r", comments="")
    (folder / "motors.csv").write_text("t,dev_id,msg_id,data\n" + "".join(orders), encoding="utf-8")
    draft = draft_profile(folder)
    assert [(one.name, one.kind) for one in draft.actuators] == [("msg3", "propeller"), ("msg5", "propeller")]
    text = draft_text(draft, Answers("boat")).replace("# FILL IN: ", "")
    signals = {signal.quantity: signal for signal in parse_profile(text, "boat.toml").signals}
    assert signals["msg3.speed.command"].where == (("dev_id", 10.0), ("msg_id", 3.0))


def test_orders_on_a_shared_topic_that_never_change_are_no_missing_orders(tmp_path: Path) -> None:
    c = sailed(60.0)
    folder = tmp_path / "log"
    folder.mkdir()
    nav = np.column_stack([c[name] for name in ("t", "N", "E", "psi", "u", "v", "r")])
    orders = [f"{t + 0.01 * number:.2f},10,{number},250.0\n" for t in c["t"] for number in (3, 5)]
    np.savetxt(folder / "nav.csv", nav, "%.6g", ",", header="t,N,E,psi,u,v,r", comments="")
    (folder / "motors.csv").write_text("t,dev_id,msg_id,data\n" + "".join(orders), encoding="utf-8")
    with pytest.raises(
        FerryIdError, match=r"nothing .* like an actuator ever changes, found /motors: data\. Fix: record while"
    ):
        draft_profile(folder)


def test_an_answer_makes_an_order_of_a_signal(tmp_path: Path) -> None:
    draft, _ = drafted(tmp_path, {**in_ned(sailed()), "delta_rudder [rad]": sailed()["rudder"]})
    text = draft_text(draft, Answers("boat", {"propeller.order": "order"}))
    assert '[signals."propeller.speed.command"]' in text


def test_like_another_profile_a_draft_is_whole(tmp_path: Path) -> None:
    known = load_profile("milliampere")
    draft = draft_profile(FIXTURES / "short.mcap", known)
    profile = parse_profile(draft_text(draft, Answers("twin")), "twin.toml")
    assert profile.actuators == known.actuators
    assert np.array_equal(profile.hull.M, known.hull.M)
    assert profile.wind == known.wind
    assert mapped(profile.signals) <= mapped(known.signals)


def test_like_a_vessel_of_forces_a_speed_is_a_force_and_an_angle_none(tmp_path: Path) -> None:
    text = re.sub(r"\[actuator\.thrust\](.|\n)*?(?=\n\[)", "", load_profile("milliampere").text)
    text = text[: text.index("[signals.position]")].replace('kind = "azimuth"', 'kind = "force"')
    forces = "".join(
        f'[signals."thruster{k}.force.command"]\ntopic = "/force{k}"\nfield = "data"\nunit = "N"\n' for k in (1, 2)
    )
    place = '[signals.position]\ntopic = "/pose"\nfields = ["x", "y"]\nunit = "m"\nframe = "NED"\n'
    heading = '[signals.heading]\ntopic = "/pose"\nfield = "psi"\nunit = "rad"\nframe = "NED"\n'
    known = parse_profile(text + place + heading + forces, "forces.toml")
    draft = draft_profile(FIXTURES / "short.mcap", known)
    # That it can be read is what is tested: a speed or an angle of a force is refused.
    profile = parse_profile(draft_text(draft, Answers("twin")), "twin.toml")
    found = {signal.quantity: signal for signal in profile.signals if signal.quantity.startswith("thruster")}
    assert set(found) == {f"thruster{k}.force{order}" for k in (1, 2) for order in ("", ".command")}
    assert {signal.unit for signal in found.values()} == {"N"}
    assert {signal.fields for signal in found.values()} == {("speed",)}
    assert "its field is called a speed: that it is the force is as in the profile milliampere" in draft_text(
        draft, Answers("twin")
    )


def test_like_a_vessel_of_forces_a_speed_beside_a_thrust_is_no_force() -> None:
    text = re.sub(r"\[actuator\.thrust\](.|\n)*?(?=\n\[)", "", load_profile("milliampere").text)
    text = (
        text.replace('kind = "azimuth"', 'kind = "force"')
        .replace(".speed", ".force")
        .replace('unit = "rpm"', 'unit = "N"')
    )
    known = parse_profile(re.sub(r'\[signals\."thruster..angle(.|\n)*?(?=\n\[)', "", text), "forces.toml")
    speed, thrust = (
        MappedSignal(f"thruster1.{what}", "/state", (what,), unit)
        for what, unit in (("speed", "rpm"), ("thrust.command", "kN"))
    )
    found = with_kind(DraftedActuator("thruster1", "propeller", (speed, thrust)), known)
    assert [(one.quantity, one.unit) for one in found.signals] == [("thruster1.force.command", "kN")]


def mapped(signals: tuple) -> set[tuple]:
    return {(s.quantity, s.topic, s.fields, s.unit, s.frame, s.sign, tuple(sorted(s.options.items()))) for s in signals}


def test_a_file_that_is_there_is_kept(tmp_path: Path) -> None:
    place = tmp_path / "vessel.toml"
    place.write_text("mine", encoding="utf-8")
    with pytest.raises(FerryIdError, match=r"vessel\.toml: is there already\. Fix: give --file"):
        api.new_vessel(FIXTURES / "short.mcap", file=place)
    assert place.read_text(encoding="utf-8") == "mine"
    result = api.new_vessel(FIXTURES / "short.mcap", "milliampere", file=place, overwrite=True)
    assert result.json["fill_in"] == 0
    assert load_profile(place).name == "fixtures"


def test_a_draft_that_is_whole_states_shorter_windows_where_the_log_needs_them(tmp_path: Path) -> None:
    asked: list[Profile] = []

    def windows(profile: Profile) -> StatedWindow:
        asked.append(profile)
        return StatedWindow(1.125, "Windows of 4.5 s keep 2 % in yaw.")

    def made(like: Profile | None, **more: object) -> str:
        return new_profile(
            str(FIXTURES / "short.mcap"), like, file=Path("-"), progress=lambda _: None, windows=windows, **more
        )[2]

    text = made(load_profile("milliampere"))
    assert "\n# Windows of 4.5 s keep 2 % in yaw.\nwindow_s = 1.1\n" in text
    assert parse_profile(text, "twin.toml").window_s == 1.1
    # Its length is not known before the lines of the hull are completed, and what --like states holds.
    assert "window_s" not in made(None)
    stated = load_profile("milliampere").text.replace('name = "milliampere"', 'name = "milliampere"\nwindow_s = 3.0', 1)
    assert "window_s = 3\n" in made(parse_profile(stated, "stated.toml"))
    assert len(asked) == 1


@pytest.mark.slow
def test_a_boat_that_zigzags_within_its_windows_is_drafted_with_shorter_ones(
    shared_data: Callable[[str], Path], tmp_path: Path
) -> None:
    log = sorted(shared_data("vtec_usv").glob("exp37_*.bag"))[0]
    like = re.sub(r"window_s = .*\n", "", load_profile("vtec-usv").text)
    text = api.new_vessel(log, parse_profile(like, "like.toml"), file=tmp_path / "x.toml").json["toml"]
    why = re.search(
        r"# Windows of 4.35 s, by its length, .* of the variance of the velocity in this log\.\nwindow_s = ", text
    )
    assert why is not None
    assert load_profile(tmp_path / "x.toml").window_s == pytest.approx(1.1, abs=0.1)


RECORDINGS = {
    "esso-osaka": "esso_osaka/*/*.csv",
    "gunnerus": "gunnerus/*.csv",
    "kvlcc2-model": "kvlcc2/HSVA*.dat",
    "milliampere-2025": "milliampere1",
    "vtec-usv": "vtec_usv/*.bag",
}


@pytest.mark.slow
@pytest.mark.parametrize("name", RECORDINGS)
def test_a_draft_maps_what_the_bundled_profile_maps(shared_data: Callable[[str], Path], name: str) -> None:
    """Topic, fields, unit, frame and sign; names of actuators, layouts and what are orders are the profile's."""
    folder, _, pattern = RECORDINGS[name].partition("/")
    root, known = shared_data(folder), load_profile(name)
    logs = sorted(root.glob(pattern)) if pattern else [root]
    assert logs
    for log in logs:
        draft = draft_profile(log, known)
        profile: Profile = parse_profile(draft_text(draft, Answers("drafted")), "drafted.toml")
        assert _bare(known) <= _bare(profile), log


def _bare(profile: Profile) -> set[tuple]:
    return {(quantity, topic.strip("/"), *rest) for quantity, topic, *rest in mapped(profile.signals)}


def test_names_that_say_nothing_are_told_what_the_motion_shows_of_them(tmp_path: Path) -> None:
    c = sailed()
    order = ("N", "E", "psi", "u", "v", "r", "n")
    columns = {"t": c["t"], **{f"col{k}": c[name] for k, name in enumerate(order)}}
    columns["col2"] = np.degrees(c["psi"]) % 360.0
    with pytest.raises(FerryIdError) as refused:
        draft_profile(table(tmp_path, columns))
    told = str(refused.value)
    assert "col5 follows the slope of col2" in told
    assert "col3 and col4, turned by col2, follow the slopes of col0 and col1" in told
    assert 'Fix: name the columns after what they are, as in "N [m]"' in told


def test_a_velocity_along_the_axes_of_the_position_leaves_open_which_is_the_heading(tmp_path: Path) -> None:
    t = np.arange(0.0, 120.0, 0.1)
    angle, rate = 0.1 * np.sin(0.3 * t), 0.03 * np.cos(0.3 * t)
    # A zigzag about north: what is turned by so little agrees as well as what is not, but for rounding.
    north, east = np.cumsum(0.1 * np.cos(angle)), np.cumsum(0.1 * np.sin(angle))
    columns = {
        "t": t,
        "col0": north,
        "col1": east,
        "col2": angle,
        "col3": np.cos(angle),
        "col4": np.sin(angle),
        "col5": rate,
    }
    with pytest.raises(FerryIdError) as refused:
        draft_profile(table(tmp_path, columns))
    for rate_of, slope_of in (("col3", "col0"), ("col4", "col1"), ("col5", "col2")):
        assert f"{rate_of} follows the slope of {slope_of}" in str(refused.value)
    assert "turned by" not in str(refused.value)


def two_thrusters(first: str, second: str) -> Columns:
    """Return a trial whose speed stands in two columns of these names."""
    c = sailed(60.0)
    return {"t": c["t"], "N": c["N"], "E": c["E"], "psi": c["psi"], "r": c["r"], first: c["n"] + 9.0 * c["rudder"],
            second: c["n"] - 9.0 * c["rudder"]}  # fmt: skip


@pytest.mark.parametrize(
    ("columns", "names"),
    [
        (("n_port", "n_stb"), ["port", "starboard"]),
        (("n_p", "n_s"), ["port", "starboard"]),
        (("thruster_p", "thruster_s"), ["port", "starboard"]),
        (("PWM port", "PWM stbd"), ["port", "starboard"]),
        (("thrust_sb", "thrust_port"), ["starboard", "port"]),
        (("rpm_l", "rpm_r"), ["left", "right"]),
        (("rpm_main", "rpm_auxiliary"), ["propeller_main", "propeller_auxiliary"]),
        # Once filtered and once as measured it is one propeller.
        (("rpm", "rpm_filtered"), ["propeller"]),
    ],
)
def test_two_thrusters_are_two_actuators(tmp_path: Path, columns: tuple[str, str], names: list[str]) -> None:
    draft, found = drafted(tmp_path, two_thrusters(*columns))
    assert [one.name for one in draft.actuators] == names
    assert found["yaw_rate"].fields == ("r",)


def test_of_two_propellers_with_one_rudder_the_first_keeps_it(tmp_path: Path) -> None:
    columns = two_thrusters("rpm_main", "rpm_auxiliary") | {"rudder": sailed(60.0)["rudder"]}
    _, found = drafted(tmp_path, columns)
    assert {one for one in found if "." in one} == {"propeller.speed", "propeller.rudder", "propeller_auxiliary.speed"}


def test_a_letter_is_a_side_only_beside_its_other_side(tmp_path: Path) -> None:
    draft, _ = drafted(tmp_path, {**in_ned(sailed()), "delta_r": sailed()["rudder"]})
    assert [one.name for one in draft.actuators] == ["propeller"]


@pytest.mark.parametrize("name", ["theta", "cap"])
def test_headings_of_other_tongues_beside_latitude_and_longitude(tmp_path: Path, name: str) -> None:
    c = in_latitude_and_enu(sailed())
    _, found = drafted(
        tmp_path, {**{each: c[each] for each in ("t", "latitude", "longitude", "rudder", "rpm")}, name: sailed()["psi"]}
    )
    assert found["heading"].fields == (name,)


@pytest.mark.parametrize(
    ("columns", "names"),
    [
        (("cmd_port", "cmd_stbd"), ["port", "starboard"]),
        (("thr_left", "thr_right"), ["left", "right"]),
        (("left_thr", "right_thr"), ["left", "right"]),
        (("motor_l", "motor_r"), ["left", "right"]),
        (("motl", "motr"), ["left", "right"]),
        (("cmdl", "cmdr"), ["left", "right"]),
        (("cmd_l", "cmd_r"), ["left", "right"]),
        (("servo1_raw", "servo3_raw"), ["output1", "output3"]),
        (("T1", "T2"), ["actuator1", "actuator2"]),
        (("u1", "u2"), ["actuator1", "actuator2"]),
        (("RCOU.C1", "RCOU.C3"), ["output1", "output3"]),
    ],
)
def test_what_may_be_an_order_to_a_thruster_is_drafted_as_one_to_be_checked(
    tmp_path: Path, columns: tuple[str, str], names: list[str]
) -> None:
    draft, found = drafted(tmp_path, two_thrusters(*columns))
    assert [one.name for one in draft.actuators] == names
    orders = [found[f"{name}.speed.command"] for name in names]
    assert all("a share of full power is assumed" in one.doubts[0] for one in orders)
    assert found["yaw_rate"].fields == ("r",)


@pytest.mark.parametrize("topic", ["thrusters/{}/cmd", "heron/thrusters/{}/input", "motor/{}", "{}/cmd"])
def test_a_topic_of_side_and_order_is_an_order_to_be_checked(tmp_path: Path, topic: str) -> None:
    c = sailed(60.0)
    np.savetxt(tmp_path / "nav.csv", np.column_stack([c[name] for name in ("t", "N", "E", "psi", "r")]), "%.6g", ",",
               header="t,N,E,psi,r", comments="")  # fmt: skip
    for side, share in (("port", c["n"] / 1000.0), ("starboard", c["n"] / 1100.0)):
        place = tmp_path / f"{topic.format(side)}.csv"
        place.parent.mkdir(parents=True, exist_ok=True)
        np.savetxt(place, np.column_stack([c["t"], share]), "%.6g", ",", header="t,data", comments="")
    draft = draft_profile(tmp_path)
    assert [one.name for one in draft.actuators] == ["port", "starboard"]
    assert all("a share of full power is assumed" in one.signals[0].doubts[0] for one in draft.actuators)


@pytest.mark.parametrize(
    ("more", "kept"),
    [
        # A temperature, a current, a network port, and one number alone.
        (("motor_l [degC]", "motor_r [degC]"), 1),
        (("motor_current_l", "motor_current_r"), 1),
        (("cmd_port", "cmd_vel"), 1),
        (("T1", "T2"), 1),
    ],
)
def test_beside_a_thruster_with_a_name_nothing_is_guessed(tmp_path: Path, more: tuple[str, str], kept: int) -> None:
    columns = two_thrusters(*more) | {"rpm": sailed(60.0)["n"]}
    draft, _ = drafted(tmp_path, columns)
    assert len(draft.actuators) == kept


def test_a_guessed_order_that_never_changes_is_left_out(tmp_path: Path) -> None:
    columns = two_thrusters("servo1_raw", "servo3_raw")
    columns |= {"servo2_raw": np.full(columns["t"].size, 1500.0)}
    draft, _ = drafted(tmp_path, columns)
    assert [one.name for one in draft.actuators] == ["output1", "output3"]


def test_columns_among_which_no_actuator_is_found_are_named(tmp_path: Path) -> None:
    with pytest.raises(FerryIdError, match=r"beside pose and velocity the columns left_knob, right_knob\. Fix"):
        drafted(tmp_path, two_thrusters("left_knob", "right_knob"))


def test_a_rudder_in_pulses_is_no_angle(tmp_path: Path) -> None:
    columns = sailed()
    columns["rudder"] = 1500.0 + 400.0 * columns["rudder"] / np.abs(columns["rudder"]).max()
    rudder = next(one for quantity, one in drafted(tmp_path, columns)[1].items() if ".rudder" in quantity)
    assert rudder.unit == "us"
    assert rudder.sign == 1.0
    assert any("full_deg is the angle at full travel" in one for one in rudder.doubts)


def test_a_step_of_time_is_no_rudder_and_what_never_changes_is_said_to(tmp_path: Path) -> None:
    columns = sailed()
    columns["delta_t"] = np.full_like(columns["t"], 0.1)
    columns["thrust_starboard"] = np.zeros_like(columns["t"])
    draft, signals = drafted(tmp_path, columns)
    assert not [one for one in draft.every if "delta_t" in one.fields]
    (thrust,) = (one for one in signals.values() if "thrust_starboard" in one.fields)
    assert "it never changes in this log: it is always 0" in thrust.doubts


@pytest.mark.parametrize(("most", "counts"), [(95.0, False), (500.0, True)])
def test_counts_beyond_a_hundred_are_said_to_be_no_per_cent(tmp_path: Path, most: float, counts: bool) -> None:
    columns = two_thrusters("PWM port", "PWM stbd")
    for name in ("PWM port", "PWM stbd"):
        columns[name] *= most / np.abs(columns[name]).max()
    draft, signals = drafted(tmp_path, columns)
    orders = [one for quantity, one in signals.items() if ".speed" in quantity]
    assert [one.unit for one in orders] == ["%", "%"]
    assert [any("counts of a motor driver" in doubt for doubt in one.doubts) for one in orders] == [counts, counts]
    # What the profile divides by is 100 in either case.
    assert draft_text(draft, Answers("boat")).count("# speed at a value of 100 [rpm]") == 2
