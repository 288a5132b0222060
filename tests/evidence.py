"""Which pages in reports/ are older than the sources that they were made from.

Whatever makes a page calls `stamp`, which writes to ``reports/sources.json`` the hash of every folder of sources that the page
depends on: its maker's and all that these import. ``make evidence`` (``python -m tests.evidence``) lists pages whose sources
have changed since; ``python -m tests.evidence PAGE`` stamps one.
"""

from __future__ import annotations

import ast
import hashlib
import json
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
MAKERS: Mapping[str, tuple[str, ...]] = {
    "reports/attack.md": ("tests/attack",),
    "reports/benchmarks.md": ("tests/bench",),
    "reports/campaign.md": ("tests/real",),
    "reports/demo/forces.svg": ("cli/cmd_simulate.py", "cli/cmd_fit.py"),
    "reports/plan.md": ("tests/plans",),
    "reports/proof.json": ("cli/cmd_prove.py",),
    "reports/proof-real.json": ("cli/cmd_prove.py",),
    "reports/proof-sea.json": ("cli/cmd_prove.py",),
    "reports/proof.md": ("tests/proof",),
    "reports/real.md": ("tests/real",),
    "reports/real/diagnosis.md": ("tests/real",),
    "reports/rivals.md": ("tests/rivals",),
    "reports/thesis.md": ("cli/cmd_reproduce.py",),
    "reports/waves.md": ("tests/wavy", *(f"cli/cmd_{name}.py" for name in ("simulate", "fit", "diagnose", "evaluate"))),
}
"""Pages, and the folders or files of their makers."""
BY_HAND = ("reports/proof/changes.md",)
"""Pages that nothing makes."""
STATES = "reports/sources.json"
_NO_SOURCE = (".pyc", ".so")
_ASIDE = ("ferryid.cli", "tests.evidence")
"""Modules that change nothing on a page."""


@dataclass(frozen=True)
class Age:
    """How old a page is.

    Attributes
    ----------
    page
        Path from the root.
    made
        Date on which it was made, empty where it has no state.
    changed
        Folders of sources that have changed or gone since.
    """

    page: str
    made: str
    changed: tuple[str, ...]

    def __str__(self) -> str:
        if not self.made:
            return f"{self.page}: the state of its sources is not known"
        state_ = f"older than {', '.join(self.changed)}" if self.changed else "up to date"
        return f"{self.page}, of {self.made}: {state_}"


def folders(page: str, root: Path = ROOT) -> tuple[str, ...]:
    """Return the folders that a page depends on: its makers', and of all that they import, the command line's left out."""
    found: set[Path] = set()
    left = [path for maker in MAKERS[page] for path in _imported(root / maker, root)]
    left += [root / maker for maker in MAKERS[page] if (root / maker).is_dir()]
    while left:
        folder = left.pop()
        if folder not in found:
            found.add(folder)
            left += _imported(folder, root)
    return tuple(sorted(folder.relative_to(root).as_posix() for folder in found))


@cache
def _imported(place: Path, root: Path) -> frozenset[Path]:
    """Return the folders of what a file, or the files of a folder, import or name as a package."""
    return frozenset(_targets(place, root))


def _targets(place: Path, root: Path) -> Iterator[Path]:
    for path in sorted(place.glob("*.py")) if place.is_dir() else [place]:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.module:
                names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
            elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.startswith("ferryid."):
                # Packages of data are named, as in ``files("ferryid.vessel.profiles")``.
                names = [node.value]
            else:
                continue
            for name in names:
                if name.startswith(("ferryid", "tests")) and not name.startswith(_ASIDE):
                    target = root.joinpath(*name.split("."))
                    if target.is_dir():
                        yield target
                    elif target.with_suffix(".py").is_file():
                        yield target.parent


def digest(folder: Path) -> str:
    """Return a hash of the files right in a folder, by name and content; tests are no sources."""
    whole = hashlib.sha256()
    for path in sorted(folder.iterdir()):
        if path.is_file() and path.suffix not in _NO_SOURCE and not path.name.startswith((".", "test_")):
            whole.update(f"{path.name}\0{hashlib.sha256(path.read_bytes()).hexdigest()}\n".encode())
    return whole.hexdigest()[:16]


