"""How alike effects look in a log before anything is fitted: angles between what each does to the prediction errors.

An effect's response is the change of the whitened prediction errors when one of its parameters goes to its usual size. What the
hull's coefficients imitate within their prior is projected out. Two effects whose responses span the same space cannot be told
apart, whatever is fitted; the cosine of the smallest angle between the two spaces is their likeness.

References
----------
Björck and Golub (1973), Numerical methods for computing angles between linear subspaces.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import sqrt
from typing import Any

import numpy as np
from scipy.cluster.hierarchy import leaves_list, linkage
from scipy.spatial.distance import squareform

from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem
from ferryid.diagnose.inference.search import list_candidates
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.effects.effect import HELD
from ferryid.effects.wording import titled
from ferryid.types import Floats

Key = tuple[str, str | None]
HULL = "hull_parameters"
"""The hull's coefficients are what is projected out, so that an effect of nothing else is not compared."""
ROUNDING = 1e-9
"""Share of the greatest response below which a direction is none."""


@dataclass(frozen=True)
class Responses:
    """Cross-products of what hull and effects do to the whitened prediction errors of a log, or of several.

    Attributes
    ----------
    titles
        Of every effect (and instance) that does anything, by key.
    errors
        How far off each one's formula may be, as a share of what it does, by key.
    parameters
        Key and parameter of every column behind the hull's.
    hull_spread
        Prior standard deviations of the hull's coefficients, shape (26,), in which their columns are.
    products
        Shape (26 + q, 26 + q); the columns of effects are for a parameter of usual size.
    """

    titles: Mapping[Key, str]
    errors: Mapping[Key, float]
    parameters: tuple[tuple[Key, str], ...]
    hull_spread: Floats
    products: Floats

    def with_hull_spread(self, spread: Floats) -> Responses:
        """Return the same with another prior of the hull; a coefficient that could not move before still cannot."""
        scale = np.divide(spread, self.hull_spread, out=np.zeros_like(spread), where=self.hull_spread > 0.0)
        every = np.concatenate([scale, np.ones(len(self.parameters))])
        return replace(self, hull_spread=spread, products=self.products * np.outer(every, every))


@dataclass(frozen=True)
class EffectVisibility:
    """An effect of usual size in a log.

    Attributes
    ----------
    effect, instance, title
        Which one.
    signal_to_noise
        Norm of its response, in standard deviations of the noise; the root mean square over the signs of its parameters.
    share_of_hull
        Share of the squared response that the hull's coefficients imitate within their prior, and that is not in it.
    """

    effect: str
    instance: str | None
    title: str
    signal_to_noise: float
    share_of_hull: float

    @property
    def key(self) -> Key:
        """Effect and instance."""
        return self.effect, self.instance

    @property
    def visible(self) -> bool:
        """True where it could be named at its usual size."""
        return self.signal_to_noise >= INFERENCE.visible_response


@dataclass(frozen=True)
class Pair:
    """Two effects in a log.

    Attributes
    ----------
    first, second
        Effect and instance of each.
    likeness
        Cosine of the smallest angle between their responses: 1 where they cannot be told apart, 0 where nothing is common.
    resolved_from
        How many times its usual size the less visible one needs for the log evidence between the two to exceed
        `INFERENCE.resolved_evidence`; None where no size is enough, as formulas are as far off as the two differ.
    """

    first: Key
    second: Key
    likeness: float
    resolved_from: float | None

    @property
    def resolved(self) -> bool:
        """True where usual sizes are enough."""
        return self.resolved_from is not None and self.resolved_from <= 1.0


