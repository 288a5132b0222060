"""Structures compared: every basis, decoupled and coupled, cross-validated on the same folds and the same test rows.

The number of components is chosen anew within the training rows of every fold, so that no structure gains by having more to
choose from; it is the one of least error there, as a simpler one near it would cost one structure more than another. Errors
are kept block by block; from blocks drawn again come the intervals, and the structures that cannot be told from the best.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.identify.bases import forms
from ferryid.identify.basis import STRUCTURES, Basis, sized
from ferryid.identify.bootstrap import FEW_BLOCKS, block_seconds, percentiles, times_drawn
from ferryid.identify.cautions import of_logs
from ferryid.identify.choose import Studied, choose, force_free, pieces_of
from ferryid.identify.compared import LEVEL, Compared, Ratios, Structure, StructureSweep, over_base
from ferryid.identify.confidence_set import confidence_set
from ferryid.identify.cross_products import CrossProducts
from ferryid.identify.crossed import FOLDS, MOST_GROUPS, TEST_WINDOW_S, Curves, Folds, FoldSums
from ferryid.identify.inertia import without_inertia
from ferryid.identify.pieces import together
from ferryid.identify.residual import residual
from ferryid.identify.rows import basis_of, known_rows, rows_of
from ferryid.identify.settings import FitSettings
from ferryid.identify.simpls import simpls, total
from ferryid.identify.split import correlation_time
from ferryid.identify.sweep import BY, check_folds, log_json, read_logs
from ferryid.signals.smooth import Measured, smooth_measured
from ferryid.signals.track import Motion
from ferryid.vessel.profile import Profile

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Ints = NDArray[np.int64]

DRAWS = 2000


@dataclass(frozen=True, eq=False)
class _Log:
    """One log smoothed for testing and for training, with what each leaves to explain, and the rows that test."""

    test: tuple[Motion, Floats]
    training: tuple[Motion, Floats]
    used: Flags


@dataclass(frozen=True, eq=False)
class _Tried:
    """A structure's choices, and its errors in blocks, shape (B, 3)."""

    basis: str
    functions: Basis
    allowed: Flags
    components: int
    within: tuple[int, ...]
    errors: Floats


def sweep_structures(
    logs: Sequence[str],
    profile: Profile,
    settings: FitSettings,
    out: Path,
    *,
    folds: int = FOLDS,
    progress: Callable[[str], None],
) -> StructureSweep:
    """Cross-validate every basis, decoupled and coupled.

    Parameters
    ----------
    logs, profile, out, folds, progress
        As in `ferryid.identify.sweep.sweep`.
    settings
        How to fit. Of its basis only what stands behind ``+``, and a hull's length, count; of its structure nothing.

    Raises
    ------
    FerryIdError
        For input that cannot be used, with file, cause and remedy.
    """
    check_folds(folds)
    usable, unusable = named(settings, profile)
    opened = read_logs(logs, profile, settings, out, progress)
    motions = [smooth_measured(one.measured, TEST_WINDOW_S) for one in opened]
    bases = {
        name: {
            structure: basis_of(replace(settings, basis=full, structure=structure), motions) for structure in STRUCTURES
        }
        for name, full in usable.items()
    }
    progress("smoothing")
    made = [_log(profile, settings, one.measured, bases["modulus"]["coupled"]) for one in opened]
    progress("finding how long residuals remember")
    block_s = block_length(made, [one["decoupled"] for one in bases.values()])
    reach_s = max(TEST_WINDOW_S, settings.window_s)
    pieces: dict[str, list[Studied]] = {}
    for name, one in bases.items():
        progress(f"cutting {name} into pieces")
        pieces[name] = [
            pieces_of(
                one["coupled"], log.test, [log.training], reach_s, blocks=_blocks(log, block_s, folds), wanted=log.used
            )
            for log in made
        ]
    by = {}
    for key in ("blocks", "logs") if len(opened) > 1 else ("blocks",):
        progress(f"cross-validating by {key}")
        by[key] = compared(
            profile, settings, bases, pieces, min(MOST_GROUPS, len(opened)) if key == "logs" else folds, key == "logs"
        )
    told = tuple(log_json(one, log) for one, log in zip(opened, pieces["modulus"], strict=True))
    return StructureSweep(
        profile.name,
        told,
        settings,
        block_s,
        by,
        unusable,
        (*_notes(by, settings), *of_logs([(log["name"], log["warnings"]) for log in told])),
    )


