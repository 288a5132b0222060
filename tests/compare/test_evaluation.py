"""The sentence that judges a model on a log, which says on which axes it is worse."""

from __future__ import annotations

import json
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from ferryid.compare import evaluate
from ferryid.compare.candidates import select_candidates
from ferryid.compare.comparison import compare
from ferryid.errors import FerryIdError
from ferryid.files import dump_json
from ferryid.identify import FitOutcome, FitSettings, fit_logs
from ferryid.identify.fit_data import Coefficients
from ferryid.identify.prediction_windows import PredictionWindows
from ferryid.identify.split import Split
from ferryid.models import Conditions, Model, Quantity, StoredEffect, blank_model, usable_rows
from ferryid.models.forces.estimator import base_estimator, model_estimator
from ferryid.models.prediction import Prediction, window_averages, window_errors
from ferryid.models.scores import force_scores
from ferryid.regression.bases import make_basis
from ferryid.report.evaluation_text import NOT_ACCEPTED, render_evaluation
from ferryid.report.headline import headline_of
from ferryid.signals.prepare import prepare
from ferryid.types import AXES, RunContext
from ferryid.vessel import load_profile

LOG = Path(__file__).resolve().parents[2] / "fixtures" / "short.mcap"

N = 400
HEAD = {"model": {"name": "ferry", "version": 1}, "window_s": 2.0}


@pytest.mark.parametrize(
    ("ratios", "told"),
    [
        ((0.5, 0.6, 0.7), "40 % better than its base model here (mean square force error, row by row)"),
        (
            (0.4, 0.5, 1.2),
            "30 % better than its base model here (mean square force error, row by row), but worse in yaw",
        ),
        (
            (0.2, 1.2, 1.3),
            "10 % better than its base model here (mean square force error, row by row), but worse in sway and yaw",
        ),
        ((0.8, 0.9, 1.6), "10 % worse than its base model here (mean square force error, row by row), namely in yaw"),
        (
            (1.4, 0.7, 1.5),
            "20 % worse than its base model here (mean square force error, row by row), namely in surge and yaw",
        ),
        ((1.2, 1.3, 1.4), "30 % worse than its base model here (mean square force error, row by row), on every axis"),
        # Within 5 % no axis is called worse.
        ((1.04, 1.04, 1.04), "4 % worse than its base model here (mean square force error, row by row)"),
        # "0 % worse" would name a side that the figure does not have.
        (
            (1.4, 0.5, 1.106),
            "as good as its base model here (mean square force error, row by row), but worse in surge and yaw",
        ),
        # An axis on which the base model is right cannot be judged.
        (
            (np.nan, 1.2, 1.4),
            "30 % worse than its base model here (mean square force error, row by row), namely in sway and yaw",
        ),
        ((np.nan, np.nan, np.nan), "cannot be judged: the base model makes no error here"),
        # Hardly any error is left, but some.
        ((0.002, 0.003, 0.001), "99.8 % better than its base model here (mean square force error, row by row)"),
    ],
)
def test_the_verdict_says_where_a_model_is_worse(ratios: tuple[float, float, float], told: str) -> None:
    tau = np.random.default_rng(1).normal(size=(N, 3))
    known = np.isfinite(ratios)
    base = tau + np.where(known, 1.0, 0.0)
    model = tau + np.sqrt(np.where(known, ratios, 1.0))
    scores = force_scores(tau, base, model, np.ones(N, dtype=bool))
    text = render_evaluation({**HEAD, "logs": [{"name": "log", **scores.to_json()}]})
    assert f"  {told}" in text.splitlines()


def shown(told: str, part: str) -> list[str]:
    """Return the lines of a text that contain a part."""
    return [line for line in told.splitlines() if part in line]


