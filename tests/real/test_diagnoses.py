"""The page of diagnoses of recordings, without the recordings."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest

from ferryid.diagnose.judging.finding import Finding
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


def test_findings_above_one_half_are_counted_with_those_that_nothing_defends() -> None:
    def finding(effect: str, sure: bool = True) -> Finding:
        return cast(Finding, SimpleNamespace(effect=effect, instance=None, sure=sure))

    assert diagnoses.tally([(finding("wind", sure=False), "Defended: so.")]) == "Findings above one half: none."
    judged = [
        (finding("wind"), "Defended: the witness says 1 m/s. Defended: the witness says 2 m/s."),
        (finding("wind"), "Defended: the witness says 1 m/s. Doubtful: the witness says 9 m/s."),
        (finding("payload"), diagnoses.UNJUDGED),
        (finding("payload"), diagnoses.UNJUDGED),
    ]
    told = diagnoses.tally(judged)
    assert told.startswith("Findings above one half: 4, of which 1 are defended")
    assert told.endswith("The others: Steady wind: doubtful; Payload: no witness (2 logs).")
