"""An empirical law for a force that no known effect accounts for: sparse regression in the weak form.

Terms are selected one after the other. Each is judged on held-out blocks, beside the hull and the effects that were found,
which are refitted with it (linearised about the fit), and against placebos: the same errors with signs drawn anew for every
block, and late by parts of the log. What the best of all terms gains on a placebo is what the choice among so many gives by
chance.

References
----------
Brunton, Proctor and Kutz (2016); Messenger and Bortz (2021), Weak SINDy. Here selection is by prediction, not by a threshold.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ferryid.diagnose.inference.autoregression import ORDER, AutoregressiveNoise, fit_autoregression
from ferryid.diagnose.inference.candidate_terms import Term, terms_of
from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, Fit, fit, fitted_force_model
from ferryid.diagnose.inference.folds import Folds
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.judging.held_out import Improvement, compare_held_out, held_out
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.effects.effect import Effect, Parameter
from ferryid.effects.force_model import ForceModel
from ferryid.types import Flags, Floats, Ints


@dataclass(frozen=True)
class Law:
    """A law beside hull and effects.

    Attributes
    ----------
    terms
        In the order of their selection.
    fit
        Hull, effects, and the law as the last candidate; its values are the terms' coefficients.
    problem
        With the noise that the fit leaves.
    held_out
        What the law improves on held-out windows.
    gain, chance
        What its first term gained in log-likelihood, and what the best of all terms gains on placebos.
    values, errors
        Coefficients and their standard deviations as they are told.
    """

    terms: tuple[Term, ...]
    fit: Fit
    problem: EstimationProblem
    held_out: Improvement
    gain: float
    chance: float
    values: Floats
    errors: Floats


@dataclass(frozen=True)
class LinearTerms:
    """The gaps and their derivatives about a fit.

    Attributes
    ----------
    gaps
        Shape (J, c).
    known, centre
        Derivatives by hull and effects in sizes, shape (J, c, p), and where these are now, in sizes from what is believed (p,).
    terms
        Derivatives by the terms' coefficients, each of unit root mean square, shape (J, c, k).
    sizes
        Their root mean squares before they were made so, shape (k,).
    """

    gaps: Floats
    known: Floats
    centre: Floats
    terms: Floats
    sizes: Floats


def select_law(problem: EstimationProblem, kept: Fit, folds: Folds, unlike: Floats | None = None) -> Law | None:
    """Return a law for what a fit leaves; None where none holds.

    Parameters
    ----------
    problem
        With the noise that the fit leaves.
    kept
        The fit: hull and effects.
    folds
        Of the trial's windows.
    unlike
        What an effect moves the gaps by, shape (J, c): no term that says the same, nor the share of any actuator's force, which
        has a name and is weighed as a rival: beside masses and damping that may be off, one thruster that is weaker is another
        that is stronger. Any will do where None.
    """
    # Of the level of a step anything may be true, as of the hull.
    levels = {(f"force of {one.instance}", "1") for one in kept.candidates if one.is_step}
    terms = [one for one in terms_of(problem.plain.measurements) if one.key not in levels]
    if unlike is not None:
        unnamed = [one for one in terms if one.key[1] != "1" or not one.key[0].startswith("force of ")]
        terms = _unlike(problem, kept, unnamed, unlike)
    chosen: list[Term] = []
    made, refitted = kept, problem
    gains: list[tuple[float, float]] = []
    while len(chosen) < JUDGING.law_terms:
        lines = linearise_terms(refitted, made, terms)
        best, real, chance = _best(refitted, refitted.noise, lines, folds)
        if real < JUDGING.law_gain or real <= chance:
            best, real, chance = _best(refitted, _noise_of_the_rest(refitted, lines), lines, folds, plain=True)
            if real < JUDGING.unwhitened_law_gain or real <= chance:
                break
        gains.append((real, chance))
        chosen.append(terms.pop(best))
        made = _fitted(refitted, kept, chosen)
        refitted = refitted.with_noise_of(made)
    if not chosen:
        return None
    made = _fitted(refitted, kept, chosen)
    errors = made.errors(len(kept.candidates))
    sure = [abs(value) > JUDGING.law_errors * error for value, error in zip(made.values[-1], errors, strict=True)]
    if not any(sure):
        return None
    if not all(sure):
        chosen = [term for term, one in zip(chosen, sure, strict=True) if one]
        made = _fitted(refitted, kept, chosen)
    if _void(refitted, made):
        return None
    before = held_out(refitted, folds, kept.candidates, kept.values)
    after = held_out(refitted, folds, made.candidates, made.values)
    better = compare_held_out(refitted, folds, before, after)
    if better.score_low <= 0.0:
        return None
    return Law(
        tuple(chosen),
        made,
        refitted,
        better,
        *gains[0],
        made.values[-1],
        INFERENCE.posterior_factor * made.errors(len(kept.candidates)),
    )


def _unlike(problem: EstimationProblem, kept: Fit, terms: Sequence[Term], moved: Floats) -> list[Term]:
    pushes = linearise_terms(problem, kept, terms).terms
    size = np.sqrt(np.sum(moved**2) * np.sum(pushes**2, axis=(0, 1)))
    alike = np.abs(np.einsum("jc,jck->k", moved, pushes)) / np.maximum(size, 1e-12)
    return [term for term, one in zip(terms, alike.tolist(), strict=True) if one < JUDGING.law_likeness]


def law_candidate(problem: EstimationProblem, kept: Fit, terms: Sequence[Term]) -> Candidate:
    """Return a law as something that hypotheses can hold: one parameter a term.

    A coefficient's usual size gives a force as large as the thrusters' is in the root mean square, on the axis of the term.
    """
    force_model = fitted_force_model(problem.plain, kept)
    thrust = np.sqrt(np.mean(force_model.parts.sum(axis=1) ** 2, axis=0))
    parameters = []
    for term in terms:
        size = np.sqrt(np.mean(term.force(force_model) ** 2, axis=0))
        axis = int(np.argmax(size / np.maximum(thrust, 1e-9)))
        usual = float(max(thrust[axis], 1e-9) / max(size[axis], 1e-9))
        parameters.append(
            Parameter(term.name, term.coefficient_unit, usual, -JUDGING.law_limit * usual, JUDGING.law_limit * usual)
        )
    made = tuple(parameters)

    def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
        external = force_model.external.copy()
        for coefficient, term in zip(p.tolist(), terms, strict=True):
            external += coefficient * term.force(force_model)
        return replace(force_model, external=external)

    effect = Effect(
        "unknown",
        "Something unknown",
        lambda profile: made,
        apply,
        lambda values, instance: "",
        lambda values, instance: {},
    )
    return Candidate(effect, None, made)


def _fitted(problem: EstimationProblem, kept: Fit, terms: Sequence[Term]) -> Fit:
    law = law_candidate(problem, kept, terms)
    return fit(problem, [*kept.candidates, law], [*kept.values, np.zeros(len(terms))])


def _void(problem: EstimationProblem, made: Fit) -> bool:
    """Tell whether the law moves the vessel too little to matter to anybody."""
    windows = problem.windows
    without = replace(made, candidates=made.candidates[:-1], values=made.values[:-1])
    moved = windows.gap(fitted_force_model(problem.plain, made)) - windows.gap(
        fitted_force_model(problem.plain, without)
    )
    size = np.sqrt(np.mean(windows.measured[:, windows.channels] ** 2, axis=0))
    return bool((np.sqrt(np.mean(moved**2, axis=0)) < INFERENCE.void_share * size).all())


def _best(
    problem: EstimationProblem, noise: AutoregressiveNoise, lines: LinearTerms, folds: Folds, *, plain: bool = False
) -> tuple[int, float, float]:
    """Return which term gains most beside a fit, how much, and how much the best gains on placebos.

    Placebos made of a force that stands plainly above the noise are forces as well, and shifted a constant one is itself: there
    half of those with other signs are beaten, and no others are held against it.
    """
    runs = problem.windows.runs
    left, known, columns = (noise.white(one, runs) for one in (lines.gaps, lines.known, lines.terms))
    rows = np.concatenate([np.arange(a + ORDER, b) for a, b in runs if b - a > ORDER])
    c = lines.gaps.shape[1]
    parts = []
    for k, training in enumerate(folds.training):
        inside = np.isin(problem.windows.starts, training.starts)
        # A whitened window needs the ones before it.
        whole = np.all([inside[rows - lag] for lag in range(ORDER + 1)], axis=0)
        parts.append((np.repeat(whole, c), np.repeat(folds.fold[rows] == k, c)))
    tried = _placebos(left.reshape(-1, c), folds.block[rows], np.random.default_rng(0))
    gained = _gains(tried, known, lines.centre, columns, parts)
    best = int(np.argmax(gained[:, 0]))
    most = gained.max(axis=0)
    flipped, late = np.split(most[1:], [JUDGING.law_sign_placebos])
    chance = (
        float(np.median(flipped)) if plain else float(max(np.quantile(flipped, JUDGING.law_beats), np.median(late)))
    )
    return best, float(most[0]), chance


def linearise_terms(problem: EstimationProblem, made: Fit, terms: Sequence[Term]) -> LinearTerms:
    """Return a fit's gaps and what they change by with hull, effects and the coefficients of terms."""
    windows = problem.windows
    force_model = fitted_force_model(problem.plain, made)
    base = windows.gap(force_model)
    known, centre = nuisance_columns(problem, made)
    pushes = np.stack(
        [
            windows.gap(replace(force_model, external=force_model.external + term.force(force_model))) - base
            for term in terms
        ],
        axis=-1,
    )
    sizes = np.maximum(np.sqrt(np.mean(pushes**2, axis=(0, 1))), 1e-12)
    return LinearTerms(base, known, centre, pushes / sizes, sizes)


