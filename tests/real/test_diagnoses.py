"""The page of diagnoses of recordings, without the recordings."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.real import diagnoses

PAGE = """# Diagnoses

## A tanker

![wind](diagnosis-tanker-wind.svg)

## A ferry

![gain](diagnosis-ferry-thruster_gain.svg)

Made in 3 minutes.
"""


def test_figures_of_findings_that_are_no_longer_made_are_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(diagnoses, "FOLDER", tmp_path)
    kept = ["diagnosis-tanker-wind.svg", "diagnosis-ferry-thruster_gain.svg", "tanker-forces.svg", "diagnosis.md"]
    for name in (*kept, "diagnosis-ferry-payload.svg", "diagnosis-ferry-thruster_gain-2.svg"):
        (tmp_path / name).write_text("", encoding="utf-8")
    diagnoses.put(PAGE)
    assert sorted(one.name for one in tmp_path.iterdir()) == sorted(kept)
    assert (tmp_path / "diagnosis.md").read_text(encoding="utf-8") == PAGE

    def again() -> str:
        (tmp_path / "diagnosis-ferry-lag.svg").write_text("", encoding="utf-8")
        return "\n## A ferry\n\n![lag](diagnosis-ferry-lag.svg)\n"

    diagnoses.write_again(again)
    # What the other sections show stays, and so do the figures of other pages.
    kept[1] = "diagnosis-ferry-lag.svg"
    assert sorted(one.name for one in tmp_path.iterdir()) == sorted(kept)
    assert "Made in 3 minutes." in (tmp_path / "diagnosis.md").read_text(encoding="utf-8")
