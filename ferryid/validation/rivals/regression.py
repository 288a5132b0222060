"""From a log to columns, and from chosen columns to names and predictions: what sparse regressions share."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.models.prediction import Prediction
from ferryid.signals.prepare import Prepared
from ferryid.types import Floats, Ints
from ferryid.validation.records import RivalName
from ferryid.validation.rivals.base import Base, base_of, prepared_log
from ferryid.validation.rivals.candidates import CONSTANT, Candidate, candidates, distinct_columns
from ferryid.validation.rivals.joint_fit import combined, joint_coefficients, least_error
from ferryid.validation.rivals.learner import WINDOW_S, LearnedModel
from ferryid.vessel.profile import Profile

Choose = Callable[[Floats, Floats, Ints], Floats]
"""``choose(X (m, k), y (m,), block (m,)) -> coefficients (k,)``, zero where not chosen; columns and `y` have mean square 1.

`block` numbers contiguous stretches of the log.
"""

BLOCKS = 5
"""Contiguous stretches of the log that take turns in cross-validation."""
FEWEST_ROWS = 60
"""Smoothing windows below which there is nothing to choose by."""


@dataclass(frozen=True)
class Regression:
    """The residual of one log beside the columns of all candidates, one row a smoothing window and axis.

    Attributes
    ----------
    X
        Columns of mean square 1, shape (m, k).
    y
        Residual over its root mean square by axis, shape (m,).
    block
        Contiguous stretch that a row lies in, shape (m,).
    candidates
        The k terms.
    scale
        What the columns were divided by, shape (k,): a coefficient over it is one of the term's own unit.
    rows, by_axis
        Rows of the log, and what the force on each axis was divided by, shape (3,).
    """

    X: Floats
    y: Floats
    block: Ints
    candidates: tuple[Candidate, ...]
    scale: Floats
    rows: Ints
    by_axis: Floats


def regression_of(base: Base) -> Regression:
    """Return the regression for a log.

    Smoothed rows repeat one another within a window: one row of each window is taken.

    Raises
    ------
    FerryIdError
        For a log that is too short.
    """
    motion = base.prepared.motion
    rows = np.flatnonzero(base.rows)[:: max(1, round(WINDOW_S * motion.rate_hz))]
    if rows.size < FEWEST_ROWS:
        raise FerryIdError(
            f"{motion.log}: {rows.size} s with force and motion are too few to choose terms by, which needs {FEWEST_ROWS} s. "
            "Fix: give a longer log"
        )
    residual = base.residual[rows]
    by_axis = np.sqrt(np.mean(residual**2, axis=0))
    by_axis = np.where(by_axis > 0.0, by_axis, 1.0)
    every = candidates(base)
    columns = np.column_stack([(one.column(base)[rows] / by_axis).ravel() for one in every])
    # An effect that needs what the log measured only in part is left out; a column of zeros is never kept.
    known = np.where(np.isfinite(columns).all(axis=0), columns, 0.0)
    kept = distinct_columns(known)
    columns = columns[:, kept]
    scale = np.sqrt(np.mean(columns**2, axis=0))
    block = np.repeat(np.arange(rows.size) * BLOCKS // rows.size, 3)
    return Regression(
        X=columns / scale,
        y=(residual / by_axis).ravel(),
        block=block,
        candidates=tuple(every[k] for k in kept),
        scale=scale,
        rows=rows,
        by_axis=by_axis,
    )


def learn_sparsely(rival: str, choose: Choose, log: str, profile: Profile, out: Path) -> LearnedModel:
    """Choose terms for a log and return what comes of them; arguments as in `ferryid.validation.rivals.learner.Learner`."""
    base = base_of(prepared_log(log, profile, out), profile)
    task = regression_of(base)
    coefficients = choose(task.X, task.y, task.block)
    chosen = np.flatnonzero(coefficients)
    terms = [task.candidates[k] for k in chosen.tolist()]
    units = [term.added(base) for term in terms]
    linear = (coefficients / task.scale)[chosen]
    both = (linear, joint_coefficients(base, units, linear, task.rows, task.by_axis))
    sizes = least_error(base, units, both, task.rows, task.by_axis)

    def expect(prepared: Prepared) -> Prediction:
        other = base_of(prepared, profile)
        return other.expected(combined(other, [term.added(other) for term in terms], sizes))

    names = names_of(task.X[:, chosen], task.y, terms)
    return LearnedModel(
        rival, expect, names, {term.label: size for term, size in zip(terms, sizes.tolist(), strict=True)}
    )


def names_of(X: Floats, y: Floats, terms: Sequence[Candidate]) -> tuple[RivalName, ...]:
    """Return the physics that chosen terms speak for, the one that removes most first.

    A force that is constant over ground is the wind's, or that of a mooring whose spring has its zero elsewhere: it goes to
    whichever of the two removes more by its own terms. Where the wind was measured it is the mooring's.

    Parameters
    ----------
    X, y
        Columns of the chosen terms, shape (m, q), and the residual, shape (m,).
    terms
        The terms, q of them.
    """

    def without(places: Sequence[int]) -> float:
        return left_over(np.delete(X, places, axis=1), y)

    constant = [one.label.startswith(CONSTANT) for one in terms]
    alone = {
        effect: without([k for k, one in enumerate(terms) if one.effect == effect and not constant[k]])
        for effect in ("wind", "mooring")
    }
    pulls = "mooring" if alone["mooring"] > alone["wind"] else "wind"
    groups: dict[tuple[str, str | None], list[int]] = {}
    for k, one in enumerate(terms):
        effect = pulls if constant[k] and one.effect == "wind" else one.effect
        groups.setdefault((effect or one.label, one.instance), []).append(k)
    whole, left = float(y @ y), left_over(X, y)
    named = [
        RivalName(
            effect,
            instance,
            (without(places) - left) / whole,
            tuple(terms[k].label for k in places),
        )
        for (effect, instance), places in groups.items()
    ]
    return tuple(sorted(named, key=lambda one: -one.removed))


def left_over(X: Floats, y: Floats) -> float:
    """Return the squared residual that ordinary least squares leaves."""
    if X.shape[1] == 0:
        return float(y @ y)
    rest = y - X @ np.linalg.lstsq(X, y, rcond=None)[0]
    return float(rest @ rest)
