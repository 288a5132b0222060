"""The archive: a fit over many logs from what is kept of each, and how long the command line takes to start."""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import fields, replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from ferryid.identify import block_sum_store, window_store
from ferryid.identify.block_sum_store import StoredSums, load_block_sums
from ferryid.identify.log_windows import LogWindows
from ferryid.identify.settings import FitSettings
from ferryid.identify.weak_rows import WeakRows
from ferryid.identify.window_length import TRAINING_LENGTHS
from ferryid.identify.window_loads import LoadSamples
from ferryid.regression.bases.basis import make_basis
from ferryid.regression.cross_products import CrossProducts
from ferryid.regression.cross_validation.block_sums import BlockSums
from ferryid.side_by_side import over
from ferryid.signals.cache import note_text, recordings
from ferryid.signals.prepare import open_track
from ferryid.simulate import load_scenario, simulate, write_log
from ferryid.vessel import load_profile
from tests.bench.identify import of_motion
from tests.bench.page import Row, Section, Timed, faster_row, in_turn
from tests.bench.preparing import preparing
from tests.bench.processes import whole_process
from tests.bench.rivals import rosbags_to_parquet
from tests.bench.trials import ROUND_S, SCALE, VESSEL, written

ROWS_A_LOG = 144_000
"""Two hours at 20 Hz."""
HELP_GOAL_S = 0.08
BATCH_LOGS, BATCH_GOAL_S = 20, 180.0
"""Logs of a batch and the goal of all [s]."""
MEASURED_LOGS = 4
"""So many of them are measured, against their part of the goal: a smaller batch has the same start."""
RIVAL_LOGS = 4
"""Logs of the batch that the rival reads; its time is multiplied."""
PROFILE = load_profile("milliampere")
FIT = ("fit", "--archive", *VESSEL, *SCALE)
WEAK = (*FIT, "--estimator", "weak")
SWEEP = ("sweep", "components", "--archive", *VESSEL, *SCALE)


def run(quick: bool) -> Section:
    """Measure everything; `quick` with a hundredth of the logs."""
    logs = 7 if quick else 700
    rows = logs * ROWS_A_LOG
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        with preparing():
            season(out, logs)
        size, windows = (
            sum(path.stat().st_size for path in out.glob(f"logs/*/{kind}-*.parquet")) for kind in ("pieces", "windows")
        )
        fitted, swept = [], []
        for _ in range(1 if quick else 3):
            fitted.append(whole_process((*FIT, "--out", folder)))
            swept.append(whole_process((*SWEEP, "--out", folder)))
        weak, weak_peak = whole_process((*WEAK, "--out", folder))
        read = [_one_pass(rows) for _ in fitted]
    peak = max(memory for _, memory in (*fitted, *swept))
    table = [
        faster_row(
            f"{what}, {rows:,} rows in {logs} logs, whole process",
            [one for one, _ in took],
            name,
            read[-len(took) :],
            None,
        )
        for what, took, name in (
            ("fit with 500 bootstrap draws", fitted, "one pass over the rows in memory"),
            ("sweep of components, by stretches and by logs", swept, "one pass over the rows in memory"),
            ("fit in the weak form with 500 draws", [(weak, weak_peak)], "one pass over the rows in memory"),
        )
    ]
    notes = [
        f"Kept of {logs} logs: {size / 1e6:.0f} MB of sums, 36 blocks in three pieces each. Peak memory of the process: "
        f"{peak / 1e9:.2f} GB (goal: at most 1).",
        f"For the weak form: {windows / 1e6:.0f} MB of windows of {len(TRAINING_LENGTHS)} lengths. A fit holds those that "
        f"validate, of the usual length, those that train, of the chosen one, and of some logs the others: "
        f"{weak_peak / 1e9:.2f} GB, {weak_peak / 1e6 / logs:.2g} MB a log. Winds and gusts of each log are estimated with the "
        "hull by steps over all its windows. Sums cannot replace these: the load of a wind is not linear in it.",
        "The pass over the rows forms basis and cross-products in chunks from arrays in memory, once; ingestion and smoothing, "
        "which the sums save as well, are not counted.",
    ]
    start_up, same = _start_up(3 if quick else 9)
    with tempfile.TemporaryDirectory() as folder:
        rows = [*table, *_batch(1 if quick else MEASURED_LOGS, Path(folder)), *start_up]
    return Section(
        "Archive and start-up",
        rows,
        notes,
        ("rosbags", "typer"),
        same=same,
    )


def _batch(logs: int, folder: Path) -> list[Row | Timed]:
    """Return how long a batch of simulated logs takes, ingestion, fit, diagnosis and pages of each, whole process."""
    paths = written(range(logs), ROUND_S)
    recipe = folder / "recipe.toml"
    recipe.write_text('steps = ["fit", "diagnose"]\n', encoding="utf-8")
    words = (
        "batch",
        *map(str, paths),
        *VESSEL,
        "--recipe",
        str(recipe),
        "--processes",
        "2",
        "--out",
        str(folder / "pool"),
    )
    took, _ = whole_process(words)
    rival = paths[:RIVAL_LOGS]
    tables = [folder / path.stem for path in rival]
    for one in tables:
        one.mkdir()
    start = time.perf_counter()
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as workers:
        list(workers.map(rosbags_to_parquet, rival, tables))
    rosbags_s = (time.perf_counter() - start) * logs / len(rival)
    what = f"batch of {logs} logs of 12 min, ingested, fitted and diagnosed, two processes"
    return [
        Timed(what, took, BATCH_GOAL_S * logs / BATCH_LOGS),
        faster_row(what, [took], "rosbags to Parquet in a pool of two, no fit", [rosbags_s], None),
    ]


