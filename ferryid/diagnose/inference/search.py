"""Which effects a log speaks for: selection by evidence, one after the other, with every rival kept."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import exp

import numpy as np

from ferryid.diagnose.inference.estimation import Fit, Near, Suspect, Trial, fit, imagined, near, settled, without
from ferryid.diagnose.inference.onset_estimation import (
    GLANCE,
    NEARBY_S,
    Ground,
    ground_of,
    part_s,
    promising,
    sharpened,
    timed,
)
from ferryid.diagnose.inference.stochastic_disturbance import WORTH, State, disturbed
from ferryid.diagnose.parallel import over
from ferryid.effects import effects
from ferryid.effects.picture import Scene
from ferryid.vessel.profile import Floats

ODDS = 8.0
"""Logarithm of the evidence that an effect must show over none before it is as likely as none."""
FAR = 8
"""Steps of a fit by which candidates are sorted from afar, `GLANCE` from nearby; the best are then fitted to the end."""
REJUDGED = 5
"""Candidates whose evidence is weighed under the noise that each leaves itself."""
MOST = 4
"""Effects looked for at once."""
CLEAR = 100.0
"""Logarithm of the evidence as of which an effect is taken before gusts and waves are looked for: they look like nothing so
clear."""
VOID = 0.02
"""An effect whose acceleration is less than this share of the measured one, by every channel's root mean square, is void."""


@dataclass(frozen=True)
class Candidate:
    """A suspect with its fit beside what is selected already, and its evidence over that."""

    suspect: Suspect
    fit: Fit
    gain: float


@dataclass(frozen=True)
class Round:
    """One round of selection: every candidate, the best first, and the probability of each."""

    candidates: tuple[Candidate, ...]
    probabilities: tuple[float, ...]
    none: float


@dataclass(frozen=True)
class Search:
    """What the log speaks for.

    Attributes
    ----------
    trial
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

    trial: Trial
    base: Fit
    fit: Fit
    rounds: tuple[Round, ...]
    untested: dict[str, str]
    states: tuple[State, ...] = ()


def suspects_of(scene: Scene) -> tuple[list[Suspect], dict[str, str]]:
    """Return every effect that the scene can show, and why it cannot show the others."""
    suspects, untested = [], {}
    for effect in effects().values():
        reason = effect.cannot(scene)
        if reason:
            untested[effect.id] = reason
            continue
        parameters = effect.parameters_of(scene.profile)
        suspects += [Suspect(effect, instance, parameters) for instance in effect.instances(scene.profile)]
    return suspects, untested


def search(trial: Trial, progress: Callable[[str], None], *, known: Sequence[Suspect] | None = None) -> Search:
    """Select effects as long as one is more likely than none, then drop those that the others have made idle.

    Parameters
    ----------
    trial
        From `ferryid.diagnose.inference.estimation.trial_of`.
    progress
        Called with the name of each stage.
    known
        The suspects; the whole library where None.
    """
    suspects, untested = suspects_of(trial.plain.scene)
    if known is not None:
        suspects = list(known)
    steady = [suspect for suspect in suspects if suspect.effect.unsteady is None]
    shaken = [suspect for suspect in suspects if suspect.effect.unsteady is not None]
    calm = trial.plain
    chosen, rounds = fit(trial, ()), list[Round]()
    states: tuple[State, ...] = ()
    stood: frozenset[tuple[str, str | None]] | None = None
    calm_beside: frozenset[tuple[str, str | None]] | None = None
    while True:
        taken = {suspect.key for suspect in chosen.suspects}
        left = [suspect for suspect in steady if suspect.key not in taken]
        progress(f"weighing {len(left)} hypotheses beside {len(taken) or 'none'} found")
        found = _weighed(trial, chosen, left)
        rounds.append(_round(found))
        good = [one for one in found if one.gain > ODDS and not void(trial, one.fit)]
        best = good[0] if good and len(taken) < MOST else None
        if best is None:
            chosen = pruned(trial, chosen)
        beside, gain = _beside(trial, chosen, found, shaken)
        clear = best is not None and best.gain > CLEAR
        if shaken and not states and not clear and beside.keys != calm_beside:
            progress("looking for gusts and waves")
            # What explains more is taken first.
            least = max(WORTH, (0.0 if best is None else best.gain) - gain)
            rough, found_states = disturbed(trial, beside, shaken, calm, least)
            # What would stand in for them falls, and what they hid may show.
            kept = pruned(rough, fit(rough, beside.suspects, beside.values)) if found_states else chosen
            if found_states and _has_what_they_shake(kept, found_states):
                stood = beside.keys
                trial, chosen, states = rough, kept, found_states
                continue
            calm_beside = beside.keys if least <= WORTH else calm_beside
        if best is None:
            break
        trial = trial.with_noise_of(best.fit)
        chosen = timed(trial, fit(trial, best.fit.suspects, best.fit.values))
    if states and chosen.keys != stood:
        trial, states = disturbed(trial, chosen, shaken, calm, near=states)
        chosen = pruned(trial, fit(trial, chosen.suspects, chosen.values))
    if states:
        chosen = timed(trial, chosen)
    return Search(trial, fit(trial, ()), chosen, tuple(rounds), untested, states)


def rejudged(trial: Trial, made: Fit) -> Fit:
    """Return a fit with the evidence that it has under the noise that it leaves itself: with that two are fairly compared."""
    fair = trial.with_noise_of(made)
    return fit(fair, made.suspects, made.values, begin=near(fair, made))


def _has_what_they_shake(made: Fit, states: Sequence[State]) -> bool:
    there = {"", *(suspect.effect.id for suspect in made.suspects)}
    return all(state.suspect.effect.about in there for state in states)


def _beside(trial: Trial, chosen: Fit, found: Sequence[Candidate], shaken: Sequence[Suspect]) -> tuple[Fit, float]:
    """Return the fit beside which disturbances are looked for, and its evidence over what is chosen.

    What one of them comes and goes about, a wind's gusts, hides it and is hidden by it: the two are judged together.
    """
    about = {suspect.effect.about for suspect in shaken}
    for one in found:
        if one.suspect.effect.id in about:
            return fit(trial, one.fit.suspects, one.fit.values), one.gain
    return chosen, 0.0


def _weighed(trial: Trial, chosen: Fit, suspects: Sequence[Suspect]) -> list[Candidate]:
    """Return what each suspect adds to those chosen already, the best first."""
    current = fit(trial, chosen.suspects, chosen.values)
    begin = near(trial, current)
    ground = ground_of(trial, current, begin)
    found = over(partial(_best, trial, current, begin, ground), suspects)
    found.sort(key=lambda one: -one.gain)
    fair = over(partial(_fairly, trial), found[:REJUDGED])
    return sorted([*fair, *found[REJUDGED:]], key=lambda one: -one.gain)


def _fairly(trial: Trial, one: Candidate) -> Candidate:
    made = rejudged(trial, fit(trial, one.fit.suspects, one.fit.values))
    return replace(one, fit=made, gain=max(one.gain, one.gain + made.evidence - one.fit.evidence))


def _best(trial: Trial, current: Fit, begin: Near, ground: Ground, suspect: Suspect) -> Candidate:
    """Return a suspect's best fit beside the current ones, over all spans where it can begin or end."""

    def candidate(made: Fit) -> Candidate:
        gain = made.evidence - current.evidence
        return Candidate(made.suspects[-1], made, gain)

    def tried(one: Suspect, values: Floats | None = None) -> Candidate:
        start = (*current.values, one.start if values is None else values)
        # Where the hull has strained to stand in for an effect that multiplies it, the way to both leads from the profile's.
        afar = one.effect.bends_hull and not one.times
        made = fit(trial, (*current.suspects, one), start, steps=FAR if afar else GLANCE, begin=None if afar else begin)
        return candidate(made)

    suspect = settled(trial, current, suspect)
    whole = tried(suspect)
    if not suspect.effect.onset:
        return whole
    # The kick of an onset shows within seconds of it only; what is changed from then on leads there.
    smooth = replace(suspect, effect=replace(suspect.effect, kick=None))
    spans = [tried(one) for one in promising(trial, ground, smooth)]
    index, step = len(current.suspects), 0.5 * part_s(trial, suspect)

    def refined(one: Candidate) -> Candidate:
        coarse = sharpened(trial, one.fit, index, begin, step, NEARBY_S)
        kicked = tried(replace(coarse.suspects[-1], effect=suspect.effect), coarse.values[-1])
        return candidate(sharpened(trial, kicked.fit, index, begin, min(step, NEARBY_S)))

    # Seconds matter: which of them is best shows when each has its own.
    good = [one for one in spans if one.gain > max(whole.gain, 0.5 * ODDS)]
    return max([whole, *(refined(one) for one in good)], key=lambda one: one.gain)


