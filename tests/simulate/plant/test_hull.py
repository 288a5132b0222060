"""The bare hull against the vessel layer and hand-worked numbers of Table 4.1."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ferryid.simulate.plant.hull import DAMPING, fouled, hydrodynamics, perturbed, required_force
from ferryid.simulate.sections import Fouling
from ferryid.vessel.hull import inverse_dynamics
from ferryid.vessel.load import load_profile
from ferryid.vessel.parse_hull import DAMPING_TERMS

HULL = load_profile("milliampere").hull
speed = st.floats(-2.0, 2.0)
turn = st.floats(-0.5, 0.5)


@settings(max_examples=40, deadline=None)
@given(speed, speed, turn, speed, speed, turn)
def test_required_force_equals_the_vessel_layer(u, v, r, u_dot, v_dot, r_dot):
    ours = required_force(hydrodynamics(HULL), u_dot, v_dot, r_dot, u, v, r)
    theirs = inverse_dynamics(HULL, np.array([[u_dot, v_dot, r_dot]]), np.array([[u, v, r]]))[0]
    np.testing.assert_allclose(ours, theirs, rtol=1e-10, atol=1e-9)


def test_every_coefficient_that_a_profile_may_have_counts():
    assert set(DAMPING) == set(DAMPING_TERMS)
    still = required_force(hydrodynamics(HULL), 0.0, 0.0, 0.0, 0.7, 0.5, 0.3)
    for name in DAMPING:
        more = replace(HULL, D={**HULL.D, name: HULL.D.get(name, 0.0) - 1.0})
        ours = required_force(hydrodynamics(more), 0.0, 0.0, 0.0, 0.7, 0.5, 0.3)
        theirs = inverse_dynamics(more, np.zeros((1, 3)), np.array([[0.7, 0.5, 0.3]]))[0]
        assert ours == pytest.approx(tuple(theirs), rel=1e-12)
        assert ours != still


def test_base_model_is_scaled():
    still = required_force(hydrodynamics(HULL, 0.4, 0.0), 1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert still[0] == pytest.approx(0.4 * 2389.657)
    steady = required_force(hydrodynamics(HULL, 0.0, 0.4), 0.0, 0.0, 0.0, 1.0, 0.0, 0.0)
    assert steady[0] == pytest.approx(0.4 * 151.661)  # 27.632 + 110.064 + 13.965 N, Table 4.1


def test_fouling_multiplies_damping_of_second_order_alone():
    foul = hydrodynamics(fouled(HULL, Fouling(surge=2.0, sway=3.0, yaw=0.5)))
    surge = required_force(foul, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0)
    assert surge[0] == pytest.approx(27.632 + 2.0 * 110.064 + 13.965)
    sway = required_force(foul, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    assert sway[1] == pytest.approx(52.947 + 3.0 * 116.486 + 24.313)
    assert sway[2] == pytest.approx(-3.524 + 0.5 * 0.832)
    yaw = required_force(foul, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    assert yaw[1] == pytest.approx(-24.732 + 3.0 * 115.457)
    assert yaw[2] == pytest.approx(122.860 + 0.5 * 874.428)
    both = required_force(foul, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0)
    sway_alone, yaw_alone = -52.947 - 3.0 * 116.486 - 24.313, 24.732 - 3.0 * 115.457
    assert both[1] == pytest.approx(-sway_alone - yaw_alone + 3.0 * (1540.383 - 572.141))


def test_perturbed_multiplies_by_name_and_leaves_the_profile_alone():
    before = HULL.M.copy()
    more = perturbed(HULL, {"m23": 2.0, "X_u": 3.0})
    assert (more.M[1, 2], more.M[2, 1]) == (2.0 * 62.386, 28.141)
    assert (more.D["X_u"], more.D["Y_v"]) == (3.0 * -27.632, -52.947)
    np.testing.assert_array_equal(HULL.M, before)
