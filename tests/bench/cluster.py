"""Beyond one machine: archive, batch and proof on Dask clusters of single-thread workers, and what that says of larger ones.

All workers are processes of this machine. More of them than it has cores cannot be faster; what they cost is measured.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import shutil
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from unittest.mock import patch

from distributed import Client, LocalCluster

from ferryid import api
from ferryid.batch import spread
from tests.bench.archive import FIT, ROWS_A_LOG, season
from tests.bench.page import Curve, Row, Section, Timed, duration
from tests.bench.preparing import preparing
from tests.bench.processes import whole_process
from tests.bench.trials import ROUND_S, SCALE, VESSEL, written

WORKERS = (1, 2, 4, 8)
LOGS = 4
QUICK_S = 180
"""Length of the shorter logs of a quick run [s]."""
LONG_S = 3600
"""Length of the longer logs [s], by which the time of a log is split into what its rows take and what it takes without."""
CASES = ("--only", "short", "--runs", "0.5", "--seed", "20261128")
TRIVIAL = 200
PROJECTED_LOGS, PROJECTED_ROWS = 10_000, 10_000_000_000
RATE_HZ = 20.0
RECIPE = 'steps = ["fit"]\n[fit]\ndelta = 0.4\nsigma = 0.4\n'


@dataclass(frozen=True)
class Traffic:
    """What passes between the batch and its workers, and the file system that they share [bytes per log]."""

    sent: float
    returned: float
    read: float
    written: float

    @property
    def scheduled(self) -> float:
        """Bytes of one log that pass the scheduler."""
        return self.sent + self.returned


@dataclass(frozen=True)
class LogTimes:
    """What a log takes without its rows, and each row more [s], by logs of `least` and of `rows` rows."""

    base_s: float
    row_s: float
    least: float
    rows: float


@dataclass
class Measured:
    """Times [s] by the number of workers: of the batch, of the proof's cases, of one trivial task."""

    batch: dict[int, float] = field(default_factory=dict)
    proof: dict[int, float] = field(default_factory=dict)
    task: dict[int, float] = field(default_factory=dict)


def run(quick: bool) -> Section:
    """Measure; `quick` on one and two workers, two short logs, and without the proof, whose cases take long."""
    workers, logs, short_s, long_s = (
        (WORKERS[:2], 2, QUICK_S, 2 * QUICK_S) if quick else (WORKERS, LOGS, ROUND_S, LONG_S)
    )
    found = Measured()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        paths = written(range(logs), short_s)
        recipe = folder / "recipe.toml"
        recipe.write_text(RECIPE, encoding="utf-8")

        def batch(some: Sequence[Path], out: str, address: str) -> float:
            words = ("batch", *map(str, some), *VESSEL, "--recipe", str(recipe), "--dask", address)
            return whole_process((*words, "--out", str(folder / out)))[0]

        for count in workers:
            with cluster(count) as address:
                found.task[count] = _trivial(address)
                found.batch[count] = batch(paths, f"batch{count}", address)
                if not quick:
                    words = ("prove", *CASES, "--dask", address, "--out", str(folder / f"proof{count}"))
                    found.proof[count] = whole_process(words)[0]
                if count == 1:
                    # The first log of each kind goes with the time of the process itself, and does not count.
                    few = max(logs // 2, 2)
                    some = [batch(paths[:number], f"some{number}", address) for number in (1, few)]
                    short_log_s = (some[1] - some[0]) / (few - 1)
                    longer = written([200, 201], long_s)
                    # The process itself, and what its first log takes beyond that, are known by the shorter ones.
                    long_log_s = (batch(longer, "long", address) - (some[0] - short_log_s)) / len(longer)
                    moved = _traffic(paths[:2], recipe, folder / "moved", address)
        archive_s = whole_process(("fit", "--archive", *VESSEL, *SCALE, "--out", str(folder / f"batch{workers[-1]}")))[
            0
        ]
        kept = _archive(folder, (10, 110) if quick else (50, 550), 1 if quick else 3)
    rows = [
        row
        for what, times in (
            (f"batch of {logs} logs of {short_s / 60:g} min, with fits", found.batch),
            ("cases of the proof", found.proof),
        )
        for row in _speed(what, times)
    ]
    rows.append(
        Row(
            f"fit over the archive of those {logs} logs, in one process",
            duration(archive_s),
            "the batch that made it, on one worker",
            duration(found.batch[1]),
            found.batch[1] / archive_s,
        )
    )
    short_rows, long_rows = short_s * RATE_HZ, long_s * RATE_HZ
    slope_s = max((long_log_s - short_log_s) / (long_rows - short_rows), 0.0)
    log_times = LogTimes(max(short_log_s - slope_s * short_rows, 0.0), slope_s, short_rows, long_rows)
    curves = [
        Curve(
            what,
            "single-thread workers of a Dask cluster",
            [(float(count), took) for count, took in times.items()],
            shared=True,
        )
        for what, times in ((f"batch of {logs} logs", found.batch), ("cases of the proof", found.proof))
        if times
    ]
    notes = [*_overhead(found, logs), *_moved(moved, short_s), *_projected(log_times, found.task, moved, kept)]
    return Section("Beyond one machine", rows, notes, ("dask", "distributed"), curves=curves)


@contextlib.contextmanager
def cluster(workers: int) -> Iterator[str]:
    """Give the address of a cluster of single-thread workers, which say nothing of how they end."""
    with LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None, silence_logs=51) as one:  # type: ignore[no-untyped-call]
        yield str(one.scheduler_address)


