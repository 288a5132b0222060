"""The page on logs that were refused: the error, what the logs hold, drawn, and what is missing."""

from __future__ import annotations

import re
from collections.abc import Sequence
from math import isfinite
from pathlib import Path, PurePath
from typing import Any

import matplotlib as mpl

from ferryid.errors import FerryIdError, UnwritableError
from ferryid.files import finite
from ferryid.report.figures import MEASURED, STYLE, canvas, svg_text
from ferryid.report.folder import made, place_of, write_folder
from ferryid.report.held_signals import HeldLog, held_log
from ferryid.report.html import template
from ferryid.report.interactive import Interactive, make_interactive
from ferryid.report.structure import envelope
from ferryid.report.timeline import Timeline
from ferryid.types import RunContext
from ferryid.vessel.profile import Profile

MAX_LOGS = 6
"""Logs that are drawn."""
COLOURS = {"c0": "#0072b2", "c1": "#d55e00", "c2": "#009e73", "c3": "#cc79a7", "c4": "#e69f00", "c5": "#56b4e9"}
"""Okabe and Ito's, as in the styles of the pages."""


def write_refusal(
    error: FerryIdError, what: str, logs: Sequence[str], profile: Profile, run: RunContext, command: Sequence[str] = ()
) -> Path | None:
    """Write the page, and return its path; None where the error is about no log, or none of them can be opened.

    Raises
    ------
    FerryIdError
        For a folder that cannot be written; nothing half-written is left.
    """
    held = []
    for path in _concerned(str(error), logs, profile):
        try:
            held.append(held_log(path, profile, run))
        except UnwritableError:
            raise
        except FerryIdError:
            continue
    if not held:
        return None
    more = f"-and-{len(held) - 1}-more" if len(held) > 1 else ""
    name = re.sub(r"[^\w.+-]+", "_", f"not-{what}-{held[0].name[:100]}{more}")
    place = place_of(run.out / "reports", name, [one.path for one in held], command)
    drawn = held[:MAX_LOGS]
    interactive = make_interactive({k: one.timeline for k, one in enumerate(drawn)}, place.folder, run.out)
    page, drawings = _render(str(error), what, drawn, profile, made(command), interactive)
    plain = finite(as_json(error, what, held, place.page))
    write_folder(place, page, drawings, plain, "refusal.json", scripts=interactive.files())
    return place.page


def _concerned(message: str, logs: Sequence[str], profile: Profile) -> list[str]:
    """Return the logs that an error is about: those that its first words name, or all where they name the signal map."""
    head = message.partition(": ")[0]
    words = set(re.split(r"[,;]? (?:and )?|:\d+$", head)) | {head}
    named = [
        log
        for log in logs
        for parts in [log.split("+")]
        if words & {name for part in (log, *parts) for name in (part, PurePath(part).name, PurePath(part).stem)}
    ]
    return named or (list(logs) if re.sub(r":\d+$", "", head) == str(profile.path) else [])


def as_json(error: FerryIdError, what: str, held: Sequence[HeldLog], page: Path) -> dict[str, Any]:
    """Return what was refused in the form of schema ``ferryid.refusal/1``."""
    return {
        "schema": "ferryid.refusal/1",
        "error": str(error),
        "refused": what,
        "logs": [
            {
                "name": one.name,
                "path": one.path,
                "signals": [
                    {
                        "column": signal.column,
                        "source": signal.source,
                        "unit": signal.unit,
                        "rows": signal.rows,
                        "rate_hz": signal.rate_hz if isfinite(signal.rate_hz) else None,
                        "least": signal.least if isfinite(signal.least) else None,
                        "greatest": signal.greatest if isfinite(signal.greatest) else None,
                    }
                    for signal in one.signals
                ],
                "missing": dict(one.missing),
                "needed": sorted(one.needed),
            }
            for one in held
        ],
        "report": str(page),
    }


def _render(
    message: str,
    what: str,
    held: Sequence[HeldLog],
    profile: Profile,
    origin: dict[str, str],
    interactive: Interactive,
) -> tuple[str, dict[str, str]]:
    wrong, _, remedy = message.partition(" Fix: ")
    drawings = {
        f"signals-{k}": signals_over_time(one.timeline) for k, one in enumerate(held, 1) if one.timeline is not None
    }
    logs = [
        {
            "name": one.name,
            "timeline": interactive.number(k),
            "figures": [
                {
                    "file": f"signals-{k + 1}",
                    "svg": drawings[f"signals-{k + 1}"],
                    "caption": "The signals of the profile as the log has them, in SI units, angles in degrees.",
                    "over_time": True,
                }
            ]
            if one.timeline is not None
            else [],
            "signals": [
                {
                    "cells": [
                        signal.source,
                        signal.unit,
                        signal.rows,
                        _number(signal.rate_hz),
                        _number(signal.least),
                        _number(signal.greatest),
                    ],
                    "column": signal.column,
                    "remark": signal.remark,
                }
                for signal in one.signals
            ],
            "missing": [
                {"quantity": quantity, "reason": reason, "needed": "yes" if quantity in one.needed else "no"}
                for quantity, reason in sorted(one.missing.items(), key=lambda pair: pair[0] not in one.needed)
            ],
            "topics": [
                {"name": topic.name, "type": topic.type, "count": topic.count, "mapped": _mapped(topic.name, profile)}
                for topic in one.topics
            ],
        }
        for k, one in enumerate(held)
    ]
    page = template("refusal.html").render(
        title=f"Not {what} · {profile.name} · {', '.join(one.name for one in held[:2])}"
        + (f" and {len(held) - 2} more" if len(held) > 2 else ""),
        wrong=wrong,
        remedy=remedy,
        made=origin,
        logs=logs,
        assets=interactive.assets,
    )
    return page, drawings


def _mapped(topic: str, profile: Profile) -> str:
    names = [signal.quantity for signal in profile.signals if signal.topic.strip("/") == topic.strip("/")]
    return ", ".join(names)


def _number(value: float) -> str:
    return f"{value:.4g}" if isfinite(value) else "–"


def signals_over_time(timeline: Timeline) -> str:
    """Draw the strips of a timeline below one another."""
    with mpl.rc_context(STYLE):
        count = len(timeline.strips)
        figure, axes = canvas(count, 1.3 * count + 0.8, top=0.2)
        for ax, strip in zip(axes, timeline.strips, strict=True):
            for trace in strip.traces:
                ax.plot(
                    *envelope(timeline.t, trace.values),
                    color=COLOURS.get(trace.colour, MEASURED),
                    label=trace.label,
                    linestyle="--" if trace.dash else "-",
                )
            ax.set_title(strip.label, fontsize=9, loc="left", pad=2)
            if len(strip.traces) > 1:
                # Beside the title, where no line can lie below it.
                ax.legend(
                    fontsize=6.5, loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.1, borderpad=0.0,
                    columnspacing=0.8, handlelength=1.2, handletextpad=0.4, labelspacing=0.2, ncols=4,
                )  # fmt: skip
        axes[-1].set_xlabel("time [s]")
        rows = max((len(strip.traces) + 3) // 4 for strip in timeline.strips)
        figure.subplots_adjust(hspace=0.3 + 0.15 * rows)
        return svg_text(figure)
