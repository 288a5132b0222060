"""Errors of the navigation that make port and starboard unlike: found over logs without a hull model, and no others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ferryid.diagnose.judging.campaign import JudgedCampaign
from ferryid.effects.force_model import Measurements
from tests.diagnose.judging.test_changes_between_logs import judged, member_of, together
from tests.diagnose.judging.test_held_out import sailed

pytestmark = pytest.mark.slow


def judged_as(*, heading_deg: float = 0.0, arm_m: tuple[float, float] = (0.0, 0.0)) -> JudgedCampaign:
    """Judge three logs that were measured with a heading that is off, or by an antenna that is."""
    return judged(together([member_of(measured(number, np.radians(heading_deg), *arm_m)) for number in range(3)]))


def measured(number: int, bias: float, x: float, y: float) -> Measurements:
    """Return what a navigation gives of a log: a point of the vessel, and velocities resolved by the heading that it reads."""
    first = 300 * number
    whole = sailed(240.0 + 0.2 * first, np.zeros(2))
    rows = slice(first, None)
    cut = {name: getattr(whole, name)[rows] for name in ("t", "eta", "nu_raw", "nu", "parts", "angles", "usable")}
    north, east, psi = cut["eta"].T
    seen = {"eta": np.column_stack([*_at(north, east, psi, x, y), psi + bias])}
    for name in ("nu_raw", "nu"):
        u, v, r = cut[name].T
        u, v = u - r * y, v + r * x
        seen[name] = np.column_stack([np.cos(bias) * u + np.sin(bias) * v, np.cos(bias) * v - np.sin(bias) * u, r])
    return replace(whole, **{**cut, **seen})


def _at(north: np.ndarray, east: np.ndarray, psi: np.ndarray, x: float, y: float) -> tuple[np.ndarray, np.ndarray]:
    return north + np.cos(psi) * x - np.sin(psi) * y, east + np.sin(psi) * x + np.cos(psi) * y


def named(found: JudgedCampaign) -> list[str]:
    return [one.candidate.effect.id for one in found.properties if one.confirmed]


def test_a_heading_that_is_off_is_found_without_a_hull_model() -> None:
    found = judged_as(heading_deg=4.0)
    assert named(found) == ["heading_bias"]
    angle = found.properties[0].estimates["angle"]
    assert angle.low < 4.0 < angle.high
    assert angle.value == pytest.approx(4.0, abs=0.5)


def test_an_antenna_off_to_one_side_is_found_and_how_far_ahead_is_left_open() -> None:
    found = judged_as(arm_m=(0.0, -0.6))
    assert named(found) == ["lever_arm"]
    (one,) = (each for each in found.properties if each.confirmed)
    assert set(one.estimates) == {"y"}
    assert one.estimates["y"].low < -0.6 < one.estimates["y"].high
    assert "m to port of the body origin; how far ahead" in one.finding(found.hull.fit.campaign.members[0].windows).says


def test_an_antenna_off_both_ways_is_no_other_effect_beside_its_side() -> None:
    """Held at the body origin, how far ahead it is was taken for a weak thruster."""
    found = judged_as(arm_m=(-1.2, 0.6))
    assert named(found) == ["lever_arm"]
    (one,) = (each for each in found.properties if each.confirmed)
    for name, true in (("x", -1.2), ("y", 0.6)):
        assert one.estimates[name].low < true < one.estimates[name].high


@pytest.mark.parametrize("arm_m", [(0.0, 0.0), (0.6, 0.0)], ids=["none", "an antenna ahead"])
def test_what_a_hull_takes_after_has_no_name(arm_m: tuple[float, float]) -> None:
    assert named(judged_as(arm_m=arm_m)) == []


def test_an_arm_of_a_few_centimetres_is_void() -> None:
    assert "lever_arm" not in [one.candidate.effect.id for one in judged_as(arm_m=(0.0, -0.04)).properties]
