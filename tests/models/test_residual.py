"""The lack-of-fit residual: hand-worked limits, and forces that were left out on purpose."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ferryid.errors import FerryIdError
from ferryid.models.forces.residual import base_force, compute_residual, motion_force, scale_hull
from ferryid.signals.track import Motion
from ferryid.vessel import load_profile
from ferryid.vessel.hull import current_in_body, inverse_dynamics
from ferryid.vessel.wind import wind_force
from tests.vessel.hull_matrices import forward

Floats = NDArray[np.float64]

PROFILE = load_profile("milliampere")
NOTHING: Mapping[str, float] = {}
RATE = 20.0


def applied(t: Floats) -> Floats:
    return np.column_stack([150 + 100 * np.sin(0.2 * t), 80 * np.cos(0.15 * t), 120 * np.sin(0.1 * t)])


def sail(extra: Callable[[Floats, Floats], Floats], seconds: float = 30.0, *, wind: Floats | None = None) -> Motion:
    """Integrate the base model finely under `applied` and an extra force of time and velocity (or heading)."""
    fine, dt = 2, 1.0 / RATE / 2
    n = round(seconds * RATE)
    nu, psi, states = np.zeros(3), 0.0, np.empty((n, 7))

    def rate(now: float, state: Floats, heading: float) -> Floats:
        force = applied(np.array([now]))[0] + extra(np.array([now, heading]), state)
        return forward(PROFILE.hull, state[None], force[None])[0]

    for k in range(n * fine):
        now = k * dt
        if k % fine == 0:
            states[k // fine] = [*nu, *rate(now, nu, psi), psi]
        middle = nu + dt / 2 * rate(now, nu, psi)
        turned = psi + dt / 2 * nu[2]
        nu, psi = nu + dt * rate(now + dt / 2, middle, turned), psi + dt * middle[2]
    t = np.arange(n) / RATE
    eta = np.column_stack([np.full((n, 2), np.nan), states[:, 6]])
    valid = np.ones(n, dtype=bool)
    flow = None if wind is None else np.tile(wind, (n, 1))
    return Motion("trial", t, RATE, eta, states[:, :3], states[:, 3:6], applied(t), valid, states[:, :3], wind=flow)


def none(_: Floats, nu: Floats) -> Floats:
    return np.zeros_like(nu)


@pytest.fixture(scope="module")
def calm() -> Motion:
    return sail(none)


@pytest.fixture(scope="module")
def pushed() -> Motion:
    return sail(lambda _, nu: np.array([-30.0, 20.0, 40.0]))


@pytest.mark.slow
def test_a_perfect_model_leaves_nothing(calm: Motion) -> None:
    np.testing.assert_allclose(compute_residual(PROFILE, calm, NOTHING), 0.0, atol=1e-9)


@pytest.mark.slow
def test_a_force_that_was_left_out_is_what_remains(pushed: Motion) -> None:
    # tau_mes + extra = F, so that tau_mes - F is the extra force with its sign turned.
    np.testing.assert_allclose(
        compute_residual(PROFILE, pushed, NOTHING), np.tile([30.0, -20.0, -40.0], (600, 1)), atol=1e-9
    )


def test_factors_of_the_base_model_by_hand() -> None:
    one = np.ones((1, 3))
    M = PROFILE.hull.M
    scale = {"delta": 0.4, "sigma": 0.5, "zeta": 2.0}
    # At rest only the mass acts: 0.4 M nu_dot / 2.
    still = motion_force(PROFILE, scale, one, 0 * one, np.zeros(1))
    np.testing.assert_allclose(still[0], 0.4 * M.sum(axis=1) / 2.0)
    # At steady surge only the damping does: 0.5 (27.632 + 110.064 + 13.965) / 2 at 1 m/s.
    surge = motion_force(PROFILE, scale, 0 * one, np.array([[1.0, 0, 0]]), np.zeros(1))
    np.testing.assert_allclose(surge[0], [0.5 * (27.632 + 110.064 + 13.965) / 2.0, 0.0, 0.0], atol=1e-12)
    # Surge and yaw rate: the Coriolis force in sway scales with the mass.
    both = np.array([[1.0, 0, 1.0]])
    free = motion_force(PROFILE, {"delta": 1.0, "sigma": 0.0}, 0 * one, both, np.zeros(1))
    less = motion_force(PROFILE, {"delta": 0.4, "sigma": 0.0}, 0 * one, both, np.zeros(1))
    assert free[0, 1] == pytest.approx(2389.657)
    np.testing.assert_allclose(less, 0.4 * free)


def test_the_scaled_hull_is_new_and_the_profile_unchanged() -> None:
    before = PROFILE.hull.M.copy()
    hull = scale_hull(PROFILE.hull, {"delta": 0.4, "sigma": 0.4})
    assert hull.mass_kg == pytest.approx(0.4 * 1670)
    np.testing.assert_array_equal(PROFILE.hull.M, before)


@pytest.mark.slow
def test_measured_wind_belongs_to_the_base_model() -> None:
    assert PROFILE.wind is not None
    areas, wind = PROFILE.wind, np.array([4.0, -6.0])

    def blown(now: Floats, nu: Floats) -> Floats:
        return wind_force(areas, wind[None], now[1:], nu[None])[0]

    motion = sail(blown, 10.0, wind=wind)
    np.testing.assert_allclose(compute_residual(PROFILE, motion, NOTHING), 0.0, atol=1e-9)
    unmeasured = replace(motion, wind=None)
    assert np.abs(compute_residual(PROFILE, unmeasured, NOTHING)).max() > 50.0


def test_a_measured_current_acts_through_the_relative_velocity() -> None:
    rng = np.random.default_rng(0)
    nu, nu_dot, psi = rng.normal(size=(50, 3)), rng.normal(size=(50, 3)), rng.uniform(-3, 3, 50)
    current = np.tile([0.3, -0.2], (50, 1))
    ours = motion_force(PROFILE, NOTHING, nu_dot, nu, psi, current=current)
    exact = inverse_dynamics(PROFILE.hull, nu_dot, nu, current_in_body(current, psi))
    np.testing.assert_allclose(ours, exact)
    # A vessel that drifts with the water feels none.
    drifting = current_in_body(current, psi)
    np.testing.assert_allclose(
        motion_force(PROFILE, NOTHING, np.zeros((50, 3)), drifting, psi, current=current), 0.0, atol=1e-9
    )


@pytest.mark.slow
def test_commanded_force_in_place_of_measured(pushed: Motion) -> None:
    more = np.array([5.0, -6.0, 7.0])
    commanded = replace(pushed, tau_d=pushed.tau + more)
    np.testing.assert_allclose(
        compute_residual(PROFILE, commanded, NOTHING, "commanded"), compute_residual(PROFILE, pushed, NOTHING) + more
    )
    with pytest.raises(FerryIdError, match=r"trial: the commanded residual needs tau_d.*Fix: "):
        compute_residual(PROFILE, pushed, NOTHING, "commanded")


@pytest.mark.slow
def test_the_parallel_simulation_of_a_perfect_model_stays_with_the_vessel(calm: Motion) -> None:
    error = compute_residual(PROFILE, calm, NOTHING, "parallel")
    inside = np.isfinite(error).all(axis=1)
    # One second: ten rows at either end cannot be judged.
    assert inside.sum() == 600 - 20
    assert np.abs(error[inside]).max() < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("horizon_s", [0.1, 0.5, 1.0])
def test_the_parallel_simulation_finds_the_force_that_was_left_out(pushed: Motion, horizon_s: float) -> None:
    error = compute_residual(PROFILE, pushed, NOTHING, "parallel", horizon_s=horizon_s)
    inside = np.isfinite(error).all(axis=1)
    expected = np.array([30.0, -20.0, -40.0])
    np.testing.assert_allclose(error[inside], np.tile(expected, (inside.sum(), 1)), rtol=0.02)


def test_the_parallel_simulation_does_not_cross_a_gap(pushed: Motion) -> None:
    tau = pushed.tau.copy()
    tau[300] = np.nan
    error = compute_residual(PROFILE, replace(pushed, tau=tau), NOTHING, "parallel")
    lost = np.isnan(error).any(axis=1)
    np.testing.assert_array_equal(np.flatnonzero(lost[100:500]) + 100, np.arange(290, 311))


@pytest.mark.slow
def test_a_log_shorter_than_the_horizon_gives_no_parallel_residual(calm: Motion) -> None:
    assert np.isnan(compute_residual(PROFILE, sail(none, 0.5), NOTHING, "parallel")).all()


def test_the_base_force_of_a_log_is_that_of_its_motion(calm: Motion) -> None:
    np.testing.assert_allclose(base_force(PROFILE, calm, NOTHING), calm.tau, atol=1e-9)


def test_unknown_form(calm: Motion) -> None:
    with pytest.raises(FerryIdError, match=r'no residual called "paralel". Did you mean "parallel"\?'):
        compute_residual(PROFILE, calm, NOTHING, "paralel")
