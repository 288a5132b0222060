"""The findings of `inspect` as text for a terminal of a given width."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

from ferryid.counts import counted, verb
from ferryid.errors import one_line
from ferryid.ingest.log import Loss
from ferryid.signals.data_quality import dropped_rows, loss_sentence, named

_FIELDS_SHOWN = 24
_LEGEND = {
    "ppm": "drift of the sender's clock against the recorder's",
    "held": "samples that repeat the one before",
    "spikes": "single implausible samples",
    "jumps": "other implausible steps",
}


def render_inspect(result: Mapping[str, Any], width: int = 100) -> str:
    """Return the output of `ferryid.signals.inspect.inspect` as text: aligned columns, at most `width` characters wide."""
    blocks = [_head(result, width), _topics(result["topics"], width)]
    if result["vessel"] is not None:
        blocks.append(_vessel(result["vessel"], width))
    else:
        blocks.append(_fields(result["topics"], width))
        blocks.append(_matches(result["bundled"], str(result["path"]), width))
    shown = {word for block in blocks for line in block.splitlines() for word in line.split()}
    legend = "; ".join(f"{word}: {meaning}" for word, meaning in _LEGEND.items() if word in shown)
    blocks.append(textwrap.fill(legend, width))
    losses = [Loss(**{key: value for key, value in loss.items() if key != "seconds"}) for loss in result["losses"]]
    lost = [loss_sentence(loss) for loss in losses if loss.costs_messages]
    left_out = _left_out(result)
    if lost:
        blocks.append(_listed("Lost", [*lost, *(f"{one[:1].upper()}{one[1:]}." for one in left_out)], width))
    elif left_out:
        blocks.append(textwrap.fill(f"Lost: no message; {'; '.join(left_out)}.", width, subsequent_indent="      "))
    else:
        blocks.append("Lost: nothing")
    blocks.append(
        _listed(
            "Notes", [*(loss_sentence(loss) for loss in losses if not loss.costs_messages), *result["notes"]], width
        )
    )
    return "\n\n".join(block for block in blocks if block)


def _left_out(result: Mapping[str, Any]) -> list[str]:
    """Return what was read and is left out nevertheless, because of times and, with a profile, of gaps and faults."""
    said = []
    dropped = dropped_rows([topic["clock"] for topic in result["topics"] if topic["clock"] is not None])
    if dropped:
        count = sum(dropped.values())
        why = ", ".join(f"{number} as {reason}" for reason, number in dropped.items())
        said.append(f"{counted(count, 'row')} {verb(count, 'is')} left out for wrong times: {why}")
    vessel = result["vessel"]
    rows = sum(one["rows"] for one in vessel["left_out"]) if vessel is not None else 0
    if rows:
        said.append(f"a fit leaves out {counted(rows, 'row')} for gaps and faults, see Vessel {vessel['name']}")
    return said


def table(header: Sequence[str], rows: Sequence[Sequence[str]], width: int, left: Sequence[int] = (0,)) -> str:
    """Align columns; those in `left` to the left, and cut where the table is wider than `width`; others to the right."""
    cells = [list(header), *(list(row) for row in rows)]
    widths = [max(len(row[place]) for row in cells) for place in range(len(header))]
    excess = sum(widths) + 2 * (len(widths) - 1) - width
    ends = {place: max(len(row[place].rpartition("/")[2]) for row in cells) + 2 for place in left}
    # What stands before the last slash is spared first, and the first column, which names the row, for longest.
    for least in ({**ends, left[0]: max(20, ends[left[0]])}, dict.fromkeys(left, 12)):
        for place in reversed(left):
            cut = min(max(0, excess), max(0, widths[place] - least[place]))
            widths[place] -= cut
            excess -= cut
    lines = []
    for row in cells:
        parts = [
            _cut(cell, size).ljust(size) if place in left else cell.rjust(size)
            for place, (cell, size) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(parts).rstrip())
    return "\n".join(lines)


def _cut(text: str, width: int) -> str:
    """Keep the end of a name that is too long: topics differ there."""
    return text if len(text) <= width else "…" + text[len(text) - width + 1 :]


def _head(result: Mapping[str, Any], width: int) -> str:
    size = sum(file["bytes"] for file in result["files"])
    start = result["start"] or "not known (times count from it)"
    lines = [
        _cut(one_line(result["path"]), width),
        f"  {result['format']}, {_bytes(size)}, {counted(result['messages'], 'message')} in "
        f"{counted(len(result['topics']), 'topic')}",
        f"  start {start}, duration {_duration(result['duration_s'])}",
        f"  {result['sha256']}",
    ]
    return "\n".join(lines)


def _topics(topics: Sequence[Mapping[str, Any]], width: int) -> str:
    rows = []
    for topic in topics:
        clock = topic["clock"]
        values = ["?", "", "", "", ""]
        if clock is not None:
            longest = max(((end - start) * 1e-9 for start, end in clock["gaps"]), default=0.0)
            values = [
                "column" if clock["source"] == "receive" and topic["encoding"] == "table" else clock["source"],
                _seconds(clock["offset_s"]),
                _drift(clock, topic["duration_s"]),
                _seconds(clock["jitter_s"]),
                f"{len(clock['gaps'])} ({_gap(longest)})" if clock["gaps"] else "0",
            ]
        kind = topic["type"].replace("/msg/", "/")
        rows.append([topic["name"], kind, str(topic["count"]), _number(topic["rate_hz"], ".2f"), *values])
    header = ["topic", "type", "count", "Hz", "clock", "offset", "ppm", "jitter", "gaps"]
    if all(row[1] == "table" for row in rows):
        header, rows = [header[0], *header[2:]], [[row[0], *row[2:]] for row in rows]
        return table(header, rows, width)
    return table(header, rows, width, left=(0, 1))


def _fields(topics: Sequence[Mapping[str, Any]], width: int) -> str:
    lines = ["Fields"]
    alike: dict[tuple[str, ...], list[str]] = {}
    for topic in topics:
        alike.setdefault(tuple(topic["fields"]), []).append(topic["name"])
    for names, owners in alike.items():
        shown = ", ".join(names[:_FIELDS_SHOWN])
        if len(names) > _FIELDS_SHOWN:
            shown += f" and {len(names) - _FIELDS_SHOWN} more (see --json)"
        text = f"{named(owners)}: {shown or 'not known'}"
        lines += _wrapped(text, width)
    return "\n".join(lines)


def _matches(matches: Sequence[Mapping[str, Any]], path: str, width: int) -> str:
    usable = [match for match in matches if match["usable"]]
    lines = ["Bundled vessel profiles"]
    lines += [f"  {one['name']}: fits, {one['found']} of {counted(one['signals'], 'signal')} found" for one in usable]
    for one in matches:
        if one["problem"]:
            lines += _wrapped(
                f"{one['name']}: {one['found']} of {counted(one['signals'], 'signal')} found, but a fit "
                f"refuses the log: {one['problem']}",
                width,
            )
    if not usable and len(lines) == 1:
        best = max(matches, key=lambda one: int(one["found"]), default=None)
        near = (
            f" (nearest: {best['name']}, {best['found']} of {counted(best['signals'], 'signal')})"
            if best and best["found"]
            else ""
        )
        what = f"none fits{near}: draft one with ferryid vessel new {one_line(path)}, or write one and pass it with --vessel"
        lines += _wrapped(what, width)
    return "\n".join(lines)


def _vessel(vessel: Mapping[str, Any], width: int) -> str:
    signals = {name: signal for stream in vessel["streams"].values() for name, signal in stream["signals"].items()}
    rows = []
    for name, source in vessel["found"].items():
        signal = signals.get(name)
        if signal is None:
            rows.append([name, *[""] * 7, source])
            continue
        share = signal["held"] / max(1, signal["count"])
        held = "0" if share == 0 else "<1 %" if share < 0.01 else f"{100 * share:.0f} %"
        rows.append(
            [
                name,
                signal["unit"],
                _number(signal["minimum"], ".4g"),
                _number(signal["maximum"], ".4g"),
                str(signal["missing"]),
                held if not signal["constant"] else "constant",
                str(signal["spikes"]),
                str(signal["jumps"]),
                source,
            ]
        )
    title = f"Vessel {vessel['name']}: " + ("fits" if vessel["usable"] else "does not fit")
    lines = [title]
    if rows:
        header = ["signal", "unit", "min", "max", "NaN", "held", "spikes", "jumps", "from"]
        if not any(signal["jumps"] for signal in signals.values()):
            header, rows = [*header[:7], header[8]], [[*row[:7], row[8]] for row in rows]
        lines.append(table(header, rows, width, left=(0, 1, len(header) - 1)))
    if vessel["problem"]:
        lines += _wrapped(vessel["problem"], width)
    missing: dict[str, list[str]] = {}
    for quantity, reason in vessel["missing"].items():
        missing.setdefault(reason, []).append(quantity)
    for reason, quantities in missing.items():
        lines += _wrapped(f"missing {', '.join(quantities)}: {reason}", width)
    for remark in vessel["remarks"]:
        lines += _wrapped(remark, width)
    return "\n".join(lines)


def _wrapped(text: str, width: int) -> list[str]:
    return textwrap.wrap(text, width, initial_indent="  ", subsequent_indent="      ", break_on_hyphens=False)


def _listed(title: str, sentences: Sequence[str], width: int) -> str:
    if not sentences:
        return ""
    lines = [title]
    for sentence in sentences:
        lines += _wrapped(sentence, width)
    return "\n".join(lines)


def _drift(clock: Mapping[str, Any], duration_s: float) -> str:
    """Drift [ppm], or "~0" where jitter hides it over so short a log."""
    if clock["drift_ppm"] is None:
        return ""
    hidden = abs(clock["drift_ppm"]) * 1e-6 * duration_s < clock["jitter_s"]
    return "~0" if hidden else f"{clock['drift_ppm']:.1f}"


def _number(value: float | None, form: str) -> str:
    return "" if value is None else format(value, form)


def _seconds(value: float | None) -> str:
    if value is None:
        return ""
    size = abs(value)
    if size < 1.0:
        return f"{value * 1e3:.1f} ms"
    if size < 600.0:
        return f"{value:.2f} s"
    return f"{value / 3600:.2f} h" if size < 172_800 else f"{value / 86_400:.1f} d"


def _gap(seconds: float) -> str:
    return f"{seconds:.1f} s" if seconds < 100.0 else f"{seconds:.0f} s" if seconds < 3600.0 else _seconds(seconds)


def _duration(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.2f} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    clock = f"{hours} h {minutes:02d} min" if hours else f"{minutes} min {rest:02d} s"
    return f"{clock} ({seconds:.1f} s)"


def _bytes(size: int) -> str:
    for unit, scale in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if size >= scale:
            return f"{size / scale:.1f} {unit}"
    return f"{counted(size, 'byte')}"
