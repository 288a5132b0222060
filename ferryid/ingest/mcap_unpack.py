"""Decompression of MCAP chunks, piece by piece and within bounds.

A chunk is decompressed only up to the size that it states, and not at all where that is more than `MAX_CHUNK` or, beyond
`MAX_DENSE_CHUNK`, more than `MAX_RATIO` times its size in the file. At most 128 MiB of chunks are held at a time, or one
chunk that is larger.
"""

from __future__ import annotations

import threading
from typing import Any

import lz4.frame
import numpy as np
import zstandard

from ferryid.counts import counted
from ferryid.ingest.mcap_index import Bytes, Chunk, DamagedRecord

MAX_CHUNK = 256 << 20
"""A compressed chunk that states more bytes than this is not read. Recorders write chunks of 1 to 8 MiB, and none larger
than this unless a single message is; an uncompressed chunk needs no memory and has no limit."""
MAX_DENSE_CHUNK = 64 << 20
MAX_RATIO = 256
"""A chunk that states more than `MAX_DENSE_CHUNK` bytes may be compressed up to this ratio."""
MAX_EXPANDED = 512 << 20
"""All chunks of a file may state this many bytes and `MAX_RATIO` times the file's size together."""
_thread = threading.local()


class Unpacker:
    """Decompresses a chunk from its beginning, as far as it is asked, into `room` if that is given."""

    def __init__(self, file: memoryview, chunk: Chunk, room: Bytes | None = None) -> None:
        if chunk.compression not in ("zstd", "lz4"):
            raise DamagedRecord(f"a chunk has the unknown compression {chunk.compression!r}")
        size = chunk.uncompressed_size
        if size > MAX_CHUNK or (size > MAX_DENSE_CHUNK and size > MAX_RATIO * chunk.compressed_size):
            raise DamagedRecord(
                f"a chunk states {counted(size, 'byte')} when decompressed, from {chunk.compressed_size}: more than are read"
            )
        if chunk.refused:
            raise DamagedRecord(f"the chunks of the file state more than {MAX_RATIO} times its size when decompressed")
        self._source = file[chunk.data_offset : chunk.data_offset + chunk.compressed_size]
        self._size = chunk.uncompressed_size
        self._room = room
        self._have = 0
        self._taken = 0
        self._zstd: Any = None
        self._lz4: Any = None
        if chunk.compression == "zstd":
            # A stream reader that is given room for the whole frame decompresses straight into it.
            if not hasattr(_thread, "zstd"):
                _thread.zstd = zstandard.ZstdDecompressor()
            self._zstd = _thread.zstd.stream_reader(self._source, read_across_frames=True)
        else:
            self._lz4 = lz4.frame.create_decompression_context()

    def upto(self, size: int) -> Bytes:
        """Return the first `size` bytes, fewer only where the compressed data end before.

        Raises
        ------
        DamagedRecord
            For data that cannot be decompressed.
        """
        size = min(size, self._size)
        try:
            if self._room is None and self._lz4 is not None and self._have == 0 and size == self._size:
                # The whole chunk in the memory that lz4 allocates: no copy.
                piece, self._taken, _ = lz4.frame.decompress_chunk(self._lz4, self._source, max_length=size)
                self._room = np.frombuffer(piece, np.uint8)
                self._have = len(piece)
            if self._room is None:
                self._room = np.empty(self._size, np.uint8)
            while self._have < size:
                got = self._more(self._room, size)
                if not got:
                    break
                self._have += got
        except (zstandard.ZstdError, RuntimeError, ValueError, MemoryError, EOFError) as error:
            raise DamagedRecord("a chunk cannot be decompressed") from error
        return self._room[: min(size, self._have)]

    def has_more(self) -> bool:
        """Tell whether anything is left behind the size that the chunk states, after all of that was read."""
        rest = np.empty(1, np.uint8)
        try:
            if self._zstd is not None:
                return int(self._zstd.readinto(rest.data)) > 0
            if self._taken >= len(self._source):
                return False
            piece, _, _ = lz4.frame.decompress_chunk(self._lz4, self._source[self._taken :], max_length=1)
            return len(piece) > 0
        except (zstandard.ZstdError, RuntimeError, ValueError, EOFError):
            return True

    def _more(self, room: Bytes, size: int) -> int:
        if self._zstd is not None:
            return int(self._zstd.readinto(room[self._have : size].data))
        if self._taken >= len(self._source):
            return 0
        piece, taken, _ = lz4.frame.decompress_chunk(
            self._lz4, self._source[self._taken :], max_length=size - self._have
        )
        self._taken += taken
        room[self._have : self._have + len(piece)] = np.frombuffer(piece, np.uint8)
        return len(piece)