def test_one_of_several_logs_that_cannot_be_used_is_left_out(tmp_path: Path) -> None:
    foreign = tmp_path / "foreign.csv"
    foreign.write_text("time,temperature\n0,1\n1,2\n2,3\n", encoding="utf-8")
    model, run = blank_model(load_profile("milliampere"), "ferry"), RunContext(tmp_path / "out")
    told = evaluate(model, [str(foreign), str(LOG)], run)
    assert [one["name"] for one in told["logs"]] == ["short"]
    (warning,) = told["warnings"]
    assert warning.startswith("Left out of the evaluation: ")
    assert "foreign.csv: " in warning
    assert f"warning: {warning}" in render_evaluation(told).splitlines()
    schema = json.loads(files("ferryid.schemas").joinpath("evaluate.json").read_text(encoding="utf-8"))
    jsonschema.validate(json.loads(dump_json(told)), schema)
    assert "warnings" not in evaluate(model, [str(LOG)], run)
    for logs in ([str(foreign)], [str(tmp_path / "absent.csv"), str(LOG)]):
        with pytest.raises(FerryIdError, match=r"foreign\.csv: |absent\.csv: no such file"):
            evaluate(model, logs, run)


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> FitOutcome:
    settings = FitSettings(delta=0.4, sigma=0.4, components=9, draws=1, estimator="derivative")
    return fit_logs([str(LOG)], load_profile("milliampere"), settings, RunContext(tmp_path_factory.mktemp("fit")))


@pytest.mark.slow
def test_predictions_are_judged_in_windows_as_a_fit_judges_them(fitted: FitOutcome, tmp_path: Path) -> None:
    told = evaluate(fitted.model, [str(LOG), str(LOG.with_name("second.bag"))], RunContext(tmp_path))
    for entry in (*told["logs"], told["pooled"]):
        prediction = entry["prediction"]
        assert prediction["window_s"] == pytest.approx(8.0)
        # Noise is the most of the force error of a row, and hardly any of that of a window.
        assert prediction["normalised_mse"] < 0.5 * entry["normalised_mse"]
        ratio = [prediction["mse"]["model"][axis] / prediction["mse"]["base"][axis] for axis in AXES]
        assert ratio == pytest.approx([prediction["per_axis"][axis] for axis in AXES])
    windows = [entry["prediction"]["windows"] for entry in told["logs"]]
    assert told["pooled"]["prediction"]["windows"] == sum(windows) > 20
    pooled = np.average([one["prediction"]["mse"]["model"]["yaw"] for one in told["logs"]], weights=windows)
    assert told["pooled"]["prediction"]["mse"]["model"]["yaw"] == pytest.approx(pooled)
    text = render_evaluation(told)
    assert len(shown(text, "squared prediction error / base")) == len(shown(text, "row by row, MSE / base")) == 3
    assert len(shown(text, "than its base model here (squared prediction error in windows)")) == 3
    # What a fit is judged by comes first, the noisier errors of rows after it: of verdicts, figures and explanations.
    lines = text.splitlines()
    for predicted, of_rows in (
        ("its base model here (squared prediction error in windows)", "(mean square force error, row by row)"),
        ("squared prediction error / base", "row by row, MSE / base"),
        ("prediction error: ", "row by row: "),
    ):
        first, second = ([k for k, line in enumerate(lines) if part in line] for part in (predicted, of_rows))
        assert all(a < b for a, b in zip(first, second, strict=True)), (predicted, first, second)
    assert len(shown(text, "windows of 8 s, as force on the base model's mass, as fit judges.")) == 1
    assert max(len(line) for line in text.splitlines() if "warning" not in line) <= 120


@pytest.mark.slow
def test_the_errors_in_windows_are_those_of_a_fit(fitted: FitOutcome, tmp_path: Path) -> None:
    """On the same rows and with measured velocities, from predicted accelerations as from averaged equations of motion."""
    model, profile = fitted.model, load_profile("milliampere")
    motion = prepare(str(LOG), profile, tmp_path, window_s=1.0).motion
    motion = replace(
        motion, valid=usable_rows(motion, base_estimator(model).of(motion), model_estimator(model).of(motion))
    )
    functions = make_basis(str(model.settings["basis"]), structure="decoupled")
    everything = replace(Split.nothing([motion]), kind="blocks", validation=(motion.valid,))
    settings = FitSettings(delta=0.4, sigma=0.4)
    windows = PredictionWindows(profile, settings, functions, (motion,), everything)
    nothing = np.full((len(model.terms), 3), np.nan)
    found = Coefficients(model.theta, model.intercept, nothing, nothing, nothing[0], nothing[0], np.zeros(0))
    expected = windows.errors(found)
    told = evaluate(model, [str(LOG)], RunContext(tmp_path), window_s=1.0)["logs"][0]["prediction"]
    assert list(told["mse"]["model"].values()) == pytest.approx(expected.mse_model, rel=1e-9)
    assert list(told["mse"]["base"].values()) == pytest.approx(expected.mse_base, rel=1e-9)
    assert list(told["mse"]["constant_velocity"].values()) == pytest.approx(expected.mse_constant_velocity, rel=1e-9)
    assert list(told["r2"]["model"].values()) == pytest.approx(expected.r2_model, rel=1e-9)


