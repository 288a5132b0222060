"""The oracle's size of an effect in a recording: what could be seen by one who knows everything but the size.

The oracle knows which effect it is, on which thruster, in which direction and from when on, and the noise of the recording as
it was; only the size is fitted, and the hull beside it within its prior. An effect that changes the whitened prediction errors
by ``d``, of which the hull takes up what it can, has the log-likelihood ratio ``|d|²/2`` on average. It exceeds the floor of
one parameter, which chance exceeds in `FALSE_SHARE` of the logs, 19 times in 20 where ``|d|`` is `SIGMAS`.
Sensors that err are seen in kinematics likewise, by the standard error of their parameter.

What moves the vessel less than a diagnosis reports is nothing that it is asked for: the size is at least so large. Doses are
multiples of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf, sqrt
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from ferryid.diagnose.data import read_measurements
from ferryid.diagnose.inference import INFERENCE, EstimationProblem
from ferryid.effects import effects
from ferryid.types import Floats
from ferryid.validation.case import Truth
from ferryid.validation.recorded.effects.effect import Concealment
from ferryid.validation.recorded.kinematic_sizes import SIGMAS
from ferryid.validation.recorded.log import RecordedLog, cached_log, cached_problem
from ferryid.validation.recorded.writing import write_log

ROUNDS = 6
"""Of the search for a size."""
CLOSE = 0.05
"""Relative accuracy of a size at which the search ends."""
FURTHEST = 30.0
"""Factor by which a step of the search changes the size at most."""
SMOOTHED = 9
"""Frequencies over which a spectrum is averaged."""
SEARCHED = 4.0
"""How far beyond the largest size of an effect its oracle's is looked for, as a factor."""


@dataclass(frozen=True, eq=False)
class Baseline:
    """A recording as it was, for the oracle.

    Attributes
    ----------
    log, problem
        As read, and its estimation problem, with the noise that the hull alone leaves.
    """

    log: RecordedLog
    problem: EstimationProblem


def baselines(logs: Sequence[str], vessel: str) -> list[Baseline]:
    """Return the logs of a recording, read once in a process."""
    return [Baseline(cached_log(path, vessel), cached_problem(path, vessel)) for path in logs]


def oracle_size(one: Concealment, recording: Sequence[Baseline], truth_of: Callable[[float], Truth]) -> float:
    """Return the size of an effect that the oracle names 19 times in 20; infinite where it is beyond all that is concealed.

    Parameters
    ----------
    one
        The concealment.
    recording
        Its logs, which are a campaign where there are several.
    truth_of
        Returns the truth of a size, all else the same.
    """
    measured = [] if one.visible is None else [one.visible(base.log) for base in recording]
    if seen_there := [size for size in measured if size is not None]:
        return min(seen_there)
    least, most = one.sizes(recording[0].log)
    size, power, before = sqrt(least * most), 1.0, (0.0, 0.0)
    for _ in range(ROUNDS):
        seen = visibility(one, recording, truth_of(size))
        if abs(seen - 1.0) < CLOSE:
            break
        if before[1] > 0.0 and seen > 0.0 and size != before[0]:
            # A load grows with the size, or with its square.
            power = float(np.clip(np.log(seen / before[1]) / np.log(size / before[0]), 0.5, 3.0))
        step = FURTHEST if seen <= 0.0 else float(np.clip(seen ** (-1.0 / power), 1.0 / FURTHEST, FURTHEST))
        before, size = (size, seen), min(max(size * step, least), SEARCHED * most)
        if size == before[0]:
            return inf if seen < 1.0 else size
    return size


