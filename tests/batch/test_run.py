"""A batch as a whole: bad logs are rows, and what is done stays done, whatever ends it."""

from __future__ import annotations

import errno
import json
import os
import pickle
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from ferryid.batch import kept, steps, task
from ferryid.batch import run as running
from ferryid.batch.log_result import LogFile, LogResult, StepSummary
from ferryid.batch.remaining import Remaining, told_time
from ferryid.batch.spread import Spread, spread
from ferryid.errors import FerryIdError, UnwritableError
from ferryid.files import dump_json, unwritable
from ferryid.report.batch_rows import BatchResult
from ferryid.vessel import load_profile
from tests.batch.archive import archive, recipe, rows_of, run, same, stay_here
from tests.batch.work import blank, children_of, deadly, default_interrupts, ended, environment
from tests.cli.test_every_command import conforms
from tests.report.pages import NEEDS_UPLOT

pytestmark = pytest.mark.slow

FIT = """steps = ["fit"]
[fit]
delta = 0.4
sigma = 0.4
draws = 20
estimator = "derivative"
report = false
"""
"""The quickest fit: what becomes of fits is tried here, not which is the better."""


def statuses(result: BatchResult) -> dict[str, str]:
    return {row.name: row.status for row in result.rows}


def results(folder: Path) -> Path:
    return folder / "out" / "batch" / "results"


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Work in this process: for what becomes of rows and results, whichever process makes them."""
    stay_here(monkeypatch)


@pytest.mark.usefixtures("here")
def test_a_bad_log_is_a_row_and_the_rest_goes_on(tmp_path: Path) -> None:
    logs = archive(tmp_path, 2)
    recipe(tmp_path)
    (logs / "a_broken.mcap").write_bytes(b"")
    (logs / "z_other.txt").write_text("not a log\n", encoding="utf-8")
    (logs / "list.csv").write_text(
        "log\nday0.mcap\nday1.mcap\na_broken.mcap\nz_other.txt\ngone.mcap\n", encoding="utf-8"
    )
    result, told = run(tmp_path, logs / "list.csv")
    assert statuses(result) == {
        "day0": "done", "day1": "done", "a_broken": "refused", "z_other": "refused", "gone": "refused",
    }  # fmt: skip
    assert [line for line in told if line.startswith("refused: ")] == told
    assert told[0] == f"refused: {logs / 'a_broken.mcap'}: {result.rows[2].reason}"
    assert result.rows[2].reason.startswith("the file is empty, a log was expected, found 0 bytes. Fix: ")
    assert result.counts == {
        "logs": 5, "done": 2, "partly": 0, "refused": 3, "failed": 0, "memory": 0, "lost": 0, "done_before": 0,
    }  # fmt: skip
    # Refused ones are no more tried than others, until they change or somebody asks.
    again, told = run(tmp_path, logs / "list.csv")
    assert told == ["5 of 5 logs done already, 3 of them in vain (--again tries these again); 0 left"]
    assert same(again) == same(result)
    shutil.copy(logs / "day0.mcap", logs / "gone.mcap")
    again, told = run(tmp_path, logs / "list.csv")
    assert again.rows[4].status == "done"
    assert again.counts["done_before"] == 4
    before = rows_of(tmp_path)
    again, told = run(tmp_path, logs / "list.csv", again=True)
    assert again.counts["done_before"] == 3
    assert len(set(before.items()) - set(rows_of(tmp_path).items())) == 2


LOADED = """
import pickle, sys
from ferryid.batch import task
with open(sys.argv[1], "rb") as file:
    print(task.work(pickle.load(file)).status)
