"""Where studies work: seeds, a folder for logs, processes to share the work among, and a voice."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from ferryid.errors import FerryIdError

T = TypeVar("T")
Job = Callable[[Path, int], T]
"""One seed's share of a study: a function of a folder and the seed, found by its name in its module."""

FEWEST_SEEDS, MOST_SEEDS = 1, 100


@dataclass(frozen=True)
class Lab:
    """What every study is given.

    Attributes
    ----------
    seeds
        Each study is repeated with each.
    folder
        For logs and ingested tables, one folder below it per job.
    pool
        Shares the jobs out; None carries them out here, one after the other.
    progress
        Called with the name of each stage.
    """

    seeds: tuple[int, ...]
    folder: Path
    pool: Executor | None
    progress: Callable[[str], None]

    def each_seed(self, job: Job[T], what: str) -> list[T]:
        """Carry out a job for every seed and return the answers in the order of the seeds."""
        self.progress(what)
        folders = [
            self.folder / f"{job.__module__.rpartition('.')[2]}-{job.__name__.strip('_')}-{seed}" for seed in self.seeds
        ]
        if self.pool is None:
            return [job(folder, seed) for folder, seed in zip(folders, self.seeds, strict=True)]
        return list(self.pool.map(job, folders, self.seeds))


def seeds(count: int) -> tuple[int, ...]:
    """Return the seeds 1, 2, ...

    Raises
    ------
    FerryIdError
        For fewer than one or more than a hundred.
    """
    if not FEWEST_SEEDS <= count <= MOST_SEEDS:
        raise FerryIdError(
            f"--seeds: {count} is no number of repetitions. Fix: give {FEWEST_SEEDS} to {MOST_SEEDS}, 7 is usual"
        )
    return tuple(range(1, count + 1))
