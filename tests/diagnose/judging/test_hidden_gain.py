"""The share of a hidden sensor's held-out gain: all of it where the estimate is the truth, none where it is wrong."""

from __future__ import annotations

from dataclasses import replace
from math import isnan

import numpy as np
import pytest

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.campaign_logs import Member
from ferryid.diagnose.judging.campaign_conditions import judge_conditions
from ferryid.diagnose.judging.diagnosis import Withheld
from ferryid.diagnose.judging.hidden_gain import HiddenGain, bridged, gain_of
from ferryid.diagnose.judging.hidden_signal import with_gains
from ferryid.types import no_progress
from ferryid.vessel import load_profile
from ferryid.vessel.wind import wind_force
from tests.diagnose.inference.test_campaign_estimation import WINDS, campaign
from tests.diagnose.judging.test_held_out import sailed

FERRY = load_profile("milliampere")
BLOCKS = np.array([4.0, 6.0, 5.0, 5.0])


def test_the_share_is_of_what_was_measured_with_its_interval() -> None:
    half = HiddenGain.of(0.5 * BLOCKS, BLOCKS, 3)
    assert (half.share, half.low, half.high) == pytest.approx((0.5, 0.5, 0.5))
    assert half.says("wind") == (
        "Held out over all 3 logs, the wind as it was measured gains +20 nat (+18 to +23); the estimated one, steady in each "
        "log, +10 nat (+9 to +12): 50 % of it (50 to 50 %)."
    )
    assert (
        HiddenGain.of(0.5 * BLOCKS, BLOCKS, 1)
        .says("wind")
        .startswith("Held out, the wind as it was measured gains +20")
    )
    assert half.to_json()["share"] == {"value": half.share, "low": half.low, "high": half.high}
    scattered = HiddenGain.of(np.array([5.0, 0.0, 4.0, 1.0]), BLOCKS, 3)
    assert scattered.low < scattered.share < scattered.high


def test_of_what_may_be_nothing_there_is_no_share() -> None:
    none = HiddenGain.of(BLOCKS, np.array([-4.0, 6.0, -5.0, 5.0]), 2)
    assert isnan(none.share)
    assert none.to_json()["share"] is None
    assert "no share of it can be given" in none.says("current")


def test_the_sentence_stands_with_the_signal_that_was_hidden() -> None:
    gain = HiddenGain.of(0.5 * BLOCKS, BLOCKS, 3)
    wind, load = (
        Withheld(name, {"x": Estimate(1.0, 0.9, 1.1, "-")}, {}, "It was hidden.") for name in ("wind", "payload")
    )
    found = with_gains((wind, load), {"wind": gain})
    assert found[0].gain is gain
    assert found[0].says == f"It was hidden. {gain.says('wind')}"
    assert found[1] is load
    # Where it is told of all logs together, no log repeats it.
    quiet = with_gains((wind, load), {"wind": gain}, told=False)
    assert quiet[0].gain is gain
    assert quiet[0].says == "It was hidden."


def test_a_hidden_flow_is_bridged_where_the_sensor_was_silent() -> None:
    measurements = sailed(20.0, np.zeros(2))
    hidden = np.column_stack([np.linspace(0.0, 4.0, len(measurements.t)), np.full(len(measurements.t), 2.0)])
    hidden[30:50] = np.nan
    told = bridged(measurements, hidden)
    assert told[10:-10] == pytest.approx(
        np.column_stack([np.linspace(0.0, 4.0, len(told)), np.full(len(told), 2.0)])[10:-10]
    )


@pytest.mark.slow
def test_a_steady_wind_that_is_found_has_all_of_its_gain_and_a_wrong_one_less() -> None:
    (wind, *_) = judge_conditions(campaign(), {str(i): i for i in range(3)}, no_progress).tests
    assert wind.confirmed

    def blown(member: Member, air: tuple[float, float]) -> Member:
        seen = member.windows.measurements
        assert FERRY.wind is not None
        load = wind_force(FERRY.wind, np.broadcast_to(air, (len(seen.t), 2)), seen.psi, seen.nu)
        return replace(member, plain=replace(member.plain, external=load))

    known = gain_of(wind, [blown(one, air) for one, air in zip(campaign().members, WINDS, strict=True)], 3)
    assert known.estimated == wind.gain
    assert known.logs == 3
    assert 0.9 < known.share < 1.05
    assert known.low < known.share < known.high
    wrong = gain_of(
        wind, [blown(one, (-2.0 * a, -b)) for one, (a, b) in zip(campaign().members, WINDS, strict=True)], 3
    )
    assert isnan(wrong.share)
    assert wrong.measured.total < 0.0
