"""A plan as files: poses, legs of a mission, places on the earth."""

from __future__ import annotations

import json
from dataclasses import replace
from math import cos, pi, radians
from pathlib import Path

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.planning.limits import Limits
from ferryid.planning.plan import Chosen, Expected, Plan, Track
from ferryid.planning.steering import manoeuvres
from ferryid.planning.waypoints import NAV_WAYPOINT, as_csv, check_place, legs, mission, scenarios, turned, write_plan
from ferryid.simulate import parse_scenario
from ferryid.vessel import load_profile

SCENARIO = 'schema = "ferryid.scenario/1"\nvessel = "milliampere"\n[path]\nkind = "four-corner"\n'
CORNER = np.array([(0.0, 0, 0), (5, 0, 0), (10, 0, 0), (10, 5, pi / 2), (10, 10, pi / 2)], dtype=np.float64)


def a_plan() -> Plan:
    track = Track(
        CORNER, 2.0, Limits((2.0, 1.0, 0.3), (0.1, 0.1, 0.1), 25.0, 15.0), (60.0, 40.0), parse_scenario(SCENARIO, "p")
    )
    chosen = (Chosen("run", "ahead", 2.0, 6.0, 1.0), Chosen("turn", "about", 6.0, 10.0, 0.5))
    return Plan(
        load_profile("milliampere"), chosen, track, 10.0, (Expected("m11", "kg", 1.0, 3.0, 2.0, 1.0),), (), "usual", 2
    )


def steered() -> Plan:
    orders = manoeuvres(1.0)[0]
    chosen = (Chosen(orders.kind, orders.says, 0.0, 150.0, 1.0, parse_scenario(SCENARIO, "p"), orders),)
    return replace(a_plan(), track=None, chosen=chosen)


def test_rows_have_the_time_and_the_manoeuvre() -> None:
    rows = as_csv(a_plan()).splitlines()
    assert rows[0] == "time_s,north_m,east_m,heading_deg,manoeuvre"
    assert rows[1:] == ["0.00,0.000,0.000,0.00,0", "2.00,5.000,0.000,0.00,1", "4.00,10.000,0.000,0.00,1",
                        "6.00,10.000,5.000,90.00,2", "8.00,10.000,10.000,90.00,2"]  # fmt: skip
    assert as_csv(steered()).splitlines()[1] == "0.0,150.0,zigzag,500,10,10"


def test_a_bearing_turns_the_path_clockwise() -> None:
    # To starboard of east is south.
    assert turned(CORNER, pi / 2)[-1] == pytest.approx([-10.0, 10.0, pi])
    assert as_csv(a_plan(), pi / 2).splitlines()[2] == "2.00,0.000,5.000,90.00,1"


def test_legs_are_as_long_as_the_tolerance_allows() -> None:
    line = np.column_stack([np.arange(11.0), np.zeros(11), np.zeros(11)])
    assert legs(line, 0.1) == [(0, 10)]
    bent = line.copy()
    bent[5, 1] = 1.0
    assert legs(bent, 1.01) == [(0, 10)]
    assert legs(bent, 0.3) == [(0, 4), (4, 5), (5, 6), (6, 10)]
    turning = line.copy()
    turning[:, 2] = np.linspace(0.0, pi, 11)
    assert [end for _, end in legs(turning * [0, 0, 1], 1.0)][-1] == 10
    assert len(legs(turning * [0, 0, 1], 1.0)) == 1  # a steady turn is one leg of time
    assert legs(np.zeros((4, 3)), 0.1) == [(0, 3)]


def test_a_mission_has_places_speeds_and_headings() -> None:
    made = mission(a_plan().track, 0.0, (60.0, 10.0))
    assert (made["fileType"], made["version"], made["mission"]["plannedHomePosition"]) == ("Plan", 1, [60.0, 10.0, 0])
    items = made["mission"]["items"]
    assert [one["doJumpId"] for one in items] == list(range(1, len(items) + 1))
    last = [one for one in items if one["command"] == NAV_WAYPOINT][-1]["params"]
    # A minute of latitude is a nautical mile.
    assert (last[4] - 60.0) * 60.0 * 1853.0 == pytest.approx(10.0, rel=1e-3)
    assert (last[5] - 10.0) * 60.0 * 1853.0 * cos(radians(60.0)) == pytest.approx(10.0, rel=1e-3)
    assert last[3] == 90.0
    speeds = [one["params"][1] for one in items if one["command"] != NAV_WAYPOINT]
    assert speeds == [2.5]


def test_files_are_written_whole_and_not_replaced_unasked(tmp_path: Path) -> None:
    told = write_plan(a_plan(), tmp_path / "p", {"schema": "ferryid.plan/1"}, "<svg/>", origin=(60.0, 10.0))
    names = sorted(path.name for path in (tmp_path / "p").iterdir())
    assert names == ["plan.csv", "plan.json", "plan.svg", "plan.toml", "qgroundcontrol.plan"]
    assert sorted(Path(one).name for one in told["files"]) == names
    assert json.loads((tmp_path / "p" / "plan.json").read_text())["origin_deg"] == [60.0, 10.0]
    with pytest.raises(FerryIdError, match="--overwrite"):
        check_place(tmp_path / "p", None)
    # A plan of another kind leaves nothing of the one before.
    write_plan(steered(), tmp_path / "p", {"schema": "ferryid.plan/1"}, "<svg/>", overwrite=True)
    assert sorted(path.name for path in (tmp_path / "p").iterdir()) == [
        "plan-1.toml",
        "plan.csv",
        "plan.json",
        "plan.svg",
    ]


def test_a_place_that_is_none(tmp_path: Path) -> None:
    with pytest.raises(FerryIdError, match=r"--origin: latitude is -85 to 85 .* found 90,10"):
        check_place(tmp_path, (90.0, 10.0))


@pytest.mark.parametrize("bearing", [np.nan, np.inf, 1e300])
def test_a_bearing_that_is_none(tmp_path: Path, bearing: float) -> None:
    with pytest.raises(FerryIdError, match="--bearing: is -360 to 360 deg"):
        check_place(tmp_path, None, bearing_deg=bearing)


def test_what_is_no_plan_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "plan.toml").write_text("mine")
    with pytest.raises(FerryIdError, match=r"plan\.toml: cannot be replaced, found no plan beside it"):
        check_place(tmp_path, None, overwrite=True)


def test_a_generic_hull_leaves_no_scenario() -> None:
    assert scenarios(a_plan())
    assert scenarios(replace(a_plan(), generic_hull=True)) == {}
