"""The result of a comparison; what is not known is NaN here and null in JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite, nan

from ferryid.json_record import Record, json_key
from ferryid.models import Quantity


@dataclass(frozen=True)
class ComparedModel(Record):
    """A model of a comparison.

    Attributes
    ----------
    label
        Its name in the comparison.
    name, version
        Its own.
    is_base
        True for the hull in the profile alone.
    accepted
        Verdict of its fit; None for the base model.
    basis
        Name of its basis.
    diagnosed
        Whether a diagnosis has changed it.
    scale
        Factors on its base model.
    training
        Names of the logs that it was fitted to.
    validation, normalised_mse
        Mean square force error over its base model's where it was validated, by axis and on average; None without scores.
    """

    label: str
    name: str
    version: int
    is_base: bool = field(metadata=json_key("base"))
    accepted: bool | None
    basis: str
    diagnosed: bool
    scale: Mapping[str, float]
    training: tuple[str, ...]
    validation: Mapping[str, float] | None
    normalised_mse: float | None


@dataclass(frozen=True)
class PredictionErrors(Record):
    """Mean square [N², N², N²m²] and R² of the force that makes up for errors of the acceleration in windows, by axis."""

    mse: Mapping[str, float]
    r2: Mapping[str, float]


@dataclass(frozen=True)
class ModelErrors(Record):
    """Errors of one model.

    Attributes
    ----------
    mse, r2
        Mean square force error of single rows [N², N², N²m²] and R², by axis.
    prediction
        How far predicted accelerations are off, as forces, in windows.
    trained
        Whether the model has learnt from what it is judged on.
    free_run
        Root-mean-square errors at each horizon, by quantity with unit.
    """

    mse: Mapping[str, float]
    r2: Mapping[str, float]
    prediction: PredictionErrors
    trained: bool
    free_run: Mapping[str, tuple[float, ...]]


@dataclass(frozen=True)
class FreeRunCounts(Record):
    """How many free runs there are.

    Attributes
    ----------
    horizons_s
        Horizons [s].
    told_s
        The one that sentences are made of; None where none has intervals.
    starts
        Runs.
    counted, blocks
        At each horizon: runs that count, and blocks of them.
    """

    horizons_s: tuple[float, ...]
    told_s: float | None
    starts: int
    counted: tuple[int, ...]
    blocks: tuple[int, ...]


@dataclass(frozen=True)
class Ratio(Record):
    """One model's error over another's, its 95 % interval, and the probability of one this far from 1 by chance."""

    value: float
    low: float
    high: float
    p: float

    def inverse(self) -> Ratio:
        """Return the second model's error over the first's; what would have no bounds is not known."""

        def over(value: float) -> float:
            return 1.0 / value if isfinite(value) and value != 0.0 else nan

        return Ratio(over(self.value), over(self.high), over(self.low), self.p)


@dataclass(frozen=True)
class ModelPair(Record):
    """Errors of the first of two models over the second's: mean squares by axis, and free runs at each horizon.

    `mse` is of the force in single rows, `prediction` of the acceleration in windows.
    """

    first: str
    second: str
    mse: Mapping[str, Ratio]
    prediction: Mapping[str, Ratio]
    free_run: Mapping[str, tuple[Ratio, ...]]

    def inverse(self) -> ModelPair:
        """Return it with the models exchanged."""
        mse, prediction = (
            {axis: ratio.inverse() for axis, ratio in each.items()} for each in (self.mse, self.prediction)
        )
        free_run = {key: tuple(ratio.inverse() for ratio in ratios) for key, ratios in self.free_run.items()}
        return ModelPair(self.second, self.first, mse, prediction, free_run)


@dataclass(frozen=True)
class CommonErrors(Record):
    """Errors of all models on the same rows, of one log or of several together.

    Attributes
    ----------
    rows, seconds, blocks
        Rows, their length [s], and blocks of them.
    windows
        Windows in which accelerations are predicted; none in a log without a stretch as long as a window.
    scores
        Errors of each model by its label.
    free_run
        How many free runs there are.
    pairs
        Ratios of every two models.
    """

    rows: int
    seconds: float
    blocks: int
    windows: int
    scores: Mapping[str, ModelErrors]
    free_run: FreeRunCounts
    pairs: tuple[ModelPair, ...]


@dataclass(frozen=True)
class TrackingScores(Record):
    """How closely a vessel kept to its reference; see `ferryid.compare.Tracking`.

    Attributes
    ----------
    ISE, IAE, EC, IAEW
        Sums over unbroken stretches.
    seconds
        Length of all stretches [s].
    position_m, heading_rad
        Root-mean-square errors [m], [rad].
    """

    ISE: float
    IAE: float
    EC: float
    IAEW: float
    seconds: float
    position_m: float
    heading_rad: float


@dataclass(frozen=True)
class _Log(Record):
    """Name, hash of the content, and length of a block [s] of a log."""

    name: str
    sha256: str
    block_s: float


@dataclass(frozen=True)
class LogErrors(CommonErrors, _Log):
    """Errors of all models on one log, how closely it kept to a reference if it has one, and what a reader must know of it."""

    tracking: TrackingScores | None
    warnings: tuple[str, ...]


def place_of(kind: str, what: str, horizon_s: float | None) -> str:
    """Return where two models are compared, as a part of a sentence; arguments are those of `Statement`."""
    return f"in {what}, run free for {horizon_s:g} s" if kind == "free run" else f"on {what}"


@dataclass(frozen=True)
class Statement(Record):
    """Which of two models is better in one respect.

    Attributes
    ----------
    on
        Name of the log; None for all of them together.
    kind, what, horizon_s
        ``prediction`` (accelerations in windows) or ``force`` (single rows) and an axis, or ``free run``, a quantity and a
        horizon [s].
    first, second
        The model that errs less, and the other.
    ratio, low, high
        Error of the first over the second's, with its 95 % interval.
    p, p_corrected
        Probability of such a ratio by chance, by itself and among all comparisons; those of ``force`` by themselves.
    better, perhaps
        The first where it is better, and where it may be; else None.
    evidence
        False where the first has learnt from what it is judged on.
    sentence
        All of it.
    """

    on: str | None
    kind: str
    what: str
    horizon_s: float | None
    first: str
    second: str
    ratio: float
    low: float
    high: float
    p: float
    p_corrected: float
    better: str | None
    perhaps: str | None
    evidence: bool
    sentence: str = field(metadata=json_key("says"))

    @property
    def place(self) -> str:
        """Where the two are compared, as a part of a sentence."""
        return place_of(self.kind, self.what, self.horizon_s)


@dataclass(frozen=True)
class Coefficient(Record):
    """A coefficient of one model with its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class CoefficientRow(Record):
    """A coefficient of the equations of motion in every model, by label."""

    coefficient: str
    unit: str
    values: Mapping[str, Coefficient]


