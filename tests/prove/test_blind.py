"""The process that diagnoses sees its log and nothing of the answers, and is replaced when it dies."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from ferryid.errors import FerryIdError, UnwritableError
from ferryid.prove.ask import Blind
from ferryid.prove.guard import landlock_version, python_rooms
from ferryid.prove.sources import sources
from ferryid.simulate import parse_scenario, simulate, write_log
from ferryid.vessel import load_profile
from tests.batch.work import ended, environment
from tests.prove.spy import BY_C

SPY = ("-m", "tests.prove.spy")
PROFILE = load_profile("milliampere").text


def with_logs(folder: Path, *names: str) -> Path:
    """Make the folder of a proof with answers in it, and logs that nobody reads."""
    folder.mkdir(exist_ok=True)
    for name in ("answers.sealed", "answers.json", "seal.json"):
        (folder / name).write_text("the answers", encoding="utf-8")
    for name in (*names, "other"):
        place = folder / "logs" / name
        place.mkdir(parents=True)
        (place / f"{name}.mcap").write_text("a log", encoding="utf-8")
        (place / "vessel.toml").write_text(PROFILE, encoding="utf-8")
        (place / "link").symlink_to(folder / "answers.sealed")
    return folder


def asked(blind: Blind, folder: Path, name: str) -> dict:
    place = folder / "logs" / name
    return blind.ask(place / f"{name}.mcap", place / "vessel.toml", folder / "models" / name)


@pytest.mark.parametrize("kernel", [True, False], ids=["landlock+audit", "audit"])
def test_no_way_to_the_answers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kernel: bool) -> None:
    if kernel and landlock_version() == 0:
        pytest.skip("this kernel has no Landlock: only Python's hook keeps the answers, and C code could read them")
    folder = with_logs(tmp_path / "proof", "one")
    monkeypatch.setenv("FERRYID_TEST_SEED", "4711")
    with Blind(folder, SPY if kernel else (*SPY, "--without-kernel")) as blind:
        told = asked(blind, folder, "one")
        assert blind.sources == sources()
    assert told["guard"] == ("landlock+audit" if kernel else "audit")
    seen = {name: what for name, what in told["attempts"].items() if what != "refused"}
    # Without the kernel, C code is kept out by nothing, which is why the result says what guarded it.
    assert seen == ({} if kernel else dict.fromkeys(BY_C, "done"))
    # What it is there for, it can do.
    assert told["log"] == len("a log")
    assert told["profile"] == len(PROFILE)
    assert told["kept"] == 2
    assert (folder / "models" / "one" / "model.json").exists()
    assert Path(told["temporary"]).parent == folder / "scratch"
    assert not list((folder / "scratch").iterdir())
    assert (folder / "answers.sealed").read_text("utf-8") == "the answers"
    assert sorted(path.name for path in (folder / "logs" / "one").iterdir()) == ["link", "one.mcap", "vessel.toml"]
    assert "4711" not in str(told["environment"]) + str(told["command"])
    assert set(told["environment"]) <= {
        *("HOME", "NUMBA_CACHE_DIR", "LD_LIBRARY_PATH", "PATH", "PYTHONPATH", "TMPDIR", "OPENBLAS_NUM_THREADS"),
        *("OMP_NUM_THREADS", "LC_CTYPE"),
    }
    assert told["cores"] == 1


def test_what_cannot_be_written_is_no_diagnosis(tmp_path: Path) -> None:
    folder = with_logs(tmp_path / "proof", "one")
    program = (
        "import sys\n"
        "from pathlib import Path\n"
        "from ferryid.files import unwritable\n"
        "from ferryid.prove.blind import main\n"
        "def full(log, profile, out):\n"
        "    raise unwritable(out, OSError(28, 'no space'))\n"
        "main(full)\n"
    )
    with Blind(folder, ("-c", program)) as blind, pytest.raises(UnwritableError, match="the disk is full"):
        asked(blind, folder, "one")


def test_the_kernel_alone_keeps_what_python_opens(tmp_path: Path) -> None:
    if landlock_version() == 0:
        pytest.skip("this kernel has no Landlock")
    (tmp_path / "open").mkdir()
    (tmp_path / "open" / "a").write_text("a", encoding="utf-8")
    (tmp_path / "shut").write_text("b", encoding="utf-8")
    code = """
import os, sys, threading
from ferryid.prove.guard import Rooms, landlock
assert landlock(Rooms((sys.argv[1] + "/open", sys.prefix, sys.base_prefix), ()))
def refused(what):
    try:
        what()
    except PermissionError:
        return True
