"""Read-only, bounded connections to SQLite files that may be damaged or hostile."""

from __future__ import annotations

import sqlite3
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.files import resolved
from ferryid.ingest.formats.sqlite3_bag import MAGIC

Job = TypeVar("Job")
Result = TypeVar("Result")

# What the sqlite3 module raises for a damaged file: a message of SQLite may quote bytes that are no UTF-8, and a
# damaged length may ask for more memory than there is.
FAULTS = (sqlite3.Error, MemoryError, UnicodeDecodeError)
# A sound file is read in less than one instruction of SQLite's virtual machine for every byte.
STEP = 1_000_000
FIRST_STEPS = 30
BYTES_PER_STEP = STEP // 2
SQL_BYTES = 1 << 20
BLOCK_BYTES = 4 << 20
# First bytes of the pages of an index.
INDEX_PAGES = (0x02, 0x0A)
THREADS = 2
JOBS_AHEAD = 4


class Database:
    """One SQLite file, which is opened immutable: without locks, and without writing anything beside it.

    Parameters
    ----------
    path
        The file itself.
    name
        How messages refer to it.

    Raises
    ------
    FerryIdError
        The header of the file is not that of an SQLite database.
    """

    def __init__(self, path: Path, name: Path) -> None:
        self.path, self.name = path, name
        with path.open("rb") as file:
            head = file.read(100)
        self.bytes = path.stat().st_size
        page = int.from_bytes(head[16:18], "big")
        # 65536 does not fit the two bytes.
        page = 65536 if page == 1 else page
        if len(head) < 100 or head[:16] != MAGIC or page < 512 or page & (page - 1):
            raise FerryIdError(
                f"{name}: not a readable SQLite database, the header of its {counted(self.bytes, 'byte')} is damaged or cut "
                "off. Fix: give the .db3 file as rosbag2 recorded it"
            )
        self.page = page
        # Size that the header states, which old writers left at 0.
        self.stated_bytes = int.from_bytes(head[28:32], "big") * page

    @property
    def cut(self) -> str:
        """What is to be reported of a file that is shorter than its header states, or an empty string."""
        return (
            f"the file ends after {counted(self.bytes, 'byte')} of {self.stated_bytes}"
            if self.bytes < self.stated_bytes
            else ""
        )

    def connect(self) -> sqlite3.Connection:
        """Return a connection for one thread at a time, whose statements are interrupted when they do not end."""
        uri = f"{resolved(self.path).as_uri()}?mode=ro&immutable=1"
        connection = sqlite3.connect(uri, uri=True, check_same_thread=False, isolation_level=None)
        connection.text_factory = bytes
        # No value of a file is larger than the file.
        connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, max(16 * SQL_BYTES, self.bytes))
        connection.setlimit(sqlite3.SQLITE_LIMIT_SQL_LENGTH, SQL_BYTES)
        connection.setlimit(sqlite3.SQLITE_LIMIT_ATTACHED, 0)
        connection.setlimit(sqlite3.SQLITE_LIMIT_TRIGGER_DEPTH, 1)
        connection.set_progress_handler(self._limit(), STEP)
        # As sqlite.org/security.html advises for files of unknown origin. A writable schema, which nothing writes,
        # makes SQLite open a truncated file.
        for pragma in ("trusted_schema=OFF", "cell_size_check=ON", "mmap_size=0", "temp_store=MEMORY"):
            connection.execute(f"PRAGMA {pragma}")
        connection.execute("PRAGMA writable_schema=ON")
        return connection

    def _limit(self) -> Callable[[], bool]:
        """Return a progress handler that interrupts after more steps than a sound file of this size takes."""
        left = FIRST_STEPS + self.bytes // BYTES_PER_STEP

        def count() -> bool:
            nonlocal left
            left -= 1
            return left < 0

        return count

    def checked(self, error: BaseException) -> BaseException:
        """Return an error that stands for damage.

        Raises
        ------
        FerryIdError
            The statement did not end: pages refer to one another in circles, or a value never ends.
        """
        if isinstance(error, sqlite3.OperationalError) and "interrupted" in str(error):
            raise FerryIdError(
                f"{self.name}: reading does not end after more steps than a file of "
                f"{counted(self.bytes, 'byte')} can take, its "
                "pages refer to each other in circles. Fix: recover it with sqlite3's .recover"
            ) from error
        return error

    def in_order(self, work: Callable[[sqlite3.Connection, Job], Result], jobs: Iterable[Job]) -> Iterator[Result]:
        """Do jobs on threads of their own, a few ahead of the caller; SQLite works while Python does too.

        Yields
        ------
        Result
            What `work` returned for each job, in order of the jobs.
        """
        connections = [self.connect() for _ in range(THREADS)]
        idle = deque(connections)

        def run(job: Job) -> Result:
            connection = idle.popleft()
            try:
                return work(connection, job)
            finally:
                idle.append(connection)

        waiting: deque[Future[Result]] = deque()
        try:
            with ThreadPoolExecutor(THREADS) as pool:
                try:
                    for job in jobs:
                        waiting.append(pool.submit(run, job))
                        if len(waiting) >= JOBS_AHEAD:
                            yield waiting.popleft().result()
                    while waiting:
                        yield waiting.popleft().result()
                finally:
                    for future in waiting:
                        future.cancel()
        finally:
            for connection in connections:
                connection.close()

    def integrity(self) -> list[str]:
        """Return what SQLite's own check of the whole file finds, nothing for a sound one."""
        try:
            with closing(self.connect()) as connection:
                found = [_text(row[0]) for row in connection.execute("PRAGMA integrity_check(10)")]
        except FAULTS as error:
            found = [str(error)]
        return [" ".join(fault.split()) for fault in found if fault != "ok"]

    def index_entries(self) -> int:
        """Count the entries of all pages of the file that are of an index, whether anything refers to them or not."""
        step = max(1, BLOCK_BYTES // self.page) * self.page
        count = 0
        with self.path.open("rb") as file:
            while block := file.read(step):
                pages = np.frombuffer(block, np.uint8)
                pages = pages[: pages.size // self.page * self.page].reshape(-1, self.page)
                cells = pages[np.isin(pages[:, 0], INDEX_PAGES), 3:5].astype(np.int64)
                count += int((cells[:, 0] << 8 | cells[:, 1]).sum())
        return count


def _text(value: Any) -> str:
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)
