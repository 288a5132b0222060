"""Wind load: Table 4.2 worked by hand, limits and symmetries."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ferryid.vessel import load_profile
from ferryid.vessel.wind import relative_wind_force, relative_wind_slope, wind_force

WIND = load_profile("milliampere").wind
assert WIND is not None
STILL = np.zeros((1, 3))


def load(speed_north: float, speed_east: float, psi: float = 0.0, nu: object = STILL) -> np.ndarray:
    return wind_force(WIND, np.array([[speed_north, speed_east]]), np.array([psi]), np.asarray(nu))[0]


def test_head_wind_gives_drag_alone() -> None:
    # ½·1.225·10² · 0.5 · 2.9 = 88.8125 N
    np.testing.assert_allclose(load(-10.0, 0.0), [-88.8125, 0.0, 0.0], atol=1e-12)


def test_following_wind_pushes_ahead() -> None:
    np.testing.assert_allclose(load(10.0, 0.0), [88.8125, 0.0, 0.0], atol=1e-9)


def test_wind_from_starboard_pushes_to_port_without_yaw() -> None:
    # ½·1.225·10² · 0.9 · 8.6 = 474.075 N; S_L = 0 and gamma = -90 deg, so no moment
    np.testing.assert_allclose(load(0.0, -10.0), [0.0, -474.075, 0.0], atol=1e-9)


def test_wind_from_45_degrees_on_the_starboard_bow() -> None:
    speed = 10.0 / math.sqrt(2.0)
    denominator = 1.0 - 0.4 * (1.0 - (0.5 * 2.9 / 8.6) / 0.9)
    c_x = -0.5 * math.sqrt(0.5) / denominator
    c_y = -0.9 * math.sqrt(0.5) / denominator
    c_n = -0.18 * (math.pi / 4 - math.pi / 2) * c_y
    np.testing.assert_allclose(
        load(-speed, -speed), 61.25 * np.array([c_x * 2.9, c_y * 8.6, c_n * 8.6 * 5.0]), rtol=1e-12
    )
    # From ahead of the beam the load acts ahead of midship and turns the bow away from the wind: to port.
    assert load(-speed, -speed)[2] < 0.0


def test_own_speed_makes_wind() -> None:
    np.testing.assert_allclose(load(0.0, 0.0, nu=[[10.0, 0.0, 0.3]]), load(-10.0, 0.0))


def test_drifting_with_the_wind_gives_no_load() -> None:
    np.testing.assert_allclose(load(3.0, 0.0, nu=[[3.0, 0.0, 0.0]]), 0.0, atol=1e-12)


@pytest.mark.slow
@given(st.floats(-20, 20), st.floats(-20, 20), st.floats(-4, 4))
def test_mirror_and_rotation(north: float, east: float, psi: float) -> None:
    mirrored = load(north, -east) * [1.0, -1.0, -1.0]
    np.testing.assert_allclose(load(north, east), mirrored, rtol=1e-9, atol=1e-9)
    turned = load(north * math.cos(psi) - east * math.sin(psi), north * math.sin(psi) + east * math.cos(psi), psi)
    # The moment's |gamma| has a kink, not a jump, so rounding may only change the load by rounding.
    np.testing.assert_allclose(turned, load(north, east), rtol=1e-6, atol=1e-6)


def test_rows_are_independent() -> None:
    ne = np.array([[1.0, 2.0], [-3.0, 0.5]])
    psi, nu = np.array([0.3, -1.0]), np.array([[1.0, 0.2, 0.0], [0.5, -0.1, 0.1]])
    both = wind_force(WIND, ne, psi, nu)
    single = np.array([wind_force(WIND, ne[i : i + 1], psi[i : i + 1], nu[i : i + 1])[0] for i in (0, 1)])
    assert both == pytest.approx(single)


def test_slopes_are_the_limits_of_differences() -> None:
    rng = np.random.default_rng(4)
    u, v = rng.uniform(-9.0, 9.0, (2, 300))
    areas = replace(WIND, S_L_m=0.4)
    load, by_u, by_v = relative_wind_slope(areas, u, v)
    np.testing.assert_allclose(load, relative_wind_force(areas, u, v), rtol=1e-12, atol=1e-12)
    h = 1e-5
    for slope, (du, dv) in ((by_u, (h, 0.0)), (by_v, (0.0, h))):
        ahead, astern = (relative_wind_force(areas, u + sign * du, v + sign * dv) for sign in (1.0, -1.0))
        np.testing.assert_allclose(slope, (ahead - astern) / (2.0 * h), rtol=1e-6, atol=1e-5)


def test_slopes_on_the_bow_and_in_still_air() -> None:
    # The load ahead is a square of the speed: its slope is twice the load over the speed, and aside it is C_Y' alone.
    load, by_u, by_v = relative_wind_slope(WIND, np.array([10.0, 0.0]), np.zeros(2))
    np.testing.assert_allclose(by_u[0], 2.0 * load[0] / 10.0)
    np.testing.assert_allclose(by_v[0, :2], [0.0, -0.5 * 1.225 * 10.0 * 0.9 * 8.6])
    assert not load[1].any()
    np.testing.assert_allclose(by_u[1], 0.0, atol=1e-100)
    np.testing.assert_allclose(by_v[1], 0.0, atol=1e-100)
