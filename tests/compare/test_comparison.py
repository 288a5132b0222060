"""A comparison on simulated logs: against errors summed by hand, and what it says of logs that can show nothing."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.compare.candidates import BASE, CandidateSet, select_candidates
from ferryid.compare.comparison import Comparison, compare
from ferryid.compare.comparison_result import ComparisonResult
from ferryid.compare.replay import replay_versions
from ferryid.errors import FerryIdError
from ferryid.files import dump_json
from ferryid.models.model import Model, blank_model
from ferryid.models.prediction.free_run import NO_MASS
from ferryid.models.prediction.log_prediction import predict
from ferryid.models.prediction.window_averages import window_errors
from ferryid.models.scores import usable_rows
from ferryid.report import comparison_words
from ferryid.report.comparison_figures import looks, over_reference, runs_to_draw
from ferryid.report.comparison_page import render
from ferryid.report.fit_timeline import comparison_timeline
from ferryid.signals.prepare import prepare
from ferryid.simulate import load_scenario, simulate, write_log
from ferryid.types import RunContext
from ferryid.vessel import load_profile
from tests.export.models import fitted
from tests.models.test_stored_effect import stored

pytestmark = pytest.mark.slow

FERRY = load_profile("milliampere")
SECONDS = (400.0, 300.0)


def quiet(_: str) -> None:
    pass


def heavier(version: int, factor: float) -> Model:
    """Return a model whose hull has all masses and damping times a factor: worse, the farther it is from one."""
    return replace(
        blank_model(FERRY, "ferry"),
        version=version,
        scale={"delta": factor, "sigma": factor, "zeta": 1.0},
        accepted=True,
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with two logs of a vessel whose profile is true; the first tells its reference."""
    path = tmp_path_factory.mktemp("compared")
    scenario = load_scenario("twelve-corner-calm")
    for k, seconds in enumerate(SECONDS):
        sensors = replace(
            scenario.sensors, imu_rate_hz=0.0, camera_rate_hz=0.0, reference_rate_hz=10.0 if k == 0 else 0.0
        )
        write_log(simulate(replace(scenario, sensors=sensors, duration_s=seconds), 30 + k), path / f"trial-{k}.mcap")
    return path


def logs_in(folder: Path) -> list[str]:
    return [str(folder / f"trial-{k}.mcap") for k in range(2)]


@pytest.fixture(scope="module")
def field() -> CandidateSet:
    return select_candidates(["ferry@1", "ferry@2"], [heavier(1, 1.1), heavier(2, 3.0)])


@pytest.fixture(scope="module")
def compared(field: CandidateSet, folder: Path) -> Comparison:
    return compare(field, logs_in(folder), RunContext(folder / "out"))


def test_errors_are_those_that_one_sums_by_hand(field: CandidateSet, folder: Path, compared: Comparison) -> None:
    squares, forces, errors = [], [], []
    for log, entry in zip(logs_in(folder), compared.result.logs, strict=True):
        prepared = prepare(log, FERRY, folder / "out", window_s=1.0)
        tau = prepared.motion.tau
        seen = [predict(one.model, prepared, FERRY, window_s=1.0, smoother="square") for one in field.candidates]
        rows = usable_rows(prepared.motion, *(one.tau for one in seen))
        assert entry.rows == rows.sum()
        for one, prediction in zip(field.candidates, seen, strict=True):
            scores = entry.scores[one.label]
            assert scores.mse["sway"] == pytest.approx(np.mean((tau - prediction.tau)[rows, 1] ** 2))
            assert scores.r2["yaw"] == pytest.approx(1.0 - scores.mse["yaw"] / np.var(tau[rows, 2]))
            run = prediction.free_run(rows)
            assert scores.free_run["position_m"] == pytest.approx(run.position_m.tolist(), nan_ok=True)
            assert scores.free_run["yaw_rate_radps"] == pytest.approx(run.yaw_rate_radps.tolist(), nan_ok=True)
        squares.append(np.stack([np.sum((tau - one.tau)[rows] ** 2, axis=0) for one in seen]))
        forces.append(tau[rows])
        errors.append((entry.free_run.counted, entry.scores["ferry@2"].free_run["heading_rad"]))
    pooled, every = compared.result.pooled, np.concatenate(forces)
    assert pooled is not None
    for k, one in enumerate(field.candidates):
        mse = sum(part[k] for part in squares) / len(every)
        assert list(pooled.scores[one.label].mse.values()) == pytest.approx(mse.tolist())
        assert list(pooled.scores[one.label].r2.values()) == pytest.approx((1.0 - mse / every.var(axis=0)).tolist())
    pair = next(one for one in pooled.pairs if (one.first, one.second) == ("ferry@1", "ferry@2"))
    total = sum(squares)
    assert pair.mse["surge"].value == pytest.approx(total[1, 0] / total[2, 0])
    (first, one), (second, other) = errors
    both = np.sqrt((first[2] * one[2] ** 2 + second[2] * other[2] ** 2) / (first[2] + second[2]))
    assert pooled.scores["ferry@2"].free_run["heading_rad"][2] == pytest.approx(both)


