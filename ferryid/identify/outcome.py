"""What a fit hands on to the report, the JSON output and the notebook."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import atan2, degrees, hypot
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import per_cent
from ferryid.effects.wording import listed
from ferryid.identify.acceptance import Acceptance
from ferryid.identify.log_condition import KindOutcome, LogCondition, conditions_json
from ferryid.identify.thresholds import IDENTIFY
from ferryid.models import Model, ModelScores
from ferryid.models.prediction import FreeRun
from ferryid.signals.track import Motion
from ferryid.types import Flags, Floats, by_axis


@dataclass(frozen=True)
class ComponentCurve:
    """MSE against the number of components, normalised per axis by the base model's.

    Attributes
    ----------
    components
        1..A, shape (A,).
    training, validation
        Normalised MSE, shape (A, 3).
    chosen
        The number of components in the model.
    explained_x, explained_y
        Cumulative fraction of variance explained, shape (A,) and (A, 3).
    """

    components: NDArray[np.int64]
    training: Floats
    validation: Floats
    chosen: int
    explained_x: Floats
    explained_y: Floats


@dataclass(frozen=True)
class Excitation:
    """What a log can and cannot determine.

    Attributes
    ----------
    singular_values
        Of the standardised basis, descending, shape (K,).
    ranges
        ``{"u": (low, high), "v": ..., "r": ..., "u_dot": ..., "v_dot": ..., "r_dot": ..., "U": ...}`` in SI, from the
        0.5 % and 99.5 % quantiles of the training rows.
    heading_coverage
        Fraction of twelve 30° heading sectors with at least 1 % of the rows, 0..1; NaN without heading.
    undetermined
        Term names that the log cannot determine, with the reason: ``{"uv": "same column as ..."}``.
    vip
        Variable importance in projection, shape (K,), terms in basis order.
    """

    singular_values: Floats
    ranges: Mapping[str, tuple[float, float]]
    heading_coverage: float
    undetermined: Mapping[str, str]
    vip: Floats


@dataclass(frozen=True)
class LogFit:
    """One log in a fit: its motion, which rows trained and which validated, and the forces estimated for it.

    Attributes
    ----------
    motion
        Smoothed motion, n rows.
    training, validation
        Row masks, shape (n,); rows in neither were invalid or purged.
    tau_base, tau_model
        Applied force as estimated by base and new model [N, N, N·m], shape (n, 3).
    data_quality
        The log's part of the `inspect` output: topics used, clocks, losses, repairs.
    """

    motion: Motion
    training: Flags
    validation: Flags
    tau_base: Floats
    tau_model: Floats
    data_quality: Mapping[str, object]


@dataclass(frozen=True)
class ArchivedLog:
    """One log in a fit to sums: its rows, its validation MSE over the base model's per axis, shape (3,), and warnings."""

    name: str
    files: tuple[str, ...]
    sha256: str
    rows: int
    validation_rows: int
    mse_ratio: Floats
    warnings: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """Return the log as plain values."""
        return {
            "name": self.name,
            "files": list(self.files),
            "sha256": self.sha256,
            "rows": self.rows,
            "validation_rows": self.validation_rows,
            "per_axis": by_axis(self.mse_ratio),
            "warnings": list(self.warnings),
        }


@dataclass(frozen=True)
class EstimatorScore:
    """How well one estimator predicts.

    Attributes
    ----------
    name
        ``"weak"`` or ``"derivative"``.
    folds
        Squared prediction error over the base model's, mean of the axes, on folds of the training rows; infinite where a fold
        gave no model that can be run, NaN where it was not tried.
    held_out
        The same of an estimate from all training rows, on the rows that validate.
    chosen
        Whether the model comes of it.
    possible
        Whether a hull can have its inertia and damping.
    """

    name: str
    folds: float
    held_out: float
    chosen: bool
    possible: bool = True

    def to_json(self) -> dict[str, Any]:
        """Return the score as plain values."""
        return {
            "name": self.name,
            "folds": self.folds,
            "held_out": self.held_out,
            "chosen": self.chosen,
            "possible": self.possible,
        }


@dataclass(frozen=True)
class EstimatedResponse:
    """How orders of one kind are followed, as logs show it.

    Attributes
    ----------
    orders
        Signals of the profile.
    times, low, high
        Time constant and delay [s], with the ends of their 95 % intervals; zero where there is none.
    error
        Squared error of the acceleration in windows over that of orders that are followed at once, mean of the axes.
    """

    orders: tuple[str, ...]
    times: tuple[float, float]
    low: tuple[float, float]
    high: tuple[float, float]
    error: float

    @property
    def lines(self) -> tuple[str, ...]:
        """The lines of a profile that state it, in the table of each of these orders."""
        keys = ("time_constant_s", "delay_s")
        return tuple(f"{key} = {value:.2g}" for key, value in zip(keys, self.times, strict=True) if value > 0.0)

    def __str__(self) -> str:
        names = listed([one.removesuffix(".command") for one in self.orders])
        parts = [
            f"a {what} of {value:.2g} s (95 % interval {low:.2g} to {high:.2g} s)"
            for what, value, low, high in zip(("time constant", "delay"), self.times, self.low, self.high, strict=True)
            if value > 0.0
        ]
        tables = listed([f'[signals."{one}"]' for one in self.orders])
        return (
            f"The orders of {names} are followed with {' and '.join(parts)}, estimated; the fit took them as followed at once. "
            f"State it in the profile, in {tables}: {' and '.join(self.lines)} (accelerations then err by "
            f"{per_cent(1.0 - self.error)} less, squared). A navigation that is as late looks alike."
        )

    def to_json(self) -> dict[str, Any]:
        """Return the response as plain values."""
        ends = zip(("time_constant", "delay"), self.times, self.low, self.high, strict=True)
        return {
            "orders": list(self.orders),
            **{key: {"value": value, "low": low, "high": high, "unit": "s"} for key, value, low, high in ends},
            "squared_error": self.error,
        }


