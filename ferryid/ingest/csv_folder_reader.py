"""A folder of CSV files, one topic per file: its name is "/" and the path inside the folder without the suffix."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.ingest.formats.csv_folder import csv_files
from ferryid.ingest.log import Loss, TableLayout
from ferryid.ingest.table_rows import TextSheet
from ferryid.ingest.table_text import open_text
from ferryid.ingest.tables import TableReader


def open_folder(path: Path, layout: TableLayout | None) -> TableReader:
    sheets: list[TextSheet] = []
    losses: list[Loss] = []
    for file in csv_files(path):
        topic = "/" + file.relative_to(path).with_suffix("").as_posix()
        try:
            sheets.append(_sheet(file, layout, topic))
        except FerryIdError as error:
            # One unreadable file must not cost the others: it is shown as a loss.
            losses.append(Loss(file=str(file), what=str(error).removeprefix(f"{file}: "), topic=topic))
    if not sheets:
        raise FerryIdError(
            f"{path}: none of the {counted(len(losses), 'CSV file')} in this folder is a table with a time column; "
            f"{losses[0].file}: {losses[0].what}"
        )
    if len(sheets) > 1 and len({sheet.names for sheet in sheets}) == 1 and _are_relative(sheets):
        note = (
            f"{counted(len(sheets), 'file')} with the same columns: if they are separate runs, pass each file by itself"
        )
        sheets = [
            replace(s, topic=replace(s.topic, note="; ".join(filter(None, (s.topic.note, note))))) for s in sheets
        ]
    return TableReader(sheets, losses)


def _are_relative(sheets: list[TextSheet]) -> bool:
    """True where every file counts its time from its own start (before 1973 as an epoch)."""
    return all(sheet.topic.end_ns is not None and sheet.topic.end_ns < 10**17 for sheet in sheets)


def _sheet(file: Path, layout: TableLayout | None, topic: str) -> TextSheet:
    """Open one file; stamp columns that a layout names need not be in every file of a folder."""
    if layout is None or not layout.stamp:
        return open_text(file, layout, topic)
    try:
        return open_text(file, layout, topic)
    except FerryIdError:
        return open_text(file, replace(layout, stamp=()), topic)