def test_the_true_model_is_found_better(compared: Comparison) -> None:
    rows = [row for row in compared.result.statements if row.on is None]
    told = {(row.what, row.first, row.second): row for row in rows if row.kind != "force"}
    row = told["sway", BASE, "ferry@2"]
    assert row.better == BASE
    assert row.p <= row.p_corrected <= 0.05
    assert row.high < 1.0
    assert row.sentence.startswith(f"{BASE} is better than ferry@2 on sway (p 0.")
    assert "of the other's (95 % interval " in row.sentence
    assert told["sway", "ferry@1", "ferry@2"].better == "ferry@1"
    # Nine comparisons of accelerations and six of free runs: each p is raised, and none beyond their number.
    assert len(told) == 15
    assert all(row.p_corrected <= 15 * row.p for row in told.values())
    forces = [row for row in rows if row.kind == "force"]
    assert len(forces) == 9
    assert all(row.p_corrected <= 9 * row.p for row in forces)


def test_predictions_are_judged_in_windows_that_all_share(
    field: CandidateSet, folder: Path, compared: Comparison
) -> None:
    squares, forces = [], []
    for log, entry in zip(logs_in(folder), compared.result.logs, strict=True):
        prepared = prepare(log, FERRY, folder / "out", window_s=1.0)
        motion, length = prepared.motion, compared.result.prediction_window_s
        seen = [predict(one.model, prepared, FERRY, window_s=1.0, smoother="square") for one in field.candidates]
        rows = usable_rows(motion, *(one.tau for one in seen))
        found = window_errors(seen, motion, rows, FERRY.hull.M, length)
        assert entry.windows == len(found.force)
        for one, error in zip(field.candidates, found.errors, strict=True):
            assert list(entry.scores[one.label].prediction.mse.values()) == pytest.approx(
                np.mean(error**2, axis=0).tolist()
            )
        squares.append(np.array([np.sum(error**2, axis=0) for error in found.errors]))
        forces.append(found.force)
    pooled, every = compared.result.pooled, np.concatenate(forces)
    assert pooled is not None
    total = sum(squares)
    r2 = 1.0 - total[1] / len(every) / every.var(axis=0)
    assert list(pooled.scores["ferry@1"].prediction.r2.values()) == pytest.approx(r2.tolist())
    pair = next(one for one in pooled.pairs if (one.first, one.second) == ("ferry@1", "ferry@2"))
    assert pair.prediction["yaw"].value == pytest.approx(total[1, 2] / total[2, 2])
    assert pair.inverse().prediction["yaw"].value == pytest.approx(total[2, 2] / total[1, 2])


def test_half_the_thrust_on_half_the_hull_predicts_alike(folder: Path) -> None:
    """Errors of the force count in a model's own thrust: half of it on half the hull has a quarter of the mean square."""
    halves = tuple(stored("thruster_gain", one.name, factor=0.5) for one in FERRY.actuators)
    whole, half = heavier(1, 1.3), replace(heavier(2, 0.65), vessel_effects=halves)
    result = compare(
        select_candidates(["ferry@1", "ferry@2"], [whole, half]), logs_in(folder)[:1], RunContext(folder / "out")
    ).result
    pair = over_reference(result.logs[0].pairs, "ferry@2", "ferry@1")
    assert [ratio.value for ratio in pair.mse.values()] == pytest.approx([0.25] * 3, rel=0.05)
    assert [ratio.value for ratio in pair.prediction.values()] == pytest.approx([1.0] * 3, rel=0.05)
    assert "ferry@2" not in comparison_words.headline(result).split("chance")[0]


def test_the_json_comes_back_as_it_was(compared: Comparison) -> None:
    plain = json.loads(dump_json(compared.result.to_json()))
    again = ComparisonResult.from_json(plain)
    assert again.to_json() == plain
    assert again.logs[0].pairs[0].mse["sway"] == compared.result.logs[0].pairs[0].mse["sway"]


