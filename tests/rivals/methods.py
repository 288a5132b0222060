"""The methods: base model, ferryid's two estimators, the thesis's pipeline, and three rivals.

All give a correction ``tau = F_0 + theta' phi + intercept`` with the terms of `ferryid fit`, and the same code judges them.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from pysindy.optimizers import STLSQ

from ferryid.identify.estimation import estimate_correction
from ferryid.identify.estimators import choose_estimator
from ferryid.identify.fit_data import Coefficients
from ferryid.identify.log_sums import folds_by_blocks, force_free_axes, sum_log
from ferryid.identify.model_selection import select_model
from ferryid.identify.own_conditions import with_own_conditions
from ferryid.identify.weak_data import weak_data
from ferryid.identify.weak_rows import to_force
from ferryid.identify.window_length import with_best_length
from ferryid.types import Floats, Ints, no_progress
from ferryid.validation.rivals import stepwise
from tests.rivals.output_error import fit_output_error
from tests.rivals.task import Task, coefficients

BLOCKS = 5
"""Contiguous parts of the rows, by which weak SINDy chooses its threshold."""
THESIS_COMPONENTS = 12
THRESHOLDS = tuple(float(one) for one in np.geomspace(0.005, 0.5, 7))
"""Shares of the target's root mean square below which weak SINDy leaves a term out."""
RIDGE = 1e-3
"""Weight of squared coefficients against the mean square of the rest, as pysindy's `STLSQ` needs for columns that trade."""
Method = Callable[[Task, int], Coefficients]
"""``method(task, draws)``; with `draws` the methods that draw again for their intervals do so."""


def base(task: Task, draws: int) -> Coefficients:
    """Return no correction."""
    return coefficients(np.zeros((len(task.functions.terms), 3)), np.zeros(3))


def weak(task: Task, draws: int) -> Coefficients:
    """Return what ``ferryid fit --estimator weak`` finds."""
    data = with_own_conditions(with_best_length(weak_data(task.data)))
    return estimate_correction(data, data.components(), draws, no_progress).coefficients


def derivative(task: Task, draws: int) -> Coefficients:
    """Return what ``ferryid fit --estimator derivative`` finds, the number of components by cross-validation."""
    return estimate_correction(task.data, _derivative_components(task), draws, no_progress).coefficients


def auto(task: Task, draws: int) -> Coefficients:
    """Return what ``ferryid fit`` finds: by the possible one of its estimators that errs less on folds of the training rows."""
    data = with_own_conditions(with_best_length(weak_data(task.data)))
    components = {"weak": data.components(), "derivative": _derivative_components(task)}
    chosen, scores = choose_estimator(task.data, data, components)
    (name,) = (one.name for one in scores if one.chosen)
    return estimate_correction(chosen, components[name], draws, no_progress).coefficients


def _derivative_components(task: Task) -> int:
    settings, data = task.settings, task.data
    logs = [
        sum_log(task.profile, settings, task.functions, one.measured, (settings.window_s,), wanted=rows)
        for one, rows in zip(task.logs, data.split.training, strict=True)
    ]
    folds, idle = folds_by_blocks(logs), force_free_axes(logs)
    return select_model(task.profile, settings, task.functions, (settings.window_s,), folds, idle).components


def thesis(task: Task, draws: int) -> Coefficients:
    """Return what the thesis's pipeline finds: smooth, differentiate, SIMPLS with 12 components, no bounds on the inertia."""
    data = replace(task.data, settings=replace(task.settings, inertia="fitted"))
    return estimate_correction(data, THESIS_COMPONENTS, draws, no_progress).coefficients


def stepwise_derivative(task: Task, draws: int) -> Coefficients:
    """Return ordinary least squares on smoothed and differentiated motion, terms added and removed by Schwarz's criterion.

    Of the rows one a smoothing window is taken: those between repeat it.
    """
    data, functions = task.data, task.functions
    picked = []
    for motion, rows in zip(data.motions, data.split.training, strict=True):
        picked.append(np.flatnonzero(rows)[:: max(1, round(task.settings.window_s * motion.rate_hz))])
    X = np.concatenate([functions.of(motion)[rows] for motion, rows in zip(data.motions, picked, strict=True)])
    Y = np.concatenate([target[rows] for target, rows in zip(data.targets, picked, strict=True)])
    theta, intercept, error = _select_terms(X, Y, functions.mask, stepwise.choose)
    return coefficients(theta, intercept, error)


