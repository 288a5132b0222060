"""The folder of a report: its page, its drawings and its JSON, all or nothing."""

from __future__ import annotations

import hashlib
import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from html import escape, unescape
from pathlib import Path
from textwrap import shorten
from typing import Any

from ferryid import __version__
from ferryid.files import dump_json, parts_of, replacing, resolved

PAGE = "report.html"
_CHARSET = '<meta charset="utf-8">'
_LONGEST = 300
"""Characters of an earlier command that a terminal shows."""
_HEAD_BYTES = 65536
"""What is read of an earlier page to see what it is of."""


@dataclass(frozen=True)
class Place:
    """Where a report goes.

    Attributes
    ----------
    folder
        Of the report.
    logs
        Digest of the paths of its logs; empty where these are not known.
    command
        The words that it was asked for with.
    note
        What a terminal says of an earlier report, on a line of its own; empty where there is nothing to say.
    """

    folder: Path
    logs: str = ""
    command: str = ""
    note: str = ""

    @property
    def page(self) -> Path:
        """The file of the page."""
        return self.folder / PAGE


def place_of(reports: Path, name: str, logs: Sequence[str], command: Sequence[str] = ()) -> Place:
    """Return where a report goes: in the folder of its name, unless the report there is of other logs.

    Parameters
    ----------
    reports, name
        Folder of all reports, and the name of what this one is of.
    logs
        Paths of its logs, parts of one joined by ``+``; none where they are not known.
    command
        The words that it was asked for with.
    """
    words = shlex.join(command)
    digest = _digest(logs) if logs else ""
    folder, note = reports / name, ""
    there, earlier = _made_of(folder)
    if digest and there and there != digest:
        note = f"\n        ({folder} is the report of other logs of that name)"
        folder = reports / f"{name}-{digest}"
        there, earlier = _made_of(folder)
    if words and earlier and earlier != words:
        note += f"\n        in place of the one that was made by: {shorten(earlier, _LONGEST)}"
    return Place(folder, digest, words, note)


def _digest(logs: Sequence[str]) -> str:
    paths = sorted("+".join(str(resolved(part)) for part in parts_of(log)) for log in logs)
    return hashlib.sha256("\n".join(paths).encode(errors="surrogateescape")).hexdigest()[:8]


def _made_of(folder: Path) -> tuple[str, str]:
    """Return the digest of the logs of an earlier report and the command that made it, each empty where it says none."""
    try:
        with (folder / PAGE).open("rb") as file:
            head = file.read(_HEAD_BYTES).decode("utf-8", "replace")
    except OSError:
        return "", ""
    found = {key: unescape(text) for key, text in re.findall(r'<meta name="ferryid-(\w+)" content="([^"]*)">', head)}
    return found.get("logs", ""), found.get("command", "")


def _with_origin(page: str, place: Place) -> str:
    """Return a page whose head says what it is of."""
    told = {"logs": place.logs, "command": place.command}
    tags = "".join(f'\n<meta name="ferryid-{key}" content="{escape(text)}">' for key, text in told.items() if text)
    return page.replace(_CHARSET, _CHARSET + tags, 1)


def made(command: Sequence[str]) -> dict[str, str]:
    """Return date, version and the words of the command, as a page states them."""
    now = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    return {"date": now, "version": __version__, "command": shlex.join(command)}


def write_folder(
    place: Place | Path,
    page: str,
    drawings: Mapping[str, str],
    plain: Mapping[str, Any],
    name: str,
    last: Callable[[], object] = lambda: None,
    scripts: Mapping[str, str] | None = None,
) -> None:
    """Write a report in place of an earlier one of that folder.

    Parameters
    ----------
    place
        Where to, from `place_of`, or a folder that is this report's alone.
    page, drawings
        HTML, and SVG by name.
    plain, name
        The result, and the name of its JSON file.
    last
        Done before the report takes its place: a full disk or an interrupt leaves neither without the other.
    scripts
        Data of the interactive figures, by file name.

    Raises
    ------
    FerryIdError
        For a folder that cannot be written; nothing half-written is left.
    """
    place = Place(place) if isinstance(place, Path) else place
    with replacing(place.folder) as temporary:
        temporary.mkdir()
        files = {
            PAGE: _with_origin(page, place),
            **{f"{key}.svg": drawing for key, drawing in drawings.items()},
            **(scripts or {}),
        }
        for file, text in files.items():
            (temporary / file).write_text(text, encoding="utf-8", errors="backslashreplace")
        (temporary / name).write_text(dump_json(plain), encoding="utf-8")
        last()
