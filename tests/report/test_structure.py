"""Small computations behind the figures, against what was planted."""

from __future__ import annotations

import numpy as np
import pytest

from ferryid.identify.outcome import LogFit
from ferryid.report.structure import autocorrelation, envelope, spectrum, worst_and_best_minute
from ferryid.signals.track import Motion

RATE = 10.0


def log_with(residual: np.ndarray, valid: np.ndarray | None = None) -> LogFit:
    """Return a log whose residual of the new model is given, shape (n, 3)."""
    n = len(residual)
    ok = np.ones(n, dtype=bool) if valid is None else valid
    zero = np.zeros((n, 3))
    tau = np.sin(np.arange(n) / 50)[:, None] * np.ones(3)
    motion = Motion(
        log="made", t=np.arange(n) / RATE, rate_hz=RATE, eta=zero, nu=zero, nu_dot=zero, tau=tau, valid=ok, raw_nu=zero
    )
    return LogFit(motion, ok, ok, tau, tau - residual, {})


def test_envelope_keeps_every_peak_and_every_gap() -> None:
    t = np.arange(100_000) / RATE
    values = np.zeros(100_000)
    values[41_234], values[77_777] = 9.0, -7.0
    values[50_000:50_500] = np.nan
    thin_t, thin = envelope(t, values)
    assert len(thin) < 2000
    assert (np.nanmax(thin), np.nanmin(thin)) == (9.0, -7.0)
    assert np.isnan(thin[(thin_t > 5000.1) & (thin_t < 5049.0)]).all()
    assert np.all(np.diff(thin_t) > 0)


def test_spectrum_finds_a_planted_wave_with_its_power() -> None:
    rng = np.random.default_rng(0)
    t = np.arange(20_000) / RATE
    wave = np.sqrt(2.0) * np.sin(2 * np.pi * 0.8 * t) + 0.01 * rng.normal(size=t.size)
    frequency, density = spectrum(log_with(np.column_stack([wave] * 3)), "tau_model", 0)
    assert frequency[np.argmax(density)] == pytest.approx(0.8, abs=0.03)
    assert np.trapezoid(density, frequency) == pytest.approx(1.0, rel=0.03)


def test_autocorrelation_of_white_noise_and_of_a_first_order_process() -> None:
    rng = np.random.default_rng(1)
    white = rng.normal(size=(20_000, 3))
    lag, correlation, count = autocorrelation(log_with(white), "tau_model", 1)
    assert correlation[0] == pytest.approx(1.0)
    assert np.mean(np.abs(correlation[1:]) < 1.96 / np.sqrt(count)) > 0.9
    red = np.zeros_like(white)
    for k in range(1, len(white)):
        red[k] = 0.95 * red[k - 1] + white[k]
    lag, correlation, _ = autocorrelation(log_with(red), "tau_model", 1)
    np.testing.assert_allclose(correlation[:20], 0.95 ** (lag[:20] * RATE), atol=0.1)


def test_worst_and_best_minute_are_the_planted_ones() -> None:
    residual = np.full((6000, 3), 0.2)
    residual[2400:3000] = 3.0
    residual[4200:4800] = 0.0
    worst, best = worst_and_best_minute(log_with(residual))
    assert worst == pytest.approx(240.0, abs=10.0)
    assert best == pytest.approx(420.0, abs=10.0)


def test_a_log_too_short_for_minutes_has_none() -> None:
    assert worst_and_best_minute(log_with(np.ones((900, 3)))) is None


def test_one_minute_is_not_the_worst_and_the_best() -> None:
    log = log_with(np.ones((1300, 3)))
    log.motion.valid[:] = False
    log.motion.valid[100:720] = True
    assert worst_and_best_minute(log) is None


@pytest.mark.parametrize("rows", [1021, 1024, 1100])
def test_autocorrelation_is_that_of_the_sums_whatever_the_number_of_rows(rows: int) -> None:
    residual = np.cumsum(np.random.default_rng(3).standard_normal((rows, 3)), axis=0)
    lag, correlation, _ = autocorrelation(log_with(residual), "tau_model", 0)
    centred = residual[:, 0] - residual[:, 0].mean()
    sums = np.array([centred[: rows - k] @ centred[k:] for k in range(len(lag))])
    np.testing.assert_allclose(correlation, sums / sums[0], atol=1e-12)
