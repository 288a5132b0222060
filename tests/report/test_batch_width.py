"""The table of a batch in headless Chromium: however long its names are, it folds in its own box and the page is not wider."""

from __future__ import annotations

from pathlib import Path

import pytest

from ferryid.report.batch_page import render
from ferryid.report.batch_rows import BatchResult
from tests.batch.rows import finding, result, row
from tests.report.browser import CHROMIUM, Page

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM, reason="there is no Chromium to open the pages with"),
]


def long() -> BatchResult:
    """Return a batch with names, notes and findings that take all the room they are given."""
    name = "2016-02-11_harbour_acceptance_of_the_new_stern_thruster_second_attempt"
    found = tuple(
        finding(effect, instance, probability=p, factor=0.612)
        for effect, instance, p in (("thruster_gain", name, 0.99), ("azimuth_offset", "bow_port", 0.3))
    )
    reason = (
        "fit: too short for three blocks and the gaps between them, found 29.0 s of usable rows and 38.7 s are needed."
    )
    model = f"{name}@12"
    axes = dict.fromkeys(("surge", "sway", "yaw"), 12345.6)
    errors = {"of": model, "result": "", "normalised_mse": 0.7, "per_axis": axes, "mse": axes, "warnings": []}
    return result(
        row(f"/archive/{name}/{name}.bag", note=name, findings=found, evaluate=errors),
        row(f"/archive/{name}/{name[::-1]}.bag", 2, note="calm", status="partly", reason=reason),
        model=model,
    )


@pytest.mark.parametrize("width", [420, 800, 1200, 1500])
def test_long_names_of_a_batch_fold_in_their_own_box(page: Page, tmp_path: Path, width: int) -> None:
    path = tmp_path / "index.html"
    path.write_text(render(long()), encoding="utf-8")
    page.faults.clear()
    page.open(path, width)
    assert page.do("document.documentElement.scrollWidth <= document.documentElement.clientWidth")
    cut = "[...document.querySelectorAll('.scroll')].filter((one) => one.scrollWidth > one.clientWidth + 1).length"
    assert page.do(cut) == 0
    # What reaches beyond its own cell is drawn over the next one.
    over = "[...document.querySelectorAll('#logs td')].filter((one) => one.scrollWidth > one.clientWidth + 1).length"
    assert page.do(over) == 0
    assert page.faults == []


def test_a_batch_that_is_made_narrower_folds_and_unfolds_again(page: Page, tmp_path: Path) -> None:
    path = tmp_path / "index.html"
    path.write_text(render(long()), encoding="utf-8")
    shape = "getComputedStyle(document.getElementById('logs')).display"
    page.open(path, 3200)
    page.do("document.body.style.maxWidth = 'none'")
    page.settle()
    seen = []
    for width in (3300, 1450, 3300):
        page.send("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=False)
        page.settle()
        seen.append(page.do(shape))
    assert seen == ["table", "block", "table"]