def named(settings: FitSettings, profile: Profile) -> tuple[dict[str, str], dict[str, str]]:
    """Return the bases that can be used on a vessel, by the name that `basis` takes, and why the others cannot."""
    own, plus, extensions = settings.basis.partition("+")
    usable, unusable = {}, {}
    for name in forms():
        # The hull's length may stand in the settings: cross-flow-5m.
        given = own if own.rpartition("-")[0] == name else name
        try:
            usable[name] = sized(given + plus + extensions, profile.hull.length_m, profile.path or profile.name)
        except FerryIdError as error:
            unusable[name] = str(error)
    return usable, unusable


def block_length(logs: Sequence[_Log], bases: Sequence[Basis]) -> float:
    """Return the least length of a block [s]: what residuals need to be independent, or as much of it as leaves `FEW_BLOCKS`.

    It is the longest over the bases, each fitted to all rows, and no less than the residual's correlation time.
    """
    seconds = sum(np.count_nonzero(log.used) / log.test[0].rate_hz for log in logs)
    rates = [log.test[0].rate_hz for log in logs]
    longest, memory = 0.0, 0.0
    for functions in bases:
        rows = rows_of(
            functions, [log.test[0] for log in logs], [log.test[1] for log in logs], [log.used for log in logs]
        )
        fit = simpls(CrossProducts.of(*rows), len(functions.terms), allowed=functions.mask)
        theta, constant = fit.coefficients[-1], fit.intercepts[-1]
        longest = max(longest, block_seconds(rows, rates, theta, constant)[0])
        for log, rate in zip(logs, rates, strict=True):
            motion, error = log.test
            left = np.full_like(error, np.nan)
            left[log.used] = error[log.used] - functions.of(motion, log.used) @ theta - constant
            memory = max(memory, correlation_time(left, log.used, rate))
    return max(min(longest, seconds / FEW_BLOCKS), memory)


def compared(
    profile: Profile,
    settings: FitSettings,
    bases: Mapping[str, Mapping[str, Basis]],
    pieces: Mapping[str, Sequence[Studied]],
    k: int,
    whole: bool,
) -> Compared:
    """Cross-validate bases whose pieces are known, all cut alike.

    Parameters
    ----------
    profile, settings
        Vessel, and how to fit.
    bases
        By name, decoupled and coupled.
    pieces
        Those of every log, by the basis's name.
    k, whole
        As in `ferryid.identify.crossed.FoldSums`.
    """
    tried: list[_Tried] = []
    base, rows = np.zeros((0, 3)), np.zeros(0)
    for name, logs in pieces.items():
        sums = FoldSums(1, k, whole=whole)
        labels = [sums.add(log.training, log.test) for log in logs]
        folds = sums.folds()
        blocks = [
            (fold, cross)
            for log, label in zip(logs, labels, strict=True)
            for fold, cross in _cut(log, label)
            if cross.n
        ]
        free = force_free(logs)
        nothing = np.zeros((1, len(bases[name]["coupled"].terms), 3)), np.zeros((1, 3))
        base = np.array([cross.sse(*nothing)[0] for _, cross in blocks])
        rows = np.array([cross.n for _, cross in blocks], dtype=np.float64)
        for structure in STRUCTURES:
            functions = bases[name][structure]
            tried.append(_tried(profile, settings, name, functions, folds, blocks, free, logs[0].log))
    return _ordered(tried, base, rows, len(folds.test))


def _tried(
    profile: Profile,
    settings: FitSettings,
    name: str,
    functions: Basis,
    folds: Folds,
    blocks: Sequence[tuple[int, CrossProducts]],
    free: Flags,
    where: str,
) -> _Tried:
    """Fit one structure without each fold in turn, as the other folds choose, and test it on the fold's blocks."""
    window = (settings.window_s,)
    whole = choose(profile, settings, functions, window, folds, free, rule=Curves.best, where=where)
    fits, within = [], []
    for fold in range(len(folds.test)):
        rest = Folds((_without(folds.training[0], fold),), _without(folds.test, fold))
        # Two folds leave one, which cannot choose: both then take what they choose together.
        choice = (
            whole
            if len(rest.test) < 2
            else choose(profile, settings, functions, window, rest, free, rule=Curves.best, where=where)
        )
        allowed = without_inertia(functions.mask, functions.terms, choice.held)
        fits.append(simpls(total(rest.training[0]), choice.components, allowed=allowed, where=where))
        within.append(choice.components)
    errors = [cross.sse(fits[fold].coefficients[-1:], fits[fold].intercepts[-1:])[0] for fold, cross in blocks]
    allowed = without_inertia(functions.mask, functions.terms, whole.held)
    return _Tried(name, functions, allowed, whole.components, tuple(within), np.array(errors))


