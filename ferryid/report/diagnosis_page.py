"""A diagnosis as one HTML page that needs nothing else, and as text for a terminal."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any

import numpy as np

from ferryid.counts import counted
from ferryid.diagnose import Diagnosis, Finding, Withheld, campaign_verdict
from ferryid.effects.wording import MEANS_LITTLE
from ferryid.log_warnings import left_out_together, log_warnings
from ferryid.models.prediction import FreeRun
from ferryid.report import (
    campaign,
    diagnosis_errors,
    diagnosis_figures,
    diagnosis_words,
    figures,
    least_sizes,
    likeness,
    second_sources,
)
from ferryid.report.campaign import TEXT_COLUMNS
from ferryid.report.drawings import NONE, Drawings
from ferryid.report.html import template
from ferryid.report.interactive import STATIC, Interactive
from ferryid.report.left_out import left_out_table
from ferryid.signals.artificial import NO_RECORDING
from ferryid.signals.track import LeftOut
from ferryid.types import AXES, Floats

MAX_LOGS = 6
"""Logs whose evidence is drawn; the page stays readable."""
UNITS = ("[N]", "[N]", "[N·m]")


def render(
    diagnoses: Sequence[Diagnosis],
    title: str,
    made: Mapping[str, str] | None = None,
    interactive: Interactive = STATIC,
    drawings: Drawings = NONE,
) -> tuple[str, dict[str, str]]:
    """Return the page on one log or several, and its drawings (SVG) by name; `made` are date, version and command.

    `drawings` are those that exist already.
    """
    several = len(diagnoses) > 1
    shared = diagnosis_words.notes_of_all(diagnoses)
    foremost = (
        [note for note in shared if MEANS_LITTLE in note] if several else diagnosis_words.foremost_notes(diagnoses[0])
    )
    gathered = [note for note in shared if note in diagnoses[0].gathered and note not in foremost]
    common = diagnosis_words.findings_of_all(diagnoses)
    together = second_sources.of_all(diagnoses)
    logs = [
        {
            **_log(one, f"{k + 1}-" if several else "", k < MAX_LOGS, [*shared, *foremost], common, drawings),
            "timeline": interactive.number(k),
        }
        for k, one in enumerate(diagnoses)
    ]
    left = [one.log for one in diagnoses[MAX_LOGS:]]
    of_campaign = campaign.section(diagnoses, drawings) if several else {}
    of_all = likeness.section(diagnoses[0].likeness_of_all, "likeness", "these logs together", drawings=drawings)
    page = template("diagnosis.html").render(
        title=title,
        verdict=campaign_verdict([one.verdict for one in diagnoses]),
        headline=diagnosis_words.summary(diagnoses),
        several=several,
        campaign=of_campaign,
        logs=logs,
        where_common=diagnosis_words.where_common(diagnoses, common),
        common=[_finding(one, f"all-finding-{k}", False, (), NONE) for k, one in enumerate(common, 1)],
        likeness=of_all,
        heat_maps=any(one.get("figures") for one in (of_all, *(log["likeness"] for log in logs))),
        sign=diagnosis_words.SIGN,
        made=made,
        gathered=gathered,
        foremost=foremost,
        shared_notes=left_out_together([note for note in shared if note not in (*gathered, *foremost)]),
        shared_sources=second_sources.section(together) if together else {},
        shared_model=diagnosis_words.model_of_all(diagnoses),
        axes=list(zip(AXES, UNITS, strict=True)),
        assets=interactive.assets,
        omitted=f"Not drawn, but part of every number: {', '.join(left)}." if left else "",
    )
    shown = {
        figure["file"]: figure["svg"]
        for log in logs
        for figure in (
            *log["figures"],
            *log["free_run_figures"],
            *(one for finding in log["findings"] for one in finding["figures"]),
            *log["likeness"].get("figures", ()),
        )
    }
    together_drawn = [
        *of_all.get("figures", ()),
        *(one for flow in of_campaign.get("flows", ()) for one in flow["figures"]),
    ]
    shown |= {figure["file"]: figure["svg"] for figure in together_drawn}
    return page, shown


def as_text(diagnoses: Sequence[Diagnosis]) -> str:
    """Return the same for a terminal, short: of several logs what they have in common, as tables."""
    return _one_as_text(diagnoses[0]) if len(diagnoses) == 1 else _several_as_text(diagnoses)


def _several_as_text(diagnoses: Sequence[Diagnosis]) -> str:
    blocks = [_folded(diagnosis_words.summary(diagnoses))]
    shared = diagnosis_words.notes_of_all(diagnoses)
    common = diagnosis_words.findings_of_all(diagnoses)
    together = second_sources.of_all(diagnoses)
    first = [note for note in shared if NO_RECORDING in note or MEANS_LITTLE in note]
    blocks += [_folded(f"note: {note}") for note in first]
    if common:
        lines = [f"{diagnosis_words.where_common(diagnoses, common)}:", *_listed(common)]
        blocks.append("\n".join(_folded(line) for line in lines))
    blocks += campaign.text_tables(diagnoses)
    about_all = [
        *left_out_together([note for note in shared if note not in first]),
        *likeness.notes(diagnoses[0].likeness_of_all, "these logs together"),
    ]
    if about_all:
        blocks.append("\n".join(_folded(f"note: {note}") for note in about_all))
    if together and (instruments := second_sources.lines(together)):
        blocks.append("\n".join(_folded(line) for line in instruments))
    unused = [one for one in diagnoses if one.verdict == "not_testable"]
    if why := log_warnings([(one.log, diagnosis_words.notes_of(one, shared)) for one in unused]):
        blocks.append("\n".join(_folded(line) for line in why))
    tested = [one for one in diagnoses if one not in unused]
    blocks.append(_folded(campaign.left_to_the_page(tested, shared)))
    if model := diagnosis_words.model_of_all(diagnoses):
        blocks.append(_folded(model))
    return "\n\n".join(blocks)


def _one_as_text(one: Diagnosis) -> str:
    foremost = diagnosis_words.foremost_notes(one)
    lines = [f"{one.log}: {diagnosis_words.summary([one])}", *(f"note: {note}" for note in foremost)]
    lines += _listed(one.findings)
    rows = diagnosis_errors.force_rows(one)
    if rows:
        lines += ["", f"{'on held-out data':<44}" + "".join(f"{axis:>22}" for axis in AXES)]
        lines.append(f"{'':<44}" + "".join(f"{unit:>22}" for unit in UNITS))
        lines += [f"{row['name']:<44}" + "".join(f"{cell:>22}" for cell in row["cells"]) for row in rows]
        lines += diagnosis_words.about_errors(one)
    runs = diagnosis_errors.free_run_rows(one)
    if runs:
        names = ("without", "with", "with over without") if diagnosis_errors.fitted(one) else ("error",)
        lines += ["", f"{'free run on held-out data':<44}" + "".join(f"{name:>22}" for name in names)]
        for row in runs:
            lines.append(f"{row['name']:<44}" + "".join(f"{cell:>22}" for cell in row["cells"][: len(names)]))
        lines += [caution] if (caution := diagnosis_errors.free_run_caution(one)) else []
    hidden = [f"withheld {one_hidden.signal}: {one_hidden.says}" for one_hidden in one.withheld]
    remarks = [*hidden, *(f"note: {note}" for note in diagnosis_words.notes_of(one, foremost))]
    remarks += [f"note: {text}"] if (text := least_sizes.line(one)) else []
    if one.likeness_of_all is None:
        remarks += [f"note: {note}" for note in likeness.notes(one.likeness, "this log")]
    remarks += [*second_sources.lines(one.sources), *second_sources.repair_lines(one)]
    lines += ["", *remarks] if remarks else []
    lines += ["", diagnosis_words.new_model(one)] if one.model else [""]
    return "\n".join(_folded(line) for line in lines)


def _listed(findings: Sequence[Finding]) -> list[str]:
    lines = []
    for k, finding in enumerate(findings, 1):
        lines += ["", f"{k}. {diagnosis_words.said(finding)}", *(f"   {line}" for line in _lines(finding))]
    return lines


def _lines(finding: Finding) -> list[str]:
    lines = [
        diagnosis_words.numbers(finding),
        diagnosis_words.where(finding),
        diagnosis_words.trust(finding),
        *diagnosis_words.rivals(finding),
    ]
    return [line for line in lines if line]


def _folded(line: str) -> str:
    """Break prose at the width of a page; tables stay as they are."""
    if len(line) <= TEXT_COLUMNS or "  " in line.strip():
        return line
    indent = " " * (len(line) - len(line.lstrip()))
    hanging = indent + ("   " if re.match(r"\d+\. ", line) else "")
    return fill(
        line.strip(),
        TEXT_COLUMNS,
        initial_indent=indent,
        subsequent_indent=hanging,
        break_on_hyphens=False,
        break_long_words=False,
    )


def _log(
    diagnosis: Diagnosis,
    prefix: str,
    drawn: bool,
    told: Sequence[str],
    common: Sequence[Finding],
    drawings: Drawings,
) -> dict[str, Any]:
    force_rows, free_run_rows = diagnosis_errors.force_rows(diagnosis), diagnosis_errors.free_run_rows(diagnosis)
    return {
        "name": diagnosis.log,
        "vessel": diagnosis.vessel,
        "verdict": diagnosis.verdict,
        "headline": diagnosis_words.headline(diagnosis),
        "findings": [
            _finding(one, f"{prefix}finding-{k}", drawn, diagnosis.left_out, drawings, diagnosis.withheld)
            for k, one in enumerate(diagnosis_words.findings_of(diagnosis, common), 1)
        ],
        "left_out": left_out_table(diagnosis.left_out),
        "names": campaign.names_of(diagnosis, common),
        "force_rows": force_rows,
        "free_run_rows": free_run_rows,
        "free_run_caution": diagnosis_errors.free_run_caution(diagnosis),
        "free_run_figures": _free_run_figures(diagnosis, prefix, drawings) if drawn else [],
        "intervals": any(" to " in cell for row in (*force_rows, *free_run_rows) for cell in row["cells"]),
        "free_run_note": diagnosis.before.get("free_run", {}).get("note", ""),
        "figures": [
            {"file": file, "svg": svg, "caption": caption, "over_time": file == f"{prefix}left-over"}
            for file, svg, caption in (diagnosis_figures.figures_of(diagnosis, prefix, drawings) if drawn else ())
        ],
        "withheld": [
            {
                "signal": one.signal,
                "says": one.says,
                "rows": [
                    {
                        "name": name.replace("_", " "),
                        "found": diagnosis_words.estimate(value),
                        "measured": diagnosis_words.measured(one.measured.get(name), value.unit),
                    }
                    for name, value in one.found.items()
                ],
            }
            for one in diagnosis.withheld
        ],
        "notes": diagnosis_words.notes_of(diagnosis, told),
        "least_sizes": least_sizes.rows(diagnosis),
        "proof": least_sizes.proof(diagnosis),
        "proof_note": least_sizes.proof_note(diagnosis),
        "sources": second_sources.section(diagnosis.sources),
        "repairs": second_sources.repairs(diagnosis),
        # Of a campaign that of all logs is shown; the JSON has each log's own.
        "likeness": {}
        if diagnosis.likeness_of_all is not None
        else likeness.section(diagnosis.likeness, f"{prefix}likeness", "this log", drawn=drawn, drawings=drawings),
        "drawn": drawn and any(one.evidence for one in diagnosis.findings),
        "fitted": diagnosis_errors.fitted(diagnosis),
        "about_errors": diagnosis_words.about_errors(diagnosis),
        "about": diagnosis_words.about_log(diagnosis),
        "model": diagnosis_words.new_model(diagnosis),
    }


def _finding(
    finding: Finding,
    file: str,
    drawn: bool,
    left_out: Sequence[LeftOut],
    drawings: Drawings,
    withheld: Sequence[Withheld] = (),
) -> dict[str, Any]:
    shown = []
    if drawn and diagnosis_figures.compared(finding):
        what = finding.labels.get("regressor", "") if "regressor" in finding.evidence else ""
        against = what.partition(" [")[0] or "what the finding adds"
        since = " while it acts" if finding.ends else ""
        shown.append(
            {
                "file": f"{file}-evidence",
                "svg": drawings.of(f"{file}-evidence", diagnosis_figures.on_regressor, finding),
                "caption": f"What is left over{since}, against {against}. Points: windows of the recording. Marks: their means "
                "with 95 % intervals (Student's t times the standard error) from separate visits; hollow: from parts of one or "
                "two visits, which know less; none where there are too few windows for either. Where the finding holds, orange "
                "follows the line of what it explains, and blue is flat at zero.",
            }
        )
    if drawn and diagnosis_figures.drawable(finding):
        caption = (
            "The same over time; shaded: when it acts, and what is left out."
            if shown
            else "What is left over; shaded: when it acts most, and what is left out of the log."
        )
        svg = drawings.of(f"{file}-time", diagnosis_figures.in_time, finding, left_out)
        shown.append({"file": f"{file}-time", "svg": svg, "caption": caption})
    if drawn and finding.course is not None:
        measured = next((one.course for one in withheld if one.signal == finding.effect), None)
        beside = (
            "; black, or white on dark: what the withheld sensor measured, averaged over the same times"
            if measured is not None
            else ""
        )
        shown.append(
            {
                "file": f"{file}-course",
                "svg": drawings.of(f"{file}-course", diagnosis_figures.over_time, finding.course, measured),
                "caption": "Its course over the log, estimated together with the hull: where it flows to, with "
                f"the 95 % band{beside}.",
            }
        )
    if drawn and diagnosis_figures.spectral(finding):
        shown.append(
            {
                "file": f"{file}-spectrum",
                "svg": drawings.of(f"{file}-spectrum", diagnosis_figures.in_frequency, finding),
                "caption": "Power spectrum of what is left over with the other findings, on the axis on which it acts most, "
                "and what it is less that of the disturbance. What it explains: the spectrum of a disturbance of the strength "
                "and duration that were found, averaged over windows like the rest. Where the finding holds, orange is nowhere "
                "far below it; far above it, where blue lies on orange, it is a small part of what is left over.",
            }
        )
    return {
        "title": diagnosis_words.title(finding.effect, finding.instance),
        "says": diagnosis_words.said(finding),
        "lines": [
            line
            for line in (
                diagnosis_words.numbers(finding),
                diagnosis_words.where(finding),
                diagnosis_words.trust(finding),
            )
            if line
        ],
        "rivals": diagnosis_words.rivals(finding),
        "figures": shown,
    }


def _free_run_figures(diagnosis: Diagnosis, prefix: str, drawings: Drawings) -> list[dict[str, str]]:
    before, after = diagnosis.before.get("free_run", {}), diagnosis.after.get("free_run", {})
    if not (before.get("horizons_s") and after.get("horizons_s") and diagnosis.findings):
        return []
    file, learned = f"{prefix}free-run-errors", diagnosis.learned
    other = "; it is not the one that is stored" if learned is not None and learned.fit_alone else ""
    return [
        {
            "file": file,
            "svg": drawings.of(file, figures.free_run_errors, _free_run(before), _free_run(after)),
            "caption": f"Root-mean-square error of {counted(before.get('starts', 0), 'free run')} on "
            "held-out data: each takes the "
            f"measured state once and then only the measured actuator forces. New model: with the findings{other}.",
        }
    ]


def _free_run(plain: dict[str, Any]) -> FreeRun:
    def column(name: str) -> Floats:
        return np.array([np.nan if value is None else value for value in plain[name]], dtype=np.float64)

    return FreeRun(
        horizons_s=column("horizons_s"),
        position_m=column("position_m"),
        heading_rad=column("heading_rad"),
        speed_mps=column("speed_mps"),
        yaw_rate_radps=column("yaw_rate_radps"),
        starts=int(plain.get("starts", 0)),
        example={},
        note=plain.get("note", ""),
    )
