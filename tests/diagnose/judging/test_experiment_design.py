"""What to record next: every pair that is told apart is of effects that exist, once, and either way round."""

from __future__ import annotations

from itertools import combinations, combinations_with_replacement

import pytest

from ferryid.diagnose.judging.experiment_design import (
    CALM,
    FITTING,
    HULL_FIRST,
    OTHERWISE,
    PAIRS,
    SENSORS,
    SHOWS,
    fitting,
    manoeuvre,
    sensor_of,
    shown_by,
)
from ferryid.effects import effects
from ferryid.vessel.profile import SETTINGS

OF_ACTUATORS = ("dead_band", "astern_asymmetry", "thrust_saturation", "thruster_gain")
"""Effects that take force from one actuator, each over another part of its range."""
RELATED = ("fouling", "hull_parameters", "shallow_water", "payload", "thruster_gain")
"""Effects that explain more or less of the same: those of mass, damping and strength."""


def test_pairs_are_of_known_effects_and_stand_once() -> None:
    known = {*effects(), "gusts", "waves"}
    pairs = [pair for pair, _ in PAIRS]
    assert len(set(pairs)) == len(pairs)
    assert set().union(*pairs) <= known


@pytest.mark.parametrize(("one", "other"), [*combinations(RELATED, 2), *combinations(OF_ACTUATORS, 2)])
def test_related_effects_have_a_manoeuvre_of_their_own(one: str, other: str) -> None:
    text = manoeuvre(one, [other])
    assert text is not None
    assert frozenset({one, other}) in dict(PAIRS)
    assert manoeuvre(other, [one]) == text


def test_nothing_to_tell_apart_needs_no_manoeuvre() -> None:
    assert manoeuvre("wind", []) is None


@pytest.mark.parametrize(("one", "other"), list(combinations_with_replacement(sorted(effects()), 2)))
def test_every_pair_has_a_manoeuvre_that_names_what_to_do(one: str, other: str) -> None:
    """A pair that nobody thought of is told apart by what shows the one and what shows the other."""
    text = manoeuvre(one, [other])
    assert text
    assert text == dict(PAIRS).get(frozenset({one, other})) or SHOWS.get(one, SHOWS.get(other, OTHERWISE)) in text


def test_a_pair_without_its_own_is_told_apart_by_what_shows_each() -> None:
    assert manoeuvre("payload", ["azimuth_resolution"]) == f"{SHOWS['payload']}; {SHOWS['azimuth_resolution']}"


def test_several_rivals_are_all_told_apart() -> None:
    text = manoeuvre("wind", ["current", "mooring"]) or ""
    pairs = dict(PAIRS)
    assert text == f"{pairs[frozenset({'wind', 'current'})]}; {pairs[frozenset({'wind', 'mooring'})]}"


@pytest.mark.parametrize("setting", FITTING)
def test_every_advice_of_a_setting_takes_the_place_of_some_general_one(setting: str) -> None:
    assert setting in SETTINGS
    every = [CALM, HULL_FIRST, OTHERWISE, *(text for _, text in PAIRS), *SHOWS.values()]
    for general, there in FITTING[setting]:
        assert any(general in text for text in every), general
        assert there != general
    for text in every:
        assert fitting(text, "") == text


def test_in_a_tank_nothing_of_the_air_is_asked_for() -> None:
    inside = [one for one in effects() if "tank" not in effects()[one].absent_in]
    asked = [manoeuvre(one, [other], "tank") or "" for one in inside for other in inside]
    asked += [shown_by(one, "tank") for one in inside] + [fitting(CALM, "tank"), fitting(HULL_FIRST, "tank")]
    asked += [sensor_of(one, "tank") for one in SENSORS]
    for text in asked:
        assert not {"air", "wind", "anemometer", "sea", "quay", "day"} & set(text.replace(",", "").split()), text
    assert sensor_of("wind", "tank") == ""
    assert sensor_of("wind", "sea") == "an anemometer"
    assert sensor_of("azimuth_resolution", "tank") == "feedback of each thruster's angle"


def test_at_sea_a_calm_is_waited_for() -> None:
    assert manoeuvre("waves", ["time_delay"], "sea") == "the same manoeuvres in shelter or on a calm day"
    assert manoeuvre("waves", ["time_delay"]) == "the same manoeuvres in still water"
    assert shown_by("waves", "harbour").startswith("station keeping in these waves")
