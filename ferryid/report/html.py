"""HTML pages from the templates of this package, alike in all that is not their own."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader, Template
from markupsafe import Markup, escape

from ferryid.counts import counted
from ferryid.errors import printable
from ferryid.report.heat_map import inline


@cache
def template(name: str) -> Template:
    """Return a template by its file name; whatever a page of HTML shows is escaped."""
    environment = Environment(
        loader=PackageLoader("ferryid.report", "templates"),
        autoescape=name.endswith(".html"),
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_visible,
    )
    environment.filters["unbroken_options"] = _unbroken_options
    environment.globals["counted"] = counted
    environment.globals["heat_inline"] = inline()
    return environment.get_template(name)


CONTENTS = "<!-- contents -->"
"""Where a page has the links to its sections."""
_SECTION = re.compile(r"<h2>(.*?)</h2>", re.DOTALL)


def with_contents(page: str) -> str:
    """Return a page with links to its sections at `CONTENTS`, and the names there that they lead to."""
    titles = _SECTION.findall(page)
    numbers = iter(range(1, len(titles) + 1))
    named = _SECTION.sub(lambda one: f'<h2 id="section-{next(numbers)}">{one[1]}</h2>', page)
    links = "".join(f'<li><a href="#section-{number}">{title}</a></li>' for number, title in enumerate(titles, 1))
    return named.replace(CONTENTS, f'<nav class="contents" aria-label="Contents"><ul>{links}</ul></nav>')


def _unbroken_options(text: str) -> Markup:
    """Return a text as HTML in which no line ends within an option, which browsers break after its hyphens."""
    words = re.split(r"((?<![\w-])--?[A-Za-z][\w-]*)", printable(text, keep="\n\t"))
    return Markup("").join(
        Markup('<span class="unbroken">{}</span>').format(word) if k % 2 else escape(word)
        for k, word in enumerate(words)
    )


def _visible(value: Any) -> Any:
    """Escape control characters in a text; markup made by ourselves, such as a figure, passes as it is."""
    return printable(value, keep="\n\t") if type(value) is str else value
