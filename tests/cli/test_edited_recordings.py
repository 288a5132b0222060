"""Recordings with one thing wrong in them, through the command line: each has a clear outcome, and nothing is left behind."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from ferryid.identify.excitation import still_axes
from ferryid.models.forces import motion_force
from ferryid.models.store import load_file
from ferryid.vessel import applied_force, load_profile
from tests.cli.recordings import Table, corners, profile, write
from tests.cli.test_bad_input import drawn, refused
from tests.cli.test_every_command import conforms
from tests.identify.rounds import PROFILE, motion

CURRENT = "\n[environment.current]\nnorth_mps = 0.4\neast_mps = 0.0\n"


def exchanged(table: Table) -> None:
    for quantity in ("speed [rpm]", "azimuth [deg]"):
        first, second = f"thruster1 {quantity}", f"thruster2 {quantity}"
        table[first], table[second] = table[second], table[first]


def mirrored(*columns: str) -> object:
    def edit(table: Table) -> None:
        for name in columns:
            table[name] = -table[name]

    return edit


def turned_round(table: Table) -> None:
    table["heading [deg]"] = (table["heading [deg]"] + 180.0) % 360.0


def anticlockwise(table: Table) -> None:
    table["heading [deg]"] = -table["heading [deg]"] % 360.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("edit", "parts"),
    [
        (exchanged, ("the yaw moment accelerates the vessel", "actuators are exchanged", "exchange the signals")),
        (
            mirrored("v [m/s]"),
            (
                "contradict",
                "sway velocity has the wrong sign",
                "the other of FRD and FLU as frame in [signals.velocity]",
            ),
        ),
        (mirrored("v [m/s]", "r [deg/s]"), ("contradict", "yaw rate has the wrong sign")),
        (
            # The whole motion is consistent, and its mirror image: the actuators alone show it.
            mirrored("v [m/s]", "r [deg/s]", "east [m]", "heading [deg]"),
            ("the sway force accelerates the vessel", "y axes that point to opposite sides", 'frame = "FLU"'),
        ),
        (
            turned_round,
            (
                "contradict",
                "surge velocity has the wrong sign against the position",
                "turn the heading by 180 deg with offset in [signals.heading]",
            ),
        ),
        (
            anticlockwise,
            (
                "contradict",
                "yaw rate has the wrong sign against the heading",
                "counts anticlockwise: change frame or sign in [signals.yaw_rate] or [signals.heading]",
            ),
        ),
    ],
    ids=[
        "thrusters exchanged",
        "sway mirrored",
        "sway and yaw mirrored",
        "all mirrored",
        "turned round",
        "anticlockwise",
    ],
)
def test_a_fit_refuses_with_the_cause_and_leaves_no_model(
    ferryid, tmp_path: Path, edit, parts: tuple[str, ...]
) -> None:
    table = corners()
    edit(table)
    log, out = write(table, tmp_path / "edited.csv"), tmp_path / "out"
    run = ferryid("fit", log, "--vessel", profile(tmp_path), "--out", out)
    refused(run, "edited", *parts)
    assert [one["name"] for one in drawn(run, out)["logs"]] == ["edited"]


@pytest.mark.slow
def test_speeds_declared_in_too_large_a_unit_are_refused(ferryid, tmp_path: Path) -> None:
    log, out = write(corners(), tmp_path / "corners.csv"), tmp_path / "out"
    vessel = profile(tmp_path, ('unit = "rpm"', 'unit = "rad/s"'))
    run = ferryid("fit", log, "--vessel", vessel, "--out", out)
    refused(run, "several times too large", "1 rad/s is 9.55 rpm")
    drawn(run, out)


@pytest.mark.slow
def test_speeds_in_rad_per_second_declared_as_rpm_are_told_and_not_accepted(ferryid, tmp_path: Path) -> None:
    table = corners()
    for number in (1, 2):
        table[f"thruster{number} speed [rpm]"] /= 9.55
    log = write(table, tmp_path / "slow.csv")
    run = ferryid(
        "fit", log, "--vessel", profile(tmp_path), "--components", "8", "--no-report", "--out", tmp_path / "out",
        "--json", "-",
    )  # fmt: skip
    assert run.code == 0, run.err
    result = conforms(run.out)
    assert not result["model"]["accepted"]
    assert not result["model"]["current"]
    assert any(
        "The applied force is a small part" in warning and "1 rad/s is 9.55 rpm" in warning
        for warning in result["warnings"]
    )


@pytest.mark.slow
def test_velocities_over_ground_in_a_current_come_with_a_warning(ferryid, tmp_path: Path) -> None:
    log = write(corners(CURRENT), tmp_path / "tide.csv")
    run = ferryid(
        "fit", log, "--vessel", profile(tmp_path), "--components", "8", "--no-report", "--out", tmp_path / "out",
        "--json", "-",
    )  # fmt: skip
    assert run.code == 0, run.err
    result = conforms(run.out)
    assert result["excitation"]["heading_coverage"] < 0.5
    assert any("a steady wind or current could not be separated" in warning for warning in result["warnings"])
    assert not result["model"]["current"]
    # What pushes the vessel is no wind, and with so few headings it cannot be distinguished from one: none is given.
    assert "conditions" not in result
    assert any("No steady wind of single logs is estimated" in warning for warning in result["warnings"])


def straight() -> Table:
    """Return a log in which the same ferry goes straight ahead, with noise alone in sway and yaw."""
    table, rng = corners(), np.random.default_rng(0)
    t = table["time [s]"]
    n, boat = len(t), load_profile("milliampere")
    speed = 200.0 * np.sin(2.0 * np.pi * t / 40.0) + 300.0 * np.sign(np.sin(2.0 * np.pi * t / 97.0))
    ahead = np.zeros(n)
    columns = {"n_thruster1": speed, "n_thruster2": speed, "alpha_thruster1": ahead, "alpha_thruster2": ahead}
    tau, _ = applied_force(boat, columns, np.zeros((n, 3)))
    u, scale = np.zeros(n), {"delta": 1.0, "sigma": 1.3, "zeta": 1.0}
    for k in range(n - 1):
        drag = motion_force(boat, scale, np.zeros((1, 3)), np.array([[u[k], 0.0, 0.0]]), np.zeros(1))[0, 0]
        u[k + 1] = u[k] + 0.1 * (tau[k, 0] - drag) / (0.9 * boat.hull.M[0, 0])
    way = 0.1 * np.cumsum(u)
    table["north [m]"] = way * np.cos(np.radians(30.0)) + 0.01 * rng.standard_normal(n)
    table["east [m]"] = way * np.sin(np.radians(30.0)) + 0.01 * rng.standard_normal(n)
    table["heading [deg]"] = 30.0 + 0.05 * rng.standard_normal(n)
    table["u [m/s]"] = u + 0.01 * rng.standard_normal(n)
    table["v [m/s]"] = 0.01 * rng.standard_normal(n)
    table["r [deg/s]"] = 0.05 * rng.standard_normal(n)
    for number in (1, 2):
        table[f"thruster{number} speed [rpm]"] = speed
        table[f"thruster{number} azimuth [deg]"] = ahead
    return table


@pytest.mark.slow
@pytest.mark.parametrize("estimator", ["weak", "derivative"])
def test_an_axis_without_excitation_keeps_the_coefficients_of_the_base_model(
    ferryid, tmp_path: Path, estimator: str
) -> None:
    log = write(straight(), tmp_path / "straight.csv")
    options = ("--estimator", estimator, "--components", "18", "--no-report", "--out", tmp_path / "out", "--json", "-")
    run = ferryid("fit", log, "--vessel", profile(tmp_path), *options)
    assert run.code == 0, run.err
    result = conforms(run.out)
    for axis in ("sway", "yaw"):
        told = f"These logs do not excite {axis}: the vessel hardly moves there, and the base model's coefficients are kept."
        assert told in result["warnings"]
    model = load_file(Path(result["model"]["path"]))
    assert not model.theta[:, 1:].any()
    acting = {term for term, row in zip(model.terms, model.theta, strict=True) if row.any()}
    assert acting == {"u_dot", "u", "|u|u", "u^3"}


def test_an_axis_counts_by_its_part_of_the_kinetic_energy() -> None:
    made = motion(3, seconds=60.0)
    assert still_axes(PROFILE, [made]) == ()
    for axis in range(3):
        made.nu[:, axis] *= 1e-3
        assert still_axes(PROFILE, [made]) == (axis,)
        made.nu[:, axis] *= 1e3


@pytest.mark.slow
def test_ten_logs_of_twenty_seconds_are_fitted_as_one_and_are_too_little_to_accept(ferryid, tmp_path: Path) -> None:
    whole = corners()
    logs = []
    for number in range(10):
        rows = slice(450 * number, 450 * number + 200)
        logs.append(write({name: values[rows] for name, values in whole.items()}, tmp_path / f"part{number}.csv"))
    out = tmp_path / "out"
    options = ("--components", "4", "--no-report", "--out", out, "--json", "-")
    run = ferryid("fit", *logs, "--vessel", profile(tmp_path), *options)
    assert run.code == 0, run.err
    result = conforms(run.out)
    assert [one["name"] for one in result["logs"]] == [f"part{number}" for number in range(10)]
    assert not result["model"]["current"]
    reasons = " ".join(result["reasons"])
    assert "held-out data are" in reasons
    assert "give longer logs, or more of them" in reasons
    assert json.loads(Path(result["model"]["path"]).read_text(encoding="utf-8"))["training"]


@pytest.mark.slow
def test_left_and_right_exchanged_on_a_real_catamaran_are_refused(ferryid, shared_data, tmp_path: Path) -> None:
    names = ("48000_2016-02-11-10-52-07", "exp50_v_2016-02-11-11-12-11", "exp52_v_2016-02-11-11-14-28")
    logs = [shared_data(f"vtec_usv/{name}.bag") for name in names]
    text = load_profile("vtec-usv").text
    other = text.replace('"/left_thruster"', '"/other"').replace('"/right_thruster"', '"/left_thruster"')
    vessel = tmp_path / "exchanged.toml"
    vessel.write_text(other.replace('"/other"', '"/right_thruster"'), encoding="utf-8")
    run = ferryid("fit", *logs, "--vessel", vessel, "--components", "6", "--out", tmp_path / "out")
    refused(run, "the yaw moment accelerates the vessel", "actuators are exchanged (port and starboard")
    drawn(run, tmp_path / "out")
    # What a diagnosis finds beside them would be names of the wrong physics.
    run = ferryid("diagnose", *logs, "--vessel", vessel, "--out", tmp_path / "diagnosed")
    refused(run, "the yaw moment accelerates the vessel", "actuators are exchanged (port and starboard")
    assert not list((tmp_path / "diagnosed").glob("models/*"))
