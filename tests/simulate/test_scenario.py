"""Scenario files: the bundled ones are read and fit their vessels, and each fault gets its line."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from ferryid.errors import FerryIdError
from ferryid.simulate import list_scenarios, load_scenario, parse_scenario
from ferryid.simulate.check_scenario import vessel_of
from ferryid.simulate.scenario import Scenario, check_against, read_series
from ferryid.simulate.sections import Fault, Payload, Sensors, Wake
from ferryid.vessel import load_profile, parse_profile

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

[[payload]]
mass_kg = 200
from_s = 10
until_s = 30

[[payload]]
mass_kg = 80
x_m = -1.0

[environment.waves]
significant_height_m = 0.2

[[environment.wakes]]
at_s = 12
height_m = 0.3

[environment.shallow]
north_m = [5, 20]

[environment.mooring]
stiffness_north_Npm = 20
until_s = 15

[[thrusters.faults]]
thruster = "thruster2"
factor = 0.5
from_s = 25
until_s = 35

[guidance]
law = "carrot"
"""
GOOD = GOOD.replace("seed = 5\n", "seed = 5\nduration_s = 40\n")
HELM = """schema = "ferryid.scenario/1"
vessel = "milliampere"

[manoeuvre]
kind = "rpm-steps"
levels = [0.5, -0.5]
duration_s = 100
"""


@pytest.mark.parametrize("name", list_scenarios())
def test_bundled_scenarios_fit_their_vessels_and_can_be_fitted(name: str) -> None:
    scenario = load_scenario(name)
    assert scenario.name == name
    assert scenario.title == list_scenarios()[name]
    assert 20 < len(scenario.title) < 130
    check_against(scenario, load_profile(scenario.vessel))
    assert 400.0 <= scenario.duration_s <= 1440.0


@pytest.mark.slow
def test_every_phenomenon_has_a_scenario() -> None:
    """No section of the file is without a bundled scenario that uses it."""
    used: set[str] = set()
    for name in list_scenarios():
        used |= _beside_defaults("", load_scenario(name))
    for key in (
        *(".wind.gust_std_mps", ".current.turn_degpmin", ".waves.significant_height_m", ".wakes", ".payload"),
        *(".shallow.damping_factor", ".mooring.stiffness_north_Npm", ".fouling.surge"),
        *(".thrusters.faults", ".thrusters.inflow_loss_per_mps", ".thrusters.interaction_fraction", ".guidance.law"),
        *(".manoeuvre.kind", ".sensors.azimuth_step_deg", ".sensors.navigation.delay_s", ".sensors.payload_rate_hz"),
        *(".sensors.current_rate_hz", ".sensors.wind_rate_hz", ".sensors.thruster_clock_offset_ms"),
    ):
        assert key in used
    assert {load_scenario(name).guidance.law for name in list_scenarios()} == {
        *("set-points", "look-ahead", "enclosure", "carrot")
    }


def _beside_defaults(prefix: str, section: Any) -> set[str]:
    """Return the dotted names of all fields that differ from their default."""
    plain = Scenario("", "", "", section.path, 1.0, 0, 0) if isinstance(section, Scenario) else type(section)()
    found: set[str] = set()
    for entry in fields(section):
        value = getattr(section, entry.name)
        if is_dataclass(value) and entry.name != "path":
            found |= _beside_defaults(f"{prefix}.{entry.name}", value)
        elif value != getattr(plain, entry.name):
            found.add(f"{prefix}.{entry.name}")
    return found


def test_the_thesis_calibration() -> None:
    thesis = load_scenario("twelve-corner")
    assert (thesis.controller.delta, thesis.controller.sigma, thesis.duration_s) == (0.4, 0.4, 1440.0)
    gusty = load_scenario("twelve-corner-gusty")
    assert 5.5 < (gusty.wind.north_mps**2 + gusty.wind.east_mps**2) ** 0.5 < 6.5
    assert gusty.wind.north_mps < 0.0 < gusty.wind.east_mps
    assert gusty.sensors.wind_rate_hz == 0.0


