"""The drawing of the packages, made from their imports: ``python -m tests.docs.drawing`` writes it."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from html import escape
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DRAWING = ROOT / "docs" / "architecture.svg"
WIDTH, HEIGHT, ACROSS, DOWN, MARGIN, LANE = 104, 34, 36, 22, 12, 12
STYLE = """
text { font: 14px sans-serif; text-anchor: middle; dominant-baseline: central; fill: #222 }
rect { fill: #fff; stroke: #444 }
path { fill: none; stroke: #777 }
marker path { fill: #777; stroke: none }
@media (prefers-color-scheme: dark) { text { fill: #eee } rect { fill: #222; stroke: #bbb } path { stroke: #999 } }
"""


def packages() -> dict[str, Path]:
    """Return the folder of every package that holds code, by its name."""
    found = {path.parent.name: path.parent for path in (ROOT / "ferryid").glob("*/__init__.py")}
    found = {name: folder for name, folder in found.items() if any(folder.rglob("[!_]*.py"))}
    return {**found, "cli": ROOT / "cli"}


def imports(folder: Path) -> Iterator[str]:
    """Yield the packages that a package imports from, repeatedly."""
    for path in folder.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                names = [node.module or ""]
            else:
                continue
            yield from (name.split(".")[1] for name in names if name.startswith("ferryid."))


def built_on() -> dict[str, frozenset[str]]:
    """Return which packages each is built on, without those that another of them is built on already."""
    folders = packages()
    direct = {
        name: {other for other in imports(folder) if other in folders} - {name} for name, folder in folders.items()
    }

    def below(name: str) -> set[str]:
        return direct[name].union(*(below(other) for other in direct[name]))

    return {
        name: frozenset(one for one in used if not any(one in below(other) for other in used - {one}))
        for name, used in direct.items()
    }


def drawn(edges: Mapping[str, frozenset[str]]) -> str:
    """Return the drawing: a column for every depth, an arrow from each package to those that are built on it."""

    def depth(name: str) -> int:
        return 1 + max((depth(other) for other in edges[name]), default=-1)

    columns: dict[int, list[str]] = {}
    for name in sorted(edges):
        columns.setdefault(depth(name), []).append(name)
    tallest = max(map(len, columns.values()))
    height = 2 * MARGIN + tallest * HEIGHT + (tallest - 1) * DOWN
    place: dict[str, tuple[float, float]] = {}
    for column, names in columns.items():
        top = (height - len(names) * HEIGHT - (len(names) - 1) * DOWN) / 2
        for row, name in enumerate(names):
            place[name] = (MARGIN + column * (WIDTH + ACROSS), top + row * (HEIGHT + DOWN))
    width = 2 * MARGIN + len(columns) * WIDTH + (len(columns) - 1) * ACROSS
    arrows = sorted((used, name) for name in edges for used in edges[name])
    far = [pair for pair in arrows if depth(pair[1]) - depth(pair[0]) > 1]
    full = height + LANE * len(far)
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {full}" width="{width}" height="{full}" role="img">',
        "<title>Packages of ferryid; an arrow leads from a package to one that is built on it</title>",
        f"<style>{STYLE}</style>",
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="8" markerHeight="8" orient="auto">'
        '<path d="M0 0 8 4 0 8z"/></marker></defs>',
    ]
    for used, name in arrows:
        (x1, y1), (x2, y2) = place[used], place[name]
        x1, y1, y2 = x1 + WIDTH, y1 + HEIGHT / 2, y2 + HEIGHT / 2
        curve = f"M{x1:g} {y1:g}"
        if (used, name) in far:
            # Beneath the boxes, so that it seems to meet none of those between.
            lane = height - MARGIN + LANE * (1 + far.index((used, name)))
            x, y1 = x1 + ACROSS, lane
            curve += f"C{x - ACROSS / 2:g} {place[used][1] + HEIGHT / 2:g} {x - ACROSS / 2:g} {lane:g} {x:g} {lane:g}"
            curve += f"H{x2 - ACROSS:g}"
        middle = x2 - ACROSS / 2
        curve += f"C{middle:g} {y1:g} {middle:g} {y2:g} {x2:g} {y2:g}"
        lines.append(f'<path d="{curve}" marker-end="url(#tip)"/>')
    for name, (x, y) in sorted(place.items()):
        lines.append(f'<rect x="{x:g}" y="{y:g}" width="{WIDTH}" height="{HEIGHT}" rx="4"/>')
        lines.append(f'<text x="{x + WIDTH / 2:g}" y="{y + HEIGHT / 2:g}">{escape(name)}</text>')
    return "\n".join([*lines, "</svg>", ""])


if __name__ == "__main__":
    DRAWING.write_text(drawn(built_on()), encoding="utf-8")
