"""Thrusters and the force they apply together: published and hand-worked numbers, sums, symmetries."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ferryid.errors import FerryIdError
from ferryid.types import Floats
from ferryid.vessel import applied_force, load_profile, speed_doubts
from ferryid.vessel.profile import Profile, ThrustCurve
from ferryid.vessel.thrusters import thrust

Boat = Callable[..., Profile]
MILLIAMPERE = load_profile("milliampere")
CURVE = MILLIAMPERE.actuators[0].thrust
assert CURVE is not None


def rows(**columns: float) -> dict[str, Floats]:
    return {name: np.array([value]) for name, value in columns.items()}


def force(profile: Profile, nu: object = (0.0, 0.0, 0.0), **columns: float) -> Floats:
    return applied_force(profile, rows(**columns), np.array([nu], dtype=float))[0][0]


def test_polynomial_at_its_limits() -> None:
    # (4.1) summed by hand: 25.1659 + 235.4112 + 890.6005 - 131.4599 - 522.8951 at 1050 rpm
    value, clipped = thrust(CURVE, np.array([1050.0, -1050.0, 0.0]))
    np.testing.assert_allclose(value, [496.8224, -288.9169, 0.0], atol=1e-3)
    assert not clipped.any()


def test_speed_beyond_the_curve_is_clipped_and_counted() -> None:
    value, clipped = thrust(CURVE, np.array([2000.0, -2000.0, 100.0, np.nan]))
    assert value[:2] == pytest.approx([496.8224, -288.9169], abs=1e-3)
    assert clipped.tolist() == [True, True, False, False]
    assert np.isnan(value[3])


def test_clipping_is_said() -> None:
    columns = {
        "n_thruster1": np.array([0.0, 1200.0, -1100.0]),
        "n_thruster2": np.zeros(3),
        "alpha_thruster1": np.zeros(3),
        "alpha_thruster2": np.zeros(3),
    }
    notes = applied_force(MILLIAMPERE, columns, np.zeros((3, 3)))[1]
    assert notes == ("thruster1: 2 of 3 rows lie outside the thrust curve's -1050 to 1050 rpm and were clipped.",)


def speeds(first: Floats) -> dict[str, Floats]:
    return {
        f"{column}_thruster{k}": first if (column, k) == ("n", 1) else np.zeros(9)
        for column in ("n", "alpha")
        for k in (1, 2)
    }


def test_turns_per_second_declared_for_minutes_are_refused() -> None:
    turned = np.array([0.0, 0.0, 0.0, 0.0, 300.0, 400.0, -200.0, 10.0, np.nan])
    assert speed_doubts(MILLIAMPERE, speeds(turned)) == ()
    with pytest.raises(
        FerryIdError, match=r"milliampere\.toml:\d+: thruster1 cannot turn at 1\.5e\+04 rpm.*Fix: correct the unit"
    ):
        speed_doubts(MILLIAMPERE, speeds(60.0 * turned))
    # A value that stands for none, and one wild sample, are no unit.
    assert speed_doubts(MILLIAMPERE, speeds(np.where(np.abs(turned) > 100.0, 32767.0, turned))) == ()
    assert speed_doubts(MILLIAMPERE, speeds(np.where(turned == 400.0, 24e3, turned))) == ()


def test_a_propeller_that_as_good_as_rests_is_told() -> None:
    (told,) = speed_doubts(MILLIAMPERE, speeds(np.array([0.0, 1.0, 6.0, -5.0, 0.0, 0.0, 0.0, 0.0, np.nan])))
    assert told.startswith("thruster1 never turned faster than 6 rpm, 0.57 % of what its thrust curve covers: if")


def test_quadratic_in_turns_per_second() -> None:
    curve = ThrustCurve("quadratic", "rps", (-math.inf, math.inf), ahead=3.0, astern=2.0)
    np.testing.assert_allclose(thrust(curve, np.array([600.0, -600.0]))[0], [300.0, -200.0])


def test_table_of_two_thrusters_gives_half() -> None:
    curve = load_profile("milliampere-2025").actuators[0].thrust
    assert curve is not None
    # Halfway between 238:98 and 358:140 of both together, and the last entry
    np.testing.assert_allclose(thrust(curve, np.array([298.0, 913.0, -948.0]))[0], [59.5, 425.0, -330.0])


def test_open_water_by_hand() -> None:
    curve = ThrustCurve("open_water", "rps", (-math.inf, math.inf), table=((0.0, 1.0), (0.3, 0.1)), astern=0.2)
    # 10 rps, D 0.2 m, 1 m/s: J = 0.5, K_T = 0.2, T = 1000·100·0.0016·0.2 = 32 N; bollard 48 N; astern -32 N
    value = thrust(curve, np.array([600.0]), advance_mps=np.array([1.0]), diameter_m=0.2)[0]
    assert value == pytest.approx([32.0])
    assert thrust(curve, np.array([600.0]), diameter_m=0.2)[0] == pytest.approx([48.0])
    assert thrust(curve, np.array([-600.0]), diameter_m=0.2)[0] == pytest.approx([-32.0])
    assert thrust(curve, np.array([0.0]), advance_mps=1.0, diameter_m=0.2)[0] == pytest.approx([0.0])


def test_measured_kvlcc2_thrust_agrees_with_its_open_water_curve() -> None:
    """At 10.23 rps and 1.178 m/s HSVA measured 41 N in straight running; two sources, so within the wake's spread."""
    propeller = load_profile("kvlcc2-model").actuators[0]
    assert propeller.thrust is not None
    value = thrust(
        propeller.thrust,
        np.array([10.2295 * 60]),
        advance_mps=1.178 * (1.0 - propeller.inflow["wake_fraction"]),
        diameter_m=propeller.inflow["diameter_m"],
    )[0]
    assert value == pytest.approx([41.0], rel=0.1)