def test_every_key_arrives() -> None:
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
    assert scenario.payload == (Payload(200.0, 0.0, 10.0, 30.0), Payload(80.0, -1.0))
    assert scenario.wakes == (Wake(at_s=12.0, height_m=0.3),)
    assert scenario.shallow.north_m == (5.0, 20.0)
    assert scenario.mooring.until_s == 15.0
    assert scenario.thrusters.faults == (Fault("thruster2", 0.5, 0.0, 25.0, 35.0),)
    assert scenario.guidance.law == "carrot"
    assert scenario.manoeuvre.kind == ""


def test_a_manoeuvre_takes_the_place_of_the_path() -> None:
    scenario = parse_scenario(HELM, "mine.toml")
    assert scenario.manoeuvre.levels == (0.5, -0.5)
    assert scenario.duration_s == 100.0
    assert parse_scenario("duration_s = 30\n" + HELM, "mine.toml").duration_s == 30.0


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ("delta = 0.4", "delat = 0.4", 13, 'unknown key "delat" in [controller]. Did you mean "delta"?'),
        ("north_mps = -3.0", 'north_mps = "calm"', 17, "must be a number"),
        ('kind = "points"', 'kind = "twelve corner"', 8, 'Did you mean "twelve-corner"?'),
        ('kind = "points"', 'kind = "crossing"', 9, '"points" belongs to kind = "points"'),
        ("points = [[10, 0, 0], [10, 5, 90]]", "points = [[10, 0]]", 9, "rows of [north_m, east_m, heading_deg]"),
        ("points = [[10, 0, 0], [10, 5, 90]]", "points = 3", 9, "rows of [north_m, east_m, heading_deg]"),
        ("[[10, 0, 0], [10, 5, 90]]", "[[0, 0, 0], [0, 0, 90]]", 9, "at least two waypoints that lie apart, found 1"),
        ("dwell_s = 20", "dwell_s = 0", 10, "at least 0.1 and at most 14400"),
        ("dwell_s = 20", "dwell_s = 1e-300", 10, "at least 0.1"),
        ("dwell_s = 20", "size = 5e-324", 10, "at least 0.001"),
        ("[[10, 0, 0], [10, 5, 90]]", "[[0.5, 0, 0], [0, 0.5, 90]]\nsize = 0.001", 9, "found 1. Fix: add points"),
        ("seed = 5", "seed = -5", 3, "at least 0"),
        ("seed = 5", f"seed = {2**63}", 3, "the number is too long"),
        ("[10, 5, 90]", f"[{10**400}, 5, 90]", 9, "the number is too long"),
        ("duration_s = 40", "duration_s = nan", 4, "at least 0.001"),
        ("duration_s = 40\n", "", 56, 'lacks "duration_s"'),
        ("2022-06-01T08:30:00.25Z", '"noon"', 5, "date and time"),
        ("2022-06-01T08:30:00.25Z", "1022-06-01T08:30:00Z", 5, "between 2000 and 2038"),
        ("2022-06-01T08:30:00.25Z", "2038-01-19T03:13:00Z", 5, "the trial ends before 2038-01-19"),
        ("2022-06-01T08:30:00.25Z", "2050-01-01T00:00:00Z", 5, "the trial ends before 2038-01-19"),
        ("wind_rate_hz = 10", "wind_rate_hz = 5e-324", 20, "must be 0, or at least 0.01"),
        ("wind_rate_hz = 10", "navigation_rate_hz = 1e-3", 20, "at least 0.01"),
        ("wind_rate_hz = 10", "azimuth_step_deg = 1e-9", 20, "must be 0, or at least 0.001"),
        ("velocity_mps = 0.02", "velocity_mps = 1e-300", 23, "must be 0, or at least 1e-09"),
        ("delta = 0.4", 'model = "a\\u0000b.json"', 13, r"there is no file a\x00b.json"),
        ("north_mps = -3.0", 'series = "a\\u0000b.csv"', 17, "embedded null byte"),
        ("ferryid.scenario/1", "a\\nb\\u001b[2J", 1, r'cannot be "a\nb\x1b[2J"'),
        ("[100, 100, 400]", "[100, 100, -400]", 14, "at least 0"),
        ("[100, 100, 400]", "[100, 100]", 14, "3 numbers"),
        ("[100, 100, 400]", "[]", 14, "must hold 3 numbers, found 0"),
        ("north_mps = -3.0", "north_mps = -1e300", 17, "at least -60 and at most 60"),
        ("north_mps = -3.0", 'series = "gusts.csv"', 17, "gusts.csv: the series cannot be read"),
        ("wind_rate_hz = 10", "imu_rate_hz = 1e9", 20, "at most 1000"),
        ("dwell_s = 20", "rounds = 1000000000", 10, "at most 1000"),
        ("duration_s = 40", "duration_s = 14401", 4, "at most 14400"),
        ("X_u = 1.2", "m11 = 0", 26, "at least 0.1"),
        ("velocity_mps = 0.02", "white_share = 2", 23, "at most 1"),
        ("X_u = 1.2", "Xu = 1.2", 26, 'unknown key "Xu" in [true_hull]. Did you mean "X_u"?'),
        ("[true_hull]", "[true_hul]", 25, 'Did you mean "true_hull"?'),
        ("ferryid.scenario/1", "ferryid.vessel/1", 1, '"schema" cannot be'),
        ('vessel = "milliampere"', "", 1, 'lacks "vessel"'),
        ("[environment.wind]", "[environment.wnid]", 16, 'Did you mean "wind"?'),
        ("mass_kg = 80", "mas_kg = 80", 34, 'unknown key "mas_kg" in [payload]. Did you mean "mass_kg"?'),
        ("until_s = 30", "until_s = 10", 31, '"until_s" must come after "from_s" = 10'),
        ("until_s = 15", "until_s = 0", 49, '"until_s" must come after "from_s" = 0'),
        ("until_s = 35", "until_s = 5", 55, '"until_s" must come after "from_s" = 25'),
        ("from_s = 10\nuntil_s = 30", "from_s = 4000", 30, "comes after the end of the trial"),
        ("delta = 0.4", 'delta = 0.4\nmodel = "s.toml"', 13, '"delta" scales the profile'),
        ("significant_height_m = 0.2", "peak_period_s = 0", 38, "at least 0.5"),
        ("significant_height_m = 0.2", "significant_height_m = 2", 38, "steeper waves break"),
        ("significant_height_m = 0.2", "components = 0", 38, "whole number of at least 1"),
        ("significant_height_m = 0.2", "components = 4000", 38, "at most"),
        ("height_m = 0.3", "height_m = 3", 42, "steeper waves break"),
        ("[[environment.wakes]]", "[environment.wakes]", 40, "Fix: head each entry with [[environment.wakes]]"),
        ("north_m = [5, 20]", "north_m = [20, 5]", 45, "reversed"),
        ("north_m = [5, 20]", "north_m = 5", 45, "array of finite numbers"),
        ('thruster = "thruster2"\n', "", 51, "does not say whose it is"),
        ("factor = 0.5", "factor = 4", 53, "at most 3"),
        ('law = "carrot"', 'law = "carot"', 58, 'Did you mean "carrot"?'),
        ('law = "carrot"', 'lwa = "carrot"', 58, 'Did you mean "law"?'),
        ("delta = 0.4", 'model = "mine.json"', 13, "there is no file mine.json"),
        ("delta = 0.4", 'allocation = "ncsa"', 13, 'Did you mean "nsca"?'),
        ("[path]", '[manoeuvre]\nkind = "zigzag"\n[path]', 7, "either a path or a manoeuvre, found both"),
    ],
)
def test_a_fault_is_said_in_one_line_with_its_place(old: str, new: str, line: int, words: str) -> None:
    assert old in GOOD
    _faulty(GOOD.replace(old, new, 1), line, words)


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ('kind = "rpm-steps"', 'kind = "zig-zag"', 5, 'Did you mean "zigzag"?'),
        ('kind = "rpm-steps"\n', "", 4, '[manoeuvre] lacks "kind"'),
        ("levels = [0.5, -0.5]", "levels = []", 6, '"levels" is an empty array'),
        ("levels = [0.5, -0.5]", "levels = [1.5]", 6, "shares of speed_rpm"),
        ("levels = [0.5, -0.5]", f"levels = {[0.1] * 101}", 6, "at most 100"),
        ("duration_s = 100", "duration_s = 1e6", 4, "Fix: set duration_s"),
        ("[manoeuvre]", '[guidance]\nlaw = "carrot"\n[manoeuvre]', 4, "a manoeuvre has none"),
    ],
)
def test_a_fault_of_a_manoeuvre(old: str, new: str, line: int, words: str) -> None:
    assert old in HELM
    _faulty(HELM.replace(old, new, 1), line, words)


