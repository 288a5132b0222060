"""The browser that the tests of interactive figures open pages in."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.report.browser import Page, browser


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """Give one tab for the tests of a file."""
    with browser(tmp_path_factory.mktemp("chromium")) as opened:
        yield opened


@pytest.fixture
def opened(page: Page, written: Path) -> Iterator[Page]:
    """Give the page that a file of tests has written, freshly opened, and see that its console stays clean."""
    page.faults.clear()
    page.open(written)
    yield page
    assert page.faults == []
