"""Logs by URL: over HTTP, from a store that speaks S3, and from fsspec's memory; copied once, with the errors in one line."""

from __future__ import annotations

import shutil
import sys
import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import fsspec
import pytest

from ferryid import api
from ferryid.errors import FerryIdError
from ferryid.ingest.remote import copies_folder, is_remote, local_logs

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"
LOG = "short.mcap"


class Handler(SimpleHTTPRequestHandler):
    """Serves a folder: as a web server, and as a bucket, whose objects have a tag of their size."""

    asked: list[tuple[str, str]] = []  # noqa: RUF012 - the server makes an instance for each request

    def send_head(self) -> Any:
        self.asked.append((self.command, self.path))
        return super().send_head()

    def end_headers(self) -> None:
        if "/bucket/" in self.path:
            self.send_header("ETag", '"1"')
        super().end_headers()

    def log_message(self, *_: Any) -> None:
        pass


@pytest.fixture
def served(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[str, Path]]:
    """Address of a server, and the folder that it serves; copies go into a folder of the test."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("AWS_ACCESS_KEY_ID", "test")
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "test")
    folder = tmp_path / "served"
    (folder / "bucket").mkdir(parents=True)
    for place in (folder, folder / "bucket"):
        shutil.copy(FIXTURES / LOG, place / LOG)
    Handler.asked = []
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Handler, directory=str(folder)))
    thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
    thread.start()
    yield f"127.0.0.1:{server.server_port}", folder
    server.shutdown()
    server.server_close()
    thread.join()


def bodies() -> int:
    return sum(method == "GET" for method, _ in Handler.asked)


def test_a_url_is_not_a_path() -> None:
    assert is_remote("https://example.org/a.mcap")
    assert is_remote("s3://bucket/a.mcap")
    assert not any(is_remote(path) for path in ("a.mcap", "/a//b.mcap", "C:/a.mcap", "c://a", "a+b.bag"))
    assert local_logs("here.mcap") == ["here.mcap"]


def test_a_log_is_copied_once_and_again_when_it_changes(served: tuple[str, Path]) -> None:
    address, folder = served
    url = f"http://{address}/{LOG}"
    (path,) = local_logs(url)
    assert Path(path).is_relative_to(copies_folder())
    assert Path(path).name == LOG
    assert Path(path).read_bytes() == (FIXTURES / LOG).read_bytes()
    fetched, stamp = bodies(), Path(path).stat().st_mtime_ns
    assert local_logs(url) == [path]
    assert bodies() == fetched
    assert Path(path).stat().st_mtime_ns == stamp
    (folder / LOG).write_bytes(b"another log")
    assert Path(local_logs(url)[0]).read_bytes() == b"another log"


def test_commands_take_urls(served: tuple[str, Path]) -> None:
    address, _ = served
    found = api.inspect(f"http://{address}/{LOG}", "milliampere").json
    here = api.inspect(FIXTURES / LOG, "milliampere").json
    assert found["topics"] == here["topics"]
    assert found["vessel"]["usable"]


def test_a_bucket_that_speaks_s3(served: tuple[str, Path]) -> None:
    address, _ = served
    url = f"s3://bucket/{LOG}?scheme=http&endpoint_override={address}&region=us-east-1"
    (path,) = local_logs(url)
    assert Path(path).read_bytes() == (FIXTURES / LOG).read_bytes()


def test_patterns_parts_and_folders(served: tuple[str, Path]) -> None:
    memory = fsspec.filesystem("memory")
    for name in ("season/b.mcap", "season/a.mcap", "recording/metadata.yaml", "recording/data/recording_0.db3"):
        memory.pipe(f"/{name}", name.encode())
    try:
        paths = local_logs("memory://season/*.mcap")
        assert [Path(path).read_text() for path in paths] == ["season/a.mcap", "season/b.mcap"]
        with pytest.raises(FerryIdError, match=r"matches 2 logs, one was to be read. Fix: "):
            api.inspect("memory://season/*.mcap")
        (joined,) = local_logs("memory://season/a.mcap+memory://season/b.mcap")
        assert joined == "+".join(paths)
        (folder,) = local_logs("memory://recording")
        assert sorted(one.name for one in Path(folder).rglob("*") if one.is_file()) == [
            "metadata.yaml",
            "recording_0.db3",
        ]
    finally:
        memory.rm("/season", recursive=True)
        memory.rm("/recording", recursive=True)


@pytest.mark.parametrize(
    ("url", "found"),
    [
        ("http://{}/none.mcap", "nothing is there, a log was to be read. Fix: check the URL"),
        ("memory://none/*.mcap", "nothing is there that this matches. Fix: check the pattern"),
        ("nowhere://a/b.mcap", "cannot be read from nowhere://. Fix: use https:// or s3://"),
        ("http://127.0.0.1:1/a.mcap", "the log cannot be copied from there .*Fix: check the URL, the connection"),
        ("http://{}/", "names no file. Fix: "),
    ],
)
def test_what_cannot_be_read_is_one_line_and_leaves_nothing(served: tuple[str, Path], url: str, found: str) -> None:
    with pytest.raises(FerryIdError, match=found) as caught:
        local_logs(url.format(served[0]))
    assert "\n" not in str(caught.value)
    assert not any(path.is_file() for path in copies_folder().rglob("*"))


@pytest.mark.parametrize("missing", ["fsspec", "aiohttp"])
def test_without_the_extra_the_message_has_the_command(monkeypatch: pytest.MonkeyPatch, missing: str) -> None:
    monkeypatch.setitem(sys.modules, missing, None)
    monkeypatch.delitem(sys.modules, "fsspec.implementations.http", raising=False)
    with pytest.raises(FerryIdError, match=r"pip install 'ferryid\[remote\]'"):
        local_logs("https://127.0.0.1:1/a.mcap")
