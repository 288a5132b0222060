"""Smoothing: frequency response, polynomials, noise gain and gaps, each against theory."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import linalg, signal

from ferryid.errors import FerryIdError
from ferryid.signals.complementary_filter import CUBIC_S
from ferryid.signals.kalman import WINDOW_PER_TIME, fit_levels, smooth_run, steady_state
from ferryid.signals.smooth import (
    central_difference,
    correlate,
    local_polynomial,
    measure,
    moving_mean,
    odd_rows,
    smooth_measured,
    steady_cubic,
    steady_mean,
)
from ferryid.signals.track import Motion, Track
from ferryid.vessel import load_profile

Floats = NDArray[np.float64]

PROFILE = load_profile("milliampere")
RATE = 20.0
SMOOTHERS = ("square", "savgol", "kalman")


def smoothed(track: Track, window_s: float, smoother: str = "square") -> Motion:
    return smooth_measured(measure(track, PROFILE), window_s, smoother)


def trial(n: int = 2400, **changes: Floats) -> Track:
    t = np.arange(n) / RATE
    columns = {
        "x": t,
        "y": 0.5 * t,
        "psi": 0.1 * t,
        "u": 0.5 + 0.2 * np.sin(0.3 * t),
        "v": 0.1 * np.cos(0.2 * t),
        "r": 0.1 * np.sin(0.15 * t),
        "n_thruster1": 400 + 100 * np.sin(0.1 * t),
        "alpha_thruster1": 0.3 * np.sin(0.2 * t),
        "n_thruster2": 300 + 0 * t,
        "alpha_thruster2": 0.2 + 0 * t,
        **changes,
    }
    valid = np.all([np.isfinite(columns[name]) for name in ("u", "v", "r", "n_thruster1")], axis=0)
    return Track("trial", t, 0, RATE, columns, valid, ("aligned",))


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(
    n=st.integers(1, 300),
    half=st.integers(0, 30),
    columns=st.integers(1, 3),
    holes=st.lists(st.integers(0, 299), max_size=5),
    seed=st.integers(0, 2**32 - 1),
)
def test_the_moving_mean_is_the_mean_of_each_window(
    n: int, half: int, columns: int, holes: list[int], seed: int
) -> None:
    values = np.random.default_rng(seed).normal(size=(n, columns))
    for hole in holes:
        values[hole % n, 0] = np.nan
    kept = values.copy()
    expected = np.full_like(values, np.nan)
    for i in range(half, n - half):
        expected[i] = values[i - half : i + half + 1].mean(axis=0)
    np.testing.assert_allclose(moving_mean(values, 2 * half + 1), expected, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(values, kept)


def test_no_digits_are_lost_on_a_long_log_with_a_large_offset() -> None:
    n, rows, offset = 400_000, 21, 1e7
    values = offset + np.random.default_rng(0).normal(size=n)
    exact = np.mean(np.lib.stride_tricks.sliding_window_view(values - offset, rows), axis=1)
    ours = moving_mean(values[:, None], rows)[rows // 2 : -(rows // 2), 0] - offset
    total = np.concatenate([[0.0], np.cumsum(values)])
    plain = (total[rows:] - total[:-rows]) / rows - offset
    # The samples themselves are rounded to 1e-9 at this offset. A plain cumulative sum loses 4 more digits.
    assert np.abs(ours - exact).max() < 1e-8
    assert np.abs(plain - exact).max() > 1e-6


def test_the_window_is_rounded_to_an_odd_number_of_rows_and_told() -> None:
    assert [odd_rows(w, 20.0) for w in (0.0, 0.05, 0.1, 0.25, 0.5, 1.0, 1.05, 1.5)] == [1, 1, 3, 5, 11, 21, 21, 31]
    said = smoothed(trial(), 1.0).repairs[-1]
    assert (
        said == "Smoothing: square window of 21 rows, 1.05 s at 20 Hz (asked for 1 s; the number of rows must be odd)."
    )
    assert smoothed(trial(), 0.0).repairs[-1] == "Smoothing: none (window 0)."


def response(smoother: str, window_s: float, hertz: float) -> tuple[complex, complex]:
    """Return gain and phase of value and slope of the surge velocity at one frequency, over the input's."""
    t = np.arange(2400) / RATE
    wave = np.exp(2j * np.pi * hertz * t)
    answers = []
    for part in (wave.real, wave.imag):
        motion = smoothed(trial(u=part), window_s, smoother)
        answers.append((motion.nu[1200, 0], motion.nu_dot[1200, 0]))
    value, slope = (a + 1j * b for a, b in zip(*answers, strict=True))
    return value / wave[1200], slope / (2j * np.pi * hertz * wave[1200])


