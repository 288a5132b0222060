"""Whole diagnoses of simulated logs: what is named, how large, since when, and what is left in doubt."""

from __future__ import annotations

import shutil
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from ferryid.diagnose.checks import screening
from ferryid.diagnose.data import measurements
from ferryid.diagnose.judging.diagnosis import Diagnosis, to_json
from ferryid.diagnose.pipeline import DiagnosisSettings, diagnose, diagnose_campaign
from ferryid.effects.thresholds import EFFECTS
from ferryid.simulate import Scenario, load_scenario, parse_scenario, scenarios, simulate, write_log
from ferryid.types import IN_MEMORY
from ferryid.vessel import load_profile

pytestmark = pytest.mark.slow

SHORT = Path(__file__).resolve().parents[2] / "fixtures" / "short.mcap"


def one_round(name: str, dwell_s: float = 60.0) -> Scenario:
    """Return a bundled scenario of one round or two of twelve minutes with one of them, of less time at each corner."""
    path = Path(scenarios.__file__).with_name(f"{name}.toml")
    text = path.read_text(encoding="utf-8").replace("rounds = 2", "rounds = 1")
    text = text.replace("dwell_s = 60", f"dwell_s = {dwell_s}").replace("from_s = 360", f"from_s = {6.0 * dwell_s}")
    return parse_scenario(text, name, path.parent)


def diagnosed(scenario: Scenario, folder: Path) -> Diagnosis:
    """Diagnose the log of a scenario, without the many messages of sensors that a diagnosis does not read."""
    log = folder / f"{scenario.name}.mcap"
    sensors = replace(scenario.sensors, imu_rate_hz=0.0, camera_rate_hz=0.0)
    write_log(simulate(replace(scenario, sensors=sensors)), log)
    return diagnose([str(log)], load_profile("milliampere"), DiagnosisSettings(), IN_MEMORY)[0]


@pytest.mark.parametrize("each", [False, True])
def test_every_log_is_read_aligned_and_checked_once(
    each: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    counts: Counter[str] = Counter()
    for module, name in ((measurements, "record"), (measurements, "align"), (screening, "examine")):
        stage = getattr(module, name)

        def counted(*args: object, name: str = name, stage: Callable[..., object] = stage, **more: object) -> object:
            counts[name] += 1
            return stage(*args, **more)

        monkeypatch.setattr(module, name, counted)
    logs = [str(shutil.copy(SHORT, tmp_path / f"{name}.mcap")) for name in "ab"]
    settings = DiagnosisSettings(each=each)
    made = diagnose(logs, load_profile("milliampere"), settings, IN_MEMORY)
    # As a campaign, the second is a copy and left out once it is read.
    assert [one.log for one in made] == (["a", "b"] if each else ["a"])
    assert counts == {"record": 2, "align": 2, "examine": 2}


def test_one_log_is_a_campaign_of_one() -> None:
    ferry, log = load_profile("milliampere"), str(SHORT)
    (alone,) = diagnose([log], ferry, DiagnosisSettings(), IN_MEMORY)
    (one,) = diagnose_campaign([log], ferry, DiagnosisSettings(), IN_MEMORY)
    assert to_json(alone) == to_json(one)


def test_a_thruster_that_gives_up_half_way_and_a_breeze(tmp_path: Path) -> None:
    result = diagnosed(one_round("thruster-fault", 40.0), tmp_path)
    assert result.verdict == "explained"
    fault, wind, *rest = result.findings
    assert (fault.effect, fault.instance, wind.effect) == ("thruster_gain", "thruster2", "wind")
    true = load_scenario("thruster-fault").wind
    # Gusts of 0.25 m/s have 21 nat, but their time constant is known to about half of itself, the limit of what is told.
    for gusts in rest:
        assert gusts.effect == "gusts"
        assert gusts.parameters["std"].value == pytest.approx(true.gust_std_mps, rel=0.25)
    assert fault.parameters["factor"].value == pytest.approx(0.6, abs=0.02)
    onset = fault.parameters["onset"]
    assert onset.low - 1.0 <= 240.0 <= onset.high + 1.0
    for name, value in (("north", 0.6), ("east", -0.4)):
        assert wind.parameters[name].low <= value <= wind.parameters[name].high
        assert wind.parameters[name].value == pytest.approx(value, abs=0.15)
    assert min(fault.probability, wind.probability) > 0.95
    assert fault.improvement["yaw"] > 0.8
    assert result.after["mse"]["yaw"] < 0.2 * result.before["mse"]["yaw"]
    moved = result.moved
    assert moved is not None
    # The profile's hull is the true one, so that no coefficient has reason to go beyond what chance lets it.
    assert 0.0 < abs(moved.deviations) < 3.0
    assert moved.value - moved.before == pytest.approx(moved.deviations * EFFECTS.hull_spread * abs(moved.before))


def test_gusts_make_a_delay_doubtful(tmp_path: Path) -> None:
    scenario = load_scenario("twelve-corner-gusty")
    result = diagnosed(scenario, tmp_path)
    wind = next(one for one in result.findings if one.effect == "wind")
    assert wind.parameters["north"].value == pytest.approx(scenario.wind.north_mps, abs=0.5)
    assert wind.parameters["east"].value == pytest.approx(scenario.wind.east_mps, abs=0.5)
    assert result.verdict == "partly_explained"
    for one in result.findings:
        if one.effect in ("time_delay", "thruster_lag"):
            assert one.probability <= 0.5
            assert "gusts" in one.unresolved_with


def test_a_calm_log_matches(tmp_path: Path) -> None:
    result = diagnosed(one_round("twelve-corner-calm"), tmp_path)
    assert result.verdict == "matched"
    assert result.findings == ()
    assert result.moved is None
    assert result.duration_s == pytest.approx(one_round("twelve-corner-calm").duration_s, abs=2.0)
    assert result.before["window_s"] == pytest.approx(8.0)


def test_a_squall_is_a_wind_that_gets_up_and_drops(tmp_path: Path) -> None:
    rows = [(0.0, 0.0), (272.0, 0.0), (287.0, 1.0), (412.0, 1.0), (427.0, 0.0)]
    text = "time,north,east\n" + "".join(f"{t:.1f},{3.4 * share:.3f},{-1.6 * share:.3f}\n" for t, share in rows)
    (tmp_path / "wind.csv").write_text(text, encoding="utf-8")
    scenario = (
        'schema = "ferryid.scenario/1"\nvessel = "milliampere"\npath = { kind = "twelve-corner", dwell_s = 40 }\n'
        'controller = { delta = 0.7, sigma = 0.7 }\nenvironment = { wind = { series = "wind.csv" } }\n'
        "true_hull = { m11 = 0.9, m22 = 1.1, m33 = 0.9, X_u = 1.1, Y_v = 0.9 }\n"
        "sensors = { imu_rate_hz = 0.0, camera_rate_hz = 0.0 }\n"
    )
    log = tmp_path / "squall.mcap"
    write_log(simulate(parse_scenario(scenario, "squall", tmp_path), 3), log)
    result = diagnose([str(log)], load_profile("milliampere"), DiagnosisSettings(), IN_MEMORY)[0]
    assert result.verdict == "explained"
    (wind,) = [one for one in result.findings if one.sure]
    assert wind.effect == "wind"
    assert all(
        wind.parameters[name].low < true < wind.parameters[name].high for name, true in (("north", 3.4), ("east", -1.6))
    )
    # It rises and falls within a quarter of a minute.
    assert wind.onset_s is not None
    assert wind.offset_s is not None
    assert 272.0 < wind.onset_s < 287.0
    assert 412.0 < wind.offset_s < 427.0
