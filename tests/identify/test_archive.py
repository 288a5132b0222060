"""One fit over many logs from what is kept of each: the same as from their rows, once, and refused where it means nothing."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.files import dump_json
from ferryid.identify import archive as module
from ferryid.identify import block_sum_store
from ferryid.identify.archive import fit_archive
from ferryid.identify.archived_logs import archived_folders
from ferryid.identify.pipeline import fit_logs
from ferryid.identify.settings import FitSettings
from ferryid.identify.sweeps.settings_sweep import sweep_settings
from ferryid.models.model import model_to_json
from ferryid.report.fit_report import fit_archive_and_report
from ferryid.signals.parquet import read_table, write_table
from ferryid.signals.prepare import open_track
from ferryid.simulate import load_scenario, simulate, write_log
from ferryid.types import RunContext
from ferryid.vessel import load_profile, parse_profile

pytestmark = pytest.mark.slow

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"
PROFILE = load_profile("milliampere")
SETTINGS = FitSettings(delta=0.4, sigma=0.4, draws=60, estimator="derivative", accept="thesis")
"""Sums over rows hold force errors, which are the thesis's criterion."""


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    folder = tmp_path_factory.mktemp("season")
    paths = [folder / f"day{day}.mcap" for day in (1, 2, 3)]
    for seed, path in enumerate(paths):
        write_log(simulate(load_scenario("four-corner"), seed), path)
    return [str(path) for path in paths]


