"""Structures compared: every basis, decoupled and coupled, cross-validated on the same folds and the same test rows.

By the estimator that a fit to the logs uses, or the one that is asked for; what follows is the derivative's. The number of
components is chosen anew within the training rows of every fold, so that no structure gains by having more to choose from; it
is the one of least error there, as a simpler one near it would cost one structure more than another. Errors are kept block by
block; from blocks drawn again come the intervals, and the structures that cannot be told from the best.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.identify.inertia.shares import without_inertia
from ferryid.identify.inputs import OddLogs, usable_logs
from ferryid.identify.log_sums import LogSums, force_free_axes, sum_motions
from ferryid.identify.model_selection import select_model
from ferryid.identify.rows import basis_for, known_rows, rows_of
from ferryid.identify.settings import FOLDS, TEST_WINDOW_S, FitSettings
from ferryid.identify.split import TooShort, correlation_time
from ferryid.identify.sweeps.settings_sweep import as_a_fit, check_folds, derivative_instead, log_json
from ferryid.identify.sweeps.structure_comparison import StructureComparison, StructureSweep
from ferryid.identify.sweeps.structure_ranking import StructureErrors, rank_structures
from ferryid.identify.sweeps.weak_structures import compare_weak
from ferryid.log_warnings import left_out_together, log_warnings
from ferryid.models.forces import compute_residual
from ferryid.regression import REGRESSION, CrossProducts, fit_simpls, total
from ferryid.regression.bases import STRUCTURES, Basis, basis_names, with_hull_length
from ferryid.regression.cross_validation import Curves, Folds, FoldSums, unpurged_parts
from ferryid.regression.resampling import block_seconds
from ferryid.signals.smooth import Measured, smooth_measured
from ferryid.signals.track import Motion
from ferryid.types import Flags, Floats, Ints, RunContext
from ferryid.vessel.dimensions import window_seconds
from ferryid.vessel.profile import Profile


@dataclass(frozen=True, eq=False)
class _Log:
    """One log smoothed for testing and for training, with what each leaves to explain, and the rows that test."""

    test: tuple[Motion, Floats]
    training: tuple[Motion, Floats]
    used: Flags


def sweep_structures(
    logs: Sequence[str],
    profile: Profile,
    settings: FitSettings,
    run: RunContext,
    *,
    folds: int = FOLDS,
    odd: OddLogs | None = None,
) -> StructureSweep:
    """Cross-validate every basis, decoupled and coupled.

    Parameters
    ----------
    logs, profile, run, folds, odd
        As in `ferryid.identify.sweeps.settings_sweep.sweep_settings`.
    settings
        How to fit. Of its basis only what stands behind ``+``, and a hull's length, count; of its structure nothing.

    Raises
    ------
    FerryIdError
        For input that cannot be used, with file, cause and remedy. One of several logs is left out instead, with a note.
    """
    check_folds(folds)
    usable, unusable = usable_bases(settings, profile)
    given = usable_logs(logs, profile, replace(settings.on(profile), components="auto"), run, "sweep", odd)
    opened = given.opened
    kind, says, scores = as_a_fit(opened, profile, settings.on(profile), run)
    asked, settings = settings.estimator, replace(settings, estimator=kind)
    motions = [smooth_measured(one.measured, TEST_WINDOW_S) for one in opened]
    bases = {
        name: {
            structure: basis_for(replace(settings, basis=full, structure=structure), motions)
            for structure in STRUCTURES
        }
        for name, full in usable.items()
    }
    run.progress("smoothing")
    made = [_log(profile, settings, one.measured, bases["modulus"]["coupled"]) for one in opened]
    run.progress("finding how long residuals remember")
    block_s = block_length(made, [one["decoupled"] for one in bases.values()])
    if kind == "weak":
        try:
            by = compare_weak(opened, profile, settings.on(profile), usable, run, block_s=block_s, folds=folds)
        except TooShort as error:
            if asked != "auto":
                raise
            kind, settings = "derivative", replace(settings, estimator="derivative")
            says = derivative_instead(error)
    if kind == "derivative":
        by = _compare_derivative(profile, settings, bases, made, run, block_s=block_s, folds=folds)
    told = tuple(log_json(one, int(np.count_nonzero(log.used))) for one, log in zip(opened, made, strict=True))
    return StructureSweep(
        profile.name,
        told,
        block_s,
        by,
        unusable,
        (
            *_notes(by, settings),
            *log_warnings([(log["name"], log["warnings"]) for log in told]),
            *given.notes,
            *given.doubts,
            *left_out_together(given.left_out),
        ),
        settings=settings,
        asked=asked,
        estimator_says=says,
        estimators=scores,
        test_window_s=window_seconds(profile) if kind == "weak" else TEST_WINDOW_S,
    )


def _compare_derivative(
    profile: Profile,
    settings: FitSettings,
    bases: Mapping[str, Mapping[str, Basis]],
    made: Sequence[_Log],
    run: RunContext,
    *,
    block_s: float,
    folds: int,
) -> dict[str, StructureComparison]:
    """Return structures compared by the derivative's estimator, by the way of cutting."""
    reach_s = max(TEST_WINDOW_S, settings.window_s)
    pieces: dict[str, list[LogSums]] = {}
    for name, one in bases.items():
        run.progress(f"cutting {name} into pieces")
        pieces[name] = [
            sum_motions(
                one["coupled"], log.test, [log.training], reach_s, blocks=_blocks(log, block_s, folds), wanted=log.used
            )
            for log in made
        ]
    by = {}
    for key in ("blocks", "logs") if len(made) > 1 else ("blocks",):
        run.progress(f"cross-validating by {key}")
        by[key] = compare_structures(
            profile, settings, bases, pieces, len(made) if key == "logs" else folds, key == "logs"
        )
    return by


