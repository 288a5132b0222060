"""Physics in an estimate: inertia that is symmetric and possible, damping that takes energy.

The gains of the weak form (`ferryid.identify.weak_rows`) are moved as little as their information allows to where the mass
matrix is symmetric and lies between bounds of the rigid body's, and the damping dissipates in surge alone and in sway and yaw
together, at every speed. Before that the Coriolis force is tied to the mass: what products of surge with sway and yaw rate
exert beyond it is lift, of which the prior says how large it may be.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ferryid.identify.inertia.shares import rigid_body
from ferryid.identify.thresholds import IDENTIFY
from ferryid.identify.weak_rows import to_force
from ferryid.models.forces import ACCELERATIONS, effective_mass, motion_force, without_sway_coupling
from ferryid.regression import non_negative
from ferryid.regression.bases import Basis
from ferryid.types import AXES, Flags, Floats
from ferryid.vessel.profile import Profile

_ROUNDS = 6
_SHARES = (0.01, 0.05, *(tenth / 10.0 for tenth in range(1, 11)), 2.0, 5.0, 100.0)
"""Of the velocities visited and a margin. At the last ones the highest power decides: a hull dissipates at every speed."""
_DIRECTIONS = 16
_TIE_STEPS = 3


@dataclass(frozen=True)
class LiftTie:
    """A coefficient of the force that the mass matrix determines but for the hull's lift.

    Attributes
    ----------
    term, axis
        Number of the function, and the axis it acts on.
    masses
        What of the added mass it is the sum of: (row, column, factor) each.
    spread
        Standard deviation of the lift.
    """

    term: int
    axis: int
    masses: tuple[tuple[int, int, float], ...]
    spread: float


@dataclass(frozen=True, eq=False)
class _Pull:
    """Moves gains, flat, to where they agree with the ties as far as these are sure: ``b + gain @ (level - slope @ b)``."""

    gain: Floats
    slope: Floats
    level: Floats
    spread: Floats

    def of(self, flat: Floats, lift: Floats) -> Floats:
        """Return the gains (..., size) pulled to a lift, (..., ties)."""
        return np.asarray(flat + (self.level + lift - flat @ self.slope.T) @ self.gain.T)


@dataclass(frozen=True, eq=False)
class Feasible:
    """Gains that physics allows.

    Attributes
    ----------
    gains
        Shape (K, 3).
    notes
        What the data contradicted by more than their scatter, as sentences.
    projection
        Makes the mass matrix of other gains, flat, symmetric: ``b + lift @ (level - normal @ b)``; empty where it is.
    shift
        By how much the bounds moved the gains, flat.
    places
        Which gains the flat ones are, as (function, axis) rows.
    pull
        What ties the Coriolis force to the mass.
    """

    gains: Floats
    notes: tuple[str, ...]
    projection: tuple[Floats, Floats, Floats]
    shift: Floats
    places: tuple[tuple[int, int], ...]
    pull: _Pull

    def moved(self, gains: Floats, seed: int = 0) -> Floats:
        """Return drawn gains, shape (n, K, 3), with a symmetric mass matrix and moved as far as the estimate was.

        Lift is drawn from its prior. A bound that the estimate meets does not take the scatter of the draws: how far the truth
        is inside is not known.
        """
        spread, normal, level = self.projection
        rows, axes = (np.array(part) for part in zip(*self.places, strict=True))
        lift = self.pull.spread * np.random.default_rng(seed).standard_normal((len(gains), len(self.pull.spread)))
        flat = self.pull.of(gains[:, rows, axes], lift)
        out = gains.copy()
        out[:, rows, axes] = flat + (level - flat @ normal.T) @ spread.T + self.shift
        return out


def feasible_gains(
    profile: Profile,
    scale: Mapping[str, float],
    functions: Basis,
    mask: Flags,
    gains: Floats,
    information: Floats,
    nu: Floats,
    *,
    ties: Sequence[LiftTie] = (),
    reduced: bool = False,
) -> Feasible:
    """Return the gains nearest to `gains` that physics allows.

    Parameters
    ----------
    profile, scale, functions
        Base model, factors on it, and basis.
    mask
        Which gains may be other than zero, shape (K, 3).
    gains
        Shape (K, 3).
    information
        What moving them costs, shape (3, K, K).
    nu
        Velocities visited, shape (n, 3).
    ties
        What ties the Coriolis force to the mass.
    reduced
        Whether the gains are those of a hull that cannot sway.
    """
    problem = _Problem(profile, scale, functions, mask, information, reduced)
    wanted, pull = problem.tied(problem.flat(gains), ties)
    cuts: list[tuple[Floats, float, str]] = []
    symmetry = problem.symmetry()
    damping = problem.damping(_points(nu))
    current = wanted
    active = np.zeros(0, dtype=np.int64)
    rows: list[tuple[Floats, float, str]] = []
    for _ in range(_ROUNDS):
        mass = problem.mass(current)
        cuts += problem.mass_cuts(mass)
        rows = symmetry + cuts + problem.dissipation(current, damping)
        found, active = _nearest(
            problem.cost, wanted, np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
        )
        settled = np.allclose(found, current, rtol=1e-9, atol=1e-12)
        current = found
        if settled and not problem.mass_cuts(problem.mass(current)):
            break
    lift, normal, level = problem.projection(symmetry)
    shift = current - (wanted + lift @ (level - normal @ wanted))
    bounds = [rows[k][2] for k in active.tolist() if rows[k][2]]
    # What scatter alone may bring to a bound is no contradiction.
    contradicted = bool(bounds) and _beyond_scatter(float(shift @ problem.cost @ shift), len(bounds))
    told = tuple(dict.fromkeys(bounds)) if contradicted else ()
    return Feasible(problem.gains(current), told, (lift, normal, level), shift, tuple(problem.places), pull)


def _beyond_scatter(distance: float, bounds: int) -> bool:
    from scipy.special import chdtri  # a tenth of a second to import: only where it is needed

    return bool(distance > chdtri(bounds, IDENTIFY.bound_level))


@dataclass(frozen=True, eq=False)
class _Damping:
    """Velocities, shape (p, 3), the functions of each gain there, (p, size), and what the base model takes, (p,) [W]."""

    points: Floats
    functions: Floats
    levels: Floats


class _Problem:
    """The gains as one vector, and what it must satisfy as ``normal @ b >= level``."""

    def __init__(
        self,
        profile: Profile,
        scale: Mapping[str, float],
        functions: Basis,
        mask: Flags,
        information: Floats,
        reduced: bool,
    ) -> None:
        self.profile, self.scale, self.functions = profile, scale, functions
        self.places = [(k, axis) for axis in range(3) for k in range(len(functions.terms)) if mask[k, axis]]
        self.index = {place: number for number, place in enumerate(self.places)}
        self.mass0, self.rigid = effective_mass(profile, scale, (), np.zeros((0, 3))), rigid_body(profile.hull)
        if reduced:
            self.mass0, self.rigid = without_sway_coupling(self.mass0), without_sway_coupling(self.rigid)
        self.acceleration = {
            column: functions.terms.index(name) for column, name in enumerate(ACCELERATIONS) if name in functions.terms
        }
        self.rows, self.axes = np.array(self.places, dtype=np.int64).reshape(-1, 2).T
        self.accelerating = [
            (axis, column, self.index[k, axis])
            for column, k in self.acceleration.items()
            for axis in range(3)
            if (k, axis) in self.index
        ]
        size = len(self.places)
        self.cost = np.zeros((size, size))
        for axis in range(3):
            own = [self.index[place] for place in self.places if place[1] == axis]
            terms = [self.places[number][0] for number in own]
            self.cost[np.ix_(own, own)] = information[axis][np.ix_(terms, terms)]

    def flat(self, gains: Floats) -> Floats:
        """Return gains, shape (..., K, 3), as vectors, (..., size)."""
        return np.asarray(gains[..., self.rows, self.axes])

    def gains(self, flat: Floats) -> Floats:
        """Return vectors, shape (..., size), as gains, (..., K, 3)."""
        out = np.zeros((*flat.shape[:-1], len(self.functions.terms), 3))
        out[..., self.rows, self.axes] = flat
        return out

    def G(self, flat: Floats) -> Floats:
        """Return what the accelerations' gains make of the base model's mass matrix, shape (..., 3, 3)."""
        G = np.broadcast_to(np.eye(3), (*flat.shape[:-1], 3, 3)).copy()
        for axis, column, number in self.accelerating:
            G[..., axis, column] -= flat[..., number]
        return G

    def mass(self, flat: Floats) -> Floats:
        """Return the mass matrix, shape (..., 3, 3)."""
        return np.asarray(np.linalg.solve(self.G(flat), self.mass0))

    def tied(self, wanted: Floats, ties: Sequence[LiftTie]) -> tuple[Floats, _Pull]:
        """Return the gains with the ties as observations beside the data, whose cost then has these in it, and how.

        Gauss-Newton steps: the added mass is not linear in the gains.
        """
        ties = [one for one in ties if (one.term, one.axis) in self.index and np.isfinite(one.spread)]
        spread, found, pull, cost = np.array([one.spread for one in ties]), wanted, None, self.cost
        for _ in range(_TIE_STEPS):
            lift, slope = self._lift(found, ties)
            level = slope @ found - lift
            weighted = slope.T / spread**2
            self.cost = cost + weighted @ slope
            gain = np.linalg.pinv(self.cost, hermitian=True) @ weighted
            pull = _Pull(gain, slope, level, spread)
            found = pull.of(wanted, np.zeros(len(ties)))
        assert pull is not None
        return found, pull

    def _lift(self, flat: Floats, ties: Sequence[LiftTie]) -> tuple[Floats, Floats]:
        """Return what tied coefficients have beyond the mass's share, (ties,), and its slope over the gains."""
        step = 1e-6 * np.eye(len(flat))
        every = np.vstack([flat, flat + step, flat - step])
        theta, _ = to_force(self.gains(every), np.zeros((len(every), 3)), self.functions.terms, self.mass0)
        added = self.mass(every) - self.mass0
        lift = np.zeros((len(every), len(ties)))
        for number, one in enumerate(ties):
            own = sum((factor * added[:, row, column] for row, column, factor in one.masses), np.zeros(len(every)))
            lift[:, number] = theta[:, one.term, one.axis] - own
        return lift[0], (lift[1 : len(flat) + 1] - lift[len(flat) + 1 :]).T / 2e-6

    def _inverse_mass(self, x: Floats, y: Floats) -> tuple[Floats, float]:
        """Return ``x' M^-1 y`` as a function of the gains: ``M^-1 = M0^-1 G``, slope and constant."""
        left = np.linalg.solve(self.mass0.T, x)
        slope = np.zeros(len(self.places))
        for axis, column, number in self.accelerating:
            slope[number] -= left[axis] * y[column]
        return slope, float(left @ y)

    def symmetry(self) -> list[tuple[Floats, float, str]]:
        rows = []
        unit = np.eye(3)
        for i, j in ((0, 1), (0, 2), (1, 2)):
            (upper, first), (lower, second) = self._inverse_mass(unit[i], unit[j]), self._inverse_mass(unit[j], unit[i])
            if np.any(upper != lower):
                rows += [(upper - lower, second - first, ""), (lower - upper, first - second, "")]
        return rows

    def mass_cuts(self, mass: Floats) -> list[tuple[Floats, float, str]]:
        """Return half-spaces that a mass matrix outside its bounds violates: one for each direction in which it does."""
        root = np.linalg.cholesky(self.rigid)
        inverse = np.linalg.inv(mass)
        values, vectors = np.linalg.eigh(root.T @ ((inverse + inverse.T) / 2.0) @ root)
        cuts = []
        low, high = 1.0 / IDENTIFY.most_inertia, 1.0 / IDENTIFY.least_inertia
        for value, vector in zip(values, vectors.T, strict=True):
            if low * (1.0 - 1e-6) <= value <= high * (1.0 + 1e-6):
                continue
            x = root @ vector
            slope, constant = self._inverse_mass(x, x)
            if not np.any(slope):
                continue
            axis = AXES[int(np.argmax(np.abs(vector)))]
            if value > high:
                cuts.append(
                    (
                        -slope,
                        constant - high,
                        f"The data want less inertia in {axis} than the rigid body's: it is held there.",
                    )
                )
            else:
                cuts.append(
                    (
                        slope,
                        low - constant,
                        f"The data want an inertia in {axis} that no hull has: it is held at the bound.",
                    )
                )
        return cuts

    def damping(self, points: Floats) -> _Damping:
        """Return what acts at velocities, shape (p, 3), beside the accelerations."""
        still = np.zeros_like(points)
        across = np.zeros((len(points), 2))
        functions = self.functions
        phi = functions.evaluate(
            points,
            still,
            points[:, :2] if functions.needs_wind else None,
            points[:, :2] if functions.needs_current else None,
        )
        motion = np.array([not term.endswith("_dot") and "_r" not in term for term in functions.terms])
        phi = np.where(motion, phi, 0.0)
        base = motion_force(self.profile, self.scale, still, points, across[:, 0])
        return _Damping(points, phi[:, self.rows], -np.einsum("pi,pi->p", points, base))

    def dissipation(self, flat: Floats, damping: _Damping) -> list[tuple[Floats, float, str]]:
        """Return that at each velocity the damping takes energy."""
        points, levels = damping.points, damping.levels.tolist()
        power = np.linalg.solve(self.G(flat).T, points.T).T
        slopes = power[:, self.axes] * damping.functions
        slopes[:, np.isin(self.rows, list(self.acceleration.values()))] = 0.0
        told = "At some velocities the data want damping in {} that feeds the motion: there it is held at none."
        surge, others = (told.format(which) for which in ("surge", "sway and yaw"))
        return [
            (slopes[k], levels[k], surge if points[k, 0] else others)
            for k in np.flatnonzero(slopes.any(axis=1)).tolist()
        ]

    def projection(self, rows: list[tuple[Floats, float, str]]) -> tuple[Floats, Floats, Floats]:
        """Return what leads other gains to where these rows hold exactly; see `Feasible`."""
        size = len(self.places)
        if not rows:
            return np.zeros((size, 0)), np.zeros((0, size)), np.zeros(0)
        normal, level = np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
        unit = np.linalg.norm(normal, axis=1)
        normal, level = normal / unit[:, None], level / unit
        spread = np.linalg.pinv(self.cost, hermitian=True) @ normal.T
        return spread @ np.linalg.pinv(normal @ spread, rcond=1e-9), normal, level


