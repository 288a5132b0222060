"""When a disturbance acts, and how it grows: what each step of the filter gains by it, summed up.

Waves get up, and a wake passes. As a disturbance that acts all along, a wake of a minute is weak, and the calm before and
after speaks against it. The likelihood of a filter is a product over its steps, so that two runs of the filter show what each
step gains by a disturbance; what it gains in a span is nearly the sum of those of the span. One pass over the sums finds the
likeliest span, which is then fitted.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import inf, isfinite, log

import numpy as np

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.noise_model import NoiseModel, likelihood, make_whitening_filter, stride_s
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.inference.weak_form import STEPS_A_WINDOW, Windows
from ferryid.effects.effect import Process
from ferryid.effects.force_model import ForceModel
from ferryid.types import Floats

GROWTHS = (0.03, 0.1, 0.25, 0.5, 2.0, 4.0, 10.0, 30.0)
"""Strengths at the end over those at the start of a log that are tried."""
FINEST_FACTOR = 1.1
"""Factor between neighbouring growths that are compared last."""
GROWTH_DIFFERENCE = 0.3
"""Step in the logarithm of a growth by which the curvature of the likelihood is found."""

Processes = Callable[[Floats], tuple[Process, ...]]
"""Returns processes from positive parameters."""


@dataclass(frozen=True)
class StrengthCourse:
    """How strong a disturbance is over a log: all along alike, in a span, or growing evenly from its start to its end.

    Attributes
    ----------
    onset_s, offset_s
        From when until when it acts [s].
    growth
        Strength at the end of the log over that at its start.
    with_force
        True where its ends are those of a force that was found, and so are no choice.
    """

    onset_s: float = 0.0
    offset_s: float = inf
    growth: float = 1.0
    with_force: bool = False

    @property
    def ends(self) -> int:
        """How many of its two ends lie within the log."""
        return int(self.onset_s > 0.0) + int(isfinite(self.offset_s))

    def factors(self, t: Floats) -> Floats:
        """Return the strength over its root mean square while it acts, at some times [s], shape (n,)."""
        acts = (t >= self.onset_s) & (t < self.offset_s)
        if self.growth == 1.0:
            return acts.astype(np.float64)
        share = (t - t[0]) / max(float(t[-1] - t[0]), 1e-9)
        strength = (1.0 + (self.growth - 1.0) * share) * acts
        return np.asarray(strength / np.sqrt(np.mean(strength**2)))

    def cost(self, steps: int) -> float:
        """Return the evidence that it must bring: each end is chosen from so many steps, and it is a finding of its own."""
        if self == ALL_ALONG or self.with_force:
            return 0.0
        return INFERENCE.prior_odds + (self.ends + 0.5 * (self.growth != 1.0)) * log(steps)


ALL_ALONG = StrengthCourse()


def acting(processes: Processes, course: StrengthCourse, force_model: ForceModel) -> Processes:
    """Return processes that are as strong as a course has it."""
    if course == ALL_ALONG:
        return processes
    factors = course.factors(force_model.measurements.t)[:, None]
    return lambda p: tuple(replace(one, force=one.force * factors) for one in processes(p))


def step_likelihoods(steps: Windows, gaps: Floats, noise: NoiseModel) -> Floats:
    """Return the logarithm of the likelihood of each step's gaps after those before it, but for a constant, shape (J,)."""
    ready = make_whitening_filter(noise, steps)
    whitened = ready.white(gaps).reshape(len(gaps), -1)
    return np.asarray(-0.5 * np.sum(whitened**2, axis=1) - ready.log_scales.sum(axis=1))


