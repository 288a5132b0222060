"""A hidden signal beside what was found of it: compared while it acted, in the effect's units."""

from __future__ import annotations

import numpy as np
import pytest

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.judging.finding import Finding
from ferryid.diagnose.judging.hidden_signal import compare_hidden_signals
from ferryid.effects.force_model import Measurements
from ferryid.vessel import load_profile

FERRY = load_profile("milliampere")
N = 100


def measurements() -> Measurements:
    """A hundred seconds at rest."""
    zero = np.zeros((N, 3))
    usable = np.ones(N, dtype=bool)
    return Measurements(FERRY, np.arange(float(N)), zero, zero, zero, np.zeros((N, 2, 3)), np.zeros((N, 2)), usable)


def load(first: int, end: int) -> np.ndarray:
    """A mass of 300 kg at 0.5 m between two rows, nothing else."""
    values = np.zeros((N, 2))
    values[first:end] = [300.0, 0.5]
    return values


def found(**parameters: Estimate) -> Finding:
    nothing = dict.fromkeys(("surge", "sway", "yaw"), 0.0)
    return Finding(
        effect="payload", instance=None, probability=0.99, parameters=parameters, axes=nothing, intervals=(), says=""
    )


def test_a_load_is_compared_while_it_was_aboard() -> None:
    mass = Estimate(290.0, 280.0, 300.0, "kg")
    (one,) = compare_hidden_signals(
        {"payload": load(20, 60)}, measurements(), [found(mass=mass, x=Estimate(0.4, 0.3, 0.5, "m"))]
    )
    assert one.measured == {"mass": 300.0, "x": 0.5, "onset": 20.0, "offset": 59.0}
    assert set(one.found) == {"mass", "x"}
    assert "Measured while it was aboard: mass 300 kg, x 0.5 m, onset 20 s, offset 59 s" in one.says
    assert "found: mass 290 kg, x 0.4 m" in one.says


def test_a_load_that_stays_has_no_ends_and_one_that_was_not_found_is_told() -> None:
    (one,) = compare_hidden_signals({"payload": load(0, N)}, measurements(), [])
    assert set(one.measured) == {"mass", "x"}
    assert one.says.endswith("nothing of it was found.")


def test_a_wind_is_compared_on_average_of_what_was_measured() -> None:
    blown = np.full((N, 2), [2.0, -1.0])
    blown[:50] = np.nan
    (one,) = compare_hidden_signals({"wind": blown}, measurements(), [])
    assert one.measured == {"north": pytest.approx(2.0), "east": pytest.approx(-1.0)}
    assert "on average: north 2 m/s, east -1 m/s" in one.says


def test_an_empty_deck_is_no_load() -> None:
    (one,) = compare_hidden_signals({"payload": load(0, 0)}, measurements(), [])
    assert one.measured == {"mass": 0.0, "x": 0.0}
