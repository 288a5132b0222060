"""The choice of smoothing window and component count: what ``fit`` does for ``auto``, and ``sweep`` shows."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ferryid.identify.basis import Basis
from ferryid.identify.crossed import FOLDS, MOST_GROUPS, TEST_WINDOW_S, Curves, Folds, FoldSums
from ferryid.identify.inertia import effective_mass, unbelievable, unforced, without_inertia
from ferryid.identify.pieces import Pieces, edges_of
from ferryid.identify.residual import residual
from ferryid.identify.rows import known_rows, rows_of
from ferryid.identify.settings import WINDOWS_S, FitSettings, check_window
from ferryid.identify.simpls import simpls, total
from ferryid.identify.split import block_number, purge_seconds
from ferryid.signals.smooth import Measured, longest_stretch_s, odd_rows, smooth_measured
from ferryid.signals.track import Motion
from ferryid.vessel.profile import Profile

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

_STRETCHES = 10.0
"""A window is tried where the longest unbroken stretch of every log is so many times as long."""


@dataclass(frozen=True, eq=False)
class Studied:
    """One log in a cross-validation.

    Attributes
    ----------
    log
        Its name.
    training
        Its pieces at each window.
    test
        The same blocks smoothed for testing; outputs are what the base model leaves of the measured force.
    force, base
        Count, mean and sum of squares about the mean, of the measured force and of the base model's on the test rows of each
        block, shape (B, 3, 3): they say on which axes no actuator acts, and what R² compares with.
    """

    log: str
    training: tuple[Pieces, ...]
    test: Pieces
    force: Floats
    base: Floats


@dataclass(frozen=True)
class Choice:
    """What cross-validation chose.

    Attributes
    ----------
    window, window_s, components
        Number of the window, its length [s], and number of components.
    held
        Axes on which the inertia is the base model's, shape (3,).
    curves
        The errors that it rests on, with the inertia of these axes held.
    """

    window: int
    window_s: float
    components: int
    held: Flags
    curves: Curves

    @property
    def over_base(self) -> Floats:
        """MSE of every combination over the base model's, shape (W, A, 3); NaN where the base model makes no error."""
        base = np.where(self.curves.base > 0.0, self.curves.base, np.nan)
        return np.asarray(self.curves.mse / base)


def distinct(windows_s: Iterable[float], rates_hz: Sequence[float]) -> tuple[float, ...]:
    """Return the windows [s] in order, without those that come to the same rows as a shorter one at every rate [Hz]."""
    kept: dict[tuple[int, ...], float] = {}
    for window_s in sorted(windows_s):
        kept.setdefault(tuple(odd_rows(window_s, rate) for rate in rates_hz), window_s)
    return tuple(kept.values())


def tried(windows_s: Sequence[float], measured: Sequence[Measured], *, in_blocks: bool = False) -> tuple[float, ...]:
    """Return the windows to try [s], as `distinct` does; of the usual ones, where none is given, those that suit the logs.

    With `in_blocks` those, too, that leave no log with blocks to train and blocks to validate on do not suit.
    """
    for window_s in windows_s:
        check_window(window_s)
    if tuple(windows_s) in ((), WINDOWS_S):
        longest_s = min(longest_stretch_s(one) for one in measured) / _STRETCHES
        windows_s = [w for w in WINDOWS_S if w <= longest_s]
        if in_blocks:
            windows_s = [w for w in windows_s if any(_divides(one, w) for one in measured)]
    return distinct(windows_s, [one.rate_hz for one in measured])


def _divides(measured: Measured, window_s: float) -> bool:
    """Return whether a log is long enough for blocks that train and blocks that validate at a window [s]."""
    seconds = np.count_nonzero(measured.usable) / measured.rate_hz - window_s
    return block_number(seconds, purge_seconds(measured.rate_hz, window_s)) >= 3


def studied(
    profile: Profile,
    settings: FitSettings,
    functions: Basis,
    measured: Measured,
    windows_s: Sequence[float],
    *,
    blocks: int = FOLDS,
    wanted: Flags | None = None,
) -> Studied:
    """Return the pieces of one log at several windows.

    Parameters
    ----------
    profile, settings, functions
        Vessel, base model and residual, and the basis.
    measured
        The log before smoothing.
    windows_s
        Windows of the training rows [s].
    blocks
        Number of blocks; fewer in a log too short for so many.
    wanted
        Rows to use, shape (n,); all where None.
    """
    test = smooth_measured(measured, TEST_WINDOW_S)
    motions = (smooth_measured(measured, window_s, settings.smoother) for window_s in windows_s)
    return pieces_of(
        functions,
        (test, residual(profile, test, settings.scale)),
        ((motion, residual(profile, motion, settings.scale, settings.residual)) for motion in motions),
        max(TEST_WINDOW_S, *windows_s),
        blocks=blocks,
        wanted=wanted,
    )


