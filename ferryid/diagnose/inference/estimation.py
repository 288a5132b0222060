"""One hypothesis: some effects at once, their parameters and the hull's fitted together, and the evidence for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf, log

import numpy as np

from ferryid.cached import cached_property
from ferryid.diagnose.inference.autoregression import AutoregressiveNoise, fit_autoregression
from ferryid.diagnose.inference.candidate import Candidate as Candidate
from ferryid.diagnose.inference.candidate import acting_order
from ferryid.diagnose.inference.candidate import apply_candidates as apply_candidates
from ferryid.diagnose.inference.folds import Folds, folds_of
from ferryid.diagnose.inference.newton_step import newton_step
from ferryid.diagnose.inference.noise_estimation import SEARCHED_STEPS, excerpt, fit_noise
from ferryid.diagnose.inference.noise_model import NoiseModel, WhiteningFilter, make_whitening_filter
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.inference.weak_form import Windows
from ferryid.effects import effects
from ferryid.effects.effect import HELD
from ferryid.effects.force_model import ForceModel, moved_coefficient
from ferryid.types import Floats, Ints

MAX_ITERATIONS = 24
HULL_SLOPE_ITERATIONS = 4
"""Iterations after which the derivatives by the hull's coefficients are computed again."""
CONVERGED_GAIN = 1e-2
"""Gain in cost of an iteration, promised or made, below which the fit has converged."""
HULL_DIFFERENCE = 0.1
"""Finite difference of a coefficient of the hull, in its spread."""
DAMPINGS = (0.0, 0.3, 3.0, 30.0, 300.0)
PARAMETER_DIFFERENCE = 1e-2
"""Finite difference of an effect's parameter, in its size."""
LONGEST_STEP = 4.0
"""Longest Gauss-Newton step, in sizes of a parameter."""


@dataclass(frozen=True)
class Fit:
    """A fitted hypothesis.

    Attributes
    ----------
    candidates
        What it holds responsible.
    values
        Parameters of each candidate, in its own units.
    spread
        Covariance of all of them together, in their own units, in the same order, shape (q, q).
    hull
        The hull's coefficients, shape (26,).
    evidence
        Logarithm of the evidence (Laplace) over that of a hypothesis whose parameters are all zero wide, less that of how many
        windows each onset and offset was chosen from.
    """

    candidates: tuple[Candidate, ...]
    values: tuple[Floats, ...]
    spread: Floats
    hull: Floats
    evidence: float

    @property
    def keys(self) -> frozenset[tuple[str, str | None]]:
        """Effects and instances."""
        return frozenset(candidate.key for candidate in self.candidates)

    def errors(self, index: int) -> Floats:
        """Return the posterior's standard deviations of one candidate's parameters."""
        return np.sqrt(np.diag(self.covariance(index)))

    def covariance(self, index: int) -> Floats:
        """Return the posterior's covariance of one candidate's parameters."""
        first = sum(len(values) for values in self.values[:index])
        own = slice(first, first + len(self.values[index]))
        return self.spread[own, own]

    def reported_errors(self, index: int) -> Floats:
        """Return the standard deviations to report: with `INFERENCE.posterior_factor`, and what no log determines.

        That is the error of its formula (``formula_error``), and what hull or instruments may be off anyway (``negligible``,
        about a 95 % interval). A
        place has no size.
        """
        candidate, values = self.candidates[index], self.values[index]
        sized = np.array([one.unit == candidate.parameters[0].unit for one in candidate.parameters])
        away = values - np.array([one.neutral for one in candidate.parameters])
        beyond = np.where(
            sized, np.hypot(candidate.effect.formula_error * away, 0.5 * candidate.effect.negligible), 0.0
        )
        return np.hypot(INFERENCE.posterior_factor * self.errors(index), beyond)


