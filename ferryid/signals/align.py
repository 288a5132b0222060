"""One uniform grid for all signals of a recording, with nothing invented across gaps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ferryid.errors import FerryIdError
from ferryid.signals.grid import EXACT_S, on_grid
from ferryid.signals.poses import MARGIN_S, USED, PoseFault, pose_faults, pose_sentences
from ferryid.signals.quality import NAVIGATION, POSE, REFERENCE, cross_checks, is_actuator, is_load, is_order
from ferryid.signals.sampling import check_advancing
from ferryid.signals.source import Source, source_of
from ferryid.signals.track import LeftOut, Track
from ferryid.vessel import actuator_columns, resolve, resolve_notes
from ferryid.vessel.profile import Profile

if TYPE_CHECKING:
    from ferryid.signals.stream import Recording, Stream

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

RATE_LIMIT_HZ = 20.0
_VELOCITY = ("u", "vel_N", "x", "psi")
MOST_EMPTY_ROWS, MOST_SPARSE = 2_000_000, 50
"""A grid beyond both limits, the second in rows per sample, comes of wrong times, not of gaps."""
_ENDS_S = 2.0
"""Rows at either end of the common time that lack a signal count as left out from this length [s] on."""
_HEADING_SHARE = 0.8
"""A heading that was measured on this share of the rows is needed; one that was measured on fewer is left out by others."""


def align(recording: Recording, profile: Profile, rate_hz: float | None = None) -> Track:
    """Bring all streams of a recording onto one uniform grid, in the frames of the vessel.

    The grid covers the time for which there are both navigation and actuator signals, and starts on a sample of the
    velocity. Within measured data, values are interpolated linearly; headings and azimuth angles are unwrapped before
    and the wind is interpolated as a vector. Orders hold until the next order. Actuator signals that are published
    only when they change hold too, without limit, and so does a payload; all others are missing across a gap. Streams
    much faster than the grid are averaged over each of its intervals, which keeps their noise from folding down. Isolated
    implausible samples and stale repetitions are taken out before, and counted; rows with a pose that cannot be true, as
    `ferryid.signals.poses` finds it, are missing a pose and are not valid.

    Parameters
    ----------
    recording
        Streams with repaired clocks in canonical SI columns.
    profile
        Resolves frames that need several signals.
    rate_hz
        Rows per second; None takes the rate of the velocity, rounded, at most 20 Hz.

    Returns
    -------
    Track
        Trimmed to its first and last valid row.

    Raises
    ------
    FerryIdError
        Where navigation or actuators are missing or empty, or never measured at the same time.
    """
    repairs: list[str] = []
    sources = [source_of(stream, repairs) for stream in recording.streams.values() if _enough(stream)]
    navigation = [s for s in sources if _has(s, NAVIGATION)]
    actuators = [s for s in sources if any(is_actuator(name) or is_order(name) for name in {*s.columns} - {*REFERENCE})]
    check_advancing(recording)
    for group, what in ((navigation, "navigation"), (actuators, "actuator")):
        if not group:
            raise FerryIdError(
                f"{recording.name}: no {what} signal to align, found {_listed(recording)}. "
                "Fix: map it in the vessel profile, or use a log that has it"
            )
    start, end = _overlap(recording.name, navigation, actuators)
    lead = next((s for name in _VELOCITY for s in navigation if name in s.columns), navigation[0])
    rate = _round_rate(1.0 / lead.period_s) if rate_hz is None else float(rate_hz)
    # On the samples of the velocity, interpolation leaves them as they are.
    first = int(lead.time_ns[min(int(np.searchsorted(lead.time_ns, start)), len(lead.time_ns) - 1)])
    t0_ns = max(start, first)
    count = int((end - t0_ns) * 1e-9 * rate + EXACT_S) + 1
    if count < 2 or count > max(MOST_EMPTY_ROWS, MOST_SPARSE * len(lead.time_ns)):
        raise FerryIdError(
            f"{recording.name}: its times cannot be right, {len(lead.time_ns)} samples of the velocity are spread over "
            f"{max(0.0, (end - t0_ns) * 1e-9):.4g} s. Fix: look for wrong clocks with ferryid inspect, or cut the log"
        )
    t = np.arange(count) / rate
    columns: dict[str, Floats] = {}
    for source in sources:
        columns.update(on_grid(source, t0_ns, t, rate, repairs))
    faults = pose_faults({name: (s.time_ns, s.columns[name]) for s in sources for name in USED if name in s.columns})
    repairs.extend(pose_sentences(faults))
    wrong = _inside(faults, t0_ns, count, rate)
    for name in POSE:
        if name in columns:
            columns[name][wrong] = np.nan
    repairs.extend(resolve_notes(profile, columns))
    columns = resolve(profile, columns, rate)
    measured = _measured(recording.name, profile, columns, wrong)
    valid = measured & ~wrong
    if not valid.any():
        raise FerryIdError(
            f"{recording.name}: velocity and actuators are never measured at the same time, found "
            f"{_blame(profile, columns)}. Fix: check the clocks with `ferryid inspect`, or use another log"
        )
    rows = np.flatnonzero(valid)
    kept = slice(int(rows[0]), int(rows[-1]) + 1)
    lost = ~measured & ~wrong
    for side in (slice(0, kept.start), slice(kept.stop, None)):
        # Topics never begin and end with the same row; more than that is a loss.
        if np.count_nonzero(lost[side]) < _ENDS_S * rate:
            lost[side] = False
    left_out = (
        *LeftOut.of(_unmeasured(profile, columns, lost), lost, rate),
        *LeftOut.of("the pose cannot be true", wrong, rate),
    )
    total = sum(one.rows for one in left_out) + int(np.count_nonzero(valid))
    columns = {name: np.ascontiguousarray(values[kept]) for name, values in columns.items()}
    valid = valid[kept]
    t0_ns += round(int(rows[0]) * 1e9 / rate)
    repairs.extend(
        f"{one.rows} of {total} rows ({one.seconds:.1f} s in {one.stretches} stretches) are not used: {one.reason}."
        for one in left_out
    )
    track = Track(recording.name, t[: valid.size], t0_ns, rate, columns, valid, tuple(repairs), left_out=left_out)
    doubts = cross_checks(track)
    return replace(track, repairs=(*repairs, *(doubt.says for doubt in doubts)), doubts=doubts)


def segments(valid: Flags) -> list[slice]:
    """Return the unbroken stretches of True, in order."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], valid, [False]]).astype(np.int8)))
    return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _enough(stream: Stream) -> bool:
    """One message is enough for what holds until the next: a payload that was weighed once."""
    return len(stream.time_ns) > 1 or (len(stream.time_ns) == 1 and all(is_load(name) for name in stream.columns))


