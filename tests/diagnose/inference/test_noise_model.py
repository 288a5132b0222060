"""The filter against dense covariances, its noise against known noise, and its estimates in a closed loop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import block_diag, toeplitz
from scipy.stats import chi2, multivariate_normal

from ferryid.diagnose.inference.autoregression import ORDER, AutoregressiveNoise
from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, fit
from ferryid.diagnose.inference.kalman import (
    DIFFUSE,
    FEW,
    WIDE,
    errors,
    gains,
    kept,
    predictions_alone,
    summed,
    whitened_alone,
)
from ferryid.diagnose.inference.noise_estimation import _widths, excerpt, fit_noise
from ferryid.diagnose.inference.noise_model import NoiseModel, likelihood, make_whitening_filter, stride_s
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.inference.weak_form import Windows, steps_of, windows
from ferryid.effects import effects
from ferryid.effects.effect import Effect, Parameter, Process
from ferryid.effects.force_model import COEFFICIENTS, ForceModel, Measurements, hull_of
from ferryid.types import Floats
from ferryid.vessel import load_profile

FERRY = load_profile("milliampere")
STEP_S = 0.2
TRUE = np.array([[0.01, 0.02, 1.5, 0.01, 8.0], [0.01, 0.02, 1.5, 0.01, 8.0], [0.002, 0.004, 0.9, 0.003, 12.0]])
OTHER = np.array([[0.02, 0.01, 3.0, 0.02, 4.0], [0.005, 0.03, 0.8, 0.005, 20.0], [0.003, 0.002, 2.0, 0.002, 5.0]])


def at_rest(seconds: float, placed: bool = True, usable: np.ndarray | None = None) -> tuple[Windows, ForceModel]:
    """Return steps of a vessel that lies still, and its force model without any force."""
    t = np.arange(0.0, seconds, STEP_S)
    zero = np.zeros((len(t), 3))
    eta = zero if placed else np.column_stack([np.full((len(t), 2), np.nan), zero[:, 2]])
    every = np.ones(len(t), dtype=bool) if usable is None else usable
    measurements = Measurements(FERRY, t, eta, zero, zero, np.zeros((len(t), 2, 3)), np.zeros((len(t), 2)), every)
    seen = windows(measurements, 8.0, 2.0)
    thin = seen.measurements
    return steps_of(seen), ForceModel(thin, hull_of(FERRY), thin.parts, thin.angles, np.zeros((len(thin.t), 3)))


def moved_by(n: int, integrals: int, h: float) -> Floats:
    """Return what accelerations, each held for a step, make of the position or the velocity, shape (n, n)."""
    ago = np.arange(n)[:, None] - np.arange(n)[None]
    return np.where(ago > 0, h * h * (ago - 0.5) if integrals == 2 else h, 0.0)


def covariances(row: Floats, n: int, h: float) -> tuple[Floats, Floats]:
    """Return covariances of a channel's measurement error and of its disturbance, shape (n, n) each."""
    white, wrong, wrong_s, pushed, pushed_s = row
    lag = h * np.arange(n)
    error = wrong**2 * (1.0 + lag / wrong_s) * np.exp(-lag / wrong_s)
    error[0] += white**2
    return toeplitz(error), toeplitz(pushed**2 * np.exp(-lag / pushed_s))


def contrasts(c: int, n: int, integrals: int) -> Floats:
    """Return what takes an unknown start away, of all channels, time by time: differences, shape (c (n - integrals), c n)."""
    D = np.diff(np.eye(n), integrals, axis=0)
    return np.kron(D, np.eye(c))


def dense(y: Floats, C: Floats, integrals: int) -> float:
    """Return the log-density of series, shape (n, c), but for a constant, given the first `DIFFUSE` steps."""
    n, c = y.shape
    D = contrasts(c, n, integrals)
    z, S = D @ y.ravel(), D @ C @ D.T
    total = float(multivariate_normal(np.zeros(len(z)), S).logpdf(z))
    known = c * (DIFFUSE - integrals)
    if known:
        total -= float(multivariate_normal(np.zeros(known), S[:known, :known]).logpdf(z[:known]))
    return total


