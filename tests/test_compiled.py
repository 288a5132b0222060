"""The compiled functions on disk: used again, and never trusted when damaged."""

from __future__ import annotations

import errno
import importlib.util
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numba
import pytest

from ferryid.compiled import compiled

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="nothing is compiled")


@pytest.fixture
def fresh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return a function that compiles the same source anew, with the folder that it is kept in."""
    source = tmp_path / "source.py"
    source.write_text("def twice(x):\n    return 2.0 * x\n")
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "cache"))

    def make() -> Any:
        spec = importlib.util.spec_from_file_location("source", source)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        function = compiled(module.twice)
        assert function(3.0) == 6.0
        return function

    return make


def _hits(function: Any) -> int:
    return sum(function.stats.cache_hits.values())


def test_what_is_compiled_is_used_again(fresh: Any) -> None:
    assert _hits(fresh()) == 0
    assert _hits(fresh()) == 1


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
@pytest.mark.parametrize("damage", ["empty", "cut", "flipped", "gone", "zeros"])
def test_a_damaged_file_counts_as_none_and_is_replaced(fresh: Any, tmp_path: Path, suffix: str, damage: str) -> None:
    fresh()
    (path,) = (tmp_path / "cache").rglob(f"*{suffix}")
    good = path.read_bytes()
    bad = {
        "empty": b"",
        "cut": good[: len(good) // 2],
        "flipped": good[: len(good) // 2] + bytes([good[len(good) // 2] ^ 255]) + good[len(good) // 2 + 1 :],
        "zeros": bytes(len(good)),
    }
    if damage == "gone":
        path.unlink()
    else:
        path.write_bytes(bad[damage])
    assert _hits(fresh()) == 0
    assert _hits(fresh()) == 1


def test_a_full_disk_only_costs_the_time_to_compile(fresh: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("numba.core.caching.IndexDataCacheFile._open_for_write", full)
    assert _hits(fresh()) == 0
    assert _hits(fresh()) == 0


def test_numba_is_loaded_at_the_first_call(tmp_path: Path) -> None:
    program = (
        "import pickle, sys; from ferryid.recursive_filter import _filtered, recursive_filter; import ferryid.effects\n"
        "assert pickle.loads(pickle.dumps(_filtered)) is _filtered and _filtered.__doc__ is None\n"
        "before = {'numba', 'llvmlite'} & set(sys.modules)\n"
        "import numpy as np; recursive_filter(np.ones(1), np.ones(1), np.zeros(3))\n"
        "print(sorted(before), 'numba' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.stdout.split() == ["[]", "True"], done.stderr


def test_threads_that_call_a_function_first_share_what_is_compiled() -> None:
    @compiled
    def thrice(x: float) -> float:
        return 3.0 * x

    with ThreadPoolExecutor(8) as pool:
        made = set(pool.map(lambda _: id(thrice._dispatcher), range(64)))  # type: ignore[attr-defined]
    assert len(made) == 1


def test_python_calls_what_was_compiled_for_compiled_functions_alone() -> None:
    @compiled
    def called(x: float) -> float:
        return x + 1.0

    @compiled
    def calling(x: float) -> float:
        return 2.0 * called(x)

    assert calling(3.0) == 8.0
    assert called(3.0) == 4.0
    assert calling(4.0) == 10.0


CALLER = """
from callee import FACTOR, Pair, callee
from ferryid.compiled import compiled


@compiled
def caller(pair):
    return callee(pair.a) * FACTOR
"""
CALLEE = """
from typing import NamedTuple

from ferryid.compiled import compiled

FACTOR = 2.0


class Pair(NamedTuple):
    a: float
    b: float


@compiled
def callee(x):
    return x + 1.0
"""
USE = "from caller import Pair, caller; print(caller(Pair(3.0, 5.0)), sum(caller.stats.cache_hits.values()))"


def _called(folder: Path, callee: str, caller: str = CALLER) -> list[str]:
    """Write both modules, and return what another process makes of them: the value, and how many times it was kept."""
    (folder / "caller.py").write_text(caller)
    (folder / "callee.py").write_text(callee)
    done = subprocess.run(
        [sys.executable, "-c", USE],
        cwd=folder,
        env={**os.environ, "NUMBA_CACHE_DIR": str(folder / "cache"), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.split()


@pytest.mark.slow
def test_what_is_called_from_another_file_counts_and_nothing_else(tmp_path: Path) -> None:
    assert _called(tmp_path, CALLEE) == ["8.0", "0"]
    assert _called(tmp_path, CALLEE) == ["8.0", "1"]
    # Text beside the function, and where it stands.
    more = CALLEE.replace("def callee(x):", 'def callee(x):\n    """Say something."""').replace(
        "FACTOR", "# Two.\nFACTOR"
    )
    assert _called(tmp_path, more + "\n\ndef other():\n    return 5\n", f"# A remark.\n{CALLER}") == ["8.0", "1"]
    assert _called(tmp_path, CALLEE.replace("x + 1.0", "x + 2.0")) == ["10.0", "0"]
    assert _called(tmp_path, CALLEE.replace("FACTOR = 2.0", "FACTOR = 3.0")) == ["12.0", "0"]
    assert _called(tmp_path, CALLEE.replace("a: float\n    b: float", "b: float\n    a: float")) == ["12.0", "0"]


@pytest.mark.slow
def test_of_several_processes_one_compiles(tmp_path: Path) -> None:
    source = "import time\nfrom ferryid.compiled import compiled\n\n\n@compiled\ndef twice(x):\n    return 2.0 * x\n"
    (tmp_path / "both.py").write_text(source)
    program = "import both; both.twice(1.0); print(sum(both.twice.stats.cache_hits.values()))"
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    several = [
        subprocess.Popen([sys.executable, "-c", program], cwd=tmp_path, env=environment, stdout=subprocess.PIPE)
        for _ in range(3)
    ]
    assert sorted(int(one.communicate()[0]) for one in several) == [0, 1, 1]
