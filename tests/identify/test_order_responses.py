"""How orders are followed: found in simulated trials of which no feedback is mapped, and nowhere else."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from ferryid.errors import FerryIdError
from ferryid.identify import pipeline
from ferryid.identify.order_responses import estimate_order_responses
from ferryid.identify.outcome import EstimatedResponse
from ferryid.identify.settings import FitSettings
from ferryid.signals.prepare import Opened, open_track
from ferryid.simulate import load_scenario, simulate, write_log
from ferryid.types import RunContext
from ferryid.vessel import load_profile, parse_profile
from tests.simulate.order_boat import profile_text, sailed

LAG_S, DELAY_S = 0.6, 0.25


def opened(path: Path, *lines: str, feedback: bool = False) -> Opened:
    return open_track(str(path), parse_profile(profile_text(*lines, feedback=feedback), "boat.toml"), None)


def responses(path: Path, *lines: str, feedback: bool = False) -> tuple[EstimatedResponse, ...]:
    profile = parse_profile(profile_text(*lines, feedback=feedback), "boat.toml")
    return estimate_order_responses([opened(path, *lines, feedback=feedback)], profile, FitSettings().on(profile))


@pytest.fixture(scope="module")
def trials(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Trials in which orders are followed at once, with a lag, and with a lag and a delay."""
    stated = {
        "at once": ("time_constant_s = 0",),
        "lag": (f"time_constant_s = {LAG_S}",),
        "both": (f"time_constant_s = {LAG_S}", f"delay_s = {DELAY_S}"),
    }
    paths = {}
    for name, lines in stated.items():
        folder = tmp_path_factory.mktemp("trials")
        paths[name] = folder / "trial.mcap"
        write_log(sailed(folder, *lines), paths[name])
    return paths


def test_a_time_constant_comes_back_within_its_interval(trials: dict[str, Path]) -> None:
    (found,) = responses(trials["lag"])
    assert found.orders == ("left.speed.command", "right.speed.command")
    assert found.low[0] < LAG_S < found.high[0]
    assert found.high[0] - found.low[0] < 0.3 * LAG_S
    assert found.times[1] == found.low[1] == found.high[1] == 0.0
    assert found.error < 0.2


def test_a_lag_and_a_delay_are_found_beside_each_other(trials: dict[str, Path]) -> None:
    (found,) = responses(trials["both"])
    assert sum(found.times) == pytest.approx(LAG_S + DELAY_S, rel=0.08)
    assert found.times[1] == pytest.approx(DELAY_S, abs=0.1)


def test_nothing_is_said_of_orders_that_are_followed_at_once(trials: dict[str, Path]) -> None:
    assert responses(trials["at once"]) == ()


def test_no_response_is_said_of_orders_that_the_vessel_goes_against(trials: dict[str, Path]) -> None:
    """Of propellers whose sign is wrong the lag would be right, and a fit says at length what is wrong."""
    assert responses(trials["lag"], "sign = -1") == ()


def test_nothing_is_estimated_of_what_is_stated_or_measured(
    trials: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With feedback a fit has no more to do than before: no window is made for it."""
    monkeypatch.setattr("ferryid.identify.order_responses.prepared_data", lambda *given: pytest.fail("was estimated"))
    assert responses(trials["lag"], feedback=True) == ()
    assert responses(trials["lag"], f"time_constant_s = {LAG_S}") == ()
    assert responses(trials["lag"], "delay_s = 0") == ()


def test_what_is_found_goes_into_the_profile_as_it_is_written(trials: dict[str, Path]) -> None:
    (found,) = responses(trials["both"])
    stated = parse_profile(profile_text(*found.lines), "boat.toml")
    for signal in stated.signals[-2:]:
        assert (signal.time_constant_s, signal.delay_s) == pytest.approx(found.times, rel=0.05)
    assert [line.partition(" = ")[0] for line in found.lines] == ["time_constant_s", "delay_s"]


def test_the_sentence_has_intervals_tables_and_lines() -> None:
    found = EstimatedResponse(("a.force.command", "b.force.command"), (0.0, 0.234), (0.0, 0.22), (0.0, 0.25), 0.41)
    assert str(found) == (
        "The orders of a.force and b.force are followed with a delay of 0.23 s (95 % interval 0.22 to 0.25 s), estimated; the "
        'fit took them as followed at once. State it in the profile, in [signals."a.force.command"] and '
        '[signals."b.force.command"]: delay_s = 0.23 (accelerations then err by 59 % less, squared). A navigation that is as '
        "late looks alike."
    )


def fitted(path: Path, tmp_path: Path, *lines: str) -> pipeline.FitOutcome:
    profile = parse_profile(profile_text(*lines), "boat.toml")
    return pipeline.fit_logs([str(path)], profile, FitSettings(draws=20), RunContext(tmp_path))


def test_a_fit_says_it_and_errs_less_where_it_is_stated(trials: dict[str, Path], tmp_path: Path) -> None:
    plain = fitted(trials["lag"], tmp_path)
    (found,) = plain.order_responses
    assert plain.warnings[0] == str(found)
    stated = fitted(trials["lag"], tmp_path, *found.lines)
    assert stated.order_responses == ()
    assert not any("estimated; the fit took" in said for said in stated.warnings)
    assert stated.scores.force.mse_model[0] < 0.3 * plain.scores.force.mse_model[0]


def test_a_fit_that_is_refused_says_it_too(trials: dict[str, Path], tmp_path: Path, monkeypatch) -> None:
    def refuse(*given: object) -> None:
        raise FerryIdError("trial: refused. Fix: correct it")

    monkeypatch.setattr(pipeline, "estimator_for", refuse)
    with pytest.raises(FerryIdError, match=r"^trial: refused\. The orders of left\.speed .* alike\. Fix: correct it$"):
        fitted(trials["lag"], tmp_path)
    with pytest.raises(FerryIdError, match=r"^trial: refused\. Fix: correct it$"):
        fitted(trials["at once"], tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize(("lag_s", "shown"), [(0.0, False), (1.0, True)])
def test_a_controller_that_answers_disturbances_is_no_delay(tmp_path: Path, lag_s: float, shown: bool) -> None:
    """A controller's orders answer gusts, so that orders of before explain them: as if they were followed late."""
    scenario = load_scenario("twelve-corner-gusty" if not shown else "twelve-corner")
    thrusters = replace(scenario.thrusters, speed_lag_s=lag_s, speed_rate_rpmps=1e6, azimuth_lag_s=0.0)
    sensors = replace(scenario.sensors, imu_rate_hz=0.0, camera_rate_hz=0.0)
    write_log(simulate(replace(scenario, thrusters=thrusters, sensors=sensors)), tmp_path / "trial.mcap")
    bundled = load_profile("milliampere")
    profile = replace(
        bundled, signals=tuple(one for one in bundled.signals if "thruster" not in one.topic or one.is_order)
    )
    found = estimate_order_responses(
        [open_track(str(tmp_path / "trial.mcap"), profile, None)], profile, FitSettings().on(profile)
    )
    assert [one.orders for one in found] == ([("thruster1.speed.command", "thruster2.speed.command")] if shown else [])
    for one in found:
        assert one.low[0] < lag_s < one.high[0]
