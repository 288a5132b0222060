"""Compressed files and messages: unpacked in bounded memory and space, whatever they claim."""

from __future__ import annotations

import shutil
import struct
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import lz4.frame
import numpy as np
import pytest
import zstandard

from ferryid.errors import FerryIdError
from ferryid.ingest import open_log, unpack
from ferryid.ingest.unpack import message_unpacker, unpack_file, unpacked_batches

CODECS: dict[str, Callable[[bytes], bytes]] = {
    "zstd": zstandard.ZstdCompressor().compress,
    "lz4": lz4.frame.compress,
}
DATA = np.random.default_rng(1).bytes(300_000)
SKIPPABLE = struct.pack("<II", 0x184D2A53, 5) + b"hello"

every_codec = pytest.mark.parametrize("codec", CODECS)


def packed(folder: Path, content: bytes) -> Path:
    path = folder / "log.bin.zst"
    path.write_bytes(content)
    return path


def unpacked(folder: Path, content: bytes) -> bytes:
    path, losses = unpack_file(packed(folder, content), folder)
    assert losses == ()
    return path.read_bytes()


def without_size(content: bytes) -> bytes:
    """A zstd frame that does not state how much it holds."""
    stream = zstandard.ZstdCompressor(level=1).compressobj()
    return stream.compress(content) + stream.flush()


@every_codec
def test_frames_of_every_kind_are_joined(tmp_path: Path, codec: str) -> None:
    frame, empty = CODECS[codec](DATA), CODECS[codec](b"")
    assert unpacked(tmp_path, SKIPPABLE + frame + empty * 500 + SKIPPABLE + frame) == DATA + DATA


@every_codec
def test_a_bomb_is_refused_and_leaves_nothing(tmp_path: Path, codec: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(unpack, "ALLOWED_BYTES", 1 << 20)
    monkeypatch.setattr(unpack, "MAX_RATIO", 20)
    zeros = bytes(8 << 20)
    for content in (CODECS[codec](zeros), without_size(zeros), CODECS[codec](b"a" * (200 << 10)) * 40):
        path = packed(tmp_path, content)
        with pytest.raises(FerryIdError, match=r"log\.bin\.zst: .*it holds \d+ bytes or more.* Fix: "):
            unpack_file(path, tmp_path)
        assert list(tmp_path.iterdir()) == [path]


@pytest.mark.slow
def test_zeros_are_unpacked_in_small_pieces() -> None:
    packed_zeros = zstandard.ZstdCompressor().compress(bytes(64 << 20))
    stream = unpack._streams("zstd")()
    piece = unpack.PIECE_BYTES["zstd"]
    sizes = [len(stream.decompress(packed_zeros[i : i + piece])) for i in range(0, len(packed_zeros), piece)]
    assert sum(sizes) == 64 << 20
    assert piece // 4 * (128 << 10) <= 64 << 20


class Usage(NamedTuple):
    total: int
    used: int
    free: int


def test_a_file_that_does_not_fit_on_the_disk_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(1 << 30, 0, unpack.RESERVED_BYTES + 1000))
    for content in (CODECS["zstd"](DATA), without_size(DATA)):
        path = packed(tmp_path, content)
        with pytest.raises(FerryIdError, match=r"do not fit into .*Fix: free space"):
            unpack_file(path, tmp_path)
        assert list(tmp_path.iterdir()) == [path]


def test_a_full_disk_is_one_line(tmp_path: Path) -> None:
    path = packed(tmp_path, CODECS["zstd"](DATA))
    folder = tmp_path / "gone"
    with pytest.raises(FerryIdError, match=r"cannot be unpacked into .*gone, No such file.* Fix: "):
        unpack_file(path, folder)


def test_a_window_larger_than_that_of_the_zstd_program_is_refused(tmp_path: Path) -> None:
    parameters = zstandard.ZstdCompressionParameters(window_log=28)
    stream = zstandard.ZstdCompressor(compression_params=parameters).compressobj()
    path = packed(tmp_path, stream.compress(DATA) + stream.flush())
    with pytest.raises(FerryIdError, match=r"nothing can be unpacked .*too much memory.* Fix: "):
        unpack_file(path, tmp_path)


def test_a_frame_with_a_dictionary_is_refused(tmp_path: Path) -> None:
    samples = [bytes([k % 7, k % 11]) * 40 for k in range(500)]
    dictionary = zstandard.train_dictionary(2000, samples)
    path = packed(tmp_path, zstandard.ZstdCompressor(dict_data=dictionary).compress(DATA))
    with pytest.raises(FerryIdError, match=r"nothing can be unpacked .* Fix: "):
        unpack_file(path, tmp_path)
    assert list(tmp_path.iterdir()) == [path]


def test_a_compressed_file_in_a_compressed_file_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    path = tmp_path / "log.mcap.zst.zst"
    path.write_bytes(CODECS["zstd"](CODECS["zstd"](DATA)))
    with pytest.raises(FerryIdError, match=r"compressed file in a compressed file.* Fix: ") as caught:
        open_log(path)
    assert list(tmp_path.iterdir()) == [path]
    assert caught.value


def test_a_log_that_cannot_be_opened_leaves_no_temporary_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    path = tmp_path / "log.mcap.zst"
    path.write_bytes(CODECS["zstd"](b"no log at all"))
    with pytest.raises(FerryIdError) as caught:
        open_log(path)
    assert list(tmp_path.iterdir()) == [path]
    assert caught.value


@every_codec
def test_a_message_that_holds_too_much_is_corrupt(codec: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(unpack, "MAX_MESSAGE_BYTES", 1 << 20)
    unpacker = message_unpacker(codec)
    assert unpacker(CODECS[codec](bytes(1 << 20))) == bytes(1 << 20)
    assert unpacker(CODECS[codec](bytes((1 << 20) + 1))) is None
    if codec == "zstd":
        assert unpacker(without_size(bytes((1 << 20) + 1))) is None


def test_unpacked_messages_come_in_batches(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(unpack, "BATCH_BYTES", 1000)
    messages = [CODECS["zstd"](bytes([k]) * 400) for k in range(9)]
    compressed: list[bytes | None] = [*messages, None, b"damaged"]
    batches = list(unpacked_batches(message_unpacker("zstd"), compressed))
    assert [numbers.tolist() for *_, numbers in batches] == [[0, 1, 2], [3, 4, 5], [6, 7, 8]]
    for buffer, starts, sizes, numbers in batches:
        for start, size, number in zip(starts, sizes, numbers, strict=True):
            assert buffer[start : start + size] == bytes([number]) * 400
