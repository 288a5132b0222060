"""What a comparison of structures found, as values, as JSON and in words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ferryid.identify.sweeps.settings_sweep import SCHEMA
from ferryid.identify.sweeps.swept import Swept, beats_base
from ferryid.identify.thresholds import IDENTIFY
from ferryid.regression.bases import Basis
from ferryid.types import AXES, Flags, Floats, by_axis


@dataclass(frozen=True, eq=False)
class Ratios:
    """Mean square error per axis over that of another structure, with its interval; shape (3,) each."""

    value: Floats
    low: Floats
    high: Floats


@dataclass(frozen=True, eq=False)
class Structure:
    """One basis, decoupled or coupled, and how it did.

    Attributes
    ----------
    basis, structure
        Names that a fit takes, the former without wind and current.
    functions
        The functions, with those of wind and current.
    allowed
        Terms that each axis may use, without inertia that is held, shape (K, 3).
    components, within
        Number of components that all folds together choose, and that each fold's training rows chose.
    mse
        Cross-validated mean square error per axis [N², N², (N·m)²], shape (3,).
    score
        Each axis over the least of all structures, mean.
    p
        See `model_confidence_set`; above 0.05 it cannot be told from the best.
    against_best, against_simplest
        Error over that of the structure with the least score, and over that of the one with the fewest coefficients.
    """

    basis: str
    structure: str
    functions: Basis
    allowed: Flags
    components: int
    within: tuple[int, ...]
    mse: Floats
    score: float
    p: float
    against_best: Ratios
    against_simplest: Ratios

    @property
    def title(self) -> str:
        """Both names."""
        return f"{self.basis}, {self.structure}"

    @property
    def held(self) -> Flags:
        """Axes on which the inertia is the base model's, shape (3,)."""
        return np.asarray((self.functions.mask & ~self.allowed).any(axis=0))

    @property
    def coefficients(self) -> int:
        """Number of free coefficients, without the constants."""
        return int(self.allowed.sum())

    @property
    def kept(self) -> bool:
        """True where it cannot be told from the best."""
        return self.p > 1.0 - IDENTIFY.structure_level


@dataclass(frozen=True, eq=False)
class StructureComparison:
    """Structures compared in one way of cutting.

    Attributes
    ----------
    structures
        By score, the best first.
    base
        Mean square error of the base model on the same rows, shape (3,).
    folds, rows, blocks
        Number of folds, of test rows, and of blocks that were drawn from.
    """

    structures: tuple[Structure, ...]
    base: Floats
    folds: int
    rows: int
    blocks: int

    @property
    def simplest(self) -> Structure:
        """The structure with the fewest coefficients."""
        return min(self.structures, key=lambda one: one.coefficients)

    @property
    def supported(self) -> Structure:
        """Of the structures that cannot be told from the best, the one with the fewest coefficients."""
        return min((one for one in self.structures if one.kept), key=lambda one: one.coefficients)

    @property
    def any_beats_base(self) -> bool:
        """Whether any structure errs less than the base model does without a correction."""
        return any(beats_base(over_base(one, self)) for one in self.structures)


@dataclass(frozen=True)
class StructureSweep(Swept):
    """What a comparison of structures found.

    Attributes
    ----------
    vessel, logs
        As in `ferryid.identify.sweeps.settings_sweep.Sweep`.
    block_s
        Least length of a block [s].
    by
        By contiguous stretches of every log (``"blocks"``) and, of several logs, by whole ones (``"logs"``).
    unusable
        Bases that cannot be used here, and why.
    notes
        What a reader must know, as sentences.
    """

    vessel: str
    logs: tuple[Mapping[str, Any], ...]
    block_s: float
    by: Mapping[str, StructureComparison]
    unusable: Mapping[str, str]
    notes: tuple[str, ...]


def structures_json(found: StructureSweep, report: str | None = None) -> dict[str, Any]:
    """Return a comparison of structures in the form of schema ``ferryid.sweep/1``."""
    chosen = found.by["blocks"].supported
    # Every structure has names of its own.
    settings = {key: value for key, value in found.settings.plain().items() if key not in ("basis", "structure")}
    return {
        "schema": SCHEMA,
        "what": "basis",
        "vessel": found.vessel,
        "logs": [dict(log) for log in found.logs],
        "settings": {**settings, **found.settings.scale},
        "window_s": found.settings.window_s,
        "test_window_s": found.test_window_s,
        "block_s": found.block_s,
        "by": {key: _compared_json(one) for key, one in found.by.items()},
        "unusable": [{"basis": name, "reason": reason} for name, reason in found.unusable.items()],
        "choice": {"basis": chosen.basis, "structure": chosen.structure},
        "notes": list(found.notes),
        **found.estimator_json(),
        "report": report,
    }


def _compared_json(one: StructureComparison) -> dict[str, Any]:
    return {
        "folds": one.folds,
        "rows": one.rows,
        "blocks": one.blocks,
        "base_mse": by_axis(one.base),
        "best": _names(one.structures[0]),
        "simplest": _names(one.simplest),
        "supported": _names(one.supported),
        "structures": [_structure_json(structure, one) for structure in one.structures],
    }


def _structure_json(structure: Structure, one: StructureComparison) -> dict[str, Any]:
    return {
        **_names(structure),
        "functions": structure.functions.name,
        "terms": {axis: int(count) for axis, count in zip(AXES, structure.allowed.sum(axis=0), strict=True)},
        "coefficients": structure.coefficients,
        "components": structure.components,
        "components_by_fold": list(structure.within),
        "held_inertia": [axis for axis, held in zip(AXES, structure.held, strict=True) if held],
        "mse": by_axis(structure.mse),
        "over_base": by_axis(over_base(structure, one)),
        "score": structure.score,
        "p": structure.p,
        "not_told_from_best": structure.kept,
        "against_best": _ratios_json(structure.against_best),
        "against_simplest": _ratios_json(structure.against_simplest),
    }


def _names(structure: Structure) -> dict[str, str]:
    return {"basis": structure.basis, "structure": structure.structure}


def _ratios_json(ratios: Ratios) -> dict[str, Any]:
    return {
        axis: {"ratio": float(value), "low": float(low), "high": float(high)}
        for axis, value, low, high in zip(AXES, ratios.value, ratios.low, ratios.high, strict=True)
    }


def over_base(structure: Structure, one: StructureComparison) -> Floats:
    """Return the MSE over the base model's, shape (3,); NaN where that makes no error."""
    return np.asarray(structure.mse / np.where(one.base > 0.0, one.base, np.nan))
