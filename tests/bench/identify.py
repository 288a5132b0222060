"""Identification: fit, component sweep and bootstrap, against scikit-learn, ikpls and a bare X'X."""

from __future__ import annotations

import contextlib
import io
import statistics
import time
import tracemalloc
import warnings
from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np
from ikpls.fast_cross_validation.numpy import PLS as FastCrossValidation
from ikpls.numpy import PLS as ImprovedKernel
from numpy.typing import NDArray
from sklearn.cross_decomposition import PLSRegression
from threadpoolctl import threadpool_limits

from ferryid.regression.bases.basis import Basis, make_basis
from ferryid.regression.cross_products import CrossProducts, Rows
from ferryid.regression.cross_validation.block_sums import BlockSums, block_edges
from ferryid.regression.cross_validation.folds import Folds
from ferryid.regression.qr import QrFactor
from ferryid.regression.resampling.bootstrap import Blocks, bootstrap_coefficients
from ferryid.regression.simpls import fit_simpls
from ferryid.side_by_side import over
from ferryid.signals.smooth import central_difference, moving_mean, odd_rows
from tests.bench.page import Row, Section, duration, faster, faster_row, in_turn, within_row
from tests.regression.rows import from_rows

Floats = NDArray[np.float64]

COMPONENTS = 12
MOST = 21
FOLDS = 5
RATE_HZ = 100.0
WINDOWS_S = (0.05, 0.25, 0.5, 1.0, 1.5)
DRAWS = 1000
BLOCK_ROWS = 1000
SHARE = 10
"""The part of the rows that a rival gets which takes a minute or two for all of them: its time grows in proportion."""
MASS = np.diag([2390.0, 2448.0, 4862.0])


def run(quick: bool) -> Section:
    """Measure everything; `quick` with a hundredth of the rows."""
    small = 7_200 if quick else 72_000
    large = 72_000 if quick else 7_200_000
    many = 1_000_000 if quick else 100_000_000
    repeats = 3 if quick else 5
    same: dict[str, float] = {}
    arrays = regression(large)
    rows = list(fits(arrays, repeats, same))
    extra = extra_memory(arrays)
    del arrays
    rows += [*sweeps(small, repeats), *bootstraps(small, repeats)]
    row, floor = fused(many, 3)
    rows.append(row)
    notes = [
        f"{MOST} regressors, 3 outputs; fits and draws with {COMPONENTS} components. Rivals get the same arrays, of which "
        "one row is one sample; ferryid's own fits never hold such an array.",
        f"scikit-learn fits one {SHARE}th of the rows, and its time is multiplied.",
        "“One by one” draws rows, forms their cross-products and refits, in Python; 20 draws are timed and the time is "
        f"multiplied by {DRAWS // 20}. scikit-learn's draws: 2, multiplied likewise.",
        "The sweep is 5 windows × 5 folds × 21 components with smoothing and basis; rivals share ours of those two and "
        "differ in cross-validation alone. scikit-learn's grid search refits for every number of components; one fold of "
        f"one window of it is timed and counted {len(WINDOWS_S) * FOLDS} times.",
        floor,
        draws_floor(small),
        f"Fit of {large:,} rows: {extra / 1e6:.1f} MB beside the data.",
        *digits(),
    ]
    return Section("Fit, sweep, bootstrap", rows, notes, ("numpy", "scikit-learn", "ikpls"), same={} if quick else same)


