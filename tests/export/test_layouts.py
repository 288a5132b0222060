"""Layouts beside an exported log: every curve is a field that the messages have, and nothing else is replaced."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest

from ferryid.errors import FerryIdError
from ferryid.export.layouts import check_layouts, foxglove, layout_files, plotjuggler
from tests.export.test_log_file import diagnosis, export, finding, read

TOPICS = [f"/ferryid/force/{name}" for name in ("measured", "base", "model", "residual")]
TOPICS += ["/ferryid/velocity", "/ferryid/pose"]


def has(message: Any, field: str) -> bool:
    for part in field.split("."):
        if not hasattr(message, part):
            return False
        message = getattr(message, part)
    return isinstance(message, float)


def panels(layout: Any) -> list[str]:
    """Return the panels of a tree."""
    return [layout] if isinstance(layout, str) else panels(layout["first"]) + panels(layout["second"])


@pytest.mark.slow
def test_curves_are_fields_of_the_file(tmp_path: Path) -> None:
    mcap, told = tmp_path / "view.mcap", tmp_path / "d.json"
    told.write_text(json.dumps(diagnosis(finding("wind", [[0.0, 1.0]]))), encoding="utf-8")
    result = export(mcap, diagnosis=told)
    messages = {topic: rows[0][1] for topic, rows in read(mcap).items()}
    xml, layout = (Path(place) for place in result["layouts"])
    assert (xml, layout) == layout_files(mcap)
    curves = [one.get("name") for one in ET.parse(xml).iter("curve")]
    assert len(curves) == 3 * 4 + 3 + 1
    assert curves[-1] == "/ferryid/finding/wind/north/data"
    for curve in curves:
        topic = max((topic for topic in messages if curve.startswith(f"{topic}/")), key=len)
        assert has(messages[topic], curve.removeprefix(f"{topic}/").replace("/", ".")), curve
    whole = json.loads(layout.read_text(encoding="utf-8"))
    assert sorted(panels(whole["layout"])) == sorted(whole["configById"])
    for panel in whole["configById"].values():
        for path in [*panel.get("paths", []), *filter(None, [panel.get("xAxisPath")])]:
            topic, _, field = path["value"].partition(".")
            assert has(messages[topic], field), path
            assert (path["timestampMethod"] == "headerStamp") == hasattr(messages[topic], "header")
    assert whole["configById"]["DiagnosticSummary!findings"]["topicToRender"] in messages
    # Another time they are replaced with the file.
    export(mcap, overwrite=True)
    assert "DiagnosticSummary!findings" not in json.loads(layout.read_text(encoding="utf-8"))["configById"]


def test_what_is_not_there_has_no_plot() -> None:
    whole = json.loads(foxglove(["/ferryid/force/measured"]))
    assert panels(whole["layout"]) == ["Plot!1", "Plot!2", "Plot!3"]
    root = ET.fromstring(plotjuggler(["/ferryid/velocity"], Path("a/b.mcap")))
    assert [tab.get("tab_name") for tab in root.iter("Tab")] == ["Motion"]
    assert root.find(".//fileInfo").get("filename") == "b.mcap"
    assert len({one.get("color") for one in ET.fromstring(plotjuggler(TOPICS, Path("b.mcap"))).iter("curve")}) == 6


def test_a_file_of_somebody_else_is_kept(tmp_path: Path) -> None:
    mcap = tmp_path / "view.mcap"
    for place in layout_files(mcap):
        check_layouts(mcap)
        place.write_text("mine", encoding="utf-8")
        with pytest.raises(FerryIdError, match="found no layout of ferryid"):
            check_layouts(mcap)
        place.unlink()
    for place, text in zip(layout_files(mcap), (plotjuggler(TOPICS, mcap), foxglove(TOPICS)), strict=True):
        place.write_text(text, encoding="utf-8")
    check_layouts(mcap)
