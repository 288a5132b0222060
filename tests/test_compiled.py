"""The compiled functions on disk: used again, and never trusted when damaged."""

from __future__ import annotations

import errno
import importlib.util
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
