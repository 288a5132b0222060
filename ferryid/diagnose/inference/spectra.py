"""Which frequencies errors have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.special import polygamma

from ferryid.diagnose.inference.estimation import EstimationProblem
from ferryid.diagnose.inference.force_errors import force_errors, position_errors
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.inference.weak_form import Windows, windows
from ferryid.effects.force_model import ForceModel, Measurements
from ferryid.types import Floats

WINDOW_RATIO = 8
"""The spectrum's windows are this much shorter than those of the fit, as they must not hide what is fast."""
BURST_HZ = (0.03, 0.1, 0.2, 0.4, 0.8)
"""Bands that are searched for bursts."""
BURST_S, BURST_PERIODS = 20.0, 1.2
"""Shortest block of a burst, and periods of a band's highest frequency that it holds at least."""
BANDS_HZ = (0.0, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2)


@dataclass(frozen=True)
class Band:
    """One frequency band: power of the force error before and after by axis, shape (3,) [N², N², N²m²]."""

    low_hz: float
    high_hz: float
    before: Floats
    after: Floats


@dataclass(frozen=True)
class Burst:
    """A band whose power comes and goes.

    Attributes
    ----------
    low_hz, high_hz
        The band.
    deviations
        By how many standard deviations it is away from a band that is even.
    shares
        Share of each axis in that, shape (3,).
    intervals
        When it is loud [s].
    t, force
        Time [s], shape (m,), and what the band lets through of the force error [N, N, N·m], shape (m, 3).
    whole
        The force error of all frequencies on the same rows, shape (m, 3) [N, N, N·m].
    in_positions
        Share of it that positions and headings show too, on the axis that shows most, with its standard error: one of a force,
        zero of noise that is in the velocities only. None where there are no positions.
    """

    low_hz: float
    high_hz: float
    deviations: float
    shares: Floats
    intervals: tuple[tuple[float, float], ...]
    t: Floats
    force: Floats
    whole: Floats
    in_positions: tuple[float, float] | None


def bands_of(
    problem: EstimationProblem, force_models: Sequence[ForceModel], measurements: Measurements | None
) -> tuple[Band, ...]:
    """Return the power of the force errors in frequency bands, by windows short enough to let them through.

    The weight of a window of length T passes frequencies up to about 1/T; the power of each is that of the filtered error.
    """
    short = fine_windows(problem, problem.windows.measurements if measurements is None else measurements)
    spectra = [spectrum_of(short, force_errors(short, force_model, problem.plain)) for force_model in force_models]
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


def fine_windows(problem: EstimationProblem, measurements: Measurements) -> Windows:
    """Return windows of the measurements that are short enough to show what is fast."""
    step_s = problem.windows.measurements.step_s
    return windows(measurements, max(len(problem.windows.weight) * step_s / WINDOW_RATIO, 8.0 * step_s), step_s)


def bursts_of(problem: EstimationProblem, force_model: ForceModel, measurements: Measurements) -> Burst | None:
    """Return the most telling band in which the power of the force error comes and goes; None where there are no bands.

    The power of blocks is compared with an even one, as that of noise would be: of a band of width B, a block of length T holds
    2 B T independent values, of which the mean square's logarithm has a known variance. Between samples all signals are lines:
    what a band has of few samples a period is missing in forces and motions in different ways, and resembles a force.
    """
    short = fine_windows(problem, measurements)
    errors = force_errors(short, force_model, problem.plain)
    positions = position_errors(short, force_model, problem.plain)
    found = []
    for low, high in pairwise(BURST_HZ):
        block_s = max(BURST_S, BURST_PERIODS / high)
        if high < 0.5 / short.measurements.step_s and high * INFERENCE.burst_samples <= 1.0 / measurements.step_s:
            found.append(_uneven(short, errors, positions, low, high, block_s))
    uneven = [one for one in found if one is not None]
    return max(uneven, key=lambda one: one.deviations, default=None)


