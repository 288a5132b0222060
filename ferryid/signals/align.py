"""One uniform grid for all signals of a recording, with nothing invented across gaps."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ferryid.counts import counted, verb
from ferryid.errors import FerryIdError
from ferryid.signals.consistency import cross_checks
from ferryid.signals.faults import Faults, find_faults
from ferryid.signals.grid import EXACT_S, on_grid
from ferryid.signals.poses import step_doubts
from ferryid.signals.quality import NAVIGATION, POSE, REFERENCE, is_actuator, is_order
from ferryid.signals.sampling import check_advancing, single_rows
from ferryid.signals.source import Held, Source
from ferryid.signals.thresholds import SIGNALS
from ferryid.signals.track import LeftOut, Track
from ferryid.types import Flags, Floats
from ferryid.vessel import actuator_columns, follow_orders, resolve, resolve_notes, slopes_of_pose
from ferryid.vessel.profile import Profile

if TYPE_CHECKING:
    from ferryid.signals.stream import Recording


RATE_LIMIT_HZ = 20.0
_VELOCITY = ("u", "vel_N", "x", "psi")
HELD = "velocity repeats an old value, or stays at one while the pose moves"


def align(recording: Recording, profile: Profile, rate_hz: float | None = None, faults: Faults | None = None) -> Track:
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
    faults
        What `ferryid.signals.faults.find_faults` found in the recording, where that is known.

    Returns
    -------
    Track
        Trimmed to its first and last valid row.

    Raises
    ------
    FerryIdError
        Where navigation or actuators are missing or empty, or never measured at the same time.
    """
    faults = find_faults(recording) if faults is None else faults
    sources = faults.sources
    repairs = [*faults.taken_out, *faults.remarks]
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
    if t0_ns - start > SIGNALS.overlap_ns:
        # A gap before that sample is on the grid too, so that it is counted.
        t0_ns -= round(int((t0_ns - start) * 1e-9 * rate) * 1e9 / rate)
    count = int((end - t0_ns) * 1e-9 * rate + EXACT_S) + 1
    if count < 2 or count > max(SIGNALS.most_grid_rows, SIGNALS.most_rows_per_sample * len(lead.time_ns)):
        raise FerryIdError(_spread(recording.name, lead, max(0.0, (end - t0_ns) * 1e-9)))
    t = np.arange(count) / rate
    columns: dict[str, Floats] = {}
    for source in sources:
        columns.update(on_grid(source, t0_ns, t, rate, repairs))
    around = faults.wrong_poses()
    wrong, held = (_inside(spans, t0_ns, count, rate) for spans in (around, faults.held))
    for name in POSE:
        if name in columns:
            columns[name][wrong] = np.nan
    repairs.extend(resolve_notes(profile, columns))
    slopes = slopes_of_pose(columns)
    try:
        columns = resolve(profile, columns, rate)
    except FerryIdError as error:
        # What holds one row is not on the grid, and not the profile's fault.
        if message := single_rows(recording):
            raise FerryIdError(message) from error
        raise
    columns = follow_orders(profile, columns, rate)
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
        if np.count_nonzero(lost[side]) < SIGNALS.unmeasured_end_s * rate:
            lost[side] = False
    first_row = kept.start
    lacking = _Lacking(profile, columns)
    left_out = (
        *LeftOut.of(lacking.reason(lost & ~held), lost & ~held, rate, first_row, lacking.cause),
        *LeftOut.of(lacking.reason(lost & held, HELD), lost & held, rate, first_row, _cause(faults.held, t0_ns, rate)),
        *LeftOut.of("the pose cannot be true", wrong, rate, first_row, _cause(around, t0_ns, rate)),
    )
    total = sum(one.rows for one in left_out) + int(np.count_nonzero(valid))
    columns = {name: np.ascontiguousarray(values[kept]) for name, values in columns.items()}
    valid = valid[kept]
    t0_ns += round(int(rows[0]) * 1e9 / rate)
    repairs.extend(
        f"{one.rows} of {counted(total, 'row')} ({one.seconds:.1f} s in {counted(one.stretches, 'stretch')}) "
        f"{verb(one.rows, 'is')} not used: {one.reason}."
        for one in left_out
    )
    track = Track(
        recording.name, t[: valid.size], t0_ns, rate, columns, valid, tuple(repairs), left_out=left_out, slopes=slopes
    )
    doubts = (*step_doubts(faults.poses, t0_ns), *cross_checks(track))
    return replace(track, repairs=(*repairs, *(doubt.says for doubt in doubts)), doubts=doubts)


