"""What is wrong with a signal by itself: missing, held and wild samples, and constants."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted, verb
from ferryid.errors import FerryIdError
from ferryid.signals.thresholds import SIGNALS
from ferryid.signals.track import Track
from ferryid.types import Flags, Floats
from ferryid.vessel.frames import wrap

NAVIGATION = ("x", "y", "psi", "phi", "theta", "u", "v", "r", "vel_N", "vel_E")
POSE = ("x", "y", "psi")
VELOCITY = ("u", "v", "r", "vel_N", "vel_E")
LOAD = ("payload_kg", "payload_x")
WEATHER = ("wind_speed", "wind_from", "wind_N", "wind_E", "current_N", "current_E")
REFERENCE = ("x_d", "y_d", "psi_d")
_ACTUATOR = ("n_", "alpha_", "delta_", "F_")
_ORDER = tuple(f"{prefix}cmd_" for prefix in _ACTUATOR)

_MEDIAN_OF = 50_000

# Steps that no vessel takes from one sample to the next: at any interval, and per second of interval. Generous on
# purpose: what is removed here must be wrong on a 1 m model and on a ferry.
_POSITION = (SIGNALS.position_step_m, SIGNALS.position_rate_mps)
_ATTITUDE = (SIGNALS.attitude_step_rad, SIGNALS.attitude_rate_radps)
_SPEED = (SIGNALS.velocity_step_mps, SIGNALS.velocity_rate_mps2)
_YAW_RATE = (SIGNALS.yaw_rate_step_radps, SIGNALS.yaw_rate_rate_radps2)
_WIND = (SIGNALS.wind_step_mps, SIGNALS.wind_rate_mps2)
_CURRENT = (SIGNALS.current_step_mps, SIGNALS.current_rate_mps2)
IMPLAUSIBLE: Mapping[str, tuple[float, float]] = {
    "x": _POSITION,
    "y": _POSITION,
    "psi": _ATTITUDE,
    "phi": _ATTITUDE,
    "theta": _ATTITUDE,
    "u": _SPEED,
    "v": _SPEED,
    "vel_N": _SPEED,
    "vel_E": _SPEED,
    "r": _YAW_RATE,
    "wind_speed": _WIND,
    "wind_N": _WIND,
    "wind_E": _WIND,
    "current_N": _CURRENT,
    "current_E": _CURRENT,
}


@dataclass(frozen=True)
class ColumnQuality:
    """Findings on one column of one stream, at its native rate.

    Attributes
    ----------
    name
        Canonical name.
    count
        Number of samples.
    missing
        Samples that are NaN or infinite.
    through_wrap
        Samples between 359° and 1° that some tool interpolated through 180°; removed.
    spikes
        Single samples that were removed as implausible.
    jumps
        Implausible steps that were kept: not single, or too many.
    held
        Samples that repeat the one before, in a signal that otherwise changes; 0 for actuators, which may rest.
    longest_held_s
        Longest run of repeated samples [s].
    constant
        True where all samples are equal.
    """

    name: str
    count: int
    missing: int = 0
    through_wrap: int = 0
    spikes: int = 0
    jumps: int = 0
    held: int = 0
    longest_held_s: float = 0.0
    constant: bool = False

    def taken_out(self) -> tuple[str, ...]:
        """Return what is missing or was removed as sentences with numbers; empty for a clean column."""
        name, of = self.name, f"of {counted(self.count, 'sample')}"
        said = []
        if self.missing:
            bridged = "the value before holds" if is_load(name) else "short ones are interpolated"
            said.append(f"{name}: {self.missing} {of} {verb(self.missing, 'is')} missing (NaN); {bridged}.")
        if self.through_wrap:
            said.append(
                f"{name}: {self.through_wrap} {of} {verb(self.through_wrap, 'was')} interpolated the wrong way round "
                "between 359° and 1°; removed and interpolated."
            )
        if self.spikes:
            bridged = "held over" if is_load(name) else "interpolated"
            what = "is a single implausible spike" if self.spikes == 1 else "are single implausible spikes"
            said.append(f"{name}: {self.spikes} {of} {what}; removed and {bridged}.")
        return tuple(said)

    def remarks(self) -> tuple[str, ...]:
        """Return what was found and kept as sentences with numbers; empty for a clean column."""
        name = self.name
        said = []
        if self.jumps:
            kept = "" if name in POSE else " and kept"
            said.append(f"{name}: {counted(self.jumps, 'implausible step')} {verb(self.jumps, 'was')} found{kept}.")
        if self.held:
            share = self.held / max(1, self.count)
            which = (
                "; most samples repeat the one before: it is updated slower than it is recorded" if share > 0.5 else ""
            )
            said.append(
                f"{name}: {self.held} of {counted(self.count, 'sample')} {verb(self.held, 'repeats')} the one "
                "before, at most for "
                f"{self.longest_held_s:.2f} s{which}."
            )
        if self.constant and self.count > 1:
            said.append(f"{name}: never changes.")
        return tuple(said)


def is_order(name: str) -> bool:
    """True for a commanded value, which holds until the next one and may jump."""
    return name.startswith(_ORDER) or name in ("X_d", "Y_d", "N_d", *REFERENCE)


def is_actuator(name: str) -> bool:
    """True for an actuator's measured value."""
    return name.startswith(_ACTUATOR) and not name.startswith(_ORDER)


