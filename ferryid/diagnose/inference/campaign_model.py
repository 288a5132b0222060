"""Several logs of one vessel as one model: what is common to them, what each has of its own, and the gaps that this leaves.

References
----------
Fossen (2021), section 6.5, for cross-flow drag and lift.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ferryid.diagnose.inference.estimation import Candidate, apply_candidates
from ferryid.diagnose.inference.weak_form import Windows
from ferryid.effects.effect import Parameter
from ferryid.effects.force_model import COEFFICIENTS, ForceModel, unloaded
from ferryid.types import Floats, Ints

INDUCED = ("X_vr", "X_vv")
"""Drag of drift and turning, beside `COEFFICIENTS`."""
DIFFERENCE_STEP = 0.02
"""Of a size, for derivatives."""


@dataclass(frozen=True)
class Member:
    """One log of a vessel: its windows, its force model without effects, and the conditions that it has of its own.

    Where groups of logs are compared, `group` is its group's name: properties of another group do not act in it.
    """

    windows: Windows
    plain: ForceModel
    conditions: tuple[Candidate, ...] = ()
    group: str = ""


@dataclass(frozen=True)
class HullPrior:
    """What is believed of the hull before any log: `COEFFICIENTS` and `INDUCED`, mean and standard deviations, shape (h,).

    `known` is False where nobody has modelled it, so that it comes from the logs alone; `together` is the root of their
    correlation matrix, shape (h, h), where a fitted model brings it, and they are independent where None.
    """

    mean: Floats
    spread: Floats
    known: bool = True
    together: Floats | None = None

    @cached_property
    def free(self) -> Ints:
        """Which of them can move."""
        return np.flatnonzero(self.spread)

    @cached_property
    def root(self) -> Floats:
        """What turns the vector that is estimated, of unit variance, into departures from the mean, shape (h, h)."""
        root = np.eye(len(self.spread)) if self.together is None else self.together
        return np.asarray(self.spread[:, None] * root)


@dataclass(frozen=True)
class Spreads:
    """Standard deviations between logs: of each condition, in sizes, and of the steady accelerations, shape (3,)."""

    conditions: tuple[float, ...]
    steady: Floats


@dataclass(frozen=True)
class Campaign:
    """Logs with the belief about their hull: what is estimated together.

    The vector of all logs, shape (g,), holds the hull in spreads, what conditions share, properties, and the conditions'
    means, in sizes; that of a log, shape (l,), its conditions' departures from these means, in sizes, and its steady
    acceleration.
    """

    members: tuple[Member, ...]
    hull: HullPrior
    properties: tuple[Candidate, ...] = ()

    @cached_property
    def conditions(self) -> tuple[Candidate, ...]:
        """Every condition that some log has, in a fixed order."""
        found = {one.key: one for member in self.members for one in member.conditions}
        return tuple(found[key] for key in sorted(found, key=str))

    @cached_property
    def shared(self) -> list[tuple[int, Parameter]]:
        """What conditions share: which condition, and the parameter."""
        return [
            (k, one)
            for k, condition in enumerate(self.conditions)
            for one in condition.parameters
            if one.name not in condition.effect.of_log
        ]

    @cached_property
    def own(self) -> list[tuple[int, Parameter]]:
        """What every log has of its own: which condition, and the parameter."""
        return [
            (k, one)
            for k, condition in enumerate(self.conditions)
            for one in condition.parameters
            if one.name in condition.effect.of_log
        ]

    @cached_property
    def lasting(self) -> list[Parameter]:
        """Parameters of the properties."""
        return [one for candidate in self.properties for one in candidate.parameters]

    @property
    def g(self) -> int:
        """Length of the vector of all logs."""
        return len(self.hull.mean) + len(self.shared) + len(self.lasting) + len(self.own)

    @property
    def l(self) -> int:  # noqa: E743
        """Length of the vector of a log."""
        return len(self.own) + 3

    @property
    def means(self) -> slice:
        """Where the conditions' means stand in the vector of all logs."""
        return slice(self.g - len(self.own), self.g)

    def values(self, common: Floats, own: Floats) -> tuple[list[Floats], list[Floats]]:
        """Return the parameters of the conditions of a log and of the properties, in their units and within their limits."""
        means = common[self.means] + own[: len(self.own)]
        every = np.concatenate([common[len(self.hull.mean) : self.g - len(self.own)], means])
        first, limits, cuts = self._layout
        neutral, size, low, high = limits
        found = np.split(np.clip(neutral + size * every[first], low, high), cuts)
        return found[: len(self.conditions)], found[len(self.conditions) : len(self.conditions) + len(self.properties)]

    @cached_property
    def _layout(self) -> tuple[Ints, Floats, list[int]]:
        """Where parameters of conditions and properties stand among what is shared, lasting, and a log's own, in this order.

        Beside the places their neutral values, sizes and limits, shape (4, p), and where one condition or property ends.
        """
        shared, own = iter(range(len(self.shared))), iter(range(len(self.own)))
        lasting = iter(range(len(self.shared), len(self.shared) + len(self.lasting)))
        behind = len(self.shared) + len(self.lasting)
        places = [
            behind + next(own) if one.name in condition.effect.of_log else next(shared)
            for condition in self.conditions
            for one in condition.parameters
        ]
        places += [next(lasting) for _ in self.lasting]
        every = [*self.conditions, *self.properties]
        rows = [(one.neutral, one.size, one.low, one.high) for candidate in every for one in candidate.parameters]
        cuts = np.cumsum([len(one.parameters) for one in every]).tolist()
        return np.array(places, dtype=np.int64), np.array(rows).reshape(-1, 4).T, cuts

    def force_model(self, i: int, common: Floats, own: Floats) -> ForceModel:
        """Return a log's force model at an estimate, without its steady acceleration."""
        member, n = self.members[i], len(COEFFICIENTS)
        hull = self.hull.mean + self.hull.root @ common[: len(self.hull.mean)]
        modelled = induced(replace(member.plain, hull=hull[:n]), hull[n:])
        return self.acted(modelled, member.conditions, common, own, member.group)

    def acted(
        self, modelled: ForceModel, conditions: Sequence[Candidate], common: Floats, own: Floats, group: str = ""
    ) -> ForceModel:
        """Return a force model in which a log's conditions and the properties of all logs and of its group act."""
        values, lasting = self.values(common, own)
        here = {one.key: one for one in conditions}
        candidates = [here[one.key] for one in self.conditions if one.key in here]
        mine = [p for one, p in zip(self.conditions, values, strict=True) if one.key in here]
        pairs = zip(self.properties, lasting, strict=True)
        act = [(one, p) for one, p in pairs if one.group in ("", group)]
        return apply_candidates(modelled, [*candidates, *(one for one, _ in act)], [*mine, *(p for _, p in act)])

    def gap(self, i: int, common: Floats, own: Floats) -> Floats:
        """Return the gaps of a log along the vessel's axes, shape (J, 3)."""
        member = self.members[i]
        return member.windows.along_vessel(member.windows.gap(self.force_model(i, common, own))) + own[-3:]

    def hull_slopes(self, i: int, common: Floats, own: Floats) -> Floats:
        """Return derivatives of the gaps of a log by the hull in spreads, shape (J, 3, h)."""
        member, n = self.members[i], len(COEFFICIENTS)
        slopes = np.zeros((len(member.windows.starts), 3, len(self.hull.mean)))
        free = self.hull.free[self.hull.free < n]
        moves = DIFFERENCE_STEP * self.hull.spread[free]
        force_model, windows = self.force_model(i, common, own), member.windows
        changes = windows.hull_changes(force_model, free, moves)
        slopes[:, :, free] = windows.along_vessel(changes) / DIFFERENCE_STEP
        rest = self.hull.free[self.hull.free >= n]
        if rest.size and force_model.measurements is windows.measurements and unloaded(force_model):
            # A force ahead, of which the mass alone makes an acceleration.
            drag = windows.along_vessel(windows.drift_responses)[:, :, rest - n] / force_model.hull[0]
            slopes[:, :, rest] = drag * self.hull.spread[rest]
        elif rest.size:
            here = self.gap(i, common, own)
            for k in rest.tolist():
                slopes[:, :, k] = (self.gap(i, _moved(common, k), own) - here) / DIFFERENCE_STEP
        return slopes if self.hull.together is None else slopes @ self.hull.together

    def linearised(self, i: int, common: Floats, own: Floats, hull_slopes: Floats) -> tuple[Floats, Floats]:
        """Return the gaps of a log and their derivatives by both vectors, shapes (J, 3) and (J, 3, g + l)."""
        gaps, h, m = self.gap(i, common, own), len(self.hull.mean), len(self.own)
        slopes = np.zeros((*gaps.shape, self.g + self.l))
        slopes[:, :, :h] = hull_slopes
        for k in range(h, self.g - m):
            slopes[:, :, k] = (self.gap(i, _moved(common, k), own) - gaps) / DIFFERENCE_STEP
        for k in range(m):
            # A wind near none has no slope to one side of what it has to the other: both count.
            ahead, astern = (self.gap(i, common, _moved(own, k, sign)) for sign in (1.0, -1.0))
            slopes[:, :, self.g - m + k] = slopes[:, :, self.g + k] = (ahead - astern) / (2.0 * DIFFERENCE_STEP)
        slopes[:, :, -3:] = np.eye(3)
        return gaps, slopes

    def own_precision(self, spreads: Spreads) -> Floats:
        """Return what is believed of the vector of a log: inverse variances, shape (l,)."""
        mine = [spreads.conditions[k] for k, _ in self.own]
        return np.concatenate([mine, spreads.steady]) ** -2.0


def induced(force_model: ForceModel, coefficients: Floats) -> ForceModel:
    """Return the force model with induced drag in it, from coefficients in the order of `INDUCED`; in still water.

    It is an external force at the measured motion.
    """
    X_vr, X_vv = coefficients
    if X_vr == 0.0 and X_vv == 0.0:
        return force_model
    _, v, r = force_model.measurements.nu.T
    external = force_model.external.copy()
    external[:, 0] += (X_vr * r + X_vv * v) * v
    return replace(force_model, external=external)


def induced_spread(length_m: float, draught_m: float, water_density: float = 1000.0) -> Floats:
    """Return how large the coefficients of `INDUCED` may be, shape (2,): a flat plate's."""
    plate = 0.5 * water_density * length_m * draught_m
    return np.array([plate * length_m / 2.0, plate / 2.0])


def _moved(vector: Floats, k: int, sign: float = 1.0) -> Floats:
    moved = vector.copy()
    moved[k] += sign * DIFFERENCE_STEP
    return moved
