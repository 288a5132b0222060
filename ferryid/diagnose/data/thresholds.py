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
    summed_digits: float = threshold(
        1e-5,
        "of the usual step",
        "difference between a step of the position and the speed times one length of time below which it is their sum",
        "convention: far above the roundings of double precision, 1e-11 on paths of kilometres, and far below any sensor",
    )
    summed_steps: int = threshold(
        50,
        "steps",
        "fewest steps of a moving vessel that show where its positions come from",
        "convention: some seconds",
    )
    summed_variation: float = threshold(
        0.05,
        "of the greatest speed",
        "by how much the speed must vary for its steps to show where they come from",
        "convention: steps of a constant speed are as good as alike",
    )
    summed_share: float = threshold(
        0.9,
        "of the steps",
        "steps of the position that are a sum of velocities for which no position is a measurement",
        "convention: nearly all; a simulation may have been set back to its start in between",
    )

    along_rad: float = threshold(
        1e-6,
        "rad",
        "angle between a step of the position and the heading below which the one follows from the other",
        "convention: far above the roundings of double precision, and far below any drift angle or sensor",
    )
    along_step: float = threshold(
        1e-3,
        "of the greatest step",
        "length of a step above which its direction is known to the last digits",
        "convention: a thousandth; shorter ones are of a vessel at rest",
    )
    along_samples: int = threshold(
        3,
        "samples",
        "headings on either side of a step of the position that may belong to it",
        "convention: senders that take turns are a sample or two apart",
    )
    along_turn_rad: float = threshold(
        0.1,
        "rad",
        "range of the heading above which a vessel drifts in its turns",
        "convention: six degrees; on a straight course nothing need drift",
    )


DATA = DataThresholds()