print(*sorted({".".join(name.split(".")[:2]) for name in sys.modules}))
"""


def test_a_process_that_evaluates_loads_no_diagnosis_and_draws_nothing(one: task.Task, tmp_path: Path) -> None:
    (tmp_path / "task").write_bytes(pickle.dumps(one))
    words = [sys.executable, "-c", LOADED, str(tmp_path / "task")]
    run = subprocess.run(words, capture_output=True, text=True, check=True, env=environment())
    status, loaded = run.stdout.splitlines()
    assert status == "done"
    assert not {"ferryid.diagnose", "matplotlib", "jinja2", "pandas", "numba"} & set(loaded.split())


@pytest.fixture(scope="module")
def two_processes() -> Iterator[Spread]:
    """Two other processes, which are started once: each loads for a second or two what a log needs."""
    with spread(2) as pool:
        yield pool


@pytest.fixture
def elsewhere(monkeypatch: pytest.MonkeyPatch, two_processes: Spread) -> None:
    """Work in these processes, and leave figures blank there as well."""
    monkeypatch.setattr(running, "spread", lambda processes, dask, *, apart: nullcontext(two_processes))
    monkeypatch.setattr(running, "work", blank)


@pytest.mark.usefixtures("elsewhere")
def test_every_step_of_one_log(tmp_path: Path) -> None:
    logs = archive(tmp_path, 1)
    recipe(tmp_path, '[fit]\ndelta = 0.4\nsigma = 0.4\naccept = "thesis"\ndraws = 20\n')
    result, _ = run(tmp_path, logs / "*.mcap")
    (row,) = result.rows
    assert row.status == "done", row.reason
    folder = tmp_path / "out" / "batch" / row.folder
    fitted = json.loads((folder / row.fit.report).with_name("fit.json").read_text("utf-8"))
    assert row.fit.normalised_mse == fitted["scores"]["normalised_mse"]
    assert row.fit.accepted
    # Results of a log are its own: its model is no version of anybody else's.
    assert json.loads((folder / row.fit.model).read_text("utf-8"))["version"] == 1
    assert row.fit.model.startswith("models/milliampere-day0/")
    evaluated = json.loads((folder / row.evaluate.file).read_text("utf-8"))
    assert row.evaluate.mse == evaluated["logs"][0]["mse"]["model"]
    assert evaluated["logs"][0]["mse"]["model"] == pytest.approx(evaluated["logs"][0]["mse"]["base"])
    diagnosed = json.loads((folder / row.diagnose.report).with_name("diagnosis.json").read_text("utf-8"))
    assert row.diagnose.verdict == diagnosed["verdict"]
    assert Path(diagnosed["report"]).exists()
    assert (row.date, row.date_from) == ("2021-04-20T10:00:00+00:00", "log")
    assert set(row.seconds) == {"read", "fit", "evaluate", "diagnose"}
    assert 1 << 27 < row.peak_bytes <= result.memory.limit_bytes
    # The tables are where other commands look for them.
    assert list((tmp_path / "out" / "logs").glob("day0-*/*.parquet"))


@pytest.mark.usefixtures("here")
def test_what_one_step_refuses_another_may_take(tmp_path: Path) -> None:
    logs = tmp_path / "season"
    logs.mkdir()
    shutil.copy(archive(tmp_path / "season", 1).parents[1] / "season" / "season" / "day0.mcap", logs / "long.mcap")
    shutil.copytree(Path(__file__).resolve().parents[2] / "fixtures" / "short_ros2", logs / "brief")
    recipe(tmp_path, 'steps = ["fit", "evaluate"]\n[fit]\ndraws = 20\nestimator = "derivative"\nreport = false\n')
    result, told = run(tmp_path, logs / "long.mcap", logs / "brief")
    assert statuses(result) == {"long": "done", "brief": "partly"}
    row = result.rows[1]
    assert row.fit is None
    assert row.evaluate.mse["surge"] > 0.0
    assert row.reason.startswith("fit: too short for three blocks")
    assert told == [f"partly: {logs / 'brief'}: {row.reason}"]


@pytest.mark.parametrize("wanted", [True, False])
@pytest.mark.usefixtures("here")
def test_a_fit_without_its_page(tmp_path: Path, wanted: bool) -> None:
    logs = archive(tmp_path, 1)
    recipe(tmp_path, FIT if not wanted else FIT.replace("report = false", "report = true"))
    result, _ = run(tmp_path, logs / "*.mcap")
    (row,) = result.rows
    folder = tmp_path / "out" / "batch" / row.folder
    assert row.fit.accepted == json.loads((folder / row.fit.model).read_text("utf-8"))["accepted"]
    assert [path.name for path in folder.rglob("report.html")] == ["report.html"] * wanted
    assert (row.fit.report is not None) == wanted
    data = conforms((tmp_path / "out" / "batch" / "batch.json").read_text("utf-8"))
    assert data["rows"][0]["fit"]["report"] == row.fit.report
    assert ("report.html" in Path(result.page).read_text("utf-8")) == wanted
    table = pq.read_table(result.summary).column("fit_report").to_pylist()
    assert table == [f"{row.folder}/{row.fit.report}" if wanted else None]


@NEEDS_UPLOT
@pytest.mark.usefixtures("here")
def test_the_interactive_figures_of_the_page_lie_where_it_looks_for_them(tmp_path: Path) -> None:
    recipe(tmp_path, FIT)
    result, _ = run(tmp_path, archive(tmp_path, 2) / "*.mcap")
    page = Path(result.page)
    text = page.read_text("utf-8")
    scripts = re.findall(r'src="([^"]+)"', text)
    assert scripts[-1] == "timeline.js"
    assert all((page.parent / script).resolve().is_file() for script in scripts)
    assert (page.parent / scripts[0]).resolve().is_relative_to((tmp_path / "out" / "reports" / "assets").resolve())
    assert page.with_name("timeline.js").read_text("utf-8").count('"Force errors, milliampere"') == 1


@pytest.mark.usefixtures("here")
def test_another_recipe_profile_or_model_is_another_result(tmp_path: Path) -> None:
    logs = archive(tmp_path, 2)
    recipe(tmp_path, FIT)
    first, _ = run(tmp_path, logs / "*.mcap")
    recipe(tmp_path, FIT.replace("20", "30"))
    other, told = run(tmp_path, logs / "*.mcap")
    assert told == ["2 of the logs left were done with another recipe, and are done again"]
    assert other.counts["done_before"] == 0
    # Both are kept.
    recipe(tmp_path, FIT)
    again, told = run(tmp_path, logs / "*.mcap")
    assert told == ["2 of 2 logs done already; 0 left"]
    assert same(again) == same(first)
    # What settings there are for steps that are not asked for is no matter.
    recipe(tmp_path, FIT + '[diagnose]\nwithhold = ["wind"]\n')
    assert run(tmp_path, logs / "*.mcap")[0].counts["done_before"] == 2

    model = Path("out/batch") / first.rows[0].folder / first.rows[0].fit.model
    recipe(tmp_path, f'steps = ["evaluate"]\nmodel = "{tmp_path / model}"\n')
    evaluated, _ = run(tmp_path, logs / "day1.mcap")
    assert evaluated.rows[0].evaluate.evaluated == "milliampere-day0@1"
    ratio = evaluated.rows[0].evaluate.normalised_mse
    assert ratio < 1.0
    assert f"force MSE of milliampere-day0@1: {ratio:.3f} of its" in running.render_batch(evaluated)
    profile = tmp_path / "boat.toml"
    from ferryid.vessel import load_profile

    profile.write_text(load_profile("milliampere").text + "\n# another day\n", encoding="utf-8")
    changed, told = run(tmp_path, logs / "day1.mcap", vessel=str(profile))
    assert told == ["1 of the logs left were done with another profile, and are done again"]
    assert changed.counts["done_before"] == 0


@pytest.mark.usefixtures("here")
def test_a_log_is_known_by_its_content_where_it_was_touched_or_moved(tmp_path: Path) -> None:
    logs = archive(tmp_path, 2)
    (logs / "day1.mcap").write_bytes((Path(__file__).resolve().parents[2] / "fixtures" / "truncated.mcap").read_bytes())
    recipe(tmp_path)
    first, _ = run(tmp_path, logs)  # a folder is one log
    first, _ = run(tmp_path, logs / "*.mcap")
    os.utime(logs / "day0.mcap")
    (logs / "day1.mcap").rename(logs / "moved.mcap")
    second, told = run(tmp_path, logs / "*.mcap")
    assert told == ["2 of 2 logs done already; 0 left"]
    assert [row.folder for row in second.rows] == [row.folder for row in first.rows]
    assert second.rows[1].log.endswith("moved.mcap")
    # A copy beside it is another log.
    shutil.copy(logs / "moved.mcap", logs / "copy.mcap")
    third, _ = run(tmp_path, logs / "*.mcap")
    assert third.counts["done_before"] == 2
    assert [row.folder for row in third.rows[1:]] == [row.folder for row in first.rows]
    # As long as before, and another.
    data = bytearray((logs / "day0.mcap").read_bytes())
    data[len(data) // 2] ^= 1
    (logs / "day0.mcap").write_bytes(data)
    fourth, _ = run(tmp_path, logs / "*.mcap")
    assert fourth.counts["done_before"] == 2
    assert fourth.rows[1].sha256 != first.rows[0].sha256


def test_a_log_that_kills_its_process_is_a_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    logs = archive(tmp_path, 3)
    (logs / "day1.mcap").rename(logs / "deadly.mcap")
    recipe(tmp_path)
    monkeypatch.setattr(running, "work", deadly)
    result, told = run(tmp_path, logs / "*.mcap", processes=2)
    assert statuses(result) == {"day0": "done", "day2": "done", "deadly": "lost"}
    assert any(line.startswith(f"lost: {logs / 'deadly.mcap'}: its process died") for line in told)
    monkeypatch.undo()
    # It kills no more, and this process does as well.
    stay_here(monkeypatch)
    kept_ones, _ = run(tmp_path, logs / "*.mcap")
    assert statuses(kept_ones)["deadly"] == "lost"
    # With more memory it is worth another try.
    more, _ = run(tmp_path, logs / "*.mcap", memory_limit="5G")
    assert statuses(more)["deadly"] == "done"
    assert more.counts["done_before"] == 2


@pytest.fixture(scope="module")
def asked(tmp_path_factory: pytest.TempPathFactory) -> task.Task:
    """Return the task of one log, for this process."""
    folder = tmp_path_factory.mktemp("one")
    logs = archive(folder, 1)
    recipe(folder)
    tasks: list[task.Task] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(running, "_carry_out", lambda these, *rest: tasks.extend(these) or 1 / 0)
        with pytest.raises(ZeroDivisionError):
            run(folder, logs / "*.mcap")
    return tasks[0]


@pytest.fixture
def one(asked: task.Task, tmp_path: Path) -> task.Task:
    """Return the task with folders of its own, in which nothing is done."""
    return replace(asked, folder=tmp_path / "results" / asked.folder.name, tables=tmp_path / "out")


@pytest.fixture(scope="module")
def carried_out(asked: task.Task) -> LogResult:
    """Return the row of the task; what came of it is in its folders."""
    return task.work(asked)


@pytest.fixture
def done(asked: task.Task, carried_out: LogResult, one: task.Task) -> task.Task:
    """Return the task with copies of the folders in which it is done."""
    assert carried_out.status == "done", carried_out.reason
    shutil.copytree(asked.folder, one.folder)
    shutil.copytree(asked.tables / "logs", one.tables / "logs")
    return one


@pytest.fixture
def again(carried_out: LogResult, monkeypatch: pytest.MonkeyPatch) -> list[steps.Job]:
    """Return what is evaluated from now on, without doing it: for whether it is done, not for what comes of it."""
    found: list[steps.Job] = []
    monkeypatch.setitem(steps.CARRY_OUT, "evaluate", lambda job: found.append(job) or carried_out.evaluate)
    return found


def failing(error: Callable[[], BaseException]) -> Any:
    def step(job: steps.Job) -> StepSummary:
        (job.folder / "half").mkdir()
        raise error()

    return step


def test_a_bug_is_a_row_with_its_traceback(one: task.Task, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(steps.CARRY_OUT, "evaluate", failing(lambda: ValueError("wind\nx")))
    row = task.work(one)
    assert row.status == "failed"
    assert row.reason.startswith("a bug of ferryid: ValueError: wind\\nx (test_run.py:")
    assert "\n" not in row.reason
    assert "in step" in (one.folder / "traceback.txt").read_text("utf-8")
    assert kept.read_row(one.folder) == row
    monkeypatch.undo()
    assert task.work(one) == row, "nothing has changed"
    assert task.work(replace(one, again=True)).status == "done"
    assert not (one.folder / "half").exists(), "what was half done before is gone"


@pytest.mark.parametrize(
    ("error", "status", "reason"),
    [
        (MemoryError(), "memory", "needs more than 4.0 GB of memory. Fix: give more with --memory"),
        (OSError(errno.EIO, "Input/output error", "a.mcap"), "refused", "a.mcap: Input/output error. Fix: "),
        (RuntimeError("can't start new thread"), "memory", "needs more than 4.0 GB"),
    ],
)
def test_what_a_system_does_not_give(
    one: task.Task, monkeypatch: pytest.MonkeyPatch, error: Exception, status: str, reason: str
) -> None:
    monkeypatch.setitem(steps.CARRY_OUT, "evaluate", failing(lambda: error))
    row = task.work(one)
    assert row.status == status
    assert row.reason.startswith(reason)


@pytest.mark.parametrize("wrapped", [False, True])
def test_a_full_disk_is_no_result_of_a_log(one: task.Task, monkeypatch: pytest.MonkeyPatch, wrapped: bool) -> None:
    full = OSError(errno.ENOSPC, "No space left on device")

    def error() -> BaseException:
        if not wrapped:
            return full
        told = FerryIdError("x: the bag cannot be unpacked. Fix: y")
        told.__cause__ = full
        return told

    monkeypatch.setitem(steps.CARRY_OUT, "evaluate", failing(error))
    with pytest.raises(UnwritableError, match=r"the disk is full\. Fix: free some space"):
        task.work(one)
    assert kept.read_row(one.folder) is None
    monkeypatch.setitem(steps.CARRY_OUT, "evaluate", failing(lambda: unwritable(one.folder, full)))
    with pytest.raises(UnwritableError):
        task.work(one)
    monkeypatch.undo()
    assert task.work(one).status == "done"


def test_more_memory_than_there_may_be(one: task.Task, monkeypatch: pytest.MonkeyPatch) -> None:
    if sys.platform != "linux":
        pytest.skip("other systems hold no process to a bound")
    import numpy as np

    def greedy(job: steps.Job) -> StepSummary:
        raise AssertionError(np.ones(6 << 27).sum())

    monkeypatch.setitem(steps.CARRY_OUT, "evaluate", greedy)
    assert task.work(one).status == "memory"


def started(folder: Path, *options: str) -> subprocess.Popen[str]:
    cli = Path(running.__file__).parents[2] / "cli"
    # As installed: the command line is a package of ferryid.
    code = f"""
