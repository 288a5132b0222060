"""Whoever asks a command to end gets it ended within two seconds, with the exit code that shells expect."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import pytest

from tests.batch.work import children_of, default_interrupts, ended, environment

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform == "win32", reason="there are no such signals")]
MESSAGE = "ferryid: interrupted, nothing half-written was left\n"
BUSY = """
import subprocess, sys, time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from ferryid.files import replacing, scratch_folder
import ferryid.signals.inspect as module

out = Path(sys.argv[1])

# Loading numba takes longer than all else, and only what is compiled needs it.
if {compiles}:
    import numba, numpy as np

    @numba.njit(nogil=True)
    def compiled(n):
        x = 0.0
        for i in range(n):
            x = np.sin(x + i)
        return x

def pool():
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(compiled, [10**12] * 4))

def clean_up():
    try:
        time.sleep(60.0)
    finally:
        time.sleep(60.0)

def swallow():
    while True:
        try:
            time.sleep(60.0)
        except BaseException:
            pass

def child():
    subprocess.run(["sleep", "60"])

def busy(*_, **__):
    scratch = scratch_folder()
    (scratch / "log").write_text("unpacked")
    with replacing(out / "report") as temporary:
        temporary.mkdir()
        (temporary / "page").write_text("half")
        (out / "scratch").write_text(str(scratch))
        if {compiles}:
            compiled(1)
        print("busy", flush=True)
        {how}()

module.inspect = busy
sys.argv = ["ferryid", "inspect", "a.log"]
from ferryid.cli.main import main
main()
"""


def started(code: str, *arguments: str | Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", code, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env=environment(), preexec_fn=default_interrupts, start_new_session=True,
    )  # fmt: skip


@pytest.mark.parametrize("module", ["ferryid.cli.main", "typer"])
def test_an_interrupt_while_the_command_line_is_loaded_shows_no_traceback(module: str) -> None:
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    entry, _, function = project["scripts"]["ferryid"].partition(":")
    loading = f"""
import os, signal, sys

class Interrupt:
    def find_spec(self, name, path, target=None):
        if name == {module!r}:
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Interrupt())
sys.argv = ["ferryid", "--help"]
from {entry} import {function}
{function}()
"""
    out, error = (process := started(loading)).communicate(timeout=60)
    assert (process.returncode, out, error) == (130, "", MESSAGE)


def test_two_threads_that_end_a_process_say_so_once() -> None:
    ending = """
import threading, time
from ferryid import interrupts
interrupts._children = lambda: time.sleep(0.3) or []
for _ in range(3):
    threading.Thread(target=interrupts.end, args=(2,)).start()
"""
    _, error = (process := started(ending)).communicate(timeout=60)
    assert (process.returncode, error) == (130, MESSAGE)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["interrupt", "terminate"])
@pytest.mark.parametrize("how", ["pool", "compiled_alone", "clean_up", "swallow", "child"])
def test_a_command_ends_within_two_seconds_whatever_it_is_at(tmp_path: Path, number: signal.Signals, how: str) -> None:
    code = BUSY.replace("{how}()", "compiled(10**12)" if how == "compiled_alone" else f"{how}()")
    code = code.replace("{compiles}", str(how in ("pool", "compiled_alone")))
    with started(code, tmp_path) as working:
        assert working.stdout is not None
        assert working.stdout.readline() == "busy\n", working.communicate()
        children = children_of(working.pid)
        begun = time.monotonic()
        working.send_signal(number)
        _, told = working.communicate(timeout=30.0)
        seconds = time.monotonic() - begun
    assert (working.returncode, told) == (128 + number, MESSAGE)
    assert seconds < 2.0
    assert ended(children)
    assert [path.name for path in tmp_path.iterdir()] == ["scratch"]
    assert not Path((tmp_path / "scratch").read_text()).exists()


AT_IMPORT = """
import os, signal, sys

class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == {name!r}:
            sys.meta_path.remove(self)
            os.kill(os.getpid(), {number})

sys.meta_path.insert(0, Finder())
sys.argv = ["ferryid", "fit", sys.argv[1], "--vessel", "milliampere", "--out", sys.argv[2]]
from ferryid.cli.main import main
main()
"""


@pytest.mark.parametrize(
    "name", ["typer", "ferryid.cli.app", "ferryid.cli.cmd_fit", "ferryid.errors", "numpy", "scipy.special", "pyarrow"]
)
def test_an_interrupt_during_imports_is_one(tmp_path: Path, fixtures: Path, name: str) -> None:
    code = AT_IMPORT.format(name=name, number=int(signal.SIGINT))
    with started(code, fixtures / "short.mcap", tmp_path) as working:
        _, told = working.communicate(timeout=30.0)
    assert (working.returncode, told) == (130, MESSAGE)


def test_an_ignored_interrupt_stays_ignored() -> None:
    code = (
        "import os, signal, sys; import ferryid.signals.inspect as module\n"
        "module.inspect = lambda *_, **__: os.kill(os.getpid(), signal.SIGINT) or sys.exit(7)\n"
        "sys.argv = ['ferryid', 'inspect', 'a.log']; from ferryid.cli.main import main; main()"
    )
    command = ["sh", "-c", 'trap "" INT; exec "$0" -c "$1"', sys.executable, code]
    done = subprocess.run(command, capture_output=True, text=True, env=environment(), timeout=30.0)
    assert (done.returncode, done.stderr) == (7, "")
