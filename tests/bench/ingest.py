"""Ingestion: log to Parquet, against rosbags and pandas, rerun-sdk, and the least work conceivable."""

from __future__ import annotations

import contextlib
import importlib.util
import math
import os
import shutil
import sqlite3
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import patch

import lz4.frame
import zstandard
from rosbags.rosbag1 import Reader as Rosbag1Reader

from ferryid.ingest import (
    mcap_batches,
    mcap_chunks,
    mcap_reader,
    open_log,
    rosbag1_messages,
    rosbag1_reader,
    sqlite_data,
    sqlite_rows,
)
from ferryid.ingest.bulk import BulkDecoder
from ferryid.signals import cache, recording
from ferryid.signals.recording import log_name, read_recording, record
from ferryid.vessel import load_profile
from tests.bench import logs, rivals
from tests.bench.page import Row, Section, duration, faster, faster_row, in_turn, within_row
from tests.bench.preparing import preparing
from tests.bench.processes import SHORT_INTERVAL_S, imports, middle, sampled_process

PROFILE = Path(__file__).with_name("bench.toml")
FORMATS = {"mcap": ("zstd", "lz4", "none"), "bag": ("lz4", "none"), "db3": ("none",)}
PLAIN = tuple((kind, compression) for kind, compressions in FORMATS.items() for compression in compressions)
CAMERA = (("mcap", "none"), ("db3", "none"), ("mcap", "zstd"), ("mcap", "lz4"))
NAMES = {"mcap": "MCAP", "bag": "ROS1", "db3": "db3"}
ROSBAGS = "rosbags → pandas → Parquet"


@contextmanager
def scratch() -> Iterator[Path]:
    """A folder that is gone afterwards."""
    folder = Path(tempfile.mkdtemp(prefix="ferryid-bench-"))
    try:
        yield folder
    finally:
        shutil.rmtree(folder)


def ingest(log: Path) -> None:
    """All that `ferryid ingest` does with one log: hash, read, clocks, units, Parquet."""
    with scratch() as out:
        record(log, load_profile(PROFILE), out)


def columns(log: Path) -> None:
    """Read, put on one clock and convert, without hash or Parquet."""
    read_recording(open_log(log), "bench", load_profile(PROFILE))


def columns_to_parquet(log: Path) -> None:
    """Read and write, without the hash."""
    reader = open_log(log)
    with scratch() as out:
        read = read_recording(reader, log_name(log), load_profile(PROFILE))
        cache.store(out, read, cache.signatures(reader.paths), verify=False)


def by_rosbags(log: Path) -> None:
    with scratch() as out:
        rivals.rosbags_to_parquet(log, out)


def decompress(log: Path) -> Callable[[], None]:
    """Return the least that reading a whole log can be: its bytes, decompressed chunk by chunk.

    Where the chunks lie is found out beforehand.
    """
    target = next(log.glob("*.db3")) if log.is_dir() else log
    places: list[tuple[int, int]] = []
    unpack: Callable[[bytes], bytes] = bytes
    if log.suffix == ".mcap":
        from mcap.reader import make_reader

        with log.open("rb") as file:
            summary = make_reader(file).get_summary()
        assert summary is not None
        for chunk in summary.chunk_indexes:
            # Opcode, length, two times, size, checksum, name of the compression, length of the data.
            head = 1 + 8 + 8 + 8 + 8 + 4 + 4 + len(chunk.compression) + 8
            places.append((chunk.chunk_start_offset + head, chunk.compressed_size))
        codec = summary.chunk_indexes[0].compression
        unpack = {"": bytes, "zstd": zstandard.ZstdDecompressor().decompress, "lz4": lz4.frame.decompress}[codec]
    elif log.suffix == ".bag":
        with Rosbag1Reader(log) as reader:
            places = [(chunk.datapos, chunk.datasize) for chunk in reader.chunks.values()]
            unpack = next(iter(reader.chunks.values())).decompressor
    else:
        places = [(start, 1 << 20) for start in range(0, target.stat().st_size, 1 << 20)]

    def work() -> None:
        with target.open("rb", buffering=0) as file:
            for start, size in places:
                file.seek(start)
                unpack(file.read(size))

    return work