import importlib.util, sys
if importlib.util.find_spec("ferryid.cli") is None:
    place = {str(cli)!r}
    spec = importlib.util.spec_from_file_location("ferryid.cli", place + "/__init__.py", submodule_search_locations=[place])
    sys.modules["ferryid.cli"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sys.modules["ferryid.cli"])
from ferryid.cli.main import main
main()
"""
    words = [
        "batch",
        str(folder / "season" / "*.mcap"),
        "--vessel",
        "milliampere",
        "--recipe",
        str(folder / "recipe.toml"),
    ]
    return subprocess.Popen(
        [sys.executable, "-c", code, *words, "--out", str(folder / "out"), *options],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True, env=environment(),
        preexec_fn=default_interrupts,
    )  # fmt: skip


def wait_for(folder: Path, count: int, working: subprocess.Popen[str]) -> None:
    deadline = time.monotonic() + 90.0
    while len(list(results(folder).glob("*/row.json"))) < count:
        assert working.poll() is None, working.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.002)


@pytest.mark.usefixtures("here")
def test_killed_in_the_middle_it_repeats_nothing_and_loses_nothing(tmp_path: Path) -> None:
    logs = archive(tmp_path, 6)
    recipe(tmp_path, FIT)
    with started(tmp_path, "--processes", "2") as working:
        wait_for(tmp_path, 2, working)
        # Both processes may have ended a log in the same millisecond: a third one has to be begun. They are held meanwhile, or
        # it would end before they are killed.
        os.killpg(working.pid, signal.SIGSTOP)
        while len(list(results(tmp_path).iterdir())) <= len(rows_of(tmp_path)):
            os.killpg(working.pid, signal.SIGCONT)
            assert working.poll() is None, working.communicate()
            time.sleep(0.002)
            os.killpg(working.pid, signal.SIGSTOP)
        children = children_of(working.pid)
        working.send_signal(signal.SIGKILL)
        os.killpg(working.pid, signal.SIGCONT)
    assert ended(children), "processes go on that nobody waits for"
    before = rows_of(tmp_path)
    assert 2 <= len(before) < 6, "it was over before it was killed"
    abandoned = tmp_path / "out" / "logs" / f".day5.{0:032x}.part"
    abandoned.mkdir()

    second, told = run(tmp_path, logs / "*.mcap")
    assert told == [f"{len(before)} of 6 logs done already; {6 - len(before)} left"]
    assert before.items() <= rows_of(tmp_path).items(), "what was done is not done again"
    assert set(statuses(second).values()) == {"done"}
    assert not abandoned.exists()
    assert not list(results(tmp_path).rglob(".*.part"))

    # As a run that nobody killed.
    shutil.move(tmp_path / "out", tmp_path / "killed")
    whole, _ = run(tmp_path, logs / "*.mcap")
    assert same(whole) == same(second)
    tables = [pq.read_table(tmp_path / place / "batch" / "summary.parquet") for place in ("killed", "out")]
    mine, other = (table.drop_columns(["seconds", "peak_bytes"]) for table in tables)
    assert mine.equals(other, check_metadata=True)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["interrupt", "terminate"])
def test_interrupted_it_keeps_what_is_done(tmp_path: Path, number: signal.Signals) -> None:
    archive(tmp_path, 6)
    recipe(tmp_path, FIT)
    with started(tmp_path, "--processes", "2") as working:
        wait_for(tmp_path, 1, working)
        children = children_of(working.pid)
        os.killpg(working.pid, number) if number == signal.SIGINT else working.send_signal(number)
        out, told = working.communicate(timeout=60.0)
    assert working.returncode == (130 if number == signal.SIGINT else 143), told
    assert told == "ferryid: interrupted, nothing half-written was left\n"
    assert out == ""
    assert ended(children)
    assert 1 <= len(rows_of(tmp_path)) < 6


TWICE = """
import subprocess, sys
from pathlib import Path
from ferryid.cli.main import main

