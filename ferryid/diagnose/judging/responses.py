"""What effects do to the prediction errors of a log before anything but hull and noise is fitted: their responses.

An effect's response is the change of the whitened prediction errors when its parameters go to their usual size, one by one. The
cross-products of all responses and of the hull's slopes hold all that angles between them need, and those of several logs are
their sum.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, Fit, fitted_force_model
from ferryid.diagnose.inference.search import list_candidates
from ferryid.effects.effect import HELD
from ferryid.effects.force_model import ForceModel
from ferryid.effects.wording import titled
from ferryid.types import Floats
from ferryid.vessel.circumstances import ANYWHERE, Circumstances

Key = tuple[str, str | None]
HULL = "hull_parameters"
"""The hull's coefficients are what is projected out, so that an effect of nothing else has no response of its own."""
ROUNDING = 1e-9
"""Share of the greatest squared response below which a response is none."""


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
    circumstances
        Where the logs were recorded, and what drives the vessel.
    """

    titles: Mapping[Key, str]
    errors: Mapping[Key, float]
    parameters: tuple[tuple[Key, str], ...]
    hull_spread: Floats
    products: Floats
    circumstances: Circumstances = ANYWHERE

    def with_hull_spread(self, spread: Floats) -> Responses:
        """Return the same with another prior of the hull; a coefficient that could not move before still cannot."""
        scale = np.divide(spread, self.hull_spread, out=np.zeros_like(spread), where=self.hull_spread > 0.0)
        every = np.concatenate([scale, np.ones(len(self.parameters))])
        return replace(self, hull_spread=spread, products=self.products * np.outer(every, every))


def candidates_of(problem: EstimationProblem) -> list[Candidate]:
    """Return the effects that have a response, of those that a log can show."""
    return [one for one in list_candidates(problem.plain.measurements)[0] if has_response(one)]


def has_response(candidate: Candidate) -> bool:
    """Tell whether an effect has a response of its own before anything is fitted.

    Of what comes and goes by chance a force model holds no force: it is a state of the filter. What only passes has one, but
    when it acts is not known beforehand, and at another time it looks like another effect.
    """
    effect = candidate.effect
    return effect.unsteady is None and not effect.passing and effect.id != HULL


def responses(problem: EstimationProblem, base: Fit, candidates: Sequence[Candidate] | None = None) -> Responses:
    """Return what hull and effects do to the prediction errors of a log, beside a hull that was fitted without effects.

    Parameters
    ----------
    problem, base
        The log, and its fit without any effect: in a hull that nobody modelled, a current would do nothing.
    candidates
        The effects; those of `candidates_of` where None.
    """
    found, every = response_columns(problem, base, candidates)
    return replace(found, products=every.T @ every)


def response_columns(
    problem: EstimationProblem, base: Fit, candidates: Sequence[Candidate] | None = None
) -> tuple[Responses, Floats]:
    """Return the same without its products, and the responses themselves, shape (w, 26 + q): those of any rows add up.

    Rows are the steps of the filter, each with its channels one after the other.
    """
    force_model = fitted_force_model(problem.plain, base)
    columns, parameters = [problem.hull_slopes(force_model)], list[tuple[Key, str]]()
    titles, errors = dict[Key, str](), dict[Key, float]()
    for candidate in candidates_of(problem) if candidates is None else candidates:
        names, response = _response(problem, force_model, candidate)
        if not names:
            continue
        columns.append(response)
        parameters += [(candidate.key, name) for name in names]
        titles[candidate.key] = titled(candidate.effect.title, candidate.instance)
        errors[candidate.key] = candidate.effect.formula_error
    where = Circumstances.of(problem.plain.measurements.profile)
    found = Responses(titles, errors, tuple(parameters), problem.hull_spread, np.zeros((0, 0)), where)
    return found, np.column_stack(columns)


def _response(problem: EstimationProblem, force_model: ForceModel, candidate: Candidate) -> tuple[list[str], Floats]:
    """Return the parameters that do anything, and the change that each makes at its usual size, shape (w, q).

    Each goes from its neutral value to both sides as far as it may; one that means nothing there, such as the place of a
    spring without stiffness, moves where the others have their usual size.
    """
    size, low, high, neutral = (
        np.array([getattr(one, name) for one in candidate.parameters]) for name in ("size", "low", "high", "neutral")
    )
    at = neutral.copy()
    # What can only be smaller than neutral, such as a share that is left, is smaller.
    usual = np.clip(np.where(high > neutral, neutral + size, neutral - size), low, high)
    idle = candidate.effect.unreported(problem.plain.measurements, usual)
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
                gaps.append(problem.steps.gap(candidate.act(force_model, moved)))
        change = np.stack(gaps[1::2], axis=2) - np.stack(gaps[::2], axis=2)
        found[:, places] = problem.whitening_filter.white(change) * (size[places] / ends)

    if not own:
        return [], found[:, :0]
    move(at, own)
    norms = np.linalg.norm(found[:, own], axis=0)
    still = [k for k, norm in zip(own, norms, strict=True) if norm <= sqrt(ROUNDING) * max(float(norms.max()), 1.0)]
    acting = [k for k in own if k not in still]
    if still and acting:
        there = at.copy()
        there[acting] = usual[acting]
        move(there, still)
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
    return Responses(titles, errors, tuple(names), spread, total, parts[0].circumstances)