def usable_bases(settings: FitSettings, profile: Profile) -> tuple[dict[str, str], dict[str, str]]:
    """Return the bases that can be used on a vessel, by the name that `make_basis` takes, and why the others cannot."""
    own, plus, extensions = settings.basis.partition("+")
    usable, unusable = {}, {}
    for name in basis_names():
        # The hull's length may stand in the settings: cross-flow-5m.
        given = own if own.rpartition("-")[0] == name else name
        try:
            usable[name] = with_hull_length(
                given + plus + extensions, profile.hull.length_m, profile.path or profile.name
            )
        except FerryIdError as error:
            unusable[name] = str(error)
    return usable, unusable


def block_length(logs: Sequence[_Log], bases: Sequence[Basis]) -> float:
    """Return the least length of a block [s]: what residuals need to be independent, or what leaves enough blocks.

    Enough are `REGRESSION.few_blocks`. It is the longest over the bases, each fitted to all rows, and no less than the
    residual's correlation time.
    """
    seconds = sum(np.count_nonzero(log.used) / log.test[0].rate_hz for log in logs)
    rates = [log.test[0].rate_hz for log in logs]
    longest, memory = 0.0, 0.0
    for functions in bases:
        rows = rows_of(
            functions, [log.test[0] for log in logs], [log.test[1] for log in logs], [log.used for log in logs]
        )
        fit = fit_simpls(CrossProducts.of(*rows), len(functions.terms), allowed=functions.mask)
        theta, constant = fit.coefficients[-1], fit.intercepts[-1]
        longest = max(longest, block_seconds(rows, rates, theta, constant)[0])
        for log, rate in zip(logs, rates, strict=True):
            motion, error = log.test
            left = np.full_like(error, np.nan)
            left[log.used] = error[log.used] - functions.of(motion, log.used) @ theta - constant
            memory = max(memory, correlation_time(left, log.used, rate))
    return max(min(longest, seconds / REGRESSION.few_blocks), memory)


