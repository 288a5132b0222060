"""Fits and evidence against cases that can be worked out: linear ones against the formula, noise against its own law."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.stats import multivariate_normal

from ferryid.diagnose.inference.autoregression import ORDER, AutoregressiveNoise, fit_autoregression
from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, Fit, fit, starting_point
from ferryid.diagnose.inference.kalman import DIFFUSE
from ferryid.diagnose.inference.noise_model import NoiseModel, stride_s
from ferryid.diagnose.inference.weak_form import steps_of, windows
from ferryid.effects import effects
from ferryid.effects.effect import HELD, Effect, Parameter
from ferryid.effects.force_model import ForceModel, Measurements, hull_of, moved_coefficient
from ferryid.types import Floats
from ferryid.vessel import load_profile

FERRY = load_profile("milliampere")


def push(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """A constant force ahead: exactly linear."""
    return replace(force_model, external=force_model.external + np.array([p[0], 0.0, 0.0]))


PUSH = Candidate(
    Effect("push", "Push", lambda profile: (), push, lambda v, i: "", lambda v, i: {}),
    None,
    (Parameter("force", "N", 50.0, -1e4, 1e4),),
)


NOISE = np.array([[0.01, 0.02, 1.5, 0.01, 8.0], [0.01, 0.02, 1.5, 0.01, 8.0], [0.01, 0.02, 1.5, 0.01, 8.0]])
"""Of north, east and heading: white error, coloured error and its time constant, disturbance and its time constant."""


def covariance(row: Floats, n: int, h: float) -> Floats:
    """Return the covariance of the second differences, over h², of n + 2 positions with the noise of a channel."""
    white, wrong, wrong_s, pushed, pushed_s = row
    lag = h * np.arange(n + 2)
    error = toeplitz(wrong**2 * (1.0 + lag / wrong_s) * np.exp(-lag / wrong_s)) + white**2 * np.eye(n + 2)
    ago = np.arange(n + 2)[:, None] - np.arange(n + 2)[None]
    # What an acceleration that is held for a step makes of the position.
    moved = np.where(ago > 0, h * h * (ago - 0.5), 0.0)
    D = np.diff(np.eye(n + 2), 2, axis=0) / h**2
    return np.asarray(D @ (error + moved @ toeplitz(pushed**2 * np.exp(-lag / pushed_s)) @ moved.T) @ D.T)


def problem(true_force: float, seed: int = 0) -> EstimationProblem:
    """A vessel held at rest, pushed by a force that its noisy position is said to show, with the noise of `NOISE`."""
    t = np.arange(0.0, 300.0, 0.2)
    zero = np.zeros((len(t), 3))
    parts, ahead = np.zeros((len(t), 2, 3)), np.zeros((len(t), 2))
    measurements = Measurements(FERRY, t, zero, zero, zero, parts, ahead, np.ones(len(t), dtype=bool))
    seen = windows(measurements, 8.0, 2.0)
    steps = steps_of(seen)
    n, h = len(steps.starts), stride_s(steps)
    random = np.random.default_rng(seed)
    # Gaps have no start to be unknown of: two more, at rest, are where it stands.
    position = np.zeros((len(t), 3))
    often = len(t) // (n + 2)
    # The heading is exact, so that ahead is north.
    for j, row in enumerate(NOISE[:2]):
        gaps = np.linalg.cholesky(covariance(row, n, h)) @ random.standard_normal(n)
        gaps += true_force / FERRY.hull.M[0, 0] if j == 0 else 0.0
        path = np.concatenate([np.zeros(2), np.cumsum(np.cumsum(gaps)) * h * h])
        position[: often * (n + 2) : often, j] = path
    moved = replace(seen, measurements=replace(seen.measurements, eta=position))
    plain = ForceModel(
        seen.measurements,
        hull_of(FERRY),
        seen.measurements.parts,
        seen.measurements.angles,
        np.zeros((len(seen.measurements.t), 3)),
    )
    white = AutoregressiveNoise(np.zeros((3, ORDER)), np.eye(3))
    # Next to no freedom of the hull, so that the case stays the linear one of the formula.
    return EstimationProblem(moved, plain, white, np.full(len(plain.hull), 1e-9), NoiseModel(NOISE))


@pytest.mark.slow
def test_a_linear_hypothesis_has_the_mean_spread_and_evidence_of_the_formula() -> None:
    size, mass = 50.0, FERRY.hull.M[0, 0]
    case = problem(60.0)
    found, nothing = fit(case, [PUSH]), fit(case, [])
    # Two positions stand for an unknown start; the gaps that sum up to them tell nothing.
    y = case.steps.measured[DIFFUSE:, 0] * mass
    h = stride_s(case.steps)
    C = covariance(NOISE[0], len(y), h) * mass**2
    one = np.ones(len(y))
    precision = one @ np.linalg.solve(C, one) + 1.0 / size**2
    mean, spread = one @ np.linalg.solve(C, y) / precision, precision**-0.5
    assert abs(mean - 60.0) < 4.0 * spread
    np.testing.assert_allclose(found.values[0], mean, rtol=1e-3)
    np.testing.assert_allclose(found.errors(0), spread, rtol=1e-3)
    zero = np.zeros(len(y))
    shared, alone = multivariate_normal(zero, C + size**2 * np.outer(one, one)), multivariate_normal(zero, C)
    known = shared.logpdf(y) - alone.logpdf(y)
    assert known > 3.0
    np.testing.assert_allclose(found.evidence - nothing.evidence, known, rtol=1e-3, atol=1e-2)


def test_a_fit_is_given_up_only_where_it_cannot_reach_what_is_asked() -> None:
    case, calls = problem(60.0), list[float]()

    def counted(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
        calls.append(float(p[0]))
        return push(force_model, p, instance)

    candidate = replace(PUSH, effect=replace(PUSH.effect, apply=counted))
    whole = fit(case, [candidate])
    start = fit(case, [candidate], steps=0)
    # It is linear: what the slope promises is all that there is, which four times as much is the bound of.
    gain = whole.evidence - start.evidence
    assert gain > 3.0
    for beyond, given_up in ((gain, False), (3.9 * gain, False), (4.1 * gain, True)):
        calls.clear()
        made = fit(case, [candidate], least=start.evidence + beyond)
        expected = start if given_up else whole
        # Where it starts and its slope there.
        assert (len(calls) == 2) == given_up
        np.testing.assert_allclose([made.evidence, made.values[0][0]], [expected.evidence, expected.values[0][0]])


def test_slopes_are_taken_once_where_a_fit_begins_at_its_end() -> None:
    case, calls = problem(60.0), list[float]()

    def counted(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
        calls.append(float(p[0]))
        return push(force_model, p, instance)

    candidate = replace(PUSH, effect=replace(PUSH.effect, apply=counted))
    made = fit(case, [candidate])
    calls.clear()
    again = fit(case, [candidate], made.values, begin=starting_point(case, made))
    # Once for the starting point, then where the fit begins and its slope there.
    assert len(calls) == 3
    np.testing.assert_allclose([again.evidence, *again.values[0]], [made.evidence, *made.values[0]])


@pytest.mark.parametrize("moved", [0, 1])
def test_slopes_are_those_of_all_effects_where_one_acts_on_what_another_leaves(moved: int) -> None:
    def stronger(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
        return replace(force_model, external=force_model.external * (1.0 + p[0]))

    factor = Candidate(
        replace(PUSH.effect, id="factor", apply=stronger), None, (Parameter("factor", "-", 0.5, -1e4, 1e4),)
    )
    case = problem(60.0)
    values = [np.array([40.0]), np.array([0.3])]
    held = [
        replace(one, parameters=tuple(replace(each, size=HELD, neutral=float(v[0])) for each in one.parameters))
        if k != moved
        else one
        for k, (one, v) in enumerate(zip([PUSH, factor], values, strict=True))
    ]
    both = fit(case, held, values)
    # Force times factor is all that matters.
    product = both.values[0][0] * (1.0 + both.values[1][0])
    alone = fit(case, [PUSH]).values[0][0]
    np.testing.assert_allclose(product, alone, rtol=0.05)


@pytest.mark.slow
def test_evidence_weighs_filters_against_each_other() -> None:
    case = problem(0.0)
    y, h = case.steps.measured[DIFFUSE:, :3], stride_s(case.steps)
    told, known = [], []
    for share in (1.0, 1.3, 0.6):
        told.append(fit(replace(case, filter=NoiseModel(share * NOISE)), []).evidence)
        one = multivariate_normal(np.zeros(len(y)), covariance(share * NOISE[0], len(y), h))
        known.append(sum(one.logpdf(y[:, j]) for j in range(3)))
    # A start of which next to nothing is known is not quite one of which nothing is.
    np.testing.assert_allclose(np.array(told) - told[0], np.array(known) - known[0], atol=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("factors", [(1.0, 1.0, 1.0), (1.8, 1.4, 0.7)], ids=["plain", "fouled"])
def test_slopes_by_the_hull_are_those_of_whitened_gaps(factors: tuple[float, float, float]) -> None:
    def acted(force_model: ForceModel) -> ForceModel:
        return effects()["fouling"].apply(force_model, np.array(factors), None)

    case = problem(60.0)
    n = len(case.plain.measurements.t)
    moving = np.random.default_rng(1).normal(size=(n, 3)) * [1.0, 0.5, 0.2]
    steps = replace(case.steps, measurements=replace(case.plain.measurements, nu=moving))
    plain = replace(case.plain, measurements=steps.measurements, external=np.full((n, 3), 30.0))
    spread = 0.12 * np.abs(plain.hull)
    spread[6] = 0.0
    case = replace(
        case, windows=replace(case.windows, measurements=steps.measurements), plain=plain, hull_spread=spread
    )
    # Fouling multiplies coefficients: what one moves by is multiplied too.
    found = case.hull_slopes(acted(plain), plain.hull)
    assert not found[:, spread == 0.0].any()
    for k in np.flatnonzero(spread):
        hull = plain.hull.copy()
        hull[k] += 0.1 * spread[k]
        slope = (case.white(acted(replace(plain, hull=hull))) - case.white(acted(plain))) / 0.1
        np.testing.assert_allclose(found[:, k], slope, rtol=0.0, atol=1e-6 * np.abs(slope).max())


@pytest.mark.slow
def test_what_differs_in_one_coefficient_alone_is_worked_out_as_any_other() -> None:
    case = problem(60.0)
    plain, white = case.plain, case.white(case.plain)
    n = len(plain.measurements.t)
    heavier, weaker = plain.hull.copy(), plain.hull.copy()
    heavier[0] *= 1.1
    weaker[6:8] *= 1.2
    hulls = [plain.replaced(hull=heavier), plain.replaced(hull=weaker)]
    pushed = plain.replaced(external=np.full((n, 3), 30.0))
    both = plain.replaced(hull=heavier, external=pushed.external)
    assert [moved_coefficient(plain, one) for one in (*hulls, pushed, both, plain)] == [0, None, None, None, None]
    # Equal arrays are the same, whoever made them.
    assert moved_coefficient(plain, plain.replaced(hull=heavier, external=plain.external.copy())) == 0
    others = [both, *hulls, pushed]
    for begin in (plain, pushed):
        there = case.white(begin)
        expected = np.column_stack([case.white(one) - there for one in others])
        found = case.changes(begin, others, there)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9 * np.abs(white).max())
    with pytest.raises(AssertionError, match="hul"):
        plain.replaced(hul=heavier)


@pytest.mark.slow
def test_limits_are_kept() -> None:
    narrow = replace(PUSH, parameters=(Parameter("force", "N", 50.0, -5.0, 5.0),))
    assert fit(problem(60.0), [narrow]).values[0] == 5.0


@pytest.mark.slow
def test_a_limit_does_not_keep_the_others_from_their_best() -> None:
    def shove(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
        more = np.zeros((len(force_model.measurements.t), 3))
        # The second is all but the first, so that a step that leaves its limit aside goes far off in both.
        more[:, 0] = p[0] + p[1] * (1.0 + 0.5 * (force_model.measurements.t > 150.0))
        return replace(force_model, external=force_model.external + more)

    both = (Parameter("force", "N", 500.0, -1e4, 1e4), Parameter("more", "N", 500.0, 0.0, 1e4))

    case = problem(60.0)
    drifting = replace(
        case.plain,
        external=case.plain.external + np.array([60.0, 0.0, 0.0]) * (case.plain.measurements.t > 150.0)[:, None],
    )
    case = replace(case, plain=drifting)
    effect = replace(PUSH.effect, apply=shove)
    limited = fit(case, [Candidate(effect, None, both)])
    alone = fit(case, [Candidate(effect, None, (both[0], replace(both[1], size=1e-7)))])
    assert limited.values[0][1] == 0.0
    np.testing.assert_allclose(limited.values[0][0], alone.values[0][0], rtol=1e-3)


@pytest.mark.slow
def test_an_onset_leaves_what_was_before_it_alone() -> None:
    late = replace(PUSH, onset_s=150.0)
    case = problem(0.0)
    after = late.act(case.plain, np.array([30.0]))
    rows = case.plain.measurements.t >= 150.0
    assert (after.external[~rows, 0] == 0.0).all()
    assert (after.external[rows, 0] == 30.0).all()


def test_noise_is_white_once_its_own_autoregression_is_taken_off() -> None:
    random = np.random.default_rng(1)
    n, mix = 4000, np.array([[1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 2.0]])
    kicks = random.standard_normal((n, 3)) @ mix.T
    series = np.zeros((n, 3))
    for k in range(2, n):
        series[k] = 0.9 * series[k - 1] - 0.3 * series[k - 2] + kicks[k]
    runs = ((0, n // 2), (n // 2, n))
    learnt = fit_autoregression(series, runs)
    np.testing.assert_allclose(learnt.coefficients[:, :2], [[0.9, -0.3]] * 3, atol=0.06)
    white = learnt.white(series, runs).reshape(-1, 3)
    np.testing.assert_allclose(white.T @ white / len(white), np.eye(3), atol=0.02)
    assert abs(np.corrcoef(white[1:, 0], white[:-1, 0])[0, 1]) < 0.05
    columns = np.stack([series, 2.0 * series], axis=-1)
    both = learnt.white(columns, runs)
    np.testing.assert_allclose(both[:, 1], 2.0 * both[:, 0])
    np.testing.assert_allclose(both[:, 0], learnt.white(series, runs))


def told(name: str, values: list[float], variance: float = 0.0) -> Floats:
    """Return the errors that are told of an effect whose posterior has this variance in every parameter."""
    effect = effects()[name]
    candidate = Candidate(effect, effect.instances(FERRY)[0], effect.parameters_of(FERRY)[: len(values)])
    return Fit((candidate,), (np.array(values),), variance * np.eye(len(values)), hull_of(FERRY), 0.0).reported_errors(
        0
    )


def test_a_formula_is_believed_to_a_tenth_of_what_it_changes() -> None:
    # Of a posterior that knows everything: a tenth of the distance from what changes nothing, which is 1 of a factor.
    np.testing.assert_allclose(told("payload", [300.0]), [30.0])
    # What is defined by its parameter hardly has a formula.
    np.testing.assert_allclose(told("thruster_gain", [0.7]), [0.006])
    # Where hull or instruments may be as much off themselves, that stays however little it is.
    np.testing.assert_allclose(told("thruster_lag", [0.0]), [0.015])
    np.testing.assert_allclose(told("current", [0.12, 0.0]), [0.013, 0.005])
    # Half as much again as the posterior says, and no more where nothing is changed.
    np.testing.assert_allclose(told("thruster_gain", [1.0], 0.01**2), [0.015])
    np.testing.assert_allclose(told("payload", [400.0], 20.0**2), [50.0])


def test_a_place_is_no_size() -> None:
    np.testing.assert_allclose(told("mooring", [50.0, 40.0, 300.0, -200.0]), [2.5, 2.0, 0.0, 0.0])