@pytest.mark.parametrize("hertz", [0.05, 0.3, 0.9, 1.7, 4.0])
def test_the_square_window_has_the_response_of_a_moving_average(hertz: float) -> None:
    rows = 21
    sinc = np.sin(np.pi * hertz * rows / RATE) / (rows * np.sin(np.pi * hertz / RATE))
    central = np.sin(2 * np.pi * hertz / RATE) / (2 * np.pi * hertz / RATE)
    value, slope = response("square", 1.0, hertz)
    assert value == pytest.approx(sinc, abs=1e-9)
    assert slope == pytest.approx(sinc * central, abs=1e-9)


@pytest.mark.parametrize(("rows", "degree"), [(5, 3), (21, 3), (31, 3), (101, 2)])
def test_savitzky_golay_weights_are_scipys(rows: int, degree: int) -> None:
    value, slope = local_polynomial(rows, degree)
    np.testing.assert_allclose(value, signal.savgol_coeffs(rows, degree, use="dot"), atol=1e-13)
    np.testing.assert_allclose(slope, signal.savgol_coeffs(rows, degree, deriv=1, use="dot"), atol=1e-13)


def test_correlation_is_scipys_filter() -> None:
    values = np.random.default_rng(0).normal(size=(200, 2))
    value, _ = local_polynomial(11, 3)
    ours = correlate(values, value)
    np.testing.assert_allclose(ours[5:-5], signal.savgol_filter(values, 11, 3, axis=0)[5:-5], atol=1e-13)
    assert np.isnan(ours[:5]).all()
    assert np.isnan(ours[-5:]).all()


def test_the_steady_cubic_keeps_quick_motion_that_a_mean_of_the_same_noise_takes() -> None:
    rows, mean_rows = odd_rows(CUBIC_S, RATE), odd_rows(1.0, RATE)
    noise = np.random.default_rng(4).normal(size=(20_000, 1))
    assert np.std(steady_cubic(noise, rows)) == pytest.approx(np.std(steady_mean(noise, mean_rows)), rel=0.05)
    wave = np.sin(2.0 * np.pi * 0.2 * np.arange(2400) / RATE)[:, None]
    inner = slice(200, -200)
    cubic, mean = (
        float(np.std(one[inner]) / np.std(wave[inner]))
        for one in (steady_cubic(wave, rows), steady_mean(wave, mean_rows))
    )
    # By hand: sinc(f T) of the mean, 1 - (pi f T)^4 / 280 + ... of the cubic.
    assert mean == pytest.approx(np.sinc(0.2), abs=0.01)
    assert cubic == pytest.approx(1.0 - (np.pi * 0.2 * CUBIC_S) ** 4 / 280.0, abs=0.003)


def test_the_steady_cubic_keeps_cubics_and_loses_no_row() -> None:
    t = np.linspace(-1.0, 1.0, 301)
    values = np.column_stack([t**3 - t, 2.0 * t + 3.0])
    smooth = steady_cubic(values, 41)
    np.testing.assert_allclose(smooth[20:-20], values[20:-20], atol=1e-12)
    # A line goes on beyond both ends.
    np.testing.assert_allclose(smooth[:, 1], values[:, 1], atol=1e-12)
    np.testing.assert_array_equal(steady_cubic(values[:2], 41), values[:2])
    np.testing.assert_array_equal(steady_cubic(values, 3), values)


@pytest.mark.parametrize("smoother", SMOOTHERS)
def test_zero_phase(smoother: str) -> None:
    value, slope = response(smoother, 1.0, 0.2)
    assert abs(value.imag) < 1e-6
    assert abs(slope.imag) < 1e-6


