"""From a log to SI signals per topic: open, select, read, put on one clock, convert; cached as Parquet."""

from __future__ import annotations

import re
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

from ferryid.counts import counted, verb
from ferryid.errors import FerryIdError
from ferryid.files import exists, resolved
from ferryid.ingest import log_suffixes, open_log
from ferryid.ingest.clocks import ClockReport, Rows, repair_all
from ferryid.ingest.hashing import content_hash
from ferryid.ingest.log import Reader, Series, Topic
from ferryid.ingest.many_rows import of_each
from ferryid.signals import cache
from ferryid.signals.data_quality import data_quality, grouped_notes, loss_sentence, main_loss
from ferryid.signals.empty_streams import without_empty
from ferryid.signals.stream import Recording, Stream
from ferryid.signals.time_ranges import cut
from ferryid.types import Nanoseconds, TimeRanges
from ferryid.vessel.profile import Profile
from ferryid.vessel.signal_map import Selection, convert, select, stream_name

__all__ = ["Recording", "Stream", "data_quality", "log_name", "make_recording", "name_of", "read_recording", "record"]


def record(
    path: str | Path, profile: Profile, out: Path | None = None, *, verify: bool = False, ranges: TimeRanges = ()
) -> Recording:
    """Read the signals that a profile maps from one log.

    Parameters
    ----------
    path
        Log in any supported format; parts of one recording joined by ``+``.
    profile
        Vessel profile.
    out
        Output folder. With it the result is kept as Parquet under ``out/logs`` and taken from there as long as log,
        profile and ferryid version are unchanged.
    verify
        Read the whole log, check every checksum and hash every byte, also of what is not mapped.
    ranges
        What of the log is used, all of it where empty: see `ferryid.signals.time_ranges`. Kept is the whole log.

    Raises
    ------
    FerryIdError
        For a log that cannot be used: no known format, a required signal that it lacks, no row, a range outside it, an
        unwritable `out`.
    """
    return cut(_whole(path, profile, out, verify=verify), profile, ranges)


def _whole(path: str | Path, profile: Profile, out: Path | None, *, verify: bool) -> Recording:
    name = log_name(path)
    damage: cache.Damage = {}
    if out is not None and exists(path) and Path(path).is_file():
        kept = cache.by_files(out, name, [Path(path)], profile, damage, verify=verify)
        if kept is not None:
            return kept
    reader = open_log(path, profile.table)
    if out is not None:
        kept = cache.by_files(out, name, reader.paths, profile, damage, verify=verify)
        if kept is not None:
            return kept
    with ThreadPoolExecutor(1) as pool:
        hashing: Future[str] = pool.submit(content_hash, reader.paths, verify=verify)
        if out is not None and cache.has_any(out, name, profile):
            kept = cache.by_content(out, name, hashing.result(), reader.paths, profile, damage, verify=verify)
            if kept is not None:
                return kept
        signatures = cache.signatures(reader.paths)
        recording = replace(read_recording(reader, name, profile, verify=verify), sha256=hashing.result())
    if out is not None:
        folder = cache.store(out, recording, signatures, verify=verify)
        if folder in damage:
            said = f"the cached tables of the log in {folder.name} were damaged ({damage[folder]}): read from the log again."
            recording = replace(recording, notes=(*recording.notes, said))
    return recording


def read_recording(reader: Reader, name: str, profile: Profile, *, verify: bool = False) -> Recording:
    """Decode, put on one clock and convert what a profile maps in an opened log; its hash is left empty.

    Raises
    ------
    FerryIdError
        As `record`.
    """
    selection = selected(reader, profile)
    series = reader.read(selection.wanted, verify=verify)
    return make_recording(reader, name, profile, selection, series, repair_all(series))


def selected(reader: Reader, profile: Profile) -> Selection:
    """Find the profile's signals in an opened log.

    Raises
    ------
    FerryIdError
        For a log without a single message, and for a required signal that it does not have.
    """
    if not any(topic.count for topic in reader.topics):
        there = f"{counted(len(reader.topics), 'topic')} and no message"
        if reader.losses:
            raise FerryIdError(
                f"{name_of(reader)}: the log holds no data that can be read, found {there}: "
                f"{loss_sentence(main_loss(reader.losses)).removesuffix('.')}. Fix: copy it from the recorder again"
            )
        raise FerryIdError(
            f"{name_of(reader)}: the log holds no data, found {there} in a complete file. "
            "Fix: pass a log that was recorded while the topics were published"
        )
    return select(profile, reader.topics, name_of(reader), reader.losses)