def is_load(name: str) -> bool:
    """True for the payload, which stays as it is until it is measured anew, and steps when somebody boards."""
    return name in LOAD


def is_angle(name: str) -> bool:
    """True for an angle that may wrap and that can be unwrapped: no rudder, and no direction of the wind."""
    return name in ("psi", "phi", "theta", "psi_d") or name.startswith("alpha_")


def unwrapped(angle: Floats) -> Floats:
    """Return an angle [rad] without jumps of 2 pi; missing samples stay missing and hide nothing after them."""
    result = angle.copy()
    finite = np.isfinite(angle)
    known = angle[finite]
    # Whole turns are counted and then multiplied once, so that hours of turning gather no rounding.
    turns = np.cumsum(np.round(np.diff(known) / (2 * np.pi)))
    result[finite] = np.concatenate([known[:1], known[1:] - 2 * np.pi * turns])
    return result


def clean(name: str, time_s: Floats, values: Floats) -> tuple[Floats, ColumnQuality]:
    """Return a column without single implausible samples, and what was found in it.

    A sample is a spike when it leaves its neighbours by more than 8 robust standard deviations of the usual
    step and more than a vessel can do, and comes back. Isolated ones become NaN; others are counted as jumps and
    kept. Orders are never touched.

    Parameters
    ----------
    name
        Canonical name; decides what is plausible.
    time_s
        Sample times [s], ascending, shape (n,).
    values
        Samples in SI units, shape (n,). Not changed.

    Returns
    -------
    values
        Shape (n,), NaN where missing, infinite or removed; angles unwrapped.
    quality
        What was found.
    """
    finite = np.isfinite(values)
    missing = int(values.size - np.count_nonzero(finite))
    through = 0
    if is_angle(name) and not is_order(name):
        between = np.flatnonzero(finite)[_through_wrap(time_s[finite], values[finite])]
        through = int(between.size)
        finite[between] = False
    known, times = (values, time_s) if missing + through == 0 else (values[finite], time_s[finite])
    result = np.where(finite, values, np.nan)
    if known.size < 2:
        return result, ColumnQuality(name, values.size, missing, through, constant=known.size == 1)
    step = np.diff(known)
    if is_angle(name):
        step = wrap(step)
    still = step == 0.0
    constant = bool(still.all())
    held, longest = 0, 0.0
    if not constant and name in NAVIGATION + WEATHER:
        held, longest = int(np.count_nonzero(still)), _longest(still, times)
    spikes = jumps = 0
    if not constant and not is_order(name) and name != "wind_from" and known.size >= 8:
        single, jumps = _spikes(name, times, known, step)
        spikes = int(single.size)
        result[np.flatnonzero(finite)[single]] = np.nan
    if is_angle(name):
        result = unwrapped(result)
    return result, ColumnQuality(name, values.size, missing, through, spikes, jumps, held, longest, constant)


def stale(time_s: Floats, columns: Mapping[str, Floats], longest_s: float) -> Flags:
    """Return which samples of a navigation stream only repeat what a sensor said long before, shape (n,).

    Every column of the stream must stand still at once for longer than `longest_s`, with a velocity that is not zero,
    in a stream that otherwise changes from sample to sample: then the sender repeats itself, and nothing was measured.
    """
    moving = [name for name in VELOCITY if name in columns]
    if not moving or time_s.size < 3 or any(is_actuator(name) or is_order(name) for name in columns):
        return np.zeros(time_s.size, dtype=bool)
    repeats = np.ones(time_s.size - 1, dtype=bool)
    for name in columns:
        repeats &= np.diff(columns[name]) == 0.0
    at_rest = np.all([columns[name][1:] == 0.0 for name in moving], axis=0)
    return _long_runs(time_s, repeats, at_rest, longest_s)


def stuck(time_s: Floats, values: Floats, longest_s: float) -> Flags:
    """Return which samples of one velocity only repeat an old one for longer than `longest_s`, shape (n,).

    A velocity that is not zero, and finer than to repeat by its resolution, never stands still to its last digit.
    """
    if time_s.size < 3:
        return np.zeros(time_s.size, dtype=bool)
    old = _long_runs(time_s, np.diff(values) == 0.0, values[1:] == 0.0, longest_s)
    if old.any() and np.unique(values[~old]).size < 0.5 * np.count_nonzero(~old):
        return np.zeros(time_s.size, dtype=bool)
    return old


def _long_runs(time_s: Floats, repeats: Flags, at_rest: Flags, longest_s: float) -> Flags:
    """Return the samples of long runs of repeats, their first excepted; none where repeats are usual."""
    old = np.zeros(time_s.size, dtype=bool)
    if not repeats.any() or repeats.mean() > SIGNALS.repeat_share:
        return old
    edges = np.flatnonzero(np.diff(np.concatenate([[False], repeats & ~at_rest, [False]]).astype(np.int8)))
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        if time_s[last] - time_s[first] > longest_s:
            old[first + 1 : last + 1] = True
    return old


