"""The interactive figures in headless Chromium: every control works, nothing goes wrong on the console, and pages open fast."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.diagnose import Difference, Versus
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.candidate import Candidate
from ferryid.diagnose.judging.diagnosis import Diagnosis
from ferryid.diagnose.judging.group_differences import JudgedGroups
from ferryid.effects import effects
from ferryid.report.batch_page import render
from ferryid.report.diagnosis_report import report
from ferryid.report.versus_report import render as versus_page
from ferryid.types import Floats
from ferryid.vessel import load_profile
from tests.report.browser import CHROMIUM, Page
from tests.report.pages import NEEDS_UPLOT
from tests.report.test_batch_page import hostile
from tests.report.test_diagnosis import T, diagnosis

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM, reason="there is no Chromium to open the pages with"),
    NEEDS_UPLOT,
]
OPENED_S = 1.0
SHIFT = 8
STATE = "ferryid.all[0]"


def measured(one: Diagnosis, t: Floats) -> Diagnosis:
    """Return a diagnosis with what was measured at times: a circle in a wind, for its map."""
    angle = 2.0 * np.pi * t / 300.0
    force = np.column_stack([np.sin(angle), np.cos(angle), 0.1 * np.sin(3.0 * angle)]) * 40.0
    return replace(
        one,
        evidence={
            "t": t,
            "before": force,
            "after": 0.3 * force,
            "heading": np.degrees(angle) % 360.0,
            "speed": np.ones_like(t),
            "place": np.column_stack([50.0 * np.sin(angle), 50.0 * np.cos(angle)]),
            "nu": np.column_stack([1.0 + 0.0 * t, 0.1 * np.sin(angle), 0.02 + 0.0 * t]),
            "thrust": 3.0 * force,
            "wind": np.column_stack([-3.0 + 0.0 * t, 3.0 + 0.0 * t]),
        },
    )


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return report((measured(diagnosis("explained"), T),), tmp_path_factory.mktemp("out")).report


def view(page: Page) -> list[float]:
    return [float(one) for one in page.do(f"[{STATE}.from, {STATE}.to]")]


def all_views(page: Page) -> list[list[float]]:
    """Return what every strip shows."""
    return page.do(f"{STATE}.strips.rows.map((row) => [row.plot.scales.x.min, row.plot.scales.x.max])")


def named(name: str) -> str:
    return f'[aria-label="{name}"]'


def test_buttons_zoom_and_move_all_strips_together(opened: Page) -> None:
    whole = view(opened)
    assert whole == pytest.approx([T[0], T[-1]])
    opened.click(named("zoom in"))
    near = view(opened)
    assert near[1] - near[0] == pytest.approx(0.5 * (whole[1] - whole[0]))
    opened.click(named("later"))
    later = view(opened)
    assert later[0] > near[0]
    assert later[1] <= whole[1]
    opened.click(named("earlier"))
    assert view(opened)[0] < later[0]
    assert len(all_views(opened)) == 6
    assert all(one == pytest.approx(view(opened)) for one in all_views(opened))
    opened.click(named("zoom out"))
    assert view(opened)[1] - view(opened)[0] == pytest.approx(whole[1] - whole[0])
    opened.click(named("zoom in"))
    opened.click(named("show the whole log"))
    assert view(opened) == pytest.approx(whole)


def test_dragging_zooms_or_moves(opened: Page) -> None:
    x, y = opened.middle(".u-over", 1)
    opened.drag(x - 100.0, y, x + 100.0, y)
    near = view(opened)
    width = near[1] - near[0]
    assert width < 0.6 * (T[-1] - T[0])
    assert all(one == pytest.approx(near) for one in all_views(opened))
    opened.drag(x + 60.0, y, x - 20.0, y, SHIFT)
    moved = view(opened)
    assert moved[0] > near[0]
    assert moved[1] - moved[0] == pytest.approx(width)
    opened.click(named("whether dragging zooms or moves the time axis"))
    x, y = opened.middle(".u-over", 1)
    opened.drag(x - 20.0, y, x + 60.0, y)
    assert view(opened)[0] < moved[0]
    assert view(opened)[1] - view(opened)[0] == pytest.approx(width)


def test_the_pointer_shows_values_in_every_strip_and_the_vessel_on_the_map(opened: Page) -> None:
    x, y = opened.middle(".u-over", 2)
    opened.mouse("mouseMoved", x, y)
    opened.settle()
    time = opened.do(f"{STATE}.cursor")
    k = int(np.argmin(np.abs(T - time)))
    force = 40.0 * np.sin(2.0 * np.pi * T[k] / 300.0)
    shown = opened.do(f"{STATE}.strips.rows.map((row) => row.outputs.map((one) => one.textContent))")
    assert float(shown[0][0]) == pytest.approx(force, abs=0.05)
    assert all(text for row, texts in enumerate(shown) for text in texts[:1])
    before = opened.do(f"{STATE}.map.canvas.toDataURL()")
    opened.mouse("mouseMoved", x + 90.0, y)
    opened.settle()
    assert opened.do(f"{STATE}.map.canvas.toDataURL()") != before


def test_signals_are_switched_off_and_on_in_all_strips(opened: Page) -> None:
    them = "row.plot.series.filter((one) => one.label === 'with them').map((one) => one.show)"
    shown = f"{STATE}.strips.rows.map((row) => {them})"
    assert opened.do(shown)[:3] == [[True]] * 3
    opened.click('input[data-trace="with them"]', 1)
    assert opened.do(shown)[:3] == [[False]] * 3
    opened.click('input[data-trace="with them"]')
    assert opened.do(shown)[:3] == [[True]] * 3


def test_a_finding_jumps_to_its_time(opened: Page) -> None:
    assert opened.do("[...document.querySelectorAll('.findings button')].map((one) => one.textContent)") == [
        "1. Steady wind · whole log",
        "2. Thruster force (thruster1) · 312 to 720 s",
    ]
    opened.click(".findings button", 1)
    first, last = view(opened)
    assert 200.0 < first < 312.0
    assert last == pytest.approx(T[-1])
    assert opened.do("document.querySelectorAll('.findings button')[1].getAttribute('aria-pressed')") == "true"
    assert "Thruster force" in opened.do("document.querySelector('.live').textContent")
    # What it explains is switched on where it is drawn window by window.
    assert opened.do(f"[...{STATE}.hidden].sort()") == ["1. Steady wind explains", "actuator force"]
    opened.click(".findings button", 0)
    assert view(opened) == pytest.approx([T[0], T[-1]])
    assert opened.do(f"[...{STATE}.hidden]") == ["actuator force"]


def test_the_keyboard_does_the_same(opened: Page) -> None:
    opened.do("document.querySelector('.timeline').focus()")
    opened.key("+")
    near = view(opened)
    assert near[1] - near[0] == pytest.approx(0.5 * (T[-1] - T[0]))
    opened.key("ArrowRight", SHIFT)
    assert view(opened)[0] > near[0]
    opened.key("ArrowRight")
    first = opened.do(f"{STATE}.cursor")
    opened.key("ArrowRight")
    assert opened.do(f"{STATE}.cursor") > first
    opened.key("ArrowLeft")
    assert opened.do(f"{STATE}.cursor") == pytest.approx(first, abs=2.1)
    width = view(opened)[1] - view(opened)[0]
    opened.key("-")
    assert view(opened)[1] - view(opened)[0] > 1.5 * width
    opened.key("2")
    assert opened.do(f"{STATE}.mark") == 1
    opened.key("0")
    assert view(opened) == pytest.approx([T[0], T[-1]])


def test_the_map_zooms_moves_and_gives_the_time_of_a_place(opened: Page) -> None:
    looks = [opened.do(f"{STATE}.map.canvas.toDataURL()")]

    def changed() -> bool:
        looks.append(opened.do(f"{STATE}.map.canvas.toDataURL()"))
        return looks[-1] != looks[-2]

    opened.click(named("zoom into the map"))
    assert changed()
    x, y = opened.middle(".map canvas")
    opened.drag(x, y, x + 40.0, y + 10.0)
    assert changed()
    opened.click(named("zoom out of the map"))
    assert changed()
    opened.click(named("show the whole track"))
    assert changed()
    assert opened.do("document.querySelectorAll('.map [data-arrows]').length") == 4
    for k in range(4):
        opened.click(".map input", k)
        assert changed()
    # North of the circle's middle: a quarter of a round.
    x, y = opened.middle(".map canvas")
    opened.drag(x, y - 150.0, x, y - 150.0)
    assert opened.do(f"{STATE}.cursor") % 300.0 == pytest.approx(75.0, abs=6.0)


def test_colours_follow_the_system_or_the_reader(opened: Page) -> None:
    paper = "getComputedStyle(document.body).backgroundColor"
    light = opened.do(paper)
    ink = opened.do("ferryid.colour('ink')")
    opened.theme("dark")
    opened.settle()
    dark = opened.do(paper)
    assert dark != light
    assert opened.do("ferryid.colour('ink')") != ink
    opened.click(".theme")
    assert opened.do(paper) == light
    opened.click(".theme")
    opened.theme("light")
    assert opened.do(paper) == dark
    opened.click(".theme")
    assert opened.do(paper) == light


def test_paper_and_a_page_alone_have_the_static_figures(page: Page, written: Path, tmp_path: Path) -> None:
    page.open(written)
    visible = "[...document.querySelectorAll('figure')].filter((one) => one.offsetParent !== null).length"
    hidden = page.do("document.querySelectorAll('figure').length") - page.do(visible)
    assert hidden == 1
    page.send("Emulation.setEmulatedMedia", media="print")
    assert page.do(f"{visible} === document.querySelectorAll('figure').length")
    assert page.do("getComputedStyle(document.querySelector('.timeline')).display") == "none"
    assert page.printed().startswith(b"%PDF")
    page.send("Emulation.setEmulatedMedia", media="")
    alone = tmp_path / "alone" / "report.html"
    alone.parent.mkdir()
    shutil.copy(written, alone)
    page.open(alone)
    assert page.do(f"{visible} === document.querySelectorAll('figure').length")
    assert page.do("document.querySelector('.timeline').offsetParent === null")


@pytest.mark.parametrize("width", [420, 1400])
def test_nothing_is_wider_than_the_window(page: Page, written: Path, width: int) -> None:
    page.open(written, width)
    assert page.do("document.documentElement.scrollWidth") <= width


def test_an_hour_opens_in_a_second_and_shows_all_its_rows_from_near(page: Page, tmp_path: Path) -> None:
    t = np.arange(36_000) * 0.1
    hour = report((measured(diagnosis("explained"), t),), tmp_path).report
    page.faults.clear()
    assert min(page.open(hour) for _ in range(5)) < OPENED_S
    assert page.do(f"{STATE}.data.t.length") < 3000
    page.click(".findings button", 1)
    page.do(f"new Promise((done) => {{ const wait = () => {STATE}.rows ? done() : setTimeout(wait, 20); wait(); }})")
    page.settle()
    assert page.do(f"{STATE}.data.t.length") == len(t)
    assert page.do(f"{STATE}.strips.rows[0].plot.data[0].length") == len(t)
    page.click(named("show the whole log"))
    assert page.faults == []


def test_another_log_is_laid_over_this_one(page: Page, tmp_path: Path) -> None:
    one = measured(diagnosis("explained"), T)
    both = report((replace(one, log="first"), replace(one, log="second")), tmp_path).report
    page.faults.clear()
    page.open(both)
    page.do(
        "(() => { const one = document.querySelector('.beside select'); one.value = 1;"
        "one.dispatchEvent(new Event('change')); })()"
    )
    page.settle()
    series = page.do(f"{STATE}.strips.rows[0].plot.series.map((one) => one.label)")
    assert series[-2:] == ["second: without the findings", "second: with them"]
    data = f"{STATE}.strips.rows[0].plot.data"
    assert page.do(f"{data}[{len(series) - 2}][40]") == pytest.approx(page.do(f"{data}[1][40]"), abs=1e-6)
    page.do(
        "(() => { const one = document.querySelector('.beside input'); one.value = 20;"
        "one.dispatchEvent(new Event('change')); })()"
    )
    page.settle()
    assert page.do(f"{data}[{len(series) - 2}][40]") == pytest.approx(page.do(f"{data}[1][30]"), abs=1e-6)
    page.do(
        "(() => { const one = document.querySelector('.beside select'); one.value = -1;"
        "one.dispatchEvent(new Event('change')); })()"
    )
    page.settle()
    assert page.do(f"{STATE}.strips.rows[0].plot.series.length") == len(series) - 2
    assert page.faults == []


def test_a_batch_on_paper_is_whole_and_has_no_filters(page: Page, tmp_path: Path) -> None:
    path = tmp_path / "index.html"
    path.write_text(render(hostile()), encoding="utf-8")
    page.open(path, 760)
    assert page.do("getComputedStyle(document.querySelector('form')).display") != "none"
    page.send("Emulation.setEmulatedMedia", media="print")
    assert page.do("getComputedStyle(document.querySelector('form')).display") == "none"
    cut = "[...document.querySelectorAll('.scroll')].filter((one) => one.scrollWidth > one.clientWidth + 1).length"
    assert page.do(cut) == 0
    page.send("Emulation.setEmulatedMedia", media="")


@pytest.mark.parametrize("width", [420, 800, 1200, 1500])
def test_the_table_of_a_batch_is_not_cut(page: Page, tmp_path: Path, width: int) -> None:
    path = tmp_path / "index.html"
    path.write_text(render(hostile()), encoding="utf-8")
    page.open(path, width)
    cut = "[...document.querySelectorAll('.scroll')].filter((one) => one.scrollWidth > one.clientWidth + 1).length"
    assert page.do(cut) == 0


def test_paper_keeps_headings_heads_of_tables_and_figures_whole(page: Page, written: Path) -> None:
    page.open(written)
    page.send("Emulation.setEmulatedMedia", media="print")
    styles = (
        ("h2", "breakAfter", "avoid"),
        ("thead", "breakAfter", "avoid"),
        ("thead", "display", "table-header-group"),
    )
    for selector, name, value in (*styles, ("figure", "breakInside", "avoid"), ("tr", "breakInside", "avoid")):
        assert page.do(f"getComputedStyle(document.querySelector({selector!r})).{name}") == value, (selector, name)
    # Two of them and their captions find room on a sheet.
    tallest = (
        "Math.max(...[...document.querySelectorAll('figure svg')].map((one) => one.getBoundingClientRect().height))"
    )
    assert page.do(tallest) <= 420.0
    page.send("Emulation.setEmulatedMedia", media="")


def test_a_drawing_has_the_ground_of_a_dark_page(page: Page, written: Path) -> None:
    page.open(written, dark=True)
    blend = "getComputedStyle(document.querySelector('figure svg')).mixBlendMode"
    assert page.do(blend) == "screen"
    page.theme("light")
    assert page.do(blend) == "normal"


def test_the_differences_of_two_groups_fold_on_a_telephone(page: Page, tmp_path: Path) -> None:
    gain = replace(Candidate.of(effects()["thruster_gain"], "thruster1", load_profile("milliampere")), group="B")
    one = Difference.of(gain, {"factor": Estimate(0.9, 0.8, 1.0, "-")}, -0.2, 0.1, {"factor": None})
    found = Versus("ferry", {}, JudgedGroups((), (one,), (), (), 1.0), (), "", "")
    path = tmp_path / "versus.html"
    path.write_text(versus_page(found)[0], encoding="utf-8")
    page.open(path, 420)
    cells = "[...document.querySelectorAll('.differences td')].map((one) => one.getBoundingClientRect().x)"
    # One below the other; at a desk they stand beside each other.
    assert len(set(page.do(cells))) == 1
    cut = "[...document.querySelectorAll('.scroll')].filter((one) => one.scrollWidth > one.clientWidth + 1).length"
    assert page.do(cut) == 0
    page.open(path, 1200)
    assert len(set(page.do(cells))) == 5
    assert page.do("document.querySelectorAll('.differences td')[3].textContent") == "0"
