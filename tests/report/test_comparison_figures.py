"""Figures of a comparison on a recording: residuals below the forces, and where free runs go."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from ferryid.compare.candidates import select_candidates
from ferryid.compare.comparison import Comparison, compare
from ferryid.report.comparison_figures import forces, free_run_tracks, runs_to_draw
from ferryid.report.comparison_page import render
from ferryid.report.comparison_report import report
from ferryid.types import RunContext
from tests.compare.test_comparison import heavier

pytestmark = pytest.mark.slow

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> Comparison:
    field = select_candidates(["ferry@1", "ferry@2"], [heavier(1, 1.1), heavier(2, 1.5)])
    return compare(field, [str(FIXTURES / "short.mcap")], RunContext(tmp_path_factory.mktemp("out")))


def test_on_a_narrow_window_every_cell_says_what_it_is_of(compared: Comparison) -> None:
    page = re.sub(r"<svg.*?</svg>", "", render(compared.result, compared.logs, {"date": ""})[0], flags=re.DOTALL)
    style, *tables = page.split('<table class="fold">')
    assert "@media (max-width: 700px)" in style
    assert len(tables) == 2
    for table in (one.partition("</table>")[0] for one in tables):
        heads = [head for head in re.findall(r"<th(?: [^>]*)?>(.*?)</th>", table) if head]
        rows = re.findall(r"<tr>(<td>.*?)</tr>", table, flags=re.DOTALL)
        assert len(rows) == 3
        for row in rows:
            assert re.findall(r'<td[^>]* data-of="(.*?)"', row) == heads


def test_a_residual_below_every_force(compared: Comparison) -> None:
    drawn = forces(compared.result, compared.logs[0], None)
    labels = [part.partition("</text>")[0] for part in drawn.split(">") if "[N" in part]
    assert [one.partition("<")[0] for one in labels] == [
        "surge X [N]", "residual [N]", "sway Y [N]", "residual [N]", "yaw N [N·m]", "residual [N·m]",
    ]  # fmt: skip


def test_each_free_run_has_its_panel_with_every_model(compared: Comparison) -> None:
    log = compared.logs[0]
    runs = runs_to_draw(log)
    drawn = free_run_tracks(compared.result, log, runs)
    starts = [log.motion.t[log.path_rows[run, 0]] for run in runs]
    assert [f">{start:.0f} to " in drawn for start in starts] == [True] * len(runs)
    assert drawn.count(">east [m]<") == len(runs)
    assert all(f">{label}<" in drawn for label in ("measured", *compared.result.labels))


def test_a_comparison_on_another_log_of_that_name_has_a_folder_of_its_own(compared: Comparison, tmp_path: Path) -> None:
    folders = {
        month: report(
            compared, tmp_path, ("ferryid", "compare", month), [str(tmp_path / month / "short.mcap")]
        ).report.parent
        for month in ("may", "june", "may")
    }
    assert len(set(folders.values())) == 2
    assert len(list((tmp_path / "reports").glob("compare-*"))) == 2
