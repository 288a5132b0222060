"""Where and when a mismatch shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.diagnose.inference.change_points import LEVELS, _breaks, active_intervals
from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, Fit, estimation_problem, fit
from ferryid.diagnose.inference.weak_form import windows
from ferryid.diagnose.judging.error_profiles import in_words, profile_of
from ferryid.diagnose.judging.locate import locate, whitened
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects import Parameter, effects
from ferryid.effects.force_model import ForceModel, Measurements, acceleration, hull_of
from ferryid.effects.thresholds import EFFECTS
from ferryid.types import Floats
from ferryid.vessel import load_profile

FERRY = load_profile("milliampere")
SECONDS, STEP_S = 600.0, 0.2


def trial_on(push: Floats | None = None) -> EstimationProblem:
    """A turning vessel whose thrusters give what its hull needs less a push that nobody measured, with noise."""
    rng = np.random.default_rng(5)
    t = np.arange(0.0, SECONDS, STEP_S)
    speed, drift = np.sin(t / 23.0), 0.7 * np.sin(t / 53.0)
    rate = np.full(len(t), 2.0 * np.pi / 100.0)
    psi = rate * t
    nu = np.column_stack([speed, drift, rate])
    c, s = np.cos(psi), np.sin(psi)
    place = np.cumsum(np.column_stack([c * speed - s * drift, s * speed + c * drift]), axis=0) * STEP_S
    eta = np.column_stack([place, psi])
    noisy = nu + rng.standard_normal(nu.shape) * [0.01, 0.01, 0.002]
    eta = eta + rng.standard_normal(eta.shape) * [0.02, 0.02, 0.002]
    seen = Measurements(
        FERRY, t, eta, noisy, nu, np.zeros((len(t), 2, 3)), np.zeros((len(t), 2)), np.ones(len(t), dtype=bool)
    )
    bare = ForceModel(seen, hull_of(FERRY), seen.parts, seen.angles, np.zeros((len(t), 3)))
    accelerated = np.column_stack([np.cos(t / 23.0) / 23.0, 0.7 / 53.0 * np.cos(t / 53.0), np.zeros_like(t)])
    # Inverse dynamics with the force model's own equations: its force is what is left of the motion it gives without any.
    needed = (accelerated - acceleration(bare)) @ FERRY.hull.M.T
    gone = np.zeros((len(t), 3)) if push is None else push
    parts = np.stack([needed - gone, np.zeros_like(needed)], axis=1)
    measurements = replace(seen, parts=parts)
    cut = windows(measurements, 8.0, 2.0)
    plain = ForceModel(
        cut.measurements,
        hull_of(FERRY),
        cut.measurements.parts,
        cut.measurements.angles,
        np.zeros((len(cut.measurements.t), 3)),
    )
    return estimation_problem(cut, plain, EFFECTS.hull_spread * np.abs(plain.hull))


def pushed(shape: Floats) -> Candidate:
    """An effect that is any push: `shape` times its only parameter."""

    def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
        return replace(force_model, external=force_model.external + p[0] * shape)

    effect = replace(effects()["wind"], id="push", apply=apply)
    return Candidate(effect, None, (Parameter("size", "", 1.0, -10.0, 10.0),))


def told_of(shape: Floats) -> tuple[EstimationProblem, Fit]:
    problem = trial_on(shape)
    found = fit(problem, [pushed(shape)])
    problem = problem.with_noise_of(found)
    return problem, fit(problem, [pushed(shape)])


T = np.arange(0.0, SECONDS, STEP_S)
PSI = 2.0 * np.pi / 100.0 * T


@pytest.mark.slow
def test_a_push_in_sway_shows_in_sway() -> None:
    shape = np.zeros((len(T), 3))
    shape[:, 1] = 60.0 * np.sin(T / 6.0)
    problem, found = told_of(shape)
    where = locate(problem, fit(problem, ()), found)
    assert where.shares.sum() == pytest.approx(1.0)
    assert where.shares[1] > 0.9
    assert where.intervals == ((0.0, pytest.approx(SECONDS, abs=1.0)),)
    assert where.onset_s is None
    assert where.offset_s is None


@pytest.mark.slow
def test_a_push_for_a_time_begins_and_ends() -> None:
    shape = np.zeros((len(T), 3))
    acts = (T >= 200.0) & (T < 420.0)
    shape[acts, 2] = 150.0 * np.sin(T[acts] / 5.0)
    problem, found = told_of(shape)
    where = locate(problem, fit(problem, ()), found)
    assert len(where.intervals) == 1
    assert where.onset_s == pytest.approx(200.0, abs=10.0)
    assert where.offset_s == pytest.approx(420.0, abs=10.0)


@pytest.mark.slow
def test_a_push_at_some_headings_is_told_by_the_heading() -> None:
    heading = np.degrees(PSI) % 360.0
    shape = np.zeros((len(T), 3))
    inside = (heading >= 90.0) & (heading < 150.0)
    shape[inside, 1] = 80.0
    problem, found = told_of(shape)
    where = locate(problem, fit(problem, ()), found)
    assert where.profiles[0].name == "heading"
    assert where.profiles[0].statistic > 4.0
    edges = [float(word) for word in where.regime.replace("headings", "").split() if word.isdigit()]
    # Windows of 8 s see 29 degrees of the circle, and the autoregression looks back by as much again.
    assert 60.0 <= edges[0] <= 90.0
    assert 120.0 <= edges[1] <= 210.0
    seen = where.profiles[0].mean[:, 1]
    # The model lacks the push, so that its force falls short by it.
    assert seen[4] == pytest.approx(-80.0, abs=25.0)
    assert abs(seen[9]) < 25.0


@pytest.mark.slow
def test_a_fast_push_lies_in_its_frequency_band() -> None:
    shape = np.zeros((len(T), 3))
    shape[:, 0] = 80.0 * np.sin(2.0 * np.pi * 0.15 * T)
    problem, found = told_of(shape)
    where = locate(problem, fit(problem, ()), found)
    gained = {(band.low_hz, band.high_hz): band.before[0] - band.after[0] for band in where.bands}
    assert max(gained, key=lambda key: gained[key]) == (0.1, 0.2)
    # Half the square of the amplitude, less what a window of 1.6 s takes of 0.15 Hz.
    assert 0.7 * 3200.0 < gained[0.1, 0.2] < 3200.0


@pytest.mark.slow
def test_without_a_mismatch_nothing_stands_out() -> None:
    problem = trial_on()
    alone = fit(problem, ())
    where = locate(problem, alone, alone)
    assert where.shares.tolist() == [0.0, 0.0, 0.0]
    assert where.excess.tolist() == [0.0, 0.0, 0.0]
    assert where.regime == "all along"
    assert all(profile.statistic < 4.0 for profile in where.profiles)
    assert all(np.array_equal(band.before, band.after) for band in where.bands)


@pytest.mark.slow
def test_errors_that_grow_are_found_without_any_explanation() -> None:
    shape = np.zeros((len(T), 3))
    late = T > 400.0
    shape[late, 2] = 60.0 * np.random.default_rng(9).standard_normal(int(late.sum())).cumsum() / 20.0
    problem = trial_on(shape)
    alone = fit(problem, ())
    where = locate(problem, alone, alone)
    assert where.onset_s == pytest.approx(400.0, abs=25.0)


def test_white_noise_has_no_change_and_a_step_has_one() -> None:
    times = np.arange(300.0)
    false = 0
    for seed in range(200):
        noise = np.random.default_rng(seed).standard_normal(300)
        false += len(_breaks(np.abs(noise), 0, 300, LEVELS)) > 0
        false += active_intervals(times, noise**2, 4.0, (0.0, 300.0), steady=True) != ((0.0, 300.0),)
    assert false <= 8
    step = np.random.default_rng(1).standard_normal(300) ** 2 * np.where(times < 120.0, 0.05, 4.0)
    for steady in (False, True):
        ((start, end),) = active_intervals(times, step, 4.0, (0.0, 300.0), steady=steady)
        assert start == pytest.approx(120.0, abs=5.0)
        assert end == 300.0


def test_a_profile_of_noise_is_even_and_counts_every_window() -> None:
    rng = np.random.default_rng(2)
    statistics = []
    for _ in range(200):
        white = rng.standard_normal((360, 3))
        one = profile_of(
            "heading", "deg", rng.uniform(0.0, 360.0, 360), np.linspace(0.0, 360.0, 13), white, white, white
        )
        assert one.count.sum() == 360
        statistics.append(one.statistic)
    assert abs(np.mean(statistics)) < 0.4
    assert np.mean(np.array(statistics) > 4.0) <= 0.01


def test_bins_with_too_few_windows_are_not_judged() -> None:
    value = np.concatenate([np.full(50, 0.5), np.full(JUDGING.bin_windows - 1, 1.5), np.full(50, 2.5)])
    white = np.random.default_rng(0).standard_normal((len(value), 3))
    one = profile_of("speed", "m/s", value, np.array([0.0, 1.0, 2.0, 3.0]), white, white, white)
    assert np.isnan(one.excess[1]).all()
    assert np.isfinite(one.excess[[0, 2]]).all()


def test_whitening_leaves_noise_of_unit_variance_without_memory() -> None:
    rng = np.random.default_rng(4)
    values = np.zeros((4000, 3))
    for i in range(1, 4000):
        values[i] = 0.8 * values[i - 1] + [1.0, 5.0, 20.0] * rng.standard_normal(3)
    kept, (double, white) = whitened((2.0 * values, values), ((0, 2000), (2000, 4000)))
    assert len(kept) == len(white) == 4000 - 8
    np.testing.assert_allclose(double, 2.0 * white)
    np.testing.assert_allclose(np.mean(white**2, axis=0), 1.0)
    assert np.abs(np.mean(white[1:] * white[:-1], axis=0)).max() < 0.05


def test_a_regime_across_north_is_one_range() -> None:
    heading = np.arange(0.5, 360.0)
    loud = np.where((heading > 330.0) | (heading < 60.0), 3.0, 1.0)
    white = np.random.default_rng(6).standard_normal((360, 3)) * loud[:, None]
    one = profile_of("heading", "deg", heading, np.linspace(0.0, 360.0, 13), white, white, white)
    assert in_words([one], np.full(3, 1.0 / 3.0)) == "headings 330 to 60 deg"
