"""From diagnoses to files: a page, its figures, JSON and text; what ``ferryid diagnose`` leaves."""

from __future__ import annotations

import re
from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import Any

from ferryid.diagnose import (
    SCHEMA,
    Diagnosis,
    DiagnosisSettings,
    campaign_verdict,
    copies_as_json,
    diagnose_and_store,
    finding_as_json,
    likeness_as_json,
    parts_as_json,
    to_json,
    unused_as_json,
)
from ferryid.errors import FerryIdError
from ferryid.files import finite
from ferryid.models import Model
from ferryid.models.store import load
from ferryid.report import second_sources
from ferryid.report.diagnosis_page import MAX_LOGS, as_text, render
from ferryid.report.diagnosis_timeline import timelines
from ferryid.report.diagnosis_words import findings_of, findings_of_all
from ferryid.report.drawings import NONE, Drawings
from ferryid.report.folder import made, place_of, write_folder
from ferryid.report.interactive import make_interactive
from ferryid.report.outcome import Report
from ferryid.report.page_process import DrawingProcess, started
from ferryid.types import AXES, RunContext
from ferryid.vessel import load_profile, parse_profile
from ferryid.vessel.profile import Profile


def patient(vessel: str | Path | Profile | None, model: str | None, out: Path) -> tuple[Profile, Model | None]:
    """Return the profile, and the model where one is to be examined; its own profile serves where no vessel is given.

    `vessel` is a profile, or the name or path of one.

    Raises
    ------
    FerryIdError
        When neither is given, cannot be loaded, or one is of another vessel than the other.
    """
    loaded = load(model, out) if model else None
    if loaded is None:
        if not vessel:
            raise FerryIdError(
                "diagnose: neither --vessel nor --model is given. Fix: give --vessel a profile's name or a TOML file"
            )
        return _profile(vessel), None
    own = parse_profile(loaded.profile_text, loaded.name)
    profile = _profile(vessel) if vessel else own
    if profile.name != own.name:
        raise FerryIdError(
            f"{loaded.name}@{loaded.version}: a model of {own.name} does not apply to {profile.name}. "
            "Fix: give a model and logs of one vessel"
        )
    return profile, loaded


def _profile(vessel: str | Path | Profile) -> Profile:
    return vessel if isinstance(vessel, Profile) else load_profile(vessel)


def diagnose_and_report(
    logs: Sequence[str],
    profile: Profile,
    settings: DiagnosisSettings,
    run: RunContext,
    *,
    name: str = "",
    command: Sequence[str] = (),
) -> Report:
    """Diagnose logs, store the model that the findings lead to, and write the report.

    Parameters
    ----------
    logs, profile, settings, run, name
        As of `ferryid.diagnose.pipeline.diagnose_and_store`.
    command
        The words that the diagnosis was asked for with.

    Raises
    ------
    FerryIdError
        For input that cannot be used, and a folder that cannot be written.
    """
    with started(DrawingProcess) as process:
        begin = None if process is None else process.begin
        diagnoses = diagnose_and_store(logs, profile, settings, run, name=name, diagnosed=begin)
        run.progress("writing the report")
        drawings = NONE if process is None else Drawings(process.drawings(diagnoses))
    return report(diagnoses, run.out, command, run.tables_out, drawings)


def report(
    diagnoses: Sequence[Diagnosis],
    out: Path,
    command: Sequence[str] = (),
    shared: Path | None = None,
    drawings: Drawings = NONE,
) -> Report:
    """Write page, figures and JSON to a folder of their own in ``reports``; a later diagnosis of the same logs
    replaces it.

    `command` are the words that the diagnosis was asked for with; the page repeats them. `shared` is the output folder that
    keeps the scripts of the interactive figures, where that is another than `out`. `drawings` are those that exist already.

    Raises
    ------
    FerryIdError
        For a folder that cannot be written; nothing half-written is left.
    """
    place = place_of(
        out / "reports", _folder(diagnoses), [path for one in diagnoses for path in one.paths if path], command
    )
    names = ", ".join(one.log for one in diagnoses[:2]) + (
        f" and {len(diagnoses) - 2} more" if len(diagnoses) > 2 else ""
    )
    interactive = make_interactive(timelines(diagnoses, MAX_LOGS), place.folder, shared or out)
    page, drawn = render(diagnoses, f"{diagnoses[0].vessel} · {names}", made(command), interactive, drawings)
    file = place.page
    plain = {**finite(as_json(diagnoses)), "report": str(file)}
    write_folder(place, page, drawn, plain, "diagnosis.json", scripts=interactive.files())
    return Report(plain, f"{as_text(diagnoses)}\nreport  {file}{place.note}", file)


