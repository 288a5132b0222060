"""The page of a batch: whole without a script, nothing unescaped, links that hold."""

from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser
from typing import Any

import pytest

from ferryid.batch.trend import trends_of
from ferryid.report.batch_page import render
from ferryid.report.batch_rows import BatchResult
from ferryid.vessel import load_profile
from tests.batch.rows import finding, result, row

PROFILES = {"milliampere": load_profile("milliampere")}


class Table(HTMLParser):
    """Collects the rows of the table of logs: attributes, cells by their keys, and links; and what is not closed."""

    VOID = frozenset(("meta", "br", "hr", "img", "link", "input"))

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.rows: list[dict[str, Any]] = []
        self.heads: list[str] = []
        self.tags: list[str] = []
        self._cell = ""
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.tags.append(tag)
        if tag not in self.VOID:
            self.open.append(tag)
        if tag == "tr" and "data-status" in given:
            self.rows.append({"data": given, "cells": {}, "links": [], "count": 0})
        elif tag == "th":
            self.heads.append(given.get("data-key") or "reports")
        elif tag == "td" and self.rows:
            self._cell = given.get("data-key") or ("reason" if "colspan" in given else "reports")
            self.rows[-1]["cells"][self._cell] = ""
            self.rows[-1]["count"] += int(given.get("colspan") or 1)
        elif tag == "a" and self.rows and "td" in self.open:
            self.rows[-1]["links"].append(given["href"])

    def handle_data(self, data: str) -> None:
        if self.rows and "td" in self.open:
            self.rows[-1]["cells"][self._cell] += data

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


EVIL = '<script>alert("x")</script>'


def hostile() -> BatchResult:
    nameless = finding("unknown")
    bad = {"fit": None, "evaluate": None, "diagnose": None, "start_ns": None, "duration_s": None}
    return result(
        row(
            f"season/{EVIL}'\".mcap", note=EVIL, findings=(finding(EVIL, EVIL, says=f'"{EVIL}', **{EVIL: 1.0}),)
        ),
        row("season/b#1 100%?.mcap", 2, findings=(nameless, nameless, finding("wind", north=1.0, probability=0.2))),
        row("season/c.mcap", status="refused", reason=EVIL, **bad),
        row("season/d.mcap", status="failed", reason="a bug", **bad),
    )  # fmt: skip


@pytest.mark.slow
def test_is_well_formed_and_needs_nothing_else() -> None:
    page = render(hostile())
    table = Table(page)
    assert table.open == []
    assert table.tags.count("script") == 2
    assert EVIL not in page
    assert not re.search(r"""(src|href)\s*=\s*["']?(https?:|//|data:)""", page)
    # Every row has a cell below each head.
    assert {one["count"] for one in table.rows} == {len(table.heads)}


def test_what_rows_say() -> None:
    first, second, third, fourth = Table(render(hostile())).rows
    assert first["data"]["data-effects"] == EVIL.capitalize()
    assert first["cells"]["date"] == "2024-05-01 00:00"
    assert first["cells"]["fit"].startswith("accepted")
    assert first["cells"]["fitmse"] == "0.100"
    assert first["cells"]["rms"] == "9, 9, 9"
    assert second["cells"]["found"] == "something without a name; perhaps steady wind (north 1.0)"
    assert second["data"]["data-effects"].split("|")[1] == "Steady wind"
    assert second["data"]["data-verdict"] == "explained"
    # A name is no part of an address.
    assert all("#" not in link and "?" not in link and " " not in link for link in second["links"])
    assert second["links"][0] == "results/b%231%20100%25%3F.mcap-0123/reports/m-v1/report.html"
    assert third["cells"]["reason"] == EVIL
    assert third["data"]["data-status"] == "refused"
    assert fourth["links"] == ["results/d.mcap-0123/traceback.txt"]


@pytest.mark.slow
def test_paths_are_told_from_the_folder_of_the_logs_that_were_read() -> None:
    bad = {"fit": None, "evaluate": None, "diagnose": None, "start_ns": None, "duration_s": None}
    gone = row("gone.mcap", status="refused", reason="no such file", **bad)
    page = render(result(row("/season/may/a.mcap"), row("/season/june/b.mcap", 2), gone))
    assert [one["cells"]["name"].strip() for one in Table(page).rows] == ["may/a.mcap", "june/b.mcap", "gone.mcap"]
    assert "/season/</span>" in page
    assert "Logs are in" not in render(result(gone))


