"""Winds that nobody measured, estimated with the hull: by hand, on made motions of a known hull, and where there is none."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from ferryid.identify import log_conditions
from ferryid.identify.estimation import estimate_correction
from ferryid.identify.gusts import Gusts
from ferryid.identify.log_conditions import Conditions
from ferryid.identify.outcome import LogWind
from ferryid.identify.some_logs import some_logs
from ferryid.identify.split import Split
from ferryid.identify.thresholds import IDENTIFY
from ferryid.identify.weak_data import WeakData
from ferryid.identify.window_loads import Load, LoadSamples
from ferryid.models.forces import Estimator, effective_mass
from ferryid.signals.track import Motion
from ferryid.types import no_progress
from ferryid.vessel.wind import wind_force
from tests.identify.rounds import PROFILE, RATE_HZ
from tests.identify.test_weak_form import data_of, placed
from tests.identify.trials import measured

Floats = NDArray[np.float64]
TRUE = np.array([-3.0, 2.0])


def blown(made: Motion, wind: Floats = TRUE) -> Floats:
    """Return what the actuators must give beside the hull's force where a wind blows that nobody measures."""
    assert PROFILE.wind is not None
    return -wind_force(PROFILE.wind, np.broadcast_to(wind, (len(made.t), 2)), made.eta[:, 2], made.nu)


def gusty(made: Motion) -> Floats:
    rng, kept = np.random.default_rng(5), float(np.exp(-1.0 / (15.0 * RATE_HZ)))
    gusts = np.zeros((len(made.t), 2))
    for row in range(1, len(gusts)):
        gusts[row] = kept * gusts[row - 1] + 0.8 * np.sqrt(1.0 - kept**2) * rng.standard_normal(2)
    return blown(made, TRUE + gusts)


def damping_error(data: WeakData) -> float:
    """Return how far the steady force of the estimate is off at the velocities visited, intercept included, over its size."""
    estimator = data.estimator(estimate_correction(data, len(data.functions.terms), 0, no_progress).coefficients)
    nu = np.concatenate([one.nu[one.valid] for one in data.motions])[::20]
    found = estimator.at_constant_velocity(nu)
    true = Estimator(PROFILE, {}).at_constant_velocity(nu)
    return float(np.linalg.norm(found - true) / np.linalg.norm(true))


def without_wind(data: WeakData) -> WeakData:
    unaware = replace(data)
    unaware.__dict__["conditions"] = Conditions.none(data.windows.training, len(data.functions.terms))
    return unaware


def test_the_wind_of_each_log_is_found_and_kept_out_of_the_hull() -> None:
    logs = [
        measured(seed, seconds=300.0, jitter=0.01, noise=4.0, force=blown if seed == 0 else None) for seed in range(2)
    ]
    data = data_of(logs, delta=0.8, sigma=0.8)
    np.testing.assert_allclose(data.conditions.wind[0], TRUE, atol=0.3)
    assert np.hypot(*data.conditions.wind[1]) < 1.0
    assert damping_error(data) < 0.5 * damping_error(without_wind(data))
    windy, calm = data.winds
    assert windy.significant
    assert re.search(r"towards 14\d°", str(windy))
    assert windy.log != calm.log


@pytest.mark.slow
def test_gusts_do_not_end_up_in_the_hull() -> None:
    data = data_of([measured(seed, seconds=480.0, jitter=0.01, noise=4.0, force=gusty) for seed in range(2)], sigma=0.8)
    assert 0.3 < data.conditions.gust_mps < 1.5
    assert damping_error(data) < 0.6 * damping_error(without_wind(data))
    mass = effective_mass(
        PROFILE,
        data.settings.scale,
        data.functions.terms,
        estimate_correction(data, len(data.functions.terms), 0, no_progress).coefficients.theta,
    )
    np.testing.assert_allclose(np.diag(mass), np.diag(PROFILE.hull.M), rtol=0.05)


def test_a_measured_wind_is_not_estimated_and_without_areas_there_is_none() -> None:
    one = measured(0, seconds=200.0, force=blown)
    known = replace(one, wind=np.broadcast_to(TRUE, (len(one.t), 2)))
    data = data_of([known, measured(1, seconds=200.0)])
    assert np.isnan(data.conditions.wind[0]).all()
    assert [wind.log for wind in data.winds] == [data.motions[1].log]
    bare = replace(data, profile=replace(PROFILE, wind=None))
    assert not bare.winds
    assert bare.training_windows == bare.windows.training


