"""What changes within a trial of the plant: a current that sets in, a sea that grows, and drag at one speed."""

from __future__ import annotations

import numpy as np
import pytest

from ferryid.validation.plant.effects import complete_conditions, plant_effects
from ferryid.validation.plant.effects.current import CHANGE_S
from ferryid.validation.plant.effects.fouling import hump_load
from ferryid.validation.plant.plant import Plant, build_plant
from ferryid.validation.plant.vessels import FERRY

T = np.arange(0.0, 200.0, 0.05)


def plant(**conditions: object) -> Plant:
    return build_plant(FERRY, T, complete_conditions(conditions), 3)


def test_a_current_sets_in_within_its_span() -> None:
    one = plant(current=(0.3, -0.4), current_span=(100.0, 1e9))
    speed = np.hypot(*one.water.T)
    assert not speed[T < 100.0 - 0.5 * CHANGE_S].any()
    assert speed[T > 100.0 + 0.5 * CHANGE_S] == pytest.approx(0.5)
    assert speed[np.searchsorted(T, 100.0)] == pytest.approx(0.25, abs=0.01)
    # One that runs from the start never sets in.
    assert np.hypot(*plant(current=(0.3, -0.4)).water.T) == pytest.approx(0.5)


def test_a_drawn_current_has_its_times() -> None:
    drawn = plant_effects()["current"].sample(0.2, FERRY, np.random.default_rng(1), (60.0, None))
    assert drawn.conditions["current_span"] == (60.0, 1e9)
    assert (drawn.truths[0].onset_s, drawn.truths[0].offset_s) == (60.0, None)


def test_a_sea_has_a_course() -> None:
    sea = {"wave_height": 0.1, "wave_period": 2.5}
    even, grown = plant(**sea), plant(**sea, wave_course=[[0.0, 0.0], [100.0, 1.0]])
    loads = np.zeros((2, 6))
    for t, share in ((50.0, 0.5), (150.0, 1.0)):
        for one, out in zip((even, grown), loads, strict=True):
            one.loads["waves"](t, np.zeros(12), out)
        np.testing.assert_allclose(loads[1], share * loads[0])
        assert np.abs(loads[0]).max() > 1.0


def test_a_hump_of_resistance_is_at_its_speed_and_against_the_motion() -> None:
    out = np.zeros(6)
    for u, expected in ((0.5, -60.0), (-0.5, 60.0), (0.6, -60.0 * np.exp(-0.5)), (0.0, 0.0)):
        hump_load(0.5, 0.1, 60.0, u, out)
        assert out[0] == pytest.approx(expected)
        assert not out[1:].any()
    assert "hump" not in plant().loads
    assert "hump" in plant(hump=(0.5, 0.1, 60.0)).loads
