"""Messages that a recorder compressed one by one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.ingest.bulk import Decoder
from ferryid.ingest.log import Loss, Series
from ferryid.ingest.unpack import unpacked_batches
from ferryid.types import Nanoseconds

# All messages of a topic together may unpack to this many times their size; constant pictures reach a thousand.
MAX_RATIO = 4000
FREE_BYTES = 256 << 20


class UnpackingDecoder:
    """Decoder of messages that are compressed one by one.

    Parameters
    ----------
    decoder
        Takes the unpacked messages.
    unpack
        What `message_unpacker` returns. The topics of a file share it: its memory would count for each of them.
    """

    def __init__(self, decoder: Decoder, unpack: Callable[[bytes], bytes | None]) -> None:
        self._decoder = decoder
        self._unpack = unpack
        self._lost = 0
        self._left = FREE_BYTES

    def add(self, buffer: Any, starts: NDArray[np.int64], sizes: NDArray[np.int64], receive_ns: Nanoseconds) -> None:
        """Take the compressed messages that lie in `buffer` at `starts` with `sizes` [bytes]."""
        view = memoryview(buffer)
        messages = (
            bytes(view[start : start + size]) for start, size in zip(starts.tolist(), sizes.tolist(), strict=True)
        )
        self._lost += len(starts)
        for batch, places, lengths, numbers in unpacked_batches(self._bounded, messages):
            self._decoder.add(batch, places, lengths, receive_ns[numbers])
            self._lost -= len(numbers)

    def _bounded(self, data: bytes) -> bytes | None:
        """Unpack a message as long as all together have not grown beyond what they may."""
        self._left += MAX_RATIO * len(data)
        message = self._unpack(data) if self._left > 0 else None
        self._left -= len(message or b"")
        return message

    def finish(self) -> Series:
        """Return the columns of every message that could be unpacked and decoded."""
        return self._decoder.finish()

    def losses(self, file: str) -> tuple[Loss, ...]:
        """Return what could not be unpacked or decoded."""
        lost = (Loss(file, "messages that cannot be unpacked", messages=self._lost),) if self._lost else ()
        return (*lost, *self._decoder.losses(file))
