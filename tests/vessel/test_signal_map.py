"""Finding signals in a log, converting them, and completing them after alignment."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.ingest.log import Series, Topic
from ferryid.types import Floats
from ferryid.vessel import convert, parse_profile, resolve, resolve_notes, select, survey
from ferryid.vessel.field_words import nearest_field
from ferryid.vessel.profile import Profile

HEAD = """schema = "ferryid.vessel/1"
name = "boat"
source = "made up for a test"
[hull]
mass_kg = 100.0
inertia_z = 200.0
[[actuator]]
name = "t1"
kind = "azimuth"
position_m = [-1.0, 0.0]
thrust = { kind = "quadratic", ahead = 0.01 }
[signals."t1.speed"]
topic = "/t1"
field = "rpm"
unit = "rpm"
[signals."t1.speed.command"]
topic = "/t1/order"
field = "rpm"
unit = "rpm"
[signals."t1.angle"]
topic = "/t1"
field = "angle[1]"
unit = "deg"
"""
BODY = """
[signals.velocity]
topic = "/nav"
fields = ["u", "v"]
unit = "kn"
frame = "FLU"
[signals.yaw_rate]
topic = "/nav"
field = "r"
unit = "deg/s"
frame = "FLU"
"""
WORLD = """
[signals.velocity]
topic = "/nav"
fields = ["ve", "vn"]
unit = "m/s"
frame = "ENU"
mount_m = [2.0, -0.5]
[signals.heading]
topic = "/nav"
field = "yaw"
unit = "deg"
frame = "ENU"
[signals.position]
topic = "/nav"
fields = ["e", "n"]
unit = "km"
frame = "ENU"
mount_m = [2.0, -0.5]
"""
WIND = """
[signals.wind]
topic = "/wind"
speed = "s"
unit = "kn"
direction = "d"
direction_unit = "deg"
reference = "bow"
air = "apparent"
"""


def profile(text: str) -> Profile:
    return parse_profile(HEAD + text, "boat.toml")


def topic(name: str, count: int = 10, **fields: str) -> Topic:
    return Topic(name, "x/Y", "ros1", count, 0, 1, fields)


def series(name: str, **columns: object) -> Series:
    arrays = {path: np.asarray(values) for path, values in columns.items()}
    times = np.arange(len(next(iter(arrays.values()))), dtype=np.int64)
    return Series(name, times, None, arrays)


NAV = topic("/nav", u="float64", v="float64", r="float32")
T1 = Topic("/t1", "x/T", "cdr", 10, 0, 1, {"rpm": "int32", "angle[2]": "float64"})


def test_wanted_fields_are_those_of_the_map_only() -> None:
    selection = select(profile(BODY), [NAV, T1, topic("/camera", data="uint8")], "a.bag")
    assert selection.wanted == {"/nav": ("u", "v", "r"), "/t1": ("rpm", "angle[1]")}
    assert selection.found["u"] == "/nav: u"
    assert selection.found["alpha_t1"] == "/t1: angle[1]"
    assert list(selection.missing) == ["t1.speed.command"]


def test_columns_of_an_enu_frame_name_the_field_that_each_comes_from() -> None:
    nav = topic("/nav", e="float64", n="float64", ve="float64", vn="float64", yaw="float64")
    found = survey(profile(WORLD), [nav, T1]).found
    values = convert(profile(WORLD), series("/nav", e=[3.0], n=[1.0], ve=[0.3], vn=[0.1], yaw=[0.0]))
    assert (found["x"], found["y"]) == ("/nav: n", "/nav: e")
    assert (found["vel_N"], found["vel_E"]) == ("/nav: vn", "/nav: ve")
    assert (values["vel_N"][0], values["vel_E"][0]) == (0.1, 0.3)


def test_misspelt_topic_gets_a_suggestion() -> None:
    with pytest.raises(FerryIdError) as caught:
        select(profile(BODY), [topic("/nav2", u="float64"), T1], "a.bag")
    message = str(caught.value)
    assert message.startswith("a.bag: velocity is needed by the profile boat (boat.toml:25), found no topic")
    assert 'Did you mean "/nav2"?' in message
    assert (
        'found no topic "/nav". Did you mean "/nav2"? The log has /nav2, /t1 (1 more required signal is missing)'
        in message
    )
    assert "\n" not in message


def test_reason_does_not_list_the_topics_for_every_signal() -> None:
    selection = survey(profile(BODY), [topic("/gps", lat="float64"), T1])
    assert selection.missing["velocity"] == selection.missing["yaw_rate"] == 'found no topic "/nav".'


@pytest.mark.parametrize("bits", [0x7FA00000, 0xFFA00001])
def test_signalling_nan_in_float32_is_a_plain_nan(bits: int) -> None:
    speed = np.array([0x3F800000, bits], np.uint32).view(np.float32)
    columns = convert(profile(BODY), Series("/nav", np.arange(2), None, {"r": speed}))
    np.testing.assert_allclose(columns["r"], [-math.pi / 180, np.nan])


def test_misspelt_field_gets_a_suggestion() -> None:
    with pytest.raises(FerryIdError, match=r'no field "r" in /nav \(it has u, v, r_z\)\. Did you mean "r_z"'):
        select(profile(BODY), [topic("/nav", u="float64", v="float64", r_z="float64"), T1], "a.bag")


@pytest.mark.parametrize(
    ("path", "fields", "said"),
    [
        ("u [m/s]", ("v [m/s]", "u [kn]", "r [deg/s]"), ' Did you mean "u [kn]", with unit = "kn"?'),
        ("u [m/s]", ("v [m/s]", "u"), ' Did you mean "u"?'),
        ("u", ("v", "u (knots)"), ' Did you mean "u (knots)", with unit = "kn"?'),
        ("data[1]", ("data (%)", "date[1]"), ' Did you mean "date[1]"?'),
        ("speed", ("sped", "u [kn]"), ' Did you mean "sped"?'),
    ],
)
def test_a_field_of_the_same_name_in_another_unit_comes_first(path: str, fields: tuple[str, ...], said: str) -> None:
    assert nearest_field(path, fields) == said


@pytest.mark.parametrize(
    ("nav", "reason"),
    [
        (
            topic("/nav", u="string", v="float64", r="float64"),
            r'found text \("string"\) in the field u of /nav',
        ),
        (topic("/nav", 0, u="float64", v="float64", r="float64"), "found /nav without a single message"),
        (topic("/nav"), "no readable definition"),
    ],
)
def test_unusable_topics_are_explained(nav: Topic, reason: str) -> None:
    with pytest.raises(FerryIdError, match=reason):
        select(profile(BODY), [nav, T1], "a.bag")


def test_array_index_must_be_inside() -> None:
    short = Topic("/t1", "x/T", "cdr", 10, 0, 1, {"rpm": "int32", "angle[1]": "float64"})
    with pytest.raises(FerryIdError, match=r'no field "angle\[1\]"'):
        select(profile(BODY), [NAV, short], "a.bag")
    sequence = Topic("/t1", "x/T", "cdr", 10, 0, 1, {"rpm": "int32", "angle[]": "float64"})
    assert "alpha_t1" in select(profile(BODY), [NAV, sequence], "a.bag").found


def test_order_stands_in_for_missing_feedback() -> None:
    angle_only = Topic("/t1", "x/T", "cdr", 10, 0, 1, {"angle[2]": "float64"})
    selection = select(profile(BODY), [NAV, angle_only, topic("/t1/order", rpm="float64")], "a.bag")
    assert selection.notes == ("The speed of t1 is the order, as there is no feedback: its lag stays in the residual.",)
    with pytest.raises(FerryIdError, match=r"t1\.speed is needed"):
        select(profile(BODY), [NAV, angle_only], "a.bag")


def test_two_optional_orders_that_are_both_missing_leave_the_actuator_dark() -> None:
    text = (HEAD + BODY).replace('[signals."t1.speed"]\ntopic = "/t1"\nfield = "rpm"\nunit = "rpm"\n', "")
    orders_only = parse_profile(text, "boat.toml")
    with pytest.raises(FerryIdError, match=r"t1\.speed\.command is needed"):
        select(orders_only, [NAV, T1], "a.bag")


def test_survey_never_raises() -> None:
    selection = survey(profile(BODY), [])
    assert selection.wanted == {}
    assert set(selection.missing) == {"velocity", "yaw_rate", "t1.speed", "t1.speed.command", "t1.angle"}


def test_a_leading_slash_makes_no_difference() -> None:
    bare = topic("nav", u="float64", v="float64", r="float32")
    assert "nav" in select(profile(BODY), [bare, T1], "a.bag").wanted
    assert set(convert(profile(BODY), series("nav", u=[1.0], v=[1.0], r=[1.0]))) == {"u", "v", "r"}


def test_port_positive_body_frame_in_knots_and_degrees() -> None:
    given = series("/nav", u=[10.0], v=np.array([1], dtype=np.int16), r=[90.0])
    columns = convert(profile(BODY), given)
    assert columns["u"] == pytest.approx([5.144444444])
    assert columns["v"] == pytest.approx([-0.5144444444])
    assert columns["r"] == pytest.approx([-math.pi / 2])
    columns["u"][0] = 99.0
    assert given.columns["u"][0] == 10.0


@pytest.mark.parametrize("quantity", ["velocity", "yaw_rate"])
def test_an_instrument_that_reads_too_much_is_scaled(quantity: str) -> None:
    given = series("/nav", u=[10.0], v=[1.0], r=[90.0])
    plain = convert(profile(BODY), given)
    text = BODY.replace(f"[signals.{quantity}]\n", f"[signals.{quantity}]\nscale = 0.8\n")
    found = convert(profile(text), given)
    for name, own in (("u", "velocity"), ("v", "velocity"), ("r", "yaw_rate")):
        assert found[name] == pytest.approx((0.8 if own == quantity else 1.0) * plain[name])


def test_world_frame_east_first() -> None:
    columns = convert(profile(WORLD), series("/nav", ve=[1.0], vn=[2.0], yaw=[90.0], e=[0.003], n=[0.004]))
    assert {name: pytest.approx(values) for name, values in columns.items()} == {
        "vel_N": [2.0],
        "vel_E": [1.0],
        "psi": [0.0],
        "x": [4.0],
        "y": [3.0],
    }


def test_sign_then_offset_then_unit() -> None:
    text = (
        BODY + '[signals.heading]\ntopic = "/nav"\nfield = "h"\nunit = "deg"\nframe = "NED"\nsign = -1\noffset = 10.0\n'
    )
    columns = convert(profile(text), series("/nav", h=[30.0]))
    assert columns["psi"] == pytest.approx([math.radians(-20.0)])


HEADING = '[signals.heading]\ntopic = "/nav"\nfield = "h"\nunit = "{}"\nframe = "NED"\n'
TURNING = np.mod(np.arange(0.0, 20.0, 0.05), 2.0 * math.pi)


@pytest.mark.parametrize("steps", [1, 40])
def test_helm_that_jumps_by_six_degrees_is_no_full_turn_of_radians(steps: int) -> None:
    noise = np.random.default_rng(8).normal(0.0, 0.01, 2000)
    helm = 3.08 * np.sign(np.sin(np.pi * (steps + 1) * np.arange(2000) / 2000.0 + 0.1)) + noise
    columns = convert(profile(BODY + HEADING.format("deg")), series("/nav", h=helm))
    assert columns["psi"] == pytest.approx(np.radians(helm))


@pytest.mark.parametrize("low", [0.0, math.pi])
@pytest.mark.parametrize(("unit", "other", "scale"), [("rad", "deg", 180.0 / math.pi), ("deg", "rad", 1.0)])
def test_an_angle_that_wraps_in_another_unit_is_refused(unit: str, other: str, scale: float, low: float) -> None:
    angle = scale * (TURNING - low)
    with pytest.raises(
        FerryIdError, match=rf"boat.toml:\d+: heading is declared in {unit}, .* as {other} do at a full turn"
    ):
        convert(profile(BODY + HEADING.format(unit)), series("/nav", h=angle))
    assert convert(profile(BODY + HEADING.format(other)), series("/nav", h=angle))["psi"].size == angle.size
    if unit == "deg":
        with pytest.raises(FerryIdError, match=r"t1\.angle is declared in deg"):
            convert(profile(BODY), Series("/t1", np.arange(angle.size), None, {"angle[1]": angle}))


@pytest.mark.parametrize(
    ("unit", "angle"),
    [
        ("rad", np.arange(0.0, 100.0, 0.1)),
        ("deg", 3.14 * np.sign(np.sin(np.arange(100.0)))),
        ("deg", 40.0 * np.sin(np.arange(100.0))),
        ("deg", np.zeros(9)),
        ("rad", np.full(9, np.nan)),
    ],
)
def test_honest_angles_are_in_their_unit(unit: str, angle: Floats) -> None:
    convert(profile(BODY + HEADING.format(unit)), series("/nav", h=angle))


def test_quaternion_with_offset() -> None:
    text = BODY + (
        '[signals.heading]\ntopic = "/att"\nquaternion = ["x", "y", "z", "w"]\nframe = "ENU"\noffset_deg = 5.0\n'
    )
    half = math.radians(90.0) / 2
    columns = convert(profile(text), series("/att", x=[0.0], y=[0.0], z=[math.sin(half)], w=[math.cos(half)]))
    assert columns["psi"] == pytest.approx([math.radians(-5.0)])


def test_surge_alone_has_no_sway_to_turn_in_a_port_positive_frame() -> None:
    text = BODY.replace('fields = ["u", "v"]', 'fields = ["u"]')
    columns = convert(profile(text), series("/nav", u=[2.0], r=[0.0]))
    assert columns["u"] == pytest.approx([2.0 * 1852.0 / 3600.0])
    assert "v" not in columns


def test_commanded_force_in_kilonewtons_and_flu() -> None:
    text = BODY + (
        '[signals.tau_d]\ntopic = "/tau"\nfields = ["x", "y", "n"]\nunit = "kN"\nmoment_unit = "kN*m"\nframe = "FLU"\n'
    )
    columns = convert(profile(text), series("/tau", x=[1.0], y=[2.0], n=[3.0]))
    assert {name: values.tolist() for name, values in columns.items()} == {
        "X_d": [1000.0],
        "Y_d": [-2000.0],
        "N_d": [-3000.0],
    }


def test_a_desired_pose_in_enu() -> None:
    text = WORLD + (
        '[signals.position_d]\ntopic = "/goal"\nfields = ["e", "n"]\nunit = "km"\nframe = "ENU"\n'
        '[signals.heading_d]\ntopic = "/goal"\nfield = "yaw"\nunit = "deg"\nframe = "ENU"\n'
    )
    columns = convert(profile(text), series("/goal", e=[0.3], n=[0.1], yaw=[30.0]))
    assert {name: values.tolist() for name, values in columns.items()} == {
        "x_d": [pytest.approx(100.0)],
        "y_d": [pytest.approx(300.0)],
        "psi_d": [pytest.approx(math.radians(60.0))],
    }


def test_throttle_in_per_cent() -> None:
    text = (HEAD + BODY).replace('field = "rpm"\nunit = "rpm"', 'field = "rpm"\nunit = "%"\nfull_rpm = 1200.0', 1)
    columns = convert(parse_profile(text, "boat.toml"), series("/t1", rpm=[-50.0], **{"angle[1]": [180.0]}))
    assert columns["n_t1"] == pytest.approx([-600.0])
    assert columns["alpha_t1"] == pytest.approx([math.pi])


def test_roll_and_pitch_of_a_port_positive_frame() -> None:
    text = BODY + "".join(
        f'[signals.{name}]\ntopic = "/att"\nfield = "{name}"\nunit = "rad"\nframe = "FLU"\n'
        for name in ("roll", "pitch")
    )
    columns = convert(profile(text), series("/att", roll=[0.1], pitch=[0.2]))
    assert (columns["phi"][0], columns["theta"][0]) == (0.1, -0.2)


def test_text_and_impossible_latitudes_are_refused() -> None:
    with pytest.raises(FerryIdError, match=r"/nav: velocity needs numbers, found text in u \('fast'\)"):
        convert(profile(BODY), series("/nav", u=["fast"], v=[1.0], r=[0.0]))
    fix = WORLD.replace(
        'fields = ["e", "n"]\nunit = "km"\nframe = "ENU"',
        'fields = ["lat", "lon"]\nunit = "deg"\nframe = "geodetic"',
    )
    with pytest.raises(FerryIdError, match="latitude within ±90 deg, found 100 deg in lat"):
        convert(profile(fix), series("/nav", lat=[63.0, 100.0], lon=[10.0, 10.0]))


def columns(**values: object) -> dict[str, Floats]:
    return {name: np.atleast_1d(np.asarray(value, dtype=float)) for name, value in values.items()}


def test_antenna_on_a_turning_boat() -> None:
    """Turning on the spot at 0.1 rad/s, an antenna at (2, -0.5) moves with u = 0.05, v = 0.2; the origin stands still."""
    psi = math.radians(30)
    north, east = 0.05 * math.cos(psi) - 0.2 * math.sin(psi), 0.05 * math.sin(psi) + 0.2 * math.cos(psi)
    arm_north, arm_east = 2 * math.cos(psi) + 0.5 * math.sin(psi), 2 * math.sin(psi) - 0.5 * math.cos(psi)
    given = columns(psi=psi, vel_N=north, vel_E=east, r=0.1, x=10 + arm_north, y=20 + arm_east)
    out = resolve(profile(WORLD), given)
    assert (out["u"][0], out["v"][0]) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert (out["x"][0], out["y"][0]) == pytest.approx((10.0, 20.0))
    assert "vel_N" not in out
    assert "vel_N" in given
    assert resolve_notes(profile(WORLD), given) == (
        "Surge and sway are the velocity over ground turned by the heading.",
    )


def test_yaw_rate_and_velocity_from_pose() -> None:
    """On a circle of 10 m at 1 rad/s every 0.01 s: u = 10, v = 0, r = 1, also where the heading wraps."""
    t = np.arange(0.0, 7.0, 0.01)
    only_pose = profile(WORLD.replace("mount_m = [2.0, -0.5]", ""))
    given = columns(x=10 * np.sin(t), y=-10 * np.cos(t), psi=np.mod(t, 2 * math.pi))
    out = resolve(only_pose, given, 100.0)
    np.testing.assert_allclose(out["r"][1:-1], 1.0, rtol=1e-9)
    np.testing.assert_allclose(out["u"][1:-1], 10.0, rtol=1e-4)
    np.testing.assert_allclose(out["v"][1:-1], 0.0, atol=1e-9)
    assert len(resolve_notes(only_pose, given)) == 2
    with pytest.raises(FerryIdError, match="pass rate_hz"):
        resolve(only_pose, given)


def test_nothing_to_derive_from() -> None:
    with pytest.raises(FerryIdError, match="yaw rate is needed"):
        resolve(profile(BODY), columns(u=1.0, v=0.0))
    with pytest.raises(FerryIdError, match="surge and sway velocity are needed"):
        resolve(profile(BODY), columns(r=0.1))


@pytest.mark.parametrize(
    ("options", "speed", "direction", "expected"),
    [
        # Sailing east at 5 m/s in still air, 5 m/s is felt from ahead.
        (("bow", "apparent"), 5.0, 0.0, (0.0, 0.0)),
        # Felt from starboard (south) on a heading of east, besides the own wind: it goes north and is carried along east.
        (("bow", "apparent"), 3.0, math.pi / 2, (3.0, 5.0)),
        (("bow", "true"), 3.0, math.pi / 2, (3.0, 0.0)),
        (("north", "true"), 3.0, math.pi / 2, (0.0, -3.0)),
        (("north", "apparent"), 3.0, 0.0, (-3.0, 5.0)),
    ],
)
def test_true_wind(options: tuple[str, str], speed: float, direction: float, expected: tuple[float, float]) -> None:
    text = WIND.replace('"bow"', f'"{options[0]}"').replace('"apparent"', f'"{options[1]}"')
    heading = '[signals.heading]\ntopic = "/nav"\nfield = "h"\nunit = "rad"\nframe = "NED"\n'
    given = columns(u=5.0, v=0.0, r=0.0, psi=math.pi / 2, wind_speed=speed, wind_from=direction)
    out = resolve(profile(BODY + heading + text), given)
    assert (out["wind_N"][0], out["wind_E"][0]) == pytest.approx(expected, abs=1e-12)
    assert "wind_speed" not in out


def test_wind_units_and_vector_form() -> None:
    heading = '[signals.heading]\ntopic = "/nav"\nfield = "h"\nunit = "rad"\nframe = "NED"\n'
    scalar = convert(profile(BODY + heading + WIND), series("/wind", s=[10.0], d=[-90.0]))
    assert scalar["wind_speed"] == pytest.approx([5.144444444])
    assert scalar["wind_from"] == pytest.approx([-math.pi / 2])
    vector = '[signals.wind]\ntopic = "/wind"\nfields = ["e", "n"]\nunit = "m/s"\nframe = "ENU"\n'
    columns = convert(profile(BODY + vector), series("/wind", e=[1.0], n=[2.0]))
    assert (columns["wind_N"][0], columns["wind_E"][0]) == (2.0, 1.0)


def test_wind_without_a_heading_is_left_out_and_said(boat: Callable[..., Profile]) -> None:
    heading = '[signals.heading]\ntopic = "/nav"\nfield = "h"\nunit = "rad"\nframe = "NED"\nrequired = false\n'
    windy = profile(BODY + heading + WIND)
    given = columns(u=5.0, v=0.0, r=0.0, wind_speed=1.0, wind_from=0.0)
    assert "wind_N" not in resolve(windy, given)
    assert resolve_notes(windy, given) == ("The wind was left out: without a heading it cannot be turned to north.",)


def test_a_signal_that_a_model_needs_is_not_told_by_a_line_that_nobody_can_go_to() -> None:
    with pytest.raises(FerryIdError) as caught:
        select(replace(profile(BODY), path="one"), [topic("/nav2", u="float64"), T1], "a.bag")
    message = str(caught.value)
    assert message.startswith(
        "a.bag: velocity is needed by the profile boat that is stored in the model one, found no topic"
    )
    assert "one:" not in message
    assert message.endswith(
        "Fix: give a log of boat, or, where the topics of that vessel have changed, its profile with --vessel"
    )
