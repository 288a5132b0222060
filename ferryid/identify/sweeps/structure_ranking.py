"""Structures by their cross-validated errors in blocks: intervals, and those that cannot be told from the best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ferryid.identify.sweeps.structure_comparison import Ratios, Structure, StructureComparison
from ferryid.identify.thresholds import IDENTIFY
from ferryid.regression.bases import Basis
from ferryid.regression.resampling import model_confidence_set, percentiles, times_drawn
from ferryid.types import Flags, Floats

DRAWS = 2000


@dataclass(frozen=True, eq=False)
class StructureErrors:
    """A structure's choices, and its errors in blocks, shape (B, 3)."""

    basis: str
    functions: Basis
    allowed: Flags
    components: int
    within: tuple[int, ...]
    errors: Floats


def rank_structures(tried: Sequence[StructureErrors], base: Floats, rows: Floats, folds: int) -> StructureComparison:
    """Draw blocks, and order the structures by their score."""
    errors = np.array([one.errors for one in tried])
    mse = errors.sum(axis=1) / rows.sum()
    least = mse.min(axis=0)
    unit = np.where(least > 0.0, least, 1.0)
    scores = (mse / unit).mean(axis=1)
    times = times_drawn(len(rows), DRAWS, 0)
    drawn = np.einsum("db,sbj->sdj", times, errors) / (times @ rows)[:, None]
    p = model_confidence_set(scores, (drawn / unit).mean(axis=2).T, len(rows))
    order = np.lexsort([[one.allowed.sum() for one in tried], scores.round(12)])
    simplest = min(order, key=lambda number: tried[number].allowed.sum())

    def against(number: int, other: int) -> Ratios:
        with np.errstate(divide="ignore", invalid="ignore"):
            value, ratios = mse[number] / mse[other], drawn[number] / drawn[other]
        low, high = percentiles(ratios.T, len(rows), IDENTIFY.structure_level)
        return Ratios(value, low, high)

    structures = tuple(
        Structure(
            basis=tried[number].basis,
            structure=tried[number].functions.structure,
            functions=tried[number].functions,
            allowed=tried[number].allowed,
            components=tried[number].components,
            within=tried[number].within,
            mse=mse[number],
            score=float(scores[number]),
            p=float(p[number]),
            against_best=against(number, order[0]),
            against_simplest=against(number, simplest),
        )
        for number in order
    )
    return StructureComparison(structures, base.sum(axis=0) / rows.sum(), folds, int(rows.sum()), len(rows))