@dataclass(frozen=True)
class Likeness:
    """How alike effects look in a log, or in several together.

    Attributes
    ----------
    effects
        Those that do anything there, alike ones beside each other.
    matrix
        Likeness of every two, in the same order, shape (n, n), ones on the diagonal.
    pairs
        Every two of them, the most alike first.
    """

    effects: tuple[EffectVisibility, ...]
    matrix: Floats
    pairs: tuple[Pair, ...]

    @property
    def alike(self) -> tuple[Pair, ...]:
        """Pairs of visible effects that usual sizes do not resolve, the most alike first."""
        visible = {one.key for one in self.effects if one.visible}
        return tuple(one for one in self.pairs if not one.resolved and {one.first, one.second} <= visible)

    @property
    def hidden(self) -> tuple[EffectVisibility, ...]:
        """Effects that could not be named at their usual size."""
        return tuple(one for one in self.effects if not one.visible)

    def title(self, key: Key) -> str:
        """Return the title of an effect."""
        return next(one.title for one in self.effects if one.key == key)

    def to_json(self) -> dict[str, Any]:
        """Return effects and pairs as plain values."""
        return {
            "effects": [
                {
                    "effect": one.effect,
                    "instance": one.instance,
                    "signal_to_noise": one.signal_to_noise,
                    "visible": one.visible,
                    "share_of_hull": one.share_of_hull,
                }
                for one in self.effects
            ],
            "pairs": [
                {
                    "effects": [{"effect": effect, "instance": instance} for effect, instance in (one.first, one.second)],
                    "likeness": one.likeness,
                    "resolved_from": one.resolved_from,
                }
                for one in self.pairs
            ],
        }


def candidates_of(problem: EstimationProblem) -> list[Candidate]:
    """Return the effects that have a response: those that a log can show, without what comes and goes by chance.

    Of that a force model holds no force; it is a state of the filter.
    """
    return [
        one
        for one in list_candidates(problem.plain.measurements)[0]
        if one.effect.unsteady is None and one.effect.id != HULL
    ]


def responses(problem: EstimationProblem, candidates: Sequence[Candidate] | None = None) -> Responses:
    """Return what hull and effects do to the prediction errors of a log, beside what its plain force model has.

    Parameters
    ----------
    problem
        The log.
    candidates
        The effects; those of `candidates_of` where None.
    """
    columns, parameters = [problem.by_hull], list[tuple[Key, str]]()
    titles, errors = dict[Key, str](), dict[Key, float]()
    for candidate in candidates_of(problem) if candidates is None else candidates:
        names, response = _response(problem, candidate)
        if not names:
            continue
        columns.append(response)
        parameters += [(candidate.key, name) for name in names]
        titles[candidate.key] = titled(candidate.effect.title, candidate.instance)
        errors[candidate.key] = candidate.effect.formula_error
    every = np.column_stack(columns)
    return Responses(titles, errors, tuple(parameters), problem.hull_spread, every.T @ every)


def _response(problem: EstimationProblem, candidate: Candidate) -> tuple[list[str], Floats]:
    """Return the parameters that do anything, and the change that each makes at its usual size, shape (w, q).

    Each goes from its neutral value to both sides as far as it may; one that means nothing there, such as the place of a
    spring without stiffness, moves where the others have their usual size.
    """
    size, low, high, neutral = (
        np.array([getattr(one, name) for one in candidate.parameters]) for name in ("size", "low", "high", "neutral")
    )
    at = neutral.copy()
    idle = candidate.effect.unreported(problem.plain.measurements, np.clip(neutral + size, low, high))
    own = [k for k, one in enumerate(candidate.parameters) if one.name not in idle and size[k] > HELD]
    for k, start in enumerate(candidate.start):
        if k not in own:
            at[k] = start
    found = np.zeros((problem.steps.measured[:, problem.steps.channels].size, len(at)))

    def move(base: Floats, places: Sequence[int]) -> None:
        ends, gaps = [], []
        for k in places:
            pair = np.clip([base[k] - size[k], base[k] + size[k]], low[k], high[k])
            ends.append(float(pair[1] - pair[0]))
            for value in pair:
                moved = base.copy()
                moved[k] = value
                gaps.append(problem.steps.gap(candidate.act(problem.plain, moved)))
        change = np.stack(gaps[1::2], axis=2) - np.stack(gaps[::2], axis=2)
        found[:, places] = problem.whitening_filter.white(change) * (size[places] / ends)

    if not own:
        return [], found[:, :0]
    move(at, own)
    norms = np.linalg.norm(found[:, own], axis=0)
    still = [k for k, norm in zip(own, norms, strict=True) if norm <= sqrt(ROUNDING) * max(float(norms.max()), 1.0)]
    acting = [k for k in own if k not in still]
    if still and acting:
        usual = at.copy()
        usual[acting] = np.clip(neutral + size, low, high)[acting]
        move(usual, still)
    does = [k for k in own if np.linalg.norm(found[:, k]) > sqrt(ROUNDING)]
    return [candidate.parameters[k].name for k in does], found[:, does]


