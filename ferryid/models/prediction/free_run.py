"""Free-run prediction: a model integrated with the measured forces, against what the vessel did."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, NamedTuple

import numpy as np

from ferryid.counts import counted, verb
from ferryid.models.forces.estimator import ForceLaw, without_sway_coupling
from ferryid.models.thresholds import MODELS
from ferryid.signals.track import Motion
from ferryid.types import Flags, Floats, Ints

HORIZONS_S = (5.0, 10.0, 20.0, 30.0, 60.0)
MAX_STARTS = 60
STEP_S = 0.2
MOST_RUNS = 1000
"""Runs that are integrated together: their paths are held in memory."""
NO_MASS = "the model's effective mass matrix is not positive definite: it cannot be run free"


@dataclass(frozen=True, eq=False)
class SingleRuns:
    """Every free run by itself, so that two models can be compared in pairs.

    Attributes
    ----------
    rate_hz
        Rows per second of the log of each run, shape (N,).
    log, start, end
        Log of each run, its first row, and the end of the unbroken stretch in it, shape (N,).
    errors
        As of `single_runs`, shape (N, H, 4).
    reached
        Horizons that lie within the stretch, shape (N, H); where the error is NaN nevertheless the run diverged.
    """

    rate_hz: Floats
    log: Ints
    start: Ints
    end: Ints
    errors: Floats
    reached: Flags


@dataclass(frozen=True)
class FreeRun:
    """Free-run (open-loop) prediction error of a model against horizon, on held-out stretches.

    Attributes
    ----------
    horizons_s
        Prediction horizons [s], shape (H,).
    position_m, heading_rad, speed_mps, yaw_rate_radps
        Root-mean-square error at each horizon, shape (H,); NaN where a run diverged or no stretch was long enough.
    starts
        Number of starting points.
    example
        ``{"t": (n,), "measured": (n, 3), "predicted": (n, 3)}`` of `nu` over one stretch, for a figure.
    note
        Why there is no prediction, or an empty string.
    diverged
        Number of runs that diverged, which the means leave out.
    single
        The runs one by one; None where there are none.
    """

    horizons_s: Floats
    position_m: Floats
    heading_rad: Floats
    speed_mps: Floats
    yaw_rate_radps: Floats
    starts: int
    example: Mapping[str, Floats]
    note: str = ""
    diverged: int = 0
    single: SingleRuns | None = None

    @classmethod
    def not_run(cls, note: str) -> FreeRun:
        """Return the result of no run at all, and why there is none."""
        nothing = np.zeros(0)
        return cls(nothing, nothing, nothing, nothing, nothing, starts=0, example={}, note=note)

    def to_json(self) -> dict[str, Any]:
        """Return the free run as plain values."""
        return {
            "horizons_s": self.horizons_s.tolist(),
            "position_m": self.position_m.tolist(),
            "heading_rad": self.heading_rad.tolist(),
            "speed_mps": self.speed_mps.tolist(),
            "yaw_rate_radps": self.yaw_rate_radps.tolist(),
            "starts": self.starts,
            "note": self.note,
        }


def run_free(
    force: ForceLaw,
    motions: Sequence[Motion],
    rows: Sequence[Flags],
    horizons_s: Sequence[float] = HORIZONS_S,
) -> FreeRun:
    """Predict position and velocity from many starting points and compare them with the measurement.

    From each start the model takes the measured state once, and after it only the measured actuator force (and wind,
    current and payload where they are measured), integrated with Runge-Kutta 4. A wind, current or payload that
    was not measured is part of the error.

    Parameters
    ----------
    force
        Inverse dynamics of the model.
    motions, rows
        Logs, and for each the rows on which the run may be judged, shape (n,); runs stay within unbroken stretches.
    horizons_s
        Horizons [s] at which the error is taken.

    Returns
    -------
    FreeRun
        Root-mean-square errors over all starts; NaN at horizons that no stretch is long enough for.
    """
    horizons = np.asarray(horizons_s, dtype=float)
    runs: list[SingleRuns] = []
    longest: tuple[int, dict[str, Floats]] = (0, {})
    diverged = 0
    if not runs_free(force, motions[0]):
        return _without(horizons, NO_MASS)
    begun = [
        (number, motion, *starting_points(motion, allowed, float(horizons[0]), float(horizons[-1])))
        for number, (motion, allowed) in enumerate(zip(motions, rows, strict=True))
    ]
    begun = [one for one in begun if one[2].size]
    paths = _side_by_side(force, [one[1:] for one in begun], float(horizons[-1]))
    for (number, motion, starts, ends), (path, stride) in zip(begun, paths, strict=True):
        error = _errors(path, stride, motion, starts, ends, horizons)
        reached = _rows_at(starts, stride, motion.rate_hz, horizons) < ends[:, None]
        diverged += int(np.any(reached & np.isnan(error[:, :, 2]), axis=1).sum())
        rates, logs = np.full(starts.size, motion.rate_hz), np.full(starts.size, number)
        runs.append(SingleRuns(rates, logs, starts, ends, error, reached))
        length = min(int(horizons[-1] * motion.rate_hz), int((ends - starts).max()) - 1)
        if length > longest[0]:
            best = int(np.argmax(ends - starts))
            longest = (length, _example(path[best], stride, motion, int(starts[best]), length))
    if not runs:
        return _without(horizons, f"no unbroken held-out stretch of {horizons[0]:g} s")
    single = _joined(runs)
    every = single.errors
    counts = np.sum(np.isfinite(every[:, :, 2]), axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        rms = np.sqrt(np.nansum(every**2, axis=0) / counts[:, None])
    blind = np.all(np.isnan(every[:, :, 0]), axis=0)
    rms[blind, 0] = np.nan
    note = (
        f"{diverged} of {counted(len(every), 'run')} diverged and {verb(diverged, 'is')} left out of the means"
        if diverged
        else ""
    )
    return FreeRun(horizons, rms[:, 0], rms[:, 1], rms[:, 2], rms[:, 3], len(every), longest[1], note, diverged, single)


def _joined(runs: Sequence[SingleRuns]) -> SingleRuns:
    return SingleRuns(*(np.concatenate([getattr(one, each.name) for one in runs]) for each in fields(SingleRuns)))


def runs_free(force: ForceLaw, motion: Motion) -> bool:
    """Tell whether a model can be run free: its effective mass matrix has to be positive definite."""
    return _is_positive(_masses(force, replace(motion, payload=None))[0])


def single_runs(force: ForceLaw, motion: Motion, starts: Ints, ends: Ints, horizons_s: Sequence[float]) -> Floats:
    """Return the error of every run by itself at every horizon, shape (starts, horizons, 4).

    Absolute errors of position [m], heading [rad], speed [m/s] and yaw rate [rad/s]; NaN where a run has diverged, or does
    not reach the horizon within its stretch. Parameters as of `run_free`, and starts and ends as of `starting_points`.
    """
    return single_paths(force, motion, starts, ends, horizons_s)[0]


def single_paths(
    force: ForceLaw, motion: Motion, starts: Ints, ends: Ints, horizons_s: Sequence[float]
) -> tuple[Floats, Floats, int]:
    """Return `single_runs`, where each run went north and east [m], shape (starts, steps, 2), and the rows of a step.

    Positions are NaN once a run has left its stretch or diverged.
    """
    horizons = np.asarray(horizons_s, dtype=float)
    (path,), stride = _integrate([(motion, starts, ends)], force, float(horizons[-1]))
    inside = starts[:, None] + np.arange(path.shape[1]) * stride < ends[:, None]
    places = np.where(inside[:, :, None], path[:, :, :2], np.nan)
    return _errors(path, stride, motion, starts, ends, horizons), places, stride


def predicted_acceleration(force: ForceLaw, motion: Motion, *, coupled_sway: bool = True) -> Floats:
    """Return the acceleration that a model expects in every row from force and velocity [m/s², m/s², rad/s²], shape (n, 3).

    NaN where what it needs was not measured, and everywhere where its mass matrix cannot be inverted. Without `coupled_sway`
    surge and yaw accelerate as if the hull could not sway.
    """
    masses = _masses(force, motion)
    masses = masses if coupled_sway else without_sway_coupling(masses)
    if not (np.linalg.det(masses) > 0.0).all():
        return np.full_like(motion.nu, np.nan)
    payload = () if motion.payload is None else (motion.payload,)
    needed = force(np.zeros_like(motion.nu), motion.nu, motion.eta[:, 2], motion.wind, motion.current, *payload)
    inverses = np.broadcast_to(np.linalg.inv(masses), (len(motion.t), 3, 3))
    return np.asarray(np.einsum("nij,nj->ni", inverses, motion.tau - needed))


def _masses(force: ForceLaw, motion: Motion) -> Floats:
    """Return the effective mass, the derivative of the force by the acceleration, for every row: (n, 3, 3), or (1, 3, 3)."""
    if motion.payload is None:
        return _masses_with(force, motion, None)
    # A payload stays the same for many rows: each of its values is asked for once.
    values, which = np.unique(motion.payload, axis=0, return_inverse=True)
    return _masses_with(force, motion, values)[which.reshape(-1)]


def _masses_with(force: ForceLaw, motion: Motion, payloads: Floats | None) -> Floats:
    count = 1 if payloads is None else len(payloads)
    at_rest = np.zeros((4 * count, 3))
    nu_dot = np.tile(np.vstack([np.zeros(3), np.eye(3)]), (count, 1))
    still = np.zeros((4 * count, 2))
    tau = force(
        nu_dot,
        at_rest,
        np.zeros(4 * count),
        still if motion.wind is not None else None,
        still if motion.current is not None else None,
        *(() if payloads is None else (np.repeat(payloads, 4, axis=0),)),
    ).reshape(count, 4, 3)
    return np.asarray((tau[:, 1:] - tau[:, :1]).transpose(0, 2, 1))


def _is_positive(mass: Floats) -> bool:
    return bool(np.all(np.linalg.eigvalsh((mass + mass.T) / 2) > 0))


def starting_points(motion: Motion, allowed: Flags, shortest_s: float, longest_s: float) -> tuple[Ints, Ints]:
    """Return start rows and the end of the unbroken stretch that each lies in."""
    good = allowed & motion.valid & np.isfinite(motion.nu).all(axis=1) & np.isfinite(motion.tau).all(axis=1)
    good = good & ~_jumps(motion)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], good, [False]]).astype(np.int8)))
    spacing = max(1, round(max(shortest_s, good.sum() / motion.rate_hz / MAX_STARTS) * motion.rate_hz))
    needed = round(shortest_s * motion.rate_hz) + 1
    starts, ends = [], []
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        # The first starts of a stretch see the longest horizons; the stride keeps the starts apart.
        for start in range(int(first), int(last) - needed + 1, spacing):
            starts.append(start)
            ends.append(int(last))
    return np.array(starts, dtype=int), np.array(ends, dtype=int)


def _jumps(motion: Motion) -> Flags:
    """Return the rows at which the measured position leaps farther than the vessel can have gone; runs end there."""
    step = np.hypot(*np.diff(motion.eta[:, :2], axis=0).T)
    fastest = np.nanmax(np.hypot(motion.raw_nu[:, 0], motion.raw_nu[:, 1]), initial=0.0)
    leaps = np.zeros(len(motion.t), dtype=bool)
    leaps[1:] = step > (2.0 * fastest + MODELS.leap_mps) / motion.rate_hz
    return leaps


_Runs = tuple[Motion, Ints, Ints]
"""A log with the first rows of the runs in it, and the end of the unbroken stretch that each lies in."""


def _side_by_side(force: ForceLaw, runs: Sequence[_Runs], horizon_s: float) -> list[tuple[Floats, int]]:
    """Return `_integrate` of every log; runs of logs that were measured alike take their steps together."""
    alike: dict[tuple[object, ...], list[list[int]]] = {}
    for number, (motion, starts, _) in enumerate(runs):
        measured = tuple(getattr(motion, name) is None for name in ("wind", "current", "payload"))
        batches = alike.setdefault((motion.rate_hz, motion.sway_measured, *measured), [[]])
        if sum(len(runs[one][1]) for one in batches[-1]) + len(starts) > MOST_RUNS:
            batches.append([])
        batches[-1].append(number)
    found: dict[int, tuple[Floats, int]] = {}
    for batch in (one for batches in alike.values() for one in batches if one):
        paths, stride = _integrate([runs[one] for one in batch], force, horizon_s)
        found |= {one: (path, stride) for one, path in zip(batch, paths, strict=True)}
    return [found[number] for number in range(len(runs))]


def _integrate(runs: Sequence[_Runs], force: ForceLaw, horizon_s: float) -> tuple[list[Floats], int]:
    """Return states (starts, steps + 1, 6) of position, heading, velocity for every log, and the rows per step.

    As far as the longest stretch goes, where that is shorter than the horizon. The logs have one rate and the same signals.
    """
    motions, (motion, *_) = [one for one, _, _ in runs], runs[0]
    stride = max(1, int(STEP_S * motion.rate_hz))
    substeps = max(1, int(np.ceil(1.0 / (STEP_S * motion.rate_hz))))
    dt = stride / motion.rate_hz / substeps
    longest = max(float(np.max(ends - starts, initial=0)) for _, starts, ends in runs)
    steps = int(np.ceil(min(horizon_s * motion.rate_hz, longest) / stride))
    counts = [len(starts) for _, starts, _ in runs]
    # Rows of all logs one after the other.
    first = np.concatenate([[0], np.cumsum([len(one.t) for one in motions])])
    starts = np.concatenate([own + before for (_, own, _), before in zip(runs, first, strict=False)])
    last = np.repeat(first[1:] - 1, counts)
    outside = _Outside(*(_one_after_the_other(motions, name) for name in _Outside._fields))
    masses = np.concatenate([_masses(force, one) for one in motions])
    inverses = np.linalg.inv(np.where(np.isfinite(masses), masses, np.eye(3)))
    limits = np.array([10.0 * np.nanmax(np.abs(one.nu), axis=0) + 1e-3 for one in motions])
    if not motion.sway_measured:
        limits[:, 1] = limits[:, 0]
    limit = np.repeat(limits, counts, axis=0)
    eta, nu = (np.concatenate([getattr(one, name)[own] for one, own, _ in runs]) for name in ("eta", "nu"))

    state = np.hstack([np.where(np.isfinite(eta), eta, 0.0), nu])
    path = np.empty((len(starts), steps + 1, 6))
    path[:, 0] = state

    def derivative(at: Floats, inputs: _Inputs, inverse: Floats) -> Floats:
        psi, nu = at[:, 2], at[:, 3:]
        tau, wind, current, payload = inputs
        rest = force(no_acceleration, nu, psi, wind, current, *payload)
        out = np.empty_like(at)
        c, s = np.cos(psi), np.sin(psi)
        out[:, 0] = c * nu[:, 0] - s * nu[:, 1]
        out[:, 1] = s * nu[:, 0] + c * nu[:, 1]
        out[:, 2] = nu[:, 2]
        out[:, 3:] = np.einsum("nij,nj->ni", inverse, tau - rest) if payload else (tau - rest) @ inverse.T
        return out

    no_acceleration = np.zeros((len(starts), 3))
    with np.errstate(over="ignore", invalid="ignore"):
        for k in range(steps):
            rows = np.minimum(starts + k * stride, last)
            following = np.minimum(rows + stride, last)
            inverse = inverses[rows] if motion.payload is not None else inverses[0]
            for i in range(substeps):
                a, b = i / substeps, (i + 1) / substeps
                at_a, halfway, at_b = (_inputs(outside, rows, following, part) for part in (a, (a + b) / 2, b))
                k1 = derivative(state, at_a, inverse)
                k2 = derivative(state + dt / 2 * k1, halfway, inverse)
                k3 = derivative(state + dt / 2 * k2, halfway, inverse)
                k4 = derivative(state + dt * k3, at_b, inverse)
                state = state + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            state[np.any(np.abs(state[:, 3:]) > limit, axis=1)] = np.nan
            path[:, k + 1] = state
    return np.split(path, np.cumsum(counts)[:-1]), stride


class _Outside(NamedTuple):
    """What acts from outside in every row: actuator force, wind, current, payload; None where not measured."""

    tau: Floats
    wind: Floats | None
    current: Floats | None
    payload: Floats | None


def _one_after_the_other(motions: Sequence[Motion], name: str) -> Any:
    every = [getattr(one, name) for one in motions]
    return None if every[0] is None else every[0] if len(every) == 1 else np.concatenate(every)


_Inputs = tuple[Floats, Floats | None, Floats | None, tuple[Floats, ...]]
"""What acts from outside in the rows of a step: actuator force, wind, current, payload."""


def _inputs(outside: _Outside, rows: Ints, following: Ints, part: float) -> _Inputs:
    return (
        _between(outside.tau, rows, following, part),
        None if outside.wind is None else _between(outside.wind, rows, following, part),
        None if outside.current is None else _between(outside.current, rows, following, part),
        # Held over the step, as it was measured: half a passenger never came aboard.
        () if outside.payload is None else (outside.payload[rows],),
    )


def _between(values: Floats, rows: Ints, following: Ints, part: float) -> Floats:
    result: Floats = (1.0 - part) * values[rows] + part * values[following]
    return result


def _errors(path: Floats, stride: int, motion: Motion, starts: Ints, ends: Ints, horizons: Floats) -> Floats:
    """Return |error| of position, heading, speed and yaw rate, shape (starts, horizons, 4).

    Where sway was not measured there is none of position, which sway moves too, and that of speed is of surge alone.
    """
    error = np.full((len(starts), len(horizons), 4), np.nan)
    every = _rows_at(starts, stride, motion.rate_hz, horizons)
    for h, rows in enumerate(every.T):
        inside = rows < ends
        at = rows[inside]
        now = path[inside, (at - starts[inside]) // stride]
        if motion.sway_measured:
            error[inside, h, 0] = np.hypot(*(now[:, :2] - motion.eta[at, :2]).T)
        turned = now[:, 2] - motion.eta[at, 2]
        error[inside, h, 1] = np.abs((turned + np.pi) % (2 * np.pi) - np.pi)
        astray = now[:, 3:5] - motion.nu[at, :2]
        error[inside, h, 2] = np.hypot(*astray.T) if motion.sway_measured else np.abs(astray[:, 0])
        error[inside, h, 3] = np.abs(now[:, 5] - motion.nu[at, 2])
    return error


def _rows_at(starts: Ints, stride: int, rate_hz: float, horizons: Floats) -> Ints:
    """Return the row at which each run is compared at each horizon, shape (starts, horizons)."""
    steps = np.array([round(horizon * rate_hz / stride) for horizon in horizons.tolist()], dtype=np.int64)
    return starts[:, None] + steps * stride


def _example(path: Floats, stride: int, motion: Motion, start: int, length: int) -> dict[str, Floats]:
    steps = np.arange(length // stride + 1)
    rows = start + steps * stride
    return {"t": motion.t[rows], "measured": motion.nu[rows], "predicted": path[steps, 3:]}


def _without(horizons: Floats, note: str) -> FreeRun:
    nothing = np.full(len(horizons), np.nan)
    return FreeRun(horizons, nothing, nothing, nothing, nothing, 0, {}, note)
