"""Sections of a run of the benchmarks that was ended, so that the next run goes on where it stopped."""

from __future__ import annotations

import json
import shutil
from dataclasses import asdict
from pathlib import Path

from ferryid.files import replacing
from tests.bench.page import Row, Section
from tests.evidence import ROOT, state

FOLDER = ROOT / "build" / "bench"
PAGE = "reports/benchmarks.md"


def read(name: str, folder: Path = FOLDER) -> Section | None:
    """Return a section that was measured with the sources as they are; None where there is none."""
    path = folder / f"{name}.json"
    if not path.is_file():
        return None
    kept = json.loads(path.read_text(encoding="utf-8"))
    if kept["sources"] != state(PAGE):
        return None
    section = kept["section"]
    return Section(**{**section, "rows": [Row(**row) for row in section["rows"]]})


def write(name: str, section: Section, folder: Path = FOLDER) -> None:
    """Keep a section."""
    folder.mkdir(parents=True, exist_ok=True)
    with replacing(folder / f"{name}.json") as draft:
        draft.write_text(json.dumps({"sources": state(PAGE), "section": asdict(section)}), encoding="utf-8")


def remove(folder: Path = FOLDER) -> None:
    """Forget all sections: the page of their run is made."""
    shutil.rmtree(folder, ignore_errors=True)
