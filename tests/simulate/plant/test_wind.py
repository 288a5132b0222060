"""Wind load by hand and against the vessel layer."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ferryid.simulate.plant.wind import areas_of, wind_load
from ferryid.vessel.load import load_profile
from ferryid.vessel.wind import wind_force

WIND = load_profile("milliampere").wind
AREAS = areas_of(WIND)


def test_wind_from_ahead_and_abeam_by_hand():
    # q = 0.5 * 1.225 * 10² = 61.25 Pa; head wind: 61.25 * 0.5 * 2.9 m²; beam: 61.25 * 0.90 * 8.6 m², no moment at pi/2.
    assert wind_load(AREAS, 10.0, 0.0) == pytest.approx((-61.25 * 0.5 * 2.9, 0.0, 0.0))
    assert wind_load(AREAS, 0.0, -10.0) == pytest.approx((0.0, 61.25 * 0.90 * 8.6, 0.0), abs=1e-9)
    assert wind_load(AREAS, 0.0, 0.0) == (0.0, 0.0, 0.0)
    assert wind_load(areas_of(None), 3.0, 4.0) == (0.0, 0.0, 0.0)


@settings(max_examples=60, deadline=None)
@given(st.floats(-20, 20), st.floats(-20, 20), st.floats(-pi, pi), st.floats(-2, 2), st.floats(-2, 2))
def test_equals_the_vessel_layer(north, east, psi, u, v):
    theirs = wind_force(WIND, np.array([[north, east]]), np.array([psi]), np.array([[u, v, 0.0]]))[0]
    c, s = np.cos(psi), np.sin(psi)
    ours = wind_load(AREAS, u - c * north - s * east, v - c * east + s * north)
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9)
