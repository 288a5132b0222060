"""The weak form over an archive: the same as a fit to the logs, from kept windows, or refused where it makes no sense."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.files import dump_json
from ferryid.identify import weak_archive, window_store
from ferryid.identify.archive import fit_archive
from ferryid.identify.archived_logs import archived_folders
from ferryid.identify.log_windows import LogWindows, average_log
from ferryid.identify.pipeline import fit_logs
from ferryid.identify.settings import FitSettings
from ferryid.identify.split import split_rows
from ferryid.identify.thresholds import IDENTIFY
from ferryid.identify.weak_data import WeakData
from ferryid.identify.weak_rows import WeakRows
from ferryid.identify.windowed_data import WindowedData
from ferryid.models.model import model_to_json
from ferryid.regression.bases import make_basis
from ferryid.signals.parquet import read_table, write_table
from ferryid.signals.prepare import open_track
from ferryid.signals.smooth import smooth_measured
from ferryid.simulate import load_scenario, simulate, write_log
from ferryid.types import RunContext
from ferryid.vessel import load_profile, parse_profile
from ferryid.vessel.dimensions import window_seconds
from tests.identify.trials import measured

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"
PROFILE = load_profile("milliampere")
SETTINGS = FitSettings(delta=0.4, sigma=0.4, draws=20, estimator="weak")


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
    fit_archive(PROFILE, SETTINGS, RunContext(out))
    return out


def test_windows_are_taken_by_rows_and_neighbours_by_what_is_left() -> None:
    log = average_log(PROFILE, SETTINGS, make_basis("modulus"), smooth_measured(measured(1), 1.0), divided=False)
    (part,), m = log.parts, log.length
    low, high = int(part.measured.start[5]), int(part.measured.start[9]) + m
    inner, outer = part.between(low, high, m), part.without(low, high, m)
    np.testing.assert_array_equal(inner.measured.start, part.measured.start[5:10])
    # A window that shares a row with what is left out is in neither: half of a neighbour on both sides.
    np.testing.assert_array_equal(
        outer.measured.start, np.concatenate([part.measured.start[:4], part.measured.start[11:]])
    )
    np.testing.assert_array_equal(np.diff(outer.measured.run), np.arange(1, len(outer.measured)) == 4)
    assert len(inner.nu) + len(outer.nu) == len(part.nu)
    assert part.none().rows == len(part.none().measured) == len(part.none().nu) == 0
    load = inner.load_measured
    assert load is not None
    assert part.load_measured is not None
    np.testing.assert_array_equal(load.psi, part.load_measured.psi[5:10])


def test_a_log_that_was_divided_has_no_window_in_both_parts() -> None:
    log = average_log(PROFILE, SETTINGS, make_basis("modulus"), smooth_measured(measured(1), 1.0), divided=True)
    train, held_out = log.parts
    purge = log.purge_s * log.rate_hz
    apart = np.abs(train.measured.start[:, None] - held_out.measured.start[None, :])
    assert apart.min() >= log.length + purge - 1
    assert log.whole is None
    assert held_out.blocks >= 3
    short = average_log(
        PROFILE, SETTINGS, make_basis("modulus"), smooth_measured(measured(1, seconds=30.0), 1.0), divided=True
    )
    assert short.whole is short.parts[0]


def test_of_short_logs_the_second_and_fifth_validate_as_in_a_fit_to_the_logs() -> None:
    made = [smooth_measured(measured(seed, seconds=30.0 if seed < 6 else 240.0), 1.0) for seed in range(1, 7)]
    split = split_rows(made, window_s=1.0)
    logs = [average_log(PROFILE, SETTINGS, make_basis("modulus"), one, divided=True) for one in made]
    trained, validated = weak_archive._divided(logs, "blocks")
    assert [part.rows > 0 for part in validated] == [False, True, False, False, True, True]
    assert [part.rows for part in trained] == [int(rows.sum()) for rows in split.training]
    assert [part.rows for part in validated] == [int(rows.sum()) for rows in split.validation]


@pytest.mark.slow
@pytest.mark.parametrize(
    "change", [{}, {"components": 5, "structure": "coupled"}, {"weak_window_s": 5.0, "window_s": 2.0}]
)
def test_the_same_as_a_fit_to_the_training_rows_of_the_logs(
    logs: list[str], season: Path, change: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(WeakData, "undivided", lambda _: None)
    settings = replace(SETTINGS, **change)
    rows = fit_logs(logs, PROFILE, settings, RunContext(season))
    for _ in range(2):  # made, and read
        kept = fit_archive(PROFILE, settings, RunContext(season))
        scale = np.abs(rows.model.theta).max()
        for name in ("theta", "intercept", "low", "high", "covariance"):
            np.testing.assert_allclose(
                getattr(kept.model, name), getattr(rows.model, name), rtol=1e-9, atol=1e-9 * scale, err_msg=name
            )
        np.testing.assert_allclose(kept.scores.force.mse_model, rows.scores.force.mse_model, rtol=1e-9)
        assert kept.scores.rows == rows.scores.rows
        assert kept.scores.seconds == pytest.approx(rows.scores.seconds)
        assert kept.curve.chosen == rows.curve.chosen
        assert kept.winds == rows.winds
        assert len(kept.winds) == 3
        # An archive keeps no samples by which copies of its logs would be known.
        assert kept.model.training == tuple(
            {k: v for k, v in log.items() if k != "motion"} for log in rows.model.training
        )
        assert kept.model.settings["weak_window_s"] == rows.model.settings["weak_window_s"]
        checks = {check.name: check for check in rows.acceptance.checks}
        for check in kept.acceptance.checks:
            if check.name.startswith(("mass", "inertia", "held_out")):
                assert check.value == pytest.approx(checks[check.name].value)
    assert {log.name for log in kept.archive} == {"day1", "day2", "day3"}
    assert all(np.isfinite(log.mse_ratio).all() and log.validation_rows < log.rows for log in kept.archive)


@pytest.mark.slow
def test_free_runs_decide_nothing(season: Path) -> None:
    found = fit_archive(PROFILE, SETTINGS, RunContext(season))
    (check,) = (one for one in found.acceptance.checks if one.name == "free_run")
    assert check.passed is None
    assert "a fit over an archive sees no motion" in check.reason
    assert not found.logs


@pytest.mark.slow
def test_rows_are_read_once(season: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = fit_archive(PROFILE, SETTINGS, RunContext(season))

    def never(*_: object) -> None:
        raise AssertionError("read again")

    monkeypatch.setattr(window_store, "load", never)
    again = fit_archive(PROFILE, replace(SETTINGS, structure="coupled", seed=3), RunContext(season))
    assert again.model.terms == first.model.terms
    for change in ({"delta": 0.5}, {"weak_window_s": 6.0}, {"split": "logs"}, {"basis": "thesis"}, {"window_s": 0.5}):
        with pytest.raises(AssertionError, match="read again"):
            fit_archive(PROFILE, replace(SETTINGS, **change), RunContext(season))


@pytest.mark.slow
def test_the_same_fit_again_is_the_same_model_file(season: Path, tmp_path: Path) -> None:
    shutil.copytree(season / "logs", tmp_path / "logs", ignore=shutil.ignore_patterns("windows-*"))
    texts = [
        dump_json(model_to_json(replace(fit_archive(PROFILE, SETTINGS, RunContext(tmp_path)).model, created="")))
        for _ in range(2)
    ]
    assert texts[0] == texts[1]


@pytest.mark.slow
def test_what_is_read_is_what_was_kept(season: Path, tmp_path: Path) -> None:
    shutil.copytree(season / "logs", tmp_path / "logs", ignore=shutil.ignore_patterns("windows-*"))
    (folder, *_) = archived_folders(tmp_path, PROFILE)
    made, read = (window_store.load_windows(folder, PROFILE, SETTINGS, divided=True) for _ in range(2))
    for one, other in zip(made.parts, read.parts, strict=True):
        for steadied in (False, True):
            for field in fields(WeakRows):
                np.testing.assert_array_equal(
                    getattr(one.windows(steadied), field.name), getattr(other.windows(steadied), field.name)
                )
            load, again = one.load(steadied), other.load(steadied)
            assert load is not None
            assert again is not None
            np.testing.assert_array_equal(load.nu, again.nu)
            np.testing.assert_array_equal(load.weight, again.weight)
        assert not np.array_equal(one.measured.functions, one.steadied.functions)
        assert one.ranges == other.ranges
    for field in fields(LogWindows):
        if field.name != "parts":
            assert getattr(made, field.name) == getattr(read, field.name), field.name


@pytest.mark.slow
@pytest.mark.parametrize(
    "hurt",
    [
        lambda told: told.pop("parts"),
        lambda told: told["parts"][0]["arrays"].pop(),
        lambda told: told["parts"][0]["arrays"][0].__setitem__(1, [3]),
        lambda told: told["parts"].pop(),
        lambda told: told.update(schema="ferryid.windows/0"),
        lambda told: told["key"].update(delta=0.3),
        lambda told: told["parts"][0].update(force=None),
        lambda told: told.update(name="day9"),
    ],
)
def test_what_is_told_of_windows_wrongly_is_made_anew(
    season: Path, tmp_path: Path, hurt: Callable[..., object], monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(season / "logs", tmp_path / "logs", ignore=shutil.ignore_patterns("windows-*"))
    (folder, *_) = archived_folders(tmp_path, PROFILE)
    whole = window_store.load_windows(folder, PROFILE, SETTINGS, divided=True)
    (path,) = folder.glob("windows-*.parquet")
    columns, told = read_table(path)
    hurt(told)
    write_table(path, columns, told)
    again = window_store.load_windows(folder, PROFILE, SETTINGS, divided=True)
    np.testing.assert_array_equal(again.parts[1].measured.functions, whole.parts[1].measured.functions)
    assert again.name == "day1"
    monkeypatch.setattr(window_store, "load", None)
    window_store.load_windows(folder, PROFILE, SETTINGS, divided=True)


@pytest.mark.slow
def test_damaged_windows_and_those_of_another_log_are_made_anew(season: Path, tmp_path: Path) -> None:
    shutil.copytree(season / "logs", tmp_path / "logs")
    first, second, _ = archived_folders(tmp_path, PROFILE)
    whole = window_store.load_windows(first, PROFILE, SETTINGS, divided=True)
    for path in first.glob("windows-*.parquet"):
        shutil.copy(path, second)
        columns, told = read_table(path)
        write_table(path, {"values": np.where(np.arange(columns["values"].size) == 5, np.nan, columns["values"])}, told)
    again = window_store.load_windows(first, PROFILE, SETTINGS, divided=True)
    np.testing.assert_array_equal(again.parts[0].nu, whole.parts[0].nu)
    np.testing.assert_array_equal(again.parts[0].second, whole.parts[0].second)
    assert window_store.load_windows(second, PROFILE, SETTINGS, divided=True).name == "day2"
    for path in first.glob("windows-*.parquet"):
        path.write_bytes(path.read_bytes()[:-100])
    again = window_store.load_windows(first, PROFILE, SETTINGS, divided=True)
    np.testing.assert_array_equal(again.parts[0].nu, whole.parts[0].nu)


@pytest.mark.slow
def test_whole_logs_validate(season: Path) -> None:
    found = fit_archive(PROFILE, replace(SETTINGS, split="logs"), RunContext(season))
    (held,) = (log for log in found.archive if log.validation_rows)
    assert held.validation_rows == held.rows
    assert held.sha256 not in {log["sha256"] for log in found.model.training}
    assert found.scores.split == "logs"


@pytest.mark.slow
def test_logs_that_do_not_add_up_are_refused_by_name(season: Path, tmp_path: Path) -> None:
    shutil.copytree(season / "logs", tmp_path / "logs")
    open_track(str(FIXTURES / "short.mcap"), PROFILE, tmp_path)
    with pytest.raises(FerryIdError, match=r"short: its basis is modulus\+wind-thesis.*, that of day1 modulus.*Fix: "):
        fit_archive(PROFILE, SETTINGS, RunContext(tmp_path))
    heavier = parse_profile(PROFILE.text.replace("mass_kg = 1670.0", "mass_kg = 1700.0"), "milliampere")
    with pytest.raises(FerryIdError, match=r"day1 \(and \d more\): ingested with another profile .*Fix: "):
        fit_archive(heavier, SETTINGS, RunContext(season))


@pytest.mark.slow
def test_what_the_weak_form_of_an_archive_cannot_do_is_said(season: Path, tmp_path: Path) -> None:
    for change, says in (
        ({"split": "every-kth"}, r"every-kth: an archive keeps blocks.*Fix: "),
        ({"windows_s": (0.5, 1.0)}, r"--window auto: .*Fix: give --window 1"),
        ({"residual": "commanded"}, r"the weak form explains the measured force, found --residual commanded. Fix: "),
        ({"weak_window_s": 120.0}, r"day1: (the weak form needs|too little for validation).*Fix: "),
        ({"components": 500}, r"--components: 500 are more .*Fix: "),
    ):
        with pytest.raises(FerryIdError, match=says) as error:
            fit_archive(PROFILE, replace(SETTINGS, **change), RunContext(season))
        assert "\n" not in str(error.value)


@pytest.mark.slow
def test_swapped_thrusters_are_refused_in_an_archive_as_well(season: Path) -> None:
    text = PROFILE.text
    stern, bow = (line for line in text.splitlines() if line.strip().startswith("position_m"))
    swapped = text.replace(stern, "@").replace(bow, stern).replace("@", bow)
    profile = parse_profile(swapped, "milliampere")
    for folder in archived_folders(season, PROFILE):
        note = json.loads((folder / "recording.json").read_text())
        open_track(note["files"][0][0], profile, season.parent / "swapped")
    with pytest.raises(FerryIdError, match=r"day1: the yaw moment accelerates .*exchanged.*Fix: "):
        fit_archive(profile, SETTINGS, RunContext(season.parent / "swapped"))


@pytest.mark.slow
def test_some_of_many_logs_choose_the_length_of_windows(season: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = fit_archive(PROFILE, SETTINGS, RunContext(season))
    monkeypatch.setattr("ferryid.identify.some_logs.IDENTIFY", replace(IDENTIFY, sample_logs=2, sample_windows=1))
    asked: list[int] = []

    def chosen(candidates: dict[float, WindowedData]) -> WindowedData:
        asked.extend(len(one.logs) for one in candidates.values())
        return candidates[2.0]

    monkeypatch.setattr(weak_archive, "best_length", chosen)
    found = fit_archive(PROFILE, SETTINGS, RunContext(season))
    assert asked == [2] * 4
    assert found.model.settings["weak_window_s"] == pytest.approx(2.0 * window_seconds(PROFILE))
    names = [[log["name"] for log in one.model.training] for one in (found, before)]
    assert names[0] == names[1]
    assert len(found.winds) == 3