@pytest.mark.parametrize(
    ("given", "told"),
    [("2024-05-03T00:00:00+00:00", "2024-05-03"), ("2024-05-03T10:30", "2024-05-03 10:30"), (None, "2024-05-01 00:00")],
)
def test_a_day_of_a_manifest_has_no_hour(given: str | None, told: str) -> None:
    more = {} if given is None else {"date": given}
    assert Table(render(result(row("a.mcap", **more)))).rows[0]["cells"]["date"] == told


@pytest.mark.slow
def test_filters_offer_what_there_is() -> None:
    page = render(hostile())
    assert re.findall(r"<option>(\w+)</option>", page.partition('name="status"')[2].partition("</select>")[0]) == [
        "done",
        "failed",
        "refused",
    ]
    assert 'name="vessel"' not in page, "there is but one"
    assert '<form id="filters" hidden>' in page, "without a script they would do nothing"
    alike = render(result(row("a.mcap"), row("b.mcap", 2)))
    assert 'name="status"' not in alike
    undated = render(result(row("a.mcap", start_ns=0)))
    assert 'type="date"' not in undated


@pytest.mark.slow
def test_trends_are_drawn_and_told() -> None:
    rows = [
        row(f"s/{k}.mcap", k, findings=(finding("fouling", surge=1.0 + 0.1 * k, probability=0.1 * k),) if k > 2 else ())
        for k in range(1, 11)
    ]  # fmt: skip
    page = render(result(*rows, trends=trends_of(rows, PROFILES)))
    assert "milliampere: Fouling, surge grows from 1 to 1.9" in page
    drawing = next(
        svg for svg in re.findall(r"<svg.*?</svg>", page, re.DOTALL) if ">surge</text>" in svg and "not found" in svg
    )
    for label in ("found", "a hint", "not found"):
        assert f">{label}</text>" in drawing
    assert "Fouling in 8 logs" in page
    assert ">surge [N]</text>" in page, "errors are drawn as well"
    # One log makes no trend to be drawn.
    assert "<svg" not in render(result(rows[5], trends=trends_of(rows[5:6], PROFILES)))


@pytest.mark.parametrize("model", ["", "mine@2"])
def test_what_was_evaluated_is_named(model: str) -> None:
    made = row("a.mcap")
    assert made.evaluate is not None
    made = replace(made, evaluate=replace(made.evaluate, evaluated="mine@2"))
    page = render(result(made, model="a/path/of/mine/2.json" if model else ""))
    assert f"rms error of {model or 'the hull'} [N, N, N·m]" in page
    assert ("MSE of mine@2 over base" in page) == bool(model)


@pytest.mark.slow
def test_counts_memory_and_time() -> None:
    page = render(hostile())
    assert "4 logs, 2 done; 1 refused; 1 failed by a bug of ferryid" in page
    assert "each process is held to 4.0 GB" in page
    assert "22 s of work" in page
    free = replace(hostile(), memory=replace(hostile().memory, bounded=False))
    assert "holds no process to a bound" in render(free)


@pytest.mark.slow
def test_what_was_lost_and_every_warning_stands_on_the_page() -> None:
    lost = {
        "messages": 12,
        "seconds": 3.25,
        "unknown": True,
        "rows_left_out": 399,
        "seconds_left_out": 19.95,
        "says": [f"Lost: a.mcap: {EVIL} (12 messages).", "399 of 11999 rows (19.9 s) are left out: x."],
    }
    page = render(result(row("a.mcap", lost=lost), row("b.mcap", 2), row("c.mcap", 3, lost={**lost, "messages": 0})))
    table = Table(page)
    assert table.heads.index("lost") == list(table.rows[0]["cells"]).index("lost")
    a, b, c = (one["cells"] for one in table.rows)
    assert a["lost"].startswith("12 messages, 3.2 s or more19.9 s left out")
    assert "399 of 11999 rows" in a["lost"]
    assert f"Lost: a.mcap: {EVIL}" in a["lost"]
    assert b["lost"] == ""
    # What was cut is not done like any other.
    assert (a["status"], b["status"]) == ("done, damaged", "done")
    assert c["lost"].startswith("unknown, 3.2 s")
    assert a["warnings"] == "1one"
    assert page.count("<details>") == 5
    assert "<script>alert" not in page
    assert 'data-key="lost" data-sort="23.200"' in page


def test_a_delay_is_told_as_one_and_what_is_late_where_it_is_positive() -> None:
    rows = [row(f"s/{k}.mcap", k, findings=(finding("clock_offset", seconds=0.1 * k),)) for k in range(1, 4)]
    page = render(result(*rows, trends=trends_of(rows, PROFILES)))
    assert ">delay</text>" in page
    assert "Positive: the position after the velocity." in page
    assert ">seconds" not in page