@dataclass(frozen=True)
class TermRow(Record):
    """The coefficient of a term on an axis in every model that has it, by label."""

    term: str
    axis: str
    unit: str
    values: Mapping[str, Coefficient]


@dataclass(frozen=True)
class Coefficients(Record):
    """Coefficients of the equations of motion, and of the terms of the corrections alone."""

    physical: tuple[CoefficientRow, ...]
    terms: tuple[TermRow, ...]


@dataclass(frozen=True)
class EffectInModel(Record):
    """Parameters of an effect in one model, and the sentence on it."""

    parameters: Mapping[str, Quantity]
    sentence: str = field(metadata=json_key("says"))


@dataclass(frozen=True)
class EffectRow(Record):
    """An effect in every model by label, None in one that lacks it; `log` is None for a property of the vessel."""

    effect: str
    instance: str | None
    log: str | None
    values: Mapping[str, EffectInModel | None]


@dataclass(frozen=True)
class ComparisonResult(Record):
    """Schema ``ferryid.compare/1`` without the path of the report.

    Attributes
    ----------
    schema
        Name of the form.
    vessel
        Name of the vessel.
    window_s
        Smoothing window of the test data [s].
    prediction_window_s
        Length of the windows in which accelerations are predicted [s].
    models
        The base model first where there is one.
    warnings
        What a reader must know of the whole comparison.
    logs, pooled
        Errors on each log, and on several together; None for fewer than two.
    statements
        What is better than what.
    coefficients, effects
        Of the models, whatever the logs.
    """

    schema: str
    vessel: str
    window_s: float
    prediction_window_s: float
    models: tuple[ComparedModel, ...]
    warnings: tuple[str, ...]
    logs: tuple[LogErrors, ...]
    pooled: CommonErrors | None
    statements: tuple[Statement, ...] = field(metadata=json_key("better"))
    coefficients: Coefficients
    effects: tuple[EffectRow, ...]

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the models, in order."""
        return tuple(model.label for model in self.models)
