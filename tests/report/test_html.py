"""What every page shares."""

from __future__ import annotations

import pytest
from jinja2 import DictLoader

from ferryid.report import html


def test_a_page_shows_control_characters_and_markup_of_a_log_as_text(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(html, "PackageLoader", lambda *_: DictLoader({"x.html": "<p>{{ a }}</p>{{ b | safe }}"}))
    page = html.template("x.html").render(a="\x1b[2J<b>\u202e\n", b="<i>\tkept</i>")
    assert page == "<p>\\x1b[2J&lt;b&gt;\\u202e\n</p><i>\tkept</i>"


def test_no_line_ends_within_an_option_and_the_text_is_escaped() -> None:
    made = html.template("versus.html").environment.filters["unbroken_options"]
    shown = made("ferryid fit esso-osaka --weak-window 8 -h '<b>'")
    assert shown == (
        'ferryid fit esso-osaka <span class="unbroken">--weak-window</span> 8 <span class="unbroken">-h</span> '
        "&#39;&lt;b&gt;&#39;"
    )
