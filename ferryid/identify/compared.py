"""What a comparison of structures found, as values, as JSON and in words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted
from ferryid.identify.basis import Basis
from ferryid.identify.crossed import TEST_WINDOW_S
from ferryid.identify.model import AXES
from ferryid.identify.scores import by_axis
from ferryid.identify.settings import FitSettings
from ferryid.identify.sweep import BY, SCHEMA

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

LEVEL = 0.95


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
        Names that `fit` takes, the former without wind and current.
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
        See `confidence_set`; above 0.05 it cannot be told from the best.
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
        return self.p > 1.0 - LEVEL


@dataclass(frozen=True, eq=False)
class Compared:
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


@dataclass(frozen=True)
class StructureSweep:
    """What a comparison of structures found.

    Attributes
    ----------
    vessel, logs, settings
        As in `ferryid.identify.sweep.Sweep`.
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
    settings: FitSettings
    block_s: float
    by: Mapping[str, Compared]
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
        "test_window_s": TEST_WINDOW_S,
        "block_s": found.block_s,
        "by": {key: _compared_json(one) for key, one in found.by.items()},
        "unusable": [{"basis": name, "reason": reason} for name, reason in found.unusable.items()],
        "choice": {"basis": chosen.basis, "structure": chosen.structure},
        "notes": list(found.notes),
        "report": report,
    }


def _compared_json(one: Compared) -> dict[str, Any]:
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


def _structure_json(structure: Structure, one: Compared) -> dict[str, Any]:
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


def over_base(structure: Structure, one: Compared) -> Floats:
    """Return the MSE over the base model's, shape (3,); NaN where that makes no error."""
    return np.asarray(structure.mse / np.where(one.base > 0.0, one.base, np.nan))


def verdict(one: Compared) -> str:
    """Return in a sentence which structures the data support."""
    kept = [structure for structure in one.structures if structure.kept]
    supported, count = one.supported, len(one.structures)
    size = f"{counted(supported.coefficients, 'free coefficient')}"
    if len(kept) == 1:
        return (
            f"The data support {supported.title}, with {size}: at 95 % it is better than every other of "
            f"{counted(count, 'structure')}."
        )
    which = (
        f"all {counted(count, 'structure')}, as none is significantly worse than the best (5 % level)"
        if len(kept) == count
        else f"the {len(kept)} of {counted(count, 'structure')} that are not significantly worse than the best (5 % level)"
    )
    return f"The data support {supported.title}, with {size}: the fewest of {which}."


def render_structures(found: StructureSweep) -> str:
    """Return a comparison of structures for a terminal."""
    lines = [verdict(found.by["blocks"]), ""]
    for key, one in found.by.items():
        lines += [
            f"by {BY[key]}, {counted(one.folds, 'fold')}, {counted(one.rows, 'row')}, {counted(one.blocks, 'block')}",
            *_scores(one),
            "",
        ]
        lines += [f"by {BY[key]}: MSE over that of {one.structures[0].title}, 95 % intervals", *_intervals(one), ""]
    lines += [f"left out: {name}: {reason}" for name, reason in found.unusable.items()]
    lines += [f"note: {note}" for note in found.notes]
    return "\n".join(lines).rstrip()


def _scores(one: Compared) -> list[str]:
    lines = [
        f"  {'basis':<13}{'structure':<11}{'terms':>9}{'comp.':>6}"
        + "".join(f"{axis:>8}" for axis in AXES)
        + "   score      p"
    ]
    for structure in one.structures:
        ratios = "".join(f"{value:>8.4f}" for value in over_base(structure, one))
        p = f"{structure.p:>7.3f}" if structure.p >= 0.001 else " <0.001"
        lines.append(
            f"{_mark(structure, one)} {structure.basis:<13}{structure.structure:<11}{terms(structure):>9}"
            f"{structure.components:>6}{ratios}{structure.score:>8.4f}{p}"
        )
    lines.append(
        "  terms in surge/sway/yaw; axes: MSE over the base model's; score: each axis over its least MSE, mean"
    )
    lines.append(
        "  p: that no other is better; · not significantly worse than the best (5 % level); * of these the fewest coefficients"
    )
    return lines


def _intervals(one: Compared) -> list[str]:
    lines = [f"  {'basis':<13}{'structure':<11}" + "".join(f"{axis:>22}" for axis in AXES)]
    for structure in one.structures:
        against = structure.against_best
        cells = [
            f"{value:.3g} [{low:.3g}, {high:.3g}]"
            for value, low, high in zip(against.value, against.low, against.high, strict=True)
        ]
        lines.append(
            f"{_mark(structure, one)} {structure.basis:<13}{structure.structure:<11}"
            + "".join(f"{cell:>22}" for cell in cells)
        )
    return lines


def _mark(structure: Structure, one: Compared) -> str:
    return "*" if structure is one.supported else "·" if structure.kept else " "


def terms(structure: Structure) -> str:
    """Return the number of terms in surge, sway and yaw as ``6/11/12``."""
    return "/".join(str(count) for count in structure.allowed.sum(axis=0))