@dataclass(frozen=True)
class EstimationProblem:
    """All that hypotheses about one log share.

    Attributes
    ----------
    windows
        For judging and showing what is left over.
    plain
        The force model without effects.
    noise
        Of the windows.
    hull_spread
        Standard deviations of what is believed of the hull's coefficients, shape (26,).
    filter
        Of the steps, in which hypotheses are fitted.
    """

    windows: Windows
    plain: ForceModel
    noise: AutoregressiveNoise
    hull_spread: Floats
    filter: NoiseModel

    @cached_property
    def steps(self) -> Windows:
        """The steps of the filter, over the same rows as the windows."""
        return self.windows.steps

    @cached_property
    def excerpt(self) -> Windows:
        """Those of the steps from which noise is learnt."""
        return excerpt(self.steps)

    @cached_property
    def whitening_filter(self) -> WhiteningFilter:
        """The filter, ready for the steps."""
        return make_whitening_filter(self.filter, self.steps)

    @cached_property
    def origin(self) -> StartingPoint:
        """The plain force model's hull."""
        return StartingPoint(self.plain.hull, self.by_hull)

    @cached_property
    def by_hull(self) -> Floats:
        """`hull_slopes` of the plain force model."""
        return self.hull_slopes(self.plain)

    @cached_property
    def window_slopes(self) -> Floats:
        """Derivatives of the windows' whitened errors by the hull's coefficients, in their spreads, shape (w, 26)."""
        free = np.flatnonzero(self.hull_spread)
        moves = HULL_DIFFERENCE * self.hull_spread[free]
        changes = np.zeros((*self.windows.measured_channels.shape, len(self.hull_spread)))
        if free.size:
            changes[:, :, free] = self.windows.hull_changes(self.plain, free, moves) / HULL_DIFFERENCE
        return self.noise.white(changes, self.windows.runs)

    def hull_slopes(self, force_model: ForceModel, hull: Floats | None = None) -> Floats:
        """Return derivatives of the prediction errors by the hull's coefficients, in their spreads, shape (w, 26).

        By those of the hull, shape (26,), on which the effects of the force model act; its own where None. Coefficients that
        cannot move have none.
        """
        free = np.flatnonzero(self.hull_spread)
        every = np.zeros((self.steps.measured_channels.size, len(self.hull_spread)))
        every[:, free] = self.slopes_of(force_model, force_model.hull if hull is None else hull, free)
        return every

    def slopes_of(self, force_model: ForceModel, hull: Floats, places: Ints) -> Floats:
        """Return `hull_slopes` by some of the coefficients that can move, shape (w, k)."""
        if not places.size:
            return np.empty((self.steps.measured_channels.size, 0))
        # Effects multiply coefficients: what one moves by is multiplied too.
        there, here = force_model.hull[places], hull[places]
        factor = np.where(here != 0.0, there / np.where(here != 0.0, here, 1.0), 1.0)
        changes = self.steps.hull_changes(force_model, places, HULL_DIFFERENCE * factor * self.hull_spread[places])
        changes /= HULL_DIFFERENCE
        # Column by column, as those of a starting point lie: products of the two are rounded alike.
        return np.asfortranarray(self.whitening_filter.white(changes))

    def changes(self, force_model: ForceModel, others: Sequence[ForceModel], white: Floats) -> Floats:
        """Return by how much the whitened prediction errors of others differ from those of a force model, shape (w, k).

        `white` are the latter's, shape (w,). Those that differ in one coefficient of the hull alone are worked out together.
        """
        made = np.empty((len(white), len(others)))
        places = [moved_coefficient(force_model, one) for one in others]
        of_hull = [k for k, place in enumerate(places) if place is not None]
        rest = [k for k, place in enumerate(places) if place is None]
        if of_hull:
            at = np.array([places[k] for k in of_hull])
            moves = np.array([others[k].hull[i] for k, i in zip(of_hull, at, strict=True)]) - force_model.hull[at]
            made[:, of_hull] = self.whitening_filter.white(self.steps.hull_changes(force_model, at, moves))
        if rest:
            gaps = np.stack([self.steps.gap(others[k]) for k in rest], axis=2)
            made[:, rest] = self.whitening_filter.white(gaps) - white[:, None]
        return made

    def white(self, force_model: ForceModel) -> Floats:
        """Return the whitened prediction errors of a force model, flat."""
        return self.whitening_filter.white(self.steps.gap(force_model))

    def with_noise_of(self, made: Fit) -> EstimationProblem:
        """Return the trial with the noise that a fit leaves; a filter that has shared disturbances stays as it is."""
        force_model = fitted_force_model(self.plain, made)
        own = (
            self.filter
            if self.filter.processes
            else fit_noise(self.excerpt, self.excerpt.gap(force_model), self.filter)
        )
        return replace(self, noise=fit_autoregression(self.windows.gap(force_model), self.windows.runs), filter=own)

    def part(self, windows: Windows) -> EstimationProblem:
        """Return the trial of some of its windows, with the same noise; the same one for the same windows."""
        # A part holds its windows, so that no others come to have their id.
        return self._parts.setdefault(id(windows), replace(self, windows=windows))

    @cached_property
    def folds(self) -> Folds | None:
        """`ferryid.diagnose.inference.folds.folds_of` the windows."""
        return folds_of(self.windows)

    @cached_property
    def _parts(self) -> dict[int, EstimationProblem]:
        return {}

    @cached_property
    def bare_fits(self) -> dict[tuple[int, int], tuple[Fit, Fit]]:
        """What `without` made already: by the id of a fit and the place of a candidate, that fit and the one without it."""
        return {}


