"""The transfer test: methods of which one knows what they are worth."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ferryid.diagnose.judging.model_update import store_updated_model
from ferryid.diagnose.pipeline import DiagnosisSettings, diagnose
from ferryid.errors import FerryIdError
from ferryid.models.model import Model, blank_model
from ferryid.models.prediction.log_prediction import Prediction
from ferryid.models.stored_effect import Conditions, Quantity, Source, StoredEffect
from ferryid.signals.prepare import Prepared
from ferryid.types import Floats, RunContext
from ferryid.validation.records import TransferResult
from ferryid.validation.rivals import stepwise
from ferryid.validation.rivals.base import base_of, prepared_log
from ferryid.validation.rivals.learner import LearnedModel, Learner
from ferryid.validation.transfer_test import transfer, transferred, window_errors
from ferryid.vessel import load_profile
from ferryid.vessel.profile import Profile
from tests.validation.two_logs import EAST_MPS, NORTH_MPS, WIND, two_logs

pytestmark = pytest.mark.slow

PROFILE = load_profile("milliampere")


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, str, Path]:
    folder = tmp_path_factory.mktemp("logs")
    return *two_logs(folder, WIND), folder


def _effect(name: str, values: Mapping[str, tuple[float, str]], source: Source, instance: str | None = None) -> Any:
    parameters = {key: Quantity(value, value, value, unit) for key, (value, unit) in values.items()}
    return StoredEffect(name, instance, parameters, (source,))


def _true(first: Prepared) -> Model:
    """Return a model that holds the truth of the first log, and two that began in it of which there is nothing to see."""
    log, sha256 = first.motion.log, first.recording.sha256
    source = Source(log, sha256, 1.0)
    wind = _effect("wind", {"north": (NORTH_MPS, "m/s"), "east": (EAST_MPS, "m/s")}, source)
    load = _effect("payload", {"mass": (0.0, "kg"), "x": (0.0, "m")}, replace(source, onset_s=120.0, offset_s=200.0))
    gain = _effect("thruster_gain", {"factor": (1.0, "-")}, replace(source, onset_s=90.0), "thruster1")
    return replace(
        blank_model(PROFILE, "true"),
        training=({"name": log, "sha256": sha256},),
        vessel_effects=(gain,),
        conditions=(Conditions(log, sha256, (wind, load)),),
    )


def _base(prepared: Prepared) -> Prediction:
    return base_of(prepared, PROFILE).prediction


def _rival(predict: Callable[[Prepared], Prediction]) -> Learner:
    return lambda log, profile, out: LearnedModel("rival", predict)


def _refuses(log: str, profile: Profile, out: Path) -> LearnedModel:
    raise FerryIdError("log: cannot be learnt from. Fix: give another")


def _shifted(prepared: Prepared) -> Prediction:
    """Return the base model's prediction with twice its error: four times the mean square."""
    found = _base(prepared)
    error = prepared.motion.tau - found.tau
    motion = replace(found.motion, tau=found.motion.tau + error)
    return replace(found, tau=prepared.motion.tau - 2.0 * error, motion=motion)


def _halved(prepared: Prepared) -> Prediction:
    """Return the base model with half the thrust and half the hull: it moves alike, with half the force error."""
    found = _base(prepared)

    def force(nu_dot: Floats, nu: Floats, *rest: Any) -> Floats:
        return np.asarray(0.5 * found.force(nu_dot, nu, *rest))

    error = prepared.motion.tau - found.tau
    motion = replace(found.motion, tau=0.5 * found.motion.tau)
    return Prediction(prepared.motion.tau - 0.5 * error, motion, force)


def _unstable(prepared: Prepared) -> Prediction:
    found = _base(prepared)

    def force(nu_dot: Floats, nu: Floats, *rest: Any) -> Floats:
        return np.asarray(found.force(nu_dot, nu, *rest) - 2e4 * nu)

    return replace(found, force=force)


def _weightless(prepared: Prepared) -> Prediction:
    found = _base(prepared)

    def force(nu_dot: Floats, nu: Floats, *rest: Any) -> Floats:
        return np.asarray(found.force(nu_dot, nu, *rest) - 1e5 * nu_dot)

    return replace(found, force=force)


RIVALS = {
    "blank": _rival(_base),
    "twice": _rival(_shifted),
    "halved": _rival(_halved),
    "unstable": _rival(_unstable),
    "weightless": _rival(_weightless),
    "refuses": _refuses,
}


@pytest.fixture(scope="module")
def scored(logs: tuple[str, str, Path]) -> TransferResult:
    first, other, folder = logs
    model = _true(prepared_log(first, PROFILE, folder))
    return transfer(first, other, PROFILE, folder, diagnosed=model, rivals=RIVALS).scores()


def test_a_rival_that_learnt_nothing_is_worth_the_base_model(scored: TransferResult) -> None:
    blank_one, base = scored.methods["blank"], scored.base
    assert blank_one.mse == {"surge": 1.0, "sway": 1.0, "yaw": 1.0}
    assert blank_one.position_m == blank_one.base_position_m == base.position_m
    assert blank_one.heading_rad == base.heading_rad
    assert not blank_one.why


def test_twice_the_error_is_four_times_its_square(scored: TransferResult) -> None:
    assert scored.methods["twice"].mse == pytest.approx({"surge": 4.0, "sway": 4.0, "yaw": 4.0})
    assert scored.methods["twice"].windows == pytest.approx({"surge": 4.0, "sway": 4.0, "yaw": 4.0})
    assert scored.methods["refuses"].windows == {}


def test_half_the_thrust_on_half_the_hull_predicts_no_better(scored: TransferResult) -> None:
    halved = scored.methods["halved"]
    assert halved.mse == pytest.approx({"surge": 0.25, "sway": 0.25, "yaw": 0.25})
    assert halved.windows == pytest.approx({"surge": 1.0, "sway": 1.0, "yaw": 1.0})
    assert halved.position_m == pytest.approx(scored.base.position_m)


