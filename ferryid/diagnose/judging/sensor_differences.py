"""Errors of sensors in which two groups of logs differ: what each log shows by itself, group against group.

With x_i what log i estimates, s_i its standard error, t the scatter between logs of one group beyond their errors, and m_A and
m_B the values of the groups, ``x_i ~ N(m_g, s_i² + t²)``: a mixed-effects model (Laird and Ware 1982). Estimate and evidence of
m_B - m_A are averaged over t, as those of forces are: see `ferryid.diagnose.inference.group_differences`. No force is read.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import exp, inf, log, sqrt

import numpy as np
from scipy.special import logsumexp

from ferryid.diagnose.checks import Check, checks, sensor_errors
from ferryid.diagnose.checks.check import Lasting
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.group_differences import GROUPS, gross
from ferryid.diagnose.inference.stages import AveragedLog
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.difference import SENSORS, Difference
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects import effects
from ferryid.effects.effect import Parameter
from ferryid.side_by_side import over
from ferryid.types import Flags, Floats

SCATTERS = 8
"""How many standard deviations between logs are averaged over beside none."""
WIDEST_OF_ERRORS, WIDEST_SEEN = 16.0, 2.0
"""The largest of them, in standard errors of the logs, or in what logs of one group scatter by, whichever is more."""
SIZES = np.geomspace(1e-4, 10.0, 101)
"""Differences among which the smallest that would have been seen is looked for, in usual sizes."""


@dataclass(frozen=True)
class Apart:
    """One parameter of the logs of two groups.

    Attributes
    ----------
    values, errors
        What the logs estimate, with standard errors, shape (k,).
    second
        Which of them are of the second group, shape (k,).
    size
        What a difference of moderate size is.
    """

    values: Floats
    errors: Floats
    second: Flags
    size: float

    @property
    def weighed(self) -> tuple[float, float, float, float]:
        """Second less first with its standard deviation, the scatter between logs, and the evidence over none [nat]."""
        priors = {0.0: 1.0}
        if len(self.values) > len(GROUPS):
            # A scatter is as rare as any other effect; of one log in each group it cannot be seen.
            rare = exp(-INFERENCE.prior_odds)
            priors = {0.0: 1.0 - rare, **dict.fromkeys(self._scatters(), rare / SCATTERS)}
        found = np.array([self._with(scatter) for scatter in priors])
        apart, variance, within = found.T
        prior = np.log(list(priors.values()))
        spread = variance + self.size**2
        tail = np.array([gross(np.array([max(abs(one) / self.size, 1.0)])) for one in apart])
        there = prior + within + 0.5 * np.log(variance / spread) - 0.5 * apart**2 / spread + tail
        none = prior + within - 0.5 * apart**2 / variance
        share = np.exp(there - logsumexp(there))
        value = float(share @ apart)
        error = float(np.sqrt(share @ (variance + (apart - value) ** 2)))
        scatter = float(share @ np.array(list(priors)))
        return value, error, scatter, float(logsumexp(there) - logsumexp(none))

    def _scatters(self) -> list[float]:
        """Return the standard deviations between logs that are averaged over beside none.

        An instrument errs alike in all logs, as far as these are known; what scatters more does so within a group.
        """
        w, squares, spare = self.errors**-2.0, 0.0, 0.0
        for side in (~self.second, self.second):
            mean = w[side] @ self.values[side] / w[side].sum()
            squares += float(w[side] @ (self.values[side] - mean) ** 2)
            spare += float(w[side].sum() - w[side] @ w[side] / w[side].sum())
        # By moments: DerSimonian and Laird (1986), Controlled Clinical Trials 7.
        seen = sqrt(max(squares - len(w) + len(GROUPS), 0.0) / spare) if spare > 0.0 else 0.0
        typical = float(np.median(self.errors))
        widest = max(WIDEST_OF_ERRORS * typical, WIDEST_SEEN * seen)
        return [float(one) for one in np.geomspace(typical, widest, SCATTERS)]

    def _with(self, scatter: float) -> tuple[float, float, float]:
        """Return the difference, its variance, and the log density of all else, with a standard deviation between logs."""
        w = 1.0 / (self.errors**2 + scatter**2)
        means, weights, squares = list[float](), list[float](), 0.0
        for side in (~self.second, self.second):
            weights.append(float(w[side].sum()))
            means.append(float(w[side] @ self.values[side]) / weights[-1])
            squares += float(w[side] @ (self.values[side] - means[-1]) ** 2)
        within = 0.5 * float(np.log(w).sum()) - 0.5 * log(sum(weights)) - 0.5 * squares
        return means[1] - means[0], sum(1.0 / one for one in weights), within

    def smallest(self, least: float) -> float | None:
        """Return the difference that would have been seen with an even chance, of at least `least`; None for none."""
        now = self.weighed[0]
        for size in self.size * SIZES:
            moved = replace(self, values=self.values + (size - now) * self.second)
            value, error, _, evidence = moved.weighed
            if size >= least and evidence >= INFERENCE.prior_odds and value > 1.96 * error:
                return float(size)
        return None


def sensor_differences(logs: Sequence[AveragedLog], groups: Sequence[str]) -> tuple[Difference, ...]:
    """Return each lasting error of the sensors of group B relative to group A, where each has a log that shows its size.

    Parameters
    ----------
    logs
        Of both groups.
    groups
        The group of each.
    """
    every = over(lambda one: sensor_errors(one.screened.measured.measurements), logs)
    profile = logs[0].screened.measured.measurements.profile
    found = []
    for check in checks():
        if check.lasting is None or check.estimate is None or check.hidden(profile):
            continue
        estimates = [one.get(check.id, {}) for one in every]
        least = max(check.lasting.least(one.screened.measured.measurements) for one in logs)
        one = _difference(check, check.lasting, estimates, groups, least)
        if one is not None:
            found.append(one)
    return tuple(found)


def _difference(
    check: Check, lasting: Lasting, estimates: Sequence[Mapping[str, Estimate]], groups: Sequence[str], least: float
) -> Difference | None:
    known = [i for i, one in enumerate(estimates) if one and all(each.error > 0.0 for each in one.values())]
    second = np.array([groups[i] == GROUPS[1] for i in known], dtype=np.bool_)
    if not known or second.all() or not second.any():
        return None
    parameters, every = list[Parameter](), list[Apart]()
    for name, shape in estimates[known[0]].items():
        values = np.array([estimates[i][name].value for i in known])
        errors = np.array([estimates[i][name].error for i in known])
        if lasting.neutral != 0.0:
            # A factor of one group over that of the other, which must be known to be any.
            w = errors[~second] ** -2.0
            first = float(w @ values[~second] / w.sum())
            if abs(first) < JUDGING.known_factor * float(w.sum()) ** -0.5:
                return None
            values, errors = values / first, errors / abs(first)
        parameters.append(Parameter(name, shape.unit, lasting.size, -inf, inf, lasting.neutral))
        every.append(Apart(values, errors, second, lasting.size))
    found = [one.weighed for one in every]
    off = [abs(value) > max(least, 1.96 * error) for value, error, _, _ in found]
    # That one of several is off, whichever it is.
    evidence = max(each for _, _, _, each in found) - log(len(found))
    return Difference(
        effect=check.id,
        instance=None,
        group=GROUPS[1],
        title=f"{effects()[check.id].title} (sensors compared)" if check.id in effects() else check.title,
        parameters=tuple(parameters),
        estimates={
            one.name: Estimate.normal(one.neutral + value, error, one.unit)
            for one, (value, error, _, _) in zip(parameters, found, strict=True)
        },
        evidence=evidence,
        scatter=found[0][2],
        smallest={one.name: each.smallest(least) for one, each in zip(parameters, every, strict=True)},
        selected=any(off) and evidence >= INFERENCE.prior_odds,
        shown_by=SENSORS,
    )