def require_excited(
    track: Track, nu: Floats, tau: Floats, *, sway_measured: bool = True, steady_force: bool = False
) -> None:
    """Refuse signals from which nothing can be identified.

    Parameters
    ----------
    track
        Names the log, and says which rows are valid.
    nu, tau
        Unsmoothed velocity and applied force, shape (n, 3).
    sway_measured
        False for a sway velocity that stands as zero, which is then not asked for.
    steady_force
        True where a force that never changes is enough, as a turning circle shows what drives it off; none at all is not.

    Raises
    ------
    FerryIdError
        Where surge, sway or yaw rate is constant over the whole log, or the applied force is, or there is none.
    """
    rows = track.valid
    for name, values, unit in zip(("u", "v", "r"), nu.T, ("m/s", "m/s", "rad/s"), strict=True):
        if np.ptp(values[rows]) == 0.0 and (sway_measured or name != "v"):
            surge_alone = ", map surge velocity alone where sway is not measured" if name == "v" else ""
            raise FerryIdError(
                f"{track.log}: constant signal {name}, needed by the fit, found {values[rows][0]:g} {unit} throughout. "
                f"Fix: check that the profile maps the right field{surge_alone}, or use a log in which the vessel moves in "
                "every axis"
            )
    if np.all(np.ptp(tau[rows], axis=0) == 0.0) and not (steady_force and tau[rows][0].any()):
        force = ", ".join(f"{value:g}" for value in tau[rows][0])
        raise FerryIdError(
            f"{track.log}: constant signal, the applied force never changes, found ({force}) N, N, N·m throughout. "
            "Fix: check the actuator signals in the profile, or use a log in which the actuators are used"
        )


def _through_wrap(times: Floats, angle: Floats) -> NDArray[np.int64]:
    """Return the samples inside a full turn that takes a few samples: 359°, 240°, 120°, 1° is a turn of 2° resampled."""
    step = np.diff(angle)
    edges = np.flatnonzero(
        np.diff(np.concatenate([[0.0], np.where(np.abs(step) > SIGNALS.wrap_step_rad, np.sign(step), 0.0), [0.0]]))
    )
    inside: list[int] = []
    for first, last in pairwise(edges):
        turned = abs(float(angle[last] - angle[first]))
        if 2 <= last - first <= SIGNALS.wrap_samples and abs(turned - 2 * np.pi) < SIGNALS.wrap_rest_rad:
            rate = IMPLAUSIBLE["psi"][1]
            if times[last] - times[first] < 2 * np.pi / rate:
                inside.extend(range(int(first) + 1, int(last)))
    return np.array(inside, dtype=np.int64)


def _longest(flags: Flags, times: Floats) -> float:
    """Return the longest time [s] over which consecutive flags are set."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    if edges.size == 0:
        return 0.0
    return float(np.max(times[edges[1::2]] - times[edges[::2]]))


def _spikes(name: str, times: Floats, known: Floats, step: Floats) -> tuple[NDArray[np.int64], int]:
    """Return the samples that are isolated spikes, and the number of implausible steps that are not."""
    stride = max(1, step.size // _MEDIAN_OF)
    some = np.abs(step[::stride])
    some = some[some > 0.0]
    noise = 1.4826 * float(np.median(some)) if some.size else 0.0
    interval = np.diff(times)
    usual = float(np.median(interval[::stride]))
    if name in IMPLAUSIBLE:
        floor, per_second = IMPLAUSIBLE[name]
    else:
        low, high = np.quantile(known[::stride], [0.01, 0.99])
        floor, per_second = SIGNALS.actuator_step * float(high - low), 0.0
        if floor == 0.0:
            return np.empty(0, dtype=np.int64), 0
    stretch = np.maximum(1.0, interval / usual) if usual > 0 else np.ones_like(interval)
    limit = np.maximum(SIGNALS.spike_noises * noise * stretch, floor + per_second * interval)
    large = np.abs(step) > limit
    if not large.any():
        return np.empty(0, dtype=np.int64), 0
    out, back = step[:-1], step[1:]
    change = wrap(out + back) if is_angle(name) else out + back
    returns = np.abs(change) < 0.5 * np.minimum(np.abs(out), np.abs(back))
    peaks = np.flatnonzero(large[:-1] & large[1:] & returns) + 1
    apart = np.diff(peaks, prepend=-10, append=known.size + 10) > 3
    single = peaks[apart[:-1] & apart[1:]]
    if single.size > SIGNALS.spike_share * known.size and single.size > 1:
        single = single[:0]
    if is_actuator(name) or is_load(name):
        # These may well step; only what comes straight back is implausible.
        return single, int(peaks.size - single.size)
    return single, int(np.count_nonzero(large) - 2 * single.size)
