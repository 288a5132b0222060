"""Compressed recordings: whole files unpacked beside everything, and single messages."""

from __future__ import annotations

import shutil
import weakref
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import lz4.frame
import numpy as np
import zstandard
from numpy.typing import NDArray

from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.files import remove_scratch, scratch_folder
from ferryid.ingest.log import Loss

PIECE_BYTES = {"zstd": 1 << 11, "lz4": 1 << 16}
"""What is unpacked at once: 4 bytes of zstd may hold 128 KiB, 1 byte of lz4 255, so a piece gives 64 MiB at most."""
BUFFER_BYTES = 1 << 20
MAX_WINDOW_BYTES = 1 << 27
"""Memory that a zstd frame may ask for to be unpacked, as much as the zstd program allows."""
MAX_RATIO = 1000
"""Times its size that a compressed file may unpack to; recordings reach a tenth of this."""
ALLOWED_BYTES = 256 << 20
"""What any file may unpack to, however small it is."""
RESERVED_BYTES = 64 << 20
"""Free space that is left on the disk of the temporary folder."""
MAX_MESSAGE_BYTES = 256 << 20
"""What one message may unpack to."""
BATCH_BYTES = 64 << 20
"""Unpacked messages that are gathered before they are decoded."""
# Compression formats of rosbag2's plug-ins, and the ending that each adds to a file's name.
FORMATS = {"zstd": ".zstd", "lz4": ".lz4"}
MAGIC = {b"\x28\xb5\x2f\xfd": "zstd", b"\x04\x22\x4d\x18": "lz4"}
FAULTS: tuple[type[Exception], ...] = (zstandard.ZstdError, RuntimeError, EOFError, MemoryError)


def codec_of(head: bytes) -> str | None:
    """Return the compression of a file that begins with these bytes, None where it is neither zstd nor lz4.

    Both formats have skippable frames, which parallel compressors write first; they are passed over.
    """
    while len(head) >= 8 and head[1:4] == b"\x2a\x4d\x18" and head[0] >> 4 == 5:
        head = head[8 + int.from_bytes(head[4:8], "little") :]
    return MAGIC.get(head[:4])


def _streams(codec: str) -> Callable[[], Any]:
    """Return a function that makes an object which unpacks one frame piece by piece."""
    if codec == "zstd":
        return zstandard.ZstdDecompressor(max_window_size=MAX_WINDOW_BYTES).decompressobj
    return lz4.frame.LZ4FrameDecompressor  # type: ignore[no-any-return]


def _content_bytes(codec: str, data: bytes) -> int:
    """Return the size that the first frame states for its content [bytes], 0 where it states none."""
    try:
        if codec == "zstd":
            size = zstandard.get_frame_parameters(data).content_size
            return 0 if size in (zstandard.CONTENTSIZE_UNKNOWN, zstandard.CONTENTSIZE_ERROR) else size
        return int(lz4.frame.get_frame_info(data)["content_size"])
    except FAULTS:
        return 0


def message_unpacker(codec: str) -> Callable[[bytes], bytes | None]:
    """Return a function that unpacks one message, to None when it is corrupt or larger than MAX_MESSAGE_BYTES.

    Parameters
    ----------
    codec
        One of FORMATS.
    """
    new_stream, piece = _streams(codec), PIECE_BYTES[codec]

    def unpack(data: bytes) -> bytes | None:
        stream = new_stream()
        parts: list[bytes] = []
        size = 0
        try:
            if _content_bytes(codec, data) > MAX_MESSAGE_BYTES:
                return None
            for start in range(0, len(data), piece):
                parts.append(stream.decompress(data[start : start + piece]))
                size += len(parts[-1])
                if size > MAX_MESSAGE_BYTES:
                    return None
                if stream.eof:
                    return b"".join(parts)
        except FAULTS:
            return None
        return None

    return unpack