def together(every: Iterable[Responses], hull_spread: Floats | None = None) -> Responses:
    """Return the responses in several logs that share one hull: the sum of their cross-products.

    A condition counts as the same in all logs.

    Parameters
    ----------
    every
        One or more.
    hull_spread
        Of the prior of the hull that they share, shape (26,); the widest of theirs where None.
    """
    parts = list(every)
    spread = np.max([one.hull_spread for one in parts], axis=0) if hull_spread is None else hull_spread
    h = len(spread)
    names = list(dict.fromkeys(name for one in parts for name in one.parameters))
    # Columns of an effect stand together.
    keys = list(dict.fromkeys(key for key, _ in names))
    names.sort(key=lambda name: keys.index(name[0]))
    total = np.zeros((h + len(names), h + len(names)))
    for one in parts:
        places = [*range(h), *(h + names.index(name) for name in one.parameters)]
        total[np.ix_(places, places)] += one.with_hull_spread(spread).products
    titles = {key: title for one in parts for key, title in one.titles.items()}
    errors = {key: error for one in parts for key, error in one.errors.items()}
    return Responses(titles, errors, tuple(names), spread, total)


def likeness(found: Responses) -> Likeness:
    """Return how alike effects look, and how visible each is, once the hull is projected out with its prior."""
    h = len(found.hull_spread)
    across = found.products[:h, h:]
    left = found.products[h:, h:] - across.T @ np.linalg.solve(found.products[:h, :h] + np.eye(h), across)
    keys = list(found.titles)
    own = [[k for k, (key, _) in enumerate(found.parameters) if key == one] for one in keys]
    whole = [float(np.trace(found.products[h:, h:][np.ix_(places, places)])) for places in own]
    rest = [max(float(np.trace(left[np.ix_(places, places)])), 0.0) for places in own]
    there = [k for k in range(len(keys)) if rest[k] > ROUNDING * whole[k]]
    effects = [
        EffectVisibility(*keys[k], found.titles[keys[k]], sqrt(rest[k]), 1.0 - rest[k] / whole[k]) for k in there
    ]
    bases = [_visible_directions(left[np.ix_(own[k], own[k])]) for k in there]
    matrix = np.eye(len(there))
    for i, a in enumerate(there):
        for j, b in enumerate(there[:i]):
            matrix[i, j] = matrix[j, i] = cosine(bases[i].T @ left[np.ix_(own[a], own[b])] @ bases[j])
    order = _order(matrix)
    effects, matrix = [effects[k] for k in order], matrix[np.ix_(order, order)]
    pairs = [
        Pair(one.key, other.key, float(matrix[i, j]), _resolved_from(found, one, other, float(matrix[i, j])))
        for i, one in enumerate(effects)
        for j, other in enumerate(effects)
        if i < j
    ]
    pairs.sort(key=lambda pair: -pair.likeness)
    return Likeness(tuple(effects), matrix, tuple(pairs))


def cosine(across: Floats) -> float:
    """Return the cosine of the smallest angle between two spaces, from the products of their orthonormal bases."""
    return min(float(np.linalg.norm(across, 2)), 1.0)


def _visible_directions(products: Floats) -> Floats:
    """Return an orthonormal basis of an effect's response, in its parameters, shape (q, k).

    Directions that are not visible at usual size would make any two effects alike, and nobody asks for them: they are left out,
    but for the most visible one.
    """
    values, vectors = np.linalg.eigh(products)
    seen = values >= max(INFERENCE.visible_response**2, ROUNDING * values[-1])
    seen[-1] = True
    return np.asarray(vectors[:, seen] / np.sqrt(values[seen]))


def _resolved_from(found: Responses, one: EffectVisibility, other: EffectVisibility, alike: float) -> float | None:
    apart = sqrt(max(1.0 - alike**2, 0.0))
    if apart <= max(found.errors[one.key], found.errors[other.key]):
        return None
    return sqrt(2.0 * INFERENCE.resolved_evidence) / (apart * min(one.signal_to_noise, other.signal_to_noise))


def _order(matrix: Floats) -> list[int]:
    """Return the places of effects so that alike ones stand beside each other: average linkage, leaves in optimal order."""
    if len(matrix) < 3:
        return list(range(len(matrix)))
    distance = np.sqrt(np.clip(1.0 - matrix**2, 0.0, 1.0))
    np.fill_diagonal(distance, 0.0)
    return [int(k) for k in leaves_list(linkage(squareform(distance, checks=False), "average", optimal_ordering=True))]