def pieces_of(
    functions: Basis,
    test: tuple[Motion, Floats],
    training: Iterable[tuple[Motion, Floats]],
    reach_s: float,
    *,
    blocks: int = FOLDS,
    wanted: Flags | None = None,
) -> Studied:
    """Return the pieces of one log from smoothed motions.

    Parameters
    ----------
    functions
        The basis.
    test, training
        Motion of the test rows, and those of the training rows, each with what is to be explained, shape (n, 3).
    reach_s
        Longest smoothing window of all [s].
    blocks, wanted
        As in `studied`.
    """
    motion, error = test
    every = np.ones(len(motion.t), dtype=bool) if wanted is None else wanted
    used = known_rows(motion, functions, error, error) & every
    purge = purge_seconds(motion.rate_hz, reach_s)
    # A block is at least two purges long, so that more of it is used than lost.
    most = max(1, int(np.count_nonzero(used) / motion.rate_hz / (2.0 * purge)))
    edges = edges_of(used, min(blocks, most), round(purge * motion.rate_hz))

    def pieces(motion: Motion, output: Floats, rows: Flags) -> Pieces:
        (one,) = rows_of(functions, [motion], [output], [rows])
        return Pieces.of(one, edges, names=functions.terms, where=motion.log)

    at_windows = [pieces(one, target, known_rows(one, functions, target, target) & every) for one, target in training]
    spans = [slice(low, high) for low, high in pairwise(edges[::3])]
    force, base = (
        np.array([_moments(values[span][used[span]]) for span in spans]) for values in (motion.tau, motion.tau - error)
    )
    return Studied(motion.log, tuple(at_windows), pieces(motion, error, used), force, base)


def choose(
    profile: Profile,
    settings: FitSettings,
    functions: Basis,
    windows_s: Sequence[float],
    folds: Folds,
    without_force: Flags,
    *,
    before: Floats | None = None,
    rule: Callable[[Curves], tuple[int, int]] = Curves.choice,
    where: str = "sweep",
) -> Choice:
    """Return the window and the component count that cross-validation cannot tell from the best and that are simplest.

    Parameters
    ----------
    profile, settings, functions, windows_s
        As in `studied`. The inertia is held where a fit would hold it.
    folds
        Of logs that were studied at these windows.
    without_force
        Axes on which no actuator acts, shape (3,); see `force_free`.
    before
        Coefficients that those fitted here come on top of, shape (K, 3).
    rule
        Takes the window and the number of components from the errors; by default the simplest near the best.
    where
        What is fitted, for messages.

    Raises
    ------
    FerryIdError
        With fewer than two folds that hold rows.
    """
    most = len(functions.terms)
    fitted = functions.mask.any(axis=0)
    held = without_force & fitted if settings.inertia == "auto" else np.zeros(3, dtype=bool)
    while True:
        allowed = without_inertia(functions.mask, functions.terms, held)
        curves = folds.curves(allowed, most, where)
        window, components = rule(curves)
        if settings.components != "auto":
            components = min(int(settings.components), most)
            window = int(np.argmin(curves.normalised()[0][:, components - 1]))
        choice = Choice(window, windows_s[window], components, held, curves)
        if settings.inertia != "auto":
            return choice
        theta = simpls(total(folds.training[window]), components, allowed=allowed).coefficients[-1]
        mass = effective_mass(profile, settings.scale, functions.terms, theta + (0.0 if before is None else before))
        more = unbelievable(profile, mass) & fitted & ~held
        if not more.any():
            return choice
        held = held | more


def folds_by_blocks(logs: Sequence[Studied], k: int = FOLDS) -> Folds:
    """Return folds of contiguous stretches of every log."""
    return _folds(logs, FoldSums(len(logs[0].training), k))


def folds_by_logs(logs: Sequence[Studied]) -> Folds:
    """Return folds of whole logs."""
    return _folds(logs, FoldSums(len(logs[0].training), min(MOST_GROUPS, len(logs)), whole=True))


def _folds(logs: Sequence[Studied], sums: FoldSums) -> Folds:
    for log in logs:
        sums.add(log.training, log.test)
    return sums.folds()


def force_free(logs: Sequence[Studied]) -> Flags:
    """Return the axes on which no actuator acts in any of the logs, shape (3,)."""
    force, base = (np.concatenate(moments) for moments in ([log.force for log in logs], [log.base for log in logs]))
    return unforced(deviation(force), deviation(base))


def _moments(values: Floats) -> Floats:
    if not len(values):
        return np.zeros((3, 3))
    mean = values.mean(axis=0)
    return np.array([np.full(3, float(len(values))), mean, ((values - mean) ** 2).sum(axis=0)])


def deviation(moments: Floats) -> Floats:
    """Return the standard deviation of all rows of several blocks, shape (3,), from the moments of each, shape (B, 3, 3)."""
    count, mean, squares = moments.transpose(1, 0, 2)
    whole = np.maximum(count.sum(axis=0), 1.0)
    between = count * (mean - (count * mean).sum(axis=0) / whole) ** 2
    return np.asarray(np.sqrt((squares + between).sum(axis=0) / whole))
