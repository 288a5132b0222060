"""A validation run as a whole: committed before it diagnoses, published afterwards, resumed wherever it was killed."""

from __future__ import annotations

import errno
import json
import re
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from ferryid.batch.spread import spread
from ferryid.errors import FerryIdError
from ferryid.files import unwritable
from ferryid.validation import run as running
from ferryid.validation import stages, worker_client
from ferryid.validation.checkpoint import completed, run_stage
from ferryid.validation.commitment import verified_answers
from ferryid.validation.interfaces import Evaluator
from ferryid.validation.records import Diagnosis
from ferryid.validation.run import render_summary, run_validation
from ferryid.validation.source_hash import source_hash
from ferryid.validation.stages import LogJob, diagnose_case
from ferryid.validation.worker_client import WorkerClient
from tests.batch.work import children_of, ended, environment
from tests.validation.stand_ins import PIPELINE, QUICK, TALLY, OracleMade, chatty, counted

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def tally(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Count what is done."""
    (tmp_path / "tally").touch()
    monkeypatch.setenv(TALLY, str(tmp_path / "tally"))


class Here:
    """Answers as a worker does, in this process: for what a run does with diagnoses, wherever and however they are made."""

    sources = source_hash()

    def diagnose(
        self, log: Path, profile: Path, out: Path, more: Sequence[Path] = (), before: Sequence[Path] = ()
    ) -> Diagnosis:
        assert log.exists()
        assert profile.exists()
        return Diagnosis("not_testable", 0.0)


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Start no process to diagnose, and diagnose nothing."""
    monkeypatch.setattr(stages, "worker_of", lambda folder: Here())


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Start processes that answer at once: for what becomes of them."""
    monkeypatch.setattr(worker_client, "WorkerClient", partial(WorkerClient, program=QUICK))


def validated(out: Path, pipeline: Any = PIPELINE, **options: Any) -> tuple[dict[str, Any], list[str]]:
    announced: list[str] = []
    options = {"seed": 7, "runs": 4, "processes": 1, "progress": lambda stage: None, **options}
    return run_validation(out, pipeline, announce=announced.append, **options), announced


def lines(out: Path, stage: str) -> list[dict[str, Any]]:
    (path,) = (out / "proof" / "lines").glob(f"{stage}*.jsonl")
    return [json.loads(line) for line in path.read_text("utf-8").splitlines()]


def conforms(result: dict[str, Any]) -> None:
    schema = json.loads(files("ferryid.schemas").joinpath("prove.json").read_text("utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(result, schema)


def test_from_the_draw_to_the_scores(tmp_path: Path) -> None:
    # The only one that diagnoses; one case of each format, and a second one of the first.
    out, stages = tmp_path / "out", []
    result, announced = validated(out, runs=4, processes=2, progress=stages.append)
    conforms(result)
    names = [f"{number:04d}" for number in range(4)]
    assert result["counts"] == {"cases": 4, "diagnosed": 4, "refused": 0, "crashed": 0}
    assert result["scores"]["verdicts"] == ["not_testable"] * 4
    assert announced[0].startswith("seed 7; if interrupted, go on with: ferryid prove --seed 7 --runs 4 --out ")
    assert announced[-1] == f"commitment to 4 answers: {result['commitment']}"
    assert [one["case"]["name"] for one in result["scores"]["of"]] == names
    for one in result["scores"]["of"]:
        north = one["case"]["truths"][0]["values"]["north"]
        assert one["oracle"] == {"north": north, "log": True}
        assert one["realised"] == {"wind": {"force": pytest.approx(0.1 + north)}}
        if one["case"]["name"] == "0001":
            assert one["transfer"] == {"error": "this one cannot be used. Fix: none"}
        elif one["case"]["name"] == "0002":
            assert one["transfer"] is None
        else:
            assert one["transfer"]["log"].startswith(one["case"]["name"])
    assert json.loads((out / "proof" / "result.json").read_text("utf-8")) == result
    answers = verified_answers(out / "proof")
    assert [case["name"] for case in answers["cases"]] == names
    assert answers["seed"] == 7
    assert answers["realised"]["0000"] == result["scores"]["of"][0]["realised"]
    # The transfer logs are gone, what was diagnosed is kept, alone with its profile.
    assert not (out / "proof" / "transfer").exists()
    for one in result["scores"]["of"]:
        there = {path.name for path in (out / "proof" / "logs" / one["case"]["name"]).iterdir()}
        assert len(there) == 2
        assert "vessel.toml" in there
    assert any(re.fullmatch(r"diagnosing: 4 of 4, stage 2 of 4, .+ left in all", stage) for stage in stages)
    assert stages[-1] == ""
    assert "4 cases of seed 7: 4 diagnosed, 0 refused, 0 crashed" in render_summary(result)
    # Nothing is left to do another time.
    before = counted()
    again, announced = validated(out, runs=4)
    assert again == result
    assert "completed cases of this folder's run are kept" in announced
    assert counted() == before


@pytest.mark.usefixtures("quick")
def test_no_answer_is_on_disk_before_all_logs_are_diagnosed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: dict[str, bytes] = {}

    def note(when: str) -> None:
        seen.update({f"{when}: {path}": path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()})

    def look(stage: str, *rest: Any, **options: Any) -> Any:
        if stage not in ("writing logs", "diagnosing"):
            return run_stage(stage, *rest, **options)
        note(stage)
        found = run_stage(stage, *rest, **options)
        note(f"after {stage}")
        return found

    monkeypatch.setattr(running, "run_stage", look)
    seed = 123_456_789_012
    result, _ = validated(tmp_path / "out", seed=seed)
    assert not any(name.endswith("answers.json") for name in seen)
    truth = result["scores"]["of"][0]
    words = [str(seed), str(truth["case"]["seed"]), str(truth["realised"]["wind"]["force"]), "north"]
    ours = {name: data for name, data in seen.items() if "/logs/" not in name and not name.endswith("tally")}
    assert len(ours) >= 12
    for name, data in ours.items():
        for word in words:
            assert word.encode() not in data, f"{name} has {word}"
    # The commitment is published before the first log is written.
    seal = json.loads(seen[f"writing logs: {tmp_path / 'out' / 'proof' / 'seal.json'}"])
    assert seal["commitment"] == result["commitment"]


def test_on_a_cluster(tmp_path: Path, cluster: tuple[str, list[Any]], monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(stages, "worker_of", lambda folder: Here())
        here = validated(tmp_path / "here", runs=3)[0]
    there = validated(tmp_path / "there", runs=3, dask=cluster[0])[0]
    conforms(there)
    assert there["counts"] == here["counts"]
    assert there["guard"] == here["guard"] == "process"
    assert there["scores"]["verdicts"] == here["scores"]["verdicts"]


def test_a_worker_of_other_sources_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "logs" / "a").mkdir(parents=True)
    (tmp_path / "logs" / "a" / "a.mcap").touch()
    (tmp_path / "logs" / "a" / "vessel.toml").touch()
    with pytest.raises(
        FerryIdError, match=r"other sources of ferryid .* than those of the commitment \(older\)\. Fix: "
    ):
        diagnose_case(LogJob(tmp_path, "older", "a", "a.mcap", "vessel.toml"))
    with pytest.raises(FerryIdError, match=r"not found by the process .* all workers of the cluster see"):
        diagnose_case(LogJob(tmp_path, "older", "b", "b.mcap", "vessel.toml"))


@pytest.mark.usefixtures("here")
def test_a_fresh_seed_each_time(tmp_path: Path) -> None:
    seeds = [validated(tmp_path / name, seed=None, runs=0)[0]["seed"] for name in ("a", "b")]
    assert seeds[0] != seeds[1]
    assert max(seeds) < 2**48
    with pytest.raises(FerryIdError, match=r"--seed: -1 is negative\. Fix: "):
        validated(tmp_path, seed=-1)


SCRIPT = """
import sys, time
from functools import partial
from pathlib import Path
from ferryid.validation import worker_client
from ferryid.validation.run import run_validation
from tests.validation.stand_ins import PIPELINE, QUICK

# In the processes that the run starts as well: they import this file.
worker_client.WorkerClient = partial(worker_client.WorkerClient, program=QUICK)

def wait(stage):
    if stage.startswith(sys.argv[2]):
        (Path(sys.argv[1]).parent / "waits").touch()
        time.sleep(60.0)

if __name__ == "__main__":
    run_validation(Path(sys.argv[1]), PIPELINE, seed=7, runs=8, processes=2, progress=wait, announce=lambda line: None)
"""


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("stage", "title"), [("written", "writing logs"), ("diagnosed", "diagnosing"), ("transfer", "transfer")]
)
def test_killed_in_the_middle_it_repeats_nothing_and_loses_nothing(tmp_path: Path, stage: str, title: str) -> None:
    out, script = tmp_path / "out", tmp_path / "script.py"
    script.write_text(SCRIPT, encoding="utf-8")
    folder = out / "proof" / "lines"

    with subprocess.Popen([sys.executable, script, out, f"{title}: 3 of 8"], env=environment()) as working:
        deadline = time.monotonic() + 60.0
        while not (tmp_path / "waits").exists():
            assert working.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.01)
        children = children_of(working.pid)
        working.send_signal(signal.SIGKILL)
    assert ended(children), "processes go on that nobody waits for"
    (path,) = folder.glob(f"{stage}*.jsonl")
    before = {one: one.read_bytes() for one in folder.iterdir()}
    assert before[path].count(b"\n") == 3
    first = counted()
    (out / "proof" / "logs" / f".0000.{0:032x}.part").mkdir()
    with path.open("ab") as file:
        file.write(b'{"name": "0007", "resu')

    result, announced = validated(out, runs=8)
    assert "completed cases of this folder's run are kept" in announced
    assert result["counts"]["diagnosed"] == 8
    for one, data in before.items():
        assert one.read_bytes().startswith(data[: data.rfind(b"\n") + 1]), f"{one.name} was written again"
    for name in ("written", "diagnosed", "oracle", "transfer"):
        assert sorted(line["name"] for line in lines(out, name)) == [f"{number:04d}" for number in range(8)]
    # At most what each of two processes was at when it was killed is done twice.
    work = {"written": "generate {} False", "transfer": "transfer {}"}
    if stage in work:
        twice = [n for n in range(8) if counted().count(work[stage].format(f"{n:04d}")) > 1]
        assert len(twice) <= 3
        assert len(first) >= 3
    assert not (out / "proof" / "scratch").exists()
    assert not list((out / "proof" / "logs").glob(".*"))


@pytest.mark.usefixtures("quick")
def test_other_sources_or_another_seed_begin_from_the_start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "out"
    first, _ = validated(out)
    (out / "proof" / "mine.txt").write_text("not ours", encoding="utf-8")
    other, announced = validated(out, seed=8)
    assert any("of another seed, --runs or --only, is finished" in line for line in announced)
    assert other["commitment"] != first["commitment"]
    assert other["counts"]["diagnosed"] == 4, (
        "the process that served the folder before it was emptied cannot see it now"
    )
    fewer, _ = validated(out, seed=8, runs=3)
    assert fewer["counts"]["cases"] == 3
    assert sorted(path.name for path in (out / "proof" / "logs").iterdir()) == ["0000", "0001", "0002"]
    data = json.loads((out / "proof" / "run.json").read_text("utf-8"))
    (out / "proof" / "run.json").write_text(json.dumps({**data, "sources": "older"}), encoding="utf-8")
    count = len(counted())
    _, announced = validated(out, seed=8, runs=3)
    assert any("sources of ferryid have changed" in line for line in announced)
    assert len(counted()) > count
    assert (out / "proof" / "mine.txt").exists()


@pytest.mark.usefixtures("here")
def test_a_draw_that_cannot_be_leaves_no_trace_and_a_command_can_be_pasted(tmp_path: Path) -> None:
    def refused(seed: int, runs: float, only: Any) -> Any:
        raise FerryIdError("no such cell. Fix: another")

    out = tmp_path / "an out"
    with pytest.raises(FerryIdError, match="no such cell"):
        validated(out, replace(PIPELINE, draw=refused), only=("winds",))
    assert not out.exists()
    _, announced = validated(out, runs=1, only=("short: wind",))
    words = shlex.split(announced[0].partition("go on with: ")[2])
    assert words[words.index("--only") + 1] == "short: wind"
    assert words[words.index("--out") + 1] == str(out)


@pytest.mark.parametrize("run", [None, "{"])
def test_other_files_are_left_alone(tmp_path: Path, run: str | None) -> None:
    mine = tmp_path / "out" / "proof" / "logs" / "trial.bag"
    mine.parent.mkdir(parents=True)
    mine.write_text("a trial", encoding="utf-8")
    if run is not None:
        (tmp_path / "out" / "proof" / "run.json").write_text(run, encoding="utf-8")
    with pytest.raises(FerryIdError, match=r"holds (logs|run\.json), but no run\.json of a run .* Fix: remove or move"):
        validated(tmp_path / "out")
    assert mine.read_text("utf-8") == "a trial"
    assert counted() == []


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("stage", "result"),
    [("diagnosed", None), ("diagnosed", {}), ("written", None), ("written", 1), ("written", "xyz"), ("oracle", 1)],
)
def test_lines_that_ferryid_has_not_written(tmp_path: Path, stage: str, result: Any) -> None:
    out = tmp_path / "out"
    validated(out, runs=2)
    (path,) = (out / "proof" / "lines").glob(f"{stage}*.jsonl")
    path.write_text(json.dumps({"name": "0000", "result": result}) + "\n", encoding="utf-8")
    with pytest.raises(FerryIdError, match=rf"{stage}.*\.jsonl: holds a line that ferryid has not written"):
        validated(out, runs=2)


@pytest.mark.usefixtures("here")
def test_a_full_disk_is_no_result(tmp_path: Path) -> None:
    def full(trial: Any) -> Any:
        (trial.folder / "half").mkdir(parents=True)
        raise unwritable(trial.folder, OSError(errno.ENOSPC, "no space"))

    out = tmp_path / "out"
    with pytest.raises(FerryIdError, match="the disk is full"):
        validated(out, replace(PIPELINE, evaluators={"oracle": Evaluator(full, OracleMade)}), runs=2)
    assert lines(out, "oracle") == []
    assert not (out / "proof" / "transfer").exists(), "nothing half-done is left"
    # With space again, all is done that was not.
    result, _ = validated(out, runs=2)
    assert [one["oracle"]["log"] for one in result["scores"]["of"]] == [True, True]


@pytest.mark.usefixtures("here")
def test_an_unfinished_run_is_not_thrown_away(tmp_path: Path) -> None:
    out = tmp_path / "out"
    validated(out)
    (out / "proof" / "result.json").unlink()
    with pytest.raises(FerryIdError, match="holds an unfinished run"):
        validated(out, seed=8)
    with pytest.raises(FerryIdError, match="holds an unfinished run"):
        validated(out, runs=3)
    count = len(counted())
    validated(out)
    assert len(counted()) == count, "with its own seed it goes on where it was"


@pytest.mark.usefixtures("here")
def test_other_evaluators_run_again_without_another_diagnosis(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "out"
    validated(out)
    kept = (out / "proof" / "lines" / "diagnosed.jsonl").read_bytes()
    stamp = running.source_hash
    monkeypatch.setattr(running, "source_hash", lambda *, evaluation=False: "other" if evaluation else stamp())
    validated(out)
    assert counted().count("oracle 0000") == 2
    assert counted().count("generate 0000 False") == 1
    assert (out / "proof" / "lines" / "diagnosed.jsonl").read_bytes() == kept


@pytest.mark.usefixtures("here")
def test_another_draw_than_the_committed_one_is_refused(tmp_path: Path) -> None:
    validated(tmp_path / "out", runs=2)
    other = replace(PIPELINE, draw=lambda seed, runs, only: PIPELINE.draw(seed + 1, runs, only))
    with pytest.raises(FerryIdError, match="not the commitment to what this seed draws"):
        validated(tmp_path / "out", other, runs=2)


@pytest.mark.usefixtures("here")
def test_a_changed_or_missing_commitment_is_refused(tmp_path: Path) -> None:
    out = tmp_path / "out"
    validated(out, runs=2)
    path = out / "proof" / "seal.json"
    public = json.loads(path.read_text("utf-8"))
    path.write_text(json.dumps({**public, "commitment": "0" * 64}), encoding="utf-8")
    with pytest.raises(FerryIdError, match=r"seal\.json: not the commitment to what this seed draws"):
        validated(out, runs=2)
    path.unlink()
    with pytest.raises(FerryIdError, match=r"seal\.json is gone"):
        validated(out, runs=2)


def test_a_folder_of_an_earlier_version_is_refused_in_one_line(tmp_path: Path) -> None:
    folder = tmp_path / "out" / "proof"
    folder.mkdir(parents=True)
    (folder / "answers.sealed").write_bytes(b"encrypted")
    (folder / "run.json").write_text(json.dumps({"salt": "00", "mark": "ab", "sources": "cd"}), encoding="utf-8")
    with pytest.raises(
        FerryIdError, match=r"holds a run of an earlier version .*answers\.sealed.* Fix: remove or move"
    ):
        validated(tmp_path / "out")
    # A run that was killed before it sealed its answers.
    (folder / "answers.sealed").unlink()
    with pytest.raises(FerryIdError, match=r"holds run\.json, but no run\.json of a run that can be continued"):
        validated(tmp_path / "out")
    assert counted() == []


@pytest.mark.usefixtures("here")
def test_a_log_that_somebody_removed_is_written_again(tmp_path: Path) -> None:
    out = tmp_path / "out"
    first, _ = validated(out, runs=3)
    for path in (out / "proof" / "logs" / "0001").iterdir():
        path.unlink()
    (out / "proof" / "logs" / "0001").rmdir()
    assert validated(out, runs=3)[0] == first
    assert counted().count("generate 0001 False") == 2
    assert counted().count("generate 0002 False") == 1


def test_beside_a_log_lies_nothing_but_its_profile(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"may be its profile only, found truth\.json"):
        validated(tmp_path / "out", replace(PIPELINE, generate=chatty))
    assert not list((tmp_path / "out" / "proof" / "logs").iterdir())


@pytest.mark.usefixtures("here")
def test_two_at_once_do_not_share_a_folder(tmp_path: Path) -> None:
    refused = []

    def generate(case: Any, folder: Path, *, transfer: bool = False) -> Any:
        with pytest.raises(FerryIdError, match="another process is at work in it"):
            validated(tmp_path / "out")
        refused.append(case.name)
        return PIPELINE.generate(case, folder, transfer=transfer)

    validated(tmp_path / "out", replace(PIPELINE, generate=generate), runs=1)
    assert refused


def test_damaged_lines_are_done_again(tmp_path: Path) -> None:
    path = tmp_path / "lines.jsonl"
    path.write_bytes(b'{"name": "a", "result": 1}\n\x00\x00\n[]\n{"name": "b", "result": 2}\n{"name": "c", "re')
    assert completed(path) == {"a": 1, "b": 2}
    work = {"c": 3, "a": 1, "b": 2}
    with spread() as workers:
        done = run_stage("counting", path, work, lambda one: 10 * one, workers, progress=lambda stage: None)
    assert done == {"c": 30, "a": 1, "b": 2}
    assert list(done) == ["c", "a", "b"]
    assert completed(path) == done
