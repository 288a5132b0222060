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
