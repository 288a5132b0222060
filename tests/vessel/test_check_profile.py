"""Every fault of a profile is explained with its line: one edit of a sound profile at a time."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from ferryid.errors import FerryIdError
from ferryid.vessel import bundled, check_profile, load_profile, parse_profile

SOUND = """schema = "ferryid.vessel/1"
name = "boat"
source = "made up for a test"
[hull]
length_m = 5.0
mass_kg = 1000.0
inertia_z = 2000.0
[hull.M]
m11 = 1200.0
m22 = 1500.0
m23 = 10.0
m32 = 10.0
m33 = 2500.0
[hull.D]
"X_u" = -20.0
"Y_v" = -50.0
"N_r" = -90.0
[wind]
frontal_m2 = 1.0
lateral_m2 = 2.0
length_m = 5.0
CD_t = 0.9
CD_l_AF = 0.5
delta = 0.8
[[actuator]]
name = "left"
kind = "azimuth"
position_m = [-2.0, -0.5]
thrust = { kind = "polynomial", coefficients = [0.01, 0.0, 1e-7], valid = [-900, 900] }
[[actuator]]
name = "right"
kind = "propeller_rudder"
position_m = [-2.0, 0.5]
diameter_m = 0.3
[actuator.thrust]
kind = "table"
speed = [-900, 0, 900]
force = [-200, 0, 300]
[actuator.rudder]
area_m2 = 0.1
x_m = -2.3
aspect_ratio = 1.5
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
[signals."left.speed"]
topic = "/left"
field = "n"
unit = "rpm"
[signals."left.angle"]
topic = "/left"
field = "a"
unit = "rad"
[signals."right.speed"]
topic = "/right"
field = "n"
unit = "rps"
[signals."right.rudder"]
topic = "/right"
field = "d"
unit = "deg"
"""

# (text to replace, its replacement with @ on the line of the fault, what the message must say)
CASES = {
    "newer schema": ('vessel/1"', 'vessel/9"@', "install a newer ferryid"),
    "no schema": ('schema = "ferryid.vessel/1"', "@", 'the file lacks "schema"'),
    "name with a space": ('name = "boat"', 'name = "my boat"@', "use up to 80 letters, digits"),
    "empty name": ('name = "boat"', 'name = ""@', 'cannot be "". Fix: use up to 80 letters'),
    "long name": ('name = "boat"', f'name = "{81 * "x"}"@', "use up to 80 letters"),
    "empty name of an actuator": ('name = "left"', 'name = ""@', 'cannot be named ""'),
    "source is no text": ('source = "made up for a test"', "source = 3@", "must be a string, found a number"),
    "unknown key": ("length_m = 5.0\nmass", "lenght_m = 5.0@\nmass", 'Did you mean "length_m"?'),
    "key of another table": (
        'name = "left"\n',
        'name = "left"\ntime_constant_s = 0.5@\n',
        'Fix: move it to the table of its order, such as [signals."left.speed.command"]',
    ),
    "unknown table": ("[wind]", "[winds]@", 'unknown key "winds"'),
    "no mass": ("[hull]\nlength_m = 5.0\nmass_kg = 1000.0", "[hull]@\nlength_m = 5.0", 'lacks "mass_kg"'),
    "negative mass": ("mass_kg = 1000.0", "mass_kg = -1.0@", "must be above 0, found -1"),
    "mass beyond any float": (
        "mass_kg = 1000.0",
        "mass_kg = 1" + 400 * "0" + "@",
        "must be a number, found one of more",
    ),
    "mass of no vessel": ("mass_kg = 1000.0", "mass_kg = 1e308@", "1e+308 is not plausible for any vessel"),
    "mass of nothing": ("mass_kg = 1000.0", "mass_kg = 1e-300@", "must be at least 1e-12"),
    "damping of no vessel": ('"X_u" = -20.0', '"X_u" = -1e308@', "must be at most 1e+15 in size"),
    "windows of no time": (
        'name = "boat"',
        'name = "boat"\nwindow_s = 0@',
        "must be at least 0.2 and at most 120, found 0",
    ),
    "mass as text": ("mass_kg = 1000.0", 'mass_kg = "1000"@', "must be a number, found a string"),
    "mass not finite": ("mass_kg = 1000.0", "mass_kg = inf@", "must be above 0, found inf"),
    "no inertia": (
        "[hull]\nlength_m = 5.0\nmass_kg = 1000.0\ninertia_z = 2000.0",
        "[hull]@\nmass_kg = 1.0",
        "lacks a moment of inertia",
    ),
    "inertia twice": ("inertia_z = 2000.0", "inertia_z = 2000.0\nk_zz_m = 1.0@", "say the same thing"),
    "inertia below the parallel axis": (
        "inertia_z = 2000.0",
        "x_g_m = 2.0\ninertia_z = 2000.0@",
        "must exceed",
    ),
    "radius of gyration beyond the length": ("inertia_z = 2000.0", "k_zz_m = 5.5@", "is more than the length of 5 m"),
    "inertia in other units": (
        "inertia_z = 2000.0",
        "inertia_z = 2e6@",
        "means a radius of gyration of 44.7 m, which is more than the length of 5 m",
    ),
    "mass in other units": (
        "mass_kg = 1000.0\ninertia_z = 2000.0",
        "mass_kg = 1e6@\nk_zz_m = 1.2",
        "cannot float: a cube of water as long as the hull, 5 m, has 1.25e+05 kg",
    ),
    "negative draught": ("length_m = 5.0\nmass", "length_m = 5.0\ndraught_m = -0.5@\nmass", "must be above 0"),
    "no draught": ("length_m = 5.0\nmass", "length_m = 5.0\ndraught_m = 0@\nmass", "must be above 0"),
    "centre of gravity off the hull": (
        "mass_kg = 1000.0",
        "x_g_m = 6.0@\nmass_kg = 10.0",
        "lies outside a hull",
    ),
    "spread in percent": ("mass_kg = 1000.0", "mass_kg = 1000.0\nspread = 20@", "at most 1, found 20"),
    "spread of nothing": ("mass_kg = 1000.0", "mass_kg = 1000.0\nspread = 0.0@", "must be above 0"),
    "spread in a word": (
        "mass_kg = 1000.0",
        'mass_kg = 1000.0\nspread = "unknow"@',
        'give a share, such as 0.3 for 30 %, or "unknown"',
    ),
    "spread without damping": (
        "mass_kg = 1000.0\ninertia_z = 2000.0\n[hull.M]\nm11 = 1200.0\nm22 = 1500.0\nm23 = 10.0\nm32 = 10.0\nm33 = 2500.0\n"
        '[hull.D]\n"X_u" = -20.0\n"Y_v" = -50.0\n"N_r" = -90.0\n',
        "mass_kg = 1000.0\ninertia_z = 2000.0\nspread = 0.2@\n",
        "there is no [hull.D]",
    ),
    "mass matrix": (
        "[hull.M]\nm11 = 1200.0\nm22 = 1500.0\nm23 = 10.0\nm32 = 10.0",
        "[hull.M]@\nm11 = 1200.0\nm22 = 1500.0\nm23 = 3000.0\nm32 = 3000.0",
        "not positive definite",
    ),
    "added mass": ("m11 = 1200.0", "m11 = 900.0@", "the added mass would be negative"),
    "damping that feeds": ('"X_u" = -20.0', '"X_u" = 20.0@', "feeds energy into the motion"),
    "damping that couples": ('[hull.D]\n"X_u" = -20.0', '[hull.D]@\n"Y_r" = 500.0', "not dissipative"),
    "damping term": ('"X_u" = -20.0', '"X_|u|" = -20.0@', 'Did you mean "X_|u|u"?'),
    "wind delta": ("delta = 0.8", "delta = 1.8@", "at least 0 and at most 1"),
    "same name": ('name = "right"', 'name = "left"@', "is taken by the one on line 25"),
    "name for columns": ('name = "left"', 'name = "port-aft"@', "becomes part of column names"),
    "actuator kind": ('kind = "azimuth"', 'kind = "azimut"@', 'Did you mean "azimuth"?'),
    "position": ("position_m = [-2.0, -0.5]", "position_m = [-2.0]@", "must hold 2 numbers, found 1"),
    "position off the bow": ("position_m = [-2.0, -0.5]", "position_m = [3.1, -0.5]@", "lies off a hull of length 5 m"),
    "position off the side": (
        "[hull]\nlength_m = 5.0\nmass_kg = 1000.0\ninertia_z = 2000.0",
        "[hull]\nbeam_m = 0.8\nmass_kg = 1000.0\ninertia_z = 2000.0",
        '"position_m"[1] = 0.5 lies off a hull of beam 0.8 m',
    ),
    "rudder off the hull": ("x_m = -2.3", "x_m = -23.0@", "lies off a hull of length 5 m"),
    "no actuator": (
        '[[actuator]]\nname = "left"',
        '[[actuators]]@\nname = "left"',
        'unknown key "actuators"',
    ),
    "range reversed": ("valid = [-900, 900] }", "valid = [900, -900] }@", '"valid" is reversed'),
    "range without rest": (
        "valid = [-900, 900] }",
        "valid = [100, 900] }@",
        "leaves out a stopped propeller",
    ),
    "two actuators with one signal": (
        '[signals."right.speed"]\ntopic = "/right"',
        '[signals."right.speed"]@\ntopic = "left/"',
        'right.speed is read from the field "n" of left/, and so is left.speed on line 53. Fix: correct the topic or the '
        "field, or add shared = true here where left and right really have one signal",
    ),
    "an angle that is another one's speed": (
        '[signals."right.rudder"]\ntopic = "/right"\nfield = "d"',
        '[signals."right.rudder"]@\ntopic = "/right"\nfield = "n"\nshared = true',
        "so is right.speed on line 61. Fix: correct the topic or the field",
    ),
    "one field for both axes": (
        '[signals.velocity]\ntopic = "/nav"\nfields = ["u", "v"]',
        '[signals.velocity]@\ntopic = "/nav"\nfields = ["u", "u"]',
        "it is named twice here",
    ),
    "yaw rate from the field of the velocity": ('field = "r"', 'field = "u"', "so is velocity on line"),
    "a curve without thrust": (
        "[0.01, 0.0, 1e-7], valid = [-900, 900] }",
        "[0.0, 0.0], valid = [-900, 900] }@",
        "zero everywhere",
    ),
    "a table without thrust": ("force = [-200, 0, 300]", "force = [0, 0, 0]@", "zero everywhere"),
    "a coefficient of no propeller": (
        'thrust = { kind = "polynomial", coefficients = [0.01,',
        'thrust = { kind = "polynomial", coefficients = [1e308,@',
        "is not plausible for any vessel",
    ),
    "a thrust of no propeller": (
        'thrust = { kind = "polynomial", coefficients = [0.01, 0.0, 1e-7], valid = [-900, 900] }',
        'thrust = { kind = "polynomial", coefficients = [0.01, 0.0, 1e9], valid = [-900, 900] }@',
        "more than any propeller",
    ),
    "thrust of the wrong sign": (
        "[0.01, 0.0, 1e-7], valid = [-900, 900] }",
        "[-0.01, 0.0, 1e-7], valid = [-900, 900] }@",
        "wrong sign",
    ),
    "thrust that falls": (
        "[0.01, 0.0, 1e-7], valid = [-900, 900] }",
        "[0.2, 0.0, -2e-7], valid = [-900, 900] }@",
        "not monotone",
    ),
    "table unsorted": (
        "speed = [-900, 0, 900]",
        "speed = [0, -900, 900]@",
        "must rise from entry to entry, found 0 before -900",
    ),
    "table through zero": ("force = [-200, 0, 300]", "force = [-200, 10, 300]", "does not pass through zero"),
    "table that falls": ("force = [-200, 0, 300]", "force = [200, 0, 300]@", "falls from 200 to 0 N"),
    "table lengths": ("force = [-200, 0, 300]", "force = [-200, 0]@", '"speed" has 3 entries and "force" 2'),
    "range beyond the table": (
        "speed = [-900, 0, 900]",
        "valid = [-1000, 900]@\nspeed = [-900, 0, 900]",
        "beyond the table",
    ),
    "rudder on an azimuth": (
        "position_m = [-2.0, -0.5]",
        "rudder = { area_m2 = 1.0, x_m = -2.0, f_alpha = 2.0 }@\nposition_m = [-2.0, -0.5]",
        "has no rudder",
    ),
    "rudder without slope": (
        "[actuator.rudder]\narea_m2 = 0.1\nx_m = -2.3\naspect_ratio = 1.5",
        "[actuator.rudder]@\narea_m2 = 0.1\nx_m = -2.3",
        "lift slope once",
    ),
    "rudder missing": (
        "[actuator.rudder]\narea_m2 = 0.1\nx_m = -2.3\naspect_ratio = 1.5",
        "",
        'lacks "rudder"',
    ),
    "no diameter": ("diameter_m = 0.3\n", "", 'needs "diameter_m"'),
    "unknown unit": ('unit = "m/s"', 'unit = "m/sec"@', 'Did you mean "m/s"?'),
    "unit of the wrong kind": (
        'field = "d"\nunit = "deg"',
        'field = "d"\nunit = "m"@',
        "measures a length, but this is an angle",
    ),
    "no frame": (
        '[signals.velocity]\ntopic = "/nav"\nfields = ["u", "v"]\nunit = "m/s"\nframe = "FRD"',
        '[signals.velocity]@\ntopic = "/nav"\nfields = ["u", "v"]\nunit = "m/s"',
        "its signs are not known",
    ),
    "frame that does not exist": (
        'unit = "m/s"\nframe = "FRD"',
        'unit = "m/s"\nframe = "FRU"@',
        'Did you mean "FRD"?',
    ),
    "world velocity without heading": (
        'fields = ["u", "v"]\nunit = "m/s"\nframe = "FRD"',
        'fields = ["u", "v"]\nunit = "m/s"\nframe = "NED"',
        "without a heading it cannot be turned into surge",
    ),
    "two body frames in one message": (
        'field = "r"\nunit = "rad/s"\nframe = "FRD"',
        'field = "r"\nunit = "rad/s"\nframe = "FLU"',
        "one message has one body frame",
    ),
    "three fields for a velocity": ('fields = ["u", "v"]', 'fields = ["u", "v", "w"]@', "must name 2 fields, found 3"),
    "one field for a velocity over ground": (
        'fields = ["u", "v"]\nunit = "m/s"\nframe = "FRD"',
        'fields = ["u"]\nunit = "m/s"\nframe = "NED"@\n',
        "one field of a velocity is surge alone, which is measured along the hull",
    ),
    "surge alone that may be missing": (
        'fields = ["u", "v"]\nunit = "m/s"',
        'fields = ["u"]\nrequired = false@\nunit = "m/s"',
        "a model reduced to surge and yaw needs it",
    ),
    "no topic": (
        '[signals.velocity]\ntopic = "/nav"',
        "[signals.velocity]@",
        '[signals.velocity] lacks "topic"',
    ),
    "signal of no actuator": (
        '[signals."left.speed"]',
        '[signals."lef.speed"]@',
        'does not list. Did you mean "left"?',
    ),
    "signal of another kind of actuator": (
        '[signals."left.angle"]',
        '[signals."left.rudder"]@',
        'which is of kind "azimuth"',
    ),
    "unquoted actuator signal": ('[signals."left.angle"]', "[signals.left.angle]@", "with the quotes"),
    "unknown signal": ("[signals.yaw_rate]", "[signals.yawrate]@", 'Did you mean "yaw_rate"?'),
    "azimuth without angle": (
        '[signals."left.angle"]\ntopic = "/left"\nfield = "a"\nunit = "rad"\n',
        "",
        'left is of kind "azimuth" and has no angle signal',
    ),
    "curve of an empty list": (
        'kind = "table"\nspeed = [-900, 0, 900]\nforce = [-200, 0, 300]',
        'kind = "open_water"\nJ = []@\nK_T = [0.3, 0.0]',
        '"J" is an empty array',
    ),
    "speed without curve": (
        'thrust = { kind = "polynomial", coefficients = [0.01, 0.0, 1e-7], valid = [-900, 900] }\n',
        "",
        "has a speed signal but no thrust curve",
    ),
    "no yaw": (
        '[signals.yaw_rate]\ntopic = "/nav"\nfield = "r"\nunit = "rad/s"\nframe = "FRD"\n',
        "",
        "no yaw rate is available",
    ),
    "no velocity": (
        '[signals.velocity]\ntopic = "/nav"\nfields = ["u", "v"]\nunit = "m/s"\nframe = "FRD"\n',
        "",
        "no surge and sway velocity is available",
    ),
    "sign": ('field = "a"\nunit = "rad"', 'field = "a"\nunit = "rad"\nsign = -2@', "must be 1 or -1"),
    "scale of nothing": ("[signals.velocity]", "[signals.velocity]\nscale = 0@", '"scale" must be above 0, found 0'),
    "scale beyond any unit": ("[signals.yaw_rate]", "[signals.yaw_rate]\nscale = 500@", "at most 100 in size"),
    "body frame for a heading": (
        "[signals.yaw_rate]",
        '[signals.heading]\ntopic = "/h"\nfield = "h"\nunit = "rad"\nframe = "FRD"@\n[signals.yaw_rate]',
        "in the body frame",
    ),
    "degrees for metres": (
        "[signals.yaw_rate]",
        '[signals.position]\ntopic = "/p"\nfields = ["x", "y"]\nunit = "deg"@\nframe = "NED"\n[signals.yaw_rate]',
        "measures an angle, but this is a length",
    ),
    "metres for degrees": (
        "[signals.yaw_rate]",
        '[signals.position]\ntopic = "/p"\nfields = ["x", "y"]\nunit = "m"@\nframe = "geodetic"\n[signals.yaw_rate]',
        "measures a length, but this is an angle",
    ),
    "desired position from another origin": (
        "[signals.yaw_rate]",
        '[signals.position]\ntopic = "/p"\nfields = ["x", "y"]\nunit = "deg"\nframe = "geodetic"\n'
        '[signals.position_d]@\ntopic = "/d"\nfields = ["x", "y"]\nunit = "m"\nframe = "NED"\n[signals.yaw_rate]',
        "position from its first fix",
    ),
    "desired position alone": (
        "[signals.yaw_rate]",
        '[signals.position_d]@\ntopic = "/d"\nfields = ["x", "y"]\nunit = "m"\nframe = "NED"\n[signals.yaw_rate]',
        "there is no position",
    ),
    "bow wind without heading": (
        "[signals.yaw_rate]",
        '[signals.wind]@\ntopic = "/w"\nspeed = "s"\nunit = "m/s"\ndirection = "d"\ndirection_unit = "deg"\n'
        'reference = "bow"\nair = "true"\n[signals.yaw_rate]',
        "relative to the bow",
    ),
    "throttle without full speed": (
        'field = "n"\nunit = "rpm"',
        'field = "n"\nunit = "%"',
        "the speed at full throttle",
    ),
    "table layout": ("[wind]", '[table]\nseparator = ":"@\n[wind]', '"separator" cannot be'),
    "time column": ("[wind]", '[table]\ncolumns = ["t", "x"]\ntime = "time"@\n[wind]', 'not among "columns"'),
    "encoding": ("[wind]", '[table]\nencoding = "utf-9"@\n[wind]', "unknown text encoding"),
    "syntax": ("mass_kg = 1000.0", "mass_kg = = 1000.0@", "not valid TOML"),
}


def test_the_profile_all_cases_start_from_is_sound() -> None:
    profile = parse_profile(SOUND, "boat.toml")
    assert profile.hull.D == {"X_u": -20.0, "Y_v": -50.0, "N_r": -90.0}
    assert profile.actuators[1].rudder["f_alpha"] == pytest.approx(6.13 * 1.5 / 3.75)


@pytest.mark.parametrize("case", CASES)
def test_fault_is_explained_with_its_line(case: str, tmp_path: Path) -> None:
    old, new, says = CASES[case]
    assert SOUND.count(old) >= 1
    marked = SOUND.replace(old, new, 1)
    path = tmp_path / "boat.toml"
    path.write_text(marked.replace("@", ""))
    faults = check_profile(path)
    matching = [fault for fault in faults if says in fault.message]
    assert matching, faults
    if "@" in marked:
        line = marked[: marked.index("@")].count("\n") + 1
        assert matching[0].line == line
    if not matching[0].warning:
        with pytest.raises(FerryIdError, match=r"boat\.toml:\d+: ") as caught:
            load_profile(path)
        assert "\n" not in str(caught.value)


def test_two_actuators_may_have_one_signal_where_the_file_says_so() -> None:
    old = '[signals."right.speed"]\ntopic = "/right"'
    assert old in SOUND
    text = SOUND.replace(old, '[signals."right.speed"]\nshared = true\ntopic = "/left"')
    signals = {signal.quantity: signal for signal in parse_profile(text, "boat.toml").signals}
    assert signals["left.speed"].fields == signals["right.speed"].fields


def test_every_fault_is_found_at_once(tmp_path: Path) -> None:
    text = SOUND.replace("mass_kg = 1000.0", "mass_kg = -1.0").replace('unit = "rps"', 'unit = "rpx"')
    text = text.replace("x_m = -2.3", "x_n = -2.3")
    path = tmp_path / "boat.toml"
    path.write_text(text)
    faults = check_profile(path)
    assert [fault.line for fault in faults] == sorted(fault.line for fault in faults)
    assert len(faults) == 4  # x_n is unknown and x_m is missing
    with pytest.raises(FerryIdError, match=r"boat\.toml:6: .* \(3 more faults: see ferryid vessel check "):
        load_profile(path)


def test_warnings_do_not_keep_a_profile_from_loading() -> None:
    profile = parse_profile(SOUND.replace('"X_u" = -20.0', '"X_u" = 20.0'), "boat.toml")
    assert profile.hull.D["X_u"] == 20.0


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("inertia_z = 2000.0", "k_zz_m = 4.0", "farther from the middle than any corner of the hull, 3.54 m"),
        (
            "mass_kg = 1000.0",
            "beam_m = 2.0\ndraught_m = 0.05\nmass_kg = 1000.0",
            "is more than the water in a box around the hull, 5 m long, 2 m wide and 0.05 m deep: 500 kg",
        ),
        ("mass_kg = 1000.0", "beam_m = 0.4\nmass_kg = 1000.0", "5 m long, 0.4 m wide and 0.4 m deep: 800 kg"),
        ("mass_kg = 1000.0", "beam_m = 60.0\nmass_kg = 1000.0", '"beam_m" = 60 is more than the length of 5 m'),
        ("mass_kg = 1000.0", "draught_m = 30.0\nmass_kg = 1000.0", '"draught_m" = 30 is more than the length of 5 m'),
    ],
)
def test_an_implausible_hull_is_warned_of(tmp_path: Path, old: str, new: str, told: str) -> None:
    path = tmp_path / "boat.toml"
    path.write_text(SOUND.replace(old, new, 1))
    (fault,) = [fault for fault in check_profile(path) if told in fault.message]
    assert fault.warning
    assert "Fix:" in fault.message
    assert load_profile(path).name == "boat"


def test_a_faulty_curve_is_not_said_to_be_missing(tmp_path: Path) -> None:
    path = tmp_path / "boat.toml"
    curve = 'kind = "table"\nspeed = [-900, 0, 900]\nforce = [-200, 0, 300]'
    path.write_text(SOUND.replace(curve, 'kind = "open_water"\nJ = []\nK_T = []'))
    assert [fault.message.partition(".")[0] for fault in check_profile(path)] == [
        '"J" is an empty array',
        '"K_T" is an empty array',
    ]


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(FerryIdError, match="no such file"):
        load_profile(tmp_path / "nothing.toml")
    with pytest.raises(FerryIdError, match="a folder"):
        load_profile(tmp_path)
    with pytest.raises(FerryIdError, match='Did you mean "milliampere"'):
        load_profile("miliampere")
    broken = tmp_path / "latin.toml"
    broken.write_bytes(b'name = "\xe6"')
    with pytest.raises(FerryIdError, match="UTF-8 text, found byte 0xe6 at offset 8"):
        load_profile(broken)
    empty = tmp_path / "empty.toml"
    empty.write_text("")
    with pytest.raises(FerryIdError, match=r"empty\.toml:1: the file holds no key\. Fix: [^(]*\([^(]*\)$"):
        load_profile(empty)
    empty.write_text("# nothing yet\n")
    assert len(check_profile(empty)) == 1


def test_bundled_names_and_text_survive_embedding() -> None:
    assert bundled() == (
        "esso-osaka",
        "gunnerus",
        "kvlcc2-model",
        "milliampere",
        "milliampere-2025",
        "revolt",
        "vtec-usv",
    )
    for name in bundled():
        profile = load_profile(name)
        again = parse_profile(profile.text, "model.json")
        assert again.sha256 == profile.sha256
        assert again.signals == profile.signals


@pytest.mark.slow
def test_import_is_cheap() -> None:
    heavy = "('pandas', 'scipy', 'matplotlib', 'pyarrow')"
    code = f"import sys, ferryid.vessel; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
