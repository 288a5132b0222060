"""How well models predict logs that they did not learn from: windows of seconds, and free runs."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.identify.fit_data import Coefficients
from ferryid.identify.prediction_windows import PredictionWindows
from ferryid.models.forces import effective_mass
from ferryid.models.prediction.free_run import runs_free, single_runs, starting_points
from ferryid.types import Floats
from tests.rivals.methods import METHODS, Method
from tests.rivals.task import Task

HORIZONS_S = (10.0, 30.0, 60.0)


@dataclass(frozen=True, eq=False)
class Score:
    """A method on the held-out logs of one or more folds.

    Attributes
    ----------
    windows
        Prediction errors in windows as a force on the base model's mass, shape (J, 3), and those of the base model.
    gain
        Logarithm of the probability density of every window's error over the base model's, shape (J,). Densities are normal
        with the covariance that each model leaves in its training windows.
    runs
        Errors of every free run at every horizon, shape (runs, horizons, 4): position [m], heading [rad], speed [m/s], yaw rate
        [rad/s]; infinite where it diverged, NaN where the recording ended before.
    seconds
        Time that the estimate took [s].
    failed
        Why there is no model, by fold; empty where there is one.
    """

    windows: Floats
    base: Floats
    gain: Floats
    runs: Floats
    seconds: float
    failed: tuple[str, ...] = ()

    @property
    def ratio(self) -> float:
        """Squared prediction error in windows over the base model's, mean over axes."""
        size = np.mean(self.base**2, axis=0)
        return float(np.mean(np.mean(self.windows**2, axis=0) / size)) if len(self.base) else float("nan")

    @property
    def diverged(self) -> int:
        """Number of free runs that diverged."""
        return int(np.isinf(self.runs[:, :, 2]).any(axis=1).sum())

    def median(self, quantity: int, horizon: int) -> float:
        """Return the median error over free runs, in which those that diverged count as infinite."""
        some = self.runs[:, horizon, quantity]
        some = some[~np.isnan(some)]
        return float(np.median(some)) if len(some) else float("nan")

    def rms(self, quantity: int, horizon: int) -> float:
        """Return the root mean square over free runs that did not diverge."""
        some = self.runs[:, horizon, quantity]
        some = some[np.isfinite(some)]
        return float(np.sqrt(np.mean(some**2))) if len(some) else float("nan")


def judge(task: Task, test: Task, methods: Mapping[str, Method] = METHODS) -> dict[str, Score]:
    """Fit all methods to a task and score them on another task's rows, the same for all."""
    judged = PredictionWindows(
        task.profile,
        task.settings,
        task.functions,
        test.data.motions,
        replace(test.data.split, kind="logs", validation=test.data.split.training),
    )
    scores = {}
    base: tuple[Floats, Floats] | None = None
    for name, method in methods.items():
        began = time.perf_counter()
        try:
            found = method(task, 0)
            failed = () if runs_free(task.estimator(found), task.data.motions[0]) else ("mass matrix not positive",)
        except FerryIdError as error:
            failed = (str(error),)
        seconds = time.perf_counter() - began
        if failed:
            nothing = np.full((len(base[1]) if base else 0, 3), np.nan)
            none = np.full((_count(test), len(HORIZONS_S), 4), np.nan)
            scores[name] = Score(nothing, nothing, nothing[:, 0], none, seconds, failed)
            continue
        train, held = window_errors(task, task.windows, found), window_errors(task, judged, found)
        base = base or (train, held)
        gain = log_density(held, train) - log_density(held_base := base[1], base[0])
        scores[name] = Score(held, held_base, gain, free_runs(task, test, found), seconds)
    return scores


def window_errors(task: Task, windows: PredictionWindows, found: Coefficients) -> Floats:
    """Return the prediction errors of all windows as a force on the base model's mass, shape (J, 3)."""
    terms = task.functions.terms
    added = effective_mass(task.profile, task.settings.scale, terms, found.theta) - windows.base_mass
    errors = [np.zeros((0, 3))]
    for one in windows.validation if windows.split.kind != "none" else windows.training:
        needed = one.base(one.by_velocity) + one.basis(terms, one.by_velocity) @ found.theta + found.intercept
        onto = one.inertia @ np.linalg.inv(one.inertia + added)
        errors.append(np.einsum("jab,jb->ja", onto, one.force - needed))
    return np.concatenate(errors)


def log_density(errors: Floats, training: Floats) -> Floats:
    """Return the logarithm of the normal density of errors, shape (J,), with the covariance of those in training."""
    covariance = training.T @ training / len(training)
    root = np.linalg.cholesky(covariance + 1e-12 * np.diag(np.diag(covariance)))
    scaled = np.linalg.solve(root, errors.T)
    return np.asarray(-0.5 * np.sum(scaled**2, axis=0) - np.log(np.diag(root)).sum() - 1.5 * np.log(2.0 * np.pi))


def free_runs(task: Task, test: Task, found: Coefficients) -> Floats:
    """Return the errors of all free runs, shape (runs, horizons, 4); see `Score`."""
    law, errors = task.estimator(found), [np.zeros((0, len(HORIZONS_S), 4))]
    for motion in test.data.motions:
        starts, ends = starting_points(motion, motion.valid, HORIZONS_S[0], HORIZONS_S[-1])
        if not len(starts):
            continue
        error = single_runs(law, motion, starts, ends, HORIZONS_S)
        reached = ends[:, None] > (starts + np.round(np.array(HORIZONS_S)[:, None] * motion.rate_hz).astype(int)).T
        lost = reached & np.isnan(error[:, :, 2])
        error[lost] = np.inf
        errors.append(error)
    return np.concatenate(errors)


def _count(test: Task) -> int:
    return sum(len(starting_points(m, m.valid, HORIZONS_S[0], HORIZONS_S[-1])[0]) for m in test.data.motions)


def together(folds: Sequence[Mapping[str, Score]]) -> dict[str, Score]:
    """Return the scores of all folds as one by method."""
    return {
        name: Score(
            *(
                np.concatenate([getattr(fold[name], part) for fold in folds])
                for part in ("windows", "base", "gain", "runs")
            ),
            seconds=float(np.mean([fold[name].seconds for fold in folds])),
            failed=tuple(why for fold in folds for why in fold[name].failed),
        )
        for name in folds[0]
    }
