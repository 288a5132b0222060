"""The coefficients of a model's hull, equations of motion and terms, with their intervals."""

from ferryid.models.coefficients.equations import CUBES, EQUATION_UNITS, PRODUCTS, equation_coefficients
from ferryid.models.coefficients.intervals import coefficient_intervals

__all__ = ["CUBES", "EQUATION_UNITS", "PRODUCTS", "coefficient_intervals", "equation_coefficients"]
