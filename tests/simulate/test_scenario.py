"""Scenario files: the bundled ones are read, and each fault gets its line."""

from __future__ import annotations

from pathlib import Path

import pytest

from ferryid.errors import FerryIdError
from ferryid.simulate import list_scenarios, load_scenario, parse_scenario

GOOD = """schema = "ferryid.scenario/1"
vessel = "milliampere"
seed = 5
start = 2022-06-01T08:30:00.25Z

[path]
kind = "points"
points = [[10, 0, 0], [10, 5, 90]]
dwell_s = 20

[controller]
delta = 0.4
Kp = [100, 100, 400]

[environment.wind]
north_mps = -3.0

[sensors]
wind_rate_hz = 10

[sensors.noise]
velocity_mps = 0.02

[true_hull]
X_u = 1.2
"""


def test_bundled_scenarios():
    assert set(list_scenarios()) >= {"twelve-corner", "twelve-corner-wind", "four-corner", "crossing"}
    for name, title in list_scenarios().items():
        scenario = load_scenario(name)
        assert scenario.name == name
        assert scenario.title == title
    thesis = load_scenario("twelve-corner")
    assert (thesis.controller.delta, thesis.controller.sigma, thesis.duration_s) == (0.4, 0.4, 1440.0)


def test_every_key_arrives():
    scenario = parse_scenario(GOOD, "mine.toml")
    assert scenario.name == "mine"
    assert scenario.duration_s == 40.0
    assert scenario.start_ns == 1654072200250000000
    gains = scenario.controller.gains
    assert gains.Kp == (100.0, 100.0, 400.0)
    assert gains.Kd == type(gains)().Kd
    assert scenario.wind.north_mps == -3.0
    assert scenario.sensors.wind_rate_hz == 10.0
    assert scenario.sensors.noise.velocity_mps == 0.02
    assert scenario.true_hull == {"X_u": 1.2}
    assert scenario.path.at(25.0)[:2] == (10.0, 5.0)


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ("delta = 0.4", "delat = 0.4", 12, 'unknown key "delat" in [controller]. Did you mean "delta"?'),
        ("north_mps = -3.0", 'north_mps = "calm"', 16, "must be a number"),
        ('kind = "points"', 'kind = "twelve corner"', 7, 'Did you mean "twelve-corner"?'),
        ("points = [[10, 0, 0], [10, 5, 90]]", "points = [[10, 0]]", 8, "rows of [north_m, east_m, heading_deg]"),
        ("points = [[10, 0, 0], [10, 5, 90]]", "points = 3", 8, "rows of [north_m, east_m, heading_deg]"),
        ("dwell_s = 20", "dwell_s = 0", 9, "above 0"),
        ("seed = 5", "seed = -5", 3, "at least 0"),
        ("seed = 5", "duration_s = nan", 3, "above 0"),
        ("2022-06-01T08:30:00.25Z", '"noon"', 4, "date and time"),
        ("2022-06-01T08:30:00.25Z", "1022-06-01T08:30:00Z", 4, "between 2000 and 2100"),
        ("[100, 100, 400]", "[100, 100, -400]", 13, "at least 0"),
        ("[100, 100, 400]", "[100, 100]", 13, "3 numbers"),
        ("north_mps = -3.0", "north_mps = -1e300", 16, "at least -60 and at most 60"),
        ("wind_rate_hz = 10", "imu_rate_hz = 1e9", 19, "at most 1000"),
        ("dwell_s = 20", "rounds = 1000000000", 9, "at most 1000"),
        ("dwell_s = 20", "dwell_s = 14000", 6, "Fix: set duration_s"),
        ("X_u = 1.2", "m11 = 0", 25, "at least 0.1"),
        ("velocity_mps = 0.02", "white_share = 2", 22, "at most 1"),
        ("X_u = 1.2", "Xu = 1.2", 25, 'unknown key "Xu" in [true_hull]. Did you mean "X_u"?'),
        ("[true_hull]", "[true_hul]", 24, 'Did you mean "true_hull"?'),
        ("ferryid.scenario/1", "ferryid.vessel/1", 1, '"schema" cannot be'),
        ('vessel = "milliampere"', "", 1, 'lacks "vessel"'),
        ("[environment.wind]", "[environment.wnid]", 15, 'Did you mean "wind"?'),
    ],
)
def test_a_fault_is_said_in_one_line_with_its_place(old, new, line, words):
    assert old in GOOD
    with pytest.raises(FerryIdError) as raised:
        parse_scenario(GOOD.replace(old, new), "mine.toml")
    message = str(raised.value)
    assert message.startswith(f"mine.toml:{line}: ")
    assert words in message
    assert "\n" not in message


def test_no_path_no_trial():
    with pytest.raises(FerryIdError, match=r'lacks "path"'):
        parse_scenario('schema = "ferryid.scenario/1"\nvessel = "milliampere"\n', "mine.toml")


def test_not_toml():
    with pytest.raises(FerryIdError, match=r"^mine.toml: not valid TOML, .*line 2"):
        parse_scenario("seed = 1\nschema = \n", "mine.toml")


def test_a_name_that_is_no_scenario(tmp_path: Path):
    with pytest.raises(FerryIdError, match=r'Did you mean "twelve-corner"\?'):
        load_scenario("twelve-corners")
    with pytest.raises(FerryIdError, match="No such file"):
        load_scenario(tmp_path / "absent.toml")
    (tmp_path / "latin.toml").write_bytes(b'title = "\xe6"')
    with pytest.raises(FerryIdError, match="UTF-8"):
        load_scenario(tmp_path / "latin.toml")