@pytest.mark.slow
def test_a_log_shorter_than_a_window_has_no_prediction_error(tmp_path: Path) -> None:
    profile = load_profile("milliampere")
    context = RunContext(tmp_path, ranges=((0.0, 7.0),))
    told = evaluate(blank_model(profile, "bare"), [str(LOG)], context, profile=profile)
    for entry in (told["logs"][0], told["pooled"]):
        assert entry["prediction"]["windows"] == 0
        assert np.isnan(entry["prediction"]["normalised_mse"])
    text = render_evaluation(told)
    assert shown(text, "no prediction error: no unbroken stretch of 8 s")
    assert not shown(text, "prediction error in windows")


def test_a_mass_that_cannot_be_inverted_errs_without_end_and_takes_no_row(
    fitted: FitOutcome, monkeypatch: pytest.MonkeyPatch
) -> None:
    model, motion = fitted.model, fitted.logs[0].motion
    theta = model.theta.copy()
    theta[model.terms.index("u_dot"), 0] = -1e6
    two = [Prediction(motion.tau, motion, model_estimator(one)) for one in (model, replace(model, theta=theta))]
    mass = np.diag([2000.0, 2000.0, 5000.0])
    force, (good, bad), _, accelerating = window_errors(two, motion, motion.valid, mass, 8.0)
    # A model that expects no acceleration errs by all of it.
    still = replace(model, theta=np.zeros_like(model.theta), intercept=np.zeros(3))
    none = Prediction(np.zeros_like(motion.tau), motion, model_estimator(still))
    monkeypatch.setattr(
        window_averages, "predicted_acceleration", lambda _, motion, **options: np.zeros_like(motion.nu)
    )
    np.testing.assert_allclose(
        window_errors([none], motion, motion.valid, mass, 8.0).errors[0], -accelerating, rtol=1e-9
    )
    monkeypatch.undo()
    alone = window_errors(two[:1], motion, motion.valid, mass, 8.0)
    assert len(force) > 10
    np.testing.assert_array_equal(good, alone[1][0])
    assert np.isinf(bad).all()
    # Without sway the errors are those of a hull that cannot sway.
    (reduced,) = window_errors(two[:1], motion, motion.valid, mass, 8.0, reduced=True).errors
    np.testing.assert_allclose(reduced[:, 0], good[:, 0], rtol=1e-9)
    assert not np.allclose(reduced[:, 2], good[:, 2], rtol=1e-6)


