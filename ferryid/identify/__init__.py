"""Identification of a correction to the base model, from logs, from an archive, or from motions in memory."""

from ferryid.identify.acceptance import Acceptance, accept, accept_on_motions, force_mse
from ferryid.identify.archive import fit_archive
from ferryid.identify.block_sum_store import load_block_sums
from ferryid.identify.inputs import read_logs
from ferryid.identify.model_selection import Selection
from ferryid.identify.outcome import ComponentCurve, Excitation, FitOutcome, LogFit
from ferryid.identify.physical_checks import inertia_checks
from ferryid.identify.pipeline import fit_logs, fit_opened
from ferryid.identify.remainder import fit_remainder, prediction_errors, with_remainder
from ferryid.identify.settings import FOLDS, TEST_WINDOW_S, FitSettings, check_window, parse_window, parse_windows
from ferryid.identify.window_store import load_windows

__all__ = [
    "FOLDS",
    "TEST_WINDOW_S",
    "Acceptance",
    "ComponentCurve",
    "Excitation",
    "FitOutcome",
    "FitSettings",
    "LogFit",
    "Selection",
    "accept",
    "accept_on_motions",
    "check_window",
    "fit_archive",
    "fit_logs",
    "fit_opened",
    "fit_remainder",
    "force_mse",
    "inertia_checks",
    "load_block_sums",
    "load_windows",
    "parse_window",
    "parse_windows",
    "prediction_errors",
    "read_logs",
    "with_remainder",
]
