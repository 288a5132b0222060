"""Errors of sensors that several logs of a campaign show: properties of the vessel, estimated over all of its logs.

With x_i what log i estimates, s_i its standard error and t the scatter between logs beyond their errors, a common value m has
``x_i ~ N(m, s_i² + t²)``: the random-effects model, with t by moments (DerSimonian and Laird, 1986, Controlled Clinical
Trials 7) and the interval widened where the logs scatter more than that (Knapp and Hartung, 2003, Statistics in Medicine 22).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import exp, log

import numpy as np
from scipy.special import stdtrit

from ferryid.counts import counted, verb
from ferryid.diagnose.checks.check import Check, Lasting, SensorFinding
from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.diagnose.data.estimate import Estimate
from ferryid.effects.force_model import Measurements
from ferryid.types import Floats

ROUNDS = 10
"""Of the search for logs that agree."""


@dataclass(frozen=True)
class Common:
    """The common value of one parameter.

    Attributes
    ----------
    value, error
        With its standard error.
    scatter
        Standard deviation between logs beyond their errors.
    freedom
        Degrees of freedom of the error; infinite where the logs do not scatter.
    """

    value: float
    error: float
    scatter: float
    freedom: float

    @classmethod
    def of(cls, values: Floats, errors: Floats) -> Common:
        """Return it from values and standard errors of logs, shape (k,) each."""
        w, k = errors**-2.0, len(values)
        mean = float(w @ values / w.sum())
        excess = float(w @ (values - mean) ** 2) - (k - 1)
        scatter = max(excess / float(w.sum() - w @ w / w.sum()), 0.0) ** 0.5 if k > 1 else 0.0
        w = 1.0 / (errors**2 + scatter**2)
        mean = float(w @ values / w.sum())
        apart = float(w @ (values - mean) ** 2) / (k - 1) if k > 1 else 1.0
        error = (max(apart, 1.0) / float(w.sum())) ** 0.5
        return cls(mean, error, scatter, k - 1.0 if scatter > 0.0 else np.inf)

    def reach(self, chance: float) -> float:
        """Return how many standard errors a value is off with this probability."""
        # `stdtrit` is not defined at infinity; a million is the normal distribution.
        return float(stdtrit(min(self.freedom, 1e6), 1.0 - 0.5 * chance))

    def differs(self, value: float, error: float) -> float:
        """Return how far another log's value is off, in units of what chance allows."""
        spread = (error**2 + self.scatter**2 + self.error**2) ** 0.5
        return float(abs(value - self.value) / (self.reach(CHECKS.false_alarm) * spread))

    def estimate(self, unit: str) -> Estimate:
        """Return the value with its 95 % interval."""
        half = self.reach(0.05) * self.error
        return Estimate(self.value, self.value - half, self.value + half, unit)


@dataclass(frozen=True)
class Pool:
    """What several logs say of an error together.

    Attributes
    ----------
    parameters
        By name.
    evidence
        Logarithm of the evidence over that of no such error [nat].
    inside, apart
        Places of the logs that have a say, and of those that differ from the others.
    scatter
        Standard deviation between logs beyond their errors, by name.
    """

    parameters: Mapping[str, Estimate]
    evidence: float
    inside: frozenset[int]
    apart: frozenset[int]
    scatter: Mapping[str, float]

    @property
    def values(self) -> dict[str, float]:
        """The parameters without their intervals."""
        return {name: one.value for name, one in self.parameters.items()}