def carry_out():
    try:
        main()
    except SystemExit as end:
        if end.code:
            print("code", end.code, flush=True)

# A process of the batch imports this file too.
if __name__ == "__main__":
    disk = Path(sys.argv.pop(1))
    carry_out()
    print(len(list(disk.glob("out/batch/results/*/row.json"))), flush=True)
    subprocess.run(["mount", "-o", "remount,size=60m", disk], check=True)
    carry_out()
"""
"""A command on a full disk, and again when there is space; in one process, as most of its time goes to loading."""


def test_on_a_disk_that_is_full_it_stops_and_goes_on_when_there_is_space(tmp_path: Path) -> None:
    (tmp_path / "disk").mkdir()
    small = ["unshare", "-rm", "sh", "-ec"]
    try:
        possible = subprocess.run(
            [*small, f"mount -t tmpfs -o size=1m tmpfs {tmp_path}/disk"], capture_output=True
        ).returncode
    except FileNotFoundError:
        possible = 1
    if possible != 0:
        pytest.skip("no disk of our own can be mounted here")
    archive(tmp_path, 4)
    recipe(tmp_path)
    program = tmp_path / "twice.py"
    program.write_text(TWICE, encoding="utf-8")
    words = f"batch '{tmp_path}/season/*.mcap' --vessel milliampere --processes 1 --recipe {tmp_path}/recipe.toml"
    script = f"""
