"""Logs of one file name have labels that differ."""

from __future__ import annotations

import pytest

from ferryid.diagnose.judging.diagnosis import distinct


@pytest.mark.parametrize(
    ("paths", "labels"),
    [
        (("day1/run.bag", "day2/run.bag"), ["day1/run", "day2/run"]),
        (("day1/run.bag", "day1/other.bag"), ["run", "other"]),
        (("a/day/run.bag", "b/day/run.bag", "b/day/other.bag"), ["a/day/run", "b/day/run", "other"]),
        (("day/run.bag", "day/run.bag"), ["run", "run"]),
        (("run.bag", "day/run.bag"), ["run", "day/run"]),
    ],
)
def test_folders_distinguish_what_files_do_not(paths: tuple[str, ...], labels: list[str]) -> None:
    names = [path.rpartition("/")[2].removesuffix(".bag") for path in paths]
    assert distinct(names, paths) == labels
