"""The house rules that a machine can keep: imports point one way, and heavy packages stay in their rooms."""

from __future__ import annotations

import ast
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[1]
ORDER = (
    "errors",
    "counts",
    "log_warnings",
    "files",
    "interrupts",
    "cached",
    "side_by_side",
    "freed",
    "compiler",
    "compiled",
    "lazy",
    "types",
    "recursive_filter",
    "thresholds",
    "json_record",
    "ingest",
    "vessel",
    "signals",
    "draft",
    "effects",
    "regression",
    "models",
    "identify",
    "compare",
    "diagnose",
    "simulate",
    "identifiability",
    "planning",
    "report",
    "export",
    "reproduce",
    "batch",
    "validation",
    "doctor",
    "api",
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


@cache
def _import_statements(path: Path) -> tuple[list[ast.Import | ast.ImportFrom], list[ast.ImportFrom], list[str]]:
    """Return the imports of a file, those among them that run when it is imported, and the names in its `__all__`.

    A file is parsed once for all rules.
    """
    top = ast.parse(path.read_text(encoding="utf-8")).body
    every = [node for node in _statements(top) if isinstance(node, ast.Import | ast.ImportFrom)]
    public = [
        name
        for node in top
        if isinstance(node, ast.Assign) and [getattr(target, "id", "") for target in node.targets] == ["__all__"]
        for name in ast.literal_eval(node.value)
    ]
    return every, [node for node in top if isinstance(node, ast.ImportFrom)], public


def _statements(body: list[Any]) -> Iterator[ast.AST]:
    """Yield statements and those within them; no import stands in an expression."""
    for node in body:
        yield node
        for inside in ("body", "orelse", "finalbody", "handlers", "cases"):
            yield from _statements(getattr(node, inside, []))


def _imports(path: Path) -> Iterator[tuple[int, str]]:
    for node in _import_statements(path)[0]:
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        else:
            assert node.level == 0, f"{path}:{node.lineno}: relative import"
            yield node.lineno, node.module or ""


@pytest.mark.slow
def test_imports_point_one_way() -> None:
    found = [told for path in _modules() for told in _against_the_order(path)]
    assert not found, "\n".join(found)


def _against_the_order(path: Path) -> Iterator[str]:
    """Yield the imports of a file that a later layer, or none, should have; a test for each file takes longer than this."""
    layer = _layer(path)
    if layer in ("__init__", "schemas"):
        allowed: tuple[str, ...] = ()
    elif layer in ORDER:
        allowed = ORDER[: ORDER.index(layer) + 1]
    else:
        yield f"{path}: {layer} has no place in the order of layers"
        return
    for line, name in _imports(path):
        package, _, rest = name.partition(".")
        if package == "ferryid" and rest:
            target = rest.partition(".")[0]
            if target not in allowed and target != "schemas":
                yield f"{path}:{line} imports {name} from a later layer"
        if layer not in HOMES.get(package, (layer,)):
            yield f"{path}:{line} imports {package}, which belongs to {HOMES[package]}"


BORDERS = ("regression", "models", "identify", "compare")
"""Packages of which others import only what the `__all__` of the package, or of a package in it, names."""
MOST_PUBLIC_NAMES = 23


def _packages() -> list[Path]:
    return sorted(path for name in BORDERS for path in (ROOT / "ferryid" / name).rglob("__init__.py"))


def _public(path: Path) -> list[str]:
    """Return the names in the `__all__` of a file; none where it has no such list."""
    return _import_statements(path)[2]


def test_others_import_from_the_borders_of_a_package() -> None:
    found = [told for path in _modules() for told in _past_a_border(path)]
    assert not found, "\n".join(found)


def _past_a_border(path: Path) -> Iterator[str]:
    """Yield the imports of a file from inside another package that has a border."""
    for node in _import_statements(path)[0]:
        imported = [alias.name for alias in node.names] if isinstance(node, ast.Import) else [node.module or ""]
        for name in imported:
            parts = name.split(".")
            if parts[0] != "ferryid" or len(parts) < 2 or parts[1] not in BORDERS or parts[1] == _layer(path):
                continue
            init = ROOT.joinpath(*parts, "__init__.py")
            if not init.exists():
                yield f"{path}:{node.lineno} imports the module {name}; import from its package"
            elif isinstance(node, ast.Import):
                yield f"{path}:{node.lineno} imports {name} as a whole"
            else:
                names = _public(init)
                for alias in node.names:
                    if alias.name not in names:
                        yield f"{path}:{node.lineno} {alias.name} is not public in {name}"


@pytest.mark.parametrize("path", _packages(), ids=lambda path: str(path.parent.relative_to(ROOT)))
def test_the_border_of_a_package_is_small_and_all_there(path: Path) -> None:
    names = _public(path)
    package = import_module(".".join(path.parent.relative_to(ROOT).parts))
    assert len(names) <= MOST_PUBLIC_NAMES
    assert all(hasattr(package, name) for name in names)
    # A module of the same name would take the place of the function once it is imported.
    assert not set(names) & {file.stem for file in path.parent.iterdir()}


@pytest.mark.slow
def test_no_circle_of_imports() -> None:
    paths = {".".join(path.relative_to(ROOT).with_suffix("").parts): path for path in _modules()}
    paths = {name.removesuffix(".__init__"): path for name, path in paths.items() if name.startswith("ferryid")}
    needs = {name: {other for other in _needed(path) if other in paths} - {name} for name, path in paths.items()}
    left = dict(needs)
    while free := [name for name, others in left.items() if not others & left.keys()]:
        for name in free:
            del left[name]
    assert not left, "these modules import one another: " + ", ".join(sorted(left))


def _needed(path: Path) -> Iterator[str]:
    """Yield what a module imports when it is imported itself, of a package the module that has the name."""
    own = ".".join(path.relative_to(ROOT).with_suffix("").parts)
    for node in _import_statements(path)[1]:
        for name in [node.module or "", *(f"{node.module}.{alias.name}" for alias in node.names)]:
            yield name
            # Packages around what is imported are imported first.
            around = (name.rpartition(".")[0], ".".join(name.split(".")[:2]), ".".join(name.split(".")[:3]))
            yield from (package for package in around if not own.startswith(f"{package}."))


@pytest.mark.slow
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
