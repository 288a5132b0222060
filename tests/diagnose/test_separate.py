"""What to record next: every pair that is told apart is of effects that exist, once, and either way round."""

from __future__ import annotations

from itertools import combinations

import pytest

from ferryid.diagnose.separate import PAIRS, manoeuvre
from ferryid.effects import effects

GENERAL = "a calibration run that excites every axis at many headings, such as the 12-corner path"
RELATED = ("fouling", "hull_parameters", "shallow_water", "payload", "thruster_gain")
"""Effects that explain more or less of the same: those of mass, damping and strength."""


def test_pairs_are_of_known_effects_and_stand_once() -> None:
    known = {*effects(), "gusts", "waves"}
    pairs = [pair for pair, _ in PAIRS]
    assert len(set(pairs)) == len(pairs)
    assert set().union(*pairs) <= known


@pytest.mark.parametrize(("one", "other"), list(combinations(RELATED, 2)))
def test_related_effects_have_a_manoeuvre_of_their_own(one: str, other: str) -> None:
    text = manoeuvre(one, [other])
    assert text is not None
    assert text != GENERAL
    assert manoeuvre(other, [one]) == text


def test_nothing_to_tell_apart_needs_no_manoeuvre() -> None:
    assert manoeuvre("wind", []) is None
    assert manoeuvre("wind", ["yaw_rate_scale"]) == GENERAL
