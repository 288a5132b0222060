"""Thresholds of a fit: split, accepted settings, inertia, acceptance and warnings."""

from __future__ import annotations

from dataclasses import dataclass

from ferryid.thresholds import threshold


@dataclass(frozen=True)
class IdentifyThresholds:
    """Identification."""

    improvement: float = threshold(
        0.05,
        "of the base model's error",
        "fall of the mean normalised squared error for which a model is accepted",
        "convention: thesis 3.2.4",
    )
    worsening: float = threshold(
        0.05,
        "of the base model's error",
        "growth of any one axis's squared error that is allowed",
        "convention: as `improvement`",
    )
    least_inertia: float = threshold(
        0.8,
        "rigid-body inertia",
        "lowest fitted inertia that is accepted",
        "tuned on real recordings: added mass only adds; noise in the derivative takes some per cent",
    )
    most_inertia: float = threshold(
        5.0,
        "rigid-body inertia",
        "highest fitted inertia that is accepted",
        "tuned on real recordings: no hull has four times its own as added mass",
    )
    followed: float = threshold(
        0.1,
        "of its variance",
        "share of acceleration that force explains beside velocity, below which it does not say between what the inertia lies",
        "convention: actuators that are not engaged explain none",
    )
    no_force: float = threshold(
        1e-6,
        "of the base model's force",
        "standard deviation of the force below which an axis has no actuator",
        "convention: rounding of logged actuator signals",
    )
    faint_force: float = threshold(
        0.15,
        "of the force that the motion needs",
        "applied force on every axis below which its unit is doubted",
        "derived: a unit that is 9.55 times too small, and half as much again for the base model",
    )
    least_motion: float = threshold(
        0.01,
        "of the velocity",
        "root-mean-square velocity of an axis, in units of kinetic energy, below which it is not excited and nothing is fitted",
        "tuned on simulated recordings: noise of 0.01 m/s and 0.05 deg/s beside 0.5 m/s is below it",
    )
    block_s: float = threshold(
        40.0,
        "s",
        "usual block of the split into training and validation",
        "tuned on real recordings: a manoeuvre or two, so that both see all kinds",
    )
    fewest_blocks: int = threshold(9, "blocks", "in a short log", "derived: three validation blocks")
    most_blocks: int = threshold(
        36, "blocks", "in a long log", "convention: slow vessels make long logs, and their manoeuvres last"
    )
    validates_every: int = threshold(3, "blocks", "of which one validates", "convention: a third of the rows")
    guard_s: float = threshold(
        2.0, "s", "purged beside one smoothing window", "convention: disturbances that outlast a window"
    )
    block_purges: float = threshold(
        4.0, "purge gaps", "least length of a block", "convention: more rows are used than purged"
    )
    block_windows: float = threshold(
        2.0,
        "windows",
        "least length of a block where the usual ones are too short to judge a model in",
        "convention: two windows that share nothing",
    )
    window_stretches: float = threshold(
        10.0,
        "windows",
        "longest unbroken stretch of every log for which a smoothing window is tried",
        "convention: a tenth of the stretch at most is lost at its ends",
    )
    shortest_window_s: float = threshold(
        0.01, "s", "shortest smoothing window that is accepted, beside none", "derived: one sample at any usual rate"
    )
    least_factor: float = threshold(
        1e-3, "-", "least factor on the base model that is accepted", "convention: less is the model's absence"
    )
    sector_share: float = threshold(
        0.01, "of the rows", "rows in a heading sector for which it is covered", "convention: one per cent"
    )
    validation_s: float = threshold(
        60.0, "s", "validation data that acceptance needs; shorter ones give a warning", "convention: some manoeuvres"
    )
    held_out_blocks: int = threshold(
        10,
        "blocks",
        "as long as a prediction window, of validation data that acceptance needs",
        "convention: fewer have no scatter to judge by",
    )
    damping_power: float = threshold(
        0.01,
        "of the mean power",
        "power of the damping force that feeds the motion, above which a row counts as feeding",
        "convention: less is rounding of a coefficient near zero",
    )
    damping_rows: float = threshold(
        0.05,
        "of the rows",
        "rows on which the damping force may feed the motion in an accepted model",
        "convention: as the level of a test",
    )
    free_run_level: float = threshold(
        0.95,
        "-",
        "level of the interval of the paired differences between free runs of two models",
        "convention: 95 %",
    )
    moved_rows: int = threshold(
        20,
        "rows",
        "repeated or out of order in a topic for which a warning is given",
        "convention: more than single messages",
    )
    useless_rad: float = threshold(
        0.5,
        "rad",
        "error of the heading in the shortest free runs beyond which a model is not accepted, and in longer ones warned of",
        "convention: 30°, another course",
    )
    useless_s: float = threshold(10.0, "s", "see `useless_rad`", "convention: the shortest manoeuvre")
    constant_share: float = threshold(
        0.5,
        "of the mean damping",
        "constant force on an axis from which a warning says that the model does not stay at rest",
        "convention: half of what the vessel's motion meets",
    )
    most_percentage: float = threshold(
        10.0,
        "times the mean damping",
        "constant force beyond which its size is given as many times that",
        "convention: damping that is next to nothing makes any number",
    )
    free_run_worsening: float = threshold(
        0.05,
        "of the base model's error",
        "growth of a free run's error that gives a warning",
        "convention: as `worsening`",
    )
    fewest_windows: int = threshold(
        12, "windows", "fewest that the weak form trains on", "convention: more than the coefficients of any one axis"
    )
    fewest_long_windows: int = threshold(
        36,
        "windows",
        "fewest of more than the usual length that the weak form may train on",
        "derived: in every fold of five there are then twice those of `fewest_windows`",
    )
    fewest_judged: int = threshold(
        6,
        "windows",
        "fewest that a model is judged in; with fewer its force errors are",
        "convention: as `fewest_blocks`",
    )
    wrong_way_sigmas: float = threshold(
        2.3,
        "standard deviations",
        "by which an acceleration goes against the applied force before a fit is refused",
        "derived: one in a hundred by chance",
    )
    odd_sigmas: float = threshold(
        3.7,
        "standard deviations",
        "by which a log's vessel goes against the applied force, or does not follow it, before it is left out of several",
        "derived: one in ten thousand by chance, as each of a hundred logs has three axes",
    )
    fewest_followed: int = threshold(
        2,
        "logs",
        "in which the vessel clearly follows the force on an axis, from which another that does not is left out",
        "convention: of two logs that disagree neither is known to be right",
    )
    least_work: float = threshold(
        0.25,
        "of the least in other logs",
        "work of the actuators, with the way that is lost, at the same speed, below which a log of a vessel under way is odd",
        "convention: wind, current and a wrong thrust curve change it by less",
    )
    lost_way: float = threshold(
        2.0,
        "-",
        "factor on the kinetic energy of the rigid body that is lost in a log, as it may overcome resistance",
        "derived: added mass in sway about equals the displacement",
    )
    ways_lost: float = threshold(
        1.0,
        "of the kinetic energy",
        "work that other logs show to be needed, below which a log is too short to show that the vessel keeps its way",
        "derived: without a drive a vessel has lost more than half of it then",
    )
    own_way: float = threshold(
        0.6,
        "of the motion along the bow",
        "that turns with it, below which, or above as much more than all, a vessel may drift",
        "tuned on simulated recordings: a tanker's course in zigzags turns by 0.7 of it, none of a drifting vessel",
    )
    most_aside: float = threshold(
        0.5, "of the surge velocity", "sway velocity beyond which a vessel may drift", "convention: 27° of drift angle"
    )
    least_direct: float = threshold(
        0.5,
        "of its root mean square",
        "mean surge velocity below which a vessel goes to and fro, and late orders do negative work",
        "convention: half",
    )
    most_made_good: float = threshold(
        0.5,
        "of the surge velocity",
        "mean velocity over ground up to which the course has turned round",
        "convention: half; that of a drift is all of it",
    )
    fewest_swings: int = threshold(
        3,
        "swings",
        "of the bow to one side and the other where the course has not turned round",
        "convention: what drifts turns slowly, and its course may change with that once",
    )
    slowest_way: float = threshold(
        0.5,
        "of the median of other logs",
        "speed below which it is not asked what drives a vessel",
        "convention: wind and current move a slow one",
    )
    fewest_way_windows: int = threshold(
        10, "windows", "in which the work of the actuators is judged", "convention: fewer have no scatter"
    )
    opposite: float = threshold(
        0.2,
        "of what the base model expects",
        "an acceleration that goes against the applied force by less does not show a sign that is reversed",
        "derived: a reversed sign gives minus one over the share of added mass, and no inertia is above 5",
    )
    response_window: float = threshold(
        0.5,
        "of the usual window",
        "length of the windows in which the way is judged that forces act",
        "tuned on real recordings: small vessels turn to and fro within the usual one, and longer trials show it with either",
    )
    quickest_response: float = threshold(
        0.02,
        "of the usual window",
        "shortest time constant or delay of orders that is tried",
        "convention: a fiftieth; less averages out",
    )
    slowest_response: float = threshold(
        0.75,
        "of the usual window",
        "longest time constant or delay of orders that is tried, and none that ends there is reported",
        "convention: a longer one cannot be distinguished from damping within a window",
    )
    responses_tried: int = threshold(
        11,
        "-",
        "time constants and delays that are tried before the best is refined",
        "convention: each 1.44 times the last",
    )
    response_whitening: int = threshold(
        4,
        "steps",
        "of the estimate of how the errors of neighbouring windows are correlated",
        "derived: it hardly changes",
    )
    windows_per_coefficient: int = threshold(
        3,
        "windows",
        "fewest for each coefficient, for which it is estimated how orders are followed",
        "convention: fewer leave more to chance than to the data",
    )
    pose_agreement: float = threshold(
        0.5,
        "-",
        "correlation of accelerations from poses with those from velocities from which poses may be used",
        "convention: half of what either shows is in the other",
    )
    most_autocorrelation: float = threshold(
        0.95,
        "-",
        "highest autocorrelation of neighbouring windows that is whitened",
        "derived: beyond it no window is left",
    )
    expectation_steps: int = threshold(
        20, "steps", "of the estimate of how much steady forces differ between logs", "derived: it no longer changes"
    )
    condition_steps: int = threshold(
        25,
        "steps",
        "of the joint estimate of hull and conditions of logs",
        "convention: simulated winds no longer change after 15; what still does is near none, or is as below",
    )
    most_steady_force: float = threshold(
        1.0,
        "of the scatter of the windows",
        "spread of steady forces of logs above which winds that did not settle are not distinguished from them and the hull",
        "derived: steady forces are a part of what is left over; they grow past it where winds drift with them",
    )
    sample_logs: int = threshold(
        36,
        "logs",
        "fewest, evenly spaced, that stand for all of an archive where its window length is chosen and an estimate starts",
        "convention: enough for spreads between logs",
    )
    sample_windows: int = threshold(
        20_000, "windows", "fewest of these logs", "derived: fits of this many choose as those of all do, in a second"
    )
    most_kept: float = threshold(
        0.9,
        "of the last step",
        "largest ratio of one step of expectation and maximisation to the one before by which steps are extrapolated",
        "convention: no more than nine steps are taken at once",
    )
    settled_step: float = threshold(
        0.02,
        "standard errors",
        "by which the hull still moves when the estimate over many logs ends",
        "convention: nothing beside what is not known",
    )
    fewest_condition_windows: int = threshold(
        6, "windows", "of a log from which its wind is estimated", "convention: more than it has unknowns an axis"
    )
    wind_spread_mps: float = threshold(
        3.0,
        "m/s",
        "usual standard deviation of a component of the wind, from which that between the logs starts",
        "convention: a light to gentle breeze, in which trials are done",
    )
    gust_spread_mps: float = threshold(
        0.3,
        "m/s",
        "standard deviation of a component of the gusts, from which its estimate starts",
        "convention: a tenth of the wind",
    )
    least_gust_mps: float = threshold(0.01, "m/s", "below which gusts are none", "convention: moves no vessel")
    fewest_gust_windows: int = threshold(
        100,
        "windows",
        "of a log from which gusts are estimated",
        "tuned on real recordings: in shorter ones gusts explain the hull's own forces",
    )
    gust_time_s: float = threshold(
        20.0, "s", "time constant of gusts", "convention: longer than a vessel's windows, shorter than a trial"
    )
    fits_already: float = threshold(
        0.9,
        "-",
        "R² of the base model on every axis from which on a fit that is no better has nothing to improve",
        "convention: what is left is mostly noise and weather",
    )
    fewest_condition_logs: int = threshold(
        3, "logs", "from which conditions besides wind are estimated", "convention: two say nothing of a spread"
    )
    condition_evidence: float = threshold(
        8.0,
        "nat",
        "logarithm of the marginal likelihood over that of none for which a kind of condition takes part",
        "convention: as for an effect in a diagnosis",
    )
    condition_error: float = threshold(
        1.5,
        "-",
        "factor on standard errors of conditions, as measured velocity and heading are taken as exact in products",
        "convention: as for an effect in a diagnosis",
    )
    condition_level: float = threshold(
        0.05, "-", "probability by chance below which a condition of a log differs from none", "convention: 5 %"
    )
    trim_share: float = threshold(
        0.05,
        "of the root mean square",
        "moderate offset of a velocity or yaw rate",
        "convention: the unit of its spread, which is estimated",
    )
    inertia_error: float = threshold(
        0.01,
        "of the inertia",
        "standard deviation of what windows, time stamps and remaining errors in variables shift an estimated inertia by",
        "tuned on simulated trials of the simulator: the error beyond the scatter",
    )
    hull_spread: float = threshold(
        0.4,
        "of the coefficient",
        "standard deviation of the prior of a fit's damping where the profile has a hull model and states no spread of it",
        "convention: a model that is worth correcting may be so far off",
    )
    unmodelled_share: float = threshold(
        0.1,
        "of the largest for its size",
        "standard deviation of the prior of damping that the hull model leaves out",
        "convention: what is left out is small",
    )
    mass_spread: float = threshold(
        0.2,
        "of the inertia",
        "standard deviation of the prior where the profile has a hull model and states no spread of it",
        "convention: as `hull_spread`",
    )
    unknown_mass_spread: float = threshold(
        0.5,
        "of the rigid body's inertia",
        "standard deviation of the prior where the profile has none: added mass is not in it",
        "derived: added mass in sway about equals the displacement",
    )
    widest_prior: float = threshold(
        10.0,
        "-",
        "most by which a prior that the data contradict is widened",
        "convention: a wider prior has no effect",
    )
    possible_error: float = threshold(
        1.25,
        "of the squared error",
        "error on folds up to which an estimator that is physically possible is preferred to one of less error that is not",
        "convention: by so much errors scatter between folds",
    )
    bound_level: float = threshold(
        0.05,
        "-",
        "probability by chance of the distance that bounds move the estimate, below which they are reported",
        "convention: 5 %",
    )
    visited_quantile: float = threshold(
        0.99, "-", "quantile of the velocities up to which damping has to dissipate", "convention: beyond single errors"
    )
    damping_margin: float = threshold(
        1.25, "-", "factor on the visited velocities", "convention: a free run leaves the training velocities a little"
    )
    structure_level: float = threshold(
        0.95, "-", "confidence level of the set of structures that the data support", "convention: 95 %"
    )


IDENTIFY = IdentifyThresholds()