@dataclass(frozen=True)
class StartingPoint:
    """A hull to begin with, shape (26,), and the prediction errors' derivatives by it (`EstimationProblem.hull_slopes`)."""

    hull: Floats
    by_hull: Floats

    @cached_property
    def by_free_hull(self) -> tuple[Ints, Floats, Floats]:
        """Which coefficients can move, the derivatives by these, shape (w, k), and their cross-products, shape (k, k).

        Many fits begin at one point.
        """
        free = np.flatnonzero(self.by_hull.any(axis=0))
        slopes = self.by_hull[:, free]
        return free, slopes, slopes.T @ slopes

    def moved_to(self, hull: Floats) -> StartingPoint:
        """Return it with another hull, shape (26,), for fits that are so near that the derivatives hold there too."""
        moved = replace(self, hull=hull)
        moved.__dict__["by_free_hull"] = self.by_free_hull
        return moved


def starting_point(problem: EstimationProblem, made: Fit) -> StartingPoint:
    """Return where to begin a fit that is not far from another."""
    return StartingPoint(made.hull, problem.hull_slopes(fitted_force_model(problem.plain, made), made.hull))


def fit(
    problem: EstimationProblem,
    candidates: Sequence[Candidate],
    start: Sequence[Floats] | None = None,
    *,
    steps: int = MAX_ITERATIONS,
    begin: StartingPoint | None = None,
    least: float = -inf,
    from_afar: bool = False,
) -> Fit:
    """Fit a hypothesis by Gauss-Newton steps on the posterior.

    Every parameter is believed to be about its neutral value, give or take its size, and the hull's coefficients to be
    about the profile's; the scale of the forces is that of the thrust curves, which nothing here may change freely.

    Parameters
    ----------
    problem
        From `estimation_problem`.
    candidates
        Effects, in the order in which they act.
    start
        Parameters to begin with; the candidates' own where None.
    steps
        Most Gauss-Newton steps; with 0 the spread is that at the start.
    begin
        The hull to begin with; the profile's where None.
    least
        Evidence below which nobody asks: a fit that would stay below it, however far off its linearisation may be
        (`INFERENCE.linearisation_factor`), ends where it is.
    from_afar
        True where the slope at the start leads a part of the way only: the first steps are made in any case.
    """
    every = [parameter for candidate in candidates for parameter in candidate.parameters]
    size = np.array([parameter.size for parameter in every])
    neutral = np.array([parameter.neutral for parameter in every])
    low = (np.array([parameter.low for parameter in every]) - neutral) / size
    high = (np.array([parameter.high for parameter in every]) - neutral) / size
    ends = np.cumsum([0, *(len(candidate.parameters) for candidate in candidates)]).tolist()
    own = [slice(first, end) for first, end in pairwise(ends)]
    q, h = len(every), len(problem.hull_spread)
    # Where an effect changes masses or damping itself, what the hull's coefficients do depends on it.
    bends = any(candidate.effect.changes_hull for candidate in candidates)

    order = acting_order(candidates)

    def chain_of(z: Floats) -> list[ForceModel]:
        """Return the force model of the hull alone, and with each further candidate in the order in which they act."""
        chain, values = (
            [replace(problem.plain, hull=problem.plain.hull + problem.hull_spread * z[:h])],
            neutral + size * z[h:],
        )
        for i in order:
            chain.append(candidates[i].act(chain[-1], values[own[i]]))
        return chain

    def moved_from(chain: Sequence[ForceModel], z: Floats, turn: int) -> ForceModel:
        """Return the force model with parameters elsewhere of the candidate that has a turn: what acts before is as it was."""
        values = neutral + size * z[h:]
        made = candidates[order[turn]].act(chain[turn], values[own[order[turn]]])
        for later in range(turn + 1, len(order)):
            i = order[later]
            made = candidates[i].act_again(made, values[own[i]], chain[later], chain[later + 1])
        return made

    def white(chain: Sequence[ForceModel]) -> Floats:
        return problem.white(chain[-1])

    choices = sum(
        candidate.log_alternatives + len(candidate.times) * log(len(problem.windows.starts)) for candidate in candidates
    )

    def evidence_of(cost: float, A: Floats) -> float:
        return -0.5 * (cost + float(np.linalg.slogdet(A)[1])) - problem.whitening_filter.log_scale - choices

    z = np.zeros(h + q)
    if every:
        z[h:] = (np.concatenate([one.start for one in candidates] if start is None else start) - neutral) / size
    if begin is not None:
        moves = problem.hull_spread > 0.0
        z[:h][moves] = (begin.hull - problem.plain.hull)[moves] / problem.hull_spread[moves]
    chain = chain_of(z)
    w = white(chain)
    cost = float(w @ w + z @ z)
    A = np.eye(h + q)
    # What can move: coefficients of the hull, and parameters.
    free = np.flatnonzero(size > HELD)
    # As how manyeth the candidate of every parameter acts.
    acts = [order.index(i) for i, candidate in enumerate(candidates) for _ in candidate.parameters]
    # The hull's derivatives cost most: they are taken anew only now and then, and before the fit ends.
    moving, by_hull, of_hull = (problem.origin if begin is None else begin).by_free_hull
    by_effects = np.empty((len(w), 0))
    both, fresh = np.concatenate([moving, h + free]), False
    square, many = np.ix_(both, both), len(moving)
    products = np.empty((len(both), len(both)))
    # Where the derivatives by hull and by effects were taken: after a step that led nowhere they are the same again.
    hull_taken, effects_taken = chain, list[ForceModel]()
    for count in range(max(steps, 1)):
        if hull_taken is not chain and (bends or count % HULL_SLOPE_ITERATIONS == 0):
            by_hull, hull_taken, fresh = problem.slopes_of(chain[-1], chain[0].hull, moving), chain, True
            of_hull = by_hull.T @ by_hull
        if free.size and effects_taken is not chain:
            effects_taken = chain
            d = np.where(z[h + free] + PARAMETER_DIFFERENCE <= high[free], PARAMETER_DIFFERENCE, -PARAMETER_DIFFERENCE)
            moved = np.repeat(z[None], len(free), axis=0)
            moved[np.arange(len(free)), h + free] += d
            there = [moved_from(chain, one, acts[k]) for k, one in zip(free.tolist(), moved, strict=True)]
            by_effects = problem.changes(chain[-1], there, w) / d
        across = by_hull.T @ by_effects
        products[:many, :many], products[:many, many:] = of_hull, across
        products[many:, :many], products[many:, many:] = across.T, by_effects.T @ by_effects
        A = np.eye(h + q)
        A[square] += products
        if count == steps:
            break
        lowest = np.concatenate([np.full(h, -np.inf), low - z[h:]])
        highest = np.concatenate([np.full(h, np.inf), high - z[h:]])
        slope, gained = z.copy(), 0.0
        slope[both] += np.concatenate([by_hull.T @ w, by_effects.T @ w])
        whole = newton_step(A, slope, lowest, highest)
        promised = -float(2.0 * slope @ whole + whole @ A @ whole)
        # The score test: what the linearisation promises, and a multiple of it as the most that there may be.
        known = least > -inf and (not from_afar or count >= SEARCHED_STEPS)
        if known and evidence_of(cost - promised * INFERENCE.linearisation_factor, A) < least:
            break
        for damping in DAMPINGS if promised >= CONVERGED_GAIN else ():
            # Levenberg's and Marquardt's way, where the whole step leads astray.
            step = whole
            if damping > 0.0:
                step = newton_step(A + damping * np.diag(np.diag(A)), slope, lowest, highest)
            step = step * min(1.0, LONGEST_STEP / max(float(np.abs(step).max()), 1e-12))
            new = z + step
            new[h:] = np.clip(new[h:], low, high)
            chain_new = chain_of(new)
            w_new = white(chain_new)
            new_cost = float(w_new @ w_new + new @ new)
            if new_cost < cost:
                gained = cost - new_cost
                z, w, cost, chain = new, w_new, new_cost, chain_new
                break
        if gained < CONVERGED_GAIN:
            if fresh or steps <= HULL_SLOPE_ITERATIONS:
                break
            by_hull, hull_taken, fresh = problem.slopes_of(chain[-1], chain[0].hull, moving), chain, True
            of_hull = by_hull.T @ by_hull
    covariance = np.asarray(np.linalg.inv(A)[h:, h:] * np.outer(size, size), dtype=np.float64)
    fitted = neutral + size * z[h:]
    hull = problem.plain.hull + problem.hull_spread * z[:h]
    return Fit(tuple(candidates), tuple(fitted[one] for one in own), covariance, hull, evidence_of(cost, A))