def _faulty(text: str, line: int, words: str) -> None:
    with pytest.raises(FerryIdError) as raised:
        parse_scenario(text, "mine.toml")
    message = str(raised.value)
    assert message.startswith(f"mine.toml:{line}: ")
    assert words in message
    assert "Fix: " in message
    assert message.isprintable()


def test_no_path_no_trial() -> None:
    with pytest.raises(FerryIdError, match=r'lacks "path".*\[manoeuvre\]'):
        parse_scenario('schema = "ferryid.scenario/1"\nvessel = "milliampere"\n', "mine.toml")


@pytest.mark.parametrize("text", ["a" + ".a" * 900 + " = 1", "[a" + ".a" * 900 + "]", "a = " + "[" * 40 + "]" * 40])
def test_what_is_nested_too_deep(text: str) -> None:
    with pytest.raises(FerryIdError, match=r"^mine.toml: tables or arrays hold each other .* deep") as raised:
        parse_scenario(text, "mine.toml")
    assert "Fix: " in str(raised.value)
    with pytest.raises(FerryIdError, match=r"^mine.toml:1: tables or arrays hold each other .* deep"):
        parse_profile(text, "mine.toml")


@pytest.mark.slow
@pytest.mark.parametrize("text", ["seed = " + "9" * 5000, "seed = " + "[" * 5000])
def test_a_profile_that_breaks_the_reader(text: str) -> None:
    with pytest.raises(FerryIdError, match=r"^mine.toml:1: not valid TOML: "):
        parse_profile(text, "mine.toml")