def _round_rate(rate_hz: float) -> float:
    """Return a rate that a person would name: whole above 5 Hz, two digits below, at most 20 Hz."""
    if rate_hz >= RATE_LIMIT_HZ:
        return RATE_LIMIT_HZ
    if rate_hz >= 5.0:
        return float(max(5, round(rate_hz)))
    return float(f"{rate_hz:.2g}")


def _has(source: Source, names: tuple[str, ...]) -> bool:
    return any(name in source.columns for name in names)


def _overlap(log: str, navigation: Sequence[Source], actuators: Sequence[Source]) -> tuple[int, int]:
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


def _spread(log: str, lead: Source, seconds: float) -> str:
    """Return the message on a velocity whose samples are far apart: a long pause, or wrong times."""
    pause = np.diff(lead.time_ns).max() * 1e-9 if lead.time_ns.size > 1 else 0.0
    found = f"{counted(len(lead.time_ns), 'sample')} of the velocity over {seconds:.4g} s"
    if pause < SIGNALS.pause_share * seconds:
        return (
            f"{log}: its times cannot be right, found {found}. "
            "Fix: look for wrong clocks with ferryid inspect, or cut the log"
        )
    before = (lead.time_ns[int(np.argmax(np.diff(lead.time_ns)))] - lead.time_ns[0]) * 1e-9
    return (
        f"{log}: a pause of {pause / 3600.0:.1f} h is too long for one log, found {found}, with nothing measured from "
        f"{before:.0f} s on. Fix: record or cut the parts before and after it as two logs, and give both"
    )


def _inside(spans: Sequence[Held], t0_ns: int, count: int, rate: float) -> Flags:
    """True on the rows inside spans of time, shape (count,)."""
    inside = np.zeros(count, dtype=bool)
    for span in spans:
        first, last = ((time_ns - t0_ns) * 1e-9 * rate for time_ns in (span.start_ns, span.end_ns))
        inside[max(0, int(np.ceil(first))) : max(0, int(np.floor(last)) + 1)] = True
    return inside


def _cause(spans: Sequence[Held], t0_ns: int, rate: float) -> Callable[[slice], tuple[Sequence[str], str]]:
    """Return a function that gives signals and reasons of the spans that a stretch of rows meets."""

    def cause(rows: slice) -> tuple[Sequence[str], str]:
        first_ns, last_ns = (t0_ns + row / rate * 1e9 for row in (rows.start, rows.stop - 1))
        met = [span for span in spans if span.start_ns <= last_ns + 1.0 and span.end_ns >= first_ns - 1.0]
        signals = dict.fromkeys(name for span in met for name in span.signals)
        return tuple(signals), "; ".join(dict.fromkeys(span.reason for span in met))

    return cause


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
    if psi is not None and known.size and known.mean() >= SIGNALS.heading_share:
        # Without it neither wind nor current can be turned to the vessel, and no pose can be predicted.
        valid &= np.isfinite(psi) | wrong
    return valid


@dataclass(frozen=True)
class _Lacking:
    """Which signals lack a value on rows that are left out."""

    profile: Profile
    columns: Mapping[str, Floats]

    def reason(self, rows: Flags, what: str = "velocity, heading or an actuator was not measured") -> str:
        """Return why rows are left out: the signals of which they lack a value, and how many."""
        counts = {name: int(np.count_nonzero(rows & ~np.isfinite(self.columns[name]))) for name in self._names()}
        most = sorted((name for name in counts if counts[name]), key=lambda name: -counts[name])
        shown = ", ".join(f"{name} {counts[name]}" for name in most[:4]) + (", ..." if len(most) > 4 else "")
        return f"{what} ({shown})"

    def cause(self, rows: slice) -> tuple[Sequence[str], str]:
        """Return the signals that lack a value in a stretch of rows, and the reason."""
        names = tuple(name for name in self._names() if not np.isfinite(self.columns[name][rows]).all())
        return names, "not measured"

    def _names(self) -> list[str]:
        return [name for name in dict.fromkeys([*_needed(self.profile, self.columns), "psi"]) if name in self.columns]


def _needed(profile: Profile, columns: Mapping[str, Floats]) -> list[str]:
    acting, _ = actuator_columns(profile, columns)
    return ["u", "v", "r", *acting.values()]


def _blame(profile: Profile, columns: Mapping[str, Floats]) -> str:
    shares = [f"{name} {100 * np.mean(np.isfinite(columns[name])):.0f} %" for name in _needed(profile, columns)]
    return ", ".join(shares) + " of the time"


def _listed(recording: Recording) -> str:
    names = sorted(name for stream in recording.streams.values() for name in stream.columns)
    return ", ".join(names) if names else "nothing"
