"""Witnesses for findings on real recordings, on signals whose figures are known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

from ferryid.effects.force_model import Measurements
from tests.real import witnesses


def test_the_gusts_of_an_anemometer_have_the_figures_of_their_process() -> None:
    """First-order gusts of 0.8 m/s that last 12 s about a mean wind, and rows that are not used."""
    rng, step_s, rows = np.random.default_rng(1), 0.1, 200_000
    pole = np.exp(-step_s / 12.0)
    noise = rng.normal(scale=0.8 * np.sqrt(1.0 - pole**2), size=(rows, 2))
    wind = np.array([3.0, -4.0]) + lfilter([1.0], [1.0, -pole], noise, axis=0)
    usable = np.arange(rows) >= 100
    wind[~usable] = 50.0
    found = witnesses.gustiness(cast(Measurements, SimpleNamespace(wind=wind, usable=usable, step_s=step_s)))
    assert found.std == pytest.approx(0.8, rel=0.05)
    assert found.seconds == pytest.approx(12.0, rel=0.15)


def test_the_longest_repeat_of_a_column_is_counted_from_change_to_change() -> None:
    table = pd.DataFrame({"t [s]": np.arange(8.0), "psi": [0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 3.0, 4.0]})
    assert witnesses.repeated(table, "psi") == 3.0
