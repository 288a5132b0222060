"""What a diagnosis says: findings with their evidence, and the verdict."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from ferryid.diagnose.locate import Location, plain_location
from ferryid.vessel.profile import Floats

if TYPE_CHECKING:
    from ferryid.diagnose.learnt import Learnt

SCHEMA = "ferryid.diagnosis/1"
AXES = ("surge", "sway", "yaw")
HINT = 0.5
"""Probability up to which a finding is a hint and names nothing: not more likely than not."""
NEAR = 3.0
"""Rivals whose evidence is less than this behind are not told apart."""
VERDICTS = ("matched", "explained", "partly_explained", "unexplained", "not_testable")


@dataclass(frozen=True)
class Estimate:
    """A parameter with its 95 % interval."""

    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class LawTerm:
    """One term of an empirical law: what it acts on, what it is in proportion to, its coefficient, and the same in words."""

    on: str
    quantity: str
    coefficient: Estimate
    says: str


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
    onset_s, offset_s
        When it began and when it ended, None where it acted from the start, and to the end.
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
        Columns for the figure that shows it, one row a window, shape (m,) each, on the one axis that shows it best:

        - ``t``: middle of the window [s], ascending;
        - ``before``, ``after``: what is left over without and with the finding, in one unit;
        - ``explained``: what the finding adds, in the same unit; where it holds, `before` follows it and `after` does not;
        - ``regressor``, optional: the quantity that gives it away (heading for a wind, squared speed for fouling);
          `explained` takes its place where there is none.

        Of what comes and goes by chance, one row a frequency: ``frequency`` [Hz], ascending; ``before``, the power spectrum of
        what is left over on the axis on which it acts most; ``explained``, the one that it has by its parameters.
    band_hz
        Frequencies that hold most of it [Hz], where that is told.
    law
        Terms of an empirical law, of an effect without a name.
    labels
        Names of the columns of `evidence` for people, with unit: ``residual`` (of `before`, `after` and `explained`) and
        ``regressor``. Such as ``{"residual": "sway force left over [N]", "regressor": "heading [deg]"}``.
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
    labels: Mapping[str, str] = field(default_factory=dict)
    band_hz: tuple[float, float] | None = None
    law: tuple[LawTerm, ...] = ()
    offset_s: float | None = None

    @property
    def ends(self) -> tuple[tuple[str, float], ...]:
        """Onset and offset by name [s], those within the log."""
        return tuple(
            (name, time) for name, time in (("onset", self.onset_s), ("offset", self.offset_s)) if time is not None
        )

    @property
    def key(self) -> tuple[str, str | None]:
        """Effect and instance."""
        return self.effect, self.instance

    @property
    def sure(self) -> bool:
        """True where it is more than a hint."""
        return self.probability > HINT


@dataclass(frozen=True)
class Moved:
    """The coefficient of the hull that a refit moved farthest.

    Attributes
    ----------
    coefficient, unit
        Of `ferryid.effects.picture.COEFFICIENTS`.
    before, value
        What was believed of it, and what came out.
    deviations
        The move in standard deviations of what was believed.
    """

    coefficient: str
    unit: str
    before: float
    value: float
    deviations: float


@dataclass(frozen=True)
class Withheld:
    """What the diagnosis found of a signal that it was not shown, beside what the sensor had measured.

    `found` and `measured` are by the names of the effect's parameters; `measured` is the mean over the log, of a payload
    over the time that it was aboard, in the unit of `found`.
    """

    signal: str
    found: Mapping[str, Estimate]
    measured: Mapping[str, float]
    says: str


@dataclass(frozen=True)
class Diagnosis:
    """A verdict on one log.

    Attributes
    ----------
    log, vessel
        Names.
    verdict
        One of `VERDICTS`.
    findings
        In the order in which they matter.
    before, after
        On held-out rows, without and with the findings:

        - ``mse``: force error by axis [N² or N²m²];
        - ``free_run``: as `ferryid.models.scores.free_run_plain` gives it, or empty;
        - ``rows`` (in `before`, optional): how many rows these are, so that several logs can be pooled;
        - ``window_s`` (in `before`, optional): length of the windows that force is averaged over [s];
        - ``ratio`` (in `after`, optional): `after` over `before` of the force error by axis, each
          ``{"value", "low", "high"}`` with a 95 % interval from a block bootstrap;
        - ``free_run_ratio`` (in `after`, optional): the same for the root-mean-square errors of the free run, by
          ``position_m``, ``heading_rad``, ``speed_mps`` and ``yaw_rate_radps``, at the horizon ``horizon_s`` [s];
        - ``placebos`` (in `after`, optional): force error by axis with findings that cannot be true in the place of
          these, by name ("time shifted", "heading reversed").
    notes
        Sentences for the reader: what was not tested and why, what is left in the residual.
    model
        Path of the model with the findings in it.
    evidence
        What was left over in the whole log, one row a window: ``t`` [s], shape (m,); ``before``, ``after`` [N, N, N·m],
        shape (m, 3); optionally ``heading`` [deg] and ``speed`` [m/s], shape (m,).
    withheld
        Signals that were hidden from the diagnosis.
    against
        The simulation that a recording was held against, as `ferryid.diagnose.against.plain_against` gives it, or empty.
    learnt
        What a model can learn from it; None where it found no force left out, was held against a simulation, or shares
        the hull of other logs.
    located
        Where and when the recording and the model differ.
    moved
        How far the hull went that was fitted together with the findings; None where there are none of forces.
    duration_s
        From the first to the last row of the log [s].
    """

    log: str
    vessel: str
    verdict: str
    findings: tuple[Finding, ...]
    before: Mapping[str, Any]
    after: Mapping[str, Any]
    notes: tuple[str, ...] = ()
    model: str | None = None
    evidence: Mapping[str, Floats] = field(default_factory=dict)
    withheld: tuple[Withheld, ...] = ()
    against: Mapping[str, Any] = field(default_factory=dict)
    learnt: Learnt | None = None
    located: Location | None = None
    moved: Moved | None = None
    duration_s: float | None = None


def to_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return the diagnosis as ``ferryid.diagnosis/1``."""
    return {
        "schema": SCHEMA,
        "log": diagnosis.log,
        "vessel": diagnosis.vessel,
        "verdict": diagnosis.verdict,
        "findings": [_finding(one) for one in diagnosis.findings],
        "before": {"mse": {}, "free_run": {}, **diagnosis.before},
        "after": {"mse": {}, "free_run": {}, **diagnosis.after},
        "notes": list(diagnosis.notes),
        "withheld": [
            {
                "signal": one.signal,
                "found": {name: vars(estimate) for name, estimate in one.found.items()},
                "measured": dict(one.measured),
                "says": one.says,
            }
            for one in diagnosis.withheld
        ],
        "model": diagnosis.model,
        **({"against": dict(diagnosis.against)} if diagnosis.against else {}),
        **({} if diagnosis.located is None else {"located": plain_location(diagnosis.located)}),
        **({} if diagnosis.moved is None else {"hull_moved": vars(diagnosis.moved)}),
        **({} if diagnosis.duration_s is None else {"duration_s": diagnosis.duration_s}),
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
            "offset": one.offset_s,
            "regime": one.regime,
            **({} if one.band_hz is None else {"band_hz": list(one.band_hz)}),
            **({"law": [{**vars(term), "coefficient": vars(term.coefficient)} for term in one.law]} if one.law else {}),
        },
        "improvement": dict(one.improvement),
        "held_out": one.held_out,
        "rivals": [vars(rival) for rival in one.rivals],
        "unresolved_with": list(one.unresolved_with),
        "separating_manoeuvre": one.separating_manoeuvre,
        "says": one.says,
    }
