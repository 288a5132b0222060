"""A comparison of structures as text for a terminal."""

from __future__ import annotations

from ferryid.counts import all_counted, counted
from ferryid.identify.sweeps import BY, Structure, StructureComparison, StructureSweep, over_base
from ferryid.types import AXES


def supported_structure(one: StructureComparison) -> str:
    """Return in a sentence which structures the data support."""
    if not one.any_beats_base:
        return f"No structure beats the base model: keep it as it is. Of the structures alone, {_supported(one, 'the')}"
    return _supported(one, "The")


def _supported(one: StructureComparison, the: str) -> str:
    kept = [structure for structure in one.structures if structure.kept]
    supported, count = one.supported, len(one.structures)
    size = counted(supported.coefficients, "free coefficient")
    if len(kept) == 1:
        return (
            f"{the} data support {supported.title}, with {size}: at 95 % it is better than every other of "
            f"{counted(count, 'structure')}."
        )
    which = (
        f"{all_counted(count, 'structure')}, as none is significantly worse than the best at 95 %"
        if len(kept) == count
        else f"the {len(kept)} of {counted(count, 'structure')} that are not significantly worse than the best at 95 %"
    )
    return f"{the} data support {supported.title}, with {size}: the fewest of {which}."


def render_structures(found: StructureSweep) -> str:
    """Return a comparison of structures for a terminal."""
    lines = [supported_structure(found.by["blocks"]), *([found.estimator_says] if found.estimator_says else []), ""]
    for key, one in found.by.items():
        lines += [
            f"by {BY[key]}, {counted(one.folds, 'fold')}, {counted(one.rows, found.tested)}, {counted(one.blocks, 'block')}",
            *_scores(one, found.error),
            "",
        ]
        lines += [
            f"by {BY[key]}: {found.error} over that of {one.structures[0].title}, 95 % intervals",
            *_intervals(one),
            "",
        ]
    lines += [f"left out: {name}: {reason}" for name, reason in found.unusable.items()]
    lines += [f"note: {note}" for note in found.notes]
    return "\n".join(lines).rstrip()


def _scores(one: StructureComparison, error: str) -> list[str]:
    lines = [
        f"  {'basis':<13}{'structure':<11}{'terms':>9}{'comp.':>6}"
        + "".join(f"{axis:>8}" for axis in AXES)
        + "   score      p"
    ]
    for structure in one.structures:
        ratios = "".join(f"{value:>8.4f}" for value in over_base(structure, one))
        p = f"{structure.p:>7.3f}" if structure.p >= 0.001 else " <0.001"
        lines.append(
            f"{_mark(structure, one)} {structure.basis:<13}{structure.structure:<11}{count_terms(structure):>9}"
            f"{structure.components:>6}{ratios}{structure.score:>8.4f}{p}"
        )
    lines.append(
        f"  terms in surge/sway/yaw; axes: {error} over the base model's; score: each axis over its least, mean"
    )
    lines.append(
        "  p: that no other is better; · not significantly worse than the best at 95 %; * of these the fewest coefficients"
    )
    return lines


def _intervals(one: StructureComparison) -> list[str]:
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


def _mark(structure: Structure, one: StructureComparison) -> str:
    return "*" if structure is one.supported else "·" if structure.kept else " "


def count_terms(structure: Structure) -> str:
    """Return the number of terms in surge, sway and yaw as ``6/11/12``."""
    return "/".join(str(count) for count in structure.allowed.sum(axis=0))