def _uneven(
    short: Windows, errors: Floats, positions: Floats | None, low_hz: float, high_hz: float, block_s: float
) -> Burst | None:
    step_s = short.measurements.step_s
    size = round(block_s / step_s)
    edges, detection_powers, times, forces = [], [], [], []
    for a, b in short.runs:
        if b - a < 2 * size:
            continue
        part = _passed(errors[a:b], low_hz, high_hz, step_s)
        times.append(short.middle_s[a:b])
        forces.append(part)
        for k in range(0, b - a - size + 1, size):
            detection_powers.append(np.mean(part[k : k + size] ** 2, axis=0))
            edges.append((float(short.middle_s[a + k]), float(short.middle_s[a + k + size - 1])))
    if len(detection_powers) < INFERENCE.burst_blocks:
        return None
    level = np.log(np.maximum(detection_powers, 1e-12))
    held = max(1.0, 2.0 * (high_hz - low_hz) * block_s)
    chi = np.sum((level - level.mean(axis=0)) ** 2, axis=0) / float(polygamma(1, 0.5 * held))
    total = float(chi.sum()) / (3.0 * (len(detection_powers) - 1))
    spread = 2.0 / (27.0 * (len(detection_powers) - 1))
    # Wilson and Hilferty (1931): as many standard deviations of a normal variable are as rare.
    deviations = float((np.cbrt(total) - (1.0 - spread)) / np.sqrt(spread))
    above = np.exp(level - np.median(level, axis=0))
    shares = np.maximum(chi - (len(detection_powers) - 1), 0.0)
    axes = shares / shares.sum() if shares.sum() > 0.0 else np.full(3, 1.0 / 3.0)
    loud = above @ axes >= INFERENCE.burst_level
    spans: list[tuple[float, float]] = []
    for (first, last), one in zip(edges, loud, strict=True):
        if one and spans and first - spans[-1][1] <= step_s * 1.5:
            spans[-1] = (spans[-1][0], last)
        elif one:
            spans.append((first, last))
    shown, kept = None, [(a, b) for a, b in short.runs if b - a >= 2 * size]
    if positions is not None:
        seen = np.concatenate([_passed(positions[a:b], low_hz, high_hz, step_s) for a, b in kept])
        axis = int(np.argmax(axes))
        shown = shown_share(np.concatenate(forces)[:, axis], seen[:, axis], size)
    whole = np.concatenate([errors[a:b] for a, b in kept])
    return Burst(
        low_hz, high_hz, deviations, axes, tuple(spans), np.concatenate(times), np.concatenate(forces), whole, shown
    )


def shown_share(errors: Floats, seen: Floats, size: int) -> tuple[float, float]:
    """Return the share of errors that another sensor shows too, and its standard error from blocks of so many rows.

    A regression of what the other shows, shape (m,), on the errors, shape (m,): the other's own noise, which is in none of the
    errors, does not bend it.
    """
    count = max(1, len(errors) // max(size, 1))
    across, power = (
        np.array([float(part.sum()) for part in np.array_split(one, count)]) for one in (errors * seen, errors**2)
    )
    total = max(float(power.sum()), 1e-300)
    share = float(across.sum()) / total
    return share, float(np.sqrt(np.sum((across - share * power) ** 2))) / total


def _passed(values: Floats, low_hz: float, high_hz: float, step_s: float) -> Floats:
    """Return what a band lets through, with a taper at the ends of the series."""
    n = len(values)
    taper = np.minimum(1.0, np.minimum(np.arange(n) + 0.5, n - np.arange(n) - 0.5) * step_s * high_hz)[:, None]
    spectrum = np.fft.rfft((values - values.mean(axis=0)) * taper, axis=0)
    frequency = np.fft.rfftfreq(n, step_s)
    spectrum[(frequency <= low_hz) | (frequency > high_hz)] = 0.0
    return np.asarray(np.fft.irfft(spectrum, n, axis=0))


def spectrum_of(short: Windows, errors: Floats) -> tuple[Floats, Floats]:
    """Return frequencies [Hz] and power of each, shapes (f,) and (f, 3), from stretches of equal length, half overlapping."""
    longest = max((b - a for a, b in short.runs), default=0)
    size = min(longest, 512)
    if size < 16:
        return np.empty(0), np.empty((0, 3))
    step_s = float(np.median(np.diff(short.starts))) * short.measurements.step_s
    taper = np.sin(np.pi * (np.arange(size) + 0.5) / size)[:, None]
    total, count = np.zeros((size // 2 + 1, 3)), 0
    for a, b in short.runs:
        for first in range(a, b - size + 1, size // 2):
            part = errors[first : first + size]
            total += np.abs(np.fft.rfft(taper * part, axis=0)) ** 2
            count += 1
    power = 2.0 * total / (count * size * float((taper**2).sum()))
    return np.asarray(np.fft.rfftfreq(size, step_s)), power
