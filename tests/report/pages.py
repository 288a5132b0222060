"""What holds of every page."""

from __future__ import annotations

import re

import pytest

from ferryid.report.interactive import available

NEEDS_UPLOT = pytest.mark.skipif(not available(), reason="uPlot is not there: make fetches it by npm")
_INTERACTIVE = re.compile(r"""(src|href)="((\.\./)+(\w+/)*assets/\w+/\w+\.(js|css)|timeline\.js)\"""")
_OTHER = re.compile(r"""(src|href)\s*=\s*["'](?!#|data:)""")


def needs_nothing(page: str) -> bool:
    """Return whether a page can be read alone and without a network: only its interactive figures lie beside it."""
    return not _OTHER.search(_INTERACTIVE.sub("", page))
