"""From a log to what it measures: the first stage of a diagnosis."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ferryid.diagnose.data.thresholds import DATA
from ferryid.effects.force_model import Measurements
from ferryid.effects.measurements import actuation_of, actuator_forces, interpolate_gaps, rudder_states
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.identify.engagement import ForceResponse, force_response_of
from ferryid.models import validity_ranges
from ferryid.regression import averaged_out
from ferryid.signals.align import align
from ferryid.signals.artificial import artificial
from ferryid.signals.complementary_filter import CUBIC_S, complementary_filter
from ferryid.signals.consistency import comparable
from ferryid.signals.data_quality import left_out_sentences, repair_sentences
from ferryid.signals.faults import find_faults
from ferryid.signals.prepare import Opened, doubts_of
from ferryid.signals.recording import Recording, record
from ferryid.signals.sampling import check_sampling
from ferryid.signals.smooth import Measured, measure, odd_rows, smooth_measured, steady_cubic
from ferryid.signals.source import Held
from ferryid.signals.stream import compact
from ferryid.signals.track import LeftOut, Motion, Track
from ferryid.types import IN_MEMORY, Flags, Floats, RunContext
from ferryid.vessel.dimensions import window_seconds
from ferryid.vessel.hull import current_in_body
from ferryid.vessel.profile import Profile

WITHHELD = {
    "wind": ("wind_N", "wind_E"),
    "current": ("current_N", "current_E"),
    "payload": ("payload_kg", "payload_x"),
}
"""What may be kept from the diagnosis, to be compared with what it finds, and the columns of it."""
MEAN_S = 1.0
"""Moving mean of the motion whose ranges a model tells, as for a fit [s]."""
STRIDES = 4
CHANNELS = {"x": (0, 1), "y": (0, 1), "psi": (2,), "u": (3,), "v": (4,), "r": (5,), "vel_N": (3, 4), "vel_E": (3, 4)}
"""Places of a signal among north, east, heading, surge, sway and yaw rate; a position is one sample."""


@dataclass(frozen=True)
class UsedRows:
    """The rows of a log that a fit would use.

    Attributes
    ----------
    log
        Name of the log.
    rows, seconds
        Their number, and their length together [s].
    ranges
        Ranges of validity of what they teach.
    repairs, left_out
        As of `ferryid.signals.track.Motion`.
    """

    log: str
    rows: int
    seconds: float
    ranges: Mapping[str, tuple[float, float]]
    repairs: tuple[str, ...]
    left_out: tuple[LeftOut, ...]

    @classmethod
    def of(cls, motion: Motion) -> UsedRows:
        """Return what is told of a smoothed log."""
        valid = motion.valid
        ranges = validity_ranges(motion.nu[valid], motion.nu_dot[valid])
        seconds = float(valid.sum() / motion.rate_hz)
        return cls(motion.log, int(valid.sum()), seconds, ranges, motion.repairs, motion.left_out)


@dataclass(frozen=True)
class Survey:
    """What is known of a log besides its measurements.

    Attributes
    ----------
    recording
        The log's signals.
    motion
        Smoothed as for a fit; None where only `used` was kept of it.
    used
        What of it a model file tells.
    doubts
        As in `ferryid.signals.prepare.Prepared`; here no doubt stops anything.
    hidden
        What was withheld, by name: shape (n, 2), NaN where it was not measured.
    left_out
        Which rows are not used and why, as sentences.
    t0_ns
        Absolute time of the measurements' first row [ns].
    repairs
        What was repaired while the log was read and aligned, as sentences.
    contradictions
        Those of the doubts by which it is certain that a signal is wrong.
    comparable
        False where the log is too short, or moves too little, to show any contradiction.
    jumping
        ``"position"`` or ``"heading"``, where it jumps too often to know which samples are wrong; else empty.
    averaged_out
        That the windows are too long for the log's manoeuvres, as a sentence; empty where they are not.
    """

    recording: Recording
    motion: Motion | None
    used: UsedRows
    doubts: tuple[str, ...]
    hidden: Mapping[str, Floats]
    t0_ns: int
    left_out: tuple[str, ...]
    repairs: tuple[str, ...] = ()
    contradictions: tuple[str, ...] = ()
    comparable: bool = True
    jumping: tuple[str, ...] = ()
    averaged_out: tuple[str, ...] = ()


@dataclass(frozen=True)
class MeasuredLog:
    """A log as it was measured: the first stage of a diagnosis.

    `response` is how the vessel accelerates under the applied force; None where the log does not show it.
    """

    path: str
    measurements: Measurements
    survey: Survey
    response: ForceResponse | None = None


def measure_log(
    path: str,
    profile: Profile,
    run: RunContext,
    *,
    withhold: Sequence[str] = (),
) -> MeasuredLog:
    """Read and align a log, of which samples and motion are not kept; parameters and errors as of `read_measurements`."""
    measurements, survey, opened = _read(path, profile, run, withhold, CUBIC_S)
    # A campaign holds all of its logs at once: what is needed of none is let go.
    survey = replace(survey, recording=compact(survey.recording), motion=None)
    return MeasuredLog(path, measurements, survey, force_response_of(opened, profile))


def read_measurements(
    path: str,
    profile: Profile,
    run: RunContext = IN_MEMORY,
    *,
    withhold: Sequence[str] = (),
    window_s: float = CUBIC_S,
) -> tuple[Measurements, Survey]:
    """Return the measurements that a log shows, and what else is known of the log.

    Positions, heading and `nu_raw` are as measured; `nu`, wind and current pass through a local cubic, as they enter
    products. Across gaps all signals are bridged so that filters can run on, but no row there is `usable`.

    Parameters
    ----------
    path
        A file or folder; parts of one recording joined by ``+``.
    profile
        The vessel.
    run
        Folder of the ingested tables, progress, and whether to check every checksum.
    withhold
        Signals to hide, of `WITHHELD`.
    window_s
        Window of the local cubic [s]; 0 leaves all as measured.

    Raises
    ------
    FerryIdError
        For a log that cannot be used, one without actuators or heading, and a signal to withhold that it does not have.
    """
    return _read(path, profile, run, withhold, window_s)[:2]


def _read(
    path: str, profile: Profile, run: RunContext, withhold: Sequence[str], window_s: float
) -> tuple[Measurements, Survey, Opened]:
    """Return what `read_measurements` does, and the log before smoothing."""
    check_withheld(withhold)
    if not profile.actuators:
        raise FerryIdError(
            f"{profile.path}: a diagnosis weighs motion against the actuators' force, found no actuator in the profile. "
            "Fix: describe them in [[actuator]] and map their signals"
        )
    if not profile.measures_sway:
        raise FerryIdError(
            f"{profile.path}: a diagnosis weighs forces on all three axes, found surge velocity alone, without sway. "
            "Fix: map both fields of [signals.velocity], or leave it out where position and heading are measured, or use "
            "ferryid fit, which reduces the model to surge and yaw"
        )
    run.progress(f"reading {Path(path).name}")
    recording = record(path, profile, run.tables, verify=run.verify, ranges=run.ranges)
    try:
        check_sampling(recording, profile)
        faults = find_faults(recording)
        track, hidden = _without(align(recording, profile, faults=faults), withhold)
        measured = measure(track, profile, steady_force=True)
    except FerryIdError as error:
        if not (why := artificial(recording)):
            raise
        # What a simulator leaves out is not missing in a recording.
        raise FerryIdError(
            f"{recording.name}: no recording of a vessel, {why}. Fix: use recorded logs, or map measured signals in the profile"
        ) from error
    motion = smooth_measured(measured, min(MEAN_S, window_s))
    repeats = _repeats(faults.repeats, track.t0_ns)
    measurements = replace(_measurements(track, measured, profile, window_s), repeats=repeats)
    # Where a log comes from is asked of all logs together.
    doubts = doubts_of(recording, track, origin=False)
    # Windows of a diagnosis end at a gap, so that smoothing loses nothing beside it; but they need the pose.
    placeless = LeftOut.of(
        "the position or heading was not measured", measured.usable & ~measurements.usable, track.rate_hz
    )
    motion = replace(motion, left_out=(*measured.left_out, *placeless))
    said = left_out_sentences(recording, motion.left_out, measurements.usable)
    repairs = repair_sentences(recording, faults.taken_out)
    survey = Survey(
        recording,
        motion,
        UsedRows.of(motion),
        doubts,
        hidden,
        track.t0_ns,
        said,
        repairs,
        tuple(doubt.says for doubt in track.doubts if doubt.certain),
        comparable(track),
        tuple(sorted({fault.signal for fault in faults.poses if not fault.left_out})),
        averaged_out(profile, [motion]).says,
    )
    return measurements, survey, Opened(recording, track, measured)


def window_lengths(profile: Profile) -> tuple[float, float]:
    """Return length and stride [s] of the weak form's windows for a vessel."""
    length_s = window_seconds(profile)
    return length_s, length_s / STRIDES