print(open(sys.argv[1] + "/open/a").read(), refused(lambda: open(sys.argv[1] + "/shut")),
      refused(lambda: os.listdir(sys.argv[1])), refused(lambda: open(sys.argv[1] + "/open/a", "a")),
      refused(lambda: open(f"/proc/{os.getppid()}/environ").read()), refused(lambda: os.execv("/bin/true", ["true"])),
      open("/dev/null", "w").write("x"))
"""
    done = subprocess.run([sys.executable, "-c", code, tmp_path], capture_output=True, text=True, check=False)
    assert done.stdout == "a True True True True True 1\n", done.stderr


def test_answers_do_not_lie_where_python_must_read() -> None:
    for place in (Path(sys.prefix) / "proof", Path(python_rooms(Path("/nowhere")).writes[0]) / "proof"):
        with pytest.raises(FerryIdError, match=r"which the diagnosing process must be able to read\. Fix: choose"):
            python_rooms(place)


def test_one_process_serves_many_logs_and_its_death_costs_one_retry(tmp_path: Path) -> None:
    names = ("first", "once", "always", "bug", "last")
    folder = with_logs(tmp_path / "proof", *names)
    with Blind(folder, (*SPY, "--mortal")) as blind:
        told = {name: asked(blind, folder, name) for name in names}
    assert [told[name]["verdict"] for name in names] == ["matched", "matched", "crashed", "crashed", "matched"]
    assert told["first"]["pid"] != told["once"]["pid"]
    assert told["first"]["value"] is None
    assert told["always"]["error"] == "the process that diagnosed it died 2 times, the last time with code 7"
    assert told["bug"]["error"].startswith("ZeroDivisionError: division by zero (spy.py:")
    assert told["always"]["findings"] == told["bug"]["findings"] == []
    # A bug is no death: the next log has the process that had it.
    folder = with_logs(tmp_path / "second", "a", "bug", "b")
    with Blind(folder, (*SPY, "--mortal")) as blind:
        pids = [asked(blind, folder, name).get("pid") for name in ("a", "bug", "b")]
    assert pids[0] == pids[2]


def test_a_process_that_cannot_start_is_said(tmp_path: Path) -> None:
    folder = with_logs(tmp_path / "proof", "one")
    with (
        Blind(folder, ("-c", "raise SystemExit(3)")) as blind,
        pytest.raises(FerryIdError, match="ended with code 3 before it took a log"),
    ):
        asked(blind, folder, "one")


def test_it_ends_with_whoever_asks_also_in_the_middle_of_a_log(tmp_path: Path) -> None:
    folder = with_logs(tmp_path / "proof", "slow")
    code = f"""
from pathlib import Path
from ferryid.prove.ask import Blind
folder = Path({str(folder)!r})
blind = Blind(folder, {(*SPY, "--mortal")!r})
blind._start()
print(blind._process.pid, flush=True)
blind.ask(folder / "logs/slow/slow.mcap", folder / "logs/slow/vessel.toml", folder / "models/slow")
"""
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=environment()) as asking:
        assert asking.stdout is not None
        pid = int(asking.stdout.readline())
        time.sleep(0.5)
        os.kill(pid, 0)
        asking.send_signal(signal.SIGKILL)
    assert ended([pid]), "a diagnosis goes on that nobody waits for"


def test_a_real_diagnosis_behind_the_guard(tmp_path: Path) -> None:
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
    with Blind(folder) as blind:
        told = blind.ask(place / "0001", place / "vessel.toml", folder / "models" / "0001")
        refused = blind.ask(place / "none.mcap", place / "vessel.toml", folder / "models" / "0001")
    assert told["verdict"] == "explained", told
    (wind,) = told["findings"]
    assert wind["effect"] == "wind"
    assert wind["parameters"]["north"]["value"] == pytest.approx(-3.0, abs=0.5)
    assert set(wind) == {
        *(
            "effect",
            "instance",
            "probability",
            "parameters",
            "improvement",
            "unresolved_with",
            "rivals",
            "onset",
            "offset",
        ),
    }
    assert len(wind["rivals"]) <= 2
    assert (folder / "models" / "0001" / told["model"]).exists()
    assert told["before"]["mse"]["sway"] > told["after"]["mse"]["sway"]
    assert told["seconds"] > 0.0
    assert "error" not in told
    assert refused["verdict"] == "refused"
    assert "none.mcap" in refused["error"]
