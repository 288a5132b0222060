"""A load sinks the hull: what its draught is known of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.effects import effects
from ferryid.effects.force_model import ForceModel, added_mass, hull_of
from tests.diagnose.judging.test_unexplained import FERRY, sailed

PAYLOAD = effects()["payload"]


def force_model(draught_m: float) -> ForceModel:
    profile = replace(FERRY, hull=replace(FERRY.hull, draught_m=draught_m))
    measurements = replace(sailed(0), profile=profile)
    return ForceModel(
        measurements, hull_of(profile), measurements.parts, measurements.angles, np.zeros((len(measurements.t), 3))
    )


@pytest.mark.slow
def test_a_box_sinks_by_its_load_over_its_waterplane() -> None:
    """milliAmpère is 5 m by 2.8 m: 610 kg sink 0.85 of that area by 5 cm in water of 1025 kg/m³."""
    before = force_model(0.25)
    loaded = PAYLOAD.apply(before, np.array([610.0, 0.0, 1.0]), None)
    assert loaded.damping_factor == pytest.approx(np.full(len(before.measurements.t), 1.2), rel=1e-3)
    half = PAYLOAD.apply(before, np.array([610.0, 0.0, 0.5]), None)
    assert half.damping_factor == pytest.approx(np.full(len(before.measurements.t), 1.1), rel=1e-3)
    twice = PAYLOAD.apply(loaded, np.array([610.0, 0.0, 0.5]), None)
    assert twice.damping_factor == pytest.approx(np.full(len(before.measurements.t), 1.32), rel=1e-3)


def test_a_load_adds_its_own_mass_and_the_water_that_a_deeper_hull_moves() -> None:
    before = force_model(0.25)
    loaded = PAYLOAD.apply(before, np.array([610.0, 0.5, 1.0]), None)
    more = float(loaded.damping_factor[0]) - 1.0  # type: ignore[index]
    assert more == pytest.approx(0.2, rel=1e-3)
    own = np.array([610.0, 610.0, 305.0, 305.0, 152.5])
    assert loaded.load == pytest.approx(np.tile(own + more * added_mass(before), (len(before.measurements.t), 1)))
    assert added_mass(before)[0] > 0.0


def test_a_hull_of_unknown_draught_has_mass_and_place_only() -> None:
    before = force_model(float("nan"))
    assert [one.name for one in PAYLOAD.parameters_of(before.measurements.profile)] == ["mass", "x"]
    assert PAYLOAD.apply(before, np.array([610.0, 0.0]), None).damping_factor is None
    known = force_model(0.25).measurements
    names = [one.name for one in PAYLOAD.parameters_of(known.profile)]
    assert names[:2] == ["mass", "x"]
    # Of what is fitted for their sake, nothing is told.
    assert PAYLOAD.unreported(known, np.array([610.0, 0.0, 1.0])) == frozenset(names[2:])
