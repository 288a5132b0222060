"""What to record next: every pair that is told apart is of effects that exist, once, and either way round."""

from __future__ import annotations

from itertools import combinations, combinations_with_replacement

import pytest

from ferryid.diagnose.judging.experiment_design import (
    CALM,
    EXCITES,
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
from ferryid.vessel.circumstances import ANYWHERE, Circumstances, Drive, drive_of
from ferryid.vessel.load import bundled, load_profile
from ferryid.vessel.profile import SETTINGS, Actuator

TANK = Circumstances("tank")
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
        assert fitting(text, ANYWHERE) == text


def test_in_a_tank_nothing_of_the_air_is_asked_for() -> None:
    inside = [one for one in effects() if "tank" not in effects()[one].absent_in]
    asked = [manoeuvre(one, [other], TANK) or "" for one in inside for other in inside]
    asked += [shown_by(one, TANK) for one in inside] + [fitting(CALM, TANK), fitting(HULL_FIRST, TANK)]
    asked += [sensor_of(one, TANK) for one in SENSORS]
    for text in asked:
        assert not {"air", "wind", "anemometer", "sea", "quay", "day"} & set(text.replace(",", "").split()), text
    assert sensor_of("wind", TANK) == ""
    assert sensor_of("wind", Circumstances("sea")) == "an anemometer"
    assert sensor_of("azimuth_resolution", TANK) == "feedback of each thruster's angle"


def test_at_sea_a_calm_is_waited_for() -> None:
    assert manoeuvre("waves", ["time_delay"], Circumstances("sea")) == "the same manoeuvres in shelter or on a calm day"
    assert manoeuvre("waves", ["time_delay"]) == "the same manoeuvres in still water"
    assert shown_by("waves", Circumstances("harbour")).startswith("station keeping in these waves")


PAIRED = [text for _, text in PAIRS]
EVERY_ADVICE = [CALM, HULL_FIRST, OTHERWISE, *PAIRED, *SHOWS.values(), *SENSORS.values(), *EXCITES.values()]
CANNOT = {
    "esso-osaka": ("each thruster", "thrusters", "speeds and angles", "sideways", "on the spot", "station keeping"),
    "kvlcc2-model": ("each thruster", "thrusters", "speeds and angles", "sideways", "on the spot", "station keeping"),
    "gunnerus": ("each thruster", "thrusters", "rudder", "sideways", "station keeping"),
    "vtec-usv": ("rudder", "and angles", "and angle ", "sideways", "station keeping"),
    "milliampere": ("rudder",),
}
"""What must not be asked of a vessel, for what drives it."""
FEEDBACK = ("feedback of each thruster's angle", "the other one")
"""What is said of effects that a vessel without thrusters that turn, or with one, cannot have."""


@pytest.mark.parametrize("name", CANNOT)
def test_what_a_vessel_cannot_do_is_not_asked_of_it(name: str) -> None:
    where = Circumstances("", Circumstances.of(load_profile(name)).drive)
    for text in EVERY_ADVICE:
        if not any(one in text for one in FEEDBACK):
            advice = fitting(text, where)
            assert not [words for words in CANNOT[name] if words in advice], (advice, text)


def test_a_propeller_with_a_rudder_is_tried_at_rudder_angles() -> None:
    there = Circumstances.of(load_profile("esso-osaka"))
    assert (
        shown_by("thruster_gain", there)
        == "several speeds of the propeller, ahead and astern, each at several rudder angles"
    )
    assert (
        shown_by("thruster_lag", there)
        == "steps of the propeller's speed from rest, and of the rudder's angle with way on"
    )
    assert sensor_of("thruster_gain", there) == "feedback of the propeller's speed or torque"


def test_a_vessel_that_pushes_every_way_gets_the_general_advice() -> None:
    for text in EVERY_ADVICE:
        assert fitting(text, Circumstances.of(load_profile("milliampere"))) == text


PROPELLER = Actuator("a", "propeller", (-1.0, 0.0))
TWO = ((-1.0, 0.5), (-1.0, -0.5))
DRIVES = [
    ([], Drive()),
    ([PROPELLER], Drive(single=True, turned=False, on_the_spot=False, sideways=False)),
    ([Actuator("a", "azimuth", (-1.0, 0.0))], Drive(single=True, sideways=False)),
    ([Actuator("a", "propeller", place) for place in TWO], Drive(turned=False, sideways=False)),
    ([Actuator("a", "propeller_rudder", place) for place in TWO], Drive(turned=False, rudder=True, sideways=False)),
    ([PROPELLER, Actuator("b", "tunnel", (1.0, 0.0), angle_rad=1.570796)], Drive(turned=False, sideways=False)),
    ([Actuator("a", "azimuth", (-1.0, 0.0)), Actuator("b", "azimuth", (1.0, 0.0))], Drive()),
]
"""A tunnel turns the vessel as it moves it sideways: two forces do not give three."""


@pytest.mark.parametrize(("actuators", "drive"), DRIVES)
def test_drive_of_actuators(actuators: list[Actuator], drive: Drive) -> None:
    assert drive_of(actuators) == drive


def test_two_rudders_have_their_angles() -> None:
    two = Circumstances("", Drive(turned=False, rudder=True, sideways=False))
    assert (
        shown_by("thruster_gain", two) == "each thruster alone, at several speeds and rudder angles, ahead and astern"
    )


def test_every_bundled_vessel_has_a_drive() -> None:
    assert {name: Circumstances.of(load_profile(name)).drive.rudder for name in bundled()} == {
        name: any(one.kind == "propeller_rudder" for one in load_profile(name).actuators) for name in bundled()
    }