def state(page: str, root: Path = ROOT) -> dict[str, str]:
    """Return the hash of every folder that a page depends on."""
    return {folder: digest(root / folder) for folder in folders(page, root)}


def stamp(page: str | Path, root: Path = ROOT) -> None:
    """Write down the present state of the sources of a page that was just made; nothing for a page elsewhere."""
    name = _named(Path(page), root)
    if name not in MAKERS:
        return
    states = read(root)
    states[name] = {"made": f"{datetime.now(UTC):%Y-%m-%d}", "sources": state(name, root)}
    (root / STATES).write_text(json.dumps(states, indent=1, sort_keys=True) + "\n", encoding="utf-8")


def _named(page: Path, root: Path) -> str:
    path = (root / page).resolve()
    return path.relative_to(root).as_posix() if path.is_relative_to(root) else ""


def read(root: Path = ROOT) -> dict[str, dict[str, object]]:
    """Return the states of all pages."""
    path = root / STATES
    return dict(json.loads(path.read_text(encoding="utf-8"))) if path.is_file() else {}


@dataclass(frozen=True)
class Lines:
    """Results of one unit of work each, so that a run that was ended goes on: only those of the present sources count.

    Attributes
    ----------
    path
        The file, of lines of JSON; it need not be there.
    sources
        Hash of all sources that results depend on.
    """

    path: Path
    sources: str

    @classmethod
    def of(cls, path: Path, page: str) -> Lines:
        """Return the lines in a file for the sources of a page as they are."""
        every = json.dumps(state(page), sort_keys=True)
        return cls(path, hashlib.sha256(every.encode()).hexdigest()[:16])

    def known(self) -> dict[str, Any]:
        """Return the results that are there, by the name of their unit; the last line may be cut off."""
        found = {}
        for line in self._read():
            if line["sources"] == self.sources:
                found[line["unit"]] = line["result"]
        return found

    def _read(self) -> Iterator[dict[str, Any]]:
        if not self.path.exists():
            return
        for text in self.path.read_text(encoding="utf-8").splitlines():
            try:
                yield json.loads(text)
            except json.JSONDecodeError:
                continue

    def add(self, unit: str, result: Any) -> None:
        """Append a result."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        text = json.dumps({"sources": self.sources, "unit": unit, "result": result})
        begun = self.path.exists() and not self.path.read_bytes().endswith(b"\n")
        with self.path.open("a", encoding="utf-8") as file:
            file.write(("\n" if begun else "") + text + "\n")


def ages(root: Path = ROOT) -> tuple[Age, ...]:
    """Return the age of every page that is made."""
    states, made = read(root), []
    for page in MAKERS:
        known = states.get(page)
        if known is None:
            made.append(Age(page, "", ()))
            continue
        before = known["sources"]
        assert isinstance(before, dict)
        changed = [one for one, was in before.items() if not (root / one).is_dir() or digest(root / one) != was]
        made.append(Age(page, str(known["made"]), tuple(sorted(changed))))
    return tuple(made)


def table(every: tuple[Age, ...]) -> str:
    """Return ages as text, the folders of each page beneath it."""
    width = max(len(one.page) for one in every)
    lines = [f"{'page':{width}}  made        state"]
    for one in every:
        state_ = (
            "no state"
            if not one.made
            else f"older than {len(one.changed)} of its folders"
            if one.changed
            else "up to date"
        )
        lines.append(f"{one.page:{width}}  {one.made or '-':10}  {state_}")
        lines += [f"{'':{width}}              {folder}" for folder in one.changed]
    return "\n".join(lines)


if __name__ == "__main__":
    unknown = [page for page in sys.argv[1:] if page not in MAKERS]
    if unknown:
        sys.exit(f"{unknown[0]}: no page that is made. Fix: give one of {', '.join(MAKERS)}")
    for page in sys.argv[1:]:
        stamp(page)
    if not sys.argv[1:]:
        print(table(ages()))