def effect_slopes(problem: EstimationProblem, kept: Fit) -> Floats:
    """Return derivatives of the prediction errors by the parameters of a fit's effects, in their sizes, shape (w, q)."""
    left = problem.white(fitted_force_model(problem.plain, kept))
    columns = []
    for i, candidate in enumerate(kept.candidates):
        for k, one in enumerate(candidate.parameters):
            d = (
                PARAMETER_DIFFERENCE
                if kept.values[i][k] + PARAMETER_DIFFERENCE * one.size <= one.high
                else -PARAMETER_DIFFERENCE
            )
            moved = kept.values[i].copy()
            moved[k] += d * one.size
            changed = (*kept.values[:i], moved, *kept.values[i + 1 :])
            columns.append((problem.white(fitted_force_model(problem.plain, replace(kept, values=changed))) - left) / d)
    return np.stack(columns, axis=1) if columns else np.empty((len(left), 0))


def rest_of(made: Fit, index: int) -> tuple[list[Candidate], list[Floats]]:
    """Return the candidates of a fit beside one of them, and their values; of a step, its level at other times is one."""
    candidates, values = list(made.candidates), list(made.values)
    one, value = candidates[index], values[index]
    if not one.is_step:
        del candidates[index], values[index]
        return candidates, values
    candidates[index] = replace(
        one, effect=effects()[one.effect.id], parameters=one.parameters[:1], onset_s=0.0, offset_s=inf
    )
    values[index] = value[1:]
    return candidates, values