@pytest.mark.slow
def test_a_model_that_adds_nothing_needs_no_second_free_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Evaluated as its base model alone, and as other models are: the same to the last digit."""
    profile = load_profile("milliampere")
    context = RunContext(tmp_path, ranges=((0.0, 20.0),))

    def told() -> str:
        return dump_json(evaluate(blank_model(profile, "bare"), [str(LOG)], context, profile=profile))

    once = told()
    monkeypatch.setattr(Model, "blank", False)
    assert told() == once


def test_a_copy_in_another_format_is_no_second_log(tmp_path: Path) -> None:
    model = blank_model(load_profile("milliampere"), "ferry")
    with pytest.raises(
        FerryIdError, match=r"short\.bag: holds the recording of .*short\.mcap, or a piece of it.*Fix: "
    ):
        evaluate(model, [str(LOG), str(LOG.with_suffix(".bag"))], RunContext(tmp_path))


@pytest.mark.slow
def test_a_training_log_in_another_format_and_a_part_of_it_are_no_evidence(fitted: FitOutcome, tmp_path: Path) -> None:
    def warned(log: Path, model: Model = fitted.model, **of_log: object) -> bool:
        told = evaluate(model, [str(log)], RunContext(tmp_path, **of_log))
        return "the model was trained on this log: its scores here are no evidence" in told["logs"][0]["warnings"]

    copy = LOG.with_suffix(".bag")
    assert warned(LOG)
    assert warned(copy)
    assert warned(copy, ranges=(("20", "60"),))
    assert not warned(LOG.with_name("second.bag"))
    # A file from before has a hash alone.
    old = tuple({key: value for key, value in log.items() if key != "motion"} for log in fitted.model.training)
    assert not warned(copy, replace(fitted.model, training=old))
    field = select_candidates(
        ["new", "bare"], [replace(fitted.model, version=1), replace(fitted.model, version=2, training=())]
    )
    assert compare(field, [str(copy)], RunContext(tmp_path)).logs[0].trained == ("milliampere@1",)


@pytest.mark.slow
def test_a_part_of_a_log_that_was_diagnosed_as_one_says_what_its_figures_lack(
    fitted: FitOutcome, tmp_path: Path
) -> None:
    (log,) = fitted.model.training
    wind = StoredEffect("wind", None, {name: Quantity(1.0, 0.5, 1.5, "m/s") for name in ("north", "east")}, ())
    blown = replace(
        fitted.model,
        training=({**log, "name": "bag00-and-1-more", "files": ["bag00.mcap", "bag01.mcap"]},),
        conditions=(Conditions("bag00-and-1-more", str(log["sha256"]), (wind,)),),
    )

    def warned(model: Model) -> bool:
        told = evaluate(model, [str(LOG.with_suffix(".bag"))], RunContext(tmp_path, ranges=(("20", "60"),)))
        return any(one.startswith("it is a part of bag00-and-1-more, ") for one in told["logs"][0]["warnings"])

    assert warned(blown)
    assert not warned(replace(blown, conditions=()))
    assert not warned(replace(blown, training=(log,)))


@pytest.mark.slow
def test_a_scaled_base_is_named_and_the_hull_of_the_profile_judged_beside(fitted: FitOutcome, tmp_path: Path) -> None:
    told = evaluate(fitted.model, [str(LOG), str(LOG.with_name("second.bag"))], RunContext(tmp_path))
    assert told["model"]["scale"] == {"delta": 0.4, "sigma": 0.4}
    unscaled = replace(fitted.model, scale={"delta": 1.0, "sigma": 1.0, "zeta": 1.0})
    own = evaluate(unscaled, [str(LOG), str(LOG.with_name("second.bag"))], RunContext(tmp_path))
    assert own["model"]["scale"] == {}
    for entry, other in zip((*told["logs"], told["pooled"]), (*own["logs"], own["pooled"]), strict=True):
        beside, hull = entry["prediction_beside_hull"], other["prediction"]
        assert "prediction_beside_hull" not in other
        assert beside["windows"] == entry["prediction"]["windows"]
        assert beside["mse"]["model"] == pytest.approx(entry["prediction"]["mse"]["model"])
        # The same errors of the acceleration as those of a base that was never scaled, on another mass.
        assert beside["mse"]["base"]["surge"] == pytest.approx(0.4**2 * hull["mse"]["base"]["surge"], rel=1e-6)
    lines = render_evaluation(told).splitlines()
    assert "base: the base model as fitted (delta 0.4, sigma 0.4), not the profile's hull" in lines
    assert sum("than the profile's hull here" in line for line in lines) == 3
    assert not shown(render_evaluation(own), "profile's hull")


@pytest.mark.slow
def test_a_fit_on_a_scaled_base_is_judged_against_the_hull_of_the_profile_too(
    fitted: FitOutcome, tmp_path: Path
) -> None:
    assert "base model as fitted (delta 0.4, sigma 0.4)" in headline_of(fitted)
    (told,) = [reason for reason in fitted.acceptance.reasons if reason.startswith("Beside the profile's hull")]
    assert told in fitted.acceptance.reasons
    # The log is of that very hull, so that no fit to ninety seconds of it is better.
    assert "% above:" in told
    plain = fit_logs([str(LOG)], load_profile("milliampere"), FitSettings(draws=1), RunContext(tmp_path))
    assert "as fitted" not in headline_of(plain)
    assert not [reason for reason in plain.acceptance.reasons if "profile's hull" in reason]


def test_a_rejected_model_is_not_judged_without_a_word() -> None:
    warning = "warning: this model is marked as rejected, as its fit was not accepted"
    head = {**HEAD, "logs": []}
    assert warning in render_evaluation({**head, "model": {**HEAD["model"], "accepted": False}}).splitlines()
    assert warning not in render_evaluation({**head, "model": {**HEAD["model"], "accepted": True}})
    diagnosed = render_evaluation({**head, "model": {**HEAD["model"], "accepted": False, "base": "the hull"}})
    assert warning not in diagnosed
    assert (
        f"warning: this model is {NOT_ACCEPTED}. Use it only where its errors below are the smaller ones"
        in diagnosed.splitlines()
    )