def pool(estimates: Sequence[Mapping[str, Estimate]], lasting: Lasting, least: float) -> Pool | None:
    """Return the common values of what logs estimate; None where they have none, or it is not certainly an error.

    Parameters
    ----------
    estimates
        Of each log by parameter; empty of one that shows none.
    lasting
        What is known of the error.
    least
        How far a parameter has to be off to be worth a name.
    """
    known = {i: one for i, one in enumerate(estimates) if one and all(each.error > 0.0 for each in one.values())}
    names = next((tuple(one) for one in known.values()), ())

    inside = _agreeing(known, names)
    # Logs of which most have nothing in common have nothing in common.
    if len(inside) < CHECKS.pooled_logs or 2 * len(inside) <= len(known):
        return None
    shared = {name: _common(known, name, inside) for name in names}
    off = [
        abs(one.value - lasting.neutral) - max(least, one.reach(0.05) * one.error, one.scatter / CHECKS.pooled_scatter)
        for one in shared.values()
    ]
    if max(off) <= 0.0:
        return None
    return Pool(
        {name: one.estimate(known[inside[0]][name].unit) for name, one in shared.items()},
        sum(_evidence(one, [known[i][name] for i in inside], lasting) for name, one in shared.items()),
        frozenset(inside),
        frozenset(known) - frozenset(inside),
        {name: one.scatter for name, one in shared.items()},
    )


def _common(known: Mapping[int, Mapping[str, Estimate]], name: str, logs: Sequence[int]) -> Common:
    every = [known[i][name] for i in logs]
    return Common.of(np.array([one.value for one in every]), np.array([one.error for one in every]))


def _agreeing(known: Mapping[int, Mapping[str, Estimate]], names: Sequence[str]) -> list[int]:
    """Return the logs that agree with each other, as far as their scatter goes; logs that differ do not hide each other.

    It begins with the log that most others agree with, for what errors explain.
    """

    def near(logs: Sequence[int]) -> list[int]:
        common = {name: _common(known, name, logs) for name in names}
        return [
            i
            for i, one in known.items()
            if all(common[name].differs(one[name].value, one[name].error) <= 1.0 for name in names)
        ]

    inside = max((near([i]) for i in known), key=len, default=[])
    for _ in range(ROUNDS):
        again = near(inside)
        if again == inside:
            break
        inside = again
    return inside


def _evidence(common: Common, every: Sequence[Estimate], lasting: Lasting) -> float:
    """Return the evidence of all logs for a parameter that is not neutral, under a normal prior [nat]."""
    spreads = [one.error**2 + common.scatter**2 for one in every]
    likelihood = sum(
        0.5 * ((one.value - lasting.neutral) ** 2 - (one.value - common.value) ** 2) / spread
        for one, spread in zip(every, spreads, strict=True)
    )
    return likelihood - 0.5 * log(1.0 + (lasting.size / common.error) ** 2)


@dataclass
class Examined:
    """A log whose sensors are examined beside those of other logs.

    Attributes
    ----------
    alone
        What its own checks find in what is left of it, by effect.
    measurements
        As they were measured, and without what was found so far.
    findings, notes
        So far.
    otherwise
        True once it was corrected otherwise than by itself.
    copy
        True for a log that holds the motion of another: it has no say of its own.
    """

    alone: Mapping[str, SensorFinding]
    measurements: Measurements
    findings: list[SensorFinding] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    otherwise: bool = False
    copy: bool = False

    def correct(self, finding: SensorFinding) -> None:
        """Take an error out."""
        self.findings.append(finding)
        self.measurements = finding.correct(self.measurements)


def find_in_turn(checks: Sequence[Check], measurements: Measurements) -> tuple[list[SensorFinding], Measurements]:
    """Return what checks find, each in what those before it corrected, and what is left."""
    findings = []
    for check in checks:
        finding = check.find(measurements)
        if finding is not None:
            findings.append(finding)
            measurements = finding.correct(measurements)
    return findings, measurements


def pool_check(check: Check, later: Sequence[Check], logs: Sequence[Examined]) -> None:
    """Let one check act on the logs of a campaign: in all of them by what they show together, where several show it.

    `later` are the checks that act after it.
    """
    found = [one.alone.get(check.id) for one in logs]
    pooled = _pooled(check, logs, found)
    if pooled is None:
        found = _doubted(check, logs, found)
    for i, (one, own) in enumerate(zip(logs, found, strict=True)):
        if pooled is not None and i not in pooled[1].apart:
            one.correct(pooled[0])
            one.otherwise = True
            one.alone = {each.effect: each for each in find_in_turn(later, one.measurements)[0]}
            continue
        if pooled is not None:
            one.notes.append(_differs(check, pooled[1], own))
        if own is not None:
            one.correct(own)