def without(problem: EstimationProblem, made: Fit, index: int) -> Fit:
    """Return the fit of a hypothesis that lacks one of its candidates; in the place of a step it has one level all along.

    Of one that trades with the hull, such as a load, the posterior is a bent ridge: there the way from the profile's hull may
    end on a lower top than that from the hull beside which it was found.

    Selection and judging ask for the same ones again: what was fitted once is kept.
    """
    key = id(made), index % len(made.candidates)
    if key not in problem.bare_fits:
        problem.bare_fits[key] = made, _without(problem, made, index)
    return problem.bare_fits[key][1]


def _without(problem: EstimationProblem, made: Fit, index: int) -> Fit:
    candidates, values = rest_of(made, index)
    bare = fit(problem, candidates, values)
    if not any(one.effect.profiled for one in candidates):
        return bare
    near = fit(problem, candidates, values, begin=starting_point(problem, made))
    return max(bare, near, key=lambda one: one.evidence)


def choose_parameters(problem: EstimationProblem, beside: Fit, candidate: Candidate) -> Candidate:
    """Return a candidate with the parameters that its effect chooses beside a fit; the same one where there is no choice."""
    if candidate.effect.choose is None:
        return candidate
    prior_hull = fitted_force_model(problem.plain, replace(beside, hull=problem.plain.hull)).hull
    made = candidate.effect.choose(fitted_force_model(problem.plain, beside), prior_hull, problem.white)
    # Of one that is rare, and chosen from alternatives.
    rarity = candidate.effect.log_rarity(problem.plain.measurements.profile)
    return replace(candidate, parameters=made.parameters, log_alternatives=made.log_alternatives + rarity)


def fitted_force_model(plain: ForceModel, made: Fit) -> ForceModel:
    """Return the force model that a fit has of the log."""
    return apply_candidates(replace(plain, hull=made.hull), made.candidates, made.values)


def estimation_problem(windows: Windows, plain: ForceModel, hull_spread: Floats) -> EstimationProblem:
    """Return the trial with the noise that is left when the hull alone is refitted.

    What an effect leaves in the gaps is in that noise too, until a hypothesis that holds takes it out: see
    `ferryid.diagnose.inference.search`.
    """
    first = excerpt(windows.steps)
    problem = EstimationProblem(
        windows,
        plain,
        fit_autoregression(windows.gap(plain), windows.runs),
        hull_spread,
        fit_noise(first, first.gap(plain)),
    )
    for _ in range(2):
        problem = problem.with_noise_of(fit(problem, ()))
    return problem
