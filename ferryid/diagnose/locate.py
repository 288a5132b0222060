"""Where and when a model and a log differ: by axis, in time, and by heading, place, speed, thruster and frequency.

Everything is measured against the noise that the best hypothesis leaves: an error of every window, as a force, whitened by an
autoregression and scaled to unit variance, so that a mean square of 1 is what the model's own noise gives, give or take a known
error. Where nothing was found, the two hypotheses are one, and what is told is where its errors are larger than elsewhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from ferryid.diagnose.evidence import force_errors
from ferryid.diagnose.hypothesis import Fit, Trial, imagined
from ferryid.diagnose.noise import ORDER, noise_of
from ferryid.diagnose.weak import Windows, windows
from ferryid.effects.picture import Picture, Scene
from ferryid.vessel.profile import Floats

Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

SECTORS = 12
SPEEDS, PLACES, TIMES = 5, 3, 6
FEWEST = 4
"""Windows in a bin that are needed to judge it."""
BREAK = 2.3
"""Kuiper's statistic of changes of the mean, as of which they are believed: one in a thousand without any."""
MOST_BREAKS = 6
ACTS = 0.25
"""An interval acts whose mean excess is more than this part of the strongest one's."""
TELLS = 4.0
"""Standard errors by which a profile must differ from an even one to name a regime."""
HALF = 0.5
FINE = 8
"""The spectrum's windows are this much shorter than those of the fit, as they must not hide what is fast."""
BANDS_HZ = (0.0, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2)


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
    excess
        Mean square over that of the noise, less 1, by axis, shape (b, 3); NaN in bins with fewer than `FEWEST` windows.
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
    error: Floats
    mean: Floats
    by_axis: Floats
    statistic: float


@dataclass(frozen=True)
class Band:
    """One frequency band: power of the force error before and after by axis, shape (3,) [N², N², N²m²]."""

    low_hz: float
    high_hz: float
    before: Floats
    after: Floats


@dataclass(frozen=True)
class Location:
    """Where a mismatch shows.

    Attributes
    ----------
    shares
        Share of each axis in the excess, shape (3,); they add up to 1, or are all 0 where there is none.
    excess
        Mean square error before over that after, less 1, by axis, shape (3,).
    middle_s, before, after
        Time and force errors of every window, shapes (J,), (J, 3), (J, 3).
    intervals
        When it acts [s], pairs of first and last.
    onset_s, offset_s
        When errors rise and fall, None where they are large from the start, or to the end. What began before the vessel did
        anything that shows it, such as a payload before it accelerates, rises later; a suspect's own onset is found sharper.
    profiles
        The strongest first.
    bands
        From low to high frequency.
    regime
        Where it shows most, in words.
    """

    shares: Floats
    excess: Floats
    middle_s: Floats
    before: Floats
    after: Floats
    intervals: tuple[tuple[float, float], ...]
    onset_s: float | None
    offset_s: float | None
    profiles: tuple[Profiled, ...]
    bands: tuple[Band, ...]
    regime: str


def locate(trial: Trial, before: Fit, after: Fit, scene: Scene | None = None) -> Location:
    """Return where and when the errors of one hypothesis exceed those of a better one.

    Parameters
    ----------
    trial
        The log.
    before, after
        Fits without and with what was found; the same one where nothing was.
    scene
        The log's scene at its full rate, for frequencies above those of the trial's windows; the trial's own where None.
    """
    pictures = [imagined(trial.plain, made) for made in (before, after)]
    first, second = (force_errors(trial.windows, picture, trial.plain) for picture in pictures)
    kept, (white, calm) = whitened((first, second), trial.windows.runs)
    unexplained = before is after
    power_before, power_after = np.mean(white**2, axis=0), np.mean(calm**2, axis=0)
    excess = np.maximum(power_before / power_after - 1.0, 0.0)
    profiles = _profiles(trial.windows, kept, white, first)
    # Without a better hypothesis an axis stands out by how uneven its errors are.
    uneven = profiles[0].by_axis if unexplained and profiles and profiles[0].statistic >= TELLS else np.zeros(3)
    shares = _shared(np.maximum(uneven, 0.0) if unexplained else excess)
    axes = shares if shares.any() else np.full(3, 1.0 / 3.0)
    strength = (white**2 if unexplained else white**2 - calm**2) @ axes
    middle, seconds = trial.windows.middle_s, trial.windows.scene.t
    reach = 0.5 * len(trial.windows.weight) * trial.windows.scene.step_s
    intervals = acting(middle[kept], strength, reach, (float(seconds[0]), float(seconds[-1])), steady=unexplained)
    onset = None if not intervals or intervals[0][0] <= middle[0] else intervals[0][0]
    offset = None if not intervals or intervals[-1][1] >= middle[-1] else intervals[-1][1]
    return Location(
        shares,
        excess,
        middle,
        first,
        second,
        intervals,
        onset,
        offset,
        profiles,
        _bands(trial, pictures, scene),
        _in_words(profiles, axes),
    )


