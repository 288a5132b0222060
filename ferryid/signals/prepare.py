"""From a log on disk to smoothed motion: the first half of every command."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.cached import cached_property
from ferryid.errors import ContradictionError
from ferryid.signals.align import align
from ferryid.signals.artificial import NO_RECORDING, artificial
from ferryid.signals.data_quality import left_out_sentences
from ferryid.signals.faults import Faults
from ferryid.signals.quality import POSE
from ferryid.signals.recording import Recording, data_quality, record
from ferryid.signals.sampling import check_grid, check_sampling
from ferryid.signals.smooth import ON_FEW_ROWS, Measured, measure, smooth_measured
from ferryid.signals.thresholds import SIGNALS
from ferryid.signals.track import Motion, Track
from ferryid.types import TimeRanges
from ferryid.vessel import SWAY_NOT_MEASURED
from ferryid.vessel.profile import Profile


@dataclass(frozen=True)
class Opened:
    """One log before smoothing: as it was recorded, on one grid, and as velocities and forces."""

    recording: Recording
    track: Track
    measured: Measured

    @property
    def doubts(self) -> tuple[str, ...]:
        """That no sensor measured it, contradictions between signals, and actuators known by orders alone, as sentences."""
        return doubts_of(self.recording, self.track)

    @property
    def left_out(self) -> tuple[str, ...]:
        """Which rows are not used whatever the smoothing, and why, as sentences."""
        return left_out_sentences(self.recording, self.measured.left_out, self.measured.usable)


@dataclass(frozen=True)
class Prepared:
    """One log, ready for regression, with what is known of its quality; its aligned signals where they were asked for."""

    recording: Recording
    motion: Motion
    doubts: tuple[str, ...] = ()
    track: Track | None = None

    @cached_property
    def quality(self) -> Mapping[str, Any]:
        """What is known of the quality of its signals: see `ferryid.signals.data_quality`."""
        return data_quality(self.recording, self.motion)

    @property
    def left_out(self) -> tuple[str, ...]:
        """Which rows are not used and why, as sentences."""
        return left_out_sentences(self.recording, self.motion.left_out, self.motion.valid)


def doubts_of(recording: Recording, track: Track, *, origin: bool = True) -> tuple[str, ...]:
    """Return what to mind of a log as sentences: signals that contradict each other, end early or are not there.

    With `origin` also that it is no recording of a vessel.
    """
    why = artificial(recording) if origin else ""
    empty = [name for name in POSE if name in track.columns and not np.isfinite(track.columns[name]).any()]
    return (
        *((f"It {NO_RECORDING}: {why}.",) if why else ()),
        *(doubt.says for doubt in track.doubts),
        *(repair for repair in track.repairs if repair == SWAY_NOT_MEASURED),
        *recording.orders_for_feedback,
        *recording.repeated_columns,
        *_overlap(recording, track),
        *(f"{name} is mapped and has no value in this log." for name in empty),
    )


def _overlap(recording: Recording, track: Track) -> list[str]:
    """Return how much is not used because navigation and actuators were not recorded together, if it is of any length."""
    first, last = track.t0_ns, track.t0_ns + round(float(track.t[-1]) * 1e9)
    begins = {topic: abs(int(s.time_ns[0]) - first) for topic, s in recording.streams.items() if len(s.time_ns)}
    ends = {topic: abs(int(s.time_ns[-1]) - last) for topic, s in recording.streams.items() if len(s.time_ns)}
    sides = []
    for cut_ns, near, where, verb in (
        (first - recording.start_ns, begins, "first", "begins then"),
        (recording.end_ns - last, ends, "last", "ends before"),
    ):
        topic = min(near, key=lambda name: near[name])
        # Rows that lack a value at either end are counted with all others that do.
        if cut_ns > SIGNALS.overlap_ns > near[topic]:
            sides.append(f"the {where} {cut_ns * 1e-9:.1f} s, as {topic} {verb}")
    if not sides:
        return []
    return [
        f"{track.t[-1]:.1f} s are used, the time that navigation and actuators share, without {' and '.join(sides)}."
    ]


def open_track(
    path: str,
    profile: Profile,
    out: Path | None,
    *,
    rate_hz: float | None = None,
    verify: bool = False,
    ranges: TimeRanges = (),
) -> Opened:
    """Ingest and align one log, and reconstruct its forces; arguments and errors are those of `prepare`."""
    return track_of(record(path, profile, out, verify=verify, ranges=ranges), profile, rate_hz)


def track_of(
    recording: Recording, profile: Profile, rate_hz: float | None = None, faults: Faults | None = None
) -> Opened:
    """Align a recording and reconstruct its forces; arguments and errors are those of `prepare` and `align`."""
    check_sampling(recording, profile)
    if rate_hz is not None:
        check_grid(profile, rate_hz)
    track = align(recording, profile, rate_hz, faults)
    for doubt in track.doubts:
        if doubt.certain:
            raise ContradictionError(
                f"{recording.name}: signals contradict each other, so they cannot be used. {doubt.says} "
                f"Fix: in the profile {profile.name}, {doubt.remedy}"
            )
    return Opened(recording, track, measure(track, profile))


def prepare(
    path: str,
    profile: Profile,
    out: Path | None,
    *,
    window_s: float,
    smoother: str = "square",
    rate_hz: float | None = None,
    verify: bool = False,
    keep_track: bool = False,
    ranges: TimeRanges = (),
) -> Prepared:
    """Ingest, align and smooth one log.

    Parameters
    ----------
    path
        A file or folder; parts of one recording joined by ``+``.
    profile
        Vessel and signal map.
    out
        Output folder, whose ``logs`` keep the ingested tables; None keeps none.
    window_s, smoother, rate_hz
        See `ferryid.signals.smooth` and `ferryid.signals.align`.
    verify
        Check every checksum.
    keep_track
        Return the aligned signals as well.
    ranges
        What of the log is used; all of it where empty.

    Raises
    ------
    FerryIdError
        For a log that cannot be used, also one whose signals contradict each other beyond doubt.
    """
    opened = open_track(path, profile, out, rate_hz=rate_hz, verify=verify, ranges=ranges)
    return smoothed(opened, window_s, smoother, keep_track=keep_track)


def smoothed(opened: Opened, window_s: float, smoother: str = "square", *, keep_track: bool = False) -> Prepared:
    """Smooth an opened log; arguments and errors are those of `prepare`."""
    motion = smooth_measured(opened.measured, window_s, smoother)
    unused = [said for said in motion.repairs if ON_FEW_ROWS in said]
    return Prepared(opened.recording, motion, (*opened.doubts, *unused), opened.track if keep_track else None)
