"""``ferryid plan``: a trial that tells more than the usual one, its files, and input that makes none."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ferryid.simulate import load_scenario
from tests.cli.test_diagnose_input import refused
from tests.cli.test_every_command import conforms
from tests.command_line.in_process import Run

Command = Callable[..., Run]


@pytest.mark.slow
@pytest.mark.draws
def test_a_path_for_a_vessel_that_pushes_every_way(ferryid: Command, tmp_path: Path) -> None:
    words = (
        "plan",
        "--vessel",
        "milliampere",
        "--minutes",
        "6",
        "--area",
        "50x30",
        "--origin",
        "63.4,10.4",
        "--bearing",
        "90",
    )
    run = ferryid(*words, "--name", "milliampere", "--out", tmp_path, "--json", "-")
    assert run.code == 0, run.err
    found = conforms(run.out)
    assert found["duration_s"] <= 360.0
    assert found["mean_ratio"] < 0.8
    assert found["expected_ratio"] < 0.9
    names = {Path(one).name for one in found["files"]}
    assert names == {"plan.csv", "plan.toml", "plan.svg", "plan.json", "qgroundcontrol.plan"}
    assert json.loads((tmp_path / "plans" / "milliampere" / "plan.json").read_text()) == found
    rows = np.loadtxt(tmp_path / "plans" / "milliampere" / "plan.csv", delimiter=",", skiprows=1)
    # The longer side points east.
    assert np.abs(rows[:, 1]).max() <= 15.0
    assert np.abs(rows[:, 2]).max() <= 25.0
    scenario = load_scenario(tmp_path / "plans" / "milliampere" / "plan.toml")
    assert scenario.duration_s == pytest.approx(found["duration_s"])
    refused(ferryid(*words, "--out", tmp_path), "plan.csv", "--overwrite")


@pytest.mark.slow
@pytest.mark.draws
def test_orders_for_a_vessel_that_steers(ferryid: Command, tmp_path: Path) -> None:
    run = ferryid("plan", "--vessel", "vtec-usv", "--minutes", "2", "--out", tmp_path, "--json", "-")
    assert run.code == 0, run.err
    found = conforms(run.out)
    assert found["path"] is None
    assert [one["kind"] for one in found["manoeuvres"]]
    assert all(one["says"].endswith((" rpm", " N")) for one in found["manoeuvres"])
    # The simulator would not know the hull.
    assert found["generic_hull"]
    assert not list((tmp_path / "plans" / "vtec-usv").glob("*.toml"))
    refused(
        ferryid("plan", "--vessel", "vtec-usv", "--minutes", "2", "--area", "2x1", "--out", tmp_path / "b"),
        "--area: 2x1 m has no room for any manoeuvre of vtec-usv",
    )


@pytest.mark.parametrize(
    ("options", "parts"),
    [
        ((), ("--vessel: a plan is of a vessel, found none",)),
        (("--vessel", "milliampere", "--area", "60"), ("--area: is two numbers, found '60'",)),
        (("--vessel", "milliampere", "--area", "8x60"), ("no room for the turning circle", "15x15")),
        (("--vessel", "milliampere", "--minutes", "0.5"), ("--minutes: a plan takes 2 to 120 minutes, found 0.5",)),
        (("--vessel", "milliampere", "--minutes", "nan"), ("--minutes",)),
        (("--vessel", "milliampere", "--area", "nanxinf"), ("--area: has two sides above 0 m",)),
        (("--vessel", "milliampere", "--area", "0x0"), ("--area: has two sides above 0 m",)),
        (("--vessel", "milliampere", "--bearing", "inf"), ("--bearing: is -360 to 360 deg",)),
        (("--vessel", "milliampere", "--seed", "-1"), ("--seed: must be a whole number",)),
        (("--vessel", "vtec-usv", "--origin", "60,10"), ("vtec-usv steers and gets orders",)),
        (("--vessel", "milliampere", "--origin", "63"), ("--origin: is two numbers",)),
        (("--vessel", "milliampere", "--separate", "wind"), ("--separate: is two different effects",)),
        (("--vessel", "milliampere", "--separate", "wnd,current"), ('no effect "wnd"', 'Did you mean "wind"')),
        (("--vessel", "milliampere", "--separate", "thruster_gain(bow),wind"), ('no actuator "bow"', "thruster1")),
        (("--after", "absent.mcap"), ("absent.mcap", "no such file")),
        (("--vessel", "milliampere", "--from", "3"), ("--from, --to: select a part of recordings, found no --after",)),
        (("--vessel", "milliampere", "--name", "../x"), ("--name: '../x' cannot name a plan",)),
    ],
)
def test_input_that_makes_no_plan(
    ferryid: Command, tmp_path: Path, options: tuple[str, ...], parts: tuple[str, ...]
) -> None:
    refused(ferryid("plan", *options, "--out", tmp_path), *parts)
    assert not (tmp_path / "plans").exists()


def test_a_plan_that_is_there_stays_and_options_are_looked_at_first(ferryid: Command, tmp_path: Path) -> None:
    for name in ("milliampere", "tuesday"):
        (tmp_path / "plans" / name).mkdir(parents=True)
        (tmp_path / "plans" / name / "plan.csv").write_text("kept", encoding="utf-8")
    words = ("plan", "--vessel", "milliampere", "--out", tmp_path)
    refused(
        ferryid(*words),
        "milliampere/plan.csv: exists already. Fix: choose another name, or replace it with --overwrite",
    )
    refused(ferryid(*words, "--name", "tuesday"), "tuesday/plan.csv: exists already")
    refused(ferryid(*words, "--minutes", "0.5"), "--minutes: a plan takes")
    refused(ferryid(*words, "--separate", "wnd,current"), 'no effect "wnd"')
    assert (tmp_path / "plans" / "tuesday" / "plan.csv").read_text(encoding="utf-8") == "kept"