def _doubted(
    check: Check, logs: Sequence[Examined], found: Sequence[SensorFinding | None]
) -> list[SensorFinding | None]:
    """Return what logs show of an error that has no common value: of an instrument it would, so that each is doubtful."""
    showing = _showing(logs, found)
    if check.lasting is None or not check.lasting.of_instrument or len(showing) < CHECKS.pooled_logs:
        return list(found)
    doubt = f"{counted(len(showing), 'log')} show such an error, and its size differs between the logs as no instrument's does"
    return [None if one is None else replace(one, doubt=doubt) for one in found]


def _showing(logs: Sequence[Examined], found: Sequence[SensorFinding | None]) -> list[int]:
    """Return the places of logs that show an error by themselves."""
    return [i for i, (log, own) in enumerate(zip(logs, found, strict=True)) if own is not None and not log.copy]


def _pooled(
    check: Check, logs: Sequence[Examined], found: Sequence[SensorFinding | None]
) -> tuple[SensorFinding, Pool] | None:
    lasting, estimate = check.lasting, check.estimate
    showing = _showing(logs, found)
    if lasting is None or estimate is None or len(showing) < CHECKS.pooled_logs:
        return None
    estimates: list[Mapping[str, Estimate]] = [
        {} if log.copy else own.parameters if own is not None else estimate(log.measurements)
        for log, own in zip(logs, found, strict=True)
    ]
    pooled = pool(estimates, lasting, lasting.least(logs[showing[0]].measurements))
    if pooled is None or pooled.evidence < CHECKS.pooled_evidence:
        return None
    # What a log shows that differs is another error.
    showing = [i for i in showing if i in pooled.inside]
    if len(showing) < CHECKS.pooled_logs:
        return None
    values, corrected = pooled.values, lasting.corrected
    away = min(pooled.evidence - CHECKS.pooled_evidence, 700.0)
    finding = SensorFinding(
        check.id,
        pooled.parameters,
        _says(lasting, pooled, len(showing), logs),
        lambda measured: corrected(measured, values),
        probability=1.0 / (1.0 + exp(-away)),
        vessel=True,
    )
    return finding, pooled


def _says(lasting: Lasting, pooled: Pool, showing: int, logs: Sequence[Examined]) -> str:
    count = sum(not one.copy for one in logs)
    blind = count - len(pooled.inside) - len(pooled.apart)
    parts = [f"{showing} of {counted(count, 'log')} {verb(showing, 'shows')} it alone as well"]
    if pooled.apart:
        parts.append(f"{counted(len(pooled.apart), 'log')} {verb(len(pooled.apart), 'differs')} from it")
    if blind:
        parts.append(f"{counted(blind, 'log')} {verb(blind, 'is')} too short for an estimate")
    scatter = max(pooled.scatter, key=lambda name: pooled.scatter[name])
    if pooled.scatter[scatter] > 0.0:
        unit = pooled.parameters[scatter].unit.replace("-", "")
        parts.append(f"between logs it scatters by {pooled.scatter[scatter]:.2g} {unit}".rstrip())
    return f"{lasting.says(pooled.values)} That is estimated from all logs of the vessel together: {', '.join(parts)}."


def _differs(check: Check, pooled: Pool, own: SensorFinding | None) -> str:
    """Return that a log differs from the others, as a sentence."""
    assert check.lasting is not None
    what = f"{check.title}: this log differs from the others, of which holds: {check.lasting.says(pooled.values)}"
    return f"{what} It keeps its own." if own is not None else f"{what} Nothing is corrected in it."
