"""Output is there whole, or not at all."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ferryid import cli, files
from ferryid.errors import FerryIdError
from ferryid.files import dump_json, make_folder, remove_abandoned, remove_unfinished, replacing, write_text
from tests.batch.work import environment


def test_an_interrupt_leaves_the_old_file_and_no_rest(tmp_path: Path) -> None:
    target = tmp_path / "model.json"
    write_text(target, "old")

    def half_way() -> None:
        with replacing(target) as temporary:
            temporary.write_text("half", encoding="utf-8")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        half_way()
    assert target.read_text(encoding="utf-8") == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["model.json"]


def test_a_folder_replaces_a_folder(tmp_path: Path) -> None:
    target = tmp_path / "report"
    for text in ("old", "new"):
        with replacing(target) as temporary:
            temporary.mkdir()
            (temporary / text).write_text(text, encoding="utf-8")
    assert [path.name for path in target.iterdir()] == ["new"]


def test_a_full_disk_is_told_with_a_remedy(tmp_path: Path) -> None:
    with pytest.raises(FerryIdError, match="disk is full"), replacing(tmp_path / "a"):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert list(tmp_path.iterdir()) == []


def test_a_file_in_the_place_of_the_folder_is_told(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("a file", encoding="utf-8")
    with pytest.raises(
        FerryIdError,
        match=f"^{tmp_path / 'out'}: is a file, and a folder was to be there, .* cannot be written. Fix: .* with --file",
    ):
        write_text(tmp_path / "out" / "deeper" / "model.json", "x", by="--file")


def test_json_has_no_nan_and_plain_numbers() -> None:
    text = dump_json(
        {"a": np.array([1.0, np.nan, np.inf]), "b": np.float64(2.5), "c": np.int64(3), "d": np.bool_(True)}
    )
    assert text == '{\n "a": [\n  1.0,\n  null,\n  null\n ],\n "b": 2.5,\n "c": 3,\n "d": true\n}\n'


WRITER = """
import sys, time
from pathlib import Path
from ferryid.files import replacing
with replacing(Path(sys.argv[1])) as temporary:
    temporary.mkdir()
    (temporary / "page").write_text("half")
    print("writing", flush=True)
    sys.stdin.read()
"""


def writing(path: Path) -> subprocess.Popen[str]:
    process = subprocess.Popen(
        [sys.executable, "-c", WRITER, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        env=environment(),
    )  # fmt: skip
    assert process.stdout is not None
    assert process.stdout.readline() == "writing\n"
    return process


def test_what_a_killed_process_left_is_removed_and_what_a_living_one_writes_is_not(tmp_path: Path) -> None:
    with writing(tmp_path / "dead") as dead, writing(tmp_path / "alive") as alive:
        dead.send_signal(signal.SIGKILL)
        dead.wait()
        assert len(list(tmp_path.glob(".dead.*"))) == 2
        write_text(tmp_path / "other", "x")
        assert not list(tmp_path.glob(".dead.*"))
        alive.communicate("")
    assert (tmp_path / "alive" / "page").read_text(encoding="utf-8") == "half"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["alive", "other"]


UNPACKING = """
import os, signal, sys, tempfile
from pathlib import Path
from ferryid.files import scratch_folder
tempfile.tempdir = sys.argv[1]
folder = scratch_folder()
(folder / "unpacked.bag").write_bytes(b"x" * 1000)
print(folder.name, flush=True)
if sys.argv[2] == "killed":
    os.kill(os.getpid(), signal.SIGKILL)
