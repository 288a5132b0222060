"""Streams that turn out to hold no row: their signals are missing, or the log cannot be used."""

from __future__ import annotations

from dataclasses import replace

from ferryid.errors import FerryIdError
from ferryid.signals.stream import Recording
from ferryid.vessel.profile import Profile
from ferryid.vessel.signal_map import Selection, is_in, lacking_signals


def without_empty(recording: Recording, profile: Profile, where: str, remedy: str) -> Recording:
    """Return a recording whose streams all hold a row; the signals of the others are missing.

    Parameters
    ----------
    recording
        The streams, some perhaps without a row.
    profile
        Says which signals are needed.
    where
        In what there is no row, to stand after "holds no row"; empty in all of the log.
    remedy
        What to do where a needed signal is missing.

    Raises
    ------
    FerryIdError
        Where a needed signal has no row.
    """
    empty = [name for name, stream in recording.streams.items() if not len(stream.time_ns)]
    if not empty:
        return recording
    found, missing = dict(recording.found), dict(recording.missing)
    for name in empty:
        for column in recording.streams[name].columns:
            found.pop(column, None)
        missing |= {one.quantity: f"{name} holds no row{where}" for one in profile.signals if is_in(one, name)}
    lacking = lacking_signals(profile, Selection({}, found, missing))
    if lacking:
        raise FerryIdError(
            f"{recording.name}: {lacking[0].quantity} is needed by the profile {profile.name}, "
            f"{missing[lacking[0].quantity]}. Fix: {remedy}"
        )
    streams = {name: stream for name, stream in recording.streams.items() if len(stream.time_ns)}
    return replace(recording, streams=streams, found=found, missing=missing)