def nuisance_columns(problem: EstimationProblem, made: Fit, *, but: int = -1) -> tuple[Floats, Floats]:
    """Return a fit's `LinearTerms.known` and `LinearTerms.centre`, without the parameters of the candidate number `but`."""
    windows = problem.windows
    base = windows.gap(fitted_force_model(problem.plain, made))
    known, centre = [], []
    for k, spread in enumerate(problem.hull_spread):
        hull = made.hull.copy()
        hull[k] += 0.1 * spread
        known.append((windows.gap(fitted_force_model(problem.plain, replace(made, hull=hull))) - base) / 0.1)
        centre.append((made.hull[k] - problem.plain.hull[k]) / spread if spread > 0.0 else 0.0)
    for i, candidate in enumerate(made.candidates):
        for j, parameter in enumerate(candidate.parameters if i != but else ()):
            step = -0.01 if made.values[i][j] + 0.01 * parameter.size > parameter.high else 0.01
            values = [one.copy() for one in made.values]
            values[i][j] += step * parameter.size
            known.append(
                (windows.gap(fitted_force_model(problem.plain, replace(made, values=tuple(values)))) - base) / step
            )
            centre.append((float(made.values[i][j]) - parameter.neutral) / parameter.size)
    return np.stack(known, axis=-1), np.array(centre)