def test_blocks_of_free_runs_are_twice_as_long_as_a_run(compared: Comparison) -> None:
    # Starts from 0 s to 400 s but for the length of a run: 30 s blocks, then 40, 60 and 120 s.
    blocks = compared.result.logs[0].free_run.blocks
    for horizon, count in zip((5.0, 10.0, 20.0, 30.0, 60.0), blocks, strict=True):
        assert count == pytest.approx((SECONDS[0] - horizon) / max(30.0, 2.0 * horizon), abs=1.0)


def test_paths_of_free_runs_end_as_far_off_as_their_errors_say(compared: Comparison) -> None:
    log = compared.logs[0]
    h = compared.result.logs[0].free_run.horizons_s.index(30.0)
    step_s = (log.path_rows[0, 1] - log.path_rows[0, 0]) / log.motion.rate_hz
    k = round(30.0 / step_s)
    measured = log.motion.eta[log.path_rows[:, k], :2]
    astray = np.hypot(*np.moveaxis(log.paths[:, :, k] - measured, 2, 0))
    got_there = log.reached[:, h]
    np.testing.assert_allclose(astray[:, got_there], log.errors[:, got_there, h, 0], rtol=1e-9)
    assert np.isnan(astray[:, ~got_there]).all()


def test_the_runs_that_are_drawn_err_least_most_and_between(compared: Comparison) -> None:
    log = compared.logs[0]
    runs = runs_to_draw(log)
    assert len(runs) == 3
    error = log.errors[:, runs, -1, 0].mean(axis=0)
    assert (np.diff(error) > 0.0).all()
    every = log.errors[:, log.reached[:, -1], -1, 0].mean(axis=0)
    assert (error[0], error[2]) == (every.min(), every.max())
    assert runs_to_draw(replace(log, paths=np.full_like(log.paths, np.nan))) == []
    page, drawings = render(compared.result, compared.logs, {"date": "", "version": "", "command": ""})
    assert "free-run-tracks-trial-0" in drawings
    assert drawings["free-run-tracks-trial-0"] in page
    assert page.index("ferry@1 against base model") < page.index("Ratios of the errors, with intervals and p")


def test_the_residual_of_every_model_lies_below_its_force(compared: Comparison) -> None:
    log, models = compared.logs[0], compared.result.models
    made = comparison_timeline(log, models, looks(models))
    assert made is not None
    force, residual = made.strips[:2]
    assert (force.label, residual.label) == ("surge X [N]", "surge X, residual [N]")
    for estimate, left in zip(force.traces[1:], residual.traces, strict=True):
        assert (estimate.label, estimate.colour, estimate.dash) == (left.label, left.colour, left.dash)
        np.testing.assert_allclose(left.values, force.traces[0].values - estimate.values)


def test_a_log_with_a_reference_tells_how_it_was_kept(compared: Comparison) -> None:
    first, second = compared.result.logs
    assert second.tracking is None
    assert first.tracking is not None
    assert first.tracking.position_m < 1.0
    assert first.tracking.seconds == pytest.approx(SECONDS[0], abs=5.0)
    assert pytest.approx(first.tracking.IAE * first.tracking.EC) == first.tracking.IAEW


def test_a_training_log_is_no_evidence(folder: Path, compared: Comparison) -> None:
    sha256 = compared.result.logs[0].sha256
    learnt = replace(
        heavier(1, 1.1), training=({"name": "trial-0", "sha256": sha256, "files": [], "seconds": 1.0, "rows": 1},)
    )
    field = select_candidates(["ferry@1", "ferry@2"], [learnt, heavier(2, 3.0)])
    result = compare(field, logs_in(folder), RunContext(folder / "out")).result
    first, second = result.logs
    assert "ferry@1 was trained on this log: its scores here are no evidence" in first.warnings
    assert first.scores["ferry@1"].trained
    assert not second.scores["ferry@1"].trained
    rows = {(row.on, row.first): row for row in result.statements if (row.what, row.second) == ("sway", "ferry@2")}
    assert rows[None, "ferry@1"].better == "ferry@1"
    assert rows[None, "ferry@1"].sentence.endswith("no evidence, as ferry@1 was fitted to some of these logs")
    assert not rows[None, "ferry@1"].evidence
    # What is better without having learnt is so all the more.
    assert rows[None, BASE].evidence