def compare_structures(
    profile: Profile,
    settings: FitSettings,
    bases: Mapping[str, Mapping[str, Basis]],
    pieces: Mapping[str, Sequence[LogSums]],
    k: int,
    whole: bool,
) -> StructureComparison:
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
        As in `ferryid.regression.cross_validation.folds.FoldSums`.
    """
    tried: list[StructureErrors] = []
    base, rows = np.zeros((0, 3)), np.zeros(0)
    for name, logs in pieces.items():
        sums = FoldSums(1, k, whole=whole)
        labels = [sums.add(log.training, log.test) for log in logs]
        folds = sums.folds()
        blocks = [
            (fold, cross)
            for log, label in zip(logs, labels, strict=True)
            for fold, cross in _cut_test_rows(log, label)
            if cross.n
        ]
        free = force_free_axes(logs)
        nothing = np.zeros((1, len(bases[name]["coupled"].terms), 3)), np.zeros((1, 3))
        base = np.array([cross.sse(*nothing)[0] for _, cross in blocks])
        rows = np.array([cross.n for _, cross in blocks], dtype=np.float64)
        for structure in STRUCTURES:
            functions = bases[name][structure]
            tried.append(_cross_validate(profile, settings, name, functions, folds, blocks, free, logs[0].log))
    return rank_structures(tried, base, rows, len(folds.test))


def _cross_validate(
    profile: Profile,
    settings: FitSettings,
    name: str,
    functions: Basis,
    folds: Folds,
    blocks: Sequence[tuple[int, CrossProducts]],
    free: Flags,
    where: str,
) -> StructureErrors:
    """Fit one structure without each fold in turn, as the other folds choose, and test it on the fold's blocks."""
    window = (settings.window_s,)
    whole = select_model(profile, settings, functions, window, folds, free, rule=Curves.best, where=where)
    fits, within = [], []
    for fold in range(len(folds.test)):
        rest = Folds((_leave_out(folds.training[0], fold),), _leave_out(folds.test, fold))
        # Two folds leave one, which cannot choose: both then take what they choose together.
        choice = (
            whole
            if len(rest.test) < 2
            else select_model(profile, settings, functions, window, rest, free, rule=Curves.best, where=where)
        )
        allowed = without_inertia(functions.mask, functions.terms, choice.held)
        fits.append(fit_simpls(total(rest.training[0]), choice.components, allowed=allowed, where=where))
        within.append(choice.components)
    errors = [cross.sse(fits[fold].coefficients[-1:], fits[fold].intercepts[-1:])[0] for fold, cross in blocks]
    allowed = without_inertia(functions.mask, functions.terms, whole.held)
    return StructureErrors(name, functions, allowed, whole.components, tuple(within), np.array(errors))


def _log(profile: Profile, settings: FitSettings, measured: Measured, functions: Basis) -> _Log:
    """Smooth a log; of all bases only wind and current, which they share, say which rows are known."""
    test = smooth_measured(measured, TEST_WINDOW_S)
    training = smooth_measured(measured, settings.window_s, settings.smoother)
    error = compute_residual(profile, test, settings.scale)
    target = compute_residual(profile, training, settings.scale, settings.residual)
    return _Log((test, error), (training, target), known_rows(test, functions, error, error))


def _blocks(log: _Log, block_s: float, folds: int) -> int:
    """Return the number of blocks of a log, as many in every fold: so folds are alike, and those of other sweeps."""
    seconds = np.count_nonzero(log.used) / log.test[0].rate_hz
    # Where the log's length is a whole number of blocks, rounding must not cost one.
    return folds * max(1, int(seconds / block_s / folds + 1e-9))


def _cut_test_rows(log: LogSums, labels: Ints) -> list[tuple[int, CrossProducts]]:
    """Return fold and cross-products of the test rows of every block."""
    kept = unpurged_parts(labels)
    cut = []
    for block, fold in enumerate(labels.tolist()):
        one = np.zeros_like(kept)
        one[block] = kept[block]
        cut.append((fold, log.test.summed(one)))
    return cut


def _leave_out(parts: Sequence[CrossProducts], number: int) -> tuple[CrossProducts, ...]:
    return (*parts[:number], *parts[number + 1 :])


def _notes(by: Mapping[str, StructureComparison], settings: FitSettings) -> list[str]:
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
            "Intervals and p by whole logs hold the scatter within these logs, not that between one day and the next: "
            "a difference may be these days' own."
        )
    if blocks.blocks < REGRESSION.few_blocks:
        notes.append(
            f"Only {counted(blocks.blocks, 'independent stretch')} to draw from: the intervals are probably too narrow."
        )
    if settings.components == "auto" and any(one.folds < 3 for one in by.values()):
        notes.append("With two folds the number of components was chosen on both: errors are a little too small.")
    if settings.residual != "measured":
        notes.append(f"Fitted to the {settings.residual} residual, tested against measured force.")
    return notes
