"""Rudder behind a propeller: against the MMG paper's own form, hand-worked limits, symmetries."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ferryid.types import Floats
from ferryid.vessel import applied_force, load_profile
from ferryid.vessel.rudder import rudder_force

PROFILE = load_profile("kvlcc2-model")
RUDDER = PROFILE.actuators[0].rudder
DIAMETER, WAKE, RHO = 0.204, 0.40, 1000.0


def tau(delta: float, thrust: float, u: float, v: float = 0.0, r: float = 0.0) -> Floats:
    return rudder_force(
        RUDDER,
        np.array([delta]),
        np.array([thrust]),
        np.array([[u, v, r]]),
        diameter_m=DIAMETER,
        wake_fraction=WAKE,
        water_density=RHO,
    )[0]


@pytest.mark.slow
@given(st.floats(0.2, 2.0), st.floats(0.05, 0.9), st.floats(-0.6, 0.6))
def test_agrees_with_the_papers_form(u: float, k_t: float, delta: float) -> None:
    """Yasukawa & Yoshimura (2015): u_R = eps u_P sqrt(eta {1 + kappa (sqrt(1 + 8 K_T/(pi J²)) - 1)}² + 1 - eta)."""
    n = 10.0
    u_p = u * (1 - WAKE)
    advance = u_p / (n * DIAMETER)
    slip = 1 + 0.50 * (math.sqrt(1 + 8 * k_t / (math.pi * advance**2)) - 1)
    u_r = 1.09 * u_p * math.sqrt(0.591 * slip**2 + 1 - 0.591)
    normal = 0.5 * RHO * 0.0539 * 2.747 * u_r**2 * math.sin(delta)
    expected = [
        -(1 - 0.387) * normal * math.sin(delta),
        -(1 + 0.312) * normal * math.cos(delta),
        -(-3.5 + 0.312 * -3.248) * normal * math.cos(delta),
    ]
    np.testing.assert_allclose(tau(delta, RHO * n**2 * DIAMETER**4 * k_t, u), expected, rtol=1e-9, atol=1e-12)


def test_starboard_rudder_turns_to_starboard_going_ahead() -> None:
    surge, sway, yaw = tau(0.2, 40.0, 1.0)
    assert surge < 0.0 > sway
    assert yaw > 0.0


def test_going_astern_the_rudder_works_the_other_way() -> None:
    # No wake and no slipstream at the rudder: u_R = 1.09 · 1 m/s from astern
    normal = 0.5 * 1000 * 0.0539 * 2.747 * 1.09**2 * math.sin(-0.2)
    moment = -(-3.5 + 0.312 * -3.248) * normal * math.cos(0.2)
    assert tau(0.2, 0.0, -1.0)[2] == pytest.approx(moment, rel=1e-12)
    assert moment < 0.0


def test_bollard_slipstream_by_hand() -> None:
    # At rest: u_R² = eps² eta kappa² 8 T/(pi rho D²) = 1.1881·0.591·0.25·8·40/(pi·1000·0.041616) = 0.42967 m²/s²
    normal = 0.5 * 1000 * 0.0539 * 2.747 * 0.429655 * math.sin(0.3)
    assert tau(0.3, 40.0, 0.0)[0] == pytest.approx(-0.613 * normal * math.sin(0.3), rel=1e-4)


def test_no_flow_no_force() -> None:
    np.testing.assert_array_equal(tau(0.5, 0.0, 0.0), 0.0)
    np.testing.assert_array_equal(tau(0.5, -30.0, 0.0), 0.0)


def test_drift_resists_itself() -> None:
    assert tau(0.0, 40.0, 1.0, v=0.1)[1] < 0.0  # pushed to port while drifting to starboard
    assert tau(0.0, 40.0, 1.0, r=0.05)[2] < 0.0  # turns against the turn


def test_flow_straightening_by_side() -> None:
    # Drift to starboard has a negative beta_R and the weaker straightening, gamma 0.395 against 0.640.
    starboard, port = tau(0.0, 0.0, 1.0, v=0.01)[1], tau(0.0, 0.0, 1.0, v=-0.01)[1]
    assert -starboard / port == pytest.approx(0.395 / 0.640, rel=1e-3)


@pytest.mark.slow
@given(st.floats(-0.6, 0.6), st.floats(-40, 80), st.floats(-1, 2))
def test_mirror(delta: float, thrust: float, u: float) -> None:
    np.testing.assert_allclose(tau(-delta, thrust, u), tau(delta, thrust, u) * [1.0, -1.0, -1.0], rtol=1e-9, atol=1e-12)


def test_propeller_and_rudder_together() -> None:
    """Measured thrust less deduction, plus the rudder with the slipstream of the thrust before deduction."""
    nu = np.array([[1.0, 0.05, 0.02]])
    columns = {"F_propeller": np.array([40.0]), "delta_propeller": np.array([0.2])}
    total = applied_force(PROFILE, columns, nu)[0][0]
    np.testing.assert_allclose(total - tau(0.2, 40.0, 1.0, 0.05, 0.02), [0.78 * 40.0, 0.0, 0.0], atol=1e-12)


def test_thrust_from_the_open_water_curve_where_it_was_not_measured() -> None:
    columns = {"n_propeller": np.array([600.0]), "delta_propeller": np.array([0.0])}
    # Ahead at 1 m/s: J = 0.6/(10·0.204) = 0.29412, K_T = 0.261 - (0.016)(0.04412/0.05) = 0.246882
    expected = 0.78 * 1000 * 100 * 0.204**4 * 0.2468816
    assert applied_force(PROFILE, columns, np.array([[1.0, 0, 0]]))[0][0, 0] == pytest.approx(expected, rel=1e-5)
    # Astern the wake is not at the propeller: J is clipped at 0 here, K_T 0.323
    astern = applied_force(PROFILE, columns, np.array([[-0.5, 0, 0]]))[0][0, 0]
    assert astern == pytest.approx(0.78 * 1000 * 100 * 0.204**4 * 0.323, rel=1e-9)