def _shared(values: Floats) -> Floats:
    total = float(values.sum())
    return values / total if total > 0.0 else np.zeros(3)


def whitened(errors: tuple[Floats, Floats], runs: tuple[tuple[int, int], ...]) -> tuple[Ints, tuple[Floats, Floats]]:
    """Return which windows are left, shape (m,), and errors before and after in units of the noise, shape (m, 3) each.

    Both pass through the autoregression of the second, axis by axis; the first `ORDER` windows of a series only start it.
    """
    kept = np.concatenate([np.arange(a + ORDER, b) for a, b in runs if b - a > ORDER])
    noise = noise_of(errors[1], runs)
    left = []
    for values in errors:
        parts = []
        for a, b in runs:
            if b - a <= ORDER:
                continue
            part = values[a:b]
            rest = part[ORDER:].copy()
            for k in range(ORDER):
                rest -= noise.coefficients[:, k] * part[ORDER - 1 - k : b - a - 1 - k]
            parts.append(rest)
        left.append(np.concatenate(parts))
    scale = np.sqrt(np.mean(left[1] ** 2, axis=0))
    scale = np.where(scale > 0.0, scale, 1.0)
    return kept, (left[0] / scale, left[1] / scale)


def acting(
    times: Floats, strength: Floats, reach_s: float, whole: tuple[float, float], *, steady: bool = False
) -> tuple[tuple[float, float], ...]:
    """Return the intervals [s] in which a strength's mean is large, by binary segmentation at changes of its mean.

    Parameters
    ----------
    times, strength
        Shape (m,).
    reach_s
        Half the length of a window: intervals that are no further apart are one.
    whole
        First and last time of the log, for intervals that never begin or end.
    steady
        True where the strength is that of noise as well, so that only what it has above its calmest interval counts.

    References
    ----------
    Kuiper (1960) for the statistic, Vostrikova (1981) for the segmentation. The standard deviation of the mean is that of
    blocks, since neighbours are correlated.
    """
    edges = [0, *sorted(_breaks(strength, 0, len(strength), MOST_BREAKS)), len(strength)]
    means = [float(strength[a:b].mean()) for a, b in pairwise(edges)]
    calm = min(means) if steady and len(means) > 1 else 0.0
    top = max(means)
    if top <= calm:
        return ()
    found: list[tuple[float, float]] = []
    for (a, b), mean in zip(pairwise(edges), means, strict=True):
        if mean - calm <= ACTS * (top - calm):
            continue
        start = whole[0] if a == 0 else float(0.5 * (times[a - 1] + times[a]))
        end = whole[1] if b == len(strength) else float(0.5 * (times[b - 1] + times[b]))
        if found and start - found[-1][1] <= reach_s:
            found[-1] = (found[-1][0], end)
        else:
            found.append((start, end))
    return tuple(found)


