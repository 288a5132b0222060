"""Output is there whole, or not at all."""

from __future__ import annotations

import errno
from pathlib import Path

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.files import dump_json, replacing, write_text


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
    with pytest.raises(FerryIdError, match="cannot be written"):
        write_text(tmp_path / "out" / "model.json", "x")


def test_json_has_no_nan_and_plain_numbers() -> None:
    text = dump_json(
        {"a": np.array([1.0, np.nan, np.inf]), "b": np.float64(2.5), "c": np.int64(3), "d": np.bool_(True)}
    )
    assert text == '{\n "a": [\n  1.0,\n  null,\n  null\n ],\n "b": 2.5,\n "c": 3,\n "d": true\n}\n'
