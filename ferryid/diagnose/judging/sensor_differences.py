"""Errors of sensors in which two groups of logs differ: what each log shows by itself, group against group.

With x_i what log i estimates, s_i its standard error, t the scatter between logs of one group beyond their errors, and m_A and
m_B the values of the groups, ``x_i ~ N(m_g, s_i² + t²)``: a mixed-effects regression on the group, with t by moments
(DerSimonian and Laird, 1986, Controlled Clinical Trials 7) and the interval widened where the logs scatter more than that
(Knapp and Hartung, 2003, Statistics in Medicine 22). No force is read.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import expm1, inf, log, log1p, pi, sqrt

import numpy as np
from scipy.special import gammaln, stdtrit

from ferryid.diagnose.checks import Check, checks, sensor_errors
from ferryid.diagnose.checks.check import Lasting
from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.group_differences import GROUPS
from ferryid.diagnose.inference.stages import AveragedLog
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.difference import SENSORS, Difference
from ferryid.effects import effects
from ferryid.effects.effect import Parameter
from ferryid.side_by_side import over
from ferryid.types import Flags, Floats

NORMAL = 1e6
"""Degrees of freedom of Student's distribution from which on it is the normal one."""


@dataclass(frozen=True)
class Apart:
    """The difference of one parameter between two groups.

    Attributes
    ----------
    value, error
        Second less first, with its standard error.
    scatter
        Standard deviation between logs of one group beyond their errors.
    freedom
        Degrees of freedom of the error; `NORMAL` where the logs do not scatter.
    """

    value: float
    error: float
    scatter: float
    freedom: float

    @classmethod
    def of(cls, values: Floats, errors: Floats, second: Flags) -> Apart:
        """Return it from values and standard errors of logs, shape (k,) each, and which of them are of the second group."""
        sides, left = (~second, second), len(values) - 2

        def weighed(w: Floats) -> tuple[list[float], float]:
            means = [float(w[side] @ values[side] / w[side].sum()) for side in sides]
            squares = sum(float(w[s] @ (values[s] - m) ** 2) for s, m in zip(sides, means, strict=True))
            return means, squares

        w = errors**-2.0
        excess = weighed(w)[1] - left
        spare = sum(float(w[side].sum() - w[side] @ w[side] / w[side].sum()) for side in sides)
        scatter = sqrt(max(excess / spare, 0.0)) if left > 0 and spare > 0.0 else 0.0
        w = 1.0 / (errors**2 + scatter**2)
        (first, last), squares = weighed(w)
        wider = max(squares / left, 1.0) if left > 0 else 1.0
        error = sqrt(wider * sum(1.0 / float(w[side].sum()) for side in sides))
        return cls(last - first, error, scatter, float(left) if scatter > 0.0 else NORMAL)

    def reach(self, chance: float) -> float:
        """Return how many standard errors a value is off with this probability."""
        return float(stdtrit(self.freedom, 1.0 - 0.5 * chance))

    def evidence(self, size: float) -> float:
        """Return the evidence over none, where a difference is believed to be of some size [nat]."""
        variance = size**2 + self.error**2
        there = -0.5 * (self.value**2 / variance + log(2.0 * pi * variance))
        none = _log_density(self.freedom) - 0.5 * (self.freedom + 1.0) * log1p(
            (self.value / self.error) ** 2 / self.freedom
        )
        return there - none + log(self.error)

    def smallest(self, size: float, least: float) -> float:
        """Return the difference that would have been seen with an even chance, where less than `least` has no name."""
        # What is small against its usual size.
        there = -0.5 * log(2.0 * pi * (size**2 + self.error**2)) + log(self.error)
        above = 2.0 * (INFERENCE.prior_odds + _log_density(self.freedom) - there) / (self.freedom + 1.0)
        seen = sqrt(self.freedom * expm1(max(above, 0.0)))
        return max(least, self.error * max(seen, self.reach(CHECKS.false_alarm)))


def _log_density(freedom: float) -> float:
    """Return the logarithm of the density of Student's distribution at zero."""
    return float(gammaln(0.5 * (freedom + 1.0)) - gammaln(0.5 * freedom)) - 0.5 * log(pi * freedom)


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
    parameters, found = list[Parameter](), dict[str, Apart]()
    for name, shape in estimates[known[0]].items():
        values = np.array([estimates[i][name].value for i in known])
        errors = np.array([estimates[i][name].error for i in known])
        if lasting.neutral != 0.0:
            # A factor of one group over that of the other.
            middle = float(np.median(values[~second]))
            values, errors = values / middle, errors / abs(middle)
        parameters.append(Parameter(name, shape.unit, lasting.size, -inf, inf, lasting.neutral))
        found[name] = Apart.of(values, errors, second)
    certain = any(abs(one.value) > max(least, one.reach(CHECKS.false_alarm) * one.error) for one in found.values())
    evidence = sum(one.evidence(lasting.size) for one in found.values())
    return Difference(
        effect=check.id,
        instance=None,
        group=GROUPS[1],
        title=f"{effects()[check.id].title} (sensors compared)" if check.id in effects() else check.title,
        parameters=tuple(parameters),
        estimates={one.name: _estimate(found[one.name], one.neutral, one.unit) for one in parameters},
        evidence=evidence,
        scatter=next(iter(found.values())).scatter,
        smallest={name: one.smallest(lasting.size, least) for name, one in found.items()},
        selected=certain and evidence >= INFERENCE.prior_odds,
        shown_by=SENSORS,
    )


def _estimate(one: Apart, neutral: float, unit: str) -> Estimate:
    half = one.reach(0.05) * one.error
    value = neutral + one.value
    return Estimate(value, value - half, value + half, unit)
