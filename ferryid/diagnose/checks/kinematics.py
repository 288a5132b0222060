"""Position against velocity, in the weak form: what does not fit between them, all at once.

With p the measured position, psi the heading and nu the velocity, a receiver `l` from where the velocity is measured, a heading
that is `b` too large, a velocity that is multiplied by `k`, positions that are `T` late and a drift `d` of the position
(water under a log that measures through water)::

    d/dt (p - R(psi - b) l) = R(psi(t - T) - b) nu(t - T) / k + d

Both sides are averaged over windows whose weight takes the derivative. Parameters are let in one after the other, the most
certain first, and two at once where no single one is certain. Velocities are noisy, and noise in a regressor makes its factor
too small; so the regressors' instruments are made of positions, and made of velocities in a second solution. The truth lies
between the two where positions are noisy as well, which is why a finding has to be one in both.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ferryid.diagnose.checks.regression import Solution, independence, scatter, step
from ferryid.diagnose.checks.spans import Spans, spans
from ferryid.diagnose.checks.thresholds import CHECKS
from ferryid.effects.force_model import Measurements
from ferryid.types import Floats
from ferryid.vessel.frames import to_body, to_world

SCALE, ANGLE, X, Y, LATE, NORTH, EAST = range(7)
"""Places of k [-], b [rad], l [m], T [s] and the drift [m/s] among the parameters."""
NEUTRAL = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
SIZE = np.array([0.5, 0.5, 10.0, 10.0, 2.0, 1.0, 1.0])
TINY_S = 1e-2
"""Move of a delay by which a slope is found [s]."""
TOGETHER = ((SCALE,), (ANGLE,), (X, Y), (LATE,))
"""Those that are let in together: of an arm with one component the other would be in the scatter."""
GROSS = (SCALE, ANGLE)
"""Those that are let in from the start where they seem gross."""
STEPS = 12
DERIVATIVE_S = 2.0


@dataclass(frozen=True)
class Kinematics:
    """What does not fit between position and velocity.

    Attributes
    ----------
    active
        Which parameters were let in, shape (7,).
    solution
        With instruments made of positions; neutral and without error where not let in.
    rival
        Values with instruments made of velocities, shape (7,).
    middle_s
        Middle of the windows that were used [s], shape (J,).
    regressors
        Derivatives of the residual by the parameters, north and east, shape (J, 2, 7).
    left
        Residual [m/s], shape (J, 2).
    short
        True where the log is too short for blocks of residuals as long as those of other logs.
    """

    active: NDArray[np.bool_]
    solution: Solution
    rival: Floats
    middle_s: Floats
    regressors: Floats
    left: Floats
    short: bool = False

    def found(self, index: int, least: float) -> bool:
        """Return whether a parameter is certainly not neutral, and by at least `least`, in both solutions alike."""
        if not self.active[index]:
            return False
        one, other = self.solution.values[index] - NEUTRAL[index], self.rival[index] - NEUTRAL[index]
        both = min(abs(one), abs(other)) >= least and one * other > 0.0
        return bool(both and _certain(self.solution, index))

    def evidence(self, index: int) -> dict[str, Floats]:
        """Return what one parameter explains: its regressor against what is left without it."""
        regressor = -self.regressors[:, :, index]
        share = (self.solution.values[index] - NEUTRAL[index]) * regressor
        return {
            "time_s": np.repeat(self.middle_s, 2),
            "regressor": regressor.ravel(),
            "difference_mps": (self.left + share).ravel(),
        }


@dataclass(frozen=True)
class _Data:
    """Windows with what is compared in them: pose, body velocity measured, and velocity over ground that positions give."""

    problem: Spans
    eta: Floats
    velocity: Floats
    pulled: Floats

    def residual(self, p: Floats) -> Floats:
        """Return what is left between position and velocity [m/s], shape (J, 2)."""
        heading = self.eta[:, 2] - p[ANGLE]
        lever = np.column_stack(to_world(np.full_like(heading, p[X]), np.full_like(heading, p[Y]), heading))
        moved = self.problem.rate(self.eta[:, :2] - lever)
        over_ground = self._over_ground(p, self.velocity)
        return np.asarray(moved - self._mean_late(over_ground, p[LATE]) - p[NORTH:])

    def derivatives(self, p: Floats, velocity: Floats | None = None) -> Floats:
        """Return the residual's derivatives by the parameters, shape (J, 2, 7)."""
        heading = self.eta[:, 2] - p[ANGLE]
        over_ground = self._over_ground(p, self.velocity if velocity is None else velocity)
        north, east = self._mean_late(over_ground, p[LATE]).T
        # What moves with the heading, ahead and to starboard.
        c, s = self.problem.rate(np.column_stack([np.cos(heading), np.sin(heading)])).T
        out = np.zeros((len(c), 2, len(NEUTRAL)))
        out[:, 0, SCALE], out[:, 1, SCALE] = north / p[SCALE], east / p[SCALE]
        out[:, 0, ANGLE], out[:, 1, ANGLE] = -p[X] * s - p[Y] * c - east, p[X] * c - p[Y] * s + north
        out[:, 0, X], out[:, 1, X] = -c, -s
        out[:, 0, Y], out[:, 1, Y] = s, -c
        sooner, later = (self._mean_late(over_ground, p[LATE] + move) for move in (-TINY_S, TINY_S))
        out[:, :, LATE] = (sooner - later) / (2.0 * TINY_S)
        out[:, 0, NORTH] = out[:, 1, EAST] = -1.0
        return out

    def _over_ground(self, p: Floats, velocity: Floats) -> Floats:
        """Return a velocity along the vessel's axes as one over ground, shape (n, 2)."""
        u, v = velocity.T
        return np.asarray(np.column_stack(to_world(u, v, self.eta[:, 2] - p[ANGLE])) / p[SCALE])

    def _mean_late(self, values: Floats, late_s: float) -> Floats:
        """Return means in the windows of values that come late, shape (J, 2)."""
        if late_s != 0.0:
            row = np.arange(len(values), dtype=np.float64)
            values = np.column_stack([np.interp(row - late_s / self.problem.step_s, row, one) for one in values.T])
        return self.problem.mean(values)

    def instruments(self, p: Floats) -> Floats:
        """Return derivatives in which the velocity is that of the positions, shape (J, 2, 7)."""
        u, v = to_body(self.pulled[:, 0], self.pulled[:, 1], self.eta[:, 2] - p[ANGLE])
        return self.derivatives(p, np.column_stack([u, v]) * p[SCALE])