def likeliest_span(steps: Windows, gained: Floats) -> tuple[StrengthCourse, float]:
    """Return the span that gains most, less what its ends cost, and what it gains so.

    Parameters
    ----------
    steps
        Of the filter.
    gained
        What each step gains in log-likelihood by the disturbance, shape (J,): see `step_likelihoods`.
    """
    n = len(gained)
    shortest = max(1, round(shortest_s(steps) / stride_s(steps)))
    if n < 2 * shortest:
        return ALL_ALONG, float(gained.sum())
    sums = np.concatenate([[0.0], np.cumsum(gained)])
    # Where it begins at the start of the log, or ends at its end, that end is no choice.
    price = log(n)
    begins = sums[: n + 1] + price * (np.arange(n + 1) > 0)
    lowest = np.minimum.accumulate(begins)
    totals = np.full(n + 1, -inf)
    totals[shortest:] = sums[shortest:] - lowest[: n + 1 - shortest] - price * (np.arange(shortest, n + 1) < n)
    end = int(np.argmax(totals))
    first = int(np.argmin(begins[: end + 1 - shortest]))
    times = steps.middle_s - 0.5 * stride_s(steps)
    course = StrengthCourse(float(times[first]) if first > 0 else 0.0, float(times[end]) if end < n else inf)
    return course, float(totals[end])


def shortest_s(steps: Windows) -> float:
    """Return for how long a disturbance acts at least [s]: as long as what else only passes."""
    return max(INFERENCE.span_s, INFERENCE.passing_windows * stride_s(steps) * STEPS_A_WINDOW)


def likeliest_growth(
    steps: Windows, gaps: Floats, noise: Callable[[StrengthCourse], NoiseModel]
) -> tuple[StrengthCourse, float]:
    """Return the growth that is likeliest, and its log-likelihood; `noise` is that of a course."""

    def level(growth: float) -> float:
        return likelihood(noise(StrengthCourse(growth=growth)), steps, gaps)

    best, growth = max((level(one), one) for one in GROWTHS)
    factor = 1.6
    while factor > FINEST_FACTOR:
        near, other = max((level(one), one) for one in (growth * factor, growth / factor))
        best, growth, factor = (near, other, factor) if near > best else (best, growth, factor**0.5)
    return StrengthCourse(growth=growth), best


def course_estimates(
    course: StrengthCourse,
    steps: Windows,
    gaps: Floats,
    noise: Callable[[StrengthCourse], NoiseModel],
    bare: NoiseModel,
) -> Mapping[str, Estimate]:
    """Return a course's parameters with their 95 % intervals: `onset` and `offset` [s], or `growth`.

    Parameters
    ----------
    course
        The likeliest.
    steps, gaps
        Of the filter, and what a hypothesis leaves.
    noise, bare
        The noise with the disturbance in a course, and without it.
    """
    estimates = {}
    if course.ends:
        # As if it acted all along: what a step before the onset would have gained.
        gained = step_likelihoods(steps, gaps, noise(ALL_ALONG)) - step_likelihoods(steps, gaps, bare)
        sums = np.concatenate([[0.0], np.cumsum(gained)])
        times = steps.middle_s - 0.5 * stride_s(steps)
        times = np.append(times, times[-1] + stride_s(steps))
        for name, here, log_weights in (("onset", course.onset_s, -sums), ("offset", course.offset_s, sums)):
            if 0.0 < here < inf:
                inside = times < course.offset_s if name == "onset" else times > course.onset_s
                estimates[name] = _time(here, times[inside], log_weights[inside])
    if course.growth != 1.0:
        middle = log(course.growth)
        levels = [
            likelihood(noise(StrengthCourse(growth=float(np.exp(middle + d)))), steps, gaps)
            for d in (-GROWTH_DIFFERENCE, 0.0, GROWTH_DIFFERENCE)
        ]
        bend = max((2.0 * levels[1] - levels[0] - levels[2]) / GROWTH_DIFFERENCE**2, 1e-6)
        away = min(1.96 * INFERENCE.posterior_factor / np.sqrt(bend), INFERENCE.widest_log)
        low, high = float(np.exp(middle - away)), float(np.exp(middle + away))
        estimates["growth"] = Estimate(course.growth, low, high, "-")
    return estimates


def _time(here: float, times: Floats, log_weights: Floats) -> Estimate:
    weights = np.exp((log_weights - log_weights.max()) / INFERENCE.posterior_factor**2)
    shares = np.cumsum(weights) / weights.sum()
    low, high = (float(np.interp(share, shares, times)) for share in (0.025, 0.975))
    row_s = float(np.median(np.diff(times)))
    return Estimate(here, min(low, here) - row_s, max(high, here) + row_s, "s")
