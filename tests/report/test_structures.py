"""The page of compared structures: a forest plot for each way of cutting, and every number."""

from __future__ import annotations

import html
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.identify.settings import FitSettings
from ferryid.identify.sweeps.structure_comparison import StructureSweep, over_base
from ferryid.identify.sweeps.structure_sweep import sweep_structures
from ferryid.report.structures_report import render, structures_and_report
from ferryid.report.structures_text import supported_structure
from ferryid.types import RunContext
from ferryid.vessel import load_profile

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"
PROFILE = load_profile("milliampere")


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> StructureSweep:
    logs = [str(FIXTURES / name) for name in ("second.bag", "short.mcap")]
    settings = FitSettings(delta=0.4, sigma=0.4)
    return sweep_structures(logs, PROFILE, settings, RunContext(tmp_path_factory.mktemp("out")))


@pytest.mark.slow
def test_a_forest_plot_for_each_way_of_cutting(found: StructureSweep) -> None:
    page, drawings = render(found)
    assert sorted(drawings) == ["basis-blocks", "basis-logs"]
    assert page.count("<figcaption>") == page.count("<svg") == 2
    for key, drawing in drawings.items():
        assert drawing in page
        one = found.by[key.removeprefix("basis-")]
        labels = re.findall(r">([a-z-]+, (?:de)?coupled)</text>", drawing)
        assert labels == [structure.title for structure in one.structures]
        for text in ("surge", "sway", "yaw", "MSE over the best structure's"):
            assert f">{text}</text>" in html.unescape(drawing)


@pytest.mark.slow
def test_intervals_are_drawn_where_they_lie(found: StructureSweep) -> None:
    """Width of each drawn interval is in proportion to the logarithm of its ends, over all three panels."""
    one = found.by["blocks"]
    drawing = render(found)[1]["basis-blocks"]
    strokes = re.findall(
        r'd="M ([\d.]+) ([\d.]+) \nL ([\d.]+) ([\d.]+) \n" clip-path="[^"]+" style="fill: none; stroke: #', drawing
    )
    level = [(float(x0), float(x1)) for x0, y0, x1, y1 in strokes if y0 == y1]
    # Axis by axis, each with all structures; the best's own has no width.
    spans = np.array(
        [[np.log(each.against_best.high[j] / each.against_best.low[j]) for each in one.structures] for j in range(3)]
    ).ravel()
    widths = np.array([x1 - x0 for x0, x1 in level])
    assert len(widths) == len(spans) == 3 * len(one.structures)
    scale = widths.sum() / spans.sum()
    np.testing.assert_allclose(widths, scale * spans, atol=0.01)


@pytest.mark.slow
def test_every_number_is_on_it(found: StructureSweep) -> None:
    page = re.sub(r"<svg.*?</svg>", "", render(found)[0], flags=re.DOTALL)
    for one in found.by.values():
        for each in one.structures:
            cells = "".join(f"<td>{value:.4f}</td>" for value in over_base(each, one))
            terms = "/".join(map(str, each.allowed.sum(axis=0)))
            start = f'{each.basis}</td><td class="text">{each.structure}</td><td>{terms}</td><td>{each.components}</td>'
            assert re.search(
                re.escape(start) + r"<td>\d+ to \d+</td>" + re.escape(cells + f"<td>{each.score:.4f}</td>"), page
            )
            for against in (each.against_best, each.against_simplest):
                for value, low, high in zip(against.value, against.low, against.high, strict=True):
                    assert f"<td>{value:.3g} [{low:.3g}, {high:.3g}]</td>" in page
        assert supported_structure(one) in html.unescape(page)
    assert page.count('<tr class="chosen">') == 2
    kept = sum(each.kept for one in found.by.values() for each in one.structures)
    assert page.count('<tr class="kept">') == kept - 2
    assert all(note in html.unescape(page) for note in found.notes)


@pytest.mark.slow
def test_what_comes_from_outside_is_escaped(found: StructureSweep) -> None:
    evil = "<script>alert(1)</script>"
    strange = replace(
        found, vessel=evil, notes=(evil,), unusable={"lift": evil}, logs=({**found.logs[0], "name": evil},)
    )
    page, _ = render(strange)
    assert evil not in page
    assert page.count("&lt;script&gt;") >= 5


@pytest.mark.slow
def test_without_interval_there_is_still_a_page(found: StructureSweep) -> None:
    """A base model without error leaves no ratio."""
    one = found.by["blocks"]
    nothing = replace(
        one.structures[0].against_best, value=np.full(3, np.nan), low=np.full(3, np.nan), high=np.full(3, np.nan)
    )
    empty = replace(one, structures=tuple(replace(each, against_best=nothing) for each in one.structures))
    assert "nan [nan, nan]" in render(replace(found, by={"blocks": empty}))[0]


def test_windows_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FerryIdError, match=r"^--windows: bases are compared at one window\. Fix: give --window$"):
        structures_and_report(["a"], PROFILE, FitSettings(), RunContext(tmp_path), windows_s=(1.0,))
