"""What a diagnosis says: findings with their evidence, and the verdict."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ferryid.vessel.profile import Floats

SCHEMA = "ferryid.diagnosis/1"
AXES = ("surge", "sway", "yaw")
VERDICTS = ("matched", "explained", "partly_explained", "unexplained", "not_testable")


@dataclass(frozen=True)
class Estimate:
    """A parameter with its 95 % interval."""

    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class Rival:
    """Another effect that explains the same, and how much worse: difference of the logarithms of evidence, negative."""

    effect: str
    instance: str | None
    delta_score: float


@dataclass(frozen=True)
class Finding:
    """One piece of physics, or one sensor's error, that was left out.

    Attributes
    ----------
    effect, instance
        Effect id, and the thruster it is one of.
    probability
        Posterior probability against its rivals and against no effect at all.
    parameters
        By name.
    axes
        Share of the improvement on each axis; they add up to 1.
    intervals
        When it acts [s], pairs of first and last.
    onset_s
        When it began, None where it acted all along.
    regime
        Where it shows most, in words.
    improvement
        Fraction of the held-out force MSE removed, by axis.
    held_out
        True where that was measured on rows that the finding was not fitted to.
    rivals, unresolved_with
        What else was considered, and what this log cannot tell it from.
    separating_manoeuvre
        What to record to tell them apart.
    says
        One sentence in plain words.
    evidence
        Columns for the figure that shows it: name to values.
    """

    effect: str
    instance: str | None
    probability: float
    parameters: Mapping[str, Estimate]
    axes: Mapping[str, float]
    intervals: tuple[tuple[float, float], ...]
    onset_s: float | None
    regime: str
    improvement: Mapping[str, float]
    held_out: bool
    rivals: tuple[Rival, ...]
    unresolved_with: tuple[str, ...]
    separating_manoeuvre: str | None
    says: str
    evidence: Mapping[str, Floats] = field(default_factory=dict)


@dataclass(frozen=True)
class Diagnosis:
    """A verdict on one log.

    `before` and `after` hold ``{"mse": {axis: N² or N²m²}, "free_run": {...}}`` on held-out rows; `notes` are sentences for the
    reader: what was not tested and why, what is left in the residual.
    """

    log: str
    vessel: str
    verdict: str
    findings: tuple[Finding, ...]
    before: Mapping[str, Any]
    after: Mapping[str, Any]
    notes: tuple[str, ...] = ()
    model: str | None = None


def to_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return the diagnosis as ``ferryid.diagnosis/1``."""
    return {
        "schema": SCHEMA,
        "log": diagnosis.log,
        "vessel": diagnosis.vessel,
        "verdict": diagnosis.verdict,
        "findings": [_finding(one) for one in diagnosis.findings],
        "before": dict(diagnosis.before),
        "after": dict(diagnosis.after),
        "notes": list(diagnosis.notes),
        "model": diagnosis.model,
    }


def _finding(one: Finding) -> dict[str, Any]:
    return {
        "effect": one.effect,
        "instance": one.instance,
        "probability": one.probability,
        "parameters": {name: vars(estimate) for name, estimate in one.parameters.items()},
        "where": {
            "axes": dict(one.axes),
            "intervals": [list(pair) for pair in one.intervals],
            "onset": one.onset_s,
            "regime": one.regime,
        },
        "improvement": dict(one.improvement),
        "held_out": one.held_out,
        "rivals": [vars(rival) for rival in one.rivals],
        "unresolved_with": list(one.unresolved_with),
        "separating_manoeuvre": one.separating_manoeuvre,
        "says": one.says,
    }
