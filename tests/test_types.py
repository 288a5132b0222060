"""The context of a run: where ingested tables are kept."""

from __future__ import annotations

from pathlib import Path

from ferryid.types import IN_MEMORY, RunContext


def test_tables_are_kept_in_the_output_folder_in_another_or_nowhere() -> None:
    out, other = Path("out"), Path("other")
    assert RunContext(out).tables == out
    assert RunContext(out, tables_out=other).tables == other
    assert RunContext(out, tables_out=other, keep_tables=False).tables is None
    assert IN_MEMORY.tables is None
