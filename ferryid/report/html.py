"""HTML pages from the templates of this package, alike in all that is not their own."""

from __future__ import annotations

from jinja2 import Environment, PackageLoader, Template


def template(name: str) -> Template:
    """Return a template by its file name; whatever it shows is escaped."""
    loader = PackageLoader("ferryid.report", "templates")
    return Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True).get_template(name)
