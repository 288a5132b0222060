"""What decides in drafting a profile from a log."""

from __future__ import annotations

from dataclasses import dataclass

from ferryid.thresholds import threshold


@dataclass(frozen=True)
class DraftThresholds:
    """Draft of a profile: which fields and frames are taken."""

    slower: float = threshold(
        0.4,
        "of the fastest rate",
        "sources that are slower are left out",
        "convention: half, with room for lost messages",
    )
    shorter: float = threshold(
        0.1,
        "of the longest time from first to last message",
        "sources that are there for less are left out",
        "convention: a tenth, far below a receiver that starts late",
    )
    most_sources: int = threshold(
        6,
        "sources",
        "positions, headings and velocities that are tried in every combination",
        "convention: 6³ is quick",
    )
    even: float = threshold(
        0.02,
        "of the variance",
        "frames that explain a velocity as well as this are alike: names decide",
        "convention: 2 %",
    )
    agrees: float = threshold(
        0.5, "of the variance", "a velocity of which the pose explains less is a doubt", "convention: half"
    )
    shows_unit: float = threshold(
        0.9,
        "of the variance",
        "a velocity of which the pose explains less is in another unit than m/s only with a doubt",
        "derived: where it is 0.9, noise of the velocity makes it up to 11 % too large, and km/h and ft/s are 10 % apart",
    )
    most_rad: float = threshold(6.6, "rad", "an angle that goes beyond is in degrees", "derived: 2π and 5 % of it")
    most_percent: float = threshold(
        105.0, "%", "an order that goes beyond is no share of full power", "derived: 100 % and 5 % of it"
    )
    least_pulse_us: float = threshold(
        700.0,
        "us",
        "an order that stays above it may be a pulse width",
        "convention: servos take 1000 to 2000 us, few 800",
    )
    most_pulse_us: float = threshold(
        2300.0,
        "us",
        "an order that stays below it may be a pulse width",
        "convention: servos take 1000 to 2000 us, few 2200",
    )
    fewest_rows: int = threshold(
        50,
        "rows",
        "fewer show nothing; of a receiver that many positions are taken in place of reckoned ones",
        "convention: ten seconds of the grid",
    )
    jump: float = threshold(
        3.0,
        "of the speed that nine tenths of the rows do not exceed",
        "faster is a jump of the position",
        "convention: 3",
    )
    moving: float = threshold(
        0.3, "of the speed that 95 % of the rows do not exceed", "slower rows show no course", "convention: a third"
    )
    steady_course: float = threshold(
        0.9,
        "mean resultant length",
        "of course less heading from which they are apart by one angle",
        "convention: a circular standard deviation of 26 degrees, of drift angles in manoeuvres",
    )
    other_zero: float = threshold(
        0.1,
        "-",
        "by which a heading with another zero has to agree better with the course than one as it is",
        "convention: on a straight run any heading agrees with some zero",
    )
    either_way: float = threshold(
        0.5,
        "mean resultant length",
        "of twice the course less heading from which the vessel goes ahead and astern on one line of its hull",
        "convention: a circular standard deviation of 34 degrees, of drift angles while it backs",
    )
    along_hull_deg: float = threshold(
        10.0,
        "deg",
        "a line of courses ahead and astern that is no farther off the heading is along the hull",
        "convention: drift angles, and a deviation of the compass",
    )
    gain: float = threshold(
        0.15,
        "of the logarithm",
        "a gain farther from one is a doubt",
        "convention: nearer than any two units, m/s and kn",
    )
    seen: float = threshold(
        0.3, "correlation", "a sway less alike shows no sign", "convention: a tenth of the variance"
    )
    seen_rate: float = threshold(
        0.6,
        "correlation",
        "what follows the slope of the heading less is no yaw rate",
        "convention: a third of the variance",
    )
    acts: float = threshold(
        0.2,
        "correlation",
        "an actuator whose effect is fainter does not show its sign",
        "convention: 4 % of the variance",
    )
    most_rps: float = threshold(
        60.0, "rev/s", "a propeller speed that goes beyond is in rpm", "convention: 3600 rpm, as large ones never turn"
    )


DRAFT = DraftThresholds()
