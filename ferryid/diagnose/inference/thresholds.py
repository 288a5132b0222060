"""Thresholds of what a log speaks for: priors, evidence, selection, and what is held out."""

from __future__ import annotations

from dataclasses import dataclass

from ferryid.thresholds import threshold


@dataclass(frozen=True)
class InferenceThresholds:
    """Diagnosis: inference."""

    posterior_factor: float = threshold(
        1.5,
        "-",
        "factor on posterior standard deviations, as measured velocity and heading are taken as exact in products",
        "tuned on simulated logs; `ferryid prove` measures the coverage on others",
    )
    simulator_hull_factor: float = threshold(
        2.5,
        "-",
        "factor on the prior's standard deviation for the hull of a simulator",
        "convention: a simulator may be further from the profile than a vessel",
    )
    prior_odds: float = threshold(
        8.0,
        "nat",
        "log evidence that an effect must gain before it is as likely as none",
        "tuned on simulated logs: lowered from 10 when whole diagnoses were first run; odds of 1 : 3000",
    )
    most_effects: int = threshold(
        4, "effects", "most effects that are selected", "convention: more are rare in one log"
    )
    clear_gain: float = threshold(
        100.0,
        "nat",
        "log evidence above which an effect is selected before gusts and waves are searched for",
        "convention: gusts and waves look like nothing so clear",
    )
    linearisation_factor: float = threshold(
        4.0,
        "times the gain that a linearisation promises",
        "most that a fit may gain; one that would stay hopeless even so is given up",
        "convention: an effect that acts twice as strongly as its slope says gains four times as much",
    )
    hopeless_share: float = threshold(
        0.5,
        "of the prior odds",
        "log evidence that a candidate must be able to gain, or its fit is given up",
        "convention: half, as the noise that a candidate leaves raises its evidence somewhat",
    )
    common_cause_share: float = threshold(
        0.5,
        "of the log evidence",
        "evidence of an effect, as a share of that of coefficients wrong by themselves, from which it may be their cause",
        "convention: most of it",
    )
    compared_candidates: int = threshold(
        5,
        "candidates",
        "best candidates of a round that are compared under the noise that each leaves",
        "convention: bounds the time of a search",
    )
    void_share: float = threshold(
        0.02,
        "of the measured acceleration",
        "acceleration by an effect, in the root mean square of every channel, below which it is not reported",
        "convention: two per cent; discretisation shows in a clean log as an effect that hardly acts",
    )
    disturbance_gain: float = threshold(
        12.0,
        "nat",
        "log evidence that a stochastic disturbance must gain",
        "tuned on real recordings: raised from 8 after waves were named in a towing tank",
    )
    screening_iterations: int = threshold(
        12,
        "iterations",
        "of the search for a disturbance over few sizes, after which it is given up or all parameters are searched",
        "convention: bounds the time of a search",
    )
    screening_gain: float = threshold(
        12.0,
        "nat",
        "log evidence that a disturbance may then lack and is searched further",
        "convention: bounds the time of a search; lowered from 20 for speed",
    )
    noise_steps: int = threshold(
        3600,
        "steps",
        "most from which noise is estimated: 24 minutes for a vessel of 5 m",
        "convention: more determine its sizes hardly better; 1800 before",
    )
    noise_stretches: int = threshold(
        8,
        "stretches",
        "into which they are divided, evenly spread over a longer log",
        "convention: noise may differ over a log; 3 before",
    )
    longest_memory: float = threshold(
        500.0,
        "steps",
        "longest time constant of coloured errors and disturbances",
        "convention: 200 s for a vessel of 5 m; far longer than a window, in which it is an offset",
    )
    fastest_share: float = threshold(
        0.4, "of the filter's rate", "highest frequency of a disturbance", "derived: half of the rate is aliased"
    )
    least_memory: float = threshold(
        0.5,
        "periods",
        "shortest memory of a disturbance in a narrow band",
        "convention: a damping ratio of a third; that of waves is about 0.1",
    )
    least_shown: float = threshold(
        0.3,
        "of the power",
        "share of a disturbance's power that velocities must not exclude, or it is an error of the positions",
        "convention: as `power_in_velocities`, less than a half, as a navigation filter smooths",
    )
    widest_log: float = threshold(
        9.0,
        "-",
        "standard deviation of a parameter's logarithm that stands for nothing known",
        "convention: four decades",
    )
    vague_log: float = threshold(
        0.5,
        "-",
        "standard deviation of a parameter's logarithm above which a disturbance was not seen",
        "convention: known within a factor of 2.7 at 95 %",
    )
    fewest_windows: int = threshold(
        60,
        "windows",
        "shorter logs are not tested",
        "convention: two and a half minutes for a vessel of 5 m, some manoeuvres",
    )
    campaign_windows: int = threshold(
        2,
        "windows",
        "shorter logs have no say in a campaign",
        "derived: of two windows one shows what changed since the other; 16 before, when a log alone started its noise",
    )
    session_gap_h: float = threshold(
        3.0,
        "h",
        "logs that begin later than this after the end of those before are of another session, with weather of its own",
        "convention: a wind keeps its strength and direction for some hours, and a crew goes out in the morning or after noon",
    )
    change_logs: int = threshold(
        2,
        "logs",
        "on either side of a time between logs at which a load or a thruster's force may have changed, at least",
        "derived: the logs of a side must scatter, or a change cannot be separated from what one log differs by from another",
    )
    fewest_steps: int = threshold(
        10, "steps", "shorter stretches are left out", "convention: half a window, from which no noise is estimated"
    )
    folds: int = threshold(
        3,
        "folds",
        "of the blocks that are held out in turn",
        "convention: two thirds of a log estimate, one third judges",
    )
    block_windows: float = threshold(
        5.0, "windows' lengths", "length of a held-out block", "convention: 40 s for windows of 8 s, a manoeuvre or two"
    )
    fewest_blocks: int = threshold(
        6, "blocks", "shorter logs have shorter blocks, or none is held out", "derived: two for each fold"
    )
    purge_windows: float = threshold(
        0.25,
        "windows' lengths",
        "purged between training and held-out windows beside their overlap",
        "convention: slow disturbances are not shared",
    )
    span_blocks: float = threshold(
        2.0,
        "held-out blocks",
        "shortest span of an effect that begins and ends",
        "derived: a fit that is judged on one block must have seen another",
    )
    span_s: float = threshold(
        8.0,
        "s",
        "parts of a log between which an effect may begin or end, and the shortest span that is tried",
        "convention: a window of a vessel of 5 m",
    )
    span_parts: int = threshold(
        24,
        "parts",
        "least number of parts of a log between which an effect may begin or end",
        "convention: short logs are cut finer than by `span_s`, as an end that is off by seconds leaves an error",
    )
    passing_windows: float = threshold(
        2.5,
        "windows' lengths",
        "shortest span of an effect that only passes, such as a push",
        "convention: half a held-out block, 20 s for a vessel of 5 m; a position that is off for a moment looks alike",
    )
    formula_scatter: float = threshold(
        0.2,
        "of each coefficient of the hull",
        "by which it may differ in some of a log's manoeuvres, as a standard deviation",
        "tuned on real recordings: parts of one log with circles, zigzags and two speeds",
    )
    contrast: float = threshold(
        4.0,
        "times the log evidence elsewhere in the log",
        "evidence that an effect which only passes, such as a push, must have",
        "derived: evidence goes with the square of a force, and what is not twice as strong as all else like it is no event",
    )
    close_span: float = threshold(
        0.5,
        "of the log evidence all along",
        "log evidence of an effect's best span, its ends known to a part, from which they are sharpened",
        "convention: half; an end that is off by a second leaves what changed then unexplained for as long",
    )
    fitted_spans: int = threshold(
        3,
        "spans",
        "most spans of a candidate that are fitted after the linear scan",
        "convention: bounds the time of a search",
    )
    profile_drop: float = threshold(
        4.0,
        "nat",
        "fall of the log evidence, times the posterior factor squared, beyond which a parameter's value is excluded",
        "derived: exp(-4) of the top; a normal distribution has 0.5 % beyond",
    )
    interval_windows: int = threshold(
        4, "windows", "least length between two change points", "convention: windows overlap over as many strides"
    )
    change_statistic: float = threshold(
        2.3,
        "-",
        "Kuiper's statistic of changes of a mean above which there is one",
        "derived: one change in a thousand by chance; of whole series of noise, three in a hundred have one",
    )
    active_share: float = threshold(
        0.25,
        "of the largest excess",
        "mean excess of an interval in which an effect acts",
        "convention: a quarter",
    )
    foreign_share: float = threshold(
        0.35,
        "of the squared acceleration",
        "left by hull, force and all effects, above which a simulation is of another vessel",
        "convention: a third; 0.5 before",
    )
    burst_blocks: int = threshold(6, "blocks", "fewer are not searched for bursts", "convention: a median needs some")
    burst_samples: float = threshold(
        4.0,
        "samples a period",
        "of the fastest in a band, below which bursts in it are not searched",
        "derived: lines between samples keep two thirds of the power there (sinc to the fourth of a quarter)",
    )
    burst_level: float = threshold(
        3.0,
        "median powers",
        "power above which a block is part of a burst",
        "convention: beyond the scatter of even noise",
    )
    wide_scatter: float = threshold(
        0.75,
        "of the largest looked for",
        "scatter of a property between logs of one group, above which a difference between groups is none that is known",
        "tuned on runs of a catamaran in random halves, whose thrust scatters by a half from run to run",
    )


INFERENCE = InferenceThresholds()
