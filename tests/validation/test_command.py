"""`ferryid prove`: what it prints where, its JSON, and how it ends."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import ferryid.cli
from ferryid.validation import evaluators
from tests.batch.work import children_of, default_interrupts, ended, environment
from tests.cli.conftest import ferryid as ferryid_fixture
from tests.cli.test_every_command import conforms
from tests.validation.stand_ins import PIPELINE, TALLY

pytestmark = pytest.mark.slow

ferryid_run = ferryid_fixture


@pytest.fixture(autouse=True)
def pretended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Small logs that hold nothing."""
    monkeypatch.setattr(evaluators, "pipeline", lambda: PIPELINE)
    monkeypatch.setenv(TALLY, str(tmp_path / "tally"))


def test_results_to_standard_output_and_the_seed_to_standard_error(ferryid_run, tmp_path: Path) -> None:
    run = ferryid_run(
        "prove", "--runs", "2", "--processes", "1", "--out", tmp_path / "out", "--json", tmp_path / "a.json"
    )
    assert run.code == 0, run.err
    result = conforms((tmp_path / "a.json").read_text("utf-8"))
    assert f"--seed {result['seed']} --runs 2" in run.err
    assert result["commitment"] in run.err
    assert len(run.err.splitlines()) == 2, "silent but for these when piped"
    assert "2 diagnosed, 0 refused, 0 crashed" in run.out
    assert "reached     every log has a verdict" in run.out
    assert "not tested  no log is wrong" in run.out

    again = ferryid_run(
        "prove",
        "--seed",
        str(result["seed"]),
        "--runs",
        "2",
        "--processes",
        "1",
        "--out",
        tmp_path / "out",
        "--json",
        "-",
    )
    assert conforms(again.out) == result

    checked = ferryid_run("prove", "--check", tmp_path / "out" / "proof")
    assert (checked.code, checked.err) == (0, "")
    assert "the answers to 2 cases match their commitment" in checked.out
    path = tmp_path / "out" / "proof" / "answers.json"
    path.write_text(path.read_text("utf-8").replace('"cell": "wind"', '"cell": "wend"'), encoding="utf-8")
    checked = ferryid_run("prove", "--check", tmp_path / "out" / "proof")
    assert checked.code == 2
    assert "does not match its commitment" in checked.err


def test_a_cluster_that_cannot_be_used_is_one_line(
    ferryid_run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ferryid.batch.spread.ANSWER_S", 1.0)
    run = ferryid_run("prove", "--runs", "1", "--dask", "tcp://127.0.0.1:9", "--out", tmp_path / "out")
    assert run.code == 2
    assert run.err.splitlines()[-1].startswith("ferryid: --dask tcp://127.0.0.1:9: no scheduler answers there")
    monkeypatch.setitem(sys.modules, "distributed", None)
    run = ferryid_run("prove", "--runs", "1", "--dask", "tcp://127.0.0.1:9", "--out", tmp_path / "out")
    assert run.code == 2
    assert "Fix: pip install distributed" in run.err
    assert ferryid_run("prove", "--processes", "0", "--out", tmp_path / "out").code == 2


@pytest.mark.parametrize(
    ("processes", "number"), [(1, signal.SIGINT), (2, signal.SIGTERM)], ids=["interrupt", "terminate"]
)
def test_it_ends_at_once_with_all_its_processes(tmp_path: Path, number: signal.Signals, processes: int) -> None:
    cli, script = str(Path(ferryid.cli.__path__[0])), tmp_path / "script.py"
    # What diagnoses is real where an interrupt reaches it as well; the processes of a pool import this file.
    script.write_text(
        f"""
import importlib.util, sys
from functools import partial
from ferryid.validation import worker_client
from tests.validation.stand_ins import PIPELINE, QUICK

if {processes} > 1:
    worker_client.WorkerClient = partial(worker_client.WorkerClient, program=QUICK)
place = {cli!r}
spec = importlib.util.spec_from_file_location("ferryid.cli", place + "/__init__.py", submodule_search_locations=[place])
sys.modules["ferryid.cli"] = importlib.util.module_from_spec(spec)
spec.loader.exec_module(sys.modules["ferryid.cli"])

if __name__ == "__main__":
    from ferryid.validation import evaluators
    evaluators.pipeline = lambda: PIPELINE
    from ferryid.cli.main import main
    main()
""",
        encoding="utf-8",
    )
    lines = tmp_path / "out" / "proof" / "lines" / "diagnosed.jsonl"
    options = ["--seed", "3", "--runs", "60", "--processes", str(processes), "--out", tmp_path / "out"]
    with subprocess.Popen(
        [sys.executable, script, "prove", *options],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=default_interrupts,
        env=environment(),
    ) as working:
        deadline = time.monotonic() + 60.0
        while not (lines.exists() and lines.read_bytes().count(b"\n") >= 3):
            assert time.monotonic() < deadline
            assert working.poll() is None
            time.sleep(0.002)
        children = children_of(working.pid)
        # As a terminal does: to all of them.
        os.killpg(working.pid, number) if number == signal.SIGINT else working.send_signal(number)
        assert working.stderr is not None
        told = working.stderr.read()
    assert working.returncode == (130 if number == signal.SIGINT else 143), told
    assert told.splitlines()[-1] == "ferryid: interrupted, nothing half-written was left", told
    assert len(told.splitlines()) == 3, told
    assert ended(children)
    done = [json.loads(line) for line in lines.read_text("utf-8").splitlines()]
    assert {one["result"]["verdict"] for one in done} == {"not_testable"}
