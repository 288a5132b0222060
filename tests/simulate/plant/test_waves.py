"""Waves: the spectrum against quadrature, the force against the pressure on the hull, limits by hand."""

from __future__ import annotations

from math import pi

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial.legendre import leggauss
from scipy.integrate import quad, solve_ivp

from ferryid.errors import FerryIdError
from ferryid.simulate.plant.rolling import natural_frequency, roll_pitch, swing
from ferryid.simulate.plant.spectrum import components, equal_shares
from ferryid.simulate.plant.waves import first_order, lever, sea_of, sinc, sine_cosine, slopes
from ferryid.simulate.sections import Wake, Waves
from ferryid.vessel.load import load_profile

PROFILE = load_profile("milliampere")
L, B = 5.0, 2.8
T = 1670.0 / (1000.0 * L * B)
G = 9.81


def density(share, gamma):
    """JONSWAP as in Fossen (2021), (10.61), but for its constant."""
    sigma = 0.07 if share <= 1.0 else 0.09
    return share**-5 * np.exp(-1.25 * share**-4) * gamma ** np.exp(-((share - 1.0) ** 2) / (2.0 * sigma**2))


@pytest.mark.parametrize("gamma", [1.0, 3.3, 7.0])
def test_frequencies_part_the_energy_evenly(gamma):
    edges = equal_shares(gamma, np.zeros(8))
    whole = quad(density, 0.4, 5.0, (gamma,), points=(0.9, 1.0, 1.1), limit=400)[0]
    for j, edge in enumerate(edges):
        below = quad(density, 0.4, edge, (gamma,), points=(min(1.0, edge),), limit=400)[0]
        assert below / whole == pytest.approx(j / 8, abs=2e-5)


def test_sine_and_cosine_against_twenty_digits():
    turns = np.concatenate([np.linspace(-0.5, 0.5, 1001), np.linspace(-40.0, 40.0, 1001)])
    got = np.array([sine_cosine(turn) for turn in turns])
    with mpmath.workdps(20):
        # The nearest whole turn is taken off exactly: the angle itself is not rounded.
        want = np.array(
            [(float(mpmath.sinpi(2 * turn)), float(mpmath.cospi(2 * turn))) for turn in map(mpmath.mpf, turns)]
        )
    assert np.abs(got - want).max() < 2e-15
    assert sine_cosine(0.25) == pytest.approx((1.0, 0.0), abs=1e-15)


def test_pierson_moskowitz_by_hand():
    # For gamma = 1 the energy below a share f of the peak frequency is exp(-1.25 f^-4): half of it below 1.159.
    median = equal_shares(1.0, np.full(1, 0.5))[0]
    assert median == pytest.approx((1.25 / np.log(2.0 / np.exp(-1.25 * 5.0**-4))) ** 0.25, abs=1e-4)


@settings(max_examples=20, deadline=None)
@given(st.floats(0.05, 3.0), st.floats(1.0, 8.0), st.integers(1, 60))
def test_significant_height_is_exact_for_any_number_of_components(height, period, n):
    frequency, amplitude = components(height, period, 3.3, np.full(n, 0.5))
    assert 4.0 * np.sqrt(n * amplitude**2 / 2.0) == pytest.approx(height)
    assert ((frequency > 0.4 / period) & (frequency < 5.0 / period)).all()


def test_sea_does_not_repeat_itself():
    sea = sea_of(PROFILE, Waves(significant_height_m=1.0, components=40), (), 1)
    t = np.arange(0.0, 720.0, 0.1)
    height = np.cos(2.0 * pi * (np.outer(t, sea.frequency) + sea.phase)).sum(1)
    spread = np.correlate(height, height, "full")[len(t) :] / (height @ height)
    assert np.abs(spread[300:]).max() < 0.5  # more than 30 s later


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(st.one_of(st.floats(0.02, 0.4), st.floats(1e-6, 40)), st.sampled_from((-1.0, 1.0)))
def test_box_functions_equal_mpmath(size, sign):
    with mpmath.workdps(50):
        p = mpmath.mpf(size)
        zeroth, first = mpmath.sin(p) / p, (mpmath.sin(p) - p * mpmath.cos(p)) / p**2
    assert sinc(sign * size) == pytest.approx(float(zeroth), abs=1e-15)
    assert lever(sign * size) == pytest.approx(sign * float(first), abs=1e-15)
    assert (sinc(0.0), lever(0.0), lever(3e-300)) == (1.0, 0.0, 1e-300)