@pytest.mark.slow
@given(st.floats(-300, 300), st.floats(-300, 300), st.floats(-300, 300))
def test_allocated_forces_sum_to_the_demand(boat: Boat, X_d: float, Y_d: float, N_d: float) -> None:
    """NSCA (Torben et al. 2019): the forces it allocates must sum to the demand through our geometry."""
    profile = boat("azimuth", strength="force")
    l_x = 1.8
    f_x = X_d / 2
    f_y = ((l_x * Y_d + N_d) / (2 * l_x), (l_x * Y_d - N_d) / (2 * l_x))
    columns = {}
    for name, across in zip(("a", "b"), f_y, strict=True):
        columns[f"F_{name}"] = math.hypot(f_x, across)
        columns[f"alpha_{name}"] = math.atan2(across, f_x)
    np.testing.assert_allclose(force(profile, **columns), [X_d, Y_d, N_d], atol=1e-9)


@pytest.mark.slow
@given(st.floats(-1050, 1050), st.floats(-1050, 1050), st.floats(-4, 4), st.floats(-4, 4))
def test_mirror(n1: float, n2: float, a1: float, a2: float) -> None:
    one = force(MILLIAMPERE, n_thruster1=n1, n_thruster2=n2, alpha_thruster1=a1, alpha_thruster2=a2)
    two = force(MILLIAMPERE, n_thruster1=n1, n_thruster2=n2, alpha_thruster1=-a1, alpha_thruster2=-a2)
    np.testing.assert_allclose(two, one * [1.0, -1.0, -1.0], atol=1e-9)


def test_stern_thruster_to_starboard_turns_to_port() -> None:
    tau = force(load_profile("gunnerus"), n_cmd_azimuth=100.0, alpha_cmd_azimuth=math.radians(30))
    one = 2.2 * 100**2
    np.testing.assert_allclose(tau, [2 * one * math.cos(math.pi / 6), one, -16.95 * one], rtol=1e-12)


def test_differential_thrust() -> None:
    tau = force(load_profile("vtec-usv"), F_cmd_left=10.0, F_cmd_right=-10.0)
    np.testing.assert_allclose(tau, [0.0, 0.0, 20.0 * 0.205], atol=1e-12)


def test_tunnel_pushes_sideways(boat: Boat) -> None:
    np.testing.assert_allclose(force(boat("tunnel"), n_a=100.0, n_b=0.0), [0.0, 100.0, 180.0], atol=1e-12)


def test_fixed_propeller_with_an_angle(boat: Boat) -> None:
    tau = force(boat("propeller", angle_deg=60.0), n_a=100.0, n_b=0.0)
    np.testing.assert_allclose(tau, [50.0, 50.0 * math.sqrt(3), 1.8 * 50.0 * math.sqrt(3)], rtol=1e-12)


def test_deduction_takes_from_thrust_but_not_from_a_delivered_force(boat: Boat) -> None:
    by_speed = boat("propeller", extra="thrust_deduction = 0.25")
    assert force(by_speed, n_a=100.0, n_b=0.0)[0] == pytest.approx(75.0)
    by_thrust = boat("propeller", strength="thrust", extra="thrust_deduction = 0.25")
    assert force(by_thrust, F_a=100.0, F_b=0.0)[0] == pytest.approx(75.0)
    by_force = boat("propeller", strength="force", extra="thrust_deduction = 0.25")
    assert force(by_force, F_a=100.0, F_b=0.0)[0] == pytest.approx(100.0)


def test_feedback_is_preferred_and_orders_stand_in_with_a_note() -> None:
    columns = rows(
        n_thruster1=500.0,
        n_cmd_thruster1=800.0,
        n_cmd_thruster2=300.0,
        alpha_thruster1=0.0,
        alpha_thruster2=0.0,
    )
    tau, notes = applied_force(MILLIAMPERE, columns, np.zeros((1, 3)))
    expected = thrust(CURVE, np.array([500.0, 300.0]))[0].sum()
    assert tau[0, 0] == pytest.approx(expected)
    assert notes == ("The speed of thruster2 is the order, as there is no feedback: its lag stays in the residual.",)
    ordered = applied_force(MILLIAMPERE, columns, np.zeros((1, 3)), measured=False)[0]
    assert ordered[0, 0] == pytest.approx(thrust(CURVE, np.array([800.0, 300.0]))[0].sum())


def test_actuator_without_any_signal_is_refused() -> None:
    with pytest.raises(FerryIdError, match=r"the angle of thruster2 is needed .* neither feedback nor order"):
        applied_force(
            MILLIAMPERE,
            rows(n_thruster1=1.0, n_thruster2=1.0, alpha_thruster1=0.0),
            np.zeros((1, 3)),
        )
