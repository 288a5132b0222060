"""Cautions about scores and free runs: told when useless, told when worse than before, silent otherwise."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from ferryid.identify.fit_warnings import free_run_warnings, general_warnings, rest_warnings
from ferryid.identify.outcome import Excitation
from ferryid.identify.pipeline import fit_logs
from ferryid.identify.settings import FitSettings
from ferryid.models import ForceScores, ModelScores
from ferryid.models.prediction.free_run import FreeRun
from ferryid.types import RunContext
from ferryid.vessel import load_profile

SHORT = Path(__file__).resolve().parents[2] / "fixtures" / "short.mcap"


def run(position: float, heading: float, starts: int = 5, note: str = "") -> FreeRun:
    horizons = np.array([5.0, 10.0, 60.0])
    grow = horizons / 5.0
    return FreeRun(horizons, position * grow, heading * grow, 0 * grow, 0 * grow, starts, {}, note)


def test_a_better_free_run_needs_no_caution() -> None:
    assert free_run_warnings(run(2.0, 0.2), run(1.0, 0.1)) == ()


def test_worse_than_the_base_model_is_told_with_both_numbers() -> None:
    (told,) = free_run_warnings(run(1.0, 0.1), run(1.5, 0.1))
    assert "position is worse than the base model's (18 against 12 m)" in told


def test_a_model_that_cannot_run_is_told() -> None:
    assert free_run_warnings(run(1.0, 0.1), run(1.0, 0.1, 0, "no mass")) == (
        "The new model cannot be run free: no mass.",
    )


def test_an_axis_that_errs_more_than_its_mean_is_told_beside_the_base_model() -> None:
    force = ForceScores.of(np.array([0.4, 4.0, 1.2]), np.array([0.2, 3.0, 1.5]), np.ones(3))
    nothing = Excitation(np.ones(3), {}, 1.0, {}, np.ones(3))
    sway, yaw = general_warnings(FitSettings(), nothing, ModelScores(force, 100, 500.0, "blocks", ()), 1)
    assert sway.startswith("In sway the model explains the measured force worse than its mean does (R² -2.00)")
    assert sway.endswith("The base model, with which the verdict compares, errs more still.")
    assert yaw.startswith("In yaw")
    assert yaw.endswith("Do not rely on the model there.")


def test_too_few_headings_leave_a_wind_that_is_estimated_in_doubt() -> None:
    force = ForceScores.of(np.ones(3), np.full(3, 0.1), np.full(3, 2.0))
    few = Excitation(np.ones(3), {}, 0.33, {}, np.ones(3))
    (told,) = general_warnings(FitSettings(), few, ModelScores(force, 100, 500.0, "blocks", ()), 1)
    assert told.startswith("Headings cover only 33 % of the compass: a steady wind or current could not be separated")
    assert told.endswith("do not rely on one that is estimated.")


def test_an_axis_that_errs_more_than_a_constant_velocity_is_told_with_both_errors() -> None:
    force = ForceScores.of(np.array([0.4, 4.0, 1.2]), np.array([0.01, 0.04, 0.09]), np.ones(3))
    nothing = Excitation(np.ones(3), {}, 1.0, {}, np.ones(3))

    def told(*still: float) -> list[str]:
        scores = replace(force, mse_constant_velocity=np.array(still))
        return general_warnings(FitSettings(), nothing, ModelScores(scores, 100, 500.0, "blocks", ()), 1)

    assert told(1.0, np.nan, 0.1) == []
    (yaw,) = told(1.0, np.nan, 0.0025)
    assert yaw.startswith("In yaw the model predicts acceleration worse than a velocity that does not change")
    assert "(rms error 0.3 against 0.05 N·m)" in yaw


def test_a_constant_force_that_counts_beside_the_damping_is_said_with_axis_and_size() -> None:
    visited = np.array([[1.0, 0.2, 0.1], [-1.0, -0.2, -0.1], [np.nan, 0.0, 0.0]])

    def force(nu: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(nu * [40.0, 50.0, 100.0] + [-24.0, 4.9, -5.1])

    (one,) = rest_warnings(force, visited)
    assert (
        "a constant force of 24 N in surge (60 % of the mean damping) and 5.1 N·m in yaw (51 % of the mean damping):"
        in one
    )
    (one,) = rest_warnings(lambda nu: np.asarray(nu * [2.0, 50.0, 100.0] + [-24.0, 0.0, 0.0]), visited)
    assert "a constant force of 24 N in surge (many times the mean damping):" in one
    assert rest_warnings(lambda nu: 40.0 * nu, visited) == ()
    assert rest_warnings(force, visited[2:]) == ()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("estimator", "window_s", "why"),
    [("derivative", 0.9, "it was asked for."), ("auto", 60.0, "the weak form needs "), ("weak", 0.9, None)],
)
def test_a_window_of_the_weak_form_that_has_no_effect_is_told(
    estimator: str, window_s: float, why: str | None, tmp_path: Path
) -> None:
    settings = FitSettings(draws=1, estimator=estimator, weak_window_s=window_s)
    found = fit_logs([str(SHORT)], load_profile("milliampere"), settings, RunContext(tmp_path))
    told = [one for one in found.warnings if "had no effect" in one]
    wanted = f"--weak-window {window_s:g} had no effect, as the derivative's estimator was used: {why}"
    assert [one.startswith(wanted) for one in told] == ([] if why is None else [True])
