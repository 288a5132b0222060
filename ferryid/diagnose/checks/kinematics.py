"""Position against velocity, in the weak form: what does not fit between them, all at once.

With p the measured position, psi the heading and nu the velocity, a receiver `l` from where the velocity is measured, a heading
that is `b` too large, a velocity that is multiplied by `k`, positions that are `T` late and a drift `d` of the position
(water under a log that measures through water)::

    d/dt (p - R(psi - b) l) = R(psi(t - T) - b) nu(t - T) / k + d

Both sides are averaged over windows whose weight takes the derivative. Velocities are noisy, and noise in a regressor makes its
factor too small; so the regressors' instruments are made of positions, and made of velocities in a second solution. The truth
lies between the two where positions are noisy as well, which is why a finding has to be one in both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from ferryid.diagnose.checks.regression import BLOCK_S, Solution, step
from ferryid.diagnose.checks.spans import Spans, spans
from ferryid.effects.picture import Scene
from ferryid.vessel.frames import to_body, to_world
from ferryid.vessel.profile import Floats

SCALE, ANGLE, X, Y, LATE = range(5)
"""Places of k [-], b [rad], l [m] and T [s] among the parameters; the drift, north and east [m/s], comes after them."""
NEUTRAL = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
SIZE = np.array([0.5, 0.5, 10.0, 10.0, 2.0, 1.0, 1.0])
TINY = np.array([1e-4, 1e-4, 1e-2, 1e-2, 1e-2, 1e-3, 1e-3])
STEPS = 12
OUTLIER = 6.0
"""Spans whose residual is this many standard deviations are left out: a position that jumps says nothing of the velocity."""
SLOW_MPS = 0.02
"""Below this root mean square of the speed, positions and velocities are compared in vain."""
DERIVATIVE_S = 2.0


@dataclass(frozen=True)
class Kinematics:
    """What does not fit between position and velocity.

    Attributes
    ----------
    solution
        With instruments made of positions.
    rival
        Values with instruments made of velocities, shape (7,).
    middle_s
        Middle of the windows that were used [s], shape (J,).
    regressors
        Derivatives of the residual by the parameters, north and east, shape (J, 2, 7).
    left
        Residual [m/s], shape (J, 2).
    """

    solution: Solution
    rival: Floats
    middle_s: Floats
    regressors: Floats
    left: Floats

    def found(self, index: int, least: float) -> bool:
        """Return whether a parameter is certainly not neutral, and by at least `least`, in both solutions alike."""
        one, other = self.solution.values[index] - NEUTRAL[index], self.rival[index] - NEUTRAL[index]
        both = min(abs(one), abs(other)) >= least and one * other > 0.0
        return bool(both and self.solution.certain(index, float(NEUTRAL[index])))

    def evidence(self, index: int) -> dict[str, Floats]:
        """Return what one parameter explains: its regressor against what is left without it."""
        regressor = -self.regressors[:, :, index]
        share = (self.solution.values[index] - NEUTRAL[index]) * regressor
        return {
            "time_s": np.repeat(self.middle_s, 2),
            "regressor": regressor.ravel(),
            "difference_mps": (self.left + share).ravel(),
        }


def kinematics(scene: Scene) -> Kinematics | None:
    """Compare positions and velocities; None where the scene has too little of them."""
    trial = spans(scene, np.hstack([scene.eta, scene.nu_raw[:, :2]]))
    if len(trial.starts) < 8:
        return None
    velocity = np.where(np.isfinite(scene.nu_raw[:, :2]), scene.nu_raw[:, :2], 0.0)
    eta = np.where(np.isfinite(scene.eta), scene.eta, 0.0)
    pulled = _pull(scene)
    still = trial.rate(eta[:, :2])
    if np.sqrt(np.mean(still**2) * 2.0) < SLOW_MPS:
        return None
    block = (trial.middle_s // BLOCK_S).astype(np.int64)
    kept = np.ones(len(trial.starts), dtype=np.bool_)
    start = _start(trial, eta, velocity)
    found: tuple[Floats, Solution, Floats, Floats] | None = None
    for _ in range(2):
        found = _solve(trial, eta, velocity, pulled, start, kept, block)
        if found is None:
            return None
        size = np.abs(found[3]).max(axis=1)
        spread = np.median(size[kept])
        kept = size <= OUTLIER * max(float(spread), 1e-9)
        start = found[0]
    rival = _solve(trial, eta, velocity, None, start, kept, block)
    if found is None or rival is None:
        return None
    values, solution, J, left = found
    return Kinematics(solution, rival[0], trial.middle_s[kept], J[kept], left[kept])


def _pull(scene: Scene) -> Floats:
    """Return the velocity over ground that positions give, north and east [m/s], shape (n, 2)."""
    t, dt = scene.t, scene.step_s
    m = 2 * max(2, round(0.5 * DERIVATIVE_S / dt)) + 1
    known = scene.usable & np.isfinite(scene.eta).all(axis=1)
    filled = np.column_stack([np.interp(t, t[known], scene.eta[known, k]) for k in (0, 1)])
    return np.asarray(savgol_filter(filled, min(m, len(t) - 1 + len(t) % 2), 2, deriv=1, delta=dt, axis=0))


def _start(trial: Spans, eta: Floats, velocity: Floats) -> Floats:
    """Return a first guess: one factor and one rotation, whatever their size."""
    pulled = trial.rate(eta[:, :2])
    pushed = trial.mean(np.column_stack(to_world(velocity[:, 0], velocity[:, 1], eta[:, 2])))
    a, b = pulled[:, 0] + 1j * pulled[:, 1], pushed[:, 0] + 1j * pushed[:, 1]
    product = complex(np.vdot(a, b))
    start = NEUTRAL.copy()
    power = float(np.vdot(a, a).real)
    if power > 0.0 and abs(product) > 0.1 * power:
        start[SCALE], start[ANGLE] = abs(product) / power, np.angle(product)
    return start


def _residual(trial: Spans, eta: Floats, velocity: Floats, p: Floats) -> Floats:
    """Return what is left between position and velocity [m/s], shape (J, 2)."""
    heading = eta[:, 2] - p[ANGLE]
    lever = np.column_stack(to_world(np.full_like(heading, p[X]), np.full_like(heading, p[Y]), heading))
    over_ground = np.column_stack(to_world(velocity[:, 0], velocity[:, 1], heading)) / p[SCALE]
    if p[LATE] != 0.0:
        row = np.arange(len(heading), dtype=np.float64)
        over_ground = np.column_stack([np.interp(row - p[LATE] / trial.step_s, row, one) for one in over_ground.T])
    return np.asarray(trial.rate(eta[:, :2] - lever) - trial.mean(over_ground) - p[5:7])


def _derivatives(trial: Spans, eta: Floats, velocity: Floats, p: Floats) -> Floats:
    """Return the residual's derivatives by the parameters, shape (J, 2, 7)."""
    columns = []
    for k, tiny in enumerate(TINY):
        more, less = p.copy(), p.copy()
        more[k] += tiny
        less[k] -= tiny
        columns.append((_residual(trial, eta, velocity, more) - _residual(trial, eta, velocity, less)) / (2.0 * tiny))
    return np.stack(columns, axis=-1)


