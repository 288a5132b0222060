"""A new format is one file: how it is recognised, how its files are named, and how they are read."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from ferryid.errors import FerryIdError
from ferryid.ingest import formats, log_suffixes, open_log, supported_formats
from ferryid.signals.recording import log_name

LOGBOOK = """
from ferryid.ingest.log import Format, TableLayout
from ferryid.ingest.table_text import open_text
from ferryid.ingest.tables import TableReader

SUFFIXES = (".logbook",)


def opened(path, layout):
    return TableReader([open_text(path, TableLayout(time="t", skip_rows=1))])


FORMAT = Format("logbook", lambda path, head: head.startswith(b"LOGBOOK"), opened, 5, suffixes=SUFFIXES, parts=True)
"""


@pytest.fixture
def logbook(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Add the format: one file in a folder of its own."""
    (tmp_path / "formats").mkdir()
    (tmp_path / "formats" / "logbook.py").write_text(LOGBOOK)
    monkeypatch.setattr(formats, "__path__", [*formats.__path__, str(tmp_path / "formats")])
    supported_formats.cache_clear()
    yield
    supported_formats.cache_clear()


def written(folder: Path, name: str, first_s: int) -> Path:
    folder.mkdir(exist_ok=True)
    rows = "".join(f"{t},{0.1 * t}\n" for t in range(first_s, first_s + 50))
    (folder / name).write_text(f"LOGBOOK 1\nt,speed\n{rows}")
    return folder / name


@pytest.mark.usefixtures("logbook")
def test_a_format_of_one_file_is_read_and_named(tmp_path: Path) -> None:
    log = written(tmp_path / "trial", "one.logbook", 0)
    assert open_log(log).topics[0].count == 50
    assert log_name(log) == "one"
    assert ".logbook" in log_suffixes(parts=True)


@pytest.mark.usefixtures("logbook")
def test_its_files_in_a_folder_are_one_recording_whatever_lies_beside_them(tmp_path: Path) -> None:
    written(tmp_path / "trial", "b.logbook", 50)
    written(tmp_path / "trial", "a.logbook", 0)
    (tmp_path / "trial" / "notes.csv").write_text("t,what\n0,cast off\n1,moored\n")
    (topic,) = open_log(tmp_path / "trial").topics
    assert topic.count == 100


def test_without_its_file_there_is_no_such_format(tmp_path: Path) -> None:
    written(tmp_path / "trial", "one.logbook", 0)
    assert ".logbook" not in log_suffixes()
    with pytest.raises(FerryIdError, match="the folder holds no log"):
        open_log(tmp_path / "trial")


def test_suffixes_are_those_of_every_format() -> None:
    assert set(log_suffixes(parts=True)) == {".bag", ".bag.active", ".mcap", ".mcap.zstd", ".db3", ".db3.zstd"}
    assert {".csv", ".parquet", ".lz4"} < set(log_suffixes())
