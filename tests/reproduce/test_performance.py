"""Metrics (4.9)-(4.13) against hand-worked values."""

from __future__ import annotations

import numpy as np
import pytest

from ferryid.compare.tracking import signal_power, tracking_error
from ferryid.reproduce.performance import performance
from ferryid.simulate.states import Control, Truth


def _truth(t: np.ndarray, eta: np.ndarray, nu: np.ndarray, tau: np.ndarray) -> Truth:
    n = len(t)
    two, three, k = np.zeros((n, 2)), np.zeros((n, 3)), np.zeros((n, 2))
    return Truth(
        t=t, eta=eta, nu=nu, nu_dot=three, tau=tau, wave=three, attitude=two, wind=two, current=two, payload=two,
        speeds=k, angles=k,
    )  # fmt: skip


def _control(t: np.ndarray, eta_d: np.ndarray, tau_d: np.ndarray, feedforward: np.ndarray) -> Control:
    m = len(t)
    return Control(
        t=t, t_order=t, measured=np.zeros((m, 6)), sent=np.ones(m, dtype=bool), goal=eta_d, eta_d=eta_d,
        nu_d=np.zeros((m, 3)), tau_d=tau_d, feedforward=feedforward, speeds=np.zeros((m, 2)), angles=np.zeros((m, 2)),
        saturated=np.zeros(m, dtype=bool), undefined_aims=0,
    )  # fmt: skip


def test_an_error_that_grows_steadily_has_the_integrals_of_calculus() -> None:
    t = np.linspace(0.0, 10.0, 1001)
    zero = np.zeros((1001, 3))
    north = np.column_stack([0.2 * t, np.zeros((1001, 2))])
    # 3 m/s against 100 N of surge: 300 W, whatever the sign.
    nu, tau = np.tile([3.0, 0.0, 0.0], (1001, 1)), np.tile([-100.0, 50.0, 0.0], (1001, 1))
    done = performance(_truth(t, north, nu, tau), _control(t, zero, zero, zero), 5.0)
    assert pytest.approx(0.5 * 0.2 * 10.0**2, rel=1e-9) == done.IAE
    assert pytest.approx(0.2**2 * 10.0**3 / 3.0, rel=1e-5) == done.ISE
    assert pytest.approx(3000.0, rel=1e-9) == done.EC
    assert pytest.approx(done.IAE * 3000.0) == done.IAEW
    last = {name: curve[-1] for name, curve in done.cumulative().items()}
    assert last == pytest.approx({"ISE": done.ISE, "IAE": done.IAE, "IAEW": done.IAEW, "EC": done.EC})


def test_a_heading_error_counts_by_how_far_it_moves_the_ends_and_wraps() -> None:
    off = np.array([[3.0, 4.0, 0.0], [0.0, 0.0, 0.1], [0.0, 0.0, 2.0 * np.pi + 0.1], [0.0, 0.0, 2.0 * np.pi - 0.1]])
    error = tracking_error(off, np.zeros((4, 3)), 5.0)
    assert error == pytest.approx([5.0, 0.25, 0.25, 0.25])


def test_feedback_is_what_the_feedforward_leaves_of_the_desired_force() -> None:
    t = np.linspace(0.0, 2.0 * np.pi, 2001)
    wanted = np.column_stack([10.0 * np.sin(t), 5.0 + 0.0 * t, 0.0 * t])
    given = np.column_stack([0.0 * t, 2.0 + 0.0 * t, 0.0 * t])
    three = np.zeros((2001, 3))
    done = performance(_truth(t, three, three, three), _control(t, three, wanted, given), 5.0)
    # The power of a sine is half the square of its amplitude, (4.13) without the stray 2.
    assert done.feedback_power == pytest.approx([50.0, 9.0, 0.0], rel=1e-3)
    assert signal_power(given) == pytest.approx([0.0, 4.0, 0.0])
