"""Thresholds by which measurements enter a diagnosis, and a recording is compared with a simulation."""

from __future__ import annotations

from dataclasses import dataclass

from ferryid.thresholds import threshold


@dataclass(frozen=True)
class DataThresholds:
    """Diagnosis: data."""

    position_share: float = threshold(
        0.8,
        "of the usable rows",
        "rows with a position, above which positions are used and velocities only in products",
        "convention: most of them",
    )
    payload_aboard: float = threshold(
        0.5, "of the heaviest load", "measured load above which it is aboard", "convention: half"
    )
    shift_s: float = threshold(
        60.0,
        "s",
        "largest offset between the clocks of a recording and its simulation",
        "convention: the time from the start of a recorder to that of a manoeuvre",
    )
    length_difference: float = threshold(
        0.2,
        "-",
        "relative difference in length above which two logs are not of the same manoeuvre",
        "convention: a fifth",
    )
    path_distance: float = threshold(
        0.5,
        "of the path's extent",
        "distance of two paths, in the root mean square, above which they are not of the same manoeuvre",
        "convention: half; effects move a vessel less far off its path",
    )
    no_noise: float = threshold(
        2e-3,
        "of the velocity's standard deviation",
        "difference between steps of the pose and the integral of the velocity below which a log is a simulator's",
        "convention: a fifth of what optical tracking on a carriage in a tank leaves on its worst axis",
    )


DATA = DataThresholds()