def parquet_of(log: Path) -> Callable[[], None]:
    """Return the Parquet writing of a log's recording alone."""
    reader = open_log(log)
    read = read_recording(reader, log_name(log), load_profile(PROFILE))
    signatures = cache.signatures(reader.paths)

    def work() -> None:
        with scratch() as out:
            cache.store(out, read, signatures, verify=False)

    return work


def read_and_write(folder: Path, short: float, long: float) -> tuple[list[Row], list[str], float]:
    """Log → Parquet against rosbags and against the least work conceivable, all of one format in the same rounds.

    With rosbags it is compared without the content hash, which the rival does not make, and with it. The rival is timed on the
    short log of the same format, as a machine changes its speed within a run, once a round: nearly all that it takes is
    deserialising, whatever the compression, and grows with the number of messages. The least work is to decompress everything
    and to write the same tables.

    Returns
    -------
    tuple
        The rows, where the time between goes, and what decompressing the long MCAP log in zstd takes [s].
    """
    lengths = tuple(dict.fromkeys((short, long)))
    rows: dict[tuple[float, str, str], list[Row]] = {}
    least, notes, zstd_s = [], [], math.nan
    for kind, compressions in FORMATS.items():
        measured = [(minutes, compression) for minutes in lengths for compression in compressions]
        works: list[Callable[[], object]] = [partial(by_rosbags, logs.log(folder, kind, compressions[-1], short))]
        for minutes, compression in measured:
            log = logs.log(folder, kind, compression, minutes)
            columns(log)
            works += [partial(columns_to_parquet, log), partial(ingest, log)]
        for compression in compressions:
            log = logs.log(folder, kind, compression, long)
            works += [every_row(log) if kind == "db3" else decompress(log), parquet_of(log)]
        of_short, *others = in_turn(works, 3)
        ours, parts = others[: 2 * len(measured)], others[2 * len(measured) :]
        for (minutes, compression), bare, whole in zip(measured, ours[::2], ours[1::2], strict=True):
            goal = None if minutes < 120 else 15.0 if kind == "db3" else 35.0
            what = f"{minutes:g} min {NAMES[kind]} {compression}: log → Parquet"
            theirs = [took * minutes / short for took in of_short]
            rows[minutes, kind, compression] = [
                faster_row(what, bare, ROSBAGS, theirs, goal),
                faster_row(f"{what}, with content hash", whole, ROSBAGS, theirs, None),
            ]
        of_long = dict(zip(measured, ours[::2], strict=True))
        rosbags_s = statistics.median(of_short) * long / short
        for compression, unpacked, written in zip(compressions, parts[::2], parts[1::2], strict=True):
            unpacked_s, written_s = map(statistics.median, (unpacked, written))
            if (kind, compression) == PLAIN[0]:
                zstd_s = unpacked_s
            name = f"{long:g} min {NAMES[kind]} {compression}"
            told, goal = (
                ("fetch all rows by sqlite3", None)
                if kind == "db3"
                else ("decompress all", 1.5 if compression == "zstd" else 2.0)
            )
            both = [a + b for a, b in zip(unpacked, written, strict=True)]
            row = within_row(
                f"{name}: read + write", of_long[long, compression], f"{told} + write the same Parquet", both, goal
            )
            least.append(row)
            work = partial(columns_to_parquet, logs.log(folder, kind, compression, long))
            steps = processor_times(work)
            alone = f"to {told} and to write the same Parquet, one after the other, is"
            alone = f"{alone} {rosbags_s / (unpacked_s + written_s):.3g} times as fast as rosbags"
            first = rows[long, kind, compression][0]
            rows[long, kind, compression][0] = replace(first, limit=f"{alone[0].upper()}{alone[1:]}. {largest(steps)}")
            notes.append(
                f"{name}: to {told} takes {duration(unpacked_s)} and writing {duration(written_s)}; {alone}; of the "
                f"{row.ours} of both and what is between, {between(steps)}."
            )
            least[-1] = replace(row, limit=largest(steps))
    plain = [row for minutes in lengths for kind, compression in PLAIN for row in rows[minutes, kind, compression]]
    return [*plain, *least], notes, zstd_s