@pytest.mark.parametrize("integrals", [2, 1], ids=["positions", "velocities"])
def test_one_channel_has_the_likelihood_of_its_dense_covariance(integrals: int) -> None:
    n, h = 70, 0.4
    y = np.cumsum(np.random.default_rng(0).standard_normal((n, 1)), axis=0) * 0.02

    def both(row: Floats) -> tuple[float, float]:
        nothing = np.empty((n, 1, 0))
        K, spread = gains(np.array([1.0]), row[None], integrals, np.empty((0, 0)), np.empty((2, 0, 0)), nothing, h)
        left = errors(K, spread, row[None], integrals, np.empty((0, 0)), nothing, h, y[:, :, None])[DIFFUSE:]
        error, push = covariances(row, n, h)
        G = moved_by(n, integrals, h)
        filtered = -0.5 * float(np.sum(left**2)) - float(np.log(spread[DIFFUSE:]).sum())
        return filtered, dense(y, error + G @ push @ G.T, integrals)

    here = [both(row) for row in (TRUE[0], TRUE[2], OTHER[0], OTHER[1])]
    filtered, known = np.array(here).T
    assert np.ptp(known) > 10.0
    np.testing.assert_allclose(filtered - filtered[0], known - known[0], atol=2e-3)


@pytest.mark.parametrize("integrals", [2, 1], ids=["positions", "velocities"])
@pytest.mark.parametrize("row", [TRUE[0], TRUE[2], OTHER[0]], ids=["first", "turn", "other"])
def test_one_channel_alone_has_the_innovations_of_its_dense_covariance(row: Floats, integrals: int) -> None:
    n, h = 90, 0.4
    rng = np.random.default_rng(2)
    error, push = covariances(row, n, h)
    G = moved_by(n, integrals, h)
    # Series of the model itself, one of a model that is not, and one that starts elsewhere and at speed.
    own = np.linalg.cholesky(error) @ rng.standard_normal((n, 2)) + G @ np.linalg.cholesky(push) @ rng.standard_normal(
        (n, 2)
    )
    elsewhere = 0.3 + 0.2 * h * np.arange(n) if integrals == 2 else np.full(n, 0.3)
    series = np.column_stack([own, 0.05 * np.cumsum(rng.standard_normal(n)), own[:, 0] + elsewhere])
    nothing, none = np.empty((n, 1, 0)), np.empty((0, 0))
    K, spread = gains(np.array([1.0]), row[None], integrals, none, np.empty((2, 0, 0)), nothing, h)
    gaps, runs = np.diff(series, integrals, axis=0, prepend=np.zeros((integrals, 4))) / h**integrals, np.array([[0, n]])
    left = whitened_alone(gaps[:, None], runs, K, spread, row[None], integrals, h)[:, 0]
    among = errors(K, spread, row[None], integrals, none, nothing, h, series[:, None])[:, 0]
    assert not left[:DIFFUSE].any()
    np.testing.assert_allclose(left[DIFFUSE:], among[DIFFUSE:], rtol=1e-7, atol=1e-9)
    for m, one in enumerate(left.T):
        # Of a single series the states stay in registers.
        single = whitened_alone(gaps[:, None, m : m + 1].copy(), runs, K, spread, row[None], integrals, h)
        np.testing.assert_allclose(single[:, 0, 0], one, rtol=1e-9, atol=1e-9)
    # Gauss: what is new in every step of a normal vector, over its standard deviation.
    D = contrasts(1, n, integrals)
    new = np.linalg.solve(np.linalg.cholesky(D @ (error + G @ push @ G.T) @ D.T), D @ series)
    np.testing.assert_allclose(left[DIFFUSE:], new[DIFFUSE - integrals :], atol=1e-4)


@pytest.mark.parametrize("integrals", [2, 1], ids=["positions", "velocities"])
def test_series_are_filtered_alike_in_any_number_and_from_where_they_begin(integrals: int) -> None:
    n, h, rng = 60, 0.4, np.random.default_rng(3)
    series = 0.02 * np.cumsum(rng.standard_normal((n, 3, 2 * FEW)), axis=0)
    for m in range(2 * FEW):
        series[: 4 * m, :, m] = 0.0
    blocks, columns = 0.9 * np.eye(2), 0.01 * rng.standard_normal((n, 3, 2))
    drive = np.stack([0.2 * np.eye(2), np.eye(2)])
    K, spread = gains(np.ones(3), TRUE[[0, 0, 2]], integrals, blocks, drive, columns, h)
    given = (K, spread, TRUE[[0, 0, 2]], integrals, blocks, columns, h)
    together = errors(*given, series)
    assert not together[:4, :, 1].any()
    assert together[4:, :, 1].all()
    for m in range(2 * FEW):
        np.testing.assert_allclose(
            together[:, :, m], errors(*given, series[:, :, m : m + 1].copy())[:, :, 0], rtol=1e-12
        )
        # Its first value, of the channel that is looked at first, is all that it is off.
        np.testing.assert_allclose(together[4 * m, 0, m] * spread[4 * m, 0], series[4 * m, 0, m], rtol=1e-12)


