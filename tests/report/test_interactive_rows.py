"""Interactive figures whose axis is no time, in headless Chromium: of a batch over dates, and of structures by their names."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from ferryid.identify.sweeps import StructureComparison
from ferryid.report.batch_page import render, timelines
from ferryid.report.html import template
from ferryid.report.interactive import make_interactive
from ferryid.report.structures_timeline import structures_timeline
from ferryid.report.timeline import Axis, Strip, Timeline, Trace
from tests.report.browser import CHROMIUM, Page
from tests.report.pages import NEEDS_UPLOT
from tests.report.test_interactive import SHIFT, named
from tests.report.test_row_timelines import season, structure

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM, reason="there is no Chromium to open the pages with"),
    NEEDS_UPLOT,
]
FIRST = "ferryid.all[0]"
RANGE = "document.querySelector('.timeline .range').textContent"
POINT = """(() => {{
  const plot = ferryid.all[0].strips.rows[{strip}].plot;
  const box = plot.over.getBoundingClientRect();
  return [box.x + plot.valToPos(plot.data[0][{row}], 'x'), box.y + plot.valToPos(plot.data[{trace}][{row}], 'y')];
}})()"""


def write(folder: Path, page: str, files: dict[str, str]) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in {"index.html": page, **files}.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder / "index.html"


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("batch")
    interactive = make_interactive(timelines(season()), out / "batch", out)
    return write(out / "batch", render(season(), interactive), interactive.files())


@pytest.fixture
def opened(opened: Page) -> Page:
    """Give the page of the batch with its first figure in the middle of the window."""
    opened.do("document.querySelector('.timeline').scrollIntoView({block: 'center', behavior: 'instant'})")
    opened.settle()
    return opened


def point(page: Page, trace: int, row: int, strip: int = 0) -> tuple[float, float]:
    """Return where on the screen the point of a trace and row of the first figure is."""
    page.middle(".u-over", strip)
    x, y = page.do(POINT.format(strip=strip, trace=trace, row=row))
    return x, y


def test_the_cursor_tells_the_log_and_its_interval(opened: Page) -> None:
    assert opened.do(RANGE) == "2024-05-01 to 2024-05-04"
    opened.mouse("mouseMoved", *point(opened, 1, 1))
    opened.settle()
    assert opened.do(RANGE).endswith(" · cursor 2024-05-02 00:00 2.mcap")
    shown = opened.do(f"{FIRST}.strips.rows[0].outputs.map((one) => one.textContent)")
    assert shown == ["0.9 (-0.1 to 1.9)", "–", "–"]


def test_keys_go_from_log_to_log_and_to_its_row(opened: Page) -> None:
    opened.do("document.querySelector('.timeline').focus()")
    opened.key("ArrowRight")
    names = []
    for _ in range(2):
        opened.key("ArrowRight")
        names.append(opened.do(RANGE).rpartition(" ")[2])
    # Logs of one day are apart.
    assert names == ["4b.mcap", "4.mcap"]
    opened.key("Enter")
    assert opened.do("location.hash") == "#log-5"
    opened.do("document.querySelector('.timeline').focus()")
    opened.key("+")
    width = opened.do(f"{FIRST}.to - {FIRST}.from")
    opened.key("ArrowLeft", SHIFT)
    assert opened.do(f"{FIRST}.to - {FIRST}.from") == pytest.approx(width)
    opened.key("0")
    assert opened.do(RANGE).startswith("2024-05-01 to 2024-05-04")


def test_a_click_on_a_point_leads_to_the_row_of_its_log_even_if_filtered_out(opened: Page) -> None:
    opened.do("document.querySelector('#filters [name=text]').value = '2.mcap'")
    opened.do("document.querySelector('#filters').dispatchEvent(new Event('input'))")
    assert opened.do("document.querySelector('#log-1').hidden")
    x, y = point(opened, 2, 2)
    opened.drag(x - 60.0, y, x, y, SHIFT)
    assert opened.do("location.hash") == "", "the end of a drag is no click"
    opened.mouse("mouseMoved", *point(opened, 2, 2))
    assert opened.do("document.querySelector('.u-over').style.cursor") == "pointer"
    # Also while dragging moves.
    opened.click(named("whether dragging zooms or moves the horizontal axis"))
    x, y = point(opened, 2, 2)
    for kind in ("mousePressed", "mouseReleased"):
        opened.mouse(kind, x, y, clickCount=1)
    opened.settle()
    assert opened.do("location.hash") == "#log-1"
    assert not opened.do("document.querySelector('#log-1').hidden")
    top = opened.do("document.querySelector('#log-1').getBoundingClientRect().top")
    assert 0.0 <= top < 900.0
    # Again, after it was filtered out once more.
    opened.do("document.querySelector('#filters [name=text]').value = '2.mcap'")
    opened.do("document.querySelector('#filters').dispatchEvent(new Event('input'))")
    assert opened.do("document.querySelector('#log-1').hidden")
    x, y = point(opened, 2, 2)
    for kind in ("mousePressed", "mouseReleased"):
        opened.mouse(kind, x, y, clickCount=1)
    opened.settle()
    assert not opened.do("document.querySelector('#log-1').hidden")


def test_a_point_that_is_switched_off_leads_nowhere(opened: Page) -> None:
    opened.click('.timeline input[data-trace="not found"]')
    x, y = point(opened, 3, 0)
    for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
        opened.mouse(kind, x, y, clickCount=1)
    opened.settle()
    assert opened.do("location.hash") == ""


def test_zoom_goes_down_to_two_logs_of_one_day_and_frames_their_intervals(opened: Page) -> None:
    assert opened.do(f"{FIRST}.strips.rows[0].plot.scales.y.min") < -0.3
    opened.click('.timeline input[data-trace="a hint"]')
    opened.click('.timeline input[data-trace="found"]')
    assert opened.do(f"{FIRST}.strips.rows[0].plot.scales.y.min") == 0.0, "what is not shown is not framed"
    opened.click('.timeline input[data-trace="found"]')
    opened.do(f"{FIRST}.see({FIRST}.axis.t[3], {FIRST}.axis.t[3])")
    opened.settle()
    assert opened.do(f"{FIRST}.to - {FIRST}.from") == pytest.approx(120.0)
    assert opened.do(RANGE) == "2024-05-04 to 2024-05-04", "no time of day is made up"
    opened.click(named("show all"))
    assert opened.do(f"{FIRST}.to - {FIRST}.from") > 3.0 * 86400.0


def test_no_other_figure_is_laid_over_one_that_is_not_of_time(opened: Page) -> None:
    assert opened.do("document.querySelectorAll('.timeline').length") == 2
    assert opened.do("document.querySelectorAll('.beside').length") == 0


def test_a_batch_on_paper_or_alone_has_its_static_figures(page: Page, written: Path, tmp_path: Path) -> None:
    page.open(written)
    drawn = "[...document.querySelectorAll('figure svg')].filter((one) => one.getBoundingClientRect().width > 0).length"
    assert page.do(drawn) == 0
    page.send("Emulation.setEmulatedMedia", media="print")
    assert page.do(drawn) == 2
    assert page.do("document.querySelector('.timeline').getBoundingClientRect().width") == 0
    page.send("Emulation.setEmulatedMedia", media="")
    shutil.copy(written, tmp_path)
    page.open(tmp_path / written.name)
    assert page.do(drawn) == 2
    assert "Hollow: a hint" in page.do("document.querySelector('figcaption').innerText")
    page.faults.clear()


@pytest.mark.parametrize("width", [400, 1400])
def test_a_batch_is_no_wider_than_the_window(page: Page, written: Path, width: int) -> None:
    page.open(written, width)
    assert page.do("document.documentElement.scrollWidth") <= width


def show(page: Page, made: Timeline, out: Path) -> None:
    """Open a page with one figure along another axis than time."""
    interactive = make_interactive({0: made}, out / "reports" / "a", out)
    sections = [{"one": made, "timeline": 1, "svg": "<svg></svg>", "best": "x", "simplest": "x", "table": []}]
    found = SimpleNamespace(tested="row", error="MSE", weak=False, estimator_says="")
    text = template("structures.html").render(
        made={},
        found=found,
        vessel="ferry",
        axes=(),
        sections=sections,
        unusable={},
        settings={},
        assets=interactive.assets,
    )
    page.faults.clear()
    page.open(write(out / "reports" / "a", text, interactive.files()))


def test_structures_stand_below_their_axis_by_name_on_a_logarithmic_one(page: Page, tmp_path: Path) -> None:
    every = [structure(f"basis {k}", 0.5, 1.0 + 0.02 * k, 5 + k) for k in range(12)]
    every[-1] = replace(every[-1], against_best=replace(every[-1].against_best, high=np.array([900.0, 1.0, 1.0])))
    made = structures_timeline(StructureComparison(tuple(every), np.ones(3), 5, 100, 20))
    show(page, made, tmp_path)
    plot = f"{FIRST}.strips.rows[0].plot"
    assert page.do(f"{plot}.scales.y.max") == pytest.approx(900.0 * 1.05)
    ticks = page.do(f"{plot}.axes[1]._splits")
    assert {1.0, 10.0, 100.0} <= set(ticks)
    page.click(named("zoom in"))
    page.do(f"{FIRST}.see(0.5, 3.5)")
    page.settle()
    ticks = page.do(f"{plot}.axes[1]._splits")
    assert 3 <= len(ticks) <= 8
    assert all(0.7 < tick < 1.5 for tick in ticks)
    assert page.do(f"{FIRST}.strips.rows[2].plot.axes[0]._values.filter(Boolean)") == [
        f"basis {k}, coupled" for k in range(3)
    ]
    assert page.do(RANGE) == "1 to 3 of 12"
    page.mouse("mouseMoved", *point(page, 2, 1))
    page.settle()
    assert page.do(RANGE) == "1 to 3 of 12 · cursor basis 1, coupled"
    assert page.faults == []


def test_an_interval_beyond_the_frame_ends_in_an_arrow_at_its_edge(page: Page, tmp_path: Path) -> None:
    trace = Trace(
        "differs", np.array([0.5, 2.0]), "new", style="points", low=np.array([0.0, 1.0]), high=np.array([1.0, 50.0])
    )
    strip = Strip("difference", (trace,), frame=(-3.0, 3.0))
    made = Timeline("differences", np.array([1.0, 2.0]), (strip,), axis=Axis("property", "name", ("a", "b")))
    show(page, made, tmp_path)
    page.middle(".u-over")
    assert page.do(f"{FIRST}.strips.rows[0].plot.scales.y.max") == 3.0
    # Beside the bars, pixels just below the upper edge: an arrow is there, and none at the row that is within the frame.
    inked = page.do(f"""(() => {{
        const plot = {FIRST}.strips.rows[0].plot, ratio = uPlot.pxRatio;
        const line = plot.ctx.getImageData(0, plot.bbox.top + 4 * ratio, plot.ctx.canvas.width, 1).data;
        return [1, 2].map((row) => line[4 * Math.round(plot.valToPos(row, "x", true) + 3 * ratio) + 3] > 0);
    }})()""")
    assert inked == [False, True]
    assert page.faults == []
