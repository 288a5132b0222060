"""Comparison of models of one vessel on logs, and evaluation of one model."""

from ferryid.compare.candidates import BASE, select_candidates
from ferryid.compare.coefficient_table import is_of_a_hull
from ferryid.compare.comparison import ComparedLog, Comparison, compare
from ferryid.compare.comparison_result import (
    Coefficient,
    CommonErrors,
    ComparedModel,
    ComparisonResult,
    EffectRow,
    LogErrors,
    ModelPair,
    Ratio,
    Statement,
)
from ferryid.compare.evaluation import evaluate
from ferryid.compare.replay import Replay, replay_versions
from ferryid.compare.tracking import MEASURES, Tracking, cumulative_integral, signal_power, tracking_error

__all__ = [
    "BASE",
    "MEASURES",
    "Coefficient",
    "CommonErrors",
    "ComparedLog",
    "ComparedModel",
    "Comparison",
    "ComparisonResult",
    "EffectRow",
    "LogErrors",
    "ModelPair",
    "Ratio",
    "Replay",
    "Statement",
    "Tracking",
    "compare",
    "cumulative_integral",
    "evaluate",
    "is_of_a_hull",
    "replay_versions",
    "select_candidates",
    "signal_power",
    "tracking_error",
]