def make_recording(
    reader: Reader,
    name: str,
    profile: Profile,
    selection: Selection,
    series: Mapping[str, Series],
    repaired: Mapping[str, tuple[Nanoseconds, Rows, ClockReport]],
) -> Recording:
    """Convert decoded and repaired series to a recording; its hash is left empty.

    Raises
    ------
    FerryIdError
        Where no mapped topic has a row, or a field is not what the profile says.
    """
    wanted = [(topic, where) for topic in selection.wanted for where in _choices(profile, topic, selection)]
    converted = of_each(
        lambda one: _stream(profile, series[one[0]], *repaired[one[0]], one[1]),
        wanted,
        sum(len(series[topic].receive_ns) for topic, _ in wanted),
    )
    streams = {stream_name(*one): stream for one, stream in zip(wanted, converted, strict=True)}
    chosen = any(signal.where for signal in profile.signals)
    if not any(len(stream.time_ns) for stream in streams.values()):
        raise FerryIdError(
            f"{name_of(reader)}: none of the mapped topics holds a row, looked at {', '.join(sorted(streams))}. "
            "Fix: pass a log that was recorded with these topics running"
        )
    whole = Recording(
        name=name,
        files=tuple(str(path) for path in reader.paths),
        sha256="",
        profile_name=profile.name,
        profile_sha256=profile.sha256,
        streams=streams,
        topics=reader.topics,
        losses=reader.losses,
        found=dict(selection.found),
        missing=dict(selection.missing),
        notes=_log_notes(streams, selection, reader.topics),
    )
    return without_empty(whole, profile, "", "correct where in the signal map") if chosen else whole


def _choices(profile: Profile, topic: str, selection: Selection) -> list[tuple[tuple[str, float], ...]]:
    """Return by what the messages of a topic are chosen, each once; that they are not is one of it.

    A choice by a field that the topic does not have belongs to signals that are missing: it was not decoded.
    """
    bare = topic.strip("/")
    return list(
        dict.fromkeys(
            signal.where
            for signal in profile.signals
            if signal.topic.strip("/") == bare and signal.quantity not in selection.missing
        )
    )


def _stream(
    profile: Profile,
    series: Series,
    time_ns: Nanoseconds,
    rows: Rows,
    clock: ClockReport,
    where: tuple[tuple[str, float], ...],
) -> Stream:
    if where:
        kept = np.all([series.columns[path][rows] == value for path, value in where], axis=0)
        time_ns, rows = time_ns[kept], rows[kept]
        clock = replace(clock, count=len(rows), rate_hz=clock.rate_hz * len(rows) / max(len(kept), 1), gaps=())
    if clock.dropped or clock.out_of_order or where:
        # Only now are rows copied: nearly every topic is in order and keeps its arrays.
        columns = {path: values[rows] for path, values in series.columns.items()}
        series = Series(series.topic, series.receive_ns[rows], None, columns)
    receive_ns = time_ns if clock.source == "receive" else series.receive_ns
    return Stream(stream_name(series.topic, where), time_ns, convert(profile, series, where), clock, receive_ns)


def _log_notes(streams: Mapping[str, Stream], selection: Selection, topics: tuple[Topic, ...]) -> tuple[str, ...]:
    """What concerns several topics at once, and what their reader repaired."""
    notes = [*selection.notes]
    # Which topics have a header is told with their clocks.
    told = {
        one.name: [note for note in one.note.split("; ") if note and not note.startswith("no header")] for one in topics
    }
    notes += grouped_notes({topic: told[topic] for topic in streams if topic in told})
    stamped = sorted(topic for topic, stream in streams.items() if stream.clock.source == "stamp")
    received = sorted(topic for topic, stream in streams.items() if stream.clock.source == "receive")
    if stamped and received:
        notes.append(
            f"{counted(len(stamped), 'topic')} {verb(len(stamped), 'is')} on senders' stamps and "
            f"{len(received)} on receive times "
            f"({', '.join(received)}): the latter are later by their unknown latency"
        )
    elif received and not all(topic.encoding == "table" for topic in topics):
        notes.append("all topics are on receive times")
    return tuple(notes)


def log_name(path: str | Path) -> str:
    """Name of a log for folders and reports: file or folder name without suffixes, parts counted."""
    text = str(path)
    first, _, more = text.partition("+") if not exists(text) else (text, "", "")
    file = resolved(first)
    stem = file.stem if file.suffix in {Path(f"_{suffix}").suffix for suffix in log_suffixes()} else file.name
    clean = re.sub(r"[^A-Za-z0-9._-]+", "_", stem).strip("._") or "log"
    return f"{clean}-and-{more.count('+') + 1}-more" if more else clean


def name_of(reader: Reader) -> str:
    """The file of a log, or the first of several and how many more, for messages."""
    paths = [str(path) for path in reader.paths]
    if not paths:
        return "log"
    return paths[0] if len(paths) == 1 else f"{paths[0]} (and {len(paths) - 1} more)"
