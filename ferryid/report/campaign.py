"""What several logs have in common, as tables: effects over logs, winds and currents log by log, withheld measurements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import atan2, degrees, hypot, isfinite
from textwrap import fill, wrap
from typing import Any

import numpy as np

from ferryid.counts import counted
from ferryid.diagnose import UNKNOWN, Diagnosis, Estimate, Finding, Withheld
from ferryid.effects.wording import listed, uncapitalised
from ferryid.report import diagnosis_words, second_sources
from ferryid.report.diagnosis_errors import fitted, ratio_of
from ferryid.report.drawings import NONE, Drawings
from ferryid.report.figures import MEASURED, NEW, canvas, styled, svg_text
from ferryid.types import AXES

FLOWS = ("wind", "current")
"""Effects whose parameters are a horizontal vector, and of which every log has its own."""
COMPONENTS = ("north", "east")
TEXT_COLUMNS = 100
"""Width of what is written for a terminal."""
TIED = "\N{NO-BREAK SPACE}"
LOG_COLUMNS = 32
"""Most columns of a log's name in a table on a terminal."""


def effect_rows(diagnoses: Sequence[Diagnosis]) -> list[dict[str, str]]:
    """Return a row for every effect of several logs: in how many it is, where it is a hint only, and its size over them."""
    by_key: dict[tuple[str, str | None], list[tuple[int, Finding]]] = {}
    for log, one in enumerate(diagnoses):
        for finding in one.findings:
            by_key.setdefault(finding.key, []).append((log, finding))
    rows = []
    for found in sorted(by_key.values(), key=lambda found: -sum(one.sure for _, one in found)):
        every = [one for _, one in found]
        sure = [one for one in every if one.sure]
        # A log may have several that have no name.
        certain = {log for log, one in found if one.sure}
        hints = len({log for log, _ in found} - certain)
        counts = [f"{len(certain)} of {len(diagnoses)}"] if sure else []
        counts += [f"perhaps {hints}{' more' if sure else f' of {len(diagnoses)}'}"] if hints else []
        rows.append(
            {
                "name": diagnosis_words.title(every[0].effect, every[0].instance),
                "logs": ", ".join(counts),
                "size": _sizes(every[0].effect, [one.parameters for one in sure or every]),
                "probability": _range([one.probability for one in every]),
            }
        )
    return rows


def flow_rows(diagnoses: Sequence[Diagnosis], effect: str) -> list[dict[str, str]]:
    """Return a row for every log in which a wind or current was found or withheld; none where no log has one."""
    rows = []
    for one in diagnoses:
        finding, hidden = _finding(one, effect), _withheld(one, effect)
        if finding is None and hidden is None:
            continue
        sizes = {} if finding is None else finding.parameters
        row = {
            "log": one.log,
            "found": "–" if finding is None else _towards({name: sizes[name].value for name in COMPONENTS}),
            "north": diagnosis_words.estimate(sizes["north"]) if finding else "–",
            "east": diagnosis_words.estimate(sizes["east"]) if finding else "–",
            "probability": diagnosis_words.probability(finding.probability) if finding else "–",
        }
        if hidden is not None:
            row["measured"] = _towards(hidden.measured)
            row["off"] = f"{hidden.off[0]:.0f}°" if hidden.off else "–"
        rows.append(row)
    return rows


def withheld_summary(diagnoses: Sequence[Diagnosis], effect: str) -> str:
    """Return how the withheld measurements of several logs compare with what was found, in sentences; empty without any."""
    hidden = [one for one in (_withheld(each, effect) for each in diagnoses) if one is not None]
    if not hidden:
        return ""
    found = [one for one in hidden if one.off is not None]
    told = f"The measured {effect} was withheld from {counted(len(hidden), 'log')}, and it was found in {len(found)}"
    # One of each group of logs with a hull of its own.
    gains = dict.fromkeys(one.gain.says(effect) for one in hidden if one.gain is not None)
    if not found:
        return " ".join([f"{told}.", *gains])
    angle, strength = np.median([one.off for one in found if one.off is not None], axis=0)
    inside = [one.found[name].low <= one.measured[name] <= one.found[name].high for one in found for name in COMPONENTS]
    parts = [
        f"in the median {angle:.0f} deg off",
        f"at {strength:.2f} of its strength",
        f"the 95 % intervals hold {sum(inside)} of {counted(len(inside), 'component')}",
    ]
    courses = [one.course.correlation for one in found if one.course and isfinite(one.course.correlation)]
    if courses:
        parts.append(f"over time, estimate and measurement correlate by {np.median(courses):.2f} in the median")
    return " ".join([f"{told}: {'; '.join(parts)}.", *gains])


