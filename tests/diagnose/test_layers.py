"""Layers of the diagnosis: pipeline above judging, judging above inference, inference above checks and data; no circles."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]
HOME = ROOT / "ferryid" / "diagnose"
ORDER = ("data", "checks", "second_sources", "inference", "judging", "gathering", "same_vessel", "pipeline", "versus")
"""From the bottom to the top."""
PACKAGES = (
    "ferryid.diagnose",
    *(f"ferryid.diagnose.{name}" for name in ("data", "checks", "second_sources", "inference", "judging")),
)
"""What others may import from, and of these no more than their ``__all__``; a check is a module of its own."""


def imports(path: Path) -> Iterator[tuple[str, str]]:
    """Return module and name of everything that a file imports from."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            yield from ((node.module or "", alias.name) for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names)


def module(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts)


MODULES = sorted(path for path in HOME.rglob("*.py") if path.name != "__init__.py")


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(HOME)))
def test_imports_point_down(path: Path) -> None:
    layer = path.relative_to(HOME).with_suffix("").parts[0]
    allowed = ORDER[: ORDER.index(layer) + 1]
    for name, what in imports(path):
        if name == "ferryid.diagnose" or name.startswith("ferryid.diagnose."):
            parts = f"{name}.{what}".split(".")
            assert parts[2] in allowed, f"{path} imports {name} from a layer above it"


def test_there_are_no_circles() -> None:
    known = {module(path) for path in MODULES}
    needs = {
        module(path): {one for name, what in imports(path) for one in (name, f"{name}.{what}") if one in known}
        for path in MODULES
    }
    while free := [one for one, of in needs.items() if not of & needs.keys()]:
        for one in free:
            del needs[one]
    assert not needs, f"import each other: {sorted(needs)}"


def others() -> list[Path]:
    every = sorted((ROOT / "ferryid").rglob("*.py")) + sorted((ROOT / "cli").rglob("*.py"))
    return [path for path in every if HOME not in path.parents]


def test_others_import_what_is_offered() -> None:
    for path in others():
        for name, what in imports(path):
            if not (name == "ferryid.diagnose" or name.startswith("ferryid.diagnose.")):
                continue
            parts = f"{name}.{what}".split(".")
            if parts[2] == "checks" and (HOME / "checks" / f"{parts[3]}.py").exists():
                continue
            assert name in PACKAGES, f"{path} imports {name}, which is not for others"
            assert what in import_module(name).__all__, f"{path} imports {what}, which {name} does not offer"


def test_what_is_offered_is_there() -> None:
    for name in PACKAGES:
        package = import_module(name)
        assert len(package.__all__) == len(set(package.__all__))
        for what in package.__all__:
            assert hasattr(package, what)