def as_json(diagnoses: Sequence[Diagnosis]) -> dict[str, Any]:
    """Return one object in the form of schema ``ferryid.diagnosis/1``, on one log or several.

    On several, `findings` holds those of all logs, each with its ``log``, null for what all of them share; errors are pooled
    over their rows where these are known; and ``logs`` holds the diagnosis of each. Logs that follow each other without a break
    are diagnosed as one: ``logs`` holds what was found in each as it was given, and ``joined`` which are parts of what.
    """
    if len(diagnoses) == 1 and not diagnoses[0].parts:
        return to_json(diagnoses[0])
    if len(diagnoses) == 1:
        whole = to_json(diagnoses[0])
        findings = [{**one, "log": None} for one in whole["findings"]]
        return {**whole, "log": None, "findings": findings, **_joined(diagnoses), "logs": parts_as_json(diagnoses[0])}
    logs = [one for each in diagnoses for one in (parts_as_json(each) if each.parts else [to_json(each)])]
    shared = findings_of_all(diagnoses)
    for one in logs:
        # They are the campaign's.
        one.pop("copies", None)
        one.pop("logs_left_out", None)
    together = second_sources.of_all(diagnoses)
    if together is not None:
        for one in logs:
            one.pop("second_sources", None)
    return {
        "schema": SCHEMA,
        "log": None,
        "vessel": diagnoses[0].vessel,
        "verdict": campaign_verdict([one.verdict for one in diagnoses]),
        "findings": [
            *({**finding_as_json(one), "log": None} for one in shared),
            *(
                {**finding_as_json(finding), "log": one.log}
                for one in diagnoses
                for finding in findings_of(one, shared)
            ),
        ],
        "before": {"mse": _pooled(diagnoses, "before"), "free_run": {}},
        "after": {"mse": _pooled(diagnoses, "after"), "free_run": {}},
        "notes": [],
        "withheld": [],
        **({"second_sources": together.to_json()} if together else {}),
        **({"copies": copies} if (copies := copies_as_json(diagnoses)) else {}),
        **({"logs_left_out": unused} if (unused := unused_as_json(diagnoses)) else {}),
        **next(({"learned": one.learned.to_json()} for one in diagnoses if one.learned is not None), {}),
        **next(({"likeness": likeness_as_json(one.likeness_of_all)} for one in diagnoses if one.likeness_of_all), {}),
        # What several logs teach is one model.
        "model": next((one.model for one in diagnoses if one.model), None),
        **_joined(diagnoses),
        "logs": [{key: value for key, value in one.items() if key != "schema"} for one in logs],
    }


def _joined(diagnoses: Sequence[Diagnosis]) -> dict[str, Any]:
    """Return ``joined`` of a campaign: of every log that was made of several, these and when they begin and end in it [s]."""
    joined = [
        {
            "log": one.log,
            "parts": [{"path": part.path, "begin_s": part.begin_s, "end_s": part.end_s} for part in one.parts],
        }
        for one in diagnoses
        if one.parts
    ]
    return {"joined": joined} if joined else {}


def _pooled(diagnoses: Sequence[Diagnosis], part: str) -> dict[str, float | None]:
    """Return the mean of the squared force error over the rows of all logs; None where a log does not tell how many it has."""
    pooled: dict[str, float | None] = {}
    for axis in AXES:
        total, count, known = 0.0, 0, True
        for one in diagnoses:
            # Without findings nothing changes, and `after` need not say so.
            mse = (getattr(one, part).get("mse") or one.before.get("mse", {})).get(axis)
            if mse is None or not isfinite(mse):
                continue
            known = known and "rows" in one.before
            rows = int(one.before.get("rows", 0))
            total, count = total + rows * mse, count + rows
        pooled[axis] = total / count if known and count else None
    return pooled


def _folder(diagnoses: Sequence[Diagnosis]) -> str:
    parts = ["diagnosis", diagnoses[0].log]
    if len(diagnoses) > 1:
        parts.append(f"and-{len(diagnoses) - 1}-more")
    hidden = dict.fromkeys(one.signal for diagnosis in diagnoses for one in diagnosis.withheld)
    if hidden:
        parts.append(f"without-{'-'.join(hidden)}")
    return re.sub(r"[^\w.+-]+", "_", "-".join(parts))
