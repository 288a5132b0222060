"""How alike effects look in a log: the angle between what they do to the prediction errors, and how visible each is.

Two effects that change the prediction errors in the same proportions cannot be separated by any estimator, whatever their
size; this holds before anything is fitted, and depends on the manoeuvres and the sensors alone. Coefficients of the hull are
refitted beside every effect, so that what they can imitate within their prior does not count.

References
----------
Björck and Golub (1973), Numerical methods for computing angles between linear subspaces.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from itertools import combinations, pairwise
from math import sqrt
from typing import Any

import numpy as np

from ferryid.diagnose.inference.estimation import (
    PARAMETER_DIFFERENCE,
    Candidate,
    EstimationProblem,
    Fit,
    fitted_force_model,
)
from ferryid.diagnose.judging.experiment_design import SENSORS, manoeuvre
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects.force_model import ForceModel
from ferryid.effects.wording import titled
from ferryid.types import Floats

HULL = "hull_parameters"
"""What the coefficients of the hull do is taken out of every response, not compared with them."""

Apart = Callable[[Floats], Floats]
"""What is left of columns after nuisances with a prior have imitated them as far as it lets them."""


@dataclass(frozen=True)
class Seen:
    """An effect as a log shows it.

    Attributes
    ----------
    effect, instance, title
        Which it is.
    visibility
        Norm of its response at usual size less what the hull can imitate, in units of the noise: the expected signal-to-noise
        ratio.
    hull_share
        Share of the squared response that the hull's coefficients can imitate, 0 to 1.
    """

    effect: str
    instance: str | None
    title: str
    visibility: float
    hull_share: float


@dataclass(frozen=True)
class Pair:
    """Two effects of which a log shows nearly the same.

    Attributes
    ----------
    first, second
        Their places in `Likeness.effects`.
    likeness
        Cosine of the smallest principal angle between their responses: 1 where they cannot be separated.
    apart
        What distinguishes the less visible one from the other: its visibility times the sine of that angle, in units
        of the noise.
    manoeuvre
        What to record so that they separate.
    sensor
        What to measure so that they separate; None where no sensor of a vessel measures either.
    """

    first: int
    second: int
    likeness: float
    apart: float
    manoeuvre: str
    sensor: str | None


@dataclass(frozen=True)
class Likeness:
    """How alike the effects look in a log.

    Attributes
    ----------
    effects
        Those that can act and are visible, alike ones side by side, q.
    matrix
        Likeness of every two, shape (q, q).
    pairs
        Those above `JUDGING.alike`, the most alike first.
    faint
        Those that act and drown in the noise at their usual size.
    """

    effects: tuple[Seen, ...]
    matrix: Floats
    pairs: tuple[Pair, ...]
    faint: tuple[Seen, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Return it as it stands in ``ferryid.diagnosis/1``."""
        return {
            "effects": [asdict(one) for one in self.effects],
            "faint": [asdict(one) for one in self.faint],
            "matrix": self.matrix.tolist(),
            "pairs": [
                {**asdict(one), **{end: _named(self.effects[getattr(one, end)]) for end in ("first", "second")}}
                for one in self.pairs
            ],
        }


def likeness_of(problem: EstimationProblem, base: Fit, library: Sequence[Candidate]) -> Likeness:
    """Return how alike the effects of a library look in a log.

    Parameters
    ----------
    problem, base
        The log, and its fit without any effect.
    library
        The candidates; those that change no prediction error at all are left out.
    """
    force_model = fitted_force_model(problem.plain, base)
    before = problem.white(force_model)
    apart = imitated_by(problem.by_hull)
    shown: list[tuple[Seen, Floats]] = []
    faint = []
    for candidate in library:
        if candidate.effect.id == HULL:
            continue
        usual = usual_sizes(candidate)[0]
        change, columns = response(problem, force_model, before, candidate, usual)
        whole, left = float(change @ change), float(change @ apart(change))
        if whole == 0.0:
            continue
        title = titled(candidate.effect.title, candidate.instance)
        seen = Seen(candidate.effect.id, candidate.instance, title, sqrt(left), 1.0 - left / whole)
        unreported = candidate.effect.unreported(problem.plain.measurements, usual)
        reported = [k for k, one in enumerate(candidate.parameters) if one.name not in unreported]
        if seen.visibility < JUDGING.visible:
            faint.append(seen)
        else:
            shown.append((seen, columns[:, reported]))
    matrix = likeness_matrix([columns for _, columns in shown], apart)
    order = side_by_side(matrix)
    effects, matrix = tuple(shown[k][0] for k in order), matrix[np.ix_(order, order)]
    return Likeness(effects, matrix, _pairs(effects, matrix), tuple(faint))