def test_noise_of_the_acceleration_averages_out_over_windows(scored: TransferResult) -> None:
    """The true model leaves noise alone, of which an average over seconds holds less."""
    true = scored.methods["diagnosed"]
    assert all(0.0 < true.windows[axis] < 0.8 * true.mse[axis] for axis in true.mse)


def test_windows_of_a_constant_error_hold_it_and_keep_to_unbroken_rows() -> None:
    rows = np.ones(100, dtype=bool)
    rows[40] = False
    found = window_errors(np.full((100, 3), 2.0), rows, 10.0, 2.0)
    # 20 rows a window, a new one every 10: three begin in the 40 rows before the gap, four in the 59 after it.
    assert found == pytest.approx(np.full((7, 3), 2.0))
    assert window_errors(np.ones((10, 3)), rows[:10], 10.0, 2.0).shape == (0, 3)


def test_fast_noise_weighs_little_in_windows() -> None:
    alternating = np.tile([[1.0], [-1.0]], (200, 3))
    found = window_errors(alternating, np.ones(400, dtype=bool), 10.0, 4.0)
    assert np.abs(found).max() < 1e-6


def test_the_truth_of_the_first_log_holds_in_the_second(scored: TransferResult) -> None:
    """A wind of 6.4 m/s pushes with 200 N: with it in the model, what is left is the noise of the acceleration."""
    true = scored.methods["diagnosed"]
    assert true.mse["sway"] < 0.05
    assert true.mse["yaw"] < 0.05
    assert true.position_m < 0.25 * true.base_position_m
    assert {one.effect for one in true.effects} == {"wind", "payload", "thruster_gain"}
    assert not true.why


def test_what_began_in_the_first_log_begins_in_the_second_at_the_same_time(logs: tuple[str, str, Path]) -> None:
    first, other = (prepared_log(log, PROFILE, logs[2]) for log in logs[:2])
    there, model = other.recording.sha256, transferred(_true(first), first, other)
    wind, load = model.conditions_of(there)
    assert (wind.onset_in(there), load.onset_in(there), load.offset_in(there)) == (0.0, 120.0, 200.0)
    assert model.vessel_effects[0].onset_in(there) == 90.0
    # Nothing changes for the log that it was found in.
    assert len(model.conditions_of(first.recording.sha256)) == 2


def test_free_runs_that_diverge_are_counted(scored: TransferResult) -> None:
    unstable = scored.methods["unstable"]
    assert unstable.diverged > 0
    assert f"{unstable.diverged} of {unstable.starts} runs diverged" in unstable.why
    assert unstable.mse == scored.methods["blank"].mse
    assert scored.methods["blank"].diverged == 0


def test_a_model_that_cannot_run_free_says_why(scored: TransferResult) -> None:
    weightless = scored.methods["weightless"]
    assert weightless.position_m is None
    assert weightless.heading_rad is None
    assert "not positive definite" in weightless.why
    assert weightless.base_position_m == scored.base.position_m


def test_a_rival_that_cannot_learn_says_why(scored: TransferResult) -> None:
    refuses = scored.methods["refuses"]
    assert refuses.mse == {"surge": None, "sway": None, "yaw": None}
    assert refuses.position_m is None
    assert refuses.why == "log: cannot be learnt from. Fix: give another"


def test_all_of_it_goes_into_json(scored: TransferResult) -> None:
    assert TransferResult.from_json(json.loads(json.dumps(scored.to_json(), allow_nan=False))) == scored
    assert list(scored.methods) == ["diagnosed", *RIVALS]


def test_a_diagnosis_that_wrote_no_model_leaves_the_base_model(logs: tuple[str, str, Path]) -> None:
    nothing = transfer(*logs[:2], PROFILE, logs[2], diagnosed=None, rivals={}).scores().methods["diagnosed"]
    assert nothing.mse == {"surge": 1.0, "sway": 1.0, "yaw": 1.0}
    assert "wrote no model" in nothing.why


def test_the_first_log_is_no_second_one(logs: tuple[str, str, Path]) -> None:
    with pytest.raises(FerryIdError, match=r"the same log as .*Fix: give another log"):
        transfer(logs[0], logs[0], PROFILE, logs[2], diagnosed=None, rivals={})


def test_a_model_of_another_log_is_refused(logs: tuple[str, str, Path]) -> None:
    model = replace(blank_model(PROFILE, "other"), training=({"name": "x", "sha256": "0"},))
    with pytest.raises(FerryIdError, match=r"not a model of .*Fix: give the model that the diagnosis"):
        transfer(*logs[:2], PROFILE, logs[2], diagnosed=model, rivals={})


def test_what_is_diagnosed_beats_base_model_and_stepwise_regression(logs: tuple[str, str, Path]) -> None:
    """From one end to the other, by way of the model's file; the only test here that diagnoses."""
    first, other, folder = logs
    found = store_updated_model(
        diagnose([first], PROFILE, DiagnosisSettings(), RunContext(folder)), PROFILE, None, folder
    )[0]
    assert found.model is not None
    result = transfer(
        first, other, PROFILE, folder, diagnosed=found.model, rivals={"stepwise": stepwise.learn}
    ).scores()
    diagnosed, rival = result.methods["diagnosed"], result.methods["stepwise"]
    assert [one.effect for one in diagnosed.effects] == ["wind"]
    assert max(diagnosed.mse.values()) < 0.8
    assert diagnosed.position_m < 0.25 * diagnosed.base_position_m
    assert diagnosed.position_m < rival.position_m
    assert rival.names[0].effect == "wind"
