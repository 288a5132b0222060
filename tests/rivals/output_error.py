"""Output error by multiple shooting: what grey-box estimation of MATLAB and the system identification of MuJoCo do.

Logs are cut into segments of some seconds. From a free initial state each segment is integrated under the measured force, and
the coefficients of base model and correction, added mass among them, are those with which velocities and poses differ least
from the measured ones (Ljung 1999, section 7.2; Bock 1983). Initial states are eliminated: for given coefficients they are the
best, and the Jacobian is projected (Golub and Pereyra 1973, Kaufman 1975), so that `scipy.optimize.least_squares` sees the
coefficients alone. It begins at the base model. There is no prior, no bound and no process noise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from ferryid.compiled import compiled
from ferryid.identify.fit_data import Coefficients
from ferryid.models.forces import ACCELERATIONS, motion_force
from ferryid.regression.bases import make_basis
from ferryid.signals.track import segments
from ferryid.types import Floats, Ints
from ferryid.vessel.dimensions import froude_seconds
from tests.rivals.task import Task, coefficients

SEGMENT_S, STEP_S = 10.0, 0.5
"""Length of a segment and of a step of the integration [s], for a vessel of 5 m; others by Froude's law."""
WEIGHINGS = 2
"""Solutions, each with the channels weighted by what the one before left of them."""
MOST_EVALUATIONS = 25
INNER_STEPS = 1
PROBE = 1e-5
"""Change by which slopes are taken, of a coefficient's usual size or of a state's spread."""
FUNCTIONS = ("uv", "ur", "vr", "rr", "u", "v", "r", "u^3", "v^3", "r^3", "|u|u", "|v|v", "|r|r", "|v|r", "|r|v")
"""Order of the functions of velocity in `_shoot`."""
_LOST = 1e3
"""Residual of coefficients without a positive mass, in standard deviations."""


@dataclass(frozen=True, eq=False)
class Segments:
    """Segments of all logs, the logs one below the other.

    Attributes
    ----------
    tau
        Applied force less that of the measured wind on the base model, shape (n, 3).
    loads
        Functions of wind at the measured motion, shape (n, W).
    start, stride
        First row and rows per step of every segment, shape (S,).
    step_s
        Length of a step of every segment, shape (S,).
    states
        Measured pose and velocity after every step, shape (S, steps + 1, 6).
    posed
        Whether poses were measured.
    """

    tau: Floats
    loads: Floats
    start: Ints
    stride: Ints
    step_s: Floats
    states: Floats
    posed: bool


def cut(task: Task) -> Segments:
    """Cut the training rows of a task into segments.

    Raises
    ------
    ValueError
        For what this method does not know: currents and payloads.
    """
    length_s, step_s = (froude_seconds(task.profile, one) for one in (SEGMENT_S, STEP_S))
    wind = [k for k, name in enumerate(task.functions.terms) if name not in (*FUNCTIONS, *ACCELERATIONS)]
    taus, loads, starts, strides, lengths, states = [], [], [], [], [], []
    offset = 0
    for motion, rows in zip(task.data.motions, task.data.split.training, strict=True):
        if motion.current is not None or motion.payload is not None:
            raise ValueError(f"{motion.log}: output error knows no current and no payload")
        still = replace(motion, nu_dot=np.zeros_like(motion.nu))
        values = [
            motion_force(task.profile, task.settings.scale, still.nu_dot, motion.nu, motion.eta[:, 2], wind=blown)
            for blown in (None, motion.wind)
        ]
        taus.append(motion.tau + values[0] - values[1])
        loads.append(task.functions.of(still)[:, wind])
        stride = max(1, round(step_s * motion.rate_hz))
        whole = max(4, round(length_s * motion.rate_hz / stride))
        for stretch in segments(rows):
            for first in range(stretch.start, stretch.stop - whole * stride, whole * stride):
                at = first + stride * np.arange(whole + 1)
                starts.append(offset + first)
                strides.append(stride)
                lengths.append(stride / motion.rate_hz)
                states.append(np.column_stack([motion.eta[at], motion.nu[at]]))
        offset += len(motion.t)
    fewest = min(len(one) for one in states)
    stacked = np.array([one[:fewest] for one in states])
    posed = bool(np.isfinite(stacked[:, :, :3]).all())
    tau = np.nan_to_num(np.concatenate(taus))
    return Segments(
        tau,
        np.nan_to_num(np.concatenate(loads)),
        np.array(starts),
        np.array(strides),
        np.array(lengths),
        stacked if posed else np.nan_to_num(stacked),
        posed,
    )


