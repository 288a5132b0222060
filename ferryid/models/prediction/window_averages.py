"""Prediction errors in windows of what models of any kind expect of a log, as a fit has them of its rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ferryid.models.forces.estimator import without_sway_coupling
from ferryid.models.prediction.free_run import predicted_acceleration
from ferryid.models.prediction.log_prediction import Prediction
from ferryid.models.scores import ForceScores, force_scores, mean_square
from ferryid.regression import window_rows, window_starts, window_sums, window_weights
from ferryid.signals.track import Motion, segments
from ferryid.types import Flags, Floats


class WindowErrors(NamedTuple):
    """Errors of several predictions in J windows that all share.

    Attributes
    ----------
    force
        Applied force [N, N, N·m], shape (J, 3).
    errors
        How far the acceleration of each prediction is off, as a force, shape (J, 3) each; infinite for a model whose mass
        matrix cannot be inverted.
    starts_s
        When each window starts [s], shape (J,).
    accelerating
        The measured acceleration as a force, shape (J, 3): how far a velocity that does not change is off.
    """

    force: Floats
    errors: list[Floats]
    starts_s: Floats
    accelerating: Floats


def window_errors(
    predictions: Sequence[Prediction],
    motion: Motion,
    rows: Flags,
    mass: Floats,
    length_s: float,
    *,
    reduced: bool = False,
) -> WindowErrors:
    """Return the applied force and how far predicted accelerations are off, averaged over windows that all share.

    Parameters
    ----------
    predictions
        What models expect of one log.
    motion, rows
        The log, and the rows whose windows count, shape (n,).
    mass
        Mass matrix [kg, kg·m, kg·m²] with which an error of the acceleration is given as a force, shape (3, 3).
    length_s
        Length of a window [s].
    reduced
        Whether sway was not measured: it then neither errs nor couples.

    A model whose mass matrix cannot be inverted takes no row from the others.
    """
    mass = without_sway_coupling(mass) if reduced else mass
    expected = [predicted_acceleration(one.force, one.motion, coupled_sway=not reduced) for one in predictions]
    known = [np.isfinite(one).all(axis=1) for one in expected]
    rows = np.logical_and.reduce([rows, *(one for one in known if one.any())])
    step_s = 1.0 / motion.rate_hz
    m = window_rows(length_s, motion.rate_hz)
    weight, slope = (step_s * each for each in window_weights(m, step_s)[:2])
    starts = window_starts(segments(rows), m)[0]
    errors = []
    for one, acceleration, some in zip(predictions, expected, known, strict=True):
        error = window_sums(acceleration, weight, starts) + window_sums(one.motion.nu, slope, starts)
        errors.append(error @ mass.T if some.any() else np.full_like(error, np.inf))
    accelerating = -window_sums(motion.nu, slope, starts) @ mass.T
    return WindowErrors(window_sums(motion.tau, weight, starts), errors, motion.t[starts], accelerating)


def window_scores(force: Floats, base: Floats, model: Floats, accelerating: Floats) -> ForceScores:
    """Return the scores of a model beside its base model of what `window_errors` returns, shape (J, 3) each."""
    rows = np.ones(len(force), dtype=bool)
    scores = force_scores(force, force - base, force - model, rows)
    return replace(scores, mse_constant_velocity=mean_square(accelerating, np.zeros_like(accelerating), rows))
