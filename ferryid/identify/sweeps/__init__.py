"""Sweeps: cross-validated errors over settings, or over structures of the basis."""

from ferryid.identify.sweeps.settings_sweep import BY, Sweep, sweep_json, sweep_settings
from ferryid.identify.sweeps.structure_comparison import (
    Ratios,
    Structure,
    StructureComparison,
    StructureSweep,
    over_base,
    structures_json,
)
from ferryid.identify.sweeps.structure_sweep import sweep_structures

__all__ = [
    "BY",
    "Ratios",
    "Structure",
    "StructureComparison",
    "StructureSweep",
    "Sweep",
    "over_base",
    "structures_json",
    "sweep_json",
    "sweep_settings",
    "sweep_structures",
]