# Several checks ask for the kinematics of the same measurements; as many logs are examined side by side as there are cores.
@lru_cache(maxsize=os.cpu_count() or 1)
def kinematics(measurements: Measurements, forced: tuple[int, ...] = ()) -> Kinematics | None:
    """Compare positions and velocities; None where the measurements have too little of them, or velocities are their slopes.

    Parameters
    ----------
    measurements
        From a log.
    forced
        Parameters that are let in from the start, because it is known that they are off.
    """
    if not measurements.slopes.isdisjoint("uv"):
        return None
    problem, both = spans(measurements, np.hstack([measurements.eta, measurements.nu_raw[:, :2]]))
    if len(problem.starts) < 8:
        return None
    eta, velocity = both[:, :3], both[:, 3:]
    if np.sqrt(2.0 * np.mean(problem.rate(eta[:, :2]) ** 2)) < CHECKS.slow_mps:
        return None
    m = 2 * max(2, round(0.5 * DERIVATIVE_S / problem.step_s)) + 1
    pulled = _slope(eta[:, :2], m) / problem.step_s
    data = _Data(problem, eta, velocity, pulled)
    p, active = _start(data)
    active[list(forced)] = True
    searched = _search(data, p, active)
    if searched is None:
        return None
    size = np.abs(data.residual(searched[0])).max(axis=1)
    data = _Data(problem.only(size <= CHECKS.outlier * max(float(np.median(size)), 1e-9)), eta, velocity, pulled)
    searched = _search(data, p, active)
    if searched is None:
        return None
    if idle := [k for k in GROSS if searched[2][k] and k not in forced and not _certain(searched[1], k)]:
        # What looked gross at the start was another error, such as a long arm.
        p, active = searched[0].copy(), searched[2].copy()
        p[idle], active[idle] = NEUTRAL[idle], False
        searched = _search(data, p, active)
        if searched is None:
            return None
    p, solution, active = searched
    if active[SCALE]:
        errors = solution.errors.copy()
        errors[SCALE] *= scatter(_factors_of_parts(data, p), 0)
        solution = replace(solution, errors=errors)
    rival = _solve(data, p, active, own=True)
    if rival is None:
        return None
    short = independence(data.problem.place)[1] > 1.0
    return Kinematics(active, solution, rival[0], data.problem.middle_s, data.derivatives(p), data.residual(p), short)


def _factors_of_parts(data: _Data, p: Floats) -> list[Solution | None]:
    """Return by how much the factor is another in each half of the log, to the north and to the east."""
    e, J, Z = data.residual(p), data.derivatives(p), data.instruments(p)
    return [
        step(
            Z[rows, way : way + 1, SCALE : SCALE + 1],
            J[rows, way : way + 1, SCALE : SCALE + 1],
            e[rows, way : way + 1],
            data.problem.place[rows],
            SIZE[[SCALE]],
            np.zeros(1),
            *independence(data.problem.place[rows]),
        )
        for rows in np.array_split(np.arange(len(e)), 2)
        for way in (0, 1)
    ]