def every_row(log: Path) -> Callable[[], None]:
    """Return the least that reading a db3 log by Python's own sqlite3 can be: every message fetched, and none decoded."""
    (file,) = log.glob("*.db3")

    def work() -> None:
        with contextlib.closing(sqlite3.connect(file)) as connection:
            for _ in connection.execute("SELECT topic_id, timestamp, data FROM messages"):
                pass

    return work


STEPS: Mapping[str, tuple[tuple[Any, str], ...]] = {
    "opening, summary and index": (
        (mcap_reader.McapLog, "__init__"),
        (rosbag1_reader.Rosbag1Reader, "__init__"),
        (sqlite_rows, "read_numbers"),
    ),
    "fetching rows": ((sqlite_data, "_piece"),),
    "decompressing": ((mcap_batches, "_unpacked"), (rosbag1_reader, "decompressed")),
    "checksums of chunks": ((mcap_chunks, "check"),),
    "finding messages and holding them against the index": (
        (mcap_batches, "_located"),
        (rosbag1_messages.Messages, "locate"),
    ),
    "copying wanted fields": ((BulkDecoder, "add"),),
    "clocks": ((recording, "repair_all"),),
    "units and frames": ((recording, "make_recording"),),
    "writing": ((cache, "write_table"), (cache, "table_checksum")),
}
"""Functions whose processor time, in whatever thread, is a step's; that of checksums is taken from decompressing's."""
LEAST = ("fetching rows", "decompressing", "writing")
"""Steps that the least work conceivable has as well."""
LARGEST = 3
"""Steps that are named of what limits a reading."""


OTHERS = "the rest"
"""What is none of the steps."""


