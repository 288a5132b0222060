"""A part of the attack with every run of the tests, and proof that it finds what it looks for."""

from __future__ import annotations

import itertools
import os
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ferryid.ingest import open_log
from ferryid.ingest.log import Loss, Series
from tests.attack.case import EXACT, Case, Mutated, draw, format_names, formats
from tests.attack.check import Outcome, examine
from tests.attack.page import grouped, table
from tests.attack.raw import text_total
from tests.attack.run import Result, attack

SEED = int(os.environ.get("ATTACK_SEED", int(time.time())))
"""Other cases in every run; the summary of the tests prints it, with which a run is repeated."""
SECONDS = float(os.environ.get("ATTACK_SECONDS", 15))


@pytest.mark.slow
def test_no_log_breaks_what_must_hold(record_property: Callable[[str, object], None]) -> None:
    record_property("repeat", f"ATTACK_SEED={SEED}")
    end = time.monotonic() + SECONDS
    results: list[Result] = []
    for result in attack(SEED, itertools.count(1), workers=1, stop=lambda: bool(results) and time.monotonic() > end):
        results.append(result)
    found = [
        f"{len(group)} × {form}, {kind}: {text}: python -m tests.attack --seed {SEED} --only {group[0].number}"
        for form, kind, text, group in grouped(results)
    ]
    assert not found, f"ATTACK_SEED={SEED}\n" + "\n".join(found)
    assert results


class Faulty:
    """A reader that passes everything on but what a fault changes."""

    def __init__(self, path: Path, fault: Callable[[Any, dict[str, Series]], dict[str, Series]]) -> None:
        self._inner = open_log(path)
        self._fault = fault
        self.topics = self._inner.topics
        self.losses: tuple[Loss, ...] = ()

    def read(self, wanted: Any, *, verify: bool = False) -> dict[str, Series]:
        series = self._inner.read(wanted, verify=verify)
        self.losses = tuple(self._inner.losses)
        return self._fault(self, series)


def _edited(series: dict[str, Series], keep: Callable[[Series], Any]) -> dict[str, Series]:
    topic, one = next(iter(series.items()))
    rows = keep(one)
    columns = {name: values[rows] for name, values in one.columns.items()}
    stamps = None if one.stamp_ns is None else one.stamp_ns[rows]
    return {**series, topic: replace(one, receive_ns=one.receive_ns[rows], stamp_ns=stamps, columns=columns)}


def drops(reader: Any, series: dict[str, Series]) -> dict[str, Series]:
    return _edited(series, lambda one: slice(1, None))


def drops_and_reports(reader: Any, series: dict[str, Series]) -> dict[str, Series]:
    reader.losses += (Loss("log", "one message is lost", next(iter(series)), 1),)
    return drops(reader, series)


def repeats(reader: Any, series: dict[str, Series]) -> dict[str, Series]:
    return _edited(series, lambda one: np.r_[0, 0, 2 : len(one.receive_ns)])


def adds(reader: Any, series: dict[str, Series]) -> dict[str, Series]:
    return _edited(series, lambda one: np.r_[0, 0 : len(one.receive_ns)])


def changes(reader: Any, series: dict[str, Series]) -> dict[str, Series]:
    topic, one = next(iter(series.items()))
    return {**series, topic: replace(one, columns={name: values + 1 for name, values in one.columns.items()})}


def fails(reader: Any, series: dict[str, Series]) -> dict[str, Series]:
    raise KeyError("topic")


def prints(reader: Any, series: dict[str, Series]) -> dict[str, Series]:
    os.write(2, b"Exception ignored in")
    return series


def writes_beside(reader: Any, series: dict[str, Series]) -> dict[str, Series]:
    (reader._inner.paths[0].parent / "log-wal").touch()
    return series


def needs_memory(reader: Any, series: dict[str, Series]) -> dict[str, Series]:
    np.ones(150_000_000, np.uint8)
    return series


def _undamaged(name: str) -> Case:
    base = formats()[name][0][0]
    return Case(1, base, "none", Mutated("nothing", base.files))


def _examined(case: Case, tmp_path: Path, fault: Any) -> Outcome:
    (tmp_path / "tmp").mkdir()
    return examine(case, tmp_path / "case", tmp_path / "tmp", lambda path: Faulty(path, fault))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "sentence"),
    [
        (drops, "silent loss"),
        (repeats, "returned twice"),
        (adds, "too many"),
        (changes, "not those of the undamaged log"),
        (fails, "KeyError"),
        (prints, "printed by itself"),
        (writes_beside, "files beside the log"),
    ],
)
def test_a_planted_fault_is_found(fault: Any, sentence: str, tmp_path: Path) -> None:
    case = _undamaged("mcap")
    assert case.base.guard == EXACT
    outcome = _examined(case, tmp_path, fault)
    assert any(sentence in violation for violation in outcome.violations), outcome


@pytest.mark.parametrize("name", format_names())
def test_a_silent_loss_is_found_in_every_format(name: str, tmp_path: Path) -> None:
    assert any("silent loss" in each for each in _examined(_undamaged(name), tmp_path, drops).violations)


def test_a_reported_loss_is_no_violation(tmp_path: Path) -> None:
    outcome = _examined(_undamaged("mcap"), tmp_path, drops_and_reports)
    assert (outcome.result, outcome.violations) == ("loss", ())


@pytest.mark.slow
@pytest.mark.parametrize("name", format_names())
def test_undamaged_logs_are_read_whole(name: str, tmp_path: Path) -> None:
    (tmp_path / "tmp").mkdir()
    for base in formats()[name][0]:
        outcome = examine(Case(1, base, "none", Mutated("nothing", base.files)), tmp_path / "case", tmp_path / "tmp")
        assert outcome.violations == ()
        assert outcome.result == "whole" or "not closed" in base.name


def test_a_case_is_the_same_for_the_same_seed_and_number() -> None:
    for number in range(1, 40):
        first, second = draw(5, number), draw(5, number)
        assert (first.kind, first.mutated) == (second.kind, second.mutated)


@pytest.mark.slow
def test_a_worker_that_dies_is_a_violation_and_the_run_goes_on() -> None:
    results = list(attack(1, iter((1, 2, 3)), workers=1, opener=lambda path: os._exit(3)))
    assert [result.number for result in results] == [1, 2, 3]
    assert all("exit code 3" in result.outcome.violations[0] for result in results)
    assert "| **all** |  | 3 |" in table(results)


@pytest.mark.slow
def test_memory_beyond_the_limit_is_a_violation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.attack.check.BYTES", 100_000_000)
    outcome = _examined(_undamaged("text_table"), tmp_path, needs_memory)
    assert any("GB of memory" in violation for violation in outcome.violations)


@pytest.mark.parametrize(("odd", "rows"), [(b"\r", 0), (b"\n", 0), (b'"\r', 1), (b'\r"', 1)])
def test_a_line_end_in_a_quoted_cell_is_expected_to_end_no_row(odd: bytes, rows: int) -> None:
    base = next(base for base in formats()["text_table"][0] if "quoted" in base.name)
    content = base.files["log.csv"].replace(b'"0.25"', b'"' + odd + b'0.25"')
    assert text_total(base, "log.csv", content) == base.count + rows


def test_names_of_logs_differ() -> None:
    for bases, _ in formats().values():
        assert len({base.name for base in bases}) == len(bases)
