"""From a log to the file of a drafted profile: what ``ferryid vessel new`` does."""

from __future__ import annotations

import re
from collections.abc import Callable
from math import isfinite
from pathlib import Path
from typing import Any

from ferryid.draft.draft import draft_profile
from ferryid.draft.write import (
    Answers,
    Question,
    StatedWindow,
    answered,
    as_json,
    as_text,
    draft_text,
    open_lines,
    questions,
)
from ferryid.errors import FerryIdError
from ferryid.files import replacing
from ferryid.types import TimeRanges
from ferryid.vessel import parse_profile
from ferryid.vessel.folder_settings import VESSEL_FILE, log_folder
from ferryid.vessel.load import NAME, NAME_RULE
from ferryid.vessel.profile import Profile

Windows = Callable[[Profile], StatedWindow | None]
"""Returns the windows that a profile is to state for the log; None where the usual ones serve."""
Ask = Callable[[Question], str]
"""Returns the answer to a question, an empty one where it is left open."""


def new_profile(
    log: str,
    like: Profile | None = None,
    *,
    name: str = "",
    file: Path | None = None,
    overwrite: bool = False,
    ask: Ask | None = None,
    ranges: TimeRanges = (),
    windows: Windows | None = None,
    progress: Callable[[str], None],
) -> tuple[dict[str, Any], str, str]:
    """Draft a profile and write it.

    Parameters
    ----------
    log
        Path; parts of one recording joined by ``+``.
    like
        A profile that hull, thrust and the layout of tables are taken from.
    name
        Name of the vessel; of the log's folder where empty.
    file
        Where to; ``vessel.toml`` beside the log where None, nowhere where it is ``-``.
    overwrite
        Replace a file that is there.
    ask
        Asks a person for what no log shows; what is not asked is a marked line.
    ranges
        What of the log is compared; all of it where empty.
    windows
        Looks at the log with the drafted profile, where nothing of that is left to complete.
    progress
        Called with the name of each stage.

    Returns
    -------
    tuple
        The result for JSON, an account of it as text, and the profile's text.

    Raises
    ------
    FerryIdError
        For a log of which no profile can be drafted, an answer that is none, and a file that is there.
    """
    folder = log_folder(log)
    place = _shown(folder / VESSEL_FILE) if file is None else file
    if str(place) != "-" and place.exists() and not overwrite:
        raise FerryIdError(f"{place}: is there already. Fix: give --file another name, or --overwrite")
    named = name or re.sub(r"[^A-Za-z0-9._-]+", "-", folder.name).strip("-._")[:80] or "vessel"
    if not NAME.fullmatch(named):
        raise FerryIdError(f'--name: cannot be "{name[:80]}". Fix: {NAME_RULE}')
    progress("reading the log")
    draft = draft_profile(log, like, ranges)
    progress("")
    values = {}
    for question in questions(draft) if ask is not None else ():
        answer = ask(question) if ask is not None else ""
        if not question.accepts(answer):
            raise FerryIdError(
                f"{question.key}: {answer!r} does not answer it ({question.text}). Fix: answer it, or with nothing"
            )
        values[question.key] = answer
    answers = Answers(named, values)
    draft, text = answered(draft, answers), draft_text(draft, answers)
    if windows is not None and (whole := _whole(text)) is not None:
        progress("looking at what its windows keep")
        text = draft_text(draft, answers, windows(whole))
        progress("")
    if str(place) != "-":
        with replacing(place, new=not overwrite, by="--file") as temporary:
            temporary.write_text(text, encoding="utf-8")
    return as_json(draft, str(place), text), as_text(draft, str(place), text), text


def _whole(text: str) -> Profile | None:
    """Return a drafted profile; None where lines are left to complete, it has faults, or it states its windows already."""
    if open_lines(text):
        return None
    try:
        profile = parse_profile(text, "draft")
    except FerryIdError:
        return None
    return None if isfinite(profile.window_s) else profile


def _shown(path: Path) -> Path:
    """Return a path as seen from the working folder, where it lies in it."""
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path
