"""Free runs follow the equations of motion by Heun's rule, with the forces of the rows that they pass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.effects.force_model import ForceModel, acceleration
from ferryid.effects.free_motion import run_freely
from ferryid.types import Floats, Ints
from tests.effects.test_force_model import N, force_model

LARGEST = 1e6


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
    one, starts, stride, steps = force_model(flow=flow, load=load, damped=load), np.array([0, 7, 30]), 3, 10
    path = run_freely(one, starts, stride, steps, LARGEST)
    state = np.hstack([one.measurements.eta[starts], one.measurements.nu[starts]])
    np.testing.assert_array_equal(path[0], state)
    step = stride * one.measurements.step_s
    for k in range(steps):
        # The last of them runs out of rows: the forces of the last row go on.
        rows, following = (np.minimum(starts + j * stride, N - 1) for j in (k, k + 1))
        first = rates(one, rows, state)
        state = state + 0.5 * step * (first + rates(one, following, state + step * first))
        np.testing.assert_allclose(path[k + 1], state, rtol=1e-9, atol=1e-9)


def test_a_run_that_diverges_stays_at_the_largest_size() -> None:
    one = force_model(flow=False, load=False, damped=False)
    path = run_freely(replace(one, hull=one.hull * np.repeat([1.0, -1.0], [5, 21])), np.array([0]), 1, 400, LARGEST)
    assert np.nanmax(np.abs(path)) == LARGEST


def test_a_force_model_of_other_lengths_is_refused() -> None:
    one = force_model(flow=True, load=False, damped=False)
    with pytest.raises(ValueError, match="40 rows has parts of other lengths"):
        run_freely(replace(one, external=one.external[:10]), np.array([0]), 1, 5, LARGEST)
