"""The coefficients of a model's hull and terms, with their intervals."""

from ferryid.models.coefficients.intervals import coefficient_intervals, opposite, term_interval

__all__ = ["coefficient_intervals", "opposite", "term_interval"]