def _speed(what: str, times: dict[int, float]) -> list[Row | Timed]:
    """Rows of the same work on more and more workers, against one of them."""
    return [
        Row(f"{what}, {count} workers", duration(took), "one worker", duration(times[1]), times[1] / took)
        for count, took in times.items()
        if count > 1
    ]


def _trivial(address: str) -> float:
    """Return what a task that does nothing takes, from being sent to its result [s]: the median of three rounds."""
    with Client(address, set_as_default=False) as client:  # type: ignore[no-untyped-call]
        client.gather(client.map(abs, range(-TRIVIAL, 0), pure=False))
        rounds = []
        for _ in range(3):
            start = time.perf_counter()
            client.gather(client.map(abs, range(-TRIVIAL, 0), pure=False))
            rounds.append((time.perf_counter() - start) / TRIVIAL)
    return statistics.median(rounds)


def _traffic(paths: Sequence[Path], recipe: Path, out: Path, address: str) -> Traffic:
    """Return what a batch of these logs moves, by serialising what is sent and what comes back once more."""
    sent, returned = [], []
    over = spread._Cluster.over

    def counted(
        self: Any, function: Callable[[Any], Any], items: Sequence[Any], **more: Any
    ) -> Iterator[tuple[int, Any]]:
        sent.extend(len(pickle.dumps((function, item))) for item in items)
        for number, result in over(self, function, items, **more):
            returned.append(len(pickle.dumps(result)))
            yield number, result

    with patch.object(spread._Cluster, "over", counted):
        api.batch([str(path) for path in paths], out, vessel=VESSEL[1], recipe=recipe, dask=address)
    kept = sum(path.stat().st_size for path in out.rglob("*") if path.is_file())
    read = sum(path.stat().st_size for path in paths)
    return Traffic(*(total / len(paths) for total in (sum(sent), sum(returned), read, kept)))


@dataclass(frozen=True)
class Archive:
    """What one more log takes of a fit over the archive: time [s], memory and what is kept of it [bytes].

    Attributes
    ----------
    logs
        Numbers of logs of the archives that were compared.
    log_s
        Median of the differences of neighbouring runs, by log.
    least_s, most_s
        The smallest of these and the largest.
    """

    logs: tuple[int, int]
    log_s: float
    least_s: float
    most_s: float
    log_memory: float
    log_kept: float


def _archive(folder: Path, counts: tuple[int, int], repeats: int) -> Archive:
    """Measure fits over archives of two numbers of logs of two hours, in turn.

    They are so far apart that what the larger one takes more is far above how much runs differ.
    """
    outs = [folder / f"season{count}" for count in counts]
    with preparing():
        for out in outs:
            out.mkdir()
        season(outs[1], counts[1], weak=False)
        # The smaller archive is a part of the larger one.
        for log in sorted((outs[1] / "logs").iterdir())[: counts[0]]:
            shutil.copytree(log, outs[0] / "logs" / log.name)
    few_kept, many_kept = (sum(path.stat().st_size for path in out.glob("logs/*/*")) for out in outs)
    few, many = zip(*([whole_process((*FIT, "--out", str(out))) for out in outs] for _ in range(repeats)), strict=True)
    return added(counts, few, many, many_kept - few_kept)