def season(out: Path, logs: int, *, weak: bool = True) -> None:
    """Write what is kept of `logs` logs of two hours, all made of one simulated trial; with `weak`, of the weak form too."""
    problem = out / "trial.mcap"
    write_log(simulate(load_scenario("twelve-corner"), 1), problem)
    open_track(str(problem), PROFILE, out)
    settings = FitSettings(delta=0.4, sigma=0.4)
    (folder, note), *_ = recordings(out).items()
    one = load_block_sums(folder, PROFILE, settings, (settings.window_s,))
    (path,) = folder.glob("pieces-*.parquet")
    _, told = block_sum_store.read_table(path)
    long = _lengthened(one)
    windows = {}
    if weak:
        usual_s = window_store.load_windows(folder, PROFILE, settings, divided=True).length_s
        for share in TRAINING_LENGTHS:
            window_store.load_windows(folder, PROFILE, replace(settings, weak_window_s=share * usual_s), divided=True)
    for kept in folder.glob("windows-*.parquet"):
        key = block_sum_store.read_table(kept)[1]["key"]
        of_length = replace(settings, weak_window_s=key["weak_window_s"])
        windows[kept.name] = key, _repeated(window_store.load_windows(folder, PROFILE, of_length, divided=True))

    def write(number: int) -> None:
        name, sha256 = f"day{number:04d}", f"{number:08x}".ljust(64, "0")
        place = out / "logs" / f"{name}-{sha256[:8]}-{PROFILE.sha256[:8]}"
        place.mkdir()
        recording = {**note["recording"], "name": name, "sha256": sha256}
        (place / "recording.json").write_text(
            note_text({**note, "files": [[name, 0, number, number]], "recording": recording}), encoding="utf-8"
        )
        block_sum_store.write_block_sums(place / path.name, told["key"], replace(long, name=name, sha256=sha256))
        for file, (key, longer) in windows.items():
            window_store.write_windows(place / file, key, replace(longer, name=name, sha256=sha256))

    over(write, range(logs))
    for file in folder.iterdir():
        file.unlink()
    folder.rmdir()


def _lengthened(log: StoredSums) -> StoredSums:
    """Return a log of 36 blocks and two hours that repeats the blocks of a shorter one."""
    blocks = log.sums.test.blocks
    chosen = np.arange(36) % blocks
    times = ROWS_A_LOG / log.sums.test.n[chosen].sum()

    def longer(pieces: BlockSums) -> BlockSums:
        n = np.round(pieces.n[chosen] * times).astype(np.int64)
        products = pieces.products[chosen] * times
        products[..., -1, -1] = n
        return replace(pieces, n=n, products=products)

    one = log.sums
    return replace(
        log,
        sums=replace(
            one,
            training=tuple(longer(pieces) for pieces in one.training),
            test=longer(one.test),
            force=one.force[chosen],
            base=one.base[chosen],
        ),
    )


def _repeated(log: LogWindows) -> LogWindows:
    """Return a log of two hours that repeats the windows of a shorter one."""
    times = -(-ROWS_A_LOG // log.rows)

    def windows(one: WeakRows) -> WeakRows:
        tiled = {field.name: np.concatenate([getattr(one, field.name)] * times) for field in fields(WeakRows)}
        tiled["run"] = np.concatenate([one.run + number * (int(one.run[-1]) + 1) for number in range(times)])
        return WeakRows(**tiled)

    def load(one: LoadSamples | None) -> LoadSamples | None:
        if one is None:
            return None
        return replace(one, psi=np.concatenate([one.psi] * times), nu=np.concatenate([one.nu] * times))

    parts = tuple(
        replace(
            part,
            measured=windows(part.measured),
            steadied=windows(part.steadied),
            load_measured=load(part.load_measured),
            load_steadied=load(part.load_steadied),
            second=np.concatenate([part.second] * times),
            nu=np.concatenate([part.nu] * times),
            rows=part.rows * times,
            blocks=part.blocks * times,
        )
        for part in log.parts
    )
    return replace(log, rows=log.rows * times, parts=parts)


def _one_pass(rows: int) -> float:
    part = min(rows, 10_000_000)
    random = np.random.default_rng(0)
    nu, nu_dot, residual = (random.standard_normal((part, 3)) for _ in range(3))
    piece = of_motion((nu, nu_dot), residual, make_basis("modulus"))
    start = time.perf_counter()
    CrossProducts.of(piece)
    return (time.perf_counter() - start) * rows / part


def _start_up(repeats: int) -> tuple[list[Row | Timed], dict[str, float]]:
    """Return how long the command line takes to say what it is, and what Python and its parser take of that [s]."""
    main = "from ferryid.cli.main import main; main()"
    works = {
        "--help": (main, "--help"),
        "--version": (main, "--version"),
        "typer": ("import typer",),
        "Python": ("pass",),
    }

    def process(words: Sequence[str]) -> Callable[[], object]:
        return lambda: subprocess.run([sys.executable, "-c", *words], check=True, capture_output=True)

    times = dict(zip(works, in_turn([process(words) for words in works.values()], repeats), strict=True))
    middle = {name: statistics.median(took) for name, took in times.items()}
    rows = [Timed(f"ferryid {name}, whole process", middle[name], HELP_GOAL_S) for name in ("--help", "--version")]
    return rows, {"import typer, whole process": middle["typer"], "bare Python, whole process": middle["Python"]}
