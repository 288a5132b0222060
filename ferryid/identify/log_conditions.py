"""Conditions of single logs: wind that nobody measured, estimated together with the hull that all logs share.

Without it a breeze ends up in the hull: its load changes with heading and speed as damping, Coriolis force and a steady moment
do. Every log has its own mean wind, gusts about it (a first-order process), and its own steady force along the hull, north and
east, as random effects whose spreads are estimated (Laird and Ware 1982); hull and conditions are found together by
Gauss-Newton steps, with the logs' part eliminated from the normal equations. What is estimated is then treated as if it had
been measured, and the hull's covariance keeps what that leaves uncertain.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ferryid.identify.gusts import MANY_WINDOWS, GustEquations, Gusts
from ferryid.identify.outcome import LogWind
from ferryid.identify.some_logs import some_logs
from ferryid.identify.thresholds import IDENTIFY
from ferryid.identify.weak_rows import WeakRows
from ferryid.identify.window_loads import BlownLoad, Load, LoadSamples
from ferryid.models.forces import ACCELERATIONS
from ferryid.regression import STRIDES
from ferryid.side_by_side import over
from ferryid.types import Flags, Floats, Ints
from ferryid.vessel.profile import Profile

_DIRECTIONS = 8
_SPEEDS = (1.0, 3.0, 8.0)
"""Speeds at which the search starts [m/s]: at rest in still air the load has no slope."""
_START_WINDOWS = 500
"""Windows of a log, evenly spaced, in which the starts are compared."""

_SHARED = ("gains", "intercept", "sigma", "noise", "factor", "offset_spread", "wind_spread", "force_spread")
"""What an estimate of several logs shares between them, by the names in `_Problem`."""


@dataclass(frozen=True, eq=False)
class Conditions:
    """Wind of L logs, mean and gusts.

    Attributes
    ----------
    wind
        Mean wind north and east, where the air goes to [m/s], shape (L, 2); NaN where it is measured or cannot be estimated.
    covariance
        Of it, shape (L, 2, 2), with that of hull and steady forces in it.
    spread_mps
        Standard deviation of a component of the mean wind between logs.
    gust_mps
        Standard deviation of a component of the gusts.
    load
        Wind load averaged over the training windows [N, N, N·m], (J, 3) each.
    added
        What the conditions add to the covariance of gains and intercept of the weak form, by axis, shape (3, K + 1, K + 1).
    blown
        The load as a function of the mean wind, of the logs whose wind is estimated, by their numbers.
    indistinct
        True where no wind is estimated, as hull, wind and steady forces of the logs cannot be told apart.
    start
        With what an estimate from other windows of the same logs may begin.
    """

    wind: Floats
    covariance: Floats
    spread_mps: float
    gust_mps: float
    load: tuple[Floats, ...]
    added: Floats
    blown: Mapping[int, BlownLoad] = field(default_factory=dict)
    indistinct: bool = False
    start: Start | None = None

    @classmethod
    def none(cls, windows: Sequence[WeakRows], K: int) -> Conditions:
        """Return that no log has conditions to estimate."""
        L = len(windows)
        return cls(
            np.full((L, 2), np.nan),
            np.full((L, 2, 2), np.nan),
            0.0,
            0.0,
            tuple(np.zeros((len(one), 3)) for one in windows),
            np.zeros((3, K + 1, K + 1)),
        )

    def listed(self, logs: Sequence[str]) -> tuple[LogWind, ...]:
        """Return the winds that were estimated, by the names of the logs."""
        return tuple(
            LogWind(log, (float(wind[0]), float(wind[1])), tuple(np.sqrt(np.diag(covariance)).tolist()))
            for log, wind, covariance in zip(logs, self.wind, self.covariance, strict=True)
            if np.isfinite(wind).all()
        )

    def applied(self, windows: Sequence[WeakRows]) -> tuple[WeakRows, ...]:
        """Return the training windows with the load, as if the wind had been measured."""
        return tuple(
            replace(one, steady=one.steady - load) if load.any() else one
            for one, load in zip(windows, self.load, strict=True)
        )


@dataclass(frozen=True, eq=False)
class Start:
    """With what an estimate begins that another one of the same logs has gone before.

    Attributes
    ----------
    wind
        Mean winds of the logs, shape (L, 2); NaN where none was estimated.
    shared
        Hull, spreads and noise, by the names that they have in `_Problem`.
    converged
        Whether another step would have changed nothing.
    settled
        Whether spreads and noise are to stay as they are: to find them takes most of the steps.
    """

    wind: Floats
    shared: Mapping[str, Any]
    converged: bool
    settled: bool = False


def estimate_conditions(
    profile: Profile,
    samples: Sequence[LoadSamples | None],
    windows: Sequence[WeakRows],
    length_s: float,
    zeta: float,
    terms: tuple[str, ...],
    mask: Flags,
    prior_spread: Floats,
    posed: Flags,
    start: Start | None = None,
) -> Conditions:
    """Estimate the steady wind of every log in which it was not measured.

    Parameters
    ----------
    profile
        The vessel; without wind areas there is nothing to estimate.
    samples
        Where the wind load of each log is evaluated; None where there is none to estimate.
    windows
        Training windows of each log.
    length_s
        Length of a window [s].
    zeta
        Factor on the measured force.
    terms, mask
        Names of the basis functions, and where they act, shape (K, 3).
    prior_spread
        Standard deviations of the gains of the weak form, shape (K, 3); infinite where nothing is known.
    posed
        Axes whose acceleration comes from poses, shape (3,).
    start
        What was found in other windows of the same logs; None where nothing was.
    """
    nothing = Conditions.none(windows, len(terms))
    areas = profile.wind
    if areas is None:
        return nothing
    many = sum(map(len, windows)) >= MANY_WINDOWS
    loads = {
        k: Load(areas, points, zeta, many=many)
        for k, (one, points) in enumerate(zip(windows, samples, strict=True))
        if points is not None and len(one) >= IDENTIFY.fewest_condition_windows
    }
    if not loads:
        return nothing
    problem = _Problem(windows, terms, mask, prior_spread, posed, length_s / STRIDES)
    wind, covariance = problem.solve(loads, start)
    if not problem.converged and problem.force_spread > IDENTIFY.most_steady_force:
        return replace(nothing, indistinct=True)
    return Conditions(
        wind,
        covariance,
        problem.wind_spread,
        problem.gusts.spread,
        tuple(
            loads[k].of(wind[k] + problem.gusts.found[k]) if k in loads else np.zeros((len(one), 3))
            for k, one in enumerate(windows)
        ),
        problem.added(),
        {k: BlownLoad(load, problem.gusts.found[k]) for k, load in loads.items()},
        start=Start(wind, problem.shared(), problem.converged),
    )


@dataclass(frozen=True, eq=False)
class _Equations:
    """Normal equations of one log: of the hull (P), of its own conditions (D), and between them, without its gusts.

    `bare` is that of the hull with all conditions known.
    """

    bare: Floats
    hull: Floats
    hull_right: Floats
    own: Floats
    right: Floats
    across: Floats
    columns: tuple[tuple[Ints, Floats], ...]
    gusts: Floats
    process: GustEquations

    @classmethod
    def of(
        cls,
        columns: tuple[tuple[Ints, Floats], ...],
        P: int,
        weight: Floats,
        prior: Floats,
        gusts: GustEquations,
    ) -> _Equations:
        """Return the equations of columns of [hull (P), conditions (D), target]: an axis's numbers (c,) and values (J, c).

        `weight` is that of the axes, (3,), and `prior` the precision of the conditions, (D,).
        """
        size = P + len(prior) + 1
        whole = np.zeros((size, size))
        for axis, (places, values) in enumerate(columns):
            whole[np.ix_(places, places)] += weight[axis] * values.T @ values
        bare = whole[:P, :P].copy()
        response, found = gusts.eliminated(columns, size, weight)
        whole -= response.T @ found
        return cls(
            bare=bare,
            hull=whole[:P, :P],
            hull_right=whole[:P, -1],
            own=whole[P:-1, P:-1] + np.diag(prior),
            right=whole[P:-1, -1],
            across=whole[P:-1, :P],
            columns=columns,
            gusts=found,
            process=gusts,
        )

    def gusts_at(self, hull: Floats, conditions: Floats) -> Floats:
        """Return the likeliest gusts beside a hull and conditions, shape (J, 2)."""
        return np.asarray((self.gusts @ np.concatenate([-hull, -conditions, [1.0]])).reshape(-1, 2))

    def left(self, hull: Floats, conditions: Floats) -> Floats:
        """Return what hull and conditions leave, shape (J, 3)."""
        every = np.concatenate([-hull, -conditions, [1.0]])
        return np.column_stack([values @ every[places] for places, values in self.columns])


class _Problem:
    """Gains of the hull (P of them, with an intercept an axis) and of every log its wind and its steady forces."""

    def __init__(
        self,
        windows: Sequence[WeakRows],
        terms: tuple[str, ...],
        mask: Flags,
        spread: Floats,
        posed: Flags,
        stride_s: float,
    ) -> None:
        self._of = terms, mask, spread, posed, stride_s
        self.windows, self.terms, self.mask, self.spread, self.posed = windows, terms, mask, spread, posed
        self.own = [np.flatnonzero(column) for column in mask.T]
        self.low = np.cumsum([0, *(len(one) + 1 for one in self.own)])
        self.P = int(self.low[-1])
        self.steady = [np.column_stack([np.ones(len(one)), one.heading]) for one in windows]
        self.wind_spread, self.force_spread = IDENTIFY.wind_spread_mps, 0.1
        self.gusts = Gusts([one.run for one in windows], stride_s)
        # What few windows need is over before a thread has begun.
        self.threads = None if self.gusts.many else 1
        self.inverse: Floats = np.zeros((self.P, self.P))
        self.bare: Floats = np.zeros((self.P, self.P))
        self.factor, self.noise, self.offset_spread = 1.0, 1.0, 0.1
        targets = [np.zeros((1, 3)), *(self._table(k, np.zeros((len(one), 3)))[1] for k, one in enumerate(windows))]
        self.sigma = np.maximum(np.std(np.concatenate(targets), axis=0), IDENTIFY.no_force)
        self.slopes = [np.zeros((len(one), 3, 2)) for one in windows]
        self.gains = np.zeros((len(terms), 3))
        self.intercept = np.zeros(3)
        self.converged = False
        """Whether another step would change nothing."""
        self.settled = False
        """Whether spreads and noise stay as they are."""
        self._course = list[Floats]()
        """Logarithms of the spreads since they were last taken ahead."""
        self._moved = np.zeros((len(windows), 2))
        """By how much the last step moved each wind."""

    def _table(self, k: int, load: Floats) -> tuple[Floats, Floats]:
        """Return functions and target of a log under a wind load."""
        one = replace(self.windows[k], steady=self.windows[k].steady - load)
        return one.regressors(self.terms), one.force - one.base(one.acceleration(self.posed))

    def _G(self) -> Floats:
        G = np.eye(3)
        for column, name in enumerate(ACCELERATIONS):
            if name in self.terms:
                G[:, column] -= self.gains[self.terms.index(name)]
        return G

    def solve(self, loads: Mapping[int, Load], start: Start | None = None) -> tuple[Floats, Floats]:
        L = len(self.windows)
        wind, covariance = np.zeros((L, 2)), np.zeros((L, 2, 2))
        places = some_logs([len(one) for one in self.windows])
        begun, known = True, np.full((L, 2), np.nan)
        if start is not None:
            self._take_over(start.shared)
            self.settled, known = start.settled, start.wind
            begun = start.converged or not start.settled
        elif len(places) == L:
            self._step({}, wind)
        else:
            begun = self._begin_as(places, loads)
        for k, load in loads.items():
            wind[k] = known[k] if np.isfinite(known[k]).all() else self._start(k, load)
        for _ in range(IDENTIFY.condition_steps):
            before, hull = wind.copy(), self._hull()
            covariance = self._step(loads, wind)
            moved = np.abs(self._hull() - hull) / np.sqrt(np.maximum(np.diag(self.inverse), 1e-300))
            if np.abs(wind - before).max() < 1e-3 or (self.settled and moved.max() < IDENTIFY.settled_step):
                # Spreads that some logs did not settle on are not settled for all of them.
                self.converged = begun
                break
        missing = [k for k in range(L) if k not in loads]
        wind[missing], covariance[missing] = np.nan, np.nan
        return wind, covariance

    def _begin_as(self, places: Sequence[int], loads: Mapping[int, Load]) -> bool:
        """Begin with the hull of some of the logs, and keep the spreads and the noise that were found with it.

        They take most of the steps, and some logs tell them as well as all. Returns whether they settled.
        """
        self.settled = True
        some = _Problem([self.windows[k] for k in places], *self._of)
        some.solve({number: loads[k] for number, k in enumerate(places) if k in loads})
        self._take_over(some.shared())
        return some.converged

    def shared(self) -> dict[str, Any]:
        """Return hull, spreads and noise, which no log has of its own."""
        return {name: copy(getattr(self, name)) for name in _SHARED} | {"gusts": self.gusts.spread}

    def _take_over(self, shared: Mapping[str, Any]) -> None:
        """Take over what `shared` of another estimate returned."""
        for name in _SHARED:
            setattr(self, name, copy(shared[name]))
        self.gusts.spread = shared["gusts"]

    def _start(self, k: int, load: Load) -> Floats:
        """Return the likeliest wind of a log for the hull found so far, of some directions and speeds."""
        X, Y = self._table(k, np.zeros((len(self.windows[k]), 3)))
        every = -(-len(Y) // _START_WINDOWS)
        left, G = (Y - X @ self.gains - self.intercept)[::every], self._G()
        best, least = np.zeros(2), np.inf
        angles = 2.0 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
        for speed in _SPEEDS:
            for angle in angles:
                wind = speed * np.array([np.cos(angle), np.sin(angle)])
                error = (left + load.of(wind, every) @ G.T) / self.sigma
                error = error - error.mean(axis=0)
                cost = every * float(np.sum(error**2)) / self.noise + float(wind @ wind) / self.wind_spread**2
                if cost < least:
                    best, least = wind, cost
        return best

    def _step(self, loads: Mapping[int, Load], wind: Floats) -> Floats:
        """Take a Gauss-Newton step for hull and conditions, update the spreads, and return the winds' covariances.

        Logs without a load have steady forces only.
        """
        logs = over(lambda k: self._equations(k, loads.get(k), wind[k]), range(len(self.windows)), most=self.threads)
        if not self.settled:
            for log in logs:
                self.gusts.add(log.process)
        normal, right = np.diag(self._prior()), np.zeros(self.P)
        bare = normal + sum(log.bare for log in logs)
        for log in logs:
            gone = np.linalg.solve(log.own, np.column_stack([log.across, log.right]))
            normal += log.hull - log.across.T @ gone[:, :-1]
            right += log.hull_right - log.across.T @ gone[:, -1]
        inverse = np.linalg.pinv(normal, hermitian=True)
        hull = inverse @ right
        covariance, winds, forces, left = np.zeros((len(logs), 2, 2)), list[float](), list[float](), list[Floats]()
        for k, log in enumerate(logs):
            inner = np.linalg.inv(log.own)
            found = inner @ (log.right - log.across @ hull)
            spread = inner + inner @ log.across @ inverse @ log.across.T @ inner
            left.append(log.left(hull, found))
            if k in loads:
                gusts = log.gusts_at(hull, found)
                left[-1] = left[-1] - np.einsum("jac,jc->ja", self.slopes[k], gusts)
                self.gusts.take(k, gusts)
            squares = found**2 + np.diag(spread)
            if k in loads:
                step = found[:2] - wind[k]
                most = max(IDENTIFY.wind_spread_mps, float(np.linalg.norm(wind[k])))
                step *= min(1.0, most / max(float(np.linalg.norm(step)), 1e-9))
                # One that goes back where it came from would go to and fro for ever.
                self._moved[k] = step * (0.5 if step @ self._moved[k] < 0.0 else 1.0)
                wind[k] += self._moved[k]
                covariance[k] = spread[:2, :2]
                winds.append(float(np.sum(squares[:2])))
            if len(left[-1]):
                forces.append(float(np.mean(squares[2:])))
        self._take(hull)
        self.inverse, self.bare = np.asarray(inverse), np.asarray(bare)
        if not self.settled:
            self._hull_spreads(hull, np.diag(inverse))
            self._spreads(winds, forces)
            self._noise(left)
            self.gusts.update()
            self._hasten()
        return covariance

    def _hasten(self) -> None:
        """Take the spreads where expectation and maximisation would arrive: every third step is Aitken's."""
        self._course.append(np.log([self.wind_spread, self.force_spread, self.gusts.spread]))
        if len(self._course) < 3:
            return
        first, second, third = self._course
        before, last = second - first, third - second
        kept = np.clip(last / np.where(before != 0.0, before, np.inf), 0.0, IDENTIFY.most_kept)
        spreads = np.exp(third + last * kept / (1.0 - kept))
        self.wind_spread, self.force_spread = float(spreads[0]), float(spreads[1])
        self.gusts.spread = float(max(spreads[2], IDENTIFY.least_gust_mps))
        self._course.clear()

    def _equations(self, k: int, load: Load | None, wind: Floats) -> _Equations:
        """Return the normal equations of one log, linearised about a wind."""
        J, G = len(self.windows[k]), self._G()
        blown = wind + self.gusts.found[k]
        force, by_wind = (np.zeros((J, 3)), np.zeros((J, 3, 2))) if load is None else load.with_slope(blown)
        X, Y = self._table(k, force)
        slope = -np.einsum("ab,jbc->jac", G, by_wind)
        Y = Y + np.einsum("jac,jc->ja", slope, blown)
        self.slopes[k] = slope
        columns = []
        for axis in range(3):
            steady = self.P + 2 + 3 * axis
            places = [
                *range(self.low[axis], self.low[axis + 1]),
                self.P,
                self.P + 1,
                *range(steady, steady + 3),
                self.P + 11,
            ]
            hull, forces = X[:, self.own[axis]], self.steady[k] * self.sigma[axis]
            columns.append((np.array(places), np.column_stack([hull, np.ones(J), slope[:, axis], forces, Y[:, axis]])))
        weight = 1.0 / (self.noise * self.sigma**2)
        prior = np.repeat([self.wind_spread, self.force_spread], [2, 9]) ** -2.0
        gusts = self.gusts.equations(k, slope, weight, uncertain=not self.settled)
        return _Equations.of(tuple(columns), self.P, weight, prior, gusts)

    def added(self) -> Floats:
        """Return what the conditions add to the covariance of gains and intercepts, shape (3, K + 1, K + 1)."""
        covariance = self.inverse - np.linalg.pinv(self.bare, hermitian=True)
        added = np.zeros((3, len(self.terms) + 1, len(self.terms) + 1))
        for axis, own in enumerate(self.own):
            part, places = slice(self.low[axis], self.low[axis + 1]), [*own.tolist(), len(self.terms)]
            added[axis][np.ix_(places, places)] = covariance[part, part]
        return added

    def _spreads(self, winds: Sequence[float], forces: Sequence[float]) -> None:
        """Update the spreads of winds and steady forces between logs."""
        if forces:
            self.force_spread = float(np.sqrt(max(sum(forces) / len(forces), 1e-6)))
        if winds:
            # Two logs' worth of what is usual keeps the spread of few logs apart from zero and from everything.
            usual = IDENTIFY.wind_spread_mps
            self.wind_spread = float(np.sqrt((sum(winds) + 4.0 * usual**2) / (2.0 * len(winds) + 4.0)))

    def _noise(self, left: Sequence[Floats]) -> None:
        """Update size and correlation of the residual from what is left of every log, shape (J, 3) each."""
        squares = np.sum([np.sum(one**2, axis=0) for one in left], axis=0) + self.gusts.uncertain
        freedom = np.maximum(sum(len(one) for one in left) - np.diff(self.low), 1.0)
        self.sigma = np.maximum(np.sqrt(squares / freedom), IDENTIFY.no_force)
        lagged = np.zeros(3)
        for one, windows in zip(left, self.windows, strict=True):
            lagged += np.sum((one[1:] * one[:-1])[np.diff(windows.run) == 0], axis=0)
        alike = float(np.mean(lagged / np.maximum(squares, np.finfo(np.float64).tiny)))
        correlation = float(np.clip(alike, 0.0, IDENTIFY.most_autocorrelation))
        self.noise = (1.0 + correlation) / (1.0 - correlation)

    def _prior(self) -> Floats:
        values = np.zeros(self.P)
        for axis, own in enumerate(self.own):
            spread = self.factor * self.spread[own, axis]
            values[self.low[axis] : self.low[axis + 1] - 1] = np.where(np.isfinite(spread), spread**-2.0, 0.0)
            # A hull that port and starboard make alike feels no force at rest.
            values[self.low[axis + 1] - 1] = (self.offset_spread * self.sigma[axis]) ** -2.0
        return values

    def _take(self, hull: Floats) -> None:
        for axis, own in enumerate(self.own):
            self.gains[own, axis] = hull[self.low[axis] : self.low[axis + 1] - 1]
            self.intercept[axis] = hull[self.low[axis + 1] - 1]

    def _hull(self) -> Floats:
        """Return gains and intercepts of the axes, one behind the other, shape (P,)."""
        return np.concatenate([[*self.gains[own, axis], self.intercept[axis]] for axis, own in enumerate(self.own)])

    def _hull_spreads(self, hull: Floats, variance: Floats) -> None:
        """Update how much wider than stated the prior of the gains is, and the spread of the intercepts."""
        sizes = []
        for axis, own in enumerate(self.own):
            part = slice(self.low[axis], self.low[axis + 1] - 1)
            some = np.isfinite(self.spread[own, axis])
            sizes.append(((hull[part] ** 2 + variance[part]) / self.spread[own, axis] ** 2)[some])
        offsets = np.array([hull[high - 1] ** 2 + variance[high - 1] for high in self.low[1:]])
        self.offset_spread = float(np.sqrt(max(np.mean(offsets / self.sigma**2), 1e-6)))
        every = np.concatenate(sizes)
        if len(every):
            self.factor = float(np.clip(np.sqrt(np.mean(every)), 1.0, IDENTIFY.widest_prior))
