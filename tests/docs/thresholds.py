"""The page of thresholds, made from their dataclasses: ``python -m tests.docs.thresholds`` writes it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import Field, fields, is_dataclass
from importlib import import_module
from typing import Any

from ferryid.thresholds import BASES
from tests.docs.pages import ROOT

PAGE = ROOT / "docs" / "thresholds.md"
ORDER = (
    "signals",
    "draft",
    "effects",
    "regression",
    "models",
    "identify",
    "compare",
    "diagnose.data",
    "diagnose.checks",
    "diagnose.second_sources",
    "diagnose.inference",
    "diagnose.judging",
)
"""Packages with thresholds, in the order of the page."""
HEAD = f"""# Thresholds

Every number that decides what is found, left out, named, lowered to a hint or accepted, with its unit, its meaning and what it
rests on: *{BASES[0]}* from something else, a *{BASES[1]}* that stands for something, or *{BASES[2]}* data that led to
the rule or to its value. This page is made from the dataclasses in the `thresholds` modules
(`python -m tests.docs.thresholds`), and a test fails when it no longer agrees with them. Sizes of buffers, bounds of iterations
and grids of searches are not here, and the priors of the effects' parameters stand in the effects' files.
"""


def stages() -> Iterator[tuple[str, str, Any]]:
    """Yield the package, the name and the instance of every stage's thresholds, in the order of the page."""
    found = {
        ".".join(path.relative_to(ROOT / "ferryid").parts[:-1]) for path in (ROOT / "ferryid").rglob("*/thresholds.py")
    }
    assert found == set(ORDER), f"Fix: ORDER, {sorted(found ^ set(ORDER))}"
    for package in ORDER:
        module = import_module(f"ferryid.{package}.thresholds")
        for name, value in vars(module).items():
            if is_dataclass(value) and not isinstance(value, type):
                yield package, name, value


def shown(value: float | tuple[float, ...]) -> str:
    """Return a value as the page has it."""
    if isinstance(value, tuple):
        return ", ".join(map(shown, value))
    return f"{value:,}".replace(",", " ") if isinstance(value, int) else f"{value:.6g}"


def row(one: Field[Any], value: Any) -> str:
    """Return a threshold's row of the table."""
    data = one.metadata
    meaning, basis = (data[key].replace("|", "\\|") for key in ("meaning", "basis"))
    return f"| `{one.name}` | {shown(value)} | {data['unit']} | {meaning} | {basis} |"


def page() -> str:
    """Return the page."""
    lines = [HEAD]
    for package, name, stage in stages():
        lines += [
            f"## {(type(stage).__doc__ or '').rstrip('.')}",
            "",
            f"`ferryid.{package}.thresholds.{name}`",
            "",
            "| name | value | unit | meaning | basis |",
            "|---|--:|---|---|---|",
            *(row(one, getattr(stage, one.name)) for one in fields(stage)),
            "",
        ]
    return "\n".join(lines)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
