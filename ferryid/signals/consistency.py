"""Whether velocities agree with the pose in sign, unit and scale: yaw rate and heading, speeds and position.

Both sides of a comparison are noisy. Least squares of the change of the pose on the integrated velocity gives too small a
gain, as the velocity's noise attenuates it; the inverse regression gives too large a one. The true gain lies between the
two (Frisch 1934; Fuller 1987, Measurement Error Models, section 1.1), give or take the standard error of either, and only
where all of that range is away from one is there a contradiction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ferryid.signals.mirror import CourseAgainstHeading, course_against_heading, mirrored
from ferryid.signals.quality import IMPLAUSIBLE
from ferryid.signals.thresholds import SIGNALS
from ferryid.signals.track import Doubt, Track
from ferryid.types import Floats


def cross_checks(track: Track) -> tuple[Doubt, ...]:
    """Return kinematic contradictions: yaw rate against heading, velocity against position.

    Changes over two seconds are compared with the integrals of the rates, so that no noisy derivative is formed.
    Certain are those in which both follow each other closely and yet differ in sign or by the factor of a unit. A rudder
    that is often across the hull is certainly wrong too.
    Nothing is corrected here.
    """
    columns = track.columns
    span = max(2, round(SIGNALS.gain_span_s * track.rate_hz))
    said = [
        doubt for name in columns if name.startswith("delta_") for doubt in _rudder(name, columns[name][track.valid])
    ]
    # What is a slope of the pose agrees with it.
    if "psi" in columns and "r" in columns and "r" not in track.slopes:
        turned = _changes("psi", np.diff(columns["psi"]), columns["r"], track, span)
        said += _compare("yaw rate", "heading", turned, SIGNALS.least_turn_rad, _YAW_RATE_GAINS)
    if {"x", "y", "psi", "u", "v"} <= set(columns) and not track.slopes.isdisjoint("uv"):
        pose = np.column_stack([columns[name] for name in ("x", "y", "psi")])
        said += _off_course(course_against_heading(pose, track.valid, track.rate_hz))
    elif {"x", "y", "psi", "u", "v"} <= set(columns):
        north, east = np.diff(columns["x"]), np.diff(columns["y"])
        psi = (columns["psi"][1:] + columns["psi"][:-1]) / 2
        c, s = np.cos(psi), np.sin(psi)
        ahead = _changes("x", c * north + s * east, columns["u"], track, span)
        aside = _changes("y", c * east - s * north, columns["v"], track, span)
        speeds = _compare("surge velocity", "position", ahead, SIGNALS.least_way_m, _SPEED_GAINS)
        speeds += _compare("sway velocity", "position", aside, SIGNALS.least_way_m, _SPEED_GAINS)
        if not any(doubt.certain for doubt in speeds):
            pose, velocity = (np.column_stack([columns[name] for name in names]) for names in (("x", "y", "psi"), "uv"))
            wrong, says = mirrored(pose, velocity, track.valid, track.rate_hz)
            frame = f"correct the frame of [signals.{wrong}], or of what it is compared with"
            speeds = [Doubt(says, True, frame)] if says else speeds
        said += speeds
    return tuple(said)


def _off_course(seen: CourseAgainstHeading | None) -> list[Doubt]:
    """Return the doubt of a heading that goes against the course, or is off it by the same angle at all headings."""
    if seen is None:
        return []
    if seen.says:
        return [Doubt(seen.says, True, "take the other of NED and ENU as frame in [signals.heading]")]
    if not seen.turned_deg:
        return []
    side = "starboard" if seen.turned_deg > 0.0 else "port"
    return [
        Doubt(
            f"The vessel moves {abs(seen.turned_deg):.0f} deg to {side} of its heading, at all headings alike (mean resultant "
            f"length {seen.declared:.2f}): if it moved ahead, add {seen.turned_deg:+.0f} deg to offset in [signals.heading] "
            f"(offset_deg of a quaternion), {-seen.turned_deg:+.0f} deg with frame ENU.",
            False,
        )
    ]


def _rudder(name: str, angle: Floats) -> list[Doubt]:
    """Return the doubt of an angle [rad] that is beyond a right angle for a good part of the log, which no rudder is."""
    # Those counted from 0 to 360 deg are no more than a turn.
    turned = np.minimum(np.abs(angle), np.abs(2.0 * np.pi - np.abs(angle)))
    beyond = turned > 0.5 * np.pi
    if np.count_nonzero(beyond) <= SIGNALS.rudder_share * angle.size:
        return []
    actuator = name.removeprefix("delta_").removeprefix("cmd_")
    signal = f'[signals."{actuator}.rudder{".command" if name.startswith("delta_cmd_") else ""}"]'
    far = float(np.abs(angle).max())
    says = (
        f"{name} is further than 90 deg off the centreline in {100.0 * beyond.mean():.0f} % of the log, which no rudder is "
        f"(up to {far:.3g} rad)."
    )
    degrees = far > 2.0 * np.pi
    return [Doubt(says, True, f'set unit = "deg" in {signal}' if degrees else f"check unit and offset in {signal}")]


_YAW_RATE_GAINS = (
    (np.pi / 180, "degrees per second look read as rad/s, or a heading in radians as degrees"),
    (180 / np.pi, "rad/s look read as degrees per second, or a heading in degrees as radians"),
)
_SPEED_GAINS = (
    (0.514444, "knots look read as m/s"),
    (1 / 0.514444, "m/s look read as knots"),
    (1 / 3.6, "km/h look read as m/s"),
)

_SIGN_REMEDIES = {
    "yaw rate": "one of them counts anticlockwise: change frame or sign in [signals.yaw_rate] or [signals.heading]",
    "surge velocity": "the bow is taken for the stern: turn the heading by 180 deg with offset in [signals.heading] "
    "(offset_deg of a quaternion), or correct the frame of [signals.velocity]",
    "sway velocity": "its y axis is mirrored: take the other of FRD and FLU as frame in [signals.velocity], or correct the "
    "frames of [signals.heading] and [signals.position]",
}
"""What explains a rate of the wrong sign, and where the profile says otherwise."""


def _table(rate: str) -> str:
    return "yaw_rate" if rate == "yaw rate" else "velocity"


def comparable(track: Track) -> bool:
    """Return whether a log is long enough, and moves enough, that some rate of it can be compared with its pose."""
    columns = track.columns
    span = max(2, round(SIGNALS.gain_span_s * track.rate_hz))
    if {"psi", "r"} <= set(columns):
        turned = _changes("psi", np.diff(columns["psi"]), columns["r"], track, span)
        if _enough(turned, SIGNALS.least_turn_rad):
            return True
    if not {"x", "y", "psi", "u", "v"} <= set(columns):
        return False
    way = np.hypot(np.diff(columns["x"]), np.diff(columns["y"]))
    return _enough(_changes("x", way, np.hypot(columns["u"], columns["v"]), track, span), SIGNALS.least_way_m)


@dataclass(frozen=True)
class _Changes:
    """Changes of a signal of the pose and integrals of its rate over the same stretches, shape (m,), and their numbers."""

    change: Floats
    integral: Floats
    number: NDArray[np.int64]


def _enough(seen: _Changes, least: float) -> bool:
    """Return whether there are changes enough, and large enough, to be compared."""
    return seen.change.size >= SIGNALS.gain_spans and bool(np.sqrt(np.mean(seen.change**2)) >= least)


def _compare(rate: str, of: str, seen: _Changes, least: float, known: tuple[tuple[float, str], ...]) -> list[Doubt]:
    change, integral = seen.change, seen.integral
    if not _enough(seen, least) or not np.any(integral):
        return []
    both = float(change @ integral)
    if float(integral @ integral) < 1e-200:
        return []
    gain = both / float(integral @ integral)
    correlation = both / float(np.sqrt((change @ change) * (integral @ integral)))
    if abs(correlation) < SIGNALS.related_correlation:
        numbers = f"whose slope is {gain:.3g} times it, correlation {correlation:.2f}"
        return [Doubt(f"The {rate} does not follow the {of} ({numbers}): check topic, frame and clocks.", False)]
    low, high = _range(seen)
    # Which of the two is the larger has to be said: "gain" alone is read either way, and 1.2 is near 0.83.
    numbers = (
        f"whose slope is {gain:.3g} times it, 99 % interval {low:.3g} to {high:.3g}, correlation {correlation:.2f}"
    )
    size, single = _unit(gain, low, high, known)
    certain = abs(correlation) > SIGNALS.certain_correlation
    if gain < 0:
        says = f"The {rate} has the wrong sign against the {of} ({numbers})" + (f", and {size}." if size else ".")
        return [Doubt(says, certain, _SIGN_REMEDIES[rate])]
    if (low > 1.0 or high < 1.0) and abs(gain - 1.0) > SIGNALS.gain_error:
        scale = f"check the scale of the {rate} in the profile" + (
            ", and the lever arm of what is measured away from the body origin" if of == "position" else ""
        )
        remedy = size if single else "; ".join(filter(None, (size, scale)))
        says = f"The {rate} does not match the {of} ({numbers}): {remedy}."
        tables = f"[signals.{_table(rate)}] or [signals.{of}]"
        return [Doubt(says, certain and single, f"correct the unit in {tables}")]
    return []


def _unit(gain: float, low: float, high: float, known: tuple[tuple[float, str], ...]) -> tuple[str, bool]:
    """Return which unit explains the size of a gain, and whether it is the only one that its interval leaves open.

    An interval that holds the right unit, one, shows no wrong one.
    """
    least, most = sorted((abs(low), abs(high))) if low * high > 0.0 else (0.0, max(abs(low), abs(high)))
    if least <= 1.0 <= most:
        return "", False
    near = [text for value, text in known if abs(abs(gain) / value - 1.0) < SIGNALS.unit_gain]
    held = [text for value, text in sorted(known) if text in near or least <= value <= most]
    if len(held) > 1:
        return f"{' or '.join(held)}, the interval holds {'both' if len(held) == 2 else 'all'}", False
    return "".join(near), bool(near)


def _range(seen: _Changes) -> tuple[float, float]:
    """Return the least and the greatest gain that noise in either signal and chance leave open, at 99 %.

    From the direct and the inverse regression, each with its standard error from sums over blocks, in which neighbouring
    errors are counted as one.
    """
    length = max(
        1,
        min(
            round(SIGNALS.gain_block_s / SIGNALS.gain_span_s),
            int(seen.number[-1] - seen.number[0]) // SIGNALS.gain_blocks,
        ),
    )
    _, block = np.unique(seen.number // length, return_inverse=True)
    ends = []
    for y, x in ((seen.change, seen.integral), (seen.integral, seen.change)):
        slope = float(x @ y) / float(x @ x)
        sums = np.bincount(block, x * (y - slope * x))
        count = sums.size
        error = float(np.sqrt(np.sum(sums**2) * count / max(count - 1, 1))) / float(x @ x)
        from scipy.special import stdtrit  # a tenth of a second to import: only where it is needed

        half = float(stdtrit(max(count - 1, 1), SIGNALS.gain_quantile)) * error
        ends.append((slope - half, slope + half))
    (low, high), (least, most) = ends
    # The inverse regression gives one over the gain; its interval may reach zero, and then the gain has no end.
    inverse = (1.0 / most, 1.0 / least) if least * most > 0.0 else (-np.inf, np.inf)
    return min(low, *inverse), max(high, *inverse)


def _changes(name: str, step: Floats, rate: Floats, track: Track, span: int) -> _Changes:
    """Return changes of a signal and integrals of its rate over windows of `span` rows inside measured data."""
    area = (rate[1:] + rate[:-1]) / (2 * track.rate_hz)
    good = np.isfinite(step) & np.isfinite(area) & track.valid[1:] & track.valid[:-1]
    count = (good.size // span) * span
    whole = good[:count].reshape(-1, span).all(axis=1)
    change = step[:count].reshape(-1, span)[whole].sum(axis=1)
    integral = area[:count].reshape(-1, span)[whole].sum(axis=1)
    # One jump of a position or heading would outweigh hours of agreement; jumps are counted elsewhere.
    floor, per_second = IMPLAUSIBLE[name]
    possible = np.abs(change) < floor + per_second * span / track.rate_hz
    return _Changes(change[possible], integral[possible], np.flatnonzero(whole)[possible])