@pytest.mark.parametrize(("smoother", "degree"), [("square", 1), ("savgol", 3), ("kalman", 1)])
def test_polynomials_pass_unchanged(smoother: str, degree: int) -> None:
    t = np.arange(2400) / RATE - 60.0
    u = np.polynomial.polynomial.polyval(t / 60, np.arange(1.0, degree + 2))
    slope = np.polynomial.polynomial.polyval(t / 60, np.polynomial.polynomial.polyder(np.arange(1.0, degree + 2))) / 60
    motion = smoothed(trial(u=u), 1.0, smoother)
    np.testing.assert_allclose(motion.nu[motion.valid, 0], u[motion.valid], rtol=0, atol=1e-10)
    np.testing.assert_allclose(motion.nu_dot[motion.valid, 0], slope[motion.valid], rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("smoother", "gain", "slope_gain"),
    [
        ("square", 1 / 21, 2 / (2 * 21 / RATE) ** 2),
        ("savgol", float(np.sum(signal.savgol_coeffs(21, 3) ** 2)), None),
    ],
)
def test_white_noise_is_reduced_as_theory_says(smoother: str, gain: float, slope_gain: float | None) -> None:
    noise = np.random.default_rng(5).normal(size=60_000)
    motion = smoothed(trial(60_000, u=noise), 1.0, smoother)
    assert np.var(motion.nu[motion.valid, 0]) == pytest.approx(gain, rel=0.1)
    if slope_gain is not None:
        # Two averages that are two rows apart share all but two samples at either end: four samples remain.
        assert np.var(motion.nu_dot[motion.valid, 0]) == pytest.approx(2 * slope_gain, rel=0.1)


@pytest.mark.parametrize("smoother", SMOOTHERS)
@pytest.mark.parametrize("window_s", [0.0, 0.25, 1.0])
def test_rows_whose_window_meets_a_gap_are_not_valid(smoother: str, window_s: float) -> None:
    track = trial()
    u = track.columns["u"].copy()
    u[1000:1040] = np.nan
    motion = smoothed(trial(u=u), window_s, smoother)
    half = odd_rows(window_s, RATE) // 2
    assert not motion.valid[1000 - half : 1040 + half].any()
    assert not motion.valid[:half].any()
    assert motion.valid[100:900].all()
    for values in (motion.nu, motion.nu_dot, motion.tau, motion.eta):
        assert np.isfinite(values[motion.valid]).all()
    # Far from the gap, nothing of it is felt.
    untouched = smoothed(track, window_s, smoother)
    if smoother != "kalman":
        np.testing.assert_array_equal(motion.nu[motion.valid], untouched.nu[motion.valid])


@pytest.mark.parametrize("smoother", SMOOTHERS)
def test_force_and_motion_pass_through_the_same_filter(smoother: str) -> None:
    track = trial()
    measured = measure(track, PROFILE)
    # Noise of another size in each axis, so that each has a Kalman smoother of its own.
    nu = measured.nu + np.random.default_rng(0).normal(0, [0.1, 0.02, 0.002], measured.nu.shape)
    same = replace(measured, nu=nu, tau=nu.copy(), tau_d=nu.copy())
    motion = smooth_measured(same, 0.25, smoother)
    assert motion.tau_d is not None
    np.testing.assert_allclose(motion.tau, motion.nu, atol=1e-12)
    np.testing.assert_allclose(motion.tau_d, motion.nu, atol=1e-12)


def test_the_force_is_that_of_the_unsmoothed_actuators() -> None:
    motion = smoothed(trial(), 0.0)
    n = trial().columns["n_thruster1"]
    n2 = trial().columns["n_thruster2"]

    def curve(rpm: Floats) -> Floats:
        # (4.1), written out.
        return (
            2.39675290e-2 * rpm
            + 2.13524953e-4 * rpm**2
            + 7.69329924e-7 * rpm**3
            - 1.08151233e-10 * rpm**4
            - 4.09699444e-13 * rpm**5
        )

    a1, a2 = trial().columns["alpha_thruster1"], trial().columns["alpha_thruster2"]
    inside = motion.valid
    np.testing.assert_allclose(motion.tau[inside, 0], (curve(n) * np.cos(a1) + curve(n2) * np.cos(a2))[inside])
    np.testing.assert_allclose(motion.tau[inside, 2], 1.8 * (curve(n) * np.sin(a1) - curve(n2) * np.sin(a2))[inside])


