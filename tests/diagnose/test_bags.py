"""A recording cut into bags of seconds: together they are as much evidence as the whole, joined to it or one by one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from ferryid.diagnose import gathering
from ferryid.diagnose.judging.diagnosis import Diagnosis
from ferryid.diagnose.judging.finding import Finding
from ferryid.diagnose.pipeline import DiagnosisSettings, diagnose, diagnose_campaign
from ferryid.errors import FerryIdError
from ferryid.simulate import parse_scenario, simulate, write_log
from ferryid.types import IN_MEMORY
from ferryid.vessel import load_profile
from tests.ingest.bags import cut

pytestmark = pytest.mark.slow

FERRY = load_profile("milliampere")
TRIAL = """schema = "ferryid.scenario/1"
vessel = "milliampere"
path = { kind = "twelve-corner", dwell_s = 100, rounds = 1 }
controller = { delta = 0.4, sigma = 0.4 }
environment.wind = { north_mps = 2.5, east_mps = -2.0, gust_std_mps = 0.25, gust_time_s = 8 }
sensors = { imu_rate_hz = 0, camera_rate_hz = 0 }
thrusters.faults = [{ thruster = "thruster2", factor = 0.8, from_s = 0 }]
"""
WAVES = """schema = "ferryid.scenario/1"
vessel = "milliampere"
path = { kind = "twelve-corner", dwell_s = 60, rounds = 1 }
controller = { delta = 0.4, sigma = 0.4 }
environment.waves = { significant_height_m = 0.25, peak_period_s = 2.5, direction_deg = 40 }
sensors = { imu_rate_hz = 0, camera_rate_hz = 0 }
"""
BAGS = 60


def found(one: Diagnosis, effect: str) -> Finding:
    """Return a sure finding."""
    (finding,) = (each for each in one.findings if each.effect == effect and each.sure)
    return finding


def test_sixty_bags_of_twenty_seconds_tell_what_twenty_minutes_do(tmp_path: Path) -> None:
    log = tmp_path / "whole.mcap"
    write_log(simulate(parse_scenario(TRIAL, "whole", tmp_path)), log)
    (whole,) = diagnose([str(log)], FERRY, DiagnosisSettings(), IN_MEMORY)
    bags = diagnose_campaign(cut(log, BAGS), FERRY, DiagnosisSettings(), IN_MEMORY)
    assert len(bags) == BAGS
    one = found(whole, "thruster_gain").parameters["factor"]
    # A property is the vessel's, and stands with each log.
    same = found(bags[0], "thruster_gain")
    assert same.instance == "thruster2"
    every = same.parameters["factor"]
    assert every.low < 0.8 < every.high
    assert one.low < 0.8 < one.high
    assert every.high - every.low < 2.0 * (one.high - one.low)
    named = [{each.effect for each in bag.findings if each.sure} for bag in bags]
    assert all("wind" in each for each in named)
    assert not set().union(*named) - {"wind", "thruster_gain", "gusts"}
    winds = [found(bag, "wind").parameters for bag in bags]
    held = [
        each["north"].low < 2.5 < each["north"].high and each["east"].low < -2.0 < each["east"].high for each in winds
    ]
    assert sum(held) >= 0.9 * BAGS


def test_bags_that_follow_each_other_are_diagnosed_as_the_log_that_they_were_cut_from(tmp_path: Path) -> None:
    """Waves come and go too fast for a hull of other logs to show them, and a bag of 20 s is too short to learn them from."""
    log = tmp_path / "whole.mcap"
    write_log(simulate(parse_scenario(WAVES, "whole", tmp_path)), log)
    paths = cut(log, 36)
    (whole,) = diagnose([str(log)], FERRY, DiagnosisSettings(), IN_MEMORY)
    # They may be given in any order.
    (joined,) = diagnose(paths[::-1], FERRY, DiagnosisSettings(), IN_MEMORY)
    assert [part.path for part in joined.parts] == paths
    assert joined.verdict == whole.verdict
    assert "36 logs that follow each other without a break were joined into 1 log of 12 min." in joined.notes
    for name, one in found(whole, "waves").parameters.items():
        assert found(joined, "waves").parameters[name].value == pytest.approx(one.value, rel=0.02)
    each = diagnose(paths[:2], FERRY, DiagnosisSettings(each=True), IN_MEMORY)
    assert [one.path for one in each] == paths[:2]


def test_a_bag_that_cannot_be_used_takes_no_other_with_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    paths = bags_of_seconds(tmp_path)
    read = gathering.measure_log

    def refused(path: str, *others: Any, **more: Any) -> Any:
        if paths[1] in path:
            raise FerryIdError(f"{paths[1]}: its signals contradict each other")
        return read(path, *others, **more)

    monkeypatch.setattr(gathering, "measure_log", refused)
    found = gathering.gather(paths, FERRY, IN_MEMORY, join=True)
    assert [one.path for one in found.logs] == [paths[0], paths[2]]
    assert not found.parts
    assert any(note.startswith("Left out of the campaign") and paths[1] in note for note in found.notes)


def bags_of_seconds(folder: Path) -> list[str]:
    """Write three bags of one recording."""
    log = folder / "whole.mcap"
    write_log(simulate(parse_scenario(WAVES.replace("dwell_s = 60", "dwell_s = 6"), "whole", folder)), log)
    return cut(log, 3)