def visibility(one: Concealment, recording: Sequence[Baseline], truth: Truth) -> float:
    """Return how far an effect is beyond what an oracle sees, 1 where it just does.

    It is the smaller of two ratios: of the deviation in standard deviations to `SIGMAS`, and of what the vessel moves by it, or
    of its parameter, to the least that a diagnosis reports.
    """
    changed, hull, moved = list[Floats](), list[Floats](), 0.0
    unsteady = truth.effect in effects() and effects()[truth.effect].unsteady is not None
    gain = 0.0
    for base in recording:
        problem, as_it_was = base.problem, base.problem.plain
        if one.altered is not None:
            altered = one.altered(as_it_was, truth)
        else:
            parts = _parts(one, base.log, truth)
            more = resampled(parts - base.log.measurements.parts, base.log.measurements.t, as_it_was.measurements.t)
            altered = replace(as_it_was, parts=as_it_was.parts + more)
        by_step = problem.steps.gap(altered) - problem.steps.gap(as_it_was)
        white = problem.whitening_filter.white(by_step)
        gain += _gain_of_noise(white.reshape(by_step.shape)) if unsteady else 0.0
        changed.append(white)
        hull.append(problem.by_hull)
        windows = problem.windows
        by_window = windows.gap(altered) - windows.gap(as_it_was)
        usual = np.sqrt(np.mean(windows.measured[:, windows.channels] ** 2, axis=0))
        moved = max(moved, float((np.sqrt(np.mean(by_window**2, axis=0)) / np.maximum(usual, 1e-12)).max()))
    deviation = sqrt(2.0 * gain) if unsteady else _beside_hull(np.concatenate(changed), np.vstack(hull))
    return min(deviation / SIGMAS, moved / INFERENCE.void_share, _over_least(one, truth))


def _parts(one: Concealment, log: RecordedLog, truth: Truth) -> Floats:
    """Return the actuators' forces that an altered record claims, as a diagnosis reads them, shape (n, k, 3)."""
    if one.parts is not None:
        return one.parts(log, truth)
    made = one.conceal(log, truth, np.random.default_rng(0))
    with TemporaryDirectory() as folder:
        return reread(write_log(made.log, Path(folder), "altered"), log)


def reread(path: Path, log: RecordedLog) -> Floats:
    """Return the actuators' forces of a log on the rows of another's measurements, shape (n, k, 3)."""
    again = read_measurements(str(path), log.profile)[0]
    return resampled(again.parts, again.t, log.measurements.t)


def resampled(parts: Floats, t: Floats, at: Floats) -> Floats:
    """Return forces, shape (n, k, 3) at times t [s], at other times, linear in between."""
    flat = parts.reshape(len(t), -1)
    return np.column_stack([np.interp(at, t, one) for one in flat.T]).reshape(len(at), *parts.shape[1:])


def _beside_hull(changed: Floats, hull: Floats) -> float:
    """Return the length of whitened changes, shape (w,), less what the hull takes up within its prior; slopes shape (w, 26)."""
    across = hull.T @ changed
    taken = across @ np.linalg.solve(hull.T @ hull + np.eye(hull.shape[1]), across)
    return sqrt(max(float(changed @ changed - taken), 0.0))


def _gain_of_noise(white: Floats) -> float:
    """Return the expected log-likelihood ratio of a random push of known spectrum, whitened, shape (steps, channels).

    By Whittle's likelihood: half a nat for each frequency and channel times ``s - log(1 + s)``, with s the ratio of its power
    to that of the noise, which is one.
    """
    power = np.abs(np.fft.rfft(white, axis=0)) ** 2 / len(white)
    kernel = np.ones(SMOOTHED) / SMOOTHED
    ratio = np.stack([np.convolve(one, kernel, mode="same") for one in power.T], axis=1)
    return float(np.sum(ratio - np.log1p(ratio)))


def _over_least(one: Concealment, truth: Truth) -> float:
    """Return by how much the largest parameter of an effect is over the least that is reported."""
    effect = effects().get(truth.effect)
    if effect is None or effect.negligible == 0.0:
        return inf
    neutral = one.neutral
    return (
        max(abs(value - neutral) for name, value in truth.values.items() if name not in one.positions)
        / effect.negligible
    )
