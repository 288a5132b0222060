"""Thresholds of the effects: how far off hull and formulas may be, and what is too little to be an effect."""

from __future__ import annotations

from dataclasses import dataclass

from ferryid.thresholds import threshold


@dataclass(frozen=True)
class EffectThresholds:
    """Effects."""

    hull_spread: float = threshold(
        0.12,
        "of the coefficient",
        "standard deviation of the prior of the hull's coefficients where the profile states none",
        "convention: how well a hull model is known",
    )
    selected_spread: float = threshold(
        1.0,
        "of the coefficient",
        "the same of a hull coefficient that is selected as wrong",
        "convention: as large as the coefficient; narrower favours small changes",
    )
    coefficient_odds: float = threshold(
        8.0,
        "nat",
        "log evidence that each coefficient of the hull beyond the first must bring that is selected as wrong",
        "derived: the prior odds of any effect, as each is an error of its own; many with one cause are fouling, or a load",
    )
    coefficients_apart: int = threshold(
        3,
        "coefficients",
        "most beyond the first that count as errors of their own",
        "convention: more have a cause in common, be it that the model is of another vessel",
    )
    coefficient_change: float = threshold(
        0.25,
        "of the coefficient",
        "distance from the model's coefficient that the interval of a hull coefficient must keep to be reported",
        "convention: about two standard deviations of `hull_spread`",
    )
    rarity: float = threshold(
        3.0,
        "nat",
        "how much lower the log prior odds of an effect are in a setting in which it is rare, such as a current in a pond",
        "convention: odds of 1 : 20",
    )
    commonness: float = threshold(
        2.0,
        "nat",
        "how much higher the log prior odds of an effect are in a setting in which it is common, such as waves at sea",
        "convention: odds of 7 : 1; less than `rarity`, as what is common outdoors is usual where no setting is known, too",
    )
    formula_error: float = threshold(
        0.1,
        "of what the effect changes",
        "standard deviation of the error of an effect's formula",
        "tuned on simulated logs of a plant with other formulas; `ferryid prove` measures the coverage",
    )
    load_error: float = threshold(
        0.05,
        "of what the effect changes",
        "the same of a wind's load, of a mooring's pull, of a push from outside and of the end of a dead band",
        "convention: half of `formula_error`; the wind's load has factors of its own beside it",
    )
    definition_error: float = threshold(
        0.02,
        "of what the effect changes",
        "the same where the formula is the parameter's definition: a share of a thruster's force, an angle, a delay",
        "tuned on simulated logs of a plant with other formulas; `ferryid prove` measures the coverage",
    )
    least_current: float = threshold(
        0.01,
        "m/s",
        "smaller currents are void, intervals no narrower",
        "convention: a hundredth of a vessel's speed of 1 m/s",
    )
    least_heading: float = threshold(
        0.5,
        "deg",
        "smaller heading biases are void, intervals no narrower",
        "convention: compasses are no better",
    )
    least_arm: float = threshold(
        0.05,
        "m",
        "smaller arms of an antenna are void, intervals no narrower",
        "convention: how well a tape measures an antenna's place from the body origin",
    )
    least_shallow: float = threshold(
        0.1,
        "of the damping",
        "smaller growths over shallow ground are void, intervals no narrower",
        "convention: below `hull_spread`",
    )
    least_inflow: float = threshold(
        0.03,
        "s/m",
        "smaller inflow losses are void, intervals no narrower",
        "convention: 3 % of the thrust at 1 m/s; thrust curves are no better",
    )
    least_wake: float = threshold(
        0.05,
        "of the thrust",
        "smaller losses in a wake are void, intervals no narrower",
        "convention: 5 %, in a full wake only",
    )
    least_lag: float = threshold(
        0.03,
        "s",
        "shorter lags of the thrusters are void, intervals no narrower",
        "convention: a third of a period at 10 Hz",
    )
    least_delay: float = threshold(
        0.03,
        "s",
        "shorter delays of the navigation are void, intervals no narrower",
        "convention: a third of a period at 10 Hz",
    )
    acting_share: float = threshold(
        0.02,
        "of the time",
        "part of a log in which an actuator must run astern, near zero or far above it for its dead band, asymmetry or "
        "saturation to be looked for",
        "convention: a quarter of a minute in a log of 12 minutes",
    )
    acting_force: float = threshold(
        0.05,
        "of the actuator's largest force in the log",
        "smaller forces count as neither ahead nor astern",
        "convention: below the error of thrust curves",
    )
    passing_gain: float = threshold(
        0.1,
        "of the thrust",
        "smaller changes of a thruster's force that both begin and end within the log are hints",
        "convention: as much as `formula_error`, hull and formulas are off in a part of the manoeuvres",
    )
    passing_load: float = threshold(
        0.1,
        "of the vessel's mass",
        "lighter loads that both come and go within the log are hints",
        "convention: as of `passing_gain`; a hull's masses are known to `hull_spread`",
    )
    passing_current: float = threshold(
        0.05,
        "m/s",
        "weaker currents that both begin and end within the log are hints",
        "convention: damping that is off by as much as `passing_gain`, at 0.5 m/s",
    )
    longest_push: float = threshold(
        300.0,
        "s",
        "longest time for which a push from outside acts",
        "convention: five minutes; what lasts longer is a wind, a mooring or a load",
    )
    longest_share: float = threshold(
        1.0 / 3.0,
        "of the log",
        "most of a log in which a push from outside acts",
        "convention: a third, so that most of the log is without it",
    )
    least_ventilation: float = threshold(
        0.1,
        "of the thrust",
        "smaller losses by ventilation are void, intervals no narrower",
        "convention: 10 %; thrust curves are no better near their end, and measured losses are 20 % to 80 %",
    )
    slowest_waves: float = threshold(
        0.25,
        "of the usual frequency",
        "lowest frequency of waves",
        "convention: deep-water waves of a quarter of the frequency are sixteen times as long, and slower is no sea",
    )
    least_pull_change: float = threshold(
        0.5,
        "of the mean pull",
        "least standard deviation, over the places where the vessel was, of the pull of a mooring",
        "convention: half; what pulls nearly alike everywhere is a constant force as well as a line",
    )
    least_coherence: float = threshold(
        1.0,
        "periods",
        "least time constant of waves",
        "convention: the covariance of the filter, fitted by Whittle's likelihood up to four times the peak frequency, has "
        "1.17 periods for the elevation of a fully developed sea (Pierson and Moskowitz), and 1.51 for that of JONSWAP",
    )
    at_bound: float = threshold(
        0.01,
        "of the range of a parameter",
        "nearer to an end of it than this, a search was stopped by the bound; of its logarithm where a parameter is "
        "positive and has no neutral value",
        "convention: a hundredth",
    )
    heaviest_load: float = threshold(
        0.6,
        "of the vessel's own mass",
        "heaviest load that a finding can be sure of",
        "convention: a small passenger ferry full to the last place carries about half of its own mass",
    )
    least_place: float = threshold(
        0.05, "of the log", "least share of a log that lies in a place of shallow water", "convention: a twentieth"
    )
    many_visits: int = threshold(
        4,
        "visits",
        "visits from which on a place of shallow water needs no share of the log",
        "convention: more than one in each part that is held out; something else does not come with every visit",
    )
    most_place: float = threshold(
        0.8,
        "of the log",
        "most of a log that lies in it with every side one cell of the grid further out",
        "convention: what is nearly everywhere is the hull's damping, or its fouling; 0.7 before",
    )
    wind_turbulence: float = threshold(
        0.3,
        "of the mean speed",
        "standard deviation of each component of a wind about its mean",
        "derived: 1 / ln(z / z0) of EN 1991-1-4, 1.5 m above open country of roughness 0.05 m",
    )
    least_wind_std: float = threshold(
        0.5, "m/s", "the same of the weakest wind", "convention: Hanna (1983), light winds wander by as much"
    )
    wind_length: float = threshold(
        30.0,
        "m",
        "length of a gust, over the mean speed its time constant",
        "derived: EN 1991-1-4, B.1, 2 m above open country, 27 m",
    )
    current_turbulence: float = threshold(
        0.1,
        "of the mean speed",
        "standard deviation of each component of a current about its mean",
        "convention: Thomson et al. (2012), tidal channels, 8 to 11 %",
    )
    least_current_std: float = threshold(
        0.02, "m/s", "the same of the weakest current", "convention: twice `least_current`"
    )
    current_length: float = threshold(
        15.0,
        "m",
        "length of an eddy, over the mean speed its time constant",
        "convention: Thomson et al. (2012), of the order of the depth",
    )
    beyond_side: float = threshold(
        0.02,
        "of the log",
        "share of a log that lies beyond a side, below which that side's position is not reported",
        "convention: two per cent",
    )


EFFECTS = EffectThresholds()
