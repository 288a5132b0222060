"""Topics that carry several signals: which of their messages hold which."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.signals.prepare import open_track
from ferryid.signals.recording import record
from ferryid.vessel import check_profile, describe, parse_profile

PROFILE = """schema = "ferryid.vessel/1"
name = "boat"
source = "made up"

[hull]
length_m = 1.0
mass_kg = 13.0
inertia_z = 1.0

[[actuator]]
name = "left"
kind = "force"
position_m = [-0.5, -0.1]

[[actuator]]
name = "right"
kind = "force"
position_m = [-0.5, 0.1]

[signals.velocity]
topic = "/nav"
fields = ["u", "v"]
unit = "m/s"
frame = "FRD"

[signals.yaw_rate]
topic = "/nav"
field = "r"
unit = "rad/s"
frame = "FRD"

[signals."left.force.command"]
topic = "/motors"
field = "data"
unit = "N"
where = { device = 10, id = 5 }

[signals."right.force.command"]
topic = "/motors"
field = "data"
unit = "N"
where = { id = 3, device = 10 }
"""


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """Give a folder of tables: orders of both motors take turns on one topic, beside those of another device."""
    folder = tmp_path / "log"
    folder.mkdir()
    t = np.arange(0.0, 60.0, 0.1)
    nav = "".join(
        f"{one:.2f},{1 + 0.1 * np.sin(one):.4f},{0.1 * np.sin(2 * one):.4f},{0.1 * np.cos(one):.4f}\n" for one in t
    )
    (folder / "nav.csv").write_text(f"t,u,v,r\n{nav}", encoding="utf-8")
    rows = [
        f"{one + 0.01 * k:.2f},{device},{number},{value:.3f}\n"
        for one in t
        for k, (device, number, value) in enumerate(((10, 5, one), (10, 3, -one), (11, 5, 999.0)))
    ]
    (folder / "motors.csv").write_text(f"t,device,id,data\n{''.join(rows)}", encoding="utf-8")
    return folder


def test_each_signal_has_its_own_messages(log: Path, tmp_path: Path) -> None:
    profile = parse_profile(PROFILE, "boat.toml")
    for _ in range(2):  # read, and then from the cache
        found = record(log, profile, tmp_path / "out")
        left = found.streams["/motors where device = 10 and id = 5"]
        right = found.streams["/motors where device = 10 and id = 3"]
        assert left.columns["F_cmd_left"] == pytest.approx(np.arange(0.0, 60.0, 0.1), abs=1e-3)
        assert right.columns["F_cmd_right"] == pytest.approx(-np.arange(0.0, 60.0, 0.1), abs=1e-3)
        assert left.time_ns[0] != right.time_ns[0]
    track = open_track(str(log), profile, None).track
    assert np.allclose(track.columns["F_cmd_left"], -track.columns["F_cmd_right"], atol=0.11)


def test_a_range_of_such_a_log(log: Path) -> None:
    found = record(log, parse_profile(PROFILE, "boat.toml"), ranges=((10, 20),))
    assert found.streams["/motors where device = 10 and id = 5"].columns["F_cmd_left"].max() < 20.1


def test_no_message_of_that_kind(log: Path) -> None:
    profile = parse_profile(PROFILE.replace("id = 3", "id = 4"), "boat.toml")
    with pytest.raises(
        FerryIdError, match=r"right\.force\.command is needed .* device = 10 and id = 4 holds no row\. Fix:"
    ):
        record(log, profile)
    # Where it may be missed, it is.
    both = PROFILE + '\n[signals."left.force"]\ntopic = "/motors"\nfield = "data"\nunit = "N"\nwhere = { id = 7 }\n'
    found = record(log, parse_profile(both, "boat.toml"))
    assert found.missing["left.force"] == "/motors where id = 7 holds no row"
    assert "F_left" not in found.found


def test_a_field_that_the_topic_lacks(log: Path) -> None:
    with pytest.raises(FerryIdError, match=r'found no field "ident" in /motors'):
        record(log, parse_profile(PROFILE.replace("{ id = 3", "{ ident = 3"), "boat.toml"))


def test_a_signal_that_may_be_missed_is_chosen_by_a_field_that_the_topic_lacks(log: Path) -> None:
    other = '\n[signals."left.force"]\ntopic = "/motors"\nfield = "data"\nunit = "N"\nwhere = { devise = 7 }\n'
    found = record(log, parse_profile(PROFILE + other, "boat.toml"))
    assert found.missing["left.force"].startswith('found no field "devise" in /motors')
    assert found.missing["left.force"].endswith('Did you mean "device"?')
    assert "F_left" not in found.found


@pytest.mark.parametrize(
    ("where", "told"),
    [
        ("{ }", '"where" names no field. Fix: where = { MsgID = 5 }'),
        ('{ id = "a" }', '"id" must be a number'),
        ("5", '"where" must be a table'),
        ("{ device = 10, id = 5 }", 'is read from the field "data" of /motors, and so is left.force.command'),
    ],
)
def test_a_choice_with_a_fault(tmp_path: Path, where: str, told: str) -> None:
    path = tmp_path / "boat.toml"
    path.write_text(PROFILE.replace("{ id = 3, device = 10 }", where), encoding="utf-8")
    assert any(told in fault.message for fault in check_profile(path))


def test_a_profile_shows_its_choice() -> None:
    assert "/motors where device = 10 and id = 3: data" in describe(parse_profile(PROFILE, "boat.toml"))


def test_both_orders_of_a_real_boat_on_one_topic(shared_data: Callable[[str], Path]) -> None:
    log = shared_data("aauship/aauship_control_2017-05-25-13-58-03.bag")
    text = PROFILE.replace("/nav", "/kf_statesnew").replace("/motors", "/lli_input").replace('"data"', '"Data"')
    text = text.replace("device =", "DevID =").replace("id =", "MsgID =")
    found = record(log, parse_profile(text, "aauship.toml"))
    sizes = [len(found.streams[f"/lli_input where DevID = 10 and MsgID = {one}"].time_ns) for one in (3, 5)]
    assert sizes == [2301, 2301]