def imitated_by(nuisance: Floats) -> Apart:
    """Return what takes away what nuisances can imitate.

    With columns N in units of their prior, that leaves ``(1 + N N')⁻¹ x = x - N (1 + N'N)⁻¹ N' x``: the metric in which
    responses are compared once the nuisances are marginalised.
    """
    inner = nuisance.T @ nuisance + np.eye(nuisance.shape[1])
    return lambda columns: np.asarray(columns - nuisance @ np.linalg.solve(inner, nuisance.T @ columns))


def response(
    problem: EstimationProblem, force_model: ForceModel, before: Floats, candidate: Candidate, usual: Floats
) -> tuple[Floats, Floats]:
    """Return what a candidate does to the whitened prediction errors at parameters `usual`.

    Returns
    -------
    change
        Of the errors by the whole effect, shape (w,); zero where it does nothing.
    columns
        Derivatives by its parameters in their sizes, shape (w, q); empty where it does nothing.
    """
    there = problem.white(candidate.act(force_model, usual))
    change = there - before
    if not change.any():
        # Of what comes and goes by chance a force model holds no force: it is found in the noise, and not here.
        return change, np.empty((len(change), 0))
    steps = np.diag([one.size for one in candidate.parameters])
    moved = (problem.white(candidate.act(force_model, usual + PARAMETER_DIFFERENCE * step)) for step in steps)
    return change, np.column_stack([(one - there) / PARAMETER_DIFFERENCE for one in moved])


def usual_sizes(candidate: Candidate) -> list[Floats]:
    """Return parameters of usual size: all larger than neutral, and every other one smaller where that is possible."""
    neutral = np.array([one.neutral for one in candidate.parameters])
    size = np.array([one.size for one in candidate.parameters])
    low, high = (np.array([getattr(one, end) for one in candidate.parameters]) for end in ("low", "high"))
    signs = [np.ones(len(size)), np.where(np.arange(len(size)) % 2 == 0, -1.0, 1.0)]
    return [np.clip(neutral + sign * size, low, high) for sign in signs]


def likeness_matrix(responses: Sequence[Floats], apart: Apart) -> Floats:
    """Return the cosine of the smallest principal angle between every two responses, shape (q, q).

    Parameters
    ----------
    responses
        Columns of each effect, shape (w, p) with a p of its own; directions of less than `JUDGING.faint_direction` of its
        strongest are not what it looks like, and left out.
    apart
        From `imitated_by`: it defines the inner product ``a' apart(b)``.
    """
    if not responses:
        return np.empty((0, 0))
    every = np.hstack(responses)
    gram = every.T @ apart(every)
    ends = np.cumsum([0, *(one.shape[1] for one in responses)])
    parts = [slice(first, end) for first, end in pairwise(ends.tolist())]
    frames = [_frame(gram[part, part]) for part in parts]
    matrix = np.eye(len(responses))
    for i, j in combinations(range(len(responses)), 2):
        cosines = np.linalg.svd(frames[i].T @ gram[parts[i], parts[j]] @ frames[j], compute_uv=False)
        matrix[i, j] = matrix[j, i] = min(float(cosines[0]), 1.0)
    return matrix


def _frame(gram: Floats) -> Floats:
    """Return combinations of columns with this Gram matrix that are orthonormal, of the directions that count."""
    values, vectors = np.linalg.eigh(gram)
    kept = values >= JUDGING.faint_direction**2 * values[-1]
    return np.asarray(vectors[:, kept] / np.sqrt(values[kept]))


def side_by_side(matrix: Floats) -> list[int]:
    """Return an order in which what is alike lies side by side: from the most alike two, at either end the next."""
    if len(matrix) < 3:
        return list(range(len(matrix)))
    off = matrix - 2.0 * np.eye(len(matrix))
    order = [int(k) for k in np.unravel_index(int(np.argmax(off)), off.shape)]
    left = set(range(len(matrix))) - set(order)
    while left:
        end, new = max(((end, k) for end in (0, -1) for k in sorted(left)), key=lambda one: off[order[one[0]], one[1]])
        order.insert(0 if end == 0 else len(order), new)
        left.remove(new)
    return order


def _pairs(effects: Sequence[Seen], matrix: Floats) -> tuple[Pair, ...]:
    found = []
    for i, j in combinations(range(len(effects)), 2):
        if matrix[i, j] >= JUDGING.alike:
            one, other = effects[i], effects[j]
            sine = sqrt(max(1.0 - matrix[i, j] ** 2, 0.0))
            sensors = dict.fromkeys(SENSORS[name] for name in (one.effect, other.effect) if name in SENSORS)
            found.append(
                Pair(
                    i,
                    j,
                    float(matrix[i, j]),
                    min(one.visibility, other.visibility) * sine,
                    manoeuvre(one.effect, [other.effect]) or "",
                    " or ".join(sensors) or None,
                )
            )
    return tuple(sorted(found, key=lambda one: -one.likeness))


def _named(one: Seen) -> dict[str, str | None]:
    return {"effect": one.effect, "instance": one.instance}
