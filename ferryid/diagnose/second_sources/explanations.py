"""What a difference between two sensors is in words, and what would explain it."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite

from ferryid.counts import counted, verb
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.second_sources.thresholds import SECOND

KINDS = {
    "position": "position",
    "heading": "heading",
    "velocity": "velocity",
    "speed": "speed over ground",
    "yaw_rate": "yaw rate",
    "unknown": "signal",
}
CONSTANTS = {
    0.5 * 3600.0 / 1852.0: "knots taken as 0.5 m/s",
    1609.344 / 1852.0: "statute miles taken for nautical ones",
    1852.0 / 1609.344: "nautical miles taken for statute ones",
    0.9996: "the scale of a UTM grid",
    3.28 * 0.3048: "feet taken as 1/3.28 m",
}
"""Factors near one that a wrong constant of a unit makes."""
NAMES = {"kn": "knots", "deg/s": "deg/s", "ft": "feet", "ft/s": "feet per second"}


def digits(one: Estimate) -> int:
    """Return decimals of a value that its interval supports."""
    half = 0.5 * (one.high - one.low)
    if not isfinite(half) or half <= 0.0:
        return 3
    return min(max(1 - int(f"{half:e}".partition("e")[2]), 0), 6) - (
        1 if f"{half:e}"[0] not in "12" and half < 10.0 else 0
    )


def shown(one: Estimate, scale: float = 1.0, unit: str | None = None) -> str:
    """Return value ± half of the 95 % interval, with the unit."""
    scaled = Estimate(scale * one.value, scale * one.low, scale * one.high, one.unit if unit is None else unit)
    places = max(digits(scaled), 0)
    half = max(scaled.high - scaled.value, scaled.value - scaled.low)
    text = f"{scaled.value:.{places}f} ± {half:.{places}f}"
    return text if scaled.unit in ("-", "") else f"{text} {scaled.unit}"


def describe_reversed_sign(kind: str) -> str:
    """Return what an angle or rate of the other sign is."""
    if kind == "yaw_rate":
        return "sign reversed: z axis up, positive to port"
    return "sign reversed: anticlockwise"


def describe_quarter_turn(quarter: int, sign: float) -> str:
    """Return what a heading is that differs by quarter turns."""
    if sign < 0.0 and quarter == 1:
        return "counted from east (ENU)"
    return f"{ {1: 90, 2: 180, 3: 270}[quarter] } degrees added" + (
        ": points aft" if quarter == 2 and sign > 0.0 else ""
    )


def describe_scale(factor: Estimate, unit: str, rest: Estimate | None, near: str = "") -> str:
    """Return a factor, the unit that explains it, and what is left beside that; else what unit's it is near, if any's."""
    text = f"factor {shown(factor)}"
    if unit.startswith("1/"):
        name = NAMES.get(unit[2:], unit[2:])
        text += f": as if already converted from {name} once more"
    elif unit:
        text += f": {NAMES.get(unit, unit)}"
    else:
        for value, reason in CONSTANTS.items():
            if abs(factor.value - value) <= 0.5 * (factor.high - factor.low) < SECOND.constant_width * abs(value - 1.0):
                return f"{text}: {reason}"
        return f"{text}, near {near}" if near else text
    return text if rest is None else f"{text}, and {shown(rest)} beside it"


def describe_angle(one: Estimate) -> str:
    """Return by how much axes are turned."""
    return f"axes turned by {shown(one)}"


def describe_place(x: Estimate, y: Estimate) -> str:
    """Return where one sensor is, seen from the other."""
    ends = ("ahead" if x.value >= 0.0 else "astern", "to starboard" if y.value >= 0.0 else "to port")
    across, along = (shown(_positive(one)) for one in (y, x))
    return f"{along} {ends[0]} and {across} {ends[1]}"


def _positive(one: Estimate) -> Estimate:
    return one if one.value >= 0.0 else Estimate(-one.value, -one.high, -one.low, one.unit)


def describe_delay(one: Estimate) -> str:
    """Return how late or early a signal is."""
    text = shown(_positive(one), 1000.0, "ms")
    return f"{text} {'later' if one.value > 0.0 else 'earlier'}"


def describe_lag(one: Estimate) -> str:
    """Return which of the two is filtered."""
    which = "it lags the mapped signal" if one.value > 0.0 else "the mapped signal lags it"
    return f"{which} as by a first-order filter with a time constant of {shown(_positive(one))}"


def describe_bias(values: Mapping[str, Estimate], what: str) -> str:
    """Return a constant difference, or a drift."""
    parts = [shown(one) if name == "bias" else f"{shown(one)} {name}" for name, one in values.items()]
    return f"{what} {', '.join(parts)}"


def describe_heading_bias(one: Estimate) -> str:
    """Return a constant difference of headings."""
    return f"{shown(_positive(one))} {'clockwise' if one.value > 0.0 else 'anticlockwise'}"


def describe_steps(step: float, unit: str) -> str:
    """Return a resolution."""
    return f"steps of {step:.3g} {unit}"


def describe_wraps(count: int) -> str:
    """Return how many samples lie inside a wrap."""
    return f"{counted(count, 'sample')} {verb(count, 'was')} interpolated through a full turn, left out"
