"""The scripts that the pages of an output folder share: written once, and nothing stays beside them."""

from __future__ import annotations

from pathlib import Path

from ferryid import files
from ferryid.report.interactive import write_assets
from tests.report.pages import NEEDS_UPLOT


@NEEDS_UPLOT
def test_what_a_loss_of_power_left_beside_the_scripts_is_removed(tmp_path: Path) -> None:
    write_assets(tmp_path)
    (made,) = (tmp_path / "reports" / "assets").iterdir()
    lock = made.with_name(f".{made.name}.{32 * 'a'}.lock")
    lock.touch()
    # Another process looks through the folder for the first time.
    files._swept.clear()
    write_assets(tmp_path)
    assert list(made.parent.iterdir()) == [made]
