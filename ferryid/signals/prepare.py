"""From a log on disk to smoothed motion: the first half of every command."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ferryid.errors import FerryIdError
from ferryid.signals.align import align
from ferryid.signals.recording import Recording, data_quality, record
from ferryid.signals.smooth import smooth
from ferryid.signals.track import Motion, Track
from ferryid.vessel.profile import Profile


@dataclass(frozen=True)
class Prepared:
    """One log, ready for regression, with what is known of its quality; its aligned signals where they were asked for."""

    recording: Recording
    motion: Motion
    quality: Mapping[str, Any]
    doubts: tuple[str, ...] = ()
    track: Track | None = None


def prepare(
    path: str,
    profile: Profile,
    out: Path,
    *,
    window_s: float,
    smoother: str = "square",
    rate_hz: float | None = None,
    verify: bool = False,
    keep_track: bool = False,
) -> Prepared:
    """Ingest, align and smooth one log.

    Parameters
    ----------
    path
        A file or folder; parts of one recording joined by ``+``.
    profile
        Vessel and signal map.
    out
        Output folder, whose ``logs`` keep the ingested tables.
    window_s, smoother, rate_hz
        See `ferryid.signals.smooth` and `ferryid.signals.align`.
    verify
        Check every checksum.
    keep_track
        Return the aligned signals as well.

    Raises
    ------
    FerryIdError
        For a log that cannot be used, also one whose signals contradict each other beyond doubt.
    """
    recording = record(path, profile, out, verify=verify)
    track = align(recording, profile, rate_hz)
    for doubt in track.doubts:
        if doubt.certain:
            raise FerryIdError(
                f"{recording.name}: signals contradict each other, so nothing can be learnt from them. {doubt.says} "
                f"Fix: correct unit, frame or sign of the signal in the profile {profile.name}"
            )
    motion = smooth(track, profile, window_s, smoother)
    doubts = tuple(doubt.says for doubt in track.doubts)
    return Prepared(recording, motion, data_quality(recording, motion), doubts, track if keep_track else None)
