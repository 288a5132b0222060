"""A sample of the faults: the same command goes on after each, and its result is that of an undisturbed run."""

from __future__ import annotations

import random
import subprocess
import sys
from pathlib import Path

import pytest

from tests.batch.work import environment
from tests.faults import disk
from tests.faults.system import Operation

SAMPLE = 8


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="forks, and reads /proc")
def test_after_any_fault_the_same_command_goes_on_to_the_same_result() -> None:
    seed = random.SystemRandom().randrange(10**6)
    command = [sys.executable, "-m", "tests.faults", "ingest", "archive", "diagnose"]
    done = subprocess.run(
        [*command, "--sample", str(SAMPLE), "--seed", str(seed)], capture_output=True, text=True,
        env={**environment(), "OPENBLAS_NUM_THREADS": "1"}, timeout=300.0,
    )  # fmt: skip
    print(done.stdout)
    assert done.returncode == 0, done.stdout + done.stderr


def left(tmp_path: Path, operations: list[Operation], variant: str, seed: int = 0) -> dict[str, bytes]:
    start = tmp_path / "start"
    start.mkdir(exist_ok=True)
    (start / "a").write_bytes(b"old")
    node = disk.after(start, operations, variant, seed)
    return {name: one.content for name, one in node.names.items()}


def test_what_was_not_synced_is_lost(tmp_path: Path) -> None:
    unsynced = [Operation("create", "b"), Operation("write", "b", content=b"new"), Operation("rename", "b", "a")]
    assert left(tmp_path, unsynced, "nothing kept") == {"a": b"old"}
    assert left(tmp_path, unsynced, "names kept") == {"a": b""}
    every = {tuple(left(tmp_path, unsynced, "mixed", seed).items()) for seed in range(100)}
    assert len(every) > 4
    synced = [*unsynced[:2], Operation("fsync", "b"), unsynced[2]]
    assert left(tmp_path, synced, "nothing kept") == {"a": b"old"}
    assert left(tmp_path, synced, "names kept") == {"a": b"new"}
    synced.append(Operation("fsync", "."))
    assert {left(tmp_path, synced, one)["a"] for one in disk.VARIANTS} == {b"new"}
