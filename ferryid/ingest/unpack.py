"""Compressed recordings: whole files unpacked beside everything, and single messages."""

from __future__ import annotations

import shutil
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Any

import lz4.frame
import zstandard

from ferryid.errors import FerryIdError
from ferryid.files import scratch_folder
from ferryid.ingest.log import Loss

PIECE_BYTES = 1 << 20
# Compression formats of rosbag2's plug-ins, and the ending that each adds to a file's name.
FORMATS = {"zstd": ".zstd", "lz4": ".lz4"}
MAGIC = {b"\x28\xb5\x2f\xfd": "zstd", b"\x04\x22\x4d\x18": "lz4"}
FAULTS: tuple[type[Exception], ...] = (zstandard.ZstdError, RuntimeError, EOFError)


def _stream(codec: str) -> Any:
    """Return an object that unpacks one frame piece by piece."""
    return zstandard.ZstdDecompressor().decompressobj() if codec == "zstd" else lz4.frame.LZ4FrameDecompressor()


def message_unpacker(codec: str) -> Callable[[bytes], bytes | None]:
    """Return a function that unpacks one message, to None when it is corrupt.

    Parameters
    ----------
    codec
        One of FORMATS.
    """

    def unpack(data: bytes) -> bytes | None:
        stream = _stream(codec)
        try:
            message: bytes = stream.decompress(data)
        except FAULTS:
            return None
        return message if stream.eof else None

    return unpack


def working_folder(owner: object) -> Path:
    """Make a temporary folder that is removed together with its owner."""
    folder = scratch_folder()
    weakref.finalize(owner, shutil.rmtree, folder, ignore_errors=True)
    return folder


def unpack_file(path: Path, folder: Path) -> tuple[Path, tuple[Loss, ...]]:
    """Unpack a compressed file into a folder.

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
        The file is not compressed as its name says.
    """
    target = folder / path.stem
    with path.open("rb") as source, target.open("wb") as out:
        data = source.read(PIECE_BYTES)
        codec = MAGIC.get(data[:4])
        if codec is None:
            raise FerryIdError(
                f"{path}: neither a zstd nor an lz4 file, found one that begins with {data[:4]!r}. "
                "Fix: copy it from the recorder again"
            )
        stream, done = _stream(codec), 0
        try:
            while data:
                out.write(stream.decompress(data))
                done += len(data)
                # A file may hold several frames; what follows the end of one begins the next.
                data = (stream.unused_data or b"") if stream.eof else b""
                done -= len(data)
                if stream.eof and (data or source.peek(1)):
                    stream = _stream(codec)
                data = data or source.read(PIECE_BYTES)
        except FAULTS as error:
            return target, (Loss(str(path), f"cannot be unpacked from byte {done} on ({error}): the rest is lost"),)
    if not stream.eof:
        return target, (Loss(str(path), f"the compressed file is cut off after {done} bytes: the rest is lost"),)
    return target, ()
