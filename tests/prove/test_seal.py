"""Answers are bound by a hash and kept from readers; whatever was changed is refused."""

from __future__ import annotations

import json
from hashlib import sha256
from pathlib import Path

import pytest

from ferryid.errors import FerryIdError
from ferryid.prove import seal as sealing
from ferryid.prove.seal import canonical, key_of, lay_open, open_seal, opened, seal, sealed, verified

ANSWERS = {"seed": 5, "cases": [{"name": "0001", "effect": "fouling", "north": -3.25, "onset": None, "ä": [1, 2.0]}]}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A sealed folder, of seed 5."""
    key = key_of(5)
    (tmp_path / "salt").write_bytes(key.salt)
    seal(tmp_path, ANSWERS, key, "abc")
    return tmp_path


def key_in(folder: Path, seed: int = 5) -> sealing.Key:
    return key_of(seed, (folder / "salt").read_bytes())


def test_what_is_sealed_is_opened_with_the_same_seed_only() -> None:
    key = key_of(12)
    for answers in (ANSWERS, [], "", None, {"long": "x" * 100_000}):
        assert opened(sealed(answers, key), key, "here") == answers
    assert key_of(12, key.salt) == key
    assert key_of(12) != key
    for other in (key_of(13, key.salt), key_of(12)):
        with pytest.raises(FerryIdError, match=r"^here: cannot be opened, .* Fix: "):
            opened(sealed(ANSWERS, key), other, "here")


def test_nothing_of_the_answers_can_be_seen() -> None:
    key = key_of(12)
    one, two = sealed(ANSWERS, key), sealed(ANSWERS, key)
    assert one != two
    for data in (one, two):
        assert b"fouling" not in data
        assert b"name" not in data
    # Two texts under one stream would give each other away.
    text = canonical(ANSWERS)
    streams = [bytes(a ^ b for a, b in zip(data[16:-32], text, strict=True)) for data in (one, two)]
    assert streams[0] != streams[1]
    assert "secret" not in repr(key)


def test_every_bit_counts() -> None:
    key = key_of(12)
    data = sealed({"a": 1}, key)
    for place in range(len(data)):
        changed = bytearray(data)
        changed[place] ^= 1
        with pytest.raises(FerryIdError):
            opened(bytes(changed), key, "here")
    for length in (0, 10, len(data) - 1):
        with pytest.raises(FerryIdError):
            opened(data[:length], key, "here")


def test_anyone_can_verify_the_published_hash(folder: Path) -> None:
    public = json.loads((folder / "seal.json").read_text("utf-8"))
    assert {name: public[name] for name in ("schema", "cases", "sources")} == {
        "schema": "ferryid.seal/1",
        "cases": 1,
        "sources": "abc",
    }
    assert "salt" not in public
    assert not (folder / "answers.json").exists()
    assert lay_open(folder, key_in(folder)) == ANSWERS
    assert verified(folder) == ANSWERS
    # In other words than ours.
    laid = json.loads((folder / "answers.json").read_text("utf-8"))
    text = json.dumps(laid["answers"], sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    assert sha256(f"{laid['salt']}\n{text}".encode()).hexdigest() == public["commitment"]


def test_the_hash_alone_does_not_let_answers_be_guessed(tmp_path: Path) -> None:
    bound = {seal(tmp_path / name, ANSWERS, key_of(5), "abc") for name in ("a", "b")}
    assert len(bound) == 2, "without a salt of its own, the hash of a guess would tell"


@pytest.mark.parametrize("name", ["answers.sealed", "seal.json"])
def test_opening_refuses_what_was_changed(folder: Path, name: str) -> None:
    path = folder / name
    data = bytearray(path.read_bytes())
    if name == "seal.json":
        public = json.loads(data)
        public["commitment"] = sealing.commitment(ANSWERS, "another salt")
        path.write_text(json.dumps(public), encoding="utf-8")
    else:
        data[40] ^= 1
        path.write_bytes(data)
    with pytest.raises(FerryIdError, match="Fix: ") as told:
        lay_open(folder, key_in(folder))
    assert name in str(told.value) or "seal.json" in str(told.value)
    assert not (folder / "answers.json").exists()


def test_opening_refuses_other_answers_sealed_with_the_right_seed(folder: Path) -> None:
    key = key_in(folder)
    content = opened((folder / "answers.sealed").read_bytes(), key, "here")
    content["answers"]["cases"][0]["north"] = -3.0
    (folder / "answers.sealed").write_bytes(sealed(content, key))
    with pytest.raises(FerryIdError, match="is not what was sealed"):
        open_seal(folder, key)


def test_a_changed_answer_is_seen_by_anyone(folder: Path) -> None:
    lay_open(folder, key_in(folder))
    path = folder / "answers.json"
    path.write_text(path.read_text("utf-8").replace("-3.25", "-3.5"), encoding="utf-8")
    with pytest.raises(FerryIdError, match="is not what was sealed"):
        verified(folder)
    path.write_text("{", encoding="utf-8")
    with pytest.raises(FerryIdError, match=r"answers\.json: cannot be read"):
        verified(folder)
    (folder / "answers.sealed").unlink()
    with pytest.raises(FerryIdError, match=r"answers\.sealed: cannot be read"):
        open_seal(folder, key_in(folder))