def processor_times(read: Callable[[], object]) -> dict[str, float]:
    """Return the processor time of the steps of reading a log, of writing it, and of the rest [s]."""
    took = dict.fromkeys(STEPS, 0.0)

    def timed(step: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def work(*arguments: Any, **more: Any) -> Any:
            start = time.thread_time()
            try:
                return function(*arguments, **more)
            finally:
                took[step] += time.thread_time() - start

        return work

    with contextlib.ExitStack() as stack:
        for step, functions in STEPS.items():
            for owner, name in functions:
                stack.enter_context(patch.object(owner, name, timed(step, getattr(owner, name))))
        start = time.process_time()
        read()
        whole_s = time.process_time() - start
    took["decompressing"] -= min(took["checksums of chunks"], took["decompressing"])
    return {**took, OTHERS: max(whole_s - sum(took.values()), 0.0)}


def between(steps: Mapping[str, float]) -> str:
    """Return processor times of steps [s] as a part of a sentence; those under a hundredth are left out."""
    whole_s = sum(steps.values())
    parts = [f"{step} {duration(took)}" for step, took in steps.items() if took >= 0.01 * whole_s or step == OTHERS]
    return f"processor time by steps, over {os.cpu_count()} cores: {', '.join(parts)}"


def largest(steps: Mapping[str, float]) -> str:
    """Return what takes most between reading and writing, of processor times [s], as a sentence."""
    own = {step: took for step, took in steps.items() if step not in LEAST}
    most = sorted(own.items(), key=lambda one: -one[1])[:LARGEST]
    parts = ", ".join(f"{step} ({duration(took)})" for step, took in most)
    return f"Beyond the least work, most processor time, over {os.cpu_count()} cores, goes into {parts}."


def against_whole_camera_log(folder: Path, minutes: float) -> tuple[list[Row], list[str]]:
    """A log that is nearly all pictures: reading the signals, against reading or decompressing everything.

    Returns
    -------
    tuple
        The rows, and where the time of each goes.
    """
    rows, notes = [], []
    for kind, compression in CAMERA:
        log = logs.log(folder, kind, compression, minutes, camera=True)
        what = f"{minutes:g} min {NAMES[kind]} {compression} with camera: read"
        columns(log)
        if compression == "none":
            file = next(log.glob("*.db3")) if log.is_dir() else log
            row = faster(what, partial(columns, log), "cat", partial(cat, file), 1.0, 5)
        else:
            row = faster(what, lambda log=log: columns(log), "decompress all", decompress(log), 4.0, 3)
        steps = processor_times(partial(columns, log))
        rows.append(replace(row, limit=largest(steps)))
        notes.append(f"{what}: {between(steps)}.")
    return rows, notes


def cat(file: Path) -> None:
    subprocess.run(["cat", file], stdout=subprocess.DEVNULL, check=True)


def against_rerun(folder: Path, minutes: float) -> tuple[list[Row], list[str]]:
    """The same fields as NumPy arrays, and where the time goes; nothing where rerun-sdk is not installed."""
    try:
        import rerun  # noqa: F401
    except ImportError:
        return [], []
    log = logs.log(folder, "mcap", "zstd", minutes)
    what = f"{minutes:g} min MCAP zstd: the same fields as arrays"
    rivals.rerun_columns(log)
    row = faster(what, lambda: columns(log), "rerun-sdk", lambda: rivals.rerun_columns(log), 2.0, 5)
    return [row], [f"{what}: {between(processor_times(partial(columns, log)))}."]


PACKAGES = ("numpy", "pyarrow", "pyarrow.parquet", "typer")
"""What any program that reads a log and writes Parquet would import."""
PROCESS_STEPS = {
    "looking for kept tables, and waiting for the content hash": ("/signals/recording.py:_whole",),
    "opening, summary and index": ("/ingest/__init__.py:open_log",),
    "finding the signals": ("/signals/recording.py:selected",),
    "reading": ("/ferryid/ingest/:read",),
    "clocks": ("/ingest/clocks.py:repair_all",),
    "units and frames": ("/signals/recording.py:make_recording",),
    "writing": ("/signals/cache.py:store",),
}
"""Functions of the steps of a whole process."""
OURS = "from ferryid.cli.main import main; main()"
THEIRS = "from tests.bench.rivals import main; main()"
SMALL_MCAP = "from tests.bench.rivals import main_small_mcap as main; main()"
SMALL_MCAP_ALL = "from tests.bench.rivals import main_small_mcap_all as main; main()"
PEAK = """
import atexit, sys
def peak():
    line = next(line for line in open("/proc/self/status") if line.startswith("VmHWM"))
    print("peak", line.split()[1], file=sys.stderr)
atexit.register(peak)
"""


def script(code: str, *arguments: str | Path) -> str:
    """Run a script in a process of its own and return what it said on standard error."""
    done = subprocess.run([sys.executable, "-c", code, *arguments], check=True, capture_output=True, text=True)
    return done.stderr


def process(log: Path, before: str = "") -> str:
    """`ferryid ingest` as a process of its own."""
    with scratch() as out:
        return script(before + OURS, "ingest", log, "--vessel", PROFILE, "--out", out)


def rival_process(log: Path, before: str = "", code: str = THEIRS) -> str:
    """rosbags and pandas, or another rival, as a process of their own."""
    with scratch() as out:
        return script(before + code, log, out)


def as_process(folder: Path, minutes: float, repeats: int) -> tuple[list[Row], list[str]]:
    """One whole process, start-up included; where they are installed, against the fastest readers in Python as well.

    Returns
    -------
    tuple
        The rows, and what of them nothing can save.
    """
    rows, notes = [], []
    more = all(importlib.util.find_spec(name) for name in ("small_mcap", "mcap_ros2_support_fast"))
    for kind, compression in (("mcap", "zstd"), ("bag", "lz4"), ("db3", "none")):
        log = logs.log(folder, kind, compression, minutes)
        others = [("rosbags and pandas in a process", THEIRS, 8.0)]
        if more and kind == "mcap":
            name = "small-mcap with mcap-ros2-support-fast and pandas"
            others += [(f"{name}, the mapped topics", SMALL_MCAP, 1.0), (f"{name}, all topics", SMALL_MCAP_ALL, 1.0)]
        works: list[Callable[[], object]] = [partial(process, log)]
        works += [partial(rival_process, log, code=code) for _, code, _ in others]
        ours, *theirs = in_turn(works, repeats)
        runs = []
        for _ in range(repeats):
            with scratch() as out:
                words = ("ingest", str(log), "--vessel", str(PROFILE), "--out", str(out))
                runs.append(sampled_process(words, PROCESS_STEPS, interval_s=SHORT_INTERVAL_S))
        told = f"`ingest` of {minutes:g} min {NAMES[kind]} {compression}"
        run, alone = middle(runs), imports(PACKAGES)
        notes.append(alone.floor(told, run))
        what = f"{minutes:g} min {NAMES[kind]} {compression}: whole process"
        for (name, _, goal), took in zip(others, theirs, strict=True):
            limit = alone.limit(run, statistics.median(took) / goal)
            rows.append(replace(faster_row(what, ours, name, took, goal), limit=limit))
    return rows, notes


def peak_mb(said: str) -> float:
    """Peak resident memory that a process said [MB]."""
    return int(said.split("peak")[-1]) / 1024


def memory(folder: Path, minutes: float) -> list[Row]:
    """Peak memory of whole processes; only where the system tells it."""
    if not Path("/proc/self/status").exists():
        return []
    rows = []
    for kind, compression in (("mcap", "zstd"),):
        log = logs.log(folder, kind, compression, minutes)
        ours, theirs = peak_mb(process(log, PEAK)), peak_mb(rival_process(log, PEAK))
        what = f"{minutes:g} min {NAMES[kind]} {compression}: peak memory"
        rows.append(Row(what, f"{ours:.0f} MB", ROSBAGS, f"{theirs:.0f} MB", theirs / ours))
    return rows


def run(quick: bool, folder: Path | None = None) -> Section:
    """Measure everything about ingestion.

    Parameters
    ----------
    quick
        One-minute logs, to see that it runs.
    folder
        Where logs are kept; by default a folder of the system's for temporary files.
    """
    folder = folder or Path(tempfile.gettempdir()) / "ferryid-bench-logs"
    short, long, camera = (1.0, 1.0, 0.2) if quick else (12.0, 120.0, 3.0)
    with preparing():
        logs.make(
            folder,
            [
                *((*one, minutes, False) for minutes in (short, long) for one in PLAIN),
                *((*one, camera, True) for one in CAMERA),
            ],
        )
    rows, between_notes, zstd_s = read_and_write(folder, short, long)
    with_camera, camera_notes = against_whole_camera_log(folder, camera)
    by_rerun, rerun_notes = against_rerun(folder, short)
    processes, process_notes = as_process(folder, short, 1 if quick else 3)
    rows += [*with_camera, *by_rerun, *processes, *memory(folder, short)]
    return Section(
        "Ingestion",
        rows,
        (
            "Odometry and Imu at 100 Hz, thruster state at 20 Hz, wind at 10 Hz. Wanted are position, velocity and yaw rate "
            "of the first, orientation of the second, thruster and wind. Written by rosbags (ROS1, db3) and mcap.",
            "Log → Parquet is reading, clocks, units and Parquet with metadata; the rival deserialises the same topics and "
            "writes the same fields. `ferryid ingest` also hashes the log, in a thread beside; so do the whole processes. "
            f"The rival is timed on the log of {short:g} min of each format in the same rounds, and multiplied for {long:g}.",
            *between_notes,
            *camera_notes,
            *rerun_notes,
            *process_notes,
            f"Logs with camera hold raw 1280 x 720 pictures at {logs.CAMERA_HZ:g} Hz, {camera:g} minutes, about "
            f"{camera * 0.332:.2g} GB (the goal was set on 3.9 GB).",
        ),
        (
            "rosbags",
            "pandas",
            "pyarrow",
            "numpy",
            "mcap",
            "zstandard",
            "lz4",
            "rerun-sdk",
            "small-mcap",
            "mcap-ros2-support-fast",
        ),
        same={} if quick else {"zstd, 2 h of MCAP decompressed": zstd_s},
    )