def unpacked_batches(
    unpack: Callable[[bytes], bytes | None], messages: Iterable[bytes | None]
) -> Iterator[tuple[bytes, NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]]:
    """Unpack messages a few at a time, so that those of a small file do not fill the memory together.

    Parameters
    ----------
    unpack
        What `message_unpacker` returns.
    messages
        Compressed messages, None for one that could not be read.

    Yields
    ------
    tuple
        A buffer of messages, their starts and sizes in it [bytes] and their numbers, counted from 0 and without those
        that cannot be unpacked.
    """
    parts: list[bytes] = []
    numbers: list[int] = []
    size = 0

    def batch() -> tuple[bytes, NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        sizes = np.array([len(part) for part in parts], np.int64)
        return b"".join(parts), np.cumsum(sizes) - sizes, sizes, np.array(numbers, np.int64)

    for number, data in enumerate(messages):
        message = None if data is None else unpack(data)
        if message is None:
            continue
        parts.append(message)
        numbers.append(number)
        size += len(message)
        if size >= BATCH_BYTES:
            yield batch()
            parts, numbers, size = [], [], 0
    if parts:
        yield batch()


def working_folder(owner: object) -> Path:
    """Make a temporary folder that is removed together with its owner."""
    folder = scratch_folder()
    weakref.finalize(owner, remove_scratch, folder)
    return folder


def unpack_file(path: Path, folder: Path) -> tuple[Path, tuple[Loss, ...]]:
    """Unpack a compressed file into a folder, in bounded memory.

    Parameters
    ----------
    path
        A file that is one or more zstd or lz4 frames, whatever its name.
    folder
        Where to write; the name loses its last ending.

    Returns
    -------
    tuple
        The unpacked file, which is shorter when the compressed one is damaged, and what was lost by that.

    Raises
    ------
    FerryIdError
        The file is not compressed as its name says, nothing of it can be unpacked, or it unpacks to more than
        MAX_RATIO times its size or than fits on the disk. Nothing is left in the folder.
    """
    target = folder / path.stem
    try:
        losses = _unpack(path, target)
        if losses and target.stat().st_size == 0:
            raise FerryIdError(
                f"{path}: nothing can be unpacked from the compressed file, found that it {losses[0].what}. "
                "Fix: copy it from the recorder again"
            )
    except OSError as error:
        target.unlink(missing_ok=True)
        raise FerryIdError(
            f"{path}: the compressed file cannot be unpacked into {folder}, {error.strerror or error}. "
            "Fix: check its permissions, and free space there or set TMPDIR to a folder on a larger disk"
        ) from error
    except BaseException:
        target.unlink(missing_ok=True)
        raise
    return target, losses


def _unpack(path: Path, target: Path) -> tuple[Loss, ...]:
    allowed = max(ALLOWED_BYTES, MAX_RATIO * path.stat().st_size)
    with path.open("rb") as source, target.open("wb", BUFFER_BYTES) as out:
        head = source.peek(64)
        codec = codec_of(head)
        if codec is None:
            raise FerryIdError(
                f"{path}: neither a zstd nor an lz4 file, found one that begins with {head[:4]!r}. "
                "Fix: copy it from the recorder again"
            )
        _check_size(path, target, _content_bytes(codec, head), allowed)
        new_stream, piece = _streams(codec), PIECE_BYTES[codec]
        # `done` bytes of the file have been unpacked to `written`; the space on the disk is asked for at `checked`.
        done = written = checked = 0
        stream, data = new_stream(), source.read(piece)
        try:
            while data:
                unpacked = stream.decompress(data)
                written += len(unpacked)
                if written > checked:
                    checked = written + BUFFER_BYTES
                    _check_size(path, target, written, allowed, len(unpacked))
                out.write(unpacked)
                done += len(data)
                # A file may hold several frames; what follows the end of one begins the next.
                data = (stream.unused_data or b"") if stream.eof else b""
                done -= len(data)
                if stream.eof and (data or source.peek(1)):
                    stream = new_stream()
                data = data or source.read(piece)
        except FAULTS as error:
            return (Loss(str(path), f"cannot be unpacked from byte {done} on ({error}): the rest is lost"),)
    if not stream.eof:
        return (Loss(str(path), f"the compressed file is cut off after {counted(done, 'byte')}: the rest is lost"),)
    return ()


def _check_size(path: Path, target: Path, size: int, allowed: int, unwritten: int | None = None) -> None:
    """Refuse to unpack `size` bytes where they are too many; `unwritten` of them, by default all, need space on the disk."""
    if size > allowed:
        raise FerryIdError(
            f"{path}: the compressed file is not unpacked, found that it holds {counted(size, 'byte')} or more, "
            f"at most {allowed} are taken from a file of this size. "
            "Fix: check that it is a recording, and unpack it by hand if it is"
        )
    free = shutil.disk_usage(target.parent).free - RESERVED_BYTES
    if (size if unwritten is None else unwritten) > free:
        raise FerryIdError(
            f"{path}: the compressed file cannot be unpacked, {counted(size, 'byte')} or more do not fit into {target.parent}. "
            "Fix: free space there, or set TMPDIR to a folder on a larger disk"
        )
