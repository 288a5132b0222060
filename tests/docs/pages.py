"""The documents' pages, their code blocks and their links."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGES = (
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    ROOT / "CHANGELOG.md",
    ROOT / "fixtures" / "README.md",
    *sorted((ROOT / "docs").glob("*.md")),
)
FENCE = re.compile(r"(?P<slow><!-- slow -->\n)?^```(?P<language>\w*)\n(?P<text>.*?)^```$", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"\]\(([^)\s]+)\)")


@dataclass(frozen=True)
class Block:
    """A fenced block: its language, text and first line's number, and whether ``<!-- slow -->`` stands before it."""

    language: str
    text: str
    line: int
    slow: bool


@dataclass(frozen=True)
class Call:
    """A command after a prompt, and the lines shown beneath it; a line ``...`` stands for any number of lines."""

    command: str
    shown: str


def blocks(page: Path) -> list[Block]:
    """Return every fenced block of a page."""
    text = page.read_text(encoding="utf-8")
    return [
        Block(one["language"], one["text"], text.count("\n", 0, one.start("text")), one["slow"] is not None)
        for one in FENCE.finditer(text)
    ]


def calls(block: Block) -> Iterator[Call]:
    """Yield the commands of a console block."""
    for part in re.split(r"^\$ ", block.text, flags=re.MULTILINE)[1:]:
        command, _, shown = part.partition("\n")
        yield Call(command, shown)


def links(page: Path) -> list[str]:
    """Return the targets of a page's links, those in code blocks left out."""
    return LINK.findall(FENCE.sub("", page.read_text(encoding="utf-8")))
