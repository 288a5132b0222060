"""Adaptive rounds: corrections on top of models, and means of models."""

from ferryid.identify.adaptive.averaging import geometric_weights, mean_of_last, weighted_mean
from ferryid.identify.adaptive.rounds import data_matrix, fit_motions, update_axes

__all__ = [
    "data_matrix",
    "fit_motions",
    "geometric_weights",
    "mean_of_last",
    "update_axes",
    "weighted_mean",
]
