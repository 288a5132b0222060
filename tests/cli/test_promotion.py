"""``ferryid models promote`` and ``rollback``: the replay decides, and the history tells."""

from __future__ import annotations

import json
import shutil
from math import nan
from pathlib import Path

import pytest

from ferryid.compare import Replay, replay_versions
from ferryid.compare.comparison_result import Ratio
from ferryid.compare.replay import ReplayRow
from ferryid.models.store import load
from ferryid.report import promotion
from ferryid.signals.time_ranges import parse_ranges
from ferryid.types import RunContext
from tests.cli.test_every_command import SCALE, THESIS, conforms
from tests.command_line.in_process import invoke

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def fitted(fixtures: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store with two versions: the second is current."""
    folder = tmp_path_factory.mktemp("store")
    for components in ("8", "4"):
        run = invoke(
            "fit", fixtures / "short.mcap", "--vessel", "milliampere", *SCALE, *THESIS, "--components", components,
            "--out", folder,
        )  # fmt: skip
        assert run.code == 0
    return folder


@pytest.fixture
def store(fitted: Path, tmp_path: Path) -> Path:
    """The store of two versions, to be changed."""
    return shutil.copytree(fitted, tmp_path / "store")


def current(store: Path) -> str:
    return (store / "models" / "milliampere" / "current").read_text().strip()


def test_a_version_is_promoted_and_rolled_back(ferryid, fixtures: Path, store: Path) -> None:
    assert current(store) == "2"
    run = ferryid("models", "promote", "milliampere@1", fixtures / "short.bag", "--out", store, "--json", "-")
    told = conforms(run.out)
    assert (run.code, told["promoted"], told["before"], current(store)) == (0, True, 2, "1")
    assert told["replay"]
    again = ferryid("models", "promote", "milliampere@1", "--out", store)
    assert (again.code, "is the current version already" in again.out) == (0, True)
    assert (
        "milliampere@2 is current, before it was @1" in ferryid("models", "rollback", "milliampere", "--out", store).out
    )
    assert "milliampere@1 is current" in ferryid("models", "rollback", "milliampere@1", "--out", store).out
    listed = conforms(ferryid("models", "--out", store, "--json", "-").out)
    actions = [change["action"] for change in listed["history"]["milliampere"]]
    assert actions == ["fit", "fit", "promote", "rollback", "rollback"]


def test_a_version_that_is_worse_is_promoted_by_force_alone(
    ferryid, fixtures: Path, store: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    row = ReplayRow("position after 10 s", "m", 2.0, 1.0, Ratio(2.0, 1.5, 2.6, 1e-4))
    monkeypatch.setattr(promotion, "replay_versions", lambda *_: Replay((row,), (), ({"name": "a", "sha256": "b"},)))
    ferryid("models", "promote", "milliampere@1", "--out", store)
    run = ferryid("models", "promote", "milliampere@2", fixtures / "short.bag", "--out", store)
    assert (run.code, current(store)) == (3, "1")
    assert "worse than @1 in position after 10 s" in run.out
    run = ferryid("models", "promote", "milliampere@2", fixtures / "short.bag", "--force", "--out", store)
    assert (run.code, current(store)) == (0, "2")
    last = json.loads((store / "models" / "milliampere" / "history.jsonl").read_text().splitlines()[-1])
    assert (last["forced"], last["logs"]) == (True, [{"name": "a", "sha256": "b"}])


@pytest.mark.parametrize(
    ("version", "code", "told"),
    [
        ("1", 0, "It was accepted, and 1 log is too short to distinguish it from @2."),
        ("3", 3, "It was rejected by its fit, and 1 log is too short to distinguish it from @2."),
    ],
)
def test_a_replay_without_intervals_speaks_for_none(
    ferryid, fixtures: Path, store: Path, monkeypatch: pytest.MonkeyPatch, version: str, code: int, told: str
) -> None:
    models = store / "models" / "milliampere"
    rejected = json.loads((models / "1.json").read_text()) | {"version": 3, "accepted": False}
    (models / "3.json").write_text(json.dumps(rejected))
    row = ReplayRow("force in surge", "N", 1.0, 2.0, Ratio(0.5, nan, nan, nan))
    monkeypatch.setattr(promotion, "replay_versions", lambda *_: Replay((row,), (), ({"name": "a", "sha256": "b"},)))
    run = ferryid("models", "promote", f"milliampere@{version}", fixtures / "short.bag", "--out", store)
    assert (run.code, told in run.out) == (code, True), run.out
    assert "free runs  " not in run.out.replace("no free runs", "")
    assert "0.50 (too little data for one)" in run.out
    assert "nan" not in run.out


def test_a_ratio_of_forces_is_that_of_the_errors_beside_it(fitted: Path, fixtures: Path, tmp_path: Path) -> None:
    store = shutil.copytree(fitted, tmp_path / "store")
    new, old = load("milliampere@1", store), load("milliampere@2", store)
    context = RunContext(out=store, ranges=parse_ranges("0", "20"))
    rows = replay_versions(new, old, [str(fixtures / "short.bag")], context).rows
    forces = [row for row in rows if row.quantity.startswith("force in")]
    assert len(forces) == len(rows) == 3
    for row in forces:
        assert row.ratio.value == pytest.approx(row.new / row.old, rel=1e-9)


def test_a_rejected_version_needs_a_log_that_speaks_for_it(ferryid, fixtures: Path, store: Path) -> None:
    run = ferryid(
        "fit", fixtures / "short.mcap", "--vessel", "milliampere", *SCALE, "--components", "6", "--out", store
    )
    assert not load("milliampere@3", store).accepted, run.out
    run = ferryid("models", "promote", "milliampere@3", "--out", store)
    assert (run.code, current(store)) == (3, "2")
    assert "was rejected by its fit" in run.out


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("promote", "milliampere"), "names no version"),
        (("promote", "milliampere@7"), "no such version"),
        (("promote", "boat@1"), "no model of that name"),
        (("rollback", "boat"), "no model of that name"),
        (("rollback",), "models rollback: the name of a model is missing. Fix: write ferryid models rollback NAME"),
        (
            ("promote",),
            "models promote: the name of a model is missing. Fix: write ferryid models promote NAME@VERSION",
        ),
        (("rollback", "milliampere@x"), "has no version"),
        (("rollback", "milliampere", "boat"), "2 names were given"),
        (("milliampere", "boat"), "write promote or rollback"),
    ],
)
def test_what_names_no_version_is_refused(ferryid, store: Path, words: tuple[str, ...], told: str) -> None:
    run = ferryid("models", *words, "--out", store)
    assert (run.code, current(store)) == (2, "2")
    assert told in run.err
