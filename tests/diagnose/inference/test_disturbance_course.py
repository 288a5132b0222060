"""When waves act and how they grow, on a trial whose motion was calculated, beside a force that nobody measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.diagnose.data.measurements import window_lengths
from ferryid.diagnose.inference.disturbance_course import (
    ALL_ALONG,
    StrengthCourse,
    likeliest_span,
    shortest_s,
)
from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, estimation_problem, fit
from ferryid.diagnose.inference.noise_model import stride_s
from ferryid.diagnose.inference.prior import prior_force_model
from ferryid.diagnose.inference.stochastic_disturbance import DisturbanceState, fit_disturbances
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.inference.weak_form import windows
from ferryid.diagnose.judging.disturbance_findings import disturbance_claims
from ferryid.effects import effects
from ferryid.types import Floats
from tests.diagnose.inference.test_onset_estimation import TWELVE
from tests.diagnose.trials import FERRY, sailed, trial_on

WAVES = Candidate.of(effects()["waves"], None, FERRY)
HZ = 0.4
SMALL = 12.0
"""Moment [N·m] whose swing the error of a compass hides."""


WEAK = 20.0
"""Moment [N·m] that is seen for two minutes."""
MEMORY_S = 6.0


@pytest.fixture(scope="module")
def calm(tmp_path_factory: pytest.TempPathFactory) -> EstimationProblem:
    return trial_on(sailed(tmp_path_factory.mktemp("calm"), "calm", TWELVE, 5))


@pytest.fixture(scope="module")
def longer(tmp_path_factory: pytest.TempPathFactory) -> EstimationProblem:
    """A trial of half as much time again, for a growth to be told."""
    text = TWELVE.replace("dwell_s = 40", "dwell_s = 60")
    return trial_on(sailed(tmp_path_factory.mktemp("longer"), "longer", text, 5))


def narrow_band(t: Floats, step_s: float, seed: int = 3) -> Floats:
    """Return a narrow-band process of unit variance, shape (n,)."""
    rng = np.random.default_rng(seed)
    keep = np.exp(-step_s / MEMORY_S)
    fresh = np.sqrt(1.0 - keep**2) * (rng.standard_normal((len(t), 2)) @ [1.0, 1.0j])
    state, wave = rng.standard_normal(2) @ [1.0, 1.0j], np.empty(len(t))
    for k, one in enumerate(fresh):
        state = keep * np.exp(2.0j * np.pi * HZ * step_s) * state + one
        wave[k] = state.real
    return wave


def shaken(
    case: EstimationProblem, moment_std: float, strength: Floats | float = 1.0, seed: int = 3
) -> EstimationProblem:
    """Return a trial with a moment in a narrow band that the force model lacks, as strong as said over the trial."""
    measurements = case.plain.measurements
    moment = moment_std * strength * narrow_band(measurements.t, measurements.step_s, seed)
    away = case.plain.external - moment[:, None] * [0.0, 0.0, 1.0]
    return estimation_problem(case.windows, replace(case.plain, external=away), case.hull_spread)


def waves_in(case: EstimationProblem) -> tuple[EstimationProblem, tuple[DisturbanceState, ...]]:
    return fit_disturbances(case, fit(case, ()), [WAVES], case.plain)


def test_a_course_is_as_strong_on_average_as_without_one() -> None:
    t = np.linspace(50.0, 650.0, 601)
    grown = StrengthCourse(growth=4.0).factors(t)
    assert np.mean(grown**2) == pytest.approx(1.0)
    assert grown[-1] / grown[0] == pytest.approx(4.0)
    span = StrengthCourse(100.0, 200.0).factors(t)
    assert span[(t >= 100.0) & (t < 200.0)].tolist() == [1.0] * 100
    assert not span[(t < 100.0) | (t >= 200.0)].any()


def test_what_a_course_costs_grows_with_its_ends() -> None:
    costs = [one.cost(1000) for one in (ALL_ALONG, StrengthCourse(100.0), StrengthCourse(100.0, 200.0))]
    assert costs[0] == 0.0
    assert costs[2] - costs[1] == pytest.approx(np.log(1000.0))


def test_the_ends_of_a_force_that_was_found_cost_nothing() -> None:
    assert StrengthCourse(100.0, 200.0, with_force=True).cost(1000) == 0.0


@pytest.mark.slow
def test_the_span_that_gains_most_is_found_by_its_ends(calm: EstimationProblem) -> None:
    steps = calm.excerpt
    gained = np.full(len(steps.starts), -0.2)
    gained[300:500] = 1.0
    course, gain = likeliest_span(steps, gained)
    middles = steps.middle_s - 0.5 * stride_s(steps)
    assert (course.onset_s, course.offset_s) == pytest.approx((middles[300], middles[500]))
    assert gain == pytest.approx(200.0 - 2.0 * np.log(len(gained)))
    # Of what gains all along, neither end is within the log; and of a flash the least time is taken.
    assert likeliest_span(steps, np.ones(len(gained)))[0] == ALL_ALONG
    flash = np.full(len(gained), -0.2)
    flash[300] = 30.0
    short, _ = likeliest_span(steps, flash)
    assert short.offset_s - short.onset_s == pytest.approx(shortest_s(steps), abs=1.0)


@pytest.mark.slow
def test_a_wake_of_a_minute_is_found_with_its_times(calm: EstimationProblem) -> None:
    t = calm.plain.measurements.t
    from_s, until_s = float(t[0]) + 200.0, float(t[0]) + 260.0
    case = shaken(calm, 150.0, ((t >= from_s) & (t < until_s)).astype(float))
    rough, (state,) = waves_in(case)
    assert (state.course.onset_s, state.course.offset_s) == pytest.approx((from_s, until_s), abs=5.0)
    (claim,) = disturbance_claims(rough, fit(rough, ()), [state], case.plain.measurements)
    found = claim.finding
    assert found.intervals == ((found.onset_s, found.offset_s),)
    for name, truth in (("onset", from_s), ("offset", until_s)):
        assert found.parameters[name].low - 3.0 < truth < found.parameters[name].high + 3.0
    assert found.parameters["moment_std"].low < 150.0 < found.parameters["moment_std"].high


@pytest.mark.slow
def test_waves_that_grow_are_found_with_their_growth_and_even_ones_without(
    calm: EstimationProblem, longer: EstimationProblem
) -> None:
    t = longer.plain.measurements.t
    # Estimated once, beside noise and waves of even strength, it is 2.5 (1.5 to 4.2).
    case = shaken(longer, 150.0, np.interp(t, t[[0, -1]], [0.25, 1.5]), seed=12)
    growth = waves_in(case)[1][0].times["growth"]
    assert growth.low < 6.0 < growth.high
    assert abs(growth.value / 6.0 - 1.0) < 0.3
    even = waves_in(shaken(calm, 100.0))[1][0]
    assert even.course == ALL_ALONG
    assert not even.times


@pytest.mark.slow
def test_waves_that_the_compass_hides_are_found_by_the_gyroscope(calm: EstimationProblem) -> None:
    case = shaken(calm, SMALL)
    rough, (state,) = waves_in(case)
    assert state.in_velocities
    assert state.estimates["moment_std"].low < SMALL < state.estimates["moment_std"].high
    assert abs(state.estimates["peak_frequency"].value / HZ - 1.0) < 0.15
    assert rough.filter.processes
    assert waves_in(calm)[1] == ()


@pytest.mark.slow
def test_what_positions_alone_show_is_told_by_the_velocities(calm: EstimationProblem) -> None:
    """The error of a compass in a narrow band: no gyroscope shows it."""
    measurements = calm.plain.measurements
    swing = 0.01 * narrow_band(measurements.t, measurements.step_s)[:, None] * [0.0, 0.0, 1.0]
    seen = windows(replace(measurements, eta=measurements.eta + swing), *window_lengths(FERRY))
    odd = estimation_problem(seen, *prior_force_model(seen.measurements, FERRY))
    (swung,) = waves_in(odd)[1]
    assert swung.gain_in_velocities < 0.0
    assert swung.loss_in_velocities > 100.0
    (waves,) = waves_in(shaken(calm, 150.0))[1]
    assert waves.gain_in_velocities > 100.0
    assert waves.loss_in_velocities == 0.0
    # Velocities in whose noise the swing would not be seen exclude nothing.
    rough = 2.0 * np.random.default_rng(8).standard_normal((len(measurements.t), 3))
    noisy = replace(measurements, eta=measurements.eta + swing, nu_raw=measurements.nu_raw + rough)
    seen = windows(noisy, *window_lengths(FERRY))
    hidden = estimation_problem(seen, *prior_force_model(seen.measurements, FERRY))
    assert all(one.loss_in_velocities < INFERENCE.prior_odds for one in waves_in(hidden)[1])


@pytest.mark.slow
def test_what_comes_and_goes_within_a_force_alone_begins_and_ends_with_it(calm: EstimationProblem) -> None:
    t = calm.plain.measurements.t
    from_s, until_s = float(t[0]) + 200.0, float(t[0]) + 320.0
    push = replace(Candidate.of(effects()["external_push"], None, FERRY), onset_s=from_s, offset_s=until_s)

    def state(case: EstimationProblem, *forces: Candidate) -> DisturbanceState:
        made = fit(case, forces, [one.start for one in forces])
        (found,) = fit_disturbances(case, made, [WAVES], case.plain)[1]
        return found

    heaved = shaken(calm, WEAK, ((t >= from_s) & (t < until_s)).astype(float))
    alone, beside = state(heaved), state(heaved, push)
    assert alone.course.ends == 2
    assert not alone.course.with_force
    # Beside a force that was found its ends are no choice, and cost nothing.
    assert beside.course == StrengthCourse(from_s, until_s, with_force=True)
    assert beside.gain - alone.gain == pytest.approx(alone.course.cost(len(heaved.excerpt.starts)), abs=8.0)
    for name, end in (("onset", from_s), ("offset", until_s)):
        assert beside.times[name].low < end < beside.times[name].high
    # Waves that are there before and after have nothing to do with it.
    assert state(shaken(calm, 100.0), push).course == ALL_ALONG
