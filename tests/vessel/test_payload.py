"""A measured payload: its mechanics against a point mass in the world, and its entry in the signal map."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from ferryid.errors import FerryIdError
from ferryid.ingest.log import Series, Topic
from ferryid.types import Floats
from ferryid.vessel import check_profile, convert, describe, load_profile, parse_profile, resolve, resolve_notes, survey
from ferryid.vessel.hull import payload_force, payload_mass
from ferryid.vessel.profile import Profile
from tests.vessel.hull_matrices import coriolis

BOAT = """schema = "ferryid.vessel/1"
name = "boat"
source = "made up for a test"
[hull]
mass_kg = 100.0
inertia_z = 200.0
[[actuator]]
name = "main"
kind = "force"
position_m = [-1.0, 0.0]
[signals."main.force"]
topic = "/main"
field = "force"
unit = "N"
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
"""
PAYLOAD = '[signals.payload]\ntopic = "/load"\nmass = "m"\nunit = "t"\n'
PLACED = PAYLOAD + 'x = "x"\nx_unit = "ft"\n'


def boat(text: str) -> Profile:
    return parse_profile(BOAT + text, "boat.toml")


def load(**values: float) -> Series:
    return Series(
        "/load", np.zeros(1, dtype=np.int64), None, {path: np.array([value]) for path, value in values.items()}
    )


def logged(*fields: str) -> list[Topic]:
    return [Topic("/load", "x/Load", "ros1", 10, 0, 1, dict.fromkeys(fields, "float32"))]


def test_force_is_that_of_newton_for_a_point_mass_in_the_world() -> None:
    rng = np.random.default_rng(3)
    t = np.linspace(0.0, 2.0, 41)
    m, x = 400.0, -1.3
    north, east, psi = (Polynomial(rng.normal(size=5)) for _ in range(3))
    heading = psi(t)
    c, s = np.cos(heading), np.sin(heading)

    def to_body(n: Floats, e: Floats) -> Floats:
        return np.array([c * n + s * e, -s * n + c * e])

    rate, turning = psi.deriv(1)(t), psi.deriv(2)(t)
    u, v = to_body(north.deriv(1)(t), east.deriv(1)(t))
    over_n, over_e = to_body(north.deriv(2)(t), east.deriv(2)(t))
    # d/dt of R' p_dot: what the body sees of the acceleration, and of its own turning.
    nu_dot = np.column_stack([over_n + rate * v, over_e - rate * u, turning])
    # The point stands at p + R [x, 0]; its acceleration in the world, differentiated by hand.
    point_n = north.deriv(2)(t) - x * (s * turning + c * rate**2)
    point_e = east.deriv(2)(t) + x * (c * turning - s * rate**2)
    surge, sway = m * to_body(point_n, point_e)
    found = payload_force(np.tile([m, x], (len(t), 1)), nu_dot, np.column_stack([u, v, rate]))
    np.testing.assert_allclose(found, np.column_stack([surge, sway, x * sway]), rtol=1e-9, atol=1e-7)


def test_force_is_that_of_its_mass_matrix_and_the_coriolis_matrix_tied_to_it() -> None:
    rng = np.random.default_rng(4)
    nu, nu_dot, loads = (
        rng.normal(size=(3, 3)),
        rng.normal(size=(3, 3)),
        np.array([[300.0, 0.7], [0.0, 5.0], [80.0, -2.0]]),
    )
    M = payload_mass(loads)
    np.testing.assert_array_equal(M[0], [[300, 0, 0], [0, 300, 210], [0, 210, 300 * 0.7**2]])
    expected = [M[k] @ nu_dot[k] + coriolis(M[k], nu[k]) @ nu[k] for k in range(3)]
    np.testing.assert_allclose(payload_force(loads, nu_dot, nu), expected, rtol=1e-12, atol=1e-9)


def test_mass_and_place_come_in_si() -> None:
    columns = convert(boat(PLACED), load(m=0.25, x=-2.0))
    assert columns["payload_kg"][0] == pytest.approx(250.0)
    assert columns["payload_x"][0] == pytest.approx(-0.6096)


def test_the_light_ship_is_taken_off_a_displacement() -> None:
    whole = boat(PAYLOAD + "offset = -1.67\n")
    assert convert(whole, load(m=2.0))["payload_kg"][0] == pytest.approx(330.0)


def test_a_place_that_is_not_measured_is_the_profiles() -> None:
    ferry = boat(PAYLOAD + "x_m = 1.5\n")
    given = {name: np.full(3, 1.0) for name in ("u", "v", "r")} | {"payload_kg": np.array([np.nan, 0.0, 70.0])}
    np.testing.assert_array_equal(resolve(ferry, given)["payload_x"], [np.nan, 1.5, 1.5])
    (note,) = resolve_notes(ferry, given)
    assert note == "The payload's place is not measured: the profile puts it at x = 1.5 m."
    assert "standing at x = 1.5 m, may be missing" in describe(ferry)


def test_a_log_may_lack_it() -> None:
    there = survey(boat(PLACED), logged("m", "x"))
    assert (there.found["payload_kg"], there.found["payload_x"]) == ("/load: m", "/load: x")
    assert survey(boat(PAYLOAD), logged("m")).found["payload_kg"] == "/load: m"
    milliampere = load_profile("milliampere")
    assert {signal.quantity for signal in milliampere.signals if not signal.required} >= {"payload", "current"}


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        (PAYLOAD.replace('"t"', '"kN"'), 'unit "kN" measures a force, but this is a mass'),
        (PAYLOAD.replace("mass", "field"), 'lacks "mass"'),
        (PLACED + "x_m = 1.0\n", "x_m"),
    ],
)
def test_faults_are_told(wrong: str, told: str) -> None:
    with pytest.raises(FerryIdError, match=told):
        boat(wrong)


def test_the_bundled_profile_has_no_faults() -> None:
    assert check_profile("milliampere") == []
