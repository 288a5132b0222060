"""Where reports go: a later one replaces an earlier one of the same logs, and no other."""

from __future__ import annotations

from pathlib import Path

from ferryid.report.folder import Place, place_of, write_folder

HEAD = '<!doctype html>\n<head>\n<meta charset="utf-8">\n</head>'


def left(reports: Path, *logs: str, options: tuple[str, ...] = ()) -> Place:
    place = place_of(reports, "diagnosis-trial", logs, ("ferryid", "diagnose", *logs, *options))
    write_folder(place, HEAD, {}, {}, "diagnosis.json")
    return place


def test_logs_of_one_name_have_reports_of_their_own(tmp_path: Path) -> None:
    may, june = (str(tmp_path / month / "trial.bag") for month in ("may", "june"))
    first, second = left(tmp_path, may), left(tmp_path, june)
    assert first.folder == tmp_path / "diagnosis-trial"
    assert second.folder.name.startswith("diagnosis-trial-")
    assert f"({first.folder} is the report of other logs of that name)" in second.note
    # Each is found again, however its path is written.
    assert left(tmp_path, may).folder == first.folder
    assert left(tmp_path, str(tmp_path / "may" / ".." / "june" / "trial.bag")).folder == second.folder
    # A campaign that begins with a log of the same name is another one.
    assert left(tmp_path, may, june).folder not in (first.folder, second.folder)


def test_a_report_with_other_options_says_which_one_it_replaces(tmp_path: Path) -> None:
    log = str(tmp_path / 'a "b" & c.bag')
    first = left(tmp_path, log, options=("--setting", "sea"))
    assert first.note == ""
    assert left(tmp_path, log, options=("--setting", "sea")).note == ""
    second = left(tmp_path, log)
    assert second.folder == first.folder
    assert second.note.strip() == f"in place of the one that was made by: {first.command}"


def test_a_report_that_says_nothing_of_itself_is_replaced(tmp_path: Path) -> None:
    write_folder(tmp_path / "diagnosis-trial", HEAD, {}, {}, "diagnosis.json")
    assert left(tmp_path, "trial.bag").folder == tmp_path / "diagnosis-trial"
    # As of a call from Python, which has no command.
    assert place_of(tmp_path, "diagnosis-trial", ()).note == ""
