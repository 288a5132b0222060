"""Tracking measures of a log against integrals by hand, across gaps and for what is not told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.compare.tracking import tracking_scores
from ferryid.signals.track import Motion

N, RATE_HZ, LENGTH_M = 1001, 10.0, 5.0
T = np.arange(N) / RATE_HZ
"""100 s."""


def sailed(off: tuple[float, float, float], missing: tuple[int, ...] = ()) -> Motion:
    """Return a log that stays off its reference, at 0.5 m/s against 100 N."""
    eta = np.column_stack([0.5 * T, np.zeros(N), np.zeros(N)])
    eta_d = eta - np.array(off)
    eta_d[:, list(missing)] = np.nan
    nu, tau = np.tile([0.5, 0.0, 0.0], (N, 1)), np.tile([-100.0, 0.0, 0.0], (N, 1))
    return Motion("log", T, RATE_HZ, eta, nu, np.zeros((N, 3)), tau, np.ones(N, dtype=bool), nu, eta_d=eta_d)


def test_a_constant_error_has_the_integrals_of_a_rectangle() -> None:
    # 3 m, 4 m, and 0.4 rad over half a length of 2.5 m are another metre.
    e = np.sqrt(3.0**2 + 4.0**2 + 1.0**2)
    found = tracking_scores(sailed((3.0, 4.0, 0.4)), LENGTH_M)
    assert found is not None
    assert vars(found) == pytest.approx(
        {
            "ISE": 100.0 * e**2,
            "IAE": 100.0 * e,
            "EC": 100.0 * 50.0,
            "IAEW": 100.0 * e * 5000.0,
            "seconds": 100.0,
            "position_m": 5.0,
            "heading_rad": 0.4,
        }
    )


def test_a_whole_turn_is_no_error() -> None:
    found = tracking_scores(sailed((0.0, 0.0, 2.0 * np.pi + 0.2)), LENGTH_M)
    assert found is not None
    assert found.heading_rad == pytest.approx(0.2)


def test_gaps_count_for_nothing() -> None:
    motion = sailed((1.0, 0.0, 0.0))
    valid = motion.valid.copy()
    valid[301:700] = False
    found = tracking_scores(replace(motion, valid=valid), LENGTH_M)
    assert found is not None
    assert found.seconds == pytest.approx(60.0)
    assert pytest.approx((60.0, 60.0 * 50.0)) == (found.IAE, found.EC)


def test_a_heading_alone_is_a_reference_too() -> None:
    found = tracking_scores(sailed((9.0, 9.0, 0.4), missing=(0, 1)), LENGTH_M)
    assert found is not None
    assert pytest.approx(100.0) == found.IAE
    assert np.isnan(found.position_m)
    unknown = tracking_scores(sailed((9.0, 9.0, 0.4), missing=(0, 1)), float("nan"))
    assert unknown is not None
    assert np.isnan(unknown.IAE)
    assert unknown.heading_rad == pytest.approx(0.4)


def test_no_reference_no_measures() -> None:
    assert tracking_scores(replace(sailed((1.0, 1.0, 1.0)), eta_d=None), LENGTH_M) is None
    assert tracking_scores(sailed((1.0, 1.0, 1.0), missing=(0, 1, 2)), LENGTH_M) is None