def rauch_tung_striebel(values: Floats, time_rows: float) -> Floats:
    """The textbook recursion: Kalman filter forwards from a diffuse start, smoother backwards."""
    F, H = np.array([[1.0, 1.0], [0.0, 1.0]]), np.array([[1.0, 0.0]])
    Q = np.array([[1 / 3, 1 / 2], [1 / 2, 1.0]]) / time_rows**4
    x, P = np.zeros(2), np.eye(2) * 1e7
    predicted, filtered = [], []
    for z in values:
        predicted.append((x, P))
        K = P @ H.T / (H @ P @ H.T + 1.0)
        x, P = x + K[:, 0] * (z - x[0]), (np.eye(2) - K @ H) @ P
        filtered.append((x, P))
        x, P = F @ x, F @ P @ F.T + Q
    states = [filtered[-1][0]]
    for k in range(len(values) - 2, -1, -1):
        (m, C), (m_next, P_next) = filtered[k], predicted[k + 1]
        G = C @ F.T @ np.linalg.inv(P_next)
        states.append(m + G @ (states[-1] - m_next))
    return np.array(states[::-1]).T


@pytest.mark.parametrize("time_rows", [0.5, 3.0, 12.0])
def test_the_banded_kalman_smoother_is_the_rauch_tung_striebel_recursion(time_rows: float) -> None:
    values = np.cumsum(np.cumsum(np.random.default_rng(2).normal(size=150))) * 0.01
    np.testing.assert_allclose(smooth_run(values, time_rows), rauch_tung_striebel(values, time_rows), atol=2e-5)


def test_the_kalman_smoother_has_the_response_it_states() -> None:
    time_rows, n = 8.0, 4001
    impulse = np.zeros(n)
    impulse[n // 2] = 1.0
    answer = np.fft.rfft(np.fft.ifftshift(smooth_run(impulse, time_rows)[0])).real
    w = 2 * np.pi * np.fft.rfftfreq(n)
    low = w < 0.5
    np.testing.assert_allclose(answer[low], 1 / (1 + (w[low] * time_rows) ** 4), atol=5e-3)
    # As much white noise passes as through a moving average of the equivalent window.
    assert np.sum(smooth_run(impulse, time_rows)[0] ** 2) == pytest.approx(1 / (WINDOW_PER_TIME * time_rows), rel=0.01)


@pytest.mark.slow
def test_maximum_likelihood_finds_the_noise_of_a_simulated_walk() -> None:
    rng = np.random.default_rng(11)
    n, dt, noise, jerk = 40_000, 1 / RATE, np.array([0.05, 0.02, 0.003]), np.array([1e-4, 4e-4, 1e-6])
    half = np.linalg.cholesky(np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]]))
    nu = np.empty((n, 3))
    for i in range(3):
        steps = np.sqrt(jerk[i]) * rng.normal(size=(n, 2)) @ half.T
        acceleration = np.concatenate([[0.0], np.cumsum(steps[:-1, 1])])
        velocity = np.concatenate([[0.0], np.cumsum(acceleration[:-1] * dt + steps[:-1, 0])])
        nu[:, i] = velocity + rng.normal(0, noise[i], n)
    levels = fit_levels(nu, [slice(0, n)], RATE, 0.0)
    np.testing.assert_allclose([level.noise for level in levels], noise, rtol=0.03)
    np.testing.assert_allclose([level.jerk for level in levels], jerk, rtol=0.35)


def test_the_kalman_window_is_never_below_the_one_asked_for() -> None:
    rng = np.random.default_rng(4)
    # Slow noise as of a navigation filter: likelihood alone takes it for motion.
    slow = signal.lfilter([0.05], [1, -0.95], rng.normal(0, 0.2, (3, 4000)), axis=1).T
    assert all(level.window_s >= 2.0 - 1e-9 for level in fit_levels(slow, [slice(0, 4000)], RATE, 2.0))


