"""What is folded on a page is printed with the rest, and folded again afterwards."""

from __future__ import annotations

from pathlib import Path

import pytest

from ferryid.report import html
from ferryid.report.batch_page import render
from tests.report.browser import CHROMIUM, Page
from tests.report.test_batch_page import hostile

TEMPLATES = Path(html.__file__).parent / "templates"


@pytest.mark.parametrize("name", sorted(one.name for one in TEMPLATES.glob("*.html")))
def test_every_page_with_folded_texts_opens_them_to_be_printed(name: str) -> None:
    text = (TEMPLATES / name).read_text(encoding="utf-8")
    if "<details" in text:
        assert '{% include "printed.html" %}' in text


@pytest.mark.slow
@pytest.mark.skipif(not CHROMIUM, reason="there is no Chromium to open the pages with")
def test_folded_texts_are_open_while_a_page_is_printed(page: Page, tmp_path: Path) -> None:
    path = tmp_path / "index.html"
    path.write_text(render(hostile()), encoding="utf-8")
    page.faults.clear()
    page.open(path)
    states = "[...document.querySelectorAll('details')].map((one) => one.open)"
    page.do("document.querySelector('details').open = true")
    before = page.do(states)
    assert (before[0], before[1:]) == (True, [False] * (len(before) - 1))
    assert len(before) > 1
    # Listeners are called in their order: this one sees what the page did.
    page.do(f"addEventListener('beforeprint', () => {{ globalThis.printed = {states}; }})")
    page.printed()
    assert page.do("printed") == [True] * len(before)
    assert page.do(states) == before
    # A browser may begin to print again, as for a preview, before it says that it has printed.
    for event in ("beforeprint", "beforeprint", "afterprint"):
        page.do(f"dispatchEvent(new Event('{event}'))")
    assert page.do(states) == before
    assert page.faults == []
