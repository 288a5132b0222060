"""Thresholds by which samples and rows of a log are left out, repaired or kept, and logs refused."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ferryid.thresholds import threshold


@dataclass(frozen=True)
class SignalThresholds:
    """Signals."""

    gap_periods: float = threshold(
        3.0,
        "periods",
        "a stretch without samples is a gap if longer than this and than `gap_s`",
        "convention: one or two messages may be lost",
    )
    gap_s: float = threshold(0.5, "s", "shortest gap", "convention: a vessel's velocity changes little meanwhile")
    rows_apart: float = threshold(
        2.0,
        "rows",
        "distance of the values of a column of a table from which the rows between are other sensors'",
        "derived: another sensor of the same rate has the rows between",
    )
    regular_range: tuple[float, ...] = threshold(
        (0.6, 1.6),
        "of the usual",
        "distances between the values of such a column that count as regular",
        "derived: a sensor of 4 Hz has values two and three rows of 10 Hz apart",
    )
    regular_share: float = threshold(
        0.6,
        "of the distances",
        "that are regular at least where a column has a rate of its own",
        "derived: where values are lost at random, less than half are",
    )
    neighbouring_share: float = threshold(
        0.1,
        "of the values",
        "that may lie on neighbouring rows where a column has a rate of its own",
        "convention: all but a few; of values lost at random in nine rows of ten it is as many",
    )
    slowest_sensor_s: float = threshold(
        10.0,
        "s",
        "usual distance from which on the values of a column are what is left of a sensor that fails",
        "convention: slow receivers and logs report the motion every ten seconds",
    )
    slowest_weather_s: float = threshold(
        900.0, "s", "the same of wind and current", "convention: stations report means over ten minutes, with room"
    )
    fewest_weather_values: int = threshold(
        3, "values", "fewest of wind or current that are a rate of their own", "derived: two have one distance"
    )
    fewest_rests: int = threshold(
        10,
        "rests",
        "fewest intervals longer than `gap_periods` of the usual, where an order in most rows is written when it changes",
        "convention: a recorder fails less often",
    )
    stuck_periods: float = threshold(
        10.0,
        "periods",
        "a velocity that repeats for longer than this and than a gap was not measured",
        "convention: more repeats than a coarse resolution makes of a moving vessel",
    )
    irregular_share: float = threshold(
        0.1,
        "of the intervals",
        "intervals longer than a gap, above which a stream may be sent on change",
        "convention: a tenth; lost messages are fewer",
    )
    new_share: float = threshold(
        0.9, "of the messages", "messages with a new value, above which it is", "convention: nearly all of them"
    )
    decimation_ratio: float = threshold(
        1.9,
        "-",
        "rate over that of the grid above which a stream is averaged over intervals instead of sampled",
        "derived: below 2, so that a stream of nearly twice the rate of the grid is not aliased",
    )
    most_grid_rows: int = threshold(
        2_000_000,
        "rows",
        "a longer grid with fewer samples than `most_rows_per_sample` asks for comes of wrong times",
        "convention: more than a day at 20 Hz",
    )
    most_rows_per_sample: int = threshold(
        50, "rows a sample", "see `most_grid_rows`", "convention: 98 % of the log would be gaps"
    )
    pause_share: float = threshold(
        0.5,
        "of the log",
        "a pause of this share explains a log that is too long; otherwise its times are wrong",
        "convention: half",
    )
    unmeasured_end_s: float = threshold(
        2.0,
        "s",
        "rows without a signal at either end of the common time are counted as left out from this length on",
        "convention: recorders start and stop topics within this time of each other",
    )
    overlap_ns: int = threshold(
        2_000_000_000,
        "ns",
        "time that a topic may cut from the others' at either end without being reported",
        "convention: recorders start and stop topics within this time of each other",
    )
    heading_share: float = threshold(
        0.8, "of the rows", "rows with a heading, above which a row without one is left out", "convention: most of them"
    )
    weather_share: float = threshold(
        0.8, "of the rows", "rows with wind, current or payload, below which it is not used", "convention: most of them"
    )
    least_payload: float = threshold(
        -0.5,
        "hull masses",
        "lowest payload that is accepted",
        "convention: a scale has an error below zero; half is none",
    )
    most_payload: float = threshold(
        10.0,
        "hull masses",
        "highest payload that is accepted",
        "convention: a pontoon carries much; more is another unit",
    )
    slowest_period: float = threshold(
        2.0,
        "sqrt(L/g)",
        "longest sampling period from which a vessel of length L is identified",
        "derived: Froude's law of time; sway and yaw settle within several of these",
    )
    unit_period_s: float = threshold(
        20.0,
        "s",
        "rows further apart are in another unit of time, not recorded so slowly",
        "convention: no motion of a vessel is recorded at such a period",
    )
    unsorted_share: float = threshold(
        0.1,
        "of the rows",
        "rows at which time goes back above which a table is not sorted by time, rather than that its clock was set",
        "convention: nobody sets a clock at every tenth row; half of the rows of a shuffled table go back",
    )
    lowest_usual_hz: float = threshold(
        0.5, "Hz", "lowest rate that another unit of time must give", "convention: rates at which logs are recorded"
    )
    highest_usual_hz: float = threshold(
        2000.0, "Hz", "highest rate that another unit of time must give", "convention: rates at which logs are recorded"
    )
    epoch_ns: int = threshold(
        946_684_800 * 10**9,
        "ns",
        "earlier times count from the start of the log or are of a clock that was not set",
        "derived: the year 2000, after the dates at which clocks begin (1970, 1980) and before any log",
    )
    short_windows: float = threshold(
        15.0,
        "windows",
        "length of a log below which it is joined to one that it follows without a break",
        "derived: 60 windows that begin a quarter of one apart, below which nothing is tested (`fewest_windows`)",
    )
    short_s: float = threshold(
        120.0,
        "s",
        "the same of small vessels, whose windows are short",
        "convention: a bag of a minute, with room; too short to hold out more than one manoeuvre",
    )
    joined_s: float = threshold(
        1200.0,
        "s",
        "longest log that is made of such logs",
        "convention: sixty bags of 20 s; wind and current are constant over a log",
    )
    break_s: float = threshold(
        5.0,
        "s",
        "longest break between such logs, by clocks that were set",
        "convention: a recorder begins its next file; one that is started again by hand, 35 s later and more in a campaign on "
        "a lake, begins another run",
    )
    break_samples: float = threshold(
        2.0,
        "samples",
        "the same where times are no dates",
        "derived: the next sample but for jitter; logs that have nothing to do with each other hardly meet so closely",
    )
    position_step_m: float = threshold(
        1.0,
        "m",
        "step of a position that is plausible at any interval, and least jump",
        "convention: wrong on a 1 m model and on a ferry",
    )
    position_rate_mps: float = threshold(
        15.0,
        "m/s",
        "added to `position_step_m` per second of interval, and highest speed of a jump",
        "convention: beyond the speed of a ferry",
    )
    attitude_step_rad: float = threshold(
        0.15,
        "rad",
        "step of heading, roll or pitch that is plausible at any interval",
        "convention: wrong on a 1 m model and on a ferry",
    )
    attitude_rate_radps: float = threshold(
        2.0,
        "rad/s",
        "added to `attitude_step_rad` per second of interval, and highest rate of a heading's jump",
        "convention: beyond the yaw rate of a 1 m model",
    )
    velocity_step_mps: float = threshold(
        0.3,
        "m/s",
        "step of a velocity that is plausible at any interval",
        "convention: wrong on a 1 m model and on a ferry",
    )
    velocity_rate_mps2: float = threshold(
        3.0,
        "m/s²",
        "added to `velocity_step_mps` per second of interval",
        "convention: beyond the acceleration of a 1 m model",
    )
    yaw_rate_step_radps: float = threshold(
        0.1,
        "rad/s",
        "step of a yaw rate that is plausible at any interval",
        "convention: wrong on a 1 m model and on a ferry",
    )
    yaw_rate_rate_radps2: float = threshold(
        1.0,
        "rad/s²",
        "added to `yaw_rate_step_radps` per second of interval",
        "convention: beyond the acceleration of a 1 m model",
    )
    wind_step_mps: float = threshold(
        10.0, "m/s", "step of a wind that is plausible at any interval", "convention: the largest gust"
    )
    wind_rate_mps2: float = threshold(
        10.0, "m/s²", "added to `wind_step_mps` per second of interval", "convention: the largest gust within a second"
    )
    current_step_mps: float = threshold(
        0.5,
        "m/s",
        "step of a current that is plausible at any interval",
        "convention: a strong current comes into view",
    )
    current_rate_mps2: float = threshold(
        1.0,
        "m/s²",
        "added to `current_step_mps` per second of interval",
        "convention: a strong current within a second",
    )
    actuator_step: float = threshold(
        0.25,
        "of the signal's range",
        "the same of an actuator, between its quantiles of 1 and 99 %",
        "convention: a quarter, as its size is not known here",
    )
    spike_noises: float = threshold(
        8.0,
        "robust standard deviations",
        "step from sample to sample and back beyond which a sample is a spike",
        "convention: noise of any usual distribution hardly gets there",
    )
    spike_share: float = threshold(
        0.01, "of the samples", "more spikes are noise, and are kept", "convention: one per cent; spikes are rare"
    )
    wrap_step_rad: float = threshold(
        0.2, "rad", "least step of a heading that was interpolated through its wrap", "convention: faster than any turn"
    )
    wrap_samples: int = threshold(
        5, "steps", "most steps of such a wrap", "convention: the few samples of an interpolation between two fixes"
    )
    wrap_rest_rad: float = threshold(
        0.6, "rad", "largest difference of their sum from a full turn", "convention: what the vessel may turn meanwhile"
    )
    repeat_share: float = threshold(
        0.2,
        "of the samples",
        "more repeats are a slow or coarse signal, and a long run of them is no fault",
        "convention: a fifth; faults are rarer",
    )
    pose_margin_s: float = threshold(
        0.5,
        "s",
        "left out on either side of a wrong pose",
        "convention: filters of the sender carry a jump on, and the grid interpolates",
    )
    pose_fixes: int = threshold(20, "poses", "fewer are not judged", "convention: too few for a median of steps")
    jump_noises: float = threshold(
        10.0, "usual steps", "least jump of a pose that no motion explains", "convention: far beyond noise"
    )
    jump_speeds: float = threshold(
        3.0,
        "usual highest speeds",
        "and least speed of a jump",
        "convention: no vessel moves as fast as that by its usual speed",
    )
    speed_quantile: float = threshold(
        0.98,
        "-",
        "quantile of the speeds between poses that is the usual highest",
        "convention: leaves out the jumps themselves",
    )
    least_speed_mps: float = threshold(
        1.5, "m/s", "lower limit of the speed of a jump of a position", "convention: a log at rest has no usual speed"
    )
    least_rate_radps: float = threshold(
        0.5, "rad/s", "lower limit of the rate of a jump of a heading", "convention: a log at rest has no usual rate"
    )
    heading_jump_rad: float = threshold(
        0.35, "rad", "least jump of a heading", "convention: 20°; smaller ones may be a compass"
    )
    jump_share: float = threshold(
        0.02, "of the poses", "more jumps are noise, and are kept", "convention: two per cent; jumps are rare"
    )
    return_share: float = threshold(
        0.4,
        "of the jump",
        "distance from its place within which a pose has come back, if the vessel moves no farther",
        "convention: nearer to the old place than to the new one",
    )
    drift_share: float = threshold(
        0.2,
        "of the way",
        "uncertainty of a way by the measured velocity",
        "convention: a velocity scale may be wrong by that",
    )
    measured_ways: float = threshold(
        2.0,
        "ways",
        "way by the measured velocity beyond which a jump is not explained by it",
        "convention: twice, for velocities that are averaged or scaled",
    )
    held_steps: float = threshold(
        5.0,
        "usual steps",
        "a fix that repeats was lost if the vessel is farther than this afterwards",
        "convention: beyond noise",
    )
    held_way_share: float = threshold(
        0.25,
        "of the step",
        "share that the measured velocity, where there is one, must account for",
        "convention: a quarter; otherwise the vessel did not move and the step is a jump",
    )
    held_periods: float = threshold(
        4.0,
        "periods",
        "a fix that repeats for longer than this and than `held_s` is held",
        "convention: beyond lost messages",
    )
    held_s: float = threshold(0.5, "s", "shortest held fix", "convention: as the shortest gap")
    origin_s: float = threshold(
        10.0,
        "s",
        "a stretch after a jump is kept, as with another origin, if longer than this or than `origin_share`",
        "convention: a receiver that is lost comes back sooner",
    )
    origin_share: float = threshold(0.25, "of the log", "see `origin_s`", "convention: a quarter, for short logs")
    consistent_share: float = threshold(
        0.4,
        "of the poses",
        "where fewer are consistent, only the jumps are left out",
        "convention: no part of less than that is known to be the right one",
    )
    clear_jump: float = threshold(
        2.0, "limits", "size of a jump that may lead away and back", "convention: twice what no motion explains"
    )
    cancel_share: float = threshold(0.1, "of the jump", "what two jumps that cancel may leave", "convention: a tenth")
    cancel_s: float = threshold(
        120.0,
        "s",
        "longest time between two jumps that cancel",
        "convention: two minutes, in which a receiver recovers",
    )
    flip_rad: float = threshold(
        float(np.radians(20.0)),
        "rad",
        "largest difference from 180° of a heading that is turned round",
        "convention: 20°, what a vessel turns meanwhile and a compass errs",
    )
    step_rad: float = threshold(
        float(np.radians(5.0)),
        "rad",
        "least step of a heading that stays",
        "convention: 5°, as a compass errs by as much from one heading to the next",
    )
    step_noises: float = threshold(
        10.0,
        "usual differences",
        "and least step over the usual difference of heading and integrated yaw rate",
        "convention: far beyond noise",
    )
    step_side_s: float = threshold(
        3.0, "s", "time before and after over which a heading is compared", "convention: longer than a spike"
    )
    step_within_s: float = threshold(
        0.5, "s", "longest duration of a step", "convention: what takes longer may be an error of the yaw rate"
    )
    step_share: float = threshold(
        0.7,
        "of the step",
        "share that must happen within `step_within_s`",
        "convention: most of it, for a heading that is filtered",
    )
    step_samples: int = threshold(
        20, "samples", "shorter logs are not searched for steps", "convention: too few for a median"
    )
    moved_periods: float = threshold(
        10.0,
        "usual intervals of new values",
        "a velocity that stays for longer than this and than `moved_s` is held",
        "convention: beyond lost messages",
    )
    moved_s: float = threshold(0.5, "s", "shortest held velocity", "convention: as the shortest gap")
    moved_window_s: float = threshold(
        5.0,
        "s",
        "mean over which a velocity is compared with the pose's",
        "convention: noise of positions weighs little over it",
    )
    moved_share: float = threshold(
        0.25,
        "of the usual speed",
        "by which the pose must move otherwise than a held velocity",
        "convention: a quarter",
    )
    moved_m: float = threshold(0.5, "m", "and how far", "convention: beyond noise of positions")
    moved_rad: float = threshold(0.1, "rad", "and how far a heading turns", "convention: beyond noise of a compass")
    moved_steps: float = threshold(
        5.0, "usual steps", "and how far in steps of the pose", "convention: beyond its resolution"
    )
    moved_noises: float = threshold(
        3.0, "standard deviations", "and how fast over the usual difference", "convention: 99.7 % confidence"
    )
    dead_band: float = threshold(
        0.01, "-", "quantile of speeds below which an instrument may read zero", "convention: the slowest one per cent"
    )
    moved_poses: int = threshold(3, "poses", "fewer are not judged", "derived: least for a mean and a change of it")
    certain_correlation: float = threshold(
        0.9,
        "-",
        "correlation of a velocity and the pose above which a wrong sign or unit is certain and the log refused",
        "convention: a fifth of the variance is left to noise",
    )
    related_correlation: float = threshold(
        0.5, "-", "correlation below which a velocity does not follow the pose", "convention: a quarter of the variance"
    )
    unit_gain: float = threshold(
        0.15,
        "-",
        "relative difference from the factor of a unit within which that unit is named",
        "convention: units are a factor of 1.8 or more apart",
    )
    gain_error: float = threshold(
        0.05, "-", "a gain nearer to one is no contradiction", "convention: five per cent is a matter of calibration"
    )
    rudder_share: float = threshold(
        0.05,
        "of the rows",
        "of a rudder beyond 90 degrees above which its angle is in another unit, or has an offset",
        "convention: single wrong samples are fewer",
    )
    gain_quantile: float = threshold(
        0.995,
        "-",
        "of Student's t for the ends of a gain's interval",
        "derived: 99 % two-sided, as every log has three gains",
    )
    gain_span_s: float = threshold(
        2.0,
        "s",
        "changes of a pose over which velocities are compared with it",
        "convention: above noise, below a manoeuvre",
    )
    gain_block_s: float = threshold(
        30.0,
        "s",
        "blocks whose scatter gives a gain's standard error",
        "convention: longer than errors of a navigation filter last",
    )
    gain_blocks: int = threshold(
        8, "blocks", "least number, for which blocks of short logs are shorter", "convention: a usable scatter"
    )
    gain_spans: int = threshold(
        10, "changes", "fewer are not judged", "convention: a correlation of fewer may be chance"
    )
    least_turn_rad: float = threshold(
        0.035, "rad", "root mean square of the turns that are needed", "convention: 2°, above the noise of a compass"
    )
    least_way_m: float = threshold(
        0.2, "m", "root mean square of the ways that are needed", "convention: above the noise of positions"
    )
    mirror_span_s: float = threshold(
        4.0,
        "s",
        "ways over which frames are compared with their mirror images",
        "convention: above noise, below a manoeuvre",
    )
    mirror_spans: int = threshold(15, "ways", "fewer are not judged", "convention: a minute of motion")
    mirror_way_m: float = threshold(
        0.2, "m", "root mean square of the ways that are needed", "convention: above the noise of positions"
    )
    mirror_correlation: float = threshold(
        0.95,
        "-",
        "correlation of the mirrored frame above which the log is refused",
        "tuned on logs that were wrongly refused: raised from 0.9 for ships in turns, swell and distant antennas",
    )
    mirror_ratio: float = threshold(
        10.0,
        "-",
        "unexplained variance as declared over that when mirrored",
        "convention: no doubt which of two is right",
    )
    mirror_rounding: float = threshold(
        1e-9, "of the variance", "least that a hand is said to leave", "derived: rounding of sums over a long log"
    )
    course_mirrored: float = threshold(
        0.9,
        "mean resultant length",
        "of course plus heading above which a heading turns the wrong way round",
        "convention: a circular standard deviation of 26 degrees, of drift angles in manoeuvres",
    )
    course_off_deg: float = threshold(
        45.0,
        "deg",
        "mean angle between course and heading beyond which the heading's zero is in doubt",
        "convention: half a right angle, beyond drift angles; axes of another frame are off by a whole one",
    )
    shared_samples: float = threshold(
        0.1,
        "of the places of the shorter log",
        "samples in sequence that another log has as well, above which both hold one recording",
        "convention: a tenth; no two recordings have eight changing samples in sequence alike",
    )
    quantum_slack: float = threshold(
        1e-3,
        "of half a quantum",
        "by which values may differ more than rounding makes them",
        "convention: roundings of conversions are less, and values of one sensor differ by whole quanta",
    )
    rounded_quanta: float = threshold(
        2.0,
        "quanta",
        "by which rows have to change to show that two logs are one, rounded",
        "convention: more than one; neighbouring quanta are alike in many trials",
    )
    quantum_steps: int = threshold(
        128,
        "steps",
        "between neighbouring values of a signal, of which its quantum near them is found",
        "convention: many enough to be small, few enough that values rounded to digits have one quantum",
    )
    divided_steps: int = threshold(
        8,
        "steps",
        "of the smallest quarter of these, whose common divisor the quantum is",
        "derived: eight whole numbers at random have a common divisor once in 250 times",
    )
    least_quantum: float = threshold(
        2.0**-30,
        "of the largest value",
        "least quantum that is found",
        "derived: far below single precision, in which values may differ in any case, and far above roundings of double",
    )
    quantum_rests: float = threshold(
        16.0,
        "least quanta",
        "up to which a common divisor is what is left of steps that have none",
        "derived: of such steps it is between one and a few of them",
    )
    single_precision: float = threshold(
        2.0**-23,
        "of the value",
        "by which values of two logs may differ in any case",
        "derived: single precision, in which formats keep them",
    )
    least_marks: int = threshold(
        2,
        "places of a training log",
        "samples in sequence whose hashes a model file has, found in another log, from which that can be the training log",
        "convention: more than one, as at shared_samples; a hash is equal to another by chance once in 4e15",
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
    feedback_doublings: int = threshold(
        4,
        "doublings",
        "of the first step's past, over which forces are searched for an answer to errors of the motion",
        "derived: sixteen of the twenty steps of a window, the time over which errors are judged",
    )


SIGNALS = SignalThresholds()
