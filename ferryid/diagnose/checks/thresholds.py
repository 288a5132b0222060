"""Thresholds of the sensor checks."""

from __future__ import annotations

from dataclasses import dataclass

from ferryid.thresholds import threshold


@dataclass(frozen=True)
class CheckThresholds:
    """Diagnosis: sensor checks."""

    false_alarm: float = threshold(
        1e-4,
        "-",
        "probability by chance below which a parameter differs from its neutral value",
        "tuned on simulated logs: 1e-3 was tried and taken back",
    )
    independent_strides: int = threshold(
        15,
        "strides",
        "residuals this far apart are taken as independent",
        "convention: 30 s, longer than errors of a navigation filter last",
    )
    fewest_blocks: int = threshold(
        12,
        "blocks",
        "of independent residuals; in logs too short for so many, blocks are shorter",
        "convention: the scatter of fewer does not give an error",
    )
    overlapping_strides: int = threshold(
        4, "strides", "shortest such block", "derived: windows of 8 s, 2 s apart, overlap within it"
    )
    error_growth: float = threshold(
        0.35,
        "-",
        "power of a block's length by which errors grow with it",
        "tuned on Esso Osaka, milliAmpère and Gunnerus: blocks of 30 s give 1.0 to 1.6 times the errors of blocks of 8 s",
    )
    outlier: float = threshold(
        6.0,
        "usual residuals",
        "windows beyond are left out of the comparison of position and velocity",
        "convention: a position that jumps, not noise",
    )
    gross: float = threshold(
        0.2,
        "-, rad",
        "error of a velocity's scale or angle that is estimated from the start",
        "convention: beyond it no first step of the estimate would be short enough",
    )
    slow_mps: float = threshold(
        0.02, "m/s", "root mean square of the speed below which nothing is compared", "convention: noise of positions"
    )
    slow_radps: float = threshold(
        0.003,
        "rad/s",
        "standard deviation of the yaw rate below which nothing is compared",
        "convention: noise of a gyro",
    )
    least_delay_s: float = threshold(
        0.1, "s", "least clock offset of position and velocity", "convention: a few samples of a navigation"
    )
    least_angle_deg: float = threshold(1.0, "deg", "least heading bias", "convention: the accuracy of a good compass")
    least_arm_m: float = threshold(0.15, "m", "least lever arm", "convention: how well an antenna's place is measured")
    least_arm_share: float = threshold(
        0.02, "of the length", "and over the vessel's length", "convention: how well an antenna's place is measured"
    )
    least_scale: float = threshold(
        0.03, "-", "least error of a velocity's scale", "convention: the accuracy of a speed log"
    )
    unit_width: float = threshold(
        0.25,
        "of the factor",
        "width of the scale's interval above which no unit is named",
        "convention: units are a factor of 1.8 or more apart",
    )
    scale_known: float = threshold(
        0.25,
        "of the factor",
        "half of the interval of a velocity's scale above which it is a hint: the two are not in proportion",
        "convention: an instrument that reads too much does so by a factor; one known to a quarter is hardly one",
    )
    least_rate_scale: float = threshold(
        0.02, "-", "least error of a yaw rate's scale", "convention: above the scale error of a low-cost gyro"
    )
    turn_s: float = threshold(
        60.0,
        "s",
        "length of the blocks of which a yaw rate's scale has a factor each",
        "convention: a turn or two of a vessel",
    )
    fewest_turns: float = threshold(
        4.0,
        "-",
        "blocks with as much of a turn as each other from which on the scatter of their factors is asked for",
        "convention: a standard deviation of fewer values is off by half and more",
    )
    turns_alike: float = threshold(
        0.95,
        "of the turns",
        "in which a yaw rate's factor is on the same side of 1 at least, or it is a hint",
        "convention: an instrument that reads too much does so in every turn",
    )
    scale_without_bias: float = threshold(
        0.5,
        "of what the factor is off",
        "by which a yaw rate's scale is off without a bias of the gyro at least: any factor and a bias explain a steady turn",
        "convention: a gyro's bias is small beside the rates of a turn",
    )
    rounding_share: float = threshold(
        0.01,
        "of the variance of the yaw rate",
        "that rounding of the heading may have at most; windows are longer otherwise",
        "derived: it lowers the scale of the yaw rate by as much, half of the least error of that",
    )
    part_freedom: int = threshold(
        4,
        "-",
        "degrees of freedom of an error from which on a part of a log has a say in whether its parts agree",
        "derived: the variance of Student's distribution is twice that of the normal one there, and infinite at two",
    )
    window_samples: float = threshold(
        8.0,
        "samples in a window",
        "below which the fastest motions that it passes are not known well enough for a factor near one",
        "derived: a window passes up to two periods, and lines between four samples a period keep two thirds of the power",
    )
    sparse_scale: float = threshold(
        0.5,
        "-",
        "least error of a scale with fewer samples",
        "derived: slopes of lines keep 0.67 of the fastest motions at seven samples a window; a wrong unit is farther off",
    )
    filtered_scale: float = threshold(
        0.001,
        "-",
        "standard deviation of a yaw rate's scale by filters between sensors and log",
        "convention: a heading that was steadied by the gyro has a little of its error",
    )
    least_azimuth_error: float = threshold(
        0.02,
        "of the thrust",
        "least error across the thrust by rounded azimuth angles",
        "tuned on cases of `ferryid prove`: that of steps of four degrees, 4°/√12; eight degrees before",
    )
    azimuth_held: float = threshold(
        0.1,
        "of the rows",
        "repeats of a rounded angle at least",
        "convention: an angle that is not rounded never repeats",
    )
    azimuth_on_grid: float = threshold(
        0.95, "of the repeats", "that must be multiples of the step", "convention: all but a few interpolated ones"
    )
    azimuth_close: float = threshold(
        0.01,
        "steps",
        "distance from a multiple of the step that counts as one",
        "convention: rounding of printed angles",
    )
    azimuth_slew_degps: float = threshold(
        30.0,
        "deg/s",
        "speed of an azimuth thruster: a reading that lasts longer than a step then takes is the angle",
        "convention: usual for small electric thrusters",
    )
    held_runs: float = threshold(
        4.0,
        "usual runs",
        "runs of repeats longer than this are not the sensor's rate",
        "convention: beyond lost messages",
    )
    held_rows: int = threshold(5, "rows", "and longer than this", "convention: fewer repeats by chance")
    held_s: float = threshold(0.4, "s", "and longer than this", "convention: two periods of a slow navigation")
    coarse_share: float = threshold(
        0.1,
        "of the changes",
        "fewer different changes are a coarse resolution, which makes repeats",
        "convention: a tenth",
    )
    straight_share: float = threshold(
        0.2,
        "of the rows",
        "rows exactly between their neighbours above which a channel was interpolated before it was recorded",
        "convention: a fifth; noise never is",
    )
    held_jump: float = threshold(
        4.0,
        "usual changes",
        "jump at the end of a hold in coarse or interpolated channels",
        "convention: beyond the resolution",
    )
    held_missed: float = threshold(
        0.5,
        "of the usual motion",
        "what a hold's end must make up for of the motion in as long",
        "convention: half; a slow motion below the resolution does not jump",
    )
    held_around: int = threshold(
        20,
        "holds",
        "length of the stretch on either side that gives the usual motion",
        "convention: the same manoeuvre",
    )
    least_held_share: float = threshold(
        0.005, "of the log", "least share of holds that is reported", "convention: fewer do no harm"
    )
    long_held_s: float = threshold(
        2.0, "s", "or a hold as long as this, with `long_held_share`", "convention: a quarter of a window"
    )
    long_held_share: float = threshold(0.001, "of the log", "see `long_held_s`", "convention: fewer do no harm")
    wrap_rate_radps: float = threshold(
        1.5, "rad/s", "difference of heading and yaw rate at a wrong wrap", "convention: beyond any error of a gyro"
    )
    wrap_near_rad: float = threshold(
        0.5, "rad", "distance of a heading from the wrap before and after", "convention: what a vessel turns meanwhile"
    )
    idle_share: float = threshold(
        1e-3, "of the largest force", "force below which an actuator is idle", "convention: friction and rounding"
    )
    idle_s: float = threshold(3.0, "s", "shortest time without force", "convention: longer than thrusters take to stop")
    idle_mean_s: float = threshold(
        1.0, "s", "mean of the surge velocity before its slope is taken", "convention: above noise"
    )
    idle_gain_mps: float = threshold(
        0.5, "m/s", "least gain in speed along the bow", "convention: an idle vessel in a gale drifts as fast"
    )
    idle_force: float = threshold(
        0.25, "of the largest force", "least force of the acceleration", "convention: weather does not push as strongly"
    )
    opposed_span_s: float = threshold(
        4.0,
        "s",
        "windows over which forces and accelerations are compared",
        "convention: above noise, below a manoeuvre",
    )
    opposed_windows: int = threshold(60, "windows", "fewer are not judged", "convention: four minutes of motion")
    least_response: float = threshold(
        0.2,
        "1/mass",
        "least acceleration by a force, as a mass of five times the hull's gives",
        "convention: added mass of four times the hull's",
    )
    most_response: float = threshold(
        5.0, "1/mass", "largest acceleration by a force", "convention: the reciprocal of the least"
    )
    response_angle_deg: float = threshold(
        30.0,
        "deg",
        "largest angle between force and acceleration",
        "convention: surge and sway masses differ",
    )
    opposed_left: float = threshold(
        0.3,
        "of the acceleration",
        "a change of signs, angles or clocks must leave less unexplained, and the profile as it is more",
        "convention: most of the motion follows from the force",
    )
    opposed_ratio: float = threshold(
        3.0, "-", "and this many times less than the profile as it is", "convention: no doubt which of two is right"
    )
    apart_s: float = threshold(
        4.0,
        "s",
        "least offset of actuators' and navigation's clocks for which a log is refused",
        "convention: beyond what the effect of a delay is for",
    )
    apart_ratio: float = threshold(
        10.0,
        "-",
        "what every other offset leaves unexplained over the best one",
        "tuned on logs that were wrongly refused, as swell and turns look alike at several offsets",
    )
    no_push: float = threshold(
        1e-6, "-", "share of a force that is left beside drag and lift, below which there is none", "derived: rounding"
    )
    pooled_logs: int = threshold(
        2,
        "logs",
        "that show a lasting error by themselves, from which on it is pooled over a campaign",
        "convention: several",
    )
    pooled_scatter: float = threshold(
        0.5,
        "of the error",
        "scatter between logs above which they have no value in common",
        "convention: half; errors that change from log to log are no property of the vessel",
    )
    pooled_evidence: float = threshold(
        8.0,
        "nat",
        "log evidence of all logs together that a lasting error must gain",
        "convention: as an effect must in a campaign",
    )


CHECKS = CheckThresholds()
