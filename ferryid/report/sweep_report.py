"""A sweep on one HTML page: what ``ferryid sweep`` leaves."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ferryid.identify import FOLDS, FitSettings
from ferryid.identify.sweeps import BY, Sweep, sweep_json, sweep_settings
from ferryid.report.folder import made, place_of, write_folder
from ferryid.report.html import template, with_contents
from ferryid.report.interactive import STATIC, Interactive, make_interactive
from ferryid.report.next_steps import after_sweep
from ferryid.report.other_vessels import other_vessels
from ferryid.report.outcome import Report
from ferryid.report.sweep_figures import curves, heat_cells, heat_map
from ferryid.report.sweep_text import by_itself, fit_with, headline, render_sweep
from ferryid.report.sweep_timeline import sweep_timeline
from ferryid.report.timeline import Timeline
from ferryid.types import AXES, NOTHING, Given, RunContext
from ferryid.vessel.profile import Profile


def sweep_and_report(
    what: str,
    logs: Sequence[str],
    profile: Profile,
    settings: FitSettings,
    run: RunContext,
    *,
    windows_s: Sequence[float] = (),
    folds: int = FOLDS,
    archive: bool = False,
) -> Report:
    """Sweep settings over logs and write the page; arguments and errors are those of `sweep_settings`."""
    found = sweep_settings(
        what,
        logs,
        profile,
        settings,
        run,
        windows_s=windows_s,
        folds=folds,
        archive=archive,
        odd=other_vessels(profile, run),
    )
    run.progress("writing the report")
    timelines = {k: sweep_timeline(found, choice) for k, choice in enumerate(found.by.values())}
    return leave(
        run,
        what,
        found.logs,
        timelines,
        lambda interactive: render(found, run.command, interactive, run.given),
        lambda report: sweep_json(found, report),
        render_sweep(found),
    )


def leave(
    run: RunContext,
    what: str,
    logs: Sequence[Mapping[str, Any]],
    timelines: Mapping[int, Timeline],
    page_of: Callable[[Interactive], tuple[str, dict[str, str]]],
    json_of: Callable[[str], dict[str, Any]],
    text: str,
) -> Report:
    """Write page, drawings and JSON of a sweep into its folder.

    Parameters
    ----------
    run, what, logs
        Where to, what was swept, and over which logs.
    timelines, page_of
        Interactive figures by the section of the page, and the page with its drawings (SVG) by name that shows them.
    json_of, text
        Return the JSON for the page's path; what a terminal shows.
    """
    first = str(logs[0]["name"])
    more = f"-and-{len(logs) - 1}-more" if len(logs) > 1 else ""
    place = place_of(run.out / "reports", f"sweep-{what}-{first}{more}", run.given.logs, run.command)
    report = place.page
    plain = json_of(str(report))
    interactive = make_interactive(timelines, place.folder, run.out)
    page, drawings = page_of(interactive)
    write_folder(place, page, drawings, plain, "sweep.json", scripts=interactive.files())
    run.progress("")
    return Report(plain, f"{text}\nreport  {report}{place.note}", report)


def render(
    found: Sweep, command: Sequence[str] = (), interactive: Interactive = STATIC, given: Given = NOTHING
) -> tuple[str, dict[str, str]]:
    """Return the page of a sweep as HTML with the drawings inside, and the drawings (SVG) by name."""
    drawings, sections = {}, []
    for place, (key, choice) in enumerate(found.by.items()):
        name = f"{found.what}-{key}"
        drawings[name] = heat_map(found, choice) if len(found.windows_s) > 1 else curves(found, choice)
        sections.append(
            {
                "title": f"By {BY[key]}",
                "folds": choice.curves.folds,
                "rows": choice.curves.rows,
                "svg": drawings[name],
                "heat": heat_cells(found, choice).plain() if len(found.windows_s) > 1 else None,
                "timeline": interactive.number(place),
                "choice": {"window_s": f"{choice.window_s:g}", "components": choice.components},
                "table": _rows(found, key),
            }
        )
    page = template("sweep.html").render(
        what="windows and components" if found.what == "both" else f"{found.what.rstrip('s')}s",
        made=made(command),
        assets=interactive.assets,
        vessel=found.vessel,
        headline=headline(found),
        estimator=found.estimator_says,
        fit_with=fit_with(found).partition(": ")[0],
        by_itself=by_itself(found),
        options=" ".join(found.fit_options),
        notes=found.notes,
        logs=[{**log, "seconds": f"{log['seconds']:.0f}"} for log in found.logs],
        sections=sections,
        axes=AXES,
        test_window_s=f"{found.test_window_s:.3g}",
        weak=found.weak,
        error=found.error,
        tested=found.tested,
        settings={**found.settings.plain(), **found.settings.scale},
        many=len(found.windows_s) > 1,
        next=after_sweep(found.fit_options, found.choice_beats_base, given),
    )
    return with_contents(page), drawings


def _rows(found: Sweep, key: str) -> list[dict[str, Any]]:
    """Return every combination, with its MSE over the base model's."""
    choice = found.by[key]
    score, band = choice.curves.normalised()
    return [
        {
            "window_s": f"{found.windows_s[window]:g}",
            "components": count + 1,
            "ratios": [f"{value:.4g}" if np.isfinite(value) else "–" for value in choice.over_base[window, count]],
            "score": f"{score[window, count]:.4f}",
            "band": f"{band[window, count]:.4f}",
            "chosen": (window, count) == (choice.window, choice.components - 1),
        }
        for window in range(score.shape[0])
        for count in range(score.shape[1])
    ]
