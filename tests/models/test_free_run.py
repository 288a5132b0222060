"""Free runs against an independent integrator, and where they must refuse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ferryid.models.forces.estimator import Estimator
from ferryid.models.prediction import free_run
from ferryid.models.prediction.free_run import run_free
from ferryid.signals.track import Motion
from ferryid.vessel import load_profile
from tests.vessel.hull_matrices import coriolis, damping

pytestmark = pytest.mark.slow

RATE = 10.0


def _trial(seconds: float = 120.0, scale: float = 1.0) -> Motion:
    """A trial of milliAmpère without environment, integrated by SciPy from the equations of motion."""
    hull = load_profile("milliampere").hull
    inverse = np.linalg.inv(hull.M * scale)

    def force(t: float) -> np.ndarray:
        return np.array([200 * np.sin(0.11 * t), 150 * np.cos(0.07 * t), 250 * np.sin(0.05 * t + 1)])

    def derivative(t: float, state: np.ndarray) -> np.ndarray:
        psi, nu = state[2], state[3:]
        c = coriolis(hull.M * scale, nu[None])[0]
        d = damping(hull.D, nu[None])[0]
        c, d = (m @ nu if m.ndim == 2 else m for m in (c, d))
        nu_dot = inverse @ (force(t) - c - d)
        eta_dot = [nu[0] * np.cos(psi) - nu[1] * np.sin(psi), nu[0] * np.sin(psi) + nu[1] * np.cos(psi), nu[2]]
        return np.concatenate([eta_dot, nu_dot])

    t = np.arange(0.0, seconds, 1.0 / RATE)
    path = solve_ivp(derivative, (0, seconds), np.zeros(6), t_eval=t, rtol=1e-10, atol=1e-12).y.T
    tau = np.array([force(at) for at in t])
    return Motion(
        log="made", t=t, rate_hz=RATE, eta=path[:, :3], nu=path[:, 3:], nu_dot=np.zeros((len(t), 3)), tau=tau,
        valid=np.ones(len(t), dtype=bool), raw_nu=path[:, 3:],
    )  # fmt: skip


def test_true_model_follows_an_independent_integration() -> None:
    motion = _trial()
    run = run_free(Estimator(load_profile("milliampere"), {}), [motion], [motion.valid])
    assert run.starts > 10
    # What is left is the force taken as straight lines between rows: centimetres after a minute.
    assert np.all(run.position_m < 0.01)
    assert np.all(run.heading_rad < 1e-3)
    assert np.all(run.speed_mps < 1e-3)


def test_wrong_model_drifts_and_the_error_grows_with_the_horizon() -> None:
    motion = _trial()
    run = run_free(Estimator(load_profile("milliampere"), {"delta": 1.3, "sigma": 1.3}), [motion], [motion.valid])
    assert run.position_m[-1] > 0.5
    assert run.position_m[-1] > run.position_m[0]


def test_runs_stay_within_unbroken_stretches() -> None:
    motion = _trial()
    allowed = motion.valid.copy()
    allowed[::150] = False
    run = run_free(Estimator(load_profile("milliampere"), {}), [motion], [allowed])
    assert np.isfinite(run.position_m[:2]).all()
    assert np.isnan(run.position_m[2:]).all(), "no stretch of 14.9 s holds a horizon of 20 s"


def test_a_model_without_positive_mass_cannot_run() -> None:
    motion = _trial(20.0)
    profile = load_profile("milliampere")
    broken = replace(profile, hull=replace(profile.hull, M=np.diag([-1.0, 1.0, 1.0])))
    run = run_free(Estimator(broken, {}), [motion], [motion.valid])
    assert run.starts == 0
    assert "positive definite" in run.note


def test_a_diverging_run_is_counted_not_averaged() -> None:
    motion = _trial()
    profile = load_profile("milliampere")
    # Damping of the wrong sign feeds the motion until it runs away.
    unstable = replace(profile, hull=replace(profile.hull, D={"X_u": 3000.0, "N_r": 3000.0}))
    run = run_free(Estimator(unstable, {}), [motion], [motion.valid])
    assert "diverged" in run.note
    assert not np.isinf(run.position_m).any()


@pytest.mark.parametrize("most", [1000, 40], ids=["all at once", "some at a time"])
def test_runs_of_several_logs_are_those_of_each_log_alone(monkeypatch: pytest.MonkeyPatch, most: int) -> None:
    monkeypatch.setattr(free_run, "MOST_RUNS", most)
    long, short = _trial(), _trial(70.0)
    n = len(short.t)
    aboard = replace(short, payload=np.where(short.t < 30.0, 90.0, 400.0)[:, None] * [[1.0, 0.0]] + [[0.0, 0.5]])
    windy = replace(short, wind=np.column_stack([4.0 * np.sin(short.t / 9.0), np.full(n, 2.0)]))
    heavier = replace(aboard, payload=aboard.payload[::-1].copy() if aboard.payload is not None else None)
    every, law = [long, aboard, short, windy, heavier], Estimator(load_profile("milliampere"), {"delta": 1.2})
    together = run_free(law, every, [one.valid for one in every]).single
    assert together is not None
    assert together.log.max() == 4
    for k, motion in enumerate(every):
        alone = run_free(law, [motion], [motion.valid]).single
        assert alone is not None
        assert np.nanmax(alone.errors) > 0.1
        np.testing.assert_allclose(together.errors[together.log == k], alone.errors, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("rate_hz", [2.0, 10.0])
def test_slow_grids_take_substeps(rate_hz: float) -> None:
    motion = _trial()
    step = round(RATE / rate_hz)
    thin = replace(
        motion,
        t=motion.t[::step],
        rate_hz=rate_hz,
        eta=motion.eta[::step],
        nu=motion.nu[::step],
        nu_dot=motion.nu_dot[::step],
        tau=motion.tau[::step],
        valid=motion.valid[::step],
        raw_nu=motion.raw_nu[::step],
    )
    run = run_free(Estimator(load_profile("milliampere"), {}), [thin], [thin.valid])
    assert np.all(run.position_m < 0.05)
