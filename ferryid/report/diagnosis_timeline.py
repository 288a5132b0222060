"""Interactive figures of a diagnosis: what was left over, the motion, and the track with its arrows, on one time axis."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ferryid.diagnose import Diagnosis, Finding
from ferryid.report import diagnosis_words
from ferryid.report.figures import SYMBOLS, UNITS
from ferryid.report.timeline import Arrows, Mark, Strip, Timeline, Trace, left_out_spans
from ferryid.types import AXES, Floats

FLOWS = ("wind", "current")
FLOW_COLOURS = {"wind": "c2", "current": "c3"}
WITHOUT, WITH = "without the findings", "with them"


def timeline(diagnosis: Diagnosis, common: Sequence[Finding] = ()) -> Timeline | None:
    """Return the interactive figures of a log; None where its evidence has too few rows to draw.

    Findings have the numbers of the headings below; those of all logs, which stand there once, have none.
    """
    evidence = diagnosis.evidence
    t = evidence.get("t", np.empty(0))
    if len(t) < 2:
        return None
    own = diagnosis_words.findings_of(diagnosis, common)
    heading = np.radians(evidence["heading"]) if "heading" in evidence else None
    place = None
    if "place" in evidence and heading is not None and np.isfinite(evidence["place"]).all(axis=1).any():
        place = np.column_stack([evidence["place"], heading])
    return Timeline(
        diagnosis.log,
        t,
        (*_left_over(diagnosis, own), *_flows(diagnosis), *_motion(diagnosis)),
        left_out_spans(diagnosis.left_out),
        tuple(_mark(diagnosis, k, one) for k, one in enumerate(own, 1)),
        place,
        () if heading is None else _arrows(diagnosis, heading),
    )


def on_timeline(diagnosis: Diagnosis, finding: Finding) -> bool:
    """Return whether what a finding explains is drawn over time there, window by window."""
    t, own = diagnosis.evidence.get("t", np.empty(0)), finding.evidence.get("t", np.empty(0))
    return "explained" in finding.evidence and len(t) > 1 and np.array_equal(t, own)


def _left_over(diagnosis: Diagnosis, own: Sequence[Finding]) -> list[Strip]:
    evidence = diagnosis.evidence
    if "before" not in evidence:
        return []
    strips = []
    for j, axis in enumerate(AXES):
        traces = [Trace(WITHOUT if diagnosis.findings else "left over", evidence["before"][:, j], "base")]
        if diagnosis.findings and "after" in evidence:
            traces.append(Trace(WITH, evidence["after"][:, j], "new"))
        for k, finding in enumerate(own, 1):
            if on_timeline(diagnosis, finding) and finding.labels.get("residual", "").startswith(axis):
                explained = finding.evidence["explained"]
                traces.append(Trace(_explains(k, finding), explained, "measured", shown=False, dash=(6.0, 3.0)))
        if "thrust" in evidence:
            traces.append(Trace("actuator force", evidence["thrust"][:, j], "grey", shown=False, framing=False))
        strips.append(Strip(f"{axis} {SYMBOLS[j]} left over [{UNITS[j]}]", tuple(traces)))
    return strips


def _explains(k: int, finding: Finding) -> str:
    return f"{k}. {diagnosis_words.title(finding.effect, finding.instance)} explains"


def _mark(diagnosis: Diagnosis, k: int, finding: Finding) -> Mark:
    t = diagnosis.evidence["t"]
    spans = finding.intervals
    # What acts in nearly all of the log has no time of its own.
    if spans and spans[0][0] <= t[0] and spans[-1][1] >= t[-1] and len(spans) == 1:
        spans = ()
    trace = _explains(k, finding) if on_timeline(diagnosis, finding) else ""
    return Mark(diagnosis_words.title(finding.effect, finding.instance), spans, trace)


def _motion(diagnosis: Diagnosis) -> list[Strip]:
    evidence = diagnosis.evidence
    if "nu" not in evidence:
        return []
    surge, sway, yaw = evidence["nu"].T
    strips = [
        Strip(
            "velocity over ground, window means [m/s]",
            (Trace("surge u", surge, "c0"), Trace("sway v", sway, "c1", dash=(6.0, 3.0))),
        ),
        Strip("yaw rate, window means [deg/s]", (Trace("yaw rate r", np.degrees(yaw), "c0"),)),
    ]
    if "before" not in evidence and "thrust" in evidence:
        forces = zip(AXES, SYMBOLS, UNITS, evidence["thrust"].T, strict=True)
        strips += [
            Strip(f"{axis} {symbol} [{unit}]", (Trace("actuator force", force, "measured"),))
            for axis, symbol, unit, force in forces
        ]
    return strips


def _flow(diagnosis: Diagnosis, finding: Finding) -> tuple[Floats, Floats] | None:
    """Return north and east of a flow that was found: over time, or one value of the whole log."""
    t = diagnosis.evidence["t"]
    if finding.course is not None and {"north", "east"} <= set(finding.course.value):
        north, east = (np.interp(t, finding.course.t, finding.course.value[name]) for name in ("north", "east"))
        return north, east
    if {"north", "east"} <= set(finding.parameters):
        return np.array([finding.parameters["north"].value]), np.array([finding.parameters["east"].value])
    return None


def _flows(diagnosis: Diagnosis) -> list[Strip]:
    """Return a strip for every flow that changes over time, or was measured."""
    found = {one.effect: _flow(diagnosis, one) for one in diagnosis.findings if one.effect in FLOWS}
    strips = []
    for name in FLOWS:
        traces = []
        flow, measured = found.get(name), diagnosis.evidence.get(name)
        for k, (side, colour) in enumerate((("north", "c0"), ("east", "c1"))):
            if flow is not None and (len(flow[k]) > 1 or measured is not None):
                values = np.broadcast_to(flow[k], diagnosis.evidence["t"].shape)
                traces.append(Trace(f"{side}, found", values, colour))
            if measured is not None:
                traces.append(Trace(f"{side}, measured", measured[:, k], colour, dash=(2.0, 2.0)))
        if traces:
            strips.append(Strip(f"{name} goes to [m/s]", tuple(traces)))
    return strips


def _arrows(diagnosis: Diagnosis, heading: Floats) -> tuple[Arrows, ...]:
    evidence = diagnosis.evidence
    shown: list[Arrows] = []
    for name in FLOWS:
        if name in evidence:
            north, east = evidence[name].T
            shown.append(Arrows(f"{name}, measured", "m/s", "grey", north, east))
    for finding in diagnosis.findings:
        flow = _flow(diagnosis, finding) if finding.effect in FLOWS else None
        if flow is not None:
            shown.append(Arrows(f"{finding.effect}, found", "m/s", FLOW_COLOURS[finding.effect], *flow))
    for name, label, colour in (("before", WITHOUT, "base"), ("after", WITH, "new")):
        if name in evidence and (name == "before" or diagnosis.findings):
            what = f"force left over {label}" if diagnosis.findings else "force left over"
            shown.append(_force(what, evidence[name], heading, colour, shown=name == "before"))
    return tuple(shown)


def _force(label: str, force: Floats, heading: Floats, colour: str, *, shown: bool) -> Arrows:
    """Return a force along the vessel's axes as arrows north and east."""
    cos, sin = np.cos(heading), np.sin(heading)
    north, east = cos * force[:, 0] - sin * force[:, 1], sin * force[:, 0] + cos * force[:, 1]
    return Arrows(label, "N", colour, north, east, shown=shown)


def timelines(diagnoses: Sequence[Diagnosis], most: int) -> dict[int, Timeline | None]:
    """Return those of the first `most` logs, by the place of the log."""
    common = diagnosis_words.findings_of_all(diagnoses)
    return {k: timeline(one, common) for k, one in enumerate(diagnoses[:most])}
