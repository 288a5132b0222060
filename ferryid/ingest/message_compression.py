"""Messages that a recorder compressed one by one."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.ingest.bulk import Decoder
from ferryid.ingest.log import Loss, Nanoseconds, Series
from ferryid.ingest.unpack import message_unpacker

# Unpacked messages are passed on in batches of about this size.
BATCH_BYTES = 16 << 20
# All messages of a topic together may unpack to this many times their size; constant pictures reach a thousand.
MAX_RATIO = 4000
FREE_BYTES = 256 << 20


class UnpackingDecoder:
    """Decoder of messages that are compressed one by one.

    Parameters
    ----------
    decoder
        Takes the unpacked messages.
    codec
        ``"zstd"`` or ``"lz4"``.
    """

    def __init__(self, decoder: Decoder, codec: str) -> None:
        self._decoder = decoder
        self._unpack = message_unpacker(codec)
        self._lost = 0
        self._left = FREE_BYTES

    def add(self, buffer: Any, starts: NDArray[np.int64], sizes: NDArray[np.int64], receive_ns: Nanoseconds) -> None:
        """Take the compressed messages that lie in `buffer` at `starts` with `sizes` [bytes]."""
        view = memoryview(buffer)
        messages: list[bytes] = []
        rows: list[int] = []
        held = 0
        for row, (start, size) in enumerate(zip(starts.tolist(), sizes.tolist(), strict=True)):
            self._left += MAX_RATIO * size
            message = self._unpack(bytes(view[start : start + size])) if self._left > 0 else None
            if message is None:
                self._lost += 1
                continue
            self._left -= len(message)
            messages.append(message)
            rows.append(row)
            held += len(message)
            if held >= BATCH_BYTES:
                self._pass_on(messages, receive_ns[rows])
                messages, rows, held = [], [], 0
        self._pass_on(messages, receive_ns[rows])

    def _pass_on(self, messages: list[bytes], receive_ns: Nanoseconds) -> None:
        lengths = np.array([len(message) for message in messages], np.int64)
        self._decoder.add(b"".join(messages), np.cumsum(lengths) - lengths, lengths, receive_ns)

    def finish(self) -> Series:
        """Return the columns of every message that could be unpacked and decoded."""
        return self._decoder.finish()

    def losses(self, file: str) -> tuple[Loss, ...]:
        """Return what could not be unpacked or decoded."""
        lost = (Loss(file, "messages that cannot be unpacked", messages=self._lost),) if self._lost else ()
        return (*lost, *self._decoder.losses(file))
