"""Errors sorted by where the vessel was and what it did, against what noise alone would give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import digamma, polygamma

from ferryid.diagnose.inference.weak_form import Windows
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.types import Flags, Floats, Ints

SECTORS = 12
SPEEDS, PLACES, TIMES = 5, 3, 6


@dataclass(frozen=True)
class Profiled:
    """Errors of windows sorted by where the vessel was.

    Attributes
    ----------
    name, unit
        Of what they are sorted by: ``"heading"`` in ``"deg"``, ``"thruster1 angle"`` ...
    low, high
        Edges of the bins, shape (b,).
    count
        Windows in each bin, shape (b,).
    excess, left
        Mean square over that of the noise, less 1, by axis, before and after, shape (b, 3); NaN in bins with fewer than
        `JUDGING.bin_windows` windows.
    error
        Its standard error if there were noise alone, shape (b,).
    mean
        Mean force error before [N, N, N·m], shape (b, 3): with its sign.
    by_axis, statistic
        How many standard deviations the profile is away from an even one: on each axis, shape (3,), and altogether.
    """

    name: str
    unit: str
    low: Floats
    high: Floats
    count: Ints
    excess: Floats
    left: Floats
    error: Floats
    mean: Floats
    by_axis: Floats
    statistic: float


def profile_of(
    name: str, unit: str, value: Floats, edges: Floats, white: Floats, calm: Floats, errors: Floats
) -> Profiled:
    """Sort errors into bins.

    Parameters
    ----------
    name, unit, value, edges
        What they are sorted by, shape (m,), and edges of the bins, shape (b + 1,).
    white, calm, errors
        Before and after in units of the noise, and before as forces, shape (m, 3).
    """
    b = len(edges) - 1
    place = np.clip(np.searchsorted(edges, value, side="right") - 1, 0, b - 1)
    count = np.bincount(place, minlength=b)
    enough = count >= JUDGING.bin_windows
    safe = np.maximum(count, 1)

    def by_bin(values: Floats) -> Floats:
        sums = np.zeros((b, 3))
        np.add.at(sums, place, values)
        return sums / safe[:, None]

    power, left, mean = by_bin(white**2), by_bin(calm**2), by_bin(errors)
    # Against an even profile: mean and variance of the logarithm of a mean of n squares of unit noise.
    level = np.log(np.maximum(power, 1e-12)) - (digamma(0.5 * safe) - np.log(0.5 * safe))[:, None]
    weight = np.where(enough, 1.0 / polygamma(1, 0.5 * safe), 0.0)[:, None]
    even = (weight * level).sum(axis=0) / max(float(weight.sum()), 1.0)
    chi = (weight * (level - even) ** 2).sum(axis=0)
    free = int(enough.sum()) - 1
    by_axis = np.array([_deviations(float(one), free) for one in chi])
    statistic = _deviations(float(chi.sum()), 3 * free)
    blank = np.where(enough[:, None], 0.0, np.nan)
    error = np.sqrt(2.0 / safe)
    return Profiled(
        name,
        unit,
        edges[:-1],
        edges[1:],
        count,
        power - 1.0 + blank,
        left - 1.0 + blank,
        error,
        mean + blank,
        by_axis,
        statistic,
    )


def _deviations(chi_squared: float, free: int) -> float:
    """Return how many standard deviations of a normal variable are as rare, by Wilson and Hilferty (1931)."""
    if free < 1:
        return 0.0
    spread = 2.0 / (9.0 * free)
    return float((np.cbrt(chi_squared / free) - (1.0 - spread)) / np.sqrt(spread))


def profiles_of(windows_: Windows, kept: Ints, white: Floats, calm: Floats, errors: Floats) -> tuple[Profiled, ...]:
    measurements = windows_.measurements
    rows = windows_.starts[kept] + len(windows_.weight) // 2
    chosen = errors[kept]
    turn: Floats = np.linspace(0.0, 360.0, SECTORS + 1)
    heading = np.asarray(np.degrees(measurements.psi[rows]) % 360.0, dtype=np.float64)
    made = [profile_of("heading", "deg", heading, turn, white, calm, chosen)]
    speed = np.hypot(measurements.nu[rows, 0], measurements.nu[rows, 1])
    sorted_by: list[tuple[str, str, Floats, int]] = [
        ("speed", "m/s", speed, SPEEDS),
        ("yaw rate", "deg/s", np.degrees(measurements.nu[rows, 2]), SPEEDS),
    ]
    sorted_by.append(("time", "s", windows_.middle_s[kept], TIMES))
    if np.isfinite(measurements.eta[rows, :2]).all():
        sorted_by += [
            ("north", "m", measurements.eta[rows, 0], PLACES),
            ("east", "m", measurements.eta[rows, 1], PLACES),
        ]
    for k, name in enumerate(measurements.names):
        angle, part = measurements.angles[rows, k], measurements.parts[rows, k]
        strength = np.hypot(part[:, 0], part[:, 1])
        sorted_by.append((f"{name} force", "N", strength, SPEEDS))
        if np.isfinite(angle).all():
            sector = np.asarray(np.degrees(angle) % 360.0, dtype=np.float64)
            made.append(profile_of(f"{name} angle", "deg", sector, turn, white, calm, chosen))
    for name, unit, value, bins in sorted_by:
        edges: Floats = np.unique(np.quantile(value, np.linspace(0.0, 1.0, bins + 1)))
        if len(edges) > 2:
            made.append(profile_of(name, unit, value, edges, white, calm, chosen))
    return tuple(sorted(made, key=lambda one: -one.statistic))


def in_words(profiles: Sequence[Profiled], shares: Floats) -> str:
    """Return the bins of the most telling profile that hold at least half of its greatest excess."""
    telling = [one for one in profiles if one.statistic >= JUDGING.regime_errors]
    if not telling:
        return "all along"
    # When is said with the intervals: here time only stands for what nothing else tells.
    one = next((one for one in telling if one.name != "time"), telling[0])
    level = np.where(np.isfinite(one.excess).all(axis=1), np.nan_to_num(one.excess) @ shares, -np.inf)
    strong = level >= JUDGING.regime_level * level.max()
    pieces = [
        f"{_number(one.low[a])} to {_number(one.high[b - 1])}"
        for a, b in _stretches(strong, round_trip=one.unit == "deg" and len(one.low) == SECTORS)
    ]
    return _phrase(one, " and ".join([", ".join(pieces[:-1]), pieces[-1]] if len(pieces) > 1 else pieces))


def _phrase(one: Profiled, ranges: str) -> str:
    """Return a regime so that "at" can stand before it."""
    known = {
        "heading": f"headings {ranges} deg",
        "speed": f"speeds of {ranges} m/s",
        "yaw rate": f"yaw rates of {ranges} deg/s",
        "time": f"times {ranges} s",
        "north": f"places {ranges} m north",
        "east": f"places {ranges} m east",
    }
    actuator, _, what = one.name.rpartition(" ")
    if what == "angle":
        return f"angles of {actuator} of {ranges} deg"
    return known.get(one.name, f"forces of {actuator} of {ranges} {one.unit}")


def _stretches(flags: Flags, *, round_trip: bool) -> list[tuple[int, int]]:
    """Return unbroken stretches as (first, end); round the compass the last goes on in the first."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8))).reshape(-1, 2)
    found = [(int(a), int(b)) for a, b in edges]
    if round_trip and len(found) > 1 and flags[0] and flags[-1]:
        found = [(found[-1][0], found[0][1]), *found[1:-1]]
    return found


def _number(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 20.0 or value == round(value) else f"{value:.2g}"
