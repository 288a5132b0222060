"""Whether a log samples the motion often enough to identify it, and whether its time goes on at all."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, sqrt
from pathlib import PurePath

import numpy as np

from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.signals.quality import NAVIGATION, is_actuator, is_order
from ferryid.signals.source import at_own_rates
from ferryid.signals.stream import Recording, Stream
from ferryid.signals.thresholds import SIGNALS
from ferryid.vessel.profile import Profile

GRAVITY = 9.81
_LEAD = ("u", "vel_N", "x", "psi")
_RECORD_FASTER = "record the navigation at a higher rate"
_UNITS = (("ms", "milliseconds", 1e3), ("us", "microseconds", 1e6), ("ns", "nanoseconds", 1e9))


def check_sampling(recording: Recording, profile: Profile) -> None:
    """Refuse a recording whose time stands still, or whose motion is sampled too slowly for the vessel.

    Raises
    ------
    FerryIdError
        As `check_advancing`, and where the samples of the velocity (or the position) are further apart than 2 sqrt(L/g).
    """
    check_advancing(recording)
    navigation = [stream for stream in recording.streams.values() if set(stream.columns) & set(NAVIGATION)]
    parts = [one for stream in navigation if len(stream.time_ns) > 1 for one in at_own_rates(stream)]
    leads = ((name, one) for name in _LEAD for one in parts if name in one.columns and len(one.time_ns) > 1)
    name, lead = next(leads, ("", None))
    if lead is None:
        return
    period_s = float(np.median(np.diff(lead.time_ns))) * 1e-9
    length_m = _length(profile)
    if period_s <= SIGNALS.slowest_period * sqrt(length_m / GRAVITY):
        return
    in_each_row = len(lead.time_ns) == len(recording.streams[lead.topic].time_ns)
    raise FerryIdError(
        f"{_file(recording)}: the motion is sampled too slowly for a fit, found {'a row' if in_each_row else name} of "
        f"{lead.topic} every {period_s:.4g} s, where a vessel of {length_m:.3g} m needs at least "
        f"{_least_hz(length_m):.2g} Hz. Fix: {_remedy(recording, lead, period_s) if in_each_row else _RECORD_FASTER}"
    )


def check_grid(profile: Profile, rate_hz: float) -> None:
    """Refuse a grid of `rate_hz` [Hz] that samples the motion of the vessel too slowly, as `check_sampling` does a log.

    Raises
    ------
    FerryIdError
        Where rows are further apart than 2 sqrt(L/g).
    """
    length_m = _length(profile)
    if 1.0 / rate_hz <= SIGNALS.slowest_period * sqrt(length_m / GRAVITY):
        return
    raise FerryIdError(
        f"--rate: {rate_hz:g} Hz is too slow for a fit, a vessel of {length_m:.3g} m needs at least "
        f"{_least_hz(length_m):.2g} Hz. Fix: give a higher rate, or leave it out for that of the navigation"
    )


def check_advancing(recording: Recording) -> None:
    """Refuse a recording without two times in it: one row, or a clock that stands still.

    Raises
    ------
    FerryIdError
        Where all navigation or all actuator signals have fewer than two times.
    """
    streams = list(recording.streams.values())
    navigation = [stream for stream in streams if set(stream.columns) & set(NAVIGATION)]
    actuators = [stream for stream in streams if any(is_actuator(name) or is_order(name) for name in stream.columns)]
    for group in (navigation, actuators):
        if group and all(len(stream.time_ns) < 2 for stream in group):
            raise FerryIdError(_standing(recording, group))


def single_rows(recording: Recording) -> str:
    """Return the message on a topic of navigation or actuators that holds one row or one time, "" where each holds more."""
    for stream in recording.streams.values():
        moving = any(name in NAVIGATION or is_actuator(name) or is_order(name) for name in stream.columns)
        if moving and len(stream.time_ns) < 2:
            return _standing(recording, [stream])
    return ""


def _remedy(recording: Recording, lead: Stream, period_s: float) -> str:
    is_table = any(topic.encoding == "table" and topic.name == lead.topic for topic in recording.topics)
    if is_table and lead.clock.resets > SIGNALS.unsorted_share * lead.clock.count:
        return f"sort the rows by time, which goes back {counted(lead.clock.resets, 'time')}"
    if is_table:
        for unit, name, scale in _UNITS:
            if SIGNALS.lowest_usual_hz <= scale / period_s <= SIGNALS.highest_usual_hz:
                setting = f'set time_unit = "{unit}" under [table] in the profile'
                if period_s < SIGNALS.unit_period_s:
                    return f"{_RECORD_FASTER}, or {setting} if these are {name}"
                return f"these look like {name}, so {setting}"
    return _RECORD_FASTER


def _standing(recording: Recording, streams: Sequence[Stream]) -> str:
    stream = max(streams, key=lambda one: one.clock.count + one.clock.dropped)
    rows = stream.clock.count + stream.clock.dropped
    file = _file(recording, stream.topic)
    if rows < 2:
        found = "one row only" if rows else "no row"
        return f"{file}: {stream.topic} holds {found}, and motion needs many. Fix: use a longer log"
    is_table = any(topic.encoding == "table" for topic in recording.topics)
    found = f"{counted(rows, 'row')} of {stream.topic}" if is_table else f"{counted(rows, 'message')} on {stream.topic}"
    remedy = (
        "name another time column under [table] in the profile, or record the log again"
        if is_table
        else "record the log again with a running clock"
    )
    return f"{file}: time does not advance, found {found} with the same time. Fix: {remedy}"


def _least_hz(length_m: float) -> float:
    return 1.0 / (SIGNALS.slowest_period * sqrt(length_m / GRAVITY))


def _length(profile: Profile) -> float:
    """Length of the hull [m]; where the profile does not give it, four radii of gyration."""
    hull = profile.hull
    return hull.length_m if isfinite(hull.length_m) else 4.0 * sqrt(hull.inertia_z / hull.mass_kg)


def _file(recording: Recording, topic: str = "") -> str:
    """Return the file of a topic where each has its own, else the first of the log."""
    own = (file for file in recording.files if topic and PurePath(file).with_suffix("").as_posix().endswith(topic))
    return next(own, recording.files[0] if recording.files else recording.name)
