"""Open-loop manoeuvres: what the helm and the propellers are told, and when."""

from __future__ import annotations

from dataclasses import replace
from math import pi, radians

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.simulate.control.manoeuvres import build_helm, helm
from ferryid.simulate.sections import Manoeuvre
from ferryid.vessel.load import load_profile
from ferryid.vessel.profile import Actuator
from ferryid.vessel.thrusters import force_at

FERRY = load_profile("milliampere")
TANKER = load_profile("esso-osaka")
QUAD = load_profile("milliampere-2025")
CURVE = FERRY.actuators[0].thrust
MIXED = replace(
    FERRY,
    actuators=(
        Actuator("bow", "tunnel", (2.0, 0.0), CURVE, angle_rad=0.5 * pi),
        Actuator("main", "propeller", (-2.0, 0.0), CURVE),
        Actuator("reversed", "propeller", (-2.0, 0.0), CURVE, angle_rad=-pi),
    ),
)


@pytest.fixture
def steering(scenario):
    """Return a function of profile and manoeuvre that gives a function of time and heading to orders, shape (k, 2)."""

    def made(profile, kind, **keys):
        manoeuvre, state = build_helm(scenario(manoeuvre=Manoeuvre(kind=kind, **keys)), profile)

        def orders(t, psi=0.0):
            out = np.full((len(profile.actuators), 2), np.nan)
            helm(manoeuvre, state, t, (0.0, 0.0, psi), (0.0, 0.0, 0.0), out)
            return out

        return orders

    return made


def moment(profile, orders):
    """Return the sum of forces that orders of equal strength give, taking 1 rpm for 1 N."""
    rows = [
        force_at(actuator, np.array(speed), angle if actuator.kind == "azimuth" else actuator.angle_rad)
        for actuator, (speed, angle) in zip(profile.actuators, orders, strict=True)
    ]
    return np.sum(rows, axis=0)


def zigzag(orders, angle_of, side=1.0):
    """Steer a vessel that answers ``5 s r' + r = 0.2 delta`` and return heading and helm [rad], 0.1 s apart."""
    psi = r = 0.0
    rows = []
    for k in range(3000):
        delta = angle_of(orders(0.1 * k, psi))
        rows.append((psi, delta))
        r += 0.1 * (0.2 * delta - r) / 5.0
        psi += 0.1 * r
    return np.array(rows) * side


@pytest.mark.parametrize(
    ("profile", "angle_of"),
    [(TANKER, lambda out: out[0, 1]), (FERRY, lambda out: -out[1, 1])],
    ids=["rudder", "azimuth"],
)
def test_zigzag_swings_the_helm_at_each_change_of_heading(steering, profile, angle_of):
    rows = zigzag(steering(profile, "zigzag", lead_s=20.0, helm_deg=15.0, heading_deg=10.0), angle_of)
    heading, delta = rows.T
    assert not delta[:200].any()
    assert np.abs(delta[200:]) == pytest.approx(radians(15.0))
    swings = 200 + np.flatnonzero(np.diff(delta[200:])) + 1
    assert len(swings) > 6
    assert delta[200] > 0.0
    for i, at in enumerate(swings):
        side = 1.0 if i % 2 == 0 else -1.0
        assert side * heading[at - 1] < radians(10.0) <= side * heading[at]
        assert delta[at] * side < 0.0
    # It overshoots, so that the test is of a vessel with a turn of its own.
    assert np.abs(heading).max() > radians(12.0)


def test_a_negative_helm_mirrors_the_zigzag(steering):
    starboard = zigzag(steering(TANKER, "zigzag", helm_deg=20.0), lambda out: out[0, 1])
    port = zigzag(steering(TANKER, "zigzag", helm_deg=-20.0), lambda out: out[0, 1], side=-1.0)
    np.testing.assert_array_equal(starboard, port)


def test_zigzag_counts_from_the_heading_at_the_end_of_the_lead(steering):
    orders = steering(TANKER, "zigzag", lead_s=10.0, heading_deg=20.0)
    assert orders(9.95, 2.9)[0, 1] == 0.0
    assert orders(10.0, 3.0)[0, 1] > 0.0
    assert orders(11.0, 3.0 + 0.99 * radians(20.0))[0, 1] > 0.0
    assert orders(12.0, 3.0 + 1.01 * radians(20.0))[0, 1] < 0.0


def test_turning_circle_keeps_its_helm(steering):
    orders = steering(FERRY, "turning-circle", speed_rpm=600.0, lead_s=10.0, helm_deg=35.0)
    np.testing.assert_array_equal(orders(9.0), [(600.0, 0.0), (600.0, 0.0)])
    for t, psi in ((10.0, 0.1), (50.0, 4.0), (500.0, -9.0)):
        np.testing.assert_allclose(orders(t, psi), [(600.0, 0.0), (600.0, -radians(35.0))])


