"""Several files of one recording as one log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ferryid.counts import counted
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.ingest.log import Loss, Reader, Series, Topic
from ferryid.ingest.parameters import Parameter, parameters_of, together


def join(parts: Sequence[Reader]) -> Reader:
    """Return one Reader over the readers of all parts of a recording.

    Parameters
    ----------
    parts
        Opened logs, in any order. Topics are merged by name; losses keep the name of their file.
    """
    return JoinedReader(tuple(parts))


class JoinedReader:
    """The parts of one recording, read one after another and concatenated in order of start time."""

    def __init__(self, parts: tuple[Reader, ...]) -> None:
        self._parts = tuple(sorted(parts, key=_start_ns))
        _refuse_copies(self._parts)
        self.paths: tuple[Path, ...] = tuple(path for part in self._parts for path in part.paths)
        self.topics: tuple[Topic, ...] = _merged(self._parts)
        self.losses: tuple[Loss, ...] = tuple(loss for part in self._parts for loss in part.losses)

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """Parameters of all parts, one part after another."""
        return together([parameters_of(part) for part in self._parts])

    def read(self, wanted: Mapping[str, Sequence[str]], *, verify: bool = False) -> dict[str, Series]:
        """Decode the wanted fields of the wanted topics in every part.

        Raises
        ------
        FerryIdError
            For a topic or field that no part has, or a topic whose type differs between the parts.
        """
        where = " + ".join(str(path) for path in self.paths)
        known: dict[str, set[str]] = {}
        for part in self._parts:
            for topic in part.topics:
                known.setdefault(topic.name, set()).add(topic.type)
        for name in wanted:
            if name not in known:
                raise FerryIdError(
                    f"{where}: no topic {name}, found {counted(len(known), 'other')} in the parts. "
                    f"Fix: name one of them.{did_you_mean(name, known)}"
                )
            if len(types := known[name]) > 1:
                raise FerryIdError(
                    f"{where}: topic {name} cannot be read as one, found the types {', '.join(sorted(types))} "
                    "in different parts. Fix: read the parts as separate logs"
                )
        pieces: dict[str, list[Series]] = {name: [] for name in wanted}
        for part in self._parts:
            here = {topic.name for topic in part.topics}
            found = part.read({name: paths for name, paths in wanted.items() if name in here}, verify=verify)
            for name, series in found.items():
                pieces[name].append(series)
        self.losses = tuple(loss for part in self._parts for loss in part.losses)
        return {name: concatenate(series) for name, series in pieces.items()}


def concatenate(pieces: Sequence[Series]) -> Series:
    """Put series of one topic and the same columns behind one another."""
    if len(pieces) == 1:
        return pieces[0]
    stamps = [piece.stamp_ns for piece in pieces if piece.stamp_ns is not None]
    return Series(
        topic=pieces[0].topic,
        receive_ns=np.concatenate([piece.receive_ns for piece in pieces]),
        # A stamp of only some parts would leave the others without a time, so it counts only where all have one.
        stamp_ns=np.concatenate(stamps) if len(stamps) == len(pieces) else None,
        columns={path: np.concatenate([piece.columns[path] for piece in pieces]) for path in pieces[0].columns},
        time_column=pieces[0].time_column,
    )


def _refuse_copies(parts: Sequence[Reader]) -> None:
    """Refuse parts that hold the same messages, as a recording beside its copy in another format.

    Two parts of one recording never hold a topic with the same number of messages between the same two times.
    """
    seen: dict[tuple[str, int, int, int], Reader] = {}
    for part in parts:
        for topic in part.topics:
            if topic.count < 2 or topic.start_ns is None or topic.end_ns is None:
                continue
            first = seen.setdefault((topic.name, topic.count, topic.start_ns, topic.end_ns), part)
            if first is not part:
                raise FerryIdError(
                    f"{part.paths[0]}: holds the same {counted(topic.count, 'message')} of {topic.name} as "
                    f"{first.paths[0]}, so that "
                    "each would count twice. Fix: name one of them, or keep one of them in the folder"
                )


def _start_ns(part: Reader) -> tuple[int, str]:
    starts = [topic.start_ns for topic in part.topics if topic.start_ns is not None]
    # A part without messages says nothing of when it was recorded: last, by name.
    return min(starts) if starts else 2**63 - 1, str(part.paths[0])


def _merged(parts: Sequence[Reader]) -> tuple[Topic, ...]:
    merged: dict[str, Topic] = {}
    for part in parts:
        for topic in part.topics:
            have = merged.get(topic.name)
            merged[topic.name] = topic if have is None else _both(have, topic)
    return tuple(merged.values())


def _both(first: Topic, second: Topic) -> Topic:
    starts = [time for time in (first.start_ns, second.start_ns) if time is not None]
    ends = [time for time in (first.end_ns, second.end_ns) if time is not None]
    notes = [first.note] + [second.note] * (second.note != first.note)
    if second.type != first.type:
        notes.append(f"another part has {second.type}")
    return replace(
        first,
        count=first.count + second.count,
        start_ns=min(starts, default=None),
        end_ns=max(ends, default=None),
        fields=first.fields or second.fields,
        note="; ".join(note for note in notes if note),
    )
