"""The worker is given a log and its profile and nothing else, and is replaced when it dies."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from ferryid.errors import FerryIdError, UnwritableError
from ferryid.simulate import parse_scenario, simulate, write_log
from ferryid.validation.records import Diagnosis
from ferryid.validation.source_hash import source_hash
from ferryid.validation.worker import diagnose_log
from ferryid.validation.worker_client import WorkerClient
from ferryid.vessel import load_profile
from tests.batch.work import ended, environment

pytestmark = pytest.mark.slow

STAND_IN = ("-m", "tests.validation.worker_stand_in")
PROFILE = load_profile("milliampere").text


def with_logs(folder: Path, *names: str) -> Path:
    """Make the folder of a run with logs in it that nobody reads."""
    for name in names:
        place = folder / "logs" / name
        place.mkdir(parents=True)
        (place / f"{name}.mcap").write_text("a log", encoding="utf-8")
        (place / "vessel.toml").write_text(PROFILE, encoding="utf-8")
    return folder


def diagnosed(worker: WorkerClient, folder: Path, name: str) -> Diagnosis:
    place = folder / "logs" / name
    return worker.diagnose(place / f"{name}.mcap", place / "vessel.toml", folder / "models" / name)


def test_a_worker_is_given_log_and_profile_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = with_logs(tmp_path / "proof", "one")
    monkeypatch.setenv("FERRYID_TEST_SEED", "4711")
    with WorkerClient(folder, STAND_IN) as worker:
        given = diagnosed(worker, folder, "one").before
        assert worker.sources == source_hash()
    place = folder / "logs" / "one"
    assert given["arguments"] == [
        str(place / "one.mcap"),
        str(place / "vessel.toml"),
        str(folder / "models" / "one"),
    ]
    assert (folder / "models" / "one" / "model.json").exists()
    assert Path(given["folder"]) == Path(given["temporary"])
    assert Path(given["temporary"]).parent == folder / "scratch"
    assert not list((folder / "scratch").iterdir())
    assert "4711" not in str(given["environment"]) + str(given["command"])
    assert set(given["environment"]) <= {
        *("HOME", "NUMBA_CACHE_DIR", "LD_LIBRARY_PATH", "PATH", "PYTHONPATH", "TMPDIR", "OPENBLAS_NUM_THREADS"),
        *("OMP_NUM_THREADS", "LC_CTYPE"),
    }
    assert given["cores"] == 1


def test_what_cannot_be_written_is_no_diagnosis(tmp_path: Path) -> None:
    folder = with_logs(tmp_path / "proof", "one")
    program = (
        "from ferryid.files import unwritable\n"
        "from ferryid.validation.worker import main\n"
        "def full(log, profile, out):\n"
        "    raise unwritable(out, OSError(28, 'no space'))\n"
        "main(full)\n"
    )
    with WorkerClient(folder, ("-c", program)) as worker, pytest.raises(UnwritableError, match="the disk is full"):
        diagnosed(worker, folder, "one")


def test_an_error_names_files_of_the_case_and_no_folder_of_the_machine(tmp_path: Path) -> None:
    folder = with_logs(tmp_path / "proof", "one")
    refused = diagnose_log(folder / "logs/one/one.mcap", folder / "logs/one/vessel.toml", folder / "models/one")
    assert (refused.verdict, refused.error.partition(":")[0]) == ("refused", "one.mcap")
    program = (
        "from ferryid.validation.worker import main\n"
        "def broken(log, profile, out):\n"
        "    raise ValueError(f'{log} is odd')\n"
        "main(broken)\n"
    )
    with WorkerClient(folder, ("-c", program)) as worker:
        crashed = diagnosed(worker, folder, "one")
    assert crashed.error.startswith("ValueError: one.mcap is odd")


def test_one_process_serves_many_logs_and_its_death_costs_one_retry(tmp_path: Path) -> None:
    names = ("first", "once", "always", "bug", "last")
    folder = with_logs(tmp_path / "proof", *names)
    with WorkerClient(folder, (*STAND_IN, "--mortal")) as worker:
        found = {name: diagnosed(worker, folder, name) for name in names}
    assert [found[name].verdict for name in names] == ["matched", "matched", "crashed", "crashed", "matched"]
    assert found["first"].before["pid"] != found["once"].before["pid"]
    assert found["first"].before["value"] is None
    assert found["always"].error == "the process that diagnosed it died 2 times, the last time with code 7"
    assert found["bug"].error.startswith("ZeroDivisionError: division by zero (worker_stand_in.py:")
    assert found["always"].findings == found["bug"].findings == ()
    # A bug is no death: the next log has the process that had it.
    folder = with_logs(tmp_path / "second", "a", "bug", "b")
    with WorkerClient(folder, (*STAND_IN, "--mortal")) as worker:
        first, _, last = (diagnosed(worker, folder, name) for name in ("a", "bug", "b"))
    assert first.before["pid"] == last.before["pid"]


def test_a_process_that_cannot_start_is_an_error(tmp_path: Path) -> None:
    folder = with_logs(tmp_path / "proof", "one")
    with (
        WorkerClient(folder, ("-c", "raise SystemExit(3)")) as worker,
        pytest.raises(FerryIdError, match="ended with code 3 before it took a log"),
    ):
        diagnosed(worker, folder, "one")


def test_it_ends_with_the_process_that_asks_also_in_the_middle_of_a_log(tmp_path: Path) -> None:
    folder = with_logs(tmp_path / "proof", "slow")
    code = f"""
from pathlib import Path
from ferryid.validation.worker_client import WorkerClient
folder = Path({str(folder)!r})
worker = WorkerClient(folder, {(*STAND_IN, "--mortal")!r})
worker._start()
print(worker._process.pid, flush=True)
worker.diagnose(folder / "logs/slow/slow.mcap", folder / "logs/slow/vessel.toml", folder / "models/slow")
"""
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=environment()) as asking:
        assert asking.stdout is not None
        pid = int(asking.stdout.readline())
        time.sleep(0.5)
        os.kill(pid, 0)
        asking.send_signal(signal.SIGKILL)
    assert ended([pid]), "a diagnosis goes on that nobody waits for"


def test_a_real_diagnosis(tmp_path: Path) -> None:
    folder = tmp_path / "proof"
    place = folder / "logs" / "0001"
    place.mkdir(parents=True)
    scenario = """
schema = "ferryid.scenario/1"
vessel = "milliampere"
path = { kind = "twelve-corner" }
controller = { delta = 0.7, sigma = 0.7 }
sensors = { imu_rate_hz = 0.0, camera_rate_hz = 0.0 }
[environment.wind]
north_mps = -3.0
east_mps = 1.0
"""
    write_log(simulate(parse_scenario(scenario, "trial"), 3), place / "0001")
    (place / "vessel.toml").write_text(PROFILE, encoding="utf-8")
    with WorkerClient(folder) as worker:
        found = worker.diagnose(place / "0001", place / "vessel.toml", folder / "models" / "0001")
        refused = worker.diagnose(place / "none.mcap", place / "vessel.toml", folder / "models" / "none")
    assert found.verdict == "explained"
    (wind,) = found.findings
    assert (wind.effect, wind.instance) == ("wind", None)
    assert wind.parameters["north"].value == pytest.approx(-3.0, abs=0.5)
    assert len(wind.rivals) <= 2
    assert found.model is not None
    assert (folder / "models" / "0001" / found.model).exists()
    assert found.before["mse"]["sway"] > found.after["mse"]["sway"]
    assert found.seconds > 0.0
    assert not found.error
    assert refused.verdict == "refused"
    assert "none.mcap" in refused.error
