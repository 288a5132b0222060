"""Disturbances that nobody measured and that come and go by chance: gusts and waves, as states of the filter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import inf, log
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.inference.disturbance_course import (
    ALL_ALONG,
    StrengthCourse,
    acting,
    course_estimates,
    likeliest_growth,
    likeliest_span,
    step_likelihoods,
)
from ferryid.diagnose.inference.estimation import Candidate, EstimationProblem, Fit, fitted_force_model
from ferryid.diagnose.inference.noise_estimation import excerpt, fit_noise, fit_noise_with
from ferryid.diagnose.inference.noise_model import NoiseModel, likelihood, stride_s
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.inference.weak_form import Windows, steps_of
from ferryid.effects.effect import Process
from ferryid.effects.force_model import ForceModel
from ferryid.types import Floats

START_STRENGTHS, START_FREQUENCIES = (0.3, 1.0), (0.5, 0.7, 1.0, 1.4, 2.0)
"""Where the search begins, as shares of the usual ones; from hardly anything nothing leads on."""
GIVEN_WAY = 0.3
"""Share of its own coloured error and push that a channel keeps where a search begins beside less of them: strong waves have
made its noise theirs, and beside that noise nothing is likelier than the weakest."""

GROWTH_ROUNDS = 4
"""Most times that a growth and the rest of a disturbance are estimated in turns."""


@dataclass(frozen=True)
class DisturbanceState:
    """A disturbance.

    Attributes
    ----------
    candidate, values, widths
        What it is, its parameters, and the standard deviations of their logarithms.
    gain
        The evidence for it [nat].
    course
        How strong it is over the log.
    times
        The parameters of that course, with their intervals: see `course_estimates`.
    in_velocities
        True where it was found in the velocities, and positions hardly show it.
    gain_in_velocities
        Evidence for it in the velocities [nat]; infinite where these say nothing.
    loss_in_velocities
        Log-likelihood that velocities lose with the least of it that a force would show in them, `INFERENCE.least_shown` of its
        power, beside their own noise [nat]; 0 where these say nothing, or speak for it.
    """

    candidate: Candidate
    values: Floats
    widths: Floats
    gain: float
    course: StrengthCourse = ALL_ALONG
    times: Mapping[str, Estimate] = field(default_factory=dict)
    in_velocities: bool = False
    gain_in_velocities: float = inf
    loss_in_velocities: float = 0.0

    @property
    def known(self) -> frozenset[str]:
        """Names of the parameters that the log tells."""
        named = zip(self.candidate.parameters, self.widths.tolist(), strict=True)
        return frozenset(one.name for one, width in named if width < INFERENCE.vague_log)

    @property
    def estimates(self) -> dict[str, Estimate]:
        """Parameters with their 95 % intervals, which are even in the logarithm."""
        away = np.exp(
            1.96 * np.minimum(np.hypot(self.widths, self.candidate.effect.formula_error), INFERENCE.widest_log)
        )
        low, high = self.values / away, self.values * away
        return {
            one.name: Estimate(value, max(a, one.low), min(b, one.high), one.unit)
            for one, value, a, b in zip(
                self.candidate.parameters, self.values.tolist(), low.tolist(), high.tolist(), strict=True
            )
        }


def fit_disturbances(
    problem: EstimationProblem,
    made: Fit,
    candidates: Sequence[Candidate],
    undisturbed: ForceModel,
    minimum_gain: float = INFERENCE.disturbance_gain,
    *,
    initial: Sequence[DisturbanceState] = (),
) -> tuple[EstimationProblem, tuple[DisturbanceState, ...]]:
    """Return the trial with the disturbances in its filter that what a fit leaves speaks for, and these.

    Each is weighed by its likelihood, at its most likely parameters and noise, less Schwarz's penalty for its parameters and
    what its prior odds are lower where the log was recorded. One in a narrow band is looked for in the velocities as well: a
    gyroscope shows small waves that the error of a compass hides. Only beside a hull that the profile knows: what a guessed one
    leaves has bursts in narrow bands of its own, and so has the noise of receivers. A force that begins and ends may come and
    go itself, as a line that is hauled: so each disturbance is tried within each of those, whose ends cost it nothing.

    Parameters
    ----------
    problem
        Its filter is learnt anew.
    made
        What has been found.
    candidates
        Disturbances that the measurements can show.
    undisturbed
        The plain force model without any of them.
    minimum_gain
        Evidence that the first of them must show: what else explains as much is looked at before it.
    initial
        What they were beside another fit: where the search begins.
    """
    force_model = fitted_force_model(problem.plain, made)
    steps = problem.excerpt
    gaps = steps.gap(force_model)
    noise = fit_noise(steps, gaps, problem.filter)
    known = problem.plain.measurements.profile.hull.is_known
    seen = [one for one in initial if not one.in_velocities]
    before = {one.candidate.key: one for one in seen}
    spans = _spans(steps, made)
    noise, states = _selected(steps, gaps, noise, candidates, force_model, minimum_gain, before, spans, closely=known)
    narrow = [one for one in candidates if any(parameter.unit == "Hz" for parameter in one.parameters)]
    # What is broad is in the noise of any velocity, and shows by its power alone.
    found = {state.candidate.key for state in states}
    asked = found & {one.key for one in narrow}
    # Small ones wait for what explains more.
    last = minimum_gain <= INFERENCE.disturbance_gain
    velocities = _velocity_steps(problem) if asked or (known and narrow and last) else None
    if velocities is not None:
        theirs = velocities.gap(force_model)
        alone = fit_noise(velocities, theirs)
        states = [
            _in_velocities(velocities, theirs, alone, state, force_model, known=known)
            if state.candidate.key in asked
            else state
            for state in states
        ]
    if velocities is not None and known:
        missing = [one for one in narrow if last and one.key not in found]
        before = {one.candidate.key: one for one in initial if one.in_velocities}
        more = _selected(velocities, theirs, alone, missing, force_model, minimum_gain, before, spans, closely=True)[1]
        for state in more:
            pushes = _pushes(state, force_model)
            states.append(replace(state, in_velocities=True, gain_in_velocities=state.gain))
            noise = NoiseModel(noise.channels, (*noise.processes, *pushes), force_model)
    plain = undisturbed
    for state in states:
        # On average, too, they may do something.
        plain = state.candidate.act(plain, state.values)
    return replace(problem.with_noise_of(made), filter=noise, plain=plain), tuple(states)


def _spans(steps: Windows, made: Fit) -> tuple[StrengthCourse, ...]:
    """Return the spans of the forces that both begin and end within the steps."""
    first, last = float(steps.middle_s[0]), float(steps.middle_s[-1])
    spans = ((one.onset_s, one.offset_s) for one in made.candidates)
    within = dict.fromkeys((begin, end) for begin, end in spans if first < begin < end < last)
    return tuple(StrengthCourse(*one, with_force=True) for one in within)


class _Found(NamedTuple):
    """Noise with a disturbance, the disturbance, and the log-likelihood with it."""

    noise: NoiseModel
    state: DisturbanceState
    after: float


def _selected(
    steps: Windows,
    gaps: Floats,
    noise: NoiseModel,
    candidates: Sequence[Candidate],
    force_model: ForceModel,
    minimum_gain: float,
    before: Mapping[tuple[str, str | None], DisturbanceState],
    spans: Sequence[StrengthCourse],
    *,
    closely: bool,
) -> tuple[NoiseModel, list[DisturbanceState]]:
    """Return the noise with the disturbances that gaps speak for, the strongest first, and these.

    `spans` are those of forces that were found; `closely`: in spans of the log as well, and beside noise that has given way to
    them.
    """
    best = likelihood(noise, steps, gaps)
    states: list[DisturbanceState] = []
    left = list(candidates)
    while left:
        required_gain = INFERENCE.disturbance_gain if states else minimum_gain
        tried = []
        for candidate in left:
            assert candidate.effect.unsteady is not None
            processes = candidate.effect.unsteady(force_model)
            if not processes(_usual_values(candidate)):
                continue
            penalty = 0.5 * len(candidate.parameters) * log(len(steps.starts)) + candidate.log_alternatives
            looks = closely and candidate.effect.onset
            places = _places(steps, gaps, noise, candidate, force_model, before.get(candidate.key), closely=looks)
            for start, course, beside in places:
                dear = penalty + course.cost(len(steps.starts))
                fitted_noise, values, widths, after = fit_noise_with(
                    steps,
                    gaps,
                    beside,
                    acting(processes, course, force_model),
                    start,
                    force_model,
                    best + dear + required_gain,
                )
                gain = after - best - dear
                if _is_identified(candidate, values, widths, stride_s(steps)):
                    state = DisturbanceState(candidate, values, widths, gain, course)
                    tried.append((gain, fitted_noise, state, after))
        if not tried:
            break
        gain, fitted_noise, state, after = max(tried, key=lambda one: one[0])
        if gain < required_gain:
            break
        if closely and state.candidate.effect.onset:
            found = _Found(fitted_noise, state, after)
            fitted_noise, state, after = _with_course(steps, gaps, noise, found, force_model, spans)
        noise, best = fitted_noise, after
        states.append(state)
        left.remove(state.candidate)
    return noise, states


def _places(
    steps: Windows,
    gaps: Floats,
    noise: NoiseModel,
    candidate: Candidate,
    force_model: ForceModel,
    before: DisturbanceState | None,
    *,
    closely: bool,
) -> list[tuple[Floats, StrengthCourse, NoiseModel]]:
    """Return where the search for a disturbance begins: parameters, course, and the channels' noise.

    The likeliest all along, beside the noise as it is and as it may be with the disturbance, and those in a span of the log.
    """
    if before is not None:
        # The force that it came and went with may be gone.
        course = ALL_ALONG if before.course.with_force else before.course
        return [(before.values, course, noise)]
    assert candidate.effect.unsteady is not None
    processes = candidate.effect.unsteady(force_model)
    starts = _starts(candidate)
    bare = step_likelihoods(steps, gaps, noise)

    def levels(channels: Floats) -> list[Floats]:
        every = (NoiseModel(channels, (*noise.processes, *processes(one)), force_model) for one in starts)
        return [step_likelihoods(steps, gaps, one) for one in every]

    def best_of(likelihoods: list[Floats]) -> Floats:
        return starts[int(np.argmax([one.sum() for one in likelihoods]))]

    gained = [one - bare for one in levels(noise.channels)]
    places = [(best_of(gained), ALL_ALONG, noise)]
    if closely:
        less = noise.channels * [1.0, GIVEN_WAY, 1.0, GIVEN_WAY, 1.0]
        places.append((best_of(levels(less)), ALL_ALONG, replace(noise, channels=less)))
    if closely:
        spans = [likeliest_span(steps, one) for one in gained]
        k = int(np.argmax([gain for _, gain in spans]))
        # Of one that is strong all along, the span is found beside it.
        if spans[k][0].ends and spans[k][1] > 0.0:
            places.append((starts[k], spans[k][0], noise))
    return places


def _with_course(
    steps: Windows,
    gaps: Floats,
    bare: NoiseModel,
    found: _Found,
    force_model: ForceModel,
    spans: Sequence[StrengthCourse],
) -> _Found:
    """Return noise, state and log-likelihood with a disturbance in the likeliest course of its strength."""
    fitted, state, _ = found
    candidate, n = state.candidate, len(steps.starts)
    assert candidate.effect.unsteady is not None
    processes = candidate.effect.unsteady(force_model)

    def noise_in(course: StrengthCourse, channels: Floats, values: Floats) -> NoiseModel:
        own = acting(processes, course, force_model)(values)
        return NoiseModel(channels, (*bare.processes, *own), force_model)

    def span_of(channels: Floats, values: Floats) -> StrengthCourse:
        without = replace(bare, channels=channels)
        every = (step_likelihoods(steps, gaps, one) for one in (noise_in(ALL_ALONG, channels, values), without))
        return likeliest_span(steps, next(every) - next(every))[0]

    def better_in(course: StrengthCourse, found: _Found) -> _Found:
        if course == found.state.course:
            return found
        made, values, widths, after = fit_noise_with(
            steps,
            gaps,
            replace(bare, channels=found.noise.channels),
            acting(processes, course, force_model),
            found.state.values,
            force_model,
        )
        gain = after - course.cost(n) - found.after + found.state.course.cost(n)
        # Within a force that was found it need not be known as a disturbance of its own: that is what is in question.
        if gain <= 0.0 or not (course.with_force or _is_identified(candidate, values, widths, stride_s(steps))):
            return found
        return _Found(made, DisturbanceState(candidate, values, widths, found.state.gain + gain, course), after)

    if not state.course.ends:
        # What it explains all along leaves a channel nothing of its own: calm is what the noise without it is of.
        found = better_in(span_of(bare.channels, state.values), found)
    growth, likely = likeliest_growth(steps, gaps, lambda one: noise_in(one, fitted.channels, state.values))
    if likely - growth.cost(n) > found.after - found.state.course.cost(n):
        found = better_in(growth, found)
    for _ in range(GROWTH_ROUNDS):
        course, channels, values = found.state.course, found.noise.channels, found.state.values
        if course.growth == 1.0:
            break
        # What waves of even strength had left to the noise made the growth look smaller.
        growth, _ = likeliest_growth(steps, gaps, partial(noise_in, channels=channels, values=values))
        found = better_in(growth, found)
        if found.state.course == course:
            break
    if found.state.course.ends:
        found = better_in(span_of(found.noise.channels, found.state.values), found)
    for span in spans:
        found = better_in(span, found)
    if found.state.course == ALL_ALONG:
        return found
    channels, values = found.noise.channels, found.state.values
    times = course_estimates(
        found.state.course,
        steps,
        gaps,
        lambda one: noise_in(one, channels, values),
        replace(bare, channels=channels),
    )
    return found._replace(state=replace(found.state, times=times))


def _velocity_steps(problem: EstimationProblem) -> Windows | None:
    """Return steps of the velocities, from which noise is learnt; None where these are fitted anyway, or missing."""
    windows = problem.windows
    if not windows.channels[0] or not np.isfinite(windows.measurements.nu_raw[windows.measurements.usable]).all():
        return None
    return excerpt(steps_of(replace(windows, channels=~windows.channels)))


def _in_velocities(
    steps: Windows, gaps: Floats, alone: NoiseModel, state: DisturbanceState, force_model: ForceModel, *, known: bool
) -> DisturbanceState:
    """Return a disturbance that positions show with what velocities say for it, beside a known hull, and against it."""
    if known:
        gain = _shown(steps, gaps, alone, state, force_model)
        state = replace(state, gain_in_velocities=gain)
        if gain > INFERENCE.prior_odds:
            return state
    return replace(state, loss_in_velocities=_loss(steps, gaps, alone, state, force_model))


def _loss(steps: Windows, gaps: Floats, alone: NoiseModel, state: DisturbanceState, force_model: ForceModel) -> float:
    """Return how much less likely velocities are with the least of a disturbance that a force would show in them [nat].

    Their own noise gives way to it, so that a velocity in whose noise it would not be seen loses nothing.
    """
    assert state.candidate.effect.unsteady is not None
    strength = _strengths(state.candidate)
    # Nothing is claimed on an axis on which it is not known how strong it is.
    claimed = np.where(state.widths < INFERENCE.vague_log, INFERENCE.least_shown**0.5, 0.0)
    values = state.values * np.where(strength, claimed, 1.0)
    processes = acting(state.candidate.effect.unsteady(force_model), state.course, force_model)(values)
    _, _, _, after = fit_noise_with(steps, gaps, alone, lambda _: processes, np.empty(0), force_model)
    return likelihood(alone, steps, gaps) - after


def _shown(steps: Windows, gaps: Floats, alone: NoiseModel, state: DisturbanceState, force_model: ForceModel) -> float:
    """Return how much likelier velocities are with a disturbance that positions show, less what its parameters cost."""
    assert state.candidate.effect.unsteady is not None
    processes = acting(state.candidate.effect.unsteady(force_model), state.course, force_model)
    _, _, _, after = fit_noise_with(steps, gaps, alone, processes, state.values, force_model)
    return after - likelihood(alone, steps, gaps) - 0.5 * len(state.values) * log(len(steps.starts))


def _pushes(state: DisturbanceState, force_model: ForceModel) -> tuple[Process, ...]:
    assert state.candidate.effect.unsteady is not None
    return acting(state.candidate.effect.unsteady(force_model), state.course, force_model)(state.values)


def _is_identified(candidate: Candidate, values: Floats, widths: Floats, step_s: float) -> bool:
    """Tell whether a disturbance is known: how fast it is, how strong on one axis at least, and its moment if it has one.

    A position's error in a narrow band looks like a force along it, but turns nothing; what is faster than the filter's steps
    was not seen by it; waves slower than any sea are none; and what forgets itself within half a period is no narrow band.
    """
    band = np.array([parameter.unit == "Hz" for parameter in candidate.parameters])
    possible = all(
        one.low <= value <= one.high for one, value in zip(candidate.parameters, values.tolist(), strict=True)
    )
    if not possible or (values[band] * step_s > INFERENCE.fastest_share).any():
        return False
    memory = np.array([parameter.name == "time_constant" for parameter in candidate.parameters])
    if band.any() and float(values[memory][0] * values[band][0]) < INFERENCE.least_memory:
        return False
    strength = _strengths(candidate)
    turning = np.array([parameter.unit == "N·m" for parameter in candidate.parameters])
    return bool(
        (widths[~strength | turning] < INFERENCE.vague_log).all() and (widths[strength] < INFERENCE.vague_log).any()
    )


def _strengths(candidate: Candidate) -> NDArray[np.bool_]:
    return np.array([parameter.name.endswith("std") for parameter in candidate.parameters])


def _starts(candidate: Candidate) -> list[Floats]:
    """Return parameters to begin with: strengths, and frequencies where there is one, about the usual ones."""
    usual = _usual_values(candidate)
    strength = _strengths(candidate)
    band = np.array([parameter.unit == "Hz" for parameter in candidate.parameters])
    bands = START_FREQUENCIES if band.any() else (1.0,)
    return [usual * np.where(strength, a, np.where(band, b, 1.0)) for a in START_STRENGTHS for b in bands]


def _usual_values(candidate: Candidate) -> Floats:
    return np.array([parameter.size for parameter in candidate.parameters])