def _round(found: Sequence[Candidate]) -> Round:
    top = max([ODDS, *(one.gain for one in found)])
    weights = [exp(one.gain - top) for one in found]
    none = exp(ODDS - top)
    total = sum(weights) + none
    return Round(tuple(found), tuple(weight / total for weight in weights), none / total)


def void(trial: Trial, made: Fit, index: int = -1) -> bool:
    """Tell whether an effect of a fit, the last one if not another, moves the vessel too little to matter to anybody."""
    suspect, seen = made.suspects[index], trial.windows
    named = zip(made.values[index].tolist(), suspect.parameters, strict=True)
    untold = suspect.effect.untold(trial.plain.scene, made.values[index])
    away = [
        abs(value - one.neutral)
        for value, one in named
        if one.unit == suspect.parameters[0].unit and one.name not in untold
    ]
    if max(away) < suspect.effect.idle:
        return True
    others = [k for k in range(len(made.suspects)) if k != index % len(made.suspects)]
    before = replace(
        made, suspects=tuple(made.suspects[k] for k in others), values=tuple(made.values[k] for k in others)
    )
    moved = seen.gap(imagined(trial.plain, made)) - seen.gap(imagined(trial.plain, before))
    size = np.sqrt(np.mean(seen.measured[:, seen.channels] ** 2, axis=0))
    return bool((np.sqrt(np.mean(moved**2, axis=0)) < VOID * size).all())


def pruned(trial: Trial, chosen: Fit) -> Fit:
    """Drop one by one what the others explain as well without it."""
    while chosen.suspects:
        fewer = over(partial(without, trial, chosen), range(len(chosen.suspects)))
        best = max(over(partial(rejudged, trial), fewer), key=lambda one: one.evidence)
        if max(chosen.evidence, rejudged(trial, chosen).evidence) - best.evidence >= ODDS:
            break
        chosen = best
    return chosen
