"""Which effects a log speaks for: selection by evidence, one after the other, with every rival kept."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import exp, inf

import numpy as np

from ferryid.diagnose.inference.common_cause import with_fewer_coefficients
from ferryid.diagnose.inference.estimation import (
    Candidate,
    EstimationProblem,
    Fit,
    StartingPoint,
    choose_parameters,
    fit,
    fitted_force_model,
    starting_point,
    without,
)
from ferryid.diagnose.inference.needed_correction import needed
from ferryid.diagnose.inference.onset_estimation import (
    COMPARING_ITERATIONS,
    FIRST_TIME_STEP_S,
    Linearisation,
    is_brief,
    likeliest_start,
    linearise,
    part_s,
    passes,
    promising_spans,
    refine_span,
    refit_spans,
    stands_out,
    turned,
)
from ferryid.diagnose.inference.stochastic_disturbance import DisturbanceState, fit_disturbances
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.effects import effects
from ferryid.effects.force_model import Measurements
from ferryid.side_by_side import over
from ferryid.types import Floats

COARSE_ITERATIONS = 8
"""Iterations of a fit that ranks candidates from the prior or by piecewise slopes, `COMPARING_ITERATIONS` from near by.

The best then converge."""


@dataclass(frozen=True)
class ScoredCandidate:
    """A candidate with its fit beside what is selected already, and its evidence over that."""

    candidate: Candidate
    fit: Fit
    gain: float


@dataclass(frozen=True)
class Round:
    """One round of selection: every candidate, the best first, and the probability of each."""

    ranked: tuple[ScoredCandidate, ...]
    probabilities: tuple[float, ...]
    none: float


@dataclass(frozen=True)
class Search:
    """What the log speaks for.

    Attributes
    ----------
    problem
        With the noise that the selected effects leave.
    base, fit
        Fits without and with the selected effects.
    rounds
        One per selected effect, and the last, in which none was good enough.
    untested
        Effect (and instance) to why it could not be tested.
    states
        Disturbances that came and went by chance.
    """

    problem: EstimationProblem
    base: Fit
    fit: Fit
    rounds: tuple[Round, ...]
    untested: dict[str, str]
    states: tuple[DisturbanceState, ...] = ()


def list_candidates(measurements: Measurements) -> tuple[list[Candidate], dict[str, str]]:
    """Return every effect that the measurements can show, and why it cannot show the others."""
    candidates, untested = [], {}
    for effect in effects().values():
        reason = effect.untestable(measurements)
        if reason:
            untested[effect.id] = reason
            continue
        profile = measurements.profile
        candidates += [Candidate.of(effect, instance, profile) for instance in effect.testable_instances(measurements)]
    return candidates, untested


def search(
    problem: EstimationProblem, progress: Callable[[str], None], *, known: Sequence[Candidate] | None = None
) -> Search:
    """Select effects as long as one is more likely than none, then drop those that the others have made idle.

    Parameters
    ----------
    problem
        From `ferryid.diagnose.inference.estimation.estimation_problem`.
    progress
        Called with the name of each stage.
    known
        The candidates; the whole library where None.
    """
    candidates, untested = list_candidates(problem.plain.measurements)
    if known is not None:
        candidates = list(known)
    steady = [candidate for candidate in candidates if candidate.effect.unsteady is None]
    disturbances = [candidate for candidate in candidates if candidate.effect.unsteady is not None]
    about = frozenset(candidate.effect.about for candidate in disturbances)
    undisturbed = problem.plain
    chosen, rounds = fit(problem, ()), list[Round]()
    states: tuple[DisturbanceState, ...] = ()
    keys_with_states: frozenset[tuple[str, str | None]] | None = None
    keys_without_states: frozenset[tuple[str, str | None]] | None = None
    while True:
        taken = {candidate.key for candidate in chosen.candidates}
        left = [candidate for candidate in steady if candidate.key not in taken]
        # What all actuators that are too weak by one factor do as well, in fewer parameters, is decided first. A log that does
        # not call for it, as where a moment of inertia is guessed too large, still shows the others.
        first = [candidate for candidate in left if needed(problem, candidate)]
        found, good = list[ScoredCandidate](), list[ScoredCandidate]()
        for some in filter(None, (first, [candidate for candidate in left if candidate not in first])):
            progress(f"weighing {len(some)} hypotheses beside {len(taken) or 'none'} found")
            found += _ranked_candidates(problem, chosen, some, about)
            good = [one for one in found if one.gain > INFERENCE.prior_odds and not is_negligible(problem, one.fit)]
            if good:
                break
        found.sort(key=lambda one: -one.gain)
        rounds.append(_round(found))
        best = _common_cause(problem, good) if good and len(taken) < INFERENCE.most_effects else None
        if best is None:
            chosen = prune(problem, chosen)
        beside, gain = _fit_beside_disturbances(problem, chosen, found, disturbances)
        clear = best is not None and best.gain > INFERENCE.clear_gain
        if disturbances and not states and not clear and beside.keys != keys_without_states:
            progress("looking for gusts and waves")
            # What explains more is taken first.
            least = max(INFERENCE.disturbance_gain, (0.0 if best is None else best.gain) - gain)
            rough, found_states = fit_disturbances(problem, beside, disturbances, undisturbed, least)
            # What would stand in for them falls, and what they hid may show.
            kept = prune(rough, fit(rough, beside.candidates, beside.values)) if found_states else chosen
            if found_states and _has_related_effects(problem, kept, found_states):
                keys_with_states = beside.keys
                problem, chosen, states = rough, kept, found_states
                continue
            keys_without_states = beside.keys if least <= INFERENCE.disturbance_gain else keys_without_states
        if best is None:
            break
        problem = problem.with_noise_of(best.fit)
        chosen = refit_spans(problem, fit(problem, best.fit.candidates, best.fit.values))
    if states and chosen.keys != keys_with_states:
        problem, states = fit_disturbances(problem, chosen, disturbances, undisturbed, initial=states)
        chosen = prune(problem, fit(problem, chosen.candidates, chosen.values))
    if states:
        chosen = refit_spans(problem, chosen)
    return Search(problem, fit(problem, ()), chosen, tuple(rounds), untested, states)


def refit_with_own_noise(problem: EstimationProblem, made: Fit) -> Fit:
    """Return a fit with the evidence that it has under the noise that it leaves itself: with that two are fairly compared."""
    fair = problem.with_noise_of(made)
    return fit(fair, made.candidates, made.values, begin=starting_point(fair, made))


def _has_related_effects(problem: EstimationProblem, made: Fit, states: Sequence[DisturbanceState]) -> bool:
    there = {"", *(candidate.effect.id for candidate in made.candidates)}
    # In a campaign the wind of a log is known before it is looked at by itself.
    there |= {"wind"} if problem.plain.air is not None else set()
    return all(state.candidate.effect.about in there for state in states)


def _fit_beside_disturbances(
    problem: EstimationProblem, chosen: Fit, found: Sequence[ScoredCandidate], disturbances: Sequence[Candidate]
) -> tuple[Fit, float]:
    """Return the fit beside which disturbances are looked for, and its evidence over what is chosen.

    What one of them comes and goes about, a wind's gusts, hides it and is hidden by it: the two are judged together.
    """
    about = {candidate.effect.about for candidate in disturbances}
    for one in found:
        if one.candidate.effect.id in about:
            return fit(problem, one.fit.candidates, one.fit.values), one.gain
    return chosen, 0.0


def _ranked_candidates(
    problem: EstimationProblem, chosen: Fit, candidates: Sequence[Candidate], about: Collection[str]
) -> list[ScoredCandidate]:
    """Return what each candidate adds to those chosen already, the best first.

    What disturbances are looked for beside, `about`, is fitted however little it promises.
    """
    current = fit(problem, chosen.candidates, chosen.values)
    begin = starting_point(problem, current)
    linearisation = linearise(problem, current, begin)
    tried = over(partial(_best_fit, problem, current, begin, linearisation, about), candidates)
    found = [one for one in tried if one is not None]
    found.sort(key=lambda one: -one.gain)
    fair = over(partial(_with_own_noise, problem), found[: INFERENCE.compared_candidates])
    ranked = sorted([*fair, *found[INFERENCE.compared_candidates :]], key=lambda one: -one.gain)
    lasts = bool(ranked and ranked[0].candidate.times) and not is_brief(problem, ranked[0].candidate)
    there = {one.candidate.key: one for one in _in_the_same_span(problem, ranked[0], candidates)} if lasts else {}
    best = [max(one, there.get(one.candidate.key, one), key=lambda each: each.gain) for one in ranked]
    best += [one for key, one in there.items() if key not in {each.candidate.key for each in ranked}]
    return sorted(best, key=lambda one: -one.gain)


def _in_the_same_span(
    problem: EstimationProblem, best: ScoredCandidate, candidates: Sequence[Candidate]
) -> list[ScoredCandidate]:
    """Return others in the span of the best, under the noise that each leaves there.

    What is strong is held for noise at first, under which no span of another promises much. What is brief is no name, whatever
    else could stand there.
    """
    fair = problem.with_noise_of(best.fit)
    last = len(best.fit.candidates) - 1
    bare = without(fair, best.fit, last)
    begin = starting_point(fair, bare)
    beside = linearise(fair, bare, begin)

    def there(other: Candidate) -> ScoredCandidate | None:
        moved = replace(other, onset_s=best.candidate.onset_s, offset_s=best.candidate.offset_s)
        if moved.effect.passing and not (passes(fair, moved) and stands_out(fair, beside, moved)):
            return None
        moved = choose_parameters(fair, bare, moved)
        values = (*bare.values, likeliest_start(fair, beside, moved))
        made = fit(fair, (*bare.candidates, moved), values, steps=COARSE_ITERATIONS, begin=begin)
        made = refit_with_own_noise(fair, fit(fair, made.candidates, made.values, begin=starting_point(fair, made)))
        return ScoredCandidate(moved, made, made.evidence - (best.fit.evidence - best.gain))

    others = [one for one in candidates if one.effect.onset and one.key != best.candidate.key]
    return [one for one in over(there, others) if one is not None]


def largest_gain_beside(problem: EstimationProblem, chosen: Fit, library: Sequence[Candidate]) -> float:
    """Return the evidence that the best further candidate of a library adds to those chosen, 0 where none adds any [nat]."""
    left = [one for one in library if one.effect.unsteady is None and one.key not in chosen.keys]
    return max([0.0, *(one.gain for one in _ranked_candidates(problem, chosen, left, ()))])


def _with_own_noise(problem: EstimationProblem, one: ScoredCandidate) -> ScoredCandidate:
    made = refit_with_own_noise(problem, fit(problem, one.fit.candidates, one.fit.values))
    return replace(one, fit=made, gain=max(one.gain, one.gain + made.evidence - one.fit.evidence))


def _best_fit(
    problem: EstimationProblem,
    current: Fit,
    begin: StartingPoint,
    linearisation: Linearisation,
    about: Collection[str],
    candidate: Candidate,
) -> ScoredCandidate | None:
    """Return a candidate's best fit beside the current ones, over all spans where it can begin or end; None if nowhere."""

    def scored(made: Fit) -> ScoredCandidate:
        gain = made.evidence - current.evidence
        return ScoredCandidate(made.candidates[-1], made, gain)

    hopeless = INFERENCE.hopeless_share * INFERENCE.prior_odds

    def scored_fit(one: Candidate, values: Floats | None = None, least: float = hopeless) -> ScoredCandidate:
        start = (*current.values, likeliest_start(problem, linearisation, one) if values is None else values)
        # Where the hull has strained to stand in for an effect that multiplies it, the way to both leads from the profile's.
        from_prior = one.effect.changes_hull and not one.times
        from_afar = from_prior or one.effect.piecewise
        made = fit(
            problem,
            (*current.candidates, one),
            start,
            steps=COARSE_ITERATIONS if from_afar else COMPARING_ITERATIONS,
            begin=None if from_prior else begin,
            least=-inf if one.effect.id in about else current.evidence + least,
            from_afar=from_afar,
        )
        return scored(made)

    candidate = choose_parameters(problem, current, candidate)
    throughout = [] if candidate.effect.passing else [scored_fit(candidate)]
    if not candidate.effect.onset:
        return throughout[0]
    if candidate.effect.step is not None and not problem.plain.measurements.profile.hull.is_known:
        return max([*throughout, *_steps(problem, current, throughout[0])], key=lambda one: one.gain)
    # The impulse of an onset shows within seconds of it only; what is changed from then on leads there.
    smooth = replace(candidate, effect=replace(candidate.effect, impulse=None))
    # Seconds matter: which of them is best shows when each has its own.
    least, close = max([hopeless, *(one.gain for one in throughout)]), INFERENCE.close_span
    spans = [scored_fit(one, least=close * least) for one in promising_spans(problem, linearisation, smooth)]
    index, step = len(current.candidates), 0.5 * part_s(problem, candidate)

    def refined(one: ScoredCandidate) -> ScoredCandidate:
        coarse = refine_span(problem, one.fit, index, begin, step, FIRST_TIME_STEP_S)
        with_impulse = scored_fit(replace(coarse.candidates[-1], effect=candidate.effect), coarse.values[-1])
        return scored(refine_span(problem, with_impulse.fit, index, begin, min(step, FIRST_TIME_STEP_S)))

    def settled(one: ScoredCandidate) -> ScoredCandidate:
        made = fit(problem, one.fit.candidates, one.fit.values, begin=starting_point(problem, one.fit))
        return scored(made)

    near = [one for one in spans if one.gain > least]
    # An end that is off by a second may cost more than what all along gains more.
    near = near or sorted((one for one in spans if one.gain > close * least), key=lambda one: -one.gain)[:1]
    found = [refined(one) for one in near]
    if throughout and found and max(one.gain for one in found) > hopeless:
        # Few steps are judged by slopes where they began: of two that are close, one that goes far looks better than it is.
        found = [max(found, key=lambda one: one.gain), *throughout]
        found = [settled(one) for one in found]
        return max(found, key=lambda one: one.gain)
    return max([*throughout, *found], key=lambda one: one.gain, default=None)


