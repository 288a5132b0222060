"""What ``ferryid export`` does: a model in another form, or a log for a viewer, and what it says of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ferryid.counts import counted, verb
from ferryid.errors import FerryIdError
from ferryid.export.formats import formats
from ferryid.export.model_file import export_model
from ferryid.export.sdf import SMALL, shares
from ferryid.files import check_result, resolved
from ferryid.models.store import load
from ferryid.types import TimeRanges, no_progress
from ferryid.vessel import choose_vessel, parse_profile


def export(
    what: str,
    out: Path,
    *,
    to: str | None = None,
    file: Path | None = None,
    mcap: Path | None = None,
    model: str | None = None,
    vessel: str | None = None,
    diagnosis: Path | None = None,
    overwrite: bool = False,
    json: Path | None = None,
    progress: Callable[[str], None],
    ranges: TimeRanges = (),
    announce: Callable[[str], None] = no_progress,
) -> dict[str, Any]:
    """Export a model, or with `mcap` a log; return what was written (``ferryid.export/1``).

    Parameters
    ----------
    what
        The model or the log.
    out
        Output folder.
    to, file
        Form and place of an exported model; see `ferryid.export.model_file.export_model`.
    mcap, model, vessel, diagnosis
        Place of an exported log, and what is to be in it; see `ferryid.export.log_file.export_log`.
    overwrite
        Replace an export that is there.
    json
        Where the caller will write the result; looked at before anything is done.
    progress
        Called with the name of each stage.
    ranges
        What of a log is exported; all of it where empty.
    announce
        Called with the vessel of a log where it was not asked for.

    Raises
    ------
    FerryIdError
        For options that do not go together, and as the two.
    """
    if mcap is None and ranges:
        raise FerryIdError(
            f"--from: is for a log, and without --mcap {what} is a model. Fix: add --mcap FILE, or leave it out"
        )
    beside = {"--model": model, "--vessel": vessel, "--diagnosis": diagnosis}
    of_log = [name for name, value in beside.items() if value is not None]
    of_model = [name for name, value in (("--to", to), ("--file", file)) if value is not None]
    if mcap is not None and of_model:
        raise FerryIdError(
            f"{of_model[0]}: is for a model, and --mcap says that {what} is a log. Fix: give one or the other"
        )
    if mcap is None and of_log:
        raise FerryIdError(
            f"{of_log[0]}: is for a log, and without --mcap {what} is a model. Fix: add --mcap FILE, or leave it out"
        )
    if mcap is None and to is None:
        raise FerryIdError(
            f"{what}: the form is missing. Fix: give --to {'|'.join(formats())} for a model, --mcap FILE for a log"
        )
    if json is not None:
        check_result(json)
        _check_apart(json, [one for one in (file, mcap, diagnosis) if one is not None])
    if mcap is None:
        return export_model(what, str(to), out, file=file, overwrite=overwrite)
    loaded = load(model, out) if model else None
    own = parse_profile(loaded.profile_text, loaded.name) if loaded else None
    choice = choose_vessel([what], vessel, own=own)
    if choice.reason:
        announce(choice.reason)
    from ferryid.export.log_file import export_log  # brings the simulator and the diagnosis

    return export_log(
        what,
        mcap,
        out,
        profile=None if choice.profile is own else choice.profile,
        model=loaded,
        diagnosis=diagnosis,
        overwrite=overwrite,
        ranges=ranges,
        progress=progress,
    )


def _check_lines(check: Mapping[str, Any] | None) -> list[str]:
    """Return what the program that a form is for makes of the numbers."""
    if check is None:
        return []
    error = check["error_share"]
    lines = [f"  error of the force by the equations of {check['equations']}: {shares(error['velocity'])}"]
    if any(value > SMALL for value in error["acceleration"].values()):
        lines.append(f"  of the inertia: {shares(error['acceleration'])}")
    return [*lines, *(f"  no term for {part['what']}: {shares(part['share'])}" for part in check["missing"])]


def _check_apart(json: Path, others: list[Path]) -> None:
    if any(resolved(json) == resolved(one) for one in others):
        raise FerryIdError(f"{json}: cannot be the place of two files. Fix: give --json another name")


def notes(result: Mapping[str, Any]) -> list[str]:
    """Return what a user should know of an export and is no result, a line each."""
    return [*result["warnings"], *result.get("left_out", ())]


def render_export(result: Mapping[str, Any]) -> str:
    """Return an export as text."""
    if result["kind"] == "model":
        form = formats()[result["format"]]
        model = result["model"]
        lines = [f"{result['file']}: {model['name']}@{model['version']} as {form.title}"]
        lines += [f"  {effect['acts_on']}: {effect['says']}" for effect in result["effects"]]
        lines += _check_lines(result.get("check"))
        return "\n".join([*lines, form.hint.format(file=result["file"], name=result["name"])])
    used = len(result["topics"])
    lines = [f"{result['file']}: {result['log']['name']}, {counted(used, 'topic')} for PlotJuggler or Foxglove"]
    lines += [f"  {one['topic']:<26}{one['messages']:>9}  {one['type']}" for one in result["topics"]]
    lines += [f"  {place}" for place in result["layouts"]]
    if result["rows_left_out"]:
        lines.append(
            f"  {result['rows_left_out']} of {counted(result['rows'], 'row')} "
            f"{verb(result['rows_left_out'], 'is')} not known and left out"
        )
    return "\n".join(lines)