def check_withheld(withhold: Collection[str]) -> None:
    """Refuse the name of what is no signal that can be withheld."""
    for name in withhold:
        if name not in WITHHELD:
            raise FerryIdError(
                f'--withhold: "{name}" is not a signal that can be withheld.{did_you_mean(name, WITHHELD)} '
                f"Fix: choose one of {', '.join(WITHHELD)}"
            )


def _without(track: Track, withhold: Sequence[str]) -> tuple[Track, dict[str, Floats]]:
    columns, hidden = dict(track.columns), {}
    for name in withhold:
        pair = [columns.pop(column, None) for column in WITHHELD[name]]
        first, second = pair
        if first is None or second is None or not np.any(np.isfinite(first + second)):
            raise FerryIdError(
                f"{track.log}: the {name} cannot be withheld, found none in the log. Fix: leave out --withhold {name}"
            )
        hidden[name] = np.column_stack([first, second])
    return replace(track, columns=columns), hidden


def _repeats(held: Sequence[Held], t0_ns: int) -> tuple[tuple[tuple[int, ...], float, float], ...]:
    """Return stretches of repeated values as `Measurements.repeats`; components over ground stand for surge and sway alike."""
    return tuple(
        (channels, (one.start_ns - t0_ns) * 1e-9, (one.end_ns - t0_ns) * 1e-9)
        for one in held
        if (channels := tuple(sorted({place for name in one.signals for place in CHANNELS.get(name, ())})))
    )


