"""MCAP: only the chunks that hold wanted messages are read, and those only as far as needed."""

from __future__ import annotations

import mmap
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from mcap.records import Channel, Schema

from ferryid.counts import counted
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.ingest import mcap_types
from ferryid.ingest.bulk import Decoder
from ferryid.ingest.checksum import crc32
from ferryid.ingest.formats.mcap import MAGIC
from ferryid.ingest.log import Loss, Reader, Series, TableLayout, Topic
from ferryid.ingest.many_rows import of_each
from ferryid.ingest.mcap_batches import batches
from ferryid.ingest.mcap_chunks import Loaded
from ferryid.ingest.mcap_index import DATA_END, RECORD_HEADER, ExcessError, Messages, record_header
from ferryid.ingest.mcap_recovery import read_index
from ferryid.ingest.mcap_spans import spans

Call = tuple[Decoder, Any, Any, Any, Any]
"""A decoder, and what its `add` takes: buffer, starts, sizes and receive times."""


@dataclass(frozen=True)
class _Group:
    """The channels of one topic that share one definition, and their decoder."""

    topic: str
    channels: tuple[int, ...]
    decoder: Decoder


class McapLog:
    """An opened MCAP file; implements `Reader`.

    Checksums: that of the summary is always checked, a chunk's whenever the chunk is read to its end: unless only an
    early part of a large compressed chunk, or less than a quarter of a large uncompressed one, is wanted. ``verify``
    checks them all, and that of the data section. Where a chunk's checksum is wrong none of its messages can be
    trusted: they are left out and counted. In a file that had to be walked and most chunks of which have a checksum, a
    chunk without one is damaged.

    Parameters
    ----------
    path
        The file.
    content
        Its bytes where they are not in the file as such (a file compressed as a whole); by default the file is mapped.
    """

    def __init__(self, path: Path, content: Any = None) -> None:
        self.paths: tuple[Path, ...] = (path,)
        self._name = str(path)
        self._file = memoryview(_mapped(path) if content is None else content)
        if bytes(self._file[: len(MAGIC)]) != MAGIC:
            raise FerryIdError(
                f"{path}: not an MCAP file, found {bytes(self._file[: len(MAGIC)])!r} at its beginning. "
                "Fix: give the recording itself"
            )
        self._bytes = np.frombuffer(self._file, np.uint8)
        try:
            self._index = read_index(self._file, self._bytes, self._name)
        except ExcessError as error:
            raise FerryIdError(
                f"{path}: the MCAP file cannot be read, {error}. Fix: take the vessel's topics out of it with mcap filter"
            ) from error
        self._topic_of = {key: channel.topic for key, channel in self._index.channels.items()}
        self._opening = tuple(self._index.losses) + self._undefined()
        self.topics: tuple[Topic, ...] = self._describe()
        self.losses: tuple[Loss, ...] = self._opening

    def _undefined(self) -> tuple[Loss, ...]:
        """Report which messages belong to channels whose definition is nowhere in the file."""
        stated = None if self._index.statistics is None else self._index.statistics.channel_message_counts
        return tuple(
            Loss(
                self._name,
                f"the definition of channel {channel} is missing, its topic is unknown",
                None,
                # What the statistics do not know may be no messages at all.
                count if not stated or channel in stated else None,
            )
            for channel, count in sorted(self._index.counts().items())
            if channel not in self._index.channels
        )

    def _schema(self, channel: Channel) -> Schema | None:
        return self._index.schemas.get(channel.schema_id) if channel.schema_id else None

    def _describe(self) -> tuple[Topic, ...]:
        counts = self._index.counts()
        extents = spans(self._index, self._file, self._index.channels)
        topics = []
        for channels in self._by_topic().values():
            described = [self._described(channel) for channel in channels]
            starts = [extents[channel.id][0] for channel in channels if channel.id in extents]
            ends = [extents[channel.id][1] for channel in channels if channel.id in extents]
            kinds = {_definition(channel, self._schema(channel)): channel for channel in channels}
            notes = [note for note in dict.fromkeys(topic.note for topic in described) if note]
            if len(kinds) > 1:
                shown = ", ".join(dict.fromkeys(f"{topic.type} ({topic.encoding})" for topic in described))
                notes.append(f"{len(kinds)} different definitions on one topic: {shown}")
            topics.append(
                replace(
                    described[0],
                    count=sum(counts.get(channel.id, 0) for channel in channels),
                    start_ns=min(starts, default=None),
                    end_ns=max(ends, default=None),
                    note="; ".join(notes),
                )
            )
        return tuple(topics)

    def _described(self, channel: Channel) -> Topic:
        schema = self._schema(channel)
        return Topic(
            name=channel.topic,
            type=mcap_types.type_name(channel, schema),
            encoding=channel.message_encoding,
            count=0,
            start_ns=None,
            end_ns=None,
            fields=mcap_types.fields_of(channel, schema, lambda: self._first(channel.id)),
            note=mcap_types.problem(channel, schema) or mcap_types.remark(channel, schema),
        )

    def _by_topic(self) -> dict[str, list[Channel]]:
        topics: dict[str, list[Channel]] = {}
        for _, channel in sorted(self._index.channels.items()):
            topics.setdefault(channel.topic, []).append(channel)
        return topics

    def _first(self, channel: int) -> bytes:
        """Return the data of one message of a channel, or nothing."""
        for loaded in self._loaded([channel], False):
            for messages in loaded.messages.values():
                start, size = int(messages.starts[0]), int(messages.sizes[0])
                return loaded.buffer[start : start + size].tobytes()
        return b""

    def read(self, wanted: Mapping[str, Sequence[str]], *, verify: bool = False) -> dict[str, Series]:
        """Decode the wanted fields of the wanted topics and nothing else; see `Reader.read`.

        Messages of a topic with several definitions come definition by definition, put in order of receive time.

        Raises
        ------
        FerryIdError
            For a topic or field that the log does not have, and for messages that cannot be decoded.
        """
        groups, losses = self._groups(wanted)
        ids = [channel for group in groups for channel in group.channels]
        found = dict.fromkeys(ids, 0)
        for loaded in self._loaded(ids, verify):
            losses += loaded.losses
            calls: list[Call] = []
            for group in groups:
                messages = _merged([loaded.messages[key] for key in group.channels if key in loaded.messages])
                if messages is not None:
                    calls.append((group.decoder, loaded.buffer, messages.starts, messages.sizes, messages.log_ns))
            _decode_together(calls)
            for key, messages in loaded.messages.items():
                found[key] += len(messages)
        if verify:
            losses += self._data_checksum()
        # Topics that are not wanted have the messages that the index or a walk over their chunks shows.
        counts = self._index.counts()
        others = {channel: counts.get(channel, 0) for channel in self._index.channels if channel not in found}
        differing = self._shortfall(found | others, losses)
        surplus = {loss.topic for loss in differing if loss.messages == 0}
        losses += differing
        pieces: dict[str, list[Series]] = {}
        for group in groups:
            pieces.setdefault(group.topic, []).append(group.decoder.finish())
            for loss in group.decoder.losses(self._name):
                # Where there are more messages than the statistics count, those that cannot be decoded may be none.
                losses.append(replace(loss, messages=None) if group.topic in surplus else loss)
        self.losses = self._opening + tuple(_joined(losses))
        return {topic: _one_series(series) for topic, series in pieces.items()}

    def _groups(self, wanted: Mapping[str, Sequence[str]]) -> tuple[list[_Group], list[Loss]]:
        topics = self._by_topic()
        counts = self._index.counts()
        groups: list[_Group] = []
        losses: list[Loss] = []
        for name, paths in wanted.items():
            if name not in topics:
                raise FerryIdError(
                    f"{self._name}: no topic {name}, found {', '.join(list(topics)[:8]) or 'none'}. "
                    f"Fix: name one of its topics.{did_you_mean(name, topics)}"
                )
            kinds: dict[Any, list[Channel]] = {}
            for channel in topics[name]:
                kinds.setdefault(_definition(channel, self._schema(channel)), []).append(channel)
            faults: list[FerryIdError] = []
            made = len(groups)
            for channels in kinds.values():
                capacity = sum(counts.get(channel.id, 0) for channel in channels)
                try:
                    decoder, note = mcap_types.decoder_of(
                        channels[0], self._schema(channels[0]), paths, capacity, self._name
                    )
                except FerryIdError as error:
                    faults.append(error)
                    kind = mcap_types.type_name(channels[0], self._schema(channels[0])) or "unknown type"
                    what = f"messages of a second definition ({kind}) of the topic lack the wanted fields"
                    losses.append(Loss(self._name, what, name, capacity))
                else:
                    if note:
                        losses.append(Loss(self._name, note, name, 0))
                    groups.append(_Group(name, tuple(channel.id for channel in channels), decoder))
            if len(groups) == made:
                raise faults[0]
        return groups, losses

    def _loaded(self, ids: Collection[int], verify: bool) -> Iterator[Loaded]:
        """Yield the wanted messages in file order; when verifying, what is lost of all others too."""
        wanted = frozenset(ids)
        counted = frozenset(self._index.channels) if verify else wanted
        for loaded in batches(self._file, self._bytes, self._index, counted, self._name, self._topic_of, verify):
            messages = {channel: rows for channel, rows in loaded.messages.items() if channel in wanted}
            yield replace(loaded, messages=messages)

    def _data_checksum(self) -> list[Loss]:
        """Check the checksum of everything before the DataEnd record, where the writer made one."""
        end = self._index.data_end
        # A DataEnd record closes the data section: just before the summary, or where the walk found it.
        at = end if end < len(self._file) and self._file[end] == DATA_END else end - RECORD_HEADER - 4
        if at < len(MAGIC):
            return []
        opcode, size = record_header(self._file, at)
        if opcode == DATA_END and size != 4 and at == end:
            # A record whose first byte was turned into that of a DataEnd looks like the end of all data.
            return [Loss(self._name, "the record that closes the data is damaged: what stands after it is not read")]
        if (opcode, size) != (DATA_END, 4):
            return []
        crc = int.from_bytes(self._file[at + RECORD_HEADER : at + RECORD_HEADER + 4], "little")
        if crc == 0 or crc32(self._file[:at]) == crc:
            return []
        return [Loss(self._name, "the checksum of the whole data section is wrong: a part of the file is damaged")]

    def _shortfall(self, found: Mapping[int, int], losses: Sequence[Loss]) -> list[Loss]:
        """Report where the statistics do not count the messages that were found or reported as lost.

        Messages that they count beyond those are only counted as lost where damage was found that may have held them;
        otherwise the statistics may as well be wrong.
        """
        if self._index.statistics is None or self._index.complete:
            return []
        known = [*self._opening, *losses]
        damaged = any(loss.messages is None for loss in known)
        reported: dict[str | None, int] = {}
        for loss in known:
            reported[loss.topic] = reported.get(loss.topic, 0) + (loss.messages or 0)
        differences: dict[str, int] = {}
        for channel, count in found.items():
            stated = self._index.statistics.channel_message_counts.get(channel, 0)
            topic = self._topic_of[channel]
            differences[topic] = differences.get(topic, 0) + stated - count
        short = []
        for topic, difference in differences.items():
            missing = difference - reported.get(topic, 0)
            # Messages lost from an unknown topic may be of this one.
            explained = min(max(missing, 0), reported.get(None, 0))
            reported[None] = reported.get(None, 0) - explained
            missing -= explained
            if missing > 0:
                what = f"the file's own statistics count {counted(missing, 'message')} more than are in it"
                short.append(Loss(self._name, what, topic, missing if damaged else None))
            elif difference < 0:
                what = f"the file's own statistics count {counted(-difference, 'message')} fewer than are in it"
                short.append(Loss(self._name, what, topic, 0))
        return short