def pressure_force(frequency, amplitude, go, t, x, y, psi, phase):
    """Force of one wave by Gauss-Legendre quadrature of the pressure over the sides of the box."""
    k = (2.0 * pi * frequency) ** 2 / G
    points, weights = leggauss(32)

    def p(xb, yb, z):
        north, east = x + xb * np.cos(psi) - yb * np.sin(psi), y + xb * np.sin(psi) + yb * np.cos(psi)
        along = north * np.cos(go) + east * np.sin(go)
        turns = 2.0 * pi * (frequency * t + phase)
        return 1000.0 * G * amplitude * np.exp(k * z) * np.cos(turns - k * along)

    z, wz = 0.5 * T * (points - 1.0), 0.5 * T * weights
    across, depth = np.meshgrid(0.5 * B * points, z, indexing="ij")
    W = np.outer(0.5 * B * weights, wz)
    ends = p(0.5 * L, across, depth) - p(-0.5 * L, across, depth)
    X, N = -(W * ends).sum(), (W * across * ends).sum()
    along, depth = np.meshgrid(0.5 * L * points, z, indexing="ij")
    W = np.outer(0.5 * L * weights, wz)
    sides = p(along, 0.5 * B, depth) - p(along, -0.5 * B, depth)
    return X, -(W * sides).sum(), N - (W * along * sides).sum()


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(
    st.floats(0.8, 8.0),
    st.floats(-360, 360),
    st.floats(0, 600),
    st.floats(-50, 50),
    st.floats(-50, 50),
    st.floats(-7, 7),
)
def test_force_equals_the_pressure_on_the_hull(period, direction, t, x, y, psi):
    waves = Waves(0.4, period, direction, components=3)
    sea = sea_of(PROFILE, waves, (), 5)
    amplitude = 0.1 * np.sqrt(2.0 / 3.0)
    parts = [
        pressure_force(f, amplitude, np.radians(direction), t, x, y, psi, phase)
        for f, phase in zip(sea.frequency, sea.phase, strict=True)
    ]
    # Linear between tabulated headings: an error of (kL/2)² (pi/1440)²/8 of the largest force or moment.
    k = (2.0 * pi * sea.frequency.max()) ** 2 / G
    largest = 1000.0 * G * amplitude * 3.0 * (1.0 - np.exp(-k * T))
    error = (2.0 + 0.5 * k * L) ** 2 * (2.0 * pi / 1440.0) ** 2 / 8.0 * largest
    np.testing.assert_allclose(first_order(sea, t, x, y, psi)[:2], np.sum(parts, 0)[:2], atol=error * L * B + 1e-8)
    np.testing.assert_allclose(first_order(sea, t, x, y, psi)[2], np.sum(parts, 0)[2], atol=error * L * L * B + 1e-8)


def test_long_waves_push_with_weight_times_slope():
    # A wave of 8000 m: the hull feels the slope of the surface, rho g V dz/dx; no moment.
    period = np.sqrt(2.0 * pi * 8000.0 / G)
    sea = sea_of(PROFILE, Waves(significant_height_m=0.0), (Wake(1000.0, 2.0, period, 1e6, 0.0),), 1)
    k = 2.0 * pi / 8000.0
    X, Y, N = first_order(sea, 1000.0 + 0.25 * period, 0.0, 0.0, 0.0)
    # A quarter period after the crest the surface falls towards the wave's back: it rises ahead.
    assert pytest.approx(-1670.0 * G * k, rel=1e-3) == X
    assert abs(Y) + abs(N) < 1e-2
    assert slopes(sea, 1000.0 + 0.25 * period, 0.0, 0.0, 0.0)[0] == pytest.approx(k, rel=1e-3)


def test_diffraction_multiplies_the_force_and_leaves_the_slope():
    # Displaced: 1670 kg, and 1670 (25 + 7.84) / 12 = 4570.2 kg m2 about the vertical.
    waves = Waves(0.4, 3.0, 40.0)
    plain, whole = sea_of(PROFILE, waves, (), 1), sea_of(PROFILE, waves, (), 1, (334.0, 1670.0, 9140.4))
    for t in (0.0, 3.3, 7.1):
        np.testing.assert_allclose(
            first_order(whole, t, 1.0, 2.0, 0.3),
            first_order(plain, t, 1.0, 2.0, 0.3) * np.array([1.2, 2.0, 3.0]),
            rtol=1e-5,
        )
        assert slopes(whole, t, 1.0, 2.0, 0.3) == pytest.approx(slopes(plain, t, 1.0, 2.0, 0.3), rel=1e-12)


