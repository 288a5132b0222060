"""Sparse identification as in SINDy: sequentially thresholded least squares, threshold and ridge chosen by cross-validation."""

from __future__ import annotations

import warnings
from itertools import product
from pathlib import Path

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.types import Floats, Ints
from ferryid.validation.rivals.learner import LearnedModel
from ferryid.validation.rivals.regression import learn_sparsely
from ferryid.vessel.profile import Profile

THRESHOLDS = tuple(float(one) for one in np.geomspace(0.01, 1.0, 13))
"""Shares of the residual's root mean square below which a term is left out."""
RIDGES = (1e-3, 1e-2, 1e-1)
"""Weights of the squared coefficients against the mean square of the rest: columns that trade stay finite."""


def learn(log: str, profile: Profile, out: Path) -> LearnedModel:
    """Choose terms by SINDy; see `ferryid.validation.rivals.learner.Learner`.

    Raises
    ------
    FerryIdError
        Where pysindy is not installed, and for a log that cannot be used.
    """
    need()
    return learn_sparsely("sindy", choose, log, profile, out)


def need() -> None:
    """Refuse to begin without pysindy.

    Raises
    ------
    FerryIdError
        Where it is not installed.
    """
    try:
        import pysindy  # noqa: F401
    except ImportError as error:
        raise FerryIdError(
            f"prove: the rival sindy needs the package pysindy, which cannot be imported ({error}). "
            "Fix: pip install pysindy"
        ) from error


def choose(X: Floats, y: Floats, block: Ints) -> Floats:
    """Return the coefficients of the fewest terms that cross-validation does not distinguish from the best.

    Each block is predicted from the others; of the thresholds and ridges whose mean error is within one standard error of the
    least, those with the fewest terms are taken. Brunton, Proctor & Kutz (2016), with the rule of Breiman et al. (1984).

    Parameters
    ----------
    X, y
        Columns of mean square 1, shape (m, k), and what they are to explain, shape (m,).
    block
        Which block a row lies in, shape (m,).
    """
    folds = np.unique(block)
    settings = list(product(RIDGES, THRESHOLDS))
    errors = np.empty((len(settings), len(folds)))
    for j, fold in enumerate(folds.tolist()):
        held = block == fold
        rows = _condensed(X[~held], y[~held])
        for i, (ridge, threshold) in enumerate(settings):
            found = _thresholded(*rows, threshold, ridge)
            errors[i, j] = np.mean((y[held] - X[held] @ found) ** 2)
    mean = errors.mean(axis=1)
    best = int(np.argmin(mean))
    # Blocks are alike in what the settings make of them: their difference to the best counts, not their own scatter.
    spread = (errors - errors[best]).std(axis=1, ddof=1) / np.sqrt(len(folds))
    fine = np.flatnonzero(mean <= mean[best] + spread).tolist()
    rows = _condensed(X, y)
    fits = {i: _thresholded(*rows, settings[i][1], settings[i][0]) for i in fine}
    return fits[min(fine, key=lambda i: (np.count_nonzero(fits[i]), mean[i]))]


def _condensed(X: Floats, y: Floats) -> tuple[Floats, Floats, int]:
    """Return as few rows as there are columns with the same least squares, and how many rows there were."""
    _, triangle = np.linalg.qr(np.column_stack([X, y]))
    return triangle[:, :-1], triangle[:, -1], len(y)


def _thresholded(X: Floats, y: Floats, count: int, threshold: float, ridge: float) -> Floats:
    """Return the coefficients that STLSQ finds for rows that `_condensed` made of `count`."""
    from pysindy.optimizers import STLSQ

    with warnings.catch_warnings():
        # That a large threshold leaves no term at all is a result, and what cross-validation is there to decide.
        warnings.filterwarnings("ignore", message="Sparsity parameter is too big")
        warnings.filterwarnings("ignore", message="STLSQ did not converge")
        found = STLSQ(threshold=threshold, alpha=ridge * count).fit(X, y)
    return np.asarray(found.coef_, dtype=np.float64).reshape(-1)