def _solve(
    trial: Spans,
    eta: Floats,
    velocity: Floats,
    pulled: Floats | None,
    start: Floats,
    kept: NDArray[np.bool_],
    block: NDArray[np.int64],
) -> tuple[Floats, Solution, Floats, Floats] | None:
    """Return values, solution, derivatives and residual of all windows; instruments of `pulled`, or of the velocities."""
    p = start.copy()
    for _ in range(STEPS):
        e = _residual(trial, eta, velocity, p)
        J = _derivatives(trial, eta, velocity, p)
        Z = J
        if pulled is not None:
            as_measured = np.column_stack(to_body(pulled[:, 0], pulled[:, 1], eta[:, 2] - p[ANGLE])) * p[SCALE]
            Z = _derivatives(trial, eta, as_measured, p)
        change = step(
            Z[kept].reshape(-1, 7),
            J[kept].reshape(-1, 7),
            e[kept].ravel(),
            np.repeat(block[kept], 2),
            SIZE,
            p - NEUTRAL,
        )
        if change is None:
            return None
        moved = np.clip(change.values, -SIZE, SIZE)
        p = p + moved
        p[SCALE] = max(p[SCALE], 1e-3)
        if np.all(np.abs(moved) < 0.05 * change.errors + 1e-9):
            break
    solution = Solution(p, change.errors, change.freedom)
    return p, solution, J, _residual(trial, eta, velocity, p)
