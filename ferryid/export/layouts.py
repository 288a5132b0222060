"""Layouts for an exported log: what PlotJuggler and Foxglove open with every force beside the measured one.

Forms: the XML that PlotJuggler 3 saves, whose curves are topic and field joined by ``/``; the JSON that Foxglove exports, whose
paths join them by points.
"""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ferryid.errors import FerryIdError
from ferryid.export.findings import VALUES
from ferryid.export.words import MARK

Curve = tuple[str, str, str]
"""Topic, field with points, colour."""
_COLOURS = {"measured": "#000000", "base": "#999999", "model": "#0072b2", "residual": "#d55e00"}
"""Of the forces: black, grey, blue and vermilion of Okabe and Ito, which the colour-blind can tell apart."""
_OTHERS = ("#0072b2", "#009e73", "#cc79a7")
_TITLES = {"force.x": "Surge force [N]", "force.y": "Sway force [N]", "torque.z": "Yaw moment [N m]"}
_VELOCITIES = {"twist.linear.x": "u", "twist.linear.y": "v", "twist.angular.z": "r"}


def layout_files(mcap: Path) -> tuple[Path, Path]:
    """Return where the layouts of an MCAP file go: PlotJuggler's and Foxglove's."""
    return mcap.with_suffix(".plotjuggler.xml"), mcap.with_suffix(".foxglove.json")


def check_layouts(mcap: Path) -> None:
    """Refuse to write layouts over what are none of ours.

    Raises
    ------
    FerryIdError
        For the first that is not.
    """
    for place in layout_files(mcap):
        if place.exists() and not (place.is_file() and MARK.encode() in place.read_bytes()):
            raise FerryIdError(
                f"{place}: cannot be replaced, found no layout of ferryid. Fix: give --mcap another name"
            )


def plotjuggler(topics: Sequence[str], mcap: Path) -> str:
    """Return the layout for PlotJuggler: a tab of forces and one of the motion."""
    root = ET.Element("root")
    root.append(ET.Comment(f" {MARK} "))
    tabs = ET.SubElement(root, "tabbed_widget", {"parent": "main_window", "name": "Main Window"})
    for name, plots in _tabs(topics).items():
        tab = ET.SubElement(tabs, "Tab", {"containers": "1", "tab_name": name})
        sizes = ";".join([f"{1.0 / len(plots):.6f}"] * len(plots))
        attributes = {"count": str(len(plots)), "orientation": "-", "sizes": sizes}
        splitter = ET.SubElement(ET.SubElement(tab, "Container"), "DockSplitter", attributes)
        for title, curves in plots.items():
            plot = ET.SubElement(
                ET.SubElement(splitter, "DockArea", {"name": title}), "plot", {"mode": "TimeSeries", "style": "Lines"}
            )
            for topic, field, colour in curves:
                ET.SubElement(plot, "curve", {"name": f"{topic}/{field.replace('.', '/')}", "color": colour})
    ET.SubElement(tabs, "currentTabIndex", {"index": "0"})
    ET.SubElement(root, "use_relative_time_offset", {"enabled": "1"})
    loaded = ET.SubElement(
        ET.SubElement(root, "previouslyLoaded_Datafiles"), "fileInfo", {"prefix": "", "filename": mcap.name}
    )
    loader = ET.SubElement(loaded, "plugin", {"ID": "DataLoad MCAP"})
    parameters = {"max_array_size": "500", "clamp_large_arrays": "1", "use_timestamp": "1"}
    ET.SubElement(loader, "parameters", {**parameters, "selected_topics": ";".join(topics)})
    ET.indent(root)
    return f"<?xml version='1.0' encoding='UTF-8'?>\n{ET.tostring(root, encoding='unicode')}\n"


def foxglove(topics: Sequence[str]) -> str:
    """Return the layout for Foxglove: forces and velocity one below another, beside the track and the findings."""
    panels: dict[str, Any] = {}
    for title, curves in (item for plots in _tabs(topics).values() for item in plots.items()):
        paths = [
            {
                "value": f"{topic}.{field}",
                "enabled": True,
                # A bare number has no header.
                "timestampMethod": "receiveTime" if field == "data" else "headerStamp",
                "label": _VELOCITIES.get(field, topic.rpartition("/")[2]),
                "color": colour,
            }
            for topic, field, colour in curves
        ]
        panels[f"Plot!{len(panels) + 1}"] = {"title": title, "paths": paths, "showLegend": True, "isSynced": True}
    left = list(panels)
    right = []
    if "/ferryid/pose" in topics:
        where = [
            {"value": f"/ferryid/pose.pose.position.{axis}", "enabled": True, "timestampMethod": "headerStamp"}
            for axis in "yx"
        ]
        panels["Plot!track"] = {
            "title": "Track: north over east [m]",
            "paths": where[1:],
            "xAxisVal": "custom",
            "xAxisPath": where[0],
            "showLegend": False,
        }
        right.append("Plot!track")
    if "/diagnostics" in topics:
        panels["DiagnosticSummary!findings"] = {"topicToRender": "/diagnostics", "minLevel": 0, "sortByLevel": True}
        right.append("DiagnosticSummary!findings")
    whole = {
        "configById": panels,
        # The only place for a remark.
        "globalVariables": {"source": MARK},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": _split([part for part in (_stacked(left), _stacked(right)) if part], "row"),
    }
    return json.dumps(whole, indent=1) + "\n"


def _tabs(topics: Sequence[str]) -> Mapping[str, Mapping[str, list[Curve]]]:
    """Return plots with their curves by tab, of the topics that are there."""
    forces = [topic for topic in topics if topic.startswith("/ferryid/force/")]
    plots = {
        title: [(topic, f"wrench.{field}", _COLOURS[topic.rpartition("/")[2]]) for topic in forces]
        for field, title in _TITLES.items()
    }
    tabs: dict[str, Mapping[str, list[Curve]]] = {"Forces": plots} if forces else {}
    if "/ferryid/velocity" in topics:
        curves = [("/ferryid/velocity", field, colour) for field, colour in zip(_VELOCITIES, _OTHERS, strict=True)]
        tabs["Motion"] = {"Velocity [m/s], yaw rate [rad/s]": curves}
    values: dict[str, list[Curve]] = {}
    for topic in (one for one in topics if one.startswith(VALUES)):
        finding = topic.removeprefix(VALUES).rpartition("/")[0]
        curves = values.setdefault(finding.replace("_", " ").replace("/", ", "), [])
        curves.append((topic, "data", _OTHERS[len(curves) % len(_OTHERS)]))
    return tabs | ({"Findings": values} if values else {})


def _stacked(names: Sequence[str]) -> Any:
    return _split(names, "column")


def _split(parts: Sequence[Any], direction: str) -> Any:
    """Return parts beside or below one another in equal shares; None of none."""
    if len(parts) < 2:
        return parts[0] if parts else None
    rest = _split(parts[1:], direction)
    return {"direction": direction, "first": parts[0], "second": rest, "splitPercentage": round(100.0 / len(parts), 2)}