def error_sentence(diagnoses: Sequence[Diagnosis]) -> str:
    """Return the squared force error with the findings over that without, over the logs; empty where none has both."""
    ratios = [ratio_of(one) for one in diagnoses if fitted(one)]
    parts = []
    for axis in AXES:
        values = [one[axis].value for one in ratios if axis in one]
        if values:
            spread = f" ({min(values):.2f} to {max(values):.2f})" if len(values) > 1 else ""
            parts.append(f"{axis} {np.median(values):.2f}{spread}")
    if not parts:
        return ""
    over = f"median over {counted(len(ratios), 'log')}" if len(ratios) > 1 else "one log"
    return f"Squared force error on held-out data, with the findings over without, {over}: {listed(parts)}."


def flow_figure(diagnoses: Sequence[Diagnosis], effect: str) -> str:
    """Draw the wind or current of every log with its 95 % intervals, beside the withheld measurements; empty without any."""
    shown = [one for one in diagnoses if _finding(one, effect) or _withheld(one, effect)]
    if not any(_finding(one, effect) for one in shown):
        return ""
    with styled():
        figure, axes = canvas(2, 4.6)
        for ax, name in zip(axes, COMPONENTS, strict=True):
            for k, one in enumerate(shown, 1):
                finding, hidden = _finding(one, effect), _withheld(one, effect)
                if finding is not None:
                    value = finding.parameters[name]
                    ends = [[value.value - value.low], [value.high - value.value]]
                    ax.errorbar([k], [value.value], ends, fmt="o", color=NEW, label="estimated, 95 % interval")
                if hidden is not None and name in hidden.measured:
                    ax.plot([k], [hidden.measured[name]], "_", color=MEASURED, ms=14, mew=2, label="measured, withheld")
            ax.axhline(0.0, color="#888888", linewidth=0.7)
            ax.set_ylabel(f"{name} [m/s]")
            # Beside a slow current's three decimals.
            ax.yaxis.set_label_coords(-0.135, 0.5)
        axes[-1].set_xticks(range(1, len(shown) + 1))
        axes[-1].set_xlabel("log, in the order of the table")
        handles, labels = axes[0].get_legend_handles_labels()
        once = dict(zip(labels, handles, strict=True))
        figure.legend(once.values(), once.keys(), loc="upper center", ncols=2, borderaxespad=0.1)
        return svg_text(figure)


def section(diagnoses: Sequence[Diagnosis], drawings: Drawings = NONE) -> dict[str, Any]:
    """Return what the page shows of several logs together; `drawings` are those that exist already."""
    flows = []
    for effect in FLOWS:
        rows = flow_rows(diagnoses, effect)
        if not rows:
            continue
        drawing = drawings.of(f"all-{effect}", flow_figure, diagnoses, effect)
        caption = f"The {effect} of each log: where it flows to, estimated with one hull for all logs."
        flows.append(
            {
                "title": diagnosis_words.title(effect),
                "rows": rows,
                "withheld": any("measured" in row for row in rows),
                "says": withheld_summary(diagnoses, effect),
                "figures": [{"file": f"all-{effect}", "svg": drawing, "caption": caption}] if drawing else [],
            }
        )
    return {"effects": effect_rows(diagnoses), "flows": flows, "errors": error_sentence(diagnoses)}


def text_tables(diagnoses: Sequence[Diagnosis]) -> list[str]:
    """Return the same for a terminal, as blocks of lines."""
    blocks = []
    if rows := effect_rows(diagnoses):
        every = [[row["name"], row["logs"], row["size"]] for row in rows]
        blocks.append(_aligned([["left out of the model", "logs", "size over those logs"], *every]))
    common = diagnosis_words.findings_of_all(diagnoses)
    verdicts = [[_short(one.log), one.verdict.replace("_", " "), names_of(one, common)] for one in diagnoses]
    blocks.append(_aligned([["log", "verdict", "left out of the model"], *verdicts]))
    for effect in FLOWS:
        flows = flow_rows(diagnoses, effect)
        head = {"log": "log", "found": effect, "probability": "probability"}
        if any("measured" in row for row in flows):
            head |= {"measured": "measured, withheld", "off": "apart"}
        if flows:
            every = [[row.get(name, "–") for name in head] for row in flows]
            blocks.append(_aligned([list(head.values()), *([_short(row[0]), *row[1:]] for row in every)]))
    sentences = (*(withheld_summary(diagnoses, effect) for effect in FLOWS), error_sentence(diagnoses))
    return [*blocks, *(fill(line, TEXT_COLUMNS) for line in sentences if line)]