sys.stdin.read()
"""


def test_unpacked_logs_of_a_killed_process_are_removed_by_the_next_and_those_of_a_living_one_are_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def process(what: str) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [sys.executable, "-c", UNPACKING, str(tmp_path), what],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment(),
        )

    with process("lives") as living:
        assert living.stdout is not None
        alive = tmp_path / living.stdout.readline().decode().strip()
        with process("killed") as killed:
            assert killed.stdout is not None
            left = tmp_path / killed.stdout.readline().decode().strip()
            assert killed.wait(60) == -signal.SIGKILL
        assert (left / "unpacked.bag").exists()
        others = tmp_path / "ferryid-bench-x", tmp_path / ("a" * 32)
        for other in others:
            other.mkdir()
        monkeypatch.setattr(files.tempfile, "tempdir", str(tmp_path))
        own = files.scratch_folder()
        assert not left.exists()
        assert (alive / "unpacked.bag").exists()
        assert own.is_dir()
        assert all(other.is_dir() for other in others)
        files.remove_scratch(own)
        living.kill()
    assert {path.name for path in tmp_path.iterdir()} == {
        alive.name,
        f"{alive.name}.lock",
        *(other.name for other in others),
    }


def test_foreign_files_are_not_taken_for_leftovers(tmp_path: Path) -> None:
    names = [".film.part", f"{0:032x}.part", ".a.lock", f".a.{0:031x}.part", "b.old"]
    for name in names:
        (tmp_path / name).write_text("", encoding="utf-8")
    remove_abandoned(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(names)


def test_a_folder_that_was_moved_aside_comes_back(tmp_path: Path) -> None:
    for name in ("report", "other"):
        (tmp_path / f".{name}.{0:032x}.old").mkdir()
        (tmp_path / f".{name}.{0:032x}.old" / "page").write_text("old", encoding="utf-8")
    (tmp_path / "other").mkdir()
    remove_abandoned(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["other", "report"]
    assert (tmp_path / "report" / "page").read_text(encoding="utf-8") == "old"


def test_a_process_that_ends_at_once_removes_what_it_writes(tmp_path: Path) -> None:
    def ends() -> None:
        with replacing(tmp_path / "report") as temporary:
            temporary.mkdir()
            remove_unfinished()
            assert list(tmp_path.iterdir()) == []

    with pytest.raises(FerryIdError):
        ends()


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Record what is synced and renamed."""
    found: list[str] = []

    def noted(name: str, path: Callable[..., str]) -> None:
        real = getattr(os, name)

        def call(*arguments: object) -> object:
            result = real(*arguments)
            found.append(f"{name} {Path(path(*arguments)).name}")
            return result

        monkeypatch.setattr(os, name, call)

    noted("fsync", lambda number: os.readlink(f"/proc/self/fd/{number}"))
    for name in ("replace", "rename", "link"):
        noted(name, lambda source, target: target)
    return found


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.parametrize("new", [False, True])
def test_a_file_is_synced_before_it_is_renamed_and_its_folder_after(
    tmp_path: Path, calls: list[str], new: bool
) -> None:
    with replacing(tmp_path / "new" / "a", new=new) as temporary:
        temporary.write_text("x", encoding="utf-8")
    name = temporary.name
    assert calls == [f"fsync {tmp_path.name}", f"fsync {name}", f"{'link' if new else 'replace'} a", "fsync new"]


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_all_of_a_folder_is_synced_before_it_is_renamed(tmp_path: Path, calls: list[str]) -> None:
    with replacing(tmp_path / "report") as temporary:
        (temporary / "figures").mkdir(parents=True)
        (temporary / "figures" / "a").touch()
        (temporary / "b").touch()
    name = temporary.name
    # Files at once, in any order, and folders when all that is in them is on disk.
    assert sorted(calls[:2]) == ["fsync a", "fsync b"]
    assert calls[2:] == ["fsync figures", f"fsync {name}", "replace report", f"fsync {tmp_path.name}"]


def test_a_folder_is_written_where_there_is_no_room_for_a_thread(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(thread: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", refuse)
    with replacing(tmp_path / "report") as temporary:
        temporary.mkdir()
        for name in "ab":
            (temporary / name).write_text(name, encoding="utf-8")
    assert sorted(one.name for one in (tmp_path / "report").iterdir()) == ["a", "b"]


def test_a_file_system_without_links_and_syncs_is_written_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.ENOTSUP, "not supported")

    monkeypatch.setattr(os, "link", refuse)
    monkeypatch.setattr(os, "fsync", refuse)
    monkeypatch.setattr(files, "_lock", lambda number, wait: None)
    for _ in range(2):
        with replacing(tmp_path / "a", new=True) as temporary:
            temporary.write_text("x", encoding="utf-8")
        (tmp_path / "a").unlink()
    make_folder(tmp_path / "b" / "c")
    assert [path.name for path in tmp_path.iterdir()] == ["b"]


@pytest.mark.parametrize("folder", [False, True])
def test_what_is_there_is_never_taken_by_a_new_result(tmp_path: Path, folder: bool) -> None:
    write_text(tmp_path / "a", "old")
    with pytest.raises(FerryIdError, match="exists already"), replacing(tmp_path / "a", new=True) as temporary:
        temporary.mkdir() if folder else temporary.touch()
    assert [path.name for path in tmp_path.iterdir()] == ["a"]
    assert (tmp_path / "a").read_text(encoding="utf-8") == "old"


def test_paths_are_resolved_in_one_place() -> None:
    # Path.resolve raises for links that lead round in a circle, where `resolved` does not.
    for module in (files, cli):
        for source in Path(module.__file__).parent.rglob("*.py"):
            left = source.read_text(encoding="utf-8").replace("Path(__file__).resolve()", "")
            assert ".resolve()" not in left, source
