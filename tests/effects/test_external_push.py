"""A push from outside, against values worked out by hand, and what makes it an event."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
import pytest

from ferryid.diagnose.inference.onset_estimation import _is_event
from ferryid.effects import effects
from ferryid.effects.effect import Effect
from ferryid.effects.force_model import ForceModel, Measurements, hull_of
from ferryid.simulate.added_effects import simulated
from ferryid.types import Floats
from ferryid.vessel import load_profile

FERRY = load_profile("milliampere")
PUSH: Effect = effects()["external_push"]


def lying(headings_deg: Floats) -> ForceModel:
    """Return the force model of a vessel that lies still on these headings, a second apart."""
    n = len(headings_deg)
    parts = np.zeros((n, len(FERRY.actuators), 3))
    eta = np.column_stack([np.zeros(n), np.zeros(n), np.radians(headings_deg)])
    nothing = np.zeros((n, 3))
    measurements = Measurements(
        profile=FERRY,
        t=np.arange(n, dtype=np.float64),
        eta=eta,
        nu_raw=nothing,
        nu=nothing,
        parts=parts,
        angles=np.zeros(parts.shape[:2]),
        usable=np.ones(n, dtype=np.bool_),
    )
    return ForceModel(measurements, hull_of(FERRY), parts, measurements.angles, nothing)


def test_its_direction_is_that_over_ground_and_its_moment_stays() -> None:
    pushed = PUSH.apply(lying(np.array([0.0, 90.0, 180.0])), np.array([30.0, -20.0, 15.0]), None)
    expected = [[30.0, -20.0, 15.0], [-20.0, -30.0, 15.0], [-30.0, 20.0, 15.0]]
    np.testing.assert_allclose(pushed.external, expected, atol=1e-12)


def test_it_acts_from_its_onset_until_its_offset_only() -> None:
    pushed = PUSH.act(lying(np.zeros(8)), np.array([30.0, 0.0, 0.0]), None, 2.0, 5.0)
    np.testing.assert_array_equal(pushed.external[:, 0], [0, 0, 30, 30, 30, 0, 0, 0])


def test_the_simulated_push_is_the_estimated_one() -> None:
    hook = PUSH.simulated
    assert hook is not None
    assert hook.load is not None
    p = np.array([30.0, -20.0, 15.0])
    for heading in (0.0, 37.0, 200.0):
        simulated_load = hook.load(p, 0.0, 5.0, 5.0, np.radians(heading), 1.0, 1.0, 0.1, 1.0, 1.0)
        np.testing.assert_allclose(simulated_load, PUSH.apply(lying(np.array([heading])), p, None).external[0])
    assert "external_push" in simulated()


def test_it_never_acts_all_along_and_others_may() -> None:
    assert PUSH.passing
    assert [name for name, effect in effects().items() if effect.passing] == ["external_push"]
    assert PUSH.onset
    assert not PUSH.vessel


def test_a_moderate_push_is_a_hand_on_a_ferry_and_grows_with_the_mass() -> None:
    north, east, moment = PUSH.parameters_of(FERRY)
    assert (north.unit, east.unit, moment.unit) == ("N", "N", "N·m")
    assert north.size == east.size == pytest.approx(0.05 * 1670.0)
    heavy = replace(FERRY, hull=replace(FERRY.hull, mass_kg=3.0 * FERRY.hull.mass_kg))
    assert PUSH.parameters_of(heavy)[0].size == pytest.approx(3.0 * 0.05 * 1670.0)
    assert {one.neutral for one in (north, east, moment)} == {0.0}


def test_the_sentence_names_the_bearing_it_pushes_towards() -> None:
    says = PUSH.says({"north": 0.0, "east": 50.0, "moment": -12.0}, None)
    assert "50 N towards 90 deg (east)" in says
    assert "-12 N·m" in says


@pytest.mark.parametrize(
    ("elsewhere", "event"),
    [(0.0, True), (9.9, True), (10.1, False), (40.0, False)],
)
def test_an_event_has_four_times_the_evidence_of_anything_elsewhere(elsewhere: float, event: bool) -> None:
    # Spans of parts: the push in 4 to 6, a neighbour that overlaps, one that touches, and one elsewhere.
    a, b = np.array([4, 3, 6, 8]), np.array([6, 5, 7, 10])
    gain = np.array([40.0, 39.0, 39.0, elsewhere])
    assert _is_event(40.0, a, b, gain, 4, 6) is event
    assert not _is_event(-inf, a, b, gain, 4, 6)