def _measurements(track: Track, measured: Measured, profile: Profile, window_s: float) -> Measurements:
    rows = odd_rows(window_s, track.rate_hz)
    usable = measured.usable & np.isfinite(measured.eta[:, 2])
    if not usable.any():
        raise FerryIdError(
            f"{track.log}: a diagnosis needs the heading, to distinguish forces of the environment from the vessel's, "
            "found none while velocities and actuators were measured. Fix: map [signals.heading] in the profile, or use a "
            "log that has it"
        )
    eta = measured.eta
    placed: Flags = np.asarray(np.isfinite(eta[:, :2]).all(axis=1))
    if float(np.mean(placed[usable])) >= DATA.position_share:
        usable &= placed
    else:
        eta = np.column_stack([np.full((len(eta), 2), np.nan), eta[:, 2]])
    current = None if measured.current is None else interpolate_gaps(measured.current, usable)
    eta = np.column_stack([interpolate_gaps(column[:, None], usable) for column in eta.T])
    through_water = (
        measured.nu if measured.current is None else measured.nu - current_in_body(measured.current, eta[:, 2])
    )
    parts, angles = actuator_forces(profile, track.columns, through_water, usable)
    nu_raw = interpolate_gaps(measured.nu, usable)
    return Measurements(
        profile=profile,
        t=measured.t,
        eta=eta,
        nu_raw=nu_raw,
        nu=complementary_filter(steady_cubic(nu_raw, rows), nu_raw, eta, track.rate_hz),
        parts=parts,
        angles=angles,
        usable=usable,
        wind=None if measured.wind is None else steady_cubic(interpolate_gaps(measured.wind, usable), rows),
        current=None if current is None else steady_cubic(current, rows),
        payload=None if measured.payload is None else interpolate_gaps(measured.payload, usable, held=True),
        rudders=rudder_states(profile, track.columns, through_water, usable),
        slopes=track.slopes,
        actuation=actuation_of(profile, track.columns),
    )