def added(
    counts: tuple[int, int], few: Sequence[tuple[float, int]], many: Sequence[tuple[float, int]], kept: float
) -> Archive:
    """Return what a log adds by times [s] and memory [bytes] of fits over two numbers of logs, run by run."""
    more = counts[1] - counts[0]
    times = [(b[0] - a[0]) / more for a, b in zip(few, many, strict=True)]
    memory = max(much for _, much in many) - max(much for _, much in few)
    return Archive(counts, statistics.median(times), min(times), max(times), memory / more, kept / more)


def _overhead(found: Measured, logs: int) -> Iterator[str]:
    cores = os.cpu_count() or 1
    enough = max(count for count in found.batch if count <= cores)
    yield (
        f"This machine has {cores} cores: more workers than that cannot be faster here, and what they lose is their own cost, "
        "as each loads ferryid and shares the cores with the others and the scheduler."
    )
    for what, times in ((f"The batch of {logs} logs", found.batch), ("The cases of the proof", found.proof)):
        if times and enough > 1:
            yield f"{what}: {enough} workers use {times[1] / times[enough] / enough:.0%} of what {enough} of them could give."
        beyond = [
            f"{count} take {times[count] / times[enough] - 1:+.0%} against {enough}"
            for count in times
            if count > enough
        ]
        if beyond:
            yield f"{what}: of workers beyond the cores, {'; '.join(beyond)}."
    each = ", ".join(f"{took * 1e6:.0f} µs on {count}" for count, took in found.task.items())
    yield f"A task that does nothing takes {each} workers, of {TRIVIAL} sent at once: client, scheduler and worker together."


def _moved(moved: Traffic, log_s: float) -> Iterator[str]:
    yield (
        f"Moved per log of {log_s / 60:g} min: {moved.sent / 1e3:.1f} kB sent to a worker and {moved.returned / 1e3:.1f} kB "
        f"back, through the scheduler; {moved.read / 1e6:.1f} MB of log read and {moved.written / 1e6:.2f} MB of tables, sums, "
        "model and page written, through the file system that the workers share."
    )


def _projected(log: LogTimes, task: dict[int, float], moved: Traffic, kept: Archive) -> Iterator[str]:
    """Project to many logs, by the times of one."""
    logs, rows, hours = PROJECTED_LOGS, PROJECTED_ROWS / PROJECTED_LOGS, ROWS_A_LOG / RATE_HZ / 3600
    log_s, task_s = log.base_s + log.row_s * rows, max(task.values())
    yield (
        f"**Projection** to {logs:,} logs and {PROJECTED_ROWS:.0e} rows, {rows / RATE_HZ / 3600:.0f} h at {RATE_HZ:g} Hz each. "
        f"A log takes {log.base_s:.2g} s and {log.row_s * 1e6:.2g} s per million rows, by logs of {log.least / RATE_HZ / 60:g} "
        f"and {log.rows / RATE_HZ / 60:g} min on one worker, so {log_s:.3g} s; all of them {log_s * logs / 3600:.3g} h of one "
        "core."
    )
    each = ", ".join(
        f"{(log_s / count + task_s + kept.log_s) * logs / 60:.3g} min on {count}" for count in (16, 64, 256)
    )
    yield (
        f"With workers of a core like these: {each}. In that are {task_s * logs:.3g} s of the scheduler, and "
        f"{kept.log_s * logs:.3g} s of the fit over the archive in one process ({kept.log_s * 1e3:.2g} ms a log, by archives "
        f"of {kept.logs[0]} and {kept.logs[1]} logs, from {kept.least_s * 1e3:.2g} to {kept.most_s * 1e3:.2g} ms in single "
        f"runs). The scheduler could keep {log_s / task_s:.2g} workers busy."
    )
    terabytes = moved.read * rows / log.least * logs / 1e12
    yield (
        f"It would send {moved.scheduled * logs / 1e6:.3g} MB through the scheduler, and read {terabytes:.2g} TB of logs. The "
        f"archive keeps {kept.log_kept / 1e3:.0f} kB of sums and its fit holds {kept.log_memory / 1e6:.2g} MB for each log of "
        f"{hours:g} h: {kept.log_memory * logs / 1e9:.2g} GB for all of them."
    )
    yield (
        "Assumed: the time of a log grows with its rows in proportion beyond these; workers are as fast as one here and do "
        "not share cores; the file system serves all of them at once; of a log longer than "
        f"{hours:g} h the archive keeps and holds no more, as the number of blocks has a limit."
    )