def _slope(values: Floats, rows: int) -> Floats:
    """Return the slope per row of a quadratic through every `rows` rows, an odd number, shape (n, 2): Savitzky and Golay 1964.

    At the ends it is that of the outermost quadratic. It is what `scipy.signal.savgol_filter` returns, which takes a second to
    import.
    """
    half = rows // 2
    offsets = np.arange(-half, half + 1)
    inner = np.stack([values[k : len(values) - 2 * half + k] for k in range(rows)])
    slope = np.empty_like(values)
    slope[half : len(values) - half] = np.tensordot(offsets / np.sum(offsets**2), inner, axes=1)
    quadratic = np.linalg.pinv(np.vander(offsets, 3, increasing=True))
    slope[:half] = (quadratic[1] + 2.0 * offsets[:half, None] * quadratic[2]) @ values[:rows]
    slope[len(values) - half :] = (quadratic[1] + 2.0 * offsets[half + 1 :, None] * quadratic[2]) @ values[-rows:]
    return slope


def _start(data: _Data) -> tuple[Floats, NDArray[np.bool_]]:
    """Return parameters to begin with and those let in: one factor and one rotation where they are gross, and the drift."""
    pulled = data.problem.rate(data.eta[:, :2])
    u, v = data.velocity.T
    pushed = data.problem.mean(np.column_stack(to_world(u, v, data.eta[:, 2])))
    a, b = pulled[:, 0] + 1j * pulled[:, 1], pushed[:, 0] + 1j * pushed[:, 1]
    product, power = complex(np.vdot(a, b)), float(np.vdot(a, a).real)
    start, active = NEUTRAL.copy(), np.zeros(7, dtype=np.bool_)
    active[NORTH:] = True
    scale, angle = abs(product) / power, float(np.angle(product))
    if scale > 0.1 and max(abs(scale - 1.0), abs(angle)) > CHECKS.gross:
        start[SCALE], start[ANGLE] = scale, angle
        active[[*GROSS]] = True
    return start, active


def _certain(solution: Solution, index: int) -> bool:
    return solution.certain(index, float(NEUTRAL[index]))


def _search(data: _Data, start: Floats, active: NDArray[np.bool_]) -> tuple[Floats, Solution, NDArray[np.bool_]] | None:
    """Let parameters in, the most certain first, until none of the others is certain."""
    p, active = start, active.copy()
    while True:
        solved = _solve(data, p, active)
        if solved is None:
            return None
        p, solution = solved
        e, J, Z = data.residual(p), data.derivatives(p), data.instruments(p)
        open_ = [one for one in TOGETHER if not active[list(one)].all()]
        # Beside one error another may hide; each of two has to be certain then.
        for several in (combinations(open_, 1), combinations(open_, 2)):
            scores = []
            for some in several:
                more = active.copy()
                more[[k for one in some for k in one]] = True
                change = _step(data, p, more, e, J, Z)
                if change is not None and all(any(map(change.certain, one)) for one in some):
                    scores.append((min(max(map(change.score, one)) for one in some), some))
            if scores:
                break
        if not scores:
            return p, solution, active
        active[[k for one in max(scores)[1] for k in one]] = True


def _step(data: _Data, p: Floats, active: NDArray[np.bool_], e: Floats, J: Floats, Z: Floats) -> Solution | None:
    """Return the change of the parameters that were let in, zero for the others."""
    Z, J = Z[:, :, active], J[:, :, active]
    place = data.problem.place
    change = step(Z, J, e, place, SIZE[active], (p - NEUTRAL)[active], *independence(place))
    if change is None:
        return None
    values, errors = np.zeros(7), np.zeros(7)
    values[active], errors[active] = change.values, change.errors
    return Solution(values, errors, change.freedom)


def _solve(
    data: _Data, start: Floats, active: NDArray[np.bool_], *, own: bool = False
) -> tuple[Floats, Solution] | None:
    """Return values and solution; instruments made of the velocities themselves where `own`."""
    p, solution = start.copy(), None
    for _ in range(STEPS):
        e, J = data.residual(p), data.derivatives(p)
        change = _step(data, p, active, e, J, J if own else data.instruments(p))
        if change is None:
            return None
        moved = np.clip(change.values, -SIZE, SIZE)
        p = p + moved
        p[SCALE] = max(p[SCALE], 1e-2)
        solution = Solution(p, change.errors, change.freedom)
        if np.all(np.abs(moved) <= 0.05 * change.errors + 1e-9):
            break
    return None if solution is None else (p, solution)
