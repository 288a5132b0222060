"""An effect that may act in a log, with its parameters and the time in which it acts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from math import inf, isfinite

import numpy as np

from ferryid.cached import cached_property
from ferryid.effects.effect import Effect, Parameter
from ferryid.effects.force_model import ForceModel, Measurements
from ferryid.effects.wording import titled
from ferryid.types import Floats
from ferryid.vessel.profile import Profile

START_SHARES = (3.0, 2.0, 1.0, 0.75, 0.5, 0.25)
"""Shares of the way from neutral to its start at which an effect with the end of a range is weighed, as its slope is local."""


@dataclass(frozen=True, eq=False)
class OtherHeading:
    """A heading that a vessel did not have, psi [rad], shape (n,)."""

    psi: Floats
    _last: list[tuple[Measurements, Measurements, Floats, Floats]] = field(default_factory=list, repr=False)

    def of(self, measurements: Measurements) -> tuple[Measurements, Floats, Floats]:
        """Return the measurements with this heading, and cosine and sine of the angle from it to theirs, shape (n,) each.

        Those asked for last are kept, with the loads that were worked out.
        """
        last = self._last[0] if self._last else None
        if last is None or last[0] is not measurements:
            other = replace(measurements, eta=np.column_stack([measurements.eta[:, :2], self.psi]))
            apart = measurements.psi - self.psi
            last = measurements, other, np.cos(apart), np.sin(apart)
            # A list at once: threads share it.
            self._last[:] = [last]
        return last[1:]

    def acted(self, act: Callable[[ForceModel], ForceModel], force_model: ForceModel) -> ForceModel:
        """Return a force model in which something acts as if the vessel had had this heading."""
        other, cos, sin = self.of(force_model.measurements)
        acted = act(force_model.replaced(measurements=other))
        if acted.flow is force_model.flow or acted.flow is None:
            return force_model.replaced(external=acted.external)
        # Water that meets the other heading from where it would have met this one.
        north, east = acted.flow.T
        flow = np.column_stack([cos * north - sin * east, sin * north + cos * east])
        return force_model.replaced(external=acted.external, flow=flow)


@dataclass(frozen=True)
class Candidate:
    """An effect in one instance; `log_alternatives` as in `ferryid.effects.effect.Choice`, with `Effect.log_rarity`.

    It acts from `onset_s` (0: from the start of the log) until `offset_s` (infinite: to its end), in a campaign in the logs of
    one group, or of all where `group` is empty. One that cannot be true acts on a `heading` that the vessel did not have.
    """

    effect: Effect
    instance: str | None
    parameters: tuple[Parameter, ...]
    onset_s: float = 0.0
    offset_s: float = inf
    log_alternatives: float = 0.0
    group: str = ""
    heading: OtherHeading | None = field(default=None, compare=False, repr=False)

    @classmethod
    def of(cls, effect: Effect, instance: str | None, profile: Profile) -> Candidate:
        """Return an effect with the parameters and the prior odds that it has on a vessel."""
        return cls(effect, instance, effect.parameters_of(profile), log_alternatives=effect.log_rarity(profile))

    @property
    def times(self) -> tuple[str, ...]:
        """Which of the two ends of its span lie within the log."""
        return (*(("onset_s",) if self.onset_s > 0.0 else ()), *(("offset_s",) if isfinite(self.offset_s) else ()))

    def moved(self, end: str, time_s: float) -> Candidate:
        """Return the candidate with one of its `times` elsewhere."""
        return replace(self, onset_s=time_s) if end == "onset_s" else replace(self, offset_s=time_s)

    @property
    def key(self) -> tuple[str, str | None]:
        """Effect and instance."""
        return self.effect.id, self.instance

    @property
    def is_step(self) -> bool:
        """True for a step between two levels, of which the second stays where it is taken away."""
        return self.effect.otherwise is not None

    def as_step(self, profile: Profile) -> Candidate:
        """Return it as a step between two levels in its span, where its effect has that form."""
        step = self.effect.step
        return self if step is None else replace(self, effect=step, parameters=step.parameters_of(profile))

    @property
    def title(self) -> str:
        """The effect's title, with the thruster that it is one of."""
        return titled(self.effect.title, self.instance)

    @property
    def start(self) -> Floats:
        """Parameters with which a search begins."""
        return np.array([one.neutral if one.start is None else one.start for one in self.parameters])

    @property
    def start_shares(self) -> tuple[float, ...]:
        """Shares of the way from neutral to `start` where a search may begin: several, where a slope tells of one alone."""
        if not self.effect.piecewise:
            return (1.0,)
        low, high = (np.array([getattr(one, end) for one in self.parameters]) for end in ("low", "high"))
        starts = ((share, self.start_at(share)) for share in START_SHARES)
        return tuple(share for share, start in starts if ((low <= start) & (start <= high)).all())

    def start_at(self, share: float) -> Floats:
        """Return parameters at a share of the way from neutral to `start`."""
        neutral = np.array([one.neutral for one in self.parameters])
        return np.asarray(neutral + share * (self.start - neutral))

    def act(self, force_model: ForceModel, p: Floats) -> ForceModel:
        """Return the force model with the effect in it."""
        if self.heading is not None:
            return self.heading.acted(lambda other: replace(self, heading=None).act(other, p), force_model)
        return self.effect.act(force_model, p, self.instance, self.onset_s, self.offset_s)

    def act_again(self, force_model: ForceModel, p: Floats, before: ForceModel, after: ForceModel) -> ForceModel:
        """Return `act`, of an effect that led with the same parameters from another force model to a third.

        What it reads and changes, where the first two have it in common, is that of the third.
        """
        touched = self.touched
        if touched is None or any(getattr(force_model, name) is not getattr(before, name) for name in touched):
            return self.act(force_model, p)
        return force_model.replaced(**{name: getattr(after, name) for name in touched})

    @cached_property
    def touched(self) -> frozenset[str] | None:
        """`Effect.touched`."""
        return self.effect.touched


def apply_candidates(force_model: ForceModel, candidates: Sequence[Candidate], values: Sequence[Floats]) -> ForceModel:
    """Return the force model with some candidates in it, each in its turn."""
    for i in acting_order(candidates):
        force_model = candidates[i].act(force_model, values[i])
    return force_model


def acting_order(candidates: Sequence[Candidate]) -> list[int]:
    """Return the places of candidates in the order in which they act; of those that may act last, large ones at the end."""

    def turn(i: int) -> tuple[int, int]:
        effect = candidates[i].effect
        return effect.order, len(candidates[i].parameters) if effect.acts_last else 0

    return sorted(range(len(candidates)), key=turn)
