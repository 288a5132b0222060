"""The folder of a report: its page, its drawings and its JSON, all or nothing."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from ferryid import __version__
from ferryid.files import dump_json, replacing

PAGE = "report.html"


def made(command: Sequence[str]) -> dict[str, str]:
    """Return date, version and the words of the command, as a page states them."""
    now = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    return {"date": now, "version": __version__, "command": shlex.join(command)}


def write_folder(
    folder: Path,
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
    folder
        Of the report.
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
    with replacing(folder) as temporary:
        temporary.mkdir()
        files = {PAGE: page, **{f"{key}.svg": drawing for key, drawing in drawings.items()}, **(scripts or {})}
        for file, text in files.items():
            (temporary / file).write_text(text, encoding="utf-8", errors="backslashreplace")
        (temporary / name).write_text(dump_json(plain), encoding="utf-8")
        last()
