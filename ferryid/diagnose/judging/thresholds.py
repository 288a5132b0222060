"""Thresholds by which candidates become findings, hints or nothing, and a log gets its verdict."""

from __future__ import annotations

from dataclasses import dataclass

from ferryid.thresholds import threshold


@dataclass(frozen=True)
class JudgingThresholds:
    """Diagnosis: judging."""

    hint_probability: float = threshold(
        0.5, "-", "probability up to which a finding is a hint", "convention: not more likely than not"
    )
    unresolved_evidence: float = threshold(
        3.0,
        "nat",
        "rivals whose log evidence is less than this behind are unresolved",
        "convention: a Bayes factor of 20, strong evidence in the scale of Kass and Raftery (1995)",
    )
    alike_shapes: float = threshold(
        0.9,
        "of the evidence over none",
        "what another shape of the same thrust curve, or a lag beside a delay, must explain to be unresolved, too",
        "tuned on validation runs at sea: a limit and an idealised loss by air, each taken for the other at 0.91 and 0.93; "
        "applied to single logs alike",
    )
    fitted_rivals: int = threshold(
        4,
        "rivals",
        "best rivals of a finding that are fitted to convergence",
        "convention: bounds the time of a search",
    )
    most_replacements: int = threshold(
        6,
        "replacements",
        "most candidates that a rival replaces in backward elimination",
        "convention: physics outside the library may be explained by one candidate after the other",
    )
    missing_share: float = threshold(
        0.6,
        "-",
        "share of an effect's force that is missing on an axis, above which the candidate is eliminated",
        "tuned on cases of `ferryid prove`: a thruster in another place than in the profile was named a weak one",
    )
    missing_errors: float = threshold(
        2.0, "standard errors", "by which a missing force must differ from zero", "convention: about 95 % confidence"
    )
    acting_share: float = threshold(
        0.1, "-", "share of an effect's whitened force above which it acts on an axis", "convention: a tenth"
    )
    gain: float = threshold(
        8.0,
        "nat",
        "log-likelihood ratio beyond which a held-out gain needs no bootstrap interval",
        "convention: as much as the prior odds against an effect",
    )
    placebo_shifts: tuple[float, ...] = threshold(
        (0.29, 0.382, 0.5),
        "of the log",
        "delays of the placebos of an effect",
        "convention: about a third, none a multiple of another, so that a trial that repeats itself matches at most one",
    )
    placebo_share: float = threshold(
        0.7,
        "-",
        "share of the held-out gain at which a placebo matches the effect",
        "convention: a placebo that comes near is no less of an explanation; a bound beside the bootstrap interval",
    )
    placebo_difference: float = threshold(
        0.3,
        "-",
        "least difference of a placebo's force from the effect's, as a share in the root mean square",
        "tuned on simulated logs: a mirrored heading that gave nearly the same force was taken for a placebo",
    )
    law_gain: float = threshold(
        8.0,
        "nat",
        "held-out log-likelihood that a term of an empirical law must gain",
        "convention: as much as the prior odds against an effect",
    )
    unwhitened_law_gain: float = threshold(
        80.0,
        "nat",
        "the same where the noise is taken to be the least that any terms leave",
        "convention: ten times `law_gain`, as such a noise is too small",
    )
    law_beats: float = threshold(
        0.99,
        "-",
        "share of the placebos with random signs that a term must beat",
        "convention: 1 % false positives over the whole library of terms, as each placebo counts its best term",
    )
    law_errors: float = threshold(
        3.0, "standard errors", "by which a law's coefficient must differ from zero", "convention: 99.7 % confidence"
    )
    law_sign_placebos: int = threshold(
        100,
        "placebos",
        "with random signs, one a block, against which a term is compared",
        "derived: the least number with a quantile of `law_beats`",
    )
    law_shift_placebos: int = threshold(
        31,
        "placebos",
        "delayed by shares of the log, whose median a term must exceed",
        "convention: enough for a median",
    )
    law_refits: int = threshold(
        2,
        "fits",
        "of every log of a campaign beside a law, each with the coefficients of the one before",
        "convention: a hull that stood in for the law has other masses at first",
    )
    law_terms: int = threshold(3, "terms", "most terms of a law", "convention: a law that can be read and checked")
    law_limit: float = threshold(
        30.0, "usual coefficients", "limit of a law's coefficient", "convention: beyond any force of a vessel"
    )
    law_likeness: float = threshold(
        0.9,
        "-",
        "cosine between what an effect and a term do to a log above which they are the same explanation",
        "tuned on cases of `ferryid prove`: a law on one thruster's force displaced that thruster's lower gain",
    )
    visible_response: float = threshold(
        4.0,
        "standard deviations",
        "least response of an effect of usual size that counts as visible",
        "derived: half its square is the log evidence, which then reaches `prior_odds`",
    )
    alike: float = threshold(
        0.79,
        "-",
        "likeness from which two visible effects are named as alike",
        "derived: sqrt(1 - 3/8); of an effect that is just visible, 8 nat, `unresolved_evidence` is left beside the other",
    )
    law_expected_gain: float = threshold(
        4.0,
        "nat",
        "expected gain above which another log of a campaign can show a law",
        "derived: a true law's gain is normal with variance twice its mean, so it is negative with probability 8 %",
    )
    strong_gain: float = threshold(
        40.0,
        "nat",
        "held-out gain that needs no axis on which an improvement is significant",
        "convention: five times `gain`; a force that acts seldom vanishes in means over a log",
    )
    placebo_evidence: float = threshold(
        3.0,
        "nat",
        "evidence over a placebo, divided by the posterior factor squared, that a condition of a campaign must have",
        "tuned on real recordings: odds of twenty to one, where an interval of held-out gains had been asked for",
    )
    placebo_part: float = threshold(
        0.5,
        "of the evidence for a condition",
        "most that a placebo may have too",
        "convention: half; after a wind was confirmed in a towing tank whose placebo explained four fifths of it",
    )
    placebo_excess: float = threshold(
        0.25,
        "of what a placebo cannot imitate",
        "most that a placebo may have besides what it imitates of a condition that acts",
        "convention: a quarter, where a true condition leaves nothing, and a guessed hull that is off as much as for itself",
    )
    confined: float = threshold(
        10.0,
        "of its usual size",
        "range of a parameter up to which it is confined by the vessel",
        "convention: places on a hull have 3 to 7, places anywhere and times hundreds",
    )
    least_predicted: float = threshold(
        1e-3,
        "of the variance",
        "what the noise is of a held-out block's prediction error, below which the other blocks do not predict it",
        "convention: errors thirty times the noise; on recordings that were tried it is 4e-3 and more",
    )
    placebo_imitated: float = threshold(
        0.67,
        "of what a condition explains",
        "most that a placebo may imitate for that to count",
        "convention: two thirds; a wind in a towing tank, which was none, had a placebo that imitates 85 % of it",
    )
    placebo_all_but: float = threshold(
        0.9,
        "of what a candidate explains",
        "what the mirrored heading can imitate of one that begins and ends within a log from which on it is no placebo",
        "convention: nine tenths; a mooring of three minutes, on a heading that hardly turned, was dropped",
    )
    placebo_turn: float = threshold(
        30.0,
        "deg",
        "least turn from the vessel's own headings, root mean square, of headings that make a placebo",
        "convention: a wind that points 30 degrees elsewhere is another wind",
    )
    circling_turn: float = threshold(
        90.0,
        "deg",
        "spread of the headings, root mean square, from which on a vessel that turns steadily turns in circles",
        "convention: all the way round evenly is 104 degrees",
    )
    power_in_positions: float = threshold(
        0.5,
        "of what the velocities show",
        "share of what comes and goes in the velocities that the positions must show too, and at most its inverse, of a force",
        "convention: half; a force moves both, and noise of a sensor is in one of them",
    )
    power_in_velocities: float = threshold(
        0.3,
        "of the power",
        "share of a disturbance's power that the velocities must show",
        "convention: less than a half, as a navigation filter smooths; errors of positions are not in velocities",
    )
    peak_share: float = threshold(
        0.1,
        "of the peak's power",
        "band about a disturbance's peak in which positions and velocities are compared",
        "tuned on cases of `ferryid prove`: waves were hints, as the navigation shifts a narrow peak a little",
    )
    passed_power: float = threshold(
        0.01,
        "of the power",
        "least transmission of the windows at a frequency that is shown",
        "convention: one per cent",
    )
    claimed_share: float = threshold(
        1.0 / 3.0,
        "of the improvement",
        "share on an axis above which a finding claims that axis",
        "derived: the even share of three axes",
    )
    least_passing: float = threshold(
        1.0,
        "of the formula's uncertainty",
        "least size of an effect that both begins and ends within a log",
        "tuned on cases of `ferryid prove`: a thruster 5 % stronger for a minute was named; the uncertainty is each effect's",
    )
    regime_share: float = threshold(
        0.5,
        "of the squared force in the span",
        "share that an actuator gives in a regime of no other time for what it lacks in a span to be a hint",
        "convention: the larger part",
    )
    regime_margin: float = threshold(
        0.5,
        "of the largest speed along the actuator",
        "by how much a speed is beyond those of other times to be another regime",
        "derived: speed goes about with the root of the thrust: one that is halved or doubled changes it by less",
    )
    credible_move: float = threshold(
        10.0,
        "standard deviations of the prior",
        "move of a coefficient of the hull beyond which nothing that was estimated beside it is sure or stored",
        "convention: `hull_spread` of it is more than the whole coefficient; a model that far off is another vessel's",
    )
    worsening: float = threshold(
        0.2,
        "of the squared force error",
        "growth of an axis's held-out error beyond which a finding is a hint and the fit is worse on that axis",
        "tuned on cases of `ferryid prove`: the rule is from cases in which a finding made one axis far worse; 20 % "
        "stands for more than chance",
    )
    worsening_over_gain: float = threshold(
        0.5,
        "of the logarithms",
        "growth of the squared errors of some axes, over how much those of the others shrink, from which that counts",
        "convention: twice as much good as harm; after cases of `ferryid prove` in which a push and a delay, found to some per "
        "cent, removed up to 99 % of one axis's error and made another's, near its noise, a third larger",
    )
    worst_growth: float = threshold(
        1.0,
        "of the squared force error",
        "growth of an axis's held-out error that no gain of the others outweighs",
        "convention: twice the error before",
    )
    worse_run: float = threshold(
        0.1,
        "of the free-run error",
        "growth of an error of free runs that counts",
        "convention: a tenth is seen in a plot",
    )
    worse_runs: int = threshold(
        2,
        "of position, heading, speed and yaw rate",
        "in which free runs err more with a force, from which on it is a hint",
        "tuned on real recordings: one of four may be chance; of 65 simulated logs none loses a true name by it",
    )
    least_removed: float = threshold(
        0.1,
        "of the squared force error",
        "held-out error that a finding must remove on some axis while it acts",
        "tuned on cases of `ferryid prove`: clean logs named small inflow losses and currents",
    )
    certain_size: float = threshold(
        7.0,
        "standard errors",
        "size from which on, beside the hull model of a profile, it does not matter how little a finding removes",
        "tuned on cases of `ferryid prove`: wrong names that remove little are of up to 5.6, dead bands and offsets of more",
    )
    least_hinted: float = threshold(
        0.01,
        "of the squared force error",
        "held-out error that what makes another axis worse must remove on some axis to be a hint",
        "convention: one per cent, the last digit of what is reported of it",
    )
    idle_share: float = threshold(
        0.1,
        "of the recorded force",
        "force of all actuators below which nothing that was found beside it is sure",
        "convention: one of several may have lost all of its force, and a vessel that is driven has most of it",
    )
    strained_gain: float = threshold(
        32.0,
        "nat",
        "evidence over a hull that strains from which an effect is weighed against the hull as it is in the model",
        "derived: four times `gain`, as a quarter of it is left under a prior of the hull that is twice as wide",
    )
    slow_below_hz: float = threshold(
        0.2,
        "Hz",
        "unexplained disturbances above this frequency are not held in place of an effect",
        "tuned on cases of `ferryid prove`: wakes that take time to form left fast errors; effects follow the motion",
    )
    drowned_share: float = threshold(
        0.15,
        "of what moves the vessel",
        "velocity noise times damping, above which findings on forces are hints",
        "convention: stands for errors in variables that are no longer small",
    )
    noise_mean_s: float = threshold(
        2.0,
        "s",
        "time over which a slope of positions is about as noisy as the velocity in use",
        "convention: about the window of the local cubic of the velocity in products",
    )
    reaction_share: float = threshold(
        0.5,
        "of the squared force error",
        "error that a delay or lag must remove beside unmeasured disturbances, or is a hint",
        "tuned on cases of `ferryid prove`: a gross lag and a late clock were hints; a controller's reaction explains little",
    )
    campaign_share: float = threshold(
        0.5,
        "of the logs",
        "logs of a campaign that must show a property of the vessel; more, where it is of all of them",
        "convention: half",
    )
    campaign_logs: int = threshold(
        3, "logs", "least size of a campaign in which one log can be the exception", "derived: a majority needs three"
    )
    split_gain: float = threshold(
        80.0,
        "nat",
        "least held-out log-likelihood of two hulls over one for which a campaign is parted",
        "tuned on real campaigns of one vessel and 1000 parts of them, together with the ratio: the nearest has 63 and 2.3",
    )
    split_ratio: float = threshold(
        2.5,
        "-",
        "least held-out squared force error of a part with the common hull over that with its own",
        "tuned on the same, with the gain: to part one vessel is worse than to keep two together",
    )
    split_screening: float = threshold(
        0.4,
        "of that gain",
        "least gain without any wind or current of the logs for which these are estimated beside two hulls",
        "convention: less than half, as what conditions do is noise there",
    )
    split_evidence: float = threshold(
        70.0,
        "nat",
        "least half of the squared distance of two hulls, over what logs of the parts differ by, for which they are apart",
        "tuned on 600 parts of real campaigns of one vessel, with the next three: of 68 the held-out gain is too unsure",
    )
    split_surely: float = threshold(
        60.0,
        "nat",
        "lower end of the 95 % interval of the held-out gain of two hulls that are apart, at least",
        "tuned on the same: 49 at most where the hulls differ by their share",
    )
    split_share: float = threshold(
        0.4,
        "-",
        "least distance of two hulls, over the larger of them, for which they are of two vessels",
        "tuned on the same and on simulated logs in which a load, damping or one of two thrusters differs: 0.37 at most",
    )
    split_scatter: float = threshold(
        3.3,
        "-",
        "least squared distance of two hulls over the greatest of a log to the others of its part, by their expectations",
        "tuned on the same parts: 2.9 where the gain is nearly sure enough",
    )
    split_most: float = threshold(
        0.6,
        "-",
        "least distance of two hulls, over the larger, that is most of a hull, where the gain is sure but not by how much",
        "tuned on 1585 parts of real campaigns of one vessel and 150 with a log of another, with the next",
    )
    split_error: float = threshold(
        1.3,
        "-",
        "least held-out squared force error of a part with the common hull over that with its own, of such hulls",
        "tuned on the same: 1.16 at most where one vessel's logs reach that gain and evidence, and half of the hull",
    )
    split_scattering: int = threshold(
        3,
        "logs",
        "fewest logs of a part that show how logs of it scatter about their hull",
        "derived: two scatter about a hull of both, which is in the middle",
    )
    split_kept: float = threshold(
        0.75,
        "of that evidence",
        "least that is left of it beside a wind or current of each log",
        "convention: a flow that explains more of it may explain all",
    )
    usual_disagreement: float = threshold(
        2.0,
        "-",
        "variance by which logs of a vessel differ about its hull over that of their noise, where one log alone brings it",
        "tuned on real campaigns of one vessel, in which it is 1.5 to 2.9, and 4.6 where some logs have unrecorded forces",
    )
    absent_multiple: float = threshold(
        2.0,
        "times the least size that a log shows",
        "size from which a lasting property that another log does not show contradicts it",
        "convention: the least size has an even chance to be named, twice that hardly fails to be",
    )
    contradiction_share: float = threshold(
        0.25,
        "of the usual size",
        "gap between two logs' values of a parameter, beyond disjoint intervals, that is a contradiction",
        "convention: a quarter; smaller gaps do not matter in a model",
    )
    common_regime: float = threshold(
        0.5,
        "of the rows",
        "share of one group's velocities within the range of the other's below which the groups moved unlike",
        "convention: half; a hull model that is off then appears as a difference between the groups",
    )
    detection_chance: float = threshold(
        0.5,
        "-",
        "chance of finding an effect of usual size below which a log could not have shown it",
        "convention: an even chance",
    )
    excited_share: float = threshold(
        0.5,
        "-",
        "posterior over prior standard deviation of some combination of coefficients below which an axis is excited",
        "convention: the log has three times the information of the prior",
    )
    time_drop: float = threshold(
        50.0,
        "nat",
        "fall of the log evidence beyond which the search for an onset or end stops",
        "convention: smaller dips may lie between two maxima",
    )
    fine_time_drop: float = threshold(
        20.0,
        "nat",
        "fall of the log evidence within which times of an onset or end are weighed between their neighbours",
        "convention: twice what leaves one per cent of the largest density, by the posterior factor: a top may lie between",
    )
    bin_windows: int = threshold(
        4, "windows", "least windows in a bin of an error profile", "convention: fewer have no scatter to judge by"
    )
    regime_errors: float = threshold(
        4.0,
        "standard errors",
        "by which a profile must differ from an even one to name a regime",
        "convention: a significance that several profiles of several bins do not reach by chance",
    )
    regime_level: float = threshold(
        0.5, "of the largest bin", "level above which a bin belongs to the regime", "convention: half of the maximum"
    )
    usual_quantile: float = threshold(
        0.9, "-", "quantile of a quantity at which a law's force is given", "convention: near the largest in the log"
    )
    band_share: float = threshold(
        0.5, "of the power", "share that a frequency band must hold to be named", "convention: more than all others"
    )
    burst_deviations: float = threshold(
        5.0,
        "standard deviations",
        "deviation from an even power above which bursts are reported",
        "convention: rare by chance even over all bands and blocks that are searched",
    )
    least_cycles: float = threshold(
        5.0,
        "periods",
        "of a disturbance in a narrow band, below which a span of it is an event and no oscillation",
        "convention: a band shows by repetition; chosen after a draw of the proof in which 2.3 periods were named waves",
    )
    reported_change: float = threshold(
        0.02, "of the squared force error", "least change that is reported", "convention: too little to act on"
    )
    unexplained_share: float = threshold(
        0.5,
        "of the squared force",
        "squared error left over the squared force that moves the vessel, above which an axis is mostly unexplained",
        "derived: more is left than is explained",
    )
    known_factor: float = threshold(
        3.0,
        "standard errors",
        "of a sensor's factor in one group of logs from zero, below which no other is compared with it",
        "convention: surely not zero",
    )


JUDGING = JudgingThresholds()
