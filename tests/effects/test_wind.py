"""Wind: where a search for it begins."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.diagnose.inference.estimation import Candidate, choose_parameters, estimation_problem, fit
from ferryid.effects import effects
from ferryid.effects.wind import SPEEDS_MPS
from tests.diagnose.judging.test_unexplained import FERRY, pushes, trial_with

pytestmark = pytest.mark.slow

WIND = effects()["wind"]
BREEZE = Candidate(WIND, None, WIND.parameters_of(FERRY))


@pytest.mark.parametrize("speed", [0.0, 7.0])
@pytest.mark.parametrize("towards_deg", [10.0, 100.0, 190.0, 280.0])
def test_a_search_begins_on_the_side_that_the_wind_blows_to(towards_deg: float, speed: float) -> None:
    """A load that goes with the square of the speed has its likeliest wind on either side of none."""
    calm = trial_with(pushes())
    towards = np.radians(towards_deg)
    blown = BREEZE.act(calm.plain, speed * np.array([np.cos(towards), np.sin(towards)]))
    lacking = replace(calm.plain, external=calm.plain.external - (blown.external - calm.plain.external))
    trial = estimation_problem(calm.windows, lacking, calm.hull_spread)
    chosen = choose_parameters(trial, fit(trial, ()), BREEZE)
    north, east = chosen.start[:2].tolist()
    if speed == 0.0:
        assert (north, east) == (0.0, 0.0)
        return
    assert np.hypot(north, east) == pytest.approx(min(SPEEDS_MPS, key=lambda one: abs(one - speed)))
    assert abs(np.angle(np.exp(1j * (np.arctan2(east, north) - towards)))) < np.radians(16.0)
    # What is to be told is the wind alone, and choosing where to begin costs nothing.
    assert chosen.log_alternatives == 0.0
    assert [replace(one, start=None) for one in chosen.parameters] == list(BREEZE.parameters)
