"""Thresholds of the comparison with further topics of a log."""

from __future__ import annotations

from dataclasses import dataclass

from ferryid.thresholds import threshold


@dataclass(frozen=True)
class SecondSourceThresholds:
    """Diagnosis: further topics of a log."""

    most_signals: int = threshold(
        24, "signals", "that are compared in one log at most", "convention: more than any vessel has of these kinds"
    )
    most_messages: int = threshold(
        5_000_000, "messages", "a topic with more is passed over", "convention: 200 Hz for seven hours, within memory"
    )
    fewest_samples: int = threshold(
        20, "samples", "a topic with fewer is passed over", "convention: no comparison in less"
    )
    fewest_windows: int = threshold(
        12,
        "windows",
        "of 8 s, 2 s apart, below which nothing is compared",
        "convention: half a minute of common motion",
    )
    most_delay_s: float = threshold(
        5.0, "s", "largest delay that is searched", "convention: longer than any filter or link delays a signal"
    )
    bridged_periods: float = threshold(
        3.0, "periods", "longest interval of samples that is interpolated", "convention: that of the mapped signals"
    )
    follows: float = threshold(
        0.5,
        "of the variance",
        "what a signal that is known by its name must have in common with the mapped one to be compared in detail",
        "convention: half",
    )
    recognised: float = threshold(
        0.98,
        "of the variance",
        "the same for a column without a telling name",
        "convention: a rudder angle has at most some nine tenths in common with the yaw rate",
    )
    recognised_delay_s: float = threshold(
        1.0, "s", "and the largest delay of it", "convention: an order is followed later, a sensor is not"
    )
    better_frame: float = threshold(
        0.02,
        "of the variance",
        "what another frame must have more in common than the usual one",
        "convention: motion on one course fits both",
    )
    unit_ratio: float = threshold(
        1.1,
        "-",
        "distance of a factor from that of a unit within which the unit is named",
        "convention: units are a factor of 1.1 and more apart, instruments are better",
    )
    constant_width: float = threshold(
        0.5,
        "of the distance from one",
        "half width of a factor's interval below which a wrong constant of a unit is named",
        "convention: wider ones hold several constants",
    )
    degrees_extent: float = threshold(
        0.1,
        "-",
        "extent of a trial below which a position may be latitude and longitude",
        "convention: ten kilometres in degrees; in metres nothing moves",
    )
    degrees_far: float = threshold(
        20.0, "extents", "and its least distance from zero", "convention: a local origin is within a trial's extent"
    )
    no_unit_ratio: float = threshold(
        1.5, "-", "factors nearer to one are no unit's", "convention: the nearest units are a factor of 1.9 off SI"
    )
    better_lag: float = threshold(
        0.8,
        "of the squared difference",
        "what a first-order lag must leave of that beside a delay to be named instead",
        "convention: a fifth less",
    )
    least_lag_s: float = threshold(
        0.5, "s", "least time constant of a lag", "derived: below, windows of 8 s cannot distinguish it from a delay"
    )
    clock_s: float = threshold(
        0.005, "s", "standard deviation of a delay by stamps and sampling", "convention: half a sample at 100 Hz"
    )
    mount_m: float = threshold(
        0.01, "m", "standard deviation of a place by where a vessel's origin is", "convention: a tape measure"
    )
    axis_rad: float = threshold(
        0.001, "rad", "standard deviation of an angle by the rounding of signals", "convention: 0.06 degrees"
    )
    same_stamps: float = threshold(
        0.9,
        "of the times",
        "topics with as many stamps in common come from one sender and count once",
        "convention: all but lost messages",
    )
    alike_errors: float = threshold(
        2.6,
        "standard errors",
        "two sensors that differ by less from each other agree against a third",
        "convention: 99 % of a normal distribution",
    )
    alike_share: float = threshold(
        0.25, "of the difference", "or by less than this of what they differ by from the third", "convention: a quarter"
    )
    on_steps: float = threshold(
        0.98, "of the values", "that are multiples of a resolution", "convention: all but a few computed ones"
    )
    coarse: float = threshold(
        0.3,
        "of the scatter",
        "rounding below this is not worth a line",
        "derived: it adds less than a tenth to the variance",
    )


SECOND = SecondSourceThresholds()
