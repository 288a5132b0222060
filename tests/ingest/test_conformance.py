"""Bags that other projects published to test readers: each opens and lists, or is refused in one line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from ferryid.errors import FerryIdError
from ferryid.ingest import open_log

ROOT = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "conformance"
FILES = sorted(path.relative_to(ROOT).as_posix() for path in ROOT.rglob("*") if path.is_file())
FOLDERS = sorted({Path(name).parent.as_posix() for name in FILES if name.endswith((".db3", ".mcap", ".yaml"))})
READABLE = (".bag", ".mcap", ".db3", ".yaml")
# What cannot be used, and the word that its refusal must contain.
REFUSED = {
    "empty-file.bag": "empty",
    "wrong_rmw_test": "wrong_format",
}


@pytest.mark.parametrize("name", [*FILES, *FOLDERS] or ["."])
def test_every_published_bag_is_listed_or_refused_in_one_line(name: str, shared_data: Callable[[str], Path]) -> None:
    path = shared_data(f"conformance/{name}")
    refusal = REFUSED.get(path.parent.name if path.name == "metadata.yaml" else path.name)
    try:
        log = open_log(path)
        for topic in log.topics:
            assert topic.name
            assert (topic.count == 0) == (topic.start_ns is None)
        decodable = {topic.name: () for topic in log.topics if topic.fields}
        for topic_name, series in log.read(decodable).items():
            counted = next(topic.count for topic in log.topics if topic.name == topic_name)
            lost = [loss for loss in log.losses if loss.topic in (None, topic_name)]
            assert series.receive_ns.size == counted or lost
    except FerryIdError as error:
        line = str(error)
        assert "\n" not in line
        assert line.startswith(str(path.parent if path.name == "metadata.yaml" else path))
        assert " Fix: " in line
        assert refusal is None or refusal in line
        assert refusal is not None or not (path.is_dir() or path.suffix in READABLE), line
    else:
        assert refusal is None