def _steps(problem: EstimationProblem, current: Fit, throughout: ScoredCandidate) -> list[ScoredCandidate]:
    """Return the likeliest step of what acts throughout in another fit, beside the current one; none where none is promising.

    Which of its two levels is the thrust curve's nobody knows, so that either is estimated.
    """
    level = fit(problem, throughout.fit.candidates, throughout.fit.values)
    begin, values = starting_point(problem, level), (*level.values[:-1], np.append(1.0, level.values[-1]))
    index, profile = len(current.candidates), problem.plain.measurements.profile
    steps = [
        one.as_step(profile) for one in promising_spans(problem, linearise(problem, level, begin), throughout.candidate)
    ]
    found = [fit(problem, (*current.candidates, one), values, steps=COMPARING_ITERATIONS, begin=begin) for one in steps]
    if not found:
        return []
    best, width = max(found, key=lambda made: made.evidence), 0.5 * part_s(problem, throughout.candidate)
    for step_s in (width, min(width, FIRST_TIME_STEP_S)):
        best = refine_span(problem, best, index, begin, step_s)
    made = turned(problem, fit(problem, best.candidates, best.values, begin=starting_point(problem, best)), index)
    return [ScoredCandidate(made.candidates[-1], made, made.evidence - current.evidence)]


def _common_cause(problem: EstimationProblem, good: Sequence[ScoredCandidate]) -> ScoredCandidate:
    """Return the best candidate; in the place of coefficients that are wrong by themselves, a likelier cause of them."""
    best = good[0]
    if not best.candidate.effect.of_coefficients:
        return best

    def paired(one: ScoredCandidate) -> tuple[float, ScoredCandidate]:
        pair = with_fewer_coefficients(problem, one.fit, best.candidate)
        if pair is None:
            return 0.0, one
        fair = problem.with_noise_of(pair)
        ours, theirs = (fit(fair, made.candidates, made.values).evidence for made in (pair, best.fit))
        return ours - theirs, one

    causes = [
        one
        for one in good[1:]
        if one.candidate.effect.changes_hull and one.gain > INFERENCE.common_cause_share * best.gain
    ]
    gain, cause = max(over(paired, causes), key=lambda pair: pair[0], default=(0.0, best))
    return cause if gain > 0.0 else best