@pytest.mark.parametrize("integrals", [2, 1], ids=["positions", "velocities"])
def test_spreads_beside_bands_and_more_disturbances_than_a_loop_takes_are_those_of_dense_matrices(
    integrals: int,
) -> None:
    n, h, noise, rng = 30, 0.4, TRUE[[0, 1, 2]], np.random.default_rng(7)
    turn = np.array([[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]])
    blocks = block_diag(0.9 * turn, [[0.8]], [[0.95]], 0.7 * turn.T, [[0.6]])
    s = len(blocks)
    columns = rng.uniform(0.01, 0.03, (n, 3, s))
    # Of these two push on one channel alone, and one on none.
    columns[:, 1:, 1], columns[:, :2, 4], columns[:, :, 2] = 0.0, 0.0, 0.0
    drive = np.stack([np.eye(s) - blocks @ blocks.T, np.eye(s)])
    _, spread = gains(np.ones(3), noise, integrals, blocks, drive, columns, h)

    move, entering, P = block_diag(*[np.eye(5)] * 3, blocks), np.zeros((15 + s, 15 + s)), np.zeros((15 + s, 15 + s))
    keep, see = kept(noise, h), np.zeros((3, 15 + s))
    entering[15:, 15:], P[15:, 15:] = drive
    for j, (_, wrong, error_s, pushed, _) in enumerate(noise):
        i, known = 5 * j, 0 if integrals == 2 else 1
        see[j, [i + known, i + 2]] = 1.0
        move[i : i + 2, i : i + 5] = [[1.0, h, 0.0, 0.0, 0.5 * h * h], [0.0, 1.0, 0.0, 0.0, h]]
        move[i + 2 : i + 4, i + 2 : i + 4], move[i + 4, i + 4] = keep[j, :4].reshape(2, 2), keep[j, 4]
        P[i : i + 5, i : i + 5] = np.diag([0.0, 1e6, wrong**2, (wrong / error_s) ** 2, pushed**2])
        if integrals == 2:
            P[i, i], P[i + 1, i + 1] = 1e6, 1e6 / h**2
        own = slice(i + 2, i + 5)
        entering[own, own] = P[own, own] - move[own, own] @ P[own, own] @ move[own, own].T
    for k in range(n):
        seen = see @ P @ see.T + np.diag(noise[:, 0] ** 2)
        np.testing.assert_allclose(spread[k], np.diag(np.linalg.cholesky(seen)), rtol=1e-4)
        P = P - P @ see.T @ np.linalg.solve(seen, see @ P)
        for j in range(3):
            move[5 * j, 15:], move[5 * j + 1, 15:] = 0.5 * h * h * columns[k, j], h * columns[k, j]
        P = move @ P @ move.T + entering


@pytest.mark.slow
def test_a_filter_of_many_states_has_the_gains_of_one_of_few() -> None:
    n, h, idle = 40, 0.4, WIDE
    rng = np.random.default_rng(5)
    few = 0.9 * np.eye(2), np.stack([0.2 * np.eye(2), np.eye(2)]), 0.01 * rng.standard_normal((n, 3, 2))
    blocks, drive, columns = (
        np.zeros((2 + idle, 2 + idle)),
        np.zeros((2, 2 + idle, 2 + idle)),
        np.zeros((n, 3, 2 + idle)),
    )
    # Beside states that nothing drives and that push on nothing.
    blocks[:2, :2], drive[:, :2, :2], columns[:, :, :2] = few
    K, spread = gains(np.ones(3), TRUE[[0, 0, 2]], 2, *few, h)
    many, alike = gains(np.ones(3), TRUE[[0, 0, 2]], 2, blocks, drive, columns, h)
    np.testing.assert_allclose(many[:, :, : K.shape[2]], K, rtol=1e-12)
    np.testing.assert_allclose(alike, spread, rtol=1e-12)
    assert not many[:, :, K.shape[2] :].any()


@pytest.mark.parametrize("integrals", [2, 1], ids=["positions", "velocities"])
def test_accelerations_sum_up_to_velocities_and_positions(integrals: int) -> None:
    gaps, h = np.random.default_rng(4).standard_normal((30, 2, 3)), 0.4
    velocity = np.cumsum(gaps, axis=0) * h
    expected = np.cumsum(velocity, axis=0) * h if integrals == 2 else velocity
    np.testing.assert_allclose(summed(gaps, integrals, h), expected, rtol=1e-12)


