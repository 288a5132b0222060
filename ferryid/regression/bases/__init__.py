"""Bases of the correction: terms, lists of terms, and functions of wind and current.

Modules are imported when a name of theirs is first asked for: `ferryid --help` lists the bases and needs no numpy.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ferryid.lazy import import_on_demand

if TYPE_CHECKING:
    from ferryid.regression.bases.basis import STRUCTURES, Basis, make_basis, relative_flow, with_hull_length
    from ferryid.regression.bases.crossflow_integrals import LEAST_SPEED_MPS
    from ferryid.regression.bases.forms import basis_names
    from ferryid.regression.bases.term import CROSSFLOW_FACTORS, DIMENSIONS, SWAY, Term

__all__ = [
    "CROSSFLOW_FACTORS",
    "DIMENSIONS",
    "LEAST_SPEED_MPS",
    "STRUCTURES",
    "SWAY",
    "Basis",
    "Term",
    "basis_names",
    "make_basis",
    "relative_flow",
    "with_hull_length",
]

__getattr__ = import_on_demand(
    __name__,
    {
        "basis": (
            "STRUCTURES",
            "Basis",
            "make_basis",
            "relative_flow",
            "with_hull_length",
        ),
        "crossflow_integrals": ("LEAST_SPEED_MPS",),
        "forms": ("basis_names",),
        "term": (
            "CROSSFLOW_FACTORS",
            "DIMENSIONS",
            "SWAY",
            "Term",
        ),
    },
)
