"""The PID: directions of its feedback, what its integral may do, and feedforward alone on the reference."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from ferryid.simulate.control.feedforward import build_feedforward
from ferryid.simulate.control.pid import build_pid, desired_force
from ferryid.simulate.control.reference import Tuning, advance_reference, body_reference
from ferryid.simulate.plant.hull import hydrodynamics, required_force
from ferryid.simulate.sections import Control, Gains
from ferryid.vessel.load import load_profile

PROFILE = load_profile("milliampere")
FREE = Tuning((0.3,) * 3, (1.0,) * 3, (1e3,) * 3, (1e3,) * 3)
NONE = (0.0, 0.0)
REST = (0.0, 0.0, 0.0)


@pytest.fixture
def controller(scenario):
    """Return a function of gains that gives a fresh controller: a function of measurement, reference and saturation."""

    def made(gains=Gains(), delta=1.0, sigma=1.0):  # noqa: B008  frozen
        whole = scenario(controller=Control(gains=gains, delta=delta, sigma=sigma))
        pid, integral = build_pid(whole, PROFILE)
        feedforward = build_feedforward(whole, PROFILE, None)

        def force(eta, nu=REST, ref=None, h=0.05, saturated=False):
            ref = np.zeros((3, 3)) if ref is None else ref
            return desired_force(pid, feedforward, ref, integral, eta, nu, NONE, NONE, NONE, h, saturated)

        return force, integral

    return made


def test_on_its_reference_it_is_feedforward_alone(controller):
    ref = np.zeros((3, 3))
    for _ in range(60):
        advance_reference(FREE, ref, (15.0, -8.0, 2.0), 0.05)
    nu_d, nu_dot_d = body_reference(ref)
    force, _ = controller(delta=0.4, sigma=0.3)
    tau, ahead = force(tuple(ref[0]), nu_d, ref)
    assert tau == pytest.approx(ahead)
    assert ahead == pytest.approx(required_force(hydrodynamics(PROFILE.hull, 0.4, 0.3), *nu_dot_d, *nu_d))


def test_feedback_pushes_back_in_the_body_frame(controller):
    gains = replace(Gains(), Ki=REST)
    force, _ = controller(gains)
    # 1 m north of the goal, bow to the east: north is to port, so the push is to starboard.
    tau, _ = force((1.0, 0.0, pi / 2))
    assert tau == pytest.approx((0.0, gains.Kp[0], -gains.Kp[2] * pi / 2), abs=1e-9)
    # 1 m east of it, that is ahead: the push is back.
    tau, _ = force((0.0, 1.0, pi / 2))
    assert tau == pytest.approx((-gains.Kp[1], 0.0, -gains.Kp[2] * pi / 2), abs=1e-9)
    # A heading error beyond half a turn goes the shorter way.
    tau, _ = force((0.0, 0.0, 1.5 * pi))
    assert tau[2] == pytest.approx(gains.Kp[2] * pi / 2)
    tau, _ = force(REST, (0.5, -0.25, 0.1))
    assert tau == pytest.approx((-0.5 * gains.Kd[0], 0.25 * gains.Kd[1], -0.1 * gains.Kd[2]))


@pytest.mark.slow
def test_the_integral_is_limited_and_rests_when_saturated(controller):
    gains = Gains()
    force, _ = controller(gains)
    for _ in range(20_000):
        tau, _ = force((2.0, 0.0, 0.0))
    assert tau[0] == pytest.approx(-2.0 * gains.Kp[0] - gains.integral_limit[0])
    force, integral = controller(gains)
    force((2.0, 0.0, 0.0), h=10.0, saturated=True)
    assert not integral.any()


def test_an_error_mirrored_to_port_gives_a_mirrored_force(controller):
    force, _ = controller()
    tau, _ = force((1.0, -0.7, 0.3), (0.2, -0.1, 0.05))
    other, _ = controller()[0]((1.0, 0.7, -0.3), (0.2, 0.1, -0.05))
    assert other == (tau[0], -tau[1], -tau[2])
