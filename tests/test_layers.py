"""The house rules that a machine can keep: imports point one way, and heavy packages stay in their rooms."""

from __future__ import annotations

import ast
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
ORDER = (
    "errors",
    "counts",
    "files",
    "interrupts",
    "compiled",
    "ingest",
    "vessel",
    "signals",
    "effects",
    "identify",
    "diagnose",
    "simulate",
    "report",
    "export",
    "reproduce",
    "batch",
    "validation",
    "cli",
)
HOMES = {
    "matplotlib": ("report",),
    "jinja2": ("report",),
    "typer": ("cli",),
    "mcap": ("ingest", "simulate"),
    "rosbags": ("ingest", "simulate"),
    "google": ("ingest",),
    "lz4": ("ingest", "simulate"),
    "zstandard": ("ingest", "simulate"),
    "pysindy": ("validation",),
    "distributed": ("batch",),
}
"""Packages and the layers that may import them; the simulator writes logs, which is why it may know their formats."""


def _modules() -> list[Path]:
    return sorted((ROOT / "ferryid").rglob("*.py")) + sorted((ROOT / "cli").rglob("*.py"))


def _layer(path: Path) -> str:
    parts = path.relative_to(ROOT).parts
    return "cli" if parts[0] == "cli" else Path(parts[1]).stem


def _imports(path: Path) -> Iterator[tuple[int, str]]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            yield node.lineno, node.module or ""


@pytest.mark.parametrize("path", _modules(), ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_point_one_way(path: Path) -> None:
    layer = _layer(path)
    if layer in ("__init__", "schemas"):
        allowed: tuple[str, ...] = ()
    else:
        assert layer in ORDER, f"{layer} has no place in the order of layers"
        allowed = ORDER[: ORDER.index(layer) + 1]
    for line, name in _imports(path):
        package, _, rest = name.partition(".")
        if package == "ferryid" and rest:
            target = rest.partition(".")[0]
            assert target in allowed or target == "schemas", f"{path}:{line} imports {name} from a later layer"
        if package in HOMES:
            assert layer in HOMES[package], f"{path}:{line} imports {package}, which belongs to {HOMES[package]}"


@pytest.mark.parametrize(
    ("arguments", "unwanted"),
    [
        (["--help"], ("numpy", "scipy", "pandas", "pyarrow", "matplotlib", "rosbags", "mcap", "rich")),
        (["fit", "--help"], ("numpy", "scipy", "pandas", "pyarrow", "matplotlib", "rosbags", "mcap", "rich")),
        (["--version"], ("typer", "numpy")),
    ],
)
def test_help_and_version_are_light(arguments: list[str], unwanted: tuple[str, ...]) -> None:
    code = (
        "import sys, ferryid.cli.main as line\n"
        f"sys.argv = ['ferryid', *{arguments}]\n"
        "try: line.main()\n"
        "except SystemExit: pass\n"
        "print(*sorted({name.partition('.')[0] for name in sys.modules}))"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.startswith(("Usage", "ferryid 0."))
    loaded = run.stdout.splitlines()[-1].split()
    assert not set(unwanted) & set(loaded)


def test_every_package_is_in_the_wheel() -> None:
    listed = set(tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]["packages"])
    present = {".".join(path.parent.relative_to(ROOT).parts) for path in (ROOT / "ferryid").rglob("__init__.py")} | {
        "ferryid.cli"
    }
    assert listed == present


def test_no_module_is_called_by_what_it_is_not() -> None:
    assert not [path for path in _modules() if path.stem in ("utils", "helpers", "common", "misc")]
