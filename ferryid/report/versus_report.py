"""Differences between two groups of logs as text, page and JSON: what ``ferryid diagnose --versus`` leaves."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from ferryid.counts import counted
from ferryid.diagnose import GROUPS, JUDGING, DiagnosisSettings, Difference, Versus, compare_groups, versus_json
from ferryid.effects.wording import listed, uncapitalised
from ferryid.errors import FerryIdError
from ferryid.files import finite
from ferryid.report.diagnosis_words import title
from ferryid.report.folder import made, place_of, write_folder
from ferryid.report.html import template
from ferryid.report.interactive import STATIC, Interactive, make_interactive
from ferryid.report.outcome import Report
from ferryid.report.versus_figures import intervals
from ferryid.report.versus_timeline import versus_timeline
from ferryid.types import RunContext
from ferryid.vessel.profile import Profile

SHOWN = 4
"""Logs of a group that a terminal names: the page has all."""


def compare_and_report(
    logs: Sequence[str],
    versus: Sequence[str],
    profile: Profile,
    settings: DiagnosisSettings,
    run: RunContext,
    *,
    name: str = "",
    command: Sequence[str] = (),
) -> Report:
    """Compare two groups of logs and write page, figure and JSON.

    Parameters
    ----------
    logs, versus, profile, settings, run
        As of `ferryid.diagnose.versus.compare_groups`.
    name
        Of a model: refused where not empty.
    command
        The words that the comparison was asked for with.

    Raises
    ------
    FerryIdError
        For input that cannot be used, and a folder that cannot be written.
    """
    if name:
        raise FerryIdError(f'diagnose: --versus stores no model, found --name "{name}". Fix: leave out one of the two')
    found = compare_groups(logs, versus, profile, settings, run)
    run.progress("writing the report")
    place = place_of(run.out / "reports", _folder(found), [*logs, *versus], command)
    # A batch keeps the scripts where its tables are.
    interactive = make_interactive({0: versus_timeline(found)}, place.folder, run.tables_out or run.out)
    page, drawings = render(found, command, interactive)
    file = place.page
    plain = {**finite(versus_json(found)), "report": str(file)}
    write_folder(place, page, drawings, plain, "versus.json", scripts=interactive.files())
    return Report(plain, f"{as_text(found)}\nreport  {file}{place.note}", file)


def as_text(found: Versus) -> str:
    """Return a comparison of groups as a terminal shows it."""
    lines = [f"{found.vessel}: {' against '.join(_group_line(found, group) for group in reversed(found.groups))}"]
    lines += [f"  {group}: {_names(found, group)}" for group in found.groups]
    lines += ["", found.summary]
    for one in found.judged.differences:
        lines.append(f"  {probability(one)}  {one.says}")
        if rivals := unresolved(one):
            lines.append(f"    {rivals}")
    if found.judged.loads:
        lines += ["", "Loads"]
        lines += [f"  {one.says}" for one in found.judged.loads]
    if found.judged.compared:
        lines += ["", "Not favoured by the evidence: estimate and 95 % interval"]
        lines += [f"  {one.says}" for one in found.judged.compared]
    lines += ["", *(f"note: {one}" for one in (*found.notes, found.smallest, _never_seen(found)) if one)]
    return "\n".join(lines)


def probability(one: Difference) -> str:
    """Return how likely a difference is."""
    if one.doubt:
        return "hint"
    return "above 0.99" if one.probability > 0.99 else f"{one.probability:.2f}"


def unresolved(one: Difference) -> str:
    """Return what a difference cannot be separated from, and the manoeuvre that would; empty where there is none."""
    if not one.unresolved_with:
        return ""
    near = [each for each in one.instead if each.key in one.near]
    others = [f"{uncapitalised(each.title)}, {each.group or 'both groups'}: {each.values}" for each in near]
    others = others or [uncapitalised(title(each)) for each in one.unresolved_with]
    return (
        f"These logs cannot distinguish it from {', or '.join(others)} (evidence within {JUDGING.unresolved_evidence:g} nat); "
        f"what separates them: {one.separating_manoeuvre}."
    )


def _group_line(found: Versus, group: str) -> str:
    logs = found.groups[group]
    return f"{group} ({counted(len(logs), 'log')}, {sum(one.duration_s for one in logs):.0f} s)"


def _names(found: Versus, group: str) -> str:
    names = [one.name for one in found.groups[group]]
    more = len(names) - SHOWN
    return ", ".join(names[:SHOWN]) + (f" and {counted(more, 'log')} more" if more > 0 else "")


def _never_seen(found: Versus) -> str:
    """Return which differences no size would have shown, as a sentence; empty where there is none."""
    titles = [one.title for one in found.judged.compared if not any(each is not None for each in one.smallest.values())]
    return f"Would not have been seen at any size: {listed(titles)}." if titles else ""


def render(found: Versus, command: Sequence[str] = (), interactive: Interactive = STATIC) -> tuple[str, dict[str, str]]:
    """Return the page, and its drawings (SVG) by name."""
    drawings = {"differences": intervals(found)}
    rows = [_row(one, True) for one in found.judged.differences] + [_row(one, False) for one in found.judged.compared]
    page = template("versus.html").render(
        vessel=found.vessel,
        made=made(command),
        summary=found.summary,
        differences=[
            {
                "probability": probability(one),
                "says": one.says,
                "unresolved": unresolved(one),
                "held_out": _held_out(one),
            }
            for one in found.judged.differences
        ],
        loads=[one.says for one in found.judged.loads],
        svg=drawings["differences"],
        timeline_number=interactive.number(0),
        assets=interactive.assets,
        rows=rows,
        groups=found.groups,
        notes=found.notes,
    )
    return page, drawings


def _held_out(one: Difference) -> str:
    if one.gain is None or one.by_group is None:
        return ""
    parts = ", ".join(f"group {group} {gain.total:+.0f} nat" for group, gain in one.by_group.items())
    return (
        f"Evidence over none {one.evidence:+.0f} nat; log-likelihood of held-out stretches {one.gain.total:+.0f} nat "
        f"({one.gain.low:+.0f} to {one.gain.high:+.0f}), of which {parts}."
    )


def _row(one: Difference, selected: bool) -> dict[str, Any]:
    return {
        "title": one.title if one.group == GROUPS[1] else f"{one.title}, {one.group} relative to {one.other}",
        "parameters": [one.said(each) for each in one.parameters if each.name in one.estimates],
        "smallest": [one.seen_from(name) for name in one.smallest],
        "evidence": f"{one.evidence:+.0f}" if round(one.evidence) else "0",
        "selected": selected and not one.doubt,
        "verdict": ("hint" if one.doubt else "differs") if selected else "no difference seen",
    }


def _folder(found: Versus) -> str:
    first, second = (found.groups[group] for group in found.groups)
    parts = ["diagnosis", first[0].name, *([f"and-{len(first) - 1}-more"] if len(first) > 1 else [])]
    parts += ["versus", second[0].name, *([f"and-{len(second) - 1}-more"] if len(second) > 1 else [])]
    return re.sub(r"[^\w.+-]+", "_", "-".join(parts))
