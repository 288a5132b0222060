"""What kinematics show of fields whose names say nothing: heading and yaw rate, position and velocity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from ferryid.draft.fields import numeric_fields
from ferryid.draft.samples import Samples, read_samples
from ferryid.draft.thresholds import DRAFT
from ferryid.errors import FerryIdError
from ferryid.ingest.log import Reader
from ferryid.types import Flags, Floats, TimeRanges

Complexes = NDArray[np.complex128]

_MOST = 16
"""Fields of a topic that are compared: every two pairs of them are."""
_MOST_READINGS, _MOST_ROWS = 4, 2000
"""Pairs of angle and rate for which a position and a velocity are looked for, and rows of these."""
_ROUNDING = 1e-3
"""Spread of the slope of a time, over itself."""
_UNITS = (1.0, 180.0 / np.pi, np.pi / 180.0)
"""Of a rate over the slope of its angle: the same, or degrees and radians."""


@dataclass(frozen=True)
class _Rate:
    """A field that follows the slope of another, and the share of its variance that this explains."""

    angle: str
    rate: str
    share: float


@dataclass(frozen=True)
class _Moving:
    """A topic's fields on the grid, smoothed, and their slopes; without the jumps of angles that go round."""

    values: Mapping[str, Floats]
    slopes: Mapping[str, Floats]


def shown_by_values(reader: Reader, log: str, ranges: TimeRanges = ()) -> tuple[str, ...]:
    """Return what the kinematics of a log without telling names show, as parts of a sentence; of its topic of most fields."""
    topic = max(reader.topics, key=lambda one: len(numeric_fields(one)), default=None)
    if topic is None or len(numeric_fields(topic)) < 2 or topic.count < DRAFT.fewest_rows:
        return ()
    try:
        samples = read_samples(reader, {topic.name: tuple(numeric_fields(topic))}, log, ranges)
    except FerryIdError:
        return ()
    moving = _moving(samples, topic.name, tuple(numeric_fields(topic)))
    rates = _rates(moving)
    apart = _apart(rates)
    found = [
        (min(one.share, share), one, four) for one in rates[:_MOST_READINGS] for share, four in _position(moving, one)
    ]
    best = max(found, key=lambda one: one[0], default=None)
    # A velocity along the axes of the position follows its slopes as a yaw rate does: what is the heading is then open.
    if best is None or (len(apart) > 1 and apart[1].share >= best[0]):
        told = tuple(_told(one) for one in apart)
        return (*told, "as a yaw rate does that of a heading, and a velocity that of a position") if told else ()
    share, turning, (north, east, u, v) = best
    return (
        f"{_told(turning)}, as a yaw rate does that of a heading",
        f"{u} and {v}, turned by {turning.angle}, follow the slopes of {north} and {east} ({100.0 * share:.0f} %), as a "
        "velocity does that of a position",
    )


def _apart(rates: Sequence[_Rate]) -> list[_Rate]:
    """Return the best rates that have no field in common."""
    taken: set[str] = set()
    kept = []
    for one in rates:
        if not taken & {one.angle, one.rate}:
            taken |= {one.angle, one.rate}
            kept.append(one)
    return kept


def _told(one: _Rate) -> str:
    return f"{one.rate} follows the slope of {one.angle} ({100.0 * one.share:.0f} % of the variance)"


