"""The oracle's size in a recording: where a known change of the record is as large as it has to be, and doses by it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import norm

from ferryid.validation.case import Truth
from ferryid.validation.oracle import _Log
from ferryid.validation.recorded import case_sampling
from ferryid.validation.recorded.drives import drives
from ferryid.validation.recorded.effects import concealments
from ferryid.validation.recorded.kinematic_sizes import SIGMAS
from ferryid.validation.recorded.log import read_log
from ferryid.validation.recorded.manifest import Recording
from ferryid.validation.recorded.oracle_size import (
    APART,
    Baseline,
    _along,
    _beside,
    _gain_of_noise,
    distinctness,
    oracle_size,
    sizes_in,
    visibility,
)
from ferryid.vessel import load_profile
from tests.validation.recorded_logs import ferry, zigzag


def test_a_shift_of_so_many_standard_deviations_is_named_19_times_in_20() -> None:
    # One in a hundred logs without a shift is beyond the two-sided threshold.
    threshold = float(norm.isf(0.005))
    assert norm.sf(threshold - SIGMAS) == pytest.approx(0.95)


def test_what_the_hull_takes_up_is_not_seen() -> None:
    rng = np.random.default_rng(2)
    hull = 1e3 * rng.standard_normal((200, 3))
    own = rng.standard_normal(200)
    across = own - hull @ np.linalg.lstsq(hull, own, rcond=None)[0]
    assert _beside(hull @ [1.0, -2.0, 0.5], hull) < 3.0
    assert _beside(own, hull) == pytest.approx(np.linalg.norm(across), rel=1e-3)
    # A hull that is known takes up nothing.
    assert _beside(own, 0.0 * hull) == pytest.approx(np.linalg.norm(own))


def test_what_a_formula_does_not_do_is_no_evidence_of_it() -> None:
    rng = np.random.default_rng(2)
    hull, load, noise = 1e3 * rng.standard_normal((2000, 3)), rng.standard_normal(2000), 5.0 * rng.standard_normal(2000)
    formula = load + 0.3 * hull[:, 0]
    assert _along(formula, formula, hull) == pytest.approx(_beside(formula, hull))
    # Ten times as long, and as much of the load as before.
    assert _beside(formula + noise, hull) > 4.0 * _beside(formula, hull)
    assert _along(formula + noise, formula, hull) == pytest.approx(_beside(formula, hull), abs=3.0 * 5.0)


def test_noise_of_known_spectrum_gains_by_its_power() -> None:
    white = np.random.default_rng(3).standard_normal((20000, 1))
    # As strong as the noise on every frequency: half of ``1 - log 2`` for each row.
    assert _gain_of_noise(white) == pytest.approx(0.5 * (1.0 - np.log(2.0)) * len(white), rel=0.1)


@cache
def baseline() -> list[Baseline]:
    return [Baseline(ferry(), _Log(ferry().measurements).trial)]


@pytest.mark.slow
@pytest.mark.parametrize("effect", ["payload", "thruster_gain", "time_delay"])
def test_the_oracle_just_sees_its_size(effect: str) -> None:
    one = concealments()[effect]

    def truth_of(size: float) -> Truth:
        return one.sample(size, ferry(), np.random.default_rng(4), (None, None))

    size = oracle_size(one, baseline(), truth_of)
    assert visibility(one, baseline(), truth_of(size)) == pytest.approx(1.0, abs=0.1)
    assert visibility(one, baseline(), truth_of(2.0 * size)) == pytest.approx(2.0, abs=0.3)
    # Twice as many such logs halve the square of what is needed.
    twice = visibility(one, baseline() * 2, truth_of(size))
    assert twice == pytest.approx(np.sqrt(2.0), abs=0.15)


def test_the_true_one_of_two_is_likelier_19_times_in_20() -> None:
    # The log-likelihood ratio is half the square of what sets them apart, give or take its length.
    assert norm.sf(0.0, 0.5 * APART**2, APART) == pytest.approx(0.95)


@pytest.mark.slow
def test_a_size_is_distinct_from_what_looks_alike_beside_any_hull(tmp_path: Path) -> None:
    log = read_log(str(zigzag(tmp_path / "tank.dat", 120.0)), load_profile("kvlcc2-model"))
    every = [Baseline(log, _Log(log.measurements).trial)]
    lag = concealments()["thruster_lag"]

    def truth_of(size: float) -> Truth:
        return lag.sample(size, log, np.random.default_rng(4), (None, None))

    known = sizes_in(lag, every, truth_of)
    there = distinctness(lag, every, truth_of(known.distinct))
    assert known.distinct > 1.5 * known.oracle
    assert there == pytest.approx(1.0, abs=0.1)
    # A hull that nobody modelled does more than its 26 coefficients.
    assert every[0].any_hull.shape[1] > every[0].problem.by_hull.shape[1]
    # Kinematics fits all errors of the sensors at once.
    arm = concealments()["lever_arm"]
    seen = sizes_in(arm, baseline(), lambda size: Truth("lever_arm", None, {"x": size, "y": 0.0}))
    assert seen.distinct == seen.oracle


@pytest.mark.slow
def test_the_only_actuator_is_as_strong_as_a_hull_that_nobody_modelled_is_light(tmp_path: Path) -> None:
    log = read_log(str(zigzag(tmp_path / "tank.dat", 120.0)), load_profile("kvlcc2-model"))
    every = [Baseline(log, _Log(log.measurements).trial)]
    gain, weak = concealments()["thruster_gain"], Truth("thruster_gain", "propeller", {"factor": 0.6})
    assert distinctness(gain, every, weak) < 0.1 * visibility(gain, every, weak)
    # Before it was weak, or in other logs, it shows how strong it was.
    assert distinctness(gain, every, replace(weak, onset_s=40.0)) > 0.1 * visibility(
        gain, every, replace(weak, onset_s=40.0)
    )


@pytest.mark.slow
def test_a_short_lag_looks_like_a_delay() -> None:
    lag, (own,) = concealments()["thruster_lag"], baseline()

    def truth_of(size: float) -> Truth:
        return lag.sample(size, ferry(), np.random.default_rng(4), (None, None))

    # Where no delay is thought of, it is as distinct as it is visible.
    others = Baseline(own.log, own.problem)
    others.__dict__["responses"] = tuple(
        {key: one for key, one in responses.items() if key[0] != "time_delay"} for responses in own.responses
    )
    truth = truth_of(oracle_size(lag, [own], truth_of))
    assert distinctness(lag, [own], truth) < 0.97 * distinctness(lag, [others], truth)


@pytest.mark.slow
def test_a_heading_that_the_velocity_is_turned_with_is_seen_in_forces(tmp_path: Path) -> None:
    # The velocity of a tank's carriage is along the tank: kinematics agrees with any heading.
    log = read_log(str(zigzag(tmp_path / "tank.dat", 120.0)), load_profile("kvlcc2-model"))
    every = [Baseline(log, _Log(log.measurements).trial)]
    one = concealments()["heading_bias"]
    assert one.visible is not None
    assert one.visible(log) is None
    assert np.isfinite(one.visible(ferry()) or np.nan)

    def truth_of(size: float) -> Truth:
        return Truth("heading_bias", None, {"angle": size})

    size = oracle_size(one, every, truth_of)
    assert visibility(one, every, truth_of(size)) == pytest.approx(1.0, abs=0.1)
    assert visibility(one, every, truth_of(0.5 * size)) < 0.75


@pytest.mark.slow
def test_an_error_that_nothing_shows_has_no_size(tmp_path: Path) -> None:
    # Twenty-five seconds are too short for the kinematics.
    log = read_log(str(zigzag(tmp_path / "short.dat", 25.0)), load_profile("kvlcc2-model"))
    every = [Baseline(log, _Log(log.measurements).trial)]
    one = concealments()["lever_arm"]
    assert oracle_size(one, every, lambda size: Truth("lever_arm", None, {"x": size, "y": 0.0})) == np.inf


@pytest.mark.slow
def test_two_effects_are_concealed_one_after_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(case_sampling, "baselines", lambda logs, vessel: baseline())
    monkeypatch.setattr(case_sampling, "unfollowed", lambda path, vessel: "")
    recording = Recording("ferry", ("short.bag",), "milliampere")
    (case,), lacking = case_sampling._of_pair(recording, [ferry()], ("thruster_gain", "time_delay"), 3, 1.0)
    assert lacking == []
    assert [one.effect for one in case.truths] == ["thruster_gain", "time_delay"]
    assert (case.kind, case.level) == ("pair", None)
    log = ferry()
    for truth in case.truths:
        log = case_sampling.concealed(log, truth, case.seed).log
    drive = drives(ferry())[str(case.truths[0].instance)]
    ratio = log.columns[drive.column] / np.where(
        ferry().columns[drive.column] == 0.0, np.nan, ferry().columns[drive.column]
    )
    assert np.nanmax(np.abs(ratio)) > 1.05
    late = log.series[log.topics["x"]].receive_ns - ferry().series[log.topics["x"]].receive_ns
    assert late.min() == late.max() == round(1e9 * case.truths[1].values["seconds"])
    # A recording that is asked for one of them alone has no pair.
    alone = replace(recording, only=("payload",))
    assert case_sampling._of_pair(alone, [ferry()], ("payload", "wind"), 3, 1.0) == ([], [])
    # Why a pair is not made has a line.
    monkeypatch.setattr(case_sampling, "oracle_size", lambda *_: np.inf)
    made, (one,) = case_sampling._of_pair(recording, [ferry()], ("thruster_gain", "time_delay"), 3, 1.0)
    assert (made, one.effect, one.size) == ([], "thruster_gain and time_delay", 0.0)
    assert "cannot be concealed in ferry: together, time_delay of 4 times the oracle's size is beyond 2 s." in one.why


def test_a_size_that_is_drawn_again_is_the_same() -> None:
    # What two processes made of one recording.
    assert case_sampling._repeatable(0.3531394215793495) == case_sampling._repeatable(0.353139421579354) == 0.35313942
    assert case_sampling._repeatable(np.inf) == np.inf


def test_what_forces_alone_show_is_not_concealed_where_the_vessel_does_not_follow_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    recording = Recording("ferry", ("short.bag",), "milliampere")
    monkeypatch.setattr(case_sampling, "unfollowed", lambda path, vessel: "they move it by 0.02 times what is expected")
    (none,) = case_sampling._of_effect(recording, [ferry()], concealments()["thruster_gain"], 3, 0.2, ())[1]
    assert none.why.endswith(": only forces would show it, and they move it by 0.02 times what is expected.")
    # The positions tell where the antenna is, whatever moves the vessel.
    assert case_sampling._unfollowed(recording, [ferry()], concealments()["lever_arm"]) == ""
    monkeypatch.setattr(case_sampling, "unfollowed", lambda path, vessel: "")
    assert case_sampling._unfollowed(recording, [ferry()], concealments()["thruster_gain"]) == ""
