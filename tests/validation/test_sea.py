"""Campaigns at sea: what is in their logs, what the oracle makes of them, and how they are scored."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from math import hypot
from typing import Any

import numpy as np
import pytest

from ferryid.diagnose.data.estimate import Estimate
from ferryid.errors import FerryIdError
from ferryid.validation import campaign_oracle as campaigns
from ferryid.validation.campaign_oracle import campaign_oracle, deviation, visible
from ferryid.validation.case import Case, Truth
from ferryid.validation.case_sampling import CLEAN_SEA, NOT_AT_SEA, SEA_LOGS, sample_cases
from ferryid.validation.log_generation import generate, profile_with_hull
from ferryid.validation.plant.effects import plant_effects
from ferryid.validation.plant.navigation import RATE_HZ
from ferryid.validation.plant.receiver import received
from ferryid.validation.plant.trial import Trial, instrument_motion, simulate_trial
from ferryid.validation.plant.vessels import VESSELS
from ferryid.validation.recorded.kinematic_sizes import SIGMAS
from ferryid.validation.records import CaseResult, Diagnosis, Finding, OracleEstimate, OracleResult
from ferryid.validation.scores import score
from ferryid.validation.sea import (
    GAP_S,
    HELD,
    LOG_S,
    _as_heard,
    campaign_trial,
    realised_at_sea,
    receiver_lag_s,
)
from ferryid.validation.worker import _campaign, _finding

# Whose first trial compiles: no second worker has to wait for it.
pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("validation plant")]


@cache
def case(cell: str) -> Case:
    return next(one for one in sample_cases(5, 0.2, [cell]) if one.cell == cell)


@cache
def trial(cell: str, number: int) -> Trial:
    return campaign_trial(case(cell), number)


def test_every_effect_but_three_is_concealed_in_ten_logs_with_a_wind() -> None:
    every = [one for one in sample_cases(5, 0.5, ["sea"]) if one.cell != CLEAN_SEA]
    assert {one.truths[0].effect for one in every} == set(plant_effects()) - set(NOT_AT_SEA)
    assert len([one for one in sample_cases(5, 0.5, ["sea"]) if one.cell == CLEAN_SEA]) == 3
    for one in every:
        assert one.logs == SEA_LOGS
        assert [truth.effect for truth in one.truths].count("wind") == 1
        wind = next(truth for truth in one.truths if truth.effect == "wind")
        assert one.conditions["wind"] == (wind.values["north"], wind.values["east"])
        assert one.conditions["gust_std"] > 0.0


def test_a_log_is_a_part_of_a_trial_the_same_each_time() -> None:
    lengths = [len(trial(CLEAN_SEA, number).t) / RATE_HZ for number in range(3)]
    assert all(LOG_S[0] - 0.1 <= one <= LOG_S[1] for one in lengths)
    assert len(set(lengths)) == 3
    again = campaign_trial(case(CLEAN_SEA), 1)
    assert np.array_equal(again.reported, trial(CLEAN_SEA, 1).reported)
    # It does not begin at rest.
    assert np.abs(trial(CLEAN_SEA, 0).states[0, 6:8]).max() > 1e-3


def test_the_wind_of_each_log_is_what_blew_in_it() -> None:
    found = realised_at_sea(case(CLEAN_SEA))
    for number in range(3):
        north, east = trial(CLEAN_SEA, number).plant.air.mean(axis=0)
        assert found[f"wind {number}"] == {"north": pytest.approx(north), "east": pytest.approx(east)}
    mean = case(CLEAN_SEA).truths[0].values
    apart = [hypot(one["north"] - mean["north"], one["east"] - mean["east"]) for one in found.values()]
    # It is never steady: no log has the mean of all.
    assert min(apart) > 1e-3


def test_a_delay_is_told_with_the_receivers_lag_and_a_load_comes_aboard() -> None:
    late = case("sea: time_delay")
    seconds = late.truths[0].values["seconds"]
    assert realised_at_sea(late)["time_delay"]["seconds"] == pytest.approx(seconds + receiver_lag_s(late))
    aboard = [trial("sea: payload", number).plant.world.payload.mass_kg for number in (3, 4)]
    assert aboard == [0.0, case("sea: payload").truths[0].values["mass"]]


def test_the_receiver_reports_the_motion_late_by_its_lag() -> None:
    whole = simulate_trial(VESSELS["ferry"], {}, "short", 4)
    lag = 0.4
    reported = received(whole, np.random.default_rng(1), lag, 1e-3)
    pose, rates = instrument_motion(whole.states)
    steps = round(lag * RATE_HZ)
    for truth, seen in ((pose[:, 0], reported[:, 0]), (rates[:, 2], reported[:, 5])):
        late, at_once = seen[steps:] - truth[:-steps], seen - truth
        assert np.std(late) < 0.3 * np.std(at_once)
    # Surge and sway are those of the velocity over ground, along the heading that is reported.
    north = reported[:, 3] * np.cos(reported[:, 2]) - reported[:, 4] * np.sin(reported[:, 2])
    assert np.std(north[steps:] - rates[:-steps, 0]) < 0.3 * np.std(north - rates[:, 0])


def test_the_errors_of_the_receiver_are_correlated() -> None:
    whole = simulate_trial(VESSELS["ferry"], {}, "short", 4)
    quiet, noisy = (received(whole, np.random.default_rng(1), 0.4, factor) for factor in (1e-6, 1.0))
    error = (noisy - quiet)[:, 5]
    assert np.corrcoef(error[1:], error[:-1])[0, 1] > 0.8


def test_samples_are_repeated_and_missing() -> None:
    from ferryid.validation.log_writer import streams

    stream = streams(trial(CLEAN_SEA, 0), 1)[0]
    heard = [_as_heard(stream, np.random.default_rng(seed)) for seed in range(12)]
    held, gaps = [], []
    for one in heard:
        x = one.columns["pose.pose.position.x"]
        held.append(np.mean(np.diff(x) == 0.0))
        gaps.append(np.diff(one.stamp_ns).max() * 1e-9)
        assert np.all(np.diff(one.receive_ns) >= 0)
    assert np.mean(held) == pytest.approx(HELD, rel=0.3)
    assert max(gaps) > GAP_S[0]
    assert min(gaps) < 0.2, "some logs have no gap"
    assert max(gaps) < 2.0 * GAP_S[1] + 0.2


def test_a_campaign_is_written_with_a_profile_that_has_no_hull_model(tmp_path) -> None:
    few = replace(case(CLEAN_SEA), logs=2, format="mcap", name="07")
    made = generate(few, tmp_path)
    assert [path.name for path in (made.log, *made.more)] == ["07-0.mcap", "07-1.mcap"]
    assert {path.name for path in tmp_path.iterdir()} == {"07-0.mcap", "07-1.mcap", "vessel.toml"}
    assert "[hull.M]" not in made.profile.read_text("utf-8")
    assert "[hull.M]" in profile_with_hull(few)


def test_the_oracles_deviation_has_no_bias() -> None:
    rng = np.random.default_rng(3)
    # Gains of three parameters in whitened data that differ by 5 in one of them: half the square of what is fitted.
    gains = 0.5 * np.sum((rng.standard_normal((20_000, 3)) + np.array([5.0, 0.0, 0.0])) ** 2, axis=1)
    found = [deviation(OracleEstimate("wind", None, float(gain), 3, 1.0)) ** 2 for gain in gains]
    assert np.mean(found) == pytest.approx(25.0, rel=0.02)


def test_what_an_oracle_sees_of_one_parameter_is_seen_by_a_normal_test_too() -> None:
    assert visible(1) == pytest.approx(SIGMAS, rel=1e-3)
    # Twenty parameters give chance more room.
    assert visible(20) > 1.4 * visible(1)


def test_the_oracles_of_the_logs_are_added_up(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def of_log(log: str, profile: Any, truths: Any, *, fewest_windows: int) -> OracleResult:
        asked.append((log, [one.effect for one in truths]))
        if log == "c":
            raise FerryIdError("too short")
        return OracleResult(9.0, tuple(OracleEstimate(one.effect, None, 3.0, 2, 1.0) for one in truths), 1.0)

    monkeypatch.setattr(campaigns, "oracle", of_log)
    profile: Any = None
    found = campaign_oracle(["a", "b", "c", "d"], profile, (DRAG, WIND), first_log=1)
    assert asked == [
        ("a", ["wind"]),
        ("b", ["current", "wind"]),
        ("c", ["current", "wind"]),
        ("d", ["current", "wind"]),
    ]
    assert [(one.effect, one.gain, one.free) for one in found.recovered] == [("current", 6.0, 4), ("wind", 9.0, 6)]
    # Where the effect is in no log that can be used, there is no gain.
    (current, _) = campaign_oracle(["a", "c"], profile, (DRAG, WIND), first_log=1).recovered
    assert (current.gain, bool(current.cannot)) == (0.0, True)
    with pytest.raises(FerryIdError, match="too short"):
        campaign_oracle(["c"], profile, (WIND,))


def test_a_property_is_the_mean_over_the_logs_and_waves_are_those_of_each() -> None:
    loss = realised_at_sea(replace(case("sea: thrust_inflow_loss"), logs=2))
    assert set(loss) == {"wind 0", "wind 1", "thrust_inflow_loss"}
    waves = realised_at_sea(replace(case("sea: waves"), logs=2))
    assert set(waves) == {"wind 0", "wind 1", "waves 0", "waves 1"}


def test_a_campaigns_finding_is_that_of_the_log_of_middle_probability() -> None:
    def one(probability: float, north: float) -> dict[str, Any]:
        found = {"effect": "wind", "instance": None, "probability": probability, "parameters": {"north": north}}
        more = {"improvement": {}, "unresolved_with": [], "rivals": [], "where": {"onset": None, "offset": None}}
        more |= {"says": "The wind blew."}
        return {"findings": [found | more], "notes": []}

    (found,) = _campaign([one(0.9, 1.0), one(0.99, 2.0), one(0.95, 3.0)])["findings"]
    assert (_finding(found)["log"], found["parameters"]) == (2, {"north": 3.0})


WIND = Truth("wind", None, {"north": 3.0, "east": 4.0})
DRAG = Truth("current", None, {"north": 0.1, "east": 0.0})


def result(truths: tuple[Truth, ...], findings: list[Finding], gains: dict[str, float], size: float) -> CaseResult:
    one = Case("1", "sea", "sea", "ferry", "short", "mcap", 1, None, size, truths, ("gusts",), logs=10)
    oracle = OracleResult(0.0, tuple(OracleEstimate(name, None, gain, 2, 1.0) for name, gain in gains.items()), 1.0)
    realised = {"wind 3": {"north": 2.0, "east": 4.0}}
    return CaseResult(one, realised, Diagnosis("explained", 2.0, tuple(findings)), {"oracle": oracle})


def found(effect: str, log: int, **values: float) -> Finding:
    return Finding(effect, None, 1.0, {name: Estimate(x, x - 0.1, x + 0.1, "") for name, x in values.items()}, log=log)


def test_campaigns_are_scored_apart_from_what_an_oracle_sees_twice_on() -> None:
    twice = 0.5 * ((2.0 * visible(2)) ** 2 + 2.0) + 1e-6
    wind = found("wind", 3, north=2.0, east=4.0)
    every = [
        result((DRAG, WIND), [wind, found("current", 0, north=0.1, east=0.0)], {"current": twice, "wind": twice}, 0.1),
        result((DRAG, WIND), [wind], {"current": twice, "wind": twice}, 0.1),
        # Less than the oracle sees of it twice over: it may be missed.
        result((DRAG, WIND), [], {"current": 0.9 * twice, "wind": 1.0}, 0.1),
        result((WIND,), [found("gusts", 0), found("mooring", 0)], {"wind": 1.0}, 0.0),
    ]
    scores = score(every)
    assert scores.runs == 0
    sea = scores.sea
    assert sea is not None
    assert (sea.named.count, sea.named.of) == (1, 3)
    assert (sea.named_from_twice.count, sea.named_from_twice.of) == (1, 2)
    assert (sea.winds_from_twice.count, sea.winds_from_twice.of) == (2, 2)
    assert (sea.false.count, sea.false.of) == (1, 4)
    assert [one.wrong for one in sea.campaigns] == [(), (), (), ("mooring",)]
    assert [one.missed for one in sea.campaigns] == ["", "the wind of the day alone was named", "none", ""]
    # The wind is held against that of the log that the finding is of.
    (of_wind,) = [one for one in sea.recoveries if one.effect == "wind"]
    assert of_wind.errors == pytest.approx((0.0, 0.0))
    assert type(scores).from_json(scores.to_json()).sea == sea
