"""Loads of steady winds, compiled: they are those of the profile's formula."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ferryid.compiled import compiled
from ferryid.effects.wind_loads import angle, steady_wind_force
from ferryid.types import Floats
from ferryid.vessel import load_profile
from ferryid.vessel.wind import wind_force

FERRY = load_profile("milliampere").wind


@compiled
def angles(a: Floats, b: Floats) -> Floats:
    out = np.empty(len(a))
    for i in range(len(a)):
        out[i] = angle(a[i], b[i])
    return out


def test_angle_is_that_of_the_library_to_the_last_digits() -> None:
    rng = np.random.default_rng(1)
    a = np.abs(rng.standard_normal(100_000))
    b = rng.standard_normal(100_000) * 10.0 ** rng.uniform(-4.0, 4.0, 100_000)
    edges = (
        np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]),
        np.array([0.0, 1.0, -1.0, 0.0, 1.0, -1.0, math.tan(math.pi / 16.0)]),
    )
    for one, other in ((a, b), edges):
        np.testing.assert_allclose(angles(one, other), np.arctan2(one, other), rtol=4e-16, atol=4e-16)


def test_weighed_loads_of_several_winds_are_those_of_the_formula() -> None:
    assert FERRY is not None
    rng = np.random.default_rng(2)
    psi, nu = rng.uniform(-np.pi, np.pi, 50), rng.standard_normal((50, 3))
    nu[0], winds, weights = 0.0, rng.uniform(-9.0, 9.0, (4, 2)), rng.standard_normal(4)
    winds[0] = 0.0
    expected = sum(
        weight * wind_force(FERRY, np.broadcast_to(wind, (50, 2)), psi, nu)
        for wind, weight in zip(winds, weights, strict=True)
    )
    made = steady_wind_force(FERRY, winds, weights, np.cos(psi), np.sin(psi), nu)
    assert made == pytest.approx(expected, rel=1e-12, abs=1e-12)
