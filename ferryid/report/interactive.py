"""Interactive figures of a page: its timelines, and the scripts and styles that show them.

Scripts lie once per output folder in ``reports/assets/KEY``, beside the folders of the pages.

The key is of their content, so that pages of another version of ferryid keep the scripts that they were written with.
uPlot draws the lines (50 kB, MIT licence, which lies beside it). It is no part of the sources: the makefile puts it into
``static``, from where a wheel takes it, and where it is missing pages keep their static figures.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from pathlib import Path

from ferryid.errors import UnwritableError
from ferryid.files import remove_abandoned, replacing
from ferryid.report.timeline import Timeline, scripts

SCRIPTS = ("uplot.js", "theme.js", "decode.js", "axis.js", "map.js", "strips.js", "timeline.js")
"""In the order in which a page loads them."""
STYLES = ("uplot.css", "timeline.css")
LICENCE = "uplot-LICENSE.txt"


def available() -> bool:
    """Tell whether the library that draws the lines is there."""
    return (files("ferryid.report") / "static" / SCRIPTS[0]).is_file()


@cache
def _contents() -> tuple[str, dict[str, bytes]]:
    """Return the key and the contents of every file by name."""
    folder = files("ferryid.report") / "static"
    contents = {name: (folder / name).read_bytes() for name in (*SCRIPTS, *STYLES, LICENCE)}
    digest = hashlib.sha256()
    for name, content in contents.items():
        digest.update(name.encode() + b"\0" + content)
    return digest.hexdigest()[:12], contents


@dataclass(frozen=True)
class Interactive:
    """What a page shows interactively, beside its static figures.

    Attributes
    ----------
    timelines
        By the place of their log, or of their figure, on the page, from 0.
    place
        Address of the folder of the scripts as the page links to it.
    """

    timelines: Mapping[int, Timeline] = field(default_factory=dict)
    place: str = ""

    def number(self, place: int) -> int:
        """Return which timeline is at the place of a log or a figure, from 1; 0 where it has none."""
        return list(self.timelines).index(place) + 1 if place in self.timelines else 0

    @property
    def assets(self) -> dict[str, list[str]]:
        """Addresses of scripts and styles; empty without timelines."""
        if not self.timelines:
            return {}
        return {
            "scripts": [f"{self.place}/{name}" for name in SCRIPTS],
            "styles": [f"{self.place}/{name}" for name in STYLES],
        }

    def files(self) -> dict[str, str]:
        """Return the data beside the page, by file name."""
        return scripts(list(self.timelines.values()))


STATIC = Interactive()
"""A page without interactive figures."""


def make_interactive(timelines: Mapping[int, Timeline | None], folder: Path, out: Path) -> Interactive:
    """Return what the page in a folder shows, and write its scripts to the output folder.

    Raises
    ------
    FerryIdError
        For a folder that cannot be written; nothing half-written is left.
    """
    found = interactive_of(timelines, folder, out)
    if found.timelines:
        write_assets(out)
    return found


def interactive_of(timelines: Mapping[int, Timeline | None], folder: Path, out: Path) -> Interactive:
    """Return what the page in a folder shows with the scripts of the output folder, which are to be written yet."""
    made = {log: one for log, one in timelines.items() if one is not None}
    if not made or not available():
        return STATIC
    key, _ = _contents()
    return Interactive(made, os.path.relpath(out / "reports" / "assets" / key, folder).replace(os.sep, "/"))


def write_assets(out: Path) -> None:
    """Write the scripts of an output folder where they are not there yet.

    Raises
    ------
    FerryIdError
        For a folder that cannot be written; nothing half-written is left.
    """
    key, contents = _contents()
    folder = out / "reports" / "assets" / key
    if folder.is_dir():
        remove_abandoned(folder.parent)
        return
    try:
        with replacing(folder) as temporary:
            temporary.mkdir()
            for name, content in contents.items():
                (temporary / name).write_bytes(content)
    except UnwritableError:
        # Another process may have written the same meanwhile.
        if not folder.is_dir():
            raise
