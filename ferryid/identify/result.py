"""What a fit hands on to the report, the JSON output and the notebook."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ferryid.identify.model import AXES, Model
from ferryid.signals.track import Motion

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

__all__ = ["AXES", "ComponentCurve", "Excitation", "FitResult", "FreeRun", "LogFit", "Verdict"]


@dataclass(frozen=True)
class Verdict:
    """Whether a model is accepted and why, in sentences that a person can act on."""

    accepted: bool
    normalised_mse: float
    """Validation MSE over the base model's, averaged over the three axes."""
    per_axis: Mapping[str, float]
    """The same per axis."""
    reasons: tuple[str, ...]


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
class FreeRun:
    """Free-run (open-loop) prediction error of a model against horizon, on held-out stretches.

    Attributes
    ----------
    horizons_s
        Prediction horizons [s], shape (H,).
    position_m, heading_rad, speed_mps, yaw_rate_radps
        Root-mean-square error at each horizon, shape (H,); NaN where a run diverged or no stretch was long enough.
    starts
        Number of starting points.
    example
        ``{"t": (n,), "measured": (n, 3), "predicted": (n, 3)}`` of `nu` over one stretch, for a figure.
    note
        Why there is no prediction, or an empty string.
    diverged
        Number of runs that diverged, which the means leave out.
    """

    horizons_s: Floats
    position_m: Floats
    heading_rad: Floats
    speed_mps: Floats
    yaw_rate_radps: Floats
    starts: int
    example: Mapping[str, Floats]
    note: str = ""
    diverged: int = 0


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
class FitResult:
    """Everything that one fit found out; `report` renders it and never computes."""

    model: Model
    verdict: Verdict
    logs: tuple[LogFit, ...]
    curve: ComponentCurve
    excitation: Excitation
    free_run_base: FreeRun
    free_run_model: FreeRun
    warnings: tuple[str, ...]
    archive: tuple[Mapping[str, Any], ...] = ()
    """Instead of `logs`, of a fit to sums alone: each log with its rows and its validation MSE over the base model's."""