class Shooting:
    """The residual of multiple shooting as a function of the coefficients alone."""

    def __init__(self, task: Task) -> None:
        self.task, self.segments = task, cut(task)
        terms, mask = task.functions.terms, task.functions.mask
        self.places = np.argwhere(np.vstack([mask, np.ones((1, 3), dtype=bool)]))
        """Row and axis of every coefficient; the row after the last is the intercept."""
        self.velocity = [terms.index(name) for name in FUNCTIONS]
        self.accelerations = [terms.index(name) for name in ACCELERATIONS]
        self.wind = [k for k, name in enumerate(terms) if name not in (*FUNCTIONS, *ACCELERATIONS)]
        self.base_mass = task.windows.base_mass
        self.base = base_coefficients(task)
        states = self.segments.states
        spread = np.std(states - states.mean(axis=1, keepdims=True), axis=(0, 1))
        self.spread = np.where(spread > 0.0, spread, 1.0)
        self.weight = np.where([self.segments.posed] * 3 + [True] * 3, 1.0 / self.spread, 0.0)
        X = np.concatenate(
            [task.functions.of(m)[rows] for m, rows in zip(task.data.motions, task.data.split.training, strict=True)]
        )
        Y = np.concatenate([t[rows] for t, rows in zip(task.data.targets, task.data.split.training, strict=True)])
        column, force = np.append(np.sqrt(np.mean(X**2, axis=0)), 1.0), np.sqrt(np.mean(Y**2, axis=0))
        self.size = np.array([force[axis] / max(column[k], 1e-12) for k, axis in self.places])
        """Usual size of every coefficient: it alone would explain what the base model leaves."""

    def theta(self, x: Floats) -> tuple[Floats, Floats]:
        """Return coefficients (K, 3) and intercept (3,) of scaled parameters."""
        whole = np.zeros((len(self.task.functions.terms) + 1, 3))
        whole[self.places[:, 0], self.places[:, 1]] = x * self.size
        return whole[:-1], whole[-1]

    def has_mass(self, x: Floats) -> bool:
        """Return whether the mass matrix is positive."""
        mass = self.base_mass + self.theta(x)[0][self.accelerations].T
        return bool(np.linalg.eigvalsh((mass + mass.T) / 2).min() > 1e-3 * np.linalg.eigvalsh(self.base_mass).min())

    def run(self, x: Floats, initial: Floats) -> Floats:
        """Return the states of all segments, (S, steps + 1, 6), from initial ones (S, 6)."""
        theta, intercept = self.theta(x)
        parts = self.segments
        tau = parts.tau - intercept - parts.loads @ theta[self.wind]
        out = np.empty_like(parts.states)
        limit = 10.0 * np.abs(parts.states[:, :, 3:]).max(axis=(0, 1))
        need = np.ascontiguousarray(self.base + theta[self.velocity])
        inverse = np.linalg.inv(self.base_mass + theta[self.accelerations].T)
        _shoot(need, inverse, tau, parts.start, parts.stride, parts.step_s, initial, limit, out)
        return out

    def residual(self, x: Floats) -> Floats:
        """Return the weighted differences to the measured states with the best initial states, one row a segment, flat."""
        if not self.has_mass(x):
            return np.full(self.segments.states.size, _LOST)
        return self._weighted(self._initial(x)[1]).reshape(-1)

    def jacobian(self, x: Floats) -> Floats:
        """Return the slopes of the residual, projected onto what initial states cannot explain, (rows, parameters)."""
        initial, states, orthogonal = self._initial(x)
        columns = np.empty((states.size, len(x)))
        for k in range(len(x)):
            moved = x.copy()
            moved[k] += PROBE
            slope = ((self.run(moved, initial) - states) * self.weight / PROBE).reshape(len(states), -1)
            slope -= np.einsum("sij,sj->si", orthogonal, np.einsum("sij,si->sj", orthogonal, slope))
            columns[:, k] = slope.reshape(-1)
        return columns

    def _weighted(self, states: Floats) -> Floats:
        return ((states - self.segments.states) * self.weight).reshape(len(states), -1)

    def _initial(self, x: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the best initial states, the states that follow, and an orthonormal basis of what initial states explain."""
        initial = self.segments.states[:, 0].copy()
        states = self.run(x, initial)
        free = np.flatnonzero(self.weight)
        for turn in range(INNER_STEPS + 1):
            slopes = np.empty((len(initial), states[0].size, len(free)))
            for j, k in enumerate(free):
                moved = initial.copy()
                moved[:, k] += PROBE * self.spread[k]
                other = self.run(x, moved)
                slopes[:, :, j] = ((other - states) * self.weight / PROBE).reshape(len(states), -1)
            if turn == INNER_STEPS:
                break
            q, r = np.linalg.qr(slopes)
            against = np.einsum("sij,si->sj", q, self._weighted(states))
            initial[:, free] -= self.spread[free] * np.linalg.solve(r, against[..., None])[..., 0]
            states = self.run(x, initial)
        return initial, states, np.linalg.qr(slopes)[0]

    def weigh(self, x: Floats) -> None:
        """Weight every channel by what these coefficients leave of it."""
        left = self.residual(x).reshape(self.segments.states.shape)
        size = np.sqrt(np.mean(left**2, axis=(0, 1)))
        self.weight = np.where(size > 0.0, self.weight / np.where(size > 0.0, size, 1.0), self.weight)


def base_coefficients(task: Task) -> Floats:
    """Return the base model's Coriolis and damping force as coefficients of `FUNCTIONS`, shape (15, 3)."""
    nu = np.random.default_rng(0).standard_normal((400, 3))
    zero = np.zeros_like(nu)
    functions = make_basis("modulus")
    X = functions.evaluate(nu, zero)[:, [functions.terms.index(name) for name in FUNCTIONS]]
    return np.linalg.lstsq(X, motion_force(task.profile, task.settings.scale, zero, nu, zero[:, 0]), rcond=None)[0]


def fit_output_error(task: Task, draws: int) -> Coefficients:
    """Return the correction with which the vessel is simulated best; intervals as if what is left were white noise."""
    shooting = Shooting(task)
    x = np.zeros(len(shooting.places))
    for _ in range(WEIGHINGS):
        found = least_squares(
            shooting.residual, x, jac=shooting.jacobian, x_scale="jac", max_nfev=MOST_EVALUATIONS, ftol=1e-5
        )
        x = found.x
        shooting.weigh(x)
    theta, intercept = shooting.theta(x)
    freedom = max(len(found.fun) - len(x) - 6 * len(shooting.segments.start), 1)
    covariance = np.linalg.pinv(found.jac.T @ found.jac, hermitian=True) * (found.fun @ found.fun) / freedom
    error = shooting.theta(np.sqrt(np.diag(covariance)))[0]
    return coefficients(theta, intercept, error)


@compiled
def _shoot(
    need: Floats,
    inverse: Floats,
    tau: Floats,
    start: Ints,
    stride: Ints,
    step_s: Floats,
    initial: Floats,
    limit: Floats,
    out: Floats,
) -> None:
    """Integrate every segment by Runge and Kutta's fourth order; `need` are coefficients of `FUNCTIONS`, (15, 3)."""
    state, at, k, total, phi = np.zeros(6), np.zeros(6), np.zeros(6), np.zeros(6), np.zeros(15)
    force = np.zeros(3)
    for s in range(len(start)):
        state[:] = initial[s]
        out[s, 0] = state
        h = step_s[s]
        for i in range(out.shape[1] - 1):
            row = start[s] + i * stride[s]
            after = row + stride[s]
            # The rows beside the middle of the step; they are one where it has a row there.
            low, high = row + stride[s] // 2, after - stride[s] // 2
            total[:] = 0.0
            at[:] = state
            for stage in range(4):
                u, v, r = at[3], at[4], at[5]
                phi[0], phi[1], phi[2], phi[3], phi[4], phi[5], phi[6] = u * v, u * r, v * r, r * r, u, v, r
                phi[7], phi[8], phi[9] = u * u * u, v * v * v, r * r * r
                phi[10], phi[11], phi[12] = abs(u) * u, abs(v) * v, abs(r) * r
                phi[13], phi[14] = abs(v) * r, abs(r) * v
                for a in range(3):
                    if stage == 0:
                        force[a] = tau[row, a]
                    elif stage == 3:
                        force[a] = tau[after, a]
                    else:
                        force[a] = 0.5 * (tau[low, a] + tau[high, a])
                    for j in range(15):
                        force[a] -= phi[j] * need[j, a]
                c, d = np.cos(at[2]), np.sin(at[2])
                k[0], k[1], k[2] = c * u - d * v, d * u + c * v, r
                for a in range(3):
                    k[3 + a] = inverse[a, 0] * force[0] + inverse[a, 1] * force[1] + inverse[a, 2] * force[2]
                weight = 1.0 if stage == 0 or stage == 3 else 2.0
                ahead = h if stage == 2 else 0.5 * h
                for a in range(6):
                    total[a] += weight * k[a]
                    at[a] = state[a] + ahead * k[a]
            for a in range(6):
                state[a] += h / 6.0 * total[a]
            for a in range(3):
                # What diverges is held, so that the residual stays finite.
                state[3 + a] = min(max(state[3 + a], -limit[a]), limit[a])
            out[s, i + 1] = state
