"""Where and when a model and a log differ: by axis, in time, and by heading, place, speed, thruster and frequency.

Everything is measured against the noise that the best hypothesis leaves: an error of every window, as a force, whitened by an
autoregression and scaled to unit variance, so that a mean square of 1 is what the model's own noise gives, give or take a known
error. Where nothing was found, the two hypotheses are one, and what is told is where its errors are larger than elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ferryid.diagnose.inference.autoregression import ORDER, fit_autoregression
from ferryid.diagnose.inference.change_points import active_intervals
from ferryid.diagnose.inference.estimation import EstimationProblem, Fit, fitted_force_model
from ferryid.diagnose.inference.force_errors import force_errors
from ferryid.diagnose.inference.spectra import Band, bands_of
from ferryid.diagnose.judging.error_profiles import Profiled, in_words, profiles_of
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects.force_model import ForceModel, Measurements
from ferryid.types import Floats, Ints


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
        anything that shows it, such as a payload before it accelerates, rises later; a candidate's own onset is found sharper.
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


def locate(problem: EstimationProblem, before: Fit, after: Fit, measurements: Measurements | None = None) -> Location:
    """Return where and when the errors of one hypothesis exceed those of a better one.

    Parameters
    ----------
    problem
        The log.
    before, after
        Fits without and with what was found; the same one where nothing was.
    measurements
        The log's measurements at its full rate, for frequencies above those of the trial's windows; the trial's own where None.
    """
    first, second = (fitted_force_model(problem.plain, made) for made in (before, after))
    return locate_between(problem, (first, second), measurements, unexplained=before is after)


def locate_between(
    problem: EstimationProblem,
    force_models: tuple[ForceModel, ForceModel],
    measurements: Measurements | None = None,
    *,
    unexplained: bool = False,
) -> Location:
    """Return the same of two force models; of one, where its errors are larger than elsewhere, where `unexplained`."""
    first, second = (force_errors(problem.windows, force_model, problem.plain) for force_model in force_models)
    kept, (white, calm) = whitened((first, second), problem.windows.runs)
    power_before, power_after = np.mean(white**2, axis=0), np.mean(calm**2, axis=0)
    excess = np.maximum(power_before / power_after - 1.0, 0.0)
    profiles = profiles_of(problem.windows, kept, white, calm, first)
    # Without a better hypothesis an axis stands out by how uneven its errors are.
    uneven = (
        profiles[0].by_axis
        if unexplained and profiles and profiles[0].statistic >= JUDGING.regime_errors
        else np.zeros(3)
    )
    shares = _shared(np.maximum(uneven, 0.0) if unexplained else excess)
    axes = shares if shares.any() else np.full(3, 1.0 / 3.0)
    strength = (white**2 if unexplained else white**2 - calm**2) @ axes
    middle, seconds = problem.windows.middle_s, problem.windows.measurements.t
    reach = 0.5 * len(problem.windows.weight) * problem.windows.measurements.step_s
    intervals = active_intervals(
        middle[kept], strength, reach, (float(seconds[0]), float(seconds[-1])), steady=unexplained
    )
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
        bands_of(problem, force_models, measurements),
        in_words(profiles, axes),
    )


def plain_location(where: Location) -> dict[str, Any]:
    """Return a location as it stands in JSON; a profile's mean squares are over those of the noise, which are 1."""

    def by_axis(values: Floats) -> dict[str, float]:
        return dict(zip(("surge", "sway", "yaw"), values.tolist(), strict=True))

    return {
        "axes": by_axis(where.shares),
        "intervals": [list(pair) for pair in where.intervals],
        "onset": where.onset_s,
        "offset": where.offset_s,
        "regime": where.regime,
        "profiles": [
            {
                "by": one.name,
                "unit": one.unit,
                "low": one.low.tolist(),
                "high": one.high.tolist(),
                "windows": one.count.tolist(),
                "before": [by_axis(row) for row in one.excess + 1.0],
                "after": [by_axis(row) for row in one.left + 1.0],
                "noise": one.error.tolist(),
                "deviations": one.statistic,
            }
            for one in where.profiles
        ],
        "bands": [
            {"low_hz": one.low_hz, "high_hz": one.high_hz, "before": by_axis(one.before), "after": by_axis(one.after)}
            for one in where.bands
        ],
    }


def _shared(values: Floats) -> Floats:
    total = float(values.sum())
    return values / total if total > 0.0 else np.zeros(3)


def whitened(errors: tuple[Floats, Floats], runs: tuple[tuple[int, int], ...]) -> tuple[Ints, tuple[Floats, Floats]]:
    """Return which windows are left, shape (m,), and errors before and after in units of the noise, shape (m, 3) each.

    Both pass through the autoregression of the second, axis by axis; the first `ORDER` windows of a series only start it.
    """
    kept = np.concatenate([np.arange(a + ORDER, b) for a, b in runs if b - a > ORDER])
    noise = fit_autoregression(errors[1], runs)
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
