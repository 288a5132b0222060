"""Which version of a model is current: the history beside the store, and the way back."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from ferryid.errors import FerryIdError
from ferryid.models.store.history import earlier_versions, make_current, read_history
from ferryid.models.store.listing import list_versions
from ferryid.models.store.versions import current_version, promote, roll_back, save
from ferryid.report.model_text import render_listing
from tests.models.test_store import made


def changed(folder: Path, *changes: tuple[int | None, int, str]) -> None:
    folder.mkdir(exist_ok=True)
    for before, version, action in changes:
        make_current(folder, before, version, action, "Told.")


def test_a_change_is_noted_with_its_reason_and_none_is_no_change(tmp_path: Path) -> None:
    changed(tmp_path, (None, 1, "fit"), (1, 1, "fit"))
    make_current(tmp_path, 1, 2, "promote", "Better.", logs=[{"name": "a", "sha256": "b"}], forced=True)
    first, second = read_history(tmp_path)
    assert (tmp_path / "current").read_text() == "2\n"
    assert (first.before, first.version, first.action, first.forced) == (None, 1, "fit", False)
    assert (second.before, second.version, second.logs, second.forced) == (1, 2, ({"name": "a", "sha256": "b"},), True)
    assert second.sentence.endswith("promote: @2 after @1, forced. Better.")


def test_the_way_back_takes_back_what_a_rollback_undid(tmp_path: Path) -> None:
    assert earlier_versions(tmp_path, 1) == []
    changed(tmp_path, (None, 1, "fit"), (1, 2, "fit"), (2, 3, "fit"))
    assert earlier_versions(tmp_path, 3) == [1, 2]
    changed(tmp_path, (3, 2, "rollback"))
    assert earlier_versions(tmp_path, 2) == [1]
    changed(tmp_path, (2, 1, "rollback"))
    assert earlier_versions(tmp_path, 1) == []


def test_a_change_without_its_line_leaves_the_way_back(tmp_path: Path) -> None:
    """A kill between the note and the history, and a store that an older ferryid made."""
    changed(tmp_path, (None, 1, "fit"), (1, 2, "fit"))
    (tmp_path / "current").write_text("3\n")
    assert earlier_versions(tmp_path, 3) == [1, 2]
    (tmp_path / "history.jsonl").unlink()
    changed(tmp_path, (3, 4, "fit"))
    assert earlier_versions(tmp_path, 4) == [3]


@pytest.mark.parametrize("line", ["", "{", "[]", "1", '{"time": "x"}', "\x00" * 40, '{"version": "1", "before": null}'])
def test_a_damaged_line_is_passed_over(tmp_path: Path, line: str) -> None:
    changed(tmp_path, (None, 1, "fit"))
    path = tmp_path / "history.jsonl"
    path.write_text(path.read_text() + line + "\n")
    changed(tmp_path, (1, 2, "fit"))
    assert [change.version for change in read_history(tmp_path)] == [1, 2]


def test_fits_promotions_and_rollbacks_of_a_store(tmp_path: Path) -> None:
    first, second = (save(made(seed=seed), tmp_path).model for seed in range(2))
    save(made(accepted=False, seed=2), tmp_path)
    assert current_version("boat", tmp_path) == 2
    assert roll_back("boat", tmp_path) == (2, 1)
    assert current_version("boat", tmp_path) == 1
    with pytest.raises(FerryIdError, match=r"boat: no version that was current before is known\. Fix: .*promote boat@"):
        roll_back("boat", tmp_path)
    promote(second, tmp_path, "Better.")
    assert roll_back("boat", tmp_path, 1) == (2, first.version)
    with pytest.raises(FerryIdError, match=r"boat@3: not among the versions that a rollback can return to: .* Fix: "):
        roll_back("boat", tmp_path, 3)
    listed = list_versions(tmp_path)
    assert [change["action"] for change in listed["history"]["boat"]] == [
        "fit",
        "fit",
        "rollback",
        "promote",
        "rollback",
    ]
    assert "promote: @2 after @1. Better." in render_listing(listed, tmp_path)


def test_no_way_back_to_a_damaged_version(tmp_path: Path) -> None:
    for seed in range(2):
        save(made(seed=seed), tmp_path)
    (tmp_path / "models" / "boat" / "1.json").write_text("{")
    with pytest.raises(FerryIdError, match="not readable as a model file"):
        roll_back("boat", tmp_path)
    assert current_version("boat", tmp_path) == 2
    with pytest.raises(FerryIdError, match="no model of that name"):
        roll_back("ship", tmp_path)


def test_the_same_fit_again_is_no_change(tmp_path: Path) -> None:
    model = made()
    save(model, tmp_path)
    save(replace(model, created="2027-01-01T00:00:00Z"), tmp_path)
    (line,) = (tmp_path / "models" / "boat" / "history.jsonl").read_text().splitlines()
    assert json.loads(line)["version"] == 1
