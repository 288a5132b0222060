"""Predictions of a log by a model: the applied force, and free runs."""

from ferryid.models.prediction.free_run import (
    HORIZONS_S,
    NO_MASS,
    FreeRun,
    SingleRuns,
    predicted_acceleration,
    run_free,
    runs_free,
    single_paths,
    single_runs,
    starting_points,
)
from ferryid.models.prediction.log_prediction import Prediction, predict, predict_base, predict_with_effects, signal_map
from ferryid.models.prediction.window_averages import WindowErrors, window_errors, window_scores

__all__ = [
    "HORIZONS_S",
    "NO_MASS",
    "FreeRun",
    "Prediction",
    "SingleRuns",
    "WindowErrors",
    "predict",
    "predict_base",
    "predict_with_effects",
    "predicted_acceleration",
    "run_free",
    "runs_free",
    "signal_map",
    "single_paths",
    "single_runs",
    "starting_points",
    "window_errors",
    "window_scores",
]