@pytest.mark.parametrize("profile", [FERRY, QUAD], ids=["two", "four"])
def test_helm_to_starboard_turns_to_starboard(steering, profile):
    for sign in (1.0, -1.0):
        total = moment(profile, steering(profile, "turning-circle", lead_s=0.0, helm_deg=sign * 20.0)(1.0))
        assert sign * total[2] > 0.0


@pytest.mark.parametrize("profile", [FERRY, QUAD], ids=["two", "four"])
def test_on_the_spot_moments_add_up_and_forces_cancel(steering, profile):
    orders = steering(profile, "on-the-spot-turn", speed_rpm=400.0, lead_s=20.0, hold_s=30.0)
    full = 400.0 * sum(abs(actuator.position_m[0]) for actuator in profile.actuators)
    for t, side in ((0.0, 1.0), (19.9, 1.0), (20.0, -1.0), (49.9, -1.0), (50.0, 1.0), (80.0, -1.0)):
        np.testing.assert_allclose(moment(profile, orders(t)), (0.0, 0.0, side * full), atol=1e-9)
        assert (orders(t)[:, 0] == 400.0).all()


def test_tunnel_thrusters_turn_by_running_backwards(steering):
    orders = steering(MIXED, "on-the-spot-turn", speed_rpm=400.0, lead_s=20.0)
    np.testing.assert_array_equal(orders(0.0), [(400.0, 0.0), (0.0, 0.0), (0.0, 0.0)])
    np.testing.assert_array_equal(orders(20.0)[0], (-400.0, 0.0))


def test_rpm_steps_run_through_their_levels_over_and_over(steering):
    orders = steering(FERRY, "rpm-steps", speed_rpm=800.0, hold_s=10.0, levels=(0.5, 1.0, -0.25))
    for t, speed in ((0.0, 400.0), (9.9, 400.0), (10.0, 800.0), (20.0, -200.0), (30.0, 400.0), (55.0, -200.0)):
        np.testing.assert_array_equal(orders(t), [(speed, 0.0), (speed, 0.0)])


def test_a_vessel_without_rudder_turns_by_its_propellers_speeds(steering):
    boat = replace(
        FERRY, actuators=tuple(Actuator(name, "propeller", (-1.0, y), CURVE) for name, y in (("p", -0.5), ("s", 0.5)))
    )
    orders = steering(boat, "zigzag", speed_rpm=400.0, lead_s=10.0, heading_deg=20.0)
    np.testing.assert_array_equal(orders(0.0)[:, 0], (400.0, 400.0))
    starboard = orders(10.0)
    np.testing.assert_array_equal(starboard[:, 0], (600.0, 200.0))
    assert moment(boat, starboard)[2] > 0.0
    np.testing.assert_array_equal(orders(20.0, np.radians(21.0))[:, 0], (200.0, 600.0))
    # Where something can be turned, that steers.
    np.testing.assert_array_equal(steering(FERRY, "zigzag", speed_rpm=400.0, lead_s=0.0)(1.0)[:, 0], (400.0, 400.0))


def test_straight_ahead_is_ahead_for_propellers_that_look_aft(steering):
    orders = steering(MIXED, "rpm-steps", speed_rpm=800.0, levels=(1.0,))(0.0)
    np.testing.assert_array_equal(orders[:, 0], (0.0, 800.0, -800.0))


@pytest.mark.parametrize(
    ("profile", "kind", "told"),
    [
        (MIXED, "zigzag", "an azimuth thruster or a rudder aft"),
        (TANKER, "on-the-spot-turn", "fore or aft of the body origin, found propeller_rudder at"),
        (replace(FERRY, actuators=MIXED.actuators[:1]), "rpm-steps", "an actuator that pushes ahead"),
    ],
)
def test_a_manoeuvre_without_the_means_is_refused(steering, profile, kind, told):
    with pytest.raises(FerryIdError, match=rf'^test\.toml: the manoeuvre "{kind}" needs .*{told}[^\n]* Fix: '):
        steering(profile, kind)


def test_without_a_manoeuvre_there_is_nothing_to_check(scenario):
    build_helm(scenario(), MIXED)


@pytest.mark.parametrize("kind", ["rpm-steps", "on-the-spot-turn"])
def test_orders_stay_orders_beyond_any_whole_number(scenario, kind):
    manoeuvre, state = build_helm(scenario(manoeuvre=Manoeuvre(kind=kind, lead_s=0.0)), load_profile("milliampere"))
    orders = np.zeros((2, 2))
    # Compiled, the number would wrap round; in plain Python there is none.
    for function in (helm, getattr(helm, "py_func", helm)):
        function(manoeuvre._replace(hold_s=1e-310), state, 10.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), orders)
        assert np.abs(orders[:, 0]).max() in {abs(500.0 * level) for level in (1.0, *Manoeuvre().levels)}
