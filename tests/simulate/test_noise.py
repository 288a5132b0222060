"""Statistics of the noise: what was asked for is what comes out."""

from __future__ import annotations

from math import exp

import numpy as np
import pytest

from ferryid.simulate.noise import generator, gusts, measurement_noise, smooth_noise

N = 200_000


def test_smooth_noise_has_both_standard_deviations_of_table_5_2():
    step_s = 0.05
    x = smooth_noise(generator(1, "u"), N, step_s, 0.05, 0.01)
    assert x.std() == pytest.approx(0.05, rel=0.08)
    assert (np.diff(x) / step_s).std() == pytest.approx(0.01, rel=0.05)
    # Autocorrelation of a critically damped process: (1 + w tau) exp(-w tau), here w = 0.2 rad/s.
    for lag_s in (2.0, 5.0, 10.0):
        k = round(lag_s / step_s)
        found = np.mean(x[k:] * x[:-k]) / x.var()
        assert found == pytest.approx((1.0 + 0.2 * lag_s) * exp(-0.2 * lag_s), abs=0.06)


def test_noise_is_stationary_from_its_first_sample():
    first = [smooth_noise(generator(seed, "u"), 3, 0.05, 0.05, 0.01) for seed in range(1500)]
    assert np.std([x[0] for x in first]) == pytest.approx(0.05, rel=0.08)
    assert np.std([(x[1] - x[0]) / 0.05 for x in first]) == pytest.approx(0.01, rel=0.08)


def test_white_share():
    white = measurement_noise(generator(2, "x"), N, 0.05, 0.02, 0.05, 1.0)
    assert white.std() == pytest.approx(0.02, rel=0.02)
    assert abs(np.corrcoef(white[1:], white[:-1])[0, 1]) < 0.01
    mixed = measurement_noise(generator(2, "x"), N, 0.05, 0.02, 0.02, 0.1)
    assert mixed.std() == pytest.approx(0.02, rel=0.08)


def test_noise_that_hardly_moves_stays_a_constant():
    x = smooth_noise(generator(1, "u"), 100, 0.05, 0.05, 1e-9)
    assert np.ptp(x) < 1e-8
    assert x[0] != 0.0


def test_gusts_forget_with_their_time_constant():
    x = gusts(generator(3, "gust"), N, 0.1, 0.8, 5.0)
    assert x.std() == pytest.approx(0.8, rel=0.06)
    assert np.corrcoef(x[50:], x[:-50])[0, 1] == pytest.approx(exp(-1.0), abs=0.04)


def test_nothing_asked_nothing_added():
    assert not smooth_noise(generator(1, "u"), 10, 0.05, 0.0, 0.0).any()
    assert not gusts(generator(1, "u"), 10, 0.05, 0.0, 5.0).any()


def test_channels_do_not_share_a_random_stream():
    a, b, again = (generator(7, name).standard_normal(500) for name in ("u", "v", "u"))
    assert abs(np.corrcoef(a, b)[0, 1]) < 0.2
    assert (a == again).all()
    assert (generator(8, "u").standard_normal(500) != a).all()
