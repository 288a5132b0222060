"""The page of a sweep: both figures, the choice marked once in each, every number that was found."""

from __future__ import annotations

import html
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from ferryid.identify.settings import FitSettings
from ferryid.identify.sweeps.settings_sweep import Sweep, sweep_settings
from ferryid.report.sweep_report import render
from ferryid.report.sweep_text import headline
from ferryid.types import RunContext
from ferryid.vessel import load_profile

pytestmark = pytest.mark.slow

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"
WINDOWS_S = {"components": (), "window": (0.5, 1.0, 2.0), "both": (0.5, 1.0, 2.0)}


@pytest.fixture(scope="module", params=list(WINDOWS_S))
def found(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Sweep:
    logs = [str(FIXTURES / name) for name in ("second.bag", "short.mcap")]
    return sweep_settings(
        request.param, logs, load_profile("milliampere"), FitSettings(delta=0.4, sigma=0.4),
        RunContext(tmp_path_factory.mktemp("out")), windows_s=WINDOWS_S[request.param],
    )  # fmt: skip


class Reader(HTMLParser):
    """Counts tags, and checks that each is closed."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.seen: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.append(f"{tag}.{dict(attrs).get('class')}")
        if tag not in ("meta", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_a_figure_for_each_way_of_cutting(found: Sweep) -> None:
    page, drawings = render(found)
    reader = Reader()
    reader.feed(page)
    assert reader.open == []
    assert sorted(drawings) == [f"{found.what}-blocks", f"{found.what}-logs"]
    assert all(drawing in page for drawing in drawings.values())
    assert reader.seen.count("figcaption.None") == 2
    told = html.unescape(page)
    assert (f"Cross-validated {found.error} over the base model's against" in told) == (len(found.windows_s) == 1)
    assert "force error" not in told
    assert reader.seen.count("tr.chosen") == 2
    for drawing in drawings.values():
        wanted = "smoothing window of the training rows [s]" if len(found.windows_s) > 1 else "MSE over base model's"
        assert f">{wanted}</text>" in drawing
        assert ">components</text>" in drawing


def test_every_number_is_on_it(found: Sweep) -> None:
    page = re.sub(r"<svg.*?</svg>", "", render(found)[0], flags=re.DOTALL)
    for choice in found.by.values():
        score, band = choice.curves.normalised()
        rows = [
            f"<td>{window_s:g}</td><td>{count + 1}</td>"
            + "".join(f"<td>{value:.4g}</td>" for value in choice.over_base[window, count])
            + f"<td>{score[window, count]:.4f}</td><td>{band[window, count]:.4f}</td>"
            for window, window_s in enumerate(found.windows_s)
            for count in range(score.shape[1])
        ]
        assert all(row in page for row in rows)
        marked = rows[choice.window * score.shape[1] + choice.components - 1]
        assert f"<tr class=chosen>{marked}</tr>" in page
    assert page.count("<tr") == 2 * (1 + len(found.windows_s) * score.shape[1]) + 3
    assert headline(found) in html.unescape(page)
    assert all(note in html.unescape(page) for note in found.notes)


def test_one_component_is_one(found: Sweep) -> None:
    for count, told in ((1, "tested. Choice: 1 component at"), (2, "tested. Choice: 2 components at")):
        by = {key: replace(choice, components=count) for key, choice in found.by.items()}
        assert " ".join(render(replace(found, by=by))[0].split()).count(told) == 2


def test_what_comes_from_outside_is_escaped(found: Sweep) -> None:
    evil = "<script>alert(1)</script>"
    page, _ = render(replace(found, vessel=evil, notes=(evil,), logs=({**found.logs[0], "name": evil},)))
    assert evil not in page
    assert page.count("&lt;script&gt;") >= 4


def test_the_same_sweep_gives_the_same_page(found: Sweep) -> None:
    # But for the minute in which it is made.
    first, second = (re.sub(r"\d{4}-\d{2}-\d{2} \d{2}:\d{2} UTC", "", render(found)[0]) for _ in range(2))
    assert first == second
