"""Content hash: known answers, what must change it, and what must not."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import pytest

from ferryid.errors import FerryIdError
from ferryid.ingest import hashing
from ferryid.ingest.hashing import content_hash


def test_one_file_has_the_published_sha256(tmp_path: Path) -> None:
    """FIPS 180-4's example message "abc"."""
    file = tmp_path / "log.mcap"
    file.write_bytes(b"abc")
    assert content_hash([file]) == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"


def test_a_file_longer_than_one_piece_is_hashed_whole(tmp_path: Path) -> None:
    data = os.urandom(hashing.PIECE_BYTES + 12345)
    file = tmp_path / "log.mcap"
    file.write_bytes(data)
    assert content_hash([str(file)]) == hashlib.sha256(data).hexdigest()


def test_the_name_of_a_single_file_does_not_count(tmp_path: Path) -> None:
    for name in ("a.bag", "b.bag"):
        (tmp_path / name).write_bytes(b"same")
    assert content_hash([tmp_path / "a.bag"]) == content_hash([tmp_path / "b.bag"])


def folder(where: Path, files: dict[str, bytes]) -> Path:
    for name, data in files.items():
        (where / name).parent.mkdir(parents=True, exist_ok=True)
        (where / name).write_bytes(data)
    return where


def test_a_folder_hashes_names_and_contents_wherever_it_lies(tmp_path: Path) -> None:
    files = {"b/state.csv": b"1", "a.csv": b"2"}
    first = content_hash([folder(tmp_path / "one", files)])
    assert first == content_hash([folder(tmp_path / "two", dict(reversed(files.items())))])
    assert first != content_hash([folder(tmp_path / "renamed", {"b/other.csv": b"1", "a.csv": b"2"})])
    assert first != content_hash([folder(tmp_path / "swapped", {"b/state.csv": b"2", "a.csv": b"1"})])


def test_the_order_of_parts_does_not_count(tmp_path: Path) -> None:
    folder(tmp_path, {"log_0.bag": b"first", "log_1.bag": b"second"})
    parts = [tmp_path / "log_0.bag", tmp_path / "log_1.bag"]
    assert content_hash(parts) == content_hash(parts[::-1])
    assert content_hash(parts) != content_hash(parts[:1])


def test_a_folder_of_one_file_is_not_that_file(tmp_path: Path) -> None:
    where = folder(tmp_path / "bag", {"log_0.db3": b"x"})
    assert content_hash([where]) != content_hash([where / "log_0.db3"])


@pytest.fixture
def large(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file above the limit for hashing whole, with all sizes a thousandth of the real ones."""
    monkeypatch.setattr(hashing, "SAMPLED_ABOVE_BYTES", 1 << 20)
    monkeypatch.setattr(hashing, "END_BYTES", 4 << 10)
    monkeypatch.setattr(hashing, "BLOCK_BYTES", 1 << 10)
    file = tmp_path / "camera.mcap"
    file.write_bytes(bytes(3 << 20))
    os.utime(file, ns=(0, 10**18))
    return file


def test_a_large_file_is_sampled_and_says_so(large: Path) -> None:
    sampled = content_hash([large])
    assert sampled.startswith("sampled-sha256:")
    assert content_hash([large], verify=True) == hashlib.sha256(bytes(3 << 20)).hexdigest()
    assert content_hash([large.parent]).startswith("sampled-sha256:")
    os.utime(large, ns=(0, 10**18 + 1))
    assert content_hash([large]) != sampled


@pytest.mark.parametrize("at", [0, 4095, (3 << 20) - 4096, (3 << 20) - 1, ((3 << 20) - 1024) // 63 * 31])
def test_a_change_at_an_end_or_in_a_block_is_seen_in_a_sampled_file(large: Path, at: int) -> None:
    before = content_hash([large])
    with large.open("r+b") as file:
        file.seek(at)
        file.write(b"\x01")
    os.utime(large, ns=(0, 10**18))
    assert content_hash([large]) != before


def test_a_missing_file_is_said_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(FerryIdError, match=r"gone\.bag: cannot be read .* No such file.* Fix: ") as caught:
        content_hash([tmp_path / "gone.bag"])
    assert "\n" not in str(caught.value)
