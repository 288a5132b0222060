"""A run of the benchmarks that was ended goes on; what was measured with other sources is measured anew."""

from __future__ import annotations

import json
from pathlib import Path

from tests.bench import kept
from tests.bench.page import Row, Section, page

SECTION = Section(
    "Ingestion",
    [Row("12 min", "1 s", "rosbags", "20 s", 20.0, "≥ 35", reached=False), Row("growth", "2 s", "1 h", "1 s", 2.0)],
    ["A note."],
    ("numpy",),
)


def test_a_section_comes_back_as_it_was(tmp_path: Path) -> None:
    assert kept.read("ingest", tmp_path) is None
    kept.write("ingest", SECTION, tmp_path)
    back = kept.read("ingest", tmp_path)
    assert back is not None
    assert page([back], quick=False) == page([SECTION], quick=False)
    assert kept.read("long", tmp_path) is None
    kept.remove(tmp_path)
    assert not tmp_path.exists()


def test_a_section_of_other_sources_does_not_count(tmp_path: Path) -> None:
    kept.write("ingest", SECTION, tmp_path)
    path = tmp_path / "ingest.json"
    told = json.loads(path.read_text(encoding="utf-8"))
    told["sources"]["tests/bench"] = "0" * 16
    path.write_text(json.dumps(told), encoding="utf-8")
    assert kept.read("ingest", tmp_path) is None
