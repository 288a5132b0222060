"""One uniform grid for all signals of a recording, with nothing invented across gaps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ferryid.errors import FerryIdError
from ferryid.signals.poses import MARGIN_S, USED, PoseFault, pose_faults, pose_sentences
from ferryid.signals.quality import (
    NAVIGATION,
    POSE,
    REFERENCE,
    VELOCITY,
    clean,
    cross_checks,
    is_actuator,
    is_load,
    is_order,
    stale,
    stuck,
)
from ferryid.signals.track import LeftOut, Track
from ferryid.vessel import actuator_columns, resolve, resolve_notes
from ferryid.vessel.profile import Profile

if TYPE_CHECKING:
    from ferryid.signals.stream import Recording, Stream

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Nanoseconds = NDArray[np.int64]

RATE_LIMIT_HZ = 20.0
GAP_PERIODS = 3.0
GAP_LEAST_S = 0.5
"""A stretch without samples is a gap when longer than three periods of its stream and than this [s]."""

STUCK_PERIODS = 10.0
"""A velocity that repeats itself for longer than a gap and than this many periods was not measured meanwhile."""

_AVERAGED_ABOVE = 1.9
"""Streams this many times faster than the grid are averaged over each grid interval instead of sampled."""
_VELOCITY = ("u", "vel_N", "x", "psi")
MOST_EMPTY_ROWS, MOST_SPARSE = 2_000_000, 50
"""A grid beyond both limits, the second in rows per sample, comes of wrong times, not of gaps."""
_EXACT_S = 1e-6
_ENDS_S = 2.0
"""Rows at either end of the common time that lack a signal count as left out from this length [s] on."""
_HEADING_SHARE = 0.8
"""A heading that was measured on this share of the rows is needed; one that was measured on fewer is left out by others."""


@dataclass(frozen=True)
class _Source:
    """One stream, cleaned: times [ns], columns, usual period, longest interval that is bridged [s]."""

    topic: str
    time_ns: Nanoseconds
    columns: Mapping[str, Floats]
    period_s: float
    bridge_s: float
    on_change: bool


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
    sources = [_source(stream, repairs) for stream in recording.streams.values() if _enough(stream)]
    navigation = [s for s in sources if _has(s, NAVIGATION)]
    actuators = [s for s in sources if any(is_actuator(name) or is_order(name) for name in {*s.columns} - {*REFERENCE})]
    _refuse_standing(recording)
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
    count = int((end - t0_ns) * 1e-9 * rate + _EXACT_S) + 1
    if count < 2 or count > max(MOST_EMPTY_ROWS, MOST_SPARSE * len(lead.time_ns)):
        raise FerryIdError(
            f"{recording.name}: its times cannot be right, {len(lead.time_ns)} samples of the velocity are spread over "
            f"{max(0.0, (end - t0_ns) * 1e-9):.4g} s. Fix: look for wrong clocks with ferryid inspect, or cut the log"
        )
    t = np.arange(count) / rate
    columns: dict[str, Floats] = {}
    for source in sources:
        columns.update(_on_grid(source, t0_ns, t, rate, repairs))
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


def _refuse_standing(recording: Recording) -> None:
    """Refuse a log without two times in it: one row, or a clock that stands still."""
    streams = [stream for stream in recording.streams.values() if len(stream.time_ns)]
    if any(len(stream.time_ns) > 1 for stream in streams):
        return
    repeated = sum(stream.clock.duplicates for stream in streams)
    what = (
        f"time does not advance, found the same time on {repeated + 1} rows"
        if repeated
        else f"found one row in {'each of ' if len(streams) > 1 else ''}{', '.join(stream.topic for stream in streams[:3])}"
    )
    raise FerryIdError(
        f"{recording.name}: a fit needs measurements over time, {what}. "
        + (
            "Fix: check the column or clock of the times"
            if repeated
            else "Fix: use a log that was recorded for minutes"
        )
    )


def _usual_period(time_s: Floats) -> float:
    """Return the mean interval [s] of a stream without its gaps.

    The mean, since messages that are received in bursts leave a median that says nothing.
    """
    interval = np.diff(time_s)
    interval = interval[interval > 0.0]
    if interval.size == 0:
        return 1.0
    period = float(interval.mean())
    for _ in range(5):
        within = interval <= max(GAP_PERIODS * period, GAP_LEAST_S)
        if not within.any():
            break
        shorter = float(interval[within].mean())
        if shorter == period:
            break
        period = shorter
    return period


def _round_rate(rate_hz: float) -> float:
    """Return a rate that a person would name: whole above 5 Hz, two digits below, at most 20 Hz."""
    if rate_hz >= RATE_LIMIT_HZ:
        return RATE_LIMIT_HZ
    if rate_hz >= 5.0:
        return float(max(5, round(rate_hz)))
    return float(f"{rate_hz:.2g}")


def _source(stream: Stream, repairs: list[str]) -> _Source:
    time_ns = np.asarray(stream.time_ns)
    time_s = (time_ns - time_ns[0]) * 1e-9
    period = _usual_period(time_s)
    on_change = _on_change(time_s, stream.columns)
    bridge = max(GAP_PERIODS * period, GAP_LEAST_S)
    columns: dict[str, Floats] = {}
    for name, raw in stream.columns.items():
        columns[name], quality = clean(name, time_s, raw)
        repairs.extend(quality.sentences())
    old = stale(time_s, stream.columns, bridge)
    if old.any():
        for values in columns.values():
            values[old] = np.nan
        repairs.append(
            f"{stream.topic}: {int(old.sum())} of {old.size} messages repeat an old measurement for more than "
            f"{bridge:.2f} s; taken as missing."
        )
    frozen = max(bridge, STUCK_PERIODS * period)
    for name in VELOCITY:
        if name in columns and (same := stuck(time_s, stream.columns[name], frozen) & ~old).any():
            columns[name][same] = np.nan
            repairs.append(
                f"{name}: {int(same.sum())} of {same.size} samples repeat an old one to the last digit for more than "
                f"{frozen:.2f} s; taken as missing."
            )
    interval = np.diff(time_s)
    gaps = interval > bridge
    if interval.size and all(is_load(name) for name in columns):
        repairs.append(f"{stream.topic}: each value holds until the next, at most for {interval.max():.1f} s.")
    elif interval.size and on_change:
        repairs.append(
            f"{stream.topic}: published when it changes; each value holds until the next, "
            f"at most for {interval.max():.1f} s."
        )
    elif gaps.any():
        repairs.append(
            f"{stream.topic}: {int(gaps.sum())} gaps longer than {bridge:.2f} s, {interval[gaps].sum():.1f} s in all; "
            "not bridged."
        )
    return _Source(stream.topic, time_ns, columns, period, bridge, on_change)


def _on_change(time_s: Floats, columns: Mapping[str, Floats]) -> bool:
    """True for a payload, and actuator streams that are irregular and whose messages (nearly) all say something new."""
    if all(is_load(name) for name in columns):
        return True
    if not all(is_actuator(name) or is_order(name) for name in columns) or time_s.size < 3:
        return False
    interval = np.diff(time_s)
    irregular = float(np.mean(interval > GAP_PERIODS * np.median(interval)))
    new = np.zeros(interval.size, dtype=bool)
    for values in columns.values():
        new |= np.diff(values) != 0.0
    return irregular > 0.1 and float(new.mean()) > 0.9


def _on_grid(source: _Source, t0_ns: int, t: Floats, rate: float, repairs: list[str]) -> dict[str, Floats]:
    # Times relative to the grid's start keep nanoseconds exact in floating point.
    time_s = np.asarray((source.time_ns - t0_ns) * 1e-9, dtype=np.float64)
    averaged = not source.on_change and source.period_s * rate * _AVERAGED_ABOVE < 1.0
    if averaged:
        repairs.append(
            f"{source.topic}: {1 / source.period_s:.3g} Hz, averaged over the intervals of the {rate:g} Hz grid."
        )
    columns = dict(source.columns)
    wind = _wind_vector(columns)
    columns.update(wind)
    result: dict[str, Floats] = {}
    everywhere: Flags | None = None
    for name, values in columns.items():
        finite: Flags = np.isfinite(values)
        whole = bool(finite.all())
        times, known = (time_s, values) if whole else (time_s[finite], values[finite])
        if times.size == 0:
            result[name] = np.full(t.size, np.nan)
            continue
        if source.on_change or is_load(name) or (is_order(name) and not averaged):
            unlimited = source.on_change or is_load(name)
            result[name] = _held(times, known, t, np.inf if unlimited else source.bridge_s)
            continue
        if whole:
            everywhere = _bridged(times, t, source.bridge_s) if everywhere is None else everywhere
            inside = everywhere
        else:
            inside = _bridged(times, t, source.bridge_s)
        if averaged:
            times, known = _bin_means(times, known, t.size, rate)
            if times.size == 0:
                result[name] = np.full(t.size, np.nan)
                continue
            # Half a bin at either end has its mean elsewhere.
            inside = inside & (t >= times[0] - _EXACT_S) & (t <= times[-1] + _EXACT_S)
        result[name] = np.where(inside, np.interp(t, times, known), np.nan)
    if wind:
        along, across = result.pop("_wind_along"), result.pop("_wind_across")
        result["wind_speed"] = np.hypot(along, across)
        result["wind_from"] = np.arctan2(across, along)
    return result


def _wind_vector(columns: dict[str, Floats]) -> dict[str, Floats]:
    """Replace speed and direction of the wind by two components, which can be averaged and interpolated."""
    if "wind_speed" not in columns or "wind_from" not in columns:
        return {}
    speed, direction = columns.pop("wind_speed"), columns.pop("wind_from")
    return {"_wind_along": speed * np.cos(direction), "_wind_across": speed * np.sin(direction)}


def _bridged(times: Floats, t: Floats, bridge_s: float) -> Flags:
    """True where a grid time lies on a sample, or between two that are no further apart than `bridge_s`."""
    after = np.searchsorted(times, t, side="left")
    before = np.maximum(after - 1, 0)
    after = np.minimum(after, times.size - 1)
    on_sample = (np.abs(times[after] - t) <= _EXACT_S) | (np.abs(times[before] - t) <= _EXACT_S)
    between = (times[before] <= t) & (t <= times[after]) & (times[after] - times[before] <= bridge_s)
    bridged: Flags = on_sample | between
    return bridged


def _held(times: Floats, values: Floats, t: Floats, longest_s: float) -> Floats:
    latest = np.searchsorted(times, t + _EXACT_S, side="right") - 1
    known = latest >= 0
    latest = np.maximum(latest, 0)
    known &= t - times[latest] <= longest_s
    return np.where(known, values[latest], np.nan)


def _bin_means(times: Floats, values: Floats, count: int, rate: float) -> tuple[Floats, Floats]:
    """Return mean time and mean value of the samples around each grid time, for those that have any.

    The mean time is kept, since samples seldom lie evenly in a bin: half a sample off would be a delay between streams.
    """
    bins = np.floor(times * rate + 0.5).astype(np.int64)
    near = (bins >= 0) & (bins < count)
    bins = bins[near]
    number = np.bincount(bins, minlength=count)
    filled = number > 0
    mean_time = np.bincount(bins, times[near], count)[filled] / number[filled]
    mean_value = np.bincount(bins, values[near], count)[filled] / number[filled]
    return mean_time, mean_value


def _has(source: _Source, names: tuple[str, ...]) -> bool:
    return any(name in source.columns for name in names)


def _overlap(log: str, navigation: list[_Source], actuators: list[_Source]) -> tuple[int, int]:
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
