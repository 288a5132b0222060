"""The data of interactive figures: what the page decodes is what was drawn, thinned without losing a peak."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ferryid.report import interactive
from ferryid.report.interactive import LICENCE, SCRIPTS, STATIC, STYLES, make_interactive
from ferryid.report.timeline import BINS, MISSING, Axis, Mark, Span, Strip, Timeline, Trace, flagged, overview, scripts
from ferryid.types import Floats
from tests.report.pages import NEEDS_UPLOT


def line(t: Floats, values: Floats, **more: Any) -> Timeline:
    return Timeline("log", t, (Strip("surge X [N]", (Trace("measured", values, "measured"),)),), **more)


def decoded(text: str, call: str) -> Any:
    """Return what a script hands over to the page."""
    inside = text.strip().removeprefix(f"ferryid.{call}(").removesuffix(");")
    return json.loads(f"[{inside}]")


def column(stored: list[Any], kind: str = "<i2") -> Floats:
    offset, step, text = stored
    steps = np.frombuffer(base64.b64decode(text), dtype=kind).astype(np.float64)
    steps[(steps == MISSING) & (kind == "<i2")] = np.nan
    return np.asarray(offset + step * steps)


def test_a_short_log_arrives_as_it_is_and_breaks_at_its_gap() -> None:
    t = np.concatenate([np.arange(0.0, 10.0, 0.5), np.arange(30.0, 40.0, 0.5)])
    values = np.sin(t) * 300.0
    values[3] = np.nan
    (made,) = decoded(scripts([line(t, values)])["timeline.js"], "show")[0]
    times, found = column(made["data"]["t"], "<u4"), column(made["data"]["columns"][0])
    assert len(times) == len(t) + 1
    assert times[20] == pytest.approx(10.0, abs=1e-6)
    assert np.isnan(found[[3, 20]]).all()
    assert np.delete(times, 20) == pytest.approx(t, abs=1e-6)
    assert np.delete(found, 20) == pytest.approx(values, abs=600.0 / 65534, nan_ok=True)


def test_a_long_log_has_an_overview_that_keeps_every_peak_and_all_rows_in_a_file_of_their_own() -> None:
    t = np.arange(36_000) * 0.1
    values = np.random.default_rng(0).standard_normal(t.size)
    values[12_345], values[12_346] = 90.0, -80.0
    values[23_001], values[23_002] = -70.0, 80.0
    made = scripts([line(t, values, place=np.column_stack([t, -t, 0.0 * t]))])
    (first,) = decoded(made["timeline.js"], "show")[0]
    assert len(column(first["data"]["t"], "<u4")) <= 2 * BINS
    thin = column(first["data"]["columns"][0])
    assert (thin.max(), thin.min()) == pytest.approx((90.0, -80.0), abs=0.01)
    assert np.argmax(thin) + 1 == np.argmin(thin)
    rises = np.flatnonzero(thin < -60.0)[-1]
    assert thin[rises + 1] == pytest.approx(80.0, abs=0.01)
    number, rows = decoded(made[first["fine"]], "rows")
    assert number == 0
    assert column(rows["columns"][0]) == pytest.approx(values, abs=170.0 / 65534)
    # A place is where the vessel was, no pair of extremes.
    north, east = (column(one) for one in first["data"]["columns"][1:3])
    assert north == pytest.approx(-east, abs=0.2)
    assert len(made["timeline.js"]) < 40_000


def test_figures_of_few_rows_arrive_as_they_are() -> None:
    """Dates far apart are no gap, and what a logarithmic axis shows needs all its digits."""
    t = np.array([0.0, 1.0, 2.0, 900.0])
    values = np.array([0.95, np.nan, 1.25, 4e6])
    trace = Trace("found", values, "new", style="points", low=values - 0.1, high=values + 0.5)
    strips = (Strip("a", (Trace("other", t, "c0"), trace), "log", (0.5, 2.0)),)
    axis = Axis("date", "date", tuple("abcd"), tuple(f"#{name}" for name in "abcd"))
    made = scripts([Timeline("batch", t, strips, axis=axis)])
    assert list(made) == ["timeline.js"]
    (one,) = decoded(made["timeline.js"], "show")[0]
    assert one["axis"] == {"label": "date", "kind": "date", "names": [*"abcd"], "links": ["#a", "#b", "#c", "#d"]}
    assert (one["strips"][0]["scale"], one["strips"][0]["frame"]) == ("log", [0.5, 2.0])
    assert [each["ends"] for each in one["strips"][0]["traces"]] == [False, True]
    assert one["data"]["t"] == t.tolist()
    first, second, low, high = one["data"]["columns"]
    assert first == t.tolist()
    assert second == [0.95, None, 1.25, 4e6]
    assert low == [0.85, None, 1.15, 4e6]
    assert high == [1.45, None, 1.75, 4e6]


def test_the_overview_leaves_out_what_no_row_of_a_bin_has() -> None:
    t = np.arange(6000.0)
    values = np.where(t < 3000.0, np.nan, t)
    (thin,) = overview(t, [values], 1)[1]
    assert np.isnan(thin[: len(thin) // 2 - 2]).all()
    assert thin[-1] == 5999.0


def test_values_that_no_sensor_gives_are_no_fault_of_the_page() -> None:
    values = np.array([np.nan, np.inf, -1.7e308, 1.7e308, 0.0])
    for shown in (values, np.full(5, np.nan), np.zeros(5)):
        (made,) = decoded(scripts([line(np.arange(5.0), shown)])["timeline.js"], "show")[0]
        assert len(column(made["data"]["columns"][0])) == 5


def test_a_title_cannot_end_the_script() -> None:
    hostile = "</script><script>alert(1)</script>\u2028"
    text = scripts(
        [line(np.arange(3.0), np.arange(3.0), marks=(Mark(hostile),), spans=(Span(0, 1, "left-out", hostile),))]
    )
    assert "\u2028" not in text["timeline.js"]
    assert decoded(text["timeline.js"], "show")[0][0]["marks"][0]["title"] == hostile


def test_marked_rows_become_stretches() -> None:
    flags = np.array([True, True, False, False, True])
    spans = flagged(np.arange(5.0), flags, "validation", "validation")
    assert [(one.first, one.last) for one in spans] == [(0.0, 1.0), (4.0, 4.0)]


def test_without_the_library_pages_keep_their_static_figures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interactive, "available", lambda: False)
    assert make_interactive({0: line(np.arange(3.0), np.arange(3.0))}, tmp_path / "a", tmp_path) is STATIC
    assert not any(tmp_path.iterdir())


@NEEDS_UPLOT
def test_scripts_are_written_once_and_every_page_links_to_them(tmp_path: Path) -> None:
    one = line(np.arange(3.0), np.arange(3.0))
    made = make_interactive({0: None, 2: one}, tmp_path / "reports" / "a", tmp_path)
    assert (made.number(0), made.number(2)) == (0, 1)
    (folder,) = (tmp_path / "reports" / "assets").iterdir()
    assert {path.name for path in folder.iterdir()} == {*SCRIPTS, *STYLES, LICENCE}
    assert "MIT" in (folder / LICENCE).read_text(encoding="utf-8")
    links = [*made.assets["scripts"], *made.assets["styles"]]
    assert all((tmp_path / "reports" / "a" / link).resolve().parent == folder for link in links)
    before = folder.stat().st_mtime_ns
    # A page that lies elsewhere in the output folder has its own way there.
    far = make_interactive({0: one}, tmp_path / "batch" / "results" / "x" / "reports" / "b", tmp_path)
    assert far.assets["scripts"][0].startswith("../../../../../reports/assets/")
    assert folder.stat().st_mtime_ns == before
    assert make_interactive({0: None}, tmp_path / "c", tmp_path) is STATIC
    assert STATIC.assets == {}
