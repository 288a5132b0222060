"""What the sensors of a profile distinguish: groups by hand, a simulated log read as the sensors allow, one more sensor."""

from __future__ import annotations

import json
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from ferryid import api
from ferryid.diagnose.judging import EffectVisibility, Key, Likeness, Pair
from ferryid.errors import FerryIdError
from ferryid.identifiability import as_json, as_text, study
from ferryid.identifiability.sensors import FEEDBACK, further, mapped, reading
from ferryid.identifiability.study import Assessment, Study
from ferryid.identifiability.trial import Trial, generic_hull, usual_trial
from ferryid.vessel import load_profile
from ferryid.vessel.profile import Profile

FERRY, REVOLT = load_profile("milliampere"), load_profile("revolt")
NAMES = ("wind", "current", "mooring", "payload", "fouling", "time_delay")
KEYS: tuple[Key, ...] = tuple((name, None) for name in NAMES)


def assessed(
    alike: set[tuple[int, int]], hidden: set[int], sensors: frozenset[str], measured: tuple[str, ...] = ()
) -> Assessment:
    effects = tuple(
        EffectVisibility(name, None, name.capitalize(), 1.0 if k in hidden else 50.0, 0.0)
        for k, name in enumerate(NAMES)
    )
    pairs = tuple(
        Pair(KEYS[i], KEYS[j], 0.9 if (i, j) in alike else 0.1, 0.5, alike=(i, j) in alike)
        for i in range(len(NAMES))
        for j in range(i + 1, len(NAMES))
    )
    return Assessment(sensors, Likeness(effects, np.eye(len(NAMES)), pairs), measured)


OWN = assessed({(0, 1), (1, 2)}, {3}, frozenset({"position", "heading"}))


def test_effects_that_look_alike_one_with_the_next_are_one_group() -> None:
    assert OWN.groups == (KEYS[:3],)
    assert OWN.apart == {KEYS[4], KEYS[5]}
    two = assessed({(0, 1), (2, 5)}, set(), frozenset())
    assert {frozenset(group) for group in two.groups} == {frozenset(KEYS[:2]), frozenset((KEYS[2], KEYS[5]))}


def test_the_sensor_that_distinguishes_most_is_named_and_none_that_adds_nothing() -> None:
    trial = Trial(usual_trial(FERRY).scenario, FERRY, "A trial.")
    wind = assessed({(1, 2)}, {3}, OWN.sensors | {"wind"}, ("wind",))
    gyro = assessed({(0, 1), (1, 2)}, {3}, OWN.sensors | {"yaw_rate"})
    found = Study(trial, OWN, (("wind", wind), ("yaw_rate", gyro)))
    assert found.best == "wind"
    assert Study(trial, OWN, (("yaw_rate", gyro),)).best is None
    text = as_text(found)
    assert "an anemometer: distinguishes 1 more effect (steady wind)" in text
    assert "a gyro: distinguishes no more" in text
    assert "An anemometer would separate most." in text
    assert [one["gained"] for one in as_json(found)["further"]] == [1, 0]


def test_that_no_further_sensor_separates_more_is_said_of_every_profile() -> None:
    trial = Trial(usual_trial(FERRY).scenario, FERRY, "A trial.")
    gyro = assessed({(0, 1), (1, 2)}, {3}, OWN.sensors | {"yaw_rate"})
    assert "No further sensor would separate more on this trial" in as_text(Study(trial, OWN, (("yaw_rate", gyro),)))
    assert "No further sensor would separate more: the profile maps every kind" in as_text(Study(trial, OWN, ()))


def test_sensors_that_a_profile_maps_and_may_map() -> None:
    assert further(FERRY) == ()
    assert further(REVOLT) == ("current", "payload")
    dark = without(FERRY, "wind", *(f"{one.name}.speed" for one in FERRY.actuators))
    assert FEEDBACK not in mapped(dark)
    assert further(dark) == ("wind", FEEDBACK)
    assert further(replace(dark, wind=None)) == (FEEDBACK,)
    # In a tank there is nothing to measure.
    assert further(replace(REVOLT, setting="tank")) == ("payload",)


def test_without_feedback_the_orders_are_read() -> None:
    known = {one.quantity: one.topic for one in reading(FERRY, {"position", "heading"}).signals}
    assert known["thruster1.speed.command"] == "/thruster1/command"
    assert not {"velocity", "thruster1.speed"} & known.keys()
    assert {one.quantity: one.topic for one in reading(FERRY, {FEEDBACK}).signals}[
        "thruster2.angle"
    ] == "/thruster2/state"


@pytest.mark.parametrize("name", ["milliampere", "revolt", "vtec-usv", "gunnerus", "kvlcc2-model", "esso-osaka"])
def test_every_vessel_has_a_trial_of_its_scale(name: str) -> None:
    profile = load_profile(name)
    trial = usual_trial(profile)
    assert trial.vessel.hull.has_model
    assert ("generic hull" in trial.says) is not profile.hull.has_model
    assert trial.scenario.manoeuvre.kind == ("" if name in ("milliampere", "revolt") else "zigzag")
    assert 300.0 < trial.scenario.duration_s < 2500.0


def test_a_generic_hull_damps_and_is_heavier_than_its_rigid_body() -> None:
    hull = generic_hull(load_profile("vtec-usv"))
    rigid = load_profile("vtec-usv").hull
    assert all(value < 0.0 for value in hull.D.values())
    assert (np.linalg.eigvalsh(hull.M - rigid.M) > 0.0).all()


def test_a_vessel_without_actuators_is_refused_in_one_line() -> None:
    with pytest.raises(FerryIdError, match=r"found no actuator in the profile\. Fix: "):
        usual_trial(replace(FERRY, actuators=()))


def without(profile: Profile, *quantities: str) -> Profile:
    return replace(profile, signals=tuple(one for one in profile.signals if one.quantity not in quantities))


@pytest.mark.slow
def test_an_anemometer_separates_the_wind_and_a_compass_everything() -> None:
    blind = study(without(FERRY, "wind", "current"))
    assert {key for group in blind.own.groups for key in group} >= {
        ("wind", None),
        ("current", None),
        ("mooring", None),
    }
    assert blind.best in ("wind", "current")
    assert all(len(one.apart) > len(blind.own.apart) for _, one in blind.with_further)
    lost = study(without(FERRY, "heading"))
    assert lost.own.likeness is None
    assert "heading" in lost.own.reason
    assert lost.best == "heading"
    assert "Nothing can be distinguished" in as_text(lost)
    schema = json.loads(files("ferryid.schemas").joinpath("vessel-check.json").read_text("utf-8"))
    for found in (blind, lost):
        jsonschema.validate(
            {"schema": "ferryid.vessel-check/1", "file": "", "faults": [], "identifiability": as_json(found)}, schema
        )


def test_a_profile_with_faults_is_not_simulated(tmp_path: Path) -> None:
    file = tmp_path / "boat.toml"
    file.write_text(FERRY.text.replace("mass_kg = 1670.0", "mass_kg = -1.0"), encoding="utf-8")
    assert "identifiability" not in api.check_vessel(file, identifiable=True).json
