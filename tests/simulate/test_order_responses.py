"""A simulated vessel follows its orders as its profile states, in the place of the scenario's lags and limits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.simulate.order_boat import sailed


@pytest.mark.parametrize(("time_constant_s", "delay_s"), [(0.5, 0.0), (0.0, 0.3), (0.5, 0.3)])
def test_propellers_follow_their_orders_as_the_profile_states(
    tmp_path: Path, time_constant_s: float, delay_s: float
) -> None:
    made = sailed(tmp_path, f"time_constant_s = {time_constant_s}", f"delay_s = {delay_s}", lag_s=2.0)
    truth, control = made.truth, made.control
    steps = np.flatnonzero(np.diff(control.speeds[:, 0]) != 0.0) + 1
    first, second = steps[1], steps[2]
    begin, before, order = control.t_order[first] + delay_s, control.speeds[first - 1, 0], control.speeds[first, 0]
    rows = (truth.t > begin - 0.2) & (truth.t < control.t_order[second] + delay_s)
    t, speed = truth.t[rows], truth.speeds[rows, 0]
    left = np.exp(-np.maximum(t - begin, 0.0) / time_constant_s) if time_constant_s else 1.0 * (t <= begin + 1e-9)
    # All of the step before has been followed for eight seconds.
    np.testing.assert_allclose(speed, order + (before - order) * left, atol=0.06 * abs(order - before) + 1e-3)


def test_a_profile_that_states_nothing_leaves_the_scenario_its_lags(tmp_path: Path) -> None:
    plain = sailed(tmp_path, lag_s=0.5).truth
    stated = sailed(tmp_path, "time_constant_s = 0.5", lag_s=0.1).truth
    np.testing.assert_allclose(stated.speeds, plain.speeds, atol=1e-6)
    np.testing.assert_allclose(stated.nu, plain.nu, atol=1e-9)
