"""Regression: cross-products of basis and residual, SIMPLS, NIPALS, principal components and QR.

Modules are imported when a name of theirs is first asked for: `ferryid --help` lists the bases and needs no numpy.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ferryid.lazy import import_on_demand

if TYPE_CHECKING:
    from ferryid.regression.active_set import non_negative
    from ferryid.regression.collinearity import singular_values, undetermined_terms
    from ferryid.regression.cross_products import CrossProducts, Rows
    from ferryid.regression.nipals import component_covariances, fit_nipals
    from ferryid.regression.pca import principal_components
    from ferryid.regression.qr import QrFactor, factorise
    from ferryid.regression.random_effects import GroupSums, MixedFit
    from ferryid.regression.simpls import Simpls, fit_simpls, total
    from ferryid.regression.test_function import STRIDES, window_rows, window_starts, window_sums, window_weights
    from ferryid.regression.thresholds import REGRESSION
    from ferryid.regression.window_shares import averaged_out

__all__ = [
    "REGRESSION",
    "STRIDES",
    "CrossProducts",
    "GroupSums",
    "MixedFit",
    "QrFactor",
    "Rows",
    "Simpls",
    "averaged_out",
    "component_covariances",
    "factorise",
    "fit_nipals",
    "fit_simpls",
    "non_negative",
    "principal_components",
    "singular_values",
    "total",
    "undetermined_terms",
    "window_rows",
    "window_starts",
    "window_sums",
    "window_weights",
]

__getattr__ = import_on_demand(
    __name__,
    {
        "collinearity": (
            "singular_values",
            "undetermined_terms",
        ),
        "cross_products": (
            "CrossProducts",
            "Rows",
        ),
        "nipals": (
            "component_covariances",
            "fit_nipals",
        ),
        "active_set": ("non_negative",),
        "window_shares": ("averaged_out",),
        "pca": ("principal_components",),
        "qr": (
            "QrFactor",
            "factorise",
        ),
        "random_effects": (
            "GroupSums",
            "MixedFit",
        ),
        "simpls": (
            "Simpls",
            "fit_simpls",
            "total",
        ),
        "test_function": (
            "STRIDES",
            "window_rows",
            "window_starts",
            "window_sums",
            "window_weights",
        ),
        "thresholds": ("REGRESSION",),
    },
)
