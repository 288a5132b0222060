"""Cross-validation from cross-products: the choice by hand, and every score against refitting from the rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from sklearn.cross_decomposition import PLSRegression

from ferryid.errors import FerryIdError
from ferryid.identify.log_sums import folds_by_blocks, folds_by_logs, sum_log
from ferryid.identify.settings import TEST_WINDOW_S, FitSettings
from ferryid.models.forces.residual import compute_residual
from ferryid.regression.bases.basis import make_basis
from ferryid.regression.cross_validation.folds import Curves, Folds, FoldSums
from ferryid.signals.smooth import Measured, smooth_measured
from tests.identify.rounds import PROFILE, RATE_HZ
from tests.identify.trials import measured

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Part = tuple[Floats, Floats, Flags]

SETTINGS = FitSettings(delta=0.4, sigma=0.4, inertia="fitted")
FUNCTIONS = make_basis("modulus", structure="decoupled")
K = len(FUNCTIONS.terms)


def curves_of(score: Sequence[Sequence[float]], band: Sequence[Sequence[float]]) -> Curves:
    """Curves that are alike on every axis."""
    mse, error = (np.repeat(np.array(values)[:, :, None], 3, axis=2) for values in (score, band))
    return Curves(mse, error, np.ones(3), 5, 100, np.repeat(mse[:, None], 5, axis=1))


def test_the_choice_by_hand() -> None:
    # The best, 1.0 with four components. Two folds that differ by 2 d in their difference give a standard error of d.
    few, more = [1.9, 1.31, 1.3, 1.0], [1.5, 1.4, 1.25, 1.2]
    apart = np.array([[0.2, 0.2, 0.31, 0.0], [0.2, 0.2, 0.26, 0.5]])

    def curves(differences: NDArray[np.float64], common: float = 0.0, own: float = 9.0) -> Curves:
        mse = np.array([few, more])[:, :, None]
        harder = np.array([common, -common])[:, None, None, None]
        folds = mse + np.stack([differences, -differences])[:, :, :, None] + harder
        return Curves(mse, np.full_like(mse, own), np.ones(3), 2, 100, folds.transpose(1, 0, 2, 3))

    assert curves(apart).choice() == (1, 3)
    # A fold that is harder for all combinations alike changes nothing.
    assert curves(apart, common=0.9).choice() == (1, 3)
    assert curves(np.where(apart == 0.2, 0.315, apart)).choice() == (0, 2)
    assert curves(0.0 * apart).choice() == (0, 4)
    # Few components that fail in one fold differ by much, and are worse all the same.
    assert curves(9.0 + apart, own=0.26).choice() == (1, 3)
    assert curves(9.0 + apart, own=0.1).choice() == (0, 4)
    assert curves_of([[2.0, 2.0]], [[0.1, 0.1]]).choice() == (0, 1)


def test_every_axis_counts_alike_by_hand() -> None:
    mse = np.array([[[4.0, 100.0, 0.0], [2.0, 300.0, 0.0]]])
    curves = Curves(mse, 0.1 * mse, np.ones(3), 5, 100, mse[:, None])
    score, band = curves.normalised()
    # Surge over 2, sway over 100, and yaw, without error, as it is.
    np.testing.assert_allclose(score, [[(2.0 + 1.0 + 0.0) / 3.0, (1.0 + 3.0 + 0.0) / 3.0]])
    np.testing.assert_allclose(band, 0.1 * score)
    assert curves.choice() == (0, 1)
    np.testing.assert_array_equal(curves.near(), [[True, False]])


def parts(log: Measured, window_s: float) -> Part:
    """Basis, residual and known rows of a log, smoothed over a window."""
    motion = smooth_measured(log, window_s)
    error = compute_residual(PROFILE, motion, SETTINGS.scale)
    return FUNCTIONS.of(motion), error, motion.valid & np.isfinite(error).all(axis=1)


def stretches(known: Flags, blocks: int, first: int) -> NDArray[np.int64]:
    """Fold of every known row, -1 elsewhere: each block has as many rows."""
    fold = np.full(len(known), -1)
    rows = np.flatnonzero(known)
    for place, row in enumerate(rows):
        fold[row] = first + place * blocks // len(rows)
    return fold


def away(known: Flags, fold: NDArray[np.int64], number: int, purge: int) -> Flags:
    """Rows between the first and last row of a fold that are further than `purge` rows from those of another."""
    inside = np.flatnonzero(fold == number)
    keep = np.zeros(len(known), dtype=bool)
    others = np.flatnonzero((fold >= 0) & (fold != number))
    before, after = others[others < inside[0]], others[others > inside[-1]]
    low = before[-1] + purge + 1 if before.size else 0
    high = after[0] - purge if after.size else len(known)
    keep[low:high] = True
    return keep & known


def refitted(folds: Sequence[tuple[Sequence[Part], Part]], components: int) -> tuple[Floats, Floats, Floats]:
    """Error, its standard error, and that of the base model, from fits to the rows of one output each by scikit-learn."""
    windows = len(folds[0][0])
    squares = np.zeros((windows, len(folds), 3))
    rows = np.array([np.count_nonzero(test[2]) for _, test in folds])
    base = sum((test[1][test[2]] ** 2).sum(axis=0) for _, test in folds) / rows.sum()
    for window in range(windows):
        for number, (_, (X_test, Y_test, used)) in enumerate(folds):
            rest = [training[window] for other, (training, _) in enumerate(folds) if other != number]
            X = np.concatenate([X[rows] for X, _, rows in rest])
            Y = np.concatenate([Y[rows] for _, Y, rows in rest])
            for axis in range(3):
                columns = FUNCTIONS.mask[:, axis]
                A, B = X[:, columns], X_test[used][:, columns]
                if components >= np.count_nonzero(columns):
                    ones, tests = np.ones((len(A), 1)), np.ones((len(B), 1))
                    fit = np.linalg.lstsq(np.hstack([A, ones]), Y[:, axis], rcond=None)[0]
                    estimate = np.hstack([B, tests]) @ fit
                else:
                    fit = PLSRegression(components, scale=True).fit(A, Y[:, axis])
                    estimate = fit.predict(B).ravel()
                squares[window, number, axis] = ((Y_test[used, axis] - estimate) ** 2).sum()
    spread = (squares / rows[:, None]).std(axis=1, ddof=1) / np.sqrt(len(folds))
    return squares.sum(axis=1) / rows.sum(), spread, base


LOGS = (measured(1, jitter=0.01, noise=20.0), measured(2, seconds=170.0, jitter=0.01, noise=20.0, gaps=4))
WINDOWS_S = (0.5, 1.0, 2.5)
PURGE = round((2.5 + 2.0 / RATE_HZ + 2.0) * RATE_HZ)


def by_stretches() -> list[tuple[list[Part], Part]]:
    folds: list[tuple[list[list[Part]], list[Part]]] = [([[] for _ in WINDOWS_S], []) for _ in range(5)]
    for log in LOGS:
        test = parts(log, TEST_WINDOW_S)
        fold = stretches(test[2], 5, 0)
        for number, (training, tests) in enumerate(folds):
            keep = away(test[2], fold, number, PURGE)
            span = away(np.ones_like(keep), fold, number, PURGE)
            tests.append((*test[:2], keep))
            for rows, window_s in zip(training, WINDOWS_S, strict=True):
                X, Y, known = parts(log, window_s)
                rows.append((X, Y, known & span))
    return [([joined(rows) for rows in training], joined(tests)) for training, tests in folds]


def by_logs() -> list[tuple[list[Part], Part]]:
    return [([parts(log, window_s) for window_s in WINDOWS_S], parts(log, TEST_WINDOW_S)) for log in LOGS]


def joined(several: Sequence[Part]) -> Part:
    X, Y, used = zip(*several, strict=True)
    return np.concatenate(X), np.concatenate(Y), np.concatenate(used)


@pytest.fixture(scope="module")
def cut() -> dict[str, Folds]:
    pieces = [sum_log(PROFILE, SETTINGS, FUNCTIONS, log, WINDOWS_S) for log in LOGS]
    return {"stretches": folds_by_blocks(pieces), "logs": folds_by_logs(pieces)}


@pytest.mark.slow
@pytest.mark.parametrize("components", [1, 2, 4, 7, K])
@pytest.mark.parametrize("by", ["stretches", "logs"])
def test_scores_are_those_of_fits_from_scratch(cut: dict[str, Folds], by: str, components: int) -> None:
    curves = cut[by].curves(FUNCTIONS.mask, K)
    folds = by_stretches() if by == "stretches" else by_logs()
    mse, spread, base = refitted(folds, components)
    assert (curves.folds, curves.rows) == (len(folds), sum(np.count_nonzero(test[2]) for _, test in folds))
    np.testing.assert_allclose(curves.mse[:, components - 1], mse, rtol=1e-9)
    np.testing.assert_allclose(curves.standard_error[:, components - 1], spread, rtol=1e-8)
    np.testing.assert_allclose(curves.base, base, rtol=1e-12)


def test_an_error_of_one_fold_stays_in_it(cut: dict[str, Folds]) -> None:
    """What is told of a fold's test rows must not reach the fit that is tested on them."""
    folds = cut["stretches"]
    whole = folds.curves(FUNCTIONS.mask, 3)
    products = folds.test[2].products.copy()
    products[K:-1, K:-1] *= 9.0
    wrong = replace(folds, test=(*folds.test[:2], replace(folds.test[2], products=products), *folds.test[3:]))
    told = wrong.curves(FUNCTIONS.mask, 3)
    # The sum of squares of the outputs alone has grown, by as much for every fit.
    np.testing.assert_allclose((told.mse - whole.mse) / (told.base - whole.base), np.ones_like(whole.mse), rtol=1e-9)


def test_logs_are_dealt_to_folds_where_they_are_short() -> None:
    short = [sum_log(PROFILE, SETTINGS, FUNCTIONS, measured(seed, seconds=17.0), (1.0,), blocks=5) for seed in range(7)]
    assert {one.test.blocks for one in short} == {2}
    sums = FoldSums(1, 5)
    for one in short[:3]:
        sums.add(one.training, one.test)
    # Blocks go to folds 0 1, 2 3 and 4 0.
    shared = short[0].test.labelled(np.array([0, 1])).n + short[2].test.labelled(np.array([0, 1]), 1).n
    assert sums.folds().test[0].n == shared
    assert len(sums.folds().test) == 5
    assert len(folds_by_logs(short).test) == 7


def test_a_single_short_log_is_refused() -> None:
    short = sum_log(PROFILE, SETTINGS, FUNCTIONS, measured(1, seconds=9.0), (1.0,))
    for folds in (folds_by_blocks([short]), folds_by_logs([short])):
        with pytest.raises(FerryIdError, match=r"^trial: cross-validation needs two folds with rows, found 1. Fix: "):
            folds.curves(FUNCTIONS.mask, 3, "trial")
