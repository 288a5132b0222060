"""Several logs of one vessel as one model: what is common to them, what each has of its own, and the gaps that this leaves.

References
----------
Fossen (2021), section 6.5, for cross-flow drag and lift.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from ferryid.cached import cached_property
from ferryid.diagnose.inference.campaign_logs import Member, Stack, stacked
from ferryid.diagnose.inference.candidate import Candidate, apply_candidates
from ferryid.effects.effect import Parameter
from ferryid.effects.force_model import COEFFICIENTS, ForceModel, unloaded
from ferryid.side_by_side import over
from ferryid.types import Floats, Ints

T = TypeVar("T")

INDUCED = ("X_vr", "X_vv")
"""Drag of drift and turning, beside `COEFFICIENTS`."""
DIFFERENCE_STEP = 0.02
"""Of a size, for derivatives."""


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
    """Standard deviations between logs: of each condition, in sizes, and of the steady accelerations, shape (3,).

    Where logs fall into sessions, `conditions` are those between the logs of one, and `sessions` those between them.
    """

    conditions: tuple[float, ...]
    steady: Floats
    sessions: tuple[float, ...] = ()


@dataclass(frozen=True)
class Campaign:
    """Logs with the belief about their hull: what is estimated together.

    The vector of all logs, shape (g,), holds the hull in spreads, what conditions share, properties, the conditions' means, in
    sizes, and by how much those of each session depart from them; that of a log, shape (l,), its conditions' departures from
    the means of all logs, in sizes, and its steady acceleration. `sessions` numbers the session of each log; logs of one
    session are near in time, so that their conditions are more alike than those of different ones. Empty where times are not
    known. `order` holds the places of the logs in order of time, or as they were given where their times are no dates.
    """

    members: tuple[Member, ...]
    hull: HullPrior
    properties: tuple[Candidate, ...] = ()
    sessions: tuple[int, ...] = ()
    order: tuple[int, ...] = ()

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
        return int(self.means.stop) + self.session_count * len(self.own)

    @cached_property
    def session_count(self) -> int:
        """How many sessions there are; 0 where all logs are of one, or each is of its own: a session says nothing then."""
        count = len(set(self.sessions))
        return count if 1 < count < len(self.sessions) else 0

    @property
    def l(self) -> int:  # noqa: E743
        """Length of the vector of a log."""
        return len(self.own) + 3

    @property
    def means(self) -> slice:
        """Where the conditions' means stand in the vector of all logs."""
        first = len(self.hull.mean) + len(self.shared) + len(self.lasting)
        return slice(first, first + len(self.own))

    def values(self, common: Floats, own: Floats) -> tuple[list[Floats], list[Floats]]:
        """Return the parameters of the conditions of a log and of the properties, in their units and within their limits.

        Of several logs, with `own` of shape (L, l), those of the conditions have a row for each.
        """
        means = common[self.means] + own[..., : len(self.own)]
        fixed = common[len(self.hull.mean) : self.means.start]
        every = np.concatenate([np.broadcast_to(fixed, (*means.shape[:-1], len(fixed))), means], axis=-1)
        first, limits, cuts = self._layout
        neutral, size, low, high = limits
        found = np.split(np.clip(neutral + size * every[..., first], low, high), cuts, axis=-1)
        lasting = found[len(self.conditions) : len(self.conditions) + len(self.properties)]
        return found[: len(self.conditions)], lasting if own.ndim == 1 else [one[0] for one in lasting]

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

    @cached_property
    def stacks(self) -> tuple[Stack, ...]:
        """The logs as they are worked out, short ones one after another."""
        return stacked(self.members, self.properties)

    def force_model(self, i: int, common: Floats, own: Floats) -> ForceModel:
        """Return a log's force model at an estimate, without its steady acceleration."""
        return self._modelled(Stack((i,), self.members[i]), common, own)

    def _modelled(self, stack: Stack, common: Floats, own: Floats) -> ForceModel:
        member, n = stack.member, len(COEFFICIENTS)
        hull = self.hull.mean + self.hull.root @ common[: len(self.hull.mean)]
        modelled = induced(replace(member.plain, hull=hull[:n]), hull[n:])
        return self.acted(modelled, member.conditions, common, own, member.group, stack.rows)

    def acted(
        self,
        modelled: ForceModel,
        conditions: Sequence[Candidate],
        common: Floats,
        own: Floats,
        group: str = "",
        rows: Ints | None = None,
    ) -> ForceModel:
        """Return a force model in which a log's conditions and the properties of all logs and of its group act.

        Of several logs one after another, `own` has a row for each, and `rows` tells which of them each row is of.
        """
        values, lasting = self.values(common, own)
        here = {one.key: one for one in conditions}
        candidates = [here[one.key] for one in self.conditions if one.key in here]
        mine = [p for one, p in zip(self.conditions, values, strict=True) if one.key in here]
        if rows is not None:
            mine = [p[rows] for p in mine]
        pairs = zip(self.properties, lasting, strict=True)
        act = [(one, p) for one, p in pairs if one.group in ("", group)]
        return apply_candidates(modelled, [*candidates, *(one for one, _ in act)], [*mine, *(p for _, p in act)])

    def gap(self, i: int, common: Floats, own: Floats) -> Floats:
        """Return the gaps of a log along the vessel's axes, shape (J, 3)."""
        return self._gaps(Stack((i,), self.members[i]), common, own)

    def _gaps(self, stack: Stack, common: Floats, own: Floats) -> Floats:
        windows = stack.member.windows
        gaps = windows.along_vessel(windows.gap(self._modelled(stack, common, own)))
        return np.asarray(gaps + stack.by_window(own[..., -3:]))

    def gaps(self, common: Floats, own: Floats) -> list[Floats]:
        """Return the gaps of every log along the vessel's axes, shape (J, 3) each, by the vectors of all, shape (L, l)."""
        return self._by_log(lambda stack: stack.parted(self._gaps(stack, common, stack.own(own))))

    def _by_log(self, worked: Callable[[Stack], Sequence[T]]) -> list[T]:
        """Return what is worked out of stacks, log by log."""
        found = over(worked, self.stacks)
        pairs = [
            pair for stack, ones in zip(self.stacks, found, strict=True) for pair in zip(stack.logs, ones, strict=True)
        ]
        return [one for _, one in sorted(pairs, key=lambda pair: pair[0])]

    def hull_slopes(self, common: Floats, own: Floats) -> list[Floats]:
        """Return derivatives of the gaps of every log by the hull in spreads, shape (J, 3, h) each."""
        return self._by_log(lambda stack: stack.parted(self._hull_slopes(stack, common, stack.own(own))))

    def _hull_slopes(self, stack: Stack, common: Floats, own: Floats) -> Floats:
        windows, n = stack.member.windows, len(COEFFICIENTS)
        slopes = np.zeros((len(windows.starts), 3, len(self.hull.mean)))
        free = self.hull.free[self.hull.free < n]
        moves = DIFFERENCE_STEP * self.hull.spread[free]
        force_model = self._modelled(stack, common, own)
        changes = windows.hull_changes(force_model, free, moves)
        slopes[:, :, free] = windows.along_vessel(changes) / DIFFERENCE_STEP
        rest = self.hull.free[self.hull.free >= n]
        if rest.size and force_model.measurements is windows.measurements and unloaded(force_model):
            # A force ahead, of which the mass alone makes an acceleration.
            drag = windows.along_vessel(windows.drift_responses)[:, :, rest - n] / force_model.hull[0]
            slopes[:, :, rest] = drag * self.hull.spread[rest]
        elif rest.size:
            here = self._gaps(stack, common, own)
            for k in rest.tolist():
                slopes[:, :, k] = (self._gaps(stack, _moved(common, k), own) - here) / DIFFERENCE_STEP
        return slopes if self.hull.together is None else slopes @ self.hull.together

    def linearised(
        self, common: Floats, own: Floats, hull_slopes: Sequence[Floats] | None = None
    ) -> list[tuple[Floats, Floats]]:
        """Return the gaps of every log and their derivatives by both vectors, shapes (J, 3) and (J, 3, g + l).

        `hull_slopes` are those by the hull, worked out where None.
        """
        by_hull = self.hull_slopes(common, own) if hull_slopes is None else hull_slopes

        def worked(stack: Stack) -> list[tuple[Floats, Floats]]:
            gaps, slopes = self._linearised(stack, common, stack.own(own))
            slopes[:, :, : len(self.hull.mean)] = np.concatenate([by_hull[i] for i in stack.logs])
            return list(zip(stack.parted(gaps), stack.parted(slopes), strict=True))

        return self._by_log(worked)

    def _linearised(self, stack: Stack, common: Floats, own: Floats) -> tuple[Floats, Floats]:
        """Return gaps and derivatives, those by the hull left open."""
        gaps, h, m = self._gaps(stack, common, own), len(self.hull.mean), len(self.own)
        slopes = np.zeros((*gaps.shape, self.g + self.l))
        for k in range(h, self.means.start):
            slopes[:, :, k] = (self._gaps(stack, _moved(common, k), own) - gaps) / DIFFERENCE_STEP
        for k in range(m):
            # A wind near none has no slope to one side of what it has to the other: both count.
            ahead, astern = (self._gaps(stack, common, _moved(own, k, sign)) for sign in (1.0, -1.0))
            slopes[:, :, self.means.start + k] = slopes[:, :, self.g + k] = (ahead - astern) / (2.0 * DIFFERENCE_STEP)
        slopes[:, :, -3:] = np.eye(3)
        return gaps, slopes

    def session_rows(self, session: int) -> slice:
        """Return where the departures of a session stand in the vector of all logs."""
        first = self.means.stop + session * len(self.own)
        return slice(first, first + len(self.own))

    def common_precision(self, spreads: Spreads) -> Floats:
        """Return what is believed of the vector of all logs: inverse variances about zero, shape (g,)."""
        every = [spreads.sessions[k] for _ in range(self.session_count) for k, _ in self.own]
        return np.concatenate([np.ones(self.means.stop), np.array(every) ** -2.0])

    def own_belief(self, i: int, spreads: Spreads) -> Floats:
        """Return what is believed of the vector of a log as equations, shape (l, g + l).

        Their products with both vectors are errors of unit variance: a log's departures are near those of its session.
        """
        precise = self.own_precision(spreads) ** 0.5
        equations = np.hstack([np.zeros((self.l, self.g)), np.diag(precise)])
        if self.session_count:
            of_session = range(*self.session_rows(self.sessions[i]).indices(self.g))
            for row, column in enumerate(of_session):
                equations[row, column] = -precise[row]
        return equations

    def own_precision(self, spreads: Spreads) -> Floats:
        """Return inverse variances of the vector of a log about where its session is, shape (l,)."""
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
    moved[..., k] += sign * DIFFERENCE_STEP
    return moved
