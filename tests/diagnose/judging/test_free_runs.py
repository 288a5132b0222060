"""Free runs follow the equations of motion by Heun's rule, and those that cannot be judged count as none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.diagnose.judging.free_runs import DIVERGED, _judged, run_freely
from ferryid.effects.force_model import ForceModel, Measurements, acceleration, hull_of
from ferryid.types import Floats, Ints
from ferryid.vessel import load_profile

HORIZONS = np.array([1.0, 2.0])


def test_runs_that_all_diverge_are_none() -> None:
    runs = _judged(HORIZONS, np.full((2, 6, 2, 4), np.nan), np.arange(6))
    assert runs.starts == 0
    assert np.isnan(runs.low).all()


def test_runs_that_reach_their_horizon_are_judged() -> None:
    errors = np.ones((2, 6, 2, 4))
    errors[1] = 0.5
    runs = _judged(HORIZONS, errors, np.arange(6))
    assert runs.starts == 6
    assert np.allclose(runs.removed, 0.5)
    assert np.allclose((runs.low, runs.high), 0.5)


FERRY = load_profile("milliampere")
ROWS = 60


def force_model(*, flow: bool, load: bool) -> ForceModel:
    rng = np.random.default_rng(8)
    nu = rng.normal(size=(ROWS, 3)) * [1.0, 0.3, 0.1]
    measurements = Measurements(
        profile=FERRY,
        t=0.1 * np.arange(ROWS),
        eta=rng.normal(size=(ROWS, 3)),
        nu_raw=nu,
        nu=nu,
        parts=rng.normal(size=(ROWS, 2, 3)) * 100.0,
        angles=np.zeros((ROWS, 2)),
        usable=np.ones(ROWS, dtype=bool),
    )
    return ForceModel(
        measurements,
        hull_of(FERRY),
        measurements.parts,
        measurements.angles,
        rng.normal(size=(ROWS, 3)) * 50.0,
        flow=rng.normal(size=(ROWS, 2)) if flow else None,
        load=np.abs(rng.normal(size=(ROWS, 5))) * 20.0 if load else None,
        damping_factor=1.0 + rng.random(ROWS) if load else None,
    )


def rates(force_model: ForceModel, rows: Ints, state: Floats) -> Floats:
    """Return derivatives of states by the force model of these rows alone."""
    measured = force_model.measurements
    nu, psi = state[:, 3:], state[:, 2]
    at = replace(
        force_model,
        measurements=replace(measured, t=measured.t[rows], eta=state[:, :3], nu=nu, nu_raw=nu),
        parts=force_model.parts[rows],
        external=force_model.external[rows],
        flow=None if force_model.flow is None else force_model.flow[rows],
        load=None if force_model.load is None else force_model.load[rows],
        damping_factor=None if force_model.damping_factor is None else force_model.damping_factor[rows],
    )
    c, s = np.cos(psi), np.sin(psi)
    return np.column_stack([c * nu[:, 0] - s * nu[:, 1], s * nu[:, 0] + c * nu[:, 1], nu[:, 2], acceleration(at)])


@pytest.mark.parametrize("flow", [False, True])
@pytest.mark.parametrize("load", [False, True])
def test_a_free_run_is_the_rule_of_heun_with_the_forces_of_its_rows(flow: bool, load: bool) -> None:
    one, starts, stride, steps = force_model(flow=flow, load=load), np.array([0, 7, 50]), 3, 10
    path = run_freely(one, starts, stride, steps)
    state = np.hstack([one.measurements.eta[starts], one.measurements.nu[starts]])
    np.testing.assert_array_equal(path[0], state)
    for k in range(steps):
        # The last of them runs out of rows: the forces of the last row go on.
        rows, following = (np.minimum(starts + j * stride, ROWS - 1) for j in (k, k + 1))
        first = rates(one, rows, state)
        state = state + 0.15 * (first + rates(one, following, state + 0.3 * first))
        np.testing.assert_allclose(path[k + 1], state, rtol=1e-9, atol=1e-9)


def test_a_run_that_diverges_is_stopped() -> None:
    one = force_model(flow=False, load=False)
    path = run_freely(replace(one, hull=one.hull * np.repeat([1.0, -1.0], [5, 21])), np.array([0]), 1, 400)
    assert np.isnan(path[-1]).any()
    assert np.nanmax(np.abs(path)) < DIVERGED


def test_a_force_model_of_other_lengths_is_refused() -> None:
    one = force_model(flow=True, load=False)
    with pytest.raises(ValueError, match="60 rows has parts of other lengths"):
        run_freely(replace(one, external=one.external[:10]), np.array([0]), 1, 5)