def test_a_mark_of_byte_order_is_no_fault(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(GOOD, encoding="utf-8-sig")
    assert load_scenario(path).seed == 5
    text = load_profile("milliampere").text
    path.write_text(text, encoding="utf-8-sig")
    assert load_profile(path).text == text


def test_a_vessel_beside_the_scenario_comes_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "mine.toml").write_text(GOOD.replace('"milliampere"', '"boat.toml"'), encoding="utf-8")
    scenario = load_scenario(tmp_path / "mine.toml")
    with pytest.raises(FerryIdError, match=r'mine\.toml:2: "vessel": boat\.toml: the vessel profile cannot be read'):
        vessel_of(scenario)
    text = load_profile("milliampere").text
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    Path("boat.toml").write_text(text.replace('name = "milliampere"', 'name = "there"'), encoding="utf-8")
    assert vessel_of(scenario).name == "there"
    (tmp_path / "boat.toml").write_text(text.replace('name = "milliampere"', 'name = "beside"'), encoding="utf-8")
    assert vessel_of(scenario).name == "beside"
    (tmp_path / "boat.toml").write_text(text + "[nothing]\n", encoding="utf-8")
    with pytest.raises(FerryIdError, match=r'mine\.toml:2: "vessel": .*boat\.toml:\d+: unknown key "nothing"'):
        vessel_of(scenario)


@pytest.mark.parametrize("text", ["seed = 1\nschema = \n", "seed = " + "9" * 5000, "seed = " + "[" * 5000])
def test_not_toml(text: str) -> None:
    with pytest.raises(FerryIdError, match=r"^mine.toml: not valid TOML, ") as raised:
        parse_scenario(text, "mine.toml")
    assert "\n" not in str(raised.value)


def test_a_name_that_is_no_scenario(tmp_path: Path) -> None:
    with pytest.raises(FerryIdError, match=r'Did you mean "twelve-corner"\?'):
        load_scenario("twelve-corners")
    with pytest.raises(FerryIdError, match="No such file"):
        load_scenario(tmp_path / "absent.toml")
    (tmp_path / "latin.toml").write_bytes(b'title = "\xe6"')
    with pytest.raises(FerryIdError, match="UTF-8"):
        load_scenario(tmp_path / "latin.toml")