def test_too_short_a_log_and_unknown_smoothers_are_refused() -> None:
    with pytest.raises(FerryIdError, match=r"trial: log shorter than the smoothing window, found 0\.90 s .*Fix: "):
        smoothed(trial(18), 1.0)
    gappy = trial(400)
    with pytest.raises(
        FerryIdError, match=r"as long as the smoothing window, found 0\.\d+ s unbroken of 20\.00 s .* inspect"
    ):
        smoothed(replace(gappy, valid=np.arange(400) % 10 > 0), 1.0)
    with pytest.raises(FerryIdError, match=r'no smoother called "sqare". Did you mean "square"\?'):
        smoothed(trial(), 1.0, "sqare")


def test_a_constant_velocity_is_refused() -> None:
    with pytest.raises(FerryIdError, match=r"trial: constant signal u.*Fix: "):
        smoothed(trial(u=np.full(2400, 0.5)), 1.0)


def test_wind_that_is_mostly_missing_is_left_out_and_short_losses_cost_their_rows() -> None:
    north = np.full(2400, 3.0)
    north[100:150] = np.nan
    east = np.ones(2400)
    motion = smoothed(trial(wind_N=north, wind_E=east), 1.0)
    assert motion.wind is not None
    assert not motion.valid[95:155].any()
    assert any("50 rows (2.5 s) are not used: the wind was not measured." in said for said in motion.repairs)
    north[:2000] = np.nan
    motion = smoothed(trial(wind_N=north, wind_E=east), 1.0)
    assert motion.wind is None
    assert any("The wind was measured on 17 % of the rows only and is left out." in said for said in motion.repairs)


def test_a_heading_that_few_rows_have_is_left_out_and_the_wind_with_it() -> None:
    psi = np.zeros(2400)
    flows = {"wind_N": np.full(2400, 3.0), "wind_E": np.ones(2400)}
    psi[:1200] = np.nan
    motion = smoothed(trial(psi=psi, **flows), 1.0)
    assert np.isnan(motion.eta[:, 2]).all()
    assert motion.wind is None
    told = "The heading was measured on 50 % of the rows only and is left out, and wind with it."
    assert told in motion.repairs
    # The rows keep their velocities and forces.
    assert motion.valid.mean() > 0.9
    psi[100:] = 0.0
    motion = smoothed(trial(psi=psi, **flows), 1.0)
    assert motion.wind is not None
    assert not any("heading was measured" in said for said in motion.repairs)


def test_the_central_difference_is_exact_on_parabolas() -> None:
    t = np.arange(50) / RATE
    slope = central_difference((3.0 + 2.0 * t - 4.0 * t**2)[:, None], RATE)[:, 0]
    np.testing.assert_allclose(slope[1:-1], (2.0 - 8.0 * t)[1:-1], atol=1e-12)
    assert np.isnan(slope[[0, -1]]).all()


@pytest.mark.parametrize("time_rows", [0.3, 1.0, 5.0, 40.0, 300.0])
def test_the_steady_state_filter_is_the_riccati_equations(time_rows: float) -> None:
    F, H = np.array([[1.0, 1.0], [0.0, 1.0]]), np.array([[1.0, 0.0]])
    Q = np.array([[1 / 3, 1 / 2], [1 / 2, 1.0]]) / time_rows**4
    P = linalg.solve_discrete_are(F.T, H.T, Q, np.eye(1))
    variance = P[0, 0] + 1.0
    closed = np.linalg.eigvals(F @ (np.eye(2) - P @ H.T @ H / variance))
    polynomial, ours = steady_state(time_rows)
    np.testing.assert_allclose(polynomial, np.poly(closed).real, atol=1e-7)
    assert ours == pytest.approx(variance, rel=1e-7)


@pytest.mark.parametrize("smoother", SMOOTHERS)
def test_valid_rows_are_numbers_however_broken_the_log(smoother: str) -> None:
    rng = np.random.default_rng(0)
    u = trial().columns["u"].copy()
    u[rng.choice(2400, 900, replace=False)] = np.nan
    u[1500:1700] = 0.5 + 0.1 * np.sin(np.arange(200.0))
    motion = smoothed(trial(u=u), 0.0, smoother)
    assert motion.valid.sum() > 100
    for values in (motion.nu, motion.nu_dot, motion.tau):
        assert np.isfinite(values[motion.valid]).all()
