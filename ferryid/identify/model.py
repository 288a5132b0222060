"""A model of the applied force: base model plus a linear correction, with everything needed to check it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Model:
    """``tau = F_0(nu_dot, nu) + theta' phi + intercept``, thesis (3.3).

    Attributes
    ----------
    name, version
        Name in the store and version counted from 1 (0: not stored yet).
    created
        ISO 8601 time in UTC; the only field that differs between two runs on the same input.
    ferryid_version
        Version that wrote it.
    profile_text
        The vessel profile (TOML) that the model was fitted with, embedded so that other logs can be evaluated.
    scale
        ``{"delta": 1.0, "sigma": 1.0, "zeta": 1.0}`` factors on the base model's M and C, D, and tau (4.2)-(4.5).
    settings
        The fit's settings as plain values: basis, structure, components, window_s, smoother, split, residual, rate_hz, ...
    terms
        Basis function names, K of them.
    units
        Unit of each coefficient, K rows of three (N, N, N·m over the term's unit).
    theta
        Coefficients, shape (K, 3).
    intercept
        Shape (3,) [N, N, N·m].
    low, high
        95 % block-bootstrap interval of `theta`, shape (K, 3).
    intercept_low, intercept_high
        The same for `intercept`, shape (3,).
    covariance
        Bootstrap covariance of the coefficients per axis, shape (3, K + 1, K + 1), intercept last.
    ranges
        Ranges of validity, as in `Excitation.ranges`.
    training
        One entry a log: ``{"name", "files", "sha256", "seconds", "rows"}``.
    scores
        Validation scores: ``{"base": {...}, "model": {...}, "normalised_mse": ..., "per_axis": {...}}``.
    accepted
        Verdict at the time of the fit.
    """

    name: str
    version: int
    created: str
    ferryid_version: str
    profile_text: str
    scale: Mapping[str, float]
    settings: Mapping[str, Any]
    terms: tuple[str, ...]
    units: tuple[tuple[str, str, str], ...]
    theta: Floats
    intercept: Floats
    low: Floats
    high: Floats
    intercept_low: Floats
    intercept_high: Floats
    covariance: Floats
    ranges: Mapping[str, tuple[float, float]]
    training: tuple[Mapping[str, Any], ...]
    scores: Mapping[str, Any]
    accepted: bool
