"""Signal quality: what is wrong is found and counted, what is right is left alone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from ferryid.errors import FerryIdError
from ferryid.signals.quality import clean, require_excited, stale, stuck, unwrapped
from ferryid.signals.track import Track

Floats = NDArray[np.float64]

T = np.arange(0, 120, 0.05)


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(
    places=st.lists(st.integers(0, 110), min_size=1, max_size=8, unique=True),
    size=st.floats(0.8, 100),
    noise=st.floats(0.0, 0.02),
)
def test_isolated_spikes_are_found_exactly(places: list[int], size: float, noise: float) -> None:
    rng = np.random.default_rng(3)
    good = np.sin(0.2 * T) + rng.normal(0, noise, T.size)
    where = np.array(sorted(places)) * 20 + 10
    bad = good.copy()
    bad[where] += size * rng.choice([-1, 1], where.size)
    result, quality = clean("u", T, bad)
    assert quality.spikes == where.size
    assert quality.jumps == 0
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(result)), where)
    untouched = np.isfinite(result)
    np.testing.assert_array_equal(result[untouched], bad[untouched])


@settings(max_examples=40, deadline=None)
@given(noise=st.floats(1e-4, 0.5), rate=st.floats(1, 100), seed=st.integers(0, 1000))
def test_honest_noise_is_never_taken_out(noise: float, rate: float, seed: int) -> None:
    t = np.arange(3000) / rate
    values = np.random.default_rng(seed).normal(0, noise, t.size)
    result, quality = clean("u", t, values)
    assert quality.spikes == 0
    np.testing.assert_array_equal(result, values)


def test_a_lasting_step_is_reported_and_kept() -> None:
    values = np.sin(0.2 * T) + np.where(T > 60, 5.0, 0.0)
    result, quality = clean("u", T, values)
    assert (quality.spikes, quality.jumps) == (0, 1)
    np.testing.assert_array_equal(result, values)
    assert quality.remarks() == ("u: 1 implausible step was found and kept.",)


def test_two_steps_the_same_way_are_no_spike() -> None:
    rows = np.arange(T.size)
    values = np.sin(0.2 * T) + np.where(rows > 1200, 5.0, 0.0) + np.where(rows > 1201, 5.0, 0.0)
    quality = clean("u", T, values)[1]
    assert (quality.spikes, quality.jumps) == (0, 2)


def test_orders_and_resting_actuators_are_left_alone() -> None:
    pulses = 100 * np.sin(T) + np.where(np.arange(T.size) % 400 == 200, 500.0, 0.0)
    assert clean("n_thruster1", T, pulses)[1].spikes == 6
    assert clean("n_cmd_thruster1", T, pulses)[1].spikes == 0
    stepping = np.random.default_rng(0).normal(0, 1, T.size) + np.where(T > 60, 300.0, 0.0)
    found = clean("n_thruster1", T, stepping)[1]
    assert (found.spikes, found.jumps) == (0, 0)
    resting = clean("n_thruster1", T, np.where(T > 60, 300.0, 0.0))[1]
    assert (resting.spikes, resting.jumps, resting.held) == (0, 0, 0)


def test_held_and_missing_samples_are_counted() -> None:
    values = np.sin(T)
    values[100:111] = values[100]
    values[500] = values[499]
    values[700:705] = np.nan
    values[800] = np.inf
    result, quality = clean("v", T, values)
    assert (quality.missing, quality.held) == (6, 11)
    assert quality.longest_held_s == pytest.approx(0.5)
    assert np.isnan(result[800])


def test_a_slow_sensor_in_a_fast_stream_is_told_by_its_repeats() -> None:
    quality = clean("x", T, np.repeat(np.sin(T[::4]), 4))[1]
    assert quality.held == 1800
    assert "updated slower than it is recorded" in quality.remarks()[0]


def test_a_constant_is_called_one() -> None:
    assert clean("u", T, np.full(T.size, 0.3))[1].constant
    assert not clean("u", T, np.sin(T))[1].constant


def test_a_vessel_at_rest_is_not_a_stale_sensor() -> None:
    rng = np.random.default_rng(0)
    moving = rng.normal(1, 0.1, T.size)
    moving[100:300] = moving[100]
    still = moving.copy()
    still[100:300] = 0.0
    assert stale(T, {"u": moving}, 0.5).sum() == 199
    assert stale(T, {"u": still}, 0.5).sum() == 0
    assert stale(T, {"u": moving, "psi": rng.normal(size=T.size)}, 0.5).sum() == 0
    assert stale(T, {"u": np.repeat(moving[::4], 4)}, 0.1).sum() == 0


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), lost=st.integers(0, 50))
def test_unwrapping_is_exact_and_survives_missing_samples(seed: int, lost: int) -> None:
    rng = np.random.default_rng(seed)
    angle = np.cumsum(rng.uniform(-0.5, 0.5, 400))
    wrapped = (angle + np.pi) % (2 * np.pi) - np.pi
    wrapped[rng.choice(400, lost, replace=False)] = np.nan
    # Samples lost in a row can hide half a turn; one in a row cannot at half a radian a sample.
    pairs = np.isnan(wrapped)
    wrapped[1:][pairs[1:] & pairs[:-1]] = ((angle + np.pi) % (2 * np.pi) - np.pi)[1:][pairs[1:] & pairs[:-1]]
    result = unwrapped(wrapped)
    turns = (result - angle)[np.isfinite(result)] / (2 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns[0]), atol=1e-12)
    np.testing.assert_array_equal(np.isnan(result), np.isnan(wrapped))


def test_unwrapping_a_long_turn_gathers_no_rounding() -> None:
    angle = 0.3 * np.arange(500_000)
    result = unwrapped((angle + np.pi) % (2 * np.pi) - np.pi)
    assert np.abs(result - angle).max() < 1e-9


def test_constant_signals_are_refused() -> None:
    track = Track("trial", T, 0, 20.0, {}, np.ones(T.size, dtype=bool))
    nu = np.column_stack([1.0 + np.sin(0.07 * T), np.cos(0.05 * T), 0.05 * np.cos(0.1 * T)])
    tau = np.column_stack([np.sin(T), 0 * T, 0 * T])
    require_excited(track, nu, tau)
    for i, name in enumerate(("u", "v", "r")):
        flat = nu.copy()
        flat[:, i] = 0.25
        with pytest.raises(FerryIdError, match=rf"trial: constant signal {name}.*0\.25.*Fix: "):
            require_excited(track, flat, tau)
    with pytest.raises(FerryIdError, match=r"trial: constant signal, the applied force never changes.*Fix: "):
        require_excited(track, nu, np.ones_like(nu))
    # A diagnosis takes it, as what drives a vessel off shows all the same; no force at all may not have been recorded.
    require_excited(track, nu, np.ones_like(nu), steady_force=True)
    with pytest.raises(
        FerryIdError, match=r"trial: constant signal, the applied force never changes, found \(0, 0, 0\)"
    ):
        require_excited(track, nu, np.zeros_like(nu), steady_force=True)


@pytest.mark.parametrize("samples", [1, 2, 3])
def test_a_heading_resampled_the_wrong_way_round_is_taken_out(samples: int) -> None:
    heading = 0.1 * T
    wrapped = heading % (2 * np.pi)
    (last,) = np.flatnonzero(np.diff(wrapped) < -3.0)
    # What a tool leaves that resampled 359° and 1° linearly.
    wrong = np.arange(last + 1, last + 1 + samples)
    after = heading[last + samples + 1] % (2 * np.pi)
    wrapped[wrong] = np.linspace(wrapped[last], after, samples + 2)[1:-1]
    result, quality = clean("psi", T, wrapped)
    assert (quality.through_wrap, quality.spikes, quality.jumps) == (samples, 0, 0)
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(result)), wrong)
    known = np.isfinite(result)
    np.testing.assert_allclose(result[known], heading[known], atol=1e-12)


@pytest.mark.parametrize(("rate_hz", "turn"), [(2.0, 0.9), (0.2, 0.3)])
def test_honest_turns_are_not_taken_out(rate_hz: float, turn: float) -> None:
    slow = np.arange(200) / rate_hz
    heading = turn * slow
    result, quality = clean("psi", slow, heading % (2 * np.pi))
    assert (quality.through_wrap, quality.spikes) == (0, 0)
    np.testing.assert_allclose(result, heading, atol=1e-9)


@pytest.mark.parametrize("size", [1.5, np.pi])
@pytest.mark.parametrize("before", [0, 200])
def test_a_single_wild_heading_is_a_spike_even_across_the_wrap(size: float, before: int) -> None:
    heading = 0.1 * T
    wrapped = heading % (2 * np.pi)
    (last,) = np.flatnonzero(np.diff(wrapped) < -3.0)
    wrapped[last - before] = (wrapped[last - before] + size) % (2 * np.pi)
    result, quality = clean("psi", T, wrapped)
    assert quality.through_wrap + quality.spikes == 1
    known = np.isfinite(result)
    np.testing.assert_allclose(result[known], heading[known], atol=1e-12)


def test_a_velocity_that_stands_still_to_the_last_digit_is_stuck() -> None:
    rng = np.random.default_rng(0)
    u = rng.normal(1.0, 0.1, T.size)
    u[100:150] = u[100]
    u[300:305] = u[300]
    np.testing.assert_array_equal(np.flatnonzero(stuck(T, u, 0.5)), np.arange(101, 150))
    # A coarse sensor repeats itself by its resolution, and a vessel at rest has nothing else to say.
    coarse = np.round(u / 0.02) * 0.02
    assert 0.05 < np.mean(np.diff(coarse) == 0) < 0.2
    assert not stuck(T, coarse, 0.5).any()
    at_rest = u.copy()
    at_rest[100:150] = 0.0
    assert not stuck(T, at_rest, 0.5).any()
    assert not stuck(T[:2], u[:2], 0.5).any()