def weak_sindy(task: Task, draws: int) -> Coefficients:
    """Return sparse regression in the weak form: sequentially thresholded least squares on windows (Messenger & Bortz 2021).

    The acceleration, integrated by parts, is explained by forces and functions of velocity, as in ``fit --estimator weak``; no
    prior, no whitening, no bounds. The threshold is chosen by cross-validation on contiguous blocks.
    """
    windows, terms = task.windows, task.functions.terms
    X = np.concatenate([one.regressors(terms) for one in windows.training])
    Y = np.concatenate([one.force - one.base(one.by_velocity) for one in windows.training])
    gains, offset, _ = _select_terms(X, Y, task.functions.mask, sparse)
    return coefficients(*to_force(gains, offset, terms, windows.base_mass))


def sparse(X: Floats, y: Floats, block: Ints) -> Floats:
    """Return coefficients by sequentially thresholded least squares.

    The threshold is the largest within one standard error of the best.

    Parameters
    ----------
    X, y
        Columns of mean square 1, shape (m, k), and what they are to explain, shape (m,).
    block
        Which block a row lies in, shape (m,); each is predicted from the others.
    """
    errors = np.array(
        [
            [
                np.mean(
                    (y[block == held] - X[block == held] @ _thresholded(X[block != held], y[block != held], one)) ** 2
                )
                for held in range(BLOCKS)
            ]
            for one in THRESHOLDS
        ]
    )
    mean = errors.mean(axis=1)
    best = int(np.argmin(mean))
    spread = (errors - errors[best]).std(axis=1, ddof=1) / np.sqrt(BLOCKS)
    return _thresholded(X, y, THRESHOLDS[int(np.flatnonzero(mean <= mean[best] + spread).max())])


def _thresholded(X: Floats, y: Floats, threshold: float) -> Floats:
    with warnings.catch_warnings():
        # That a large threshold leaves no term at all is a result, and what cross-validation is there to decide.
        warnings.simplefilter("ignore")
        found = STLSQ(threshold=threshold, alpha=RIDGE * len(y)).fit(X, y)
    return np.asarray(found.coef_, dtype=np.float64).reshape(-1)


def _select_terms(
    X: Floats, Y: Floats, mask: np.ndarray, choose: Callable[[Floats, Floats, Ints], Floats]
) -> tuple[Floats, Floats, Floats]:
    """Return coefficients, intercepts and standard errors of the terms chosen on each axis: (K, 3), (3,), (K, 3)."""
    n, K = X.shape
    theta, intercept, error = np.zeros((K, 3)), np.zeros(3), np.zeros((K, 3))
    block = np.arange(n) * BLOCKS // n
    for axis in range(3):
        places = np.flatnonzero(mask[:, axis])
        columns = np.column_stack([X[:, places], np.ones(n)])
        size, unit = np.sqrt(np.mean(columns**2, axis=0)), np.sqrt(np.mean(Y[:, axis] ** 2))
        some = size > 0.0
        if not unit > 0.0:
            continue
        found = np.zeros(len(size))
        found[some] = choose(columns[:, some] / size[some], Y[:, axis] / unit, block) * unit / size[some]
        theta[places, axis], intercept[axis] = found[:-1], found[-1]
        chosen = np.flatnonzero(found)
        left = Y[:, axis] - columns @ found
        inverse = np.linalg.pinv(columns[:, chosen].T @ columns[:, chosen], hermitian=True)
        spread = np.zeros(len(found))
        spread[chosen] = np.sqrt(left @ left / max(n - len(chosen), 1) * np.diag(inverse))
        error[places, axis] = spread[:-1]
    return theta, intercept, error


METHODS: Mapping[str, Method] = {
    "base model": base,
    "ferryid auto": auto,
    "ferryid weak": weak,
    "ferryid derivative": derivative,
    "thesis (12 components)": thesis,
    "output error": fit_output_error,
    "weak SINDy": weak_sindy,
    "stepwise": stepwise_derivative,
}
"""Every method by the name that the page gives it."""
