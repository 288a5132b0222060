"""The reference filter: its step response, its limits, and that its parts belong together."""

from __future__ import annotations

from math import exp, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ferryid.simulate.control.reference import Tuning, advance_reference, body_reference, build_reference
from ferryid.simulate.sections import ReferenceTuning

FREE = Tuning((0.3,) * 3, (1.0,) * 3, (1e3,) * 3, (1e3,) * 3)
ORDINARY = ReferenceTuning()
LIMITED = Tuning(ORDINARY.omega_radps, ORDINARY.damping, ORDINARY.speed_limit, ORDINARY.acceleration_limit)


def moving(goal=(15.0, -8.0, 2.0), cycles=60):
    ref = np.zeros((3, 3))
    for _ in range(cycles):
        advance_reference(FREE, ref, goal, 0.05)
    return ref


def test_step_response_is_the_critically_damped_third_order_one():
    ref = np.zeros((3, 3))
    for k in range(400):
        wt = 0.3 * k * 0.05
        expected = 15.0 * (1.0 - exp(-wt) * (1.0 + wt + 0.5 * wt * wt))
        assert ref[0, 0] == pytest.approx(expected, abs=0.03)
        advance_reference(FREE, ref, (15.0, 0.0, 0.0), 0.05)


@pytest.mark.slow
@settings(max_examples=20, deadline=None)
@given(st.floats(-40, 40), st.floats(-40, 40), st.floats(-pi, pi))
def test_it_keeps_its_limits_and_arrives_without_overshoot(x, y, psi):
    ref, goal = np.zeros((3, 3)), np.array([x, y, psi])
    for _ in range(4000):
        before = ref[0].copy()
        advance_reference(LIMITED, ref, (x, y, psi), 0.05)
        assert (np.abs(ref[1]) <= LIMITED.speed_limit).all()
        assert (np.abs(ref[2]) <= LIMITED.acceleration_limit).all()
        assert (np.abs(ref[0] - before) <= 0.05 * np.array(LIMITED.speed_limit) + 1e-12).all()
        assert (np.abs(ref[0]) <= np.abs(goal) * 1.12 + 1e-9).all()
    np.testing.assert_allclose(ref[0], goal, atol=1e-3)


def test_body_velocities_belong_to_the_pose():
    """Finite differences of nu along a turning reference equal the nu_dot it gives."""
    ref = moving()
    nu, nu_dot = (np.array(part) for part in body_reference(ref))
    advance_reference(FREE, ref, (15.0, -8.0, 2.0), 0.002)
    later, dot_later = (np.array(part) for part in body_reference(ref))
    np.testing.assert_allclose((later - nu) / 0.002, 0.5 * (nu_dot + dot_later), atol=2e-4)


def test_a_path_mirrored_to_port_gives_mirrored_velocities():
    mirror = np.array([1.0, -1.0, -1.0])
    for one, other in zip(body_reference(moving()), body_reference(moving((15.0, 8.0, -2.0))), strict=True):
        np.testing.assert_array_equal(np.array(other), mirror * one)


def test_the_scenario_sets_its_tuning(scenario):
    tuning, ref = build_reference(scenario())
    assert tuning == LIMITED
    assert not ref.any()
