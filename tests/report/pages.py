"""What holds of every page."""

from __future__ import annotations

import re

import pytest

from ferryid.report.interactive import available
from tests.conftest import NOT_DRAWN

NEEDS_UPLOT = pytest.mark.skipif(not available(), reason="uPlot is not there: make fetches it by npm")
_INTERACTIVE = re.compile(r"""(src|href)="((\.\./)+(\w+/)*assets/\w+/\w+\.(js|css)|timeline\.js)\"""")
_OTHER = re.compile(r"""(src|href)\s*=\s*["'](?!#|data:)""")


def needs_nothing(page: str) -> bool:
    """Return whether a page can be read alone and without a network: only its interactive figures lie beside it.

    Its figures are drawn, which tests leave out that do not look at them.
    """
    return NOT_DRAWN not in page and not _OTHER.search(_INTERACTIVE.sub("", page))