mount -t tmpfs -o size=700k tmpfs {tmp_path}/disk
{sys.executable} {program} {tmp_path}/disk {words} --out {tmp_path}/disk/out
"""
    done = subprocess.run([*small, script], capture_output=True, text=True, env=environment())
    lines = done.stdout.splitlines()
    assert lines[0] == "code 2", done.stderr
    assert 1 <= int(lines[1]) < 4
    assert lines[2] == "4 logs: 4 done"
    told = done.stderr.splitlines()
    assert len(told) == 2, told
    assert "the disk is full. Fix: free some space" in told[0]
    assert told[1] == f"{lines[1]} of 4 logs done already; {4 - int(lines[1])} left"


def test_on_a_cluster_that_loses_a_worker(tmp_path: Path, cluster: tuple[str, list[subprocess.Popen[bytes]]]) -> None:
    logs = archive(tmp_path, 8)
    (logs / "day3.mcap").write_bytes(b"")
    recipe(tmp_path)
    address, (_, *workers) = cluster
    told: list[str] = []

    def show(stage: str) -> None:
        # One that is at work: two are done, and as many as there are workers at work.
        if stage.startswith("2 of 8") and workers[0].poll() is None:
            workers[0].kill()

    result = running.batch(
        [str(logs / "*.mcap")], tmp_path / "out", vessel="milliampere", recipe=tmp_path / "recipe.toml", dask=address,
        progress=show, tell=told.append,
    )  # fmt: skip
    assert workers[0].poll() is not None
    assert statuses(result) == {f"day{k}": "refused" if k == 3 else "done" for k in range(8)}
    here, _ = run(tmp_path, logs / "*.mcap")
    assert here.counts["done_before"] == 8
    assert same(here) == same(result)


def test_two_at_once_do_not_share_a_folder(tmp_path: Path) -> None:
    from ferryid.files import alone

    logs = archive(tmp_path, 1)
    recipe(tmp_path)
    with alone(tmp_path / "out" / "batch"), pytest.raises(FerryIdError, match="another process is at work in it"):
        run(tmp_path, logs / "*.mcap")


def test_a_task_that_somebody_else_has_done_meanwhile_is_not_done_again(
    done: task.Task, carried_out: LogResult, again: list[steps.Job]
) -> None:
    state = (done.folder / "row.json").stat()
    assert task.work(done) == carried_out
    assert (done.folder / "row.json").stat().st_ino == state.st_ino
    assert not again
    changed = replace(done, files=(LogFile(done.files[0].path, 1, 1),))
    assert task.work(changed).files == changed.files
    assert len(again) == 1


def test_what_is_begun_to_be_removed_counts_no_more(done: task.Task, monkeypatch: pytest.MonkeyPatch) -> None:
    (done.folder / "reports").mkdir()

    def denied(path: Path) -> None:
        raise OSError(errno.EACCES, "no")

    monkeypatch.setattr(shutil, "rmtree", denied)
    # Whatever comes first in the folder, the row has gone before it.
    monkeypatch.setattr(Path, "iterdir", lambda folder: iter([folder / "reports", folder / "row.json"]))
    with pytest.raises(UnwritableError):
        kept.clear(done.folder)
    monkeypatch.undo()
    assert kept.read_row(done.folder) is None


@pytest.mark.parametrize("text", ["", "{", "[]", '{"files": []}', "\x00" * 100])
def test_a_damaged_row_is_none(done: task.Task, again: list[steps.Job], text: str) -> None:
    (done.folder / "row.json").write_text(text, encoding="utf-8")
    assert kept.read_row(done.folder) is None
    assert task.work(done).status == "done"
    assert len(again) == 1


@pytest.mark.parametrize(
    "altered", [{"seconds": None}, {"files": None}, {"start_ns": "x"}, {"evaluate": 5}, {"more": 1}]
)
def test_an_altered_row_is_none(done: task.Task, again: list[steps.Job], altered: dict[str, Any]) -> None:
    path = done.folder / "row.json"
    whole = kept.read_row(done.folder)
    assert whole is not None
    path.write_text(json.dumps({**json.loads(path.read_text("utf-8")), **altered}), encoding="utf-8")
    assert kept.read_row(done.folder) is None
    assert task.work(done).status == "done"
    assert len(again) == 1


def rewritten(folder: Path, changes: dict[str, Any]) -> None:
    """Write a row again with changes, None removing a key, and the hash that belongs to it."""
    data = json.loads((folder / "row.json").read_text("utf-8")) | changes
    row = {key: value for key, value in data.items() if key not in changes or value is not None}
    del row[kept.CHECK]
    (folder / "row.json").write_text(dump_json({**row, kept.CHECK: kept._check(row)}), encoding="utf-8")


@pytest.mark.parametrize(
    "changes", [{"evaluate": {"mse": 1}}, {"files": None}, {"more": 1}, {"seconds": {"read": "1"}}]
)
def test_a_row_of_another_form_is_none(done: task.Task, again: list[steps.Job], changes: dict[str, Any]) -> None:
    rewritten(done.folder, changes)
    assert kept.read_row(done.folder) is None
    assert task.work(done).status == "done"
    assert len(again) == 1


def test_a_row_that_does_not_tell_what_was_lost_stands(done: task.Task, carried_out: LogResult) -> None:
    rewritten(done.folder, {"lost": None})
    assert kept.read_row(done.folder) == replace(carried_out, lost=None)
    assert task.work(done) == replace(carried_out, lost=None)


@pytest.mark.skipif(sys.platform != "linux", reason="other systems take no such name")
@pytest.mark.usefixtures("elsewhere")
def test_a_name_of_bytes_that_are_no_characters(tmp_path: Path) -> None:
    logs = archive(tmp_path, 1)
    recipe(tmp_path, 'steps = ["fit", "evaluate", "diagnose"]\n[fit]\ndraws = 20\nestimator = "derivative"\n')
    (logs / "day0.mcap").rename(os.fsdecode(bytes(logs) + b"/day\xff.mcap"))
    Path(os.fsdecode(bytes(logs) + b"/bad\xff.mcap")).write_bytes(b"")
    result, _ = run(tmp_path, logs / "*.mcap")
    assert statuses(result) == {"bad": "refused", "day": "done"}
    assert [row.log for row in result.rows] == [rf"{logs}/{name}\udcff.mcap" for name in ("bad", "day")]
    again, _ = run(tmp_path, logs / "*.mcap")
    assert again.counts["done_before"] == 2


@pytest.mark.usefixtures("here")
def test_vessels_are_found_for_each_log(tmp_path: Path) -> None:
    logs = archive(tmp_path, 2)
    recipe(tmp_path)
    (logs / "odd.csv").write_text("t,a\n" + "".join(f"{k},1\n" for k in range(50)), encoding="utf-8")
    other = logs / "other"
    other.mkdir()
    (logs / "day1.mcap").rename(other / "day1.mcap")
    (other / "vessel.toml").write_text(load_profile("milliampere").text.replace('"milliampere"', '"twin"', 1), "utf-8")
    result, told = run(tmp_path, logs / "**" / "*.[mc]*", vessel=None)
    assert [(row.name, row.vessel, row.status) for row in result.rows] == [
        ("day0", "milliampere", "done"),
        ("odd", "", "refused"),
        ("day1", "twin", "done"),
    ]
    assert "no vessel profile fits this log" in result.rows[1].reason
    assert f"1 log of vessel twin: from {other / 'vessel.toml'}" in told
    again, told = run(tmp_path, logs / "**" / "*.[mc]*", vessel=None)
    assert again.counts["done_before"] == 3


def test_time_left_by_bytes_and_by_count() -> None:
    equal = Remaining([5, 5, 5, 5])
    assert equal.seconds(0, 10.0) == pytest.approx(30.0)
    assert equal.seconds(3, 20.0) == pytest.approx(20.0)
    # One of two, with nine tenths of the bytes: 0.25 + 0.45 of the work.
    assert Remaining([90, 10]).seconds(0, 7.0) == pytest.approx(3.0)
    assert Remaining([0, 0]).seconds(1, 7.0) == pytest.approx(7.0)
    assert [told_time(s) for s in (5.0, 600.0, 10_000.0)] == ["5 s", "10 min", "2.8 h"]


@pytest.mark.usefixtures("elsewhere")
def test_progress_names_what_is_at_work(tmp_path: Path) -> None:
    logs = archive(tmp_path, 3)
    recipe(tmp_path)
    seen: list[str] = []
    running.batch(
        [str(logs / "*.mcap")], tmp_path / "out", vessel="milliampere", recipe=tmp_path / "recipe.toml", processes=2,
        progress=seen.append, tell=lambda line: None,
    )  # fmt: skip
    assert "0 of 3 logs; day0, day1" in seen
    # Where the first two end at once, both are done before the third begins.
    assert any(
        re.fullmatch(r"(1 of 3 logs, .* left; day[01], day2)|(2 of 3 logs, .* left; day2)", line) for line in seen
    )
    assert seen[-2:] == ["writing the summary", ""]