def test_conditions_widen_the_intervals_of_the_hull() -> None:
    data = data_of([measured(0, seconds=480.0, noise=4.0, force=gusty)], sigma=0.8)
    added = data.conditions.added
    for axis in range(3):
        own = [*np.flatnonzero(data.functions.mask[:, axis]), len(data.functions.terms)]
        values = np.linalg.eigvalsh(added[axis][np.ix_(own, own)])
        assert values.min() > -1e-9 * values.max()
    K = len(data.functions.terms)
    draws, mask = np.zeros((400, K, 3)), data.functions.mask
    sure = without_wind(data)
    sure.__dict__["whitening"], sure.__dict__["whitened"] = data.whitening, data.whitened
    sure.__dict__["prior_factor"] = data.prior_factor
    row = data.functions.terms.index("v")
    assert np.std(data.scattered(draws, mask)[:, row, 1]) > 1.05 * np.std(sure.scattered(draws, mask)[:, row, 1])


def test_the_precision_of_gusts_is_the_inverse_of_their_covariance_by_hand() -> None:
    gusts = Gusts([np.array([0, 0, 0, 1, 1])], 5.0)
    kept = np.exp(-5.0 / 20.0)
    covariance = np.zeros((5, 5))
    for run in (range(3), range(3, 5)):
        for i in run:
            for j in run:
                covariance[i, j] = kept ** abs(i - j)
    diagonal, beside = gusts.precision(0)
    precision = np.diag(diagonal) + np.diag(beside, 1) + np.diag(beside, -1)
    np.testing.assert_allclose(precision, np.linalg.inv(covariance), atol=1e-12)


def test_elimination_of_gusts_is_that_of_dense_equations() -> None:
    rng = np.random.default_rng(1)
    J, gusts = 6, Gusts([np.array([0, 0, 0, 0, 1, 1])], 5.0)
    slope, table, weight = rng.standard_normal((J, 3, 2)), rng.standard_normal((3, J, 4)), np.array([1.0, 2.0, 0.5])
    short = gusts.equations(0, slope, weight)
    # So short a log has no gusts.
    columns = [(np.arange(4), one) for one in table]
    assert not short.eliminated(columns, 4, weight)[1].any()
    _, found = replace(short, blow=True).eliminated(columns, 4, weight)
    diagonal, beside = gusts.precision(0)
    single = (np.diag(diagonal) + np.diag(beside, 1) + np.diag(beside, -1)) / gusts.spread**2
    precision, right = np.kron(single, np.eye(2)), np.zeros((2 * J, 4))
    for j in range(J):
        for axis in range(3):
            precision[2 * j : 2 * j + 2, 2 * j : 2 * j + 2] += weight[axis] * np.outer(slope[j, axis], slope[j, axis])
            right[2 * j : 2 * j + 2] += weight[axis] * np.outer(slope[j, axis], table[axis, j])
    np.testing.assert_allclose(found, np.linalg.solve(precision, right), rtol=1e-9)


def test_velocities_with_lasting_noise_are_steadied_and_good_ones_are_kept() -> None:
    log = measured(0, seconds=400.0)
    truth = placed(0, seconds=400.0)
    log = replace(log, eta=truth.eta)
    rng, kept = np.random.default_rng(2), float(np.exp(-1.0 / (5.0 * RATE_HZ)))
    noise = np.zeros_like(log.nu)
    for row in range(1, len(noise)):
        noise[row] = kept * noise[row - 1] + 0.05 * np.sqrt(1.0 - kept**2) * rng.standard_normal(3) * [1.0, 1.0, 0.0]
    noisy = data_of([replace(log, nu=log.nu + noise)])
    own = noisy.motions[0].nu
    assert noisy.windows.velocities[0] is not own
    error, left = own - truth.nu, noisy.windows.velocities[0] - truth.nu
    inner = slice(50, -50)
    assert np.std(left[inner, 1]) < 0.7 * np.std(error[inner, 1])
    stuck = data_of([replace(log, eta=np.column_stack([np.zeros((len(log.t), 2)), log.eta[:, 2]]))])
    assert stuck.windows.velocities[0] is stuck.motions[0].nu


