"""Everything that is wrong with the signals of one recording, found once for `inspect`, fits and diagnoses alike."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ferryid.signals.pose_limits import Samples
from ferryid.signals.poses import USED, PoseFault, pose_faults, pose_reason, pose_sentences
from ferryid.signals.quality import is_load
from ferryid.signals.source import Held, Source, sources_of
from ferryid.signals.stream import Recording, Stream
from ferryid.signals.thresholds import SIGNALS
from ferryid.signals.velocities import held_reason, held_sentences, held_velocities

_SIGNALS = {"position": ("x", "y"), "heading": ("psi",)}


@dataclass(frozen=True)
class Faults:
    """Cleaned streams, and what was taken out of them.

    Attributes
    ----------
    sources
        Streams without the samples that are wrong; poses that cannot be true are still in them.
    poses
        Poses that cannot be true.
    held
        Stretches in which signals repeat an old value.
    taken_out
        What is left out or interpolated, as sentences with numbers.
    remarks
        What else was found, and how each stream is bridged, as sentences.
    """

    sources: tuple[Source, ...]
    poses: tuple[PoseFault, ...]
    held: tuple[Held, ...]
    taken_out: tuple[str, ...]
    remarks: tuple[str, ...]

    @property
    def repeats(self) -> tuple[Held, ...]:
        """Return the stretches in which an old value was repeated, those of poses among them, without a margin."""
        poses = [one for one in self.poses if one.kind == "held"]
        return (
            *(one for one in self.held if one.repeats),
            *(Held(_SIGNALS[one.signal], one.start_ns, one.end_ns, pose_reason(one), True) for one in poses),
        )

    def wrong_poses(self) -> tuple[Held, ...]:
        """Return the stretches around wrong poses, `SIGNALS.pose_margin_s` on either side, with their signals and reasons."""
        margin_ns = round(SIGNALS.pose_margin_s * 1e9)
        return tuple(
            Held(_SIGNALS[one.signal], one.start_ns - margin_ns, one.end_ns + margin_ns, pose_reason(one))
            for one in self.poses
            if one.left_out
        )


def find_faults(recording: Recording) -> Faults:
    """Clean every stream of a recording, and find poses that cannot be true and velocities that stay at one value."""
    sources = [one for stream in recording.streams.values() if _enough(stream) for one in sources_of(stream)]
    samples: Samples = {name: (s.time_ns, s.columns[name]) for s in sources for name in USED if name in s.columns}
    poses = pose_faults(samples)
    velocities = held_velocities(samples, poses)
    held = [one for source in sources for one in source.held]
    for one in velocities:
        held.append(Held((one.signal,), one.start_ns, one.end_ns, held_reason(one), one.value != 0.0))
        k = next(k for k, source in enumerate(sources) if one.signal in source.columns)
        values = sources[k].columns[one.signal].copy()
        values[one.first : one.last + 1] = np.nan
        sources[k] = replace(sources[k], columns={**sources[k].columns, one.signal: values})
    taken_out = [said for source in sources for said in source.taken_out]
    taken_out += [*held_sentences(velocities, samples), *pose_sentences(poses)]
    remarks = [said for source in sources for said in source.remarks]
    return Faults(tuple(sources), poses, tuple(held), tuple(taken_out), tuple(remarks))


def _enough(stream: Stream) -> bool:
    """One message is enough for what holds until the next: a payload that was weighed once."""
    return len(stream.time_ns) > 1 or (len(stream.time_ns) == 1 and all(is_load(name) for name in stream.columns))