def profile_of(name: str, unit: str, value: Floats, edges: Floats, white: Floats, errors: Floats) -> Profiled:
    """Sort errors into bins.

    Parameters
    ----------
    name, unit, value, edges
        What they are sorted by, shape (m,), and edges of the bins, shape (b + 1,).
    white, errors
        In units of the noise, and as forces, shape (m, 3).
    """
    b = len(edges) - 1
    place = np.clip(np.searchsorted(edges, value, side="right") - 1, 0, b - 1)
    count = np.bincount(place, minlength=b)
    enough = count >= FEWEST
    safe = np.maximum(count, 1)
    power, mean = np.zeros((b, 3)), np.zeros((b, 3))
    np.add.at(power, place, white**2)
    np.add.at(mean, place, errors)
    power, mean = power / safe[:, None], mean / safe[:, None]
    # Against an even profile: the logarithm of a mean of n squares of unit noise has the variance 2/n.
    level = np.log(np.maximum(power, 1e-12))
    weight = np.where(enough, count, 0.0)[:, None]
    even = (weight * level).sum(axis=0) / max(float(weight.sum()), 1.0)
    chi = (0.5 * weight * (level - even) ** 2).sum(axis=0)
    free = max(1, int(enough.sum()) - 1)
    told = enough.sum() > 1
    by_axis = (chi - free) / sqrt(2.0 * free) if told else np.zeros(3)
    statistic = float(chi.sum() - 3 * free) / sqrt(6.0 * free) if told else 0.0
    blank = np.where(enough[:, None], 0.0, np.nan)
    error = np.sqrt(2.0 / safe)
    return Profiled(
        name, unit, edges[:-1], edges[1:], count, power - 1.0 + blank, error, mean + blank, by_axis, statistic
    )


