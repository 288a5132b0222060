"""A Dask cluster on this machine, and processes that find these tests."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.batch.work import environment

ROOT = str(Path(__file__).resolve().parents[2])


@pytest.fixture(autouse=True)
def importable(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let processes that are started afresh import what tests hand to them."""
    monkeypatch.syspath_prepend(ROOT)


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """Address of a scheduler, and the processes: its own and two workers."""
    pytest.importorskip("distributed")
    where = tmp_path / "scheduler.json"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": tmp_path, "env": environment()}
    python = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"]
    started = [subprocess.Popen([*python, "--no-dashboard", "--scheduler-file", where], **quiet)]
    worker = [sys.executable, "-m", "distributed.cli.dask_worker", "--scheduler-file", where, "--no-nanny"]
    try:
        deadline = time.monotonic() + 60.0
        while not where.exists():
            assert time.monotonic() < deadline, "no scheduler"
            time.sleep(0.1)
        options = ["--nthreads", "1", "--no-dashboard", "--host", "127.0.0.1", "--memory-limit", "0"]
        started += [subprocess.Popen([*worker, *options], **quiet) for _ in range(2)]
        yield json.loads(where.read_text())["address"], started
    finally:
        for process in started:
            process.kill()
            process.wait()