def _noise_of_the_rest(problem: EstimationProblem, lines: LinearTerms) -> AutoregressiveNoise:
    """Return the noise that all terms together leave.

    A force that is there most of the time is in the errors' autoregression as well, which then takes it for noise. What
    remains with so many terms is a little less than the noise, for placebos as well.
    """
    runs = problem.windows.runs
    every = np.concatenate([lines.known, lines.terms], axis=-1)
    prior = np.diag(np.concatenate([np.ones(len(lines.centre)), np.full(lines.terms.shape[-1], 1e-3)]))
    target = np.concatenate([lines.centre, np.zeros(lines.terms.shape[-1])])
    noise = problem.noise
    for _ in range(2):
        A = np.vstack([noise.white(every, runs), prior])
        y = np.concatenate([noise.white(lines.gaps, runs), target])
        noise = fit_autoregression(lines.gaps - every @ np.linalg.lstsq(A, y, rcond=None)[0], runs)
    return noise


def _placebos(left: Floats, block: Ints, rng: np.random.Generator) -> Floats:
    """Return what is left; with signs drawn anew for every block; and late by parts of the log: shape (w, 1 + placebos).

    Shifts cannot tell what is the same at all times or comes round again; signs can.
    """
    made = [left]
    for _ in range(JUDGING.law_sign_placebos):
        made.append(left * rng.choice([-1.0, 1.0], int(block.max()) + 1)[block][:, None])
    made += [
        np.roll(left, round(share * len(left)), axis=0) for share in np.linspace(0.1, 0.9, JUDGING.law_shift_placebos)
    ]
    return np.stack([one.reshape(-1) for one in made], axis=-1)


def _gains(
    left: Floats, known: Floats, centre: Floats, columns: Floats, parts: Sequence[tuple[Flags, Flags]]
) -> Floats:
    """Return what each column gains in log-likelihood beside hull and effects, for every placebo: shape (k, placebos).

    The lesser of two gains: that of held-out windows, by coefficients that were fitted to the others, and that of all windows
    by coefficients that were fitted to them. The second keeps from chance what the others hardly excite, where a coefficient
    may be anything and by chance be right.
    """
    # Hull and effects are believed to lie about their usual values, the new term may have any.
    prior = np.eye(len(centre))
    target = np.zeros((len(centre), left.shape[1]))
    target[:, 0] = centre

    def beside(rows: Flags) -> tuple[Floats, Floats, Floats, Floats]:
        A = np.vstack([known[rows], prior])
        Y = np.vstack([left[rows], target])
        F = np.vstack([columns[rows], np.zeros((len(centre), columns.shape[1]))])
        of_left, of_columns = (np.linalg.lstsq(A, B, rcond=None)[0] for B in (Y, F))
        F_rest, Y_rest = F - A @ of_columns, Y - A @ of_left
        power = np.sum(F_rest**2, axis=0)
        # A column that the others explain altogether has nothing to add.
        own = power > 1e-6 * np.sum(F**2, axis=0)
        together = F_rest.T @ Y_rest
        coefficient = np.where(own[:, None], together / np.where(own, power, 1.0)[:, None], 0.0)
        return of_left, of_columns, coefficient, 0.5 * coefficient * together

    inside = beside(np.ones(len(left), dtype=bool))[3]
    gained = np.zeros((columns.shape[1], left.shape[1]))
    for train, held in parts:
        of_left, of_columns, coefficient, _ = beside(train)
        f, y = columns[held] - known[held] @ of_columns, left[held] - known[held] @ of_left
        gained += coefficient * (f.T @ y) - 0.5 * coefficient**2 * np.sum(f**2, axis=0)[:, None]
    return np.minimum(gained, inside)
