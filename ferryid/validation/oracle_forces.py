"""Likelihood gain and size of effects on forces that are known to be in a log.

Parameters, hull and noise are fitted together, with each effect and without it. Two hypotheses are compared by the logarithm
of the ratio of their greatest likelihoods, where the prior of the hull counts as a measurement. The noise is learnt by a
search that may end on another top for one than for the other; each is therefore given the likelier of the noises of both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ferryid.diagnose import Estimate
from ferryid.diagnose.inference import (
    START_FREQUENCIES,
    START_STRENGTHS,
    Candidate,
    DisturbanceState,
    EstimationProblem,
    Fit,
    NoiseModel,
    choose_parameters,
    fit,
    fit_noise_with,
    fitted_force_model,
    intervals,
    is_negligible,
    likelihood,
)
from ferryid.effects import effects
from ferryid.effects.effect import HELD, Processes
from ferryid.effects.force_model import ForceModel
from ferryid.types import Floats

ROUNDS = 2
"""Times that parameters are fitted under the noise that they leave themselves."""
GLIMPSES = 2
"""Short searches for what comes and goes by chance before the one that goes on to its end."""
FROM_AFAR = 8
"""Steps of a fit by which places to begin are compared."""
MANY = 6
"""Parameters of one effect beyond which it is begun at its own start only: such are all but linear."""
REACH = 1.96
"""Half of a 95 % interval, in standard deviations."""


@dataclass(frozen=True)
class ForceEstimate:
    """The estimate of one effect from forces.

    Attributes
    ----------
    gain
        As in `ferryid.validation.records.OracleEstimate`.
    free, parameters
        How many were fitted for it, and these.
    idle
        True where it moves the vessel less than a diagnosis finds worth a name.
    """

    gain: float
    free: int
    parameters: Mapping[str, Estimate] = field(default_factory=dict)
    idle: bool = False


@dataclass(frozen=True)
class _Model:
    """A hypothesis: the trial with the noise that it leaves, what was fitted, and what comes and goes by chance."""

    trial: EstimationProblem
    fit: Fit
    states: tuple[DisturbanceState, ...] = ()


def force_gains(trial: EstimationProblem, known: Sequence[Candidate]) -> tuple[float, tuple[ForceEstimate, ...]]:
    """Return what effects gain together over the hull alone, and what each gains, added last.

    Parameters
    ----------
    trial
        From `ferryid.diagnose.inference.estimation_problem`.
    known
        Effects that are in the log.
    """
    unsteady = [one for one in known if one.effect.unsteady is not None]
    beside = _mean_effects(trial, known)
    steady = _with_chosen_parameters(trial, [one for one in known if one.effect.unsteady is None])
    full = _modelled(trial, [*steady, *beside], unsteady)
    bare = _modelled(trial, beside, ())
    own = {one.key: one for one in (*steady, *unsteady)}
    made = tuple(_estimate(trial, full, own[one.key]) for one in known)
    return max(_likelihood(full, bare) - _likelihood(bare, full if not unsteady else None), 0.0), made


def _mean_effects(trial: EstimationProblem, known: Sequence[Candidate]) -> list[Candidate]:
    """Return the means of unsteady effects that are not given: a gust is one of a wind, which is fitted with and without it."""
    there = {one.effect.id for one in known}
    missing = {one.effect.about for one in known} - there - {""}
    profile = trial.plain.measurements.profile
    return [Candidate(effects()[name], None, effects()[name].parameters_of(profile)) for name in sorted(missing)]


def _with_chosen_parameters(trial: EstimationProblem, suspects: Sequence[Candidate]) -> list[Candidate]:
    """Return suspects with the parameters that their effects choose, under the noise that these leave."""
    chosen = list(suspects)
    if all(one.effect.choose is None for one in chosen):
        return chosen
    for _ in range(ROUNDS):
        for i, suspect in enumerate(chosen):
            if suspect.effect.choose is not None:
                beside = _fitted(trial, [one for k, one in enumerate(chosen) if k != i])
                chosen[i] = choose_parameters(trial, beside, suspect)
        trial = trial.with_noise_of(_fitted(trial, chosen))
    return chosen


def _modelled(
    trial: EstimationProblem,
    steady: Sequence[Candidate],
    unsteady: Sequence[Candidate],
    pushing: ForceModel | None = None,
    near: _Model | None = None,
) -> _Model:
    """Return a hypothesis fitted under its own noise.

    Parameters
    ----------
    trial
        With the noise that the hull alone leaves.
    steady, unsteady
        Effects.
    pushing
        The force model in which unsteady ones push; the fitted one where None.
    near
        Another hypothesis with these unsteady ones, at whose noise the search for theirs begins.
    """
    calm = trial.plain
    made = _fitted(trial, steady)
    trial = trial.with_noise_of(made)
    made = fit(trial, steady, made.values)
    states: tuple[DisturbanceState, ...] = ()
    if near is not None and unsteady:
        keys = {one.key for one in unsteady}
        states = tuple(state for state in near.states if state.candidate.key in keys)
        trial = replace(trial, filter=NoiseModel(near.trial.filter.channels))
    # As long as the fit still moves much, a glimpse is enough.
    for worth in (*(GLIMPSES * (np.inf,)), -np.inf) if unsteady else ():
        trial, states = _with_processes(trial, made, unsteady, calm, pushing, states, worth)
        made = fit(trial, steady, made.values)
    return _Model(trial, made, states)


def _fitted(trial: EstimationProblem, suspects: Sequence[Candidate]) -> Fit:
    """Return the likeliest fit from several places to begin: each parameter in turn as far off as it is large."""
    own = [one.start for one in suspects]
    places = [own]
    for i, suspect in enumerate(suspects):
        free = [k for k, one in enumerate(suspect.parameters) if one.size > HELD]
        for k in free if len(free) <= MANY else ():
            one = suspect.parameters[k]
            for side in (-1.0, 1.0):
                moved = own[i].copy()
                moved[k] = min(max(moved[k] + side * one.size, one.low), one.high)
                places.append([*own[:i], moved, *own[i + 1 :]])
    if len(places) == 1:
        return fit(trial, suspects)
    begun = [fit(trial, suspects, place, steps=FROM_AFAR) for place in places]
    return fit(trial, suspects, max(begun, key=lambda one: one.evidence).values)


def _with_processes(
    trial: EstimationProblem,
    made: Fit,
    unsteady: Sequence[Candidate],
    calm: ForceModel,
    pushing: ForceModel | None,
    near: Sequence[DisturbanceState],
    worth: float,
) -> tuple[EstimationProblem, tuple[DisturbanceState, ...]]:
    """Return the trial with unsteady effects in its filter that are likeliest beside a fit, and these.

    One after the other they are learnt together with each channel's own noise, the others as they are `near`; `worth` as in
    `ferryid.diagnose.inference.fit_noise_with`.
    """
    force_model = fitted_force_model(trial.plain, made)
    within = force_model if pushing is None else pushing
    steps = trial.excerpt
    gaps = steps.gap(force_model)
    states = {state.candidate.key: state for state in near}
    pushes = {suspect.key: _pushes(suspect, within) for suspect in (*unsteady, *(state.candidate for state in near))}
    noise = trial.filter
    for suspect in unsteady:
        others = tuple(one for key, state in states.items() if key != suspect.key for one in pushes[key](state.values))
        processes = pushes[suspect.key]
        noise = NoiseModel(noise.channels, others, within)

        def glance(p: Floats, noise: NoiseModel = noise, processes: Processes = processes) -> float:
            every = (*noise.processes, *processes(p))
            return likelihood(NoiseModel(noise.channels, every, within), steps, gaps)

        places = [states[suspect.key].values] if suspect.key in states else _places(suspect)
        noise, values, widths, _ = fit_noise_with(steps, gaps, noise, processes, max(places, key=glance), within, worth)
        states[suspect.key] = DisturbanceState(suspect, values, widths, 0.0)
    plain = calm
    for state in states.values():
        # On average, too, they may do something.
        plain = state.candidate.act(plain, state.values)
    return replace(trial, filter=noise, plain=plain), tuple(states.values())


def _pushes(suspect: Candidate, force_model: ForceModel) -> Processes:
    assert suspect.effect.unsteady is not None
    return suspect.effect.unsteady(force_model)


def _places(suspect: Candidate) -> list[Floats]:
    """Return parameters to begin with: strengths, and frequencies where there is one, about the usual ones."""
    usual = np.array([one.size for one in suspect.parameters])
    strength = np.array([one.name.endswith("std") for one in suspect.parameters])
    band = np.array([one.unit == "Hz" for one in suspect.parameters])
    return [
        usual * np.where(strength, a, np.where(band, b, 1.0))
        for a in START_STRENGTHS
        for b in (START_FREQUENCIES if band.any() else (1.0,))
    ]


def _estimate(trial: EstimationProblem, full: _Model, suspect: Candidate) -> ForceEstimate:
    """Return what one effect of a hypothesis gains, added last."""
    others = [one for one in full.fit.candidates if one.key != suspect.key]
    shaking = [state.candidate for state in full.states if state.candidate.key != suspect.key]
    unreported = suspect.effect.unreported(trial.plain.measurements, suspect.start)
    free = sum(one.size > HELD and one.name not in unreported for one in suspect.parameters)
    # Without the wind that they are one of, gusts push as they did about it.
    blown = any(one.effect.about == suspect.effect.id for one in shaking)
    rest = _modelled(trial, others, shaking, fitted_force_model(full.trial.plain, full.fit) if blown else None, full)
    if suspect.effect.unsteady is not None:
        gain = _likelihood(full, rest) - _likelihood(rest)
        parameters = next(state.estimates for state in full.states if state.candidate.key == suspect.key)
        idle = False
    else:
        gain = _likelihood(full, rest) - _likelihood(rest, full)
        index = [one.key for one in full.fit.candidates].index(suspect.key)
        parameters = _estimates(full, index)
        idle = is_negligible(full.trial, full.fit, index)
    return ForceEstimate(max(gain, 0.0), free, parameters, idle)


def _likelihood(model: _Model, other: _Model | None = None) -> float:
    """Return the logarithm of the likelihood of a hypothesis, under the noise of another one if that is likelier."""
    best = _log_likelihood(model.trial, model.fit)
    if other is not None:
        again = fit(other.trial, model.fit.candidates, model.fit.values)
        best = max(best, _log_likelihood(other.trial, again))
    return best


def _log_likelihood(trial: EstimationProblem, made: Fit) -> float:
    left, free = trial.white(fitted_force_model(trial.plain, made)), trial.hull_spread > 0.0
    away = (made.hull - trial.plain.hull)[free] / trial.hull_spread[free]
    return -0.5 * float(left @ left + away @ away) - trial.whitening_filter.log_scale


def _estimates(model: _Model, index: int) -> dict[str, Estimate]:
    """Return the parameters of a steady effect with intervals as a diagnosis tells them, those that the log tells."""
    suspect, values = model.fit.candidates[index], model.fit.values[index]
    followed = intervals(model.trial, model.fit, index) if suspect.effect.profiled and not suspect.times else {}
    unreported = suspect.effect.unreported(model.trial.plain.measurements, values)
    found = {}
    for one, value, error in zip(
        suspect.parameters, values.tolist(), model.fit.reported_errors(index).tolist(), strict=True
    ):
        if one.size <= HELD or one.name in unreported:
            continue
        low, high = max(value - REACH * error, one.low), min(value + REACH * error, one.high)
        if one.name in followed:
            low, high = min(followed[one.name][0], value), max(followed[one.name][1], value)
        found[one.name] = Estimate(value, low, high, one.unit)
    return found
