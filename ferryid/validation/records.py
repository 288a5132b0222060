"""What is known of a case once it is done: diagnosis, oracle, transfer test. All of it is kept as JSON lines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ferryid.diagnose import JUDGING, Estimate
from ferryid.json_record import Record
from ferryid.validation.case import Case, Truth

UNKNOWN = "unknown"
"""Effect id of a finding that has no name."""
RIVALS = "rivals"
"""Name of the evaluation in which rivals diagnose the same logs."""
DIAGNOSED = "diagnosed"
"""Name of the diagnosed model among the methods of a transfer test."""
Key = tuple[str, str | None]
"""Effect and instance."""


@dataclass(frozen=True)
class RivalEffect(Record):
    """Another effect that explains the same, and how much worse."""

    effect: str
    instance: str | None
    delta_score: float


@dataclass(frozen=True)
class Finding(Record):
    """A finding, as the JSON of a diagnosis has it, without the data of its figures.

    Attributes
    ----------
    effect, instance, probability, parameters, improvement, unresolved_with, rivals
        As in ``ferryid.diagnosis/1``.
    onset, offset
        When it began and ended [s], None where it acted from the start, or to the end.
    log
        Number of the log of a campaign that it is of.
    says
        As in ``ferryid.diagnosis/1``.
    """

    effect: str
    instance: str | None
    probability: float
    parameters: Mapping[str, Estimate]
    improvement: Mapping[str, float] = field(default_factory=dict)
    unresolved_with: tuple[str, ...] = ()
    rivals: tuple[RivalEffect, ...] = ()
    onset: float | None = None
    offset: float | None = None
    log: int = 0
    says: str = ""

    @property
    def key(self) -> Key:
        """Effect and instance."""
        return self.effect, self.instance

    @property
    def hint(self) -> bool:
        """Whether it is no more likely than not."""
        return self.probability <= JUDGING.hint_probability


@dataclass(frozen=True)
class Diagnosis(Record):
    """The diagnosis of one log, or why there is none.

    Attributes
    ----------
    verdict
        As in ``ferryid.diagnosis/1``; ``refused`` for a log that cannot be used, ``crashed`` after a bug or a lost process.
    seconds
        Its time.
    findings
        The likeliest first.
    notes, before, after
        As in ``ferryid.diagnosis/1``.
    model
        Path of the model that it wrote, relative to its folder; None where it wrote none.
    error
        Why there is no diagnosis.
    """

    verdict: str
    seconds: float
    findings: tuple[Finding, ...] = ()
    notes: tuple[str, ...] = ()
    before: Mapping[str, Any] = field(default_factory=dict)
    after: Mapping[str, Any] = field(default_factory=dict)
    model: str | None = None
    error: str = ""


@dataclass(frozen=True)
class OracleEstimate(Record):
    """What the oracle makes of one effect.

    Attributes
    ----------
    effect, instance
        As given.
    gain
        Logarithm of the likelihood ratio of the log with it over without it, all other given effects in both [nats].
    free
        Parameters that were fitted for it.
    floor
        Gain that chance exceeds in one of a hundred logs if it has a chi-squared distribution; see
        `ferryid.validation.oracle_calibration` for thresholds from clean logs.
    parameters
        By name, with 95 % intervals.
    cannot
        Why the log cannot show it; empty where it can.
    idle
        True where it is below the size that a diagnosis names.
    """

    effect: str
    instance: str | None
    gain: float
    free: int
    floor: float
    parameters: Mapping[str, Estimate] = field(default_factory=dict)
    cannot: str = ""
    idle: bool = False

    @property
    def key(self) -> Key:
        """Effect and instance."""
        return self.effect, self.instance

    @property
    def named(self) -> bool:
        """Whether the gain is more than the floor."""
        return self.gain > self.floor


@dataclass(frozen=True)
class OracleResult(Record):
    """What the oracle makes of a log: gain of all effects together [nats], each effect in the order given, and its time."""

    gain: float
    recovered: tuple[OracleEstimate, ...]
    seconds: float

    @property
    def named(self) -> bool:
        """Whether every effect is named."""
        return all(one.named for one in self.recovered)


@dataclass(frozen=True)
class RivalName(Record):
    """Physics that a rival method names.

    Attributes
    ----------
    effect, instance
        Effect id and thruster; the label of the term where it has no such meaning.
    removed
        Share of the base model's squared residual that would come back without its terms, the others fitted again.
    terms
        Labels of its terms.
    """

    effect: str
    instance: str | None
    removed: float
    terms: tuple[str, ...]


@dataclass(frozen=True)
class RivalDiagnoses(Record):
    """What every rival names in a log, by its name."""

    methods: Mapping[str, Diagnosis]


@dataclass(frozen=True)
class StoredEffectNote(Record):
    """An effect of a diagnosed model that acts in the transfer log, with a sentence on it."""

    effect: str
    instance: str | None
    sentence: str


@dataclass(frozen=True)
class TransferScore(Record):
    """What a model is worth on the transfer log; None takes the place of numbers that could not be had.

    Attributes
    ----------
    mse
        Mean square force error over the base model's by axis; of the base model itself, in N² and N²m².
    position_m, heading_rad
        Root-mean-square error of the free runs at 60 s, those that diverged left out.
    starts, diverged
        How many free runs there were, and how many of them diverged.
    base_position_m, base_heading_rad
        The same errors of the base model.
    why
        What could not be had, and why.
    names
        Of a rival: the physics that it names.
    effects
        Of the diagnosed model: the effects that act.
    windows
        As `mse`, of force errors averaged over windows, in which noise does not drown them; empty in lines of before.
    """

    mse: Mapping[str, float | None]
    position_m: float | None = None
    heading_rad: float | None = None
    starts: int = 0
    diverged: int = 0
    base_position_m: float | None = None
    base_heading_rad: float | None = None
    why: str = ""
    names: tuple[RivalName, ...] | None = None
    effects: tuple[StoredEffectNote, ...] | None = None
    windows: Mapping[str, float | None] = field(default_factory=dict)

    @property
    def complete(self) -> bool:
        """Whether it has force errors: a method that is not installed, or that could not learn, has none."""
        return bool(self.mse) and all(value is not None for value in self.mse.values())


@dataclass(frozen=True)
class TransferResult(Record):
    """Scores on the transfer log: of the base model, and of ``diagnosed`` and every rival by name."""

    base: TransferScore
    methods: Mapping[str, TransferScore]


@dataclass(frozen=True)
class Failure(Record):
    """Why an evaluation of a trial has no result."""

    error: str


@dataclass(frozen=True)
class CaseResult:
    """A case with everything that became of it.

    Attributes
    ----------
    case, realised
        The answer: what was drawn, and parameters that were measured in the simulated trial, by effect; in a campaign also by
        effect and number of the log, such as ``wind 3``.
    diagnosis
        The blind diagnosis.
    evaluations
        What every evaluator made of it, by name; None where it had nothing to evaluate.
    """

    case: Case
    realised: Mapping[str, Mapping[str, float]]
    diagnosis: Diagnosis
    evaluations: Mapping[str, Record | None] = field(default_factory=dict)

    @property
    def truths(self) -> tuple[Truth, ...]:
        """What is in the log."""
        return self.case.truths

    def values(self, truth: Truth, finding: Finding) -> Mapping[str, float]:
        """Return the true parameters of an effect, in a campaign those of the log that a finding is of."""
        found = self.realised.get(f"{truth.effect} {finding.log}", self.realised.get(truth.effect))
        return truth.values if found is None else found

    @property
    def oracle(self) -> OracleResult | None:
        """What the oracle made of it."""
        found = self.evaluations.get("oracle")
        return found if isinstance(found, OracleResult) else None

    @property
    def rivals(self) -> RivalDiagnoses | None:
        """What rivals name in it."""
        found = self.evaluations.get(RIVALS)
        return found if isinstance(found, RivalDiagnoses) else None

    @property
    def transfer(self) -> TransferResult | None:
        """What the transfer test made of it."""
        found = self.evaluations.get("transfer")
        return found if isinstance(found, TransferResult) else None