def _moving(samples: Samples, topic: str, fields: Sequence[str]) -> _Moving:
    names = [path for path in fields if samples.has(topic, (path,))][:_MOST]
    grid = {name: samples.on_grid(topic, _unwrapped(samples.raw(topic, name))) for name in names}
    slopes = {name: samples.slope(values, topic) for name, values in grid.items()}
    for slope in slopes.values():
        # The moving mean goes to zero at the ends.
        edge = max(1, len(slope) // 30)
        slope[:edge] = slope[-edge:] = np.nan
    return _Moving({name: samples.smooth(values, topic) for name, values in grid.items()}, slopes)


def _unwrapped(raw: Floats) -> Floats:
    """Return values without the jumps of an angle that goes round, where they look like one."""
    values = np.array(raw, dtype=np.float64)
    known = np.isfinite(values)
    if np.count_nonzero(known) > 1:
        period = 2.0 * np.pi if np.max(np.abs(values[known])) <= DRAFT.most_rad else 360.0
        if np.max(np.abs(np.diff(values[known]))) > 0.75 * period >= 0.7 * np.ptp(values[known]):
            values[known] = np.unwrap(values[known], period=period)
    return values


def _rates(moving: _Moving) -> list[_Rate]:
    """Return the pairs of which one is the slope of the other, in the same unit or in degrees and radians, the best first."""
    found = []
    for angle, rate in permutations(moving.values, 2):
        slope, values = moving.slopes[angle], moving.values[rate]
        rows = np.isfinite(slope) & np.isfinite(values) & _usual(slope)
        x, y = slope[rows], values[rows]
        if x.size < DRAFT.fewest_rows or _steady(moving, angle) or not np.ptp(y) > 0.0:
            continue
        share = max(1.0 - float(np.var(y - sign * unit * x) / np.var(y)) for unit in _UNITS for sign in (1.0, -1.0))
        if share >= DRAFT.agrees:
            found.append(_Rate(angle, rate, share))
    return sorted(found, key=lambda one: -one.share)


def _position(moving: _Moving, turning: _Rate) -> list[tuple[float, tuple[str, ...]]]:
    """Return the position and the velocity that a heading turns into its slope, after the share that this explains, if any."""
    step = len(moving.values[turning.angle]) // _MOST_ROWS + 1
    values = {name: one[::step] for name, one in moving.values.items()}
    slopes = {name: one[::step] for name, one in moving.slopes.items()}
    heading = values[turning.angle]
    # One that went round many times shows its unit by neither range nor rate: both are tried.
    turns = [np.exp(sign * 1j * angle) for angle in (heading, np.radians(heading)) for sign in (1.0, -1.0)]
    names = [name for name in values if name not in (turning.angle, turning.rate) and not _steady(moving, name)]
    best: tuple[float, tuple[str, ...]] | None = None
    for place in combinations(names, 2):
        moved = slopes[place[0]] + 1j * slopes[place[1]]
        usual = np.isfinite(moved) & np.isfinite(heading) & _usual(np.abs(moved))
        for speeds in combinations([name for name in names if name not in place], 2):
            along = values[speeds[0]] + 1j * values[speeds[1]]
            rows = usual & np.isfinite(along)
            if np.count_nonzero(rows) < DRAFT.fewest_rows:
                continue
            # North and east, ahead and starboard, in any order and with any sign.
            for hand in (along[rows], np.conj(along[rows])):
                for turn in turns:
                    share = _explained(moved[rows], hand * turn[rows])
                    if share >= DRAFT.agrees and (best is None or share > best[0]):
                        best = share, (*place, *speeds)
    return [] if best is None else [best]


def _explained(moved: Complexes, turned: Complexes) -> float:
    """Return the least share of the squares of two slopes that a turned velocity explains, by whole quarters of a turn."""
    common = np.vdot(turned, moved)
    quarter = 1j ** round(float(np.angle(common)) / (0.5 * np.pi))
    left = moved - quarter * turned
    parts = ((moved.real, left.real), (moved.imag, left.imag))
    return min(
        1.0 - float(np.sum(rest**2) / total) if (total := float(np.sum(part**2))) else 0.0 for part, rest in parts
    )


def _steady(moving: _Moving, name: str) -> bool:
    """Tell whether a field has one slope but for rounding, as a time has."""
    slope = moving.slopes[name][np.isfinite(moving.slopes[name])]
    low, middle, high = np.quantile(slope, (0.1, 0.5, 0.9)) if slope.size else (0.0, 0.0, 0.0)
    return bool(high - low <= _ROUNDING * abs(middle))


def _usual(slope: Floats) -> Flags:
    """True where a slope is not that of a jump."""
    known = np.abs(slope[np.isfinite(slope)])
    return np.asarray(np.abs(slope) <= DRAFT.jump * (np.quantile(known, 0.9) if known.size else 0.0))
