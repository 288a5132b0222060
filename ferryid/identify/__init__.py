"""Identification of a correction to the base model, from logs, from an archive, or from motions in memory."""

from ferryid.identify.acceptance import Acceptance, accept, accept_on_motions, force_mse
from ferryid.identify.archive import fit_archive, keep_for_archive
from ferryid.identify.inputs import read_logs
from ferryid.identify.model_selection import Selection
from ferryid.identify.outcome import ComponentCurve, Excitation, FitOutcome, LogFit
from ferryid.identify.pipeline import fit_logs, fit_opened
from ferryid.identify.remainder import fit_remainder, prediction_errors, with_remainder
from ferryid.identify.settings import FOLDS, FitSettings, check_window, parse_window, parse_windows

__all__ = [
    "FOLDS",
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
    "keep_for_archive",
    "parse_window",
    "parse_windows",
    "prediction_errors",
    "read_logs",
    "with_remainder",
]
