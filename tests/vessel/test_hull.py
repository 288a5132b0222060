"""Hull: hand-worked values, symmetries, conservation of energy, invariance in a moving frame."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ferryid.types import Floats
from ferryid.vessel import load_profile
from ferryid.vessel.hull import current_in_body, inverse_dynamics
from ferryid.vessel.profile import Hull
from tests.vessel.hull_matrices import coriolis, damping, forward

MILLIAMPERE = load_profile("milliampere").hull
SPEEDS = st.tuples(*(st.floats(-3.0, 3.0) for _ in range(3))).map(np.array)


def tanker() -> Hull:
    """Rigid hull with its centre of gravity off the origin."""
    return load_profile("kvlcc2-model").hull


def test_coriolis_by_hand() -> None:
    # c13 = -m22 v - (m23 + m32)/2 r = -2533.911*0.5 - 45.2635*0.1, c23 = m11 u = 2389.657*2
    matrix = coriolis(MILLIAMPERE.M, np.array([2.0, 0.5, 0.1]))
    c13, c23 = -1271.48185, 4779.314
    np.testing.assert_allclose(matrix, [[0, 0, c13], [0, 0, c23], [-c13, -c23, 0]], rtol=1e-12)


@pytest.mark.slow
@given(SPEEDS)
def test_coriolis_does_no_work(nu: Floats) -> None:
    matrix = coriolis(MILLIAMPERE.M, nu)
    np.testing.assert_array_equal(matrix, -matrix.T)
    assert nu @ matrix @ nu == pytest.approx(0.0, abs=1e-9)


def test_damping_by_hand() -> None:
    # Table 4.1 at u = 1, v = -2, r = 0.5, each element of (2.14) worked with pencil
    matrix = damping(MILLIAMPERE.D, np.array([1.0, -2.0, 0.5]))
    d11 = 27.632 + 110.064 + 13.965
    d22 = 52.947 + 116.486 * 2 + 1540.383 * 0.5 + 24.313 * 4
    d23 = -24.732 - 572.141 * 2 + 115.457 * 0.5
    d32 = -3.524 + 0.832 * 2 - 336.827 * 0.5
    d33 = 122.860 + 121.957 * 2 + 874.428 * 0.5
    np.testing.assert_allclose(matrix, [[d11, 0, 0], [0, d22, d23], [0, d32, d33]], rtol=1e-12)


@pytest.mark.slow
@given(SPEEDS)
def test_port_and_starboard_mirror(nu: Floats) -> None:
    mirror = np.array([1.0, -1.0, -1.0])
    force = inverse_dynamics(MILLIAMPERE, np.zeros((1, 3)), nu[None])
    mirrored = inverse_dynamics(MILLIAMPERE, np.zeros((1, 3)), (nu * mirror)[None])
    np.testing.assert_allclose(mirrored, force * mirror, atol=1e-9)


@pytest.mark.slow
@given(SPEEDS, SPEEDS)
def test_force_is_the_sum_of_the_matrices(nu: Floats, nu_dot: Floats) -> None:
    expected = MILLIAMPERE.M @ nu_dot + (coriolis(MILLIAMPERE.M, nu) + damping(MILLIAMPERE.D, nu)) @ nu
    np.testing.assert_allclose(
        inverse_dynamics(MILLIAMPERE, nu_dot[None], nu[None])[0], expected, rtol=1e-12, atol=1e-9
    )


@pytest.mark.slow
@given(SPEEDS, SPEEDS, SPEEDS)
def test_forward_is_the_inverse(nu: Floats, nu_dot: Floats, current: Floats) -> None:
    nu_c = (current * [1.0, 1.0, 0.0])[None]
    tau = inverse_dynamics(MILLIAMPERE, nu_dot[None], nu[None], nu_c)
    np.testing.assert_allclose(forward(MILLIAMPERE, nu[None], tau, nu_c)[0], nu_dot, atol=1e-9)


@pytest.mark.slow
@given(SPEEDS, SPEEDS, SPEEDS)
def test_a_steady_current_is_a_moving_frame(nu: Floats, nu_dot: Floats, current: Floats) -> None:
    """Forces do not depend on the frame's steady speed (Galileo): they are those of still water at nu_r."""
    for hull in (MILLIAMPERE, tanker()):
        nu_c = np.array([current[0], current[1], 0.0])
        nu_c_dot = np.array([nu[2] * nu_c[1], -nu[2] * nu_c[0], 0.0])
        moving = inverse_dynamics(hull, nu_dot[None], nu[None], nu_c[None])
        # The off-diagonal Coriolis term uses the mean of m23 and m32, so the frames agree only for a symmetric M.
        asymmetry = 0.5 * (hull.M[1, 2] - hull.M[2, 1]) * nu_c_dot[1]
        still = inverse_dynamics(hull, (nu_dot - nu_c_dot)[None], (nu - nu_c)[None])
        np.testing.assert_allclose(moving, still, rtol=1e-9, atol=1e-7 + abs(asymmetry))


def test_drifting_with_the_current_takes_no_force() -> None:
    psi = np.linspace(0.0, 6.0, 7)
    nu_c = current_in_body(np.tile([0.6, -0.8], (7, 1)), psi)
    assert nu_c[0] == pytest.approx([0.6, -0.8, 0.0])
    tau = inverse_dynamics(MILLIAMPERE, np.zeros((7, 3)), nu_c, nu_c)
    np.testing.assert_allclose(tau, 0.0, atol=1e-12)


def test_current_from_abeam() -> None:
    # Heading east, the current goes north: it comes over the starboard side and goes to port.
    nu_c = current_in_body(np.array([[1.0, 0.0]]), np.array([np.pi / 2]))
    np.testing.assert_allclose(nu_c, [[0.0, -1.0, 0.0]], atol=1e-15)


def _free(hull: Hull, nu: Floats, steps: int, dt: float) -> Floats:
    def rate(state: Floats) -> Floats:
        return forward(hull, state[None], np.zeros((1, 3)))[0]

    out = [nu]
    for _ in range(steps):
        state = out[-1]
        k1 = rate(state)
        k2 = rate(state + 0.5 * dt * k1)
        k3 = rate(state + 0.5 * dt * k2)
        k4 = rate(state + dt * k3)
        out.append(state + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
    return np.array(out)


def test_energy_is_conserved_without_damping() -> None:
    hull = tanker()
    path = _free(hull, np.array([1.0, 0.3, 0.2]), 400, 0.02)
    energy = 0.5 * np.einsum("ti,ij,tj->t", path, hull.M, path)
    assert np.ptp(path[:, 0]) > 0.05
    np.testing.assert_allclose(energy, energy[0], rtol=1e-9)


def test_damping_takes_energy() -> None:
    path = _free(MILLIAMPERE, np.array([1.0, 0.5, 0.2]), 200, 0.05)
    energy = 0.5 * np.einsum("ti,ij,tj->t", path, MILLIAMPERE.M, path)
    assert np.all(np.diff(energy) < 0.0)


def test_rigid_body_about_an_origin_off_its_centre() -> None:
    """Turning on the spot about the origin, the centre of gravity must be pulled inwards with m x_G r²."""
    hull = tanker()
    tau = inverse_dynamics(hull, np.zeros((1, 3)), np.array([[0.0, 0.0, 0.1]]))
    np.testing.assert_allclose(tau, [[-3272.0 * 0.2436 * 0.01, 0.0, 0.0]], rtol=1e-12)
    assert hull.inertia_z == pytest.approx(3272.0 * (1.7402**2 + 0.2436**2))
