"""Real recordings: no environment in a towing tank, defects that raw rows show, and a hidden wind from a common hull."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.diagnose.checks import examine
from ferryid.diagnose.data.measurements import read_measurements
from ferryid.diagnose.inference.campaign import fit_campaign
from ferryid.diagnose.inference.campaign_hull import INDUCED, CampaignHull, fit_campaign_hull
from ferryid.diagnose.pipeline import DiagnosisSettings, diagnose
from ferryid.effects import effects
from ferryid.types import IN_MEMORY, no_progress
from ferryid.vessel import load_profile
from tests.diagnose.trials import averaged
from tests.real.campaign_evidence import MIRRORED, placebos

pytestmark = pytest.mark.slow

Locate = Callable[[str], Path]
ENVIRONMENT = {"wind", "current", "gusts", "waves", "mooring", "shallow_water"}


@pytest.mark.parametrize("run", ["Z_20_10_S", "Z_10_05"])
def test_no_environment_is_named_in_a_towing_tank(run: str, shared_data: Locate) -> None:
    tanker = load_profile("kvlcc2-model")
    esso = load_profile("esso-osaka")
    assert esso.wind is not None
    # The profile has no wind areas; with some a wind could be named, and must not be.
    scale = (tanker.hull.length_m / esso.hull.length_m) ** 2
    areas = replace(
        esso.wind, frontal_m2=scale * esso.wind.frontal_m2, lateral_m2=scale * esso.wind.lateral_m2, length_m=7.0
    )
    log = shared_data(f"kvlcc2/HSVA_CPMC_KVLCC2_{run}.dat")
    found = diagnose([str(log)], replace(tanker, wind=areas), DiagnosisSettings(), IN_MEMORY)[0]
    assert not ENVIRONMENT & {finding.effect for finding in found.findings}
    # One log alone knows too little of the hull to name any force.
    assert not any(finding.sure for finding in found.findings if finding.effect in effects())
    assert any("no hull model" in note for note in found.notes)


def test_zigzags_of_one_tanker_show_one_law_and_no_log_has_its_own(shared_data: Locate) -> None:
    logs = [str(shared_data(f"kvlcc2/HSVA_CPMC_KVLCC2_Z_{run}.dat")) for run in ("10_05", "20_10_S", "30_05", "35_05")]
    every = diagnose(logs, load_profile("kvlcc2-model"), DiagnosisSettings(together=True), IN_MEMORY)
    laws = {tuple((term.on, term.quantity) for term in one.law) for made in every for one in made.findings if one.sure}
    # Nothing with a name is sure; the law is the same wherever it is told.
    assert len(laws) == 1
    assert () not in laws
    assert all("holds in all" in one.says for made in every for one in made.findings if one.sure)


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


def test_a_common_hull_points_to_the_hidden_wind_and_a_mirrored_one_does_not(shared_data: Locate) -> None:
    vessel = load_profile("esso-osaka")
    logs = sorted(str(path) for path in shared_data("esso_osaka/random").glob("*.csv"))
    joint = fit_campaign(averaged(logs, vessel, withhold=("wind",)), vessel, no_progress)
    hidden = [read_measurements(log, vessel)[0].wind for log in logs]
    true = np.array([wind.mean(axis=0) for wind in hidden if wind is not None])
    mirrored = placebos(joint.members)[MIRRORED]
    spread, lift = np.split(joint.hull.spread, [-len(INDUCED)])
    found = np.median(off(joint.hull, true))
    assert found < 25.0
    assert np.median(off(fit_campaign_hull(mirrored, spread, lift), true)) > 40.0


def off(hull: CampaignHull, true: np.ndarray) -> np.ndarray:
    """Return how far the winds of all logs point away from the true ones [deg]."""
    found = np.array([values[0] for values in hull.values])
    apart = np.degrees(np.arctan2(found[:, 1], found[:, 0]) - np.arctan2(true[:, 1], true[:, 0]))
    return np.abs((apart + 180.0) % 360.0 - 180.0)
