"""Heat maps of sweeps and of likeness in headless Chromium: every cell tells its values, to pointer, finger and keys."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.diagnose import Likeness, Pair
from ferryid.diagnose.judging.likeness import EffectVisibility
from ferryid.report import likeness, sweep_report
from ferryid.report.diagnosis_page import render as render_diagnosis
from ferryid.report.html import template
from ferryid.report.interactive import STATIC, available, make_interactive
from ferryid.report.sweep_figures import heat_cells
from ferryid.report.sweep_timeline import sweep_timeline
from tests.report.browser import CHROMIUM, Page
from tests.report.test_diagnosis import diagnosis
from tests.report.test_likeness import FOUND
from tests.report.test_row_timelines import sweep

needs_chromium = pytest.mark.skipif(not CHROMIUM, reason="there is no Chromium to open the pages with")
SAYS = "document.querySelector('.heat-map .says').textContent"
AT = "[...document.querySelectorAll('.heat-map .at')].map((one) => one.textContent)"


def write(folder: Path, *windows_s: float, scripts: bool = True) -> Path:
    """Write the page of a sweep of windows and four components."""
    found, choice = sweep(*windows_s)
    interactive = STATIC
    if scripts and available():
        interactive = make_interactive({0: sweep_timeline(found, choice)}, folder / "reports" / "a", folder)
    place = folder / "reports" / "a"
    place.mkdir(parents=True)
    for name, text in {"report.html": sweep_report.render(found, (), interactive)[0], **interactive.files()}.items():
        (place / name).write_text(text, encoding="utf-8")
    return place / "report.html"


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("sweep"), 0.5, 2.0)


def test_every_cell_of_a_sweep_tells_what_the_table_has() -> None:
    found, choice = sweep(0.5, 2.0)
    made = heat_cells(found, choice)
    score, band = choice.curves.normalised()
    assert (made.columns, made.rows) == (["0.5", "2"], ["4", "3", "2", "1"])
    for place, row in enumerate(made.cells):
        count = 3 - place
        for window, cell in enumerate(row):
            surge, sway, _ = choice.over_base[window, count]
            told = f"score {score[window, count]:.4f} ± {band[window, count]:.4f}"
            assert told in cell.says
            # Without an error of the base model there is nothing to relate to.
            assert cell.says.endswith(f"MSE over base model's: surge {surge:.4g}, sway {sway:.4g}.")
            assert cell.outlined == bool(choice.curves.near()[window, count])
            assert ("within one standard error" in cell.says) == cell.outlined
    assert [(k, j) for k, row in enumerate(made.cells) for j, cell in enumerate(row) if cell.chosen] == [(2, 0)]
    assert made.cells[2][0].says.startswith("Choice: 2 components at 0.5 s")
    # Lower scores have the lighter colours of the scale's beginning.
    assert made.cells[3][0].fill == made.bar[0]
    assert made.cells[0][1].fill == made.bar[-1]


def test_every_cell_of_the_likeness_tells_its_two_effects() -> None:
    made = likeness.heat_cells(FOUND)
    assert (made.rows, made.faint) == (["1 Steady wind · 120 σ", "2 Current · 40 σ", "3 Payload · 0.7 σ"], [2])
    says = [[cell.says for cell in row] for row in made.cells]
    assert says[0][1] == "Steady wind and current: likeness above 0.99. Distinguished from 1.4 usual sizes on."
    assert says[1][0] == "Current and steady wind: likeness above 0.99. Distinguished from 1.4 usual sizes on."
    assert says[2][2] == "Payload: signal-to-noise ratio 0.7 at its usual size, too little to be named."
    assert [cell.text for cell in made.cells[0]] == ["", ".99", ".40"]
    never = replace(FOUND, pairs=(Pair(("wind", None), ("current", None), 0.998, None, alike=True),))
    assert likeness.heat_cells(never).cells[0][1].says.endswith("Distinguished at no size.")


def test_what_comes_from_outside_ends_no_script() -> None:
    evil = EffectVisibility("wind", None, "</script><b>x", 120.0, 0.1)
    section = likeness.section(Likeness((evil, *FOUND.effects[1:]), np.eye(3), ()), "likeness", "this log")
    shown = {"label": "x", "figures": section["figures"]}
    page = template("figures.html").module.drawn(shown["figures"])  # type: ignore[attr-defined]
    data = re.search(r'<script type="application/json">(.*?)</script>', page)
    assert data is not None
    assert json.loads(data[1])["rows"][0].startswith("1 </script><b>x")
    assert "<b>" not in re.sub(r"<svg.*?</svg>", "", page, flags=re.DOTALL)


@needs_chromium
@pytest.mark.slow
def test_the_pointer_reads_a_cell_and_leaves_it(opened: Page) -> None:
    choice = opened.do(SAYS)
    assert choice.startswith("Choice: 2 components at 0.5 s: score ")
    assert opened.do(AT) == []
    opened.mouse("mouseMoved", *opened.middle(".heat-map .cell", 1))
    opened.settle()
    assert opened.do(SAYS).startswith("4 components at 2 s: score ")
    # The cell and the names of its row and column.
    assert opened.do(AT) == ["4", "", "2"]
    opened.mouse("mouseMoved", 5.0, 5.0)
    opened.settle()
    assert opened.do(SAYS) == choice
    assert opened.do(AT) == []


@needs_chromium
@pytest.mark.slow
def test_keys_go_from_cell_to_cell_within_the_map(opened: Page) -> None:
    opened.do("document.querySelector('.heat-map').focus()")
    told = []
    for key in (
        "ArrowUp",
        "ArrowUp",
        "ArrowRight",
        "ArrowRight",
        "ArrowDown",
        "ArrowLeft",
        "Home",
        "ArrowDown",
        "ArrowDown",
    ):
        opened.key(key)
        told.append(opened.do(SAYS).removeprefix("Choice: ").partition(": score")[0])
    assert told == [
        "2 components at 0.5 s", "3 components at 0.5 s", "3 components at 2 s", "3 components at 2 s",
        "2 components at 2 s", "2 components at 0.5 s", "2 components at 0.5 s", "1 component at 0.5 s", "1 component at 0.5 s",
    ]  # fmt: skip
    opened.key("Escape")
    assert opened.do(AT) == []
    assert opened.do("document.querySelector('.heat-map .says').getAttribute('aria-live')") == "polite"


@needs_chromium
@pytest.mark.slow
def test_a_finger_reads_a_cell_and_what_it_read_stays(opened: Page, written: Path) -> None:
    opened.open(written, 400, 800)
    x, y = opened.middle(".heat-map .cell", 7)
    opened.send("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x, "y": y}])
    opened.send("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    opened.settle()
    assert opened.do(SAYS).startswith("1 component at 2 s: score ")


@needs_chromium
@pytest.mark.slow
@pytest.mark.parametrize("scripts", [True, False])
def test_paper_has_the_static_map_and_a_page_alone_the_other_one(
    page: Page, written: Path, tmp_path: Path, *, scripts: bool
) -> None:
    page.faults.clear()
    place = written if scripts else write(tmp_path / "plain", 0.5, 2.0, scripts=False)
    page.open(place)
    static = "document.querySelector('.heat svg').getBoundingClientRect().width > 0"
    shown = "document.querySelector('.heat-map').getBoundingClientRect().width > 0"
    assert (page.do(static), page.do(shown)) == (False, True)
    page.send("Emulation.setEmulatedMedia", media="print")
    assert (page.do(static), page.do(shown)) == (True, False)
    page.send("Emulation.setEmulatedMedia", media="")
    assert page.faults == []
    # Copied alone a page lacks the scripts beside it, and not this one.
    alone = tmp_path / "alone.html"
    shutil.copy(place, alone)
    page.open(alone)
    assert (page.do(static), page.do(shown)) == (False, True)
    page.faults.clear()
    # Without scripts of its own, as where a reader forbids them.
    still = re.sub(r"<script>.*?</script>", "", place.read_text(encoding="utf-8"), flags=re.DOTALL)
    alone.write_text(still, encoding="utf-8")
    page.open(alone)
    assert (page.do(static), page.do(shown)) == (True, False)
    page.faults.clear()


@needs_chromium
@pytest.mark.slow
@pytest.mark.parametrize("width", [360, 1400])
def test_a_heat_map_is_no_wider_than_the_window(opened: Page, tmp_path: Path, width: int) -> None:
    opened.open(write(tmp_path, *(0.25 * k for k in range(1, 13))), width)
    assert opened.do("document.documentElement.scrollWidth") <= width


@needs_chromium
@pytest.mark.slow
def test_light_and_dark(opened: Page) -> None:
    ink = "getComputedStyle(document.querySelector('.heat-map .row')).color"
    light = opened.do(ink)
    fill = opened.do("getComputedStyle(document.querySelector('.heat-map .cell')).backgroundColor")
    opened.theme("dark")
    assert opened.do(ink) != light
    # The colours of the scale are data.
    assert opened.do("getComputedStyle(document.querySelector('.heat-map .cell')).backgroundColor") == fill
    opened.theme("light")


@needs_chromium
@pytest.mark.slow
def test_the_likeness_on_the_page_of_a_diagnosis(page: Page, tmp_path: Path) -> None:

    one = replace(diagnosis("explained"), likeness=FOUND)
    (tmp_path / "report.html").write_text(render_diagnosis((one,), "trial")[0], encoding="utf-8")
    page.faults.clear()
    page.open(tmp_path / "report.html")
    assert page.do(SAYS) == "Point at a cell, or press an arrow key."
    page.mouse("mouseMoved", *page.middle(".heat-map .cell", 2))
    page.settle()
    assert page.do(SAYS) == "Steady wind and payload: likeness 0.40. Distinguished from 3.8 usual sizes on."
    assert page.do("document.querySelector('.heat-map .row.faint').textContent") == "3 Payload · 0.7 σ"
    assert page.faults == []
    plain = render_diagnosis((diagnosis("explained"),), "trial")[0]
    assert "heat-map" not in plain
