"""How long the windows are that a fit in the weak form trains on.

The noise of an acceleration from positions falls with the square of a window's length and faster, and nothing is lost of the
equations of motion, which hold over any window; but fewer windows are left, and what acts for seconds only is averaged away.
Which length tells most depends on the noise, so it is taken from the training rows: the one with which predictions scatter
least by the fit's own account. Models are judged in windows of the usual length, whatever length they were fitted with.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

import numpy as np

from ferryid.identify.thresholds import IDENTIFY
from ferryid.identify.weak_data import WeakData
from ferryid.types import Floats

TRAINING_LENGTHS = (1.0, 1.5, 2.0, 3.0)
"""Lengths of training windows that are tried, times the usual one of the vessel."""
Data = TypeVar("Data", bound=WeakData)


def with_best_length(data: WeakData) -> WeakData:
    """Return the data with training windows of the length that tells most; of the settings' own, if they say one."""
    if data.settings.weak_window_s is not None:
        return data
    usual_s = data.windows.length_s
    return best_length({share: _of_length(data, share * usual_s) for share in TRAINING_LENGTHS})


def best_length(candidates: Mapping[float, Data]) -> Data:
    """Return the data of those with which predictions in windows of the usual length scatter least.

    Parameters
    ----------
    candidates
        The same logs with training windows of several lengths, by what the usual one is multiplied with; the usual one first.
    """
    usual = next(iter(candidates.values()))
    if usual.impossible:
        return usual
    enough = [
        share for share, data in candidates.items() if data is usual or _windows(data) >= IDENTIFY.fewest_long_windows
    ]
    if len(enough) == 1:
        return usual
    at = np.concatenate([one.regressors(usual.functions.terms) for one in usual.training_windows])
    at = at - at.mean(axis=0)
    start = usual.conditions.start
    tried = {
        share: usual if candidates[share] is usual else replace(candidates[share], start=start) for share in enough
    }
    scatter = {share: float(np.nansum(np.log(prediction_scatter(one, at)))) for share, one in tried.items()}
    # What is estimated in the end depends on nothing but its own windows.
    return candidates[min(scatter, key=lambda share: scatter[share])]


def prediction_scatter(data: WeakData, at: Floats) -> Floats:
    """Return the standard error of the prediction at regressors (n, K), shape (3,); NaN on an axis without terms.

    That of the posterior, the winds of single logs in it, with the variance of the residual for the coefficients that the
    windows determine; infinite where they determine as many as there are windows.
    """
    windows = _windows(data)
    information, sigma = data.information, data.whitening.sigma
    out = np.full(3, np.nan)
    for axis, own in enumerate(data.functions.mask.T):
        if not own.any():
            continue
        covariance = np.linalg.pinv(information[axis][np.ix_(own, own)], hermitian=True)
        spread = data.prior_factor * data.prior_spread[own, axis]
        determined = float(own.sum()) - float(np.diag(covariance) @ np.where(np.isfinite(spread), spread**-2.0, 0.0))
        covariance = covariance + data.condition_covariance[axis][:-1, :-1][np.ix_(own, own)]
        variance = float(np.mean(np.einsum("nk,kl,nl->n", at[:, own], covariance, at[:, own])))
        free = windows - determined
        out[axis] = np.sqrt(variance * windows / free) if free >= 1.0 and sigma[axis] > 0.0 else np.inf
    return np.asarray(np.maximum(out, np.finfo(np.float64).tiny))


def _windows(data: WeakData) -> int:
    return sum(len(one) for one in data.windows.training)


def _of_length(data: WeakData, length_s: float) -> WeakData:
    return data if length_s == data.windows.length_s else replace(data, training_s=length_s)
