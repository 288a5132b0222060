"""Turning what a log holds into the NED world frame and the FRD body frame."""

from __future__ import annotations

import math

import numpy as np

from ferryid.types import Floats

WGS84_A_M = 6378137.0
WGS84_E2 = 6.69437999014e-3


def wrap(angle_rad: Floats) -> Floats:
    """Return angles wrapped to (-pi, pi]."""
    wrapped: Floats = math.pi - np.mod(math.pi - np.asarray(angle_rad, dtype=np.float64), 2.0 * math.pi)
    return wrapped


def yaw_of_quaternion(x: Floats, y: Floats, z: Floats, w: Floats) -> Floats:
    """Return the yaw [rad] of orientation quaternions, shape (n,); NaN where one is zero. Fossen (2021), (2.80).

    The quaternion need not be of unit length.
    """
    square = x * x + y * y + z * z + w * w
    # Both arguments are scaled by |q|², so no division is needed.
    yaw = np.arctan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
    return np.where(square > 0.0, yaw, np.nan)


def heading_from_enu(yaw_rad: Floats) -> Floats:
    """Return the NED heading (clockwise from north) of a yaw anticlockwise from east (ROS REP 103) [rad]."""
    heading: Floats = 0.5 * math.pi - yaw_rad
    return heading


def local_north_east(latitude_rad: Floats, longitude_rad: Floats) -> tuple[Floats, Floats]:
    """Return metres north and east of the first fix on the WGS-84 ellipsoid, shape (n,).

    Uses the meridian and prime-vertical radii at the first finite fix: the error is under 1 mm within 1 km at latitudes
    below 70°, and grows with the square of the distance.
    """
    finite = np.flatnonzero(np.isfinite(latitude_rad) & np.isfinite(longitude_rad))
    if finite.size == 0:
        return np.full_like(latitude_rad, np.nan), np.full_like(longitude_rad, np.nan)
    first_latitude = float(latitude_rad[finite[0]])
    first_longitude = float(longitude_rad[finite[0]])
    squash = 1.0 - WGS84_E2 * math.sin(first_latitude) ** 2
    meridian_m = WGS84_A_M * (1.0 - WGS84_E2) / squash**1.5
    prime_vertical_m = WGS84_A_M / math.sqrt(squash)
    north: Floats = meridian_m * (latitude_rad - first_latitude)
    east: Floats = prime_vertical_m * math.cos(first_latitude) * wrap(longitude_rad - first_longitude)
    return north, east


def to_body(north: Floats, east: Floats, psi_rad: Floats) -> tuple[Floats, Floats]:
    """Return the surge and sway components of a world vector, (2.1) transposed."""
    cos, sin = np.cos(psi_rad), np.sin(psi_rad)
    return cos * north + sin * east, cos * east - sin * north


def to_world(surge: Floats, sway: Floats, psi_rad: Floats) -> tuple[Floats, Floats]:
    """Return the north and east components of a body vector, (2.1)."""
    cos, sin = np.cos(psi_rad), np.sin(psi_rad)
    return cos * surge - sin * sway, sin * surge + cos * sway


def derivative(values: Floats, rate_hz: float, *, angle: bool = False) -> Floats:
    """Return the central difference on a uniform grid, shape (n,); NaN beside missing samples and at the ends.

    With `angle` each difference is wrapped, so that a heading may jump by a full turn.
    """
    step = values[2:] - values[:-2]
    slope = np.full(values.shape, np.nan)
    # The sample itself is not used, but where it is missing the difference would reach across the gap.
    slope[1:-1] = np.where(np.isnan(values[1:-1]), np.nan, 0.5 * rate_hz * (wrap(step) if angle else step))
    return slope
