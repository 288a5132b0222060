"""Models of the applied force: the model file, its scores, ranges of validity and stored effects."""

from ferryid.models.model import Model, blank_model, model_from_json, model_to_json
from ferryid.models.scores import ForceScores, ModelScores, force_scores, mean_square, usable_rows
from ferryid.models.stored_effect import Conditions, Quantity, Source, StoredEffect
from ferryid.models.training_conditions import CONDITION_TITLES, fitted_conditions
from ferryid.models.validity import RANGE_UNITS, outside_ranges, payload_kg, span_ranges, validity_ranges

__all__ = [
    "CONDITION_TITLES",
    "RANGE_UNITS",
    "Conditions",
    "ForceScores",
    "Model",
    "ModelScores",
    "Quantity",
    "Source",
    "StoredEffect",
    "blank_model",
    "fitted_conditions",
    "force_scores",
    "mean_square",
    "model_from_json",
    "model_to_json",
    "outside_ranges",
    "payload_kg",
    "span_ranges",
    "usable_rows",
    "validity_ranges",
]
