"""What has no name: laws that were put in come back with their size, noise gives none, impostors are told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ferryid.diagnose.inference import spectra
from ferryid.diagnose.inference.candidate_terms import terms_of
from ferryid.diagnose.inference.estimation import (
    Candidate,
    EstimationProblem,
    estimation_problem,
    fit,
    fitted_force_model,
)
from ferryid.diagnose.inference.folds import folds_of
from ferryid.diagnose.inference.prior import prior_force_model
from ferryid.diagnose.inference.spectra import bursts_of
from ferryid.diagnose.inference.weak_form import windows
from ferryid.diagnose.judging.claims import Figures, LogFigures
from ferryid.diagnose.judging.confidence_rules import Context, unexplained_shares
from ferryid.diagnose.judging.sparse_regression import select_law
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.diagnose.judging.unexplained import find_displaced, find_unexplained
from ferryid.effects import effects
from ferryid.effects.force_model import ForceModel, Measurements, acceleration, hull_of
from ferryid.types import Floats
from ferryid.vessel import load_profile

pytestmark = pytest.mark.slow

FERRY = load_profile("milliampere")
SECONDS, STEP_S = 720.0, 0.1
T = np.arange(0.0, SECONDS, STEP_S)
ROWS = ("t", "eta", "nu_raw", "nu", "parts", "angles", "usable")


@cache
def sailed(seed: int) -> Measurements:
    """Return a vessel that turns, goes ahead and astern and drifts, with the thrust that its hull needs for it, and noise."""
    rng = np.random.default_rng(seed)
    u = 0.5 * np.sin(T / 17.0) + 0.4 * np.sin(T / 41.0 + 1.0)
    v = 0.25 * np.sin(T / 23.0) + 0.15 * np.sin(T / 9.0)
    r = 0.06 * np.sin(T / 13.0) + 0.05 * np.sin(T / 29.0 + 2.0)
    psi = np.cumsum(r) * STEP_S
    nu = np.column_stack([u, v, r])
    c, s = np.cos(psi), np.sin(psi)
    eta = np.column_stack([np.cumsum(c * u - s * v) * STEP_S, np.cumsum(s * u + c * v) * STEP_S, psi])
    still = np.zeros((len(T), 2, 3))
    measurements = Measurements(FERRY, T, eta, nu, nu, still, np.zeros((len(T), 2)), np.ones(len(T), dtype=bool))
    bare = ForceModel(measurements, hull_of(FERRY), measurements.parts, measurements.angles, np.zeros((len(T), 3)))
    needed = (np.gradient(nu, STEP_S, axis=0) - acceleration(bare)) @ FERRY.hull.M.T
    # Two thrusters at bow and stern that share surge and sway, and turn the vessel between them.
    (x1, y1), (x2, y2) = (actuator.position_m for actuator in FERRY.actuators)
    first = np.column_stack([0.5 * needed[:, 0], (needed[:, 2] - x2 * needed[:, 1]) / (x1 - x2)])
    second = needed[:, :2] - first
    parts = np.stack(
        [np.column_stack([F, x * F[:, 1] - y * F[:, 0]]) for F, x, y in ((first, x1, y1), (second, x2, y2))], axis=1
    )
    angles = np.arctan2(parts[:, :, 1], parts[:, :, 0])
    noisy = nu + rng.standard_normal(nu.shape) * [0.01, 0.01, 0.002]
    measured = eta + rng.standard_normal(eta.shape) * [0.02, 0.02, 0.002]
    return replace(measurements, parts=parts, angles=angles, eta=measured, nu_raw=noisy)


def trial_with(force: Floats, seed: int = 0) -> EstimationProblem:
    """Return a trial whose force model lacks a force [N, N, N·m] that acted, shape (n, 3)."""
    cut = windows(sailed(seed), 8.0, 2.0)
    plain, spread = prior_force_model(cut.measurements, FERRY)
    every = round(len(T) / len(cut.measurements.t))
    thin = force[: len(cut.measurements.t) * every].reshape(-1, every, 3).mean(axis=1)
    return estimation_problem(cut, replace(plain, external=plain.external - thin), spread)


def pushes(surge: Floats | float = 0.0, sway: Floats | float = 0.0, yaw: Floats | float = 0.0) -> Floats:
    return np.column_stack([np.broadcast_to(one, len(T)) for one in (surge, sway, yaw)])


def nu() -> Floats:
    return sailed(0).nu


@pytest.mark.parametrize(
    ("force", "on", "name", "size"),
    [
        (lambda: pushes(surge=-25.0), "surge", "1", -25.0),
        (lambda: pushes(sway=-40.0 * np.abs(nu()[:, 0]) * nu()[:, 0]), "sway", "u|u|", -40.0),
        (lambda: pushes(yaw=400.0 * nu()[:, 0] * nu()[:, 1]), "yaw", "uv", 400.0),
    ],
    ids=["constant", "quadratic", "product"],
)
def test_a_law_comes_back(force: Callable[[], Floats], on: str, name: str, size: float) -> None:
    problem = trial_with(force())
    law = select_law(problem, fit(problem, ()), folds_of(problem.windows))
    assert law is not None
    assert [(term.on, term.name) for term in law.terms] == [(on, name)]
    error = law.fit.errors(0)[0]
    assert law.fit.values[-1][0] == pytest.approx(size, abs=max(3.0 * error, 0.05 * abs(size)))
    assert law.gain > max(JUDGING.law_gain, law.chance)
    assert law.held_out.score_low > 0.0
    made = find_unexplained(problem, fit(problem, ()), sailed(0))
    told = made.claims[0].finding
    # What it holds of the error is what it removes, where it does.
    left = unexplained_shares(Context(Figures("force"), LogFigures(), made.claims))
    assert left == {axis: max(share, 0.0) for axis, share in told.improvement.items()}
    assert told.effect == "unknown"
    assert told.parameters == {}
    assert (told.law[0].on, told.law[0].quantity) == (on, name)
    assert on in told.says
    assert max(told.axes, key=lambda axis: told.axes[axis]) == on
    assert told.improvement[on] > 0.05


@pytest.mark.parametrize("seed", range(3))
def test_noise_and_a_hull_that_is_off_have_no_law(seed: int) -> None:
    cut = windows(sailed(seed), 8.0, 2.0)
    plain, spread = prior_force_model(cut.measurements, FERRY)
    off = np.random.default_rng(seed).choice([0.92, 1.08], len(plain.hull))
    problem = estimation_problem(cut, replace(plain, hull=plain.hull * off), spread)
    made = find_unexplained(problem, fit(problem, ()), sailed(seed))
    assert made.claims == ()
    assert not made.unsteady


def test_bursts_are_told_by_band_and_time() -> None:
    burst = np.exp(-(((T - 200.0) / 15.0) ** 2)) + np.exp(-(((T - 500.0) / 15.0) ** 2))
    problem = trial_with(pushes(sway=120.0 * burst * np.sin(2.0 * np.pi * 0.28 * T)))
    # The windows are blind to it: it turns too fast for them.
    alone = fit(problem, ())
    made = find_unexplained(problem, alone, sailed(0))
    assert made.unsteady
    (claim,) = made.claims
    told = claim.finding
    # The same of a log whose velocities are slopes of its positions: those may be in error.
    one = find_unexplained(problem, alone, replace(sailed(0), slopes=frozenset("uv")))
    assert (one.claims, one.unsteady) == ((), False)
    assert "as the velocity is the slope of the position or heading" in one.notes[0]
    assert find_unexplained(problem, alone, replace(sailed(0), slopes=frozenset("r"))).claims
    assert told.law == ()
    assert told.band_hz == (0.2, 0.4)
    assert max(told.axes, key=lambda axis: told.axes[axis]) == "sway"
    for centre in (200.0, 500.0):
        assert any(first <= centre <= last for first, last in told.intervals)
    assert not any(first <= 350.0 <= last for first, last in told.intervals)


@pytest.mark.parametrize(
    ("of", "why"),
    [("velocities", "noise of the velocities"), ("positions", "noise of the positions"), ("", "no positions")],
)
def test_what_one_sensor_alone_shows_is_no_force(of: str, why: str) -> None:
    burst = np.exp(-(((T - 200.0) / 15.0) ** 2)) + np.exp(-(((T - 500.0) / 15.0) ** 2))
    shaken = 0.05 * burst * np.sin(2.0 * np.pi * 0.28 * T)
    whole = sailed(0)
    noisy = replace(whole, nu_raw=whole.nu_raw + np.outer(shaken, [0.0, 1.0, 0.0]))
    if of == "positions":
        # A receiver shakes, and its velocity is smoothed.
        rates = 4.0 * shaken[:, None] * np.column_stack([-np.sin(whole.psi), np.cos(whole.psi)])
        moved = np.cumsum(rates, axis=0) * STEP_S
        noisy = replace(noisy, eta=whole.eta + np.column_stack([moved, np.zeros(len(T))]))
    if not of:
        noisy = replace(noisy, eta=np.column_stack([np.full((len(T), 2), np.nan), whole.psi]))
    cut = windows(noisy, 8.0, 2.0)
    problem = estimation_problem(cut, *prior_force_model(cut.measurements, FERRY))
    made = find_unexplained(problem, fit(problem, ()), noisy)
    assert made.claims == ()
    assert not made.unsteady
    (note,) = made.notes
    assert why in note
    assert "0.2 to 0.4 Hz, most in sway" in note


def test_even_noise_has_no_bursts() -> None:
    strongest = []
    for seed in range(4):
        problem = trial_with(pushes(), seed)
        burst = bursts_of(problem, fitted_force_model(problem.plain, fit(problem, ())), sailed(seed))
        assert burst is not None
        strongest.append(burst.deviations)
    assert max(strongest) < JUDGING.burst_deviations


def test_bursts_too_fast_for_the_samples_are_not_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    searched: list[float] = []
    monkeypatch.setattr(spectra, "_uneven", lambda short, errors, positions, low, high, block_s: searched.append(high))
    problem = trial_with(pushes())
    model = fitted_force_model(problem.plain, fit(problem, ()))
    bursts_of(problem, model, sailed(0))
    assert searched == [0.1, 0.2, 0.4, 0.8]
    searched.clear()
    # At 2 Hz lines between the samples are no oscillation of 0.8 Hz.
    few = replace(sailed(0), **{name: getattr(sailed(0), name)[::5] for name in ROWS})
    cut = windows(few, 8.0, 2.0)
    problem = estimation_problem(cut, *prior_force_model(cut.measurements, FERRY))
    bursts_of(problem, fitted_force_model(problem.plain, fit(problem, ())), few)
    assert searched == [0.1, 0.2, 0.4]


def test_a_wind_is_told_right_whose_moment_the_profile_has_too_large() -> None:
    wind = effects()["wind"]
    breeze = Candidate(wind, None, wind.parameters_of(FERRY))
    calm = trial_with(pushes())
    blown = breeze.act(calm.plain, np.array([-5.0, 3.0, 1.0, 1.0, 0.5]))
    lacking = replace(calm.plain, external=calm.plain.external - (blown.external - calm.plain.external))
    problem = estimation_problem(calm.windows, lacking, calm.hull_spread)
    assert fit(problem, [breeze]).values[0] == pytest.approx([-5.0, 3.0, 1.0, 1.0, 0.5], abs=0.25)
    # By the moment alone, which is measured best, it would blow less.
    stiff = fit(problem, [replace(breeze, parameters=breeze.parameters[:2])])
    assert np.hypot(*stiff.values[0]) < 0.9 * np.hypot(5.0, 3.0)


def test_an_effect_that_a_law_makes_idle_is_an_impostor_and_a_true_one_is_not() -> None:
    gain = effects()["thruster_gain"]
    candidate = Candidate(gain, "thruster1", gain.parameters_of(FERRY))
    problem = trial_with(pushes(surge=-20.0, sway=10.0))
    kept = fit(problem, [candidate])
    assert find_displaced(problem, kept) == (0,)
    # Where the law explains more by no more than the effect's formula may be off, it displaces nothing.
    vague = replace(candidate, effect=replace(gain, formula_error=1.0))
    assert find_displaced(problem, replace(kept, candidates=(vague,))) == ()
    wind = effects()["wind"]
    breeze = Candidate(wind, None, wind.parameters_of(FERRY))
    calm = trial_with(pushes())
    blown = breeze.act(calm.plain, np.array([-3.0, 2.0]))
    lacking = replace(calm.plain, external=calm.plain.external - (blown.external - calm.plain.external))
    problem = estimation_problem(calm.windows, lacking, calm.hull_spread)
    kept = fit(problem, [breeze])
    assert kept.values[0][:2] == pytest.approx([-3.0, 2.0], abs=0.3)
    problem = problem.with_noise_of(kept)
    assert find_displaced(problem, fit(problem, [breeze], kept.values)) == ()


def test_a_weak_thruster_beside_a_hull_that_lacks_terms_is_no_strong_one() -> None:
    """Three per cent less from the first is, but for masses and damping, three more from the second: that is no law."""
    u, v, r = nu().T
    lost = -0.03 * sailed(0).parts[:, 0]
    problem = trial_with(lost + pushes(yaw=400.0 * u * r - 1500.0 * np.abs(v) * r))
    gain = effects()["thruster_gain"]
    candidate = Candidate(gain, "thruster1", gain.parameters_of(FERRY))
    problem = problem.with_noise_of(fit(problem, [candidate]))
    kept = fit(problem, [candidate])
    assert kept.values[0] == pytest.approx([0.97], abs=0.005)
    assert find_displaced(problem, kept) == ()


def test_terms_are_forces_of_the_force_model() -> None:
    problem = trial_with(pushes())
    force_model = problem.plain
    measurements = force_model.measurements
    by_name = {(term.on, term.name): term for term in terms_of(measurements)}
    assert len(by_name) == len(terms_of(measurements))
    u, _, r = measurements.nu.T
    np.testing.assert_allclose(by_name["sway", "ur"].force(force_model), np.column_stack([0 * u, u * r, 0 * u]))
    assert by_name["sway", "ur"].coefficient_unit == "N/(m·rad/s²)"
    north = by_name["north", "1"].force(force_model)
    np.testing.assert_allclose(north[:, 0], np.cos(measurements.psi))
    np.testing.assert_allclose(north[:, 1], -np.sin(measurements.psi))
    # A share of a thruster's force has its lever.
    own = by_name["force of thruster1", "1"]
    np.testing.assert_allclose(own.force(force_model), force_model.parts[:, 0])
    assert own.coefficient_unit == "-"
    across = by_name["force across thruster1", "1"].force(force_model)
    np.testing.assert_allclose(np.sum(across[:, :2] * force_model.parts[:, 0, :2], axis=1), 0.0, atol=1e-9)
