"""Force errors of models on motions in memory, and whether a new one may replace the old; thesis 3.2.4."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ferryid.errors import FerryIdError
from ferryid.identify.acceptance import accept
from ferryid.identify.estimate import Estimator, estimator
from ferryid.identify.model import Model
from ferryid.identify.outcome import Acceptance
from ferryid.identify.scores import mean_square, usable
from ferryid.signals.track import Motion

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


def force_mse(
    model: Model | Estimator, motions: Motion | Sequence[Motion], rows: Sequence[Flags] | None = None
) -> Floats:
    """Return the mean square of measured less estimated force per axis, shape (3,) [N², N², (N·m)²].

    Parameters
    ----------
    model
        A model, or an estimator such as ``Estimator(profile, scale)`` for a base model alone.
    motions
        One or several motions, whose rows count alike.
    rows
        Rows to use, one mask a motion, shape (n,); None: all. Rows on which force or estimate are not known are
        left out; NaN where none remains.
    """
    force = _force(model)
    motions = [motions] if isinstance(motions, Motion) else list(motions)
    estimates = [force.of(motion) for motion in motions]
    masks = [
        usable(motion, estimate) & wanted
        for motion, estimate, wanted in zip(motions, estimates, wanted_rows(motions, rows), strict=True)
    ]
    return mean_square(
        np.concatenate([motion.tau for motion in motions]), np.concatenate(estimates), np.concatenate(masks)
    )


def judge(
    old: Model | Estimator,
    new: Model | Estimator,
    motions: Motion | Sequence[Motion],
    rows: Sequence[Flags] | None = None,
) -> Acceptance:
    """Say whether a new model may replace the old one, by the updating criterion of thesis 3.2.4; see `accept`.

    Both are judged on the same rows: those of motions that neither was fitted to, on which both can be evaluated.
    """
    motions = [motions] if isinstance(motions, Motion) else list(motions)
    known = [
        usable(motion, _force(old).of(motion), _force(new).of(motion)) & wanted
        for motion, wanted in zip(motions, wanted_rows(motions, rows), strict=True)
    ]
    return accept(force_mse(old, motions, known), force_mse(new, motions, known))


def wanted_rows(motions: Sequence[Motion], rows: Sequence[Flags] | None) -> list[Flags]:
    """Return the mask asked for of every motion."""
    if rows is None:
        return [np.ones(len(motion.t), dtype=bool) for motion in motions]
    if [len(mask) for mask in rows] != [len(motion.t) for motion in motions]:
        raise FerryIdError(
            f"rows: every motion needs one mask of its own length, found lengths {[len(mask) for mask in rows]} for "
            f"{[len(motion.t) for motion in motions]} rows. Fix: pass one mask a motion"
        )
    return [np.asarray(mask, dtype=bool) for mask in rows]


def _force(model: Model | Estimator) -> Estimator:
    return estimator(model) if isinstance(model, Model) else model
