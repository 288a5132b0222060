"""Content hash of a recording: the same bytes give the same hash, wherever and whenever they are read."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from pathlib import Path

from ferryid.errors import FerryIdError

SAMPLED = "sampled-sha256:"
# Hashing more than this would take longer than reading what is wanted of it.
SAMPLED_ABOVE_BYTES = 1 << 30
END_BYTES = 4 << 20
BLOCK_BYTES = 1 << 20
BLOCKS = 64
# One call of this size lets other threads run for milliseconds.
PIECE_BYTES = 8 << 20


def content_hash(paths: Sequence[str | Path], *, verify: bool = False) -> str:
    """Hash the files of a recording.

    Parameters
    ----------
    paths
        Files and folders; all files below a folder count, in sorted order.
    verify
        Hash every byte of a file of more than 1 GiB too.

    Returns
    -------
    str
        SHA-256 in hexadecimal: of the bytes of a single file, as ``sha256sum`` gives it; of the sorted list of
        relative names and hashes for several. It begins with ``sampled-sha256:`` where a file of more than 1 GiB is
        represented by its size, its time of change, its ends and 64 blocks in between.

    Raises
    ------
    FerryIdError
        For a file that cannot be read.
    """
    files = [(path, name) for path, name in _named(paths)]
    digests = []
    for path, name in files:
        try:
            digests.append((name, *_file_hash(path, verify)))
        except OSError as error:
            raise FerryIdError(
                f"{path}: cannot be read for its content hash, {error.strerror or error}. Fix: check its permissions"
            ) from error
    if len(digests) == 1 and not Path(paths[0]).is_dir():
        digest, sampled = digests[0][1:]
    else:
        total = hashlib.sha256()
        for name, part, _ in sorted(digests):
            # Lengths first, so that no two lists of names and hashes run into the same bytes.
            total.update(f"{len(name.encode())}:{name}{part}".encode())
        digest, sampled = total.hexdigest(), any(entry[2] for entry in digests)
    return SAMPLED + digest if sampled else digest


def _named(paths: Sequence[str | Path]) -> list[tuple[Path, str]]:
    """List all files with the name by which each enters the hash: relative to what it was found in."""
    named: list[tuple[Path, str]] = []
    for path in map(Path, paths):
        if path.is_dir():
            below = sorted(file for file in path.rglob("*") if file.is_file())
            named += [(file, file.relative_to(path).as_posix()) for file in below]
        else:
            named.append((path, path.name))
    return named


def _file_hash(path: Path, verify: bool) -> tuple[str, bool]:
    """Return the hash of one file, and whether it is a sampled one."""
    digest = hashlib.sha256()
    with path.open("rb", buffering=0) as file:
        state = os.fstat(file.fileno())
        if state.st_size <= SAMPLED_ABOVE_BYTES or verify:
            buffer = bytearray(PIECE_BYTES)
            view = memoryview(buffer)
            while count := file.readinto(buffer):
                digest.update(view[:count])
            return digest.hexdigest(), False
        digest.update(f"{state.st_size} {state.st_mtime_ns}\n".encode())
        step = (state.st_size - BLOCK_BYTES) // (BLOCKS - 1)
        pieces = [(0, END_BYTES), *((i * step, BLOCK_BYTES) for i in range(BLOCKS))]
        for start, size in [*pieces, (state.st_size - END_BYTES, END_BYTES)]:
            digest.update(os.pread(file.fileno(), size, start))
    return digest.hexdigest(), True
