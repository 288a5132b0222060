"""The page on a log that was refused: the reason first, what the log holds, what is missing; never in the way of the error."""

from __future__ import annotations

from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest

from ferryid.api import fit
from ferryid.errors import FerryIdError, UnwritableError
from ferryid.identify import FitSettings
from ferryid.report import refusal_page
from ferryid.report.held_signals import held_log
from ferryid.report.interactive import available
from ferryid.report.refusal import shown_where_refused
from ferryid.types import RunContext
from ferryid.vessel import load_profile

LOG = str(Path(__file__).resolve().parents[2] / "fixtures" / "short.mcap")


def refusing(error: Exception) -> object:
    def work(*_: object) -> NoReturn:
        raise error

    return work


def shown(error: Exception, out: Path, vessel: str = "milliampere") -> str:
    words = ("ferryid", "fit", "my log.mcap")
    with pytest.raises(type(error)) as caught:
        shown_where_refused(refusing(error), "fitted", [LOG], load_profile(vessel), RunContext(out), words)
    return str(caught.value)


@pytest.mark.slow
def test_the_page_has_reason_remedy_signals_and_what_is_missing(tmp_path: Path) -> None:
    text = shown(FerryIdError("short: <b>the log</b> is odd, found 1. Fix: record it again"), tmp_path, "revolt")
    assert text.startswith(
        "short: <b>the log</b> is odd, found 1. Fix: record it again. What the log holds is drawn in "
    )
    page = Path(text.rpartition("drawn in ")[2]).read_text(encoding="utf-8")
    places = [
        page.index(part)
        for part in (
            "ferryid fit &#39;my log.mcap&#39;</span>",
            "<strong>short: &lt;b&gt;the log&lt;/b&gt; is odd, found 1.</strong>",
            "What helps: record it again.",
            *(['data-timeline="1"'] if available() else []),
            "<svg",
            "What is missing",
            "stern_port.speed",
            "What was found",
            '/navigation/odometry: pose.pose.position.x</td><td class="text">m</td>',
            '<td class="text">deg/s</td>',
        )
    ]
    assert places == sorted(places)


def test_the_signals_are_those_of_the_log(tmp_path: Path) -> None:
    held = held_log(LOG, load_profile("revolt"), RunContext(tmp_path))
    units = {one.column: one.unit for one in held.signals}
    assert {"x": "m", "psi": "deg", "u": "m/s", "r": "deg/s", "X_d": "N"}.items() <= units.items()
    assert held.needed >= {"stern_port.speed", "bow.angle"}
    assert held.timeline is not None
    assert held.timeline.t[-1] == pytest.approx(90.0, abs=1.0)
    strips = {strip.label: strip for strip in held.timeline.strips}
    (heading,) = strips["heading, roll, pitch [deg]"].traces
    assert np.nanmax(np.abs(heading.values)) > 90.0
    assert np.nanmax(np.abs(np.diff(heading.values))) < 180.0
    assert held.timeline.place is not None
    assert all(np.isfinite(trace.values).mean() > 0.9 for strip in strips.values() for trace in strip.traces)


@pytest.mark.parametrize(
    "error",
    [
        FerryIdError("--rate: 0 Hz is no usable rate. Fix: give 0.1 to 1000 Hz, 20 is usual"),
        FerryIdError("absent.mcap: no such file. Fix: give another"),
        UnwritableError("short: the place cannot be written. Fix: give another"),
        RuntimeError("short: a bug"),
    ],
)
def test_what_is_not_about_a_log_has_no_page(error: Exception, tmp_path: Path) -> None:
    assert shown(error, tmp_path) == str(error)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("head", ["short", "short.mcap", LOG, "other, short"])
def test_a_log_is_known_by_its_name_or_path(head: str) -> None:
    assert refusal_page._concerned(f"{head}: odd. Fix: none", [LOG, "b.mcap"], load_profile("milliampere")) == [LOG]


def test_a_fault_of_the_signal_map_concerns_all_logs() -> None:
    profile = load_profile("milliampere")
    for place in (f"{profile.path}", f"{profile.path}:12"):
        assert refusal_page._concerned(f"{place}: odd. Fix: none", [LOG, "b.mcap"], profile) == [LOG, "b.mcap"]


def test_a_page_that_cannot_be_made_leaves_the_error_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "reports").write_text("taken", encoding="utf-8")
    error = FerryIdError("short: odd. Fix: none")
    assert shown(error, tmp_path) == str(error)
    monkeypatch.setattr(refusal_page, "held_log", refusing(ZeroDivisionError("a bug")))
    assert shown(error, tmp_path / "other") == str(error)


@pytest.mark.slow
def test_a_fit_without_a_report_draws_no_log_that_it_refuses(tmp_path: Path) -> None:
    few = FitSettings(weak_window_s=300.0, estimator="weak")
    with pytest.raises(FerryIdError, match="is drawn in"):
        fit(LOG, "milliampere", few, tmp_path / "drawn")
    with pytest.raises(FerryIdError) as caught:
        fit(LOG, "milliampere", few, tmp_path / "alone", report=False)
    assert "is drawn in" not in str(caught.value)
    assert not list((tmp_path / "alone").rglob("*.html"))
