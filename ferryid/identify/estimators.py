"""The choice between the estimators: both are tried on folds of the training rows, and judged by the same windows."""

from __future__ import annotations

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.identify.estimation import estimate_correction
from ferryid.identify.motion_data import LogData
from ferryid.identify.outcome import EstimatorScore
from ferryid.identify.physical_checks import physical_checks
from ferryid.identify.settings import FOLDS
from ferryid.identify.split import Split
from ferryid.identify.thresholds import IDENTIFY
from ferryid.identify.weak_data import WeakData
from ferryid.types import Flags, Floats, no_progress


def fold_error(data: LogData, components: int) -> float:
    """Return the squared prediction error over the base model's on folds of the training rows; see `EstimatorScore.folds`."""
    base, model = np.zeros(3), np.zeros(3)
    for part in _parts(data.split):
        one = data.fold(part)
        try:
            found = estimate_correction(one, components, 0, no_progress).coefficients
        except FerryIdError:
            return float("inf")
        errors, windows = one.windows.errors(found), sum(len(rows) for rows in one.windows.validation)
        if windows:
            base, model = base + windows * errors.mse_base, model + windows * errors.mse_model
    return mean_ratio(base, model)


def mean_ratio(base: Floats, model: Floats) -> float:
    """Return the mean over the axes of the model's error over the base model's; NaN where no axis has any."""
    some = base > 0.0
    return float(np.mean(model[some] / base[some])) if some.any() else float("nan")


def _parts(split: Split) -> list[Split]:
    """Return splits of the training rows: every log's in contiguous parts, or whole logs where there are enough."""
    logs = [number for number, mask in enumerate(split.training) if mask.any()]
    nothing = tuple(np.zeros_like(mask) for mask in split.training)
    parts = []
    for fold in range(FOLDS):
        test = list(nothing)
        for place, number in enumerate(logs):
            if len(logs) >= FOLDS:
                test[number] = split.training[number] if place % FOLDS == fold else nothing[number]
            else:
                test[number] = _part(split.training[number], fold)
        train = tuple(mask & ~held for mask, held in zip(split.training, test, strict=True))
        parts.append(Split("folds", train, tuple(test), split.purge_s))
    return parts


def _part(mask: Flags, fold: int) -> Flags:
    rows = np.array_split(np.flatnonzero(mask), FOLDS)[fold]
    part = np.zeros_like(mask)
    part[rows] = True
    return part


def choose_estimator(
    derivative: LogData, weak: WeakData, components: dict[str, int]
) -> tuple[LogData, tuple[EstimatorScore, ...]]:
    """Return the data of the estimator of less error on folds of the training rows, and the scores of both.

    One whose inertia or damping no hull can have gives way to one that is possible, better than the base model, and errs little
    more. Where it errs far more, what is impossible is the data's, and is for the acceptance to say.

    Parameters
    ----------
    derivative, weak
        The same logs for either.
    components
        Number of SIMPLS components of either, by its name.
    """
    both: dict[str, LogData] = {"weak": weak, "derivative": derivative}
    errors = {name: fold_error(data, components[name]) for name, data in both.items()}
    held_out, possible = dict[str, float](), dict[str, bool]()
    for name, data in both.items():
        found = estimate_correction(data, components[name], 0, no_progress).coefficients
        judged = data.windows.errors(found)
        held_out[name] = mean_ratio(judged.mse_base, judged.mse_model)
        possible[name] = all(one.passed is not False for one in physical_checks(data, data.combined(found)))
    # The order settles what is alike.
    least = min(both, key=lambda name: errors[name])
    most = min(1.0, IDENTIFY.possible_error * errors[least])
    able = [name for name in both if possible[name] and errors[name] < most]
    chosen = min(able or [least], key=lambda name: errors[name])
    scores = tuple(EstimatorScore(name, errors[name], held_out[name], name == chosen, possible[name]) for name in both)
    return both[chosen], scores
