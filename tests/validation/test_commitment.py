"""The commitment: published before the answers, which anybody can then hash again."""

from __future__ import annotations

import json
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest

from ferryid.errors import FerryIdError
from ferryid.validation.commitment import canonical, commitment, publish_answers, publish_commitment, verified_answers

ANSWERS: dict[str, Any] = {
    "cases": [{"name": "0000", "effect": "fouling", "north": -3.25}],
    "ä": [1e-300, 0.1, True, None],
}
SALT = "ab" * 32
REPORTS = Path(__file__).resolve().parents[2] / "reports" / "proof"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    publish_commitment(tmp_path, ANSWERS, SALT, "abc")
    return tmp_path


def test_one_form_for_the_same_data() -> None:
    assert canonical({"b": 1, "a": [1.5, "ä"]}) == '{"a":[1.5,"ä"],"b":1}'.encode()


def test_anyone_can_verify_the_published_hash(folder: Path) -> None:
    public = json.loads((folder / "seal.json").read_text("utf-8"))
    assert {name: public[name] for name in ("schema", "cases", "sources")} == {
        "schema": "ferryid.seal/1",
        "cases": 1,
        "sources": "abc",
    }
    assert SALT not in (folder / "seal.json").read_text("utf-8")
    assert not (folder / "answers.json").exists()
    publish_answers(folder, ANSWERS, SALT)
    assert verified_answers(folder) == ANSWERS
    # By another implementation than ours.
    published = json.loads((folder / "answers.json").read_text("utf-8"))
    text = json.dumps(published["answers"], sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    assert sha256(f"{published['salt']}\n{text}".encode()).hexdigest() == public["commitment"]


def test_the_salt_keeps_answers_from_being_guessed_by_their_hash() -> None:
    assert commitment(ANSWERS, SALT) != commitment(ANSWERS, "cd" * 32)


def test_other_answers_than_the_committed_ones_are_not_published(folder: Path) -> None:
    other = {**ANSWERS, "cases": [{"name": "0000", "effect": "wind"}]}
    with pytest.raises(FerryIdError, match="does not match its commitment"):
        publish_answers(folder, other, SALT)
    with pytest.raises(FerryIdError, match="does not match its commitment"):
        publish_answers(folder, ANSWERS, "cd" * 32)
    assert not (folder / "answers.json").exists()


def test_a_changed_answer_is_noticed(folder: Path) -> None:
    publish_answers(folder, ANSWERS, SALT)
    path = folder / "answers.json"
    path.write_text(path.read_text("utf-8").replace("-3.25", "-3.5"), encoding="utf-8")
    with pytest.raises(FerryIdError, match=r"answers\.json: does not match its commitment: .* Fix: "):
        verified_answers(folder)
    path.write_text("{", encoding="utf-8")
    with pytest.raises(FerryIdError, match=r"answers\.json: not readable as a JSON object.* Fix: "):
        verified_answers(folder)
    path.write_text('{"answers": {}}', encoding="utf-8")
    with pytest.raises(FerryIdError, match=r"answers\.json: holds no answers\. Fix: "):
        verified_answers(folder)
    path.unlink()
    with pytest.raises(FerryIdError, match=r"answers\.json: not found; answers are published once .* Fix: "):
        verified_answers(folder)


def test_the_published_evidence_matches_its_commitment() -> None:
    assert len(verified_answers(REPORTS)["cases"]) == json.loads((REPORTS / "seal.json").read_text("utf-8"))["cases"]