def _mapped(path: Path) -> mmap.mmap:
    with path.open("rb") as file:
        return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)


def _definition(channel: Channel, schema: Schema | None) -> tuple[Any, ...]:
    """Return what makes two channels of a topic decodable as one."""
    if schema is None:
        return channel.message_encoding, channel.schema_id
    return channel.message_encoding, schema.name, schema.encoding, schema.data


def _decode_together(calls: Sequence[Call]) -> None:
    """Let every decoder take its messages of one batch; each is named once."""

    def decode(call: Call) -> None:
        decoder, *rest = call
        decoder.add(*rest)

    of_each(decode, calls, sum(len(starts) for _, _, starts, _, _ in calls))


def _merged(parts: Sequence[Messages]) -> Messages | None:
    """Put the messages of several channels into file order."""
    if len(parts) < 2:
        return parts[0] if parts else None
    starts = np.concatenate([part.starts for part in parts])
    order = np.argsort(starts, kind="stable")
    return Messages(
        starts[order],
        np.concatenate([part.sizes for part in parts])[order],
        np.concatenate([part.channels for part in parts])[order],
        np.concatenate([part.log_ns for part in parts])[order],
    )


def _one_series(pieces: Sequence[Series]) -> Series:
    """Put the series of a topic's several definitions into order of receive time."""
    if len(pieces) == 1:
        return pieces[0]
    receive = np.concatenate([piece.receive_ns for piece in pieces])
    order = np.argsort(receive, kind="stable")
    stamps = [piece.stamp_ns for piece in pieces if piece.stamp_ns is not None]
    return Series(
        topic=pieces[0].topic,
        receive_ns=receive[order],
        stamp_ns=np.concatenate(stamps)[order] if len(stamps) == len(pieces) else None,
        columns={path: np.concatenate([piece.columns[path] for piece in pieces])[order] for path in pieces[0].columns},
    )


