"""Real recordings: no environment in a towing tank, defects that raw rows show, and a withheld wind from a campaign."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from ferryid.diagnose.checks import examine
from ferryid.diagnose.data.measurements import read_measurements
from ferryid.diagnose.inference.campaign import assemble
from ferryid.diagnose.inference.campaign_model import Campaign
from ferryid.diagnose.judging.campaign_conditions import judge_conditions
from ferryid.diagnose.judging.campaign_evidence import MIRRORED
from ferryid.diagnose.judging.finding import UNKNOWN
from ferryid.diagnose.pipeline import DiagnosisSettings, diagnose
from ferryid.effects import effects
from ferryid.types import IN_MEMORY, no_progress
from ferryid.vessel import load_profile
from tests.diagnose.trials import averaged
from tests.real import esso
from tests.real.campaign import tanker_with_areas

pytestmark = pytest.mark.slow

Locate = Callable[[str], Path]
ENVIRONMENT = {"wind", "current", "gusts", "waves", "mooring", "shallow_water"}


@pytest.mark.parametrize("run", ["Z_20_10_S", "Z_10_05"])
def test_no_environment_is_named_in_a_towing_tank(run: str, shared_data: Locate) -> None:
    # The profile has no wind areas; with some a wind could be named, and must not be.
    log = shared_data(f"kvlcc2/HSVA_CPMC_KVLCC2_{run}.dat")
    found = diagnose([str(log)], tanker_with_areas(), DiagnosisSettings(), IN_MEMORY)[0]
    assert not ENVIRONMENT & {finding.effect for finding in found.findings}
    # One log alone knows too little of the hull to name any force.
    assert not any(finding.sure for finding in found.findings if finding.effect in effects())
    assert any("no hull model" in note for note in found.notes)


def test_zigzags_of_one_tanker_show_one_law_and_no_log_has_its_own(shared_data: Locate) -> None:
    logs = [str(shared_data(f"kvlcc2/HSVA_CPMC_KVLCC2_Z_{run}.dat")) for run in ("10_05", "20_10_S", "30_05", "35_05")]
    every = diagnose(logs, load_profile("kvlcc2-model"), DiagnosisSettings(), IN_MEMORY)
    sure = [one for made in every for one in made.findings if one.sure]
    # Nothing with a name is sure; the law is the same wherever it is found. What comes and goes in one log is no law.
    assert {one.effect for one in sure} == {UNKNOWN}
    assert len({tuple((term.on, term.quantity) for term in one.law) for one in sure if one.law}) == 1
    assert all("holds in all" in one.says for one in sure if one.law)


@pytest.mark.parametrize(
    ("bag", "seconds"), [("exp52_v_2016-02-11-11-14-28", 30.0), ("exp39_1_2016-02-11-10-47-10", 4.0)]
)
def test_a_boat_driven_past_its_recorded_orders_is_noticed(bag: str, seconds: float, shared_data: Locate) -> None:
    measurements, _ = read_measurements(str(shared_data(f"vtec_usv/{bag}.bag")), load_profile("vtec-usv"))
    found = {finding.effect: finding for finding in examine(measurements)[0]}
    assert found["unrecorded_force"].parameters["duration"].value == pytest.approx(seconds, abs=1.0)


@pytest.mark.parametrize("bag", ["48000_2016-02-11-10-52-07", "52000_2016-02-11-10-40-10"])
def test_a_position_on_a_grid_is_not_held(bag: str, shared_data: Locate) -> None:
    measurements, _ = read_measurements(str(shared_data(f"vtec_usv/{bag}.bag")), load_profile("vtec-usv"))
    assert "held_samples" not in {finding.effect for finding in examine(measurements)[0]}


def test_equal_readings_in_gunnerus_interpolated_table_are_not_held(shared_data: Locate) -> None:
    measurements, _ = read_measurements(str(shared_data("gunnerus/RVG_ManeuveringTests.csv")), load_profile("gunnerus"))
    assert "held_samples" not in {finding.effect for finding in examine(measurements)[0]}


def test_the_receiver_of_milliampere_is_late(shared_data: Locate) -> None:
    measurements, _ = read_measurements(str(shared_data("milliampere1")), load_profile("milliampere-2025"))
    found = {finding.effect: finding for finding in examine(measurements)[0]}
    # Cross-correlation of the slope of the position with the velocity, on the raw rows: 0.25 to 0.30 s.
    late = found["clock_offset"].parameters["seconds"]
    assert late.low < -0.275 < late.high


@cache
def assembled(folder: Path) -> tuple[Campaign, dict[str, int]]:
    """Return the runs of Esso Osaka in a folder as a campaign, with the wind withheld."""
    logs = sorted(str(path) for path in folder.glob("*.csv"))
    made = assemble(averaged(logs, esso.ESSO, withhold=("wind",)), esso.ESSO)
    assert made is not None
    return made


def test_a_campaign_confirms_the_withheld_wind_and_no_current(shared_data: Locate) -> None:
    campaign, place = assembled(shared_data("esso_osaka/random"))
    judged = judge_conditions(campaign, place, no_progress)
    assert [one.effect for one in judged.tests if one.confirmed] == ["wind"]
    assert len(place) == 9
    measured, found = [], []
    for path in place:
        (claim,) = judged.claims(path)
        assert claim.finding.effect == "wind"
        assert claim.finding.sure
        wind = read_measurements(path, esso.ESSO)[0].wind
        assert wind is not None
        measured.append(wind.mean(axis=0))
        found.append([claim.finding.parameters[name].value for name in ("north", "east")])
    apart = esso.bearing(np.array(found)) - esso.bearing(np.array(measured))
    assert np.median(np.abs((apart + 180.0) % 360.0 - 180.0)) < 15.0


@cache
def mirrored(folder: Path) -> frozenset[str]:
    """Return the conditions that are confirmed on mirrored headings, where none can be true."""
    campaign, place = assembled(folder)
    judged = judge_conditions(esso.controls(campaign)[MIRRORED], place, no_progress)
    return frozenset(one.effect for one in judged.tests if one.confirmed)


def test_no_condition_is_confirmed_on_mirrored_headings(shared_data: Locate) -> None:
    assert mirrored(shared_data("esso_osaka/random")) == frozenset()
