"""The page of both proofs: what a sceptic asks comes first, either half may be missing, and no effect lacks its sentence."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ferryid.validation.plant.effects import plant_effects
from ferryid.validation.recorded.effects import concealments
from tests.evidence import Age
from tests.proof import __main__ as made
from tests.proof.__main__ import PAGE, QUESTIONS, REAL, REPORTS, SEA, SIMULATED, WHY, joint_page, main


def stored(name: str) -> dict[str, object]:
    return dict(json.loads((REPORTS / name).read_text("utf-8")))


def test_every_effect_has_a_sentence_on_why_the_two_differ() -> None:
    assert set(WHY) == set(plant_effects()) | set(concealments())


def test_the_first_ten_lines_answer_what_a_sceptic_asks() -> None:
    first = joint_page(stored(SIMULATED), stored(REAL)).splitlines()[:10]
    for question in (*QUESTIONS, "How could I check it?"):
        (line,) = [one for one in first if f"**{question}**" in one]
        if question in QUESTIONS:
            assert "simulated: " in line
            assert "real recordings: " in line
    assert f"`{stored(SIMULATED)['sources']}`" in "".join(first)


def test_a_draw_of_older_sources_tells_where_they_differ(monkeypatch: pytest.MonkeyPatch) -> None:
    changed = ("ferryid/diagnose/data", "ferryid/report", "tests/real")
    monkeypatch.setattr(made, "ages", lambda: (Age(f"reports/{SIMULATED}", "2026-12-01", changed),))
    old = {**stored(SIMULATED), "sources": "0" * 16}
    (line,) = [one for one in joint_page(old, stored(REAL)).splitlines() if "**Made by which sources?**" in one]
    assert "(older than the present ones, which differ in ferryid/diagnose/data), `ferryid prove" in line


@pytest.mark.parametrize("name", [SIMULATED, REAL])
def test_either_half_is_written_without_the_other(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text((REPORTS / name).read_text("utf-8"), encoding="utf-8")
    main(tmp_path)
    text = (tmp_path / PAGE).read_text("utf-8")
    assert ("real recordings: " in text) == (name == REAL)
    assert text.count("\n# ") + text.startswith("# ") == 1
    assert f"({name.removesuffix('.json')}/errors.svg)" in text


def test_campaigns_at_sea_are_a_part_of_their_own() -> None:
    text = joint_page(stored(SIMULATED), None, sea=stored(SEA))
    lines = [line for line in text.splitlines()[:10] if line.startswith("- **")]
    for question, line in zip(QUESTIONS, lines, strict=False):
        assert f"**{question}**" in line
        assert "simulated: " in line
        assert "at sea, simulated: " in line
    assert f"`{stored(SEA)['sources']}`" in "".join(lines)
    assert "## Validation at sea: " in text


def test_a_folder_without_results_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match="Fix: run make proof"):
        main(tmp_path)
