"""Windows that are too long for a vessel: said where its motion is lost in them, not where noise or nothing is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ferryid.regression.window_shares import averaged_out, kept_shares
from ferryid.signals.track import Motion
from ferryid.vessel import load_profile
from ferryid.vessel.dimensions import window_seconds
from tests.identify.rounds import PROFILE

RATE_HZ = 20.0
Floats = NDArray[np.float64]


def motion(yaw_rate: Floats, moment: Floats, valid: NDArray[np.bool_] | None = None) -> Motion:
    n = len(yaw_rate)
    slow = np.sin(2.0 * np.pi * np.arange(n) / RATE_HZ / 200.0)
    nu, tau = (np.column_stack([slow, 0.1 * slow, one]) for one in (yaw_rate, moment))
    t = np.arange(n) / RATE_HZ
    known = np.ones(n, dtype=bool) if valid is None else valid
    return Motion(
        log="log",
        t=t,
        rate_hz=RATE_HZ,
        eta=np.zeros((n, 3)),
        nu=nu,
        nu_dot=np.gradient(nu, t, axis=0),
        tau=tau,
        tau_d=None,
        eta_d=None,
        wind=None,
        current=None,
        valid=known,
        raw_nu=nu,
    )


def swung(period_s: float) -> Motion:
    t = np.arange(0.0, 120.0, 1.0 / RATE_HZ)
    return motion(np.sin(2.0 * np.pi * t / period_s), 3.0 * np.cos(2.0 * np.pi * t / period_s))


def test_a_sine_keeps_what_the_weight_of_the_window_passes() -> None:
    """The weight sin^4 of length T passes the amplitude a(f) of its Fourier transform; of the variance, its square."""
    x = (np.arange(20_000) + 0.5) / 20_000
    weight = np.sin(np.pi * x) ** 4
    passed = float(np.sum(weight * np.cos(2.0 * np.pi * (x - 0.5) * 4.0 / 5.0)) / np.sum(weight)) ** 2
    kept = kept_shares([swung(5.0)], 4.0)
    assert kept[:, 2] == pytest.approx(passed, rel=0.02)
    assert kept[0, 0] > 0.95


def test_a_bow_that_swings_within_a_window_is_said_with_the_length_that_keeps_it() -> None:
    usual = window_seconds(PROFILE)
    (said,) = averaged_out(PROFILE, [swung(0.4 * usual)]).says
    assert f"windows of {usual:.3g} s" in said
    assert "they keep 0 % in yaw of the variance of the velocity" in said
    length = float(said.partition("window_s = ")[2].split()[0])
    assert length == pytest.approx(0.25 * usual, rel=0.05)
    assert averaged_out(replace(PROFILE, window_s=length), [swung(0.4 * usual)]).says == ()
    (said,) = averaged_out(PROFILE, [swung(0.75 * usual)]).says
    assert float(said.partition("window_s = ")[2].split()[0]) == pytest.approx(0.5 * usual, rel=0.05)
    assert averaged_out(PROFILE, [swung(4.0 * usual)]).says == ()


def test_noise_of_one_signal_or_of_both_asks_for_no_shorter_windows() -> None:
    usual = window_seconds(PROFILE)
    slow, rng = swung(4.0 * usual), np.random.default_rng(4)
    noise = 20.0 * rng.normal(size=(2, len(slow.t)))
    assert averaged_out(PROFILE, [motion(noise[0], slow.tau[:, 2])]).says == ()
    assert averaged_out(PROFILE, [motion(slow.nu[:, 2], noise[1])]).says == ()
    assert averaged_out(PROFILE, [motion(*noise)]).says == ()


def test_no_window_is_proposed_that_no_profile_or_no_rate_allows() -> None:
    """Of 8 rows or more, and of 0.2 s or more: at 20 Hz, windows of 1.1 s have no shorter ones of a quarter or a half."""
    quick = replace(PROFILE, window_s=1.1)
    (said,) = averaged_out(quick, [swung(0.7)]).says
    assert float(said.partition("window_s = ")[2].split()[0]) == pytest.approx(0.55)
    assert averaged_out(replace(PROFILE, window_s=0.55), [swung(0.25)]).says == ()
    assert np.isnan(kept_shares([swung(1.0)], 0.3)).all()


def test_a_log_without_a_window_or_without_motion_says_nothing() -> None:
    swinging = swung(1.0)
    assert averaged_out(PROFILE, [replace(swinging, valid=np.zeros(len(swinging.t), dtype=bool))]).says == ()
    assert averaged_out(PROFILE, [motion(0.0 * swinging.t, 0.0 * swinging.t)]).says == ()
    assert averaged_out(PROFILE, []).says == ()


def test_the_profile_of_the_boat_that_zigzags_states_its_windows() -> None:
    assert window_seconds(load_profile("vtec-usv")) == 1.1