def _breaks(strength: Floats, first: int, end: int, most: int) -> list[int]:
    n = end - first
    if n < 4 * FEWEST or most <= 0:
        return []
    part = strength[first:end]
    # Large squares are rare and heavy: their roots vary less.
    part = np.sign(part) * np.sqrt(np.abs(part))
    away = np.concatenate([[0.0], np.cumsum(part - part.mean())])
    # From its lowest to its highest point the sum gains most: one of the two ends of what differs, or both.
    cuts = sorted({int(np.argmin(away)), int(np.argmax(away))})
    cuts = [k for k in cuts if FEWEST <= k <= n - FEWEST]
    pieces = np.split(part, cuts)
    deviation = _long_deviation(np.concatenate([piece - piece.mean() for piece in pieces]))
    if not cuts or away.max() - away.min() <= BREAK * deviation * sqrt(n):
        return []
    ends = [first, *(first + k for k in cuts), end]
    further = [k for a, b in pairwise(ends) for k in _breaks(strength, a, b, most // 2)]
    return [*ends[1:-1], *further]


def _long_deviation(values: Floats) -> float:
    """Return the standard deviation that the sum of many values has per root of their number."""
    size = max(1, round(len(values) ** (1.0 / 3.0)) * 2)
    blocks = len(values) // size
    if blocks < 4:
        return float(values.std())
    means = values[: blocks * size].reshape(blocks, size).mean(axis=1)
    return max(float(means.std() * sqrt(size)), float(values.std()) * 0.5)


def _profiles(windows_: Windows, kept: Ints, white: Floats, errors: Floats) -> tuple[Profiled, ...]:
    scene = windows_.scene
    rows = windows_.starts[kept] + len(windows_.weight) // 2
    chosen = errors[kept]
    turn: Floats = np.linspace(0.0, 360.0, SECTORS + 1)
    heading = np.asarray(np.degrees(scene.psi[rows]) % 360.0, dtype=np.float64)
    made = [profile_of("heading", "deg", heading, turn, white, chosen)]
    speed = np.hypot(scene.nu[rows, 0], scene.nu[rows, 1])
    sorted_by: list[tuple[str, str, Floats, int]] = [
        ("speed", "m/s", speed, SPEEDS),
        ("yaw rate", "deg/s", np.degrees(scene.nu[rows, 2]), SPEEDS),
    ]
    sorted_by.append(("time", "s", windows_.middle_s[kept], TIMES))
    if np.isfinite(scene.eta[rows, :2]).all():
        sorted_by += [("north", "m", scene.eta[rows, 0], PLACES), ("east", "m", scene.eta[rows, 1], PLACES)]
    for k, name in enumerate(scene.names):
        angle, part = scene.angles[rows, k], scene.parts[rows, k]
        strength = np.hypot(part[:, 0], part[:, 1])
        sorted_by.append((f"{name} force", "N", strength, SPEEDS))
        if np.isfinite(angle).all():
            sector = np.asarray(np.degrees(angle) % 360.0, dtype=np.float64)
            made.append(profile_of(f"{name} angle", "deg", sector, turn, white, chosen))
    for name, unit, value, bins in sorted_by:
        edges: Floats = np.unique(np.quantile(value, np.linspace(0.0, 1.0, bins + 1)))
        if len(edges) > 2:
            made.append(profile_of(name, unit, value, edges, white, chosen))
    return tuple(sorted(made, key=lambda one: -one.statistic))


def _in_words(profiles: Sequence[Profiled], shares: Floats) -> str:
    """Return the bins of the most telling profile that hold at least half of its greatest excess."""
    telling = [one for one in profiles if one.statistic >= TELLS]
    if not telling:
        return "all along"
    # When is said with the intervals: here time only stands for what nothing else tells.
    one = next((one for one in telling if one.name != "time"), telling[0])
    level = np.where(np.isfinite(one.excess).all(axis=1), np.nan_to_num(one.excess) @ shares, -np.inf)
    strong = level >= HALF * level.max()
    pieces = [
        f"{_number(one.low[a])} to {_number(one.high[b - 1])} {one.unit}"
        for a, b in _stretches(strong, round_trip=one.unit == "deg" and len(one.low) == SECTORS)
    ]
    what = {"heading": "headings", "speed": "speeds", "yaw rate": "yaw rates"}.get(one.name, one.name)
    return f"{what} {' and '.join(pieces)}"


def _stretches(flags: Flags, *, round_trip: bool) -> list[tuple[int, int]]:
    """Return unbroken stretches as (first, end); round the compass the last goes on in the first."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8))).reshape(-1, 2)
    found = [(int(a), int(b)) for a, b in edges]
    if round_trip and len(found) > 1 and flags[0] and flags[-1]:
        found = [(found[-1][0], found[0][1]), *found[1:-1]]
    return found


def _number(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 20.0 or value == round(value) else f"{value:.2g}"


def _bands(trial: Trial, pictures: Sequence[Picture], scene: Scene | None) -> tuple[Band, ...]:
    """Return the power of the force errors in frequency bands, by windows short enough to let them through.

    The weight of a window of length T passes frequencies up to about 1/T; the power of each is that of the filtered error.
    """
    full = trial.windows.scene if scene is None else scene
    length_s = len(trial.windows.weight) * trial.windows.scene.step_s / FINE
    step_s = trial.windows.scene.step_s
    short = windows(full, max(length_s, 8.0 * step_s), step_s)
    spectra = [_spectrum(short, force_errors(short, picture, trial.plain)) for picture in pictures]
    if not spectra[0][0].size:
        return ()
    frequency = spectra[0][0]
    edges = [edge for edge in BANDS_HZ if edge < frequency[-1]] + [float(frequency[-1])]
    bands = []
    for low, high in pairwise(edges):
        inside = (frequency > low) & (frequency <= high)
        if inside.any():
            bands.append(Band(low, high, *(power[inside].sum(axis=0) for _, power in spectra)))
    return tuple(bands)


def _spectrum(short: Windows, errors: Floats) -> tuple[Floats, Floats]:
    """Return frequencies [Hz] and power of each, shapes (f,) and (f, 3), from stretches of equal length, half overlapping."""
    longest = max((b - a for a, b in short.runs), default=0)
    size = min(longest, 512)
    if size < 16:
        return np.empty(0), np.empty((0, 3))
    step_s = float(np.median(np.diff(short.starts))) * short.scene.step_s
    taper = np.sin(np.pi * (np.arange(size) + 0.5) / size)[:, None]
    total, count = np.zeros((size // 2 + 1, 3)), 0
    for a, b in short.runs:
        for first in range(a, b - size + 1, size // 2):
            part = errors[first : first + size]
            total += np.abs(np.fft.rfft(taper * part, axis=0)) ** 2
            count += 1
    power = 2.0 * total / (count * size * float((taper**2).sum()))
    return np.asarray(np.fft.rfftfreq(size, step_s)), power
