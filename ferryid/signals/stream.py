"""The signals of a log before they share a grid: one stream per topic, and the recording that holds them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ferryid.counts import counted
from ferryid.ingest.clocks import ClockReport
from ferryid.ingest.log import Loss, Topic
from ferryid.ingest.tables import columns_named
from ferryid.types import Floats, Nanoseconds
from ferryid.vessel.thrusters import ROLE_PREFIX


@dataclass(frozen=True)
class Stream:
    """The signals of one topic at its own rate.

    Attributes
    ----------
    topic
        Topic name.
    time_ns
        Strictly rising times on the log's one time base [ns], shape (n,).
    columns
        Canonical signal name to values in SI units (rpm for propeller speeds), float64, shape (n,).
    clock
        How the times came about.
    receive_ns
        Receive times of the same rows [ns], shape (n,); `time_ns` itself where the topic is on the receive clock.
    """

    topic: str
    time_ns: Nanoseconds
    columns: Mapping[str, Floats]
    clock: ClockReport
    receive_ns: Nanoseconds


@dataclass(frozen=True)
class Recording:
    """The mapped signals of one log, each topic at its own rate, with everything that was found out about them.

    Attributes
    ----------
    name
        Name of the log: its file or folder without the suffix.
    files
        Path of every file read.
    sha256
        Content hash (``sampled-sha256:...`` for files over 1 GiB that were not verified).
    profile_name, profile_sha256
        The vessel profile that mapped the signals.
    streams
        Topic name to its signals.
    topics
        All topics of the log, mapped or not.
    losses
        What could not be read.
    found
        Canonical signal to ``"topic: field"``.
    missing
        Quantity of the profile to the reason why this log does not give it.
    notes
        Sentences for the user about the log as a whole.
    """

    name: str
    files: tuple[str, ...]
    sha256: str
    profile_name: str
    profile_sha256: str
    streams: Mapping[str, Stream]
    topics: tuple[Topic, ...]
    losses: tuple[Loss, ...]
    found: Mapping[str, str]
    missing: Mapping[str, str]
    notes: tuple[str, ...]

    @property
    def orders_for_feedback(self) -> tuple[str, ...]:
        """Sentences on actuators whose mapped feedback is not in the log, so that their orders are used."""
        sentences = []
        for quantity, reason in self.missing.items():
            actuator, _, role = quantity.partition(".")
            if role in ROLE_PREFIX and f"{ROLE_PREFIX[role]}_cmd_{actuator}" in self.found:
                sentences.append(
                    f"{quantity}: the order is used, as the feedback is not in the log ({reason.rstrip('.')}); it is taken "
                    "as followed at once where the profile states no time constant."
                )
        return tuple(sentences)

    @property
    def repeated_columns(self) -> tuple[str, ...]:
        """Sentences on mapped columns of a table of which its file has several by that name."""
        tables = {topic.name: topic for topic in self.topics if topic.encoding == "table"}
        mapped = [found.partition(": ") for found in self.found.values()]
        columns = {(table, name) for table, _, names in mapped if table in tables for name in names.split(", ")}
        several = {name: columns_named(tables[table], name) for table, name in sorted(columns)}
        return tuple(
            f'{counted(count, "column")} are named "{name}": the first is used.'
            for name, count in several.items()
            if count > 1
        )

    @property
    def start_ns(self) -> int:
        """First time of any stream [ns]."""
        return min(int(stream.time_ns[0]) for stream in self.streams.values() if len(stream.time_ns))

    @property
    def end_ns(self) -> int:
        """Last time of any stream [ns]."""
        return max(int(stream.time_ns[-1]) for stream in self.streams.values() if len(stream.time_ns))


POSE_AND_VELOCITY = ("x", "y", "psi", "u", "v", "vel_N", "vel_E")
"""Signals that show which recording this is, and whether it is one of a vessel."""


def compact(recording: Recording) -> Recording:
    """Return a recording with the samples of `POSE_AND_VELOCITY` alone, and of the other topics the first and last time.

    Times of reception are not kept.
    """
    streams = {}
    for topic, stream in recording.streams.items():
        columns = {name: stream.columns[name] for name in POSE_AND_VELOCITY if name in stream.columns}
        time_ns = stream.time_ns if columns else np.concatenate([stream.time_ns[:1], stream.time_ns[1:][-1:]])
        streams[topic] = replace(stream, time_ns=time_ns, columns=columns, receive_ns=time_ns)
    return replace(recording, streams=streams)
