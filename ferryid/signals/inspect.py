"""What is in a log: topics, rates, gaps, clocks, losses, and which signals a vessel profile finds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.ingest import open_log, supported_formats
from ferryid.ingest.clocks import ClockReport, repair_all
from ferryid.ingest.hashing import content_hash
from ferryid.ingest.log import Reader, Series, Topic
from ferryid.ingest.stray_times import stray_times
from ferryid.signals.data_quality import (
    clock_notes,
    grouped_notes,
    plain_left_out,
    plain_loss,
    rows_left_out,
    stream_quality,
)
from ferryid.signals.faults import find_faults
from ferryid.signals.order_of_time import dated
from ferryid.signals.prepare import track_of
from ferryid.signals.recording import log_name, make_recording, selected
from ferryid.signals.render import render_inspect
from ferryid.signals.time_ranges import RangeError, cut
from ferryid.signals.track import LeftOut
from ferryid.types import TimeRanges
from ferryid.vessel.choice import named_profiles
from ferryid.vessel.profile import Profile
from ferryid.vessel.signal_map import Selection, select, survey

__all__ = ["inspect", "render_inspect"]

SCHEMA = "ferryid.inspect/1"
_BULKY = ("uint8", "int8", "byte", "char", "octet", "float32", "float64", "uint16", "int16", "bytes")


def inspect(
    path: str | Path, profile: Profile | None = None, *, verify: bool = False, ranges: TimeRanges = ()
) -> dict[str, Any]:
    """List what a log holds, and what a vessel profile makes of it.

    Parameters
    ----------
    path
        Log in any supported format; parts of one recording joined by ``+``.
    profile
        Vessel profile whose signals are looked for; without one all profiles that have a name are tried.
    verify
        Read the whole log, check every checksum and hash every byte.
    ranges
        Of what the signals of the profile are shown, all of the log where empty; topics are listed whole in any case.

    Returns
    -------
    dict
        For JSON, schema ``ferryid.inspect/1``.

    Raises
    ------
    FerryIdError
        For a log that cannot be opened, and a range that it does not have.
    """
    reader = open_log(path, profile.table if profile is not None else None)
    with ThreadPoolExecutor(1) as pool:
        hashing = pool.submit(content_hash, reader.paths, verify=verify)
        selection = survey(profile, reader.topics, reader.losses) if profile is not None else None
        wanted: dict[str, Sequence[str]] = {topic.name: () for topic in reader.topics if _is_small(topic)}
        wanted |= selection.wanted if selection is not None else {}
        series, problems = _read(reader, wanted, verify=verify)
        repaired = repair_all(series)
        vessel = None
        if profile is not None and selection is not None:
            vessel = _vessel(reader, log_name(path), profile, selection, series, problems, ranges)
        sha256 = hashing.result()
    described = [_timed(topic, series, repaired) for topic in sorted(reader.topics, key=lambda one: one.name)]
    topics = [
        _topic(topic, repaired[topic.name][2] if topic.name in repaired else None, problems) for topic in described
    ]
    start_ns, end_ns, apart = _span(described)
    return {
        "schema": SCHEMA,
        "path": str(path),
        "name": log_name(path),
        "format": _format_of(Path(path), reader),
        "files": [{"path": str(file), "bytes": _size(file)} for file in reader.paths],
        "sha256": sha256,
        "start": None if start_ns is None else _clock_time(start_ns),
        "duration_s": 0.0 if start_ns is None or end_ns is None else (end_ns - start_ns) * 1e-9,
        "messages": sum(topic.count for topic in reader.topics),
        "topics": topics,
        "losses": [plain_loss(loss) for loss in reader.losses],
        "notes": grouped_notes({topic["name"]: [*_notes(topic), *apart.get(topic["name"], ())] for topic in topics}),
        "vessel": vessel,
        "bundled": _bundled_matches(path, reader) if profile is None else [],
    }


def _is_small(topic: Topic) -> bool:
    """True for messages whose times are cheap to read: known layout, and no long sequence of numbers in it."""
    return bool(topic.fields) and not any(
        name.endswith("[]") and kind.startswith(_BULKY) for name, kind in topic.fields.items()
    )


def _read(
    reader: Reader, wanted: Mapping[str, Sequence[str]], *, verify: bool
) -> tuple[dict[str, Series], dict[str, str]]:
    """Read everything at once, or where one topic cannot be read, each by itself."""
    try:
        return reader.read(wanted, verify=verify), {}
    except FerryIdError:
        series: dict[str, Series] = {}
        problems: dict[str, str] = {}
        for topic, fields in wanted.items():
            try:
                series |= reader.read({topic: fields}, verify=verify)
            except FerryIdError as error:
                problems[topic] = str(error)
        return series, problems


def _timed(topic: Topic, series: Mapping[str, Series], repaired: Mapping[str, Any]) -> Topic:
    """Put first and last time of a topic that was read to those of its consistent rows."""
    if topic.name not in series:
        return topic
    receive_ns = series[topic.name].receive_ns
    _, rows, clock = repaired[topic.name]
    # Of rows on their stamps the receive time may still be a stray.
    receive_ns = receive_ns[rows] if clock.source == "receive" else receive_ns[~stray_times(receive_ns)[0]]
    if not len(receive_ns):
        return topic
    return replace(topic, start_ns=int(receive_ns.min()), end_ns=int(receive_ns.max()))


def _span(topics: Sequence[Topic]) -> tuple[int | None, int | None, dict[str, tuple[str, ...]]]:
    """Return start and end of a log [ns], and what is said of topics that neither counts.

    The one message of a topic may carry the time of what was stated long before, or none. Where it is farther from all topics
    with more than one than these last, the log does not begin or end with it.
    """
    known = [(topic, topic.start_ns, topic.end_ns) for topic in topics]
    timed = [(topic, start, end) for topic, start, end in known if start is not None and end is not None]
    several = [(start, end) for _, start, end in timed if end > start]
    if not several:
        spans = [(start, end) for _, start, end in timed]
        return min((a for a, _ in spans), default=None), max((b for _, b in spans), default=None), {}
    first, last = min(start for start, _ in several), max(end for _, end in several)
    near = [(a, b) for _, a, b in timed if a >= 2 * first - last and b <= 2 * last - first]
    apart: dict[str, tuple[str, ...]] = {
        topic.name: (
            f"its only time is {(first - end) * 1e-9:.3g} s before the others: start and duration of the log are without it"
            if end < first
            else f"its only time is {(start - last) * 1e-9:.3g} s after the others: the duration of the log is without it",
        )
        for topic, start, end in timed
        if (start, end) not in near
    }
    return min(start for start, _ in near), max(end for _, end in near), apart


def _topic(topic: Topic, clock: ClockReport | None, problems: Mapping[str, str]) -> dict[str, Any]:
    duration = (
        (topic.end_ns - topic.start_ns) * 1e-9 if topic.start_ns is not None and topic.end_ns is not None else 0.0
    )
    rate = clock.rate_hz if clock is not None else (topic.count - 1) / duration if duration > 0 else float("nan")
    why = ""
    if clock is None:
        why = problems.get(
            topic.name,
            "large messages: header stamps were not read"
            if topic.fields
            else "message layout not known: header stamps were not read",
        )
    return {
        "name": topic.name,
        "type": topic.type,
        "encoding": topic.encoding,
        "count": topic.count,
        "rate_hz": float(rate) if np.isfinite(rate) else None,
        "duration_s": duration,
        "start_ns": topic.start_ns,
        "end_ns": topic.end_ns,
        "fields": dict(topic.fields),
        "note": topic.note,
        "clock": clock.to_dict() if clock is not None else None,
        "clock_unknown": why,
    }


def _notes(topic: Mapping[str, Any]) -> list[str]:
    """What its reader and its clock say of a topic, each once."""
    clock = topic["clock"]
    told = [
        *filter(None, topic["note"].split("; ")),
        *(clock["notes"] if clock is not None else [topic["clock_unknown"]]),
    ]
    if clock is not None:
        told += clock_notes(clock["out_of_order"], clock["duplicates"])
    return list(dict.fromkeys(told))


def _vessel(
    reader: Reader,
    name: str,
    profile: Profile,
    selection: Selection,
    series: Mapping[str, Series],
    problems: Mapping[str, str],
    ranges: TimeRanges = (),
) -> dict[str, Any]:
    """What a fit with the profile makes of the log: signals with their ranges, what it leaves out, and why it refuses."""
    usable, problem = True, ""
    try:
        selected(reader, profile)
    except FerryIdError as error:
        usable, problem = False, str(error)
    streams: dict[str, Any] = {}
    told: list[str] = []
    wanted = {topic: fields for topic, fields in selection.wanted.items() if topic in series}
    if not wanted and usable:
        unread = next((problems[topic] for topic in selection.wanted if topic in problems), "")
        usable, problem = not unread, unread
    left_out: tuple[LeftOut, ...] = ()
    if wanted:
        try:
            # The clocks of the mapped topics alone, as a fit has them.
            mapped = {topic: series[topic] for topic in wanted}
            recording = make_recording(
                reader, name, profile, replace(selection, wanted=wanted), mapped, repair_all(mapped)
            )
            recording = cut(recording, profile, ranges)
            streams = {topic: stream_quality(one) for topic, one in recording.streams.items() if len(one.time_ns)}
            faults = find_faults(recording)
            told = [*selection.notes, *faults.taken_out]
            opened = track_of(recording, profile, faults=faults)
            left_out = opened.measured.left_out
            used = int(np.count_nonzero(opened.measured.usable))
            told += [*opened.doubts, *rows_left_out(left_out, used + sum(one.rows for one in left_out))]
        except RangeError:
            raise
        except FerryIdError as error:
            usable, problem = False, problem or str(error)
    return {
        "name": profile.name,
        "sha256": profile.sha256,
        "usable": usable,
        "problem": problem,
        "found": dict(selection.found),
        "missing": dict(selection.missing),
        "streams": streams,
        "left_out": [plain_left_out(one) for one in left_out],
        "remarks": list(dict.fromkeys(told)),
    }


def _bundled_matches(path: str | Path, reader: Reader) -> list[dict[str, Any]]:
    """How many of its signals every profile with a name finds in the log, best first, and whether a fit would take the log."""
    is_table = any(topic.encoding == "table" for topic in reader.topics)
    matches = []
    for name, profile in named_profiles()[0].items():
        problem, usable = "", True
        try:
            # A table is named by the profile's own layout, so that it is opened the way the profile would.
            own = open_log(path, profile.table) if is_table and profile.table is not None else reader
            found = survey(profile, own.topics, own.losses)
            select(profile, own.topics, str(path), own.losses)
        except FerryIdError:
            usable = False
            found = survey(profile, reader.topics, reader.losses)
        if usable:
            series, problems = _read(own, found.wanted, verify=False)
            judged = _vessel(own, log_name(path), profile, found, series, problems)
            usable, problem = judged["usable"], judged["problem"]
        of = len(profile.signals)
        found_signals = of - len(found.missing)
        matches.append({"name": name, "usable": usable, "found": found_signals, "signals": of, "problem": problem})
    return sorted(matches, key=lambda one: (not one["usable"], -int(str(one["found"])), str(one["name"])))


def _format_of(path: Path, reader: Reader) -> str:
    """Name of the format that takes the log's folder, or else its first file, and the number of files."""
    name = next((entry.name for entry in supported_formats() if path.is_dir() and entry.matches(path, b"")), "")
    if not name and reader.paths:
        first = reader.paths[0]
        with first.open("rb") as file:
            head = file.read(64)
        name = next((entry.name for entry in supported_formats() if entry.matches(first, head)), "")
    return f"{name}, {counted(len(reader.paths), 'file')}" if len(reader.paths) > 1 else name


def _size(path: Path) -> int:
    return path.stat().st_size


def _clock_time(time_ns: int) -> str | None:
    """A time since 1970 as ISO 8601 in UTC; None for one that is counted from the start of a log."""
    if not dated(time_ns):
        return None
    return f"{np.datetime64(time_ns, 'ns')}Z"