@pytest.mark.parametrize("integrals", [2, 1], ids=["positions", "velocities"])
def test_predictions_under_several_noises_are_those_of_each_alone(integrals: int) -> None:
    h, scale, runs = 0.4, np.array([0.7]), np.array([[0, 80], [80, 110]])
    gaps = 0.02 * np.random.default_rng(6).standard_normal((110, 1, 2))
    noises = np.stack([TRUE[0], TRUE[2], OTHER[1]])
    every = predictions_alone(scale, noises, integrals, h, gaps, runs)
    for k, row in enumerate(noises[:, None]):
        for a, b in runs.tolist():
            none, nothing = np.empty((0, 0)), np.empty((b - a, 1, 0))
            K, spread = gains(scale, row, integrals, none, np.empty((2, 0, 0)), nothing, h)
            left = errors(K, spread, row, integrals, none, nothing, h, summed(gaps[a:b], integrals, h))[:, 0]
            whitened, log_scales = (one[k, a:b] for one in every)
            assert np.ptp(left) > 1.0
            np.testing.assert_allclose(whitened[DIFFUSE:], left[DIFFUSE:], rtol=1e-7, atol=1e-9)
            np.testing.assert_allclose(log_scales[DIFFUSE:], np.log(spread[DIFFUSE:]) * [[1.0, 1.0]], rtol=1e-12)
            assert not whitened[:DIFFUSE].any()
            assert not log_scales[:DIFFUSE].any()


@pytest.mark.parametrize("placed", [True, False], ids=["positions", "velocities"])
def test_shared_disturbances_have_the_likelihood_of_their_dense_covariance(placed: bool) -> None:
    steps, plain = at_rest(26.0, placed)
    n, h, integrals = len(steps.starts), stride_s(steps), 2 if placed else 1
    t = plain.measurements.t
    rng = np.random.default_rng(1)
    gaps = 0.05 * rng.standard_normal((n, 3))
    # The channels of the filter are in the order of what was measured, whose scale says how vague a start is.
    measured = np.tile(rng.standard_normal((n, 3)), 2)
    steps = replace(steps, measured=measured)
    y = np.cumsum(gaps, axis=0) * h
    y = np.cumsum(y, axis=0) * h if placed else y
    force = np.column_stack([40.0 * np.cos(0.3 * t), 40.0 * np.sin(0.3 * t), 30.0 + 0.0 * t])
    steady = np.broadcast_to([0.0, 20.0, -30.0], (len(t), 3))

    def both(channels: Floats, processes: tuple[Process, ...]) -> tuple[float, float]:
        C = np.zeros((n, 3, n, 3))
        G = moved_by(n, integrals, h)
        for j in range(3):
            error, push = covariances(channels[j], n, h)
            C[:, j, :, j] = error + G @ push @ G.T
        lag = h * np.arange(n)
        weight = steps.weight / steps.weight.sum()
        for one in processes:
            rates = np.linalg.solve(FERRY.hull.M, one.force.T).T
            felt = np.array([weight @ rates[a : a + len(weight)] for a in steps.starts])
            shape = np.exp(-lag / one.time_constant_s) * np.cos(2.0 * np.pi * one.frequency_hz * lag)
            R = one.std**2 * toeplitz(shape)
            for i in range(3):
                for j in range(3):
                    C[:, i, :, j] += G @ (felt[:, i, None] * R * felt[:, j]) @ G.T
        return likelihood(NoiseModel(channels, processes, plain), steps, gaps), dense(
            y, C.reshape(3 * n, 3 * n), integrals
        )

    tried = [
        (TRUE, (Process(force, 1.0, 5.0), Process(steady, 2.0, 4.0, 0.3))),
        (TRUE, (Process(force, 3.0, 2.0), Process(steady, 1.0, 6.0, 0.2))),
        (TRUE, (Process(force, 0.5, 9.0),)),
        (OTHER, (Process(steady, 2.0, 4.0, 0.3),)),
        (OTHER, ()),
    ]
    filtered, known = np.array([both(*one) for one in tried]).T
    assert np.ptp(known) > 10.0
    np.testing.assert_allclose(filtered - filtered[0], known - known[0], atol=2e-3)


def drawn(steps: Windows, channels: Floats, rng: np.random.Generator) -> Floats:
    """Draw gaps of an unbroken series that have the noise of these channels, shape (n, c)."""
    n, h = len(steps.starts), stride_s(steps)
    gaps = np.empty((n, len(channels)))
    for j, row in enumerate(channels):
        error, push = covariances(row, n + 2, h)
        little = 1e-10 * np.eye(n + 2)
        wrong = np.linalg.cholesky(error) @ rng.standard_normal(n + 2)
        pushed = np.linalg.cholesky(push + row[3] ** 2 * little) @ rng.standard_normal(n + 2)
        gaps[:, j] = np.diff(wrong + moved_by(n + 2, 2, h) @ pushed, 2) / h**2
    return gaps


