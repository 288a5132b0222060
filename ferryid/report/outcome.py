"""What a command leaves: its result as JSON and as text, and the page of it."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ferryid.files import resolved

if TYPE_CHECKING:
    import pandas as pd

LARGEST_SHOWN = 8 << 20
"""A page beyond this many bytes is linked in a notebook, not shown: the notebook would keep all of it."""


@dataclass(frozen=True, repr=False)
class Outcome:
    """The result of a command; a notebook shows its text.

    Attributes
    ----------
    json
        The result as ``--json`` writes it; its key ``schema`` names its form.
    text
        The result as a terminal shows it.
    """

    json: dict[str, Any]
    text: str

    @property
    def tables(self) -> dict[str, pd.DataFrame]:
        """The result as pandas tables by name, such as ``findings`` and ``errors``: see `ferryid.report.tables.tables_of`."""
        from ferryid.report.tables import tables_of

        return tables_of(self.json)

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        """Return the form of the result and its first line; `print` shows all of it."""
        return f"<{self.json.get('schema', type(self).__name__)}: {self.text.partition(chr(10))[0]}>"

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self.text)}</pre>"


@dataclass(frozen=True, repr=False)
class Report(Outcome):
    """A result with a page, which a notebook shows in its place where it was written: `report` is its path."""

    report: Path

    @property
    def figures(self) -> dict[str, Path]:
        """Paths of the figures (SVG) beside the page, by name."""
        return {path.stem: path for path in sorted(self.report.parent.glob("*.svg"))}

    def _repr_html_(self) -> str:
        if not self.report.is_file():
            return super()._repr_html_()
        if self.report.stat().st_size > LARGEST_SHOWN:
            return f"{super()._repr_html_()}<p><a href='{escape(resolved(self.report).as_uri())}'>report</a></p>"
        page = escape(self.report.read_text(encoding="utf-8"))
        return f'<iframe srcdoc="{page}" style="width: 100%; height: 40em; border: 1px solid #ccc"></iframe>'