@pytest.fixture(scope="module")
def season(logs: list[str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("out")
    for path in logs:
        open_track(path, PROFILE, out)
    return out


@pytest.mark.parametrize(("components", "split"), [("auto", "blocks"), (12, "blocks")])
def test_the_same_as_a_fit_to_the_rows(logs: list[str], season: Path, components: str | int, split: str) -> None:
    settings = replace(SETTINGS, components=components, split=split)
    rows = fit_logs(logs, PROFILE, settings, RunContext(season))
    sums = fit_archive(PROFILE, settings, RunContext(season))
    assert sums.curve.chosen == rows.curve.chosen
    np.testing.assert_allclose(sums.model.theta, rows.judged.theta, rtol=1e-6, atol=1e-6)
    for key in ("mse", "r2"):
        for who in ("base", "model"):
            name = f"{key}_{who}"
            np.testing.assert_allclose(getattr(sums.scores.force, name), getattr(rows.scores.force, name), rtol=1e-9)
    assert sums.scores.rows == rows.scores.rows
    assert [one["rows"] for one in sums.model.training] == [one["rows"] for one in rows.judged.training]
    np.testing.assert_allclose(sums.excitation.heading_coverage, rows.excitation.heading_coverage, atol=0.09)


def test_rows_are_read_once(season: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = fit_archive(PROFILE, SETTINGS, RunContext(season))

    def never(*_: object) -> None:
        raise AssertionError("read again")

    monkeypatch.setattr(block_sum_store, "load", never)
    again = fit_archive(PROFILE, replace(SETTINGS, structure="coupled", seed=3), RunContext(season))
    assert again.model.terms == first.model.terms
    with pytest.raises(AssertionError, match="read again"):
        fit_archive(PROFILE, replace(SETTINGS, delta=0.5), RunContext(season))


def test_a_damaged_file_is_made_anew(season: Path) -> None:
    whole = fit_archive(PROFILE, SETTINGS, RunContext(season))
    for path in season.glob("logs/*/pieces-*.parquet"):
        path.write_bytes(path.read_bytes()[:-100])
    np.testing.assert_array_equal(fit_archive(PROFILE, SETTINGS, RunContext(season)).model.theta, whole.model.theta)


def test_the_same_fit_again_is_the_same_model_file(season: Path, tmp_path: Path) -> None:
    shutil.copytree(season / "logs", tmp_path / "logs", ignore=shutil.ignore_patterns("pieces-*"))
    texts = [
        dump_json(model_to_json(replace(fit_archive(PROFILE, SETTINGS, RunContext(tmp_path)).model, created="")))
        for _ in range(2)
    ]
    assert texts[0] == texts[1]


def test_sums_that_are_another_logs_are_made_anew(season: Path, tmp_path: Path) -> None:
    whole = fit_archive(PROFILE, SETTINGS, RunContext(season))
    shutil.copytree(season / "logs", tmp_path / "logs")
    first, second, _ = archived_folders(tmp_path, PROFILE)
    for path in first.glob("pieces-*.parquet"):
        shutil.copy(path, second)
    again = fit_archive(PROFILE, SETTINGS, RunContext(tmp_path))
    np.testing.assert_array_equal(again.model.theta, whole.model.theta)
    assert [log.name for log in again.archive] == ["day1", "day2", "day3"]


@pytest.mark.parametrize(
    "hurt",
    [
        lambda told: told.pop("n"),
        lambda told: told["n"][0][0].__setitem__(0, 1),
        lambda told: told.update(columns=[3, 3]),
        lambda told: told.update(shift=[[0.0]]),
        lambda told: told.update(force=None),
    ],
)
def test_what_is_told_of_sums_wrongly_is_made_anew(season: Path, tmp_path: Path, hurt: Callable[..., object]) -> None:
    whole = fit_archive(PROFILE, SETTINGS, RunContext(season))
    shutil.copytree(season / "logs", tmp_path / "logs")
    for path in tmp_path.glob("logs/day1*/pieces-*.parquet"):
        columns, told = read_table(path)
        hurt(told)
        write_table(path, columns, told)
    np.testing.assert_array_equal(fit_archive(PROFILE, SETTINGS, RunContext(tmp_path)).model.theta, whole.model.theta)


def test_sums_that_are_no_numbers_are_made_anew(season: Path, tmp_path: Path) -> None:
    whole = fit_archive(PROFILE, SETTINGS, RunContext(season))
    shutil.copytree(season / "logs", tmp_path / "logs")
    for path in tmp_path.glob("logs/day1*/pieces-*.parquet"):
        columns, told = read_table(path)
        write_table(path, {"sums": np.where(np.arange(columns["sums"].size) == 5, np.nan, columns["sums"])}, told)
    np.testing.assert_array_equal(fit_archive(PROFILE, SETTINGS, RunContext(tmp_path)).model.theta, whole.model.theta)


def test_two_recordings_of_one_file_are_refused(tmp_path: Path, logs: list[str]) -> None:
    path = tmp_path / "day.mcap"
    for log in logs[:2]:
        shutil.copy(log, path)
        open_track(str(path), PROFILE, tmp_path)
    with pytest.raises(FerryIdError, match=r"day-\w+-\w+: read from .*day.mcap, as .* changed in between.*Fix: remove"):
        archived_folders(tmp_path, PROFILE)
    open_track(logs[2], PROFILE, tmp_path)
    assert [folder.name[:5] for folder in archived_folders(tmp_path, PROFILE, ["day3"])] == ["day3-"]


@pytest.mark.parametrize("change", [{"clocks": {}}, {"name": "day4"}, {"topics": []}])
def test_a_damaged_description_of_a_log_is_refused(season: Path, tmp_path: Path, change: dict[str, object]) -> None:
    shutil.copytree(season / "logs", tmp_path / "logs")
    (note,) = tmp_path.glob("logs/day1*/recording.json")
    told = json.loads(note.read_text())
    note.write_text(json.dumps({**told, "recording": {**told["recording"], **change}}))
    with pytest.raises(FerryIdError, match=r"recording.json: .* is damaged, its checksum differs. Fix: delete"):
        archived_folders(tmp_path, PROFILE)


@pytest.mark.parametrize(("text", "fault"), [("{", "no JSON"), ('{"recording": []}', "a part of it is missing")])
def test_a_description_that_is_none_is_refused(season: Path, tmp_path: Path, text: str, fault: str) -> None:
    shutil.copytree(season / "logs", tmp_path / "logs")
    (note,) = tmp_path.glob("logs/day1*/recording.json")
    note.write_text(text)
    with pytest.raises(FerryIdError, match=fault):
        archived_folders(tmp_path, PROFILE)


def test_whole_logs_validate(season: Path) -> None:
    result = fit_archive(PROFILE, replace(SETTINGS, split="logs"), RunContext(season))
    held = [log for log in result.archive if log.validation_rows]
    assert len(held) == 1
    assert held[0].validation_rows == held[0].rows
    assert held[0].sha256 not in {log["sha256"] for log in result.model.training}


def test_a_sweep_of_the_archive_is_that_of_the_logs(logs: list[str], season: Path) -> None:
    settings = replace(SETTINGS, components="auto")
    by_rows = sweep_settings("both", logs, PROFILE, settings, RunContext(season), windows_s=(0.5, 1.0, 2.0))
    by_sums = sweep_settings("both", [], PROFILE, settings, RunContext(season), windows_s=(0.5, 1.0, 2.0), archive=True)
    # Whole logs are the same folds; stretches are cut elsewhere, along the blocks that are kept.
    np.testing.assert_allclose(by_sums.by["logs"].curves.mse, by_rows.by["logs"].curves.mse, rtol=1e-9)
    np.testing.assert_allclose(by_sums.by["blocks"].curves.mse[1, 11], by_rows.by["blocks"].curves.mse[1, 11], rtol=0.2)


def test_few_blocks_are_drawn_from_however_many_there_are(season: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_DRAWN", 4)
    drawn = module._Sums(1, 3, by_logs=False)
    for folder in archived_folders(season, PROFILE):
        drawn.add(block_sum_store.load_block_sums(folder, PROFILE, SETTINGS, (1.0,)))
    assert len(drawn.drawn[0]) == 3
    assert sum(part.n for part in drawn.drawn[0]) == sum(log.training_rows for log in drawn.logs)
    monkeypatch.setattr(module, "MOST_DRAWN", 2)
    fewer = module._Sums(1, 3, by_logs=False)
    for folder in archived_folders(season, PROFILE):
        fewer.add(block_sum_store.load_block_sums(folder, PROFILE, SETTINGS, (1.0,)))
    assert len(fewer.drawn[0]) == 2
    assert sum(part.n for part in fewer.drawn[0]) == sum(log.training_rows for log in fewer.logs)


def test_logs_are_named_and_those_of_another_profile_refused(season: Path, tmp_path: Path, logs: list[str]) -> None:
    assert len(archived_folders(season, PROFILE, ["day1", logs[1]])) == 2
    with pytest.raises(FerryIdError, match=r'day9: not among .* Did you mean "day\d"\? Fix: '):
        archived_folders(season, PROFILE, ["day9"])
    with pytest.raises(FerryIdError, match=r"no log was ingested .*Fix: ferryid ingest"):
        archived_folders(tmp_path, PROFILE)
    heavier = parse_profile(PROFILE.text.replace("mass_kg = 1670.0", "mass_kg = 1700.0"), "milliampere")
    assert heavier.sha256 != PROFILE.sha256
    with pytest.raises(FerryIdError, match=r"day1 \(and 2 more\): ingested with another profile .*Fix: "):
        archived_folders(season, heavier)
    shutil.copytree(season / "logs", tmp_path / "logs")
    open_track(logs[0], heavier, tmp_path)
    with pytest.raises(FerryIdError, match=r"\(and 1 more\): ingested with another profile"):
        archived_folders(tmp_path, heavier)
    assert len(archived_folders(tmp_path, heavier, ["day1"])) == 1


def test_a_log_with_other_measurements_is_refused_by_name(season: Path, tmp_path: Path) -> None:
    shutil.copytree(season / "logs", tmp_path / "logs")
    open_track(str(FIXTURES / "short.mcap"), PROFILE, tmp_path)
    with pytest.raises(FerryIdError, match=r"short: its basis is modulus\+wind-thesis.*, that of day1 modulus.*Fix: "):
        fit_archive(PROFILE, SETTINGS, RunContext(tmp_path))


def test_what_an_archive_cannot_do_is_said(season: Path) -> None:
    with pytest.raises(FerryIdError, match=r"every-kth: an archive keeps blocks.*Fix: "):
        fit_archive(PROFILE, replace(SETTINGS, split="every-kth"), RunContext(season))


def test_the_page_has_a_line_for_each_log(season: Path) -> None:
    outcome = fit_archive_and_report(PROFILE, SETTINGS, RunContext(season), name="season")
    page = outcome.report.read_text(encoding="utf-8")
    assert "How well it fits each log" in page
    assert all(f"<td>day{seed}</td>" in page for seed in (1, 2, 3))
    assert "What the residual still holds" not in page
    assert [log["name"] for log in outcome.json["archive"]] == ["day1", "day2", "day3"]