@pytest.mark.parametrize("offset", [0.0, 25.0])
def test_an_intercept_within_its_standard_error_is_none_and_a_clear_one_stays(offset: float) -> None:
    def push(made: Motion) -> Floats:
        return np.broadcast_to(np.array([0.0, 0.0, offset]), (len(made.t), 3))

    data = data_of([measured(seed, seconds=300.0, noise=3.0, force=push) for seed in range(4)])
    found = estimate_correction(data, len(data.functions.terms), 0, no_progress).coefficients.intercept
    assert found[2] == pytest.approx(offset, abs=3.0)
    K = len(data.functions.terms)
    # Coefficients for which the mean that is left lies within its standard error.
    near = 0.5 * data.whitening.sigma / np.sqrt(data.whitened.weight)
    gains = np.zeros((K, 3))
    offsets = (near - data.whitened.mean[K:]) * data.whitened.unit
    np.testing.assert_array_equal(data.intercepts(gains, offsets), 0.0)


def test_the_coriolis_force_may_change_as_far_as_the_mass_may() -> None:
    data = data_of([measured(0, seconds=200.0)])
    mass, spread, terms = np.diag(PROFILE.hull.M), data.prior_spread, data.functions.terms
    assert spread[terms.index("uv"), 2] > 0.2 * np.hypot(mass[0], mass[1])
    assert spread[terms.index("ur"), 1] > 0.2 * mass[0]


def test_a_wind_is_worded_by_speed_direction_and_scatter() -> None:
    assert (
        str(LogWind("a", (-3.0, 3.0), (0.1, 0.1)))
        == "a: 4.2 m/s towards 135° (estimated, not confirmed; a current may be taken for it)"
    )
    none = LogWind("b", (0.1, 0.0), (0.2, 0.2))
    assert not none.significant
    assert str(none) == "b: none that differs from zero"
    assert none.to_json()["wind"]["north"] == {"value": 0.1, "standard_error": 0.2, "unit": "m/s"}