def _joined(losses: Sequence[Loss]) -> list[Loss]:
    """Make one loss of neighbouring ones of the same kind, so that not every one of many bad chunks is reported."""
    joined: list[Loss] = []
    last: dict[tuple[str | None, str], int] = {}
    for loss in losses:
        key = loss.topic, loss.what
        place = last.get(key)
        if place is None or loss.start_ns is None or joined[place].end_ns is None:
            last[key] = len(joined)
            joined.append(loss)
            continue
        before = joined[place]
        counts = (before.messages, loss.messages)
        joined[place] = replace(
            before,
            messages=None if counts[0] is None or counts[1] is None else counts[0] + counts[1],
            start_ns=None if before.start_ns is None else min(before.start_ns, loss.start_ns),
            end_ns=None if before.end_ns is None or loss.end_ns is None else max(before.end_ns, loss.end_ns),
            lost_ns=_both_ns(before, loss),
        )
    return joined


def _both_ns(first: Loss, second: Loss) -> int | None:
    """Return how long two lost stretches are together [ns], None where that is not known."""
    lengths = [first.length_ns, second.length_ns]
    return None if None in lengths else sum(length for length in lengths if length is not None)


def open_mcap(path: Path, layout: TableLayout | None = None, *, content: Any = None) -> Reader:
    """Open an MCAP file.

    Parameters
    ----------
    path
        The file; `layout` is for tables and ignored.
    content
        The file's bytes, where `path` holds them compressed as a whole.

    Raises
    ------
    FerryIdError
        For a file that is not MCAP.
    """
    return McapLog(Path(path), content)