def fits(arrays: tuple[Floats, Floats], repeats: int, same: dict[str, float]) -> Iterator[Row]:
    """Yield the rows of fits, and add what the rivals took to `same` [s]."""
    X, Y = arrays
    n = len(X)
    part = n // SHARE

    def ours() -> None:
        fit_simpls(from_rows(CrossProducts, X, Y), COMPONENTS)

    def rival(name: str, goal: float | None, work: Callable[[], object], repeats: int = 1, share: int = 1) -> Row:
        mine, theirs = in_turn((ours, work), repeats)
        theirs = [took * share for took in theirs]
        same[f"{name}, 7.2 million rows"] = statistics.median(theirs)
        return faster_row(f"fit, {n:,} rows", mine, name, theirs, goal)

    ours()
    yield rival("scikit-learn PLS", 80, lambda: PLSRegression(COMPONENTS).fit(X[:part], Y[:part]), share=SHARE)
    yield rival("ikpls", 4, lambda: ImprovedKernel().fit(X, Y, COMPONENTS), 3)
    yield rival("bare X'X", None, lambda: X.T @ X, repeats)
    yield faster(
        f"the same by chunk-wise QR, {n // 10:,} rows",
        lambda: fit_simpls(from_rows(QrFactor, X[: n // 10], Y[: n // 10]), COMPONENTS),
        "numpy QR of all rows",
        lambda: np.linalg.qr(np.hstack([X[: n // 10], Y[: n // 10]]), mode="r"),
        None,
        3,
    )


def cross_validate(folds: list[CrossProducts]) -> None:
    """Cross-validate every number of components."""
    Folds((tuple(folds),), tuple(folds)).curves(np.ones((folds[0].K, folds[0].m), dtype=bool), MOST, "benchmark")


def sweeps(n: int, repeats: int) -> Iterator[Row]:
    nu, tau = problem(n)
    function = make_basis("thesis")
    X, Y = regression(n)

    def ours() -> None:
        for window_s in WINDOWS_S:
            inputs, residual = prepared(nu, tau, window_s)
            pieces = BlockSums.of(
                of_motion(inputs, residual, function), block_edges(np.ones(len(residual), dtype=bool), FOLDS, purge=0)
            )
            cross_validate([pieces.labelled(np.arange(FOLDS), fold) for fold in range(FOLDS)])

    def by_ikpls() -> None:
        for window_s in WINDOWS_S:
            fast_cross_validation(*matrices(nu, tau, window_s, function))

    def grid() -> None:
        one_fold_refitted(*matrices(nu, tau, WINDOWS_S[3], function))

    what = f"sweep, {len(WINDOWS_S)} windows × {FOLDS} folds × {MOST}, {n:,} rows"
    yield once(what, ours, "scikit-learn grid search", grid, 1000, times=len(WINDOWS_S) * FOLDS)
    yield faster(what, ours, "ikpls fast cross-validation", by_ikpls, 12, repeats)

    def folds_of_matrix() -> None:
        parts = np.linspace(0, n, FOLDS + 1).astype(int)
        cross_validate([from_rows(CrossProducts, X[low:high], Y[low:high]) for low, high in pairwise(parts)])

    yield faster(
        f"cross-validation, {FOLDS} folds × {MOST}, {n:,} rows",
        folds_of_matrix,
        "ikpls fast cross-validation",
        lambda: fast_cross_validation(X, Y),
        None,
        repeats,
    )


def bootstraps(n: int, repeats: int) -> Iterator[Row]:
    X, Y = regression(n)
    rows = Rows.of(X, Y)
    count = n // BLOCK_ROWS

    def ours() -> None:
        bootstrap_coefficients(Blocks.of([rows], [RATE_HZ], BLOCK_ROWS / RATE_HZ), COMPONENTS, draws=DRAWS)

    def drawn(number: int, refit: Callable[[Floats, Floats], object]) -> None:
        random = np.random.default_rng(0)
        for _ in range(number):
            chosen = random.integers(0, count, count)
            picked = (chosen[:, None] * BLOCK_ROWS + np.arange(BLOCK_ROWS)).ravel()
            refit(X[picked], Y[picked])

    what = f"{DRAWS} block bootstraps, {n:,} rows"
    yield once(
        what,
        ours,
        "one by one",
        lambda: drawn(20, lambda x, y: fit_simpls(from_rows(CrossProducts, x, y), COMPONENTS)),
        300,
        times=DRAWS // 20,
        repeats=repeats,
    )
    yield once(
        what,
        ours,
        "scikit-learn",
        lambda: drawn(2, lambda x, y: PLSRegression(COMPONENTS).fit(x, y)),
        None,
        DRAWS // 2,
    )
    blocks = [
        from_rows(CrossProducts, X[i : i + BLOCK_ROWS], Y[i : i + BLOCK_ROWS])
        for i in range(0, count * BLOCK_ROWS, BLOCK_ROWS)
    ]

    def summed() -> None:
        random = np.random.default_rng(0)
        products = np.array([block.shifted(blocks[0].shift).products for block in blocks])
        for _ in range(20):
            times = random.multinomial(count, np.full(count, 1.0 / count))
            whole = np.tensordot(times.astype(float), products, axes=1)
            fit_simpls(CrossProducts(n, MOST, 3, blocks[0].shift, whole), COMPONENTS)

    yield once(what, ours, "one by one from the blocks' cross-products", summed, None, DRAWS // 20, repeats)


def draws_floor(n: int) -> str:
    """Return, as a sentence, what the steps of the bootstraps take: cross-products of the blocks, and the draws."""
    X, Y = regression(n)
    rows = Rows.of(X, Y)
    start = time.perf_counter()
    blocks = Blocks.of([rows], [RATE_HZ], BLOCK_ROWS / RATE_HZ)
    blocks_s = time.perf_counter() - start
    times = np.random.default_rng(0).random((DRAWS, len(blocks.n)))
    products = blocks.products.reshape(len(blocks.n), -1)
    start = time.perf_counter()
    np.matmul(times, products)
    sums_s = time.perf_counter() - start
    start = time.perf_counter()
    bootstrap_coefficients(blocks, COMPONENTS, draws=DRAWS)
    draws_s = time.perf_counter() - start
    return (
        f"Of the {DRAWS} bootstraps, the cross-products of the blocks take {duration(blocks_s)} and the draws "
        f"{duration(draws_s)}, of which the bare sums of blocks, one product of matrices, take {duration(sums_s)}; "
        "the rest of the draws is taking out components and percentiles."
    )


def fused(n: int, repeats: int) -> tuple[Row, str]:
    """Basis and cross-products of `n` rows, ten times over a tenth of them, and what is the least that they can take."""
    part = n // 10
    random = np.random.default_rng(0)
    nu, nu_dot, residual = (random.standard_normal((part, 3)) for _ in range(3))
    function = make_basis("thesis")
    rows = of_motion((nu, nu_dot), residual, function)

    def ours() -> None:
        CrossProducts.of(*[rows] * 10)

    def read() -> None:
        for _ in range(10):
            for values in (nu, nu_dot, residual):
                values.sum()

    works = (ours, read, lambda: products_alone(part, 1), lambda: products_alone(part), lambda: basis_alone(part))
    mine, one_read, *floors = in_turn(works, repeats)
    row = within_row(f"{n:,} rows, basis and cross-products", mine, "one read of the inputs (sum)", one_read, 6)
    in_reads = [
        statistics.median(10 * took / read_s for took, read_s in zip(times, one_read, strict=True)) for times in floors
    ]
    note = (
        f"Of the {n:,} rows, the bare products of the {len(function.terms)} terms, outputs and one with one another, in chunks "
        f"that stay in the cache, take {in_reads[0]:.3g} reads on one core, and {in_reads[1]:.3g} on all of them together; "
        f"evaluating the basis alone on all of them {in_reads[2]:.3g}. Less than the sum of the last two, "
        f"{sum(in_reads[1:]):.3g} reads, it cannot be with these products; the rest of the {row.ratio:.3g} is centring, the "
        "check for values that are not finite, and reading the inputs."
    )
    return row, note


CHUNK = 8192


def basis_alone(n: int) -> None:
    """Evaluate the basis of `n` rows on all cores, chunk by chunk into the same memory."""
    function = make_basis("thesis")
    nu, nu_dot = np.random.default_rng(0).standard_normal((2, CHUNK, 3))

    def some(count: int) -> None:
        into = np.empty((len(function.terms), CHUNK))
        for _ in range(count):
            function.fill(into, nu, nu_dot)

    over(some, shares(n // CHUNK))


def products_alone(n: int, threads: int | None = None) -> None:
    """Form Z Z' of `n` columns of terms, outputs and one, chunk by chunk, each on one thread of BLAS."""
    Z = np.random.default_rng(0).standard_normal((len(make_basis("thesis").terms) + 4, CHUNK))

    def some(count: int) -> None:
        for _ in range(count):
            Z @ Z.T

    with threadpool_limits(1, user_api="blas"):
        over(some, shares(n // CHUNK), most=threads)


def shares(count: int) -> list[int]:
    """Return a number of chunks in parts for threads."""
    parts = 16
    return [count // parts + (k < count % parts) for k in range(parts)]


def once(
    what: str,
    ours: Callable[[], object],
    name: str,
    rival: Callable[[], object],
    goal: float | None,
    times: int = 1,
    repeats: int = 1,
) -> Row:
    """Row for a rival so slow that a part of it is timed and multiplied; ours runs before and after it."""
    mine, theirs, ratios = [], [], []
    for _ in range(repeats):
        before = statistics.median(refit_spans(ours) for _ in range(3))
        slow = refit_spans(rival) * times
        after = statistics.median(refit_spans(ours) for _ in range(3))
        mine += [before, after]
        theirs.append(slow)
        ratios.append(slow / ((before + after) / 2.0))
    ratio = statistics.median(ratios)
    took, rival_took = duration(statistics.median(mine)), duration(statistics.median(theirs))
    if goal is None:
        return Row(what, took, name, rival_took, ratio)
    return Row(what, took, name, rival_took, ratio, f"≥ {goal:g}", ratio >= goal)


def refit_spans(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def regression(n: int) -> tuple[Floats, Floats]:
    random = np.random.default_rng(0)
    X = random.standard_normal((n, MOST))
    return X, X @ random.standard_normal((MOST, 3)) + random.standard_normal((n, 3))


def problem(n: int) -> tuple[Floats, Floats]:
    """Velocities and forces of a boat that wanders, shape (n, 3) each."""
    random = np.random.default_rng(0)
    t = np.arange(n) / RATE_HZ
    nu = np.column_stack([np.sin(t / 7.0), 0.5 * np.sin(t / 5.0 + 1.0), 0.2 * np.sin(t / 3.0 + 2.0)])
    return nu + 0.02 * random.standard_normal((n, 3)), 100.0 * random.standard_normal((n, 3))


def prepared(nu: Floats, tau: Floats, window_s: float) -> tuple[tuple[Floats, Floats], Floats]:
    rows = odd_rows(window_s, RATE_HZ)
    smooth = moving_mean(np.hstack([nu, tau]), rows)
    slope = central_difference(smooth[:, :3], RATE_HZ)
    keep = slice(rows // 2 + 1, len(nu) - rows // 2 - 1)
    return (smooth[keep, :3], slope[keep]), smooth[keep, 3:] - slope[keep] @ MASS


def of_motion(inputs: tuple[Floats, ...], residual: Floats, function: Basis) -> Rows:
    return Rows(inputs, residual, fill=function.fill, terms=len(function.terms))


def matrices(nu: Floats, tau: Floats, window_s: float, function: Basis) -> tuple[Floats, Floats]:
    inputs, residual = prepared(nu, tau, window_s)
    return np.ascontiguousarray(function.evaluate(*inputs)), residual


def fast_cross_validation(X: Floats, Y: Floats) -> None:
    fold = np.minimum(np.arange(len(X)) * FOLDS // len(X), FOLDS - 1)
    with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        FastCrossValidation().cross_validate(
            X,
            Y,
            MOST,
            fold,
            lambda true, predicted: np.mean((true - predicted) ** 2, axis=1),
            n_jobs=1,
            verbose=0,
        )


def one_fold_refitted(X: Floats, Y: Floats) -> None:
    """Refit for every number of components without one fold, and predict it."""
    train = np.minimum(np.arange(len(X)) * FOLDS // len(X), FOLDS - 1) != FOLDS // 2
    for components in range(1, MOST + 1):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            fit = PLSRegression(components).fit(X[train], Y[train])
        np.mean((Y[~train] - fit.predict(X[~train])) ** 2, axis=0)


def extra_memory(arrays: tuple[Floats, Floats]) -> int:
    X, Y = arrays
    tracemalloc.start()
    fit_simpls(from_rows(CrossProducts, X, Y), COMPONENTS)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak


def digits() -> Iterator[str]:
    """Largest error of the coefficients over all numbers of components against 60 digits, per way and condition."""
    from tests.regression.test_simpls import conditioned, error, reference

    for condition in (40.0, 1.8e6):
        X, Y = conditioned(200, MOST, 3, condition)
        want = reference(X, Y, MOST, True)
        by_products, by_qr = (
            error(fit_simpls(from_rows(kind, X, Y), MOST), want).max() for kind in (CrossProducts, QrFactor)
        )
        yield (
            f"Largest error of a coefficient at any of {MOST} components, condition {condition:g}, against 60 digits: "
            f"{by_qr:.0e} by QR, {by_products:.0e} by cross-products."
        )