def _round(found: Sequence[ScoredCandidate]) -> Round:
    top = max([INFERENCE.prior_odds, *(one.gain for one in found)])
    weights = [exp(one.gain - top) for one in found]
    none = exp(INFERENCE.prior_odds - top)
    total = sum(weights) + none
    return Round(tuple(found), tuple(weight / total for weight in weights), none / total)


def is_negligible(problem: EstimationProblem, made: Fit, index: int = -1) -> bool:
    """Tell whether an effect of a fit, the last one if not another, moves the vessel too little to matter to anybody."""
    candidate, windows = made.candidates[index], problem.windows
    named = zip(made.values[index].tolist(), candidate.parameters, strict=True)
    unreported = candidate.effect.unreported(problem.plain.measurements, made.values[index])
    away = [
        abs(value - one.neutral)
        for value, one in named
        if one.unit == candidate.parameters[0].unit and one.name not in unreported
    ]
    if max(away) < candidate.effect.negligible:
        return True
    others = [k for k in range(len(made.candidates)) if k != index % len(made.candidates)]
    before = replace(
        made, candidates=tuple(made.candidates[k] for k in others), values=tuple(made.values[k] for k in others)
    )
    moved = windows.gap(fitted_force_model(problem.plain, made)) - windows.gap(
        fitted_force_model(problem.plain, before)
    )
    size = np.sqrt(np.mean(windows.measured[:, windows.channels] ** 2, axis=0))
    return bool((np.sqrt(np.mean(moved**2, axis=0)) < INFERENCE.void_share * size).all())


def prune(problem: EstimationProblem, chosen: Fit) -> Fit:
    """Drop one by one what the others explain as well without it, and what passes without being an event beside them.

    What is needed stays, see `ferryid.diagnose.inference.needed_correction.needed`.
    """
    for key in [candidate.key for candidate in chosen.candidates if candidate.effect.passing]:
        index = [candidate.key for candidate in chosen.candidates].index(key)
        bare = without(problem, chosen, index)
        if not stands_out(problem, linearise(problem, bare, starting_point(problem, bare)), chosen.candidates[index]):
            chosen = bare
    while questioned := [k for k, candidate in enumerate(chosen.candidates) if not needed(problem, candidate)]:
        fewer = over(partial(without, problem, chosen), questioned)
        best = max(over(partial(refit_with_own_noise, problem), fewer), key=lambda one: one.evidence)
        if max(chosen.evidence, refit_with_own_noise(problem, chosen).evidence) - best.evidence >= INFERENCE.prior_odds:
            break
        chosen = best
    return chosen
