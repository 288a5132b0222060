"""The truth of simulated trials: what a log in still air shows of damping is that of the water and of the air."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ferryid.validation.plant.air import air_constants
from ferryid.validation.plant.vessels import FERRY
from ferryid.vessel import load_profile
from ferryid.vessel.profile import Profile
from tests.rivals.simulated import Trial

ABEAM = np.array([[0.0, 0.8, 0.0], [0.0, -0.8, 0.0]])


def trial(hull: Profile | None) -> Trial:
    nothing: Any = None
    return Trial(nothing, nothing, nothing, np.eye(3), hull)


def test_the_damping_of_the_simulator_holds_the_drag_of_still_air() -> None:
    profile = load_profile("milliampere")
    assert profile.wind is not None
    areas = profile.wind
    none = replace(profile, wind=replace(areas, CD_t=1e-9 * areas.CD_t, CD_l_AF=1e-9 * areas.CD_l_AF))
    more = trial(profile).damping(ABEAM) - trial(none).damping(ABEAM)
    # 1.2 kg/m3, as the wind's loads are computed with.
    drag = 0.5 * 1.2 * areas.CD_t * areas.lateral_m2 * 0.8**2
    np.testing.assert_allclose(more[:, 1], [drag, -drag], rtol=0.03)


def test_the_damping_of_the_independent_plant_holds_it_too(monkeypatch: pytest.MonkeyPatch) -> None:
    air = air_constants(FERRY)
    whole = trial(None).damping(ABEAM)
    monkeypatch.setattr("tests.rivals.simulated.air_constants", lambda vessel: replace_table(air))
    more = whole - trial(None).damping(ABEAM)
    assert more[0, 1] > 1.0
    assert more[1, 1] == pytest.approx(-more[0, 1])


def replace_table(air: Any) -> Any:
    return air._replace(table=np.zeros_like(air.table))
