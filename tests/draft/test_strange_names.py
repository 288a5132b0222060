"""Drafts from tables of single boats: numbered parts of vectors, a throttle beside a rudder, a compass beside iron."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ferryid.draft import draft_profile
from ferryid.draft.mapped import MappedSignal

Columns = dict[str, np.ndarray]


def sailed(seconds: float = 240.0) -> Columns:
    """Return a boat that turns both ways under its rudder, at 10 Hz, in NED, FRD and SI."""
    t = np.arange(0.0, seconds, 0.1)
    rudder = 0.4 * np.sign(np.sin(2.0 * np.pi * t / 31.0)) + 0.2 * np.sin(2.0 * np.pi * t / 47.0)
    throttle = 0.4 + 0.2 * np.sin(2.0 * np.pi * t / 60.0)
    r, psi = np.zeros_like(t), np.zeros_like(t)
    for k in range(len(t) - 1):
        r[k + 1] = r[k] + 0.1 * (1.2 * rudder[k] - 2.0 * r[k])
        psi[k + 1] = psi[k] + 0.1 * r[k]
    u = 1.0 + throttle
    north, east = (0.1 * np.cumsum(u * turn(psi)) for turn in (np.cos, np.sin))
    return {"t": t, "rudder": rudder, "throttle": throttle, "psi": psi, "r": r,
            "lat": 59.9 + north / 111_400.0, "lon": 10.7 + east / (111_400.0 * np.cos(np.radians(59.9)))}  # fmt: skip


def drafted(folder: Path, columns: Columns) -> dict[str, MappedSignal]:
    path = folder / "trial.csv"
    rows = zip(*columns.values(), strict=True)
    text = "\n".join([",".join(columns), *(",".join(f"{value:.12g}" for value in row) for row in rows)])
    path.write_text(text + "\n", encoding="utf-8")
    return {signal.quantity: signal for signal in draft_profile(path).every}


def pulses(share: np.ndarray) -> np.ndarray:
    return np.rint(1500.0 + 400.0 * share)


@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize("before", ["current_", ""])
def test_the_third_number_of_an_orientation_is_the_heading(tmp_path: Path, before: str, first: int) -> None:
    c = sailed()
    small = 2.0 * np.sin(c["t"])
    columns = {"time": c["t"], "lat": c["lat"], "lon": c["lon"], "n1": 800.0 + 300.0 * c["rudder"],
               "n2": 800.0 - 300.0 * c["rudder"], "current_speed": 1.0 + c["throttle"]}  # fmt: skip
    for name, turned in (("orientation", np.degrees(c["psi"]) % 360.0), ("rotational_velocities", np.degrees(c["r"]))):
        columns |= {f"{before}{name}_{first + k}": part for k, part in enumerate((small, -small, turned))}
    found = drafted(tmp_path, columns)
    assert found["heading"].fields == (f"{before}orientation_{first + 2}",)
    assert (found["heading"].unit, found["heading"].frame) == ("deg", "NED")
    assert found["yaw_rate"].fields == (f"{before}rotational_velocities_{first + 2}",)
    assert (found["yaw_rate"].unit, found["yaw_rate"].frame) == ("deg/s", "FRD")
    # n with a number is the speed of a propeller, by convention, and nothing says whether it was ordered.
    assert {name: found[name].unit for name in found if "." in name} == {
        "actuator1.speed": "rpm",
        "actuator2.speed": "rpm",
    }
    assert all("whether it is an order" in " ".join(found[f"actuator{k}.speed"].doubts) for k in (1, 2))


@pytest.mark.parametrize("name", ["current_heading", "current_speed"])
def test_a_current_of_the_water_is_no_motion_of_the_vessel(tmp_path: Path, name: str) -> None:
    c = sailed()
    columns = {"time": c["t"], "lat": c["lat"], "lon": c["lon"], name: np.full(c["t"].size, 0.3) + 0.01 * c["rudder"],
               "yaw": np.degrees(c["psi"]) % 360.0, "rudder": c["rudder"], "rpm": 900.0 * c["throttle"]}  # fmt: skip
    found = drafted(tmp_path, columns)
    assert found["heading"].fields == ("yaw",)
    assert "velocity" not in found


def test_a_velocity_to_north_and_east_is_no_position(tmp_path: Path) -> None:
    c = sailed()
    north, east = ((1.0 + c["throttle"]) * turn(c["psi"]) for turn in (np.cos, np.sin))
    columns = {"time": c["t"], "lat": c["lat"], "lon": c["lon"], "speed_n": north, "speed_e": east, "tau_N": c["rudder"],
               "yaw": np.degrees(c["psi"]) % 360.0, "rudder": c["rudder"], "rpm": 900.0 * c["throttle"]}  # fmt: skip
    found = drafted(tmp_path, columns)
    assert found["position"].fields == ("lat", "lon")
    assert found["velocity"].fields == ("speed_n", "speed_e")
    assert found["velocity"].frame == "NED"


def test_a_throttle_beside_a_rudder_drives_the_propeller_ahead_of_it(tmp_path: Path) -> None:
    c = sailed()
    columns = {"time": c["t"], "lat": c["lat"], "lon": c["lon"], "yaw": np.degrees(c["psi"]) % 360.0,
               "throttle_us": pulses(c["throttle"]), "rudder_us": pulses(c["rudder"])}  # fmt: skip
    found = drafted(tmp_path, columns)
    assert {name for name in found if "." in name} == {"propeller.speed.command", "propeller.rudder"}
    assert found["propeller.speed.command"].unit == "us"


def test_a_throttle_beside_a_propeller_with_a_name_is_left(tmp_path: Path) -> None:
    c = sailed()
    columns = {"time": c["t"], "lat": c["lat"], "lon": c["lon"], "yaw": np.degrees(c["psi"]) % 360.0,
               "throttle": c["throttle"], "rpm": 900.0 * c["throttle"], "rudder": c["rudder"]}  # fmt: skip
    assert {name for name in drafted(tmp_path, columns) if "." in name} == {"propeller.speed", "propeller.rudder"}


@pytest.mark.parametrize("beside", ["", "battery_voltage"])
def test_the_power_of_a_propeller_is_its_order_where_nothing_electric_is_recorded(tmp_path: Path, beside: str) -> None:
    c = sailed()
    columns = {"time": c["t"], "lat": c["lat"], "lon": c["lon"],
               "orientation_x": 0.01 * c["rudder"], "orientation_y": 0.01 * c["throttle"],
               "orientation_z": np.sin(0.5 * c["psi"]), "orientation_w": np.cos(0.5 * c["psi"]),
               "propeller_power": 60.0 * c["throttle"], "rudder_angle": np.degrees(c["rudder"])}  # fmt: skip
    if beside:
        columns[beside] = 24.0 - c["throttle"]
    found = drafted(tmp_path, columns)
    assert ("propeller.speed.command" in found) == (not beside)
    if not beside:
        assert found["propeller.speed.command"].unit == "%"
        assert any("states a power" in doubt for doubt in found["propeller.speed.command"].doubts)


def test_the_powers_of_two_motors_are_their_orders(tmp_path: Path) -> None:
    c = sailed()
    columns = {"time": c["t"], "lat": c["lat"], "lon": c["lon"], "yaw": np.degrees(c["psi"]) % 360.0,
               "left_motor_power": 60.0 + 30.0 * c["rudder"], "right_motor_power": 60.0 - 30.0 * c["rudder"]}  # fmt: skip
    assert {name for name in drafted(tmp_path, columns) if "." in name} == {
        "left_motor.speed.command",
        "right_motor.speed.command",
    }


@pytest.mark.parametrize("wrong", ["compass", "gyro"])
def test_the_course_tells_whether_the_heading_or_the_yaw_rate_is_wrong(tmp_path: Path, wrong: str) -> None:
    c, rng = sailed(), np.random.default_rng(3)
    noise = np.convolve(rng.standard_normal(c["t"].size + 49), np.ones(50) / 50.0, mode="valid")
    # Beside iron a compass shows little of a turn, and turns of its own.
    yaw = 0.5 * np.sin(c["psi"]) + 3.0 * noise if wrong == "compass" else c["psi"]
    rate = noise if wrong == "gyro" else -c["r"]
    columns = {"time": c["t"], "lat": c["lat"], "lon": c["lon"], "yaw": np.degrees(yaw) % 360.0, "gyro_z": rate,
               "rudder": c["rudder"], "rpm": 900.0 * c["throttle"]}  # fmt: skip
    found = drafted(tmp_path, columns)
    assert "yaw_rate" not in found
    told = next(doubt for doubt in found["heading"].doubts if doubt.startswith("no yaw rate of the log follows it"))
    assert ("the heading is wrong" in told) == (wrong == "compass")