def _round_rate(rate_hz: float) -> float:
    """Return a rate that a person would name: whole above 5 Hz, two digits below, at most 20 Hz."""
    if rate_hz >= RATE_LIMIT_HZ:
        return RATE_LIMIT_HZ
    if rate_hz >= 5.0:
        return float(max(5, round(rate_hz)))
    return float(f"{rate_hz:.2g}")


def _has(source: Source, names: tuple[str, ...]) -> bool:
    return any(name in source.columns for name in names)


def _overlap(log: str, navigation: list[Source], actuators: list[Source]) -> tuple[int, int]:
    spans = []
    for group in (navigation, actuators):
        starts = min(int(s.time_ns[0]) for s in group)
        # An actuator that is published on change holds its last value.
        ends = max(int(s.time_ns[-1]) for s in group)
        if all(s.on_change for s in group):
            ends = max(ends, max(int(s.time_ns[-1]) for s in navigation))
        spans.append((starts, ends))
    start, end = max(s for s, _ in spans), min(e for _, e in spans)
    if start >= end:
        apart = (start - end) * 1e-9
        (nav_start, nav_end), (act_start, act_end) = spans
        raise FerryIdError(
            f"{log}: navigation and actuators do not overlap in time, found {(nav_end - nav_start) * 1e-9:.1f} s of "
            f"navigation and {(act_end - act_start) * 1e-9:.1f} s of actuators {apart:.1f} s apart. "
            "Fix: check which clocks the topics use with `ferryid inspect`, or use a log that holds both"
        )
    return start, end


def _inside(faults: Sequence[PoseFault], t0_ns: int, count: int, rate: float) -> Flags:
    """True on the rows of wrong poses and within `MARGIN_S` of them, shape (count,)."""
    inside = np.zeros(count, dtype=bool)
    for fault in (one for one in faults if one.left_out):
        first = ((fault.start_ns - t0_ns) * 1e-9 - MARGIN_S) * rate
        last = ((fault.end_ns - t0_ns) * 1e-9 + MARGIN_S) * rate
        inside[max(0, int(np.ceil(first))) : max(0, int(np.floor(last)) + 1)] = True
    return inside


def _measured(log: str, profile: Profile, columns: Mapping[str, Floats], wrong: Flags) -> Flags:
    """True where everything that the fit needs was measured; where the pose is wrong, what is derived of it is not asked."""
    valid = np.ones(wrong.size, dtype=bool)
    for name in _needed(profile, columns):
        finite = np.isfinite(columns[name])
        if not finite.any():
            raise FerryIdError(
                f"{log}: {name} has no value, needed by the fit, found NaN throughout the common time of navigation "
                "and actuators. Fix: check the field that the profile maps, or use another log"
            )
        valid &= finite
    psi = columns.get("psi")
    known = np.isfinite(psi[valid & ~wrong]) if psi is not None else np.empty(0, dtype=bool)
    if psi is not None and known.size and known.mean() >= _HEADING_SHARE:
        # Without it neither wind nor current can be turned to the vessel, and no pose can be predicted.
        valid &= np.isfinite(psi) | wrong
    return valid


def _unmeasured(profile: Profile, columns: Mapping[str, Floats], rows: Flags) -> str:
    """Return why rows are left out: the signals of which they lack a value, and how many."""
    counts = {
        name: int(np.count_nonzero(rows & ~np.isfinite(columns[name])))
        for name in dict.fromkeys([*_needed(profile, columns), "psi"])
        if name in columns
    }
    most = sorted((name for name in counts if counts[name]), key=lambda name: -counts[name])
    shown = ", ".join(f"{name} {counts[name]}" for name in most[:4]) + (", ..." if len(most) > 4 else "")
    return f"velocity, heading or an actuator was not measured ({shown})"


def _needed(profile: Profile, columns: Mapping[str, Floats]) -> list[str]:
    acting, _ = actuator_columns(profile, columns)
    return ["u", "v", "r", *acting.values()]


def _blame(profile: Profile, columns: Mapping[str, Floats]) -> str:
    shares = [f"{name} {100 * np.mean(np.isfinite(columns[name])):.0f} %" for name in _needed(profile, columns)]
    return ", ".join(shares) + " of the time"


def _listed(recording: Recording) -> str:
    names = sorted(name for stream in recording.streams.values() for name in stream.columns)
    return ", ".join(names) if names else "nothing"
