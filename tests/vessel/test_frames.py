"""Frames: conversions worked by hand and published ellipsoid radii."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ferryid.types import Floats
from ferryid.vessel.frames import (
    derivative,
    heading_from_enu,
    local_north_east,
    to_body,
    to_world,
    wrap,
    yaw_of_quaternion,
)


def quaternion(yaw: float, pitch: float = 0.0, roll: float = 0.0) -> tuple[Floats, ...]:
    """Multiply out the three half-angle rotations z, y, x by hand."""
    cy, sy, cp, sp, cr, sr = (f(a / 2) for a in (yaw, pitch, roll) for f in (math.cos, math.sin))
    x = sr * cp * cy - cr * sp * sy
    y = cr * sp * cy + sr * cp * sy
    z = cr * cp * sy - sr * sp * cy
    w = cr * cp * cy + sr * sp * sy
    return tuple(np.array([value]) for value in (x, y, z, w))


@pytest.mark.slow
@given(st.floats(-3.1, 3.1), st.floats(-1.4, 1.4), st.floats(-3.0, 3.0), st.sampled_from([1.0, -1.0, 2.5]))
def test_yaw_survives_pitch_roll_sign_and_length(yaw: float, pitch: float, roll: float, scale: float) -> None:
    x, y, z, w = (scale * part for part in quaternion(yaw, pitch, roll))
    assert yaw_of_quaternion(x, y, z, w)[0] == pytest.approx(yaw, abs=1e-9)


def test_zero_quaternion_is_no_measurement() -> None:
    zero = np.zeros(1)
    assert np.isnan(yaw_of_quaternion(zero, zero, zero, zero)[0])


@pytest.mark.parametrize(
    ("yaw_deg", "heading_deg"), [(90.0, 0.0), (0.0, 90.0), (-90.0, 180.0), (180.0, 270.0), (45.0, 45.0)]
)
def test_rep103_yaw_to_compass_heading(yaw_deg: float, heading_deg: float) -> None:
    heading = heading_from_enu(np.radians([yaw_deg]))
    assert wrap(heading - math.radians(heading_deg))[0] == pytest.approx(0.0, abs=1e-12)


def test_wrap_keeps_half_a_turn_positive() -> None:
    angles = np.array([math.pi, -math.pi, 3 * math.pi, 0.0, math.radians(359)])
    np.testing.assert_allclose(wrap(angles), [math.pi, math.pi, math.pi, 0.0, math.radians(-1)], atol=1e-12)


@pytest.mark.parametrize(
    ("latitude", "meridian_m", "prime_vertical_m"),
    [(0.0, 6335439.327, 6378137.0), (45.0, 6367381.816, 6388838.290)],  # WGS-84 radii in metres
)
def test_metres_of_an_arc_minute(latitude: float, meridian_m: float, prime_vertical_m: float) -> None:
    minute = math.radians(1 / 60)
    start = math.radians(latitude)
    north, east = local_north_east(np.array([start, start + minute, start]), np.array([0.1, 0.1, 0.1 + minute]))
    np.testing.assert_allclose(north, [0.0, meridian_m * minute, 0.0], rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(east, [0.0, 0.0, prime_vertical_m * math.cos(start) * minute], rtol=1e-9, atol=1e-6)


def test_crossing_the_date_line_and_starting_without_a_fix() -> None:
    latitude = np.radians([np.nan, 0.0, 0.0])
    longitude = np.radians([np.nan, 179.99, -179.99])
    north, east = local_north_east(latitude, longitude)
    assert np.isnan(north[0])
    assert np.isnan(east[0])
    assert east[1:] == pytest.approx([0.0, 6378137.0 * math.radians(0.02)])
    assert all(np.isnan(part).all() for part in local_north_east(longitude[:1], latitude[:1]))


def test_heading_east_the_bow_points_east() -> None:
    east = np.array([math.pi / 2])
    np.testing.assert_allclose(to_world(np.ones(1), np.zeros(1), east), [[0.0], [1.0]], atol=1e-15)
    np.testing.assert_allclose(to_body(np.ones(1), np.zeros(1), east), [[0.0], [-1.0]], atol=1e-15)


def test_derivative_never_reaches_across_a_gap() -> None:
    values = np.array([0.0, 1.0, 2.0, np.nan, 4.0, 5.0, 6.0])
    expected = [np.nan, 10.0, np.nan, np.nan, np.nan, 10.0, np.nan]
    np.testing.assert_allclose(derivative(values, 10.0), expected)
