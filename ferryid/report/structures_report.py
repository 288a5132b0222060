"""Compared structures on one HTML page: what ``ferryid sweep basis`` leaves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ferryid.errors import FerryIdError
from ferryid.identify import FOLDS, FitSettings
from ferryid.identify.sweeps import (
    BY,
    Ratios,
    StructureComparison,
    StructureSweep,
    over_base,
    structures_json,
    sweep_structures,
)
from ferryid.report.folder import made
from ferryid.report.html import template, with_contents
from ferryid.report.interactive import STATIC, Interactive
from ferryid.report.next_steps import after_sweep
from ferryid.report.other_vessels import other_vessels
from ferryid.report.outcome import Report
from ferryid.report.structures_figures import forest
from ferryid.report.structures_text import count_terms, render_structures, supported_structure
from ferryid.report.structures_timeline import structures_timeline
from ferryid.report.sweep_report import leave
from ferryid.types import AXES, NOTHING, Given, RunContext
from ferryid.vessel.profile import Profile


def structures_and_report(
    logs: Sequence[str],
    profile: Profile,
    settings: FitSettings,
    run: RunContext,
    *,
    windows_s: Sequence[float] = (),
    folds: int = FOLDS,
    archive: bool = False,
) -> Report:
    """Compare structures and write the page; arguments and errors are those of `sweep_structures`."""
    if archive:
        raise FerryIdError("--archive: what is kept of a log is of one basis. Fix: name the logs to compare bases on")
    if windows_s:
        raise FerryIdError("--windows: bases are compared at one window. Fix: give --window")
    found = sweep_structures(logs, profile, settings, run, folds=folds, odd=other_vessels(profile, run))
    run.progress("writing the report")
    return leave(
        run,
        "basis",
        found.logs,
        {k: structures_timeline(one) for k, one in enumerate(found.by.values())},
        lambda interactive: render(found, run.command, interactive, run.given),
        lambda report: structures_json(found, report),
        render_structures(found),
    )


def render(
    found: StructureSweep, command: Sequence[str] = (), interactive: Interactive = STATIC, given: Given = NOTHING
) -> tuple[str, dict[str, str]]:
    """Return the page of compared structures as HTML with the drawings inside, and the drawings (SVG) by name."""
    drawings = {f"basis-{key}": forest(one) for key, one in found.by.items()}
    sections = [
        {
            "title": f"By {BY[key]}",
            "verdict": supported_structure(one),
            "one": one,
            "best": one.structures[0].title,
            "simplest": one.simplest.title,
            "svg": drawings[f"basis-{key}"],
            "timeline": interactive.number(place),
            "table": _rows(one),
        }
        for place, (key, one) in enumerate(found.by.items())
    ]
    plain, best = structures_json(found), found.by["blocks"].supported
    page = template("structures.html").render(
        made=made(command),
        assets=interactive.assets,
        vessel=found.vessel,
        headline=supported_structure(found.by["blocks"]),
        notes=found.notes,
        unusable=found.unusable,
        logs=[{**log, "seconds": f"{log['seconds']:.0f}"} for log in found.logs],
        sections=sections,
        axes=AXES,
        block_s=f"{found.block_s:.3g}",
        window_s=f"{found.settings.window_s:g}",
        test_window_s=f"{plain['test_window_s']:.3g}",
        settings=plain["settings"],
        found=found,
        next=after_sweep(
            ("--basis", best.basis, "--structure", best.structure), found.by["blocks"].any_beats_base, given
        ),
    )
    return with_contents(page), drawings


def _rows(one: StructureComparison) -> list[dict[str, Any]]:
    return [
        {
            "basis": structure.basis,
            "structure": structure.structure,
            "functions": structure.functions.name,
            "terms": count_terms(structure),
            "components": structure.components,
            "within": f"{min(structure.within)} to {max(structure.within)}",
            "ratios": [f"{value:.4f}" for value in over_base(structure, one)],
            "score": f"{structure.score:.4f}",
            "p": f"{structure.p:.3f}" if structure.p >= 0.001 else "< 0.001",
            "kept": structure.kept,
            "chosen": structure is one.supported,
            "best": _cells(structure.against_best),
            "simplest": _cells(structure.against_simplest),
        }
        for structure in one.structures
    ]


def _cells(ratios: Ratios) -> list[str]:
    return [
        f"{value:.3g} [{low:.3g}, {high:.3g}]"
        for value, low, high in zip(ratios.value, ratios.low, ratios.high, strict=True)
    ]