def test_many_windows_are_solved_alike_by_compiled_loops() -> None:
    rng = np.random.default_rng(2)
    gusts = Gusts([np.repeat([0, 1, 2], [70, 1, 60])], 5.0)
    slope, weight = rng.standard_normal((131, 3, 2)), np.array([1.0, 2.0, 0.5])
    few = gusts.equations(0, slope, weight)
    assert few.blow
    assert not few.many
    many = replace(few, many=True)
    columns = [(np.array([axis, 3, 4]), rng.standard_normal((131, 3))) for axis in range(3)]
    for one, other in zip(few.eliminated(columns, 5, weight), many.eliminated(columns, 5, weight), strict=True):
        np.testing.assert_allclose(other, one, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("wind", [np.array([3.0, -1.0]), np.linspace([-2.0, 0.0], [0.5, 4.0], 40)])
def test_loads_of_many_windows_are_the_same(wind: Floats) -> None:
    assert PROFILE.wind is not None
    rng = np.random.default_rng(3)
    samples = LoadSamples(rng.uniform(-4.0, 4.0, (40, 16)), rng.standard_normal((40, 16, 3)), np.full(16, 1.0 / 16.0))
    few, many = (Load(PROFILE.wind, samples, 0.9, many=many) for many in (False, True))
    np.testing.assert_allclose(many.of(wind), few.of(wind), rtol=1e-10, atol=1e-10)
    for one, other in zip(many.with_slope(wind), few.with_slope(wind), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-10, atol=1e-10)
    if wind.ndim == 1:
        np.testing.assert_allclose(many.of(wind, 3), few.of(wind)[::3], rtol=1e-10, atol=1e-10)


def test_some_logs_stand_for_many_where_they_have_windows_enough() -> None:
    assert some_logs([100] * 36) == list(range(36))
    assert some_logs([100] * 200) == list(range(200))
    chosen = some_logs([0, 1000, 1000, 1000] * 50)
    assert len(chosen) == IDENTIFY.sample_logs
    assert all(place % 4 for place in chosen)
    assert (chosen[0], chosen[-1]) == (1, 199)


@pytest.mark.slow
def test_many_logs_begin_as_some_of_them_end(monkeypatch: pytest.MonkeyPatch) -> None:
    data = data_of([measured(seed, seconds=240.0, jitter=0.01, noise=4.0, force=blown) for seed in range(6)], sigma=0.8)
    every = replace(data).conditions
    steps: list[int] = []
    step = log_conditions._Problem._step

    def counted(self: log_conditions._Problem, *given: Any) -> Floats:
        steps.append(len(self.windows))
        return step(self, *given)

    monkeypatch.setattr(log_conditions._Problem, "_step", counted)
    monkeypatch.setattr("ferryid.identify.some_logs.IDENTIFY", replace(IDENTIFY, sample_logs=3, sample_windows=1))
    found = replace(data).conditions
    assert steps.count(6) < steps.count(3)
    np.testing.assert_allclose(found.wind, every.wind, atol=0.1)
    np.testing.assert_allclose(found.wind, np.broadcast_to(TRUE, (6, 2)), atol=0.4)


@pytest.mark.parametrize(("converged", "spread", "told"), [(False, 1.1, True), (True, 1.1, False), (False, 0.9, False)])
def test_winds_that_drift_with_steady_forces_are_not_given(
    monkeypatch: pytest.MonkeyPatch, converged: bool, spread: float, told: bool
) -> None:
    solve = log_conditions._Problem.solve

    def solved(self: log_conditions._Problem, loads: Any, start: Any = None) -> tuple[Floats, Floats]:
        found = solve(self, loads, start)
        self.converged, self.force_spread = converged, spread * IDENTIFY.most_steady_force
        return found

    monkeypatch.setattr(log_conditions._Problem, "solve", solved)
    data = data_of([measured(0, seconds=300.0, jitter=0.01, noise=4.0, force=blown)])
    assert (data.winds == ()) == told
    assert data.conditions.indistinct == told
    assert ["cannot be distinguished" in one for one in data.condition_notes] == [True] * told
    assert data.conditions.load[0].any() != told


@pytest.mark.parametrize("settled", [True, False])
def test_winds_of_many_logs_settle_where_those_of_some_do(monkeypatch: pytest.MonkeyPatch, settled: bool) -> None:
    monkeypatch.setattr("ferryid.identify.some_logs.IDENTIFY", replace(IDENTIFY, sample_logs=3, sample_windows=1))
    solve = log_conditions._Problem.solve

    def solved(self: log_conditions._Problem, loads: Any, start: Any = None) -> tuple[Floats, Floats]:
        found = solve(self, loads, start)
        if len(self.windows) == 3:
            self.converged, self.force_spread = self.converged and settled, 1.1 * IDENTIFY.most_steady_force
        return found

    monkeypatch.setattr(log_conditions._Problem, "solve", solved)
    data = data_of([measured(k, seconds=300.0, jitter=0.01, noise=4.0, force=blown) for k in range(6)])
    assert data.conditions.indistinct != settled


def test_a_fold_keeps_the_spreads_and_takes_few_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    data = data_of([measured(k, seconds=300.0, jitter=0.01, noise=4.0, force=blown) for k in range(3)])
    every, steps = data.conditions, list[bool]()
    step = log_conditions._Problem._step

    def counted(self: log_conditions._Problem, *given: Any) -> Floats:
        steps.append(self.settled)
        return step(self, *given)

    monkeypatch.setattr(log_conditions._Problem, "_step", counted)
    rows = data.split.training
    held = tuple(np.arange(len(one)) > 0.8 * len(one) for one in rows)
    split = Split("folds", tuple(one & ~out for one, out in zip(rows, held, strict=True)), held, data.split.purge_s)
    fold = data.fold(split).conditions
    few = len(steps)
    assert 0 < few < 8
    assert all(steps)
    assert (fold.spread_mps, fold.gust_mps) == (every.spread_mps, every.gust_mps)
    anew = replace(data, split=split).conditions
    assert len(steps) - few > few
    np.testing.assert_allclose(fold.wind, anew.wind, atol=0.1)


@pytest.mark.parametrize(("kept", "arrives"), [(0.5, True), (0.8, True), (0.99, False), (-0.3, False)])
def test_every_third_step_of_the_spreads_is_aitkens(kept: float, arrives: bool) -> None:
    data = data_of([measured(0, seconds=120.0)])
    problem = log_conditions._Problem(
        data.windows.training, data.functions.terms, data.functions.mask, data.prior_spread, data._posed, 1.0
    )
    # Steps that keep a share of the one before lead from 1 to 0.5, and another spread stays where it is.
    for number in range(3):
        problem.gusts.spread = 0.5 * 2.0 ** (kept**number)
        problem.force_spread = 0.2
        last = problem.gusts.spread
        problem._hasten()
    assert problem.force_spread == pytest.approx(0.2)
    if arrives:
        assert problem.gusts.spread == pytest.approx(0.5)
    elif kept > 0.0:
        assert 0.5 < problem.gusts.spread < last
    else:
        assert problem.gusts.spread == last