def test_a_short_log_has_no_intervals_and_says_so(field: CandidateSet, tmp_path: Path) -> None:
    short = Path(__file__).resolve().parents[2] / "fixtures" / "short.mcap"
    result = compare(field, [str(short)], RunContext(tmp_path)).result
    (entry,) = result.logs
    assert entry.blocks == 3
    assert "3 blocks of 30 s are too few for an interval" in entry.warnings[-1]
    assert all(row.better is None for row in result.statements)
    assert all(row.sentence.startswith("too little data to distinguish") for row in result.statements)
    assert all(np.isnan(one.p) for pair in entry.pairs for one in pair.mse.values())


def test_what_a_model_needs_and_a_log_lacks_is_named(folder: Path) -> None:
    windy = replace(fitted("modulus+wind-paper", "decoupled"), version=4)
    field = select_candidates(["ferry@1", "windy"], [heavier(1, 1.1), windy])
    with pytest.raises(FerryIdError, match=r"trial-0: milliampere@4 needs the wind, found none .* Fix: "):
        compare(field, logs_in(folder), RunContext(folder / "out"))


def test_a_force_without_bounds_is_refused(folder: Path) -> None:
    field = select_candidates(["ferry@1", "ferry@2"], [heavier(1, 1.1), heavier(2, 1e200)])
    with pytest.raises(FerryIdError, match=r"ferry@2: its force on .*trial-0.mcap is too large .*Fix: "):
        compare(field, logs_in(folder), RunContext(folder / "out"))


def test_a_log_is_given_once(field: CandidateSet, folder: Path) -> None:
    log = logs_in(folder)[0]
    with pytest.raises(FerryIdError, match=r"trial-0\.mcap: given twice, and would count twice\. Fix: "):
        compare(field, [log, log], RunContext(folder / "out"))


def test_one_of_several_logs_that_cannot_be_used_is_left_out(field: CandidateSet, folder: Path, tmp_path: Path) -> None:
    foreign = tmp_path / "foreign.csv"
    foreign.write_text("time,temperature\n0,1\n1,2\n2,3\n", encoding="utf-8")
    log, run = logs_in(folder)[1], RunContext(tmp_path / "out")
    found = compare(field, [str(foreign), log], run).result
    assert [one.name for one in found.logs] == ["trial-1"]
    (warning,) = found.warnings
    assert warning.startswith("Left out of the comparison: ")
    assert "foreign.csv: " in warning
    assert "Fix: " in warning
    for logs in ([str(foreign)], [str(tmp_path / "absent.csv"), log]):
        with pytest.raises(FerryIdError, match=r"foreign\.csv: |absent\.csv: no such file"):
            compare(field, logs, run)
    # What decides on the current version is told of every log that was named.
    with pytest.raises(FerryIdError, match=r"foreign\.csv: "):
        replay_versions(heavier(1, 1.1), heavier(2, 3.0), [log, str(foreign)], run)


def test_a_model_that_cannot_be_run_free_is_left_out_of_free_runs_alone(folder: Path) -> None:
    backwards = fitted("modulus", "decoupled")
    theta = backwards.theta.copy()
    theta[backwards.terms.index("v_dot"), 1] = -9000.0
    field = select_candidates(["ferry@1", "odd"], [heavier(1, 1.1), replace(backwards, theta=theta)])
    result = compare(field, logs_in(folder)[:1], RunContext(folder / "out")).result
    (warning,) = (one for one in result.warnings if "free runs" in one)
    assert warning == f"milliampere@3 is left out of free runs: {NO_MASS}"
    scores = result.logs[0].scores
    assert np.isnan(scores["milliampere@3"].free_run["position_m"]).all()
    assert np.isfinite(scores["ferry@1"].free_run["position_m"]).all()
    assert np.isfinite(scores["milliampere@3"].mse["yaw"])


def test_a_model_all_of_whose_runs_diverge_is_left_out_for_that(folder: Path) -> None:
    field = select_candidates(["ferry@1", "light"], [heavier(1, 1.1), replace(heavier(3, 1e-3), name="light")])
    result = compare(field, logs_in(folder)[:1], RunContext(folder / "out")).result
    (warning,) = (one for one in result.warnings if "free runs: " in one)
    assert warning == "light@3 is left out of free runs: all its runs diverge"


def test_without_logs_coefficients_are_compared(field: CandidateSet, tmp_path: Path) -> None:
    result = compare(field, [], RunContext(tmp_path)).result
    assert result.logs == () == result.statements
    mass = next(row for row in result.coefficients.physical if row.coefficient == "m11")
    assert mass.values["ferry@2"].value == pytest.approx(3.0 * mass.values[BASE].value)