def _aligned(rows: Sequence[Sequence[str]]) -> str:
    """Return rows as aligned columns; the last column is broken at the width of a terminal, between its parts if possible."""
    widths = [max(len(row[k]) for row in rows) + 2 for k in range(len(rows[0]) - 1)]
    lines = []
    for row in rows:
        first = "".join(f"{cell:<{width}}" for cell, width in zip(row[:-1], widths, strict=True))
        room = max(TEXT_COLUMNS - len(first), 20)
        parts = [part.replace(" ", TIED) if len(part) < room else part for part in row[-1].split("; ")]
        last = wrap("; ".join(parts), room) or [""]
        lines += [f"{first}{last[0]}".rstrip(), *(" " * len(first) + line for line in last[1:])]
    return "\n".join(lines).replace(TIED, " ")


def left_to_the_page(diagnoses: Sequence[Diagnosis], told: Sequence[str]) -> str:
    """Return how many notes and repairs of single logs the page has, which a terminal is spared."""
    notes = sum(len(diagnosis_words.notes_of(one, told)) for one in diagnoses)
    repairs = [len(second_sources.repairs(one)) for one in diagnoses]
    parts = [counted(notes, "note")] if notes else []
    if any(repairs):
        parts.append(f"{counted(sum(repairs), 'repair')} made while reading {counted(sum(map(bool, repairs)), 'log')}")
    about = f", with {' and '.join(parts)}" if parts else ""
    return f"Every log by itself is in the report{about}."


def names_of(diagnosis: Diagnosis, common: Sequence[Finding] = ()) -> str:
    """Return the effects of a log in words, hints apart, those of all logs without their names."""
    own = diagnosis_words.findings_of(diagnosis, common)
    shared = len(own) < len(diagnosis.findings)
    sure = list(dict.fromkeys(_inline(one) for one in own if one.sure))
    hints = [name for name in dict.fromkeys(_inline(one) for one in own if not one.sure) if name not in sure]
    parts = [", ".join(sure)] if sure else []
    parts += [f"perhaps {', '.join(hints)}"] if hints else []
    if not parts:
        return "only what all logs have" if shared else "–"
    # Without these words the row would contradict the table of effects, which counts this log.
    return "; ".join(parts) + (", beside what all logs have" if shared else "")


def _inline(finding: Finding) -> str:
    if finding.effect == UNKNOWN:
        return "something without a name"
    return uncapitalised(diagnosis_words.title(finding.effect, finding.instance))


def _short(name: str) -> str:
    """Return a log's name for a terminal: the ends of a long one, which tell one log of a series from another."""
    return name if len(name) <= LOG_COLUMNS else f"{name[:12]}…{name[-(LOG_COLUMNS - 13) :]}"


def _finding(diagnosis: Diagnosis, effect: str) -> Finding | None:
    return next(
        (
            one
            for one in diagnosis.findings
            if one.effect == effect and all(name in one.parameters for name in COMPONENTS)
        ),
        None,
    )


def _withheld(diagnosis: Diagnosis, effect: str) -> Withheld | None:
    return next(
        (
            one
            for one in diagnosis.withheld
            if one.signal == effect and all(name in one.measured for name in COMPONENTS)
        ),
        None,
    )


def _towards(flow: Mapping[str, float]) -> str:
    north, east = (flow[name] for name in COMPONENTS)
    return f"{hypot(north, east):.2f} m/s towards {round(degrees(atan2(east, north))) % 360}°"


def _sizes(effect: str, every: Sequence[Mapping[str, Estimate]]) -> str:
    """Return the estimates of one log with their intervals, and the least and greatest of several."""
    if len(every) == 1:
        return diagnosis_words.numbers_of(every[0], effect)
    parts = []
    for name, first in every[0].items():
        told, of_logs = diagnosis_words.in_words(effect, name, [one[name] for one in every if name in one])
        values = [one.value for one in of_logs]
        unit = "" if first.unit in ("-", "") else f" {first.unit}"
        digits = first.digits
        low, high = f"{min(values):.{digits}f}", f"{max(values):.{digits}f}"
        parts.append(f"{told} {low if low == high else f'{low} to {high}'}{unit}")
    return "; ".join(parts)


def _range(values: Sequence[float]) -> str:
    low, high = diagnosis_words.probability(min(values)), diagnosis_words.probability(max(values))
    return low if low == high else f"{low} to {high}"