def _ordered(tried: Sequence[_Tried], base: Floats, rows: Floats, folds: int) -> Compared:
    """Draw blocks, and order the structures by their score."""
    errors = np.array([one.errors for one in tried])
    mse = errors.sum(axis=1) / rows.sum()
    least = mse.min(axis=0)
    unit = np.where(least > 0.0, least, 1.0)
    scores = (mse / unit).mean(axis=1)
    times = times_drawn(len(rows), DRAWS, 0)
    drawn = np.einsum("db,sbj->sdj", times, errors) / (times @ rows)[:, None]
    p = confidence_set(scores, (drawn / unit).mean(axis=2).T, len(rows))
    order = np.lexsort([[one.allowed.sum() for one in tried], scores.round(12)])
    simplest = min(order, key=lambda number: tried[number].allowed.sum())

    def against(number: int, other: int) -> Ratios:
        with np.errstate(divide="ignore", invalid="ignore"):
            value, ratios = mse[number] / mse[other], drawn[number] / drawn[other]
        low, high = percentiles(ratios.T, len(rows), LEVEL)
        return Ratios(value, low, high)

    structures = tuple(
        Structure(
            basis=tried[number].basis,
            structure=tried[number].functions.structure,
            functions=tried[number].functions,
            allowed=tried[number].allowed,
            components=tried[number].components,
            within=tried[number].within,
            mse=mse[number],
            score=float(scores[number]),
            p=float(p[number]),
            against_best=against(number, order[0]),
            against_simplest=against(number, simplest),
        )
        for number in order
    )
    return Compared(structures, base.sum(axis=0) / rows.sum(), folds, int(rows.sum()), len(rows))


def _log(profile: Profile, settings: FitSettings, measured: Measured, functions: Basis) -> _Log:
    """Smooth a log; of all bases only wind and current, which they share, say which rows are known."""
    test = smooth_measured(measured, TEST_WINDOW_S)
    training = smooth_measured(measured, settings.window_s, settings.smoother)
    error = residual(profile, test, settings.scale)
    target = residual(profile, training, settings.scale, settings.residual)
    return _Log((test, error), (training, target), known_rows(test, functions, error, error))


def _blocks(log: _Log, block_s: float, folds: int) -> int:
    """Return the number of blocks of a log, as many in every fold: so folds are alike, and those of other sweeps."""
    seconds = np.count_nonzero(log.used) / log.test[0].rate_hz
    # Where the log's length is a whole number of blocks, rounding must not cost one.
    return folds * max(1, int(seconds / block_s / folds + 1e-9))


def _cut(log: Studied, labels: Ints) -> list[tuple[int, CrossProducts]]:
    """Return fold and cross-products of the test rows of every block."""
    kept = together(labels)
    cut = []
    for block, fold in enumerate(labels.tolist()):
        one = np.zeros_like(kept)
        one[block] = kept[block]
        cut.append((fold, log.test.summed(one)))
    return cut


def _without(parts: Sequence[CrossProducts], number: int) -> tuple[CrossProducts, ...]:
    return (*parts[:number], *parts[number + 1 :])


def _notes(by: Mapping[str, Compared], settings: FitSettings) -> list[str]:
    notes = []
    blocks, logs = by["blocks"], by.get("logs")
    if logs is not None:
        theirs = logs.supported
        if theirs.title != blocks.supported.title:
            notes.append(
                f"By whole logs the data support {theirs.title}. Take it where the model is for other days than those of "
                "these logs."
            )
        notes.append(
            "Intervals and p by whole logs hold the scatter within these logs, not that between one day and the next: what is "
            "told apart there may be these days' own."
        )
    for key, one in by.items():
        least = min(float(np.nanmean(over_base(structure, one))) for structure in one.structures)
        if least >= 1.0:
            notes.append(f"By {BY[key]} none predicts force better than the base model does without any.")
    if blocks.blocks < FEW_BLOCKS:
        notes.append(
            f"Only {counted(blocks.blocks, 'independent stretch')} to draw from: the intervals are probably too narrow."
        )
    if settings.components == "auto" and any(one.folds < 3 for one in by.values()):
        notes.append("With two folds the number of components was chosen on both: errors are a little too small.")
    if settings.residual != "measured":
        notes.append(f"Fitted to the {settings.residual} residual, tested against measured force.")
    return notes
