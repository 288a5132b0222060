"""What else could stand in a finding's place, and how probable that leaves the finding."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp

from ferryid.diagnose.inference.estimation import Fit, Suspect, Trial, fit, near, settled, without
from ferryid.diagnose.inference.onset_estimation import brief
from ferryid.diagnose.inference.search import FAR, ODDS
from ferryid.diagnose.parallel import over

NEAREST = 4
"""Rivals that are fitted to the end."""


@dataclass(frozen=True)
class StandIn:
    """Another suspect in the place of one that was found.

    Attributes
    ----------
    suspect
        What it is.
    fit
        Of it beside the others that were found.
    gain
        Its evidence over that of what was found.
    """

    suspect: Suspect
    fit: Fit
    gain: float


@dataclass(frozen=True)
class Standing:
    """How one of several suspects stands beside the others.

    Attributes
    ----------
    rivals
        The best first.
    probability
        Of the suspect, over its rivals and none of them.
    """

    rivals: tuple[StandIn, ...]
    probability: float


def standing_of(trial: Trial, kept: Fit, index: int, library: Sequence[Suspect]) -> Standing:
    """Return how a suspect stands against every other of the library in its place, in its span.

    One that is too brief to be judged is weighed against none at all only: it is no name, whatever else could stand there.
    """
    suspect = kept.suspects[index]
    bare = without(trial, kept, index)
    none = exp(min(bare.evidence - kept.evidence + ODDS, 50.0))
    if brief(trial, suspect):
        return Standing((), 1.0 / (1.0 + none))
    begin = near(trial, bare)
    taken = {one.key for one in kept.suspects}

    def instead(other: Suspect) -> StandIn:
        timed = replace(other, onset_s=suspect.onset_s, offset_s=suspect.offset_s) if other.effect.onset else other
        stand_in = settled(trial, bare, timed)
        start = [*bare.values, stand_in.start]
        made = fit(
            trial, [*bare.suspects, stand_in], start, steps=FAR, begin=None if stand_in.effect.bends_hull else begin
        )
        return StandIn(stand_in, made, made.evidence - kept.evidence)

    def settled_in(one: StandIn) -> StandIn:
        made = fit(trial, one.fit.suspects, one.fit.values, begin=near(trial, one.fit))
        return StandIn(one.suspect, made, made.evidence - kept.evidence)

    rivals = over(instead, [other for other in library if other.key not in taken])
    rivals.sort(key=lambda one: -one.gain)
    # How far behind the others are does not matter to the digit.
    rivals[:NEAREST] = over(settled_in, rivals[:NEAREST])
    rivals.sort(key=lambda one: -one.gain)
    against = none + sum(exp(min(one.gain, 50.0)) for one in rivals)
    return Standing(tuple(rivals), 1.0 / (1.0 + against))