def _points(nu: Floats) -> Floats:
    """Return velocities ahead, astern, and across with turning, those visited and far beyond, shape (p, 3)."""
    reach = np.quantile(np.abs(nu), IDENTIFY.visited_quantile, axis=0) * IDENTIFY.damping_margin
    angles = 2.0 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    points = []
    for share in _SHARES:
        points += [(share * reach[0], 0.0, 0.0), (-share * reach[0], 0.0, 0.0)]
        points += [(0.0, share * reach[1] * np.cos(a), share * reach[2] * np.sin(a)) for a in angles]
    return np.array(points)


def _nearest(cost: Floats, wanted: Floats, normal: Floats, level: Floats) -> tuple[Floats, np.ndarray]:
    """Return b of least ``(b - wanted)' cost (b - wanted)`` with ``normal @ b >= level``, and which of them are met exactly.

    As least distance by non-negative least squares: Lawson and Hanson (1974), Solving Least Squares Problems, chapter 23.
    """
    unit = np.sqrt(np.maximum(np.diag(cost), 1e-300))
    scaled = cost / np.outer(unit, unit)
    root = np.linalg.cholesky(scaled + 1e-9 * np.eye(len(scaled)))
    A = np.linalg.solve(root, (normal / unit).T).T
    b = level - normal @ wanted
    size = np.linalg.norm(A, axis=1)
    A, b = A / size[:, None], b / size
    if np.all(b <= 1e-12):
        return wanted, np.zeros(0, dtype=np.int64)
    # The distance in units of one: what is far off is brought near before it is solved for.
    far = max(float(np.max(b)), 1e-12)
    table, target = np.vstack([A.T, b / far]), np.zeros(A.shape[1] + 1)
    target[-1] = 1.0
    weights = non_negative(table, target, most=50 * len(A))
    left = table @ weights - target
    if abs(left[-1]) < 1e-12:  # no gains satisfy all of it: a base model that is itself not possible
        return wanted, np.zeros(0, dtype=np.int64)
    step = -left[:-1] / left[-1] * far
    return wanted + np.linalg.solve(root.T, step) / unit, np.flatnonzero(weights > 0.0)