def test_files_lie_beside_the_scenario(tmp_path: Path) -> None:
    text = GOOD.replace("north_mps = -3.0", 'series = "gusts.csv"').replace("delta = 0.4", 'model = "mine.json"')
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    (tmp_path / "gusts.csv").write_text("time,north,east\n0,1,2\n5,3,4\n", encoding="utf-8")
    with pytest.raises(FerryIdError, match=r"mine\.toml:13: .*no file .*mine\.json"):
        load_scenario(tmp_path / "mine.toml")
    (tmp_path / "mine.json").write_text("{}", encoding="utf-8")
    scenario = load_scenario(tmp_path / "mine.toml")
    assert scenario.file(scenario.controller.model) == tmp_path / "mine.json"
    assert scenario.where == str(tmp_path / "mine.toml")


def test_a_series_by_any_order_of_columns(tmp_path: Path) -> None:
    path = tmp_path / "gusts.csv"
    path.write_text("time_s, East_mps ,gauge,north\n0,2,x,1\n\n5.5,4,x,-3\n", encoding="utf-8-sig")
    t, north, east = read_series(path)
    assert (t.tolist(), north.tolist(), east.tolist()) == ([0.0, 5.5], [1.0, -3.0], [2.0, 4.0])
    path.write_text("\n\ntime,north,east\n0,1,2\n", encoding="utf-8")
    assert [column.tolist() for column in read_series(path)] == [[0.0], [1.0], [2.0]]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ':1: the series lacks the column "time", found an empty file'),
        ("time,north\n0,1\n", ':1: the series lacks the column "east"'),
        ("time;north;east\n0;1;2\n", ':1: the series lacks the column "time"'),
        ("time,north,east\n", "no rows"),
        ("time,north,east\n0,1,2\n1,1\n", ':3: "east" must be a number, found ""'),
        ("time,north,east\n0,1,calm\n", ':2: "east" must be a number, found "calm"'),
        ("time,north,east\n0,nan,2\n", ':2: "north" must be at most 60'),
        ("time,north,east\n0,1,61\n", ':2: "east" must be at most 60'),
        ("time,north,east\n1,1,2\n1,1,2\n", ":3: the time must rise"),
        ("time,north,east\n\xff0,1,2\n", "no CSV text"),
        ("time,north,east\n0,1,\x002\n", r':2: "east" must be a number, found "\x002"'),
    ],
)
def test_a_malformed_series(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "gusts.csv"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(FerryIdError) as raised:
        read_series(path)
    assert words in str(raised.value)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("old", "new", "vessel", "line", "words"),
    [
        ('"thruster2"', '"thruster3"', "milliampere", 52, 'has no thruster "thruster3", found thruster1, thruster2.'),
        ("x_m = -1.0", "x_m = -10.0", "milliampere", 35, "lies off a hull of length 5 m"),
        ("", "", "vtec-usv", 2, "needs the hull's damping"),
        ('"thruster2"', '"bow"', "revolt", 16, "the profile revolt has no [wind]"),
    ],
)
def test_what_the_vessel_lacks(old: str, new: str, vessel: str, line: int, words: str) -> None:
    scenario = parse_scenario(GOOD.replace(old, new), "mine.toml")
    with pytest.raises(FerryIdError) as raised:
        check_against(scenario, load_profile(vessel))
    assert str(raised.value).startswith(f"mine.toml:{line}: ")
    assert words in str(raised.value)


def test_waves_need_the_size_of_the_hull() -> None:
    profile = load_profile("milliampere")
    unknown = replace(profile, hull=replace(profile.hull, beam_m=float("nan")))
    with pytest.raises(FerryIdError, match=r"mine\.toml:37: waves need the size of the hull"):
        check_against(parse_scenario(GOOD, "mine.toml"), unknown)


def test_every_section_that_is_left_out_has_its_defaults() -> None:
    bare = 'schema = "ferryid.scenario/1"\nvessel = "milliampere"\n[path]\nkind = "crossing"\n'
    scenario = parse_scenario(bare, "mine.toml")
    assert scenario.sensors == Sensors()
    assert _beside_defaults("", scenario) <= {
        ".name",
        ".title",
        ".vessel",
        ".duration_s",
        ".start_ns",
        ".seed",
        ".text",
    }


@pytest.mark.slow
def test_listing_is_light() -> None:
    code = (
        "import sys, ferryid.simulate as s; s.list_scenarios(); print(*{'numba', 'scipy', 'pandas'} & set(sys.modules))"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split() == []
