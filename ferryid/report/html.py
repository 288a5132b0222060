"""HTML pages from the templates of this package, alike in all that is not their own."""

from __future__ import annotations

from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader, Template

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
    environment.globals["counted"] = counted
    environment.globals["heat_inline"] = inline()
    return environment.get_template(name)


def _visible(value: Any) -> Any:
    """Escape control characters in a text; markup made by ourselves, such as a figure, passes as it is."""
    return printable(value, keep="\n\t") if type(value) is str else value