def test_encounter_frequency_is_that_of_the_moving_vessel():
    # Head sea of 3 s met at 2 m/s: 1/3 + k U / 2 pi = 0.333 + 2/14.05 = 0.4757 per second.
    sea = sea_of(PROFILE, Waves(), (Wake(100.0, 0.2, 3.0, 1e4, 180.0),), 1)
    t = np.arange(0.0, 200.0, 0.01)
    surge = np.array([first_order(sea, one, 2.0 * one, 0.0, 0.0)[0] for one in t])
    ups = t[1:][(surge[:-1] < 0.0) & (surge[1:] >= 0.0)]
    assert (len(ups) - 1) / (ups[-1] - ups[0]) == pytest.approx(1.0 / 3.0 + 2.0 * 2.0 * pi / (G * 9.0), rel=1e-4)


def test_wake_comes_and_goes():
    sea = sea_of(PROFILE, Waves(), (Wake(60.0, 0.3, 2.0, 20.0, 90.0),), 1)

    def size(middle):
        return max(abs(first_order(sea, t, 0.0, 0.0, 0.0)[1]) for t in np.arange(middle - 1.0, middle + 1.0, 0.01))

    assert size(65.0) / size(60.0) == pytest.approx(np.exp(-0.5), rel=0.12)
    assert size(20.0) < 1e-6 * size(60.0)
    assert first_order(sea, 19.0, 0.0, 0.0, 0.0) == (0.0, 0.0, 0.0)


def test_a_vessel_of_unknown_size_is_refused():
    with pytest.raises(FerryIdError, match="waves need the size of the hull"):
        sea_of(load_profile("vtec-usv"), Waves(significant_height_m=0.2), (), 1)
    assert len(sea_of(load_profile("vtec-usv"), Waves(), (), 1).frequency) == 0


@pytest.mark.slow
def test_oscillator_against_scipy():
    t = np.linspace(0.0, 12.0, 601)
    drive = 0.1 * np.sin(2.0 * t) + 0.05 * np.cos(7.0 * t)
    values = drive.copy()
    swing(values, 6.0, 0.15, 0.02)

    def rates(time, y):
        return [y[1], 36.0 * (np.interp(time, t, drive) - y[0]) - 2.0 * 0.15 * 6.0 * y[1]]

    exact = solve_ivp(rates, (0.0, 12.0), [drive[0], 0.0], t_eval=t, rtol=1e-9, atol=1e-11, max_step=0.01).y[0]
    np.testing.assert_allclose(values, exact, atol=1e-7)


@pytest.mark.slow
def test_on_long_waves_the_hull_lies_flat_on_the_water():
    period = np.sqrt(2.0 * pi * 8000.0 / G)
    t = np.arange(1000.0, 1100.0, 0.05)
    k = 2.0 * pi / 8000.0
    for direction, psi, expected in ((0.0, 0.0, (0.0, 1.0)), (90.0, 0.0, (-1.0, 0.0)), (0.0, 0.5 * pi, (1.0, 0.0))):
        sea = sea_of(PROFILE, Waves(), (Wake(1000.0, 2.0, period, 1e6, direction),), 1)
        attitude = roll_pitch(sea, t, np.column_stack((np.zeros((len(t), 2)), np.full(len(t), psi))))
        slope = k * np.sin(2.0 * pi * (t - 1000.0) / period)
        # The surface rises ahead of the wave's back: bow up; to starboard: starboard up; to port: port up.
        np.testing.assert_allclose(attitude, np.outer(slope, expected), atol=0.02 * k)


def test_natural_frequency_by_hand():
    # A plank 3 m wide, 0.1 m deep, radius 1.2 m: GM = 9/1.2 = 7.5 m, sqrt(9.81 * 7.5)/1.2 = 7.148 rad/s.
    assert natural_frequency(3.0, 0.1, 1.2) == pytest.approx(7.148, abs=1e-3)