@pytest.fixture(scope="module")
def noisy() -> tuple[Windows, Floats]:
    steps, _ = at_rest(640.0)
    gaps = drawn(steps, TRUE, np.random.default_rng(4))
    return replace(steps, measured=np.tile(gaps, 2)), gaps


@pytest.mark.slow
def test_matching_noise_is_whitened(noisy: tuple[Windows, Floats]) -> None:
    steps, gaps = noisy
    white = make_whitening_filter(NoiseModel(TRUE), steps).white(gaps).reshape(gaps.shape)
    assert (white[:DIFFUSE] == 0.0).all()
    left = white[DIFFUSE:]
    n = len(left)
    np.testing.assert_allclose(np.mean(left**2, axis=0), 1.0, atol=4.0 * np.sqrt(2.0 / n))
    for lag in range(1, 21):
        assert np.abs(np.mean(left[lag:] * left[:-lag], axis=0)).max() < 4.0 / np.sqrt(n)
    assert np.abs(np.corrcoef(left.T)[np.triu_indices(3, 1)]).max() < 4.0 / np.sqrt(n)
    columns = make_whitening_filter(NoiseModel(TRUE), steps).white(np.stack([gaps, -2.0 * gaps], axis=2))
    np.testing.assert_allclose(columns, white.reshape(-1, 1) * [1.0, -2.0], rtol=1e-9, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("wrong", [None, 3.0, -3.0], ids=["no start", "start too large", "start too small"])
def test_noise_is_learnt(noisy: tuple[Windows, Floats], wrong: float | None) -> None:
    steps, gaps = noisy
    near = None if wrong is None else NoiseModel(TRUE * np.exp(wrong * np.array([1.0, -1.0, 0.3, 1.0, -0.5])))
    learnt = fit_noise(steps, gaps, near)
    # The likelihood cannot be less than at the truth, and is more by half a chi square of as many degrees as parameters.
    more = 2.0 * (likelihood(learnt, steps, gaps) - likelihood(NoiseModel(TRUE), steps, gaps))
    assert -0.1 < more < chi2(10).ppf(0.999)
    np.testing.assert_allclose(learnt.channels[0], learnt.channels[1])
    # White and coloured error, and the disturbance's strength; of how long it lasts 80 time constants tell less.
    np.testing.assert_allclose(learnt.channels[:, :4], TRUE[:, :4], rtol=0.3)
    assert np.abs(np.log(learnt.channels[:, 4] / TRUE[:, 4])).max() < np.log(2.0)


def test_a_break_of_a_run_starts_the_filter_anew() -> None:
    usable = np.ones(500, dtype=bool)
    usable[260:270] = False
    steps, plain = at_rest(100.0, usable=usable)
    assert len(steps.runs) == 2
    gaps = np.random.default_rng(5).standard_normal((len(steps.starts), 3))
    steps = replace(steps, measured=np.tile(gaps, 2))
    shared = Process(np.broadcast_to([0.0, 20.0, -30.0], (len(plain.measurements.t), 3)), 2.0, 4.0, 0.3)
    for noise in (NoiseModel(TRUE), NoiseModel(TRUE, (shared,), plain)):
        together = make_whitening_filter(noise, steps).white(gaps).reshape(-1, 3)
        changed = gaps.copy()
        end = steps.runs[0][1]
        changed[:end] += 5.0
        again = make_whitening_filter(noise, steps).white(changed).reshape(-1, 3)
        np.testing.assert_array_equal(again[end:], together[end:])
        assert (together[end : end + DIFFUSE] == 0.0).all()
        # The second run by itself, on the same scale, is what it is beside the first.
        mirrored = replace(
            steps, starts=steps.starts[end:], runs=((0, len(gaps) - end),), measured=steps.measured[end:]
        )
        alone = make_whitening_filter(noise, mirrored).white(gaps[end:]).reshape(-1, 3)
        np.testing.assert_allclose(alone, together[end:], rtol=1e-3, atol=1e-3)


def marked(seconds: float, *breaks: float) -> Windows:
    """Return steps with breaks of 10 s from these seconds on; what was measured in a step is its time."""
    t = np.arange(0.0, seconds, STEP_S)
    usable = np.ones(len(t), dtype=bool)
    for start in breaks:
        usable &= (t < start) | (t > start + 10.0)
    steps, _ = at_rest(seconds, usable=usable)
    return replace(steps, measured=np.tile(steps.middle_s[:, None], 6))


def test_a_short_log_is_its_own_excerpt() -> None:
    steps = marked(1430.0, 200.0)
    assert INFERENCE.noise_steps - 100 < len(steps.starts) <= INFERENCE.noise_steps
    assert excerpt(steps) is steps


@pytest.mark.parametrize(
    ("seconds", "breaks"),
    [
        (1480.0, ()),
        (3000.0, ()),
        (3000.0, (400.0, 470.0, 1500.0, 2500.0)),
    ],
    ids=["hardly too long", "unbroken", "broken"],
)
def test_an_excerpt_of_a_long_log_is_spread_evenly_and_crosses_no_break(
    seconds: float, breaks: tuple[float, ...]
) -> None:
    steps = marked(seconds, *breaks)
    n, stride = len(steps.starts), int(steps.starts[1] - steps.starts[0])
    assert n > INFERENCE.noise_steps
    assert len(steps.runs) == len(breaks) + 1
    part = excerpt(steps)
    assert len(part.starts) == INFERENCE.noise_steps
    np.testing.assert_array_equal(part.measured[:, 0], part.middle_s)
    assert set(part.starts.tolist()) <= set(steps.starts.tolist())
    assert (np.diff(part.starts) > 0).all()
    # The runs follow each other, each goes on without a step left out, and none has a break within.
    ends = [0, *(end for _, end in part.runs)]
    assert [first for first, _ in part.runs] == ends[:-1]
    assert ends[-1] == len(part.starts) == len(part.measured)
    for first, end in part.runs:
        assert end - first > DIFFUSE
        assert (np.diff(part.starts[first:end]) == stride).all()
        assert part.measurements.usable[part.starts[first] : part.starts[end - 1] + len(part.weight)].all()
    # An equal part of the excerpt in the middle of each part of the log, by count.
    where = np.searchsorted(steps.starts, part.starts)
    for k, one in enumerate(np.array_split(where, INFERENCE.noise_stretches)):
        assert np.mean(one) == pytest.approx((k + 0.5) * n / INFERENCE.noise_stretches, abs=0.01 * n)


@pytest.mark.parametrize("sliver", range(5))
def test_what_only_starts_a_filter_is_left_out_of_an_excerpt(sliver: int) -> None:
    longer = marked(3002.0)
    n = len(longer.starts) - 5
    first = int(n / (2 * INFERENCE.noise_stretches)) - INFERENCE.noise_steps // INFERENCE.noise_stretches // 2
    # The first piece begins so many steps before a break.
    kept = np.delete(np.arange(n + 5), np.arange(first + sliver, first + sliver + 5))
    runs = ((0, first + sliver), (first + sliver, n))
    part = excerpt(replace(longer, starts=longer.starts[kept], measured=longer.measured[kept], runs=runs))
    assert len(part.starts) == INFERENCE.noise_steps - (sliver if sliver <= DIFFUSE else 0)
    assert len(part.runs) == INFERENCE.noise_stretches + (sliver > DIFFUSE)
    np.testing.assert_array_equal(part.measured[:, 0], part.middle_s)


def test_an_excerpt_is_filtered_as_its_runs_are() -> None:
    steps = marked(3000.0, 400.0, 1500.0)
    gaps = np.random.default_rng(7).standard_normal((len(steps.starts), 3))
    steps = replace(steps, measured=np.tile(gaps, 2))
    part = excerpt(steps)
    left = make_whitening_filter(NoiseModel(TRUE), part).white(part.measured[:, :3]).reshape(-1, 3)
    for first, end in part.runs:
        a = int(np.searchsorted(steps.starts, part.starts[first]))
        alone = replace(
            steps,
            starts=steps.starts[a : a + end - first],
            measured=steps.measured[a : a + end - first],
            runs=((0, end - first),),
        )
        np.testing.assert_allclose(
            left[first:end],
            make_whitening_filter(NoiseModel(TRUE), alone).white(gaps[a : a + end - first]).reshape(-1, 3),
            rtol=1e-3,
            atol=1e-3,
        )


HESSIAN = np.array([[9.0, 2.0, -1.0], [2.0, 40.0, 23.0], [-1.0, 23.0, 16.0]])
PEAK = np.array([0.3, -1.2, 0.7])


def test_widths_are_the_marginal_standard_deviations_of_a_normal_density() -> None:
    def cost(z: Floats) -> float:
        return 4.0 + 0.5 * float((z - PEAK) @ HESSIAN @ (z - PEAK))

    # The first is not asked for, and stays as it is.
    known = np.sqrt(np.diag(np.linalg.inv(HESSIAN[1:, 1:])))
    np.testing.assert_allclose(_widths(cost, PEAK, 2, 4.0), known, rtol=1e-6)
    assert (known > 2.0 / np.sqrt(np.diag(HESSIAN)[1:])).all()
    np.testing.assert_allclose(_widths(cost, PEAK, 3, 4.0), np.sqrt(np.diag(np.linalg.inv(HESSIAN))), rtol=1e-6)
    np.testing.assert_allclose(_widths(cost, PEAK, 1, 4.0), 0.25, rtol=1e-6)


def test_widths_are_infinite_along_what_a_cost_does_not_depend_on() -> None:
    rest = HESSIAN[np.ix_([0, 2], [0, 2])]

    def flat(z: Floats) -> float:
        return 4.0 + 0.5 * float((z - PEAK)[[0, 2]] @ rest @ (z - PEAK)[[0, 2]])

    known = np.sqrt(np.diag(np.linalg.inv(rest)))
    np.testing.assert_allclose(_widths(flat, PEAK, 3, 4.0), [known[0], np.inf, known[1]], rtol=1e-6)
    # Nor does the edge of a cliff tell anything.
    falling = _widths(lambda z: flat(z) - 0.5 * float(z[1] - PEAK[1]) ** 2, PEAK, 3, 4.0)
    np.testing.assert_allclose(falling, [known[0], np.inf, known[1]], rtol=1e-6)


LAG_S, PERIOD_S, SECONDS, SEEDS = 0.5, 0.05, 500.0, 40
MASS = 2000.0


def looped(tick_s: float) -> tuple[Floats, Floats, Floats]:
    """Simulate a mass under a PD controller that answers to what it measures, under a disturbance: t, position, force.

    The force follows the command with a lag and is recorded exactly; position and force have shape (n, SEEDS, 2), for north
    and east.
    """
    rng = np.random.default_rng(6)
    shape = (SEEDS, 2)
    fade, keep, often = np.exp(-PERIOD_S / 4.0), np.exp(-PERIOD_S / LAG_S), round(STEP_S / PERIOD_S)
    steps, error_s = round(SECONDS / PERIOD_S), 0.6
    x, v, F, command, d, wrong, rate, last = np.zeros((8, *shape))
    seen, force = np.empty((2, steps // often, *shape))
    for k in range(steps):
        kick = rng.standard_normal((2, *shape))
        if k % often == 0:
            measured = x + wrong + 0.004 * rng.standard_normal(shape)
            seen[k // often], force[k // often] = measured, F
            if k % round(tick_s / PERIOD_S) == 0:
                goal = 0.4 * np.sin(0.11 * k * PERIOD_S) + 0.3 * np.sin(0.047 * k * PERIOD_S)
                command = MASS * (-0.35 * (measured - goal) - 0.9 * (measured - last) / tick_s)
                last = measured
        new = command + (F - command) * keep
        a = 0.5 * (F + new) / MASS + d
        x, v, F = x + PERIOD_S * v + 0.5 * PERIOD_S**2 * a, v + PERIOD_S * a, new
        d = fade * d + np.sqrt(1.0 - fade**2) * 0.02 * kick[0]
        # A critically damped error of the measurement with a standard deviation of 5 mm.
        rate = rate + PERIOD_S * (-2.0 / error_s * rate - wrong / error_s**2)
        rate = rate + 2.0 * 0.005 / error_s**1.5 * np.sqrt(PERIOD_S) * kick[1]
        wrong = wrong + PERIOD_S * rate
    return STEP_S * np.arange(len(seen)), seen, force


def late(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
    """Scale the force of the first thruster, and let it be late."""
    t = force_model.measurements.t
    parts = force_model.parts.copy()
    for j in range(2):
        parts[:, 0, j] = p[0] * np.interp(t - p[1], t, force_model.parts[:, 0, j])
    return replace(force_model, parts=parts)


LATE = Candidate(
    Effect("late", "Late", lambda profile: (), late, lambda v, i: "", lambda v, i: {}),
    None,
    (Parameter("factor", "1", 1.0, 0.0, 5.0, 1.0), Parameter("delay", "s", 1.0, -2.0, 2.0)),
)


KNOWN = np.array([[0.004, 0.005, 0.6, 0.02, 4.0], [0.004, 0.005, 0.6, 0.02, 4.0], [1e-6, 1e-7, 1.0, 1e-9, 1.0]])


def trials(seen: Floats, force: Floats, t: Floats) -> list[tuple[EstimationProblem, ForceModel]]:
    """Return a trial for every seed, with the noise that there is, and its force model without effects."""
    hull = np.zeros(len(COEFFICIENTS))
    hull[[0, 1, 4]] = MASS
    zero = np.zeros((len(t), 3))
    made = []
    for k in range(SEEDS):
        eta, parts = zero.copy(), np.zeros((len(t), 2, 3))
        eta[:, :2], parts[:, 0, :2] = seen[:, k], force[:, k]
        eta[:, 2] = 1e-6 * np.random.default_rng(k).standard_normal(len(t))
        measurements = Measurements(
            FERRY, t, eta, zero, zero, parts, np.zeros((len(t), 2)), np.ones(len(t), dtype=bool)
        )
        cut = windows(measurements, 8.0, 2.0)
        plain = ForceModel(
            cut.measurements, hull, cut.measurements.parts, cut.measurements.angles, zero[: len(cut.measurements.t)]
        )
        held = np.where(np.arange(len(COEFFICIENTS)) == 0, 1e-9, 0.0)
        blank = AutoregressiveNoise(np.zeros((3, ORDER)), np.eye(3))
        made.append((EstimationProblem(cut, plain, blank, held, NoiseModel(KNOWN)), plain))
    return made


@pytest.mark.slow
def test_a_closed_loop_does_not_bias_what_prediction_errors_estimate() -> None:
    # The controller answers as often as the filter looks: every 0.4 s, the steps of windows of 8 s.
    t, seen, force = looped(0.4)
    told, spread, naive = [], [], []
    for k, (problem, _) in enumerate(trials(seen, force, t)):
        made = fit(problem, [LATE], [np.array([0.7, 0.4])])
        told.append(made.values[0])
        spread.append(made.errors(0))
        # Least squares on the very same steps, with the force and its rate as regressors.
        steps = problem.steps
        felt = [steps.mean(one).ravel() / MASS for one in (force[:, k], np.gradient(force[:, k], STEP_S, axis=0))]
        factor, slope = np.linalg.lstsq(np.column_stack(felt), steps.measured[:, :2].ravel())[0]
        naive.append([factor, -slope / factor])
    values, least, error = np.array(told), np.array(naive), np.mean(spread, axis=0)
    assert np.abs((values.mean(axis=0) - [1.0, 0.0]) / (error / np.sqrt(SEEDS))).max() < 3.5
    # Its own account of its errors is right, too.
    ratio = values.std(axis=0, ddof=1) / error
    assert np.abs(ratio - 1.0).max() < 4.0 / np.sqrt(2.0 * SEEDS)
    wrong = (least.mean(axis=0) - [1.0, 0.0]) / (least.std(axis=0, ddof=1) / np.sqrt(SEEDS))
    assert np.abs(wrong).max() > 10.0


@pytest.mark.slow
def test_a_fit_and_its_noise_learnt_in_turn_come_to_the_truth() -> None:
    t, seen, force = looped(0.4)
    for problem, plain in trials(seen, force, t)[:1]:
        wrong = late(plain, np.array([0.7, 0.4]), None)
        problem = replace(problem, filter=fit_noise(problem.steps, problem.steps.gap(wrong)))
        for _ in range(25):
            made = fit(problem, [LATE])
            problem = problem.with_noise_of(made)
        # What is not known of the noise is no part of the errors, so that these are somewhat small.
        assert (np.abs(made.values[0] - [1.0, 0.0]) < 5.0 * made.errors(0)).all()


@pytest.mark.slow
@pytest.mark.parametrize("time_constant_s", [0.05, 0.5, 4.0])
def test_the_thrusters_lag_is_that_of_its_equation(time_constant_s: float) -> None:
    t = np.arange(0.0, 20.0, STEP_S)
    along = np.random.default_rng(8).standard_normal(len(t)) * 50.0
    zero = np.zeros((len(t), 3))
    angles = np.column_stack([0.3 * t, np.full(len(t), -0.4)])
    parts = np.zeros((len(t), 2, 3))
    for k in range(2):
        x, y = FERRY.actuators[k].position_m
        parts[:, k, 0], parts[:, k, 1] = along * np.cos(angles[:, k]), along * np.sin(angles[:, k])
        parts[:, k, 2] = x * parts[:, k, 1] - y * parts[:, k, 0]
    measurements = Measurements(FERRY, t, zero, zero, zero, parts, angles, np.ones(len(t), dtype=bool))
    plain = ForceModel(measurements, hull_of(FERRY), parts, angles, zero)
    after = effects()["thruster_lag"].apply(plain, np.array([time_constant_s]), None)

    def rate(now: float, force: np.ndarray) -> np.ndarray:
        return (np.interp(now, t, along) - force) / time_constant_s

    exact = [along[:1]]
    for k in range(len(t) - 1):
        exact.append(solve_ivp(rate, (t[k], t[k + 1]), exact[-1], rtol=1e-9, atol=1e-9).y[:, -1])
    felt = np.concatenate(exact)
    for k in range(2):
        x, y = FERRY.actuators[k].position_m
        c, s = np.cos(angles[:, k]), np.sin(angles[:, k])
        wanted = np.column_stack([felt * c, felt * s, felt * (x * s - y * c)])
        np.testing.assert_allclose(after.parts[:, k], wanted, atol=1e-4)
