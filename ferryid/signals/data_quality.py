"""What is known about the quality of one recording, as plain data for `inspect`, models and reports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from ferryid.counts import counted, verb
from ferryid.ingest.log import Loss
from ferryid.json_record import Number, Record, json_key
from ferryid.signals.parquet import unit_of
from ferryid.signals.quality import clean
from ferryid.signals.stream import Recording, Stream
from ferryid.signals.time_ranges import USED
from ferryid.signals.track import LeftOut, Motion, Track
from ferryid.types import Flags


def data_quality(recording: Recording, track: Track | Motion | None = None) -> dict[str, Any]:
    """Collect clocks, losses, and findings on every signal of a recording.

    Parameters
    ----------
    recording
        Signals at their own rates.
    track
        What was made of them, whose repairs are told as well.

    Returns
    -------
    dict
        For JSON: ``files``, ``sha256``, ``profile``, ``profile_sha256``, ``duration_s``, ``streams`` (topic to ``clock``
        and ``signals``), ``losses``, ``found``, ``missing``, ``left_out`` (rows that are not used: ``reason``, ``rows``,
        ``stretches``, ``seconds`` and ``intervals``, each with ``start_s`` and ``end_s`` from the first row that is used,
        ``signals`` and ``reason``) and ``remarks`` (sentences: all of it for a person).
    """
    streams = {topic: stream_quality(stream) for topic, stream in recording.streams.items()}
    return {
        "files": list(recording.files),
        "sha256": recording.sha256,
        "profile": recording.profile_name,
        "profile_sha256": recording.profile_sha256,
        "duration_s": (recording.end_ns - recording.start_ns) * 1e-9,
        "streams": streams,
        "losses": [plain_loss(loss) for loss in recording.losses],
        "found": dict(recording.found),
        "missing": dict(recording.missing),
        "left_out": [plain_left_out(one) for one in track.left_out] if track is not None else [],
        "remarks": remarks(recording, track.repairs if track is not None else ()),
    }


def stream_quality(stream: Stream) -> dict[str, Any]:
    """Return the clock of one stream and, per signal, its range and its missing, held and implausible samples."""
    time_s = np.asarray((stream.time_ns - stream.time_ns[:1]) * 1e-9, dtype=np.float64)
    signals = {}
    for name, values in stream.columns.items():
        _, found = clean(name, time_s, values)
        finite = values[np.isfinite(values)]
        signals[name] = {
            "unit": unit_of(name),
            "minimum": float(finite.min()) if len(finite) else None,
            "maximum": float(finite.max()) if len(finite) else None,
            **{key: value for key, value in asdict(found).items() if key != "name"},
        }
    return {"clock": stream.clock.to_dict(), "signals": signals}


def remarks(recording: Recording, repairs: Sequence[str] = ()) -> list[str]:
    """Return everything a user should know of a recording as sentences, losses first, each once."""
    told = [f"Lost: {loss_sentence(loss)}" for loss in recording.losses if loss.costs_messages]
    told += [loss_sentence(loss) for loss in recording.losses if not loss.costs_messages]
    told += recording.notes
    told += grouped_notes({topic: stream.clock.notes for topic, stream in recording.streams.items()})
    for topic, stream in recording.streams.items():
        told += [f"{topic}: {counted}" for counted in _counted(stream)]
    told += [f"{quantity} is missing: {reason}" for quantity, reason in recording.missing.items()]
    told += repairs
    return list(dict.fromkeys(told))


_NO_REPAIR = ("no header", "times are those", "time guessed", "receive times are used")
"""How notes on times begin that state which times are used, and nothing that was repaired."""


def repair_sentences(recording: Recording, taken_out: Sequence[str]) -> tuple[str, ...]:
    """Return what was repaired of a log while it was read and aligned, as sentences, each once.

    Parameters
    ----------
    recording
        Signals at their own rates.
    taken_out
        Samples that were taken out or interpolated: of `ferryid.signals.faults.find_faults`.
    """
    told = [loss_sentence(loss) for loss in recording.losses if not loss.costs_messages]
    read = {one.name: one.note.split("; ") for one in recording.topics if one.name in recording.streams}
    noted = {}
    for topic, stream in recording.streams.items():
        clock = stream.clock
        notes = [*read.get(topic, ()), *clock.notes, *_of_clock(stream), *clock_notes(clock.out_of_order, 0)]
        noted[topic] = [note for note in notes if note and not note.startswith(_NO_REPAIR)]
    return tuple(dict.fromkeys((*told, *grouped_notes(noted), *taken_out)))


def left_out_sentences(recording: Recording, left_out: Sequence[LeftOut], used: Flags) -> tuple[str, ...]:
    """Return what of a log could not be read, and which rows are not used because of times, gaps or faults, as sentences.

    `used` are flags of the rows that are, shape (n,).
    """
    said = [note for note in recording.notes if note.startswith(USED)]
    said += unread(recording.losses)
    said += grouped_notes({topic: _of_clock(stream) for topic, stream in recording.streams.items()})
    said += rows_left_out(left_out, max(used.size, _rows(left_out) + int(np.count_nonzero(used))))
    return tuple(said)


def rows_left_out(left_out: Sequence[LeftOut], total: int) -> tuple[str, ...]:
    """Return in one sentence which of `total` rows are not used and why; nothing where all are."""
    if not left_out:
        return ()
    reasons = "; ".join(
        f"{one.rows} ({one.seconds:.1f} s in {counted(one.stretches, 'stretch')}) because {one.reason}"
        for one in left_out
    )
    rows, seconds = _rows(left_out), sum(one.seconds for one in left_out)
    return (f"{rows} of {counted(total, 'row')} ({seconds:.1f} s) {verb(rows, 'is')} left out: {reasons}.",)


def _rows(left_out: Sequence[LeftOut]) -> int:
    """Rows cut from the ends of a track count as well."""
    return sum(one.rows for one in left_out)


def plain_left_out(one: LeftOut) -> dict[str, Any]:
    """Return rows that are left out for JSON."""
    return {**asdict(one), "intervals": [{**asdict(span), "signals": [*span.signals]} for span in one.intervals]}


@dataclass(frozen=True)
class LostData(Record):
    """What was lost of a log, and what of the rest is not used.

    Attributes
    ----------
    messages, seconds
        Messages and time [s] that are known to be lost.
    unknown
        Whether more may be.
    rows_left_out, seconds_left_out
        Rows that are not used, and their length [s].
    sentences
        All of it.
    """

    messages: int
    seconds: Number
    unknown: bool
    rows_left_out: int
    seconds_left_out: Number
    sentences: tuple[str, ...] = field(metadata=json_key("says"))

    @classmethod
    def of(cls, losses: Sequence[Loss], left_out: Sequence[LeftOut], total: int) -> LostData:
        """Return what was lost, from what could not be read, the rows that are not used, and how many rows there are."""
        return cls(
            messages=sum(loss.messages or 0 for loss in losses),
            seconds=sum(loss.seconds or 0.0 for loss in losses),
            unknown=any(loss.messages is None for loss in losses),
            rows_left_out=_rows(left_out),
            seconds_left_out=float(sum(one.seconds for one in left_out)),
            sentences=(*(f"Lost: {loss_sentence(loss)}" for loss in losses), *rows_left_out(left_out, total)),
        )


def unread(losses: Sequence[Loss]) -> tuple[str, ...]:
    """Return in one sentence what could not be read in all, and the largest or least certain part of it."""
    if not losses:
        return ()
    # What was repaired is counted where nothing else was wrong: it is a remark, and no loss.
    losses = [loss for loss in losses if loss.costs_messages] or losses
    count, unknown = sum(loss.messages or 0 for loss in losses), any(loss.messages is None for loss in losses)
    if count:
        what = f"{counted(count, 'message')} could not be read" + (", and perhaps more" if unknown else "")
    else:
        what = "messages may be lost" if unknown else "no message is known to be lost"
    others = len(losses) - 1
    rest = f"; and {counted(others, 'more loss')}, see ferryid inspect." if others else "."
    return (f"{what}: {loss_sentence(main_loss(losses))[:-1]}{rest}",)


def main_loss(losses: Sequence[Loss]) -> Loss:
    """Return the largest of the losses, or the least certain where none is known to have cost a message.

    Of several that are uncertain, all that is behind a time is more than a stretch that ends.
    """

    def size(loss: Loss) -> tuple[int, bool, bool, float]:
        endless = loss.start_ns is not None and loss.end_ns is None
        return loss.messages or 0, loss.messages is None, endless, loss.seconds or 0.0

    return max(losses, key=size)


_DROPPED = (
    ("strays", "their times contradict those of the rows around", "its time contradicts those of the rows around"),
    ("duplicates", "they repeat the time of another", "it repeats the time of another"),
    ("far", "they are from before or after the clock was set", "it is from before or after the clock was set"),
)


def dropped_rows(clocks: Sequence[Mapping[str, Any]]) -> dict[str, int]:
    """Return how many rows of some topics are left out because of their times, by the reason; only those above zero.

    Parameters
    ----------
    clocks
        As `ferryid.ingest.clocks.ClockReport.to_dict` gives them.
    """
    sums = {name: sum(int(clock[name]) for clock in clocks) for name in ("dropped", "strays", "duplicates")}
    counts = {**sums, "far": sums["dropped"] - sums["strays"] - sums["duplicates"]}
    return {(one if counts[name] == 1 else many): counts[name] for name, many, one in _DROPPED if counts[name] > 0}


def _of_clock(stream: Stream) -> list[str]:
    clock = stream.clock
    said = [
        f"{count} of {counted(clock.count + clock.dropped, 'row')} {verb(count, 'is')} left out: {why}"
        for why, count in dropped_rows([clock.to_dict()]).items()
    ]
    if clock.replaced:
        said.append(
            f"{clock.replaced} of {counted(clock.count, 'row')} had a senseless stamp and {verb(clock.replaced, 'is')} put "
            f"at {'its' if clock.replaced == 1 else 'their'} receive time"
        )
    return said


def _counted(stream: Stream) -> list[str]:
    clock = stream.clock
    told = [f"{one}." for one in clock_notes(clock.out_of_order, clock.duplicates)]
    if clock.gaps:
        lengths = [(end - start) * 1e-9 for start, end in clock.gaps]
        told.append(
            f"{counted(len(lengths), 'gap')} in the recording, the longest {max(lengths):.2f} s, {sum(lengths):.1f} s in all."
        )
    return told


def clock_notes(out_of_order: int, duplicates: int) -> list[str]:
    """Return what was done with the rows of a topic that were not in order or had the time of another."""
    told = []
    if out_of_order:
        told.append(f"{counted(out_of_order, 'row')} out of order {verb(out_of_order, 'was')} sorted into place")
    if duplicates:
        told.append(
            f"{counted(duplicates, 'row')} {verb(duplicates, 'repeats')} the time of another and "
            f"{verb(duplicates, 'was')} left out"
        )
    return told


def grouped_notes(notes: Mapping[str, Sequence[str]]) -> list[str]:
    """Join the same note on several topics to one sentence that names at most three of them."""
    topics: dict[str, list[str]] = {}
    for topic, sentences in notes.items():
        for sentence in sentences:
            topics.setdefault(sentence, []).append(topic)
    told = []
    for sentence, names in topics.items():
        told.append(f"{named(names)}: {sentence}.")
    return told


def named(topics: Sequence[str]) -> str:
    """Name at most three topics, and count the others."""
    return ", ".join(topics[:3]) + (f" and {len(topics) - 3} more" if len(topics) > 3 else "")


def plain_loss(loss: Loss) -> dict[str, Any]:
    """Return a loss for JSON, its length in seconds added."""
    return {**asdict(loss), "seconds": loss.seconds}


def loss_sentence(loss: Loss) -> str:
    """Return a loss as one sentence: file, topic, what, how many messages and seconds."""
    name = loss.file.rpartition("/")[2]
    topic = f" {loss.topic}" if loss.topic else ""
    amount = [counted(loss.messages, "message") if loss.messages else "", ""]
    if loss.seconds is not None:
        amount[1] = f"{loss.seconds:.3f} s"
    size = ", ".join(part for part in amount if part)
    return f"{name}{topic}: {loss.what.rstrip('.')}" + (f" ({size})." if size else ".")