@dataclass(frozen=True)
class LogWind:
    """Steady wind that acted in one log, estimated with the hull.

    Attributes
    ----------
    log
        Name of the log.
    wind
        North and east, where the air goes to [m/s].
    standard_error
        Of either, from the scatter within the logs alone. On recordings with an anemometer that was withheld the error was many
        times as large, so that texts do not show it.
    """

    log: str
    wind: tuple[float, float]
    standard_error: tuple[float, ...]

    @property
    def significant(self) -> bool:
        """Whether it differs from no wind by two standard errors."""
        return sum((value / error) ** 2 for value, error in zip(self.wind, self.standard_error, strict=True)) > 6.0

    def __str__(self) -> str:
        north, east = self.wind
        speed, towards = hypot(north, east), degrees(atan2(east, north)) % 360.0
        if not self.significant:
            return f"{self.log}: none that differs from zero"
        return f"{self.log}: {speed:.1f} m/s towards {towards:.0f}° (estimated, not confirmed; a current may be taken for it)"

    def to_json(self) -> dict[str, Any]:
        """Return the wind as plain values."""
        return {
            "log": self.log,
            "wind": {
                axis: {"value": value, "standard_error": error, "unit": "m/s"}
                for axis, value, error in zip(("north", "east"), self.wind, self.standard_error, strict=True)
            },
        }


@dataclass(frozen=True)
class FitOutcome:
    """Everything that one fit found out: a fit to logs, to an archive or to motions in memory.

    Attributes
    ----------
    model, acceptance
        The model, not stored yet, and whether it may replace the base model.
    judged
        The model from the training rows alone, of which scores and verdict are; `model` is from all rows where blocks of the
        logs were held out, else the same.
    scores
        Scores of `judged`.
    curve
        Force error against the number of components.
    excitation
        What the training rows determine.
    free_run_base, free_run_model
        Free runs on validation rows.
    warnings
        What to know before trusting the model, as sentences.
    logs
        The logs of a fit to rows.
    archive
        The logs of a fit to sums.
    winds
        Steady winds of single logs that nobody measured.
    conditions
        Conditions besides wind that single logs have of their own.
    condition_kinds
        What spoke for each kind of these that was considered.
    estimators
        How well either estimator predicts, where a fit chose between them.
    notes
        What else there is to know of the logs, as sentences.
    order_responses
        How orders are followed that no feedback goes with, as the logs show it.
    logs_left_out
        Why each log that is left out is, as a sentence, by its path; the sentences are warnings as well.
    """

    model: Model
    judged: Model
    acceptance: Acceptance
    scores: ModelScores
    curve: ComponentCurve
    excitation: Excitation
    free_run_base: FreeRun
    free_run_model: FreeRun
    warnings: tuple[str, ...]
    logs: tuple[LogFit, ...] = ()
    archive: tuple[ArchivedLog, ...] = ()
    estimators: tuple[EstimatorScore, ...] = ()
    winds: tuple[LogWind, ...] = ()
    conditions: tuple[LogCondition, ...] = ()
    condition_kinds: tuple[KindOutcome, ...] = ()
    notes: tuple[str, ...] = ()
    order_responses: tuple[EstimatedResponse, ...] = ()
    logs_left_out: Mapping[str, str] = field(default_factory=dict)

    @property
    def base_fits_already(self) -> float | None:
        """Least R² of the base model's axes where it fits so well, and the new one errs about as much; None elsewhere.

        A base model that was scaled does not count: whoever scales it wants it to be corrected.
        """
        known = self.scores.force.r2_base[np.isfinite(self.scores.force.r2_base)]
        changed = abs(self.acceptance.normalised_mse - 1.0)
        scaled = any(factor != 1.0 for factor in self.model.scale.values())
        if self.acceptance.accepted or scaled or not known.size or not changed < IDENTIFY.improvement:
            return None
        least = float(known.min())
        return least if least >= IDENTIFY.fits_already else None

    def conditions_by_log(self) -> list[dict[str, Any]]:
        """Return wind and other conditions as plain values, one entry a log that has any."""
        return conditions_json(self.winds, self.conditions)
