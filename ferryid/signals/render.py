"""The findings of `inspect` as text for a terminal, at most 100 columns wide."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

from ferryid.ingest.log import Loss
from ferryid.signals.data_quality import loss_sentence, named

WIDTH = 100
_FIELDS_SHOWN = 24


def render_inspect(result: Mapping[str, Any]) -> str:
    """Return the output of `ferryid.signals.inspect.inspect` as text: aligned columns, at most 100 wide."""
    blocks = [_head(result), _topics(result["topics"])]
    if result["vessel"] is not None:
        blocks.append(_vessel(result["vessel"]))
    else:
        blocks.append(_fields(result["topics"]))
        blocks.append(_matches(result["bundled"]))
    losses = [Loss(**{key: value for key, value in loss.items() if key != "seconds"}) for loss in result["losses"]]
    blocks.append(_listed("Lost", [loss_sentence(loss) for loss in losses]) if losses else "Lost: nothing")
    blocks.append(_listed("Notes", result["notes"]))
    return "\n\n".join(block for block in blocks if block)


def table(header: Sequence[str], rows: Sequence[Sequence[str]], left: Sequence[int] = (0,)) -> str:
    """Align columns; those in `left` to the left, all others to the right; the first one is cut to fit 100 columns."""
    cells = [list(header), *(list(row) for row in rows)]
    widths = [max(len(row[place]) for row in cells) for place in range(len(header))]
    excess = sum(widths) + 2 * (len(widths) - 1) - WIDTH
    for place in sorted(left, key=lambda one: -widths[one]):
        if excess > 0:
            cut = min(excess, max(0, widths[place] - 16))
            widths[place] -= cut
            excess -= cut
    lines = []
    for row in cells:
        parts = [
            _cut(cell, width).ljust(width) if place in left else cell.rjust(width)
            for place, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(parts).rstrip())
    return "\n".join(lines)


def _cut(text: str, width: int) -> str:
    """Keep the end of a name that is too long: topics differ there."""
    return text if len(text) <= width else "…" + text[len(text) - width + 1 :]


def _head(result: Mapping[str, Any]) -> str:
    size = sum(file["bytes"] for file in result["files"])
    start = result["start"] or "not known (times are counted from the start)"
    lines = [
        _cut(result["path"], WIDTH),
        f"  {result['format']}, {_bytes(size)}, {result['messages']} messages in {len(result['topics'])} topic(s)",
        f"  start {start}, duration {_duration(result['duration_s'])}",
        f"  {result['sha256']}",
    ]
    return "\n".join(lines)


def _topics(topics: Sequence[Mapping[str, Any]]) -> str:
    rows = []
    for topic in topics:
        clock = topic["clock"]
        values = ["?", "", "", "", ""]
        if clock is not None:
            longest = max(((end - start) * 1e-9 for start, end in clock["gaps"]), default=0.0)
            values = [
                clock["source"],
                _seconds(clock["offset_s"]),
                _drift(clock, topic["duration_s"]),
                _seconds(clock["jitter_s"]),
                f"{len(clock['gaps'])} ({longest:.1f} s)" if clock["gaps"] else "0",
            ]
        kind = topic["type"].replace("/msg/", "/")
        rows.append([topic["name"], kind, str(topic["count"]), _number(topic["rate_hz"], ".2f"), *values])
    header = ["topic", "type", "count", "Hz", "clock", "offset", "ppm", "jitter", "gaps"]
    if all(row[1] == "table" for row in rows):
        header, rows = [header[0], *header[2:]], [[row[0], *row[2:]] for row in rows]
        return table(header, rows)
    return table(header, rows, left=(0, 1))


def _fields(topics: Sequence[Mapping[str, Any]]) -> str:
    lines = ["Fields"]
    alike: dict[tuple[str, ...], list[str]] = {}
    for topic in topics:
        alike.setdefault(tuple(topic["fields"]), []).append(topic["name"])
    for names, owners in alike.items():
        shown = ", ".join(names[:_FIELDS_SHOWN])
        if len(names) > _FIELDS_SHOWN:
            shown += f" and {len(names) - _FIELDS_SHOWN} more (see --json)"
        text = f"{named(owners)}: {shown or 'not known'}"
        lines += textwrap.wrap(text, WIDTH, initial_indent="  ", subsequent_indent="      ", break_long_words=False)
    return "\n".join(lines)


def _matches(matches: Sequence[Mapping[str, Any]]) -> str:
    usable = [match for match in matches if match["usable"]]
    lines = ["Bundled vessel profiles"]
    lines += [f"  {one['name']}: fits, {one['found']} of {one['signals']} signals found" for one in usable]
    if not usable:
        best = max(matches, key=lambda one: int(one["found"]), default=None)
        near = (
            f" (nearest: {best['name']}, {best['found']} of {best['signals']} signals)"
            if best and best["found"]
            else ""
        )
        lines.append(f"  none fits{near}: describe the vessel and its signals in a profile, and pass it with --vessel")
    return "\n".join(lines)


def _vessel(vessel: Mapping[str, Any]) -> str:
    signals = {name: signal for stream in vessel["streams"].values() for name, signal in stream["signals"].items()}
    rows = []
    for name, source in vessel["found"].items():
        signal = signals.get(name)
        if signal is None:
            rows.append([name, "", "", "", "", "", "", source])
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
                source,
            ]
        )
    title = f"Vessel {vessel['name']}: " + ("fits" if vessel["usable"] else "does not fit")
    lines = [title]
    if rows:
        lines.append(table(["signal", "unit", "min", "max", "NaN", "held", "spikes", "from"], rows, left=(0, 1, 7)))
    if vessel["problem"]:
        lines += textwrap.wrap(vessel["problem"], WIDTH, initial_indent="  ", subsequent_indent="  ")
    for quantity, reason in vessel["missing"].items():
        lines += textwrap.wrap(f"missing {quantity}: {reason}", WIDTH, initial_indent="  ", subsequent_indent="      ")
    for remark in vessel["remarks"]:
        lines += textwrap.wrap(remark, WIDTH, initial_indent="  ", subsequent_indent="      ")
    return "\n".join(lines)


def _listed(title: str, sentences: Sequence[str]) -> str:
    if not sentences:
        return ""
    lines = [title]
    for sentence in sentences:
        lines += textwrap.wrap(sentence, WIDTH, initial_indent="  ", subsequent_indent="      ", break_long_words=False)
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
    return f"{size} bytes"
