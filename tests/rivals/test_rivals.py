"""Every rival finds the truth where it is there to be found: noise-free or nearly, with the terms that it knows."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ferryid.regression.bases import make_basis
from ferryid.signals.prepare import Opened
from ferryid.signals.smooth import Measured
from ferryid.types import Floats
from tests.identify.rounds import PROFILE, RATE_HZ, motion
from tests.rivals.methods import METHODS
from tests.rivals.output_error import FUNCTIONS, Shooting, base_coefficients
from tests.rivals.task import Task

BASIS = make_basis("modulus", structure="decoupled")
SIZES = {
    ("u_dot", 0): 300.0,
    ("u", 0): 40.0,
    ("v_dot", 1): -250.0,
    ("|v|v", 1): 200.0,
    ("r_dot", 2): 500.0,
    ("r", 2): 900.0,
}
"""What the truth has beside the base model, by term and axis."""


def truth() -> Floats:
    theta = np.zeros((len(BASIS.terms), 3))
    for (name, axis), size in SIZES.items():
        theta[BASIS.terms.index(name), axis] = size
    return theta


@cache
def task(noise: float) -> Task:
    """Return two logs of the base model with the terms above, positions included, and white noise of the forces."""
    rng, logs = np.random.default_rng(7), []
    for seed in (1, 2):
        made = motion(seed)
        c, s = np.cos(made.eta[:, 2]), np.sin(made.eta[:, 2])
        rate = np.column_stack([c * made.nu[:, 0] - s * made.nu[:, 1], s * made.nu[:, 0] + c * made.nu[:, 1]])
        path = np.concatenate([np.zeros((1, 2)), np.cumsum((rate[1:] + rate[:-1]) / 2.0 / RATE_HZ, axis=0)])
        tau = made.tau + BASIS.of(made) @ truth() + noise * rng.standard_normal(made.tau.shape)
        measured = Measured(
            log=made.log,
            t=made.t,
            rate_hz=RATE_HZ,
            eta=np.column_stack([path, made.eta[:, 2]]),
            nu=made.nu,
            tau=tau,
            usable=np.ones(len(made.t), dtype=bool),
            tau_d=None,
            eta_d=None,
            wind=None,
            current=None,
            payload=None,
            repairs=(),
        )
        logs.append(Opened(None, None, measured))
    return Task.of(PROFILE, logs)


@pytest.mark.slow
def test_shooting_integrates_the_base_model_along_its_own_motion() -> None:
    coefficients = base_coefficients(task(0.0))
    assert coefficients[FUNCTIONS.index("ur"), 1] == pytest.approx(PROFILE.hull.M[0, 0])
    assert coefficients[FUNCTIONS.index("u"), 0] == pytest.approx(-PROFILE.hull.D["X_u"])
    shooting = Shooting(task(0.0))
    size = [truth()[k, axis] if k < len(BASIS.terms) else 0.0 for k, axis in shooting.places]
    true = np.array(size) / shooting.size
    wrong, right = (np.sqrt(np.mean(shooting.residual(x) ** 2)) for x in (np.zeros_like(true), true))
    assert right < 0.03 * wrong


@pytest.mark.slow
def test_initial_states_are_found_where_the_first_measurement_of_a_segment_is_wrong() -> None:
    shooting = Shooting(task(0.0))
    states = shooting.segments.states.copy()
    states[:, 0] += np.array([0.2, -0.1, 0.05, 0.1, 0.1, 0.02])
    shooting.segments = replace(shooting.segments, states=states)
    exact = np.array([truth()[k, axis] if k < len(BASIS.terms) else 0.0 for k, axis in shooting.places]) / shooting.size
    free = shooting.residual(exact)
    held = (shooting.run(exact, states[:, 0]) - states) * shooting.weight
    assert np.sum(free**2) < 0.15 * np.sum(held**2)


@pytest.mark.slow
@pytest.mark.parametrize(("method", "noise"), [("output error", 0.0), ("weak SINDy", 2.0), ("stepwise", 2.0)])
def test_a_rival_recovers_inertia_and_force(method: str, noise: float) -> None:
    found, true = METHODS[method](task(noise), 0), truth()
    for k, axis in enumerate(("u_dot", "v_dot", "r_dot")):
        row = BASIS.terms.index(axis)
        assert found.theta[row, k] + PROFILE.hull.M[k, k] == pytest.approx(
            true[row, k] + PROFILE.hull.M[k, k], rel=0.02
        )
    made = motion(3)
    values = BASIS.of(made)
    error, size = values @ (found.theta - true) + found.intercept, values @ true
    assert np.all(np.sqrt(np.mean(error**2, axis=0)) < 0.06 * np.sqrt(np.mean(size**2, axis=0)))


@pytest.mark.slow
@pytest.mark.parametrize("method", ["weak SINDy", "stepwise"])
def test_sparse_rivals_take_the_true_terms_and_few_others(method: str) -> None:
    found = METHODS[method](task(2.0), 0).theta
    chosen = {(BASIS.terms[k], int(axis)) for k, axis in np.argwhere(found)}
    assert chosen >= set(SIZES)
    assert len(chosen) <= len(SIZES) + 4
